//! Sections 6 and 10: what the configuration says of bodies is so, and their envelopes hold them.

use interface::Vec2;
use interface::config::{BodyConfig, BodyInertia, ContactLaw, DemConfig, Motion};
use interface::message::wire::BodyState;
use mechanics::outline::nearest;

use super::limits::touching;
use super::scene::{MASS, SPHERO, STIFFNESS, block_or_disc, disc, elastic, one_disc, scene};
use crate::bench::{Bench, Points};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "E-1a",
        "answers a request with outlines of that step, then with forces",
        asked,
    )
    .mutant("sends outlines of the next step", || {
        Flaw::envelopes(|header, _| header.step += 1)
    }),
    Clause::must(
        "E-4a",
        "sends outlines in the order of the bodies, each with one reach",
        in_order,
    )
    .mutant("sends bodies in another order", || {
        Flaw::envelopes(|_, vertices| vertices.reverse())
    }),
    Clause::must(
        "E-4b",
        "no part of a body is outside its envelope",
        contained,
    )
    .after(&["E-4a"])
    .mutant("sends outlines without the sphero-radius", || {
        Flaw::envelopes(|_, vertices| vertices.iter_mut().for_each(|v| v.reach *= 0.5))
    }),
    Clause::must("J-1b", "a fixed body does not move", fixed)
        .mutant("lets fixed bodies fall", || {
            change::motion(|motion| matches!(motion, Motion::Fixed).then_some(Motion::Free))
        }),
    Clause::must("J-1c", "a driven body keeps its velocity and spin", driven)
        .needs(&["motion:driven"])
        .after(&["T-1a"])
        .mutant("lets driven bodies fall", || {
            change::motion(|motion| matches!(motion, Motion::Driven).then_some(Motion::Free))
        }),
    Clause::must(
        "J-1d",
        "a guided body is fixed along the given direction",
        guided,
    )
    .needs(&["motion:guided"])
    .after(&["T-1a", "T-1b"])
    .mutant("lets guided bodies move freely", || {
        change::motion(|motion| matches!(motion, Motion::Guided { .. }).then_some(Motion::Free))
    }),
    Clause::must(
        "J-1e",
        "an external force accelerates by force over mass",
        pushed,
    )
    .needs(&["motion:pushed"])
    .after(&["T-1a", "T-1b", "T-4a"])
    .mutant("ignores the external force", || {
        change::motion(|motion| matches!(motion, Motion::Pushed { .. }).then_some(Motion::Free))
    }),
    Clause::must(
        "J-1f",
        "bodies in contact push one another apart",
        body_contact,
    )
    .needs(&["feature:body_contact", "motion:free"])
    .mutant("halves the contact force between bodies", || {
        Flaw::bodies_config(|config| {
            if let Some(ContactLaw::Linear {
                normal_stiffness, ..
            }) = &mut config.body_contact
            {
                *normal_stiffness *= 0.5;
            }
        })
    }),
    Clause::must("J-1g", "mass and inertia follow from density", from_density)
        .needs(&["motion:free"])
        .mutant("uses the density as the mass", || {
            Flaw::bodies_config(|config| {
                for body in &mut config.bodies {
                    if let BodyInertia::Density(density) = body.inertia {
                        body.inertia = BodyInertia::Mass(density);
                    }
                }
            })
        }),
];

const DT: f64 = 1e-4;
const STEPS: u64 = 50;

fn asked(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    play.step(0.0, &[])?;
    play.grant(DT, 2, false)?;
    play.exchange(&[])?;
    let expected = play.header();
    let (header, vertices) = play.envelopes()?;
    let same = (header.step, header.epoch) == (expected.step, expected.epoch);
    let words = |step, epoch| format!("step {step} of epoch {epoch}");
    require(
        same,
        words(expected.step, expected.epoch),
        words(header.step, header.epoch),
    )?;
    play.exchange(&[])?;
    play.report()?;
    Ok(format!("{} vertices, then forces", vertices.len()))
}

/// Envelopes of a disc and a block, both turned, with the bodies.
fn envelopes(
    bench: &Bench,
) -> Result<
    (
        Vec<BodyConfig>,
        Vec<interface::message::wire::EnvelopeVertex>,
    ),
    Unmet,
> {
    let mut bodies = vec![disc([0.5, 0.25]), block_or_disc(bench, [-0.5, 0.0])];
    for body in &mut bodies {
        body.motion = Motion::Fixed;
    }
    bodies[1].angle = 0.4;
    let mut play = bench.run_bodies(&scene(bodies.clone(), elastic(STIFFNESS)))?;
    play.grant(0.0, 1, true)?;
    let (_, vertices) = play.envelopes()?;
    Ok((bodies, vertices))
}

fn in_order(bench: &Bench) -> Judgement {
    let (bodies, vertices) = envelopes(bench)?;
    let order: Vec<u64> = vertices.iter().map(|vertex| vertex.body).collect();
    let rising = order.is_sorted() && order.iter().all(|&b| b < bodies.len() as u64);
    let both = (0..bodies.len() as u64).all(|b| order.contains(&b));
    require(
        rising && both,
        "bodies 0 and 1, one after the other",
        format_args!("{order:?}"),
    )?;
    for pair in vertices
        .windows(2)
        .filter(|pair| pair[0].body == pair[1].body)
    {
        require(pair[0].reach == pair[1].reach, pair[0].reach, pair[1].reach)?;
    }
    let least = vertices
        .iter()
        .map(|vertex| vertex.reach)
        .fold(f64::INFINITY, f64::min);
    require(least >= 0.0, "a reach that is not negative", least)?;
    Ok(format!("{} vertices", vertices.len()))
}

