//! `tandem conformance`.

use std::path::Path;
use std::process::ExitCode;

use conformance::profile::{Profile, profiles};
use conformance::report::{json, junit, listing, row, summary};
use conformance::{Examination, ExamineError, Judged, examine};
use coupler::scene::BUILT_IN;
use interface::files;
use interface::hosted::{Host, Start, Subject};
use interface::message::control::Party;

use crate::cli::{ConformanceArgs, SolverArgs};
use crate::exit::{BAD_INPUT, FAILED, Failed, bad_input};
use crate::run::this_program;
use crate::terminal::say;
use crate::{logging, solvers};

/// Some clause that counts is broken.
const BROKEN: u8 = 1;

/// Judges a solver.
pub fn judge(args: &ConformanceArgs) -> Result<ExitCode, Failed> {
    if args.list {
        let both = [Party::Dem, Party::Mpm];
        let asked = |party: &Party| match (&args.solver.dem, &args.solver.mpm) {
            (None, None) => true,
            (dem, _) => dem.is_some() == (*party == Party::Dem),
        };
        for party in both.into_iter().filter(asked) {
            say(listing(party).trim_end());
        }
        return Ok(ExitCode::SUCCESS);
    }
    let subject = args.solver.subject().map_err(bad_input)?;
    let required = required(args, subject.party).map_err(bad_input)?;
    logging::of_solver();
    let show = |judged: &Judged| say(row(judged));
    let examination = examine(&subject, &args.options, show).map_err(|error| {
        let unknown = matches!(error, ExamineError::NoSuchClause { .. });
        Failed::new(error, if unknown { BAD_INPUT } else { FAILED })
    })?;
    say(summary(&examination));
    write(args, &examination).map_err(bad_input)?;
    let none_broken = examination.broken(args.strict).next().is_none();
    let kept = is_whole(&examination, required) && none_broken;
    Ok(ExitCode::from(if kept { 0 } else { BROKEN }))
}

/// Whether nothing of the core that counts was left out; says what was.
fn is_whole(examination: &Examination, required: Option<&Profile>) -> bool {
    let missing = examination.missing(required);
    for judged in &missing {
        let why = judged.reason().unwrap_or_default();
        say(format_args!("{} must be judged: {why}", judged.clause.id));
    }
    missing.is_empty()
}

/// The profile that is asked for.
fn required(args: &ConformanceArgs, party: Party) -> Result<Option<&'static Profile>, String> {
    let Some(name) = &args.require else {
        return Ok(None);
    };
    let found = profiles(party).find(|profile| profile.name == name);
    let known: Vec<&str> = profiles(party).map(|profile| profile.name).collect();
    let unknown =
        || format!("--require: there is no profile `{name}` of a {party}, only {known:?}");
    found.map(Some).ok_or_else(unknown)
}

impl SolverArgs {
    /// The solver that was asked for.
    ///
    /// # Errors
    /// None was, or what was given is no command or cannot be had in this process.
    pub fn subject(&self) -> Result<Subject, String> {
        let (party, command) = match (&self.dem, &self.mpm) {
            (Some(command), None) => (Party::Dem, command),
            (None, Some(command)) => (Party::Mpm, command),
            _ => return Err("expected one of --dem COMMAND and --mpm COMMAND".into()),
        };
        if self.in_process {
            if command != BUILT_IN {
                return Err(format!(
                    "--in-process runs the built-in solver only, not `{command}`"
                ));
            }
            return Ok(match party {
                Party::Mpm => Subject::in_thread(|| Host::Mpm(solvers::mpm())),
                _ => Subject::in_thread(|| Host::Dem(solvers::dem())),
            });
        }
        let command = match command.as_str() {
            BUILT_IN => this_program(party.name())?,
            command => shlex::split(command)
                .filter(|words| !words.is_empty())
                .ok_or(format!("--{party}: not a command"))?,
        };
        let start = Start::Command(command);
        Ok(Subject { party, start })
    }
}

fn write(args: &ConformanceArgs, examination: &Examination) -> Result<(), String> {
    let put = |path: &Path, text: &str| {
        files::write_named(path, text).map_err(|e| format!("cannot write {}: {e}", path.display()))
    };
    if let Some(path) = &args.json {
        put(path, &json(examination))?;
    }
    if let Some(path) = &args.junit {
        put(path, &junit(examination))?;
    }
    if let Some(dir) = &args.options.trace {
        std::fs::create_dir_all(dir)
            .map_err(|e| format!("cannot create {}: {e}", dir.display()))?;
        for judged in examination.judged.iter().filter(|judged| judged.failed()) {
            let file = dir.join(format!("{}.jsonl", judged.clause.id));
            match &judged.case {
                Some((_, case)) => put(&file.with_extension("case.json"), case)?,
                None => put(&file, &judged.trace.lines())?,
            }
        }
    }
    Ok(())
}
