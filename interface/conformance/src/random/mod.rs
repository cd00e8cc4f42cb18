//! Physics by random cases: configurations within what a solver takes, motions of the other side that reach every regime,
//! and every answer beside an oracle that is written from PROTOCOL.md and docs/physics.md. A case that differs is made as
//! small as it can be and is shown in a few lines.

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

use crate::bench::Bench;
use crate::clause::Clause;
use crate::options::Options;
use crate::verdict::{Evidence, Unmet, Verdict};
use interface::hosted::Subject;
use judge::{Compared, Difference, Judge};
use run::{Case, Stop, run, run_in_all_ways};

/// A difference of this many times what is allowed is no rounding.
const CLEAR: f64 = 100.0;

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
    /// What it asks for, what the solver answered, and the case.
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
    /// The failures, in the order in which they were found: of each clause the one of the least seed.
    failures: Vec<Failure>,
    /// What is not judged any more, and because of what.
    blocked: BTreeMap<&'static str, &'static str>,
}

impl Campaign {
    /// Cases that the solver did not refuse.
    pub fn judged(&self) -> u64 {
        self.cases - self.refused.0
    }

    /// The failure of a clause.
    pub fn failure(&self, clause: &Clause) -> Option<&Failure> {
        let mut failures = self.failures.iter();
        failures.find(|failure| failure.clause == clause.id)
    }

    /// The verdict on a clause.
    pub fn verdict(&self, clause: &Clause, takes: &Capabilities) -> Verdict {
        if let Some(failure) = self.failure(clause) {
            return Verdict::Fail(failure.evidence.clone());
        }
        if let Some(by) = self.blocked.get(clause.id) {
            return Verdict::Blocked { by };
        }
        let compared = self.compared.get(clause.id).copied();
        let Compared { count, largest } = compared.unwrap_or_default();
        let lacks = clause.lacks(takes);
        match &self.refused.1 {
            _ if !lacks.is_empty() => Unmet::Lacking(lacks).into(),
            Some(refusal) if count == 0 => refusal.clone().into(),
            None if count == 0 => Unmet::Lacking(vec!["what shows it".into()]).into(),
            _ => Verdict::Pass {
                measured: format!(
                    "{count} numbers in {} random cases, within {largest:.0e} of the tolerance",
                    self.judged()
                ),
            },
        }
    }
}

