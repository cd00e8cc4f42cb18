//! Section 5, time: the leapfrog of T-1 to T-6.

use std::time::{SystemTime, UNIX_EPOCH};

use interface::config::{BodyConfig, DemConfig};
use interface::message::wire::{BodyState, ImpForce};
use interface::step::Step;

use super::order::pressed;
use super::scene::{
    MASS, RADIUS, SPHERO, STIFFNESS, block_or_disc, disc, elastic, frictional, scene,
};
use crate::bench::{Bench, Points};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Largest, Unmet, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "T-1a",
        "free flight is x0 + n dt v0, and rotation likewise",
        flight,
    )
    .needs(&["motion:free"])
    .mutant("takes half the granted step", || {
        Flaw::grants(|_, grants| {
            for grant in grants {
                grant.dt *= 0.5;
                grant.dt_before_epoch *= 0.5;
            }
        })
    }),
    Clause::must("T-2a", "the first kick is half a step", first_kick)
        .needs(&["motion:free"])
        .after(&["T-1a"])
        .mutant("begins with a whole kick", || {
            Flaw::grants(|_, grants| {
                for grant in grants.iter_mut().filter(|g| g.first == 0) {
                    grant.dt_before_epoch = grant.dt;
                }
            })
        }),
    Clause::must(
        "T-1b",
        "free fall follows the leapfrog: x0 + n dt v0 + g (n dt)^2/2",
        fall,
    )
    .needs(&["motion:free"])
    .after(&["T-1a", "T-2a"])
    .mutant("begins every window with half a kick", || {
        Flaw::grants(|_, grants| {
            for grant in grants.iter_mut().filter(|g| g.steps_in_epoch > 0) {
                grant.epoch_start += grant.dt * grant.steps_in_epoch as f64;
                grant.steps_in_epoch = 0;
                grant.dt_before_epoch = 0.0;
            }
        })
    }),
    Clause::must("T-1c", "uses a step that changes in every epoch", varied)
        .needs(&["motion:free"])
        .after(&["T-1a", "T-1b"])
        .mutant("keeps the first step length", || {
            let mut first = 0.0;
            Flaw::grants(move |_, grants| {
                for grant in grants.iter_mut().filter(|g| g.dt > 0.0) {
                    first = if first > 0.0 { first } else { grant.dt };
                    grant.dt = first;
                }
            })
        })
        .mutant("kicks by the step before", || {
            change::each_grant(|grant| {
                if grant.dt > 0.0 && grant.dt_before_epoch > 0.0 && grant.steps_in_epoch == 0 {
                    let twice = 2.0 * grant.dt_before_epoch - grant.dt;
                    grant.dt_before_epoch = twice.max(0.0);
                }
            })
        }),
    Clause::must(
        "T-4a",
        "the closing step brings velocities to the time of the positions",
        closing,
    )
    .needs(&["motion:free"])
    .after(&["T-1a", "T-1b"])
    .mutant("closes without a kick", || {
        Flaw::grants(|_, grants| {
            for grant in grants.iter_mut().filter(|g| g.dt == 0.0) {
                grant.dt_before_epoch = 0.0;
            }
        })
    }),
    Clause::must("T-5a", "measured velocities are centred", centred)
        .needs(&["motion:free"])
        .after(&["T-1b", "T-1c", "T-4a"])
        .mutant("measures velocities half a step late", || {
            let (dt, kick) = change::shared(0.0);
            let flaw = Flaw::grants(move |_, grants| {
                grants
                    .iter()
                    .for_each(|g| dt.set(if g.first > 0 { g.dt } else { 0.0 }));
            });
            flaw.with(Flaw::bodies(move |_, bodies| {
                for body in bodies {
                    body.velocity[1] -= 9.81 * kick.get() / 2.0;
                }
            }))
        }),
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
        .after(&["T-6a", "T-1b"])
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

