//! The program at work: its processes, signals to them, and what they leave behind.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, OpenOptions};
use std::io::{self, PipeReader};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::error::{ChaosError, file};
use crate::kind::{Act, Plan, Room, Target};

/// Where runs have their directories in shared memory, if it is set; as the program reads it.
const RUNTIME_DIR: &str = "TANDEM_RUNTIME_DIR";
/// Marks the processes of a round, whoever their parent is.
const MARK: &str = "TANDEM_CHAOS_MARK";
const SHARED_MEMORY: &str = "/dev/shm";
/// Time between two looks.
const LOOK: Duration = Duration::from_micros(500);
/// A run that has not ended by then hangs: longer than any limit of the protocol that can matter here.
const HANGS: Duration = Duration::from_secs(90);
/// Longest time for processes to be gone whose run has ended.
const GONE: Duration = Duration::from_secs(10);
/// What a shell says when a program could not even be started there.
const NO_MOUNT: i32 = 99;

/// A directory in shared memory for the runs of chaos alone.
#[derive(Debug)]
pub struct RunArea {
    path: PathBuf,
    /// Runs that were seen, with the process of their coupler.
    seen: Mutex<BTreeMap<String, Option<u32>>>,
}

impl RunArea {
    /// A new one.
    ///
    /// # Errors
    /// [`ChaosError::File`].
    pub fn create() -> Result<Self, ChaosError> {
        let path = Path::new(SHARED_MEMORY).join(format!("tc{}", std::process::id()));
        fs::create_dir_all(&path).map_err(file("create", &path))?;
        Ok(Self {
            path,
            seen: Mutex::default(),
        })
    }

    /// Notes runs that are there.
    fn watch(&self) {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        for name in names(&self.path) {
            let Some(id) = name.strip_prefix("tandem-") else {
                continue;
            };
            let coupler = seen.entry(id.to_owned()).or_default();
            if coupler.is_none() {
                let noted = fs::read_to_string(self.path.join(&name).join("pid-coupler"));
                *coupler = noted.ok().and_then(|pid| pid.parse().ok());
            }
        }
    }

    /// What is there of the runs of these couplers.
    fn left_by(&self, couplers: &BTreeSet<u32>) -> Vec<String> {
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        let theirs = |coupler: &Option<u32>| coupler.is_some_and(|pid| couplers.contains(&pid));
        let ids = seen.iter().filter(|(_, coupler)| theirs(coupler));
        self.traces(ids.map(|(id, _)| id.as_str()))
    }

    /// Removes what the run of this coupler has in shared memory; whether there was something.
    fn unlink(&self, coupler: u32) -> bool {
        let left = self.left_by(&BTreeSet::from([coupler]));
        // First the segments: without its directory nobody would find them.
        for name in left.iter().filter(|name| name.starts_with("tandem_")) {
            let _ = fs::remove_file(Path::new(SHARED_MEMORY).join(name));
        }
        for name in left.iter().filter(|name| name.starts_with("tandem-")) {
            let _ = fs::remove_dir_all(self.path.join(name));
        }
        left.len() > 1
    }

    /// What is there of any run.
    pub fn left(&self) -> Vec<String> {
        self.watch();
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        self.traces(seen.keys().map(String::as_str))
    }

    fn traces<'a>(&self, ids: impl Iterator<Item = &'a str>) -> Vec<String> {
        let segments = names(Path::new(SHARED_MEMORY));
        let mut left = Vec::new();
        for id in ids {
            let (root, prefix) = (format!("tandem-{id}"), format!("tandem_{id}_"));
            if self.path.join(&root).exists() {
                left.push(root);
            }
            left.extend(
                segments
                    .iter()
                    .filter(|name| name.starts_with(&prefix))
                    .cloned(),
            );
        }
        left
    }
}

impl Drop for RunArea {
    fn drop(&mut self) {
        // Leftovers have been reported.
        let _ = fs::remove_dir_all(&self.path);
    }
}

/// The program and the scene.
#[derive(Debug)]
pub struct Program<'a> {
    file: PathBuf,
    scene: Vec<String>,
    area: &'a RunArea,
}

impl<'a> Program<'a> {
    /// Runs of `scene` whose directories are in `area`.
    pub fn new(program: &Path, scene: &[String], area: &'a RunArea) -> Self {
        Self {
            file: program.to_path_buf(),
            scene: scene.to_vec(),
            area,
        }
    }

