//! A solver with friction of its own: the oracle takes what it says where PROTOCOL.md admits that, and it has to say the same in a
//! copy of the run.

use std::collections::BTreeMap;
use std::time::Duration;

use interface::Vec2;
use interface::config::{BodyShape, DemConfig, Motion};
use interface::message::wire::{BodyState, ImpForce, ImpInfo, ImpState, Ledger};
use mechanics::mass::cross;
use mechanics::reference::bodies::{Oracle, Touch, Who};
use serde::{Deserialize, Serialize};

use super::super::judge::{self, Judge};
use super::super::run::{Stop, Window};
use super::case::Case;
use super::run::{Answered, Stand};
use crate::bench::Bench;

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

/// A step that was answered as it may be.
#[derive(Clone)]
pub struct Told {
    dt: f64,
    /// Whether the outlines were asked for.
    outlines: bool,
    set: Vec<ImpInfo>,
    states: Vec<ImpState>,
    forces: Vec<ImpForce>,
    /// How far each force may be off by rounding, in N/m.
    blur: Vec<f64>,
}

impl Told {
    /// Of a window of one step.
    pub fn of(window: Window, step: &Answered) -> Self {
        let blur = step.expected.points.iter().map(|point| point.blur);
        Self {
            dt: window.dt,
            outlines: window.outlines,
            set: step.set.clone(),
            states: step.states.clone(),
            forces: step.answer.forces.clone(),
            blur: blur.collect(),
        }
    }
}

/// Most that friction can be, and what it is, if that is known, in N/m.
type Rub = (f64, Option<Vec2>);

/// What friction has done so far.
#[derive(Clone, Default)]
pub struct Rubbed {
    /// Most that it could be in the last step, and what it was, if that is known, in N/m.
    last: BTreeMap<Who, Rub>,
    /// Most work that it can have done in J/m, and how much that work is off by the rule of section 9, which takes the mean of
    /// the forces of two steps.
    most: f64,
    off: f64,
}

impl Rubbed {
    /// Contacts slide by ways (m) while friction is at most and just this (N/m), if that is known.
    fn slide(&mut self, now: &[(Who, f64, Rub)]) {
        let last = std::mem::take(&mut self.last);
        for (who, way, (limit, force)) in now {
            let (was, before) = last.get(who).copied().unwrap_or((0.0, Some(Vec2::zeros())));
            let most = 0.5 * (limit + was) * way;
            let change = force.zip(before).map(|(now, before)| (now - before).norm());
            self.most += most;
            self.off += change.map_or(most, |change| 0.5 * change * way);
            self.last.insert(*who, (*limit, *force));
        }
    }
}

