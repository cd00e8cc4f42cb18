//! A scene that begins with the state of another run: filled once, opened in several ways.

use std::fs;
use std::path::Path;

use crate::harness::{Ended, History, Place, RunFiles};

/// Sand on a gate between the walls of the domain, and a disc on top.
const SILO: &str = r#"
version = 1
name = "silo"
gravity = [0.0, -9.81]

[time]
end = 0.2

[mpm]
cell = 0.02
domain = [[0.1, 0.0], [0.3, 0.6]]
shape = "quadratic_bspline"
transfer.blend = { pic_fraction = 0.02 }
walls = { left = "slip", right = "slip", bottom = "slip" }

[[mpm.material]]
name = "sand"
density = 1500.0
model.drucker_prager = { bulk_modulus = 1e6, shear_modulus = 5e5, friction_angle = 30.0, dilation_angle = 0.0, cohesion = 0.0, tensile_strength = 0.0 }

[[mpm.points]]
name = "sand"
material = "sand"
fill.rectangle = { lower = [0.1, 0.26], upper = [0.3, 0.36] }
spacing.per_cell = 4

[[dem.body]]
name = "gate"
shape.segment = { ends = [[0.05, 0.24], [0.35, 0.24]] }
sphero_radius = 0.01
motion = "fixed"

[[dem.body]]
name = "disc"
shape = "disc"
sphero_radius = 0.02
density = 1000.0
position = [0.2, 0.4]

[contact]
linear = { normal_stiffness = 1e5, tangential_stiffness = 5e4, friction = 0.3, damping_ratio = 0.1 }

[body_contact]
linear = { normal_stiffness = 1e5, tangential_stiffness = 5e4, friction = 0.3, damping_ratio = 0.1 }

[output]
every = 0.01
checkpoint = { at = [0.1], end = true }

[[output.column]]
name = "y"
unit = "m"
value = "points.sand.y"

[[output.column]]
name = "disc"
unit = "m"
value = "body.disc.y"

[[output.column]]
name = "friction"
unit = "J/m"
value = "energy.friction"

[[check]]
name = "no energy is created"
value = "energy.residual_relative"
when = "max"
at_most = 0.01
source = "of the energy in play; the ledger begins with the run"

[[check]]
name = "momentum is conserved"
value = "momentum_error"
when = "max"
at_most = 1e-12
source = "rounding only"
"#;

/// The silo, and the run that has filled it.
fn filled(place: &Place) -> String {
    let scene = place.write("silo.toml", SILO).display().to_string();
    place.run("fill", &scene, "--in-process").expect(0);
    scene
}

fn branch(place: &Place, out: &str, scene: &str, from: &str, more: &[&str]) -> Ended {
    let set = more.iter().map(|value| format!("--set '{value}'"));
    let set = set.collect::<Vec<_>>().join(" ");
    place.run(
        out,
        scene,
        &format!("--in-process --set start.from={from} {set}"),
    )
}

/// Rows of the history: time, then the columns.
fn history(dir: &Path) -> Vec<Vec<f64>> {
    History::read(&dir.join("history.csv")).rows
}

/// Bits of the rows after `time` (s), energies that are counted from the start left out.
fn states_after(dir: &Path, time: f64) -> Vec<[u64; 3]> {
    let rows = history(dir).into_iter().filter(|row| row[0] > time);
    rows.map(|row| [row[0], row[1], row[2]].map(f64::to_bits))
        .collect()
}

#[test]
fn a_branch_with_nothing_changed_has_the_bits_of_the_undisturbed_run() {
    let place = Place::new();
    let scene = filled(&place);
    let long = "--in-process --set time.end=0.3 --set output.checkpoint.time=0.0123";
    place.run("whole", &scene, long).expect(0);
    let whole = RunFiles::read(&place.path("whole"));
    // From the end of a shorter run, from a row of the history, and from the newest, in the middle of an epoch.
    for (out, from, begin) in [
        ("after", "fill", 0.2),
        ("row", "whole@0.1", 0.1),
        ("before", "fill@0.19", 0.1),
        ("middle", "whole@0.299", 0.299),
    ] {
        branch(&place, out, &scene, from, &["time.end=0.3"]).expect(0);
        let ours = RunFiles::read(&place.path(out));
        assert_eq!(ours.text("state_hash"), whole.text("state_hash"), "{from}");
        assert_eq!(
            states_after(&place.path(out), begin),
            states_after(&place.path("whole"), begin),
            "{from}"
        );
    }
    // The row at the start is measured too, where an epoch begins there; its sums are zero.
    let first = &history(&place.path("after"))[0];
    assert_eq!((first[0], first[3]), (0.2, 0.0));
    let last = history(&place.path("whole")).pop().unwrap();
    assert!(last[3] > history(&place.path("after")).pop().unwrap()[3]);
}

