//! Section 5, time: the leapfrog of T-1 to T-6.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::atomic::Ordering;

use interface::config::{GroupConfig, InitialFields, MpmConfig};
use interface::message::wire::ImpState;

use super::scene::{CELL, DT, IN_BLOCK, MASS, block, push, scene, single};
use crate::bench::{Bench, ContinuumRun};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Largest, Unmet, broken, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "T-1a",
        "free flight is x0 + n dt v0, and rotation likewise",
        flight,
    )
    .after(&["I-9b"])
    .mutant("drifts", || {
        Flaw::states(|header, states| {
            for state in states {
                state.position[0] += 1e-11 * header.step as f64;
            }
        })
    }),
    Clause::must("T-2a", "the first kick is half a step", first_kick)
        .after(&["T-1a"])
        .mutant("kicks by a whole step at first", || {
            change::each_grant(|grant| {
                if grant.dt_before_epoch == 0.0 {
                    grant.dt_before_epoch = grant.dt;
                }
            })
        }),
    Clause::must(
        "T-1b",
        "free fall follows the leapfrog: x0 + n dt v0 + g (n dt)^2/2",
        fall,
    )
    .after(&["T-1a", "T-2a"])
    .mutant("loses velocity", || {
        Flaw::states(|header, states| {
            for state in states.iter_mut().filter(|_| header.step > 2) {
                state.velocity[1] *= 1.0 - 1e-9;
            }
        })
    }),
    Clause::must(
        "T-1c",
        "uses a step that changes in every epoch",
        changing_steps,
    )
    .after(&["T-1b"])
    .mutant("assumes that all steps are equal", || {
        change::each_grant(|grant| {
            if grant.dt_before_epoch > 0.0 && grant.dt > 0.0 {
                grant.dt_before_epoch = grant.dt;
            }
        })
    }),
    Clause::must(
        "T-3a",
        "an opening step moves nothing and leaves no trace",
        opening,
    )
    .needs(&["feature:fields"])
    .after(&["T-1a"])
    .mutant("drifts in the opening step", || {
        change::each_grant(|grant| {
            if grant.first == 0 && grant.dt == 0.0 {
                grant.dt = 1e-9;
            }
        })
    }),
    Clause::must(
        "T-4a",
        "the closing step brings velocities to the time of the positions",
        closing,
    )
    .after(&["T-1b"])
    .mutant("leaves out the last half kick", || {
        change::each_grant(|grant| {
            if grant.dt == 0.0 {
                grant.dt_before_epoch = 0.0;
            }
        })
    }),
    Clause::must("T-5a", "measured velocities are centred", centring)
        .after(&["T-1c"])
        .mutant("adds to the measured energy", || {
            change::measured(|report| {
                if report.next > 2 {
                    report.ledger.kinetic *= 1.0 + 1e-9;
                }
            })
        }),
    Clause::must("T-6a", "two runs give the same bits", twice)
        .needs(&["feature:fields"])
        .mutant("has other bits in every run", || {
            let run = change::RUNS.fetch_add(1, Ordering::Relaxed);
            let ulps = 1 + run.wrapping_add(std::process::id()) % 31;
            change::states_of_grant(move |_, state| change::nudged(state, ulps))
        }),
    Clause::must("T-6b", "windows of 1 and 64 give the same bits", windows)
        .needs(&["feature:fields"])
        .after(&["T-6a"])
        .mutant("has other bits in windows of one step", || {
            change::states_of_grant(|grant, state| {
                change::nudged(state, u32::from(grant.steps == 1));
            })
        }),
    Clause::must(
        "T-1e",
        "moved by some cells, the motion is the same except for rounding",
        elsewhere,
    )
    .after(&["T-1a"])
    .mutant("has larger forces on the right and below", || {
        let centre = Rc::new(Cell::new([0.0; 2]));
        let seen = Rc::clone(&centre);
        Flaw::forces(move |_, forces| {
            let [x, y] = centre.get();
            for force in forces.iter_mut().filter(|_| x > 0.55 && y < 0.5) {
                force.force = force.force.map(|f| 1.001 * f);
            }
        })
        .with(Flaw::states(move |_, states| {
            let n = states.len().max(1) as f64;
            let sum = |i: usize| states.iter().map(|s| s.position[i]).sum::<f64>();
            seen.set([sum(0) / n, sum(1) / n]);
        }))
    }),
];

/// Steps of a flight. A sum of n terms is off by at most n ulp of its largest partial sum, the velocity of a node of
/// four points by some more.
const STEPS: u64 = 150;
const ROUNDING: f64 = STEPS as f64 * 16.0 * f64::EPSILON;

