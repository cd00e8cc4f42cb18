//! The kit's mutants: solvers that break one clause each. The kit must find that clause broken and no other, and every
//! clause must be broken by some mutant: a clause that no mutant can trip is no clause.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::harness::at_once;
use conformance::clause::{self, Clause};
use conformance::profile::{Profile, profiles};

use conformance::{Examination, Flaw, Options, RandomCases, examine};
use conformance::{PATIENCE, Verdict};
use interface::hosted::{Ends, Host, Start, Subject};
use interface::message::Message;
use interface::message::control::Party;
use mutant::{Flawed, Mutant, ProcessFlaws, Wrong, built_in, change};

/// The words of a mutant's command line, if a process of this program is to be one.
const MUTANT: &str = "TANDEM_MUTANT";

/// Words of a command that starts a mutant as a process: this program of tests; a variable says which mutant it is.
pub fn command(name: &str) -> Vec<String> {
    let tests = std::env::current_exe().expect("a program");
    let test = "mutants::a_process_that_is_told_to_is_a_mutant";
    let script = format!(
        "{MUTANT}=\"$*\" exec '{}' --exact {test} --nocapture >/dev/null",
        tests.display()
    );
    let words = ["sh", "-c", &script, "sh", name];
    words.map(str::to_owned).to_vec()
}

/// No test, but what [`command`] starts.
#[test]
fn a_process_that_is_told_to_is_a_mutant() {
    if let Ok(words) = std::env::var(MUTANT) {
        let words: Vec<&str> = words.split_whitespace().collect();
        std::process::exit(mutant::run(&words).into());
    }
}

fn options(only: Vec<String>) -> Options {
    Options {
        only,
        startup: PATIENCE,
        // These tests judge several solvers at the same time.
        jobs: 1,
        random: RandomCases {
            cases: 60,
            // As many on a busy machine: fewer may not show all that is judged.
            time: Duration::MAX,
            shrink: Duration::ZERO,
            failures: 1,
            ..RandomCases::default()
        },
        ..Options::default()
    }
}

/// The built-in solver of a side, or one that says in Hello that it takes no more than a profile.
#[derive(Clone, Copy)]
struct Of {
    party: Party,
    profile: Option<&'static Profile>,
}

impl Of {
    fn whole(party: Party) -> Self {
        let profile = None;
        Self { party, profile }
    }

    /// Its clauses.
    fn clauses(self) -> Vec<&'static Clause> {
        match self.profile {
            Some(profile) => profile.core().collect(),
            None => clause::of(self.party),
        }
    }

    /// The same with a flaw.
    fn with(self, wrong: Wrong) -> Wrong {
        let Some(profile) = self.profile else {
            return wrong;
        };
        let mut modest = change::hello(move |hello| hello.capabilities = profile.capabilities());
        if self.party == Party::Dem && !profile.capabilities().meets("feature:contact_resolution") {
            // It resolves no contacts, which the built-in solver would do.
            modest = modest.with(Flaw::json(|config| {
                config.insert("contact_resolution".into(), 2.0.into());
            }));
        }
        Wrong {
            messages: modest.with(wrong.messages),
            process: wrong.process,
        }
    }
}

/// A solver with this flaw, in the thread of the kit.
fn flawed<W: Into<Wrong>>(of: Of, wrong: impl Fn() -> W + Send + Sync + 'static) -> Subject {
    let party = of.party;
    let make = move |ends| -> (Host, Ends) {
        let flawed = Flawed::new(ends, party, of.with(wrong().into()));
        (built_in(party), Box::new(flawed))
    };
    let start = Start::InThread(Arc::new(make));
    Subject { party, start }
}

fn judge(subject: &Subject, only: Vec<String>) -> Examination {
    examine(subject, &options(only), |_| ()).expect("a kit that starts")
}

/// What passed without a flaw in one session, in order.
type MessageLog = Arc<Mutex<Vec<Message>>>;

/// Changes nothing and adds what passes to a log of its own.
fn listening(logs: &Mutex<Vec<MessageLog>>) -> Flaw {
    let log = MessageLog::default();
    logs.lock().expect("no panic").push(log.clone());
    Flaw::each(move |message| log.lock().expect("no panic").push(message.clone()))
}

