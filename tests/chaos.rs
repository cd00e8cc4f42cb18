//! Runs that are disturbed on purpose, resumed to their end, and compared with an undisturbed run, byte for byte.
//!
//! What happens, and at which share of the run, follows from a seed and the number of the round:
//!
//!     CHAOS_ROUNDS=1000 CHAOS_SEED=7 cargo test --release --test tandem-tests chaos::a_few -- --nocapture
//!
//! `CHAOS_FIRST` is the number of the first round, `CHAOS_JOBS` the number of rounds at the same time, `CHAOS_KIND` the kind of
//! every round, and `CHAOS_SCENE` the words after `tandem run`: a small scene with frames and checkpoints. Only what real
//! processes show is here: lost, late and wrong messages are simulated (docs/simulation.md).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use fastrand::Rng;

use crate::harness::bits::{Bits, bits};
use crate::harness::needs::Need;
use crate::harness::seen::Seen;
use crate::harness::{
    Ended, PATIENCE, Place, Running, at_once, children, dice, scene, segments, signal, until,
};

/// What is set in the scene that is run if no other is asked for: a coupled run of some hundredths of a second.
const SCENE: &str = "--variant quick --set time.end=0.03 --set check=[] \
    --set output.checkpoint.time=0.0015 --set output.frames=0.004";
const PARTIES: [&str; 3] = ["coupler", "mpm", "dem"];
const ASK_TO_END: [&str; 4] = ["INT", "TERM", "HUP", "XCPU"];
/// Other ways to go on, which must not change a bit.
const WAYS: [&str; 5] = ["", "", "--threads 2", "--window 7", "--in-process"];
/// What a run says that has no room, or no files any more.
const NO_ROOM: &[&str] = &[
    "File too large",
    "No space",
    "limits the size",
    "disk is full",
    "shared memory",
];
/// A run that has not ended by then hangs: no deadline of the protocol is longer. Here and below, time in which its threads wait
/// for a processor does not count.
const HANGS: Duration = Duration::from_secs(90);
/// A run that is asked to end does so within this time, whoever is stopped. A process that is there so long after its end is left
/// over.
const SOON: Duration = Duration::from_secs(8);
/// What the shell says if it may not mount a small file system.
const NO_MOUNT: i32 = 99;

