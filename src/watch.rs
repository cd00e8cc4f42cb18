//! `tandem watch`, and the same beside `tandem run --watch`: a run that goes on as a page for a browser.

use std::env;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::sync::atomic::Ordering;

use coupler::record::rundir::in_use;
use report::live::follow;
use rustix::process::nice;

use crate::cli::WatchArgs;
use crate::exit::{FAILED, Failed, bad_input};
use crate::signals::interrupt;
use crate::terminal::{complain, say};

/// How far it stands back behind the run, which shares its processors. Not all the way: beside other work a page of
/// 0.3 s would take minutes, and a page costs little since there is a rest after it.
const NICE: i32 = 10;

/// Keeps the page of a run up to date until the run has ended.
pub fn watch(args: &WatchArgs) -> Result<ExitCode, Failed> {
    let dir = &args.dir;
    if !in_use(dir) {
        let why = format!(
            "no run goes on in {}\n   help: `tandem run SCENE --watch` starts one and shows it; `tandem report DIR` \
             makes the page of one that has ended",
            dir.display()
        );
        return Err(bad_input(why));
    }
    let failed = |error| Failed::new(error, FAILED);
    let interrupt = interrupt(false).map_err(failed)?;
    // Where that is refused this process is as urgent as the run, which costs a little of its time.
    let _ = nice(NICE);
    // Ctrl-C on a terminal reaches a run and this process: the run ends, and has a last page.
    let stop = || !args.of_run && interrupt.to_end.load(Ordering::Relaxed);
    let shown = |page: Option<&Path>| match page {
        Some(page) => {
            let page = page.canonicalize().unwrap_or_else(|_| page.to_owned());
            say(format_args!(
                "the run is shown at file://{}",
                page.display()
            ));
        }
        None if args.of_run => {} // which has just begun
        None => say(format_args!(
            "the run has written no history yet; its page is made when it has"
        )),
    };
    follow(dir, stop, shown).map_err(|error| Failed::new(error, FAILED))?;
    Ok(ExitCode::SUCCESS)
}

/// Starts a process that shows the run in `dir`, and ends with it. A run goes on without one.
pub fn beside(dir: &Path) {
    let started = env::current_exe().and_then(|program| {
        let mut watch = Command::new(program);
        watch.arg("watch").arg("--of-run").arg(dir).spawn()
    });
    if let Err(error) = started {
        complain(format_args!("warning: the run is not shown: {error}"));
    }
}
