//! A solver that says in Hello what it takes is refused by the line and the key of the scene that needs more.

use std::path::Path;

use coupler::scene::{Scene, SceneFile, unmet};
use interface::config::capability::Capabilities;
use interface::config::needs::Need;
use interface::message::control::Party;

const SCENE: &str = r#"version = 1
name = "needs"
time.end = 0.1
output.every = 0.1

[mpm]
cell = 0.1
domain = [[0.0, 0.0], [2.0, 1.0]]
shape = "ugimp"
transfer.blend = { pic_fraction = 0.01 }
walls = { bottom = "slip" }

[[mpm.material]]
name = "rubber"
density = 1000.0
model.linear_elastic = { bulk_modulus = 5e6, shear_modulus = 3e6 }

[[mpm.points]]
name = "block"
material = "rubber"
fill.rectangle = { lower = [0.2, 0.2], upper = [0.6, 0.6] }
spacing.per_cell = 4

[[dem.body]]
name = "ball"
shape = "disc"
sphero_radius = 0.1
density = 2000.0
position = [1.0, 0.5]

[[dem.body]]
name = "box"
shape.rectangle = { width = 0.2, height = 0.2 }
position = [1.5, 0.5]
motion = "fixed"

[[dem.fill]]
name = "grain"
count = 3
seed = 1
grain.polygon = { corners = 5, roundness = 0.1 }
size.equal = 0.05
density = 2000.0
arrange.rows = { corner = [0.5, 0.7], width = 1.0 }

[contact.linear]
normal_stiffness = 6e4
tangential_stiffness = 3e4
friction = 0.5

[body_contact.granular]
normal_stiffness = 6e4
rolling_friction = 0.1

[variant.springy]
"contact.linear.damping_ratio" = 0.1
"#;

/// The scene with a variant and settings.
fn scene(variant: Option<&str>, set: &[&str]) -> Scene {
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let file = SceneFile::of_text("needs.toml", SCENE, Path::new("."));
    let scene = file.and_then(|file| file.scene(variant, &set));
    scene.unwrap_or_else(|errors| panic!("{errors}"))
}

/// The refusal of the scene for the solver `toy 1` of `party`.
fn refusal(
    (variant, set): (Option<&str>, &[&str]),
    party: Party,
    capabilities: &[&str],
) -> Option<String> {
    let scene = scene(variant, set);
    let errors = unmet(&scene, party, "toy 1", &Capabilities::of(capabilities))?;
    Some(errors.to_string())
}

const AS_IT_IS: (Option<&str>, &[&str]) = (None, &[]);

fn bodies(capabilities: &[&str]) -> Option<String> {
    refusal(AS_IT_IS, Party::Dem, capabilities)
}

fn continuum(capabilities: &[&str]) -> Option<String> {
    refusal(AS_IT_IS, Party::Mpm, capabilities)
}

#[test]
fn a_solver_without_a_list_or_with_all_capabilities_is_accepted() {
    assert_eq!(bodies(&[]), None);
    assert_eq!(continuum(&[]), None);
    // Families that are not listed are checked at Configure, but single words have to be listed.
    let layers = (None, &["mpm.layers=true"][..]);
    let message = refusal(layers, Party::Mpm, &[]).unwrap();
    assert!(
        message.contains("`mpm.layers` needs `layers`, which the solver"),
        "{message}"
    );
    assert_eq!(refusal(layers, Party::Mpm, &["layers"]), None);
    let all = ["shape:disc", "shape:rectangle", "shape:polygon", "save"];
    assert_eq!(bodies(&all), None);
    assert_eq!(refusal(AS_IT_IS, Party::Coupler, &["shape:disc"]), None);
}

#[test]
fn a_refused_shape_is_located_with_the_shapes_that_are_taken() {
    let message = bodies(&["shape:disc", "shape:polygon"]).unwrap();
    assert_eq!(
        message,
        "error: `dem.body.1.shape` needs rectangle, and the solver of the bodies, `toy 1`, takes only disc, polygon
  --> needs.toml:33:1  (dem.body.1.shape)
   33 | shape.rectangle = { width = 0.2, height = 0.2 }
      | ^^^^^
   help: change the scene, or use another solver (`--dem`, `solvers.dem`)
"
    );
}

