//! Contact between bodies: the literal sum over vertex-edge pairs both ways (Jiang 2020 eqs. 38 to 41, 43).
//!
//! Every term is a function `k xi^2 / 2` of one distance, so the sum is conservative; at a corner a pair counts up to
//! four times, at flush aligned edges eight times, which the step limit sees because it sums the same terms.

#![expect(
    clippy::inline_always,
    reason = "left to itself the compiler calls a function per pair, which costs a quarter of the step"
)]

use std::fmt::Debug;

use interface::Vec2;

use crate::body::{Bodies, Frame, Odometer};
use crate::contact::{contact_point, normal_on, vertex_edge};
use crate::law::{Law, Loss, Mates, Past, Stiffness, Touch, reduced};
use crate::load::Load;
use crate::mass::cross;
use crate::neighbours::{BodyList, VertexEdge};
use crate::threads::{CHUNK, Threads};

/// What the step needs from the contact between bodies, whatever the law.
pub trait BodySide: Debug + Send {
    /// Builds the list anew if a pair that is not in it could touch.
    fn update_list(&mut self, bodies: &Bodies);
    /// Evaluates every pair of the list and sums force and torque on the bodies (eqs. 39, 40). `closing` is how far
    /// two surfaces can come together before the next evaluation, in m: pairs within it count in the step limit.
    fn evaluate(
        &mut self,
        bodies: &Bodies,
        past: Past,
        closing: f64,
        threads: &Threads,
        loads: &mut [Load],
    );
    /// Bound of the squared frequency, from the summed loads, in 1/s^2.
    fn omega_sq(&self, loads: &[Load]) -> f64;
    /// Energy dissipated over the last step.
    fn loss(&self) -> Loss;
    /// Energy in the contact springs in J/m.
    fn energy(&self, bodies: &Bodies) -> f64;
    /// Accepts what was evaluated as the history of the next step.
    fn commit(&mut self);
    /// Largest damping ratio of a contact in reach; 0 where there is none.
    fn damping_ratio(&self) -> f64;
    /// Pairs that press at present.
    fn contacts(&self) -> usize;
    /// The bodies move on with surface speeds up to `speed` (m/s) for `dt` (s).
    fn advance(&mut self, speed: f64, dt: f64);
    /// Bytes of memory.
    fn bytes(&self) -> usize;
}

/// One evaluated vertex-edge pair in reach.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    /// Owner of the vertex, owner of the edge.
    bodies: [u32; 2],
    /// On the owner of the vertex, in N/m.
    force: Vec2,
    /// On either body, in N.
    torque: [f64; 2],
    /// Share in either body's `Load::rate`.
    rate: [f64; 2],
    /// Dissipated over the last step.
    loss: Loss,
    /// Whether the two press on one another.
    presses: bool,
}

/// Contact between bodies by the law `L`.
#[derive(Debug)]
pub struct BodyContacts<L: Law> {
    law: L,
    skin: f64,
    list: BodyList,
    constants: Vec<L::Pair>,
    history: Vec<L::History>,
    next: Vec<L::History>,
    scratches: Vec<Scratch>,
    /// Bodies of the pairs in reach.
    in_reach: Vec<[u32; 2]>,
    presses: usize,
    loss: Loss,
    odometer: Option<Odometer>,
}

impl<L: Law> BodyContacts<L> {
    /// No list yet.
    pub fn new(law: L, skin: f64) -> Self {
        Self {
            law,
            skin,
            list: BodyList::default(),
            constants: Vec::new(),
            history: Vec::new(),
            next: Vec::new(),
            scratches: Vec::new(),
            in_reach: Vec::new(),
            presses: 0,
            loss: Loss::default(),
            odometer: None,
        }
    }

