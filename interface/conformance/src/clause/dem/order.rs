//! Sections 1, 4, 5 and 6: messages of a step. What is out of order is refused, what goes out is in order.

use std::time::{Duration, Instant};

use interface::message::wire::{StepHeader, flags};
use interface::transport::raw::{Kind, Message, Payload};

use super::scene::{RADIUS, SPHERO, one_disc};
use crate::bench::{Answer, Bench, BodiesRun, Points};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, broken, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must("I-1a", "refuses states of another step", |bench| {
        refuses(bench, |_, states| states.header.step += 1)
    })
    .mutant("does not look at the step of states", || {
        change::in_step(|message, now| {
            if message.kind() == Kind::States {
                message.header.step = now.step;
            }
        })
    }),
    Clause::must("I-1b", "refuses states of another epoch", |bench| {
        refuses(bench, |_, states| states.header.epoch += 1)
    })
    .mutant("does not look at the epoch of states", || {
        change::in_step(|message, now| {
            if message.kind() == Kind::States {
                message.header.epoch = now.epoch;
            }
        })
    }),
    Clause::must("I-2a", "refuses a set whose ids do not increase", |bench| {
        refuses(bench, |set, _| set_of(set)[1].id = 0)
    })
    .mutant("accepts ids in any order", || {
        change::sets(|set| {
            if set.windows(2).any(|pair| pair[0].id >= pair[1].id) {
                (0..).zip(set).for_each(|(k, info)| info.id = k);
            }
        })
    }),
    Clause::must("I-2b", "refuses a point without radius", |bench| {
        refuses(bench, |set, _| set_of(set)[1].radius = 0.0)
    })
    .mutant("accepts a point without radius", || {
        change::sets(|set| {
            set.iter_mut()
                .for_each(|info| info.radius = info.radius.max(1e-6));
        })
    }),
    Clause::must("I-2c", "refuses a point without mass", |bench| {
        refuses(bench, |set, _| set_of(set)[1].mass = 0.0)
    })
    .mutant("accepts a point without mass", || {
        change::sets(|set| {
            set.iter_mut()
                .for_each(|info| info.mass = info.mass.max(1e-6));
        })
    }),
    Clause::must(
        "I-2d",
        "refuses a set whose count is not its number",
        |bench| refuses(bench, |set, _| set.header.count = 3),
    )
    .mutant("does not look at the count of a set", || {
        Flaw::set(|header, set| header.count = set.len() as u64)
    }),
    Clause::must("I-2e", "refuses a generation that skips one", |bench| {
        refuses(bench, |set, states| {
            set.header.set += 1;
            states.header.set += 1;
        })
    })
    .mutant("accepts any generation", || {
        let mut generation = 0;
        Flaw::inbound(move |mut message| {
            match message.kind() {
                Kind::Set => {
                    generation += 1;
                    message.header.set = generation;
                }
                // The set was there before its states.
                Kind::States if message.header.set > generation && generation > 0 => {
                    let announced = message.header.flags & flags::NEW_SET != 0;
                    message.header.set = if announced {
                        generation
                    } else {
                        message.header.set
                    };
                }
                _ => {}
            }
            vec![message]
        })
    }),
    Clause::must("I-2f", "refuses an announced set that was not sent", no_set).mutant(
        "continues with the old set when a new one is missing",
        || {
            let mut sets = 0;
            Flaw::inbound(move |mut message| {
                match message.kind() {
                    Kind::Set => sets += 1,
                    Kind::States
                        if message.header.set == sets + 1
                            && message.header.flags == flags::NEW_SET =>
                    {
                        message.header.flags = 0;
                        message.header.set = sets;
                    }
                    _ => {}
                }
                vec![message]
            })
        },
    ),
    Clause::must(
        "I-3a",
        "refuses states of another generation",
        other_generation,
    )
    .mutant("does not look at the generation of states", || {
        let mut sets = 0;
        Flaw::inbound(move |mut message| {
            match message.kind() {
                Kind::Set => sets += 1,
                Kind::States if message.header.flags == 0 => message.header.set = sets,
                _ => {}
            }
            vec![message]
        })
    }),
    Clause::must(
        "I-3b",
        "refuses fewer states than the set has points",
        |bench| {
            refuses(bench, |_, states| {
                states_of(states).pop();
                states.header.count = 1;
            })
        },
    )
    .mutant("adds missing states", || {
        let mut points = 0;
        Flaw::inbound(move |mut message| {
            match &mut message.payload {
                Payload::Set(set) => points = set.len(),
                Payload::States(states) if !states.is_empty() && states.len() < points => {
                    let last = *states.last().expect("there is one");
                    states.resize(points, last);
                    message.header.count = points as u64;
                }
                _ => {}
            }
            vec![message]
        })
    }),
    Clause::must("I-3c", "refuses a position that is NaN", |bench| {
        refuses(bench, |_, states| {
            states_of(states)[1].position[1] = f64::NAN;
        })
    })
    .mutant("uses 0 for a position that is NaN", || {
        Flaw::states(|_, states| {
            for x in states.iter_mut().flat_map(|s| &mut s.position) {
                *x = if x.is_nan() { 0.0 } else { *x };
            }
        })
    }),
    Clause::must("I-3d", "refuses a velocity that is infinite", |bench| {
        refuses(bench, |_, states| {
            states_of(states)[0].velocity[0] = f64::INFINITY;
        })
    })
    .mutant("uses 0 for a velocity that is infinite", || {
        Flaw::states(|_, states| {
            for v in states.iter_mut().flat_map(|s| &mut s.velocity) {
                *v = if v.is_infinite() { 0.0 } else { *v };
            }
        })
    }),
    Clause::must("W-2a", "ignores fields that a message does not use", unused).mutant(
        "reads a reserved field",
        || {
            let (seen, used) = change::shared(false);
            let flaw = change::sets(move |set| seen.set(set.iter().any(|info| info.next != 0)));
            flaw.with(Flaw::forces(move |_, forces| {
                if used.get() {
                    change::scale(forces, 2.0);
                }
            }))
        },
    ),
    Clause::must(
        "G-9a",
        "answers the states of a step once, also with no points",
        once,
    )
    .mutant("answers twice", || {
        Flaw::outbound(|message| match message.kind() {
            Kind::Forces => vec![message.clone(), message],
            _ => vec![message],
        })
    }),
    Clause::must("B-3a", "finds states although nobody woke it", unwoken)
        .mutant("looks for states only when woken", || {
            Flaw::process(|m| m.waits_to_be_woken = true)
        }),
    Clause::should("B-2a", "wakes the receiver of what it sends", wakes)
        .mutant("wakes nobody", || Flaw::process(|m| m.wakes_nobody = true)),
    Clause::must(
        "C-1a",
        "accepts any number of points: none, and one more than fit",
        numbers,
    )
    .mutant("answers 4096 points at most", || {
        Flaw::forces(|header, forces| {
            forces.truncate(4096);
            header.count = forces.len() as u64;
        })
    }),
];