    /// The words of a run in `dir`.
    pub fn run(&self, dir: &Path) -> Vec<String> {
        let how = ["--log", "json", "--out", &dir.to_string_lossy()].map(String::from);
        let run = std::iter::once("run".to_owned());
        run.chain(self.scene.iter().cloned()).chain(how).collect()
    }

    /// The words that go on with a run.
    pub fn resume(&self, dir: &Path) -> Vec<String> {
        ["resume", &dir.to_string_lossy(), "--log", "json"]
            .map(String::from)
            .to_vec()
    }

    /// Removes what dead runs have left.
    pub fn clean(&self) {
        let cleaned = self.sweep().and_then(|mut sweep| sweep.wait());
        if let Err(error) = cleaned {
            tracing::warn!("cannot clean: {error}");
        }
    }

    fn sweep(&self) -> io::Result<Child> {
        Command::new(&self.file)
            .arg("clean")
            .env(RUNTIME_DIR, &self.area.path)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
    }

    /// Starts the program with these words, and what happens to it; `more` are further words. What it says on standard
    /// error goes to a file beside `dir`.
    ///
    /// # Errors
    /// [`ChaosError::File`].
    pub fn start(
        &self,
        mut words: Vec<String>,
        dir: &Path,
        plan: Option<&Plan>,
        more: &[&str],
    ) -> Result<Running<'_>, ChaosError> {
        words.extend(more.iter().map(|&word| word.to_owned()));
        words.insert(0, self.file.to_string_lossy().into_owned());
        let room = plan.map_or(Room::Enough, |plan| plan.room);
        let words = in_little_room(words, room, dir);
        let log = dir.with_extension("err");
        let said = OpenOptions::new().create(true).append(true).open(&log);
        let said = said.map_err(file("create", &log))?;
        let said_before = said.metadata().map_or(0, |said| said.len());
        let (reader, stderr) = if plan.is_some_and(|plan| plan.unread) {
            let (reader, writer) = full_pipe().map_err(file("fill a pipe for", &log))?;
            (Some(reader), writer)
        } else {
            (None, said.into())
        };
        let mark = dir.to_string_lossy().into_owned();
        let mut command = Command::new(&words[0]);
        command
            .args(&words[1..])
            .env(RUNTIME_DIR, &self.area.path)
            .env(MARK, &mark)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(stderr);
        if matches!(room, Room::Memory(_)) {
            // The small one is where runs have their directories.
            command.env_remove(RUNTIME_DIR);
        }
        let child = command.spawn().map_err(file("start", &self.file))?;
        Ok(Running {
            program: self,
            child,
            mark,
            acts: plan.map(|plan| plan.acts.clone()).unwrap_or_default(),
            coupler_stopped: false,
            unlink: plan.and_then(|plan| plan.unlink),
            sweeps: plan.is_some_and(|plan| plan.sweeps),
            sweep: None,
            solvers: BTreeMap::new(),
            log,
            said_before,
            _unread: reader,
        })
    }

    /// What is there of the runs of these couplers, once it has had time to go.
    pub fn left_by(&self, couplers: &BTreeSet<u32>) -> Vec<String> {
        let began = Instant::now();
        loop {
            let left = self.area.left_by(couplers);
            // Another process may be removing the same files.
            if left.is_empty() || began.elapsed() > GONE {
                return left;
            }
            thread::sleep(LOOK);
        }
    }
}

/// The words in a shell that leaves them little room.
fn in_little_room(words: Vec<String>, room: Room, dir: &Path) -> Vec<String> {
    let script = match room {
        Room::Enough => return words,
        Room::File(kib) => {
            let script = format!("ulimit -f {} && exec \"$@\"", 2 * kib);
            return shell(&["sh", "-c", &script, "sh"], words);
        }
        // The files are copied from the small disk, because it is unmounted when the shell ends.
        Room::Disk(kib) => format!(
            "mkdir -p \"$0\" && mount -t tmpfs -o size={kib}k tmpfs \"$0\" || exit {NO_MOUNT}; \
             \"$@\"; code=$?; mount -o remount,size=1g \"$0\"; cp -a \"$0\" \"$0.kept\"; exit $code"
        ),
        Room::Memory(kib) => format!(
            "mount -t tmpfs -o size={kib}k tmpfs {SHARED_MEMORY} || exit {NO_MOUNT}; exec \"$@\""
        ),
    };
    shell(
        &[
            "unshare",
            "-rm",
            "sh",
            "-c",
            &script,
            &dir.to_string_lossy(),
        ],
        words,
    )
}

