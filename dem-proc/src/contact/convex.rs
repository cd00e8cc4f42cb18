//! Contact between convex bodies with other measures than edge by edge: one contact for each vertex
//! ([`crate::contact::nearest`]) or one for each pair of bodies ([`crate::contact::overlap`]).
//!
//! A measure defines the depth `xi` of a contact as a function of the poses of the two bodies, and its gradient: `gain`
//! times the unit normal `N`, on a line through `point`. The law gets `xi` and its change, and its force is multiplied
//! by the gain. So for every measure the force is the gradient of the law's energy. The tangential force has the same
//! factor, which preserves Coulomb's limit.
//!
//! Contacts are evaluated one after another in one thread: these measures are for scenes of hundreds of bodies, and for
//! comparison.

use std::fmt::Debug;

use interface::Vec2;
use interface::message::wire::ContactState;
use interface::saved::{pack, unpack};
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::body::frame::Frame;
use crate::body::load::PairLoad;
use crate::contact::approach::{Near, crossing_rate};
use crate::contact::frame_contacts::between_bodies;
use crate::contact::impact::{Impacts, Pressing, SurfaceMotion};
use crate::contact::pairs::BodySide;
use crate::contact::passage::{Passage, PassedBodies, TURN};
use crate::contact::versions::Versions;
use crate::law::history::Numbers;
use crate::law::{Kinematics, LastStep, Law, Loss, PairProperties, Response, reduced};
use crate::lists::watch::{Ahead, Watch};
use crate::saved::one_for_each;
use crate::threads::Threads;
use mechanics::mass::cross;

/// A possible contact: a part of one body, and another body. Candidates are sorted by the fields in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Candidate {
    /// The body that `N` points to, then the other one.
    pub bodies: [u32; 2],
    /// Vertex of the first body in [`Bodies::outline`]; 0 if the candidate is the whole body.
    pub vertex: u32,
}

/// Position, depth and direction of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Depth `xi` in m, positive in contact; the negative distance if the two do not touch.
    pub depth: f64,
    /// Derivative of the depth with respect to the approach along `N`: 1 for a distance.
    pub gain: f64,
    /// Unit normal `N`, in the direction in which the first body is pushed.
    pub normal: Vec2,
    /// A point on the line of action of the force, in m.
    pub point: Vec2,
    /// Half the width of the contact in m: the largest offset of the line of force in the next step.
    pub half_width: f64,
}

/// A measure of contact.
pub trait Measure: Debug + Send + Sync {
    /// Bound of `(d^2 E / du^2) / (d^2 E / dxi^2)` along `N`, for springs no softer than linear ones.
    const STIFFENS: f64;
    /// Appends the parts of the two bodies that could come within `margin` (m).
    fn list(&self, bodies: &Bodies, pair: [u32; 2], margin: f64, candidates: &mut Vec<Candidate>);
    /// Largest overlap of a candidate at which its force has the right sign, in m.
    fn length(&self, bodies: &Bodies, candidate: Candidate) -> f64;
    /// The contact of a candidate; `None` if its distance is above `closing` (m).
    fn meet(&mut self, bodies: &Bodies, candidate: Candidate, closing: f64) -> Option<Spot>;
    /// The criterion by which a candidate that presses has gone too far ([`crate::contact::passage`]). `turned`: its
    /// normal has rotated since the last step, in the frame of the second body.
    fn passage(
        &self,
        bodies: &Bodies,
        candidate: Candidate,
        spot: &Spot,
        turned: bool,
    ) -> Option<Passage>;
}

/// The state of the contacts of a list. The list follows from the poses of the bodies at which it was built.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "H: Numbers")]
struct State<H> {
    watch: Watch,
    #[serde(with = "crate::law::history")]
    history: Vec<H>,
    /// Normals of the last step, zero where there was no contact.
    #[serde(with = "crate::saved")]
    normals: Vec<Vec2>,
}

/// What is kept from one step to the next.
#[derive(Debug)]
struct Kept<L: Law> {
    state: State<L::History>,
    list: Vec<Candidate>,
    /// [`Measure::length`] of each.
    lengths: Vec<f64>,
    constants: Vec<L::Pair>,
}

impl<L: Law> Kept<L> {
    fn new(skin: f64) -> Self {
        Self::of(State {
            watch: Watch::new(skin),
            history: Vec::new(),
            normals: Vec::new(),
        })
    }

