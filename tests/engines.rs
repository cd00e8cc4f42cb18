//! Studies by GNU parallel, HyperQueue and Slurm, started for real. A worker or the node is lost in the middle. Each ends with
//! the table of a study on this machine, to the bit but for times, and with each run once.
//!
//! The measurements of docs/results/sweeps.md are the same with more runs: `STUDY_RUNS=200 cargo test --release --test
//! tandem-tests engines:: -- --nocapture --test-threads 1`.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use crate::harness::needs::Need;
use crate::harness::{Ended, PATIENCE, Place, Running, has, root, scene, summaries, until};
use crate::study::{tandem, without_times, words};

/// Runs of a study, unless `STUDY_RUNS` says otherwise.
const RUNS: usize = 12;

fn runs() -> usize {
    let asked = std::env::var("STUDY_RUNS").ok();
    asked.map_or(RUNS, |n| n.parse().expect("STUDY_RUNS is a number"))
}

/// A study of `collision_hard` over that many densities of its body.
fn study(out: &str, more: &str) -> String {
    let values: Vec<String> = (0..runs())
        .map(|k| format!("{}", 1000.0 + k as f64))
        .collect();
    let (hard, values) = (scene("jiang2020/collision_hard"), values.join(","));
    format!(
        "study {hard} --variant quick --vary dem.body.0.density={values} --value v_target --out {out} {more}"
    )
}

fn it_runs(program: &str, arguments: &[&str]) -> bool {
    let ran = Command::new(program).args(arguments).output();
    ran.is_ok_and(|ran| ran.status.success())
}

fn hyperqueue_is_there() -> bool {
    Need::Hyperqueue.is_met(
        it_runs("python3", &["-c", "import hyperqueue"]),
        "python3 cannot import hyperqueue: pip install hyperqueue",
    )
}

/// The program with a line of arguments, which finds its queue by `NAME=VALUE`.
fn start_by<'a>(place: &'a Place, queue: &str, line: &str) -> Running<'a> {
    let words = words(line);
    let mut arguments = vec![queue, env!("CARGO_BIN_EXE_tandem")];
    arguments.extend(words.iter().map(String::as_str));
    place.start_as(Path::new("env"), &arguments)
}

/// The table of the same study by this machine.
fn expected(place: &Place) -> BTreeMap<String, Vec<(String, String)>> {
    let began = Instant::now();
    tandem(place, &study("local", "--jobs 2")).expect(0);
    let took = began.elapsed().as_secs_f64();
    println!("{} runs, local, two at once: {took:.1} s", runs());
    let rows = without_times(&place.path("local/study.csv"));
    assert_eq!(rows.len(), runs());
    rows
}

/// Asserts that a study has made each of its runs, with the results of this machine.
fn assert_whole(place: &Place, engine: &str, ended: &Ended) {
    let count = format!("{n} runs, {n} of them new", n = runs());
    assert!(
        ended.stdout.contains(&count),
        "{}{}",
        ended.stdout,
        ended.stderr
    );
    println!(
        "{} runs, {engine}: {:.1} s",
        runs(),
        ended.took.as_secs_f64()
    );
    assert!(expected(place) == without_times(&place.path("out/study.csv")));
    let again = tandem(place, &study("out", &format!("--engine {engine}"))).expect(0);
    let count = format!("{} runs, 0 of them new", runs());
    has(&again.stdout, &count);
}

#[test]
fn parallel_runs_the_commands_of_a_study() {
    let there = it_runs("parallel", &["--version"]);
    if !Need::Parallel.is_met(there, "no GNU parallel: apt-get install parallel") {
        return;
    }
    let place = Place::new();
    tandem(&place, &study("out", "--commands todo")).expect(0);
    let mut parallel = Command::new("parallel");
    parallel
        .args(["--jobs", "2", "--arg-file", "todo"])
        .current_dir(place.path("."));
    parallel.env("TANDEM_RUNTIME_DIR", place.temporary_path());
    // Its status is the number of runs of which a check failed, as one does at most of these densities.
    let began = Instant::now();
    parallel.output().unwrap();
    let took = began.elapsed().as_secs_f64();
    println!("{} runs, parallel: {took:.1} s", runs());
    let ended = tandem(&place, &study("out", "")).expect(0);
    let count = format!("{} runs, 0 of them new", runs());
    has(&ended.stdout, &count);
    assert!(expected(&place) == without_times(&place.path("out/study.csv")));
}

/// A process that is ended with the test.
struct Helper(Child);

