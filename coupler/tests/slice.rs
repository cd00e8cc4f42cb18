//! A scene with a thickness.

use std::path::Path;

use coupler::scene::{Scene, SceneFile};

/// A pushed body, a held one, a loaded block, and three laws. Numbers of the whole slice are multiplied by `whole`.
fn scene(thickness: &str, whole: f64) -> Scene {
    let text = format!(
        r#"
version = 1
name = "slice"
{thickness}
[time]
end = 0.01
[mpm]
cell = 0.1
domain = [[0.0, 0.0], [2.0, 2.0]]
shape = "linear"
transfer = "flip"
[[mpm.material]]
name = "rubber"
density = 1000.0
model.linear_elastic = {{ bulk_modulus = 5e5, shear_modulus = 3e5 }}
[[mpm.points]]
name = "block"
material = "rubber"
fill.rectangle = {{ lower = [0.1, 0.1], upper = [0.5, 0.5] }}
spacing.per_cell = 4
[[mpm.traction]]
points = "block"
within = [[0.1, 0.1], [0.5, 0.2]]
force = [{}, {}]
[[dem.body]]
name = "ball"
shape = "disc"
sphero_radius = 0.1
surface = "ball"
mass = {}
position = [1.0, 1.0]
motion.pushed = {{ force = [{}, 0.0], torque = {} }}
[[dem.body]]
name = "other"
shape = "disc"
sphero_radius = 0.1
density = 500.0
position = [1.5, 1.5]
[contact]
linear = {{ normal_stiffness = {}, tangential_stiffness = {}, friction = 0.5, damping_ratio = 0.1, damped_mass = {} }}
[body_contact]
area = {{ area_stiffness = {}, tangential_stiffness = {}, friction = 0.5 }}
[[contact_pair]]
between = ["rubber", "ball"]
law.hertz_mindlin = {{ hertz_constant = {}, restitution = 0.5, adhesion = 3.0 }}
[output]
every = 1e-3
[[output.column]]
name = "mass"
unit = "kg"
value = "body.ball.mass"
"#,
        8.0 * whole,
        -2.0 * whole,
        2.0 * whole,
        3.0 * whole,
        5.0 * whole,
        7e4 * whole,
        3e4 * whole,
        4.0 * whole,
        1e7 * whole,
        2e4 * whole,
        1e6 * whole,
    );
    let file = SceneFile::of_text("slice.toml", &text, Path::new(".")).expect("TOML");
    file.scene(None, &[])
        .unwrap_or_else(|faults| panic!("{faults}"))
}

/// With a thickness that divides exactly, a scene of the slice is the same scene per metre.
#[test]
fn a_slice_is_the_same_scene_per_metre() {
    let (plain, slice) = (scene("", 1.0), scene("thickness = 0.25", 0.25));
    assert_eq!(plain.mpm, slice.mpm);
    assert_eq!(plain.dem, slice.dem);
    assert_ne!(plain.dem, scene("", 0.25).dem);
}