#[test]
fn a_silo_is_filled_once_and_opened_in_several_ways() {
    let place = Place::new();
    let scene = filled(&place);
    let rest = history(&place.path("fill")).pop().unwrap();
    let driven = "dem.body.0.motion=driven";
    let end = "time.end=0.5";
    let fast = "dem.body.0.velocity=[0.0, -6.0]";
    // Energy created falls with the step: 1.24 % at the composed step of 3 to 5e-4 s, 0.89 % at this one, 0.2 % at 8e-5 s.
    let short = "time.max_step=2e-4";
    let undamped = [
        "contact.linear.damping_ratio=0.0",
        "body_contact.linear.damping_ratio=0.0",
    ];
    // Each passes the scene's checks: no gate creates energy, also where it leaves its contacts within a step.
    let ways: [(&str, &[&str]); 7] = [
        ("right", &[end, driven, "dem.body.0.velocity=[3.0, 0.0]"]),
        ("left", &[end, driven, "dem.body.0.velocity=[-3.0, 0.0]"]),
        ("down", &[end, driven, "dem.body.0.velocity=[0.0, -1.0]"]),
        ("fast", &[end, driven, fast, short]),
        (
            "undamped",
            &[end, driven, fast, short, undamped[0], undamped[1]],
        ),
        ("shut", &[end, "gravity=[0.0, -3.0]"]),
        (
            "harder",
            &[
                end,
                "mpm.material.0.model.drucker_prager.shear_modulus=5e6",
                "mpm.material.0.model.drucker_prager.friction_angle=20.0",
                "contact.linear.normal_stiffness=1e6",
                "contact.linear.friction=0.0",
                "body_contact.linear.damping_ratio=0.0",
            ],
        ),
    ];
    let hash = |out: &str| place.state_hash(out);
    let mut hashes = std::collections::BTreeSet::new();
    let mut states = std::collections::BTreeSet::new();
    for (out, more) in ways {
        branch(&place, out, &scene, "fill", more).expect(0);
        let rows = history(&place.path(out));
        assert_eq!(rows[0][0], 0.2, "the clock continues");
        assert_eq!(
            rows[0][1].to_bits(),
            rest[1].to_bits(),
            "points are where they were"
        );
        assert_eq!(rows[0][3], 0.0, "sums begin anew");
        let fallen = rest[1] - rows.last().unwrap()[1];
        let open = !["shut", "harder"].contains(&out);
        assert_eq!(fallen > 0.1, open, "{out}: {fallen} m");
        hashes.insert(hash(out));
        let files = RunFiles::read(&place.path(out));
        let start = &files.summary["start"];
        assert!(start[0].as_str().unwrap().ends_with("/fill@0.2"), "{start}");
        states.insert(start[1].as_str().unwrap().to_owned());
    }
    assert_eq!(hashes.len(), 7);
    assert_eq!(states.len(), 1, "they begin with one state");
    // What was run is in scene.toml, wherever it is run again.
    let text = fs::read_to_string(place.path("left/scene.toml")).unwrap();
    assert!(text.contains(states.first().unwrap()));
    place.run("again", "left/scene.toml", "").expect(0);
    assert_eq!(hash("again"), hash("left"));
    let zero = ["start.time=0", "time.end=0.1"];
    branch(&place, "zero", &scene, "fill", &zero).expect(0);
    assert_eq!(history(&place.path("zero"))[0][0], 0.0);
}

