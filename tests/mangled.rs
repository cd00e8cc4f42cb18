//! Damaged run directories: files that are cut, changed, swapped, huge, missing, not to be read, or no files at all. Every command
//! ends with a documented status, without a signal, soon, in bounded memory, and changes and leaves nothing outside the directory.
//! `watch` makes its page while the test holds the lock of the directory, as a run does.
//!
//! `MANGLED_ROUNDS` is the number of directories (20 by default), `MANGLED_SEED` the first seed. A failure names the seed of its
//! directory, which alone makes it again: `MANGLED_SEED=17 MANGLED_ROUNDS=1`.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use fastrand::Rng;
use rustix::fs::{CWD, FileType, Mode, mknodat};

use crate::harness::seen::Seen;
use crate::harness::{MINE, Place, copy, files_below, segments, signal, until, whole_run};

/// The statuses of docs/run-directory.md.
const STATUSES: [i32; 6] = [0, 1, 2, 3, 4, 130];
/// A command takes tenths of a second; more than this is a hang. Time in which one of its threads waits for a processor does not
/// count, so that a machine that does much else makes no hangs.
const HANG: Duration = Duration::from_secs(5);
/// Longest time of a command with all that.
const PATIENCE: Duration = Duration::from_mins(2);
/// Files of more bytes are not damaged further.
const PLAIN: u64 = 1 << 30;
/// Most memory of a command, with the processes that it has started, in KiB: 1 GB.
const MEMORY: u64 = 1_000_000_000 >> 10;
/// How root is kept from files without permission too.
const AS_USER: [&str; 3] = [
    "setpriv",
    "--bounding-set",
    "-dac_override,-dac_read_search",
];

fn below(random: &mut Rng, most: usize) -> usize {
    random.usize(..most.max(1))
}

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().expect("a number"))
}

/// The bytes with up to eight of them changed: one bit, a digit, or anything.
fn changed(random: &mut Rng, kind: usize, mut bytes: Vec<u8>) -> Vec<u8> {
    for _ in 0..=below(random, 8) {
        if !bytes.is_empty() {
            let at = below(random, bytes.len());
            bytes[at] = match kind {
                1 | 2 => bytes[at] ^ (1 << below(random, 8)),
                3 => b'0' + below(random, 10) as u8,
                _ => below(random, 256) as u8,
            };
        }
    }
    bytes
}