/// Takes a step again from before it, with the answer to it where that is admitted, else with what is and is nearest: of a point on
/// one body what is not the law's normal force is at most Coulomb's friction; forces on bodies and points are opposite;
/// friction stores and takes no more than it works, and gives nothing.
pub fn admit(
    (stand, mut oracle): (&mut Stand, Oracle),
    step: &mut Answered,
    (bodies, ledger): (&[BodyState], &Ledger),
    judge: &mut Judge,
) -> judge::Result {
    let (set, states, answer) = (&step.set, &step.states, &step.answer);
    let mut points = step.expected.points.clone();
    let of_points = step
        .expected
        .touches
        .iter()
        .filter_map(|touch| match touch.who {
            Who::Point(id, b, _) => Some((touch, b, set.iter().position(|info| info.id == id)?)),
            _ => None,
        });
    let of_points: Vec<(&Touch, usize, usize)> = of_points.collect();
    let is_alone = |slot: usize| of_points.iter().filter(|(.., s)| *s == slot).count() == 1;
    let said = bodies
        .iter()
        .map(|body| Vec2::from(body.point_force).push(body.point_torque));
    let (said, mut sums): (Vec<_>, Vec<_>) = said.map(|load| (load, load * 0.0)).unzip();
    let mut slides = Vec::new();
    for (touch, b, slot) in &of_points {
        let (point, x) = (&mut points[*slot], Vec2::from(states[*slot].position));
        let (got, normal) = (answer.forces[*slot], touch.normal);
        let mut friction = None;
        (point.force, point.couple) = (got.force.into(), got.couple);
        if is_alone(*slot) {
            let pressing = normal * touch.force.dot(&normal);
            let rubs = (point.force - pressing).cap_magnitude(touch.limit);
            point.force = pressing + rubs;
            point.couple = cross(touch.at - x, point.force);
            friction = Some(rubs);
        }
        let arm = x - oracle.bodies[*b].pose.xy();
        sums[*b] -= point.force.push(cross(arm, point.force) + point.couple);
        slides.push((touch.who, touch.moved, (touch.limit, friction)));
    }
    let all = said.iter().fold(Vec2::zeros(), |sum, load| sum + load.xy());
    let forces = answer.forces.iter().map(|f| Vec2::from(f.force));
    let (sum, size) = forces.fold((all, 0.0), |(sum, size), f| (sum + f, size + f.norm()));
    let slack = points.iter().map(|point| point.blur).sum::<f64>() + 1e-9 * size;
    let of = "sum of the forces on points and on bodies in N/m";
    judge.near("R-3", of, sum.as_slice(), &[0.0; 2], slack)?;
    let shared = |b: usize| {
        of_points
            .iter()
            .any(|(_, c, slot)| *c == b && !is_alone(*slot))
    };
    let loads = (0..bodies.len()).map(|b| if shared(b) { said[b] } else { sums[b] });
    oracle.given = Some(loads.collect());
    let parted = step.expected.parted.iter();
    slides.extend(parted.map(|(who, way)| (*who, *way, (0.0, Some(Vec2::zeros())))));
    stand.rubbed.slide(&slides);
    let mut expected = oracle.step(&step.granted, set, states);
    let held: f64 = expected.touches.iter().map(|touch| touch.held).sum();
    let (want, Rubbed { most, off, .. }) = (&mut expected.ledger, &stand.rubbed);
    let stored = (ledger.contact - (want.contact - held)).clamp(0.0, *most);
    want.contact += stored - held;
    want.friction_work = ledger.friction_work.clamp(-off, most + off - stored);
    expected.points = points;
    (stand.oracle, step.expected) = (oracle, expected);
    Ok(())
}

/// Runs the copy with the same points: the forces are the same.
pub fn repeat(bench: &Bench, case: &Case, told: &[Told], judge: &mut Judge) -> Result<(), Stop> {
    let Some(copied) = case.copied.filter(|_| judge.asked.contains(&"F-7")) else {
        return Ok(());
    };
    let mut play = bench.run_bodies(&copied.config(&case.config))?;
    let mut left = told;
    while let Some(first) = left.first() {
        let alike = |step: &&Told| first.dt > 0.0 && step.dt == first.dt && !step.outlines;
        let more = left[1..].iter().take(copied.window.saturating_sub(1));
        let count = 1 + more.take_while(alike).count();
        play.grant(first.dt, count as u64, true)?;
        for step in &left[..count] {
            judge.step = play.next() as u32;
            if step.outlines {
                play.envelopes()?;
            }
            let set = copied.set(&step.set);
            if judge.step == 0 || play.at.set != set {
                play.set(&set);
            }
            let answer = play.answer(&copied.states(&step.states))?;
            let got = copied.in_order(answer.forces);
            let whom = step.forces.iter().zip(&got).zip(&step.set).zip(&step.blur);
            for (((want, got), info), blur) in whom {
                let [of, by] =
                    [(); 2].map(|()| format!("on point {} in a copy of the run", info.id));
                let tolerance = blur + 1e-9 * Vec2::from(want.force).norm();
                let (force, couple) = (copied.vector(want.force), copied.axial(want.couple));
                judge.near(
                    "F-7",
                    format!("force in N/m {of}"),
                    &got.force,
                    &force,
                    tolerance,
                )?;
                let tolerance = tolerance * info.radius;
                judge.near(
                    "F-7",
                    format!("couple in N {by}"),
                    &[got.couple],
                    &[couple],
                    tolerance,
                )?;
            }
        }
        play.report()?;
        left = &left[count..];
    }
    play.closed()?.solver.end(Duration::from_millis(500));
    Ok(())
}