/// Longer than to pass a message on takes, less than the nap of a mutant that is slow on purpose.
const A_WHILE: Duration = Duration::from_millis(4);

/// A clause that a solver without a flaw keeps, with the sessions in which that was seen.
struct Kept {
    clause: &'static Clause,
    sessions: Vec<MessageLog>,
}

impl Kept {
    /// Whether a mutant does anything in these sessions, or takes its time. Kit and solver do the same whenever they receive the same
    /// (T-6a), so where a flaw passes on all that passed without it, the mutant receives and answers what was received and
    /// answered without it, and the clause is kept: nothing has to be run to know that.
    fn is_touched_by(&self, mutant: &Mutant) -> bool {
        self.sessions.iter().any(|log| {
            let mut wrong = (mutant.wrong)();
            let log = log.lock().expect("no panic");
            wrong.process != ProcessFlaws::default()
                || log.iter().any(|message| {
                    let start = Instant::now();
                    wrong.messages.pass(message.clone()) != [message.clone()]
                        || start.elapsed() > A_WHILE
                })
        })
    }
}

/// Judges a solver without a flaw by every clause that needs no process, on all cores.
fn kept_by_the_flawless(of: Of) -> Vec<Kept> {
    let clauses: Vec<_> = of
        .clauses()
        .into_iter()
        .filter(|c| !c.of_processes && !c.is_random())
        .collect();
    at_once(cores(), &clauses, |clause| {
        let logs = Arc::new(Mutex::new(Vec::new()));
        let heard = logs.clone();
        let subject = flawed(of, move || listening(&heard));
        for judged in judge(&subject, vec![clause.id.into()]).judged {
            let kept = matches!(judged.verdict, Verdict::Pass { .. });
            assert!(kept, "{} without a flaw: {:?}", clause.id, judged.verdict);
        }
        let sessions = std::mem::take(&mut *logs.lock().expect("no panic"));
        Kept { clause, sessions }
    })
}

/// Pieces of work at a time.
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// What is wrong with how a mutant was judged.
fn complaints(mutant: &Mutant, examination: &Examination) -> Vec<String> {
    let mut wrong = Vec::new();
    let (name, meant) = (&mutant.name, mutant.clause.id);
    for judged in &examination.judged {
        let id = judged.clause.id;
        match &judged.verdict {
            Verdict::Fail(_) if id == meant => {}
            Verdict::Fail(evidence) => wrong.push(format!("{name}: also breaks {id}: {evidence}")),
            other if id == meant => wrong.push(format!("{name}: not found out: {other:?}")),
            Verdict::Blocked { by } if *by != meant => {
                wrong.push(format!("{name}: {id} is blocked by {by}"));
            }
            _ => {}
        }
    }
    wrong
}

/// The clauses that a mutant may break, and those that are blocked where it breaks its own.
fn to_be_judged(kept: &[Kept], mutant: &Mutant) -> Vec<String> {
    let mut blocked = vec![mutant.clause.id];
    let mut asked = Vec::new();
    for kept in kept {
        let Clause { id, after, .. } = kept.clause;
        let needs = after.iter().any(|needed| blocked.contains(needed));
        if needs {
            blocked.push(id);
        }
        if needs || kept.is_touched_by(mutant) {
            asked.push((*id).to_string());
        }
    }
    asked
}

fn every_mutant_breaks_its_clause_alone(of: Of) {
    let kept = kept_by_the_flawless(of);
    let judged = |mutant: &Mutant| kept.iter().any(|kept| kept.clause.id == mutant.clause.id);
    let mutants: Vec<_> = mutant::of(of.party).into_iter().filter(judged).collect();
    let mut work = at_once(cores(), &mutants, |mutant| {
        (mutant.clone(), to_be_judged(&kept, mutant))
    });
    // The longest first, so that none is waited for alone at the end.
    work.sort_by_key(|(_, asked)| std::cmp::Reverse(asked.len()));
    let wrong = at_once(cores(), &work, |(mutant, asked)| {
        if !asked.iter().any(|id| id == mutant.clause.id) {
            return vec![format!("{}: does nothing where it is judged", mutant.name)];
        }
        let (start, count) = (Instant::now(), asked.len());
        let found = judge(&flawed(of, mutant.wrong), asked.clone());
        let took = start.elapsed().as_secs_f64();
        println!("{}: {count} clauses, {took:.1} s", mutant.name);
        complaints(mutant, &found)
    });
    let wrong = wrong.concat();
    assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
}

