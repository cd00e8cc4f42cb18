//! A case run: the kit is the coupler and the points, and compares every answer with the oracle.

use std::time::Duration;

use interface::Vec2;
use interface::message::wire::{ImpInfo, flags};
use interface::solver::Refusal;

use super::admit;
use super::case::Case;
use super::compare::{CLAUSES, Compared, Difference, Judge};
use super::oracle::{BLUR, Expected, Oracle};
use crate::bench::{Answer, Bench, BodiesRun, configure};
use crate::verdict::{Evidence, Unmet};

/// How a case ended.
#[derive(Debug)]
pub enum Outcome {
    /// Nothing differed.
    Same,
    /// Something did.
    Differs(Difference),
    /// The solver refused the configuration.
    Refused(Refusal),
}

/// Where a run stands.
struct Stand {
    oracle: Oracle,
    step: u32,
    before: Option<Vec<Vec2>>,
    /// What the last step of the window before was expected to give, with the limits that were said after it.
    limits: Option<(Expected, interface::message::wire::Limits)>,
    doubtful: bool,
}

/// Runs a case, of which `compared` takes note.
pub fn run(
    bench: &Bench,
    case: &Case,
    asked: &[&str],
    compared: &mut [Compared; CLAUSES.len()],
) -> Outcome {
    let mut judge = Judge {
        asked,
        compared,
        step: 0,
    };
    match steps(bench, case, &mut judge) {
        Ok(()) => Outcome::Same,
        Err(Stop::Differs(difference)) => Outcome::Differs(*difference),
        Err(Stop::Unmet(Unmet::Declined(refusal))) => Outcome::Refused(refusal),
        Err(Stop::Unmet(Unmet::Lacking(names))) => {
            Outcome::Refused(Refusal::new("capabilities", names.join(", ")))
        }
        Err(Stop::Unmet(unmet)) => Outcome::Differs(not_answered(unmet, judge.step)),
    }
}

/// A run that does not go on.
enum Stop {
    Differs(Box<Difference>),
    Unmet(Unmet),
}

impl From<Unmet> for Stop {
    fn from(unmet: Unmet) -> Self {
        Self::Unmet(unmet)
    }
}

impl From<Box<Difference>> for Stop {
    fn from(difference: Box<Difference>) -> Self {
        Self::Differs(difference)
    }
}

fn not_answered(unmet: Unmet, step: u32) -> Difference {
    let (expected, got) = match unmet {
        Unmet::Broken(Evidence { expected, got, .. }) => (expected, got),
        other => ("an answer".to_owned(), format!("{other:?}")),
    };
    Difference {
        clause: "T-1",
        step,
        what: "answer".into(),
        expected,
        got,
    }
}

fn steps(bench: &Bench, case: &Case, judge: &mut Judge) -> Result<(), Stop> {
    let mut play = bench.run_bodies(&case.config)?;
    let mut stand = Stand {
        oracle: Oracle::new(&case.config),
        step: 0,
        before: None,
        limits: None,
        doubtful: false,
    };
    let smallest = admit::smallest(case);
    let mut longest = 0.0_f64;
    for epoch in &case.epochs {
        longest = longest.max(epoch.dt);
        for (k, &window) in epoch.windows.iter().enumerate() {
            let first = k == 0;
            let saves = first && epoch.resumed;
            let from = saves.then(|| (play.stand(), stand.copy()));
            let mut grant = play.next_grant(epoch.dt, u64::from(window), first);
            let said = [
                (first && epoch.frame, flags::FRAME),
                (saves, flags::CHECKPOINT),
            ];
            grant.flags |= said
                .iter()
                .filter(|(on, _)| *on)
                .map(|(_, flag)| flag)
                .sum::<u64>();
            play.send_grants(&[grant])?;
            let outlines = first && epoch.outlines;
            window_of(
                &mut play,
                case,
                &mut stand,
                Window {
                    steps: window,
                    outlines,
                    measured: first,
                },
                judge,
                (smallest, longest),
            )?;
            if let Some((run, begun)) = from {
                let state = play.session.saved()?;
                play = BodiesRun::from(bench.resumed(&configure(&case.config), &state, &run)?);
                stand = begun;
                let mut grant = grant;
                grant.flags &= !flags::CHECKPOINT;
                let _ = play.next_grant(epoch.dt, u64::from(window), first);
                play.send_grants(&[grant])?;
                window_of(
                    &mut play,
                    case,
                    &mut stand,
                    Window {
                        steps: window,
                        outlines,
                        measured: first,
                    },
                    judge,
                    (smallest, longest),
                )?;
            }
            if stand.doubtful {
                return Ok(());
            }
        }
    }
    play.lead.closed()?.end(Duration::from_millis(500));
    Ok(())
}

impl Stand {
    fn copy(&self) -> Self {
        Self {
            oracle: self.oracle.clone(),
            step: self.step,
            before: self.before.clone(),
            limits: self.limits.clone(),
            doubtful: self.doubtful,
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

/// What a window is.
#[derive(Clone, Copy)]
struct Window {
    steps: u32,
    /// Whether the outlines are asked for.
    outlines: bool,
    /// Whether its first step is measured.
    measured: bool,
}

/// The steps of a grant, and the report on it.
fn window_of(
    play: &mut BodiesRun,
    case: &Case,
    stand: &mut Stand,
    window: Window,
    judge: &mut Judge,
    (smallest, longest): (f64, f64),
) -> Result<(), Stop> {
    let first = stand.step;
    let mut answered = Vec::new();
    for k in 0..window.steps {
        let step = stand.step;
        judge.step = step;
        if k == 0 && window.outlines {
            let (_, vertices) = play.envelopes()?;
            judge.envelopes(&stand.oracle, &vertices)?;
            stand.oracle.publish();
        }
        let now = case.positions(step, &stand.oracle);
        let granted = play.coming(window.measured && k == 0);
        let before = stand
            .before
            .as_deref()
            .map(|before| (before, granted.dt_before));
        let states = case.states(step, &now, before);
        let set = case.set(step);
        if step == 0 || play.imps() != set {
            play.set(&set);
        }
        let answer = play.exchange(&states)?;
        let expected = stand.oracle.step(&granted, &set, &states);
        if expected.doubtful.is_some() {
            stand.doubtful = true;
            return Ok(());
        }
        stand.before = Some(now);
        stand.step += 1;
        let moves = granted.dt_before > 0.0;
        answered.push(Answered {
            set,
            answer,
            expected,
            moves,
        });
    }
    let report = play.report()?;
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
            judge.poses(expected, report.bodies(count)?, BLUR * smallest)?;
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
            judge.bodies(expected, report.bodies(count)?, (BLUR * smallest, longest))?;
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
