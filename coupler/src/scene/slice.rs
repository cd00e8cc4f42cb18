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
    use interface::config::laws::LAWS;

    use super::*;

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
