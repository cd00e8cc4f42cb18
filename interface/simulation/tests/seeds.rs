//! A fixed set of scenarios, and those by which defects were found.

use interface::message::control::Party;
use simulation::fault::{Corruption, Fault, FaultKind};
use simulation::scenario::{Outcome, Scenario};
use simulation::session::Plan;
use simulation::toys::TOYS;

#[track_caller]
fn holds(scenario: &Scenario) -> Outcome {
    match scenario.judge() {
        Ok((outcome, _)) => outcome,
        Err(what) => panic!("{what}\n{scenario:#?}"),
    }
}

#[test]
fn ten_thousand_scenarios_hold_and_meet_every_kind_of_fault_and_outcome() {
    let mut kinds = std::collections::BTreeSet::new();
    let mut outcomes = [0; 3];
    for seed in 0..10_000 {
        let scenario = Scenario::new(seed);
        let (outcome, played) = scenario
            .judge()
            .unwrap_or_else(|what| panic!("seed {seed}: {what}\n{scenario:#?}"));
        kinds.extend(played.struck.iter().map(|(fault, _)| fault.kind.name()));
        outcomes[outcome as usize] += 1;
    }
    assert_eq!(kinds.len(), 3 + Corruption::ALL.len(), "{kinds:?}");
    assert!(outcomes.iter().all(|&count| count > 100), "{outcomes:?}");
}

/// A scenario has the same course whenever it is played.
#[test]
fn a_seed_is_a_course() {
    for seed in 0..200 {
        let scenario = Scenario::new(seed);
        let course = |scenario: &Scenario| {
            let (outcome, played) = scenario.judge().expect("a scenario that holds");
            (outcome, played.events, format!("{:?}", played.verdicts))
        };
        assert_eq!(course(&scenario), course(&scenario), "seed {seed}");
    }
}

#[test]
fn seeds_that_found_something_hold() {
    for seed in [
        36, 39, 41, 59, 69, 103, 125, 345, 419, 488, 757, 2397, 3691, 19927, 21051, 23425, 628_604,
    ] {
        holds(&Scenario::new(seed));
    }
}

fn quiet(steps: u64, faults: Vec<Fault>) -> Scenario {
    Scenario {
        seed: 1,
        plan: Plan {
            solvers: TOYS,
            points: 2,
            steps,
            window: 2,
            checkpoint: None,
            outputs: 3,
            stiffens_at: 1000,
            damps_at: 1000,
        },
        delay: 0,
        lost_wakes: 0.0,
        faults,
    }
}

/// At whatever event any party dies, it is named, or the run is whole.
#[test]
fn a_death_at_any_event_is_named() {
    for party in Party::ALL {
        let mut named = 0;
        for at in 1..120 {
            let kind = FaultKind::Die;
            let scenario = quiet(6, vec![Fault { party, at, kind }]);
            named += usize::from(holds(&scenario) != Outcome::Whole);
        }
        assert!(named > 40, "{party}: {named}");
    }
}

/// A message that is sent twice is refused where it would be taken for another one.
#[test]
fn a_message_sent_twice_at_any_event_changes_no_bit() {
    for party in Party::ALL {
        for at in 1..120 {
            let kind = FaultKind::Corrupt(Corruption::Twice);
            holds(&quiet(6, vec![Fault { party, at, kind }]));
        }
    }
}
