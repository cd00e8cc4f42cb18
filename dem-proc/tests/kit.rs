//! The kit's random cases: forces, stiffness, travel, motion, limits, ledger, frames and saved states beside its oracle.

use conformance::random_cases;
use dem_proc::Sdem;
use interface::hosted::{Host, Subject};

#[test]
fn random_cases_agree_with_the_oracle_of_the_kit() {
    let subject = Subject::in_thread(|| Host::Dem(Box::new(Sdem::default())));
    let broken = random_cases(&subject, 120).unwrap();
    assert!(broken.is_empty(), "{broken:#?}");
}
