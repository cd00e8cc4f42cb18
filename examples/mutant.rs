//! A solver that breaks one clause on purpose, to see what a failing verdict looks like before there is a solver of your own.
//! Without arguments it lists the mutants; the kit starts it as it starts any solver:
//!
//! ```text
//! cargo build --release --examples
//! tandem conformance --dem "target/release/examples/mutant F-7"
//! tandem conformance --mpm "target/release/examples/mutant T-1c/2"     # the second mutant of a clause
//! ```

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use conformance::clause;
use conformance::mutant::{Flaw, serve};
use dem_proc::Sdem;
use interface::hosted::Host;
use interface::message::control::Party;
use interface::session::process;
use interface::transport::domain::Domain;
use mpm_proc::Mpm;
use signal_hook::consts::SIGINT;
use signal_hook::flag::{register, register_conditional_shutdown};

/// Exit status of a mutant that cannot join its run.
const FAILED: u8 = 3;
/// Exit status of a mutant that is started without a run, or has no such name.
const BAD_INPUT: u8 = 2;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    ExitCode::from(run(&words))
}

/// A mutant as a process, with the words of its command line: its name and `--join RUN`. Without any word it lists the mutants.
/// Returns its exit status. The kit's own tests start it too.
pub fn run(words: &[&str]) -> u8 {
    let dem_first = [Party::Dem, Party::Mpm];
    let Some((name, more)) = words.split_first() else {
        for party in dem_first {
            println!("--{party}");
            for mutant in clause::mutants(party) {
                println!("  {:<8} {}", mutant.name, mutant.mutant.what);
            }
        }
        return 0;
    };
    let found = dem_first
        .into_iter()
        .filter(|party| process::started_as().is_none_or(|started| started == *party))
        .flat_map(|party| clause::mutants(party).into_iter().map(move |m| (m, party)))
        .find(|(mutant, _)| mutant.name == *name);
    let Some((mutant, party)) = found else {
        eprintln!("error: there is no mutant `{name}`");
        return BAD_INPUT;
    };
    let flaw = (mutant.mutant.flaw)();
    if let ["--join", run] = more {
        let host = match party {
            Party::Mpm => Host::Mpm(Box::new(Mpm::default())),
            _ => Host::Dem(Box::new(Sdem::default())),
        };
        return join_and_serve(run, host, flaw);
    }
    eprintln!("error: a mutant is started by `tandem conformance`");
    flaw.process.status_unjoined.unwrap_or(BAD_INPUT)
}

/// Joins a run as a process does; returns its exit status.
fn join_and_serve(run: &str, host: Host, flaw: Flaw) -> u8 {
    // A process that a shell starts in the background inherits that SIGINT is ignored, so both ways have to be set.
    let set = if flaw.process.ends_on_interrupt {
        register_conditional_shutdown(SIGINT, 130, Arc::new(AtomicBool::new(true)))
    } else {
        register(SIGINT, Arc::default())
    };
    if let Err(error) = set {
        eprintln!("warning: the handling of Ctrl-C could not be changed: {error}");
    }
    match Domain::join(run) {
        Ok(domain) => serve(&domain, host, flaw),
        Err(error) => {
            eprintln!("error: {error}");
            FAILED
        }
    }
}
