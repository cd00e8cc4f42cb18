//! `tandem replay`: either solver alone answers a recording again, to the bit.

use std::fs;

use crate::harness::{
    Ended, HARD, Place, QUICK, RunFiles, has, python_can_join, quoted, root, scene,
};
use crate::mutants;

/// A recorded run in `out`.
fn record(place: &Place, out: &str, name: &str, more: &str) -> Ended {
    place.run(out, &scene(name), &format!("--record {more}"))
}

/// Replays a file of the place.
fn replay(place: &Place, recording: &str, more: &str) -> Ended {
    let ended = place.tandem(&format!("replay {recording} {more}"));
    place.assert_clean(&ended.runs);
    ended
}

/// A replay that reaches its end, and says this.
#[track_caller]
fn prints(ended: Ended, phrases: &[&str]) {
    let ended = ended.expect(0);
    for phrase in phrases {
        has(&ended.stdout, phrase);
    }
}

const SAME: &str = "the same, to the bit";

#[test]
fn either_solver_answers_again_to_the_bit() {
    let place = Place::new();
    for (out, how) in [("three", ""), ("one", "--in-process")] {
        let ended = record(&place, out, HARD, &format!("{QUICK} {how}")).expect(0);
        place.assert_clean(&ended.runs);
        let recorded = RunFiles::read(&place.path(out));
        let file = format!("{out}/recording.tandem");
        for more in ["--dem", "--mpm", "--dem --in-process"] {
            let steps = format!("{} steps", recorded.number("steps") + 2.0);
            prints(replay(&place, &file, more), &[&steps, SAME]);
        }
    }
}

/// A solver may list its contacts otherwise, and all else the same.
#[test]
fn the_contacts_of_frames_are_compared() {
    let place = Place::new();
    record(
        &place,
        "out",
        HARD,
        &format!("{QUICK} --set output.frames=1e-3"),
    )
    .expect(0);
    let file = "out/recording.tandem";
    prints(replay(&place, file, "--dem"), &[SAME]);
    let mutant = mutants::command("R-6/2");
    let mutant = shlex::try_join(mutant.iter().map(String::as_str)).unwrap();
    let ended = replay(&place, file, &format!("--dem {}", quoted(&mutant)));
    has(&ended.expect(1).stdout, "dem/contacts");
}

/// All that can be wrong with a file, and a solver that answers otherwise: one recording serves.
#[test]
fn what_is_damaged_or_different_is_named() {
    let place = Place::new();
    record(&place, "out", HARD, QUICK).expect(0);
    let file = "out/recording.tandem";
    let whole = fs::read(place.path(file)).unwrap();
    let refused = |file: &str, more: &str, code: i32, phrase: &str| {
        replay(&place, file, more).expect(code).says(&[phrase]);
    };

    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    fs::write(place.path("flipped"), flipped).unwrap();
    refused("flipped", "--dem", 2, "is damaged after");

    fs::write(place.path("cut"), &whole[..whole.len() * 2 / 3]).unwrap();
    for side in ["--dem", "--mpm"] {
        prints(replay(&place, "cut", side), &[SAME, "ends in the middle"]);
    }

    refused("none", "--dem", 2, "cannot open the recording");
    refused(
        file,
        "--dem no-such-program",
        3,
        "cannot start the dem solver",
    );
    let ended =
        "the dem solver at step 0: expected Notice, got a solver that ended with exit status 1";
    refused(file, "--dem false", 3, ended);
    let built_in = "--in-process runs the built-in solver only, not `false`";
    refused(file, "--dem false --in-process", 2, built_in);
    refused(file, "--dem --set no.such=1", 2, "no such key");

    // 1e-9 more stiffness: reported where it first shows, and within a tolerance of 1e-6 it is the same.
    let stiffer = "--dem --set contact.linear.normal_stiffness=60000.00006";
    let ended = replay(&place, file, stiffer).expect(1);
    for phrase in ["first difference: step", "`stiffness_max`", "ulp"] {
        has(&ended.stdout, phrase);
    }
    let within = format!("{stiffer} --tolerance 1e-4");
    prints(replay(&place, file, &within), &["within 1e-4"]);
    // A heavier continuum is slower, which it says itself.
    let ended = replay(&place, file, "--mpm --set material.0.density=1001").expect(1);
    has(
        &ended.stdout,
        "first difference: step 0, mpm/notices, `courant_time`",
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
    let discs = format!("--dem \"{discs}\"");
    record(&place, "python", HARD, &format!("{QUICK} {discs}")).expect(0);
    let file = "python/recording.tandem";
    // Its own answers again to the bit; the built-in solver's but for rounding, if it resolves no contacts.
    prints(replay(&place, file, &discs), &[SAME]);
    let built_in = "--dem --tolerance 1e-9 --set contact_resolution=2";
    prints(replay(&place, file, built_in), &["the same within 1e-9"]);
    prints(replay(&place, file, "--mpm"), &[SAME]);
}

#[test]
fn one_solver_alone_is_recorded_too() {
    let place = Place::new();
    let bar = "--variant quick --in-process";
    record(&place, "bar", "chen2023/wave_1d", bar).expect(0);
    let file = "bar/recording.tandem";
    prints(replay(&place, file, "--mpm --in-process"), &[SAME]);
    let ended = replay(&place, file, "--dem").expect(2);
    ended.says(&["the recording has no dem"]);
    // And one that sends no points.
    record(&place, "incline", "verification/incline", "--in-process").expect(0);
    let file = "incline/recording.tandem";
    prints(replay(&place, file, "--dem --in-process"), &[SAME]);
}

#[test]
fn a_failure_is_replayed_with_its_words() {
    let place = Place::new();
    let away = format!("{QUICK} --set mpm.points.0.velocity=[-20.0,0.0] --set check=[]");
    let ended = record(&place, "out", HARD, &away);
    let ended = ended.expect(3).says(&["left the domain"]);
    place.assert_clean(&ended.runs);
    let file = "out/recording.tandem";
    let ended = replay(&place, file, "--mpm");
    prints(ended, &["fails as recorded", "left the domain"]);
    prints(replay(&place, file, "--dem"), &[SAME]);
}