/// Runs random cases that judge these clauses.
pub fn campaign(
    subject: &Subject,
    options: &Options,
    takes: &Capabilities,
    clauses: &[&'static Clause],
) -> Campaign {
    let search = Search {
        subject,
        options,
        takes: takes.clone(),
        open: clauses.to_vec(),
        seed: options.random.seed,
        time: options.random.time,
        narrowed: None,
        campaign: Campaign::default(),
    };
    match subject.party {
        Party::Mpm => search.all::<continuum::Case>(),
        _ => search.all::<bodies::Case>(),
    }
}

/// Where the search for broken clauses is.
struct Search<'a> {
    subject: &'a Subject,
    options: &'a Options,
    takes: Capabilities,
    /// The clauses that are still judged.
    open: Vec<&'static Clause>,
    /// Of the next case.
    seed: u64,
    /// That is left.
    time: Duration,
    /// The clause that is broken in cases of more than what is taken now, and the seed that has shown it.
    narrowed: Option<(&'static str, u64)>,
    campaign: Campaign,
}

/// A case that fails, with its seed.
type Failing<C> = Option<(u64, C, Difference)>;

impl Search<'_> {
    /// Where a clause is broken, those that do not rest on it are judged on, from the case on that has shown it.
    fn all<C: Case>(mut self) -> Campaign {
        while self.campaign.failures.len() < self.options.random.failures {
            let Some((seed, case, difference)) = self.first::<C>() else {
                break;
            };
            self.seed = seed;
            let (case, difference) = self.smallest(case, difference);
            let broken = difference.clause;
            let clause = self.open.iter().find(|clause| clause.id == broken);
            let often = clause.map_or("", |clause| clause.often);
            let mut again = format!("again: --only {broken} --seed {seed} --cases 1");
            if let Some((cause, first)) = self.narrowed {
                let cases = seed - first + 1;
                again = format!("again: --only {cause},{broken} --seed {first} --cases {cases}");
            }
            let mut unsaved = self.takes.clone();
            unsaved.0.retain(|name| name != "save");
            let narrower = match broken {
                "K-4a" => Some(unsaved),
                _ => C::narrower(broken, &self.takes),
            };
            self.narrowed = self.narrowed.or(narrower.as_ref().map(|_| (broken, seed)));
            self.leave_out(broken, narrower);
            if self.campaign.failures.iter().any(|f| f.clause == broken) {
                continue;
            }
            let mut story = shrink::story(&case);
            story.extend((!often.is_empty()).then(|| format!("often: {often}")));
            story.push(again);
            self.campaign.failures.push(Failure {
                seed,
                case: serde_json::to_string_pretty(&case).expect("a case has string keys only"),
                clause: broken,
                evidence: Evidence {
                    step: Some(difference.step.into()),
                    expected: difference.expected,
                    got: difference.got,
                    story,
                },
            });
        }
        self.campaign
    }

    /// What rests on a broken clause is blocked; where cases of less hardly show its breach, what needs more.
    fn leave_out(&mut self, broken: &'static str, narrower: Option<Capabilities>) {
        let mut out = Vec::new();
        match narrower {
            Some(fewer) => {
                let lost =
                    |c: &&Clause| !c.lacks(&fewer).is_empty() && c.lacks(&self.takes).is_empty();
                out.extend(
                    self.open
                        .iter()
                        .copied()
                        .filter(lost)
                        .map(|clause| clause.id),
                );
                self.takes = fewer;
            }
            None => out.push(broken),
        }
        self.open.retain(|clause| {
            if !out.contains(&clause.id) && clause.after.iter().any(|id| out.contains(id)) {
                out.push(clause.id);
            }
            !out.contains(&clause.id)
        });
        let blocked = out.into_iter().filter(|id| *id != broken);
        self.campaign.blocked.extend(blocked.map(|id| (id, broken)));
    }

    fn selected(&self) -> Vec<&'static str> {
        self.open.iter().map(|clause| clause.id).collect()
    }

    fn bench(&self) -> Bench {
        Bench::new(self.subject.clone(), self.options, &self.takes)
    }

    /// Runs cases until one breaks a clause that is judged: that of the least seed.
    fn first<C: Case>(&mut self) -> Failing<C> {
        let (start, plan, selected) = (Instant::now(), self.options.random, self.selected());
        // Cases from `end` on are not run.
        let end = AtomicU64::new(plan.seed.saturating_add(plan.cases));
        let next = AtomicU64::new(self.seed);
        let found = Mutex::new((std::mem::take(&mut self.campaign), Failing::<C>::None));
        let worker = || {
            loop {
                let seed = next.fetch_add(1, Ordering::Relaxed);
                if seed >= end.load(Ordering::Relaxed) || start.elapsed() >= self.time {
                    return;
                }
                let case = C::of_seed(seed, &self.takes);
                if !case.is_possible() {
                    continue;
                }
                let mut judge = Judge::new(&selected);
                let in_all_ways = (seed - plan.seed).is_multiple_of(IN_ALL_WAYS);
                let run = if in_all_ways { run_in_all_ways } else { run };
                let outcome = run(&self.bench(), &case, &mut judge);
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
                        end.fetch_min(seed, Ordering::Relaxed);
                        if failing.as_ref().is_none_or(|(least, ..)| seed < *least) {
                            *failing = Some((seed, case, *difference));
                        }
                    }
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..self.options.jobs {
                scope.spawn(worker);
            }
        });
        let (campaign, failing) = found.into_inner().expect("no panic holds it");
        self.campaign = campaign;
        self.time = self.time.saturating_sub(start.elapsed());
        failing
    }

    /// Leaves out of a failing case what can be left out, while it breaks the same clause.
    fn smallest<C: Case>(&self, mut case: C, mut difference: Difference) -> (C, Difference) {
        let (start, time, selected) = (Instant::now(), self.options.random.shrink, self.selected());
        let fails = |case: &C, selected: &[&'static str]| {
            let steps = plan::steps(case.clone().epochs());
            if steps == 0 || !case.is_possible() {
                return None;
            }
            match run_in_all_ways(&self.bench(), case, &mut Judge::new(selected)) {
                Err(Stop::Differs(other)) => Some(*other),
                _ => None,
            }
        };
        let mut fresh = case.clone();
        for epoch in fresh.epochs() {
            epoch.resumed = false;
        }
        if selected.contains(&"K-4a") && fresh != case {
            match fails(&fresh, &selected) {
                None => {
                    difference.clause = "K-4a";
                    return (case, difference);
                }
                Some(saved) if saved.clause == "K-4a" => (case, difference) = (fresh, saved),
                Some(_) => {}
            }
        }
        // Measured in every step, the first difference is nearest to its cause: wrong motions and forces make everything else
        // wrong, and not the other way round.
        let measured = |case: &C| case.with(plan::measured(case.clone().epochs()));
        let causes = C::CAUSES.iter().copied();
        let (all, mut selected) = (selected.clone(), selected);
        let causes: Vec<&str> = causes.filter(|id| selected.contains(id)).collect();
        for (nearer, causes) in [
            (measured(&shrink::unpushed(&case)), &causes),
            (measured(&case), &causes),
            (case.clone(), &causes),
            (measured(&case), &all),
        ] {
            let cause = (!causes.is_empty()).then(|| fails(&nearer, causes));
            if let Some(cause) = cause.flatten() {
                (case, difference, selected) = (nearer, cause, causes.clone());
                break;
            }
        }
        // What is left shows the same fault, not rounding beside it.
        let least = difference.share.min(CLEAR);
        // In a circle, from where the last one was found.
        let smaller = |case: &C, difference: &Difference, from: usize| {
            let whole = serde_json::to_value(case).expect("a case has string keys only");
            let smaller = shrink::smaller(case, &whole, difference.step);
            let tries = (0..smaller.len()).map(|k| (from + k) % smaller.len());
            let mut in_time = tries.take_while(|_| start.elapsed() < time);
            in_time.find_map(|k| {
                let other = smaller[k]().filter(|other| other != case)?;
                let differs = fails(&other, &selected)?;
                let is_like = differs.clause == difference.clause && differs.share >= least;
                is_like.then_some((k, other, differs))
            })
        };
        let mut next = 0;
        while let Some(found) = smaller(&case, &difference, next) {
            (next, case, difference) = found;
        }
        (case, difference)
    }
}
