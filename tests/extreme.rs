//! The scenes at the edge (`scenes/extreme`) that stop by themselves: each says why, and leaves finite numbers only. How a variant
//! ends its scene says (`expect`); that it does, and with which bits, is a row of `hashes.rs`.

use crate::harness::{Place, RunFiles, has, scene};
use crate::hashes::{baseline, option};
use serde_json::Value;

/// A point outside of the domain, by its number and place.
const LEFT: &[&str] = &["the mpm stopped at step", "point", "left the domain at ("];
const DEEP: &[&str] = &[
    "the dem stopped at step",
    "is near the middle of body",
    "with an overlap of",
    "stiffer contact",
];

/// Scene, variant, what its reason has.
const STOPS: [(&str, &str, &[&str]); 9] = [
    (
        "forced",
        "step_4",
        &["at t = ", "created numerically", "unstable with dt = "],
    ),
    ("leaving", "plain", LEFT),
    ("leaving", "thrown", LEFT),
    (
        "mach",
        "soft_wall",
        &[
            "the dem stopped at step",
            "has passed through body 0 (wall) with an overlap of",
        ],
    ),
    ("rest", "frictionless", LEFT),
    ("squeeze", "crushed", DEEP),
    ("thin_floor", "crushed", DEEP),
    (
        "chain",
        "lost",
        &[
            "marker 1 of chain 0 at (0.1, 0.12) m has lost its material",
            "no node near it has mass",
        ],
    ),
    (
        "ring",
        "soft_contact",
        &[
            "of groups 0 and 1 overlap by",
            "they would pass through one another",
            "stiffer contact",
        ],
    ),
];

#[test]
fn every_scene_that_stops_by_itself_says_why() {
    let rows = baseline().into_iter().filter(|row| row.outcome.exit > 1);
    let rows =
        rows.filter_map(|row| Some((row.case.scene.strip_prefix("extreme/")?.to_owned(), row)));
    let stops: Vec<_> = rows.collect();
    let named = STOPS.map(|(name, variant, _)| (name.to_owned(), variant));
    let listed = stops
        .iter()
        .map(|(name, row)| (name.clone(), row.case.variant.as_str()));
    assert!(listed.eq(named));
    for ((name, row), (.., phrases)) in stops.iter().zip(STOPS) {
        let place = Place::new();
        let set = option(&row.case.variant);
        let ended = place.run("out", &scene(&row.case.scene), &set);
        let ended = ended.expect(row.outcome.exit);
        place.assert_clean(&ended.runs);
        let files = RunFiles::read(&place.path("out"));
        let reason = files.text("reason");
        for phrase in phrases {
            has(reason, phrase);
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
                "{name}: {energies:?}"
            );
        }
        assert!(files.summary["momentum_error"].is_number(), "{name}");
    }
}

/// The blow-up is first seen at the last row, which the closing step measures: its length is zero, and not to blame.
#[test]
fn a_blow_up_seen_at_the_end_names_the_step_that_led_there() {
    let place = Place::new();
    let stability_alone = "--set time.step_factor=5 --set dem.contact_resolution=2";
    let set = format!("{stability_alone} --set output.every=0.004 --set time.end=0.004");
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
