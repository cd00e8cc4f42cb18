//! Runs as one job array of Slurm.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use interface::files::{self, SMALL};
use interface::transport::wait::until_there;

use super::start::{Place, Start};
use crate::StudyError;
use crate::output;

/// The file with the number of the array.
const NOTE: &str = "slurm.job";
/// Time between two looks at the directories of the runs.
const LOOK: Duration = Duration::from_millis(500);
/// Time between two questions to the queue.
const ASK: Duration = Duration::from_secs(3);
/// Most runs at once, unless it is said.
const AT_ONCE: usize = 100;
/// Most tasks of an array where Slurm does not tell: its own default.
const MOST: usize = 1001;

/// Submits an array, or finds the one that an earlier call has submitted, and returns when it is over.
pub(super) fn work(
    starts: &[&Start],
    place: &Place,
    look: &mut dyn FnMut() -> usize,
) -> Result<(), StudyError> {
    let noted = place.runs.join(NOTE);
    let earlier = files::read_named_text(&noted, SMALL).ok();
    let job = if let Some(job) = earlier.filter(|job| is_queued(job)) {
        tracing::info!("waiting for the job {job} of an earlier call");
        job
    } else {
        let job = submit(starts, place)?;
        // Whole or not at all: a call that is killed while it writes must not leave an array that nobody waits for.
        files::replace(place.runs, NOTE, job.as_bytes(), false)
            .map_err(StudyError::file("write", &noted))?;
        tracing::info!("submitted the job {job}");
        job
    };
    let mut asked = Instant::now();
    until_there(LOOK, || {
        if look() == 0 {
            return Some(Ok(()));
        }
        if place.interrupted() {
            return Some(told(Command::new("scancel").arg(&job)).map(drop));
        }
        if asked.elapsed() > ASK {
            if !is_queued(&job) {
                return Some(Ok(()));
            }
            asked = Instant::now();
        }
        None
    })
}

/// Submits one array and tells its number.
fn submit(starts: &[&Start], place: &Place) -> Result<String, StudyError> {
    let [lines, script, log] =
        ["commands", "sh", "log"].map(|end| place.runs.join("slurm").with_extension(end));
    let mut text = String::new();
    for start in starts {
        let log = start.log.to_string_lossy();
        let log = shlex::try_quote(&log).expect("a path has no zero byte");
        let _ = writeln!(text, "{} </dev/null >/dev/null 2>{log}", start.line());
    }
    // An array has a bounded number of tasks, so each makes several runs of a large study, one after the other.
    let each = starts.len().div_ceil(largest_array()).max(1);
    let quoted = lines.to_string_lossy();
    let quoted = shlex::try_quote(&quoted).expect("a path has no zero byte");
    let task = format!(
        "#!/bin/sh\nfirst=$((SLURM_ARRAY_TASK_ID * {each} + 1))\n\
         sed -n \"$first,$((first + {each} - 1))p\" {quoted} | sh\n"
    );
    for (path, text) in [(&lines, text), (&script, task)] {
        output::write(path, text)?;
    }
    let last = starts.len().div_ceil(each) - 1;
    let mut command = Command::new("sbatch");
    command
        .args(["--parsable", "--requeue", "--open-mode=append"])
        .args(["--job-name=tandem-study", "--ntasks=1"])
        .arg(format!("--cpus-per-task={}", place.cores))
        .arg(format!(
            "--array=0-{last}%{}",
            place.jobs.unwrap_or(AT_ONCE)
        ))
        .arg(option("chdir", place.runs))
        .arg(option("output", &log));
    if let Some(memory) = place.memory {
        command.arg(format!("--mem={memory}M"));
    }
    let said = told(command.arg(&script))?;
    // `JOB;CLUSTER` where there are several.
    Ok(said.trim().split(';').next().unwrap_or_default().to_owned())
}

fn option(name: &str, path: &Path) -> String {
    format!("--{name}={}", path.display())
}

/// Tasks that an array may have.
fn largest_array() -> usize {
    let config = told(Command::new("scontrol").args(["show", "config"])).unwrap_or_default();
    let line = config.lines().find(|line| line.starts_with("MaxArraySize"));
    let size = line.and_then(|line| line.split_once('=')?.1.trim().parse().ok());
    size.unwrap_or(MOST).max(1)
}

/// Whether a job waits or runs. If the queue cannot be asked, as while it is started again, it may.
fn is_queued(job: &str) -> bool {
    let mut ask = Command::new("squeue");
    match ask
        .args(["--noheader", "--format=%T", "--jobs", job])
        .output()
    {
        Ok(said) if said.status.success() => !said.stdout.trim_ascii().is_empty(),
        Ok(said) => !String::from_utf8_lossy(&said.stderr).contains("Invalid job id"),
        Err(_) => false,
    }
}

/// What a command of Slurm says.
fn told(command: &mut Command) -> Result<String, StudyError> {
    let name = command.get_program().to_string_lossy().into_owned();
    let said = command.output();
    let said = said.map_err(StudyError::file("start", Path::new(&name)))?;
    if said.status.success() {
        return Ok(String::from_utf8_lossy(&said.stdout).into_owned());
    }
    let error = String::from_utf8_lossy(&said.stderr);
    Err(StudyError::asked(
        format!("{name}: {}", error.trim()),
        "SBATCH_PARTITION, SBATCH_ACCOUNT and SBATCH_TIMELIMIT tell sbatch what it lacks",
    ))
}