#[test]
fn every_mutant_of_the_physics_of_bodies_is_found_by_its_clause() {
    every_mutant_of_physics_is_found_by_its_clause(Of::whole(Party::Dem));
}

#[test]
fn every_mutant_of_the_physics_of_a_continuum_is_found_by_its_clause() {
    every_mutant_of_physics_is_found_by_its_clause(Of::whole(Party::Mpm));
}

/// Mutants of what random cases judge: the first difference that they show is of their clause. It prints which case shows it.
fn every_mutant_of_physics_is_found_by_its_clause(of: Of) {
    let random = |mutant: &Mutant| mutant.clause.is_random();
    let mutants: Vec<_> = mutant::of(of.party).into_iter().filter(random).collect();
    let all: Vec<_> = clause::of(of.party)
        .iter()
        .filter(|c| c.is_random())
        .map(|c| c.id.into())
        .collect();
    let wrong = at_once(cores(), &mutants, |mutant| {
        let start = Instant::now();
        let subject = flawed(of, mutant.wrong);
        let mut options = options(all.clone());
        options.random.cases = 10_000;
        let found = examine(&subject, &options, |_| ()).expect("a kit that starts");
        let broken: Vec<_> = found.broken(true).map(|judged| judged.clause.id).collect();
        let seed = found.judged.iter().find_map(|judged| judged.case.as_ref());
        let seed = seed.map(|(seed, _)| *seed);
        let took = start.elapsed().as_secs_f64();
        println!("{}: {broken:?}, {seed:?}, {took:.1} s", mutant.name);
        // A wrong force may show first as another answer on the same contact. Wrong steps may show first in the forces
        // on points, and on bodies that do not move in the impulses alone. What is wrong with the motion of points shows
        // in all that is reported of them, a soft material in the step that it allows, wrong hardening in the motion, points that
        // bear one another's ids are pushed at other places, and a set without some points may stay too long.
        let own = mutant.clause.id;
        let also: &[&str] = match own {
            "F-7" => &["F-5", "F-6", "F-8"],
            "T-1" => &["F-7", "N-1"],
            "T-1a" => &["F-1a", "R-3e", "R-5a", "I-2g", "I-6a", "N-1a", "S-2c"],
            "I-2g" => &["F-1a", "R-5a", "T-1a"],
            "D-1a" => &["R-3e", "R-5a"],
            "R-5a" => &["R-5e"],
            "R-5e" => &["T-1a"],
            "I-6a" => &["I-7a"],
            "I-7a" => &["I-6a"],
            _ => &[],
        };
        let found = broken.len() == 1 && (broken[0] == own || also.contains(&broken[0]));
        (!found).then(|| format!("{} ({}): found by {broken:?}", mutant.name, mutant.what))
    });
    let wrong: Vec<_> = wrong.into_iter().flatten().collect();
    assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
}

#[test]
fn every_mutant_of_a_bodies_side_breaks_its_clause_alone() {
    every_mutant_breaks_its_clause_alone(Of::whole(Party::Dem));
}

#[test]
fn every_mutant_of_a_continuum_breaks_its_clause_alone() {
    every_mutant_breaks_its_clause_alone(Of::whole(Party::Mpm));
}

/// The same of a solver of discs with friction and of nothing else: each clause of its core is judged by scenes that it
/// takes, and each can fail.
#[test]
fn every_mutant_of_discs_breaks_its_clause_alone() {
    let discs = profiles(Party::Dem).find(|profile| profile.name == "discs+friction");
    every_mutant_breaks_its_clause_alone(Of {
        party: Party::Dem,
        profile: discs,
    });
}

/// A solver that says what it takes is judged by the whole core of its profile, and fits that profile.
#[test]
fn a_solver_of_each_profile_is_judged_by_its_core() {
    for party in [Party::Dem, Party::Mpm] {
        for profile in profiles(party) {
            let of = Of {
                party,
                profile: Some(profile),
            };
            let examination = judge(&flawed(of, mutant::nothing), Vec::new());
            let fitting = examination.profile().map(|fitting| fitting.name);
            assert_eq!(fitting, Some(profile.name));
            let missing: Vec<_> = examination.missing(Some(profile));
            let missing: Vec<_> = missing.iter().map(|judged| judged.clause.id).collect();
            assert_eq!(missing, [""; 0], "{}", profile.name);
            let failed: Vec<_> = examination.broken(true).map(|j| j.clause.id).collect();
            assert_eq!(failed, [""; 0], "{}", profile.name);
        }
    }
}