    /// This state without its list.
    fn of(state: State<L::History>) -> Self {
        Self {
            state,
            list: Vec::new(),
            lengths: Vec::new(),
            constants: Vec::new(),
        }
    }

    /// Builds the list for the positions of bodies and the margins of `watch`.
    fn build(&mut self, law: &L, measure: &impl Measure, bodies: &Bodies) {
        let list = &mut self.list;
        list.clear();
        crate::lists::neighbours::close_pairs(bodies, &self.state.watch, |pair, margin| {
            measure.list(bodies, pair, margin, list);
        });
        list.sort_unstable();
        let length = |candidate: &Candidate| measure.length(bodies, *candidate);
        self.lengths.clear();
        self.lengths.extend(list.iter().map(length));
        self.constants.clear();
        self.constants.extend(list.iter().map(|candidate| {
            let [v, e] = candidate.bodies.map(|b| &bodies.state[b as usize]);
            law.pair(&PairProperties {
                mass: bodies.reduced_mass(candidate.bodies),
                radius: reduced(v.radius, e.radius),
                surfaces: candidate
                    .bodies
                    .map(|b| bodies.properties[b as usize].surface),
            })
        }));
    }

    /// Takes histories and normals from an `old` list.
    fn carry(&mut self, old: &Self) {
        let carried = self.list.iter().map(|candidate| {
            let was = old.list.binary_search(candidate);
            let was = was.map(|i| (old.state.history[i], old.state.normals[i]));
            was.unwrap_or((L::History::default(), Vec2::zeros()))
        });
        (self.state.history, self.state.normals) = carried.unzip();
    }
}

/// Contact between convex bodies by the law `L`, measured by `M`. As in [`crate::contact::points`], an evaluation does
/// not change the history; `commit` does.
#[derive(Debug)]
pub struct ConvexContacts<L: Law, M> {
    law: L,
    measure: M,
    lists: Versions<Kept<L>>,
    next: Vec<L::History>,
    next_normals: Vec<Vec2>,
    /// Depths of the last evaluation in m, 0 where there is no contact.
    depths: Vec<f64>,
    /// The candidates in reach in the last evaluation.
    in_reach: Vec<Near>,
    /// Force and stiffness of each candidate in reach.
    pressing: Vec<Pressing<f64>>,
    /// The contacts that press, for frames.
    contact_states: Vec<ContactState>,
    passed: Option<PassedBodies>,
    presses: usize,
    loss: Loss,
}

impl<L: Law, M: Measure> ConvexContacts<L, M> {
    /// No list yet.
    pub fn new(law: L, measure: M, skin: f64) -> Self {
        Self {
            law,
            measure,
            lists: Versions {
                kept: Kept::new(skin),
                fresh: Kept::new(skin),
                rebuilt: false,
            },
            next: Vec::new(),
            next_normals: Vec::new(),
            depths: Vec::new(),
            in_reach: Vec::new(),
            pressing: Vec::new(),
            contact_states: Vec::new(),
            passed: None,
            presses: 0,
            loss: Loss::default(),
        }
    }
}

/// The motion of the surfaces at a contact, for the law.
fn kinematics(
    bodies: &Bodies,
    last_step: LastStep,
    spot: &Spot,
    pair: [u32; 2],
    arms: [Vec2; 2],
) -> Kinematics {
    let tangent = Vec2::new(-spot.normal.y, spot.normal.x);
    let along = |u: Vec2| [spot.gain * u.dot(&spot.normal), spot.gain * u.dot(&tangent)];
    let mut kinematics = Kinematics {
        overlap: spot.depth,
        ..Kinematics::default()
    };
    if last_step.dt > 0.0 {
        let frames = pair.map(|b| &bodies.frames[b as usize]);
        let [a, b] = [0, 1].map(|i| frames[i].displacement(arms[i]));
        kinematics.moved = along(a - b);
        kinematics.velocity = kinematics.moved.map(|u| u * last_step.per_dt);
        kinematics.rolled = frames[0].last.sin - frames[1].last.sin;
    } else {
        let [a, b] = [0, 1].map(|i| bodies.state[pair[i] as usize].velocity_at(arms[i]));
        kinematics.velocity = along(a - b);
    }
    kinematics
}

