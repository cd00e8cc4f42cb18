//! Section 7, the law `linear` beyond its spring: friction, its history, and the dashpot.

use interface::config::{BodyShape, ContactLaw, DemConfig, Motion};

use super::scene::{RADIUS, SPHERO, STIFFNESS, body, frictional, scene};
use crate::bench::{Bench, Play, Points};
use crate::clause::Clause;
use crate::verdict::{Judgement, Unmet, near, require};

/// Clauses that these rest on: the force itself, of its own step, on a body that stays.
const ROOTS: &[&str] = &["F-7a", "F-7d", "J-1b"];

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "F-7k",
        "friction opposes sliding and is mu F_n at most",
        coulomb,
    )
    .after(ROOTS)
    .covers(&["C21"]),
    Clause::must("F-7l", "below that it is the tangential spring's", spring)
        .after(&["F-7a", "F-7d", "J-1b", "F-7k"])
        .covers(&["C21"]),
    Clause::must(
        "F-7m",
        "mu = 0: no tangential force, exactly 0",
        frictionless,
    )
    .after(ROOTS)
    .covers(&["C21"]),
    Clause::must(
        "F-7n",
        "an opened contact has forgotten its tangential spring",
        forgotten,
    )
    .after(&["F-7a", "F-7d", "J-1b", "F-7l"])
    .covers(&["C21"]),
    Clause::must(
        "I-10a",
        "the tangential spring survives a new set with other slots",
        carried_over,
    )
    .after(&["F-7a", "F-7d", "J-1b", "F-7l", "I-9a"])
    .covers(&["C06"]),
    Clause::must("F-7o", "the dashpot adds -c u_N", dashpot)
        .after(&["F-7a", "F-7d", "J-1b", "T-1a"]),
    Clause::must("F-7p", "the dashpot never pulls", no_pull).after(&["F-8a", "F-7a", "F-7o"]),
];

const MU: f64 = 0.5;
/// Tangential stiffness in N/m.
const TANGENTIAL: f64 = 2e4;
/// Overlap in m.
const OVERLAP: f64 = 1e-3;
/// Sliding in a step, in m.
const SLIDE: f64 = 1e-4;
const DT: f64 = 1e-3;

/// A floor whose upper surface is at y = 0.
fn floor(law: ContactLaw) -> DemConfig {
    let shape = BodyShape::Segment {
        ends: [[-1.0, 0.0], [1.0, 0.0]],
    };
    scene(vec![body(shape, [0.0, -SPHERO], Motion::Fixed)], law)
}

/// A point at `x` that presses on the floor with `overlap`.
fn on_floor(x: f64, overlap: f64, velocity: [f64; 2]) -> Points {
    Points::new().with([x, RADIUS - overlap], velocity, RADIUS, 0.5)
}

/// Slides a point along the floor, from `x`, by [`SLIDE`] a step times `directions`; the force at the end.
fn slide(play: &mut Play, x: &mut f64, directions: &[f64]) -> Result<[f64; 2], Unmet> {
    let mut force = [0.0; 2];
    for direction in directions {
        *x += direction * SLIDE;
        let points = on_floor(*x, OVERLAP, [direction * SLIDE / DT, 0.0]);
        force = play.step(DT, &points.states)?.0.forces[0].force;
    }
    Ok(force)
}

/// A point that has just been set on the floor.
fn landed(bench: &Bench, law: ContactLaw) -> Result<Play<'_>, Unmet> {
    let mut play = bench.play(&floor(law))?;
    let points = on_floor(0.0, OVERLAP, [0.0; 2]);
    play.set(&points.set);
    play.step(DT, &points.states)?;
    Ok(play)
}

fn coulomb(bench: &Bench) -> Judgement {
    let mut play = landed(bench, frictional(TANGENTIAL, MU))?;
    let (mut x, cap) = (0.0, MU * STIFFNESS * OVERLAP);
    for direction in [1.0, -1.0] {
        for _ in 0..40 {
            let force = slide(&mut play, &mut x, &[direction])?;
            let within = force[0].abs() <= cap * (1.0 + 1e-12);
            require(within, format_args!("at most {cap} N/m"), force[0].abs())
                .map_err(|e| e.at(play.next() - 1))?;
        }
        let force = slide(&mut play, &mut x, &[direction])?;
        near("friction", force[0], -direction * cap, 1e-9 * cap)
            .map_err(|e| e.at(play.next() - 1))?;
    }
    Ok(format!("{cap} N/m both ways"))
}

