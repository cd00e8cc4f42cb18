//! The steps of a case of bodies: the kit is the points.

use interface::Vec2;
use interface::message::wire::{ImpInfo, Limits};

use super::super::judge::Judge;
use super::super::run::{Stop, Window, report};
use super::admit;
use super::case::Case;
use super::oracle::{BLUR, Expected, Oracle};
use crate::bench::{Answer, Run, at_least};

/// Where a run stands.
#[derive(Clone)]
pub struct Stand {
    pub(super) oracle: Oracle,
    step: u32,
    before: Option<Vec<Vec2>>,
    /// What the last step of the window before was expected to give, with the limits that were said after it.
    limits: Option<(Expected, Limits)>,
    /// The longest step so far in s.
    longest: f64,
}

impl Stand {
    /// At the start.
    pub fn new(case: &Case) -> Self {
        Self {
            oracle: Oracle::new(&case.config),
            step: 0,
            before: None,
            limits: None,
            longest: 0.0,
        }
    }
}

/// A step that was answered.
struct Answered {
    set: Vec<ImpInfo>,
    answer: Answer,
    expected: Expected,
    /// Whether time has gone by since the step before.
    moves: bool,
}

/// A step: its exchange, and what the oracle expects of it. It is the `first` of its window or not.
fn stepped(
    play: &mut Run,
    case: &Case,
    stand: &mut Stand,
    (window, first): (Window, bool),
    judge: &mut Judge,
) -> Result<Answered, Stop> {
    let step = stand.step;
    judge.step = step;
    if first && window.outlines {
        let own = play.header();
        let (header, vertices) = play.envelopes()?;
        let said = [header.step, header.epoch, header.count];
        let want = [own.step, own.epoch, vertices.len() as u64];
        judge.same("E-1", "step, epoch and count of envelopes", said, want)?;
        judge.envelopes(&stand.oracle, &vertices)?;
        stand.oracle.publish();
    }
    let now = case.positions(step, &stand.oracle);
    let granted = play.coming(first && window.measured);
    let before = stand
        .before
        .as_deref()
        .map(|before| (before, granted.dt_before));
    let states = case.states(step, &now, before);
    let set = case.set(step);
    if step == 0 || play.imps() != set {
        play.set(&set);
    }
    let own = play.header();
    let answer = play.answer(&states)?;
    let header = answer.header;
    let (said, want) = ([header.step, header.epoch], [own.step, own.epoch]);
    judge.same("F-2", "step and epoch of forces", said, want)?;
    let generation = play.generation();
    let (said, want) = ([header.set, header.count], [generation, set.len() as u64]);
    judge.same("F-3", "set and count of forces", said, want)?;
    let numbers = answer
        .forces
        .iter()
        .flat_map(|f| [f.force[0], f.force[1], f.stiffness]);
    judge.keep(numbers.chain([answer.header.travel]));
    let expected = stand.oracle.step(&granted, &set, &states);
    if expected.doubtful.is_some() {
        return Err(Stop::Doubtful);
    }
    stand.before = Some(now);
    stand.step += 1;
    let moves = granted.dt_before > 0.0;
    Ok(Answered {
        set,
        answer,
        expected,
        moves,
    })
}

/// The steps of a grant, and the report on it.
pub fn window_of(
    play: &mut Run,
    case: &Case,
    stand: &mut Stand,
    window: Window,
    judge: &mut Judge,
) -> Result<(), Stop> {
    let (first, number) = (stand.step, play.next());
    let smallest = admit::smallest(case);
    stand.longest = stand.longest.max(window.dt);
    let longest = stand.longest;
    let mut answered = Vec::new();
    for k in 0..window.steps {
        answered.push(stepped(play, case, stand, (window, k == 0), judge)?);
    }
    let report = report(play, number, window, judge)?;
    let count = case.config.bodies.len();
    let dt = if longest > 0.0 { longest } else { 1.0 };
    // In the order in which one thing causes another, so that the first difference is the cause.
    for (
        k,
        Answered {
            set,
            answer,
            expected,
            moves,
        },
    ) in answered.iter().enumerate()
    {
        judge.step = first + k as u32;
        let measured = window.measured && k == 0;
        if measured {
            judge.poses(
                expected,
                at_least(report.bodies.as_ref(), count, "bodies")?,
                BLUR * smallest,
            )?;
        }
        judge.forces(expected, set, &answer.forces)?;
        judge.travel(expected, answer.header.travel)?;
        if let Some((before, limits)) = stand.limits.take() {
            judge.limits(
                &limits,
                &before,
                moves.then_some(expected),
                (smallest / dt, dt),
            )?;
        }
        if measured {
            judge.bodies(
                expected,
                at_least(report.bodies.as_ref(), count, "bodies")?,
                (BLUR * smallest, longest),
            )?;
            judge.ledger(expected, &report.report.ledger, admit::typical(case))?;
            if let Some((_, contacts)) = &report.contacts {
                judge.contacts(expected, contacts)?;
            }
        }
    }
    let last = answered.pop().map(|answered| answered.expected);
    stand.limits = last.map(|last| (last, report.report.limits));
    Ok(())
}
