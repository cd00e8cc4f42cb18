//! Angular momentum of all parties, and what walls, holds, weights and fixed bodies take of it.

use crate::harness::{Place, RunFiles};

/// The largest error of the angular momentum in a scene with these lines, of which the momentum is kept to rounding.
fn error(name: &str, scene: &str) -> f64 {
    error_and_course(name, scene, "time")[0]
}

/// The same; first and least and largest value of a quantity in the run.
fn error_and_course(name: &str, scene: &str, value: &str) -> [f64; 4] {
    let place = Place::new();
    let column =
        format!("[[output.column]]\nname = \"column\"\nvalue = \"{value}\"\nunit = \"1\"\n");
    let scene =
        format!("version = 1\nname = \"{name}\"\n{scene}\n[output]\nevery = 1e-3\n{column}");
    place.write("scene.toml", &scene);
    place.run("out", "scene.toml", "--in-process").expect(0);
    let files = RunFiles::read(&place.path("out"));
    assert!(files.number("momentum_error") < 1e-12, "{name}");
    let course = files.history().column("column [1]");
    let least = course.iter().copied().fold(f64::INFINITY, f64::min);
    let most = course.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [
        files.number("angular_momentum_error"),
        course[0],
        least,
        most,
    ]
}

/// A disc of points strikes a free block beside its centre and sets it turning.
fn strike(transfer: &str, stress_update: &str, friction: f64) -> f64 {
    let scene = format!(
        r#"
time = {{ end = 0.012, max_step = 1e-5 }}
[mpm]
cell = 0.003
domain = [[-0.18, -0.18], [0.18, 0.18]]
shape = "quadratic_bspline"
transfer = "{transfer}"
stress_update = "{stress_update}"
[[mpm.material]]
name = "rubber"
density = 2000.0
model.linear_elastic = {{ bulk_modulus = 5e6, shear_modulus = 3.7e6 }}
[[mpm.points]]
name = "disc"
material = "rubber"
fill.disc = {{ center = [-0.027, 0.008], radius = 0.0146 }}
spacing.per_cell = 4
velocity = [2.0, 0.0]
[[dem.body]]
name = "block"
shape.rectangle = {{ width = 0.012, height = 0.042 }}
sphero_radius = 0.004
density = 2000.0
[contact]
linear = {{ normal_stiffness = 6e4, tangential_stiffness = 3e4, friction = {friction} }}
"#
    );
    error("strike", &scene)
}

#[test]
fn a_strike_keeps_angular_momentum_with_friction_too() {
    for friction in [0.0, 0.5] {
        let left = strike("apic", "usl", friction);
        assert!(left < 1e-13, "{friction}: {left:e}");
        // Points that do not move with the velocity that they take change it a little, and FLIP by itself ("Spin").
        for (transfer, of) in [("apic", 1e-10..1e-7), ("flip", 1e-5..1e-2)] {
            let left = strike(transfer, "usf", friction);
            assert!(of.contains(&left), "{transfer}, {friction}: {left:e}");
        }
    }
}

/// A disc strikes the boundary chain of a free block aslant, slips and makes both turn. What is left is what the weights of the
/// markers gave, and that is reported; with the friction at the foot it was 14 times as much, most of it reported nowhere.
#[test]
fn friction_on_a_chain_keeps_angular_momentum_but_for_its_weights() {
    let scene = r#"
time = { end = 0.012, max_step = 1e-5 }
[mpm]
cell = 0.003
domain = [[-0.18, -0.18], [0.18, 0.18]]
shape = "quadratic_bspline"
transfer = "apic"
stress_update = "usl"
interface = "segments"
[[mpm.material]]
name = "rubber"
density = 2000.0
model.linear_elastic = { bulk_modulus = 5e6, shear_modulus = 3.7e6 }
[[mpm.points]]
name = "block"
material = "rubber"
fill.rectangle = { lower = [-0.03, -0.012], upper = [0.03, 0.012] }
spacing.per_cell = 4
[[mpm.chain]]
name = "skin"
points = "block"
spacing = 0.004
[[dem.body]]
name = "disc"
shape = "disc"
sphero_radius = 0.012
density = 2000.0
position = [-0.008, 0.0242]
velocity = [2.0, -1.0]
[contact]
linear = { normal_stiffness = 6e4, tangential_stiffness = 3e4, friction = 0.5 }
"#;
    let kept = "angular_momentum - chain.skin.angular_shift";
    let [error, first, least, most] = error_and_course("chain", scene, kept);
    assert!(
        (most - least) < 1e-12 * first.abs(),
        "{first} {least} {most}"
    );
    assert!(error < 1e-3, "{error:e}");
}