impl<L: Law, M: Measure> BodySide for ConvexContacts<L, M> {
    fn update_list(&mut self, bodies: &Bodies, ahead: &Ahead, speed: f64) {
        self.lists.rebuilt = !self.lists.kept.state.watch.holds(bodies, ahead, speed);
        if self.lists.rebuilt {
            self.lists.fresh.state.watch.begin(bodies, ahead, speed);
            self.lists.fresh.build(&self.law, &self.measure, bodies);
            self.lists.fresh.carry(&self.lists.kept);
        }
    }

    fn evaluate(
        &mut self,
        bodies: &Bodies,
        last_step: LastStep,
        closing: f64,
        _: &Threads,
        loads: &mut [PairLoad],
    ) {
        loads.fill(PairLoad::default());
        self.in_reach.clear();
        self.pressing.clear();
        self.contact_states.clear();
        self.presses = 0;
        self.passed = None;
        self.loss = Loss::default();
        let now = self.lists.current();
        let pairs = now.list.len();
        refill(&mut self.next, pairs, L::History::default());
        refill(&mut self.next_normals, pairs, Vec2::zeros());
        refill(&mut self.depths, pairs, 0.0);
        for (k, candidate) in now.list.iter().enumerate() {
            let pair = candidate.bodies;
            let closing = now.state.watch.closing(pair).unwrap_or(closing);
            let Some(spot) = self.measure.meet(bodies, *candidate, closing) else {
                continue;
            };
            self.in_reach.push(Near {
                bodies: pair,
                normal: spot.normal,
                point: spot.point,
                length: now.lengths[k],
            });
            let frames = pair.map(|b| &bodies.frames[b as usize]);
            let arms = frames.map(|frame| spot.point - frame.center);
            let kinematics = kinematics(bodies, last_step, &spot, pair, arms);
            let (constants, before) = (&now.constants[k], &now.state.history[k]);
            let stiffness = self.law.stiffness(constants, spot.depth + closing);
            let [normal, tangential] = [stiffness.normal * M::STIFFENS, stiffness.tangential];
            for i in 0..2 {
                let load = &mut loads[pair[i] as usize];
                load.rate += rate(frames[i], arms[i], &spot, normal, tangential);
                load.rate += frames[i].inverse_inertia * stiffness.rolling;
            }
            self.pressing.push(Pressing {
                overlap: spot.depth,
                force: 0.0,
                stiffness: stiffness.normal,
                // The contact point may move from one end of the smaller body to the other.
                width: 2.0 * spot.half_width,
            });
            if spot.depth <= 0.0 {
                self.loss += self.law.separate(constants, &kinematics, before);
                continue;
            }
            let turned = frames[1].turned(now.state.normals[k]).dot(&spot.normal) < TURN;
            self.next_normals[k] = spot.normal;
            if self.passed.is_none() {
                let passage = self.measure.passage(bodies, *candidate, &spot, turned);
                self.passed = passage.map(|passage| PassedBodies {
                    bodies: pair,
                    passage,
                    overlap: spot.depth,
                });
            }
            let response = self.law.response(constants, &kinematics, before);
            if let Some(pressing) = self.pressing.last_mut() {
                pressing.force = spot.gain * response.normal;
            }
            let force = push(loads, pair, arms, &spot, &response);
            self.contact_states
                .push(between_bodies(pair, spot.point, force));
            self.loss += response.loss;
            self.presses += 1;
            self.depths[k] = spot.depth;
            self.next[k] = response.history;
        }
    }

    /// As for pairs of vertices and edges: see [`crate::contact::pairs`].
    fn omega_sq(
        &self,
        bodies: &Bodies,
        motions: &[SurfaceMotion],
        impacts: &Impacts,
        _: &Threads,
    ) -> [f64; 2] {
        let (mut largest, mut of_impact): (f64, f64) = (0.0, 0.0);
        for (near, pressing) in self.in_reach.iter().zip(&self.pressing) {
            let [a, b] = near.bodies.map(|b| motions[b as usize].rate());
            largest = largest.max(a + b);
            if a + b > of_impact && impacts.is_one(bodies, near, pressing) {
                of_impact = a + b;
            }
        }
        [largest, of_impact]
    }

