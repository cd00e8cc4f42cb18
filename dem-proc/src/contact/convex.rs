//! Contact between convex bodies with other measures than edge by edge: one contact for each vertex
//! ([`crate::contact::nearest`]) or one for each pair of bodies ([`crate::contact::overlap`]).
//!
//! A measure defines the depth `xi` of a contact as a function of the poses of the two bodies, and its gradient: `gain`
//! times the unit normal `N`, on a line through `point`. The law gets `xi` and its change, and its force is multiplied
//! by the gain. So for every measure the force is the gradient of the law's energy. The tangential force has the same
//! factor, which preserves Coulomb's limit.
//!
//! Contacts are evaluated one by one: these measures are for scenes of hundreds of bodies, and for comparison.

use std::fmt::Debug;
use std::marker::PhantomData;

use interface::Vec2;

use crate::body::bodies::Bodies;
use crate::body::frame::Frame;
use crate::body::load::PairLoad;
use crate::contact::approach::Near;
use crate::contact::engine::{Chunk, Listing, On, PairKind};
use crate::contact::frame_contacts::{BODY, between};
use crate::contact::impact::Pressing;
use crate::contact::pair_geometry::Moves;
use crate::contact::pairs::pair_properties;
use crate::contact::passage::{Own, Passage, Passed, TURN};
use crate::contact::side::{AfterKick, Sums, Targets};
use crate::law::{Kinematics, Law, Loss, PairProperties, Stiffness};
use crate::lists::neighbours::Search;
use crate::lists::now::Among;
use crate::lists::watch::Watch;
use mechanics::mass::cross;

/// A possible contact: a part of one body, and another body.
#[derive(Debug, Clone, Copy, Default)]
pub struct Candidate {
    /// The body that `N` points to, then the other one.
    pub bodies: [u32; 2],
    /// Vertex of the first body in [`Bodies::outline`]; `None` if the candidate is the whole body.
    pub vertex: Option<u32>,
    /// Largest overlap at which its force has the right sign, or that is allowed without a force, in m.
    pub length: f64,
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
pub trait Measure: Debug + Default + Send + Sync + 'static {
    /// Bound of `(d^2 E / du^2) / (d^2 E / dxi^2)` along `N`, for springs no softer than linear ones.
    const STIFFENS: f64;
    /// Appends the parts of the two bodies that could come within `margin` (m).
    fn list(bodies: &Bodies, pair: [u32; 2], margin: f64, candidates: &mut Vec<Candidate>);
    /// The contact of a candidate; `None` if its distance is above `closing` (m).
    fn meet(&mut self, bodies: &Bodies, candidate: Candidate, closing: f64) -> Option<Spot>;
    /// By how much the depth has fallen over the last step in m; it was `before` in m, 0 without contact.
    fn fallen(bodies: &Bodies, candidate: Candidate, spot: &Spot, before: f64) -> f64;
    /// The criterion by which a candidate that presses has gone too far ([`crate::contact::passage`]). `turned`: its
    /// normal has rotated since the last step, in the frame of the second body; with how far the bodies have approached
    /// at most in that step, in m.
    fn passage(
        bodies: &Bodies,
        candidate: Candidate,
        spot: &Spot,
        turned: Option<f64>,
    ) -> Option<Passage>;
    /// How deep in m two bodies lie across one another that no contact pushes apart, if that is too far. It is asked for
    /// a candidate without a contact.
    fn across(_: &Bodies, _: Candidate) -> Option<f64> {
        None
    }
}

/// Pairs of convex bodies, measured by `M`.
#[derive(Debug, Default)]
pub struct Convex<M>(PhantomData<M>);

/// A contact in reach.
#[derive(Debug)]
pub struct Met {
    /// Of its candidate in the chunk.
    number: usize,
    near: Near,
    pressing: Pressing<f64>,
}

/// What a contact in reach adds to sums.
#[derive(Debug)]
struct Outcome {
    bodies: [u32; 2],
    loads: [PairLoad; 2],
    loss: Loss,
    presses: bool,
    /// If it presses and that is wanted: where it is in m, and the energy in J/m of its springs.
    measured: Option<(Vec2, f64)>,
}

