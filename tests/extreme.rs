//! The scenes at the edge: every variant of every scene in `scenes/extreme` ends as the table says, in a result that holds its
//! checks or in a reason, and with finite numbers only.

use std::collections::BTreeSet;

use crate::harness::{Place, RunFiles, catalogue, root, scene};
use serde_json::Value;

/// How a run ends.
#[derive(Debug, Clone, Copy)]
enum End {
    /// Exit 0: all checks hold.
    Holds,
    /// This exit status, and a reason with these phrases.
    Stops(i32, &'static [&'static str]),
}
use End::{Holds, Stops};

/// A point outside of the domain, by its number and place.
const LEFT: End = Stops(
    3,
    &["the mpm stopped at step", "point", "left the domain at ("],
);

/// Scene, variant (`plain`: the scene as it is), end.
const TABLE: &[(&str, &str, End)] = &[
    ("stiffness", "plain", Holds),
    ("stiffness", "ratio_1e-2", Holds),
    ("stiffness", "ratio_1e2", Holds),
    ("stiffness", "ratio_1e4", Holds),
    ("stiffness", "ratio_1e6", Holds),
    ("mass", "plain", Holds),
    ("mass", "ratio_1e-3", Holds),
    ("mass", "ratio_1e3", Holds),
    ("mass", "ratio_1e6", Holds),
    ("mass", "ratio_1e9", Holds),
    ("size", "plain", Holds),
    ("size", "disc_1e3", Holds),
    ("size", "disc_1e5", Holds),
    ("size", "edge_1e5", Holds),
    ("incompressible", "plain", Holds),
    ("incompressible", "neo_hookean", Holds),
    ("mach", "plain", Holds),
    ("mach", "linear_elastic", Holds),
    ("mach", "stiff_contact", Holds),
    (
        "mach",
        "soft_wall",
        Stops(
            3,
            &[
                "the dem stopped at step",
                "has passed through body 0 (wall) with an overlap of",
            ],
        ),
    ),
    ("squeeze", "plain", Holds),
    (
        "squeeze",
        "crushed",
        Stops(
            3,
            &[
                "the dem stopped at step",
                "point 0 is near the middle of body",
                "with an overlap of",
                "stiffer contact",
            ],
        ),
    ),
    ("shapes", "plain", Holds),
    ("shapes", "star", Holds),
    ("shapes", "needle_on", Holds),
    ("crowd", "plain", Holds),
    ("rest", "quick", Holds),
    ("rest", "frictionless", LEFT),
    ("spin", "plain", Holds),
    ("bodies_only", "plain", Holds),
    ("chain", "plain", Holds),
    ("chain", "coarse", Holds),
    ("chain", "eta_1", Holds),
    ("chain", "eta_1e-2", Holds),
    ("chain", "eta_1e-4", Holds),
    ("chain", "fine", Holds),
    (
        "chain",
        "lost",
        Stops(
            3,
            &[
                "marker 1 of chain 0 at (0.1, 0.12) m has lost its material",
                "no node near it has mass",
            ],
        ),
    ),
    ("chain", "outside", Holds),
    ("chain", "stiff", Holds),
    ("ring", "plain", Holds),
    (
        "ring",
        "soft_contact",
        Stops(3, &["more than three quarters of their contact distance"]),
    ),
    ("thin_floor", "plain", Holds),
    (
        "thin_floor",
        "crushed",
        Stops(
            3,
            &[
                "the dem stopped at step",
                "is near the middle of body 0 (floor)",
                "with an overlap of",
                "stiffer contact",
            ],
        ),
    ),
    ("ring", "plain", Holds),
    (
        "ring",
        "soft_contact",
        Stops(
            3,
            &[
                "the dem stopped at step",
                "of groups 0 and 1 overlap by",
                "they would pass through one another",
                "stiffer contact",
            ],
        ),
    ),
    ("leaving", "plain", LEFT),
    ("leaving", "thrown", LEFT),
    ("leaving", "remove", Holds),
    ("empty", "plain", Holds),
    ("empty", "points_only", Holds),
    ("forced", "plain", Holds),
    ("forced", "half_step", Holds),
    ("forced", "step_2", Holds),
    (
        "forced",
        "step_4",
        Stops(
            4,
            &["at t = ", "created numerically", "unstable with dt = "],
        ),
    ),
];

/// Scenes whose full length is for people with patience: their `quick` stands for them.
const LONG: &[&str] = &["rest"];

