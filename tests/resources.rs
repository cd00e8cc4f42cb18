//! What a run needs of the machine, reported before it begins: room in shared memory, open files, time. And files in shared memory
//! that another program removes, reported as what it is.

use std::fs;
use std::path::Path;
use std::time::Duration;

use crate::harness::needs::Need;
use crate::harness::{PATIENCE, Place, QUICK, RunFiles, has, scene, segments, signal, until};

fn drop() -> String {
    scene("jiang2020/drop_hard")
}

fn run(out: &str) -> String {
    format!("run '{}' {QUICK} --out {out}", drop())
}

/// D3: a run computed to its end and then failed, or was killed by a bus error.
#[test]
fn a_small_shared_memory_is_reported_before_the_run() {
    let place = Place::new();
    let possible = ["-c", "unshare -rm mount -t tmpfs tmpfs /dev/shm"];
    let possible = place.start_as(Path::new("sh"), &possible).end();
    let why = "its user may not mount a small /dev/shm";
    if !Need::Mount.is_met(possible.status.success(), why) {
        return;
    }
    let within = |size: &str, out: &str| {
        // The directory of the run's files is in there too.
        let script = format!(
            "mount -t tmpfs -o size={size} tmpfs /dev/shm && mkdir $TANDEM_RUNTIME_DIR && exec \"$@\""
        );
        let by = ["unshare", "-rm", "sh", "-c", &script, "sh"];
        place.start_by(&by, &run(out)).end()
    };
    within("600k", "small").expect(2).says(&[
        "of shared memory, and /dev/shm has 600.0 KiB free",
        "--shm-size",
    ]);
    assert!(!place.path("small").exists(), "nothing has begun");
    within("8m", "enough").expect(0);
}

#[test]
fn a_low_limit_of_open_files_is_reported() {
    let place = Place::new();
    let ended = place.start_after("ulimit -n 64", &run("out")).end();
    ended
        .expect(2)
        .says(&["too many open files", "ulimit -n 1024"]);
    // A soft limit alone is raised.
    place
        .start_after("ulimit -S -n 64", &run("out"))
        .end()
        .expect(0);
}

#[test]
fn a_plan_says_how_much_shared_memory_there_is() {
    let place = Place::new();
    let ended = place.tandem(&format!("plan {}", drop())).expect(0);
    let line = ended
        .stdout
        .lines()
        .find(|line| line.trim_start().starts_with("shared"));
    let line = line.unwrap_or_else(|| panic!("{}", ended.stdout));
    has(line, "MiB (");
    has(line, "free in /dev/shm");
}

/// The line of a plan that says how long a run takes.
fn time_of_plan(place: &Place, more: &str) -> String {
    let ended = place.tandem(&format!("plan {} {more}", drop())).expect(0);
    let mut lines = ended.stdout.lines().map(str::trim);
    let line = lines.find(|line| line.starts_with("time "));
    line.map_or_else(String::new, str::to_owned)
}

#[test]
fn a_plan_says_how_long_a_run_takes() {
    let place = Place::new();
    let of_whole = time_of_plan(&place, &format!("{QUICK} --measure 60"));
    place.run("whole", &drop(), QUICK).expect(0);
    let steps = RunFiles::read(&place.path("whole")).summary["steps"].to_string();
    assert!(
        of_whole.ends_with(&format!("for all {steps} steps")),
        "{of_whole}: {steps}"
    );
    let of_some = time_of_plan(&place, "--set time.end=1e4 --measure 0.2");
    has(&of_some, "about");
    has(&of_some, " on this machine: ");
    // Hours of simulated time in microseconds of steps: hours at least, on any machine.
    has(&of_some, " h ");
    assert_eq!(time_of_plan(&place, "--measure 0"), "");
    let other = time_of_plan(&place, "--set 'solvers.dem=true --slow'");
    has(
        &other,
        "not measured: its first steps end with: the dem solver",
    );
    let left = std::fs::read_dir(place.temporary_path()).unwrap().count();
    assert_eq!(left, 0, "a plan leaves nothing");
}

/// As systemd does with `RemoveIPC` when a user logs out.
#[test]
fn a_run_whose_files_in_shared_memory_are_removed_goes_on_to_the_same_bits() {
    let place = Place::new();
    let more = "--variant quick --set output.frames=0.02 --set output.every=0.001";
    place.run("whole", &drop(), more).expect(0);
    let mut run = place.start_run("removed", &drop(), more);
    // Not before the solvers have exchanged something: until then they open what is in shared memory. And not once they are
    // done, so one of them stands still at each look.
    let dem = run.solver("removed", "dem");
    let history = place.path("removed").join("history.csv");
    let has_rows = || fs::read_to_string(&history).is_ok_and(|text| text.lines().count() > 2);
    let stands = until(PATIENCE, || {
        signal(dem, "CONT");
        std::thread::sleep(Duration::from_millis(5));
        signal(dem, "STOP");
        has_rows().then_some(())
    });
    stands.expect("rows are written");
    let runs = run.runs();
    let removed = segments(&runs);
    assert!(!removed.is_empty());
    for name in removed {
        fs::remove_file(std::path::Path::new("/dev/shm").join(name)).unwrap();
    }
    for name in place.temporary() {
        fs::remove_dir_all(place.temporary_path().join(name)).unwrap();
    }
    signal(dem, "CONT");
    let ended = run.end().expect(0);
    place.assert_clean(&ended.runs);
    assert_eq!(place.state_hash("removed"), place.state_hash("whole"));
}

/// Two solvers that have to share a processor: a warning before the run says what it costs and what to do.
#[test]
fn too_few_processors_are_reported_before_the_run() {
    let place = Place::new();
    let first = "taskset -cp $$ | sed 's/.*: //; s/[-,].*//'";
    let script = format!("taskset -cp \"$({first})\" $$ > /dev/null");
    let ended = place.start_after(&script, &run("one")).end();
    ended.expect(0).says(&[
        "the threads of the solvers (2) outnumber the free processors (",
        "`--in-process`",
    ]);
}
