//! Runs of the program, each in a directory named after what it runs: what is there already is not run again.
//!
//! A run is one command, and its state is its directory: it is over when there is a summary of the same scene. So nothing is
//! counted twice, whoever starts a run again.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use coupler::record::rundir::in_use;
use coupler::record::summary::Status;
use coupler::record::{Summary, fail, log};
use interface::files::{self, SMALL, STATE};
use interface::transport::wait::{until, until_there};

use crate::StudyError;
use crate::case::Case;
use crate::output::write;
use crate::pool::{Start, pool, wait};
use crate::progress::Progress;

/// Time between two looks at runs that somebody else has started.
const LOOK: Duration = Duration::from_millis(100);
/// Longest time for a run to end that was asked to.
const DRAINING: Duration = Duration::from_secs(30);
/// How often a run is tried that leaves no summary, as one whose node was lost.
const TRIES: usize = 3;
/// Least time between two tables of the runs so far.
const PARTIAL: Duration = Duration::from_secs(10);
/// A case is run again until its two least CPU times of stepping are so near, as a share of the least.
const SCATTER: f64 = 0.05;
/// Characters of a hash that name a run: 64 bits.
const NAME: usize = 16;

/// How the runs of a study are started.
#[derive(Debug, Clone, Args)]
pub struct RunnerOptions {
    /// Directory of the results; runs that it already contains are not repeated.
    #[arg(long, alias = "output", value_name = "DIR")]
    pub out: PathBuf,
    /// Largest number of runs at the same time. With more than one their times are those of runs that share the machine.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: u16,
    /// Words before the command of each run, such as `srun --ntasks=1 --cpus-per-task=2` to make it in a queue. They return
    /// when the run has ended.
    #[arg(long, value_name = "WORDS", value_parser = launcher, default_value = "")]
    pub launcher: Launcher,
    /// Threads of each solver.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: u16,
    /// Run both solvers of a run in one thread of one process.
    #[arg(long)]
    pub in_process: bool,
    /// Start the programs that the scene names as solvers; without it a scene that names any is refused.
    #[arg(long)]
    pub trust: bool,
}

/// Words before the command of a run.
#[derive(Debug, Clone, Default)]
pub struct Launcher(Vec<String>);

fn launcher(words: &str) -> Result<Launcher, String> {
    let words = shlex::split(words).ok_or("a quote is not closed")?;
    Ok(Launcher(words))
}

/// Starts runs and finds what they left.
#[derive(Debug)]
pub struct Runner {
    options: RunnerOptions,
    /// Set from outside to end.
    interrupt: Arc<AtomicBool>,
    /// Directory of the runs.
    runs: PathBuf,
    /// This program, which has the subcommand `run`.
    program: PathBuf,
    /// Of the program itself: another build is another method.
    program_hash: blake3::Hash,
    started: AtomicUsize,
}

/// What the runs of a list of cases have left so far.
pub type Found = [Option<Summary>];

/// A case that was run, once or more often.
#[derive(Debug, Clone)]
pub struct Timed {
    /// What its runs have left: they differ in their times alone, of which these are the least.
    pub outcome: Summary,
    /// CPU time of stepping of each run in s, the least first.
    pub times: Vec<f64>,
}

impl Timed {
    pub(crate) fn of(outcome: Summary) -> Self {
        Self {
            times: vec![outcome.stepping_cpu()],
            outcome,
        }
    }

    /// Distance of the two least times as a share of the least; none of a single run.
    pub fn scatter(&self) -> Option<f64> {
        match self.times[..] {
            [least, next, ..] if least > 0.0 => Some(next / least - 1.0),
            _ => None,
        }
    }

    fn needs_more(&self) -> bool {
        self.outcome.whole() && self.scatter().is_none_or(|s| s > SCATTER)
    }