/// Names of checks that did not hold.
fn failed(files: &RunFiles) -> Vec<&str> {
    let checks = files.summary["checks"].as_array().expect("a list");
    checks
        .iter()
        .filter(|check| check["pass"] != true)
        .map(|check| check["name"].as_str().expect("a name"))
        .collect()
}

fn ends(name: &str, variant: &str, end: End) {
    let place = Place::new();
    let set: &[&str] = if variant == "plain" {
        &[]
    } else {
        &["--variant", variant]
    };
    let ended = place.run("out", &scene(&format!("extreme/{name}")), set);
    place.assert_clean(&ended.runs);
    let case = format!("{name}/{variant}");
    let files = RunFiles::read(&place.path("out"));
    let code = ended.status.code().expect("it is not killed");
    match end {
        Holds => {
            assert_eq!((code, failed(&files)), (0, vec![]), "{case}");
            let checks = files.summary["checks"].as_array().expect("a list");
            assert!(checks.len() >= 2, "{case}: a scene checks something");
        }
        Stops(status, phrases) => {
            assert_eq!(code, status, "{case}: {}", files.summary);
            let reason = files.text("reason");
            for phrase in phrases {
                assert!(
                    reason.contains(phrase),
                    "{case}: no `{phrase}` in: {reason}"
                );
            }
        }
    }
    // A NaN would be a null, or a word in the history.
    if files.number("steps") > 0.0 {
        files.history().assert_sound();
    }
    for energy in ["start", "end"] {
        let energies = files.summary["energy"][energy]
            .as_object()
            .expect("a table");
        assert!(
            energies.values().all(Value::is_number),
            "{case}: {energies:?}"
        );
    }
    assert!(files.summary["momentum_error"].is_number(), "{case}");
}

/// A test a scene, so that they run side by side and a failure names the scene.
macro_rules! scenes {
    ($($name:ident,)*) => {
        $(#[test]
        fn $name() {
            let of_scene = |row: &&(&str, &str, End)| row.0 == stringify!($name);
            for (name, variant, end) in TABLE.iter().filter(of_scene) {
                ends(name, variant, *end);
            }
        })*

        /// Scenes that have a test here.
        const TESTED: &[&str] = &[$(stringify!($name)),*];
    };
}

scenes! {
    stiffness,
    mass,
    size,
    incompressible,
    mach,
    squeeze,
    shapes,
    crowd,
    rest,
    spin,
    bodies_only,
    chain,
    ring,
    thin_floor,
    leaving,
    empty,
    forced,
}

#[test]
fn no_scene_and_no_variant_is_left_out() {
    let folder = root().join("scenes/extreme");
    let mut there = BTreeSet::new();
    for path in catalogue()
        .into_iter()
        .filter(|path| path.starts_with(&folder))
    {
        let name = path.file_stem().unwrap().to_str().unwrap().to_string();
        assert!(TESTED.contains(&name.as_str()), "{name} has no test");
        let table: toml::Table = std::fs::read_to_string(&path).unwrap().parse().unwrap();
        if !LONG.contains(&name.as_str()) {
            there.insert((name.clone(), "plain".to_string()));
        }
        for variant in table
            .get("variant")
            .and_then(|v| v.as_table())
            .into_iter()
            .flatten()
        {
            there.insert((name.clone(), variant.0.clone()));
        }
    }
    let listed: BTreeSet<_> = TABLE
        .iter()
        .map(|(name, variant, _)| (name.to_string(), variant.to_string()))
        .collect();
    assert_eq!(listed, there);
}

/// The blow-up is first seen at the last row, which the closing step measures: its length is zero, and not to blame.
#[test]
fn a_blow_up_seen_at_the_end_names_the_step_that_led_there() {
    let place = Place::new();
    let set = ["--set", "time.step_factor=5", "--set", "output.every=0.004"];
    let stability_alone = ["--set", "dem.contact_resolution=2"];
    let set = [&set[..], &["--set", "time.end=0.004"], &stability_alone].concat();
    place.run("out", &scene("extreme/forced"), &set).expect(4);
    let files = RunFiles::read(&place.path("out"));
    let reason = files.text("reason");
    let after = reason
        .split("dt = ")
        .nth(1)
        .unwrap_or_else(|| panic!("no step in: {reason}"));
    let dt: f64 = after.split(' ').next().unwrap().parse().unwrap();
    assert!(dt > 0.0 && dt <= files.number("dt_max"), "{reason}");
}
