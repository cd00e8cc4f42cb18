//! A conformance kit: starts a solver, plays its coupler and its peer over the real channels, and judges every clause
//! of PROTOCOL.md that can be seen from outside. `tandem conformance` is its command, docs/conformance.md its manual.
//!
//! [`random`] judges the physics of bodies by random cases beside an oracle; the rest of this page is about the other clauses.
//! `bench` is where a clause is judged: sessions with the solver, time, a peer of mass points. [`clause`] holds the
//! clauses as data, `verdict` what becomes of them, [`report`] how that is shown, `flaw` what the kit says wrongly.
//!
//! # How to add a clause
//!
//! 1. Find its number in PROTOCOL.md; if there is none, write the clause there first.
//! 2. In the file of its subject (`clause/dem/order.rs`, ...; `clause/shared/` for both sides) add a row to `CLAUSES`:
//!    `Must "H-1c" "stops before ..." by other_halts, after: &["L-1a"];`. Where the kit shall say something wrong and the
//!    solver fail, no function is needed: `refuses Flaw::states(|header, _| header.step += 1)` in a step, `rejects` before
//!    the first. `after` names clauses without which this one says nothing: keep them few, and design the clause so that
//!    another broken rule does not break it. The first clause of a side is before all others without being named. `needs`
//!    names the capabilities without which it cannot be judged; let them be few, by scenes that are made of what the solver
//!    takes (`Bench::takes`): profiles follow from them ([`profile`]).
//! 3. Write `fn other_halts(bench: &Bench) -> Judgement`: take a `bench::Run` (a coupled run in lockstep) or a bare
//!    `bench::Session`, do what shows the clause in as few steps as do, return `Ok(what was measured)` or an
//!    `verdict::Unmet` by `verdict::require` or `verdict::near`, with the numbers. A refused configuration comes
//!    back as *not applicable* by itself. Put many cases in one run (bodies far apart): a run costs milliseconds, a step
//!    microseconds. State the tolerance with its reason.
//! 4. A clause that needs a process (exit status, signals, files) says `of_processes: true`.
//! 5. Add a solver that breaks it, a mutant, to the table of `tests/mutant`: a clause that nothing can trip is no clause.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod bench;
pub mod clause;
mod flaw;
mod options;
pub mod profile;
mod random;
pub mod report;
mod trace;
mod verdict;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use interface::config::capability::Capabilities;
use interface::hosted::Subject;
use interface::message::control::Party;
use thiserror::Error;

pub use bench::PATIENCE;
pub use flaw::Flaw;
pub use options::{Options, RandomCases};
pub use verdict::Verdict;

use bench::Bench;
use clause::{Clause, Level};
use profile::Profile;
use trace::Trace;
use verdict::Unmet;

/// The kit cannot begin.
#[derive(Debug, Error)]
pub enum ExamineError {
    /// There is no such clause.
    #[error("there is no clause `{id}` for a {party}; `--list` shows those there are")]
    NoSuchClause {
        /// As asked for.
        id: String,
        /// The side.
        party: Party,
    },
    /// The solver cannot be started.
    #[error("{0}")]
    Start(String),
}

/// A clause with its verdict.
pub struct Judged {
    /// The clause.
    pub clause: &'static Clause,
    /// Its verdict.
    pub verdict: Verdict,
    /// Time that it took. Random cases judge several at once; the first of those has the time of all.
    pub wall: Duration,
    /// The messages, if they were asked for.
    pub trace: Trace,
    /// The seed of the random case that breaks it, and that case as small as it could be made.
    pub case: Option<(u64, String)>,
}

impl Judged {
    fn of(clause: &'static Clause, verdict: Verdict) -> Self {
        Self {
            clause,
            verdict,
            wall: Duration::ZERO,
            trace: Trace::default(),
            case: None,
        }
    }

    /// Whether it is broken.
    pub fn failed(&self) -> bool {
        matches!(self.verdict, Verdict::Fail(_))
    }

    /// Whether it was not judged because the solver does not take what it is about.
    pub fn left_out(&self) -> bool {
        matches!(self.verdict, Verdict::NotApplicable { left_out: true, .. })
    }

