//! Sections 5 and 8: limits and halting, as far as they are the same for both sides.

use interface::message::wire::{Budget, Limits, flags};

use super::run::{led, order};
use crate::bench::{Bench, Run, configure};
use crate::clause::dem::halt::lively;
use crate::clause::dem::scene::{MASS, STIFFNESS};
use crate::clause::mpm::scene::{MASS as POINT, push, single};
use crate::clause::{Clause, clauses};
use crate::verdict::{Judgement, Unmet, broken, require};
use interface::config::MpmConfig;
use interface::message::control::Party;

pub const CLAUSES: &[Clause] = clauses! {
    Should "L-2b" "contact_omega_sq is at most four times that" by tight, needs: &["motion:free"];
    Must "L-5a" "does not halt on the last step of a window" by last_step, needs: &["motion:free"];
    Must "H-5a" "a halt changes no bit of the later steps" by halt_is_free, needs: &["motion:free"];
};

/// Less than what moves in these clauses.
const SLOW: Budget = Budget {
    speed: 0.05,
    ..Budget::UNLIMITED
};
const DT: f64 = 1e-4;

/// A run in which something moves, with these budgets.
fn moving(bench: &Bench, budget: Budget) -> Result<Run<'_>, Unmet> {
    let order = match bench.subject.party {
        Party::Mpm => configure(&MpmConfig {
            gravity: [1.0, -9.0],
            ..single([0.8, 0.3])
        }),
        _ => configure(&lively(bench)),
    };
    let mut run = led(bench, &order)?;
    run.budget = budget;
    Ok(run)
}

/// A budget for the square of a frequency beyond which only the sum of these limits is (L-3), where one is not far above the other.
pub fn below_the_sum(limits: &Limits) -> f64 {
    0.9 * (limits.omega_sq + limits.contact_omega_sq)
}

fn tight(bench: &Bench) -> Judgement {
    let mut run = led(bench, &order(bench))?;
    run.grant(DT, 1, true)?;
    let exact = if run.session.is_of_bodies() {
        run.exchange()?;
        // Two points press the disc.
        2.0 * STIFFNESS / MASS
    } else {
        run.states()?;
        run.press(&[push([0.0; 2], STIFFNESS)])?;
        STIFFNESS / POINT
    };
    let got = run.report()?.report.limits.contact_omega_sq;
    let expected = format_args!("at most four times {exact:.3e} 1/s^2");
    require(got <= 4.0 * exact, expected, format_args!("{got:.3e}"))?;
    Ok(format!("{:.3} of the stiffness by the mass", got / exact))
}

fn last_step(bench: &Bench) -> Judgement {
    let mut run = moving(bench, SLOW)?;
    for next in 1..4 {
        run.grant(DT, 1, false)?;
        run.exchange()?;
        run.ends(false, next)?;
    }
    Ok("3 windows of 1".into())
}

fn halt_is_free(bench: &Bench) -> Judgement {
    let (plain, _) = six_steps(bench, Budget::UNLIMITED)?;
    let (halting, halts) = six_steps(bench, SLOW)?;
    if let Some(step) = plain.iter().zip(&halting).position(|(a, b)| a != b) {
        let [a, b] = [&plain[step], &halting[step]].map(|numbers| format!("{numbers:?}"));
        return Err(broken(a, b).at(step as u64));
    }
    Ok(format!("the same bits in 6 steps with {halts} halts"))
}

/// What the solver answers in each of six steps, and how often it halts.
fn six_steps(bench: &Bench, budget: Budget) -> Result<(Vec<Vec<f64>>, u64), Unmet> {
    let mut run = moving(bench, budget)?;
    let (mut answers, mut halts) = (Vec::new(), 0);
    while run.next() < 6 {
        // Within an epoch the same time is start + n dt; every step begins one here, as after a halt.
        run.begin_epoch(DT);
        let steps = if budget == SLOW { 6 - run.next() } else { 1 };
        run.grant(DT, steps, false)?;
        let end = run.next() + steps;
        while run.next() < end {
            let Some((flags, numbers)) = run.exchange_or_halt()? else {
                break;
            };
            answers.push(numbers);
            if flags & flags::HALT_AFTER != 0 {
                break;
            }
        }
        halts += run.report()?.report.halted;
    }
    Ok((answers, halts))
}