/// A disc at the origin, pressed by two points from the right and from the left.
pub fn pressed() -> Points {
    let x = SPHERO + 0.9 * RADIUS;
    Points::new()
        .with([x, 0.0], [0.0; 2], RADIUS, 0.5)
        .with([-x, 0.0], [0.0; 2], RADIUS, 0.5)
}

fn begun(bench: &Bench) -> Result<BodiesRun<'_>, Unmet> {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    let points = pressed();
    play.set(&points.set);
    play.step(0.0, &points.states)?;
    Ok(play)
}

/// Sends a set and states after `change` in step 1; the solver shall say Failed and no forces.
fn refuses(bench: &Bench, change: impl FnOnce(&mut Message, &mut Message)) -> Judgement {
    let mut play = begun(bench)?;
    play.grant(1e-4, 1, false)?;
    play.send_changed(&pressed(), change)?;
    let failure = play.session.failure()?;
    while let Some(forces) = play.session.take(Kind::Forces)? {
        let got = format_args!("forces, then {}", failure.message);
        require(forces.header.step < 1, "no forces", got)?;
    }
    Ok(failure.message)
}

/// Changes the records of a set.
fn set_of(message: &mut Message) -> &mut Vec<interface::message::wire::ImpInfo> {
    match &mut message.payload {
        Payload::Set(set) => set,
        _ => unreachable!("a set is one"),
    }
}