    /// A run more. One that fails where others did not is what counts.
    fn add(&mut self, other: Summary) {
        self.times.push(other.stepping_cpu());
        self.times.sort_by(f64::total_cmp);
        if !other.whole() {
            self.outcome = other;
            return;
        }
        let less = [
            other.cpu() < self.outcome.cpu(),
            other.stepping_cpu() < self.outcome.stepping_cpu(),
        ];
        let (best, other) = (&mut self.outcome.spent, other.spent);
        best.wall_s = best.wall_s.min(other.wall_s);
        best.stepping_wall_s = best.stepping_wall_s.min(other.stepping_wall_s);
        if less[0] {
            best.cpu_s = other.cpu_s;
        }
        if less[1] {
            best.stepping_cpu_s = other.stepping_cpu_s;
        }
    }
}

impl Runner {
    /// A runner that is to end when `interrupt` is set.
    ///
    /// # Errors
    /// The directory cannot be made, or the program cannot be read.
    pub fn new(options: &RunnerOptions, interrupt: Arc<AtomicBool>) -> Result<Self, StudyError> {
        let runs = options.out.join("runs");
        fs::create_dir_all(&runs).map_err(|error| {
            let what = format!("cannot create the directory {}: {error}", runs.display());
            StudyError::usage(what, "give another with `--out`")
        })?;
        // A launcher may work elsewhere.
        let runs = runs
            .canonicalize()
            .map_err(fail("find the directory", &runs))?;
        let program = std::env::current_exe().map_err(fail("find", Path::new("this program")))?;
        let content =
            files::read_named(&program, STATE).map_err(fail("read the program", &program))?;
        Ok(Self {
            program_hash: blake3::hash(&content),
            program,
            options: options.clone(),
            interrupt,
            runs,
            started: AtomicUsize::new(0),
        })
    }

    /// Runs that were started so far; the others were there already.
    pub fn started(&self) -> usize {
        self.started.load(Ordering::Relaxed)
    }

    /// Most runs at once.
    pub fn jobs(&self) -> usize {
        self.options.jobs.into()
    }

    /// Whether this machine makes the runs.
    pub fn is_local(&self) -> bool {
        self.options.launcher.0.is_empty()
    }

    /// Whether no run shares the machine with another, so that its time is its own.
    pub fn alone(&self) -> bool {
        self.is_local() && self.jobs() == 1
    }