/// Judged late: it compares forces bit by bit, so they have to be of their own step.
pub const OPENING: &[Clause] = &[Clause::must(
    "T-3a",
    "an opening step moves nothing and leaves no trace",
    opening,
)
.needs(&["motion:free"])
.after(&["T-6a", "F-7d"])
.mutant("moves in the opening step", || {
    Flaw::grants(|_, grants| {
        for grant in grants.iter_mut().filter(|g| g.first == 0 && g.dt == 0.0) {
            grant.dt = 1e-4;
        }
    })
})];

/// Steps of a flight. After n steps a sum of n terms is off by at most n ulp of its largest partial sum.
const STEPS: u64 = 200;
/// m/s^2.
const GRAVITY: [f64; 2] = [0.5, -9.81];
const DT: f64 = 1.7e-4;

/// A disc and a block in flight.
fn flying(bench: &Bench) -> Vec<BodyConfig> {
    let mut bodies = vec![disc([0.3, -0.2]), block_or_disc(bench, [2.0, 1.0])];
    for (body, velocity) in bodies.iter_mut().zip([[0.7, -1.3], [-0.4, 0.9]]) {
        body.velocity = velocity;
        body.spin = 3.0;
    }
    bodies
}

fn falling(bench: &Bench) -> DemConfig {
    DemConfig {
        gravity: GRAVITY,
        ..scene(flying(bench), elastic(STIFFNESS))
    }
}

fn flight(bench: &Bench) -> Judgement {
    let bodies = flying(bench);
    let mut play = bench.run_bodies(&scene(bodies.clone(), elastic(STIFFNESS)))?;
    play.run(&mut Points::new(), DT, STEPS, |_, _| Ok(()))?;
    let (_, measured) = play.step(0.0, &[])?;
    let mut largest = Largest::default();
    let t = STEPS as f64 * DT;
    let tolerance = STEPS as f64 * f64::EPSILON * 2.0;
    for (body, state) in bodies.iter().zip(measured.bodies(bodies.len())?) {
        for i in 0..2 {
            let x = body.position[i] + t * body.velocity[i];
            largest.near("position", state.position[i], x, tolerance, 1.0)?;
        }
        largest.near("angle", state.angle, t * body.spin, tolerance, 1.0)?;
    }
    Ok(format!("within {largest} m or rad after {STEPS} steps"))
}

fn first_kick(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&falling(bench))?;
    play.step(DT, &[])?;
    let (_, measured) = play.step(DT, &[])?;
    let mut largest = Largest::default();
    for (body, state) in flying(bench).iter().zip(measured.bodies(2)?) {
        for (i, g) in GRAVITY.into_iter().enumerate() {
            let x = body.position[i] + DT * body.velocity[i] + 0.5 * g * DT * DT;
            largest.near(
                "position after a step",
                state.position[i],
                x,
                1e-15,
                g.abs() * DT * DT,
            )?;
        }
    }
    Ok(format!("within {largest} of g dt^2"))
}

fn fall(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&falling(bench))?;
    play.run(&mut Points::new(), DT, STEPS, |_, _| Ok(()))?;
    let (_, measured) = play.step(0.0, &[])?;
    let mut largest = Largest::default();
    let t = STEPS as f64 * DT;
    for (body, state) in flying(bench).iter().zip(measured.bodies(2)?) {
        for (i, g) in GRAVITY.into_iter().enumerate() {
            let x = body.position[i] + t * body.velocity[i] + 0.5 * g * t * t;
            let tolerance = STEPS as f64 * f64::EPSILON * 4.0;
            largest.near("position", state.position[i], x, tolerance, g.abs() * t * t)?;
        }
    }
    Ok(format!("within {largest} of g t^2 after {STEPS} steps"))
}

/// A body that only gravity moves, in the kit's own leapfrog.
struct Falling {
    position: [f64; 2],
    velocity: [f64; 2],
}