/// Changes the records of states.
fn states_of(message: &mut Message) -> &mut Vec<interface::message::wire::ImpState> {
    match &mut message.payload {
        Payload::States(states) => states,
        _ => unreachable!("states are states"),
    }
}

fn no_set(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    play.grant(1e-4, 1, false)?;
    let header = StepHeader {
        flags: flags::NEW_SET,
        set: 2,
        ..play.header()
    };
    let states = Payload::States(pressed().states);
    play.session.send(&Message::new(header, states))?;
    Ok(play.session.failure()?.message)
}

fn other_generation(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    play.grant(1e-4, 1, false)?;
    let header = StepHeader {
        set: 2,
        ..play.header()
    };
    let states = Payload::States(pressed().states);
    play.session.send(&Message::new(header, states))?;
    Ok(play.session.failure()?.message)
}

fn unused(bench: &Bench) -> Judgement {
    let points = pressed();
    let answer = |change: fn(&mut Message, &mut Message)| -> Result<Answer, Unmet> {
        let mut play = bench.run_bodies(&one_disc(bench))?;
        play.grant(0.0, 1, false)?;
        play.send_changed(&points, change)?;
        play.set(&points.set);
        play.forces()
    };
    let plain = answer(|_, _| ())?;
    let odd = answer(|set, states| {
        set.header.travel = 1.0;
        states.header.travel = 2.0;
        set_of(set)[0].next = 7;
    })?;
    for (plain, odd) in plain.forces.iter().zip(&odd.forces) {
        for i in 0..2 {
            near("force", odd.force[i], plain.force[i], 1e-9)?;
        }
    }
    Ok("reserved and unused fields change nothing".into())
}

fn once(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    for points in [pressed(), Points::new()] {
        play.set(&points.set);
        play.step(1e-5, &points.states)?;
        if let Some(again) = play
            .session
            .unexpected(Kind::Forces, Duration::from_millis(20))?
        {
            let got = format_args!("a second answer to step {}", again.header.step);
            return Err(broken("one answer", got));
        }
    }
    Ok("one answer each to 2 points and to none".into())
}

fn unwoken(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    let points = pressed();
    play.grant(1e-5, 4, false)?;
    let mut longest = Duration::ZERO;
    for _ in 0..4 {
        // Long enough for a solver that spins first to be asleep.
        interface::transport::wait::nap(Duration::from_millis(2));
        let start = Instant::now();
        let states = Message::new(play.header(), Payload::States(points.states.clone()));
        play.session.send_silently(&states)?;
        play.forces()?;
        longest = longest.max(start.elapsed());
    }
    // Two sleeps of 10 ms, and a large margin for a busy machine.
    let limit = Duration::from_millis(500);
    require(
        longest < limit,
        format_args!("an answer within {limit:?}"),
        format_args!("{longest:?}"),
    )?;
    Ok(format!(
        "after {:.1} ms at most",
        longest.as_secs_f64() * 1e3
    ))
}

fn wakes(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    let points = pressed();
    play.grant(1e-5, 1, false)?;
    // Earlier wake-ups are consumed.
    for kind in [Kind::Forces, Kind::Report] {
        play.session.raw_run.sleep(kind, Duration::ZERO);
    }
    play.send_states(&points.states)?;
    for kind in [Kind::Forces, Kind::Report] {
        let woken = play.session.raw_run.sleep(kind, Duration::from_millis(500));
        require(
            woken > 0,
            format_args!("a wake-up with {kind:?}"),
            "none within 0.5 s",
        )?;
    }
    play.forces()?;
    play.report()?;
    Ok("after forces and report".into())
}

fn numbers(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    // A channel begins with room for 64 records.
    let counts = [0, 1, 63, 64, 65, 10_000, 1];
    for count in counts {
        let points = (0..count).fold(Points::new(), |points, k| {
            points.with([0.05 + 1e-4 * f64::from(k), 0.0], [0.0; 2], RADIUS, 0.5)
        });
        play.set(&points.set);
        play.grant(1e-6, 1, false)?;
        play.exchange(&points.states)?;
        play.report()?;
    }
    Ok(format!("{counts:?}"))
}
