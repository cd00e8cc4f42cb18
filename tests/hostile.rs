//! A run directory may come from somebody else, with anything in the place of its files: nothing waits, nothing outside the
//! directory is read as a file of it or touched, and every command says what it refuses.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use rustix::fs::{CWD, FileType, Mode, mknodat};

use crate::harness::{MINE, Place, copy, has, scene, whole_run};

/// Longest time of a command here; it takes tenths of a second.
const SOON: Duration = Duration::from_mins(1);
const HARD: &str = "jiang2020/collision_hard";

/// The files of a run that Tandem opens, with the newest of its checkpoints.
fn files_of(run: &Path) -> Vec<String> {
    let mut checkpoints = fs::read_dir(run.join("checkpoints"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect::<Vec<_>>();
    checkpoints.sort();
    let newest = format!("checkpoints/{}", checkpoints.last().unwrap());
    let files = [
        "scene.toml",
        "log.jsonl",
        "history.csv",
        "course.csv",
        "summary.json",
        "bodies.csv",
        "frames/frames.pvd",
        "frames/points_0000.vtu",
        "recording.tandem",
        ".tandem.lock",
        ".tandem.files",
    ];
    let files: Vec<String> = files
        .map(str::to_owned)
        .into_iter()
        .chain([newest])
        .collect();
    for file in &files {
        assert!(run.join(file).is_file(), "{file}");
    }
    files
}

fn pipe(path: &Path) {
    mknodat(CWD, path, FileType::Fifo, Mode::from_raw_mode(0o600), 0).unwrap();
}

/// The commands that use the run directory `hostile`, and whether they write to it.
fn commands(place: &Place) -> [(bool, String); 7] {
    let hard = scene(HARD);
    let from = place.path("hostile").display().to_string();
    let lines = [
        (true, "resume hostile"),
        (true, "run HARD --variant quick --out hostile"),
        (false, "plot hostile --y t --out plot.svg"),
        (false, "report hostile --out page.html"),
        (false, "check hostile/scene.toml"),
        (false, "replay hostile/recording.tandem --dem"),
        (false, "run HARD --set start.from=FROM --out branch"),
    ];
    lines.map(|(writes, line)| (writes, line.replace("HARD", &hard).replace("FROM", &from)))
}

/// Everybody's file and the folder around it, as they were.
fn assert_untouched(outside: &Path, what: &str) {
    let names = fs::read_dir(outside).unwrap().count();
    assert_eq!(names, 1, "{what}: something was made outside");
    let mine = fs::read_to_string(outside.join("mine")).unwrap();
    assert_eq!(mine, MINE, "{what}");
}

fn outside(place: &Place) -> PathBuf {
    let outside = place.path("outside");
    fs::create_dir(&outside).unwrap();
    fs::write(outside.join("mine"), MINE).unwrap();
    outside
}

/// Folders of Tandem's own in a run's directory; a link in the place of one is removed.
const OWN: [&str; 2] = [".tandem.next", ".tandem.earlier"];

/// Each command on a copy of a whole run in which `put` has made something in the place of `name`. Those that `refused`
/// tells by whether they write, and by their words, end with exit status 2 and name it; the others may. Nothing outside
/// changes.
fn obeyed_with(
    place: &Place,
    (name, what): (&str, &str),
    put: impl Fn(&Path),
    refused: impl Fn(bool, &str) -> bool,
) {
    let (dir, outside) = (place.path("hostile"), place.path("outside"));
    for (writes, line) in commands(place) {
        let _ = fs::remove_dir_all(&dir);
        copy(&place.path("run"), &dir);
        let path = dir.join(name);
        if path.is_dir() {
            fs::remove_dir_all(&path).unwrap();
        } else {
            let _ = fs::remove_file(&path);
        }
        put(&path);
        let ended = place.start(&line).end_within(SOON);
        let status = ended.status.code();
        if refused(writes, &line) {
            assert_eq!(status, Some(2), "{what}: {line}: {ended:?}");
            has(&ended.stderr, name.rsplit('/').next().unwrap());
        } else {
            assert!(matches!(status, Some(0 | 2)), "{what}: {line}: {ended:?}");
        }
        assert_untouched(&outside, what);
        let removed = fs::symlink_metadata(&path).is_err();
        assert!(!removed || OWN.contains(&name), "{what} was removed");
        let _ = fs::remove_dir_all(place.path("branch"));
    }
}

/// `resume` wrote through a link in the place of the log or of a table, `run` through one in that of the lock; a pipe in the
/// place of any file made every command wait for ever.
#[test]
fn a_link_or_a_pipe_in_the_place_of_any_file_of_a_run_is_refused_at_once() {
    let place = Place::new();
    let outside = outside(&place);
    whole_run(&place, "run");
    for name in files_of(&place.path("run")) {
        for kind in ["link", "dangling link", "pipe", "link to /dev/zero"] {
            let what = format!("{kind} in the place of {name}");
            let put = |path: &Path| match kind {
                "link" => symlink(outside.join("mine"), path).unwrap(),
                "dangling link" => symlink(outside.join("new"), path).unwrap(),
                "pipe" => pipe(path),
                _ => symlink("/dev/zero", path).unwrap(),
            };
            let reads = |line: &str| line.split(' ').any(|word| word.ends_with(&name));
            let refused = |writes, line: &str| writes || reads(line);
            obeyed_with(&place, (&name, &what), put, refused);
        }
    }
}

#[test]
fn a_link_in_the_place_of_a_folder_of_a_run_is_refused() {
    let place = Place::new();
    let outside = outside(&place);
    whole_run(&place, "run");
    let put = |path: &Path| symlink(&outside, path).unwrap();
    for folder in ["frames", "checkpoints", "failed-start"]
        .into_iter()
        .chain(OWN)
    {
        let refused = |writes, _: &str| writes && !OWN.contains(&folder);
        obeyed_with(&place, (folder, folder), put, refused);
    }
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

/// A sparse file of a terabyte was read until memory ended.
#[test]
fn no_more_is_read_than_a_file_of_its_kind_can_have() {
    let place = Place::new();
    whole_run(&place, "run");
    let dir = place.path("hostile");
    for name in files_of(&place.path("run")) {
        for (_, line) in commands(&place) {
            let _ = fs::remove_dir_all(&dir);
            copy(&place.path("run"), &dir);
            let file = fs::OpenOptions::new()
                .write(true)
                .open(dir.join(&name))
                .unwrap();
            file.set_len(1 << 40).unwrap();
            let ended = place.start(&line).end_within(SOON);
            let status = ended.status.code();
            // 3: the run began, and the table cannot be gone on with.
            assert!(
                matches!(status, Some(0 | 2 | 3)),
                "{name}: {line}: {ended:?}"
            );
            let _ = fs::remove_dir_all(place.path("branch"));
        }
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

/// A block of points; the test sets how many.
const BLOCK: &str = r#"
version = 1
name = "block"
check = []
[time]
end = 0.01
[mpm]
cell = 0.01
domain = [[0.0, 0.0], [20.0, 20.0]]
shape = "ugimp"
transfer = "flip"
[[mpm.material]]
name = "rubber"
density = 2000.0
model.linear_elastic = { bulk_modulus = 5e6, shear_modulus = 3.7e6 }
[[mpm.points]]
name = "block"
material = "rubber"
fill.rectangle = { lower = [1.0, 1.0], upper = [11.0, 11.0] }
spacing.counts = [1000, 1000]
[output]
every = 1e-3
"#;

/// `check` and `plan` took memory until they were aborted.
#[test]
fn points_are_counted_before_memory_is_taken_for_them() {
    let place = Place::new();
    place.write("block.toml", BLOCK);
    let many = "block.toml --set mpm.points.0.spacing.counts=[43000,43000]";
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
    let some = "block.toml --set mpm.points.0.spacing.counts=[1600,1600]";
    let ended = place.start(&format!("check {some}"));
    let ended = ended.end_within(SOON).expect(0);
    assert!(
        ended.stdout.contains("the solvers were not asked"),
        "{ended:?}"
    );
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
    for command in ["check", "plan", "run"] {
        let refused = |file: &str, phrases: &[&str]| {
            let ended = place.start(&format!("{command} {file}")).end_within(SOON);
            ended.expect(2).says(phrases);
        };
        refused(
            "heap.toml",
            &["900000 bodies", "lie on one another, need at least"],
        );
        refused(
            "sets.toml",
            &["the scene has 30000000 bodies, expected at most 1000000"],
        );
    }
}

/// It was ended by a signal.
#[test]
fn too_little_address_space_is_an_error() {
    let tandem = env!("CARGO_BIN_EXE_tandem");
    let hard = scene(HARD);
    for command in ["check", "run"] {
        let script = format!("ulimit -v 50000; exec '{tandem}' {command} '{hard}'");
        let ended = Command::new("sh").args(["-c", &script]).output().unwrap();
        let said = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(2), "{said}");
        has(&said, "of address space");
    }
}

/// The first was a panic (status 101); of the second a terminal was cleared.
#[test]
fn names_that_are_no_text_and_names_that_a_terminal_obeys() {
    let place = Place::new();
    let tandem = env!("CARGO_BIN_EXE_tandem");
    let out = place.path("").join(OsStr::from_bytes(b"out-\xff"));
    let ended = Command::new(tandem)
        .args([
            "run",
            &scene(HARD),
            "--variant",
            "quick",
            "--in-process",
            "--out",
        ])
        .arg(&out)
        .output()
        .unwrap();
    assert_eq!(ended.status.code(), Some(0), "{ended:?}");
    assert!(out.join("summary.json").is_file());
    let ended = place.start("check 'a\u{1b}[2Jb\nerror: c.toml'");
    let ended = ended.end_within(SOON).expect(2);
    assert!(!ended.stderr.contains('\u{1b}'), "{ended:?}");
    assert!(!ended.stderr.contains("\nerror: c"), "{ended:?}");
}