    /// Why it was not judged.
    pub fn reason(&self) -> Option<&str> {
        match &self.verdict {
            Verdict::NotApplicable { reason, .. } => Some(reason),
            _ => None,
        }
    }
}

/// What the kit found.
pub struct Examination {
    /// The solver's side.
    pub party: Party,
    /// The solver's name for itself, if it sent one.
    pub identity: String,
    /// What it says that it takes.
    pub capabilities: Capabilities,
    /// Every clause that was asked for, in order.
    pub judged: Vec<Judged>,
    /// Whether all clauses were asked for.
    pub whole: bool,
    /// Random cases that were run and that the solver did not refuse.
    pub cases: u64,
    /// Time that it took.
    pub wall: Duration,
}

/// Fewer random cases than this say little: of the mutants the last is found in the 59th.
const FEW: u64 = 100;

impl Examination {
    /// Whether no clause is found broken, but in few random cases.
    pub fn is_hasty(&self) -> bool {
        self.whole && self.cases < FEW && self.broken(false).next().is_none()
    }

    /// Broken clauses that count: those that a solver must keep, with `strict` also those that it should.
    pub fn broken(&self, strict: bool) -> impl Iterator<Item = &Judged> {
        let counts = move |j: &&Judged| strict || j.clause.level == Level::Must;
        self.judged.iter().filter(|j| j.failed()).filter(counts)
    }

    /// The profile that the solver is judged as: the largest that it fits by what it says in Hello.
    pub fn profile(&self) -> Option<&'static Profile> {
        profile::fitting(self.party, &self.capabilities)
    }

    /// Clauses that count and that the solver has got out of, by a refusal or because it does not take what they need: those
    /// of the core of a profile that is required; where none is, of the least one, and what it says in Hello that it takes.
    pub fn missing(&self, required: Option<&Profile>) -> Vec<&Judged> {
        let profile = required.or(profile::profiles(self.party).next());
        let core = profile.into_iter().flat_map(Profile::core);
        let core: Vec<&str> = core.map(|clause| clause.id).collect();
        let named = required.is_none() && !self.capabilities.0.is_empty();
        let promised = |clause: &Clause| named && clause.lacks(&self.capabilities).is_empty();
        let counts = |clause: &Clause| core.contains(&clause.id) || promised(clause);
        let missing = |j: &&Judged| j.left_out() && counts(j.clause);
        self.judged.iter().filter(missing).collect()
    }

    /// What is not judged: what clauses need that the solver does not take, and keys that it refused.
    pub fn not_judged(&self) -> BTreeSet<String> {
        let mut not_judged = BTreeSet::new();
        for judged in self.judged.iter().filter(|judged| judged.left_out()) {
            let lacks = judged.clause.lacks(&self.capabilities);
            if lacks.is_empty() {
                let reason = judged.reason().unwrap_or_default();
                not_judged.insert(reason.split(": ").next().unwrap_or_default().to_string());
            }
            not_judged.extend(lacks);
        }
        not_judged
    }
}

/// Tests a solver; calls `show` with each verdict, in the order of the clauses.
///
/// # Errors
/// [`ExamineError`] when nothing can be judged.
pub fn examine(
    subject: &Subject,
    options: &Options,
    mut show: impl FnMut(&Judged),
) -> Result<Examination, ExamineError> {
    let start = Instant::now();
    let all = clause::of(subject.party);
    let known = |id: &&String| !all.iter().any(|clause| clause.id == **id);
    if let Some(id) = options.only.iter().find(known) {
        return Err(ExamineError::NoSuchClause {
            id: id.clone(),
            party: subject.party,
        });
    }
    let greeting = greeting(subject, options)?;
    let first = all.first().map(|clause| clause.id);
    let asked =
        |clause: &&Clause| options.only.is_empty() || options.only.iter().any(|id| id == clause.id);
    let clauses: Vec<&Clause> = all.into_iter().filter(asked).collect();
    let (rows, random): (Vec<_>, Vec<_>) = clauses.into_iter().partition(|c| c.judge.is_some());
    let mut judged = judge_all(subject, options, &greeting, first, &rows, &mut show);
    let takes = &greeting.capabilities;
    let (at_random, cases) = judge_at_random(subject, options, takes, &random, &judged);
    at_random.iter().for_each(&mut show);
    judged.extend(at_random);
    Ok(Examination {
        party: subject.party,
        identity: greeting.identity,
        capabilities: greeting.capabilities,
        judged,
        whole: options.only.is_empty(),
        cases,
        wall: start.elapsed(),
    })
}

