//! A recorded run of a solver that cannot save its state goes on from a checkpoint: the recording is played to that solver,
//! the other one takes its saved state.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{a_while_after_a_checkpoint, assert_same, checkpoints, recorded};
use crate::harness::{Ended, PATIENCE, Place, dice, python_can_join, root, scene, signal, until};

/// The collision of a disc of springs and a body, with friction, whose springs are the history of the bodies' side.
const COLLISION: &[&str] = &[
    "--variant",
    "quick",
    "--set",
    "dem.body.0.position=[0.036,0.02]",
    "--set",
    "mpm.material.0.model.linear_elastic.shear_modulus=3e6",
    "--set",
    "mpm.points.0.spacing.per_cell=4",
    "--set",
    "gravity=[0,-9.81]",
    "--set",
    "output.frames=5e-4",
    "--set",
    "output.checkpoint.time=2e-4",
    "--set",
    "check=[]",
    "--record",
];

fn collision() -> String {
    scene("jiang2020/collision_hard")
}

/// The commands of both examples in Python. Each notes the process and the number of every step that it computes, and of
/// them `unable` has not the capability `save`. With `otherwise`, that file's presence changes its answers a little.
fn solvers(place: &Place, unable: &str) -> [String; 2] {
    let folder = root().join("python/examples").display().to_string();
    let sides = [
        ("mpm", "springs_mpm", "Springs", "step"),
        ("dem", "disc_dem", "Discs", "contact"),
    ];
    sides.map(|(side, module, class, method)| {
        let log = place.path(&format!("steps_{side}")).display().to_string();
        let otherwise = place.path(&format!("otherwise_{side}"));
        let otherwise = otherwise.display().to_string();
        let withheld = if side == unable { "save" } else { "" };
        let text = format!(
            r#"import os, sys
sys.path.insert(0, {folder:?})
import {module} as example
base = example.{class}
class Counted(base):
    capabilities = tuple(c for c in base.capabilities if c != {withheld:?})
    other = os.path.exists({otherwise:?})
    def {method}(self, step, of_the_other):
        with open({log:?}, "a") as log:
            print(os.getpid(), step.index, file=log)
        if self.other and step.index == 5:
            step = example_step(step)
        return base.{method}(self, step, of_the_other)
def example_step(step):
    import dataclasses
    return dataclasses.replace(step, dt=step.dt * 1.001)
sys.exit(example.serve_{side}(Counted()))
"#
        );
        let path = place.write(&format!("{side}_{unable}.py"), &text);
        format!("python3 '{}'", path.display())
    })
}

/// The steps that the last process of a side has computed.
fn last_steps(place: &Place, side: &str) -> Vec<u64> {
    let text = fs::read_to_string(place.path(&format!("steps_{side}"))).unwrap();
    let lines = text.lines().filter_map(|line| line.split_once(' '));
    let lines: Vec<(&str, &str)> = lines.collect();
    let (last, _) = lines.last().expect("it has computed");
    let of_last = lines.iter().filter(|(pid, _)| pid == last);
    of_last.map(|(_, step)| step.parse().unwrap()).collect()
}

/// The step from which a checkpoint goes on, by its name.
fn step_of(checkpoint: &Path) -> u64 {
    let name = checkpoint.file_stem().unwrap().to_string_lossy();
    name.parse().unwrap()
}

fn resume(place: &Place, out: &str) -> Ended {
    let dir = place.path(out);
    let arguments = [
        "resume",
        dir.to_str().unwrap(),
        "--log",
        "json",
        "--trust",
        "--window",
        "5",
    ];
    place.start(&arguments).end()
}

/// A run in `whole`, and the same in `killed` that is killed at a random moment after its first checkpoint, with a solver that
/// cannot save; the directory of the second.
fn whole_and_killed(place: &Place, unable: &str) -> PathBuf {
    let [mpm, dem] = solvers(place, unable);
    let run = [COLLISION, &["--mpm", &mpm, "--dem", &dem][..]].concat();
    place.run("whole", &collision(), &run).expect(0);
    let running = place.start_run("killed", &collision(), &run);
    let dir = place.path("killed");
    a_while_after_a_checkpoint(&dir);
    signal(running.pid(), "KILL");
    assert_eq!(running.end().signal(), Some(9), "it was over too soon");
    dir
}

