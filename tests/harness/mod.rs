//! Runs the real binary in a place of its own and watches what it leaves behind.
//!
//! Every run gets its own `TANDEM_RUNTIME_DIR`, so that the directories and segments that a test sees are of its own runs only, and
//! every wait has a limit, so that nothing hangs. The limits are no claims about speed: they separate "late" from "never".

pub mod bits;
pub mod browser;
pub mod needs;
pub mod seen;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

use needs::Need;

/// The scene of most tests: a disc of points hits one that is a body.
pub const HARD: &str = "jiang2020/collision_hard";
/// Some hundredths of a second of it, or of any scene of the catalogue.
pub const QUICK: &str = "--variant quick";
/// Longest wait for anything that is sure to come, on a machine that does much else.
pub const PATIENCE: Duration = Duration::from_mins(10);
/// Time between two looks.
const LOOK: Duration = Duration::from_millis(2);

/// Whether solvers in Python can run here; notes if not.
pub fn python_can_join() -> bool {
    let python = Command::new("python3")
        .args(["-c", "import iceoryx2"])
        .output();
    let can = python.is_ok_and(|python| python.status.success());
    Need::Python.is_met(can, "python3 cannot import iceoryx2: python/README.md")
}

/// Runs `python3` with the readers and the packages of this tree, and the program as `$TANDEM`; `None` where it cannot import
/// `modules`.
pub fn python(modules: &str, arguments: &[&str]) -> Option<Vec<u8>> {
    let mut path = root().join("target/readers").into_os_string();
    for more in [
        Some(root().join("python").into_os_string()),
        std::env::var_os("PYTHONPATH"),
    ] {
        path.push(":");
        path.push(more.unwrap_or_default());
    }
    let python = |arguments: &[&str]| {
        let mut python = Command::new("python3");
        python
            .env("PYTHONPATH", &path)
            .env("TANDEM", env!("CARGO_BIN_EXE_tandem"))
            .args(arguments)
            .output()
            .unwrap()
    };
    let import = python(&["-c", &format!("import {modules}")]);
    let need = match modules {
        "PIL" => Need::Paraview,
        _ => Need::Vtk,
    };
    let why = format!("python3 cannot import {modules}: .ci/run installs them");
    if !need.is_met(import.status.success(), &why) {
        return None;
    }
    let ended = python(arguments);
    let output = String::from_utf8_lossy(&ended.stdout) + String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{output}");
    Some(ended.stdout)
}

/// The root of the workspace.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A scene of the catalogue.
pub fn scene(name: &str) -> String {
    let path = root().join("scenes").join(name).with_extension("toml");
    path.to_str()
        .expect("the workspace has a UTF-8 path")
        .into()
}

/// Every scene file of the catalogue, sorted.
pub fn catalogue() -> Vec<PathBuf> {
    let mut files = files_below(&root().join("scenes"));
    files.retain(|path| path.extension().is_some_and(|e| e == "toml"));
    files
}

/// All files below a folder, sorted.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files_below(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The words of a line of shell.
pub fn words(line: &str) -> Vec<String> {
    shlex::split(line).expect("quotes are closed")
}

/// A word as a shell takes it, whatever is in it.
pub fn quoted(word: &str) -> Cow<'_, str> {
    shlex::try_quote(word).expect("no zero byte")
}

/// A corner of the machine for the runs of one test.
pub struct Place {
    dir: TempDir,
    /// Where the directories of its runs are.
    runs: TempDir,
}

impl Place {
    /// An empty one.
    pub fn new() -> Self {
        let new = || tempfile::Builder::new().prefix("tt").to_owned();
        Self {
            dir: new().tempdir().expect("a temporary directory"),
            runs: new()
                .tempdir_in("/dev/shm")
                .expect("a directory beside shared memory"),
        }
    }

