//! Section 5, time: the leapfrog of T-1 to T-6.

use std::time::{SystemTime, UNIX_EPOCH};

use interface::config::DemConfig;
use interface::message::wire::{BodyState, ImpForce};

use super::scene::{MASS, RADIUS, SPHERO, block_or_disc, frictional, scene};
use crate::bench::{Bench, Points};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must("T-6a", "two runs give the same bits", |bench| {
        same(&tumble(bench, bench.window)?, &tumble(bench, bench.window)?)
    })
    .needs(&["motion:free"])
    .mutant("rounds differently by the time of day", || {
        Flaw::forces(|_, forces| {
            let now = SystemTime::now().duration_since(UNIX_EPOCH);
            if now.is_ok_and(|now| now.subsec_micros() % 2 == 1) {
                change::next_up(forces);
            }
        })
    }),
    Clause::must("T-6b", "windows of 1 and 64 give the same bits", windows)
        .needs(&["motion:free"])
        .after(&["T-6a"])
        .mutant("rounds differently for other windows", || {
            let (window, steps) = change::shared(0);
            let flaw = Flaw::grants(move |_, grants| {
                grants.iter().for_each(|g| window.set(g.steps));
            });
            flaw.with(Flaw::forces(move |_, forces| {
                if steps.get() > 1 {
                    change::next_up(forces);
                }
            }))
        }),
];

/// m/s^2.
const GRAVITY: [f64; 2] = [0.5, -9.81];

/// What is compared bit by bit.
#[derive(Debug, PartialEq)]
struct Record {
    forces: Vec<ImpForce>,
    bodies: Vec<BodyState>,
}

/// Points run into a falling, spinning block, with friction.
fn tumble(bench: &Bench, window: u64) -> Result<Record, Unmet> {
    let mut play = bench.run_bodies(&tumbling(bench))?;
    play.window = window;
    let flat = bench.takes("shape:rectangle");
    let mut points = Points::new();
    for k in 0..5 {
        let (along, gap) = (f64::from(k) - 2.0, 1e-4 * f64::from(k));
        let far = SPHERO + RADIUS + gap;
        let (s, c) = (0.9 * along).sin_cos();
        let at = if flat {
            [0.04 * along, -(0.05 + far)]
        } else {
            [far * s, -far * c]
        };
        let velocity = if flat { [0.3, 1.0] } else { [0.3 - s, c] };
        points = points.with(at, velocity, RADIUS, 0.05 * MASS);
    }
    play.set(&points.set);
    let mut forces = Vec::new();
    play.run(&mut points, 1e-4, 130, |_, answer| {
        forces.extend(&answer.forces);
        Ok(())
    })?;
    let (_, measured) = play.step(0.0, &points.states)?;
    let bodies = measured.bodies(1)?.to_vec();
    Ok(Record { forces, bodies })
}

fn tumbling(bench: &Bench) -> DemConfig {
    let mut body = block_or_disc(bench, [0.0; 2]);
    body.spin = -2.0;
    let rubs = bench.takes("feature:friction");
    let friction = if rubs { 0.4 } else { 0.0 };
    DemConfig {
        gravity: GRAVITY,
        ..scene(vec![body], frictional(2e4, friction))
    }
}

/// Whether two runs are the same to the bit; if not, where they part.
fn same(one: &Record, other: &Record) -> Judgement {
    let bits = |f: &ImpForce| {
        [
            f.force[0].to_bits(),
            f.force[1].to_bits(),
            f.stiffness.to_bits(),
        ]
    };
    let mut pairs = one.forces.iter().zip(&other.forces);
    if let Some(k) = pairs.position(|(a, b)| bits(a) != bits(b)) {
        let (a, b) = (one.forces[k], other.forces[k]);
        let step = (k / 5) as u64;
        return require(false, format_args!("{a:?}"), format_args!("{b:?}"))
            .map_err(|e| e.at(step))
            .map(|()| String::new());
    }
    let (a, b) = (&one.bodies, &other.bodies);
    require(a == b, format_args!("{a:?}"), format_args!("{b:?}"))?;
    let pressing = one.forces.iter().filter(|f| f.force != [0.0; 2]).count();
    require(
        pressing > 50,
        "a scene with contacts",
        format_args!("{pressing} forces"),
    )?;
    Ok(format!("{pressing} forces and the end state, bit by bit"))
}

fn windows(bench: &Bench) -> Judgement {
    same(&tumble(bench, 1)?, &tumble(bench, 64)?)
}