#[test]
fn a_body_of_a_set_is_reported_by_the_set() {
    let message = bodies(&["shape:disc", "shape:rectangle", "motion:fixed"]).unwrap();
    assert!(
        message.contains("`dem.fill.0.grain` needs polygon"),
        "{message}"
    );
    assert!(
        message.contains("needs.toml:41:1  (dem.fill.0.grain)"),
        "{message}"
    );
    assert!(message.contains("2 more keys need the same"), "{message}");
    // The ball, whose motion is not written, and the three of the set.
    let motion =
        "`dem.body.0.motion`, which is not in the scene and has this value by default, needs free";
    assert!(message.contains(motion), "{message}");
    assert!(message.contains("3 more keys need the same"), "{message}");
    let before = message.find("dem.body.0.motion").unwrap() < message.find("dem.fill.0").unwrap();
    assert!(before, "in the order of the file: {message}");
}

#[test]
fn laws_and_their_numbers_are_reported_by_the_scenes_sections() {
    let message = bodies(&["law:linear", "feature:damping", "feature:body_contact"]).unwrap();
    for phrase in [
        "`body_contact` needs granular",
        "`contact.linear.friction` needs friction",
        "needs.toml:49:12  (contact.linear.friction)",
        "`body_contact.granular.rolling_friction` needs rolling_friction",
        "takes only damping, body_contact",
    ] {
        assert!(message.contains(phrase), "{phrase}: {message}");
    }
    assert_eq!(message.matches("error:").count(), 3, "{message}");
}

#[test]
fn the_continuum_is_reported_by_its_keys() {
    let message =
        continuum(&["transfer:flip", "wall:open", "material:fluid", "fill:disc"]).unwrap();
    for phrase in [
        "`mpm.transfer` needs blend, and the solver of the continuum, `toy 1`, takes only flip",
        "`mpm.walls.bottom` needs slip",
        "needs.toml:11:20  (mpm.walls.bottom)",
        "`mpm.material.0.model` needs linear_elastic",
        "`mpm.points.0.fill` needs rectangle",
    ] {
        assert!(message.contains(phrase), "{phrase}: {message}");
    }
    assert_eq!(message.matches("error:").count(), 4, "{message}");
}

#[test]
fn an_override_is_reported_at_its_place() {
    let frictional = [
        "feature:friction",
        "feature:body_contact",
        "feature:rolling_friction",
    ];
    assert_eq!(bodies(&frictional), None);
    let variant = (Some("springy"), &[][..]);
    let message = refusal(variant, Party::Dem, &frictional).unwrap();
    assert!(message.contains("set by variant `springy`"), "{message}");
    let set = ["contact.linear.damping_ratio=0.2"];
    let message = refusal((None, &set), Party::Dem, &frictional).unwrap();
    let place = "command line: --set contact.linear.damping_ratio=0.2";
    assert!(message.contains(place), "{message}");
}

/// Without points there is no `[contact]`: what needs the law is `[body_contact]`.
#[test]
fn bodies_alone_are_reported_by_their_law() {
    let scenes =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/verification/body_bounce.toml");
    let scene = Scene::load(&scenes, None, &[]).unwrap();
    assert!(scene.mpm.is_none() && scene.dem.is_some());
    let area = Capabilities::of(&["law:area"]);
    let message = unmet(&scene, Party::Dem, "toy 1", &area)
        .unwrap()
        .to_string();
    assert!(message.contains("`body_contact` needs linear"), "{message}");
    assert!(message.contains("body_bounce.toml:"), "{message}");
}

