//! `tandem replay`.

use std::process::ExitCode;
use std::time::Duration;

use interface::hosted::Subject;
use interface::recording::End;
use interface::recording::replay::{Outcome, ReplayError, replay};
use interface::transport::remains::sweep;

use crate::cli::ReplayArgs;
use crate::exit::{BAD_INPUT, FAILED, Failed, bad_input};
use crate::logging;
use crate::terminal::{complain, say};

/// Some answer differs.
const DIFFERENT: u8 = 1;

/// Plays a recording to one solver.
pub fn run(args: &ReplayArgs) -> Result<ExitCode, Failed> {
    let subject = args.solver.subject().map_err(bad_input)?;
    let interrupted = sweep(Duration::ZERO).removed;
    if !interrupted.is_empty() {
        complain(format_args!(
            "removed the files of {} dead run(s)",
            interrupted.len()
        ));
    }
    logging::of_solver();
    let outcome =
        replay(&args.recording, &subject, args.tolerance, &args.set).map_err(|error| {
            let status = match error {
                ReplayError::Start(..) | ReplayError::Channel(_) | ReplayError::Solver { .. } => {
                    FAILED
                }
                _ => BAD_INPUT,
            };
            Failed::new(error, status)
        })?;
    Ok(show(&outcome, &subject, args.tolerance))
}

/// The result for people.
fn show(outcome: &Outcome, subject: &Subject, tolerance: f64) -> ExitCode {
    let (steps, party, comparison) = (outcome.steps, subject.party, &outcome.comparison);
    let numbers = comparison.numbers;
    if let End::Torn { messages, .. } = outcome.end {
        say(format_args!(
            "the recording ends in the middle, after {messages} messages: its run was killed"
        ));
    }
    say(format_args!(
        "{party}: {steps} steps replayed, {numbers} numbers compared"
    ));
    if let Some(words) = &outcome.failed_as_recorded {
        say(format_args!("it fails as recorded: {words}"));
    }
    let largest = comparison.largest;
    match &comparison.first {
        None if tolerance > 0.0 => {
            say(format_args!(
                "the same within {tolerance:e}; largest difference {largest:.1e}"
            ));
            ExitCode::SUCCESS
        }
        None => {
            say("the same, to the bit");
            ExitCode::SUCCESS
        }
        Some(first) => {
            say(format_args!("first difference: {first}"));
            let differing = comparison.differing;
            say(format_args!(
                "{differing} numbers differ, by {largest:.1e} of the largest at most"
            ));
            ExitCode::from(DIFFERENT)
        }
    }
}
