//! Studies by a launcher, Slurm's `srun`, started for real. The node is lost in the middle. Each ends with
//! the table of a study on this machine, to the bit but for times, and with each run once.
//!
//! The measurements of docs/results/sweeps.md are the same with more runs: `STUDY_RUNS=200 cargo test --release --test
//! tandem-tests launchers:: -- --nocapture --test-threads 1`.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;
use std::time::Instant;

use crate::harness::needs::Need;
use crate::harness::{PATIENCE, Place, has, quoted, root, scene, summaries, until};
use crate::study::without_times;

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

/// The table of the same study by this machine.
fn expected(place: &Place) -> BTreeMap<String, Vec<(String, String)>> {
    let began = Instant::now();
    place.tandem(&study("local", "--jobs 2")).expect(0);
    let took = began.elapsed().as_secs_f64();
    println!("{} runs, local, two at once: {took:.1} s", runs());
    let rows = without_times(&place.path("local/study.csv"));
    assert_eq!(rows.len(), runs());
    rows
}

/// A launcher of which every process says that it was started, and loses its first run.
#[test]
fn a_launcher_starts_the_runs_and_what_it_loses_is_tried_again() {
    let place = Place::new();
    let launcher = "sh -c 'echo >> started; mkdir lost && exit 9; exec \"$@\"' launcher";
    let more = format!("--jobs 2 --launcher {}", quoted(launcher));
    let ended = place.tandem(&study("out", &more)).expect(0);
    let count = format!("{n} runs, {n} of them new", n = runs());
    has(&ended.stdout, &count);
    has(&ended.stderr, "1 runs left no summary: tried again");
    let started = fs::read_to_string(place.path("started")).unwrap();
    assert_eq!(started.lines().count(), runs() + 1);
    assert!(expected(&place) == without_times(&place.path("out/study.csv")));
    let ended = place
        .tandem(&study("other", "--launcher \"srun 'x\""))
        .expect(2);
    ended.says(&["--launcher", "a quote is not closed"]);
}

/// A queue of Slurm with this machine as its node, in a place of its own.
struct Queue<'a>(&'a Place);

impl Queue<'_> {
    fn command(&self, what: &str) -> bool {
        let mut queue = Command::new(root().join("tests/harness/slurm"));
        queue.arg(what).arg(self.0.path("queue"));
        queue.env("TANDEM_RUNTIME_DIR", self.0.temporary_path());
        queue.status().expect("a shell").success()
    }
}

impl Drop for Queue<'_> {
    fn drop(&mut self) {
        self.command("stop");
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
    assert!(queue.command("start"), "the queue does not start");
    let conf = format!("SLURM_CONF={}", place.path("queue/slurm.conf").display());
    let slurm = |line: &str| place.start_by(&["env", &conf], line);
    let srun = "--jobs 3 --launcher 'srun --quiet --ntasks=1 --cpus-per-task=1 --mem=500M'";
    let line = study("out", srun);
    let started = slurm(&line);
    let ended = |out: &str, n: usize| {
        let ended = until(PATIENCE, || (summaries(&place.path(out)) > n).then_some(()));
        ended.expect("runs end");
    };
    ended("out", runs() / 4);
    assert!(queue.command("crash"), "the node does not come back");
    let done = started.end().expect(0);
    has(
        &done.stdout,
        &format!("{n} runs, {n} of them new", n = runs()),
    );
    let (n, took) = (runs(), done.took.as_secs_f64());
    println!("{n} runs, srun: {took:.1} s");
    assert!(expected(&place) == without_times(&place.path("out/study.csv")));
    let again = slurm(&line).end().expect(0);
    has(&again.stdout, &format!("{} runs, 0 of them new", runs()));
    // An interrupt reaches the runs in the queue, and the same command goes on.
    let line = study("cut", &format!("{srun} --set time.step_factor=0.1"));
    let cut = slurm(&line);
    ended("cut", 1);
    crate::harness::signal(cut.pid(), "TERM");
    cut.end().expect(130);
    slurm(&line).end().expect(0);
    assert_eq!(without_times(&place.path("cut/study.csv")).len(), runs());
}
