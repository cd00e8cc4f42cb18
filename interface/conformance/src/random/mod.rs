//! Physics by random cases: configurations within what a solver takes, motions of the other side that reach every regime,
//! and every answer beside an oracle that is written from PROTOCOL.md and docs/physics.md. A case that differs is made as
//! small as it can be and told in a sentence.

mod bodies;
mod continuum;
mod dice;
mod judge;
mod plan;
mod run;
mod shrink;

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use interface::config::capability::Capabilities;
use interface::message::control::Party;

use crate::bench::{Bench, Subject};
use crate::clause::Clause;
use crate::options::Options;
use crate::verdict::{Evidence, Unmet, Verdict};
use judge::{Compared, Difference, Judge};
use run::{Case, Stop, run, run_in_all_ways};

/// One in so many cases is run in all ways that shall give the same bits.
const IN_ALL_WAYS: u64 = 4;
/// So many cases are refused before a solver is taken for one that refuses all.
const REFUSED: u64 = 20;

/// A case in which a solver differs from the oracle, as small as it could be made.
#[derive(Debug)]
pub struct Failure {
    /// Its seed.
    pub seed: u64,
    /// The small case, as a file.
    pub case: String,
    /// The clause that is broken.
    pub clause: &'static str,
    /// What it asks for, what the solver said, and the case.
    pub evidence: Evidence,
}

/// What random cases have shown.
#[derive(Debug, Default)]
pub struct Campaign {
    /// Cases that were run.
    cases: u64,
    /// Those that the solver refused, with the last refusal.
    refused: (u64, Option<Unmet>),
    /// What was compared, by clause.
    compared: BTreeMap<&'static str, Compared>,
    /// The failure of the least seed.
    pub failure: Option<Failure>,
}

impl Campaign {
    /// How many numbers were compared.
    pub fn numbers(&self) -> u64 {
        self.compared.values().map(|compared| compared.count).sum()
    }

    /// What is said of a clause where nothing failed.
    pub fn verdict(&self, clause: &Clause, takes: &Capabilities) -> Verdict {
        let compared = self.compared.get(clause.id).copied();
        let Compared { count, largest } = compared.unwrap_or_default();
        let lacks = clause.lacks(takes);
        let (cases, (refused, refusal)) = (self.cases, &self.refused);
        match refusal {
            _ if !lacks.is_empty() => Unmet::Lacking(lacks).into(),
            Some(refusal) if count == 0 => refusal.clone().into(),
            None if count == 0 => Unmet::Lacking(vec!["what shows it".into()]).into(),
            _ => Verdict::Pass {
                measured: format!(
                    "{count} numbers in {} random cases, within {largest:.0e} of the tolerance",
                    cases - refused
                ),
            },
        }
    }
}

/// Runs random cases until one breaks one of the clauses that are asked for.
pub fn campaign(
    subject: &Subject,
    options: &Options,
    takes: &Capabilities,
    asked: &[&str],
) -> Campaign {
    match subject.party {
        Party::Mpm => campaign_of::<continuum::Case>(subject, options, takes, asked),
        _ => campaign_of::<bodies::Case>(subject, options, takes, asked),
    }
}