/// What a chunk adds to sums.
#[derive(Debug, Default)]
pub struct Results {
    outcomes: Vec<Outcome>,
    passed: Option<Passed>,
}

/// The motion of the surfaces at a contact, for the law.
fn kinematics<M: Measure>(
    bodies: &Bodies,
    moves: &Moves,
    spot: &Spot,
    (candidate, arms, before): (Candidate, [Vec2; 2], f64),
) -> Kinematics {
    let tangent = Vec2::new(-spot.normal.y, spot.normal.x);
    let frames = candidate.bodies.map(|b| moves.frame(b));
    let [a, b] = [0, 1].map(|i| frames[i].displacement(arms[i]));
    let [normal, along] = [spot.normal, tangent].map(|x| spot.gain * (a - b).dot(&x));
    let fallen = if moves.are_known() {
        M::fallen(bodies, candidate, spot, before)
    } else {
        normal
    };
    let [moved, velocity] = moves.scaled([fallen, along]);
    let [sines, _] = moves.scaled(frames.map(|frame| frame.last.sin));
    Kinematics {
        overlap: spot.depth,
        moved,
        velocity,
        sines,
    }
}

impl<M: Measure> Listing for Convex<M> {
    const POINTS: u32 = 0;
    type Pair = Candidate;
    type Key = ([u32; 2], Option<u32>);
    type Extra = Search<Candidate>;
    type Watch = Watch;

    fn list(
        &self,
        among: &Among,
        watch: &Watch,
        pairs: &mut Vec<Candidate>,
        search: &mut Search<Candidate>,
    ) {
        search.close_pairs(among, watch, pairs, |pair, margin, found| {
            M::list(among.bodies, pair, margin, &mut found.pairs);
        });
        pairs.sort_unstable_by_key(|candidate| (candidate.bodies, candidate.vertex));
    }

    fn key(candidate: Candidate, _: impl Fn(u32) -> Option<u32>) -> Option<Self::Key> {
        Some((candidate.bodies, candidate.vertex))
    }

    fn properties(&self, among: &Among, candidate: Candidate) -> PairProperties {
        let radii = (candidate.bodies).map(|b| among.bodies.state[b as usize].radius);
        pair_properties(among.bodies, candidate.bodies, radii)
    }

    fn bodies(candidate: Candidate) -> [Option<u32>; 2] {
        candidate.bodies.map(Some)
    }
}

impl<M: Measure> PairKind for Convex<M> {
    /// Normal and depth (m) of the last step, zero where there was no contact.
    type Memory = [f64; 3];
    type Found = Vec<Met>;
    type Added = Results;
    type Room<L: Law> = M;