fn shell(begin: &[&str], words: Vec<String>) -> Vec<String> {
    begin
        .iter()
        .map(|&word| word.to_owned())
        .chain(words)
        .collect()
}

/// Whether this machine lets a user mount memory in a namespace of its own.
pub fn can_mount() -> bool {
    let script = format!("mount -t tmpfs -o size=64k tmpfs {SHARED_MEMORY}");
    let tried = Command::new("unshare")
        .args(["-rm", "sh", "-c", &script])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    tried.is_ok_and(|status| status.success())
}

/// The reading end of a pipe that has no room, and the writing end.
fn full_pipe() -> io::Result<(PipeReader, Stdio)> {
    let (reader, writer) = io::pipe()?;
    let filled = Command::new("dd")
        .args(["if=/dev/zero", "bs=4096", "count=16"])
        .stdout(writer.try_clone()?)
        .stderr(Stdio::null())
        .status()?;
    if !filled.success() {
        return Err(io::Error::other("dd failed"));
    }
    Ok((reader, writer.into()))
}

/// The program at work.
#[derive(Debug)]
pub struct Running<'a> {
    program: &'a Program<'a>,
    child: Child,
    mark: String,
    /// What is still to happen.
    acts: Vec<Act>,
    /// The coupler is stopped, so it starts nobody.
    coupler_stopped: bool,
    /// When its files in shared memory are still to be removed.
    unlink: Option<Duration>,
    sweeps: bool,
    sweep: Option<Child>,
    solvers: BTreeMap<Target, u32>,
    log: PathBuf,
    said_before: u64,
    _unread: Option<PipeReader>,
}

/// How the program has ended.
#[derive(Debug)]
pub struct Ended {
    /// Its process.
    pub pid: u32,
    /// Exit status.
    pub code: Option<i32>,
    /// Signal that ended it.
    pub signal: Option<i32>,
    /// It did not end by itself.
    pub hung: bool,
    /// Processes that were there long after its end.
    pub survivors: Vec<u32>,
    /// From the last signal to the end.
    pub since_last_act: Duration,
    log: PathBuf,
    said_before: u64,
}

impl Running<'_> {
    /// Lets happen what is to happen, until the program has ended and all of its processes with it.
    pub fn wait(mut self) -> Ended {
        let began = Instant::now();
        let mut last_act = began;
        let mut looks = 0_u64;
        let status = loop {
            if let Ok(Some(status)) = self.child.try_wait() {
                break Some(status);
            }
            if self.act(began.elapsed()) {
                last_act = Instant::now();
            }
            if looks.is_multiple_of(8) {
                self.program.area.watch();
                self.sweep();
                let due = self.unlink.is_some_and(|at| began.elapsed() >= at);
                if due && self.program.area.unlink(self.child.id()) {
                    self.unlink = None;
                }
            }
            looks += 1;
            if last_act.elapsed() > HANGS {
                break None;
            }
            thread::sleep(LOOK);
        };
        let since_last_act = last_act.elapsed();
        self.program.area.watch();
        if let Some(mut sweep) = self.sweep.take() {
            let _ = sweep.wait();
        }
        let survivors = self.survivors(status.is_none());
        Ended {
            pid: self.child.id(),
            code: status.and_then(|status: ExitStatus| status.code()),
            signal: status.and_then(|status| status.signal()),
            hung: status.is_none(),
            survivors,
            since_last_act,
            log: std::mem::take(&mut self.log),
            said_before: self.said_before,
        }
    }

    /// Sends what is due; whether something was. To a process that is not there yet it is sent as soon as it is, but not
    /// where the coupler is stopped before it has started that process: then nothing is sent to it.
    fn act(&mut self, elapsed: Duration) -> bool {
        let Some(&Act { at, to, signal }) = self.acts.first() else {
            return false;
        };
        if at > elapsed {
            return false;
        }
        let found = self.find(to);
        if found.is_none() && !self.coupler_stopped {
            return false;
        }
        self.acts.remove(0);
        let Some(pid) = found else {
            return false;
        };
        if to == Target::Coupler {
            self.coupler_stopped = signal == Signal::STOP;
        }
        send(pid, signal);
        true
    }

    fn find(&mut self, target: Target) -> Option<u32> {
        if target == Target::Coupler {
            return Some(self.child.id());
        }
        if let Some(&pid) = self.solvers.get(&target) {
            return is_solver(pid, target).then_some(pid);
        }
        let pid = children(self.child.id()).find(|&pid| is_solver(pid, target))?;
        self.solvers.insert(target, pid);
        Some(pid)
    }

    fn sweep(&mut self) {
        if !self.sweeps {
            return;
        }
        let done = |sweep: &mut Child| !matches!(sweep.try_wait(), Ok(None));
        if self.sweep.as_mut().is_none_or(done) {
            self.sweep = self.program.sweep().ok();
        }
    }

    /// Processes of the run that do not go; they are killed, and so is everything if it `hangs`.
    fn survivors(&mut self, hangs: bool) -> Vec<u32> {
        let began = Instant::now();
        let mut there = marked(&self.mark);
        while !there.is_empty() && began.elapsed() < GONE && !hangs {
            thread::sleep(10 * LOOK);
            there = marked(&self.mark);
        }
        for &pid in &there {
            send(pid, Signal::KILL);
        }
        if hangs {
            let _ = self.child.wait();
            there.clear();
        }
        there
    }
}