/// Settings of the scene, what they need besides, the first key with that need, and how many keys of both sides
/// have it.
const NEEDS: &str = "
mpm.layers=true | layers | mpm.layers | 1
mpm.layers=true; OTHER; PAIR | pairs | group_pair.0 | 2
mpm.interface=segments; dem.fill=[]; dem.body.1.shape=disc; dem.body.1.sphero_radius=0.1; mpm.chain=[{ name = 'c', points = 'block', spacing = 0.1 }] | segments | mpm.interface | 2
mpm.points.0.lattice=outline | lattice:outline | mpm.points.0.lattice | 1
mpm.walls.bottom.friction.coefficient=0.5 | wall:friction | mpm.walls.bottom | 1
mpm.body_force=[0, 't'] | feature:fields | mpm.body_force | 1
mpm.points.0.velocity=['x', 0]; mpm.points.0.stress=[0, 0, 0, 0] | feature:fields | mpm.points.0.velocity | 2
mpm.points.0.velocity=[1, 0] | feature:fields | none | 0
mpm.probe=[{ name = 'a', WITHIN }, { name = 'b', WITHIN }] | feature:probes | mpm.probe.0 | 2
mpm.hold=[{ name = 'a', WITHIN, hold_x = true }] | feature:holds | mpm.hold.0 | 1
mpm.grid_contact.friction=0 | feature:grid_contact | mpm.grid_contact | 1
mpm.points.0.keeps_spin=true | feature:keeps_spin | mpm.points.0.keeps_spin | 1
SAND; SAND.critical_state.volume=1.1 | feature:critical_state | mpm.material.0.model | 1
SAND; SAND.separates=true | feature:separates | mpm.material.0.model | 1
BEADS | feature:volume_rate | mpm.material.0.model | 1
dem.body.0={ name = 'ball', shape = 'disc', sphero_radius = 0.1, mass = 1 } | inertia:mass | dem.body.0.mass | 1
dem.fill.0.count=2 | inertia:density | dem.body.0.density | 4
SURFACES; contact_pair=[LINEAR, { between = ['rubber', 'ball'], HERTZ }] | feature:contact_pairs | contact_pair.0 | 2
SURFACES; contact_pair=[LINEAR, { between = ['rubber', 'ball'], HERTZ }] | feature:mixed_kinds | contact_pair.1.law | 1
SURFACES; contact_pair=[LINEAR, { between = ['ball', 'box'], HERTZ }] | feature:mixed_kinds | contact_pair.1.law | 1
SURFACES; contact_pair=[LINEAR] | feature:mixed_kinds | none | 0
SURFACES; contact_pair=[{ between = ['ball', 'box'], HERTZ }]; body_contact={ HERTZ_OF_BODIES } | feature:mixed_kinds | none | 0
";

/// What words of [`NEEDS`] stand for.
const WORDS: [(&str, &str); 11] = [
    ("HERTZ_OF_BODIES", "hertz_mindlin.hertz_constant = 1e6"),
    (
        "OTHER",
        "mpm.points.1={ name = 'other', material = 'rubber', fill.disc = { center = [1.5, 0.5], radius = 0.1 }, spacing.per_cell = 4 }",
    ),
    (
        "PAIR",
        "group_pair=[{ between = ['block', 'other'], law.linear.normal_stiffness = 1e4 }]",
    ),
    ("WITHIN", "points = 'block', within = [[0, 0], [1, 1]]"),
    (
        "SAND;",
        "mpm.material.0.model={ drucker_prager = { MODULI, friction_angle = 30, dilation_angle = 0, cohesion = 0, tensile_strength = 0 } };",
    ),
    ("SAND", "mpm.material.0.model.drucker_prager"),
    (
        "BEADS",
        "mpm.material.0.model={ mu_i = { MODULI, static_friction = 0.4, limit_friction = 0.6, inertial_number = 0.3, grain_diameter = 1e-3, grain_density = 2000, volume_rate = 1 } }",
    ),
    ("MODULI", "bulk_modulus = 1e6, shear_modulus = 1e6"),
    (
        "SURFACES",
        "dem.body.0.surface=ball; dem.body.1.surface=box",
    ),
    (
        "LINEAR",
        "{ between = ['rubber', 'box'], law.linear.normal_stiffness = 1e4 }",
    ),
    ("HERTZ", "law.hertz_mindlin.hertz_constant = 1e6"),
];

#[test]
fn each_key_has_its_need() {
    for row in NEEDS.trim().lines() {
        let whole = WORDS
            .iter()
            .fold(row.to_owned(), |row, (word, of)| row.replace(word, of));
        let [set, need, key, places] = whole.split(" | ").collect::<Vec<_>>()[..] else {
            panic!("{whole}");
        };
        let set: Vec<&str> = set.split("; ").collect();
        let scene = scene(None, &set);
        let sides = [scene.mpm.unwrap().needs(), scene.dem.unwrap().needs()].concat();
        let found: Vec<&Need> = sides.iter().filter(|n| n.capability == need).collect();
        let first = found.first().map_or("none", |need| need.key.as_str());
        let found = (first, found.iter().map(|need| need.places).sum::<usize>());
        assert_eq!(found, (key, places.parse().unwrap()), "{whole}");
    }
}
