//! The same bits whatever the transport, the threads and the window.

use crate::harness::{Place, RunFiles, scene};

/// Ways to run a scene that must not show in its result. The first is what the others are compared with.
const WAYS: [&str; 8] = [
    "",
    "--in-process",
    "--threads 1",
    "--threads 2",
    "--window 1",
    "--window 8",
    "--window 64",
    "--in-process --threads 2 --window 1",
];

/// Runs a scene in every way; its final state, and every number of its history, is the same.
#[track_caller]
fn assert_same_bits(scene: &str, set: &str, code: i32) {
    let mut first: Option<(RunFiles, Vec<String>)> = None;
    for (k, way) in WAYS.iter().enumerate() {
        let place = Place::new();
        let ended = place
            .run("out", scene, &format!("{set} {way}"))
            .expect(code);
        place.assert_clean(&ended.runs);
        let files = RunFiles::read(&place.path("out"));
        let hash = files.text("state_hash");
        assert_eq!(hash.len(), 64, "{hash}");
        let text = std::fs::read_to_string(place.path("out/history.csv")).unwrap();
        let rows: Vec<String> = text.lines().map(String::from).collect();
        let Some((reference, reference_rows)) = &first else {
            first = Some((files, rows));
            continue;
        };
        // Where they part first says more than that the ends differ.
        let pairs = reference_rows.iter().zip(&rows);
        if let Some((row, (a, b))) = pairs.enumerate().find(|(_, (a, b))| a != b) {
            panic!("{way:?} (way {k}) differs first in row {row}:\n{a}\n{b}");
        }
        assert_eq!(rows.len(), reference_rows.len(), "{way:?}");
        assert_eq!(hash, reference.text("state_hash"), "{way:?}");
        for key in [
            "scene_hash",
            "steps",
            "time",
            "dt_min",
            "dt_max",
            "dt_bound_by",
            "momentum_error",
            "energy",
        ] {
            assert_eq!(
                files.summary[key], reference.summary[key],
                "{key} with {way:?}"
            );
        }
    }
}

#[test]
fn a_collision_is_the_same_in_every_way() {
    assert_same_bits(&scene("jiang2020/collision_hard"), "--variant quick", 0);
}

/// Tangential springs, friction, dashpots, gravity and a fixed body; too short for what the scene must show (exit 1).
#[test]
fn friction_and_gravity_are_the_same_in_every_way() {
    let set = "--set time.end=0.02 --set check=[]";
    assert_same_bits(&scene("jiang2020/friction_force"), set, 0);
}

/// A run is told apart from a slightly different one: the hash is of the state, not of the scene's name.
#[test]
fn another_state_has_another_hash() {
    let hash = |velocity: &str| {
        let place = Place::new();
        let short = "--variant quick --set time.end=0.001 --set check=[]";
        let set = format!("{short} --set mpm.points.0.velocity=[{velocity},0.0]");
        let hard = scene("jiang2020/collision_hard");
        place.run("out", &hard, &set).expect(0);
        RunFiles::read(&place.path("out"))
            .text("state_hash")
            .to_owned()
    };
    let original = hash("2.0");
    assert_eq!(hash("2.0"), original);
    assert_ne!(hash("2.0000000000000004"), original);
}