fn campaign_of<C: Case>(
    subject: &Subject,
    options: &Options,
    takes: &Capabilities,
    asked: &[&str],
) -> Campaign {
    let (start, plan) = (Instant::now(), options.random);
    // Cases from this one on are not run.
    let (next, end) = (AtomicU64::new(0), AtomicU64::new(plan.cases));
    let found = Mutex::new((Campaign::default(), None::<(u64, C, Difference)>));
    let bench = || Bench::new(subject.clone(), options, takes);
    let worker = || {
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= end.load(Ordering::Relaxed) || start.elapsed() >= plan.time {
                return;
            }
            let seed = plan.seed + k;
            let Some(case) = of_seed::<C>(seed, takes) else {
                continue;
            };
            let mut judge = Judge::new(asked);
            let in_all_ways = k % IN_ALL_WAYS == 0;
            let run = if in_all_ways { run_in_all_ways } else { run };
            let outcome = run(&bench(), &case, &mut judge);
            let (campaign, failing) = &mut *found.lock().expect("no panic holds it");
            campaign.cases += 1;
            for (clause, one) in judge.compared {
                let sum = campaign.compared.entry(clause).or_default();
                sum.count += one.count;
                sum.largest = sum.largest.max(one.largest);
            }
            match outcome {
                Ok(()) | Err(Stop::Doubtful) => {}
                Err(Stop::Unmet(refusal)) => {
                    campaign.refused = (campaign.refused.0 + 1, Some(refusal));
                    if campaign.refused.0 > REFUSED && campaign.refused.0 == campaign.cases {
                        // It takes nothing.
                        end.store(0, Ordering::Relaxed);
                    }
                }
                Err(Stop::Differs(difference)) => {
                    end.fetch_min(k, Ordering::Relaxed);
                    if failing.as_ref().is_none_or(|(least, ..)| seed < *least) {
                        *failing = Some((seed, case, *difference));
                    }
                }
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.max(1) {
            scope.spawn(worker);
        }
    });
    let (mut campaign, failing) = found.into_inner().expect("no panic holds it");
    campaign.failure = failing.map(|(seed, case, difference)| {
        let (case, difference) = smallest(bench, asked, plan.shrink, case, difference);
        let clause = difference.clause;
        let mut story = shrink::story(&case);
        story.push(format!("again: --only {clause} --seed {seed} --cases 1"));
        Failure {
            seed,
            case: serde_json::to_string_pretty(&case).expect("a case has string keys only"),
            clause,
            evidence: Evidence {
                step: Some(difference.step.into()),
                expected: difference.expected,
                got: difference.got,
                story,
            },
        }
    });
    campaign
}

/// The case of a seed, as far as it can be run.
fn of_seed<C: Case>(seed: u64, takes: &Capabilities) -> Option<C> {
    let mut case = C::of_seed(seed, takes);
    let steps = case.possible();
    let epochs = case.epochs();
    [*epochs, _] = plan::parts(epochs, steps);
    (steps > 0).then_some(case)
}

/// Leaves out of a failing case what can be left out, while it breaks the same clause.
fn smallest<C: Case>(
    bench: impl Fn() -> Bench,
    asked: &[&str],
    time: Duration,
    mut case: C,
    mut difference: Difference,
) -> (C, Difference) {
    let start = Instant::now();
    let fails = |case: &C, asked: &[&str]| {
        let steps = plan::steps(case.clone().epochs());
        if case.possible() < steps || steps == 0 {
            return None;
        }
        match run_in_all_ways(&bench(), case, &mut Judge::new(asked)) {
            Err(Stop::Differs(other)) => Some(*other),
            _ => None,
        }
    };
    let mut fresh = case.clone();
    for epoch in fresh.epochs() {
        epoch.resumed = false;
    }
    if asked.contains(&"K-4a") && fresh != case && fails(&fresh, asked).is_none() {
        difference.clause = "K-4a";
        return (case, difference);
    }
    // Measured in every step, the first difference is nearest to its cause: wrong motions and forces make everything else
    // wrong, and not the other way round.
    let measured = |case: &C| case.with(plan::measured(case.clone().epochs()));
    let causes = C::CAUSES.iter().copied();
    let (all, mut asked) = (asked.to_vec(), asked.to_vec());
    let causes: Vec<&str> = causes.filter(|id| asked.contains(id)).collect();
    for (nearer, causes) in [
        (measured(&shrink::unpushed(&case)), &causes),
        (measured(&case), &causes),
        (case.clone(), &causes),
        (measured(&case), &all),
    ] {
        if let Some(cause) = fails(&nearer, causes) {
            (case, difference, asked) = (nearer, cause, causes.clone());
            break;
        }
    }
    let mut smaller = shrink::smaller(&case, difference.step);
    let (mut next, mut tried) = (0, 0);
    while start.elapsed() < time && tried < smaller.len() {
        let other = &smaller[next % smaller.len()];
        match fails(other, &asked) {
            Some(differs) if differs.clause == difference.clause => {
                (case, difference, tried) = (other.clone(), differs, 0);
                smaller = shrink::smaller(&case, difference.step);
            }
            _ => (next, tried) = (next + 1, tried + 1),
        }
    }
    (case, difference)
}