impl Ended {
    /// How it ended.
    pub fn words(&self) -> String {
        match (self.hung, self.code, self.signal) {
            (true, ..) => "hangs".into(),
            (_, Some(code), _) => format!("ends with status {code}"),
            (.., Some(signal)) => format!("is ended by signal {signal}"),
            _ => "ends".into(),
        }
    }

    /// What it has said on standard error.
    pub fn said(&self) -> String {
        let bytes = fs::read(&self.log).unwrap_or_default();
        let from = (self.said_before as usize).min(bytes.len());
        String::from_utf8_lossy(&bytes[from..]).into_owned()
    }

    /// The last line of that.
    pub fn last_words(&self) -> String {
        let said = self.said();
        let last = said.lines().rev().find(|line| !line.trim().is_empty());
        last.unwrap_or("it said nothing").to_owned()
    }

    /// Whether this machine could not give it a small disk.
    pub fn had_no_mount(&self) -> bool {
        self.code == Some(NO_MOUNT)
    }
}

fn names(dir: &Path) -> Vec<String> {
    let entries = fs::read_dir(dir).into_iter().flatten().flatten();
    entries
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect()
}

/// Processes that any thread of `pid` has started.
fn children(pid: u32) -> impl Iterator<Item = u32> {
    let tasks = PathBuf::from(format!("/proc/{pid}/task"));
    let lists = names(&tasks).into_iter().map(move |task| {
        let list = fs::read_to_string(tasks.join(task).join("children"));
        list.unwrap_or_default()
    });
    lists.flat_map(|list| {
        let pids = list.split_whitespace().filter_map(|pid| pid.parse().ok());
        pids.collect::<Vec<u32>>()
    })
}

/// Whether the process is this solver of a run.
fn is_solver(pid: u32, target: Target) -> bool {
    let command = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    let words: Vec<&[u8]> = command.split(|&byte| byte == 0).collect();
    words.get(1) == Some(&target.name().as_bytes()) && words.get(2) == Some(&&b"--join"[..])
}

/// Living processes with this mark.
fn marked(mark: &str) -> Vec<u32> {
    let entry = format!("{MARK}={mark}");
    let ours = |pid: &u32| {
        let environ = fs::read(format!("/proc/{pid}/environ")).unwrap_or_default();
        environ
            .split(|&byte| byte == 0)
            .any(|e| e == entry.as_bytes())
    };
    let pids = names(Path::new("/proc")).into_iter();
    pids.filter_map(|name| name.parse().ok())
        .filter(ours)
        .collect()
}

fn send(pid: u32, signal: Signal) {
    // It may have ended meanwhile.
    if let Some(pid) = i32::try_from(pid).ok().and_then(Pid::from_raw) {
        let _ = kill_process(pid, signal);
    }
}

/// Opens a file to see that it is there; its error names what is wrong.
pub(crate) fn read(path: &Path) -> Option<Vec<u8>> {
    File::open(path).ok()?;
    fs::read(path).ok()
}
