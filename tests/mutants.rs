//! The kit's mutants: solvers that break one clause each. The kit must find that clause broken and no other, and every
//! clause must be broken by some mutant: a clause that no mutant can trip is no clause.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use conformance::bench::{Start, Subject};
use conformance::mutant::{self, Flaw, Host, Mutant, relay};
use conformance::verdict::Verdict;
use conformance::{Examination, Options, clause, examine};
use interface::OneProcess;
use interface::control::Party;
use interface::domain::Domain;
use interface::session::{SessionError, dem, mpm};
use interface::stage::Medium;

fn bodies(domain: &Domain) -> Result<(), SessionError> {
    dem::run::<OneProcess, _>(domain, &mut dem_proc::Sdem::default(), false)
}

fn continuum(domain: &Domain) -> Result<(), SessionError> {
    mpm::run::<OneProcess, _>(domain, &mut mpm_proc::Mpm::default(), false)
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
        trace: false,
    }
}

/// Judges a relay with this flaw, in a thread.
fn judge_flaw(party: Party, flaw: fn() -> Flaw) -> Examination {
    let solve = move |domain: &Domain| relay(Medium::Threads, domain, host(party), flaw());
    let start = Start::Thread(Arc::new(solve));
    let subject = Subject { party, start };
    examine(&subject, &options(Vec::new()), |_| ()).expect("a kit that starts")
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

fn every_mutant_breaks_its_clause_alone(party: Party) {
    let mutants = mutant::of(party);
    let mutants: Vec<_> = mutants
        .into_iter()
        .filter(|m| !of_processes(party, m))
        .collect();
    let next = AtomicUsize::new(0);
    // They mostly wait, so there may be more than there are cores.
    let wrong: Vec<String> = std::thread::scope(|scope| {
        let judge = || {
            let mut wrong = Vec::new();
            while let Some(mutant) = mutants.get(next.fetch_add(1, Ordering::Relaxed)) {
                let start = Instant::now();
                wrong.extend(complaints(mutant, &judge_flaw(party, mutant.flaw)));
                println!("{} {:.1} s", mutant.clause, start.elapsed().as_secs_f64());
            }
            wrong
        };
        let judges: Vec<_> = (0..4).map(|_| scope.spawn(judge)).collect();
        judges
            .into_iter()
            .flat_map(|j| j.join().expect("a judge"))
            .collect()
    });
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
            let found =
                examine(&subject, &options(only.clone()), |_| ()).expect("a kit that starts");
            let wrong = complaints(mutant, &found);
            assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
        }
    }
}

#[test]
fn a_relay_without_a_flaw_keeps_every_clause() {
    for party in [Party::Dem, Party::Mpm] {
        let examination = judge_flaw(party, Flaw::none);
        let broken: Vec<_> = examination.judged.iter().filter(|j| j.failed()).collect();
        let broken: Vec<_> = broken.iter().map(|j| (j.clause.id, &j.verdict)).collect();
        assert!(broken.is_empty(), "{broken:?}");
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