#[test]
fn a_branch_of_a_branch_goes_on_and_is_resumed() {
    let place = Place::new();
    let scene = filled(&place);
    let open = ["dem.body.0.motion=driven", "dem.body.0.velocity=[3.0, 0.0]"];
    let keep = ["output.checkpoint.at=[0.3]", "output.frames=0.05"];
    let first = [&open[..], &keep, &["time.end=0.4"]].concat();
    branch(&place, "first", &scene, "fill@0.2", &first).expect(0);
    let second = [&open[..], &["time.end=0.4", "output.frames=0.05"]].concat();
    branch(&place, "second", &scene, "first@0.3", &second).expect(0);
    let hash = |out: &str| place.state_hash(out);
    assert_eq!(hash("second"), hash("first"));
    // The bodies are drawn where they are, though no frame is of where the scene puts them.
    let frame = |out: &str, n: u32| {
        let path = place.path(out).join(format!("frames/bodies_{n:04}.vtu"));
        fs::read(path).unwrap()
    };
    assert!(frame("second", 1) == frame("first", 3));
    // A branch is resumed without its parent.
    let dir = place.path("second");
    for parent in ["fill", "first"] {
        fs::remove_dir_all(place.path(parent)).unwrap();
    }
    let before = fs::read(dir.join("history.csv")).unwrap();
    place.tandem("resume second").expect(0);
    assert!(fs::read(dir.join("history.csv")).unwrap() == before);
}

#[test]
fn what_may_not_change_is_refused_by_its_key_with_both_values() {
    let place = Place::new();
    let scene = filled(&place);
    let refused: [(&str, &[&str]); 15] = [
        ("mpm.cell=0.01", &["`mpm.cell` is 0.01", "it is 0.02"]),
        (
            "mpm.shape=linear",
            &["`mpm.shape`", "linear", "quadratic_bspline"],
        ),
        ("mpm.transfer=apic", &["`mpm.transfer`", "apic"]),
        (
            "mpm.points.0.spacing.per_cell=9",
            &["`mpm.points.0.spacing.per_cell` is 9", "it is 4"],
        ),
        (
            "mpm.points.0.velocity=[1.0, 0.0]",
            &[
                "`mpm.points.0.velocity.0` is 1",
                "begins with the positions and velocities",
            ],
        ),
        (
            "mpm.material.0.density=1000.0",
            &["`mpm.material.0.density` is 1000", "1500"],
        ),
        ("mpm.walls.left=periodic", &["periodic"]),
        ("mpm.stress_update=usl", &["`mpm.stress_update`"]),
        (
            "dem.body.1.sphero_radius=0.03",
            &["`dem.body.1.sphero_radius` is 0.03", "0.02"],
        ),
        (
            "dem.body.1.position=[0.2, 0.5]",
            &["`dem.body.1.position.1` is 0.5", "0.4"],
        ),
        (
            "dem.body.1.velocity=[1.0, 0.0]",
            &["`dem.body.1.velocity.0` is 1"],
        ),
        (
            "dem.body.1.motion=fixed",
            &["`dem.body.1.motion` is \"fixed\"", "forces move stays one"],
        ),
        ("dem.overlap=nearest_edge", &["`dem.overlap`"]),
        ("coupling.skin=0.02", &["`coupling.skin` is 0.02"]),
        (
            "time.end=0.15",
            &["`time.end` is 0.15 s", "begins at 0.2 s"],
        ),
    ];
    for (set, says) in refused {
        let more = if set.starts_with("time") {
            vec![set]
        } else {
            vec![set, "time.end=0.3"]
        };
        branch(&place, "no", &scene, "fill", &more)
            .expect(2)
            .says(says);
        assert!(!place.path("no").exists(), "{set}");
    }
}

#[test]
fn a_check_looks_at_the_run_that_a_scene_begins_with() {
    let place = Place::new();
    let scene = filled(&place);
    let check = |command: &str, from: &str, set: &str| {
        let from = place.path(from).display().to_string();
        let begin = format!("--set start.from={from} --set time.end=0.3");
        place.tandem(&format!("{command} {scene} {begin} --set '{set}'"))
    };
    // The disc has sunk onto the sand: what the scene describes is not what is begun with.
    check("check", "fill", "time.max_step=1e-4").expect(0);
    for command in ["check", "plan"] {
        check(command, "fill", "mpm.cell=0.01")
            .expect(2)
            .says(&["`mpm.cell` is 0.01", "it is 0.02"]);
    }
    // Such a check had no sample at the end of the run, or a mean was over a part of its window.
    for (set, key) in [
        ("check.0.from=0.1", "from"),
        ("check.0.to=0.1", "to"),
        ("check.0.when={at=0.1}", "when.at"),
    ] {
        let says = format!("`check.0.{key}` is 0.1 s, and the scene begins at 0.2 s");
        check("check", "fill", set).expect(2).says(&[&says]);
    }
    check("check", "fill", "check.0.from=0.2").expect(0);
    // Rows were counted from 0: the clock goes on from 0.2 s.
    let ended = check("plan", "fill", "time.max_step=1e-4").expect(0);
    assert!(ended.stdout.contains("every 0.01 s, 11 rows"));
    let ended = check("check", "nowhere", "time.max_step=1e-4").expect(0);
    assert!(ended.stdout.contains("`start.from` is not looked at"));
    let ended = check("plan", "nowhere", "time.max_step=1e-4").expect(0);
    assert!(ended.stdout.contains("`start.from` is not looked at"));
    // No run would begin with a region that holds no points, whatever its state.
    let small = "mpm.points.0.fill={polygon={vertices=[[0.2, 0.3], [0.201, 0.3], [0.2, 0.301]]}}";
    for command in ["check", "plan"] {
        check(command, "nowhere", small)
            .expect(2)
            .says(&["group 'sand' has no points"]);
    }
}