/// Damages a file; returns what was done.
fn mangle(random: &mut Rng, all: &[PathBuf], outside: &Path) -> String {
    let path = &all[random.usize(..all.len())];
    let name = path.display();
    // An earlier damage may have left something else here, or a file that is too long to be read.
    let is_plain =
        |path| fs::symlink_metadata(path).is_ok_and(|meta| meta.is_file() && meta.len() < PLAIN);
    let plain = is_plain(path);
    let bytes = if plain {
        fs::read(path).unwrap_or_default()
    } else {
        Vec::new()
    };
    let replace = |with: &dyn Fn()| {
        let _ = fs::remove_file(path);
        with();
    };
    match below(random, if plain { 15 } else { 1 }) {
        0 if !plain => format!("{name} stays as it is"),
        0 => {
            fs::write(path, &bytes[..below(random, bytes.len())]).unwrap();
            format!("{name} is cut")
        }
        kind @ 1..=4 => {
            fs::write(path, changed(random, kind, bytes)).unwrap();
            format!("{name} has other bytes ({kind})")
        }
        5 => {
            let other = &all[random.usize(..all.len())];
            if is_plain(other) {
                fs::write(path, fs::read(other).unwrap_or_default()).unwrap();
                fs::write(other, bytes).unwrap();
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
            let length = 1 << (30 + below(random, 12));
            let file = OpenOptions::new().write(true).open(path).unwrap();
            file.set_len(length).unwrap();
            format!("{name} has {length} bytes")
        }
        10 => {
            fs::set_permissions(path, fs::Permissions::from_mode(0o0)).unwrap();
            format!("{name} may not be read")
        }
        11 => {
            replace(&|| fs::create_dir(path).unwrap());
            format!("{name} is a folder")
        }
        12 => {
            replace(&|| fs::hard_link(outside.join("mine"), path).unwrap());
            format!("{name} is another file's second name")
        }
        13 => {
            replace(&|| {});
            format!("{name} is missing")
        }
        _ => {
            let folder = path.parent().expect("a file of the directory");
            let moved = folder.with_extension("moved");
            if folder.ends_with("mangled") || fs::rename(folder, &moved).is_err() {
                return format!("{name} stays as it is");
            }
            symlink(outside, folder).unwrap();
            format!("the folder of {name} is a link")
        }
    }
}

/// What is wrong with a command on a mangled directory, if anything is; its status, and how long it took. The program starts by
/// the words `by`.
fn fault(place: &Place, by: &[&str], words: &[&str]) -> (Option<String>, Option<i32>, Duration) {
    let mut running = place.start_by(by, &words.join(" "));
    let (pid, mut seen) = (running.pid(), Seen::begin());
    let (mut asked, mut answer) = (false, None);
    let over = until(PATIENCE, || {
        seen.look([pid]);
        if words[0] == "watch" && !asked {
            let stdout = running.output();
            asked = stdout.ends_with('\n');
            if asked {
                let page = stdout.split_once("shown at file://");
                answer = page.map(|(_, page)| fs::read_to_string(page.trim()).unwrap_or_default());
                signal(pid, "TERM");
            }
        }
        if running.is_over() {
            return Some(true);
        }
        (seen.took() > HANG).then_some(false)
    });
    let took = seen.took();
    if over != Some(true) {
        drop(running);
        let _ = until(PATIENCE, || place.processes().is_empty().then_some(()));
        place.tandem("clean").expect(0);
        return (Some(format!("hangs: {answer:?}")), None, took);
    }
    let runs = running.runs();
    let left = place.temporary().len() + segments(&runs).len();
    let ended = running.end();
    let most = seen.memory();
    let fault = match ended.status.code() {
        None => Some(format!("ended by signal {:?}", ended.signal())),
        Some(code) if !STATUSES.contains(&code) => Some(format!("status {code}")),
        _ if ended.stderr.contains("panicked") => Some("panicked".into()),
        _ if most > MEMORY => Some(format!("took {most} KiB")),
        _ if left > 0 => Some(format!("left {left} files of its run")),
        _ if answer.is_some_and(|page| !page.starts_with("<!doctype html>")) => {
            Some("gives no page".into())
        }
        _ => None,
    };
    let fault = fault.map(|fault| format!("{fault}: {}", ended.stderr));
    (fault, ended.status.code(), took)
}

/// Size, number and time of change of every file around a mangled directory, or also `in_it`.
fn around(place: &Place, in_it: bool) -> BTreeMap<PathBuf, (u64, u64, i64, i64)> {
    let mut all = vec![];
    for folder in &["whole", "outside", "mangled"][..2 + usize::from(in_it)] {
        all.extend(files_below(&place.path(folder)));
    }
    all.extend(place.content().iter().map(|name| place.path(name)));
    let of = |path: PathBuf| {
        let meta = fs::symlink_metadata(&path).ok()?;
        let is_dir = meta.is_dir();
        let state = if is_dir {
            (0, 0, 0, 0)
        } else {
            (meta.size(), meta.ino(), meta.mtime(), meta.mtime_nsec())
        };
        Some((path, state))
    };
    all.into_iter().filter_map(of).collect()
}

#[test]
fn a_mangled_run_directory_breaks_no_command() {
    let place = Place::new();
    whole_run(&place, "whole");
    let (whole, outside) = (place.path("whole"), place.path("outside"));
    fs::create_dir(&outside).unwrap();
    let dropped = Command::new(AS_USER[0])
        .args(&AS_USER[1..])
        .arg("true")
        .status();
    let by: &[&str] = if dropped.is_ok_and(|status| status.success()) {
        &AS_USER
    } else {
        &[]
    };

    let (first, rounds) = (number("MANGLED_SEED", 1), number("MANGLED_ROUNDS", 20));
    let (mut faults, mut longest) = (Vec::new(), BTreeMap::<String, Duration>::new());
    let mut statuses = BTreeMap::<(String, Option<i32>), u64>::new();
    for seed in first..first + rounds {
        let dir = place.path("mangled");
        let recording = dir.join("recording.tandem");
        let [of_dir, of_recording] = [&dir, &recording].map(|path| path.to_str().unwrap());
        // The last one alone may change the directory.
        let commands: [&[&str]; 5] = [
            &["replay", of_recording, "--dem"],
            &["report", of_dir, "--out", "page.html"],
            &["plot", of_dir, "--y", "t", "--out", "plot.svg"],
            &["watch", of_dir],
            &["resume", of_dir],
        ];
        for of_before in ["page.html", "plot.svg", "outside/mine"] {
            let _ = fs::remove_file(place.path(of_before));
        }
        let _ = fs::remove_dir_all(&dir);
        fs::write(outside.join("mine"), MINE).unwrap();
        copy(&whole, &dir);
        let (mut random, all) = (Rng::with_seed(seed), files_below(&dir));
        let done: Vec<String> = (0..=below(&mut random, 3))
            .map(|_| mangle(&mut random, &all, &outside))
            .collect();
        for words in commands {
            let around = || around(&place, words[0] != "resume");
            let before = around();
            let held = (words[0] == "watch").then(|| File::open(&dir).unwrap());
            if let Some(held) = &held {
                held.try_lock().unwrap();
            }
            let (fault, status, took) = fault(&place, by, words);
            *statuses.entry((words[0].to_owned(), status)).or_default() += 1;
            let slowest = longest.entry(words[0].to_owned()).or_default();
            *slowest = took.max(*slowest);
            let mut after = around();
            let written = words.iter().position(|&word| word == "--out");
            if let Some(at) = written {
                after.remove(&place.path(words[at + 1]));
            }
            if words[0] == "watch" {
                after.remove(&dir.join("live.html"));
            }
            let touched = (after != before).then(|| format!("changed {after:?}"));
            for fault in fault.into_iter().chain(touched) {
                println!("seed {seed}, {words:?}, {done:?}: {fault}");
                faults.push((seed, words[0].to_owned()));
            }
        }
    }
    println!("{rounds} directories from seed {first}: {statuses:?}; longest: {longest:?}");
    assert!(faults.is_empty(), "{faults:?}");
}