    /// A path in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Writes a file in it.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).unwrap();
        path
    }

    /// What lies in it, but for the harness's own files.
    pub fn content(&self) -> BTreeSet<String> {
        let ours = |name: &String| !name.starts_with("stream-");
        names(self.dir.path()).into_iter().filter(ours).collect()
    }

    /// Where the runs of this place have their directories.
    pub fn temporary_path(&self) -> &Path {
        self.runs.path()
    }

    /// Directories of runs of this place.
    pub fn temporary(&self) -> BTreeSet<String> {
        names(self.temporary_path())
    }

    /// Processes that were started by a run of this place, whoever their parent is now.
    pub fn processes(&self) -> Vec<u32> {
        let mark = format!("TANDEM_RUNTIME_DIR={}", self.temporary_path().display());
        let ours = |pid: &u32| {
            fs::read(format!("/proc/{pid}/environ")).is_ok_and(|text| {
                text.split(|&b| b == 0)
                    .any(|entry| entry == mark.as_bytes())
            })
        };
        let pids = names(Path::new("/proc")).into_iter();
        pids.filter_map(|name| name.parse().ok())
            .filter(ours)
            .collect()
    }

    /// Starts the program with a line of arguments, as one types it, its streams in files of this place.
    pub fn start(&self, line: &str) -> Running<'_> {
        self.start_by(&[], line)
    }

    /// The same by the words of another program, which starts it in its turn.
    pub fn start_by(&self, by: &[&str], line: &str) -> Running<'_> {
        let line = words(line);
        let mut all = [by, &[env!("CARGO_BIN_EXE_tandem")]].concat();
        all.extend(line.iter().map(String::as_str));
        self.start_as(Path::new(all[0]), &all[1..])
    }

    /// The same by a shell, after a line of it.
    pub fn start_after(&self, script: &str, line: &str) -> Running<'_> {
        let script = format!("{script} && exec \"$@\"");
        self.start_by(&["sh", "-c", &script, "sh"], line)
    }

    /// The same, to its end.
    pub fn tandem(&self, line: &str) -> Ended {
        self.start(line).end()
    }

    /// `tandem run` of a scene with `--out` to the run directory `out`, and JSON logs.
    pub fn start_run(&self, out: &str, scene: &str, more: &str) -> Running<'_> {
        let out = self.path(out);
        self.start(&format!(
            "run '{scene}' --log json --out '{}' {more}",
            out.display()
        ))
    }

    /// As [`Self::start_run`], to its end.
    pub fn run(&self, out: &str, scene: &str, more: &str) -> Ended {
        self.start_run(out, scene, more).end()
    }

    /// The hash of the state at the end of the run in `out`.
    #[track_caller]
    pub fn state_hash(&self, out: &str) -> String {
        RunFiles::read(&self.path(out)).text("state_hash").into()
    }

    /// As [`Self::start`], another build of the program.
    pub fn start_as<W: AsRef<OsStr>>(&self, program: &Path, arguments: &[W]) -> Running<'_> {
        let stream = |kind: &str| {
            let file = tempfile::Builder::new()
                .prefix(&format!("stream-{kind}-"))
                .tempfile_in(self.dir.path())
                .unwrap();
            file.keep().unwrap()
        };
        let ((stdout, stdout_path), (stderr, stderr_path)) = (stream("out"), stream("err"));
        let child = Command::new(program)
            .args(arguments)
            .env("TANDEM_RUNTIME_DIR", self.temporary_path())
            .current_dir(self.dir.path())
            .stdin(Stdio::null())
            .stdout(stdout)
            .stderr(stderr)
            .spawn()
            .expect("the program starts");
        Running {
            place: self,
            child,
            started: Instant::now(),
            runs: BTreeSet::new(),
            stdout: stdout_path,
            stderr: stderr_path,
        }
    }

    /// Asserts that no process and no temporary directory of any run of this place is there any more, and no segment
    /// of the runs of these ids.
    pub fn assert_clean(&self, runs: &BTreeSet<String>) {
        // A killed process is not gone before its parent has collected it; an orphan's parent is not ours.
        let processes = until(PATIENCE, || self.processes().is_empty().then_some(()));
        assert!(processes.is_some(), "still running: {:?}", self.processes());
        assert!(
            self.temporary().is_empty(),
            "left in the temporary directory: {:?}",
            self.temporary()
        );
        let left = segments(runs);
        assert!(left.is_empty(), "left in shared memory: {left:?}");
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // After a failed test: what it started is ended, and the program sweeps what that left.
        for pid in self.processes() {
            signal(pid, "KILL");
        }
        if !self.temporary().is_empty() {
            let _ = self.tandem("clean");
        }
    }
}

