//! The kit's random cases: forces, stiffness, travel, motion, limits, ledger, frames and saved states beside its oracle.

use std::time::Duration;

use conformance::{Options, RandomCases, Subject, Verdict, clause, examine};
use dem_proc::Sdem;
use interface::message::control::Party;
use interface::session::serve_dem;

#[test]
fn random_cases_agree_with_the_oracle_of_the_kit() {
    let subject = Subject::in_thread(Party::Dem, |domain| {
        serve_dem(domain, &mut Sdem::default(), false)
    });
    let random = clause::of(Party::Dem).into_iter();
    let random = random.filter(|clause| clause.is_random());
    let options = Options {
        only: random.map(|clause| clause.id.into()).collect(),
        random: RandomCases {
            cases: 120,
            time: Duration::MAX,
            ..RandomCases::default()
        },
        ..Options::default()
    };
    // A clause passes if numbers were compared.
    for judged in examine(&subject, &options, |_| ()).unwrap().judged {
        let (id, verdict) = (judged.clause.id, judged.verdict);
        assert!(
            matches!(verdict, Verdict::Pass { .. }),
            "{id}: {verdict:#?}"
        );
    }
}
