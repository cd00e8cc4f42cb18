//! The steps of a case of bodies: the kit is the points.

use std::time::Duration;

use interface::Vec2;
use interface::config::capability::Capabilities;
use interface::message::control::Configure;
use interface::message::wire::{ImpInfo, ImpState, Limits};
use interface::step::Step;
use mechanics::reference::bodies::{BLUR, Expected, Oracle, Reported, Rubbed};

use super::super::judge::Judge;
use super::super::plan::Epoch;
use super::super::run::{self, Begun, Stop, Window, report};
use super::case::Case;
use super::{admit, generate};
use crate::bench::{Answer, Bench, Run, at_least, configure};

/// Where a run stands.
#[derive(Clone)]
pub struct Stand {
    oracle: Oracle,
    step: u32,
    before: Option<Vec<Vec2>>,
    /// What the last step of the window before was expected to give, with the limits that were reported after it.
    limits: Option<(Expected, Limits)>,
    /// The longest step so far in s.
    longest: f64,
    /// Of a solver with friction of its own: what that has done, and the steps that the copy of the run has to repeat.
    rubbed: Rubbed,
    past: Vec<(Window, Answered)>,
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
            rubbed: Rubbed::default(),
            past: Vec::new(),
        }
    }
}

/// A step that was answered.
#[derive(Clone)]
struct Answered {
    granted: Step,
    set: Vec<ImpInfo>,
    states: Vec<ImpState>,
    answer: Answer,
    expected: Expected,
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
        let sent = [header.step, header.epoch, header.count];
        let want = [own.step, own.epoch, vertices.len() as u64];
        judge.same("E-1", "step, epoch and count of envelopes", sent, want)?;
        judge.envelopes(&stand.oracle, &vertices)?;
        stand.oracle.publish();
    }
    let now = case.positions(step, &stand.oracle);
    let granted = play.coming(first && window.measured);
    let before = stand.before.as_deref();
    let states = case.states(step, &now, before.map(|before| (before, granted.dt_before)));
    let set = case.set(step);
    if step == 0 || play.at.set != set {
        play.set(&set);
    }
    let passes = before.is_some_and(|before| admit::passes(case, &stand.oracle, &now, before));
    let passes = passes || admit::pierces(case, &stand.oracle, &now);
    let poses: Vec<_> = stand.oracle.bodies.iter().map(|body| body.pose).collect();
    let expected = stand.oracle.step(&granted, &set, &states);
    let points: Vec<ImpInfo> = case.points.iter().map(|point| point.info).collect();
    let sound = !passes && stand.oracle.is_sound(&poses, &expected, &points);
    if !sound || expected.doubtful.is_some() {
        return Err(Stop::Doubtful);
    }
    let own = play.header();
    let answer = play.answer(&states)?;
    let header = answer.header;
    let (sent, want) = ([header.step, header.epoch], [own.step, own.epoch]);
    judge.same("F-2", "step and epoch of forces", sent, want)?;
    let generation = play.at.generation;
    let there = answer.forces.len() as u64;
    judge.same("C-4", "count in the header of forces", header.count, there)?;
    let (sent, want) = ([header.set, there], [generation, set.len() as u64]);
    judge.same("F-3", "set and number of forces", sent, want)?;
    let forces = answer.forces.iter();
    let numbers = forces.flat_map(|f| [f.force[0], f.force[1], f.stiffness]);
    judge.keep(numbers.chain([answer.header.travel]));
    stand.before = Some(now);
    stand.step += 1;
    Ok(Answered {
        granted,
        set,
        states,
        answer,
        expected,
    })
}

