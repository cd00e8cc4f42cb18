//! Runs of the program, each in a directory named after what it runs: what is there already is not run again.

use std::fs;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use coupler::record::Summary;
use coupler::record::rundir::in_use;
use interface::files::{self, SMALL, STATE};
use rustix::process::{Pid, Signal, kill_process_group};

use crate::StudyError;
use crate::case::Case;

/// Time between two looks at a run.
const LOOK: Duration = Duration::from_millis(5);
/// Longest time for a run to end that was asked to.
const DRAINING: Duration = Duration::from_secs(30);
/// Characters of a hash that name a run: 64 bits.
const NAME: usize = 16;

/// How the runs of a study are started.
#[derive(Debug, Clone)]
pub struct RunnerOptions {
    /// The program, which has the subcommand `run`.
    pub program: PathBuf,
    /// Command in which `{}` stands for the command of a run, such as `srun -n1 {}`.
    pub launcher: Option<String>,
    /// Threads of each solver.
    pub threads: u16,
    /// Both solvers as threads of one process.
    pub in_process: bool,
    /// Whether the programs that a scene names as solvers may be started.
    pub trust: bool,
    /// Most runs at once.
    pub jobs: usize,
    /// Set from outside to end.
    pub interrupt: Arc<AtomicBool>,
}

/// Starts runs and finds what they left.
#[derive(Debug)]
pub struct Runner {
    options: RunnerOptions,
    launcher: Option<Launcher>,
    /// Directory of the runs.
    runs: PathBuf,
    /// Of the program itself: another build is another method.
    program_hash: blake3::Hash,
    started: AtomicUsize,
}

/// How often a case is run for its times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeat {
    /// Most runs of a case.
    pub most: usize,
    /// A case is run again until its two least CPU times of stepping are so near, as a share of the least.
    pub scatter: f64,
}

/// A case that was run, once or more often.
#[derive(Debug, Clone)]
pub struct Timed {
    /// What its runs have left: they differ in their times alone, of which these are the least.
    pub outcome: Summary,
    /// CPU time of stepping of each run in s, the least first.
    pub times: Vec<f64>,
}

impl Timed {
    fn of(outcome: Summary) -> Self {
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

    fn needs_more(&self, scatter: f64) -> bool {
        self.outcome.whole() && self.scatter().is_none_or(|s| s > scatter)
    }

    /// A run more. One that fails where others did not is what counts.
    fn add(&mut self, other: Summary) {
        self.times.push(other.stepping_cpu());
        self.times.sort_by(f64::total_cmp);
        let best = &mut self.outcome;
        if !other.whole() {
            *best = other;
            return;
        }
        best.wall_s = best.wall_s.min(other.wall_s);
        best.stepping_wall_s = best.stepping_wall_s.min(other.stepping_wall_s);
        if other.cpu() < best.cpu() {
            best.cpu_s = other.cpu_s.clone();
        }
        if other.stepping_cpu() < best.stepping_cpu() {
            best.stepping_cpu_s = other.stepping_cpu_s;
        }
    }
}

/// A command template.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Launcher {
    words: Vec<String>,
}

impl Launcher {
    fn parse(template: &str) -> Result<Self, StudyError> {
        let wrong = |what: &str| {
            let help = "write `--launcher \"srun -n1 {}\"`: `{}` stands for the command of a run";
            StudyError::asked(format!("--launcher {template}: {what}"), help)
        };
        let words = shlex::split(template).ok_or_else(|| wrong("not a command"))?;
        if !words.iter().any(|word| word.contains("{}")) {
            return Err(wrong("there is no `{}` in it"));
        }
        if words.first().is_some_and(|word| word == "{}") && words.len() > 1 {
            return Err(wrong("the run's command is not the launcher's first word"));
        }
        Ok(Self { words })
    }

