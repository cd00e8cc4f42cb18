//! Contact between bodies: the literal sum over vertex-edge pairs both ways (Jiang 2020 eqs. 38 to 41, 43).
//!
//! Every term is a function `k xi^2 / 2` of one distance, so the sum is conservative; at a corner a pair counts up to
//! four times, at flush aligned edges eight times, which the step limit sees because it sums the same terms.

use std::fmt::Debug;

use interface::Vec2;

use crate::body::{Bodies, Reference};
use crate::contact::{contact_point, vertex_edge};
use crate::law::{History, Law, Loss, Touch};
use crate::load::Load;
use crate::mass::cross;
use crate::neighbours::{BodyList, VertexEdge};
use crate::threads::Threads;

/// What the step needs from the contact between bodies, whatever the law.
pub trait BodySide: Debug + Send {
    /// Builds the list anew if a pair that is not in it could touch.
    fn update_list(&mut self, bodies: &Bodies);
    /// Evaluates every pair of the list. `closing` is how far two surfaces can come together before the next
    /// evaluation, in m: pairs within it count in the step limit.
    fn evaluate(&mut self, bodies: &Bodies, dt_before: f64, closing: f64, threads: &Threads);
    /// Sums the evaluated pairs (eqs. 39, 40).
    fn gather(&self, loads: &mut [Load]);
    /// Bound of the squared frequency, from the gathered loads, in 1/s^2.
    fn omega_sq(&self, loads: &[Load]) -> f64;
    /// Energy dissipated over the last step.
    fn loss(&self) -> Loss;
    /// Energy in the contact springs in J/m.
    fn energy(&self, bodies: &Bodies) -> f64;
    /// Accepts what was evaluated as the history of the next step.
    fn commit(&mut self);
    /// Damping ratio of the law.
    fn damping_ratio(&self) -> f64;
    /// Pairs that touch at present.
    fn contacts(&self) -> usize;
    /// Bytes of memory.
    fn bytes(&self) -> usize;
}

/// One evaluated vertex-edge pair.
#[derive(Debug, Clone, Copy, Default)]
struct Outcome {
    /// On the owner of the vertex, in N/m.
    force: Vec2,
    /// On either body, in N.
    torque: [f64; 2],
    /// Share in either body's `Load::rate`; both zero where the pair is out of reach.
    rate: [f64; 2],
}

impl Outcome {
    fn in_reach(&self) -> bool {
        self.rate[0] + self.rate[1] > 0.0
    }
}

/// Contact between bodies by the law `L`.
#[derive(Debug)]
pub struct BodyContacts<L: Law> {
    law: L,
    skin: f64,
    list: BodyList,
    outcomes: Vec<Outcome>,
    history: Vec<L::History>,
    next: Vec<L::History>,
    built_with: Option<Reference>,
}

/// Overlap (eq. 38) of a vertex-edge pair, and its normal from the edge to the vertex.
#[inline]
fn overlap_of(bodies: &Bodies, pair: &VertexEdge) -> (f64, Vec2) {
    let [v, e] = pair.bodies.map(|b| &bodies.state[b as usize]);
    let at = |i: u32| bodies.outline[i as usize];
    let (distance, normal) = vertex_edge(at(pair.vertex), at(pair.edge[0]), at(pair.edge[1]));
    (v.radius + e.radius - distance, normal)
}

impl<L: Law> BodyContacts<L> {
    /// No list yet.
    pub fn new(law: L, skin: f64) -> Self {
        Self {
            law,
            skin,
            list: BodyList::default(),
            outcomes: Vec::new(),
            history: Vec::new(),
            next: Vec::new(),
            built_with: None,
        }
    }

    /// Moves the histories of `old` to the new list: both are in the same order, so one walk finds them.
    fn carry_history(&mut self, old: &[VertexEdge]) {
        let before = std::mem::take(&mut self.history);
        let mut old = old.iter().zip(before).peekable();
        let carried = self.list.pairs.iter().map(|pair| {
            while old.next_if(|(o, _)| o.key() < pair.key()).is_some() {}
            let same = old.next_if(|(o, _)| *o == pair);
            same.map_or_else(L::History::default, |(_, history)| history)
        });
        self.history = carried.collect();
    }

