//! Sections 5 and 9: reports, measurements, and a ledger that balances.

use interface::config::capability::CONTACTS;
use interface::config::{BodyConfig, BodyShape, ContactLaw, DemConfig, Motion};
use interface::message::wire::{Ledger, Record, flags};

use super::order::pressed;
use super::scene::{
    MASS, RADIUS, SPHERO, STIFFNESS, block_or_disc, body, damped, disc, elastic, frictional,
    one_disc, scene,
};
use crate::bench::{Answer, Bench, Points, WindowReport};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Largest, Unmet, broken, near, require};

const ROOTS: &[&str] = &["F-7a", "F-7d", "T-1a", "T-1b", "F-7i"];

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "R-1a",
        "sends one report for each grant, with its epoch and its last step",
        report,
    )
    .mutant("reports on another epoch", || {
        Flaw::reports(|_, reports| reports.iter_mut().for_each(|report| report.epoch += 1))
    }),
    Clause::must("R-2a", "the numbers of a report are finite", finite)
        .after(&["L-1a"])
        .mutant("reports a NaN", || change::limits(|l| l.mobility = f64::NAN)),
    Clause::must(
        "R-3a",
        "sends a measurement when asked: one record for each body or group, of the measured step, before the report",
        measured,
    )
    .mutant("measures the next step", || {
        Flaw::bodies(|header, _| header.step += 1)
    }),
    Clause::must("R-3b", "measures nothing when not asked", unmeasured)
        .mutant("reports a measurement that was not asked for", || {
            Flaw::reports(|_, reports| reports.iter_mut().for_each(|report| report.measured = 1))
        }),
    Clause::must(
        "R-3c",
        "measures mass, force and contacts of each body",
        body_forces,
    )
    .needs(&["motion:free"])
    .after(&["F-7a", "R-3a"])
    .mutant("counts one contact too many", || {
        Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.contacts += 1))
    }),
    Clause::must("R-3d", "measures torque about the centre of mass", torque)
        .needs(&["motion:free", "shape:rectangle"])
        .after(&["F-7a", "R-3c"])
        .mutant("reverses torques", || {
            Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.point_torque *= -1.0))
        }),
    Clause::must(
        "R-6a",
        "the contacts of a frame are those of the measured step, and add up to the body's force and torque",
        contacts,
    )
    .needs(&[CONTACTS, "motion:free"])
    .after(&["F-7a", "R-3a", "R-3c", "R-3d"])
    .mutant("reports the forces on the points", || {
        Flaw::contacts(|_, contacts| {
            for contact in contacts {
                contact.force = contact.force.map(|f| -f);
            }
        })
    })
    .mutant("reports the position of the other surface", || {
        Flaw::contacts(|_, contacts| contacts.iter_mut().for_each(|c| c.position[0] += 0.01))
    })
    .mutant("forgets a contact", || {
        Flaw::contacts(|header, contacts| {
            contacts.pop();
            header.count = contacts.len() as u64;
        })
    })
    .mutant("reports the contacts of the next step", || {
        Flaw::contacts(|header, _| header.step += 1)
    }),
    Clause::must("N-1a", "momentum less applied impulse is kept", momentum)
        .needs(&["motion:free"])
        .after(ROOTS)
        .mutant("leaves out a share of the impulse of gravity", || {
            change::ledger(|l| l.applied_impulse = l.applied_impulse.map(|p| 0.9 * p))
        }),
    Clause::must("N-1b", "the sum of energies is kept", energy)
        .needs(&["motion:free"])
        .after(ROOTS)
        .mutant("leaves out the energy in springs", || {
            change::ledger(|l| l.contact = 0.0)
        }),
    Clause::must("N-1c", "the ledger has the energy dissipated by sliding", friction_work)
        .needs(&["feature:friction"])
        .after(&[
            "F-7a", "F-7d", "T-1a", "T-1b", "F-7i", "N-1b", "F-7k", "F-7l", "J-1b",
        ])
        .mutant("counts half of the energy dissipated by sliding", || {
            change::ledger(|l| l.friction_work *= 0.5)
        }),
    Clause::must("N-1d", "the ledger has the energy dissipated by a dashpot", viscous_work)
        .needs(&["feature:damping"])
        .after(&["F-7a", "F-7d", "T-1a", "T-1b", "F-7i", "N-1b", "F-7o"])
        .mutant("counts half of the energy dissipated by dashpots", || {
            change::ledger(|l| l.viscous_work *= 0.5)
        }),
    Clause::must("N-1e", "the ledger has the work of an external force", driven_work)
        .needs(&["motion:pushed"])
        .after(&["T-1a", "T-1b", "N-1b", "J-1e"])
        .mutant("counts half of the work of external forces", || {
            change::ledger(|l| l.driven_work *= 0.5)
        }),
    Clause::must(
        "N-1f",
        "contact force and impulse are those of the forces",
        exchanged,
    )
    .needs(&["motion:free"])
    .after(ROOTS)
    .mutant("counts the contact forces on the points", || {
        change::ledger(|l| l.contact_force = l.contact_force.map(|f| -f))
    }),
];

