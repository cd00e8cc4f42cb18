//! Sections 4 and 9: the report and what is measured.

use interface::config::capability::STRESS_WORK;
use interface::config::{GroupConfig, InitialFields};
use interface::message::wire::{GroupState, Ledger, PointState, StepHeader, flags};

use super::scene::{DT, IN_BLOCK, MASS, MODULI, SPACING, block, points, push, scene, single};
use crate::bench::{Bench, ContinuumRun, Shown, WindowReport};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Largest, Unmet, broken, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "R-1a",
        "sends one report for each grant, with its epoch and its last step",
        of_its_grant,
    )
    .mutant("leaves the epoch out of the report's header", || {
        Flaw::reports(|header, _| header.epoch = 0)
    }),
    Clause::must("R-1b", "a report counts points, IMPs and sets", counts)
        .mutant("counts one IMP too many", || {
            change::report(|report| report.imps += 1)
        }),
    Clause::must("R-3b", "measures nothing when not asked", unmeasured).mutant(
        "reports an energy that was not asked for",
        || {
            change::report(|report| {
                if report.measured == 0 {
                    report.ledger.kinetic = 1e-3;
                }
            })
        },
    ),
    Clause::must(
        "R-3a",
        "sends a measurement when asked: one record for each body or group, of the measured step, before the report",
        groups,
    )
    .mutant("sends its groups in reverse order", || {
        Flaw::groups(|_, groups| groups.reverse())
    }),
    Clause::must(
        "R-3e",
        "mass, centre and extent of a group are right",
        extent,
    )
    .after(&["R-3a"])
    .mutant("includes the boxes of points in the extent", || {
        Flaw::groups(|_, groups| {
            for group in groups {
                group.lower = group.lower.map(|x| x - 0.0125);
            }
        })
    }),
    Clause::must(
        "R-3f",
        "contact force and contacts of a group are those of its points",
        group_contact,
    )
    .after(&["R-3a", "F-1c"])
    .mutant("counts points that are near as contacts", || {
        Flaw::groups(|_, groups| {
            for group in groups.iter_mut().filter(|g| g.contacts == 0) {
                group.contacts = 1;
            }
        })
    }),
    Clause::must("N-1a", "momentum less applied impulse is kept", momentum)
        .after(&["T-1b"])
        .mutant("adds to the impulse of gravity", || {
            change::measured(|report| report.ledger.applied_impulse[1] *= 1.0 + 1e-6)
        }),
    Clause::must(
        "N-1f",
        "contact force and impulse are those of the forces",
        contact,
    )
    .after(&["F-1b", "F-1c", "T-1c"])
    .mutant("adds to the impulse of contact", || {
        change::measured(|report| report.ledger.contact_impulse[0] *= 1.0 + 1e-6)
    }),
    Clause::must("N-1g", "elastic energy of a uniform stress", elastic)
        .needs(&["feature:fields"])
        .mutant("adds to the elastic energy", || {
            change::measured(|report| report.ledger.elastic *= 1.01)
        }),
    Clause::must("N-1h", "potential energy is that of all points", potential)
        .mutant("adds to the potential energy", || {
            change::measured(|report| report.ledger.gravity *= 1.0 + 1e-6)
        }),
    Clause::must("N-1b", "the sum of energies is kept", closure)
        .needs(&["feature:fields"])
        .after(&["N-1g", "T-5a"])
        .mutant("loses energy", || {
            change::measured(|report| report.ledger.plastic_work = 0.2 * report.ledger.kinetic)
        }),
    Clause::must("N-1i", "the work of the stress is what is stored", work)
        .needs(&["feature:fields", STRESS_WORK])
        .after(&["N-1b"])
        .mutant(
            "reports twice the stored energy as the work of the stress",
            || change::measured(|report| report.ledger.stress_work = 2.0 * report.ledger.elastic),
        ),
];

