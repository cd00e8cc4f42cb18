//! Section 7: what a continuum does with forces.

use super::scene::{DT, MASS, block, push, scene, single};
use crate::bench::Bench;
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Largest, Unmet, broken, near};

pub const CLAUSES: &[Clause] = &[
    Clause::must("F-1a", "a force acts in its step", in_its_step)
        .after(&["T-1b"])
        .mutant("applies forces one step late", || {
            change::after_others(|before, now| now.copy_from_slice(before))
        }),
    Clause::must("F-1b", "a force acts in no other step", once)
        .after(&["F-1a"])
        .mutant("keeps a tenth of a force for the next step", || {
            change::after_others(|before, now| {
                for (now, before) in now.iter_mut().zip(before) {
                    if before.force != [0.0; 2] {
                        now.force = [0, 1].map(|i| now.force[i] + 0.1 * before.force[i]);
                        now.stiffness = now.stiffness.max(before.stiffness);
                    }
                }
            })
        }),
    Clause::must(
        "F-1c",
        "momentum changes by the kick of the sum of all forces",
        sum,
    )
    .after(&["F-1a"])
    .mutant("applies larger forces to later points", || {
        Flaw::forces(|_, forces| {
            for force in forces.iter_mut().skip(32) {
                force.force = force.force.map(|f| f * (1.0 + 1e-6));
            }
        })
    }),
    Clause::must("F-1d", "a force acts at the position of its point", place)
        .after(&["F-1a", "T-2a"])
        .mutant("exchanges the forces on two points", || {
            Flaw::forces(|_, forces| {
                if forces.len() == 2 {
                    forces.swap(0, 1);
                }
            })
        }),
];

const FORCE: [f64; 2] = [3.0, -2.0];

/// Velocities of a point that is pushed in step 3 alone, step by step: those of `t_{n-1/2}`.
fn pushed(bench: &Bench) -> Result<Vec<[f64; 2]>, Unmet> {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
    let mut velocities = Vec::new();
    flow.run(DT, 8, |flow, shown| {
        velocities.extend(shown.states.first().map(|state| state.velocity));
        if shown.step.index == 3 {
            return Ok(vec![push(FORCE, 1e3); flow.imps().len()]);
        }
        Ok(flow.no_forces())
    })?;
    if velocities.len() == 8 {
        Ok(velocities)
    } else {
        Err(broken("a state in each of 8 steps", velocities.len()))
    }
}

fn in_its_step(bench: &Bench) -> Judgement {
    let velocities = pushed(bench)?;
    for i in 0..2 {
        let v = DT * FORCE[i] / MASS;
        for (step, velocity) in velocities.iter().enumerate().take(4) {
            near("velocity in m/s", velocity[i], 0.0, 0.0).map_err(|e| e.at(step as u64))?;
        }
        near("velocity in m/s", velocities[4][i], v, 1e-13 * v.abs()).map_err(|e| e.at(4))?;
    }
    Ok(format!("{:?} m/s after {FORCE:?} N/m", velocities[4]))
}

fn once(bench: &Bench) -> Judgement {
    let velocities = pushed(bench)?;
    for i in 0..2 {
        let v = DT * FORCE[i] / MASS;
        for (step, velocity) in velocities.iter().enumerate().skip(5) {
            // All nodes have the velocity of the only point, so there is no strain.
            near("velocity in m/s", velocity[i], v, 1e-12 * v.abs())
                .map_err(|e| e.at(step as u64))?;
        }
    }
    Ok("4 steps after it".into())
}

fn sum(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&scene(vec![block([0.4; 2], [0.0; 2])]))?;
    flow.coast(DT, 2)?;
    let mut total = [0.0; 2];
    let (_, told) = flow.step(DT, |flow, _| {
        let force = |slot: usize| {
            let x = slot as f64;
            push([5.0 + (7.0 * x).sin(), 1e-3 * x - 9.0], 1e3)
        };
        let forces: Vec<_> = (0..flow.imps().len()).map(force).collect();
        for f in &forces {
            total = [total[0] + f.force[0], total[1] + f.force[1]];
        }
        forces
    })?;
    let mut largest = Largest::default();
    for i in 0..2 {
        let p = DT * total[i];
        largest.near(
            "momentum",
            told.report.ledger.momentum[i],
            p,
            1e-12 * p.abs(),
            p.abs(),
        )?;
    }
    Ok(format!("within {largest} of the kick of 64 forces"))
}

/// Two points further apart than any shape function reaches: the one that is pushed moves.
fn place(bench: &Bench) -> Judgement {
    let config = scene(vec![super::scene::points(&[[0.21, 0.23], [0.78, 0.81]])]);
    let mut flow = bench.run_continuum(&config)?;
    flow.grant(DT, 2, false)?;
    let shown = flow.states()?;
    let left = shown.states.iter().position(|s| s.position[0] < 0.5);
    let left = left.ok_or_else(|| broken("a point at the left", "none"))?;
    let mut forces = flow.no_forces();
    forces[left] = push(FORCE, 1e3);
    flow.forces(&forces)?;
    let after = flow.exchange()?;
    for (slot, state) in after.states.iter().enumerate() {
        for i in 0..2 {
            let v = if slot == left {
                0.5 * DT * FORCE[i] / MASS
            } else {
                0.0
            };
            near("velocity in m/s", state.velocity[i], v, 1e-13 * v.abs()).map_err(|e| e.at(1))?;
        }
    }
    Ok("the pushed one of two".into())
}