impl Falling {
    /// Advances by a step; returns the position and the centred velocity at `t_n`.
    fn step(&mut self, step: &Step) -> ([f64; 2], [f64; 2]) {
        let (position, before) = (self.position, self.velocity);
        let w = step.centring();
        for (i, g) in GRAVITY.into_iter().enumerate() {
            self.velocity[i] += g * step.kick();
            self.position[i] += self.velocity[i] * step.dt;
        }
        let centred = |i: usize| (1.0 - w) * before[i] + w * self.velocity[i];
        (position, [centred(0), centred(1)])
    }
}

/// Compares every step of a fall with steps that change by up to three, and its closing step, with the kit's leapfrog.
fn follow(
    bench: &Bench,
    mut look: impl FnMut(&Step, &BodyState, [f64; 2], [f64; 2]) -> Result<(), Unmet>,
) -> Result<(), Unmet> {
    let mut play = bench.run_bodies(&falling(bench))?;
    let body = &flying(bench)[0];
    let mut own = Falling {
        position: body.position,
        velocity: body.velocity,
    };
    let varied = (0..40u32).map(|k| DT * f64::from(1 + (7 * k) % 3));
    for dt in varied.chain([0.0]) {
        let (answer, measured) = play.step(dt, &[])?;
        let (position, velocity) = own.step(&answer.step);
        look(&answer.step, &measured.bodies(1)?[0], position, velocity)?;
    }
    Ok(())
}

fn varied(bench: &Bench) -> Judgement {
    let mut largest = Largest::default();
    follow(bench, |step, body, position, _| {
        for i in 0..2 {
            let near = largest.near("position", body.position[i], position[i], 1e-14, 1.0);
            near.map_err(|e| e.at(step.index))?;
        }
        Ok(())
    })?;
    Ok(format!("within {largest} m over 40 epochs"))
}

fn centred(bench: &Bench) -> Judgement {
    let mut largest = Largest::default();
    follow(bench, |step, body, _, velocity| {
        for i in 0..2 {
            let near = largest.near("velocity", body.velocity[i], velocity[i], 1e-14, 1.0);
            near.map_err(|e| e.at(step.index))?;
        }
        Ok(())
    })?;
    Ok(format!("within {largest} m/s over 40 epochs"))
}

fn closing(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&falling(bench))?;
    play.run(&mut Points::new(), DT, STEPS, |_, _| Ok(()))?;
    let (_, measured) = play.step(0.0, &[])?;
    let mut largest = Largest::default();
    for (body, state) in flying(bench).iter().zip(measured.bodies(2)?) {
        for (i, g) in GRAVITY.into_iter().enumerate() {
            let v = body.velocity[i] + g * DT * STEPS as f64;
            let tolerance = STEPS as f64 * f64::EPSILON * 2.0;
            largest.near("velocity", state.velocity[i], v, tolerance, g.abs() * DT)?;
        }
    }
    Ok(format!("within {largest} of g dt"))
}

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

fn opening(bench: &Bench) -> Judgement {
    let config = DemConfig {
        gravity: GRAVITY,
        ..scene(vec![disc([0.0; 2])], elastic(STIFFNESS))
    };
    let run = |open: bool| -> Result<(Vec<ImpForce>, BodyState), Unmet> {
        let mut play = bench.run_bodies(&config)?;
        let mut points = pressed();
        play.set(&points.set);
        if open {
            play.step(0.0, &points.states)?;
        }
        let mut forces = Vec::new();
        play.run(&mut points, 1e-4, 10, |_, answer| {
            forces.extend(&answer.forces);
            Ok(())
        })?;
        let (_, measured) = play.step(0.0, &points.states)?;
        Ok((forces, measured.bodies(1)?[0]))
    };
    let (plain, opened) = (run(false)?, run(true)?);
    require(
        plain == opened,
        format_args!("{:?}", plain.1),
        format_args!("{:?}", opened.1),
    )?;
    Ok("the same bits with and without".into())
}