    /// Name of a case's runs: of its scene, the programs, and what else decides how long it takes.
    pub fn name(&self, case: &Case) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(case.scene.hash.as_bytes());
        hasher.update(self.program_hash.as_bytes());
        hasher.update(case.solver_files.as_deref().unwrap_or("").as_bytes());
        hasher.update(&self.options.threads.to_le_bytes());
        hasher.update(&[u8::from(self.options.in_process)]);
        hasher.finalize().to_hex()[..NAME].to_owned()
    }

    /// Directory of the `repeat`-th run of a case.
    pub fn directory(&self, case: &Case, repeat: usize) -> PathBuf {
        let name = self.name(case);
        match repeat {
            0 => self.runs.join(name),
            again => self.runs.join(format!("{name}-{}", again + 1)),
        }
    }

    /// Runs cases as often as their times ask for, `most` times at most, unless they have been. All cases are run before one is repeated, so that
    /// what else the machine does at a time falls on repetitions of many cases and not on all of one. `partial` gets now
    /// and then what the first runs of all cases have left so far.
    ///
    /// # Errors
    /// [`StudyError::Interrupted`], files that cannot be written, and a launcher that cannot be started. A run that fails is an outcome.
    pub fn timed(
        &self,
        cases: &[Case],
        most: usize,
        partial: &mut dyn FnMut(&Found),
    ) -> Result<Vec<Timed>, StudyError> {
        let all: Vec<&Case> = cases.iter().collect();
        let first = self.make(&all, 0, partial)?;
        let mut timed: Vec<Timed> = first.into_iter().map(Timed::of).collect();
        for again in 1..most {
            let open: Vec<usize> = (0..cases.len())
                .filter(|&k| timed[k].needs_more())
                .collect();
            if open.is_empty() {
                break;
            }
            tracing::info!("{} of {} runs are timed again", open.len(), cases.len());
            let again_of: Vec<&Case> = open.iter().map(|&k| &cases[k]).collect();
            let others = self.make(&again_of, again, &mut |_| ())?;
            for (k, other) in open.into_iter().zip(others) {
                timed[k].add(other);
            }
        }
        Ok(timed)
    }

    /// The commands of the first runs of cases that have not ended yet, as lines for a shell.
    ///
    /// # Errors
    /// Files that cannot be written, and programs of the scene that are not trusted.
    pub fn commands(&self, cases: &[Case]) -> Result<Vec<String>, StudyError> {
        let open = |case: &&Case| !self.left(case, 0).is_some_and(|known| known.settled());
        let start = |case: &Case| Ok(self.prepare(case, 0)?.line());
        cases.iter().filter(open).map(start).collect()
    }

    /// The `repeat`-th runs of cases. What has left no summary is tried again; what has failed is not, because it may
    /// take as long to fail once more.
    fn make(
        &self,
        cases: &[&Case],
        repeat: usize,
        partial: &mut dyn FnMut(&Found),
    ) -> Result<Vec<Summary>, StudyError> {
        let settled = |case: &&Case| self.left(case, repeat).filter(Summary::settled);
        let mut found: Vec<Option<Summary>> = cases.iter().map(settled).collect();
        let mut progress = Progress::new(cases.len());
        let mut starts: Vec<(usize, Start)> = Vec::new();
        for attempt in 0..TRIES {
            let open = |found: &Found| -> Vec<usize> {
                (0..found.len()).filter(|&k| found[k].is_none()).collect()
            };
            let directories = open(&found).into_iter();
            let directories: Vec<PathBuf> = directories
                .map(|k| self.directory(cases[k], repeat))
                .collect();
            if self.free(&directories)? || attempt > 0 {
                for k in open(&found) {
                    found[k] = self.left(cases[k], repeat);
                }
            }
            let prepare = |k| Ok::<_, StudyError>((k, self.prepare(cases[k], repeat)?));
            starts = open(&found)
                .into_iter()
                .map(prepare)
                .collect::<Result<_, _>>()?;
            if starts.is_empty() {
                break;
            }
            if attempt == 0 {
                self.started.fetch_add(starts.len(), Ordering::Relaxed);
            } else {
                tracing::warn!("{} runs left no summary: tried again", starts.len());
            }
            let commands: Vec<&Start> = starts.iter().map(|(_, start)| start).collect();
            let mut last_shown = Instant::now();
            let mut look = || {
                let mut news = false;
                for (k, _) in &starts {
                    if found[*k].is_none() {
                        found[*k] = self.left(cases[*k], repeat);
                        news |= found[*k].is_some();
                    }
                }
                progress.show(&found);
                // A large table takes its time too.
                if news && last_shown.elapsed() > PARTIAL {
                    let began = Instant::now();
                    partial(&found);
                    last_shown = Instant::now() + 20 * began.elapsed();
                }
            };
            let make = |start: &&Start| wait(start, &self.interrupt);
            let worked = pool(&commands, self.jobs(), make, &mut look);
            if self.interrupted() {
                // A launcher may have ended before its run.
                let busy = || directories.iter().any(|directory| in_use(directory));
                until(DRAINING, LOOK, || (!busy()).then_some(()));
                look();
                partial(&found);
                return Err(StudyError::Interrupted);
            }
            worked?;
            look();
            partial(&found);
        }
        let left = |k: usize, known: Option<Summary>| {
            let of = || starts.iter().find(|(open, _)| *open == k);
            known.unwrap_or_else(|| lost(&of().expect("it was tried").1))
        };
        Ok(found
            .into_iter()
            .enumerate()
            .map(|(k, known)| left(k, known))
            .collect())
    }

    /// Waits until no run that somebody else has started, or that has outlived its worker, uses one of these directories.
    /// Tells whether there was any.
    fn free(&self, directories: &[PathBuf]) -> Result<bool, StudyError> {
        let mut waited = false;
        for directory in directories {
            until_there(LOOK, || {
                let used = in_use(directory);
                if used && !waited {
                    let used = directory.display();
                    tracing::warn!(
                        "a run that was started before uses {used}: waiting for its end"
                    );
                    waited = true;
                }
                (!used || self.interrupted()).then_some(())
            });
            if self.interrupted() {
                return Err(StudyError::Interrupted);
            }
        }
        Ok(waited)
    }

    /// What a run of this scene has left, if it has ended by itself.
    fn left(&self, case: &Case, repeat: usize) -> Option<Summary> {
        let left = Summary::read(&self.directory(case, repeat)).ok()?;
        let ended = !matches!(left.status, Status::Interrupted | Status::Killed);
        (ended && left.scene_hash == case.scene.hash).then_some(left)
    }

    /// What has to be there for a run to begin.
    fn prepare(&self, case: &Case, repeat: usize) -> Result<Start, StudyError> {
        if self.interrupted() {
            return Err(StudyError::Interrupted);
        }
        let programs = case.scene.programs();
        if let Some((side, command)) = programs.first().filter(|_| !self.options.trust) {
            let what = format!("the scene would start a program as its {side}: {command}");
            return Err(StudyError::usage(what, "look at it, then give `--trust`"));
        }
        let directory = self.directory(case, repeat);
        let beside = |extension: &str| directory.with_extension(extension);
        // What is run is the text that was hashed, whatever becomes of the scene's own file meanwhile. A run in a queue may
        // be about to read it.
        let scene = beside("toml");
        let text = &case.scene.resolved_toml;
        if files::read_named_text(&scene, SMALL).ok().as_ref() != Some(text) {
            write(&scene, text)?;
        }
        // The summary of an unfinished run would be taken for that of this one.
        let _ = files::remove(&directory, "summary.json");
        let text = |path: &Path| path.to_string_lossy().into_owned();
        let mut command = self.options.launcher.0.clone();
        command.extend([text(&self.program), "run".into(), text(&scene)]);
        command.extend(["--out".into(), text(&directory), "--unless-done".into()]);
        command.extend(["--threads".into(), self.options.threads.to_string()]);
        command.extend(["--log", "json"].map(String::from));
        if self.options.in_process {
            command.push("--in-process".into());
        }
        // The run's scene contains what the command line of the study named or trusted.
        let solvers = &case.scene.solvers;
        if solvers.mpm.is_some() || solvers.dem.is_some() {
            command.push("--trust".into());
        }
        let log = beside("err");
        Ok(Start { command, log })
    }

    fn interrupted(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }
}

