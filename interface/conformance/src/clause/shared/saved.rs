//! Section 12: states that are saved and restored.

use interface::message::control::{Configure, Order, Party};
use interface::message::wire::{ImpForce, ImpState, StepHeader, flags};
use interface::transport::raw::{Message, Payload};

use super::run::Run;
use crate::bench::{Bench, ContinuumRun, Points, Reply, RunState, Shown, around_all, configure};
use crate::clause::Clause;
use crate::clause::dem::scene::{MASS, OVERLAP, RADIUS, SPHERO, STIFFNESS, elastic, frictional};
use crate::clause::dem::scene::{disc, one_disc, scene as bodies};
use crate::clause::mpm::scene::{DT, block, push, scene as continuum};
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, broken, require};

const SAVES: &[&str] = &["save"];
/// Steps before the state is saved, where nothing else is asked for.
const BEFORE: u64 = 20;
/// Steps that are compared.
const AFTER: u64 = 100;
/// Moments at which a state is saved: in the middle of an epoch, after a new set, at the beginning of an epoch that is
/// measured.
const MOMENTS: [Moment; 3] = [Moment::Midway, Moment::NewSet, Moment::Measured];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Moment {
    Midway,
    NewSet,
    Measured,
}

/// That a state is sent whole.
pub const SAVED: Clause = Clause::must(
    "K-3a",
    "sends its state before the report, in pieces with their hash",
    saves,
)
.after(&["S-6a"])
.needs(SAVES)
.mutant("sends another hash", || {
    pieces(|header, piece| {
        if header.flags & flags::LAST != 0 {
            piece[0] ^= 1;
        }
    })
});

/// That a run goes on from it, which rests on clauses that each side has by itself.
pub const fn resumed(after: &'static [&'static str]) -> Clause {
    Clause::must(
        "K-4a",
        "after a restore in a new process, continues with the same bits",
        resumes,
    )
    .after(after)
    .needs(SAVES)
    .mutant("starts from the beginning", begins_anew)
}

/// That it is looked at first; after the same, and K-4a.
pub const fn looked_at(after: &'static [&'static str]) -> Clause {
    Clause::must("K-4b", "refuses a state that is damaged", damaged)
        .after(after)
        .needs(SAVES)
        .mutant("corrects the hash of a damaged state", corrects_the_hash)
}

/// Changes the pieces of a saved state.
fn pieces(mut change: impl FnMut(&StepHeader, &mut Vec<u8>) + 'static) -> Flaw {
    Flaw::each(move |message| {
        if let Payload::Saved(piece) = &mut message.payload {
            change(&message.header, piece);
        }
    })
}

/// Configures as if there were nothing to restore, and counts steps from 0.
fn begins_anew() -> Flaw {
    let (first, known) = change::shared(None::<u64>);
    let back = move |step: &mut u64| *step -= known.get().unwrap_or(0).min(*step);
    let mut restoring = false;
    Flaw::passing(move |mut message| match &mut message.payload {
        Payload::Restore(_) => Vec::new(),
        Payload::Order(_) => match message.as_order() {
            Ok(Order::Configure(order)) => {
                restoring = order.restore;
                let order = Configure {
                    restore: false,
                    ..order
                };
                vec![Message::order(&Order::Configure(order))]
            }
            _ => vec![message],
        },
        Payload::Grant(grants) if restoring => {
            for grant in grants {
                first.set(first.get().or(Some(grant.first)));
                back(&mut grant.first);
            }
            vec![message]
        }
        _ => vec![message],
    })
}

/// Gives every state that comes the hash that it has.
fn corrects_the_hash() -> Flaw {
    let mut state = Vec::new();
    Flaw::each(move |message| {
        if let Payload::Restore(piece) = &mut message.payload {
            if message.header.flags & flags::LAST == 0 {
                state.extend_from_slice(piece);
            } else {
                *piece = blake3::hash(&state).as_bytes().to_vec();
            }
        }
    })
}

/// A configuration with a history: points that slide over a disc, or a block that is pressed and moves so fast that its set
/// becomes too old within the steps that are compared.
fn order(bench: &Bench) -> Configure {
    if bench.subject.party == Party::Mpm {
        return configure(&continuum(vec![block([0.3, 0.4], [2.0, -1.0])]));
    }
    let law = if bench.takes("feature:friction") {
        frictional(0.3 * STIFFNESS, 0.4)
    } else {
        elastic(STIFFNESS)
    };
    if bench.takes("motion:free") {
        configure(&bodies(vec![disc([0.0; 2])], law))
    } else {
        configure(&one_disc(bench))
    }
}

/// What a solver answered, bit by bit.
type Bits = Vec<u64>;

/// A run that is saved and goes on: the bodies' side against these points, or a continuum.
struct Course<'b> {
    run: Run<'b>,
    points: Points,
}

fn sliders() -> Points {
    let top = SPHERO + RADIUS - OVERLAP;
    Points::new()
        .with([0.0, top], [0.2, -0.1], RADIUS, MASS)
        .with([-0.5 * top, -0.9 * top], [0.1, 0.3], RADIUS, MASS)
}

fn press(_: &ContinuumRun, shown: &Shown) -> Vec<ImpForce> {
    let force = |(slot, state): (usize, &ImpState)| {
        if (slot as u64 + shown.step.index).is_multiple_of(7) {
            push([3.0 - 10.0 * state.position[0], 2.0], 1e3)
        } else {
            ImpForce::default()
        }
    };
    shown.states.iter().enumerate().map(force).collect()
}

fn bits_of(vectors: impl IntoIterator<Item = [f64; 2]>) -> impl Iterator<Item = u64> {
    vectors.into_iter().flatten().map(f64::to_bits)
}