/// The program at work.
pub struct Running<'a> {
    place: &'a Place,
    child: Child,
    started: Instant,
    runs: BTreeSet<String>,
    stdout: PathBuf,
    stderr: PathBuf,
}

/// The exit status of the program and its output.
#[derive(Debug)]
pub struct Ended {
    /// How.
    pub status: ExitStatus,
    /// Its standard output.
    pub stdout: String,
    /// Its standard error.
    pub stderr: String,
    /// From start to end.
    pub took: Duration,
    /// Ids of the runs that were seen to begin.
    pub runs: BTreeSet<String>,
}

impl Running<'_> {
    /// Its process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Process id of a solver, from the run's log in `out`.
    pub fn solver(&mut self, out: &str, party: &str) -> u32 {
        let joined = |line: &Value| {
            let fields = &line["fields"];
            (fields["message"] == "joined" && fields["party"] == party)
                .then(|| fields["pid"].as_u64().expect("`joined` has a pid"))
        };
        self.logged(out, joined) as u32
    }

    /// Waits until all sides have begun to step.
    pub fn stepping(&mut self, out: &str) {
        for party in ["mpm", "dem"] {
            self.logged(out, |line| {
                let fields = &line["fields"];
                (fields["message"] == "ready" && fields["party"] == party).then_some(())
            });
        }
    }

    /// Waits until the history in `out` has rows.
    pub fn has_rows(&self, out: &str) {
        let history = self.place.path(out).join("history.csv");
        let rows = || fs::read_to_string(&history).map_or(0, |text| text.lines().count());
        until(PATIENCE, || (rows() > 2).then_some(())).expect("rows are written");
    }

    /// Waits for a line of the log in `out`.
    fn logged<T>(&mut self, out: &str, find: impl Fn(&Value) -> Option<T>) -> T {
        let log = self.place.path(out).join("log.jsonl");
        let found = until(PATIENCE, || {
            self.watch();
            if let Ok(Some(status)) = self.child.try_wait() {
                panic!("the run ended ({status}): {}", read(&self.stderr));
            }
            // The last line may be half written.
            let lines = fs::read_to_string(&log).unwrap_or_default();
            let mut lines = lines
                .lines()
                .filter_map(|line| serde_json::from_str(line).ok());
            lines.find_map(|line| find(&line))
        });
        found.expect("the line comes")
    }

    /// What is on standard output so far.
    pub fn output(&self) -> String {
        read(&self.stdout)
    }

    /// Notes the ids of runs under way.
    fn watch(&mut self) {
        let names = self.place.temporary();
        self.runs
            .extend(names.iter().filter_map(|name| run_of(name)));
    }

    /// Ids of the runs that were seen so far.
    pub fn runs(&mut self) -> BTreeSet<String> {
        self.watch();
        self.runs.clone()
    }

    /// Whether it has ended.
    pub fn is_over(&mut self) -> bool {
        self.watch();
        !matches!(self.child.try_wait(), Ok(None))
    }

    /// Waits for the end.
    pub fn end(self) -> Ended {
        self.end_within(PATIENCE)
    }

    /// Waits for the end, which comes within `limit`.
    pub fn end_within(mut self, limit: Duration) -> Ended {
        let ended = until(limit, || {
            self.watch();
            self.child.try_wait().unwrap()
        });
        let Some(status) = ended else {
            let busy = processes_of(self.pid());
            let _ = self.child.kill();
            panic!("not over after {limit:?}: {}\n{busy}", read(&self.stderr));
        };
        Ended {
            status,
            stdout: read(&self.stdout),
            stderr: read(&self.stderr),
            took: self.started.elapsed(),
            runs: std::mem::take(&mut self.runs),
        }
    }
}