/// What is wrong, and more about it.
type Wrong = (&'static str, String);
/// How a run has ended, and what is wrong with that.
type Part = (Ended, Option<Wrong>);

/// What happens to a run.
#[derive(Debug, Default)]
struct Fault {
    /// Signals to parties, by time after the start.
    signals: Vec<(Duration, &'static str, &'static str)>,
    /// A shell's script that leaves the run little room.
    room: Option<String>,
    /// When its files in shared memory are removed.
    remove: Option<Duration>,
    /// `tandem clean` runs all the time.
    sweeps: bool,
    /// Another run goes on all the time, which sweeps when it begins.
    beside: bool,
}

impl Fault {
    /// One for a run that takes `takes`. A third of them strike in its beginning.
    fn choose(kind: &str, rng: &mut Rng, takes: Duration) -> Self {
        let moment = |rng: &mut Rng| {
            let share = [0.15, 1.05, 1.05][rng.usize(..3)];
            takes.mul_f64(share * rng.f64())
        };
        let at = moment(rng);
        let later = at + Duration::from_millis(rng.u64(1..=300));
        let solver = PARTIES[rng.usize(1..=2)];
        let mut who = PARTIES;
        rng.shuffle(&mut who);
        let who = &who[..rng.usize(1..=3)];
        let to_all = |at, signal| who.iter().map(move |&to| (at, to, signal));
        let mut fault = Self {
            sweeps: rng.bool(),
            beside: kind == "kill" && rng.bool(),
            ..Self::default()
        };
        let signals = &mut fault.signals;
        match (kind, rng.u8(..4)) {
            ("kill", 0) => *signals = vec![(at, solver, "STOP"), (later, solver, "KILL")],
            ("kill", _) => signals.extend(to_all(at, "KILL")),
            ("freeze", _) => signals.extend(to_all(at, "STOP").chain(to_all(later, "CONT"))),
            ("signal", 0) => {
                signals.extend((0..3).map(|_| (moment(rng), "coupler", "USR1")));
                signals.sort();
            }
            ("signal", dice) => {
                signals.extend((dice == 1).then_some((at, solver, "STOP")));
                signals.push((later, "coupler", ASK_TO_END[rng.usize(..4)]));
            }
            ("starve", 0 | 1) => {
                let blocks = 2 * rng.u32(1..=200);
                fault.room = Some(format!("ulimit -f {blocks}; exec \"$@\""));
            }
            // The disk is gone when the shell ends, so what is on it is copied.
            ("starve", 2) => {
                let size = 4 * rng.u32(1..=100);
                fault.room = Some(format!(
                    "mkdir $0; mount -t tmpfs -o size={size}k tmpfs $0 || exit {NO_MOUNT}; \"$@\"; code=$?; \
                     mount -o remount,size=1g $0; cp -a $0 $0.kept; exit $code"
                ));
            }
            ("starve", _) => {
                let size = 64 * rng.u32(1..=64);
                fault.room = Some(format!(
                    "mount -t tmpfs -o size={size}k tmpfs /dev/shm || exit {NO_MOUNT}; \
                     mkdir $TANDEM_RUNTIME_DIR; exec \"$@\""
                ));
            }
            _ => fault.remove = Some(at),
        }
        fault
    }

    fn sends(&self, party: &str, signals: &[&str]) -> bool {
        let mut sent = self.signals.iter();
        sent.any(|(_, to, signal)| *to == party && signals.contains(signal))
    }

    /// What is wrong with the end of a run that this happened to; `took` is the time since the last signal.
    fn judge(&self, ended: &Ended, took: Duration) -> Option<Wrong> {
        let says = |words: &&str| ended.stderr.contains(words);
        let kills = |party: &str| self.sends(party, &["KILL"]);
        let killed = |party: &str| says(&&*format!("the {party} solver was killed by signal 9"));
        let blamed = |party: &str| kills(party) && killed(party);
        let right = match ended.status.code() {
            Some(0) => true,
            // Before the program handles a signal, this does what it always does.
            None => !self.signals.is_empty(),
            Some(130) if self.sends("coupler", &ASK_TO_END) => took < SOON,
            Some(3) if kills("mpm") || kills("dem") => blamed("mpm") || blamed("dem"),
            Some(2 | 3) if self.room.is_some() || self.remove.is_some() => NO_ROOM.iter().any(says),
            _ => has_nothing(ended),
        };
        let last = ended.stderr.lines().last().unwrap_or_default();
        let about = format!("{}, {took:.1?} after the last signal: {last}", ended.status);
        (!right).then(|| ("wrong culprit", format!("{about} {self:?}")))
    }
}

/// What all rounds have in common, and what they come to.
struct Rig {
    scene: String,
    seed: u64,
    dir: PathBuf,
    bits: Bits,
    takes: Duration,
    /// How often what was seen in rounds of a kind.
    counts: Mutex<BTreeMap<(&'static str, &'static str), u64>>,
}

impl Rig {
    /// Runs the scene in peace, to know its bits and how long it takes.
    fn new(seed: u64) -> Self {
        let scene = format!("{} {SCENE}", scene("jiang2020/normal_force"));
        let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("chaos-{seed}"));
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).unwrap();
        let mut rig = Self {
            scene: std::env::var("CHAOS_SCENE").unwrap_or(scene),
            seed,
            dir,
            bits: Bits::new(),
            takes: Duration::ZERO,
            counts: Mutex::default(),
        };
        let dir = rig.dir.join("undisturbed");
        let (place, began) = (Place::new(), Instant::now());
        let (ended, _) = rig.part(&place, &rig.begin(&dir), &dir, &Fault::default());
        rig.takes = began.elapsed();
        rig.bits = bits(&dir).unwrap_or_else(|| panic!("{}", ended.stderr));
        rig
    }

    fn begin(&self, dir: &Path) -> String {
        format!("run {} --log json --out {}", self.scene, dir.display())
    }

    /// Plays rounds, some at once.
    fn play(&self, first: u64, rounds: u64, jobs: u64) {
        let numbers: Vec<u64> = (first..first + rounds).collect();
        at_once(jobs as usize, &numbers, |number| self.round(*number));
    }

    /// Plays one round. Its files are kept if something is wrong.
    fn round(&self, number: u64) {
        let kinds = ["kill", "freeze", "signal", "starve", "remove"];
        let asked = std::env::var("CHAOS_KIND").unwrap_or_default();
        let only = kinds.into_iter().find(|kind| *kind == asked);
        let kind = only.unwrap_or(kinds[(number % 5) as usize]);
        let mut rng = Rng::with_seed(self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ number);
        let dir = self.dir.join(format!("round-{number}"));
        self.count(kind, "rounds");
        let Some((wrong, about)) = self.parts(kind, &dir, &mut rng) else {
            let _ = fs::remove_dir_all(&dir);
            return;
        };
        self.count(kind, wrong);
        println!("round {number}, {kind}: {wrong}: {about}");
    }

    fn count(&self, kind: &'static str, what: &'static str) {
        *self.counts.lock().unwrap().entry((kind, what)).or_default() += 1;
    }

    /// One run with what happens to it and what follows.
    fn parts(&self, kind: &'static str, dir: &Path, rng: &mut Rng) -> Option<Wrong> {
        let (place, fault) = (Place::new(), Fault::choose(kind, rng, self.takes));
        let (mut ended, mut wrong) = self.part(&place, &self.begin(dir), dir, &fault);
        let mut runs = ended.runs.clone();
        if ended.status.code() == Some(NO_MOUNT) {
            self.count(kind, "left out");
            return None;
        }
        let kept = dir.with_extension("kept");
        if kept.exists() {
            fs::remove_dir_all(dir).unwrap();
            fs::rename(kept, dir).unwrap();
        }
        let mut parts = 0;
        while wrong.is_none() && !ended.status.success() && parts < 8 {
            let mut again = Fault::default();
            if parts < 2 && rng.u8(..4) == 0 {
                again = Fault::choose(["kill", "signal"][rng.usize(..2)], rng, self.takes);
            }
            let way = WAYS[rng.usize(..5)];
            let mut words = format!("resume {} --log json {way}", dir.display());
            if has_nothing(&ended) {
                words = self.begin(dir);
            }
            self.count(kind, "resumed");
            (ended, wrong) = self.part(&place, &words, dir, &again);
            runs.extend(ended.runs.iter().cloned());
            parts += 1;
        }
        if wrong.is_some() {
            return wrong;
        }
        let bits = bits(dir).unwrap_or_default();
        let mut names = self.bits.keys().chain(bits.keys());
        if let Some(name) = names.find(|name| self.bits.get(*name) != bits.get(*name)) {
            return Some(("different bits", format!("{name} differs")));
        }
        // What a run has left is removed by the next start.
        let left = || format!("{:?}{:?}", place.temporary(), segments(&runs));
        (left() != "{}[]").then(|| ("leftover", left()))
    }

    /// Starts the program, lets happen what is to happen, and waits until all of its processes have ended.
    fn part(&self, place: &Place, words: &str, dir: &Path, fault: &Fault) -> Part {
        let dir = dir.to_str().expect("UTF-8");
        let mut by = Vec::new();
        if let Some(script) = &fault.room {
            let shell = ["unshare", "-rm", "sh", "-c", script, dir];
            let from = if script.contains("mount") { 0 } else { 2 };
            by.extend(&shell[from..]);
        }
        let mut run = place.start_by(&by, words);
        let (began, mut seen, mut last) = (Instant::now(), Seen::begin(), Duration::ZERO);
        let mut signals = fault.signals.iter().peekable();
        let mut remove = fault.remove;
        let mut solvers = BTreeMap::new();
        let mut sweep: Option<Running> = None;
        let (other, mut beside) = (PathBuf::from(format!("{dir}.beside")), None);
        let over = until(PATIENCE, || {
            solvers.extend(solvers_of(run.pid()));
            seen.look([run.pid()].into_iter().chain(solvers.values().copied()));
            if let Some(&&(at, to, what)) = signals.peek()
                && at <= began.elapsed()
            {
                let coupler = (to == "coupler").then(|| run.pid());
                // A solver that is not there yet is waited for, unless nobody may start it.
                if let Some(pid) = coupler.or_else(|| solvers.get(to).copied()) {
                    signal(pid, what);
                    last = seen.took();
                    signals.next();
                } else if fault.sends("coupler", &["STOP"]) {
                    signals.next();
                }
            }
            if remove.is_some_and(|at| at <= began.elapsed()) {
                let segments = segments(&run.runs());
                for name in &segments {
                    let _ = fs::remove_file(Path::new("/dev/shm").join(name));
                }
                for name in place.temporary() {
                    let _ = fs::remove_dir_all(place.temporary_path().join(name));
                }
                remove = remove.filter(|_| segments.is_empty());
            }
            if fault.sweeps && sweep.as_mut().is_none_or(Running::is_over) {
                sweep = Some(place.start("clean"));
            }
            if fault.beside && beside.is_none() {
                beside = Some(place.start(&self.begin(&other)));
            }
            if seen.took() > HANGS {
                return Some(false);
            }
            run.is_over().then_some(true)
        });
        let took = seen.since(last);
        drop(sweep);
        let harmed = beside.and_then(|beside| self.harmed(beside, &other));
        let mut seen = Seen::begin();
        until(PATIENCE, || {
            let left = place.processes();
            seen.look(left.iter().copied());
            (left.is_empty() || seen.took() > SOON).then_some(())
        });
        let left = place.processes();
        for &pid in &left {
            signal(pid, "KILL");
        }
        let ended = run.end();
        let wrong = if over != Some(true) {
            Some(("hang", format!("{fault:?}")))
        } else if !left.is_empty() {
            Some(("leftover", format!("processes {left:?}")))
        } else {
            harmed.or_else(|| fault.judge(&ended, took))
        };
        (ended, wrong)
    }

    /// What is wrong with the end of an undisturbed run in `dir`, if anything is.
    fn harmed(&self, beside: Running, dir: &Path) -> Option<Wrong> {
        let ended = beside.end();
        let right = ended.status.success() && bits(dir).as_ref() == Some(&self.bits);
        let _ = fs::remove_dir_all(dir);
        (!right).then(|| ("harmed another run", format!("{ended:?}")))
    }
}