impl<'b> Course<'b> {
    fn begun(bench: &'b Bench, order: &Configure) -> Result<Self, Unmet> {
        let (mut run, points) = (Run::from(bench.run_coupled(order)?), sliders());
        match &mut run {
            Run::Bodies(play) => {
                play.set(&points.set);
                play.step(0.0, &points.states)?;
            }
            Run::Continuum(flow) => {
                let config = serde_json::from_str(&order.config);
                flow.outlines = around_all(&config.expect("a configuration of the kit"));
                flow.step(0.0, press)?;
            }
        }
        Ok(Self { run, points })
    }

    /// Grants a step of [`DT`] with these flags besides, and does it.
    fn step(&mut self, more: u64, bits: &mut Bits) -> Result<(), Unmet> {
        let measure = more & flags::MEASURE != 0;
        let mut grant = self.run.next_grant(DT, 1, measure);
        grant.flags |= more;
        self.run.send_grants(&[grant])?;
        match &mut self.run {
            Run::Bodies(play) => {
                let answer = play.exchange(&self.points.states)?;
                bits.extend(bits_of(answer.forces.iter().map(|f| f.force)));
                bits.extend([answer.header.travel.to_bits(), answer.header.flags]);
                self.points.advance(&answer.step, &answer.forces);
            }
            Run::Continuum(flow) => {
                let shown = flow.states()?;
                let states = shown.states.iter();
                bits.extend(bits_of(states.flat_map(|s| [s.position, s.velocity])));
                bits.push(shown.header.set);
                flow.forces(&press(flow, &shown))?;
            }
        }
        let limits = self.run.report()?.report.limits;
        bits.extend([limits.contact_omega_sq, limits.speed].map(f64::to_bits));
        Ok(())
    }

    /// A step before which there is a new set.
    fn step_with_new_set(&mut self) -> Result<(), Unmet> {
        match &mut self.run {
            Run::Bodies(play) => play.set(&self.points.set),
            // So far that the set is too old (I-6).
            Run::Continuum(flow) => flow.travel = 1.0,
        }
        self.step(0, &mut Vec::new())?;
        if let Run::Continuum(flow) = &mut self.run {
            flow.travel = 0.0;
        }
        Ok(())
    }

    /// The run from where it was saved, in a fresh solver.
    fn resumed(&self, bench: &'b Bench, order: &Configure, saved: &Saved) -> Result<Self, Unmet> {
        let mut run = Run::from(bench.resumed(order, &saved.state, &saved.stand)?);
        if let (Run::Continuum(again), Run::Continuum(flow)) = (&mut run, &self.run) {
            again.outlines.clone_from(&flow.outlines);
        }
        let points = saved.points.clone();
        Ok(Self { run, points })
    }
}

/// A run up to the step before which its state is saved: the state, where the run stood, the points of the other side,
/// and what came of that step.
struct Saved {
    state: Vec<u8>,
    stand: RunState,
    points: Points,
    more: u64,
    bits: Bits,
}

fn save(course: &mut Course, moment: Moment) -> Result<Saved, Unmet> {
    for _ in 0..BEFORE {
        course.step(0, &mut Vec::new())?;
    }
    if moment == Moment::NewSet {
        course.step_with_new_set()?;
    }
    let (stand, points, mut bits) = (course.run.stand(), course.points.clone(), Vec::new());
    let more = if moment == Moment::Measured {
        flags::MEASURE
    } else {
        0
    };
    course.step(more | flags::CHECKPOINT, &mut bits)?;
    Ok(Saved {
        state: course.run.session.saved()?,
        stand,
        points,
        more,
        bits,
    })
}

fn saves(bench: &Bench) -> Judgement {
    let mut course = Course::begun(bench, &order(bench))?;
    let saved = save(&mut course, Moment::Midway)?;
    // Nothing may be sent without a request.
    course.step(0, &mut Vec::new())?;
    let more = course.run.session.saved();
    require(more.is_err(), "no state without CHECKPOINT", "one")?;
    Ok(format!("{} bytes", saved.state.len()))
}

fn resumes(bench: &Bench) -> Judgement {
    let order = order(bench);
    for moment in MOMENTS {
        let mut course = Course::begun(bench, &order)?;
        let saved = save(&mut course, moment)?;
        let mut again = course.resumed(bench, &order, &saved)?;
        let (mut bits, mut same) = (saved.bits, Vec::new());
        again.step(saved.more, &mut same)?;
        for _ in 0..AFTER {
            course.step(0, &mut bits)?;
            again.step(0, &mut same)?;
        }
        let differs = bits.iter().zip(&same).position(|(a, b)| a != b);
        require(
            differs.is_none() && bits.len() == same.len(),
            format_args!("the bits of the run that went on ({moment:?})"),
            match differs {
                Some(place) => format!("another number at place {place} of {}", bits.len()),
                None => format!("{} numbers in place of {}", same.len(), bits.len()),
            },
        )?;
    }
    Ok(format!("{AFTER} steps, {} moments", MOMENTS.len()))
}

fn damaged(bench: &Bench) -> Judgement {
    let order = order(bench);
    let saved = save(&mut Course::begun(bench, &order)?, Moment::Midway)?;
    let mut session = bench.greeted()?;
    let reply = session.restore(&order, &saved.state, |hash| hash[5] ^= 0x10);
    match reply {
        Err(_) | Ok(Reply::Refused(_)) => Ok("refused".into()),
        Ok(Reply::Ready(_)) => Err(broken("a refusal of the damaged state", "Ready")),
    }
}