    /// Builds the list, and moves the histories to it: both lists are in the same order, so one walk finds them.
    fn build(&mut self, bodies: &Bodies) {
        let old = std::mem::take(&mut self.list.pairs);
        self.list.build(bodies, self.skin);
        let pairs = self.list.pairs.iter();
        if size_of::<L::History>() > 0 {
            // `next` holds nothing between steps; it becomes the new history.
            let mut old = old.iter().zip(&self.history).peekable();
            self.next.clear();
            self.next.extend(pairs.clone().map(|pair| {
                while old.next_if(|(o, _)| o.key() < pair.key()).is_some() {}
                let same = old.next_if(|(o, _)| o.key() == pair.key());
                same.map_or_else(L::History::default, |(_, history)| *history)
            }));
            std::mem::swap(&mut self.history, &mut self.next);
        }
        self.history.resize(pairs.len(), L::History::default());
        self.next.resize(pairs.len(), L::History::default());
        self.constants.clear();
        self.constants.extend(pairs.map(|pair| {
            let [v, e] = pair.bodies.map(|b| &bodies.state[b as usize]);
            let inverse = v.inverse_mass + e.inverse_mass;
            self.law.pair(&Mates {
                mass: if inverse > 0.0 { 1.0 / inverse } else { 0.0 }, // bodies that can only turn: no dashpot
                radius: reduced(v.radius, e.radius),
                surfaces: pair.bodies.map(|b| bodies.fixed[b as usize].surface),
            })
        }));
        self.odometer.get_or_insert_default().reset(bodies);
    }
}

/// Vector from the edge to the vertex of a pair, and its squared length.
#[inline(always)]
fn separation(bodies: &Bodies, pair: &VertexEdge) -> (Vec2, f64) {
    let at = |i: u32| bodies.outline[i as usize];
    let inverse = bodies.inverse_length_sq[pair.edge[0] as usize];
    vertex_edge(at(pair.vertex), at(pair.edge[0]), at(pair.edge[1]), inverse)
}

/// What a chunk of pairs is worked on in. The work is done in passes over the chunk: a contact is one long chain of
/// dependent operations, and short passes let the processor work on several contacts at once.
#[derive(Debug, Default)]
struct Scratch {
    near: Vec<Near>,
    met: Vec<Met>,
    outcomes: Vec<Outcome>,
}

/// A pair in reach.
#[derive(Debug, Clone, Copy, Default)]
struct Near {
    /// Vector from the edge to the vertex in m; then the unit normal `N`.
    normal: Vec2,
    /// Squared distance in m^2; then the overlap `xi` in m.
    overlap: f64,
    /// Index in the list.
    index: usize,
}

/// How the two surfaces of a pair in reach met.
#[derive(Debug, Clone, Copy)]
struct Met {
    arms: [Arms; 2],
    touch: Touch,
}

/// Finds the pairs in reach among those from `from` on. Without a branch, because which pairs of a list touch is not
/// predictable.
#[inline(always)]
fn find_near<'a>(
    bodies: &Bodies,
    pairs: &[VertexEdge],
    from: usize,
    closing: f64,
    near: &'a mut Vec<Near>,
) -> &'a [Near] {
    near.resize(CHUNK, Near::default());
    let mut count = 0;
    for (k, pair) in pairs.iter().enumerate() {
        let (away, distance_sq) = separation(bodies, pair);
        let far = pair.reach + closing;
        near[count] = Near {
            normal: away,
            overlap: distance_sq,
            index: from + k,
        };
        count += usize::from(distance_sq < far * far);
    }
    for near in &mut near[..count] {
        let pair = &pairs[near.index - from];
        let distance = near.overlap.sqrt();
        near.overlap = pair.reach - distance;
        if distance > 0.0 {
            near.normal /= distance;
        } else {
            let [a, b] = pair.edge.map(|i| bodies.outline[i as usize]);
            near.normal = normal_on(a, b);
        }
    }
    &near[..count]
}