fn spring(bench: &Bench) -> Judgement {
    let mut play = landed(bench, frictional(TANGENTIAL, MU))?;
    let mut x = 0.0;
    for k in 1..10 {
        let force = slide(&mut play, &mut x, &[1.0])?;
        let want = -TANGENTIAL * SLIDE * f64::from(k);
        near("friction", force[0], want, 1e-9).map_err(|e| e.at(play.next() - 1))?;
    }
    // Slid to its cap and pulled back by three steps.
    let force = slide(
        &mut play,
        &mut x,
        &[[1.0; 20].as_slice(), &[-1.0; 3]].concat(),
    )?;
    let want = -MU * STIFFNESS * OVERLAP + 3.0 * TANGENTIAL * SLIDE;
    near("friction after sliding", force[0], want, 1e-9)?;
    Ok("k_t times the way, forth and back".into())
}

fn frictionless(bench: &Bench) -> Judgement {
    let mut play = landed(bench, frictional(TANGENTIAL, 0.0))?;
    let mut x = 0.0;
    for _ in 0..10 {
        let force = slide(&mut play, &mut x, &[1.0])?;
        require(force[0] == 0.0, "0", force[0]).map_err(|e| e.at(play.next() - 1))?;
    }
    Ok("0 in ten steps".into())
}

fn forgotten(bench: &Bench) -> Judgement {
    let mut play = landed(bench, frictional(TANGENTIAL, MU))?;
    let mut x = 0.0;
    slide(&mut play, &mut x, &[1.0; 5])?;
    play.step(DT, &on_floor(x, -OVERLAP, [0.0; 2]).states)?;
    let (answer, _) = play.step(DT, &on_floor(x, OVERLAP, [0.0; 2]).states)?;
    near(
        "friction of the new contact",
        answer.forces[0].force[0],
        0.0,
        1e-9,
    )?;
    let force = slide(&mut play, &mut x, &[1.0])?;
    near("friction after a step", force[0], -TANGENTIAL * SLIDE, 1e-9)?;
    Ok("0, then from the beginning".into())
}

fn carried_over(bench: &Bench) -> Judgement {
    let mut play = bench.play(&floor(frictional(TANGENTIAL, MU)))?;
    let at = |x: f64| {
        let mut points = on_floor(x, OVERLAP, [SLIDE / DT, 0.0]);
        points.set[0].id = 5;
        points
    };
    play.set(&at(0.0).set);
    for k in 0..5 {
        play.step(DT, &at(f64::from(k) * SLIDE).states)?;
    }
    // Another point before it, far away.
    let mut both = Points::new().with([0.5, RADIUS + 1e-3], [0.0; 2], RADIUS, 0.5);
    let slid = at(5.0 * SLIDE);
    both.set.extend(&slid.set);
    both.states.extend(&slid.states);
    play.set(&both.set);
    let (answer, _) = play.step(DT, &both.states)?;
    let got = answer.forces[1].force[0];
    near("friction", got, -TANGENTIAL * 5.0 * SLIDE, 1e-9)?;
    Ok(format!("{got:.3} N/m in another slot"))
}

fn damped() -> ContactLaw {
    ContactLaw::Linear {
        normal_stiffness: STIFFNESS,
        tangential_stiffness: 0.0,
        friction: 0.0,
        damping_ratio: 0.1,
    }
}

/// c of the floor and a point of 0.5 kg/m, in N s/m.
fn damping() -> f64 {
    2.0 * 0.1 * (STIFFNESS * 0.5).sqrt()
}

fn dashpot(bench: &Bench) -> Judgement {
    let mut play = bench.play(&floor(damped()))?;
    let speed = 0.1;
    let mut points = on_floor(0.0, OVERLAP, [0.0, -speed]);
    play.set(&points.set);
    for k in 0..5 {
        let overlap = OVERLAP + f64::from(k) * speed * DT;
        points = on_floor(0.0, overlap, [0.0, -speed]);
        let (answer, _) = play.step(DT, &points.states)?;
        let want = STIFFNESS * overlap + damping() * speed;
        near("force", answer.forces[0].force[1], want, 1e-9 * want)
            .map_err(|e| e.at(answer.step.index))?;
    }
    Ok(format!("c = {:.3} N s/m", damping()))
}

fn no_pull(bench: &Bench) -> Judgement {
    let mut play = bench.play(&floor(damped()))?;
    // So fast that the dashpot would pull five times as hard as the spring pushes.
    let speed = 5.0 * STIFFNESS * OVERLAP / damping();
    let points = on_floor(0.0, OVERLAP, [0.0, speed]);
    play.set(&points.set);
    let got = play.step(1e-6, &points.states)?.0.forces[0].force[1];
    require(got == 0.0, "0", got)?;
    Ok(format!("0 at {speed:.1} m/s"))
}
