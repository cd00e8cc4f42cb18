//! Clause R-5: the plastic strain that points have in frames and at the end.

use std::collections::HashMap;

use interface::config::capability::PLASTIC_STRAIN;
use interface::config::{MaterialConfig, MaterialModel, MpmConfig};
use interface::message::wire::{PointState, flags};

use super::scene::{DENSITY, DT, MODULI, block, material, scene};
use crate::bench::{Bench, Run};
use crate::clause::{Clause, clauses};
use crate::mutant::Flaw;
use crate::verdict::{Judgement, Unmet, broken, require};

pub const CLAUSES: &[Clause] = clauses! {
    Must "R-5d" "plastic strain is finite and not below 0, grows where material flows and never falls"
        by remembered, needs: &[PLASTIC_STRAIN, "material:von_mises"], after: &["G-10a"];
        - "reports the growth of plastic strain since the last frame": {
            let mut before = HashMap::new();
            strains(move |point| {
                let now = point.plastic_strain;
                now - before.insert(point.id, now).unwrap_or_default()
            })
        };
        - "reports negative plastic strain": strains(|point| -point.plastic_strain);
        - "keeps no plastic strain": strains(|_| 0.0);
        - "reports NaN for points that have flowed":
            strains(|point| match point.plastic_strain { 0.0 => 0.0, _ => f32::NAN, });
};

/// Tells another plastic strain of each point.
fn strains(mut tells: impl FnMut(&PointState) -> f32 + 'static) -> Flaw {
    Flaw::points(move |_, points| {
        for point in points {
            point.plastic_strain = tells(point);
        }
    })
}

/// Speed at which two blocks run into one another in m/s: strains of a few percent.
const SPEED: f64 = 1.0;
/// Frames of a run, and steps between two of them. Waves go to and fro in a block meanwhile.
const FRAMES: u64 = 10;
const BETWEEN: u64 = 10;

/// A block of a material runs into an elastic one.
fn collision(model: MaterialModel) -> MpmConfig {
    let mut first = block([0.2, 0.4], [SPEED, 0.0]);
    first.material = 1;
    let mut config = scene(vec![first, block([0.4, 0.4], [-SPEED, 0.0])]);
    config.materials.push(MaterialConfig {
        name: "tested".into(),
        model,
        ..material(DENSITY, MODULI)
    });
    config
}

/// Materials that keep a plastic strain, each with a capability that it needs.
const KEPT: &str = r#"[
["material:von_mises", {"von_mises": {"bulk_modulus": 1e6, "shear_modulus": 6e5, "yield_stress": 5e3, "hardening_modulus": 2e5}}],
["material:mu_i", {"mu_i": {"bulk_modulus": 1e6, "shear_modulus": 6e5, "static_friction": 0.4, "limit_friction": 0.6,
    "inertial_number": 0.3, "grain_diameter": 1e-3, "grain_density": 2e3}}],
["feature:critical_state", {"drucker_prager": {"bulk_modulus": 1e6, "shear_modulus": 6e5, "friction_angle": 30.0, "dilation_angle": 5.0,
    "cohesion": 0.0, "tensile_strength": 0.0, "critical_state": {"shear_strain": 0.1}}}],
["feature:separates", {"drucker_prager": {"bulk_modulus": 1e6, "shear_modulus": 6e5, "friction_angle": 30.0, "dilation_angle": 5.0,
    "cohesion": 0.0, "tensile_strength": 0.0, "separates": true}}],
["feature:separates", {"mohr_coulomb": {"bulk_modulus": 1e6, "shear_modulus": 6e5, "friction_angle": 30.0, "dilation_angle": 5.0,
    "cohesion": 0.0, "tensile_strength": 0.0, "separates": true}}]
]"#;

/// The points before a window, which is done then; at the end those of the end.
fn points(flow: &mut Run, frame: u64) -> Result<Vec<PointState>, Unmet> {
    if frame == FRAMES {
        flow.free_step(0.0)?;
        return Ok(flow.drain()?.1);
    }
    let mut grant = flow.next_grant(DT, BETWEEN, true);
    grant.flags |= flags::FRAME;
    flow.send_grant(grant)?;
    for _ in 0..BETWEEN {
        flow.free()?;
    }
    let points = flow.report()?.points;
    let points = points.ok_or_else(|| broken("all points before the report", "none"))?;
    Ok(points.1)
}

fn remembered(bench: &Bench) -> Judgement {
    let mut words = Vec::new();
    let has = |name: &str| bench.capabilities.has(name);
    let kept: Vec<(String, MaterialModel)> = serde_json::from_str(KEPT).expect("materials");
    let kept = kept.into_iter();
    let taken = |(needed, model): &(String, MaterialModel)| {
        has(needed) && has(&format!("material:{}", model.key()))
    };
    for (_, model) in kept.filter(taken) {
        let (key, mut flow) = (model.key(), bench.run_continuum(&collision(model))?);
        let mut before = HashMap::new();
        for frame in 0..=FRAMES {
            for point in points(&mut flow, frame)? {
                let (strain, id) = (point.plastic_strain, point.id);
                let least = before.insert(id, strain).unwrap_or_default();
                // The second group is elastic.
                let flows = point.group == 0 && strain.is_finite() && strain >= least;
                let of = format_args!(
                    "a plastic strain of point {id} beside {key} not below {least}; 0 of an elastic one"
                );
                require(flows || strain == 0.0 && least == 0.0, of, strain)?;
            }
        }
        let most = before.into_values().fold(0.0, f32::max);
        let expected = format_args!("a plastic strain above 0.001 somewhere in {key}");
        require(most > 1e-3, expected, most)?;
        words.push(format!("{key} up to {most:.3}"));
    }
    Ok(words.join(", "))
}