fn report(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    let points = pressed();
    play.set(&points.set);
    play.step(0.0, &points.states)?;
    for steps in [1, 3] {
        let grant = play.next_grant(1e-5, steps, true);
        play.send_grants(&[grant])?;
        for _ in 0..steps {
            play.exchange(&points.states)?;
        }
        let got = play.report()?.report;
        let said = (got.epoch, got.next, got.halted);
        let expected = (grant.epoch, grant.first + steps, 0);
        let words = |(epoch, next, halted)| format!("epoch {epoch}, next {next}, halted {halted}");
        require(said == expected, words(expected), words(said))?;
    }
    Ok("windows of 1 and 3 steps".into())
}

/// A measured step of length 0 of a disc that two points press.
fn opened(bench: &Bench) -> Result<(Answer, WindowReport), Unmet> {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    let points = pressed();
    play.set(&points.set);
    play.step(0.0, &points.states)
}

fn finite(bench: &Bench) -> Judgement {
    let (_, measured) = opened(bench)?;
    let wrong = measured.report.check().err();
    require(
        wrong.is_none(),
        "finite numbers",
        format_args!("{wrong:?}: {:?}", measured.report),
    )?;
    Ok("all of them".into())
}

fn measured(bench: &Bench) -> Judgement {
    let held = |k| body(BodyShape::Disc, [f64::from(k), 0.0], Motion::Fixed);
    let bodies = (0..3).map(held).collect();
    let mut play = bench.run_bodies(&scene(bodies, elastic(STIFFNESS)))?;
    play.step(0.0, &[])?;
    play.grant(1e-4, 2, true)?;
    play.exchange(&[])?;
    play.exchange(&[])?;
    let got = play.report()?;
    require(
        got.report.measured == 1,
        "measured = 1",
        got.report.measured,
    )?;
    let bodies = got.bodies(3)?;
    require(bodies.len() == 3, "3 bodies", bodies.len())?;
    for (k, body) in (0..).zip(bodies) {
        near(
            "position of the body in its place",
            body.position[0],
            f64::from(k),
            1e-12,
        )?;
    }
    let step = got.bodies.as_ref().map_or(0, |(header, _)| header.step);
    require(
        step == 1,
        "states of step 1",
        format_args!("of step {step}"),
    )?;
    Ok("3 bodies of the window's first step".into())
}

fn unmeasured(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    play.grant(1e-4, 1, false)?;
    play.exchange(&[])?;
    let got = play.report()?;
    require(
        got.report.measured == 0,
        "measured = 0",
        got.report.measured,
    )?;
    require(
        got.report.ledger == Ledger::default(),
        "a ledger of 0",
        format_args!("{:?}", got.report.ledger),
    )?;
    require(got.bodies.is_none(), "no bodies", "bodies")?;
    Ok("measured = 0, no ledger, no bodies".into())
}