/// A solver that refuses everything is not conformant: the core of the least profile is left out.
#[test]
fn a_solver_that_refuses_everything_does_not_pass() {
    for party in [Party::Dem, Party::Mpm] {
        // What S-8a says that nobody can honour.
        let key = if party == Party::Mpm {
            "cell"
        } else {
            "threads"
        };
        let refusing = move || {
            Flaw::json(move |config| {
                config.insert(key.into(), 0.into());
            })
        };
        let examination = judge(&flawed(Of::whole(party), refusing), Vec::new());
        let missing = examination.missing(None).len();
        assert!(missing > 20, "{missing}");
    }
}

/// Where the messages of a step are out of order, nothing is said of the physics.
#[test]
fn physics_is_blocked_where_a_step_has_a_message_too_many() {
    for (party, order, physics) in [(Party::Dem, "G-9a", "F-2"), (Party::Mpm, "G-9b", "I-1c")] {
        let mut mutants = mutant::of(party).into_iter();
        let mutant = mutants.find(|mutant| mutant.name == order).expect("one");
        let subject = flawed(Of::whole(party), mutant.wrong);
        let judged = judge(&subject, vec![order.into(), physics.into()]).judged;
        let verdict = &judged[1].verdict;
        let blocked = matches!(verdict, Verdict::Blocked { by } if *by == order);
        assert!(blocked, "{physics}: {verdict:?}");
    }
}

/// What a right solver may do otherwise than the built-in one: nothing fails.
#[test]
fn a_solver_with_other_rounding_passes() {
    // The normal's rounding leaves this on a floor, where the built-in solver has 0.
    let flaw = || {
        Flaw::forces(|_, forces| {
            for force in forces.iter_mut().filter(|force| force.force != [0.0; 2]) {
                force.force[0] += 2e-17;
            }
        })
    };
    let examination = judge(&flawed(Of::whole(Party::Dem), flaw), vec!["F-7".into()]);
    assert_eq!(examination.broken(true).count(), 0);
}

/// The same for what can be seen of processes only, among the clauses that are about processes.
#[test]
fn every_mutant_process_breaks_its_clause_alone() {
    for party in [Party::Dem, Party::Mpm] {
        let about: Vec<_> = clause::of(party)
            .into_iter()
            .filter(|c| c.of_processes)
            .collect();
        let only: Vec<String> = about.iter().map(|c| c.id.to_string()).collect();
        for mutant in mutant::of(party) {
            if !mutant.clause.of_processes {
                continue;
            }
            let start = Start::Command(command(&mutant.name));
            let subject = Subject { party, start };
            let found = judge(&subject, only.clone());
            let wrong = complaints(&mutant, &found);
            assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
        }
    }
}

#[test]
fn every_clause_has_its_mutant_and_an_id_is_one_statement() {
    let mut titles = BTreeMap::new();
    for party in [Party::Dem, Party::Mpm] {
        let (clauses, mutants) = (clause::of(party), mutant::of(party));
        let ids: BTreeSet<_> = clauses.iter().map(|clause| clause.id).collect();
        assert_eq!(ids.len(), clauses.len(), "a clause is there twice");
        for clause in clauses {
            let broken = mutants.iter().any(|mutant| mutant.clause.id == clause.id);
            assert!(broken, "{} has no mutant", clause.id);
            let title = titles.entry(clause.id).or_insert(clause.title);
            assert_eq!(*title, clause.title, "{} says two things", clause.id);
        }
    }
}

#[test]
fn what_a_clause_needs_is_judged_before_it() {
    for party in [Party::Dem, Party::Mpm] {
        let clauses = clause::of(party);
        for (k, clause) in clauses.iter().enumerate() {
            for needed in clause.after {
                let before = clauses[..k].iter().any(|c| c.id == *needed);
                assert!(
                    before,
                    "{} is after {needed}, which is not before it",
                    clause.id
                );
            }
        }
    }
}
