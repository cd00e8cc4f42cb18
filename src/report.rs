//! `tandem report`, and the page at the end of a run.

use std::path::Path;
use std::process::ExitCode;

use coupler::record::FileError;
use coupler::run::resources::Bytes;
use report::{ReportError, Written};

use crate::cli::ReportArgs;
use crate::exit::{BAD_INPUT, FAILED, Failed};
use crate::terminal::{complain, say};

/// Writes the page of some runs.
pub fn report(args: &ReportArgs) -> Result<ExitCode, Failed> {
    let written = report::write(&args.dirs, args.out.as_deref()).map_err(|error| {
        let status = match error {
            ReportError::NotARun { .. } | ReportError::File(FileError { action: "read", .. }) => {
                BAD_INPUT
            }
            ReportError::File(_) => FAILED,
        };
        Failed::new(error, status)
    })?;
    announce(&written);
    Ok(ExitCode::SUCCESS)
}

/// Writes the page of a run that has ended. One that cannot be written is no fault of the run, whose exit status stays.
pub fn at_the_end_of(run: &Path) {
    match report::write(&[run.to_path_buf()], None) {
        Ok(written) => announce(&written),
        Err(error) => complain(format_args!("warning: no report: {error}")),
    }
}

fn announce(written: &Written) {
    say(format_args!(
        "report in {} ({})",
        written.path.display(),
        Bytes(written.bytes)
    ));
}
