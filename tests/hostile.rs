//! Files and scenes may come from somebody else: nothing waits, nothing outside a run directory is touched, no memory is taken
//! without bounds, and every command says what it refuses. Links and pipes beneath a directory are refused by
//! `interface/src/files.rs`, whose tests have each; `mangled.rs` puts them into the place of files at random.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::{CWD, FileType, Mode, mknodat};

use crate::harness::{HARD, MINE, Place, QUICK, copy, has, scene, whole_run};

/// Longest time of a command here; it takes tenths of a second.
const SOON: Duration = Duration::from_mins(1);

fn pipe(path: &Path) {
    mknodat(CWD, path, FileType::Fifo, Mode::from_raw_mode(0o600), 0).unwrap();
}

fn outside(place: &Place) -> PathBuf {
    let outside = place.path("outside");
    fs::create_dir(&outside).unwrap();
    fs::write(outside.join("mine"), MINE).unwrap();
    outside
}

/// A copy of a directory by hard links (`cp -al`) is changed together with the original.
#[test]
fn a_file_with_a_second_name_is_not_changed() {
    let place = Place::new();
    let outside = outside(&place);
    whole_run(&place, "run");
    let dir = place.path("hostile");
    for name in ["history.csv", "course.csv", "log.jsonl", ".tandem.lock"] {
        let _ = fs::remove_dir_all(&dir);
        copy(&place.path("run"), &dir);
        let before = fs::read(dir.join(name)).unwrap();
        fs::write(outside.join("mine"), &before).unwrap();
        fs::remove_file(dir.join(name)).unwrap();
        fs::hard_link(outside.join("mine"), dir.join(name)).unwrap();
        let ended = place.start("resume hostile").end_within(SOON);
        ended.expect(2).says(&[name, "second name"]);
        assert!(
            fs::read(outside.join("mine")).unwrap() == before,
            "{name} was changed"
        );
    }
}

/// What the user names may be reached by a link, and has to be a file.
#[test]
fn files_that_the_user_names_are_regular_ones() {
    let place = Place::new();
    symlink(scene(HARD), place.path("linked.toml")).unwrap();
    let ended = place.start("check linked.toml").end_within(SOON);
    ended.expect(0);
    pipe(&place.path("waits"));
    for file in ["waits", "/dev/zero"] {
        for line in [
            "check FILE",
            "plan FILE",
            "run FILE",
            "plot FILE --y t --out a.svg",
            "replay FILE --dem",
            "study FILE --out study",
        ] {
            let ended = place.start(&line.replace("FILE", file));
            let ended = ended.end_within(SOON).expect(2);
            assert!(ended.stderr.contains("not a regular file"), "{ended:#?}");
        }
    }
}

/// `check` and `plan` took memory until they were aborted.
#[test]
fn points_are_counted_before_memory_is_taken_for_them() {
    let place = Place::new();
    let block = format!("{} {QUICK}", scene("verification/column_collapse"));
    let many = format!("{block} --set mpm.points.0.spacing.counts=[43000,43000]");
    for command in ["check", "plan", "run", "run --in-process"] {
        let ended = place.start(&format!("{command} {many}"));
        let ended = ended.end_within(SOON).expect(2);
        ended.says(&["about 1.85e9 points need at least", "of memory"]);
    }
    assert!(
        !place.path("runs").exists(),
        "a refused run leaves no directory"
    );
    // As many as the machine can hold are not laid out for a check.
    let some = format!("{block} --set mpm.points.0.spacing.counts=[1600,1600]");
    let ended = place.start(&format!("check {some}"));
    let ended = ended.end_within(SOON).expect(0);
    has(&ended.stdout, "the solvers were not asked");
}

/// 4,400 discs in one place took 1.4 GB, and ten times as many would take a hundred times that; so did the bodies of many sets.
#[test]
fn bodies_are_counted_before_memory_is_taken_for_them() {
    let place = Place::new();
    let sets = |name: &str, sets: u32, count: u32| {
        let set = |k: u32| {
            format!(
                "[[dem.fill]]\nname = \"f{k}\"\ncount = {count}\ndensity = 1e3\ngrain = \"disc\"\nsize.equal = 1.0\n\
                 arrange.rows = {{ corner = [0.0, 0.0], width = 20.0 }}\n"
            )
        };
        let begin = "version = 1\nname = \"heap\"\ncheck = []\ntime.end = 0.1\noutput.every = 0.01\n\
                     body_contact.linear = { normal_stiffness = 1e5, tangential_stiffness = 0.0 }\n";
        place.write(
            name,
            &(begin.to_owned() + &(0..sets).map(set).collect::<String>()),
        );
    };
    sets("heap.toml", 9000, 100);
    sets("sets.toml", 30, 1_000_000);
    let refused = |line: &str, phrases: &[&str]| {
        place.start(line).end_within(SOON).expect(2).says(phrases);
    };
    let heap = ["900000 bodies", "lie on one another, need at least"];
    let sets = ["the scene has 30000000 bodies, expected at most 1000000"];
    for command in ["check", "plan", "run"] {
        refused(&format!("{command} heap.toml"), &heap);
        refused(&format!("{command} sets.toml"), &sets);
    }
}

/// It was ended by a signal.
#[test]
fn too_little_address_space_is_an_error() {
    let place = Place::new();
    for command in ["check", "run"] {
        let line = format!("{command} '{}'", scene(HARD));
        let ended = place.start_after("ulimit -v 50000", &line).end_within(SOON);
        ended.expect(2).says(&["of address space"]);
    }
}

/// The first was a panic (status 101); of the second a terminal was cleared.
#[test]
fn names_that_are_no_text_and_names_that_a_terminal_obeys() {
    let place = Place::new();
    let out = place.path("").join(OsStr::from_bytes(b"out-\xff"));
    let hard = scene(HARD);
    let line = ["run", &hard, "--variant", "quick", "--in-process", "--out"];
    let line: Vec<&OsStr> = line
        .map(OsStr::new)
        .into_iter()
        .chain([out.as_os_str()])
        .collect();
    let ended = place.start_as(Path::new(env!("CARGO_BIN_EXE_tandem")), &line);
    ended.end_within(SOON).expect(0);
    assert!(out.join("summary.json").is_file());
    let ended = place.start("check 'a\u{1b}[2Jb\nerror: c.toml'");
    let ended = ended.end_within(SOON).expect(2);
    assert!(!ended.stderr.contains('\u{1b}'), "{ended:?}");
    assert!(!ended.stderr.contains("\nerror: c"), "{ended:?}");
}