/// Contact point (eq. 41), lever arms, and how the surfaces have moved there.
#[inline(always)]
fn meet<const MOTION: bool>(bodies: &Bodies, past: Past, pair: &VertexEdge, near: &Near) -> Met {
    let (normal, overlap) = (near.normal, near.overlap);
    let [v, e] = pair.bodies.map(|b| &bodies.frames[b as usize]);
    let vertex = bodies.outline[pair.vertex as usize];
    let p = contact_point(vertex, pair.radius, overlap, normal);
    let arms = [
        Arms::new(p - v.center, normal),
        Arms::new(p - e.center, normal),
    ];
    let mut touch = Touch {
        overlap,
        ..Touch::default()
    };
    if MOTION && past.dt > 0.0 {
        let shift = v.shift - e.shift;
        let turned = [arms[0].displacement(v), arms[1].displacement(e)];
        touch.moved = [
            shift.dot(&normal) + (turned[0][0] - turned[1][0]),
            cross(normal, shift) + (turned[0][1] - turned[1][1]),
        ];
        touch.velocity = touch.moved.map(|u| u * past.per_dt);
        // The sine is the angle but for a third-order term; exact rotation matters to lengths only.
        touch.rolled = v.sin - e.sin;
    } else if MOTION {
        let [v, e] = pair.bodies.map(|b| &bodies.state[b as usize]);
        let velocity = v.velocity - e.velocity;
        touch.velocity = [
            velocity.dot(&normal) + (v.spin * arms[0].n - e.spin * arms[1].n),
            cross(normal, velocity) + (v.spin * arms[0].t - e.spin * arms[1].t),
        ];
    }
    Met { arms, touch }
}

impl<L: Law> BodyContacts<L> {
    /// Law, force and torques of a pair in reach.
    #[inline(always)]
    fn press(
        &self,
        bodies: &Bodies,
        closing: f64,
        near: &Near,
        met: &Met,
    ) -> (Outcome, L::History) {
        let k = near.index;
        let (pair, constants, before) = (&self.list.pairs[k], &self.constants[k], &self.history[k]);
        let (normal, arms, touch) = (near.normal, &met.arms, &met.touch);
        let [v, e] = pair.bodies.map(|b| &bodies.frames[b as usize]);
        let stiffness = self.law.stiffness(constants, touch.overlap + closing);
        let mut outcome = Outcome {
            bodies: pair.bodies,
            force: Vec2::zeros(),
            torque: [0.0; 2],
            rate: [arms[0].rate(v, stiffness), arms[1].rate(e, stiffness)],
            loss: Loss::default(),
            presses: touch.overlap > 0.0,
        };
        if touch.overlap <= 0.0 {
            outcome.loss = self.law.part(constants, touch, before);
            return (outcome, L::History::default());
        }
        let press = self.law.press(constants, touch, before);
        let (f_n, f_t) = (press.normal, press.tangential);
        outcome.force = Vec2::new(
            normal.x.mul_add(f_n, -(normal.y * f_t)),
            normal.y.mul_add(f_n, normal.x * f_t),
        );
        outcome.torque = [
            arms[0].moment(f_n, f_t) + press.moment,
            -arms[1].moment(f_n, f_t) - press.moment,
        ];
        outcome.loss = press.loss;
        (outcome, press.history)
    }
}

/// Lever arms of a contact: `r x N` and `r x T`, from which everything about a body's rotation follows.
#[derive(Debug, Clone, Copy)]
struct Arms {
    n: f64,
    t: f64,
}

impl Arms {
    #[inline(always)]
    fn new(r: Vec2, normal: Vec2) -> Self {
        Self {
            n: cross(r, normal),
            t: r.dot(&normal), // T is N turned by +90 degrees, so r x T = r . N
        }
    }

    /// Displacement of the material at `r` by the last step's rotation, along `N` and `T`: exact at any angle.
    #[inline(always)]
    fn displacement(self, frame: &Frame) -> [f64; 2] {
        [
            frame.sin.mul_add(self.n, frame.versine * self.t),
            frame.sin.mul_add(self.t, -(frame.versine * self.n)),
        ]
    }

    /// `sum k (1/m + (r x n)^2 / I)` over both directions, and `k_r / I`.
    #[inline(always)]
    fn rate(self, frame: &Frame, k: Stiffness) -> f64 {
        let along = (k.normal * self.n).mul_add(self.n, k.rolling);
        let turning = (k.tangential * self.t).mul_add(self.t, along);
        frame
            .inverse_inertia
            .mul_add(turning, (k.normal + k.tangential) * frame.inverse_mass)
    }

    #[inline(always)]
    fn moment(self, f_n: f64, f_t: f64) -> f64 {
        self.n.mul_add(f_n, self.t * f_t)
    }
}

impl<L: Law> BodySide for BodyContacts<L> {
    fn update_list(&mut self, bodies: &Bodies) {
        // Both bodies of a pair may move, so each may use half of the skin.
        let safe = |o: &mut Odometer| o.stays_below(0.5 * self.skin, bodies);
        if !self.odometer.as_mut().is_some_and(safe) {
            self.build(bodies);
        }
    }

