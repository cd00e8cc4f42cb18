//! The kit's mutants: solvers that break one clause each. The kit must find that clause broken and no other, and every
//! clause must be broken by some mutant: a clause that no mutant can trip is no clause.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use conformance::bench::{PATIENCE, Start, Subject};
use conformance::clause::{self, Clause};
use conformance::mutant::{self, Flaw, Host, Manners, Mutant, Pass, relay};
use conformance::verdict::Verdict;
use conformance::{Examination, Options, examine};
use interface::control::Party;
use interface::domain::Domain;
use interface::session::{SessionError, serve_dem, serve_mpm};
use interface::stage::{Medium, Message};

fn bodies(domain: &Domain) -> Result<(), SessionError> {
    serve_dem(
        Medium::Threads,
        domain,
        &mut dem_proc::Sdem::default(),
        false,
    )
}

fn continuum(domain: &Domain) -> Result<(), SessionError> {
    serve_mpm(
        Medium::Threads,
        domain,
        &mut mpm_proc::Mpm::default(),
        false,
    )
}

fn host(party: Party) -> Host {
    let solve = if party == Party::Mpm {
        continuum
    } else {
        bodies
    };
    Host { party, solve }
}

fn options(only: Vec<String>) -> Options {
    Options {
        only,
        window: 64,
        startup: PATIENCE,
        trace: false,
    }
}

/// A relay with this flaw, in a thread.
fn relayed(party: Party, flaw: impl Fn() -> Flaw + Send + Sync + 'static) -> Subject {
    let solve = move |domain: &Domain| relay(Medium::Threads, domain, host(party), flaw());
    let start = Start::Thread(Arc::new(solve));
    Subject { party, start }
}

fn judge(subject: &Subject, only: Vec<String>) -> Examination {
    examine(subject, &options(only), |_| ()).expect("a kit that starts")
}

/// Which way a message passes a relay.
#[derive(Clone, Copy)]
enum Way {
    In,
    Out,
}

/// What passed a relay without a flaw in one session, in order.
type Tape = Arc<Mutex<Vec<(Way, Message)>>>;

/// A relay that changes nothing and notes what passes it on a tape of its own.
fn listening(tapes: &Mutex<Vec<Tape>>) -> Flaw {
    let tape = Tape::default();
    tapes.lock().expect("no panic").push(tape.clone());
    let note = |tape: Tape, way: Way| -> Pass {
        Box::new(move |message| {
            tape.lock().expect("no panic").push((way, message.clone()));
            vec![message]
        })
    };
    Flaw {
        inbound: note(tape.clone(), Way::In),
        outbound: note(tape, Way::Out),
        ..Flaw::none()
    }
}

/// Longer than to pass a message on takes, less than the nap of a mutant that is slow on purpose.
const A_WHILE: Duration = Duration::from_millis(10);

/// A clause that a relay without a flaw keeps, with the sessions in which that was seen.
struct Kept {
    clause: &'static Clause,
    sessions: Vec<Tape>,
}

impl Kept {
    /// Whether a mutant does anything in these sessions, or takes its time. Kit and solver do the same whenever they are told the same
    /// (T-6a), so where a flaw passes on all that passed without it, the mutant is told and answers what was told and
    /// answered without it, and the clause is kept: nothing has to be run to know that.
    fn is_touched_by(&self, mutant: &Mutant) -> bool {
        self.sessions.iter().any(|tape| {
            let mut flaw = (mutant.flaw)();
            flaw.manners != Manners::default()
                || tape.lock().expect("no panic").iter().any(|(way, message)| {
                    let pass = match way {
                        Way::In => &mut flaw.inbound,
                        Way::Out => &mut flaw.outbound,
                    };
                    let start = Instant::now();
                    pass(message.clone()) != [message.clone()] || start.elapsed() > A_WHILE
                })
        })
    }
}

/// Judges a relay without a flaw by every clause that can be seen of a thread, on all cores.
fn kept_by_the_flawless(party: Party) -> Vec<Kept> {
    let clauses: Vec<_> = clause::of(party)
        .into_iter()
        .filter(|c| !c.of_processes)
        .collect();
    on_all_cores(&clauses, |clause| {
        let tapes = Arc::new(Mutex::new(Vec::new()));
        let heard = tapes.clone();
        let subject = relayed(party, move || listening(&heard));
        for judged in judge(&subject, vec![clause.id.into()]).judged {
            let kept = matches!(judged.verdict, Verdict::Pass { .. });
            assert!(kept, "{} without a flaw: {:?}", clause.id, judged.verdict);
        }
        let sessions = std::mem::take(&mut *tapes.lock().expect("no panic"));
        Kept { clause, sessions }
    })
}

