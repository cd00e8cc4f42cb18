//! A solver that says in Hello what it takes is refused by the line and the key of the scene that needs more.

use std::path::{Path, PathBuf};

use coupler::scene::{Scene, unmet};
use interface::config::capability::Capabilities;
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

/// A scene file of these lines, and what the sides' solver of `party`, `toy 1`, is told of it.
fn told(
    name: &str,
    (variant, set): (Option<&str>, &[&str]),
    party: Party,
    capabilities: &[&str],
) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    let file: PathBuf = folder.path().join(name);
    std::fs::write(&file, SCENE).unwrap();
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let scene = Scene::load(&file, variant, &set).unwrap_or_else(|errors| panic!("{errors}"));
    let errors = unmet(&scene, party, "toy 1", &Capabilities::of(capabilities))?;
    let folder = format!("{}/", folder.path().display());
    Some(errors.to_string().replace(&folder, ""))
}

const AS_IT_IS: (Option<&str>, &[&str]) = (None, &[]);

fn bodies(capabilities: &[&str]) -> Option<String> {
    told("needs.toml", AS_IT_IS, Party::Dem, capabilities)
}

fn continuum(capabilities: &[&str]) -> Option<String> {
    told("needs.toml", AS_IT_IS, Party::Mpm, capabilities)
}

#[test]
fn a_solver_without_a_list_or_with_all_capabilities_is_accepted() {
    assert_eq!(bodies(&[]), None);
    assert_eq!(continuum(&[]), None);
    let all = ["shape:disc", "shape:rectangle", "shape:polygon", "save"];
    assert_eq!(bodies(&all), None);
    assert_eq!(
        told("needs.toml", AS_IT_IS, Party::Coupler, &["shape:disc"]),
        None
    );
}

#[test]
fn a_refused_shape_is_located_with_the_shapes_that_are_taken() {
    let said = bodies(&["shape:disc", "shape:polygon"]).unwrap();
    assert_eq!(
        said,
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
    let said = bodies(&["shape:disc", "shape:rectangle", "motion:fixed"]).unwrap();
    assert!(said.contains("`dem.fill.0.grain` needs polygon"), "{said}");
    assert!(
        said.contains("needs.toml:41:1  (dem.fill.0.grain)"),
        "{said}"
    );
    assert!(said.contains("2 more keys need the same"), "{said}");
    // The ball, whose motion is not written, and the three of the set.
    let motion =
        "`dem.body.0.motion`, which is not in the scene and has this value by default, needs free";
    assert!(said.contains(motion), "{said}");
    assert!(said.contains("3 more keys need the same"), "{said}");
    let before = said.find("dem.body.0.motion").unwrap() < said.find("dem.fill.0").unwrap();
    assert!(before, "in the order of the file: {said}");
}

#[test]
fn laws_and_their_numbers_are_reported_by_the_scenes_sections() {
    let said = bodies(&["law:linear", "feature:damping", "feature:body_contact"]).unwrap();
    for phrase in [
        "`body_contact` needs granular",
        "`contact.linear.friction` needs friction",
        "needs.toml:49:12  (contact.linear.friction)",
        "`body_contact.granular.rolling_friction` needs rolling_friction",
        "takes only damping, body_contact",
    ] {
        assert!(said.contains(phrase), "{phrase}: {said}");
    }
    assert_eq!(said.matches("error:").count(), 3, "{said}");
}

#[test]
fn the_continuum_is_reported_by_its_keys() {
    let said = continuum(&["transfer:flip", "wall:open", "material:fluid", "fill:disc"]).unwrap();
    for phrase in [
        "`mpm.transfer` needs blend, and the solver of the continuum, `toy 1`, takes only flip",
        "`mpm.walls.bottom` needs slip",
        "needs.toml:11:20  (mpm.walls.bottom)",
        "`mpm.material.0.model` needs linear_elastic",
        "`mpm.points.0.fill` needs rectangle",
    ] {
        assert!(said.contains(phrase), "{phrase}: {said}");
    }
    assert_eq!(said.matches("error:").count(), 4, "{said}");
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
    let said = told("needs.toml", variant, Party::Dem, &frictional).unwrap();
    assert!(said.contains("set by variant `springy`"), "{said}");
    let set = ["contact.linear.damping_ratio=0.2"];
    let said = told("needs.toml", (None, &set), Party::Dem, &frictional).unwrap();
    let place = "command line: --set contact.linear.damping_ratio=0.2";
    assert!(said.contains(place), "{said}");
}

/// Without points there is no `[contact]`: what needs the law is `[body_contact]`.
#[test]
fn bodies_alone_are_reported_by_their_law() {
    let scenes =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/verification/body_bounce.toml");
    let scene = Scene::load(&scenes, None, &[]).unwrap();
    assert!(scene.mpm.is_none() && scene.dem.is_some());
    let area = Capabilities::of(&["law:area"]);
    let said = unmet(&scene, Party::Dem, "toy 1", &area)
        .unwrap()
        .to_string();
    assert!(said.contains("`body_contact` needs linear"), "{said}");
    assert!(said.contains("body_bounce.toml:"), "{said}");
}
