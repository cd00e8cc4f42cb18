//! A fixed set of scenarios, and those by which defects were found.

use std::collections::BTreeMap;

use interface::message::control::Party;

use crate::fault::{Corruption, Fault, FaultKind};
use crate::scenario::{Outcome, Scenario, shrink};
use crate::session::Plan;
use crate::toys::TOYS;

#[track_caller]
fn holds(scenario: &Scenario) -> Outcome {
    match scenario.judge() {
        Ok((outcome, _)) => outcome,
        Err(what) => panic!("{what}\n{scenario:#?}"),
    }
}

/// A campaign: `SIMULATE_SEEDS` scenarios from seed `SIMULATE_FROM` on, counted by faults and outcomes. The first that breaks
/// something is made smaller.
#[test]
fn scenarios_of_seeds_hold_and_meet_every_kind_of_fault_and_outcome() {
    let asked = |name: &str| {
        let number = std::env::var(name).ok()?;
        Some(number.parse::<u64>().expect("a number of scenarios"))
    };
    let (from, asked) = (asked("SIMULATE_FROM").unwrap_or(0), asked("SIMULATE_SEEDS"));
    let mut kinds: BTreeMap<String, u64> = BTreeMap::new();
    let (mut outcomes, mut events) = ([0_u64; 3], 0);
    for seed in from..from + asked.unwrap_or(10_000) {
        let scenario = Scenario::new(seed);
        match scenario.judge() {
            Ok((outcome, played)) => {
                for (fault, _) in &played.struck {
                    *kinds.entry(fault.kind.name()).or_default() += 1;
                }
                outcomes[outcome as usize] += 1;
                events += played.events;
            }
            Err(what) => {
                let (small, why) = shrink(scenario, what.clone());
                panic!("seed {seed}: {what}\nsmallest: {why}\n{small:#?}");
            }
        }
    }
    println!("{events} events; whole, blamed, resumed: {outcomes:?}; {kinds:#?}");
    if asked.is_none() {
        assert_eq!(kinds.len(), 3 + Corruption::ALL.len(), "{kinds:?}");
        assert!(outcomes.iter().all(|&count| count > 100), "{outcomes:?}");
    }
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
