//! Sections 5 and 8: limits bound what the bodies can do, and who is beyond its budget halts.

use interface::config::{BodyConfig, DemConfig};
use interface::message::wire::{ImpForce, flags};

use super::order::pressed;
use super::scene::{MASS, RADIUS, SPHERO, STIFFNESS, damped, disc, one_disc, scene};
use crate::bench::{Bench, Budget};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, broken, require};

pub const CLAUSES: &[Clause] = &[
    Clause::should(
        "L-2b",
        "contact_omega_sq is at most four times that",
        contact_tight,
    )
    .needs(&["motion:free"])
    .mutant("reports ten times its contact frequency", || {
        change::limits(|l| l.contact_omega_sq *= 10.0)
    }),
    Clause::must(
        "H-2a",
        "halts after a step whose limits are beyond a budget",
        halts,
    )
    .needs(&["motion:free"])
    .mutant("never halts", || {
        Flaw::grants(|_, grants| {
            for grant in grants {
                grant.budget_omega_sq = f64::MAX;
                grant.budget_speed = f64::MAX;
                grant.budget_damping = f64::MAX;
            }
        })
    }),
    Clause::must(
        "L-5a",
        "does not halt on the last step of a window",
        last_step,
    )
    .needs(&["motion:free"])
    .after(&["H-2a"])
    .mutant("halts on the last step too", || {
        let (budget, short) = change::shared(f64::MAX);
        let flaw = Flaw::grants(move |_, grants| {
            grants.iter().for_each(|g| budget.set(g.budget_speed));
        });
        flaw.with(Flaw::reports(move |_, reports| {
            if short.get() == 0.0 {
                reports.iter_mut().for_each(|report| report.halted = 1);
            }
        }))
    }),
    Clause::must(
        "H-1c",
        "stops before the step that the other side does not compute",
        other_halts,
    )
    .mutant("does not report a halt of the other side", || {
        let (halted, hidden) = change::shared(false);
        let flaw =
            Flaw::states(move |header, _| halted.set(header.flags & flags::HALT_BEFORE != 0));
        flaw.with(Flaw::reports(move |_, reports| {
            if hidden.get() {
                reports.iter_mut().for_each(|report| report.halted = 0);
            }
        }))
    }),
    Clause::must(
        "H-5a",
        "a halt changes no bit of the later steps",
        halt_is_free,
    )
    .needs(&["motion:free"])
    .after(&["H-2a"])
    .mutant("uses another step length after a halt", || {
        let (halted, next) = change::shared(false);
        let flaw = Flaw::grants(move |_, grants| {
            for grant in grants.iter_mut().filter(|_| next.get()) {
                grant.dt *= 1.0 + 1e-6;
            }
        });
        flaw.with(Flaw::reports(move |_, reports| {
            reports
                .iter()
                .for_each(|report| halted.set(report.halted == 1));
        }))
    }),
];

fn contact_tight(bench: &Bench) -> Judgement {
    let points = pressed().with([0.0, SPHERO + 0.9 * RADIUS], [0.0; 2], RADIUS, 0.5);
    let mut play = bench.run_bodies(&one_disc(bench))?;
    play.set(&points.set);
    let (_, told) = play.step(0.0, &points.states)?;
    let (got, exact) = (told.report.limits.contact_omega_sq, 3.0 * STIFFNESS / MASS);
    require(
        got <= 4.0 * exact,
        format_args!("at most four times {exact:.3e} 1/s^2"),
        format_args!("{got:.3e}"),
    )?;
    Ok("half the step that is possible, or more".into())
}

/// A moving disc that two points press, damped where the solver takes that: beyond any budget of 0.
fn lively(bench: &Bench) -> DemConfig {
    let law = damped(if bench.takes("feature:damping") {
        0.1
    } else {
        0.0
    });
    let mut runner: BodyConfig = disc([0.0; 2]);
    runner.velocity = [0.1, 0.0];
    scene(vec![runner], law)
}

fn halts(bench: &Bench) -> Judgement {
    let budgets = [
        (
            "omega_sq",
            Budget {
                omega_sq: 0.0,
                ..Budget::ALL
            },
        ),
        (
            "speed",
            Budget {
                speed: 0.0,
                ..Budget::ALL
            },
        ),
        (
            "damping",
            Budget {
                damping: 0.0,
                ..Budget::ALL
            },
        ),
    ];
    let damps = bench.takes("feature:damping");
    for (name, budget) in budgets.into_iter().take(if damps { 3 } else { 2 }) {
        let mut play = bench.run_bodies(&lively(bench))?;
        let points = pressed();
        play.set(&points.set);
        play.budget = budget;
        play.grant(1e-5, 5, true)?;
        let answer = play.exchange(&points.states)?;
        let told = answer.header.flags & flags::HALT_AFTER != 0;
        require(
            told,
            format_args!("HALT_AFTER beyond the budget of {name}"),
            "forces without it",
        )?;
        let report = play.report()?.report;
        let halted = report.halted == 1 && report.next == 1;
        let got = format_args!("halted = {}, next = {}", report.halted, report.next);
        require(halted, "halted = 1, next = 1", got)?;
    }
    Ok("for each budget".into())
}

fn last_step(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&lively(bench))?;
    let points = pressed();
    play.set(&points.set);
    play.budget.speed = 0.0;
    let (_, measured) = play.step(1e-5, &points.states)?;
    let report = measured.report;
    let whole = report.halted == 0 && report.next == 1;
    let got = format_args!("halted = {}, next = {}", report.halted, report.next);
    require(whole, "halted = 0, next = 1", got)?;
    Ok("halted = 0".into())
}

fn other_halts(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    let points = pressed();
    play.set(&points.set);
    play.grant(1e-5, 5, true)?;
    play.exchange(&points.states)?;
    play.exchange(&points.states)?;
    play.halt_before()?;
    let report = play.report()?.report;
    let halted = report.halted == 1 && report.next == 2;
    let got = format_args!("halted = {}, next = {}", report.halted, report.next);
    require(halted, "halted = 1, next = 2", got)?;
    // The session goes on.
    play.step(1e-5, &points.states)?;
    Ok("halted = 1, and goes on".into())
}

fn halt_is_free(bench: &Bench) -> Judgement {
    let run = |budget: Budget| -> Result<(Vec<ImpForce>, u64), Unmet> {
        let mut play = bench.run_bodies(&lively(bench))?;
        play.budget = budget;
        let mut points = pressed();
        play.set(&points.set);
        let (mut forces, mut halts) = (Vec::new(), 0);
        play.run(&mut points, 1e-4, 40, |_, answer| {
            forces.extend(&answer.forces);
            halts += u64::from(answer.header.flags & flags::HALT_AFTER != 0);
            Ok(())
        })?;
        Ok((forces, halts))
    };
    let (plain, _) = run(Budget::ALL)?;
    let (halting, halts) = run(Budget {
        speed: 0.0,
        ..Budget::ALL
    })?;
    if let Some(k) = plain.iter().zip(&halting).position(|(a, b)| a != b) {
        let (a, b) = (plain[k], halting[k]);
        return Err(broken(format_args!("{a:?}"), format_args!("{b:?}")).at((k / 2) as u64));
    }
    Ok(format!("the same bits in 40 steps with {halts} halts"))
}
