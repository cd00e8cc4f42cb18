//! What no compiler and no linter holds: which crate sees which, and that a session can be simulated
//! (ARCHITECTURE.md). Which files may open files is in `clippy.toml`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;

use serde_json::Value;

use crate::harness::root;

/// What each crate sees of the others, by dependencies of any kind. The tests of `simulation` play the built-in solvers, those of
/// `rapier-dem` run scenes; nobody sees `guard`.
const ARROWS: &str = "
    config:
    interface: config
    mechanics: interface
    mpm-proc: conformance interface mechanics
    dem-proc: conformance interface mechanics
    record: interface mechanics
    scene: interface mechanics record
    coupler: interface record scene
    conformance: interface mechanics
    simulation: dem-proc interface mechanics mpm-proc
    mutant: conformance dem-proc interface mpm-proc
    study: coupler interface mechanics
    report: coupler interface
    guard: coupler dem-proc interface mechanics mpm-proc
    rapier-dem: conformance coupler dem-proc interface mechanics mpm-proc
    tandem: conformance coupler dem-proc interface mpm-proc mutant report study";
/// Dependencies of one crate only: the transport, the codec, the broad phase.
const OWNERS: [(&str, &str); 3] = [
    ("iceoryx2", "interface"),
    ("bincode", "interface"),
    ("parry2d-f64", "dem-proc"),
];
/// The order of the protocol names no clock, thread or file, so that it can be simulated; but for those who drive it.
const DRIVERS: [&str; 2] = ["stopwatch.rs", "together.rs"];

fn packages() -> Vec<Value> {
    let arguments = [
        "metadata",
        "--no-deps",
        "--offline",
        "--format-version",
        "1",
    ];
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .current_dir(root())
        .output()
        .unwrap();
    let output: Value = serde_json::from_slice(&output.stdout).expect("cargo metadata");
    output["packages"].as_array().expect("packages").clone()
}

/// `cargo run` and `cargo test` build all dependencies once, as long as tests, benchmarks and examples want no feature of one
/// that the program does without: `Cargo.toml` of the program names those that they want.
#[test]
fn the_program_and_its_tests_share_their_dependencies() {
    let tree = |scope: &[&str]| -> BTreeSet<String> {
        let output = Command::new(env!("CARGO"))
            .args(["tree", "--offline", "--prefix", "none", "--no-dedupe"])
            .args(["--format", "{p} {f}"])
            .args(scope)
            .current_dir(root())
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let text = String::from_utf8(output.stdout).expect("names of crates");
        text.lines().map(str::to_owned).collect()
    };
    let of_program = tree(&["--edges", "normal"]);
    let of_tests = tree(&["--workspace", "--edges", "normal,dev"]);
    let apart: Vec<&String> = of_program.difference(&of_tests).collect();
    assert!(
        apart.is_empty(),
        "tests want them with more features: {apart:#?}"
    );
}

#[test]
fn arrows_between_crates_point_down() {
    let arrows = ARROWS
        .lines()
        .filter_map(|line| line.trim().split_once(':'));
    let arrows: BTreeMap<&str, &str> = arrows.collect();
    let mut found = BTreeMap::new();
    let packages = packages();
    for package in &packages {
        let name = package["name"].as_str().unwrap();
        let sees = package["dependencies"].as_array().unwrap().iter();
        let sees: BTreeSet<&str> = sees.map(|other| other["name"].as_str().unwrap()).collect();
        let ours: Vec<&str> = sees
            .iter()
            .copied()
            .filter(|other| arrows.contains_key(other))
            .collect();
        found.insert(name, ours.join(" "));
        for (what, owner) in OWNERS {
            assert_eq!(
                sees.contains(what),
                owner == name,
                "{name}: {what} is for {owner} alone"
            );
        }
    }
    let arrows: BTreeMap<&str, String> = arrows
        .into_iter()
        .map(|(name, sees)| (name, sees.trim().to_owned()))
        .collect();
    assert_eq!(found, arrows);
}

#[test]
fn a_session_names_no_clock_thread_or_file() {
    let mut found = Vec::new();
    for entry in fs::read_dir(root().join("interface/src/session")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let code = code(&fs::read_to_string(&path).unwrap());
        let mut words = code.split(|c: char| !is_of_word(c));
        if words.any(|word| ["Instant", "SystemTime", "thread", "fs", "net"].contains(&word)) {
            found.push(name);
        }
    }
    found.sort();
    assert_eq!(found, DRIVERS);
}

/// A source without comments, and without the tests at its end.
fn code(text: &str) -> String {
    let text = text
        .split("\n#[cfg(test)]\nmod tests {")
        .next()
        .expect("a part");
    let lines = text
        .lines()
        .map(|line| line.split("//").next().expect("a part"));
    lines.collect::<Vec<_>>().join("\n")
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}
