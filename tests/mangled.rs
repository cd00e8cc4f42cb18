//! Damaged run directories: files that are cut, changed, swapped, huge, not to be read, or no files at all. Every command ends with
//! a documented status, without a signal, soon, in bounded memory, and changes nothing outside the directory.
//!
//! `MANGLED_ROUNDS` is the number of directories (20 by default), `MANGLED_SEED` the first seed. A failure names the seed of its
//! directory, which alone makes it again: `MANGLED_SEED=17 MANGLED_ROUNDS=1`.

use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::fs::{CWD, FileType, Mode, mknodat};

use crate::harness::{MINE, Place, copy, signal, until, whole_run};

/// The statuses of docs/run-directory.md.
const STATUSES: [i32; 6] = [0, 1, 2, 3, 4, 130];
/// A command takes tenths of a second; more than this is a hang, also on a machine that does much else.
const HANG: Duration = Duration::from_secs(30);
/// After so long `watch` is asked to end.
const WATCHED: Duration = Duration::from_secs(1);
/// Most memory of a process in KiB.
const MEMORY: u64 = 1 << 20;

/// Numbers that are the same for a seed (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, most: usize) -> usize {
        (self.next() % most.max(1) as u64) as usize
    }

    fn one_of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }
}

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().expect("a number"))
}

/// All files below a folder, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Damages a file; returns what was done.
fn mangle(random: &mut Random, all: &[PathBuf], outside: &Path) -> String {
    let path = random.one_of(all);
    let name = path.display();
    // An earlier damage may have left something else here.
    let plain = fs::symlink_metadata(path).is_ok_and(|meta| meta.is_file());
    let bytes = if plain {
        fs::read(path).unwrap_or_default()
    } else {
        Vec::new()
    };
    let replace = |with: &dyn Fn()| {
        let _ = fs::remove_file(path);
        with();
    };
    match random.below(if plain { 12 } else { 1 }) {
        0 if !plain => format!("{name} stays as it is"),
        0 => {
            fs::write(path, &bytes[..random.below(bytes.len())]).unwrap();
            format!("{name} is cut")
        }
        kind @ 1..=4 => {
            let mut bytes = bytes;
            for _ in 0..=random.below(8) {
                if !bytes.is_empty() {
                    let at = random.below(bytes.len());
                    bytes[at] = match kind {
                        1 | 2 => bytes[at] ^ (1 << random.below(8)),
                        3 => b'0' + random.below(10) as u8,
                        _ => random.below(256) as u8,
                    };
                }
            }
            fs::write(path, bytes).unwrap();
            format!("{name} has other bytes ({kind})")
        }
        5 => {
            let other = random.one_of(all);
            let (a, b) = (bytes, fs::read(other).unwrap_or_default());
            if fs::symlink_metadata(other).is_ok_and(|meta| meta.is_file()) {
                fs::write(path, b).unwrap();
                fs::write(other, a).unwrap();
            }
            format!("{name} and {} are swapped", other.display())
        }
        6 => {
            replace(&|| symlink(outside.join("mine"), path).unwrap());
            format!("{name} is a link")
        }
        7 => {
            replace(&|| symlink(outside.join("new"), path).unwrap());
            format!("{name} is a dangling link")
        }
        8 => {
            replace(&|| mknodat(CWD, path, FileType::Fifo, Mode::from_raw_mode(0o600), 0).unwrap());
            format!("{name} is a pipe")
        }
        9 => {
            let length = 1 << (30 + random.below(12));
            let file = OpenOptions::new().write(true).open(path).unwrap();
            file.set_len(length).unwrap();
            format!("{name} has {length} bytes")
        }
        10 => {
            fs::set_permissions(path, fs::Permissions::from_mode(0o0)).unwrap();
            format!("{name} may not be read")
        }
        _ => {
            replace(&|| fs::create_dir(path).unwrap());
            format!("{name} is a folder")
        }
    }
}

/// The largest memory of a process so far in KiB.
fn memory(pid: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let words = line.and_then(|line| line.split_whitespace().next());
    words.and_then(|words| words.parse().ok()).unwrap_or(0)
}

/// What is wrong with a command on a mangled directory, if anything is; and how long it took.
fn fault(place: &Place, words: &[&str]) -> (Option<String>, Duration) {
    let started = Instant::now();
    let mut running = place.start(words);
    let (pid, watch) = (running.pid(), words[0] == "watch");
    let (mut most, mut asked) = (0, None);
    let over = until(HANG, || {
        most = most.max(memory(pid));
        if watch && asked.is_none() && started.elapsed() > WATCHED {
            signal(pid, "TERM");
            asked = Some(Instant::now());
        }
        running.is_over().then_some(())
    });
    if over.is_none() {
        return (Some("hangs".into()), started.elapsed());
    }
    let took = asked.unwrap_or(started).elapsed();
    let ended = running.end();
    let fault = match ended.status.code() {
        None => Some(format!("ended by signal {:?}", ended.signal())),
        Some(code) if !STATUSES.contains(&code) => Some(format!("status {code}")),
        _ if ended.stderr.contains("panicked") => Some("panicked".into()),
        _ if most > MEMORY => Some(format!("took {most} KiB")),
        _ => None,
    };
    (
        fault.map(|fault| format!("{fault}: {}", ended.stderr)),
        took,
    )
}

#[test]
fn a_mangled_run_directory_breaks_no_command() {
    let place = Place::new();
    whole_run(&place, "whole");
    let (whole, outside) = (place.path("whole"), place.path("outside"));
    fs::create_dir(&outside).unwrap();
    fs::write(outside.join("mine"), MINE).unwrap();

    let (first, rounds) = (number("MANGLED_SEED", 1), number("MANGLED_ROUNDS", 20));
    let (mut faults, mut longest) = (Vec::new(), BTreeMap::<String, Duration>::new());
    for seed in first..first + rounds {
        let dir = place.path("mangled");
        let recording = dir.join("recording.tandem");
        let [of_dir, of_recording] = [&dir, &recording].map(|path| path.to_str().unwrap());
        let commands: [&[&str]; 5] = [
            &["resume", of_dir],
            &["replay", of_recording, "--dem"],
            &["report", of_dir, "--out", "page.html"],
            &["plot", of_dir, "--y", "t", "--out", "plot.svg"],
            &["watch", of_dir],
        ];
        for words in commands {
            let _ = fs::remove_dir_all(&dir);
            copy(&whole, &dir);
            let mut random = Random(seed);
            let all = files(&dir);
            let done: Vec<String> = (0..=random.below(3))
                .map(|_| mangle(&mut random, &all, &outside))
                .collect();
            let (fault, took) = fault(&place, words);
            let slowest = longest.entry(words[0].to_owned()).or_default();
            *slowest = took.max(*slowest);
            let touched = fs::read_dir(&outside).unwrap().count() != 1
                || fs::read_to_string(outside.join("mine")).ok().as_deref() != Some(MINE);
            for fault in fault
                .into_iter()
                .chain(touched.then(|| "changed another file".into()))
            {
                println!("seed {seed}, {words:?}, {done:?}: {fault}");
                faults.push((seed, words[0].to_owned()));
            }
        }
    }
    println!("{rounds} directories from seed {first}; longest: {longest:?}");
    assert!(faults.is_empty(), "{faults:?}");
}