/// What a process and those that it has started are doing: what they were started as, and for each thread its state, its
/// CPU time in ticks of the system, and the call of the system that it is in.
fn processes_of(pid: u32) -> String {
    let of = |name: &str| fs::read_to_string(format!("/proc/{pid}/{name}")).unwrap_or_default();
    let mut text = format!("{pid}: {}\n", of("cmdline").replace('\0', " "));
    let threads = fs::read_dir(format!("/proc/{pid}/task"));
    for thread in threads.into_iter().flatten().flatten() {
        let of = |name: &str| fs::read_to_string(thread.path().join(name)).unwrap_or_default();
        let stat = of("stat");
        let fields: Vec<&str> = stat.rsplit(") ").next().unwrap().split(' ').collect();
        let [state, user, system] = [0, 11, 12].map(|i| fields.get(i).copied().unwrap_or("?"));
        let (name, call) = (of("comm"), of("syscall"));
        let (name, call) = (name.trim(), call.trim());
        let thread = [
            name,
            ": ",
            state,
            ", ",
            user,
            " user, ",
            system,
            " system, in ",
            call,
        ];
        text.extend(["  ", &thread.concat(), "\n"]);
    }
    text + &children(pid)
        .into_iter()
        .map(processes_of)
        .collect::<String>()
}

/// The processes that the threads of a process have started.
pub fn children(pid: u32) -> Vec<u32> {
    let threads = fs::read_dir(format!("/proc/{pid}/task"));
    let threads = threads.into_iter().flatten().flatten();
    let of = |thread: fs::DirEntry| fs::read_to_string(thread.path().join("children"));
    let all: String = threads.filter_map(|thread| of(thread).ok()).collect();
    all.split_whitespace()
        .filter_map(|pid| pid.parse().ok())
        .collect()
}

/// The id of the run whose directory has this name, `tandem-ID`, or whose directory it is about to be, `tandem-ID.PID`.
pub fn run_of(name: &str) -> Option<String> {
    let id = name.strip_prefix("tandem-")?.split('.').next()?;
    Some(id.to_string())
}

impl Drop for Running<'_> {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            let _ = self.child.kill();
        }
        let _ = self.child.wait();
    }
}

impl Ended {
    /// Asserts the exit code.
    #[track_caller]
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(self.status.code(), Some(code), "{self:#?}");
        self
    }

    /// Asserts that standard error has all these phrases.
    #[track_caller]
    pub fn says(self, phrases: &[&str]) -> Self {
        for phrase in phrases {
            has(&self.stderr, phrase);
        }
        self
    }

    /// The signal that ended it.
    pub fn signal(&self) -> Option<i32> {
        self.status.signal()
    }
}

/// What a run directory has.
pub struct RunFiles {
    /// Where.
    pub dir: PathBuf,
    /// `summary.json`.
    pub summary: Value,
}

impl RunFiles {
    /// Of a run directory with a summary.
    #[track_caller]
    pub fn read(dir: &Path) -> Self {
        let text = fs::read_to_string(dir.join("summary.json"))
            .unwrap_or_else(|e| panic!("no summary in {}: {e}", dir.display()));
        Self {
            dir: dir.into(),
            summary: serde_json::from_str(&text).expect("the summary is JSON"),
        }
    }

    /// A number of the summary.
    #[track_caller]
    pub fn number(&self, key: &str) -> f64 {
        self.summary[key]
            .as_f64()
            .unwrap_or_else(|| panic!("`{key}` is {}", self.summary[key]))
    }

    /// A text of the summary.
    #[track_caller]
    pub fn text(&self, key: &str) -> &str {
        self.summary[key]
            .as_str()
            .unwrap_or_else(|| panic!("`{key}` is {}", self.summary[key]))
    }

    /// A check's verdict.
    #[track_caller]
    pub fn check(&self, name: &str) -> &Value {
        let checks = self.summary["checks"].as_array().expect("checks");
        checks
            .iter()
            .find(|check| check["name"] == name)
            .unwrap_or_else(|| panic!("no check `{name}`"))
    }

    /// `history.csv`.
    #[track_caller]
    pub fn history(&self) -> History {
        History::read(&self.dir.join("history.csv"))
    }
}

/// `history.csv`, read back.
#[derive(Debug, PartialEq)]
pub struct History {
    /// Columns as `name [unit]`.
    pub header: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<f64>>,
}

impl History {
    /// Reads a file; every row is whole and ends with a line feed.
    #[track_caller]
    pub fn read(path: &Path) -> Self {
        let text = read(path);
        assert!(text.ends_with('\n'), "the last row is cut off: {text:?}");
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let header = reader.headers().expect("a header");
        let header = header.iter().map(String::from).collect();
        // Rows of another length are an error.
        let rows = reader.deserialize().map(|row| row.expect("numbers"));
        let rows = rows.collect();
        Self { header, rows }
    }