    /// One pair: geometry, law, contact point.
    #[inline]
    fn pair(
        &self,
        bodies: &Bodies,
        dt_before: f64,
        closing: f64,
        k: usize,
    ) -> (Outcome, L::History) {
        let pair = &self.list.pairs[k];
        let (overlap, normal) = overlap_of(bodies, pair);
        let mut outcome = Outcome::default();
        if overlap <= -closing {
            return (outcome, L::History::default());
        }
        let [v, e] = pair.bodies.map(|b| &bodies.state[b as usize]);
        let tangent = Vec2::new(-normal.y, normal.x);
        let p = contact_point(
            bodies.outline[pair.vertex as usize],
            v.radius,
            overlap,
            normal,
        );
        let r = [p - v.center, p - e.center];
        let arms = r.map(|r| [cross(r, normal), cross(r, tangent)]);
        let mut touch = Touch {
            overlap,
            ..Touch::default()
        };
        if L::MOTION {
            let moved = if dt_before > 0.0 {
                v.turn.displacement(r[0]) - e.turn.displacement(r[1])
            } else {
                Vec2::zeros()
            };
            let velocity = v.velocity_at(r[0]) - e.velocity_at(r[1]);
            touch.moved = [moved.dot(&normal), moved.dot(&tangent)];
            touch.velocity = [velocity.dot(&normal), velocity.dot(&tangent)];
            touch.mass = 1.0 / (v.inverse_mass + e.inverse_mass);
        }
        if overlap > -closing {
            let [k_n, k_t] = self.law.stiffness(overlap);
            let rate =
                |m: f64, i: f64, [n, t]: [f64; 2]| k_n * (m + i * n * n) + k_t * (m + i * t * t);
            outcome.rate = [
                rate(v.inverse_mass, v.inverse_inertia, arms[0]),
                rate(e.inverse_mass, e.inverse_inertia, arms[1]),
            ];
        }
        let before = &self.history[k];
        if overlap <= 0.0 {
            return (outcome, self.law.part(&touch, before));
        }
        let press = self.law.press(&touch, before);
        outcome.force = normal * press.normal + tangent * press.tangential;
        let moment = |[n, t]: [f64; 2]| n * press.normal + t * press.tangential;
        outcome.torque = [moment(arms[0]), -moment(arms[1])];
        (outcome, press.history)
    }
}

impl<L: Law> BodySide for BodyContacts<L> {
    fn update_list(&mut self, bodies: &Bodies) {
        // Both bodies of a pair may move, so each may use half of the skin.
        let safe = |r: &Reference| 2.0 * r.travelled(bodies) < self.skin;
        if self.built_with.as_ref().is_some_and(safe) {
            return;
        }
        let old = std::mem::take(&mut self.list.pairs);
        self.list.build(bodies, self.skin);
        if size_of::<L::History>() > 0 {
            self.carry_history(&old);
        } else {
            self.history
                .resize(self.list.pairs.len(), L::History::default());
        }
        self.next
            .resize(self.list.pairs.len(), L::History::default());
        self.outcomes
            .resize(self.list.pairs.len(), Outcome::default());
        self.built_with.get_or_insert_default().set(bodies);
    }

    fn evaluate(&mut self, bodies: &Bodies, dt_before: f64, closing: f64, threads: &Threads) {
        let mut outcomes = std::mem::take(&mut self.outcomes);
        let mut next = std::mem::take(&mut self.next);
        threads.fill(&mut outcomes, &mut next, |k| {
            self.pair(bodies, dt_before, closing, k)
        });
        self.outcomes = outcomes;
        self.next = next;
    }

    fn gather(&self, loads: &mut [Load]) {
        for (pair, outcome) in self.list.pairs.iter().zip(&self.outcomes) {
            if !outcome.in_reach() {
                continue;
            }
            let [v, e] = pair.bodies.map(|b| b as usize);
            loads[v].force += outcome.force;
            loads[v].torque += outcome.torque[0];
            loads[v].rate += outcome.rate[0];
            loads[v].in_reach = true;
            loads[e].force -= outcome.force;
            loads[e].torque += outcome.torque[1];
            loads[e].rate += outcome.rate[1];
            loads[e].in_reach = true;
        }
    }

    /// `max over contacts (Lambda_A + Lambda_B)`, with `Lambda` the trace of each body's own `M^-1 K`.
    ///
    /// In contact space the operator is a sum over bodies of positive parts, each supported on that body's contacts
    /// and of norm at most `Lambda_b`; a vector's quotient is at most `sum_b Lambda_b |x on b's contacts|^2`, hence
    /// at most the largest `Lambda_A + Lambda_B` of one contact. Exact for two bodies and one contact.
    fn omega_sq(&self, loads: &[Load]) -> f64 {
        let pairs = self.list.pairs.iter().zip(&self.outcomes);
        pairs
            .filter(|(_, outcome)| outcome.in_reach())
            .map(|(pair, _)| pair.bodies.iter().map(|&b| loads[b as usize].rate).sum())
            .fold(0.0, f64::max)
    }

    fn loss(&self) -> Loss {
        let mut sum = Loss::default();
        if size_of::<L::History>() > 0 {
            for loss in self.next.iter().map(History::loss) {
                sum.friction += loss.friction;
                sum.viscous += loss.viscous;
            }
        }
        sum
    }

    fn energy(&self, bodies: &Bodies) -> f64 {
        let pairs = self.list.pairs.iter().zip(&self.next);
        pairs
            .map(|(pair, history)| self.law.energy(overlap_of(bodies, pair).0, history))
            .sum()
    }

    fn commit(&mut self) {
        std::mem::swap(&mut self.history, &mut self.next);
    }

    fn damping_ratio(&self) -> f64 {
        self.law.damping_ratio()
    }

    fn contacts(&self) -> usize {
        self.outcomes
            .iter()
            .filter(|o| o.force != Vec2::zeros())
            .count()
    }

    fn bytes(&self) -> usize {
        self.list.pairs.capacity() * size_of::<VertexEdge>()
            + self.outcomes.capacity() * size_of::<Outcome>()
            + 2 * self.history.capacity() * size_of::<L::History>()
    }
}