/// A block pressed off its centre by one point, or a disc, and the force on that point.
fn pushed_block(bench: &Bench) -> Result<(f64, WindowReport), Unmet> {
    let (target, corner) = target(bench);
    let at = [0.8 * corner[0], corner[1] + SPHERO + 0.9 * RADIUS];
    let points = Points::new().with(at, [0.0; 2], RADIUS, 0.5);
    let mut play = bench.run_bodies(&scene(vec![target], elastic(STIFFNESS)))?;
    play.set(&points.set);
    let (answer, measured) = play.step(0.0, &points.states)?;
    Ok((answer.forces[0].force[1], measured))
}

fn body_forces(bench: &Bench) -> Judgement {
    let (force, measured) = pushed_block(bench)?;
    let body = measured.bodies(1)?[0];
    near("mass", body.mass, MASS, 1e-12 * MASS)?;
    near(
        "force of points along y",
        body.point_force[1],
        -force,
        1e-12 * force,
    )?;
    require(body.contacts == 1, "1 contact", body.contacts)?;
    Ok(format!("{:.3} N/m of 1 point", body.point_force[1]))
}

/// A free body that three points press is in the frame of the first of two steps.
fn contacts(bench: &Bench) -> Judgement {
    let (target, corner) = target(bench);
    let center = target.position;
    let spots = [[0.8, 0.9], [0.1, 0.7], [-0.6, 0.8]];
    let points = spots.iter().fold(Points::new(), |points, &[x, deep]| {
        let at = [x * corner[0], corner[1] + SPHERO + deep * RADIUS];
        points.with(at, [0.0; 2], RADIUS, 0.5)
    });
    let mut play = bench.run_bodies(&scene(vec![target], elastic(STIFFNESS)))?;
    play.set(&points.set);
    play.step(0.0, &points.states)?;
    let mut grant = play.next_grant(1e-5, 2, true);
    grant.flags |= flags::FRAME;
    play.send_grants(&[grant])?;
    play.exchange(&points.states)?;
    play.exchange(&points.states)?;
    let told = play.report()?;
    let Some((header, contacts)) = &told.contacts else {
        return Err(broken("the contacts before the report", "none"));
    };
    let body = told.bodies(1)?[0];
    let said = (header.step, header.count);
    require(
        said == (grant.first, body.contacts),
        format_args!("{} contacts of step {}", body.contacts, grant.first),
        format_args!("{} of step {}", said.1, said.0),
    )?;
    let (mut force, mut torque) = ([0.0; 2], 0.0);
    for contact in contacts {
        let known = points.set.iter().any(|info| info.id == contact.other);
        let said = (contact.body, contact.with, known);
        require(
            said == (0, 1, true),
            "a point of the set on body 0",
            format_args!("{contact:?}"),
        )?;
        let [x, y] = [0, 1].map(|i| contact.position[i] - center[i]);
        let [fx, fy] = contact.force;
        force = [force[0] + fx, force[1] + fy];
        torque += x * fy - y * fx;
    }
    let scale = force[1].abs();
    for i in 0..2 {
        near(
            "sum of their forces in N/m",
            force[i],
            body.point_force[i],
            1e-12 * scale,
        )?;
    }
    near(
        "sum of their torques in N",
        torque,
        body.point_torque,
        1e-12 * scale,
    )?;
    Ok(format!("{} contacts, {:.3} N/m", contacts.len(), force[1]))
}

fn torque(bench: &Bench) -> Judgement {
    let (force, measured) = pushed_block(bench)?;
    let got = measured.bodies(1)?[0].point_torque;
    near("torque", got, -0.08 * force, 1e-12 * force)?;
    Ok(format!("{got:.4} N"))
}