    /// The command with the run's in place: as words of its own where `{}` is a word, quoted for a shell within one.
    fn around(&self, command: &[String]) -> Vec<String> {
        let quoted = || {
            let words = command.iter().map(String::as_str);
            shlex::try_join(words).expect("paths on a command line have no zero byte")
        };
        let fill = |word: &String| {
            if word == "{}" {
                command.to_vec()
            } else if word.contains("{}") {
                vec![word.replace("{}", &quoted())]
            } else {
                vec![word.clone()]
            }
        };
        self.words.iter().flat_map(fill).collect()
    }
}

impl Runner {
    /// A runner whose runs are in `out/runs`.
    ///
    /// # Errors
    /// The launcher is no template, the directory cannot be made, or the program cannot be read.
    pub fn new(options: RunnerOptions, out: &Path) -> Result<Self, StudyError> {
        let launcher = options
            .launcher
            .as_deref()
            .map(Launcher::parse)
            .transpose()?;
        let runs = out.join("runs");
        fs::create_dir_all(&runs).map_err(|error| {
            let what = format!("cannot create the directory {}: {error}", runs.display());
            StudyError::asked(what, "give another with `--out`")
        })?;
        // Launchers may work elsewhere.
        let runs = runs
            .canonicalize()
            .map_err(StudyError::file("find the directory", &runs))?;
        let program = files::read_named(&options.program, STATE)
            .map_err(StudyError::file("read the program", &options.program))?;
        Ok(Self {
            program_hash: blake3::hash(&program),
            options,
            launcher,
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
        self.options.jobs.max(1)
    }

    /// Name of a case's runs: of its scene, the program, and what else decides how long it takes.
    pub fn name(&self, case: &Case) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(case.scene.hash.as_bytes());
        hasher.update(self.program_hash.as_bytes());
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

    /// Runs a case, unless it has been.
    ///
    /// # Errors
    /// [`StudyError::Interrupted`], and files that cannot be written. A run that fails is an outcome.
    pub fn run(&self, case: &Case) -> Result<Summary, StudyError> {
        self.run_once(case, 0)
    }

    /// Runs cases as often as their times ask for, unless they have been. All cases are run before one is repeated, so that
    /// what else the machine does at a time falls on repetitions of many cases and not on all of one.
    ///
    /// # Errors
    /// Of [`Self::run`].
    pub fn timed(&self, cases: &[Case], repeat: Repeat) -> Result<Vec<Timed>, StudyError> {
        let first = self.each(cases, |case| {
            let outcome = self.run(case)?;
            let (said, cpu) = (outcome.status.name(), outcome.stepping_cpu());
            tracing::info!(
                "{}: {said}, {cpu:.4} s of CPU time of stepping",
                case.label(&[])
            );
            Ok(outcome)
        })?;
        let mut timed: Vec<Timed> = first.into_iter().map(Timed::of).collect();
        for again in 1..repeat.most {
            let open: Vec<usize> = (0..cases.len())
                .filter(|&k| timed[k].needs_more(repeat.scatter))
                .collect();
            if open.is_empty() {
                break;
            }
            tracing::info!("{} of {} runs are timed again", open.len(), cases.len());
            let others = self.each(&open, |&k| self.run_once(&cases[k], again))?;
            for (k, other) in open.into_iter().zip(others) {
                timed[k].add(other);
            }
        }
        Ok(timed)
    }

    /// Works on items, as many at once as runs may be, in their order as far as that goes.
    ///
    /// # Errors
    /// The first that `work` gave.
    pub fn each<T: Sync, R: Send>(
        &self,
        items: &[T],
        work: impl Fn(&T) -> Result<R, StudyError> + Sync,
    ) -> Result<Vec<R>, StudyError> {
        let next = AtomicUsize::new(0);
        let done: Mutex<Vec<Option<R>>> = Mutex::new(items.iter().map(|_| None).collect());
        let error = Mutex::new(None);
        thread::scope(|scope| {
            for _ in 0..self.jobs().min(items.len()) {
                scope.spawn(|| {
                    loop {
                        let k = next.fetch_add(1, Ordering::Relaxed);
                        let Some(item) = items.get(k) else { break };
                        match work(item) {
                            Ok(result) => done.lock().expect("no thread panics")[k] = Some(result),
                            Err(e) => {
                                error.lock().expect("no thread panics").get_or_insert(e);
                                // The others find no more runs to start.
                                next.fetch_max(items.len(), Ordering::Relaxed);
                                break;
                            }
                        }
                    }
                });
            }
        });
        if let Some(error) = error.into_inner().expect("no thread panics") {
            return Err(error);
        }
        let done = done.into_inner().expect("no thread panics");
        Ok(done.into_iter().flatten().collect())
    }

    fn run_once(&self, case: &Case, repeat: usize) -> Result<Summary, StudyError> {
        if self.interrupted() {
            return Err(StudyError::Interrupted);
        }
        let directory = self.directory(case, repeat);
        let is_ours = |outcome: &Summary| outcome.scene_hash == case.scene.hash;
        let known = Summary::read(&directory).ok();
        if let Some(known) = known.filter(|o| o.settled() && is_ours(o)) {
            return Ok(known);
        }
        let programs = case.scene.programs();
        if let Some((side, command)) = programs.first().filter(|_| !self.options.trust) {
            let what = format!("the scene would start a program as its {side}: {command}");
            return Err(StudyError::asked(what, "look at it, then give `--trust`"));
        }
        if in_use(&directory) {
            let what = format!("a run that was started before uses {}", directory.display());
            return Err(StudyError::asked(what, "wait for its end, or end it"));
        }
        self.started.fetch_add(1, Ordering::Relaxed);
        let beside = |extension: &str| directory.with_extension(extension);
        // What is run is the text that was hashed, whatever becomes of the scene's own file meanwhile.
        let scene = beside("toml");
        files::write_named(&scene, &case.scene.resolved_toml)
            .map_err(StudyError::file("write", &scene))?;
        // The summary of an unfinished run would be taken for that of this one.
        let _ = files::remove(&directory, "summary.json");
        let log = beside("err");
        let mut command = self.command(&scene, &directory);
        let solvers = &case.scene.solvers;
        if solvers.mpm.is_some() || solvers.dem.is_some() {
            // The run's scene contains what the command line of the study named or trusted.
            command.push("--trust".into());
        }
        let command = self.launched(command);
        let ended = self.wait(&command, &log)?;
        if self.interrupted() {
            // A launcher may have ended before its run.
            let began = Instant::now();
            while in_use(&directory) && began.elapsed() < DRAINING {
                thread::sleep(LOOK);
            }
        }
        let outcome = Summary::read(&directory).unwrap_or_else(|_| {
            let said = files::read_named_text(&log, SMALL).unwrap_or_default();
            let last = said.lines().rev().find(|line| !line.trim().is_empty());
            lost(format!(
                "{ended}; {}",
                last.map_or("it said nothing".into(), message_of)
            ))
        });
        if outcome.status == coupler::record::summary::Status::Interrupted || self.interrupted() {
            return Err(StudyError::Interrupted);
        }
        Ok(outcome)
    }

    fn command(&self, scene: &Path, directory: &Path) -> Vec<String> {
        let text = |path: &Path| path.to_string_lossy().into_owned();
        let mut command = vec![
            text(&self.options.program),
            "run".into(),
            text(scene),
            "--out".into(),
            text(directory),
            "--threads".into(),
            self.options.threads.to_string(),
            "--log".into(),
            "json".into(),
        ];
        if self.options.in_process {
            command.push("--in-process".into());
        }
        command
    }

    /// The same as the launcher starts it.
    fn launched(&self, command: Vec<String>) -> Vec<String> {
        match &self.launcher {
            Some(launcher) => launcher.around(&command),
            None => command,
        }
    }

    /// Starts a command and waits for its end; an interrupt is passed on.
    fn wait(&self, command: &[String], log: &Path) -> Result<String, StudyError> {
        let (program, arguments) = command.split_first().expect("a command has a first word");
        let said = files::make_named(log).map_err(StudyError::file("create", log))?;
        let mut child = Command::new(program)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(said)
            // A launcher is interrupted together with its run, and Ctrl-C from the terminal reaches the run once.
            .process_group(0)
            .spawn()
            .map_err(StudyError::file("start", Path::new(program)))?;
        let mut told = false;
        loop {
            let looked = child.try_wait();
            if let Some(status) =
                looked.map_err(StudyError::file("wait for", Path::new(program)))?
            {
                return Ok(in_words(status));
            }
            if self.interrupted() && !told {
                told = true;
                interrupt(&child);
            }
            thread::sleep(LOOK);
        }
    }

    fn interrupted(&self) -> bool {
        self.options.interrupt.load(Ordering::Relaxed)
    }
}

/// Asks a run, and a launcher with it, to drain. It may have ended meanwhile, which the next look finds out.
fn interrupt(child: &Child) {
    if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        let _ = kill_process_group(pid, Signal::TERM);
    }
}

fn in_words(status: ExitStatus) -> String {
    format!("the run left no summary ({status})")
}

/// What a line of a run's log says.
fn message_of(line: &str) -> String {
    let event: Option<serde_json::Value> = serde_json::from_str(line).ok();
    let message = event.and_then(|event| Some(event["fields"]["message"].as_str()?.to_owned()));
    message.unwrap_or_else(|| line.to_owned())
}

/// A run that left no summary.
fn lost(reason: String) -> Summary {
    Summary {
        reason: Some(reason),
        ..Summary::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command() -> Vec<String> {
        ["tandem", "run", "a b.toml"].map(String::from).to_vec()
    }

    fn stepped(cpu: f64, wall: f64) -> Summary {
        Summary {
            status: coupler::record::summary::Status::Done,
            stepping_cpu_s: [
                ("mpm".to_owned(), 0.75 * cpu),
                ("dem".to_owned(), 0.25 * cpu),
            ]
            .into(),
            stepping_wall_s: wall,
            ..Summary::default()
        }
    }

    #[test]
    fn a_case_is_run_again_until_its_two_least_times_agree() {
        let mut timed = Timed::of(stepped(1.3, 4.0));
        assert!(timed.needs_more(0.05), "one run shows no scatter");
        timed.add(stepped(1.0, 5.0));
        assert!(timed.needs_more(0.05));
        assert_eq!(timed.outcome.stepping_cpu(), 1.0);
        assert_eq!(timed.outcome.stepping_wall_s, 4.0);
        // The two least need not be the last two.
        timed.add(stepped(2.0, 3.0));
        assert!(timed.needs_more(0.05));
        timed.add(stepped(1.04, 6.0));
        assert!(!timed.needs_more(0.05) && timed.needs_more(0.03));
        assert_eq!(timed.times, [1.0, 1.04, 1.3, 2.0]);
        assert_eq!(timed.outcome.stepping_wall_s, 3.0);
        // A run that fails is not timed again.
        timed.add(lost("killed".into()));
        assert!(!timed.outcome.whole() && !timed.needs_more(0.0));
    }

    #[test]
    fn a_template_takes_the_command_as_words_or_quoted() {
        let launcher = Launcher::parse("srun -n1 --exclusive {}").unwrap();
        assert_eq!(
            launcher.around(&command()),
            ["srun", "-n1", "--exclusive", "tandem", "run", "a b.toml"]
        );
        let shell = Launcher::parse("sh -c 'exec {} 2>&1'").unwrap();
        assert_eq!(
            shell.around(&command()),
            ["sh", "-c", "exec tandem run 'a b.toml' 2>&1"]
        );
        assert_eq!(Launcher::parse("{}").unwrap().around(&command()), command());
    }

    #[test]
    fn a_template_without_a_place_for_the_command_is_refused() {
        for (template, phrase) in [
            ("srun -n1", "there is no `{}`"),
            ("srun 'x", "not a command"),
            ("", "there is no `{}`"),
            ("{} -n1", "first word"),
        ] {
            let said = Launcher::parse(template).unwrap_err().to_string();
            assert!(said.contains(phrase), "{template}: {said}");
        }
    }
}