fn of_its_grant(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
    let mut epoch = 0;
    for (dt, steps, measure) in [
        (0.0, 1, true),
        (DT, 3, false),
        (DT, 2, false),
        (0.5 * DT, 1, true),
    ] {
        epoch += u64::from(measure || steps == 3);
        flow.grant(dt, steps, measure)?;
        for _ in 0..steps {
            flow.exchange()?;
        }
        let told = flow.report()?;
        let (header, report) = (told.header, told.report);
        let said = (
            report.epoch,
            report.next,
            report.halted,
            header.epoch,
            header.step,
            header.count,
        );
        let expected = (epoch, flow.next(), 0, epoch, flow.next(), 1);
        require(
            said == expected,
            format_args!("epoch, next, halted and header's epoch, step, count {expected:?}"),
            format_args!("{said:?}"),
        )
        .map_err(|e| e.at(flow.next()))?;
    }
    Ok("4 grants".into())
}

fn counts(bench: &Bench) -> Judgement {
    let config = scene(vec![points(&[[0.1, 0.1]]), block([0.4; 2], [0.0; 2])]);
    let mut flow = bench.run_continuum(&config)?;
    for imps in [65, 0] {
        flow.travel = 1.0;
        let told = flow.free_step(DT)?.1.report;
        let said = (told.items, told.imps, told.rebuilds);
        let expected = (65, imps, flow.generation());
        require(
            said == expected,
            format_args!("items, imps, rebuilds {expected:?}"),
            format_args!("{said:?}"),
        )
        .map_err(|e| e.at(flow.next() - 1))?;
        flow.outlines.clear();
    }
    Ok("65 points, 65 and no IMPs".into())
}

fn unmeasured(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.5, 0.0]))?;
    flow.grant(DT, 2, false)?;
    flow.exchange()?;
    flow.exchange()?;
    let WindowReport {
        report,
        groups,
        points,
        ..
    } = flow.report()?;
    require(report.measured == 0, "measured 0", report.measured)?;
    require(
        report.ledger == Ledger::default(),
        "a ledger of zeros",
        format_args!("{:?}", report.ledger),
    )?;
    require(groups.is_none(), "no groups", format_args!("{groups:?}"))?;
    require(points.is_none(), "no points", format_args!("{points:?}"))?;
    Ok("a report alone".into())
}

/// Three groups with different numbers of points.
fn three() -> interface::config::MpmConfig {
    scene(vec![
        points(&[[0.1, 0.2], [0.2, 0.1]]),
        block([0.6; 2], [0.3, -0.1]),
        points(&[[0.3, 0.8]]),
    ])
}

fn measured(bench: &Bench) -> Result<(u64, Vec<GroupState>, StepHeader), Unmet> {
    let mut flow = bench.run_continuum(&three())?;
    flow.coast(DT, 2)?;
    // Measured is the first step of the window; others follow before the report.
    flow.grant(DT, 3, true)?;
    let step = flow.next();
    for _ in 0..3 {
        flow.exchange()?;
    }
    let told = flow.report()?;
    require(
        told.report.measured == 1,
        "measured 1",
        told.report.measured,
    )?;
    let groups = told.groups(3)?.to_vec();
    let header = told.groups.map(|(header, _)| header).unwrap_or_default();
    Ok((step, groups, header))
}

fn groups(bench: &Bench) -> Judgement {
    let (step, groups, header) = measured(bench)?;
    require(
        (header.step, header.count) == (step, 3),
        format_args!("3 groups of step {step}"),
        format_args!("{} of step {}", header.count, header.step),
    )?;
    for (group, count) in groups.iter().zip([2.0, 64.0, 1.0]) {
        let points = group.mass / MASS;
        near("points by mass", points, count, 1e-9)?;
    }
    Ok(format!("3 groups of step {step}"))
}