/// A run that left no summary, with its last words.
fn lost(start: &Start) -> Summary {
    let log = files::read_named_text(&start.log, SMALL).unwrap_or_default();
    let last = log.lines().rev().find(|line| !line.trim().is_empty());
    let event = last.and_then(|line| log::parse(line).0.pop());
    let why = match (&event, last) {
        (Some(event), _) => event.message(),
        (None, last) => last.unwrap_or("it said nothing"),
    };
    Summary {
        reason: Some(format!("the run left no summary, {TRIES} times; {why}")),
        ..Summary::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use coupler::record::summary::Spent;

    fn stepped(cpu: f64, wall: f64) -> Summary {
        Summary {
            status: coupler::record::summary::Status::Done,
            spent: Spent {
                stepping_cpu_s: [
                    ("mpm".to_owned(), 0.75 * cpu),
                    ("dem".to_owned(), 0.25 * cpu),
                ]
                .into(),
                stepping_wall_s: wall,
                ..Spent::default()
            },
            ..Summary::default()
        }
    }

    #[test]
    fn a_case_is_run_again_until_its_two_least_times_agree() {
        let mut timed = Timed::of(stepped(1.3, 4.0));
        assert!(timed.needs_more(), "one run shows no scatter");
        timed.add(stepped(1.0, 5.0));
        assert!(timed.needs_more());
        assert_eq!(timed.outcome.stepping_cpu(), 1.0);
        assert_eq!(timed.outcome.spent.stepping_wall_s, 4.0);
        // The two least need not be the last two.
        timed.add(stepped(2.0, 3.0));
        assert!(timed.needs_more());
        timed.add(stepped(1.04, 6.0));
        assert!(!timed.needs_more());
        assert_eq!(timed.times, [1.0, 1.04, 1.3, 2.0]);
        assert_eq!(timed.outcome.spent.stepping_wall_s, 3.0);
        // A run that fails is not timed again.
        timed.add(Summary::default());
        assert!(!timed.outcome.whole() && !timed.needs_more());
    }
}
