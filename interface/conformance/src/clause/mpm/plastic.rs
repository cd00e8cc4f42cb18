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

/// A window of steps of `dt` (s) with a frame, and its points.
fn framed(flow: &mut Run, dt: f64, steps: u64) -> Result<Vec<PointState>, Unmet> {
    let mut grant = flow.next_grant(dt, steps, true);
    grant.flags |= flags::FRAME;
    flow.send_grant(grant)?;
    for _ in 0..steps {
        flow.free()?;
    }
    let points = flow.report()?.points;
    let points = points.ok_or_else(|| broken("all points before the report", "none"))?;
    Ok(points.1)
}

/// The points of each frame of a run, and those of its end.
fn course(flow: &mut Run) -> Result<Vec<Vec<PointState>>, Unmet> {
    let mut frames = Vec::new();
    for _ in 0..FRAMES {
        frames.push(framed(flow, DT, BETWEEN)?);
    }
    flow.free_step(0.0)?;
    frames.push(flow.drain()?.1);
    Ok(frames)
}

fn remembered(bench: &Bench) -> Judgement {
    let mut words = Vec::new();
    let has = |name: &str| bench.capabilities.has(name);
    let kept: Vec<(String, MaterialModel)> = serde_json::from_str(KEPT).expect("materials");
    for (needed, model) in kept {
        if !has(&needed) || !has(&format!("material:{}", model.key())) {
            continue;
        }
        let mut flow = bench.run_continuum(&collision(model))?;
        let mut before = HashMap::new();
        for point in course(&mut flow)?.into_iter().flatten() {
            let (strain, id, key) = (point.plastic_strain, point.id, model.key());
            let least = before.insert(id, strain).unwrap_or_default();
            // The second group is elastic.
            let kept = if point.group == 0 {
                strain.is_finite() && strain >= least
            } else {
                strain == 0.0
            };
            let expected = format_args!(
                "a plastic strain of point {id} beside {key} not below {least}; 0 of an elastic one"
            );
            require(kept, expected, strain)?;
        }
        let most = before.into_values().fold(0.0, f32::max);
        let expected = format_args!("a plastic strain above 0.001 somewhere in {}", model.key());
        require(most > 1e-3, expected, most)?;
        words.push(format!("{} up to {most:.3}", model.key()));
    }
    Ok(words.join(", "))
}
