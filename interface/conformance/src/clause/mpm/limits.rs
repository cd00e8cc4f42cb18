//! Section 8: limits that hold.

use interface::config::{GroupConfig, InitialFields};
use interface::message::wire::Limits;

use super::scene::{DT, IN_BLOCK, MASS, RADIUS, block, push, scene, single};
use crate::bench::{Bench, ContinuumRun};
use crate::clause::Clause;
use crate::mutant::change;
use crate::verdict::{Judgement, Unmet, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must("L-2a", "contact_omega_sq bounds what contact adds", contact)
        .after(&["I-9b", "F-1a"])
        .mutant("halves what contact adds", || {
            change::report(|report| report.limits.contact_omega_sq *= 0.5)
        }),
    Clause::must(
        "L-2f",
        "contact_omega_sq is 0 where no point has stiffness",
        no_contact,
    )
    .after(&["L-2a"])
    .mutant("keeps the last contact frequency", || {
        let mut touched = false;
        change::report(move |report| {
            touched |= report.limits.contact_omega_sq > 0.0;
            if touched && report.limits.contact_omega_sq == 0.0 {
                report.limits.contact_omega_sq = 1e-3;
            }
        })
    }),
    Clause::should(
        "L-2b",
        "contact_omega_sq is at most four times that",
        not_absurd,
    )
    .after(&["L-2a"])
    .mutant("reports five times its contact_omega_sq", || {
        change::report(|report| report.limits.contact_omega_sq *= 5.0)
    }),
    Clause::must(
        "L-2d",
        "speed bounds that of every point, or of every point of a surface",
        speed,
    )
    .after(&["T-1a"])
    .mutant("reports half of its speed", || {
        change::report(|report| report.limits.speed *= 0.5)
    }),
    Clause::must(
        "L-2g",
        "radius_min is that of the smallest point",
        radius_min,
    )
    .mutant("reports twice its radius", || {
        change::report(|report| report.limits.radius_min *= 2.0)
    }),
    Clause::must(
        "L-2c",
        "omega_sq bounds the solver's own frequencies",
        stable,
    )
    .needs(&["feature:fields"])
    .after(&["T-1a"])
    .mutant("reports a hundredth of its stiffness", || {
        change::report(|report| report.limits.omega_sq *= 0.01)
    }),
    Clause::should(
        "L-2h",
        "the step limit by its own stiffness is at most ten times too small",
        not_too_careful,
    )
    .needs(&["feature:fields"])
    .after(&["L-2c"])
    .mutant("reports four hundred times its stiffness", || {
        change::report(|report| report.limits.omega_sq *= 400.0)
    }),
];

const STIFFNESS: f64 = 2e5;

/// Limits of a run in whose one step every point has this stiffness.
fn limits(flow: &mut ContinuumRun, stiffness: f64) -> Result<Limits, Unmet> {
    let (_, told) = flow.step(DT, |flow, _| {
        vec![push([0.0, 0.0], stiffness); flow.imps().len()]
    })?;
    Ok(told.report.limits)
}

fn contact(bench: &Bench) -> Judgement {
    let mut least = f64::INFINITY;
    for config in [single([0.0; 2]), scene(vec![block([0.4; 2], [0.0; 2])])] {
        let mut flow = bench.run_continuum(&config)?;
        for share in [1.0, 10.0] {
            let stiffness = share * STIFFNESS;
            let said = limits(&mut flow, stiffness)?.contact_omega_sq;
            // All points moving as one: k sum / m sum, which the largest eigenvalue is not below.
            let bound = stiffness / MASS;
            require(
                said >= bound * (1.0 - 1e-12),
                format_args!("at least {bound:.6e} 1/s^2"),
                format_args!("{said:.6e}"),
            )?;
            least = least.min(said / bound);
        }
    }
    Ok(format!(
        "{least:.3} k/m at least, of 1 and of {IN_BLOCK} points"
    ))
}

