//! Sections 5 and 7 together: bodies and points that meet keep momentum, angular momentum and energy.

use interface::config::{BodyConfig, ContactLaw};

use super::scene::{MASS, RADIUS, SPHERO, STIFFNESS, block, disc, elastic, scene};
use crate::bench::{Bench, Points};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Largest, Unmet, near};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "F-7i",
        "bodies take the same impulse, negated: momentum is kept",
        momentum,
    )
    .needs(&["motion:free"])
    .after(ROOTS)
    .mutant("pushes moving points harder than it is pushed", || {
        change::moving(
            |v| v > 0.5,
            |force| force.force = force.force.map(|f| 1.001 * f),
        )
    }),
    Clause::must(
        "F-7j",
        "a push off the centre turns a body: angular momentum is kept",
        spin,
    )
    .needs(&["motion:free", "shape:rectangle"])
    .after(&["F-7a", "F-7d", "T-1a", "T-1b", "T-4a", "F-7i"])
    .mutant("does not turn", || {
        Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.spin *= 0.99))
    }),
    Clause::must("F-7h", "forces do not change in a moving frame", galilean)
        .needs(&["motion:free"])
        .after(&["F-7a", "F-7d", "T-1a", "F-7i"])
        .mutant("adds a drag to fast points", || {
            change::moving(|v| v > 30.0, |force| force.force[0] -= 1.0)
        }),
    Clause::must("T-1d", "an elastic impact keeps the speed: e = 1", bounce)
        .needs(&["motion:free"])
        .after(&["F-7a", "F-7d", "T-1a", "T-1b", "T-4a", "F-7i"])
        .mutant("damps a little without a dashpot", || {
            change::law(|_, k_t, mu, zeta| {
                if *zeta == 0.0 && *mu == 0.0 && *k_t == 0.0 {
                    *zeta = 0.002;
                }
            })
        }),
];

const ROOTS: &[&str] = &["F-7a", "F-7d", "T-1a", "T-1b", "T-4a"];

/// Mass of a point in kg/m.
const POINT: f64 = 0.5;
/// Phases of the first contact within a step.
const PHASES: u32 = 16;

/// Angular frequency of a contact of a disc and a point in 1/s.
fn omega() -> f64 {
    (STIFFNESS * (1.0 / POINT + 1.0 / MASS)).sqrt()
}

/// A row of discs, a metre apart, and a point in front of each that comes at 1 m/s and touches at another phase of a
/// step of `dt`.
fn row(dt: f64) -> (Vec<BodyConfig>, Points) {
    let mut points = Points::new();
    let discs = (0..PHASES).map(|k| {
        let x = f64::from(k);
        let gap = (1.0 + x / f64::from(PHASES)) * dt;
        points = std::mem::take(&mut points).with(
            [x + SPHERO + RADIUS + gap, 0.0],
            [-1.0, 0.0],
            RADIUS,
            POINT,
        );
        disc([x, 0.0])
    });
    (discs.collect(), points)
}

/// Velocities along x of each disc and its point after a bounce in steps of `h / omega`.
fn bounced(bench: &Bench, h: f64) -> Result<Vec<(f64, f64)>, Unmet> {
    let dt = h / omega();
    let (bodies, mut points) = row(dt);
    let mut play = bench.run_bodies(&scene(bodies, elastic(STIFFNESS)))?;
    play.set(&points.set);
    // Half a period of contact, and the way there.
    let steps = (std::f64::consts::PI / h) as u64 + 6;
    play.run(&mut points, dt, steps, |_, _| Ok(()))?;
    let (answer, measured) = play.step(0.0, &points.states)?;
    points.advance(&answer.step, &answer.forces);
    let bodies = measured.bodies(PHASES as usize)?;
    let velocities = bodies.iter().zip(&points.states);
    Ok(velocities
        .map(|(b, p)| (b.velocity[0], p.velocity[0]))
        .collect())
}