/// Whether a run was stopped before it had a checkpoint to go on from.
fn has_nothing(ended: &Ended) -> bool {
    let says = |words| ended.stderr.contains(words);
    ended.status.code() == Some(2) && (says("has no checkpoint") || says("scene.toml"))
}

/// The solvers that a coupler has started.
fn solvers_of(coupler: u32) -> impl Iterator<Item = (&'static str, u32)> {
    children(coupler).into_iter().filter_map(|pid| {
        let words = fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        let is = |party: &&str| words.contains(&format!("\0{party}\0--join\0"));
        PARTIES.into_iter().find(is).map(|party| (party, pid))
    })
}

#[test]
fn a_few_rounds_of_everything_leave_the_same_bits() {
    let number = |name: &str, or: u64| std::env::var(name).map_or(or, |n| n.parse().unwrap());
    let seed = number("CHAOS_SEED", dice(1 << 32));
    let rounds = number("CHAOS_ROUNDS", 30);
    let rig = Rig::new(seed);
    rig.play(number("CHAOS_FIRST", 0), rounds, number("CHAOS_JOBS", 2));
    let counts = rig.counts.into_inner().unwrap();
    println!("CHAOS_SEED={seed}: {counts:#?}");
    let fine = |(_, what): &(_, &str)| ["rounds", "resumed", "left out"].contains(what);
    assert!(counts.keys().all(fine), "files: {}", rig.dir.display());
    assert!(rounds < 30 || counts.contains_key(&("kill", "resumed")));
    let mounts = !counts.contains_key(&("starve", "left out"));
    Need::Mount.is_met(mounts, "no small file system may be mounted");
}
