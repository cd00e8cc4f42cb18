//! Sections 5 and 8: limits bound what the bodies can do, and who is beyond its budget halts.

use interface::config::{BodyConfig, DemConfig};
use interface::message::wire::flags;

use super::scene::{MASS, RADIUS, SPHERO, STIFFNESS, disc, law, one_disc, pressed, scene};
use crate::bench::Bench;
use crate::clause::{Clause, clauses};
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, require};

pub const CLAUSES: &[Clause] = clauses! {
    Should "L-2b" "contact_omega_sq is at most four times that" by contact_tight, needs: &["motion:free"];
        - "reports ten times its contact frequency": change::limits(|l| l.contact_omega_sq *= 10.0);
    Must "H-2a" "halts after a step whose limits are beyond a budget" by halts, needs: &["motion:free"];
        - "never halts": Flaw::grant(|g| {
            (g.budget_omega_sq, g.budget_speed, g.budget_damping) = (f64::MAX, f64::MAX, f64::MAX);
        });
    Must "H-1c" "stops before the step that the other side does not compute" by other_halts;
        - "does not report a halt of the other side": {
            let (halted, hidden) = change::shared(false);
            let flaw = Flaw::states(move |header, _| halted.set(header.flags & flags::HALT_BEFORE != 0));
            flaw.with(Flaw::report(move |report| report.halted *= u64::from(!hidden.get())))
        };
};

fn contact_tight(bench: &Bench) -> Judgement {
    let points = pressed().with([0.0, SPHERO + 0.9 * RADIUS], [0.0; 2], RADIUS, 0.5);
    let mut play = bench.run_bodies(&one_disc(bench))?;
    play.set(&points.set);
    let (_, told) = play.measured(0.0, &points.states)?;
    let (got, exact) = (told.report.limits.contact_omega_sq, 3.0 * STIFFNESS / MASS);
    let expected = format_args!("at most four times {exact:.3e} 1/s^2");
    require(got <= 4.0 * exact, expected, format_args!("{got:.3e}"))?;
    Ok("half the step that is possible, or more".into())
}

/// A moving disc that two points press, damped where the solver takes that: beyond any budget of 0.
pub fn lively(bench: &Bench) -> DemConfig {
    let damps = bench.takes("feature:damping");
    let mut runner: BodyConfig = disc([0.0; 2]);
    runner.velocity = [0.1, 0.0];
    scene(vec![runner], law(0.0, 0.0, if damps { 0.1 } else { 0.0 }))
}

fn halts(bench: &Bench) -> Judgement {
    let names = ["omega_sq", "speed", "damping"];
    let damps = bench.takes("feature:damping");
    for name in &names[..2 + usize::from(damps)] {
        let (mut play, points) = (bench.run_bodies(&lively(bench))?, pressed());
        play.set(&points.set);
        match *name {
            "omega_sq" => play.budget.omega_sq = 0.0,
            "speed" => play.budget.speed = 0.0,
            _ => play.budget.damping = 0.0,
        }
        play.grant(1e-5, 5, true)?;
        let told = play.answer(&points.states)?.header.flags & flags::HALT_AFTER != 0;
        let expected = format_args!("HALT_AFTER beyond the budget of {name}");
        require(told, expected, "forces without it")?;
        play.ends(true, 1)?;
    }
    Ok("for each budget".into())
}

fn other_halts(bench: &Bench) -> Judgement {
    let (mut play, points) = (bench.run_bodies(&one_disc(bench))?, pressed());
    play.set(&points.set);
    play.grant(1e-5, 5, true)?;
    play.answer(&points.states)?;
    play.answer(&points.states)?;
    play.halt_before()?;
    play.ends(true, 2)?;
    // The session goes on.
    play.measured(1e-5, &points.states)?;
    Ok("halted = 1, and goes on".into())
}