impl Drop for Helper {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn hyperqueue_makes_a_study_though_a_worker_is_lost() {
    if !hyperqueue_is_there() {
        return;
    }
    let place = Place::new();
    // Two workers, each with the two processors that a run asks for.
    let mut server = Command::new("python3");
    server
        .arg(root().join("tests/harness/two_workers.py"))
        .arg("2");
    server.env("TANDEM_RUNTIME_DIR", place.temporary_path());
    server.stdin(Stdio::piped()).stdout(Stdio::null());
    server.stderr(fs::File::create(place.path("server")).unwrap());
    let mut server = Helper(server.spawn().unwrap());
    let directory = until(PATIENCE, || {
        let said = fs::read_to_string(place.path("server")).unwrap();
        said.strip_suffix('\n')
            .map(|said| said.lines().last().unwrap().to_owned())
    });
    let queue = format!("HQ_SERVER_DIR={}", directory.expect("it starts"));
    let study = start_by(&place, &queue, &study("out", "--engine hyperqueue"));
    until(PATIENCE, || {
        (summaries(&place.path("out")) > runs() / 4).then_some(())
    })
    .expect("runs end");
    server.0.stdin.as_mut().unwrap().write_all(b"\n").unwrap();
    assert_whole(&place, "hyperqueue", &study.end().expect(0));
}

/// Without a server it starts its own, and ends it when it is interrupted.
#[test]
fn hyperqueue_of_its_own_goes_on_after_an_interrupt() {
    if !hyperqueue_is_there() {
        return;
    }
    let place = Place::new();
    // Small steps, so that it is not over before it is interrupted.
    let factor = 0.03 * runs() as f64 / RUNS as f64;
    let slow = format!("--engine hyperqueue --jobs 2 --set time.step_factor={factor}");
    let line = study("out", &slow);
    let arguments = words(&line);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let running = place.start(&arguments);
    until(PATIENCE, || {
        (summaries(&place.path("out")) > 1).then_some(())
    })
    .expect("runs end");
    crate::harness::signal(running.pid(), "TERM");
    let ended = running.end().expect(130);
    place.assert_clean(&ended.runs);
    let ended = tandem(&place, &line).expect(0);
    assert!(
        !ended.stdout.contains(", 0 of them new"),
        "{}",
        ended.stdout
    );
    assert_eq!(without_times(&place.path("out/study.csv")).len(), runs());
}

/// A queue of Slurm with this machine as its node, in a place of its own.
struct Queue<'a>(&'a Place);

impl Queue<'_> {
    fn tell(&self, what: &str) -> bool {
        let mut queue = Command::new(root().join("tests/harness/slurm"));
        queue.arg(what).arg(self.0.path("queue"));
        queue.env("TANDEM_RUNTIME_DIR", self.0.temporary_path());
        queue.status().expect("a shell").success()
    }
}

impl Drop for Queue<'_> {
    fn drop(&mut self) {
        self.tell("stop");
    }
}

#[test]
fn slurm_makes_a_study_though_the_node_starts_again() {
    let programs = ["slurmctld", "slurmd", "munged", "sbatch"];
    let there = programs
        .iter()
        .all(|program| it_runs("sh", &["-c", &format!("command -v {program}")]));
    let there = there && rustix::process::geteuid().is_root();
    let why = "no Slurm, or no root: apt-get install slurmctld slurmd slurm-client munge";
    if !Need::Slurm.is_met(there, why) {
        return;
    }
    let place = Place::new();
    fs::create_dir(place.path("queue")).unwrap();
    let queue = Queue(&place);
    assert!(queue.tell("start"), "the queue does not start");
    let conf = format!("SLURM_CONF={}", place.path("queue/slurm.conf").display());
    let slurm = |line: &str| start_by(&place, &conf, line);
    let line = study("out", "--engine slurm --jobs 3 --cores 1 --memory 500");
    let started = slurm(&line);
    let ended = |n: usize| {
        let ended = until(PATIENCE, || {
            (summaries(&place.path("out")) > n).then_some(())
        });
        ended.expect("runs end");
    };
    ended(runs() / 4);
    assert!(queue.tell("crash"), "the node does not come back");
    let done = started.end().expect(0);
    let done = done.says(&["submitted the job 1"]);
    assert_whole(&place, "slurm", &done);
    // A study that is killed leaves its array, which the next call waits for.
    let other = study(
        "killed",
        "--engine slurm --jobs 3 --cores 1 --set time.safety=0.7",
    );
    let killed = slurm(&other);
    let noted = place.path("killed/runs/slurm.job");
    until(PATIENCE, || noted.exists().then_some(())).expect("it is submitted");
    crate::harness::signal(killed.pid(), "KILL");
    drop(killed.end());
    let done = slurm(&other).end().expect(0);
    let waits =
        done.stderr.contains("of an earlier call") || done.stderr.contains("waiting for its end");
    assert!(
        waits || done.stdout.contains(", 0 of them new"),
        "{}",
        done.stderr
    );
    assert!(
        !done.stderr.contains("submitted the job"),
        "{}",
        done.stderr
    );
    assert_eq!(without_times(&place.path("killed/study.csv")).len(), runs());
}