/// Runs the random cases of these seeds, however long they take; returns the clauses that do not pass, with their
/// verdicts. A clause passes if numbers were compared. For the tests of a solver.
///
/// # Errors
/// [`ExamineError`] when nothing can be judged.
pub fn random_cases(
    subject: &Subject,
    seeds: Range<u64>,
) -> Result<Vec<(&'static str, Verdict)>, ExamineError> {
    let random = clause::of(subject.party).into_iter();
    let random = random.filter(|clause| clause.is_random());
    let options = Options {
        only: random.map(|clause| clause.id.into()).collect(),
        random: RandomCases {
            seed: seeds.start,
            cases: seeds.end - seeds.start,
            time: Duration::MAX,
            ..RandomCases::default()
        },
        ..Options::default()
    };
    let judged = examine(subject, &options, |_| ())?.judged.into_iter();
    let verdicts = judged.map(|judged| (judged.clause.id, judged.verdict));
    let passes = |verdict: &Verdict| matches!(verdict, Verdict::Pass { .. });
    Ok(verdicts.filter(|(_, verdict)| !passes(verdict)).collect())
}

/// Tests clauses of a table whose first one is `first`, several at the same time; calls `show` with the verdicts in order.
///
/// A clause is blocked where one that it is after is broken, however many are judged at once. Those that measure time come
/// last, one by one.
fn judge_all(
    subject: &Subject,
    options: &Options,
    greeting: &Greeting,
    first: Option<&'static str>,
    clauses: &[&'static Clause],
    mut show: impl FnMut(&Judged),
) -> Vec<Judged> {
    let impatient = AtomicBool::new(!greeting.came);
    // What rests on a clause is blocked by itself or by what blocks it.
    let broken = Mutex::new(BTreeMap::new());
    let blocked = |clause: &Clause| {
        let mut needs = first
            .iter()
            .chain(clause.after)
            .filter(|id| **id != clause.id);
        let broken = broken.lock().expect("no panic holds it");
        needs.find_map(|id| broken.get(id).copied())
    };
    let breaks = |clause: &Clause, by: &'static str| {
        let mut broken = broken.lock().expect("no panic holds it");
        broken.insert(clause.id, by);
    };
    let judge = |clause: &'static Clause| {
        if let Some(by) = blocked(clause) {
            return Judged::of(clause, Verdict::Blocked { by });
        }
        let mut options = options.clone();
        if impatient.load(Ordering::Relaxed) {
            options.startup = options.startup.min(bench::PATIENCE);
        }
        let (judged, awaited) = judge(subject, &options, &greeting.capabilities, clause);
        impatient.fetch_or(awaited, Ordering::Relaxed);
        if judged.failed() {
            breaks(clause, clause.id);
        }
        judged
    };
    let mut done: Vec<Judged> = Vec::new();
    let mut waiting = BTreeMap::new();
    let mut take = |place: usize, judged: Judged| {
        waiting.insert(place, judged);
        while let Some(mut judged) = waiting.remove(&done.len()) {
            let clause = judged.clause;
            if let Some(by) = blocked(clause) {
                breaks(clause, by);
                judged = Judged::of(clause, Verdict::Blocked { by });
            }
            show(&judged);
            done.push(judged);
        }
    };
    let (first_of_all, rest): (Vec<_>, Vec<_>) =
        (0..).zip(clauses).partition(|(_, c)| first == Some(c.id));
    let (alone, several): (Vec<_>, Vec<_>) = rest.into_iter().partition(|(_, c)| c.alone);
    let jobs = options.jobs;
    for (jobs, clauses) in [(1, first_of_all), (jobs, several), (1, alone)] {
        let next = AtomicUsize::new(0);
        let (sender, receiver) = std::sync::mpsc::channel();
        std::thread::scope(|scope| {
            for _ in 0..jobs {
                let (sender, next, clauses, judge) = (sender.clone(), &next, &clauses, &judge);
                scope.spawn(move || {
                    while let Some((place, clause)) =
                        clauses.get(next.fetch_add(1, Ordering::Relaxed))
                    {
                        // The receiver lives until all results are sent.
                        let _ = sender.send((*place, judge(clause)));
                    }
                });
            }
            drop(sender);
            for (place, judged) in receiver {
                take(place, judged);
            }
        });
    }
    done
}

