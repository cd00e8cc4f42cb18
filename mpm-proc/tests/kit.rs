//! The kit's random cases: sets, states, motion under forces, limits, ledger, frames and saved states beside its oracle.

use conformance::random_cases;
use interface::hosted::{Host, Subject};
use mpm_proc::Mpm;

#[test]
fn random_cases_agree_with_the_oracle_of_the_kit() {
    let subject = Subject::in_thread(|| Host::Mpm(Box::new(Mpm::default())));
    let broken = random_cases(&subject, 0..240).unwrap();
    assert!(broken.is_empty(), "{broken:#?}");
}