fn contained(bench: &Bench) -> Judgement {
    let (bodies, vertices) = envelopes(bench)?;
    let mut tightest = f64::INFINITY;
    for (b, body) in (0..).zip(&bodies) {
        let mine = || vertices.iter().filter(|vertex| vertex.body == b);
        let outline: Vec<Vec2> = mine().map(|vertex| vertex.position.into()).collect();
        let reach = mine()
            .map(|vertex| vertex.reach)
            .fold(f64::INFINITY, f64::min);
        let (s, c) = body.angle.sin_cos();
        for [x, y] in body.shape.vertices() {
            // The surface around each corner of the swept shape.
            let corner = [
                body.position[0] + c * x - s * y,
                body.position[1] + s * x + c * y,
            ];
            for k in 0..16 {
                let (dy, dx) = (f64::from(k) * std::f64::consts::TAU / 16.0).sin_cos();
                let at = Vec2::new(corner[0] + SPHERO * dx, corner[1] + SPHERO * dy);
                let room = reach - nearest(&outline, at).distance;
                let expected = format_args!("body {b} within its envelope");
                require(
                    room >= -1e-12,
                    expected,
                    format_args!("{:.3e} m outside", -room),
                )?;
                tightest = tightest.min(room);
            }
        }
    }
    Ok(format!("{tightest:.1e} m of room at the tightest"))
}

/// The bodies at the end of [`STEPS`] steps under gravity, pressed by no points.
fn fallen(
    bench: &Bench,
    bodies: Vec<BodyConfig>,
    gravity: [f64; 2],
) -> Result<Vec<BodyState>, Unmet> {
    let count = bodies.len();
    let config = DemConfig {
        gravity,
        ..scene(bodies, elastic(STIFFNESS))
    };
    let mut play = bench.run_bodies(&config)?;
    play.run(&mut Points::new(), DT, STEPS, |_, _| Ok(()))?;
    let (_, measured) = play.step(0.0, &[])?;
    Ok(measured.bodies(count)?.to_vec())
}

fn with_motion(motion: Motion) -> BodyConfig {
    BodyConfig {
        motion,
        ..disc([0.25, 0.5])
    }
}

fn fixed(bench: &Bench) -> Judgement {
    let got = fallen(bench, vec![with_motion(Motion::Fixed)], [1.0, -9.81])?[0].position;
    require(got == [0.25, 0.5], "(0.25, 0.5)", format_args!("{got:?}"))?;
    Ok(format!("{STEPS} steps under gravity"))
}

fn driven(bench: &Bench) -> Judgement {
    let body = BodyConfig {
        velocity: [0.5, -1.0],
        spin: 2.0,
        ..with_motion(Motion::Driven)
    };
    let got = fallen(bench, vec![body], [1.0, -9.81])?[0];
    let t = STEPS as f64 * DT;
    near("position along x", got.position[0], 0.25 + 0.5 * t, 1e-13)?;
    near("position along y", got.position[1], 0.5 - t, 1e-13)?;
    near("angle", got.angle, 2.0 * t, 1e-13)?;
    Ok(format!("{STEPS} steps under gravity"))
}

fn guided(bench: &Bench) -> Judgement {
    let body = with_motion(Motion::Guided {
        hold_x: true,
        hold_y: false,
        hold_angle: false,
    });
    let got = fallen(bench, vec![body], [1.0, -9.81])?[0].position;
    let t = STEPS as f64 * DT;
    require(got[0] == 0.25, "x = 0.25", got[0])?;
    near("y", got[1], 0.5 - 0.5 * 9.81 * t * t, 1e-13)?;
    Ok("held along x, falls along y".into())
}

fn pushed(bench: &Bench) -> Judgement {
    let body = with_motion(Motion::Pushed {
        force: [3.0, -6.0],
        torque: 0.0,
        ramp: 0.0,
        until: None,
    });
    let got = fallen(bench, vec![body], [0.0; 2])?[0].velocity;
    let t = STEPS as f64 * DT;
    near("velocity along x", got[0], 3.0 / MASS * t, 1e-14)?;
    near("velocity along y", got[1], -6.0 / MASS * t, 1e-14)?;
    Ok(format!("{got:?} m/s after {t} s"))
}

fn body_contact(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&touching())?;
    let (_, measured) = play.step(0.0, &[])?;
    let bodies = measured.bodies(2)?;
    let want = STIFFNESS * 1e-3;
    near(
        "force on the left disc",
        bodies[0].body_force[0],
        -want,
        1e-9 * want,
    )?;
    near(
        "force on the right disc",
        bodies[1].body_force[0],
        want,
        1e-9 * want,
    )?;
    Ok(format!("{want} N/m"))
}

fn from_density(bench: &Bench) -> Judgement {
    let density = 2000.0;
    let body = BodyConfig {
        inertia: BodyInertia::Density(density),
        ..disc([0.0; 2])
    };
    let got = fallen(bench, vec![body], [0.0; 2])?[0];
    let mass = density * std::f64::consts::PI * SPHERO * SPHERO;
    near("mass of a disc", got.mass, mass, 1e-12 * mass)?;
    let inertia = 0.5 * mass * SPHERO * SPHERO;
    near("its inertia", got.inertia, inertia, 1e-12 * inertia)?;
    Ok(format!("{mass:.4} kg/m, {inertia:.3e} kg m"))
}
