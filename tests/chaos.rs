//! `tandem chaos` with the real binary: a few rounds of everything, and that it tells what is wrong.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

use crate::harness::{Place, scene};

/// A coupled run of some hundredths of a second.
const TINY: &[&str] = &[
    "--variant",
    "quick",
    "--set",
    "time.end=0.03",
    "--set",
    "check=[]",
];

fn play(place: &Place, scene: &str, more: &[&str]) -> crate::harness::Ended {
    let out = place.path("chaos");
    let out = ["--out", out.to_str().unwrap()];
    let words = [&["chaos", scene][..], TINY, &out, more].concat();
    place.start(&words).end()
}

/// The row of the table that adds all up.
#[track_caller]
fn sums(stdout: &str) -> Vec<u64> {
    let row = stdout.lines().find(|line| line.starts_with("| all |"));
    let row = row.unwrap_or_else(|| panic!("no table: {stdout}"));
    let numbers = row.split('|').skip(2).map(str::trim);
    numbers
        .filter(|n| !n.is_empty())
        .map(|n| n.parse().unwrap())
        .collect()
}

#[test]
fn a_few_rounds_of_everything_leave_the_same_bits() {
    let place = Place::new();
    let scene = scene("jiang2020/normal_force");
    let seed = crate::harness::dice(1 << 32).to_string();
    println!("seed {seed}");
    let ended = play(&place, &scene, &["--rounds", "45", "--seed", &seed]);
    println!("{}", ended.stdout);
    let ended = ended.expect(0);
    let sums = sums(&ended.stdout);
    assert_eq!(sums[0], 45);
    assert!(sums[2] + sums[3] > 0, "something had to be gone on with");
    assert_eq!(sums[4..], [0; 5]);
    let kept = fs::read_dir(place.path("chaos")).unwrap();
    let kept = kept.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let of_rounds: Vec<String> = kept.filter(|name| name.starts_with("round")).collect();
    assert!(of_rounds.is_empty(), "{of_rounds:?}");
}

/// A program whose `resume` adds a row to the history of a run, as if a row had come twice.
#[test]
fn a_failed_round_is_reported_with_a_command_that_repeats_it() {
    let place = Place::new();
    let wrong = place.write(
        "tandem",
        &format!(
            "#!/bin/sh\nif [ \"$1\" != resume ]; then exec '{0}' \"$@\"; fi\n\
             '{0}' \"$@\"\ncode=$?\necho 1 >> \"$2/history.csv\"\nexit $code\n",
            env!("CARGO_BIN_EXE_tandem")
        ),
    );
    fs::set_permissions(&wrong, fs::Permissions::from_mode(0o755)).unwrap();
    let out = place.path("chaos");
    let scene = scene("jiang2020/normal_force");
    let ended = Command::new(env!("CARGO_BIN_EXE_tandem"))
        .args(["chaos", &scene, "--out", out.to_str().unwrap()])
        .args(TINY)
        .args(["--rounds", "6", "--only", "interrupt", "--seed", "5"])
        .args(["--program", wrong.to_str().unwrap()])
        .env("TANDEM_RUNTIME_DIR", place.temporary_path())
        .output()
        .unwrap();
    let stdout = String::from_utf8(ended.stdout).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{stdout}");
    assert!(sums(&stdout)[7] > 0, "{stdout}");
    assert!(
        stdout.contains("different bits: history.csv differs"),
        "{stdout}"
    );
    assert!(stdout.contains("again: tandem chaos "), "{stdout}");
    assert!(stdout.contains("--seed 5 --first "), "{stdout}");
}

#[test]
fn a_kind_that_does_not_exist_and_a_scene_that_fails_are_refused() {
    let place = Place::new();
    let good = scene("jiang2020/normal_force");
    play(&place, &good, &["--only", "flood"])
        .expect(2)
        .says(&["expected one of", "kill-several"]);
    let stops = ["--set", "dem.point_contact.linear.normal_stiffness=-1"];
    play(&place, &good, &stops).expect(2);
}