/// Runs points against bodies in measured steps of `dt`; `look` gets the measurement and what the points have at `t_n`:
/// momentum after the kick in N s/m, energy in J/m.
fn observe(
    bench: &Bench,
    config: &DemConfig,
    mut points: Points,
    (dt, steps): (f64, u64),
    mut look: impl FnMut(&Answer, &WindowReport, [f64; 2], f64) -> Result<(), Unmet>,
) -> Result<(), Unmet> {
    let mut play = bench.run_bodies(config)?;
    play.set(&points.set);
    for _ in 0..steps {
        let (answer, measured) = play.step(dt, &points.states)?;
        let before = kinetic(&points);
        points.advance(&answer.step, &answer.forces);
        let w = answer.step.centring();
        let energy = (1.0 - w) * before + w * kinetic(&points);
        look(&answer, &measured, points.momentum(), energy).map_err(|e| e.at(answer.step.index))?;
    }
    Ok(())
}

fn kinetic(points: &Points) -> f64 {
    let points = points.states.iter().zip(&points.set);
    points
        .map(|(s, i)| 0.5 * i.mass * (s.velocity[0].powi(2) + s.velocity[1].powi(2)))
        .sum()
}

/// N-1's sum of a ledger in J/m.
fn total(ledger: &Ledger) -> f64 {
    ledger.kinetic
        + ledger.kinetic_rotation
        + ledger.elastic
        + ledger.gravity
        + ledger.contact
        + ledger.friction_work
        + ledger.viscous_work
        + ledger.plastic_work
        - ledger.driven_work
}

/// A block with its corner, without what is swept around it; or a disc, whose corner is its centre.
fn target(bench: &Bench) -> (BodyConfig, [f64; 2]) {
    let target = block_or_disc(bench, [0.0; 2]);
    let corner = target.shape.vertices().pop().unwrap_or_default();
    (target, corner.map(f64::abs))
}

/// A point that hits a falling block off its centre, or a disc aslant.
fn hit(bench: &Bench) -> (DemConfig, Points) {
    let (target, corner) = target(bench);
    let config = DemConfig {
        gravity: [1.0, -9.81],
        ..scene(vec![target], elastic(STIFFNESS))
    };
    let start = [0.6 * corner[0], corner[1] + SPHERO + RADIUS + 1e-4];
    let aslant = if corner == [0.0; 2] { 0.2 } else { 0.0 };
    (
        config,
        Points::new().with(start, [aslant, -1.0], RADIUS, 0.5),
    )
}

fn momentum(bench: &Bench) -> Judgement {
    let (config, points) = hit(bench);
    let start = points.momentum();
    let mut largest = Largest::default();
    observe(
        bench,
        &config,
        points,
        (1e-4, 200),
        |_, measured, of_points, _| {
            let ledger = &measured.report.ledger;
            for i in 0..2 {
                let sum = of_points[i] + ledger.momentum[i] - ledger.applied_impulse[i];
                largest.near("sum", sum, start[i], 200.0 * f64::EPSILON, 0.5)?;
            }
            Ok(())
        },
    )?;
    Ok(format!("within {largest} of the point's"))
}

/// Largest change of N-1's sum over both sides, which shall be below `tolerance` of the points' energy at the start.
fn balance(
    bench: &Bench,
    config: &DemConfig,
    points: Points,
    time: (f64, u64),
    tolerance: f64,
) -> Result<(Largest, Ledger), Unmet> {
    let scale = kinetic(&points).max(1e-3);
    let (mut first, mut last) = (None, Ledger::default());
    let mut largest = Largest::default();
    observe(bench, config, points, time, |_, measured, _, of_points| {
        last = measured.report.ledger;
        let sum = of_points + total(&last);
        let start = *first.get_or_insert(sum);
        largest.near("energy", sum, start, tolerance * scale, scale)
    })?;
    Ok((largest, last))
}