    fn evaluate(
        &mut self,
        bodies: &Bodies,
        past: Past,
        closing: f64,
        threads: &Threads,
        loads: &mut [Load],
    ) {
        let mut next = std::mem::take(&mut self.next);
        let mut scratches = std::mem::take(&mut self.scratches);
        let mut in_reach = std::mem::take(&mut self.in_reach);
        let (mut loss, mut presses) = (Loss::default(), 0);
        in_reach.clear();
        let chunk = |from: usize, next: &mut [L::History], scratch: &mut Scratch| {
            let pairs = &self.list.pairs[from..from + next.len()];
            next.fill(L::History::default());
            let near = find_near(bodies, pairs, from, closing, &mut scratch.near);
            scratch.met.clear();
            scratch.met.extend(near.iter().map(|near| {
                let pair = &pairs[near.index - from];
                if L::MOTION {
                    meet::<true>(bodies, past, pair, near)
                } else {
                    meet::<false>(bodies, past, pair, near)
                }
            }));
            scratch.outcomes.clear();
            let met = near.iter().zip(&scratch.met);
            scratch.outcomes.extend(met.map(|(near, met)| {
                let (outcome, history) = self.press(bodies, closing, near, met);
                next[near.index - from] = history;
                outcome
            }));
        };
        threads.chunks(&mut next, &mut scratches, chunk, |scratch: &Scratch| {
            for outcome in &scratch.outcomes {
                in_reach.push(outcome.bodies);
                let [v, e] = outcome.bodies.map(|b| b as usize);
                loads[v].force += outcome.force;
                loads[v].torque += outcome.torque[0];
                loads[v].rate += outcome.rate[0];
                loads[e].force -= outcome.force;
                loads[e].torque += outcome.torque[1];
                loads[e].rate += outcome.rate[1];
                loss += outcome.loss;
                presses += usize::from(outcome.presses);
            }
        });
        self.next = next;
        self.scratches = scratches;
        self.in_reach = in_reach;
        self.loss = loss;
        self.presses = presses;
    }

    /// `max over contacts (Lambda_A + Lambda_B)`, with `Lambda` the trace of each body's own `M^-1 K`.
    ///
    /// In contact space the operator is a sum over bodies of positive parts, each supported on that body's contacts
    /// and of norm at most `Lambda_b`; a vector's quotient is at most `sum_b Lambda_b |x on b's contacts|^2`, hence
    /// at most the largest `Lambda_A + Lambda_B` of one contact. Exact for two bodies and one contact.
    fn omega_sq(&self, loads: &[Load]) -> f64 {
        let sums = self
            .in_reach
            .iter()
            .map(|&[a, b]| loads[a as usize].rate + loads[b as usize].rate);
        sums.fold(0.0, f64::max)
    }

    fn loss(&self) -> Loss {
        self.loss
    }

    fn energy(&self, bodies: &Bodies) -> f64 {
        let pairs = self.list.pairs.iter().zip(&self.constants).zip(&self.next);
        let energy = |((pair, constants), history): ((&VertexEdge, _), _)| {
            let overlap = pair.reach - separation(bodies, pair).1.sqrt();
            if overlap > 0.0 {
                self.law.energy(constants, overlap, history)
            } else {
                0.0
            }
        };
        pairs.map(energy).sum()
    }

    fn commit(&mut self) {
        std::mem::swap(&mut self.history, &mut self.next);
    }

    fn damping_ratio(&self) -> f64 {
        if self.in_reach.is_empty() {
            0.0
        } else {
            self.law.damping_ratio()
        }
    }

    fn contacts(&self) -> usize {
        self.presses
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        if let Some(odometer) = &mut self.odometer {
            odometer.advance(speed, dt);
        }
    }

    fn bytes(&self) -> usize {
        self.list.pairs.capacity() * size_of::<VertexEdge>()
            + self.constants.capacity() * size_of::<L::Pair>()
            + self.scratches.len()
                * CHUNK
                * (size_of::<Outcome>() + size_of::<Near>() + size_of::<Met>())
            + 2 * self.history.capacity() * size_of::<L::History>()
    }
}