impl run::Case for Case {
    type Stand = Stand;
    const CAUSES: &'static [&'static str] = &["T-1", "J-1", "F-8", "F-7", "F-5", "F-6"];

    fn of_seed(seed: u64, takes: &Capabilities) -> Self {
        generate::case(seed, takes)
    }

    fn epochs(&mut self) -> &mut Vec<Epoch> {
        &mut self.epochs
    }

    fn is_possible(&self) -> bool {
        let apart = self.epochs.iter().all(|epoch| epoch.windows == [1]);
        self.config.faults().is_empty() && (apart || self.copied.is_none())
    }

    fn order(&self) -> Configure {
        configure(&self.config)
    }

    fn begun<'b>(&self, bench: &'b Bench, _: &mut Judge) -> Result<Begun<'b, Self>, Stop> {
        Ok((bench.run_bodies(&self.config)?, Stand::new(self)))
    }

    fn window(
        &self,
        play: &mut Run,
        stand: &mut Stand,
        window: Window,
        judge: &mut Judge,
    ) -> Result<(), Stop> {
        let (first, number) = (stand.step, play.next());
        let smallest = admit::smallest(self);
        stand.longest = stand.longest.max(window.dt);
        let longest = stand.longest;
        let earlier = self.copied.is_some().then(|| stand.oracle.clone());
        let mut answered = Vec::new();
        for k in 0..window.steps {
            let step = stepped(play, self, stand, (window, k == 0), judge);
            let ends = match &step {
                Ok(step) => step.expected.is_last,
                Err(stop) => matches!(stop, Stop::Doubtful),
            };
            match step {
                Ok(step) => answered.push(step),
                Err(Stop::Doubtful) => {}
                Err(other) => return Err(other),
            }
            if ends {
                // There is no report, but forces can be judged.
                for (step, k) in answered.iter().zip(first..) {
                    judge.step = k;
                    judge.forces(&step.expected, &step.set, &step.answer, "")?;
                }
                return Err(Stop::Doubtful);
            }
        }
        let all = self.config.bodies.len();
        let report = report(play, (number, all), window, judge)?;
        let count = usize::from(window.measured) * all;
        let bodies = match count {
            0 => &[],
            count => at_least(report.bodies.as_ref(), count, "bodies")?,
        };
        let dt = if longest > 0.0 { longest } else { 1.0 };
        if let (Some(mut oracle), [step]) = (earlier, &mut answered[..]) {
            if window.outlines {
                oracle.publish();
            }
            judge.opposite(&step.expected, &step.answer.forces, bodies)?;
            let reported = Reported {
                forces: &step.answer.forces,
                bodies,
                ledger: &report.report.ledger,
            };
            let of = (&step.set[..], &step.states[..]);
            let law = (&step.expected, reported);
            step.expected = oracle.admit(&step.granted, of, law, &mut stand.rubbed);
            stand.oracle = oracle;
        }
        // In the order in which one thing causes another, so that the first difference is the cause.
        for (k, step) in answered.iter().enumerate() {
            judge.step = first + k as u32;
            let (measured, expected) = (window.measured && k == 0, &step.expected);
            if measured {
                judge.poses(expected, bodies, BLUR * smallest)?;
            }
            judge.forces(expected, &step.set, &step.answer, "")?;
            if let Some((before, limits)) = stand.limits.take() {
                let moves = step.granted.dt_before > 0.0;
                let now = moves.then_some(expected);
                judge.limits(&limits, &before, now, (smallest / dt, dt))?;
            }
            if measured {
                judge.bodies(expected, bodies, (BLUR * smallest, longest))?;
                judge.ledger(expected, &report.report.ledger, admit::typical(self))?;
                if let Some((_, contacts)) = &report.contacts {
                    judge.contacts(expected, contacts)?;
                }
            }
        }
        let last = answered.last().map(|answered| answered.expected.clone());
        stand.limits = last.map(|last| (last, report.report.limits));
        let past = answered.into_iter().filter(|_| self.copied.is_some());
        stand.past.extend(past.map(|step| (window, step)));
        Ok(())
    }

    fn again(&self, bench: &Bench, stand: &Stand, judge: &mut Judge) -> Result<(), Stop> {
        repeat(bench, self, &stand.past, judge)
    }

    fn end(&self, run: Run, _: &mut Stand, _: &mut Judge) -> Result<(), Stop> {
        run.closed()?.solver.end(Duration::from_millis(500));
        Ok(())
    }

    /// Forces on bodies that nothing moves can be judged although those that move do so wrongly.
    fn narrower(broken: &str, takes: &Capabilities) -> Option<Capabilities> {
        let mut fewer = takes.clone();
        fewer.0.retain(|name| !name.starts_with("motion:"));
        fewer.0.push("motion:fixed".into());
        (broken == "T-1" && takes.meets("motion:free")).then_some(fewer)
    }

    fn later(&self, first: u32) -> Option<Self> {
        Some(self.begun_in(first))
    }
}

/// Runs the copy of steps that were answered as they may be, in windows of one step each, with the same points: the forces are
/// the same.
fn repeat(
    bench: &Bench,
    case: &Case,
    past: &[(Window, Answered)],
    judge: &mut Judge,
) -> Result<(), Stop> {
    let Some(copied) = case.copied.filter(|_| judge.selected.contains(&"F-7")) else {
        return Ok(());
    };
    let mut play = bench.run_bodies(&copied.config(&case.config))?;
    let mut left = past;
    while let Some((first, _)) = left.first() {
        let alike = |(window, _): &&(Window, Answered)| {
            first.dt > 0.0 && window.dt == first.dt && !window.outlines
        };
        let more = left[1..].iter().take(copied.window.saturating_sub(1));
        let count = 1 + more.take_while(alike).count();
        play.grant(first.dt, count as u64, true)?;
        for (window, step) in &left[..count] {
            judge.step = play.next() as u32;
            if window.outlines {
                play.envelopes()?;
            }
            let set = copied.set(&step.set);
            if judge.step == 0 || play.at.set != set {
                play.set(&set);
            }
            let Answer { header, forces } = play.answer(&copied.states(&step.states))?;
            let forces = copied.in_order(forces);
            let mut expected = step.expected.clone();
            for (want, got) in expected.points.iter_mut().zip(&step.answer.forces) {
                want.force = copied.vector(got.force).into();
                want.couple = copied.axial(got.couple);
            }
            let answer = Answer { header, forces };
            judge.forces(&expected, &step.set, &answer, " in a copy of the run")?;
        }
        play.report()?;
        left = &left[count..];
    }
    play.closed()?.solver.end(Duration::from_millis(500));
    Ok(())
}
