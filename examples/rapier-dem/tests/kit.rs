//! The kit's random cases of what the solver lists: it takes them, and answers as the oracle does.

use conformance::{Verdict, random_cases};
use interface::hosted::{Host, Subject};
use rapier_dem::Rapier;

#[test]
fn random_cases_agree_with_the_oracle_of_the_kit() {
    let subject = Subject::in_thread(|| Host::Dem(Box::new(Rapier::default())));
    let mut broken = random_cases(&subject, 0..60).unwrap();
    // What it does not list, it need not have.
    broken.retain(|(_, verdict)| matches!(verdict, Verdict::Fail(_)));
    assert!(broken.is_empty(), "{broken:#?}");
}
