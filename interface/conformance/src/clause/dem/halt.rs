//! Section 5, halting: who is beyond its budget, or whose other side is.

use interface::config::{BodyConfig, ContactLaw, DemConfig, Motion};
use interface::message::wire::{Budget, flags};

use super::scene::{SPHERO, STIFFNESS, disc, pressed};
use crate::bench::{Bench, Run};
use crate::clause::{Clause, below_the_sum, clauses};
use crate::verdict::{Judgement, require};

pub const CLAUSES: &[Clause] = clauses! {
    Must "H-2a" "halts after a step whose limits are beyond a budget" by halts, needs: &["motion:free"];
    Must "L-3a" "compares the sum of its frequencies with the budget" by sum, after: &["H-2a", "L-2b"],
        needs: &["motion:free", "feature:body_contact"];
    Must "H-1c" "stops before the step that the other side does not compute" by other_halts;
};

/// A moving disc that two points press, damped where the solver takes that: beyond any budget of 0.
pub fn lively(bench: &Bench) -> DemConfig {
    let damps = bench.takes("feature:damping");
    let mut config = disc(Motion::Free);
    config.bodies[0].velocity = [0.1, 0.0];
    config.point_contact = ContactLaw::linear(STIFFNESS, 0.0, 0.0, if damps { 0.1 } else { 0.0 });
    config
}

fn halts(bench: &Bench) -> Judgement {
    let budgets: [fn(&mut Budget) -> &mut f64; 3] =
        [|b| &mut b.omega_sq, |b| &mut b.speed, |b| &mut b.damping];
    let count = 2 + usize::from(bench.takes("feature:damping"));
    for budget in budgets.into_iter().take(count) {
        let (mut play, points) = (bench.run_bodies(&lively(bench))?, pressed());
        play.set(&points.set);
        *budget(&mut play.budget) = 0.0;
        play.grant(1e-5, 5, true)?;
        let halts = play.answer(&points.states)?.header.flags & flags::HALT_AFTER != 0;
        let expected = format_args!("HALT_AFTER beyond {:?}", play.budget);
        require(halts, expected, "forces without it")?;
        play.ends(true, 1)?;
    }
    Ok("for each budget".into())
}

fn sum(bench: &Bench) -> Judgement {
    let mut config = disc(Motion::Free);
    // It lies in another disc, while two points press it.
    let other = BodyConfig {
        position: [0.0, 1.9 * SPHERO],
        motion: Motion::Fixed,
        ..config.bodies[0].clone()
    };
    config.bodies.push(other);
    config.body_contact = Some(config.point_contact);
    // No contact counts more than its stiffness.
    config.contact_resolution = bench.takes("feature:contact_resolution").then_some(2.0);
    let (mut play, points) = (bench.run_bodies(&config)?, pressed());
    play.set(&points.set);
    let (_, reported) = play.measured(1e-5, &points.states)?;
    play.budget.omega_sq = below_the_sum(&reported.report.limits);
    play.grant(1e-5, 5, false)?;
    let halts = play.answer(&points.states)?.header.flags & flags::HALT_AFTER != 0;
    let expected = format_args!("HALT_AFTER beyond {:?}", play.budget);
    require(halts, expected, "forces without it")?;
    play.ends(true, 2)?;
    Ok("halts".into())
}

fn other_halts(bench: &Bench) -> Judgement {
    let mut play = Run::begun(bench)?;
    play.grant(1e-5, 5, true)?;
    play.exchange()?;
    play.exchange()?;
    play.halt_before()?;
    play.ends(true, 3)?;
    // The session goes on.
    play.step(1e-5)?;
    Ok("halted = 1, and goes on".into())
}