fn flight(bench: &Bench) -> Judgement {
    let velocity = [0.7, -0.9];
    let mut flow = bench.run_continuum(&scene(vec![block([0.4; 2], velocity)]))?;
    let mut start: Vec<ImpState> = Vec::new();
    let mut largest = Largest::default();
    flow.run(DT, STEPS, |flow, shown| {
        if start.is_empty() {
            start.clone_from(&shown.states);
        }
        for (state, then) in shown.states.iter().zip(&start) {
            for i in 0..2 {
                let x = then.position[i] + shown.step.time * velocity[i];
                largest
                    .near("position", state.position[i], x, ROUNDING, 1.0)
                    .map_err(|e| e.at(shown.step.index))?;
            }
        }
        Ok(flow.no_forces())
    })?;
    Ok(format!(
        "within {largest} m, {IN_BLOCK} points, {STEPS} steps"
    ))
}

const GRAVITY: [f64; 2] = [1.3, -9.81];

fn falling() -> MpmConfig {
    let mut config = single([0.3, 0.2]);
    config.gravity = GRAVITY;
    config
}

fn one(states: &[ImpState]) -> Result<ImpState, Unmet> {
    states
        .first()
        .copied()
        .ok_or_else(|| broken("a state", "none"))
}

fn first_kick(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&falling())?;
    flow.grant(DT, 2, false)?;
    flow.exchange()?;
    let state = one(&flow.exchange()?.states)?;
    for i in 0..2 {
        let v = [0.3, 0.2][i] + 0.5 * DT * GRAVITY[i];
        near("velocity in m/s", state.velocity[i], v, 1e-14).map_err(|e| e.at(1))?;
    }
    Ok(format!("{:?} m/s after half a step", state.velocity))
}

fn fall(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&falling())?;
    let x0 = [0.512, 0.487];
    let mut largest = Largest::default();
    flow.run(DT, STEPS, |flow, shown| {
        let n = shown.step.index as f64;
        let state = one(&shown.states)?;
        for i in 0..2 {
            let (v0, t) = ([0.3, 0.2][i], n * DT);
            // With half a kick at first the leapfrog has no error in a parabola.
            let x = x0[i] + t * v0 + 0.5 * t * t * GRAVITY[i];
            let v = v0 + (t - 0.5 * DT).max(0.0) * GRAVITY[i];
            largest
                .near("position", state.position[i], x, ROUNDING, 1.0)
                .and_then(|()| largest.near("velocity", state.velocity[i], v, ROUNDING, 1.0))
                .map_err(|e| e.at(shown.step.index))?;
        }
        Ok(flow.no_forces())
    })?;
    Ok(format!("within {largest} m or m/s after {STEPS} steps"))
}

fn changing_steps(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&falling())?;
    let (mut v, mut before) = ([0.3, 0.2], 0.0);
    let mut x = [0.512, 0.487];
    let mut largest = Largest::default();
    for share in [1.0, 0.37, 0.91, 0.02, 1.0, 1.0, 0.5] {
        let dt = share * DT;
        flow.grant(dt, 1, false)?;
        let shown = flow.exchange()?;
        let state = one(&shown.states)?;
        for i in 0..2 {
            largest
                .near("position", state.position[i], x[i], 1e-14, 1.0)
                .and_then(|()| largest.near("velocity", state.velocity[i], v[i], 1e-14, 1.0))
                .map_err(|e| e.at(shown.step.index))?;
            v[i] += 0.5 * (before + dt) * GRAVITY[i];
            x[i] += dt * v[i];
        }
        before = dt;
        flow.report()?;
    }
    Ok(format!("within {largest} m or m/s, 7 steps"))
}

/// A block that is not moving uniformly, so that a transfer would show.
fn stretching() -> MpmConfig {
    let field = |text: &str| text.to_string();
    scene(vec![GroupConfig {
        fields: InitialFields {
            velocity: Some([field("0.4*x + 0.2*y"), field("0.3*sin(9*x)")]),
            stress: None,
        },
        ..block([0.4; 2], [0.1, 0.0])
    }])
}

fn opening(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&stretching())?;
    let (first, told) = flow.free_step(0.0)?;
    flow.grant(DT, 1, false)?;
    let second = flow.exchange()?;
    flow.report()?;
    for (a, b) in first.states.iter().zip(&second.states) {
        let bits = |s: &ImpState| [s.position, s.velocity].map(|v| v.map(f64::to_bits));
        require(
            bits(a) == bits(b),
            format_args!("{a:?}"),
            format_args!("{b:?}"),
        )
        .map_err(|e| e.at(1))?;
    }
    let momentum = momentum_of(&first.states);
    for i in 0..2 {
        let measured = told.report.ledger.momentum[i];
        near(
            "momentum in N s/m",
            measured,
            momentum[i],
            1e-12 * MASS * 64.0,
        )?;
    }
    Ok(format!("{} points stay", first.states.len()))
}