/// What `work` makes of each item, in order. It mostly waits, so there may be more at once than there are cores.
fn on_all_cores<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(k) else { return };
                    let result = work(item);
                    done.lock().expect("no panic").push((k, result));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("no panic");
    done.sort_by_key(|(k, _)| *k);
    done.into_iter().map(|(_, result)| result).collect()
}

/// What is wrong with how a mutant was judged.
fn complaints(mutant: &Mutant, examination: &Examination) -> Vec<String> {
    let mut wrong = Vec::new();
    for judged in &examination.judged {
        let meant = judged.clause.id == mutant.clause;
        match &judged.verdict {
            Verdict::Fail(evidence) if !meant => {
                wrong.push(format!(
                    "{}: also breaks {}: {evidence}",
                    mutant.clause, judged.clause.id
                ));
            }
            Verdict::Fail(_) => {}
            other if meant => wrong.push(format!("{}: not found out: {other:?}", mutant.clause)),
            Verdict::Blocked { by } if *by != mutant.clause => {
                wrong.push(format!(
                    "{}: {} is blocked by {by}",
                    mutant.clause, judged.clause.id
                ));
            }
            _ => {}
        }
    }
    wrong
}

/// Whether a mutant's clause can be seen of a process only.
fn of_processes(party: Party, mutant: &Mutant) -> bool {
    let clauses = clause::of(party);
    clauses
        .iter()
        .any(|c| c.id == mutant.clause && c.of_processes)
}

/// The clauses that a mutant may break, and those that are blocked where it breaks its own.
fn to_be_judged(kept: &[Kept], mutant: &Mutant) -> Vec<String> {
    let mut blocked = vec![mutant.clause];
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

fn every_mutant_breaks_its_clause_alone(party: Party) {
    let kept = kept_by_the_flawless(party);
    let mutants = mutant::of(party);
    let mutants: Vec<_> = mutants
        .into_iter()
        .filter(|m| !of_processes(party, m))
        .collect();
    let mut work = on_all_cores(&mutants, |mutant| (*mutant, to_be_judged(&kept, mutant)));
    // The longest first, so that none is waited for alone at the end.
    work.sort_by_key(|(_, asked)| std::cmp::Reverse(asked.len()));
    let wrong = on_all_cores(&work, |(mutant, asked)| {
        if !asked.iter().any(|id| id == mutant.clause) {
            return vec![format!(
                "{}: does nothing where it is judged",
                mutant.clause
            )];
        }
        let (start, count) = (Instant::now(), asked.len());
        let found = judge(&relayed(party, mutant.flaw), asked.clone());
        let took = start.elapsed().as_secs_f64();
        println!("{}: {count} clauses, {took:.1} s", mutant.clause);
        complaints(mutant, &found)
    });
    let wrong = wrong.concat();
    assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
}

#[test]
fn every_mutant_of_a_bodies_side_breaks_its_clause_alone() {
    every_mutant_breaks_its_clause_alone(Party::Dem);
}

#[test]
fn every_mutant_of_a_continuum_breaks_its_clause_alone() {
    every_mutant_breaks_its_clause_alone(Party::Mpm);
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
        for mutant in mutant::of(party)
            .into_iter()
            .filter(|m| of_processes(party, m))
        {
            let program = PathBuf::from(env!("CARGO_BIN_EXE_tandem"));
            let mut command = vec![program.to_str().expect("UTF-8"), "mutant", mutant.clause];
            if party == Party::Mpm {
                command.push("--mpm");
            }
            let start = Start::Command(command.into_iter().map(String::from).collect());
            let subject = Subject { party, start };
            let found = judge(&subject, only.clone());
            let wrong = complaints(mutant, &found);
            assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
        }
    }
}

#[test]
fn every_clause_has_its_mutant_and_every_mutant_its_clause() {
    for party in [Party::Dem, Party::Mpm] {
        let clauses: Vec<_> = clause::of(party).iter().map(|c| c.id).collect();
        let mutants: Vec<_> = mutant::of(party).iter().map(|m| m.clause).collect();
        let set = |ids: &[&'static str]| ids.iter().copied().collect::<BTreeSet<_>>();
        assert_eq!(set(&clauses), set(&mutants));
        assert_eq!(
            set(&clauses).len(),
            clauses.len(),
            "a clause is there twice"
        );
        assert_eq!(
            set(&mutants).len(),
            mutants.len(),
            "a mutant is there twice"
        );
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