fn momentum(bench: &Bench) -> Judgement {
    let mut largest = Largest::default();
    for (disc, point) in bounced(bench, 0.1)? {
        // 40 kicks, each rounded to an ulp of the speed.
        largest.near(
            "momentum",
            MASS * disc + POINT * point,
            -POINT,
            40.0 * f64::EPSILON,
            POINT,
        )?;
        // The contact must have changed the velocity.
        near(
            "speed of the disc",
            disc,
            -2.0 * POINT / (MASS + POINT),
            0.01,
        )?;
    }
    Ok(format!("within {largest} over {PHASES} bounces"))
}

fn bounce(bench: &Bench) -> Judgement {
    let mut worst: f64 = 0.0;
    for h in [0.05, 0.1] {
        for (disc, point) in bounced(bench, h)? {
            let e = point - disc;
            // The leapfrog's energy is off by a share of (omega dt)^2/8 where contact begins, and where it ends.
            near(&format!("e at omega dt = {h}"), e, 1.0, h * h / 4.0)?;
            worst = worst.max((e - 1.0).abs());
        }
    }
    Ok(format!(
        "|e - 1| up to {worst:.1e} at omega dt of 0.05 and 0.1"
    ))
}

fn spin(bench: &Bench) -> Judgement {
    let target = block([0.0; 2]);
    let start = [0.08, 0.05 + SPHERO + RADIUS + 1e-4];
    let mut points = Points::new().with(start, [0.2, -1.0], RADIUS, POINT);
    // About an origin far from both.
    let far = [3.0, -2.0];
    let about = |x: [f64; 2], v: [f64; 2]| (x[0] - far[0]) * v[1] - (x[1] - far[1]) * v[0];
    let before = POINT * about(start, [0.2, -1.0]);
    let mut play = bench.run_bodies(&scene(vec![target], elastic(STIFFNESS)))?;
    play.set(&points.set);
    play.run(&mut points, 1e-4, 200, |_, _| Ok(()))?;
    let (answer, measured) = play.step(0.0, &points.states)?;
    points.advance(&answer.step, &answer.forces);
    let (body, point) = (measured.bodies(1)?[0], points.states[0]);
    let after = MASS * about(body.position, body.velocity)
        + body.inertia * body.spin
        + POINT * about(point.position, point.velocity);
    // 200 steps with the rounding of terms of about 1.
    near(
        "angular momentum",
        after,
        before,
        200.0 * 4.0 * f64::EPSILON,
    )?;
    near(
        "spin of the block, above 0.1",
        body.spin.abs().min(0.1),
        0.1,
        0.0,
    )?;
    Ok(format!("off by {:.1e} of {before:.2} N s", after - before))
}

/// A point runs into a disc at 1 m/s, both carried along at `boost` m/s; its force in every step.
fn carried(bench: &Bench, boost: f64, law: ContactLaw) -> Result<Vec<f64>, Unmet> {
    let mut target = disc([0.0; 2]);
    target.velocity = [boost, 0.0];
    let start = [SPHERO + RADIUS + 1e-5, 0.0];
    let mut points = Points::new().with(start, [boost - 1.0, 0.0], RADIUS, POINT);
    let mut play = bench.run_bodies(&scene(vec![target], law))?;
    play.set(&points.set);
    let mut forces = Vec::new();
    play.run(&mut points, 1e-4, 100, |_, answer| {
        forces.push(answer.forces[0].force[0]);
        Ok(())
    })?;
    Ok(forces)
}

fn galilean(bench: &Bench) -> Judgement {
    let law = elastic(STIFFNESS);
    let (still, fast) = (carried(bench, 0.0, law)?, carried(bench, 64.0, law)?);
    let mut largest = Largest::default();
    // 100 steps of 6.4 mm; each position has the rounding of up to 0.7 m and speeds that of 64 m/s over the way.
    let tolerance = 100.0 * 64.0 * f64::EPSILON * STIFFNESS;
    for (step, (one, other)) in (0..).zip(still.iter().zip(&fast)) {
        let same = largest.near("force", *other, *one, tolerance, STIFFNESS * RADIUS);
        same.map_err(|e| e.at(step))?;
    }
    Ok(format!("within {largest} of k_n r_p at 64 m/s"))
}
