//! A copy of a run, in which a solver with friction of its own has to say the same.

use std::time::Duration;

use interface::Vec2;
use interface::config::{BodyShape, DemConfig, Motion};
use interface::message::wire::{ImpInfo, ImpState};
use serde::{Deserialize, Serialize};

use super::super::judge::Judge;
use super::super::run::{Stop, Window};
use super::case::Case;
use super::run::Answered;
use crate::bench::{Answer, Bench};

/// An id above all others.
const LAST_ID: u64 = (1 << 20) - 1;

/// How a copy of a run differs from it: mirrored at the x axis, turned about the origin, and shifted.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Copied {
    pub mirrored: bool,
    /// In rad.
    pub turn: f64,
    /// In m.
    pub shift: [f64; 2],
    /// Whether bodies, points and their ids come in the opposite order.
    pub reversed: bool,
    /// Most steps of a window, which have one each in the run.
    pub window: usize,
}

impl Copied {
    fn vector(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ((sin, cos), y) = (self.turn.sin_cos(), self.axial(y));
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// An angle, a spin, a moment.
    fn axial(&self, x: f64) -> f64 {
        if self.mirrored { -x } else { x }
    }

    fn place(&self, x: [f64; 2]) -> [f64; 2] {
        (Vec2::from(self.vector(x)) + Vec2::from(self.shift)).into()
    }

    fn in_order<T>(&self, mut list: Vec<T>) -> Vec<T> {
        if self.reversed {
            list.reverse();
        }
        list
    }

    fn config(&self, config: &DemConfig) -> DemConfig {
        let mut bodies = config.bodies.clone();
        for body in &mut bodies {
            body.position = self.place(body.position);
            body.angle = self.axial(body.angle) + self.turn;
            body.velocity = self.vector(body.velocity);
            body.spin = self.axial(body.spin);
            let own = match &mut body.shape {
                BodyShape::Disc | BodyShape::Rectangle { .. } => &mut [][..],
                BodyShape::Segment { ends } => ends,
                BodyShape::Polygon { vertices } => vertices,
                BodyShape::Cluster { centers, .. } => centers,
            };
            own.iter_mut().for_each(|[_, y]| *y = self.axial(*y));
            if let Motion::Pushed { force, torque, .. } = &mut body.motion {
                (*force, *torque) = (self.vector(*force), self.axial(*torque));
            }
        }
        DemConfig {
            gravity: self.vector(config.gravity),
            bodies: self.in_order(bodies),
            ..config.clone()
        }
    }

    fn set(&self, set: &[ImpInfo]) -> Vec<ImpInfo> {
        let mut set = set.to_vec();
        let ids = set.iter_mut().filter(|_| self.reversed);
        ids.for_each(|info| info.id = LAST_ID - info.id);
        self.in_order(set)
    }

    fn states(&self, states: &[ImpState]) -> Vec<ImpState> {
        let states = states.iter().map(|state| ImpState {
            position: self.place(state.position),
            velocity: self.vector(state.velocity),
            spin: self.axial(state.spin),
        });
        self.in_order(states.collect())
    }
}

/// Runs the copy of steps that were answered as they may be, in windows of one step each, with the same points: the forces are
/// the same.
pub fn repeat(
    bench: &Bench,
    case: &Case,
    told: &[(Window, Answered)],
    judge: &mut Judge,
) -> Result<(), Stop> {
    let Some(copied) = case.copied.filter(|_| judge.asked.contains(&"F-7")) else {
        return Ok(());
    };
    let mut play = bench.run_bodies(&copied.config(&case.config))?;
    let mut left = told;
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
            for (want, said) in expected.points.iter_mut().zip(&step.answer.forces) {
                want.force = copied.vector(said.force).into();
                want.couple = copied.axial(said.couple);
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
