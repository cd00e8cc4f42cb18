//! `tandem replay`: either solver alone answers a recording again, to the bit.

use std::fs;

use crate::harness::{Ended, Place, RunFiles, python_can_join, root, scene};

const HARD: &str = "jiang2020/collision_hard";
const QUICK: [&str; 2] = ["--variant", "quick"];

/// A recorded run in `out`.
fn record(place: &Place, out: &str, name: &str, more: &[&str]) -> Ended {
    place.run(out, &scene(name), &[&["--record"], more].concat())
}

fn recording(place: &Place, out: &str) -> String {
    let path = place.path(out).join("recording.tandem");
    path.to_str().expect("a UTF-8 path").into()
}

fn replay(place: &Place, recording: &str, more: &[&str]) -> Ended {
    let ended = place.start(&[&["replay", recording], more].concat()).end();
    place.assert_clean(&ended.runs);
    ended
}

#[track_caller]
fn tells(ended: &Ended, phrases: &[&str]) {
    for phrase in phrases {
        assert!(ended.stdout.contains(phrase), "no `{phrase}` in {ended:#?}");
    }
}

#[test]
fn either_solver_answers_again_to_the_bit() {
    let place = Place::new();
    for (out, how) in [("three", &[][..]), ("one", &["--in-process"])] {
        let ended = record(&place, out, HARD, &[&QUICK, how].concat()).expect(0);
        place.assert_clean(&ended.runs);
        let recorded = RunFiles::read(&place.path(out));
        let file = recording(&place, out);
        for more in [&["--dem"][..], &["--mpm"], &["--dem", "--in-process"]] {
            let ended = replay(&place, &file, more).expect(0);
            let steps = format!("{} steps", recorded.number("steps") + 2.0);
            tells(&ended, &[&steps, "the same, to the bit"]);
        }
    }
}

/// All that can be wrong with a file, and a solver that answers otherwise: one recording serves.
#[test]
fn what_is_damaged_or_different_is_named() {
    let place = Place::new();
    record(&place, "out", HARD, &QUICK).expect(0);
    let file = recording(&place, "out");
    let whole = fs::read(&file).unwrap();

    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let path = place.path("flipped");
    fs::write(&path, flipped).unwrap();
    replay(&place, path.to_str().unwrap(), &["--dem"])
        .expect(2)
        .says(&["is damaged after"]);

    let path = place.path("cut");
    fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
    for side in ["--dem", "--mpm"] {
        let ended = replay(&place, path.to_str().unwrap(), &[side]).expect(0);
        tells(&ended, &["the same, to the bit", "ends in the middle"]);
    }

    replay(
        &place,
        &place.path("none").display().to_string(),
        &["--dem"],
    )
    .expect(2)
    .says(&["cannot open the recording"]);
    replay(&place, &file, &["--dem", "no-such-program"])
        .expect(3)
        .says(&["cannot start the dem solver"]);
    replay(&place, &file, &["--dem", "false"]).expect(3).says(&[
        "the dem solver at step 0: expected Notice, got a solver that ended with exit status 1",
    ]);

    // 1e-9 more stiffness: told where it first shows, and within a tolerance of 1e-6 it is the same.
    let stiffer = ["--set", "contact.linear.normal_stiffness=60000.00006"];
    let ended = replay(&place, &file, &[&["--dem"], &stiffer[..]].concat()).expect(1);
    tells(
        &ended,
        &["first difference: step", "`stiffness_max`", "ulp"],
    );
    let within = [&["--dem", "--tolerance", "1e-4"], &stiffer[..]].concat();
    tells(&replay(&place, &file, &within).expect(0), &["within 1e-4"]);
    replay(&place, &file, &["--dem", "--set", "no.such=1"])
        .expect(2)
        .says(&["no such key"]);
    // A heavier continuum is slower, which it says itself.
    let ended = replay(
        &place,
        &file,
        &["--mpm", "--set", "material.0.density=1001"],
    )
    .expect(1);
    tells(
        &ended,
        &["first difference: step 0, mpm/notices, `courant_time`"],
    );
}

#[test]
fn a_solver_in_python_is_recorded_and_compared_for_nothing() {
    if !python_can_join() {
        return;
    }
    let place = Place::new();
    let example = root().join("python/examples/disc_dem.py");
    let discs = format!("python3 '{}'", example.display());
    record(
        &place,
        "python",
        HARD,
        &[&QUICK[..], &["--dem", &discs]].concat(),
    )
    .expect(0);
    let file = recording(&place, "python");
    // Its own answers again to the bit; the built-in solver's but for rounding, if it resolves no contacts.
    tells(
        &replay(&place, &file, &["--dem", &discs]).expect(0),
        &["the same, to the bit"],
    );
    tells(
        &replay(
            &place,
            &file,
            &[
                "--dem",
                "--tolerance",
                "1e-9",
                "--set",
                "contact_resolution=2",
            ],
        )
        .expect(0),
        &["the same within 1e-9"],
    );
    tells(
        &replay(&place, &file, &["--mpm"]).expect(0),
        &["the same, to the bit"],
    );
}

#[test]
fn one_solver_alone_is_recorded_too() {
    let place = Place::new();
    let bar = ["--variant", "quick", "--in-process"];
    record(&place, "bar", "chen2023/wave_1d", &bar).expect(0);
    let file = recording(&place, "bar");
    tells(
        &replay(&place, &file, &["--mpm", "--in-process"]).expect(0),
        &["the same, to the bit"],
    );
    replay(&place, &file, &["--dem"])
        .expect(2)
        .says(&["the recording has no dem"]);
    // And one that sends no points.
    record(&place, "incline", "verification/incline", &["--in-process"]).expect(0);
    tells(
        &replay(
            &place,
            &recording(&place, "incline"),
            &["--dem", "--in-process"],
        )
        .expect(0),
        &["the same, to the bit"],
    );
}

#[test]
fn a_killed_run_leaves_a_prefix_that_replays() {
    let place = Place::new();
    let file = place.recording_of_a_killed_run("out", &scene(HARD));
    for side in ["--dem", "--mpm"] {
        let replayed = place.start(&["replay", file.to_str().unwrap(), side]);
        let replayed = replayed.end().expect(0);
        tells(&replayed, &["the same, to the bit", "ends in the middle"]);
        assert!(!replayed.stdout.contains(": 0 steps"), "{replayed:#?}");
    }
}

#[test]
fn a_failure_is_replayed_with_its_words() {
    let place = Place::new();
    let away = [
        "--set",
        "mpm.points.0.velocity=[-20.0, 0.0]",
        "--set",
        "check=[]",
    ];
    let ended = record(&place, "out", HARD, &[&QUICK[..], &away].concat());
    let ended = ended.expect(3).says(&["left the domain"]);
    place.assert_clean(&ended.runs);
    let file = recording(&place, "out");
    let ended = replay(&place, &file, &["--mpm"]).expect(0);
    tells(&ended, &["fails as recorded", "left the domain"]);
    tells(
        &replay(&place, &file, &["--dem"]).expect(0),
        &["the same, to the bit"],
    );
}