fn extent(bench: &Bench) -> Judgement {
    let (_, groups, _) = measured(bench)?;
    let t = 2.0 * DT;
    let [x, y] = [0.6 + 0.3 * t, 0.6 - 0.1 * t];
    let (half, side) = (0.5 * SPACING, 8.0 * SPACING);
    let expected = [
        // Lower and upper of the points, not of their boxes.
        ([0.1, 0.1], [0.2, 0.2], [0.15, 0.15], 2.0 * MASS, [0.0; 2]),
        (
            [x + half, y + half],
            [x + side - half, y + side - half],
            [x + 0.5 * side, y + 0.5 * side],
            64.0 * MASS,
            [0.3, -0.1],
        ),
        ([0.3, 0.8], [0.3, 0.8], [0.3, 0.8], MASS, [0.0; 2]),
    ];
    let mut largest = Largest::default();
    for (group, (lower, upper, centre, mass, velocity)) in groups.iter().zip(expected) {
        largest.near("mass", group.mass, mass, 1e-12 * mass, mass)?;
        for i in 0..2 {
            largest.near("lower", group.lower[i], lower[i], 1e-12, 1.0)?;
            largest.near("upper", group.upper[i], upper[i], 1e-12, 1.0)?;
            largest.near("centre", group.position[i], centre[i], 1e-12, 1.0)?;
            largest.near("velocity", group.velocity[i], velocity[i], 1e-12, 1.0)?;
        }
    }
    Ok(format!("3 groups within {largest}"))
}

fn group_contact(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&three())?;
    let (_, told) = flow.step(DT, |flow, _| {
        let force = |info: &interface::message::wire::ImpInfo| match info.group {
            0 => push([1.0, 2.0], 1e3),
            2 => push([-4.0, 0.5], 1e3),
            // Near, but not in contact.
            _ => push([0.0; 2], 1e3),
        };
        flow.imps().iter().map(force).collect()
    })?;
    let groups = told.groups(3)?;
    for (group, (force, contacts)) in
        groups
            .iter()
            .zip([([2.0, 4.0], 2), ([0.0; 2], 0), ([-4.0, 0.5], 1)])
    {
        require(
            (group.contact_force, group.contacts) == (force, contacts),
            format_args!("{force:?} N/m on {contacts} points"),
            format_args!("{:?} N/m on {}", group.contact_force, group.contacts),
        )?;
    }
    Ok("3 groups".into())
}

fn momentum(bench: &Bench) -> Judgement {
    let mut config = scene(vec![block([0.4; 2], [0.4, 0.1])]);
    config.gravity = [2.0, -9.81];
    let mut flow = bench.run_continuum(&config)?;
    let mass = IN_BLOCK as f64 * MASS;
    let mut largest = Largest::default();
    for round in 0..4 {
        let dt = [0.0, DT, 0.3 * DT, 0.0][round];
        let ledger = flow.free_step(dt)?.1.report.ledger;
        for i in 0..2 {
            let left = ledger.momentum[i] - ledger.applied_impulse[i];
            let start = mass * [0.4, 0.1][i];
            // Against the momentum that falls in all of this, a hundred times rounding.
            largest.near("momentum less impulse", left, start, 1e-12 * mass, mass)?;
        }
        if round == 1 {
            flow.coast(DT, 40)?;
        }
    }
    Ok(format!("within {largest} of mass times 1 m/s"))
}