    fn crossing(&self, bodies: &Bodies, kicked: &[(Vec2, f64)], _: f64, known: f64) -> f64 {
        let rates = self.in_reach.iter();
        let rates = rates.map(|near| crossing_rate(bodies, kicked, near));
        rates.fold(known, f64::max)
    }

    fn passed(&self, _: &Bodies) -> Option<PassedBodies> {
        self.passed
    }

    fn loss(&self) -> Loss {
        self.loss
    }

    /// The energy at the positions of the last evaluation, which are those of the measurement.
    fn energy(&self, _: &Bodies) -> f64 {
        let contacts = self
            .depths
            .iter()
            .zip(&self.lists.current().constants)
            .zip(&self.next);
        let pressing = contacts.filter(|((depth, _), _)| **depth > 0.0);
        let energy = pressing
            .map(|((depth, constants), history)| self.law.energy(constants, *depth, history));
        energy.sum()
    }

    fn collect_contacts(&self, _: &Bodies, found: &mut Vec<ContactState>) {
        found.extend_from_slice(&self.contact_states);
    }

    fn keep_list(&mut self) {
        self.lists.keep();
    }

    fn commit(&mut self) {
        self.keep_list();
        std::mem::swap(&mut self.lists.kept.state.history, &mut self.next);
        std::mem::swap(&mut self.lists.kept.state.normals, &mut self.next_normals);
    }

    fn damping_ratio(&self) -> f64 {
        if self.in_reach.is_empty() {
            0.0
        } else {
            // `damped_mass` is for contacts of points only.
            self.law.damping_ratio(f64::INFINITY)
        }
    }

    fn contacts(&self) -> usize {
        self.presses
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.lists.kept.state.watch.advance(speed, dt);
    }

    fn bytes(&self) -> usize {
        let listed = |kept: &Kept<L>| {
            kept.list.capacity() * (size_of::<Candidate>() + size_of::<f64>() + size_of::<Vec2>())
                + kept.constants.capacity() * size_of::<L::Pair>()
                + kept.state.history.capacity() * size_of::<L::History>()
        };
        let each = size_of::<L::History>() + size_of::<Vec2>() + size_of::<f64>();
        listed(&self.lists.kept) + listed(&self.lists.fresh) + self.next.capacity() * each
    }

    fn save(&self) -> Vec<u8> {
        pack("pairs", &self.lists.kept.state)
    }

    fn restore(&mut self, saved: &[u8], bodies: &Bodies) -> Result<(), Refusal> {
        let mut kept = Kept::of(unpack("pairs", saved)?);
        if let Some(then) = kept.state.watch.bodies_then(bodies) {
            kept.build(&self.law, &self.measure, &then);
        }
        one_for_each(&kept.state.history, kept.list.len())?;
        (self.lists.kept, self.lists.rebuilt) = (kept, false);
        Ok(())
    }
}

/// Adds force and moment of a contact that presses to the loads of its two bodies.
fn push<H>(
    loads: &mut [PairLoad],
    pair: [u32; 2],
    arms: [Vec2; 2],
    spot: &Spot,
    response: &Response<H>,
) -> Vec2 {
    let (f_n, f_t) = (spot.gain * response.normal, spot.gain * response.tangential);
    let tangent = Vec2::new(-spot.normal.y, spot.normal.x);
    let force = spot.normal * f_n + tangent * f_t;
    for (i, sign) in [(0, 1.0), (1, -1.0)] {
        let load = &mut loads[pair[i] as usize];
        load.force += force * sign;
        load.torque += sign * (cross(arms[i], force) + response.moment);
    }
    force
}

/// `count` times `value`.
fn refill<T: Clone>(kept: &mut Vec<T>, count: usize, value: T) {
    kept.clear();
    kept.resize(count, value);
}

/// Contribution of a contact to a body's `Load::rate`, for a force anywhere on the width of the contact and a gain of
/// at most 1.
fn rate(frame: &Frame, arm: Vec2, spot: &Spot, normal: f64, tangential: f64) -> f64 {
    let across = cross(arm, spot.normal).abs() + spot.half_width;
    let along = arm.dot(&spot.normal).abs() + spot.half_width;
    frame.inverse_mass * (normal + tangential)
        + frame.inverse_inertia * (normal * across * across + tangential * along * along)
}