/// The state has a stress of its own: one of the start, which weaker sand cannot bear, does not matter.
#[test]
fn a_branch_may_weaken_sand_that_began_under_stress() {
    let place = Place::new();
    let scene = place.write("silo.toml", SILO).display().to_string();
    let stress = r#"mpm.points.0.stress=["-7e3*(0.36-y)", "-14e3*(0.36-y)", "-7e3*(0.36-y)", 0]"#;
    let more = format!("--set output.checkpoint={{end=true}} --set '{stress}'");
    let strong = format!("--in-process --set time.end=0.02 {more}");
    place.run("strong", &scene, &strong).expect(0);
    let weak = format!("{more} --set mpm.material.0.model.drucker_prager.friction_angle=15.0");
    let check = |more: &str| place.tandem(&format!("check {scene} {weak} {more}"));
    check("").expect(2).says(&["mpm.points.0.stress"]);
    let from = place.path("strong").display().to_string();
    check(&format!("--set start.from={from}")).expect(0);
    let weak = format!("--in-process --set start.from=strong --set time.end=0.04 {weak}");
    place.run("weak", &scene, &weak).expect(0);
}

#[test]
fn what_cannot_be_begun_with_is_refused_with_the_reason() {
    let place = Place::new();
    let scene = filled(&place);
    let end = ["time.end=0.3"];
    let refuse = |from: &str, says: &[&str]| {
        branch(&place, "no", &scene, from, &end)
            .expect(2)
            .says(says);
    };
    refuse("nowhere", &["`start.from` is no run", "nowhere"]);
    refuse(
        "fill@0.05",
        &["no checkpoint of t = 0.05 s or before", "0.2 s, 0.1 s"],
    );
    refuse("@0.1", &["expected RUN or RUN@TIME"]);
    let none = "--in-process --set output.checkpoint={wall=1000.0}";
    place.run("none", &scene, none).expect(0);
    refuse("none", &["has no checkpoint", "output.checkpoint"]);
    // Not over its own parent.
    branch(&place, "fill", &scene, "fill", &end)
        .expect(2)
        .says(&["replace the one"]);
    // Another state than the one that was begun with.
    let state = ["time.end=0.3", "start.state=0123"];
    branch(&place, "no", &scene, "fill", &state)
        .expect(2)
        .says(&["`start.state` is 0123"]);
    let damaged = place.path("fill").join("checkpoints");
    let newest = fs::read_dir(&damaged)
        .unwrap()
        .map(|e| e.unwrap().path())
        .max()
        .unwrap();
    let bytes = fs::read(&newest).unwrap();
    fs::write(&newest, &bytes[..bytes.len() - 7]).unwrap();
    refuse("fill", &["is damaged"]);
    let scene_file = place.path("fill").join("scene.toml");
    let text = fs::read_to_string(&scene_file).unwrap();
    fs::write(&scene_file, text.replace("cell = 0.02", "cell = 0.01")).unwrap();
    refuse("fill@0.1", &["is not of this run", "scene hash"]);
    for (at, says) in [
        ("[0.105]", "not the time of a row of the history"),
        ("[0.0]", "a time of `output.every` or later"),
        ("[0.7]", "up to the end of the run"),
    ] {
        let at = format!("--set output.checkpoint.at={at}");
        place.run("no", &scene, &at).expect(2).says(&[says]);
    }
}
