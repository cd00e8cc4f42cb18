//! A scene with `thickness`: its masses, forces, stiffnesses and energies are those of a slice. They are divided by the
//! thickness on input, and quantities are multiplied by it on output ([`crate::record::quantity`]). Solvers work per
//! metre and do not know the thickness.

use interface::config::{ContactLaw, Motion};

use super::problems::Problems;
use super::written::SceneWritten;

/// Divides the numbers of the whole slice by its thickness.
pub(super) fn per_metre(problems: &mut Problems, written: &mut SceneWritten) {
    let Some(thickness) = written.thickness else {
        return;
    };
    problems.above_zero("thickness", thickness, "a length");
    // With a refused thickness, correct numbers would be reported as faults.
    if thickness <= 0.0 {
        return;
    }
    let laws = [&mut written.contact, &mut written.body_contact];
    let laws = laws.into_iter().flatten();
    let pairs = written.contact_pair.iter_mut().map(|pair| &mut pair.law);
    let of_groups = written.group_pair.iter_mut().map(|pair| &mut pair.law);
    for law in laws.chain(pairs).chain(of_groups) {
        *law = law_per_metre(*law, thickness);
    }
    if let Some(mpm) = &mut written.mpm {
        for traction in &mut mpm.traction {
            traction.force = traction.force.map(|f| f / thickness);
        }
    }
    for body in written.dem.iter_mut().flat_map(|dem| &mut dem.body) {
        body.mass = body.mass.map(|mass| mass / thickness);
        if let Motion::Pushed { force, torque, .. } = &mut body.motion {
            *force = force.map(|f| f / thickness);
            *torque /= thickness;
        }
    }
}

/// The law whose stiffnesses and mass are those of a slice, per metre. Stresses, ratios and coefficients are the same.
fn law_per_metre(mut law: ContactLaw, thickness: f64) -> ContactLaw {
    match &mut law {
        ContactLaw::Linear {
            normal_stiffness,
            tangential_stiffness,
            damped_mass,
            friction: _,
            damping_ratio: _,
        }
        | ContactLaw::Granular {
            normal_stiffness,
            tangential_stiffness,
            damped_mass,
            friction: _,
            damping_ratio: _,
            adhesion: _,
            rolling_friction: _,
        } => {
            *normal_stiffness /= thickness;
            *tangential_stiffness /= thickness;
            *damped_mass /= thickness;
        }
        ContactLaw::HertzMindlin {
            hertz_constant,
            poisson_ratio: _,
            friction: _,
            restitution: _,
            adhesion: _,
        } => *hertz_constant /= thickness,
        ContactLaw::Area {
            area_stiffness,
            tangential_stiffness,
            friction: _,
        } => {
            *area_stiffness /= thickness;
            *tangential_stiffness /= thickness;
        }
    }
    law
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use interface::config::laws::LAWS;

    use super::*;
    use crate::scene::{Scene, SceneFile};

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

    /// Every parameter is divided whose unit is per metre of thickness, and no other one.
    #[test]
    fn what_is_divided_follows_from_the_units() {
        for law in laws() {
            let half = law_per_metre(law, 0.5);
            for ((parameter, before), (_, after)) in law.numbers().zip(half.numbers()) {
                let per_metre = !["", "Pa"].contains(&parameter.unit);
                let factor = if per_metre { 2.0 } else { 1.0 };
                assert_eq!(after, factor * before, "{}", parameter.name);
                assert_ne!(before, 0.0);
            }
        }
    }

    /// One law for every row of the table, with all numbers other than 0.
    fn laws() -> Vec<ContactLaw> {
        let law = |row: &interface::config::laws::LawRow| {
            let numbers = row.parameters.iter().enumerate();
            let numbers: serde_json::Map<_, _> = numbers
                .map(|(i, p)| (p.name.to_owned(), (0.25 + 0.125 * i as f64).into()))
                .collect();
            let law = serde_json::json!({ row.name: numbers });
            serde_json::from_value(law).expect("a law")
        };
        LAWS.iter().map(law).collect()
    }
}