    /// A column by its name and unit.
    #[track_caller]
    pub fn column(&self, name: &str) -> Vec<f64> {
        let k = self.header.iter().position(|column| column == name);
        let k = k.unwrap_or_else(|| panic!("no column `{name}` in {:?}", self.header));
        self.rows.iter().map(|row| row[k]).collect()
    }

    /// Asserts what holds of every history: finite numbers, increasing times from 0 on.
    #[track_caller]
    pub fn assert_sound(&self) {
        assert!(
            self.rows.iter().flatten().all(|n| n.is_finite()),
            "a number is not finite"
        );
        let times = self.column("time [s]");
        assert_eq!(
            times.first(),
            Some(&0.0),
            "the first row is that of the start"
        );
        assert!(
            times.windows(2).all(|pair| pair[0] < pair[1]),
            "times do not increase"
        );
    }
}

/// Asserts that a text has these words.
#[track_caller]
pub fn has(text: &str, words: &str) {
    assert!(text.contains(words), "no `{words}` in: {text}");
}

/// Does all of the work, so many pieces at a time; results in the order of the work.
pub fn at_once<W: Sync, R: Send>(
    pieces: usize,
    work: &[W],
    one: impl Fn(&W) -> R + Sync,
) -> Vec<R> {
    let (next, results) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..pieces {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    let Some(piece) = work.get(k) else { break };
                    let result = one(piece);
                    results.lock().unwrap().push((k, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap();
    results.sort_by_key(|(k, _)| *k);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Looks until something is found, for `limit` at most.
pub fn until<T>(limit: Duration, mut look: impl FnMut() -> Option<T>) -> Option<T> {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return Some(found);
        }
        if start.elapsed() > limit {
            return None;
        }
        std::thread::sleep(LOOK);
    }
}

/// Sends a signal by its name.
pub fn signal(pid: u32, name: &str) {
    let command = format!("kill -{name} {pid}");
    let status = Command::new("sh")
        .args(["-c", &command])
        .stderr(Stdio::null())
        .status();
    assert!(status.is_ok(), "no shell to send signals with");
}

/// What a file has that no command may touch.
pub const MINE: &str = "a file of somebody who has nothing to do with the run\n";

/// A run with every file that a run can have.
pub fn whole_run(place: &Place, out: &str) {
    let more = "--record --report --variant quick --set mpm.points.0.spacing.per_cell=4 \
        --set time.end=7e-3 --set output.every=2e-4 --set output.frames=2e-3 \
        --set output.checkpoint.time=1e-3";
    let hard = scene("jiang2020/collision_hard");
    place.run(out, &hard, more).expect(0);
}

/// A copy of a directory.
pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).unwrap();
        }
    }
}

/// How many runs of a study in `out` have a summary.
pub fn summaries(out: &Path) -> usize {
    let entries = fs::read_dir(out.join("runs"))
        .into_iter()
        .flatten()
        .flatten();
    entries
        .filter(|e| e.path().join("summary.json").exists())
        .count()
}

/// Whether a process is there; one that has ended and is not collected yet is not.
pub fn lives(pid: u32) -> bool {
    fs::read_to_string(format!("/proc/{pid}/stat")).is_ok_and(|stat| {
        // The state follows the program's name, which is in parentheses.
        stat.rsplit_once(')')
            .is_some_and(|(_, rest)| !rest.trim_start().starts_with(['Z', 'X']))
    })
}

/// Segments in shared memory of the runs of these ids.
pub fn segments(runs: &BTreeSet<String>) -> Vec<String> {
    let of_a_run = |name: &String| {
        runs.iter()
            .any(|id| name.starts_with(&format!("tandem_{id}_")))
    };
    names(Path::new("/dev/shm"))
        .into_iter()
        .filter(of_a_run)
        .collect()
}

/// A number in `0..below` that differs from call to call.
pub fn dice(below: u64) -> u64 {
    use std::hash::{BuildHasher, Hasher, RandomState};
    RandomState::new().build_hasher().finish() % below
}

fn names(dir: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(dir).into_iter().flatten().flatten();
    entries
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect()
}

#[track_caller]
fn read(path: &Path) -> String {
    // Opened as a file first: its error names what is wrong better than a missing text.
    File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
