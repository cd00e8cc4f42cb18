//! `tandem watch`, and the same beside `tandem run --watch`: a run that goes on as a page for a browser of this machine.

use std::env;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::sync::atomic::Ordering;

use coupler::record::rundir::in_use;
use coupler::record::summary::Status;
use report::live::Live;
use rustix::process::nice;

use crate::cli::WatchArgs;
use crate::exit::BAD_INPUT;
use crate::signals::interrupt;
use crate::terminal::{complain, say};

/// How far the server stands back behind the run, which shares its processors. Not all the way: beside other work a page of
/// 0.3 s would take minutes, and a page costs little since the server rests after it.
const NICE: i32 = 10;

/// Serves the page of a run until the run has ended.
pub fn watch(args: &WatchArgs) -> ExitCode {
    let dir = &args.dir;
    if !in_use(dir) {
        complain(format_args!(
            "error: no run goes on in {}\n   help: `tandem run SCENE --watch` starts one and shows it; `tandem report DIR` \
             makes the page of one that has ended",
            dir.display()
        ));
        return ExitCode::from(BAD_INPUT);
    }
    let interrupt = match interrupt(false) {
        Ok(interrupt) => interrupt,
        Err(error) => return failed(&error),
    };
    let live = match Live::listen(dir, args.port) {
        Ok(live) => live,
        Err(error) => return failed(&error.to_string()),
    };
    // Where that is refused the server is as urgent as the run, which costs a little of its time.
    let _ = nice(NICE);
    say(format_args!("the run is shown at {}", live.address()));
    // Ctrl-C on a terminal reaches a run and its server: the run ends, and has a last page.
    let stop = || !args.of_run && interrupt.to_end.load(Ordering::Relaxed);
    match live.serve(stop) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failed(&error.to_string()),
    }
}

fn failed(error: &str) -> ExitCode {
    complain(format_args!("error: {error}"));
    ExitCode::from(Status::Failed.exit_code())
}

/// Starts the server of the run in `dir`, which ends with it. A run goes on without one.
pub fn beside(dir: &Path) {
    let started = env::current_exe().and_then(|program| {
        let mut server = Command::new(program);
        server.arg("watch").arg("--of-run").arg(dir).spawn()
    });
    if let Err(error) = started {
        complain(format_args!("warning: the run is not shown: {error}"));
    }
}