fn no_contact(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
    limits(&mut flow, STIFFNESS)?;
    let said = limits(&mut flow, 0.0)?.contact_omega_sq;
    require(said == 0.0, 0.0, said)?;
    Ok("0 after contact".into())
}

fn not_absurd(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
    let said = limits(&mut flow, STIFFNESS)?.contact_omega_sq;
    let bound = STIFFNESS / MASS;
    require(
        said <= 4.0 * bound,
        format_args!("at most {:.3e} 1/s^2", 4.0 * bound),
        format_args!("{said:.3e}"),
    )?;
    Ok(format!("{:.3} k/m", said / bound))
}

fn speed(bench: &Bench) -> Judgement {
    let mut config = single([0.3, 0.4]);
    config.gravity = [30.0, 40.0];
    let mut flow = bench.run_continuum(&config)?;
    let mut velocity: f64 = 0.5;
    for step in 0..5 {
        let said = limits(&mut flow, 0.0)?.speed;
        // Gravity is along the velocity: 50 m/s^2; the first kick is half a step.
        velocity += if step == 0 { 0.5 } else { 1.0 } * DT * 50.0;
        require(
            said >= velocity * (1.0 - 1e-9),
            format_args!("at least {velocity:.9} m/s"),
            format_args!("{said:.9}"),
        )
        .map_err(|e| e.at(step))?;
    }
    Ok(format!("{velocity:.4} m/s after 5 steps"))
}

fn radius_min(bench: &Bench) -> Judgement {
    let mut config = scene(vec![block([0.2; 2], [0.0; 2]), block([0.6; 2], [0.0; 2])]);
    config.groups[1] = GroupConfig {
        contact_radius: Some(0.6 * RADIUS),
        ..config.groups[1].clone()
    };
    let mut flow = bench.run_continuum(&config)?;
    let said = limits(&mut flow, 0.0)?.radius_min;
    require(said == 0.6 * RADIUS, 0.6 * RADIUS, said)?;
    Ok(format!("{said} m"))
}

/// Kinetic energy of a block that rings, with steps of `share` of its own limit: the largest seen, over that of the
/// start.
fn growth(bench: &Bench, share: f64) -> Result<f64, Unmet> {
    // A wave as short as the grid can hold, with displacements of a hundredth of a cell.
    let field = |text: &str| text.to_string();
    let ringing = GroupConfig {
        fields: InitialFields {
            velocity: Some([field("0.1*cos(40*x)*cos(25*y)"), field("0.1*cos(30*y)")]),
            stress: None,
        },
        ..block([0.4; 2], [0.0; 2])
    };
    let mut flow = bench.run_continuum(&scene(vec![ringing]))?;
    let (_, told) = flow.free_step(0.0)?;
    let start = told.report.ledger.kinetic;
    let mut omega_sq = told.report.limits.omega_sq;
    let mut largest: f64 = 0.0;
    for _ in 0..12 {
        let dt = share * 2.0 / omega_sq.sqrt();
        flow.coast(dt, 32)?;
        let (_, told) = flow.free_step(dt)?;
        omega_sq = told.report.limits.omega_sq;
        largest = largest.max(told.report.ledger.kinetic / start);
    }
    Ok(largest)
}

fn stable(bench: &Bench) -> Judgement {
    let growth = growth(bench, 0.95)?;
    require(
        growth < 2.0,
        "kinetic energy below twice that of the start",
        format_args!("{growth:.3e} times"),
    )?;
    Ok(format!("kinetic energy up to {growth:.2} of the start"))
}

fn not_too_careful(bench: &Bench) -> Judgement {
    // Beyond what is stable the solver may fail, which shows it as well.
    let growth = growth(bench, 9.5).unwrap_or(f64::INFINITY);
    require(
        growth > 2.0,
        "no stability with ten times the step",
        format_args!("kinetic energy {growth:.2} of the start"),
    )?;
    Ok("unstable with ten times the step".into())
}