fn contact(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&scene(vec![block([0.4; 2], [0.0; 2])]))?;
    let (mut total, mut impulse, mut before) = ([0.0; 2], [0.0; 2], 0.0);
    let mut largest = Largest::default();
    for (round, share) in [1.0, 1.0, 0.4].into_iter().enumerate() {
        let dt = share * DT;
        let (_, told) = flow.step(dt, |flow, _| {
            let force = |slot: usize| {
                if slot.is_multiple_of(3) {
                    push([0.0; 2], 1e3)
                } else {
                    push([1.0 + slot as f64, -2.0 * round as f64], 1e3)
                }
            };
            let forces: Vec<_> = (0..flow.imps().len()).map(force).collect();
            total = forces
                .iter()
                .fold([0.0; 2], |[x, y], f| [x + f.force[0], y + f.force[1]]);
            forces
        })?;
        let ledger = told.report.ledger;
        let scale = total[0];
        for i in 0..2 {
            impulse[i] += 0.5 * (before + dt) * total[i];
            largest.near(
                "contact force",
                ledger.contact_force[i],
                total[i],
                1e-12 * scale,
                scale,
            )?;
            largest.near(
                "contact impulse",
                ledger.contact_impulse[i],
                impulse[i],
                1e-12 * scale * DT,
                scale * DT,
            )?;
        }
        require(ledger.contacts == 42, "42 contacts", ledger.contacts)?;
        before = dt;
    }
    Ok(format!("42 contacts, within {largest}"))
}

/// A window of steps of `dt` (s) with a frame: what was shown of its first step, and the points.
pub(super) fn framed(
    flow: &mut ContinuumRun,
    dt: f64,
    steps: u64,
) -> Result<(Shown, StepHeader, Vec<PointState>), Unmet> {
    let mut grant = flow.next_grant(dt, steps, true);
    grant.flags |= flags::FRAME;
    flow.send_grants(&[grant])?;
    let first = flow.exchange()?;
    for _ in 1..steps {
        flow.exchange()?;
    }
    match flow.report()?.points {
        Some((header, points)) => Ok((first, header, points)),
        None => Err(broken("all points before the report", "none")),
    }
}

pub(super) fn frame(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&three())?;
    flow.coast(DT, 2)?;
    let (first, header, points) = framed(&mut flow, DT, 2)?;
    let said = (header.step, header.count);
    require(
        said == (2, IN_BLOCK + 3),
        format_args!("{} points of step 2", IN_BLOCK + 3),
        format_args!("{} of step {}", said.1, said.0),
    )?;
    for ((point, info), state) in points.iter().zip(flow.imps()).zip(&first.states) {
        let said = (point.id, point.group);
        let expected = (info.id, info.group);
        require(
            said == expected,
            format_args!("point and group {expected:?}"),
            format_args!("{said:?}"),
        )?;
        near("mass in kg/m", point.mass, info.mass, 1e-12 * info.mass)?;
        // Equal to the states of the step, to the bit, because nothing happens in between.
        require(
            (point.position, point.velocity) == (state.position, state.velocity),
            format_args!("{state:?}"),
            format_args!("{point:?}"),
        )?;
    }
    Ok("67 points as the states have them".into())
}

/// Plane strain with its stress out of plane, and shear, in Pa.
const STRESS: [f64; 4] = [-3e3, 1e3, -500.0, 800.0];

pub(super) fn stressed(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&scene(vec![under_stress()]))?;
    let (_, _, points) = framed(&mut flow, 0.0, 1)?;
    for point in &points {
        for (said, expected) in point.stress.iter().zip(STRESS) {
            near("stress in Pa", *said, expected, 1e-9)?;
        }
        let volume = SPACING * SPACING;
        near("volume in m^2", point.volume, volume, 1e-12 * volume)?;
    }
    Ok(format!("{} points", points.len()))
}

/// A block under [`STRESS`].
fn under_stress() -> GroupConfig {
    GroupConfig {
        fields: InitialFields {
            velocity: None,
            stress: Some(STRESS.map(|s: f64| format!("{s}"))),
        },
        ..block([0.4; 2], [0.0; 2])
    }
}