    fn evaluate<L: Law>(
        chunk: &Chunk<Self, L>,
        measure: &mut M,
        next: &mut [(L::History, [f64; 3])],
        (met, added): (&mut Vec<Met>, &mut Results),
    ) {
        let (bodies, interval) = (chunk.on.bodies, chunk.on.interval);
        met.clear();
        added.outcomes.clear();
        added.passed = None;
        next.fill(Default::default());
        for (k, candidate) in chunk.pairs.iter().enumerate() {
            let pair = candidate.bodies;
            let closing = chunk.on.watch.closing(pair, interval.closing);
            let mut passes = |passage: Option<Passage>, overlap| {
                let passed = passage.map(|passage| Passed::Body {
                    own: Own::Body(pair[0]),
                    body: pair[1],
                    passage,
                    overlap,
                });
                added.passed = added.passed.or(passed);
            };
            let Some(spot) = measure.meet(bodies, *candidate, closing) else {
                if let Some(overlap) = M::across(bodies, *candidate) {
                    passes(Some(Passage::Across), overlap);
                }
                continue;
            };
            let frames = pair.map(|b| &bodies.frames[b as usize]);
            let arms = frames.map(|frame| spot.point - frame.center);
            let (constants, (before, was)) = (&chunk.constants[k], &chunk.history[k]);
            let [was_x, was_y, depth] = *was;
            let place = (*candidate, arms, depth);
            let kinematics = kinematics::<M>(bodies, &chunk.on.moves, &spot, place);
            let stiffness = chunk.law.stiffness(constants, spot.depth + closing);
            let mut outcome = Outcome {
                bodies: pair,
                loads: [0, 1].map(|i| PairLoad {
                    rate: rate::<M>(frames[i], arms[i], &spot, &stiffness),
                    ..PairLoad::default()
                }),
                loss: Loss::default(),
                presses: spot.depth > 0.0,
                measured: None,
            };
            let mut pressing = Pressing {
                overlap: spot.depth,
                force: 0.0,
                stiffness: stiffness.normal,
                // The contact point may move from one end of the smaller body to the other.
                width: 2.0 * spot.half_width,
            };
            if outcome.presses {
                let response = chunk.law.response(constants, &kinematics, before);
                let along = frames[1].turned(Vec2::new(was_x, was_y)).dot(&spot.normal);
                let turned = (along < TURN).then_some(closing);
                passes(M::passage(bodies, *candidate, &spot, turned), spot.depth);
                pressing.force = spot.gain * response.normal;
                let tangent = Vec2::new(-spot.normal.y, spot.normal.x);
                let along = tangent * (spot.gain * response.tangential);
                let force = spot.normal * pressing.force + along;
                for (i, sign) in [(0, 1.0), (1, -1.0)] {
                    outcome.loads[i].force = force * sign;
                    outcome.loads[i].torque = sign * (cross(arms[i], force) + response.moment);
                }
                outcome.loss = response.loss;
                if interval.measured {
                    let energy = (chunk.law).energy(constants, spot.depth, &response.history);
                    outcome.measured = Some((spot.point, energy));
                }
                next[k] = (response.history, [spot.normal.x, spot.normal.y, spot.depth]);
            } else {
                outcome.loss = chunk.law.separate(constants, &kinematics, before);
            }
            added.outcomes.push(outcome);
            met.push(Met {
                number: k,
                near: Near {
                    bodies: pair,
                    normal: spot.normal,
                    point: spot.point,
                    length: candidate.length,
                },
                pressing,
            });
        }
    }

    fn add(_: &On<Self>, added: &Results, to: &mut Targets, sums: &mut Sums) {
        for outcome in &added.outcomes {
            if let Some((at, energy)) = outcome.measured {
                let ids = outcome.bodies.map(u64::from);
                let force = outcome.loads[0].force;
                to.contacts.push(between(ids, BODY, at, force));
                sums.hold(energy);
            }
            for (b, load) in outcome.bodies.into_iter().zip(outcome.loads) {
                to.by_bodies[b as usize] += load;
            }
            sums.loss += outcome.loss;
            sums.presses += usize::from(outcome.presses);
        }
        sums.passed = sums.passed.or(added.passed);
        sums.in_reach += added.outcomes.len();
    }

    fn rates(
        found: &Vec<Met>,
        _: &[Candidate],
        [mut largest, mut of_impact]: [f64; 2],
        after: &AfterKick,
        _: f64,
    ) -> [f64; 2] {
        for Met { near, pressing, .. } in found {
            let [a, b] = near.bodies.map(|b| after.motions[b as usize].rate());
            largest = largest.max(a + b);
            if a + b > of_impact && after.impacts.is_one(after.bodies, near, pressing) {
                of_impact = a + b;
            }
        }
        [largest, of_impact]
    }

    fn fastest_crossing(_: &Search<Candidate>, _: f64) -> f64 {
        f64::INFINITY
    }

    fn each_near(
        found: &Vec<Met>,
        _: &[Candidate],
        _: &Bodies,
        _: (&Watch, f64),
        mut act: impl FnMut(usize, &Near),
    ) {
        for met in found {
            act(met.number, &met.near);
        }
    }
}

/// Contribution of a contact to a body's `Load::rate`, for a force anywhere on the width of the contact and a gain of
/// at most 1.
fn rate<M: Measure>(frame: &Frame, arm: Vec2, spot: &Spot, stiffness: &Stiffness) -> f64 {
    let [normal, tangential] = [stiffness.normal * M::STIFFENS, stiffness.tangential];
    let across = cross(arm, spot.normal).abs() + spot.half_width;
    let along = arm.dot(&spot.normal).abs() + spot.half_width;
    frame.inverse_mass * (normal + tangential)
        + frame.inverse_inertia * (normal * across * across + tangential * along * along)
        + frame.inverse_inertia * stiffness.rolling
}
