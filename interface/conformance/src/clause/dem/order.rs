//! Sections 1, 4, 5 and 6: messages of a step. What is out of order is refused, what goes out is in order.

use std::time::Duration;

use interface::message::Kind;
use interface::message::wire::flags;

use super::scene::{one_disc, points, pressed};
use crate::bench::{Answer, Bench, Points, Run};
use crate::clause::{Clause, clauses};
use crate::flaw::Flaw;
use crate::verdict::{Judgement, Unmet, near, require};

pub const CLAUSES: &[Clause] = clauses! {
    Must "I-1a" "refuses states of another step" refuses Flaw::states(|h, _| h.step += 1);
    Must "I-1b" "refuses states of another epoch" refuses Flaw::states(|h, _| h.epoch += 1);
    Must "I-2a" "refuses a set whose ids do not increase" refuses Flaw::set(|_, set| set[1].id = 0);
    Must "I-2b" "refuses a point without radius" refuses Flaw::info(|info| info.radius = 0.0);
    Must "I-2c" "refuses a point without mass" refuses Flaw::info(|info| info.mass = 0.0);
    Must "I-2d" "refuses a set whose count is not its number" refuses Flaw::set(|h, _| h.count = 3);
    Must "I-2e" "refuses a generation that skips one"
        refuses Flaw::set(|h, _| h.set += 1).with(Flaw::states(|h, _| h.set += 1));
    Must "I-2f" "refuses an announced set that was not sent" refuses without_set(flags::NEW_SET);
    Must "I-3a" "refuses states of another generation" refuses without_set(0);
    Must "I-3b" "refuses fewer states than the set has points"
        refuses Flaw::states(|h, states| { states.pop(); h.count = states.len() as u64; });
    Must "I-3c" "refuses a position that is NaN" refuses Flaw::state(|state| state.position[1] = f64::NAN);
    Must "I-3d" "refuses a velocity that is infinite" refuses Flaw::state(|state| state.velocity[0] = f64::INFINITY);
    Must "W-2a" "ignores fields that a message does not use" by unused;
    Must "G-9a" "answers the states of a step once, also with no points" by once;
    Must "C-1a" "accepts any number of points: none, and one more than fit" by numbers;
};

/// Sends no set, although states have its number and these flags.
fn without_set(flags: u64) -> Flaw {
    Flaw::passing(move |mut message| match message.kind() {
        Kind::Set => Vec::new(),
        Kind::States => {
            message.header.flags = flags;
            vec![message]
        }
        _ => vec![message],
    })
}

fn unused(bench: &Bench) -> Judgement {
    let answer = |flaw: Option<Flaw>| -> Result<Answer, Unmet> {
        let (mut play, points) = (bench.run_bodies(&one_disc(bench))?, pressed());
        play.session.flaw = flaw;
        play.set(&points.set);
        Ok(play.measured(0.0, &points.states)?.0)
    };
    let odd = Flaw::set(|header, set| (header.travel, set[0].next) = (1.0, 7));
    let odd = odd.with(Flaw::states(|header, _| header.travel = 2.0));
    let (plain, odd) = (answer(None)?, answer(Some(odd))?);
    for (plain, odd) in plain.forces.iter().zip(&odd.forces) {
        for i in 0..2 {
            near("force", odd.force[i], plain.force[i], 1e-9)?;
        }
    }
    Ok("reserved and unused fields change nothing".into())
}

fn once(bench: &Bench) -> Judgement {
    let mut play = Run::begun(bench)?;
    for points in [pressed(), Points::default()] {
        play.place(points);
        play.step(1e-5)?;
        let again = play
            .session
            .unexpected(Kind::Forces, Duration::from_millis(20))?;
        require(
            again.is_none(),
            "one answer",
            format_args!("also {again:?}"),
        )?;
    }
    Ok("one answer each to 2 points and to none".into())
}

fn numbers(bench: &Bench) -> Judgement {
    let mut play = Run::begun(bench)?;
    // A channel begins with room for 64 records.
    let counts = [0, 1, 63, 64, 65, 10_000, 1];
    for count in counts {
        let row = (0..count).map(|k| [0.05 + 1e-4 * f64::from(k), 0.0]);
        play.place(points(row));
        play.step(1e-6)?;
    }
    Ok(format!("{counts:?}"))
}
