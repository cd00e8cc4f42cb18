//! Sections 1, 4, 5 and 6: messages of a step. What is out of order is refused, what goes out is in order.

use std::time::Duration;

use interface::message::wire::flags;
use interface::transport::raw::{Kind, Message, Payload};

use super::scene::{RADIUS, one_disc, pressed};
use crate::bench::{Answer, Bench, Points, Run};
use crate::clause::{Clause, clauses};
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, near, require};

pub const CLAUSES: &[Clause] = clauses! {
    Must "I-1a" "refuses states of another step" refuses Flaw::states(|h, _| h.step += 1);
        - "does not look at the step of states": change::header(Kind::States, |h, now| h.step = now.step);
    Must "I-1b" "refuses states of another epoch" refuses Flaw::states(|h, _| h.epoch += 1);
        - "does not look at the epoch of states": change::header(Kind::States, |h, now| h.epoch = now.grant.epoch);
    Must "I-2a" "refuses a set whose ids do not increase" refuses Flaw::set(|_, set| set[1].id = 0);
        - "accepts ids in any order": Flaw::set(|_, set| {
            if set.windows(2).any(|pair| pair[0].id >= pair[1].id) {
                (0..).zip(set).for_each(|(k, info)| info.id = k);
            }
        });
    Must "I-2b" "refuses a point without radius" refuses Flaw::info(|info| info.radius = 0.0);
        - "accepts a point without radius": Flaw::info(|info| info.radius = info.radius.max(1e-6));
    Must "I-2c" "refuses a point without mass" refuses Flaw::info(|info| info.mass = 0.0);
        - "accepts a point without mass": Flaw::info(|info| info.mass = info.mass.max(1e-6));
    Must "I-2d" "refuses a set whose count is not its number" refuses Flaw::set(|h, _| h.count = 3);
        - "does not look at the count of a set": Flaw::set(|header, set| header.count = set.len() as u64);
    Must "I-2e" "refuses a generation that skips one"
        refuses Flaw::set(|h, _| h.set += 1).with(Flaw::states(|h, _| h.set += 1));
        - "accepts any generation": change::in_step(|message, now| {
            let announced = message.kind() == Kind::Set || message.header.flags & flags::NEW_SET != 0;
            if announced {
                message.header.set = now.set.min(message.header.set);
            }
        });
    Must "I-2f" "refuses an announced set that was not sent" refuses without_set(flags::NEW_SET);
        - "continues with the old set when a new one is missing": change::header(Kind::States, |h, now| {
            if h.flags == flags::NEW_SET && h.set == now.set + 1 {
                (h.flags, h.set) = (0, now.set);
            }
        });
    Must "I-3a" "refuses states of another generation" refuses without_set(0);
        - "does not look at the generation of states": change::header(Kind::States, |h, now| {
            h.set = if h.flags == 0 { now.set } else { h.set };
        });
    Must "I-3b" "refuses fewer states than the set has points"
        refuses Flaw::states(|h, states| { states.pop(); h.count = states.len() as u64; });
        - "adds missing states": change::in_step(|message, now| {
            if let Payload::States(states) = &mut message.payload
                && let Some(&last) = states.last()
            {
                states.resize(now.points, last);
                message.header.count = now.points as u64;
            }
        });
    Must "I-3c" "refuses a position that is NaN" refuses Flaw::state(|state| state.position[1] = f64::NAN);
        - "uses 0 for a position that is NaN":
            Flaw::state(|s| s.position = s.position.map(|x| if x.is_nan() { 0.0 } else { x }));
    Must "I-3d" "refuses a velocity that is infinite" refuses Flaw::state(|state| state.velocity[0] = f64::INFINITY);
        - "uses 0 for a velocity that is infinite":
            Flaw::state(|s| s.velocity = s.velocity.map(|v| if v.is_infinite() { 0.0 } else { v }));
    Must "W-2a" "ignores fields that a message does not use" by unused;
        - "reads a reserved field": {
            let (seen, used) = change::shared(false);
            let flaw = Flaw::set(move |_, set| seen.set(set.iter().any(|info| info.next != 0)));
            flaw.with(Flaw::forces(move |_, forces| {
                if used.get() {
                    change::scale(forces, 2.0);
                }
            }))
        };
    Must "G-9a" "answers the states of a step once, also with no points" by once;
        - "answers twice": change::twice(|message| message.kind() == Kind::Forces);
    Must "B-3a" "finds states although nobody woke it" by unwoken;
        - "looks for states only when woken": Flaw::process(|m| m.waits_to_be_woken = true);
    Should "B-2a" "wakes the receiver of what it sends" by wakes;
        - "wakes nobody": Flaw::process(|m| m.wakes_nobody = true);
    Must "C-1a" "accepts any number of points: none, and one more than fit" by numbers;
        - "answers 4096 points at most":
            Flaw::forces(|header, forces| { forces.truncate(4096); header.count = forces.len() as u64; });
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
    let answer = |said: Option<Flaw>| -> Result<Answer, Unmet> {
        let (mut play, points) = (bench.run_bodies(&one_disc(bench))?, pressed());
        play.session.flaw = said;
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
    for points in [pressed(), Points::new()] {
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

fn unwoken(bench: &Bench) -> Judgement {
    let (mut play, points) = (Run::begun(bench)?, pressed());
    play.grant(1e-5, 4, false)?;
    let mut longest = Duration::ZERO;
    for _ in 0..4 {
        // Long enough for a solver that spins first to be asleep.
        play.session.solver.leave_alone(Duration::from_millis(2));
        let start = play.session.solver.elapsed();
        let states = Message::new(play.header(), Payload::States(points.states.clone()));
        play.session.send_silently(&states)?;
        play.forces()?;
        longest = longest.max(play.session.solver.since(start));
    }
    // Two sleeps of 10 ms, and a large margin for a busy machine.
    let limit = Duration::from_millis(500);
    let expected = format_args!("an answer within {limit:?}");
    require(longest < limit, expected, format_args!("{longest:?}"))?;
    Ok(format!("after {longest:.1?} at most"))
}

fn wakes(bench: &Bench) -> Judgement {
    let (mut play, points) = (Run::begun(bench)?, pressed());
    play.grant(1e-5, 1, false)?;
    // Earlier wake-ups are consumed.
    for kind in [Kind::Forces, Kind::Report] {
        play.session.solver.sleep(kind, Duration::ZERO);
    }
    play.send_states(&points.states)?;
    for kind in [Kind::Forces, Kind::Report] {
        let woken = play.session.solver.sleep(kind, Duration::from_millis(500));
        let expected = format_args!("a wake-up with {kind:?}");
        require(woken > 0, expected, "none within 0.5 s")?;
    }
    play.forces()?;
    play.report()?;
    Ok("after forces and report".into())
}

fn numbers(bench: &Bench) -> Judgement {
    let mut play = Run::begun(bench)?;
    // A channel begins with room for 64 records.
    let counts = [0, 1, 63, 64, 65, 10_000, 1];
    for count in counts {
        let mut points = Points::new();
        for k in 0..count {
            let x = 0.05 + 1e-4 * f64::from(k);
            points = points.with([x, 0.0], [0.0; 2], RADIUS, 0.5);
        }
        play.place(points);
        play.step(1e-6)?;
    }
    Ok(format!("{counts:?}"))
}
