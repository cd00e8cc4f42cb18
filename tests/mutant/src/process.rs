//! A mutant as a process.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use dem_proc::Sdem;
use interface::hosted::Host;
use interface::message::control::Party;
use interface::session::{Clocked, Session, SessionError, drive, process};
use interface::transport::domain::Domain;
use interface::transport::iceoryx::{SEND_TIMEOUT, join};
use mpm_proc::Mpm;
use signal_hook::consts::SIGINT;
use signal_hook::flag::register_conditional_shutdown;

use crate::table::of;
use crate::transport::Flawed;
use crate::wrong::Wrong;

/// Exit status of a mutant that cannot join its run.
const FAILED: u8 = 3;
/// Exit status of a mutant that is started without a run, or has no such name.
const BAD_INPUT: u8 = 2;

/// The built-in solver of a side.
pub fn built_in(party: Party) -> Host {
    match party {
        Party::Mpm => Host::Mpm(Box::new(Mpm::default())),
        _ => Host::Dem(Box::new(Sdem::default())),
    }
}

/// A mutant as a process, with the words of its command line: its name and `--join RUN`. Without any word it lists the mutants.
/// Returns its exit status.
pub fn run(words: &[&str]) -> u8 {
    let dem_first = [Party::Dem, Party::Mpm];
    let Some((name, more)) = words.split_first() else {
        for party in dem_first {
            println!("--{party}");
            for mutant in of(party) {
                println!("  {:<8} {}", mutant.name, mutant.what);
            }
        }
        return 0;
    };
    let found = dem_first
        .into_iter()
        .filter(|party| process::started_as().is_none_or(|started| started == *party))
        .flat_map(|party| of(party).into_iter().map(move |mutant| (mutant, party)))
        .find(|(mutant, _)| mutant.name == *name);
    let Some((mutant, party)) = found else {
        eprintln!("error: there is no mutant `{name}`");
        return BAD_INPUT;
    };
    let wrong = (mutant.wrong)();
    if let ["--join", run] = more {
        // `join` sees to it that the others do not end. A process that a shell starts in the background inherits that SIGINT
        // is ignored, so both ways have to be set.
        if wrong.process.ends_on_interrupt {
            let _ = register_conditional_shutdown(SIGINT, 130, Arc::new(AtomicBool::new(true)));
        }
        process::join(run, |domain| {
            std::process::exit(serve(domain, party, wrong).into())
        });
        return FAILED;
    }
    eprintln!("error: a mutant is started by `tandem conformance`");
    wrong.process.status_unjoined.unwrap_or(BAD_INPUT)
}

/// Joins the run of `domain` as the built-in solver of a side that does something wrong, and serves until its session is
/// over; returns its exit status.
pub fn serve(domain: &Domain, party: Party, wrong: impl Into<Wrong>) -> u8 {
    let wrong = wrong.into();
    let process = wrong.process;
    let served = served(domain, party, wrong);
    if process.removes_the_lock {
        let _ = std::fs::remove_file(domain.directory().join("lock"));
    }
    match served {
        Ok(()) => process.status_closed.unwrap_or(0),
        Err(_) => process.status_failed.unwrap_or(FAILED),
    }
}

fn served(domain: &Domain, party: Party, wrong: Wrong) -> Result<(), SessionError> {
    let ends = join(domain, party, &[], SEND_TIMEOUT)?;
    if wrong.process.joins_without_note {
        remove_note(domain);
    }
    let flawed = Box::new(Flawed::new(ends, party, wrong));
    drive(Session::solver(built_in(party), flawed, Clocked::Process))
}

/// Removes the file by which this process notes that it takes part.
fn remove_note(domain: &Domain) {
    let own = format!("joined-{}.", std::process::id());
    let entries = std::fs::read_dir(domain.directory());
    for entry in entries.into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(&own) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}
