//! Clause R-5: the plastic strain that points have in frames and at the end.

use std::collections::HashMap;

use interface::config::capability::PLASTIC_STRAIN;
use interface::config::material::{Frictional, Inertial};
use interface::config::{CriticalState, MaterialConfig, MaterialModel, MpmConfig};
use interface::message::wire::{PointState, flags};

use super::scene::{DENSITY, DT, MODULI, SPACING, block, material, scene};
use crate::bench::{Bench, Run};
use crate::clause::{Clause, clauses};
use crate::mutant::Flaw;
use crate::verdict::{Judgement, Unmet, broken, near, require};

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
    Must "R-5e" "the plastic strain of von Mises' material is the equivalent one, whose work is the plastic work"
        by equivalent, needs: &[PLASTIC_STRAIN, "material:von_mises"], after: &["R-5d"];
        - "reports the plastic shear strain": strains(|point| point.plastic_strain * 3.0_f32.sqrt());
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
/// Yield stress and hardening modulus in Pa.
const STRENGTH: [f64; 2] = [5e3, 2e5];

fn von_mises() -> MaterialModel {
    MaterialModel::VonMises {
        bulk_modulus: MODULI[0],
        shear_modulus: MODULI[1],
        yield_stress: STRENGTH[0],
        hardening_modulus: STRENGTH[1],
    }
}

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

/// Materials that keep a plastic strain, as far as the solver says that it takes them.
fn kept(bench: &Bench) -> Vec<MaterialModel> {
    let [bulk_modulus, shear_modulus] = MODULI;
    let critical = Frictional {
        bulk_modulus,
        shear_modulus,
        friction_angle: 30.0,
        dilation_angle: 5.0,
        cohesion: 0.0,
        tensile_strength: 0.0,
        critical_state: Some(CriticalState::ShearStrain(0.1)),
        separates: false,
    };
    let loose = Frictional {
        critical_state: None,
        separates: true,
        ..critical
    };
    let grains = Inertial {
        bulk_modulus,
        shear_modulus,
        static_friction: 0.4,
        limit_friction: 0.6,
        inertial_number: 0.3,
        grain_diameter: 1e-3,
        grain_density: 2.0 * DENSITY,
        volume_rate: 0.0,
    };
    let models = [
        (None, MaterialModel::MuI(grains)),
        (
            Some("critical_state"),
            MaterialModel::DruckerPrager(critical),
        ),
        (Some("separates"), MaterialModel::DruckerPrager(loose)),
        (Some("separates"), MaterialModel::MohrCoulomb(loose)),
    ];
    let has = |family: &str, member: &str| bench.capabilities.has(&format!("{family}:{member}"));
    let taken = models.into_iter().filter(|(feature, model)| {
        has("material", &model.key()) && feature.is_none_or(|feature| has("feature", feature))
    });
    let taken = taken.map(|(_, model)| model);
    [von_mises()].into_iter().chain(taken).collect()
}

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
    for model in kept(bench) {
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

/// The yield stress is `s + H a`, so flow up to `a` takes `s a + H a^2/2` of each volume, whatever the way there.
fn equivalent(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&collision(von_mises()))?;
    flow.coast(DT, FRAMES * BETWEEN)?;
    // Steps of no length: nothing flows between the frame and the measurement.
    let points = framed(&mut flow, 0.0, 1)?;
    let (_, told) = flow.free_step(0.0)?;
    let [yields, hardening] = STRENGTH;
    let work = |point: &PointState| {
        let strain = f64::from(point.plastic_strain);
        (yields + 0.5 * hardening * strain) * strain * SPACING * SPACING
    };
    let expected: f64 = points.iter().map(work).sum();
    let said = told.report.ledger.plastic_work;
    // Volumes change by a few percent on the way, and back.
    near("plastic work in J/m", said, expected, 0.02 * expected)?;
    Ok(format!("{said:.4} J/m, {expected:.4} by the strains"))
}