/// Whichever side cannot save: the same bits, and the side that can computes no step that is in its saved state. In between
/// the run is killed once more, or interrupted, while the recording is played or later.
#[test]
fn the_recording_is_played_to_a_solver_that_cannot_save_and_the_other_one_goes_on() {
    if !python_can_join() {
        return;
    }
    for (unable, able, how) in [("dem", "mpm", "INT"), ("mpm", "dem", "KILL")] {
        let place = Place::new();
        let dir = whole_and_killed(&place, unable);
        let path = dir.to_str().unwrap().to_owned();
        let second = place.start(&["resume", &path, "--log", "json", "--trust"]);
        std::thread::sleep(Duration::from_millis(400 + dice(400)));
        signal(second.pid(), how);
        second.end();
        let from = step_of(checkpoints(&dir).last().unwrap());
        let ended = resume(&place, "killed").expect(0);
        let ended = ended.says(&[&format!("the recording is played to the {unable}")]);
        place.assert_clean(&ended.runs);
        assert_same(&dir, &place.path("whole"));
        assert_eq!(recorded(&dir), recorded(&place.path("whole")));
        let steps = last_steps(&place, able);
        assert_eq!(
            steps.first(),
            Some(&from),
            "the {able} goes on from its state"
        );
        assert_eq!(last_steps(&place, unable).first(), Some(&0));
        assert_eq!(steps.last(), last_steps(&place, unable).last());
    }
}

/// One that answers otherwise than it did is not gone on with, and a recording that is too short is no help. Nothing is lost
/// by either.
#[test]
fn a_recording_that_does_not_fit_ends_the_resumed_run_and_costs_nothing() {
    if !python_can_join() {
        return;
    }
    let place = Place::new();
    let dir = whole_and_killed(&place, "dem");
    fs::write(place.path("otherwise_dem"), "").unwrap();
    resume(&place, "killed")
        .expect(3)
        .says(&["imp/forces, step 5: not what was recorded"]);
    fs::remove_file(place.path("otherwise_dem")).unwrap();
    let recording = dir.join("recording.tandem");
    let whole = fs::read(&recording).unwrap();
    fs::write(&recording, &whole[..whole.len() / 3]).unwrap();
    resume(&place, "killed")
        .expect(2)
        .says(&["has no state of the dem", "ends before step"]);
    fs::write(&recording, &whole).unwrap();
    resume(&place, "killed").expect(0);
    assert_same(&dir, &place.path("whole"));
    assert_eq!(recorded(&dir), recorded(&place.path("whole")));
}

/// No scene begins with a part of a state.
#[test]
fn nothing_begins_with_a_run_of_which_one_solver_has_no_state() {
    if !python_can_join() {
        return;
    }
    let place = Place::new();
    let [_, discs] = solvers(&place, "dem");
    let out = place.path("parent");
    let run = ["--variant", "quick", "--dem", &discs, "--record"];
    let keeps = ["--set", "output.checkpoint={time=2e-4, end=true}"];
    let ended = place.run("parent", &collision(), &[&run[..], &keeps].concat());
    ended.expect(0).says(&["the dem cannot save its state"]);
    let there = until(PATIENCE, || (!checkpoints(&out).is_empty()).then_some(()));
    assert!(there.is_some());
    let text = fs::read_to_string(out.join("scene.toml")).unwrap();
    let branch = place.write(
        "branch.toml",
        &format!("{text}\n[start]\nfrom = \"parent\"\n"),
    );
    place
        .run("branch", branch.to_str().unwrap(), &["--trust"])
        .expect(2)
        .says(&["the dem of", "could not save its state"]);
}