/// Without these a session with the solver says nothing of its physics.
const ROOTS: [&str; 5] = ["S-2a", "S-6a", "S-7a", "G-9a", "G-9b"];

/// Judges the clauses that random cases judge, all at once; returns also how many cases there were.
fn judge_at_random(
    subject: &Subject,
    options: &Options,
    takes: &Capabilities,
    clauses: &[&'static Clause],
    judged: &[Judged],
) -> (Vec<Judged>, u64) {
    if clauses.is_empty() {
        return (Vec::new(), 0);
    }
    let start = Instant::now();
    let root = judged
        .iter()
        .find(|j| j.failed() && ROOTS.contains(&j.clause.id));
    let mut campaign = random::Campaign::default();
    if root.is_none() {
        campaign = random::campaign(subject, options, takes, clauses);
    }
    let case = |failure: &random::Failure| (failure.seed, failure.case.clone());
    let mut wall = start.elapsed();
    let judged = clauses.iter().map(|&clause| {
        let verdict = match root {
            Some(root) => Verdict::Blocked { by: root.clause.id },
            None => campaign.verdict(clause, takes),
        };
        Judged {
            wall: std::mem::take(&mut wall),
            case: campaign.failure(clause).map(case),
            ..Judged::of(clause, verdict)
        }
    });
    (judged.collect(), campaign.judged())
}

/// Judges a clause; returns also whether the solver was awaited in vain at its start.
fn judge(
    subject: &Subject,
    options: &Options,
    hello: &Capabilities,
    clause: &'static Clause,
) -> (Judged, bool) {
    let start = Instant::now();
    let bench = Bench::new(subject.clone(), options, hello);
    let lacks = clause.lacks(hello);
    let judgement = match clause.judge {
        _ if clause.of_processes && !subject.is_process() => Err(Unmet::OutOfSight),
        _ if !lacks.is_empty() => Err(Unmet::Lacking(lacks)),
        judge => judge.map_or(Ok(String::new()), |judge| judge(&bench)),
    };
    let verdict = match judgement {
        Ok(measured) => Verdict::Pass { measured },
        Err(unmet) => unmet.into(),
    };
    let awaited = bench.was_kept_waiting();
    let judged = Judged {
        wall: start.elapsed(),
        trace: bench.into_trace(),
        ..Judged::of(clause, verdict)
    };
    (judged, awaited)
}

/// What a solver says first.
struct Greeting {
    /// What it is called, empty when it does not say.
    identity: String,
    capabilities: Capabilities,
    /// Whether it spoke or ended in time.
    came: bool,
}

/// Starts the solver once, to learn whether it can be started and what it says first.
fn greeting(subject: &Subject, options: &Options) -> Result<Greeting, ExamineError> {
    let bench = Bench::new(subject.clone(), options, &Capabilities::default());
    let session = bench.session();
    let mut session = session.map_err(|why| ExamineError::Start(why.to_string()))?;
    let hello = session.hello().ok();
    let (identity, capabilities) = hello
        .map(|h| (h.identity, h.capabilities))
        .unwrap_or_default();
    Ok(Greeting {
        identity,
        capabilities,
        came: !bench.was_kept_waiting(),
    })
}
