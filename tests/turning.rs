//! Angular momentum of all parties, and what walls, holds, weights and fixed bodies take of it.

use crate::harness::{Place, RunFiles};

/// The largest error of the angular momentum in a scene with these lines, of which the momentum is kept to rounding.
fn error(name: &str, scene: &str) -> f64 {
    let place = Place::new();
    let head = format!("version = 1\nname = \"{name}\"\n[output]\nevery = 1e-3\n");
    let scene = place.write("scene.toml", &format!("{head}{scene}"));
    let scene = scene.display().to_string();
    place.run("out", &scene, &["--in-process"]).expect(0);
    let files = RunFiles::read(&place.path("out"));
    assert!(files.number("momentum_error") < 1e-12, "{name}");
    files.number("angular_momentum_error")
}

/// A disc of points strikes a free block beside its centre and sets it turning.
fn strike(transfer: &str, friction: f64) -> f64 {
    let scene = format!(
        r#"
time = {{ end = 0.012, max_step = 1e-5 }}
[mpm]
cell = 0.003
domain = [[-0.18, -0.18], [0.18, 0.18]]
shape = "quadratic_bspline"
transfer = "{transfer}"
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
fn a_strike_keeps_angular_momentum() {
    let [smooth, rough] = [0.0, 0.5].map(|friction| strike("apic", friction));
    assert!(smooth < 1e-6, "{smooth:e}");
    assert!(rough < 1e-6, "{rough:e}");
    // FLIP's own, for any force (docs/energy.md, "Spin").
    let [smooth, rough] = [0.0, 0.5].map(|friction| strike("flip", friction));
    assert!(smooth < 1e-2 && rough < 3e-2, "{smooth:e} {rough:e}");
}