fn elastic(bench: &Bench) -> Judgement {
    // u = (p^2/K + s:s/(2G))/2.
    let [xx, yy, zz, xy] = STRESS;
    let [k, g] = MODULI;
    let p = (xx + yy + zz) / 3.0;
    let square = (xx - p).powi(2) + (yy - p).powi(2) + (zz - p).powi(2) + 2.0 * xy * xy;
    let density = 0.5 * (p * p / k + square / (2.0 * g));
    let mut flow = bench.run_continuum(&scene(vec![under_stress()]))?;
    let said = flow.free_step(0.0)?.1.report.ledger.elastic;
    let expected = density * (8.0 * SPACING).powi(2);
    near("elastic energy in J/m", said, expected, 1e-10 * expected)?;
    Ok(format!("{said:.6e} J/m"))
}

fn potential(bench: &Bench) -> Judgement {
    let mut config = three();
    config.gravity = [3.0, -7.0];
    let mut flow = bench.run_continuum(&config)?;
    let said = flow.free_step(0.0)?.1.report.ledger.gravity;
    // Sums of m x by hand: two points, a block of 64 about (0.7, 0.7), one point.
    let [x, y] = [0.3 + 64.0 * 0.7 + 0.3, 0.3 + 64.0 * 0.7 + 0.8];
    let expected = -MASS * (3.0 * x - 7.0 * y);
    near(
        "potential energy in J/m",
        said,
        expected,
        1e-12 * 64.0 * MASS,
    )?;
    Ok(format!("{said:.6e} J/m"))
}

/// A block with its longest wave: half a period of a cosine over it, a few cells long.
fn ringing() -> GroupConfig {
    let field = |text: &str| text.to_string();
    GroupConfig {
        fields: InitialFields {
            velocity: Some([field("0.02*cos(5*pi*(x - 0.4))"), field("0")]),
            stress: None,
        },
        ..block([0.4; 2], [0.0; 2])
    }
}

/// Strains are so small that any elastic law has an energy.
fn work(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&scene(vec![ringing()]))?;
    let (_, told) = flow.free_step(0.0)?;
    let start = told.report.ledger.elastic;
    let (mut off, mut most) = (0.0_f64, 0.0_f64);
    for _ in 0..10 {
        flow.coast(0.5 * DT, 9)?;
        let (_, told) = flow.free_step(0.5 * DT)?;
        let ledger = &told.report.ledger;
        let kept = if bench.takes("stress_work") {
            ledger.elastic - start
        } else {
            0.0
        };
        off = off.max((ledger.stress_work - kept).abs());
        most = most.max(ledger.elastic);
    }
    require(
        off <= 0.02 * most,
        "work within 2 % of the most that is stored; 0 without the capability `stress_work`",
        format_args!("off by {:.2} %", 100.0 * off / most),
    )?;
    Ok(format!("within {:.2} %", 100.0 * off / most))
}

fn closure(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&scene(vec![ringing()]))?;
    let total = |told: &WindowReport| {
        let l = &told.report.ledger;
        l.kinetic
            + l.kinetic_rotation
            + l.elastic
            + l.gravity
            + l.contact
            + l.friction_work
            + l.viscous_work
            + l.plastic_work
            + l.transfer_work
            - l.driven_work
    };
    let (_, told) = flow.free_step(0.0)?;
    let (start, mut off, mut most) = (total(&told), 0.0_f64, 0.0_f64);
    // A period of the bar is 2 x 0.2 m / 40 m/s = 10 ms.
    for _ in 0..10 {
        flow.coast(0.5 * DT, 9)?;
        let (_, told) = flow.free_step(0.5 * DT)?;
        off = off.max((total(&told) - start).abs() / start);
        most = most.max(told.report.ledger.elastic / start);
    }
    require(
        off <= 0.05,
        "the same within 5 %, which FLIP and linear hats need over half a period",
        format_args!("off by {:.2} %", 100.0 * off),
    )?;
    require(
        most > 0.3,
        "a third of it elastic at some time",
        format_args!("{:.2} %", 100.0 * most),
    )?;
    Ok(format!(
        "within {:.2} %, elastic up to {:.0} %",
        100.0 * off,
        100.0 * most
    ))
}