fn momentum_of(states: &[ImpState]) -> [f64; 2] {
    states.iter().fold([0.0; 2], |p, s| {
        [p[0] + MASS * s.velocity[0], p[1] + MASS * s.velocity[1]]
    })
}

fn closing(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&falling())?;
    let steps = 40;
    flow.coast(DT, steps)?;
    flow.free_step(0.0)?;
    let (_, points) = flow.drain()?;
    let t = steps as f64 * DT;
    let point = points.first().ok_or_else(|| broken("a point", "none"))?;
    for i in 0..2 {
        let v = [0.3, 0.2][i] + t * GRAVITY[i];
        near("velocity in m/s", point.velocity[i], v, ROUNDING)?;
    }
    Ok(format!("{:?} m/s at the end", point.velocity))
}

fn centring(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&falling())?;
    flow.coast(DT, 2)?;
    // From steps of 1 to one of 0.5: the velocity after the kick counts by 2/3.
    let (shown, told) = flow.free_step(0.5 * DT)?;
    let before = one(&shown.states)?.velocity;
    let after = [0, 1].map(|i| before[i] + 0.75 * DT * GRAVITY[i]);
    let share = 2.0 / 3.0;
    let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
    let kinetic = 0.5 * MASS * ((1.0 - share) * square(before) + share * square(after));
    let ledger = told.report.ledger;
    near("kinetic energy in J/m", ledger.kinetic, kinetic, 1e-13)?;
    let group = told.groups(1)?[0];
    near("of the group", group.kinetic, kinetic, 1e-13)?;
    for i in 0..2 {
        let v = (1.0 - share) * before[i] + share * after[i];
        near("velocity in m/s", group.velocity[i], v, 1e-13)?;
    }
    Ok(format!("{kinetic:.6e} J/m"))
}

/// States of a block that stretches and is pushed, step by step.
fn history(bench: &Bench, window: u64) -> Result<Vec<Vec<ImpState>>, Unmet> {
    let mut flow = bench.run_continuum(&stretching())?;
    flow.window = window;
    let mut history = Vec::new();
    flow.run(DT, 64, |flow, shown| {
        history.push(shown.states.clone());
        let force = |slot: usize| push([0.1 * slot as f64, -1.0], 1e3);
        Ok((0..flow.imps().len()).map(force).collect())
    })?;
    Ok(history)
}

fn same(one: &[Vec<ImpState>], other: &[Vec<ImpState>]) -> Result<(), Unmet> {
    for (step, (a, b)) in (0..).zip(one.iter().zip(other)) {
        for (a, b) in a.iter().zip(b) {
            let bits = |s: &ImpState| [s.position, s.velocity].map(|v| v.map(f64::to_bits));
            require(
                bits(a) == bits(b),
                format_args!("{a:?}"),
                format_args!("{b:?}"),
            )
            .map_err(|e| e.at(step))?;
        }
    }
    require(one.len() == other.len(), one.len(), other.len())
}

fn windows(bench: &Bench) -> Judgement {
    same(&history(bench, 1)?, &history(bench, 64)?)?;
    Ok("64 steps of 64 points".into())
}

fn twice(bench: &Bench) -> Judgement {
    same(&history(bench, 64)?, &history(bench, 64)?)?;
    Ok("64 steps of 64 points".into())
}

fn elsewhere(bench: &Bench) -> Judgement {
    let shift = [4.0 * CELL, -3.0 * CELL];
    let mut ends = Vec::new();
    for lower in [[0.3, 0.5], [0.3 + shift[0], 0.5 + shift[1]]] {
        let mut config = stretching();
        config.groups[0] = block(lower, [0.2, 0.1]);
        let mut flow = bench.run_continuum(&config)?;
        flow.run(DT, STEPS, |flow, _| {
            let force = |slot: usize| push([2.0 * slot as f64, -9.0], 1e3);
            Ok((0..flow.imps().len()).map(force).collect())
        })?;
        flow.grant(DT, 1, false)?;
        ends.push(last_states(&mut flow)?);
    }
    let mut largest = Largest::default();
    for (a, b) in ends[0].iter().zip(&ends[1]) {
        for i in 0..2 {
            let x = a.position[i] + shift[i];
            // Where a point stands in its cell is rounded by 1e-16 of a metre, a step's stress by 1e-14 of itself.
            largest.near("position", b.position[i], x, 1e-9, 1.0)?;
            largest.near("velocity", b.velocity[i], a.velocity[i], 1e-9, 1.0)?;
        }
    }
    Ok(format!("within {largest} m or m/s after {STEPS} steps"))
}

fn last_states(flow: &mut ContinuumRun) -> Result<Vec<ImpState>, Unmet> {
    let states = flow.exchange()?.states;
    flow.report()?;
    Ok(states)
}