fn energy(bench: &Bench) -> Judgement {
    let (config, points) = hit(bench);
    let dt = 2e-5;
    // A share (omega dt)^2/8 of the leapfrog at either end of the contact; omega is 500/s here, gravity adds its own.
    let (largest, ledger) = balance(bench, &config, points, (dt, 700), 1e-4)?;
    let turned = ledger.kinetic_rotation > 1e-3 || !bench.takes("shape:rectangle");
    require(turned, "a block that turns", ledger.kinetic_rotation)?;
    Ok(format!("within {largest} of the energy"))
}

/// A fixed body that a point hits at an angle.
fn glance(bench: &Bench, law: ContactLaw) -> (DemConfig, Points) {
    let (mut target, corner) = target(bench);
    target.motion = Motion::Fixed;
    let config = scene(vec![target], law);
    let start = [-0.2 * corner[0], corner[1] + SPHERO + RADIUS + 1e-5];
    // At that speed a point would pass through a disc.
    let along = if corner == [0.0; 2] { 0.5 } else { 1.5 };
    (
        config,
        Points::new().with(start, [along, -1.0], RADIUS, 0.5),
    )
}

fn friction_work(bench: &Bench) -> Judgement {
    let (config, points) = glance(bench, frictional(2e4, 0.3));
    let (largest, ledger) = balance(bench, &config, points, (1e-5, 1200), 1e-3)?;
    let booked = ledger.friction_work > 0.02;
    require(
        booked,
        "work of friction above 0.02 J/m",
        ledger.friction_work,
    )?;
    Ok(format!(
        "{:.4} J/m, within {largest} of the energy",
        ledger.friction_work
    ))
}

fn viscous_work(bench: &Bench) -> Judgement {
    let (config, points) = glance(bench, damped(0.1));
    // The work of the dashpot uses forces that are half a step late: first order in dt.
    let (largest, ledger) = balance(bench, &config, points, (1e-5, 1200), 1e-2)?;
    let booked = ledger.viscous_work > 0.05;
    require(
        booked,
        "work of the dashpot above 0.05 J/m",
        ledger.viscous_work,
    )?;
    Ok(format!(
        "{:.4} J/m, within {largest} of the energy",
        ledger.viscous_work
    ))
}

fn driven_work(bench: &Bench) -> Judgement {
    let mut pushed = disc([0.0; 2]);
    pushed.motion = Motion::Pushed {
        force: [3.0, 1.0],
        torque: 0.0,
        ramp: 0.0,
        until: None,
    };
    let config = scene(vec![pushed], elastic(STIFFNESS));
    let (_, ledger) = balance(bench, &config, Points::new(), (1e-4, 200), 1e-6)?;
    let booked = ledger.driven_work > 1e-4;
    require(
        booked,
        "work of the push above 1e-4 J/m",
        ledger.driven_work,
    )?;
    Ok(format!("{:.3e} J/m", ledger.driven_work))
}

fn exchanged(bench: &Bench) -> Judgement {
    let (config, points) = hit(bench);
    let mut largest = Largest::default();
    let mut impulse = [0.0; 2];
    observe(
        bench,
        &config,
        points,
        (1e-4, 200),
        |answer, measured, _, _| {
            let ledger = &measured.report.ledger;
            for i in 0..2 {
                let force = answer.forces[0].force[i];
                impulse[i] += answer.step.kick() * force;
                let scale = STIFFNESS * RADIUS;
                near(
                    "contact force",
                    ledger.contact_force[i],
                    -force,
                    1e-12 * scale,
                )?;
                largest.near(
                    "contact impulse",
                    ledger.contact_impulse[i],
                    -impulse[i],
                    1e-13,
                    1.0,
                )?;
            }
            Ok(())
        },
    )?;
    Ok(format!(
        "impulse within {largest} N s/m of {:.3}",
        impulse[1]
    ))
}
