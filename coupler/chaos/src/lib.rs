//! Chaos: a scene is run many times, and each time something happens to it. A process is killed or stopped, the run is
//! interrupted, its files or its memory have no more room. What is left is resumed, and must have the same bits as a run that
//! nobody has disturbed.
//!
//! | file | what is in it |
//! | --- | --- |
//! | [`kind`], [`random`] | what can happen, and when: chosen from a seed |
//! | [`command`] | the program at work: its processes, signals to them, what they leave |
//! | [`round`] | one run with what happens to it, what follows, and what is wrong with that |
//! | [`result`] | what a run has left, to be compared |
//! | [`table`] | what all rounds come to |
#![forbid(unsafe_code)]

pub mod command;
mod error;
pub mod kind;
mod options;
pub mod random;
pub mod result;
pub mod round;
pub mod table;

use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use command::{Program, RunArea};
use error::file;
use result::RunResult;
use round::{Round, Verdict};
use table::Table;

pub use error::ChaosError;
pub use options::Options;

/// Runs that are left alone, of which the slowest says how long one takes.
const UNDISTURBED: u64 = 3;
/// What a last sweep removes is gone within this time: another one's may be at it.
const GRACE: Duration = Duration::from_secs(2);

/// Plays all rounds.
///
/// # Errors
/// [`ChaosError`]; what goes wrong in a round is in the table.
pub fn run(options: &Options) -> Result<Table, ChaosError> {
    fs::create_dir_all(&options.out).map_err(file("create", &options.out))?;
    let area = RunArea::create()?;
    let program = Program::new(&options.program, &options.scene, &area);
    let (undisturbed, takes) = undisturbed(&program, &options.out)?;
    tracing::info!(
        "an undisturbed run takes {takes:.2?} and {}",
        undisturbed.words()
    );
    let table = Mutex::new(Table::new(&options.kinds));
    let next = AtomicU64::new(options.first);
    let end = options.first + options.rounds;
    thread::scope(|scope| {
        for _ in 0..options.jobs.max(1) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= end || options.interrupt.load(Ordering::Relaxed) {
                        break;
                    }
                    let round = Round::new(number, options, takes);
                    let verdict = round.run(&program, &undisturbed);
                    tell(&round, &verdict);
                    let mut table = table.lock().expect("no thread panics");
                    table.take(&round, &verdict);
                }
            });
        }
    });
    let mut table = table.into_inner().expect("no thread panics");
    table.left = left_at_the_end(&program, &area);
    Ok(table)
}

/// Runs the scene in peace: what it leaves, and how long it takes at most.
fn undisturbed(program: &Program, out: &Path) -> Result<(RunResult, Duration), ChaosError> {
    let mut first: Option<RunResult> = None;
    let mut takes = Duration::ZERO;
    for n in 0..UNDISTURBED {
        let dir = out.join(format!("undisturbed-{n}"));
        let _ = fs::remove_dir_all(&dir);
        let began = Instant::now();
        let ended = program.start(program.run(&dir), &dir, None, &[])?.wait();
        takes = takes.max(began.elapsed());
        let result = RunResult::read(&dir).filter(|result| result.state_hash.is_some());
        let Some(result) = result else {
            return Err(ChaosError::Undisturbed {
                how: ended.words(),
                said: ended.last_words(),
            });
        };
        let result = result.that_ended(ended.code);
        match &first {
            None => first = Some(result),
            Some(first) => match first.difference(&result) {
                Some(what) => return Err(ChaosError::Differ(what)),
                None => drop(fs::remove_dir_all(&dir)),
            },
        }
    }
    Ok((first.expect("some were run"), takes))
}

fn tell(round: &Round, verdict: &Verdict) {
    for failure in &verdict.failures {
        tracing::warn!("round {}: {}: {failure}", round.number, round.kind.name());
    }
}

/// What is there of all runs after a last sweep, which must be nothing.
fn left_at_the_end(program: &Program, area: &RunArea) -> Vec<String> {
    let began = Instant::now();
    loop {
        program.clean();
        let left = area.left();
        if left.is_empty() || began.elapsed() > GRACE {
            return left;
        }
        thread::sleep(Duration::from_millis(100));
    }
}
