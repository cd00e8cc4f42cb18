//! Contact between bodies: the literal sum over vertex-edge pairs both ways (Jiang 2020 eqs. 38 to 41, 43).
//!
//! Every term is a function `k xi^2 / 2` of one distance, so the sum is conservative. At a corner a pair has up to four
//! terms, and at aligned edges eight. The step limit sums the same terms, so it takes this into account.
//!
//! As in [`crate::contact::points`], an evaluation does not change the history; `commit` does.

#![expect(
    clippy::inline_always,
    reason = "without it the compiler calls a function for each pair, which costs a quarter of the step"
)]

use std::fmt::Debug;
use std::sync::Mutex;

use interface::Vec2;
use interface::message::wire::ContactState;
use interface::saved::{pack, unpack};
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::body::edge::vertex_edge;
use crate::body::load::PairLoad;
use crate::contact::approach::{Near, crossing_rate};
use crate::contact::frame_contacts::between_bodies;
use crate::contact::impact::{Impacts, Nears, Pressing, Relative, SurfaceMotion};
use crate::contact::pair_geometry::{
    Answers, LANES, Lanes, Moves, Numbers, Room, Separations, away, bits, dot, each, first, gather,
    gather_vec,
};
use crate::contact::passage::{Passage, PassedBodies};
use crate::contact::versions::Versions;
use crate::law::history;
use crate::law::{LastStep, Law, Loss, PairProperties, reduced};
use crate::lists::neighbours::{BodyList, VertexEdge};
use crate::lists::watch::{Ahead, Watch};
use crate::saved::one_for_each;
use crate::threads::{CHUNK, Spare, Threads};
use mechanics::outline::contact_point;

/// What a step needs from the contact between bodies, for any law.
pub trait BodySide: Debug + Send + Sync {
    /// Builds a new list if a pair that is not in the present one could touch within two steps, with surface speeds up
    /// to `speed` (m/s).
    fn update_list(&mut self, bodies: &Bodies, ahead: &Ahead, speed: f64);
    /// Evaluates every pair of the list. `closing` is the distance in m by which two surfaces can approach within two
    /// steps: pairs within it count in the step limit. The sums of force and torque on each body (eqs. 39, 40), in the
    /// order of the list, become its `loads`.
    fn evaluate(
        &mut self,
        bodies: &Bodies,
        last_step: LastStep,
        closing: f64,
        threads: &Threads,
        loads: &mut [PairLoad],
    );
    /// Upper bounds of the squared frequency in 1/s^2, with the `motions` of all bodies: of all pairs in reach, and of
    /// those whose contact opens or closes ([`crate::contact::impact`]); 0 if there is none.
    fn omega_sq(
        &self,
        bodies: &Bodies,
        motions: &[SurfaceMotion],
        impacts: &Impacts,
        threads: &Threads,
    ) -> [f64; 2];
    /// The largest [`crossing_rate`] of a pair in reach in 1/s, or a number not above `known` if none is larger than
    /// that. `kicked` has the velocities and spins after the kick, and `speed` (m/s) bounds the speed of surfaces.
    fn crossing(&self, bodies: &Bodies, kicked: &[(Vec2, f64)], speed: f64, known: f64) -> f64;
    /// The first two bodies, in the order of the list, whose overlap in the last evaluation was too large.
    fn passed(&self, bodies: &Bodies) -> Option<PassedBodies>;
    /// Energy dissipated over the last step.
    fn loss(&self) -> Loss;
    /// Energy in the contact springs in J/m.
    fn energy(&self, bodies: &Bodies) -> f64;
    /// Appends the pairs of the last evaluation that press to `found`, in the order of the list.
    fn collect_contacts(&self, bodies: &Bodies, found: &mut Vec<ContactState>);
    /// Keeps the list that was evaluated.
    fn keep_list(&mut self);
    /// Makes the result of the evaluation the history of the next step, and keeps the list.
    fn commit(&mut self);
    /// Largest damping ratio of a contact in reach; 0 if there is none.
    fn damping_ratio(&self) -> f64;
    /// Pairs that press at present.
    fn contacts(&self) -> usize;
    /// The bodies move with surface speeds up to `speed` (m/s) for `dt` (s).
    fn advance(&mut self, speed: f64, dt: f64);
    /// Bytes of memory.
    fn bytes(&self) -> usize;
    /// The bytes of its state.
    fn save(&self) -> Vec<u8>;
    /// Restores a saved state, with bodies of the same configuration.
    ///
    /// # Errors
    /// A refusal if the bytes are no state of this configuration.
    fn restore(&mut self, saved: &[u8], bodies: &Bodies) -> Result<(), Refusal>;
}

/// The state of the contacts of a list. The list follows from the poses of the bodies at which it was built.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "H: history::Numbers")]
struct State<H> {
    watch: Watch,
    #[serde(with = "crate::law::history")]
    history: Vec<H>,
}

/// What is kept from one step to the next.
#[derive(Debug)]
struct Kept<L: Law> {
    state: State<L::History>,
    list: BodyList,
    constants: Vec<L::Pair>,
    /// Whether all pairs of the chunk are of discs.
    round: Vec<bool>,
}

/// Contact between bodies by the law `L`.
#[derive(Debug)]
pub struct BodyContacts<L: Law> {
    law: L,
    lists: Versions<Kept<L>>,
    next: Vec<L::History>,
    separations: Spare<Box<Separations>>,
    /// The results of each chunk.
    outcomes: Vec<Outcomes>,
    /// The argument of the last evaluation.
    closing: f64,
    /// How far two surfaces may approach one another before a pair that the last evaluation did not look at may come
    /// into reach, in m; `None` if it looked at all.
    slack: Option<f64>,
    /// How many of the two versions of the histories may have one of a pair that is not looked at.
    stale: u32,
}

impl<L: Law> Kept<L> {
    fn new(skin: f64) -> Self {
        Self::of(State {
            watch: Watch::new(skin),
            history: Vec::new(),
        })
    }

    /// This state without its list.
    fn of(state: State<L::History>) -> Self {
        Self {
            state,
            list: BodyList::default(),
            constants: Vec::new(),
            round: Vec::new(),
        }
    }

    /// Builds the list for the positions of bodies and the margins of `watch`.
    fn build(&mut self, law: &L, bodies: &Bodies) {
        self.list.build(bodies, &self.state.watch);
        let pairs = self.list.pairs.iter();
        self.constants.clear();
        self.constants.extend(pairs.map(|pair| {
            law.pair(&PairProperties {
                mass: bodies.reduced_mass(pair.bodies),
                radius: reduced(pair.radius, pair.reach - pair.radius),
                surfaces: pair.bodies.map(|b| bodies.properties[b as usize].surface),
            })
        }));
        let disc = |b: u32| bodies.outline_of(b as usize).len() == 1;
        let round = |chunk: &[VertexEdge]| {
            chunk
                .iter()
                .all(|pair| pair.bodies.iter().all(|&b| disc(b)))
        };
        self.round.clear();
        self.round.extend(self.list.pairs.chunks(CHUNK).map(round));
    }

    /// Takes the histories from an `old` list. Both lists have the same order, so one pass finds them.
    fn carry(&mut self, old: &Self) {
        let pairs = self.list.pairs.iter();
        self.state.history.clear();
        if size_of::<L::History>() > 0 {
            let mut old = old.list.pairs.iter().zip(&old.state.history).peekable();
            self.state.history.extend(pairs.clone().map(|pair| {
                while old.next_if(|(o, _)| o.key() < pair.key()).is_some() {}
                let same = old.next_if(|(o, _)| o.key() == pair.key());
                same.map_or_else(L::History::default, |(_, history)| *history)
            }));
        }
        self.state
            .history
            .resize(pairs.len(), L::History::default());
    }

    fn bytes(&self) -> usize {
        self.list.pairs.capacity() * size_of::<VertexEdge>()
            + self.constants.capacity() * size_of::<L::Pair>()
            + self.state.history.capacity() * size_of::<L::History>()
    }
}

impl<L: Law> BodyContacts<L> {
    /// No list yet.
    pub fn new(law: L, skin: f64) -> Self {
        Self {
            law,
            lists: Versions {
                kept: Kept::new(skin),
                fresh: Kept::new(skin),
                rebuilt: false,
            },
            next: Vec::new(),
            separations: Spare::default(),
            outcomes: Vec::new(),
            closing: 0.0,
            slack: None,
            stale: 2,
        }
    }

    /// Which pairs the next evaluation looks at, if pairs within `closing` (m) count. A list has several times as many
    /// pairs as there are in reach, and most come no nearer than some distance for many steps.
    fn look(&self, closing: f64) -> Look {
        if self.lists.rebuilt {
            return Look::All;
        }
        match self.slack {
            Some(slack) if slack > closing => Look::Same,
            _ => {
                // Surfaces approach by half of `closing` in a step, or less.
                let skin = self.lists.current().state.watch.skin();
                let more = (20.0 * closing).min(0.25 * skin);
                if more > 2.0 * closing {
                    Look::Within(closing + more)
                } else {
                    Look::All
                }
            }
        }
    }
}

/// Vector from the edge to the vertex of a pair, and its squared length.
#[inline(always)]
fn separation(bodies: &Bodies, pair: &VertexEdge) -> (Vec2, f64) {
    let at = |i: u32| bodies.outline[i as usize];
    let inverse = bodies.inverse_length_sq[pair.edge[0] as usize];
    vertex_edge(at(pair.vertex), at(pair.edge[0]), at(pair.edge[1]), inverse)
}

/// Which pairs of a list an evaluation looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Look {
    /// At all.
    All,
    /// At those whose surfaces are within this distance in m.
    Within(f64),
    /// At the same pairs as the evaluation before.
    Same,
}

/// The pairs of a chunk that are in reach.
#[derive(Debug)]
struct Outcomes {
    /// The pairs of the chunk that the evaluation looked at. The others are too far apart.
    looked_at: Numbers,
    count: usize,
    /// Owner of the vertex, then owner of the edge.
    pair_bodies: Room<[u32; 2]>,
    /// Their indices within the chunk.
    numbers: Room<u32>,
    /// Normal force in N/m and bound of the stiffness in N/m of each pair.
    force: Room<f64>,
    stiffness: Room<f64>,
    /// The largest stiffness in N/m of a pair that presses, lane by lane.
    stiffest: Lanes,
    /// The loads on the owners of the vertices, and on those of the edges.
    on_vertex: Room<PairLoad>,
    on_edge: Room<PairLoad>,
    /// Dissipated over the last step by friction and by dashpots in J/m, lane by lane.
    loss: [Lanes; 2],
    /// Pairs that press on one another.
    presses: usize,
    /// The first pair whose overlap is too large.
    deep: Option<PassedBodies>,
}

impl Default for Outcomes {
    fn default() -> Self {
        Self {
            looked_at: Numbers::default(),
            count: 0,
            pair_bodies: [[0; 2]; CHUNK + LANES],
            numbers: [0; CHUNK + LANES],
            force: [0.0; CHUNK + LANES],
            stiffness: [0.0; CHUNK + LANES],
            stiffest: Lanes::ZERO,
            on_vertex: [PairLoad::default(); CHUNK + LANES],
            on_edge: [PairLoad::default(); CHUNK + LANES],
            loss: [Lanes::ZERO; 2],
            presses: 0,
            deep: None,
        }
    }
}

impl Outcomes {
    /// The pairs in reach, with the loads on their bodies.
    fn each(&self) -> impl Iterator<Item = ([usize; 2], [&PairLoad; 2])> {
        let pair_bodies = self.pair_bodies[..self.count]
            .iter()
            .map(|m| m.map(|b| b as usize));
        let loads = self.on_vertex.iter().zip(&self.on_edge);
        let loads = loads.map(|(v, e)| [v, e]);
        pair_bodies.zip(loads)
    }

    /// Which of the contacts of four entries open or close, as bits.
    #[inline(always)]
    fn impacts(
        &self,
        entries: [u32; LANES],
        bodies: &Bodies,
        pairs: &[VertexEdge],
        by: &Impacts,
    ) -> u32 {
        let at = each(|l| entries[l] as usize);
        let pair = each(|l| &pairs[self.numbers[at[l]] as usize]);
        let away = away::<false>(bodies, pair);
        let distance = dot(away, away).sqrt();
        // If a vertex is exactly on an edge, its normal is not a number and nothing opens or closes. The overlap is too
        // large, and the run ends with this step.
        let near = Nears {
            bodies: [each(|l| pair[l].bodies[0]), each(|l| pair[l].bodies[1])],
            normal: [away[0] / distance, away[1] / distance],
            point: gather_vec(|l| bodies.outline[pair[l].vertex as usize]),
        };
        let pressing = Pressing {
            overlap: gather(|l| pair[l].reach) - distance,
            force: gather(|l| self.force[at[l]]),
            stiffness: gather(|l| self.stiffness[at[l]]),
            width: Lanes::ZERO,
        };
        by.among(bodies, &near, &pressing)
    }

    /// The larger ones of `known` and of the rates of these pairs in 1/s^2: of all, and of those whose contact opens or
    /// closes.
    fn rates(
        &self,
        [largest, mut of_impact]: [f64; 2],
        bodies: &Bodies,
        motions: &[SurfaceMotion],
        pairs: &[VertexEdge],
        stiffest: f64,
        impacts: &Impacts,
    ) -> [f64; 2] {
        let mut largest = Lanes::splat(largest);
        let mut asked = Numbers::default();
        for i in (0..self.count).step_by(LANES) {
            let four = &self.pair_bodies[i..i + LANES];
            let both = Relative::of(motions, each(|l| four[l]));
            largest = largest.fast_max(both.rate * first(self.count - i));
            let calm = bits(self.presses.saturating_sub(i)) & both.calm(stiffest, impacts);
            let higher = both.rate.simd_gt(Lanes::splat(of_impact)).to_bitmask();
            let may_open = higher & !calm & bits(self.count - i);
            if may_open != 0 {
                asked.append(may_open, i as u32);
            }
        }
        asked.pad();
        for i in (0..asked.count()).step_by(LANES) {
            let entries = asked.four(i);
            let found = self.impacts(entries, bodies, pairs, impacts);
            for (l, entry) in entries.into_iter().enumerate() {
                if found >> l & 1 == 1 {
                    let of = self.pair_bodies[entry as usize].map(|b| &motions[b as usize]);
                    of_impact = of_impact.max(of[0].rate() + of[1].rate());
                }
            }
        }
        let largest = largest.to_array().into_iter().fold(0.0, f64::max);
        [largest, of_impact]
    }

    /// Adds the first `count` lanes of four evaluated pairs.
    #[inline(always)]
    fn add(
        &mut self,
        count: usize,
        numbers: [u32; LANES],
        pair_bodies: [[u32; 2]; LANES],
        answers: &Answers,
        loads: [[PairLoad; LANES]; 2],
    ) {
        let lanes = self.count..self.count + LANES;
        assert!(lanes.end <= CHUNK + LANES);
        self.pair_bodies[lanes.clone()].copy_from_slice(&pair_bodies);
        self.numbers[lanes.clone()].copy_from_slice(&numbers);
        self.force[lanes.clone()].copy_from_slice(&answers.force[0]);
        self.stiffness[lanes.clone()].copy_from_slice(&answers.stiffness[0]);
        self.on_vertex[lanes.clone()].copy_from_slice(&loads[0]);
        self.on_edge[lanes].copy_from_slice(&loads[1]);
        self.count += count;
    }
}

/// The pairs of a chunk, and the data that their evaluation needs.
struct Chunk<'a, L: Law> {
    law: &'a L,
    pairs: &'a [VertexEdge],
    constants: &'a [L::Pair],
    history: &'a [L::History],
    bodies: &'a Bodies,
    moves: Moves<'a>,
    closing: f64,
    watch: &'a Watch,
    look: Look,
    /// Whether no history of the chunk is known to be that of a pair that does not press.
    clear: bool,
}

impl<L: Law> Chunk<'_, L> {
    /// Evaluates all pairs. `ROUND`: all are of discs.
    #[inline(always)]
    fn evaluate<const ROUND: bool>(
        &self,
        next: &mut [L::History],
        separations: &mut Separations,
        outcomes: &mut Outcomes,
    ) {
        let bodies = self.bodies;
        match self.look {
            Look::All => outcomes.looked_at.fill(self.pairs.len()),
            Look::Within(margin) => outcomes.looked_at.find_near(bodies, self.pairs, margin),
            Look::Same => {}
        }
        if self.clear {
            next.fill(L::History::default());
        } else {
            for &k in outcomes.looked_at.all() {
                next[k as usize] = L::History::default();
            }
        }
        let looked_at = &outcomes.looked_at;
        separations.find::<ROUND>(bodies, self.pairs, looked_at, self.closing);
        if self.watch.is_by_body() {
            let closing = |pair| self.watch.closing(pair).unwrap_or(self.closing);
            separations.keep_close(self.pairs, looked_at, closing);
        }
        outcomes.deep = separations
            .deep(self.pairs, looked_at)
            .map(|(pair, overlap)| PassedBodies {
                bodies: pair.bodies,
                passage: Passage::Deep,
                overlap,
            });
        outcomes.count = 0;
        outcomes.stiffest = Lanes::ZERO;
        outcomes.loss = [Lanes::ZERO; 2];
        let (pressing, close) = (&separations.pressing, &separations.close);
        for i in (0..pressing.count()).step_by(LANES) {
            let places = (pressing.four(i), pressing.count() - i);
            self.quad::<true, ROUND>(separations, places, next, outcomes);
        }
        outcomes.presses = outcomes.count;
        for i in (0..close.count()).step_by(LANES) {
            let places = (close.four(i), close.count() - i);
            self.quad::<false, ROUND>(separations, places, next, outcomes);
        }
    }

    /// Evaluates law, forces and torques of up to four pairs, of which all press or none does. Unused lanes repeat the
    /// last pair; their results are not summed.
    #[inline(always)]
    fn quad<const PRESS: bool, const ROUND: bool>(
        &self,
        separations: &Separations,
        (places, left): ([u32; LANES], usize),
        next: &mut [L::History],
        outcomes: &mut Outcomes,
    ) {
        let count = left.min(LANES);
        let numbers = outcomes.looked_at.at(places);
        let k = each(|l| numbers[l] as usize);
        let pair = each(|l| &self.pairs[k[l]]);
        let geometry = separations.geometry::<ROUND>(self.bodies, &self.moves, pair, places);
        let kinematics = geometry.kinematics();
        // With one length for all slices, an index is compared only once.
        let all = self.pairs.len();
        let (constants, history) = (&self.constants[..all], &self.history[..all]);
        let next = &mut next[..all];
        let (constants, before) = (each(|l| constants[k[l]]), each(|l| history[k[l]]));
        let mut answers = Answers::default();
        let mut after = before;
        // There is no branch, so that the compiler can vectorise the four evaluations.
        for l in 0..LANES {
            let (constants, kinematics) = (&constants[l], &kinematics[l]);
            let stiffness = self
                .law
                .stiffness(constants, kinematics.overlap + self.closing);
            answers.stiffness[0][l] = stiffness.normal;
            answers.stiffness[1][l] = stiffness.tangential;
            answers.stiffness[2][l] = stiffness.rolling;
            let loss = if PRESS {
                let response = self.law.response(constants, kinematics, &before[l]);
                answers.force[0][l] = response.normal;
                answers.force[1][l] = response.tangential;
                answers.moment[l] = response.moment;
                after[l] = response.history;
                response.loss
            } else {
                self.law.separate(constants, kinematics, &before[l])
            };
            answers.loss[0][l] = loss.friction;
            answers.loss[1][l] = loss.viscous;
        }
        if PRESS {
            for l in 0..LANES {
                next[k[l]] = after[l];
            }
            let stiffness = Lanes::new(answers.stiffness[0]);
            outcomes.stiffest = outcomes.stiffest.fast_max(stiffness);
        }
        let valid = first(count);
        for (sum, loss) in outcomes.loss.iter_mut().zip(answers.loss) {
            *sum += Lanes::new(loss) * valid;
        }
        let pair_bodies = each(|l| pair[l].bodies);
        outcomes.add(
            count,
            numbers,
            pair_bodies,
            &answers,
            geometry.loads(&answers),
        );
    }
}

impl<L: Law> BodySide for BodyContacts<L> {
    fn update_list(&mut self, bodies: &Bodies, ahead: &Ahead, speed: f64) {
        self.lists.rebuilt = !self.lists.kept.state.watch.holds(bodies, ahead, speed);
        if self.lists.rebuilt {
            self.lists.fresh.state.watch.begin(bodies, ahead, speed);
            self.lists.fresh.build(&self.law, bodies);
            self.lists.fresh.carry(&self.lists.kept);
        }
    }

    fn evaluate(
        &mut self,
        bodies: &Bodies,
        last_step: LastStep,
        closing: f64,
        threads: &Threads,
        loads: &mut [PairLoad],
    ) {
        let look = self.look(closing);
        self.slack = match look {
            Look::All => None,
            // A little less, for rounding.
            Look::Within(margin) => Some(0.999 * margin),
            Look::Same => self.slack,
        };
        if look != Look::Same {
            self.stale = 2;
        }
        let stale = self.stale;
        let mut next = std::mem::take(&mut self.next);
        let mut outcomes = std::mem::take(&mut self.outcomes);
        let now = self.lists.current();
        next.resize(now.list.pairs.len(), L::History::default());
        outcomes.resize_with(next.len().div_ceil(CHUNK), Outcomes::default);
        let opening = Moves::opening(bodies, last_step);
        let moves = Moves::of(bodies, last_step, &opening);
        let evaluate = |i: usize, next: &mut [L::History], outcomes: &mut Outcomes| {
            let here = i * CHUNK..i * CHUNK + next.len();
            let chunk = Chunk {
                law: &self.law,
                pairs: &now.list.pairs[here.clone()],
                constants: &now.constants[here.clone()],
                history: &now.state.history[here],
                bodies,
                moves,
                closing,
                watch: &now.state.watch,
                look,
                clear: stale > 0,
            };
            let mut separations = self.separations.take();
            if now.round[i] {
                chunk.evaluate::<true>(next, &mut separations, outcomes);
            } else {
                chunk.evaluate::<false>(next, &mut separations, outcomes);
            }
            self.separations.give_back(separations);
        };
        // By parts, since the thread that clears a load is the one that kicks by it and mostly the one that adds to it.
        let (count, part) = (loads.len(), threads.part(loads.len()));
        threads.each(count, loads.chunks_mut(part), |loads| {
            loads.fill(PairLoad::default());
        });
        threads.chunks(&mut next, &mut outcomes, evaluate, |outcomes| {
            for ([v, e], [of_vertex, of_edge]) in outcomes.each() {
                loads[v] += *of_vertex;
                loads[e] += *of_edge;
            }
        });
        self.next = next;
        self.outcomes = outcomes;
        self.closing = closing;
    }

    /// `max over contacts (Lambda_A + Lambda_B)`, with `Lambda` the trace of each body's own `M^-1 K`. In contact space
    /// the operator is a sum of positive semidefinite parts, one for each body. The part of body `b` acts on the
    /// contacts of that body, and its norm is at most `Lambda_b`. So the Rayleigh quotient of a vector `x` is at most
    /// `sum_b Lambda_b |x on b's contacts|^2 / |x|^2`, and this is at most the largest `Lambda_A + Lambda_B` of one
    /// contact. The bound is exact for two bodies and one contact.
    fn omega_sq(
        &self,
        bodies: &Bodies,
        motions: &[SurfaceMotion],
        impacts: &Impacts,
        threads: &Threads,
    ) -> [f64; 2] {
        let stiffest = self.outcomes.iter().map(|found| found.stiffest);
        let stiffest = stiffest.fold(Lanes::ZERO, Lanes::max).to_array();
        let stiffest = stiffest.into_iter().fold(0.0, f64::max);
        let pairs = &self.lists.current().list.pairs;
        let chunks = self.outcomes.iter().zip(pairs.chunks(CHUNK));
        let all = Mutex::new([0.0_f64; 2]);
        threads.each(pairs.len(), chunks, |(found, pairs)| {
            let known = || all.lock().expect("nobody panics while he holds it");
            let before = *known();
            let now = found.rates(before, bodies, motions, pairs, stiffest, impacts);
            // The largest of all does not depend on the order.
            let mut known = known();
            *known = [known[0].max(now[0]), known[1].max(now[1])];
        });
        all.into_inner().expect("likewise")
    }

    fn crossing(&self, bodies: &Bodies, kicked: &[(Vec2, f64)], speed: f64, known: f64) -> f64 {
        let now = self.lists.current();
        // The bound has twice the speed of a surface for the approach of two surfaces. It is doubled for the curvature
        // of paths under rotation, which is smaller than that as long as a step moves surfaces by less than the contact
        // distance.
        let most = 4.0 * (2.0 * 2.0 * speed) / now.list.smallest_reach;
        if most <= known || self.outcomes.iter().all(|found| found.count == 0) {
            return known;
        }
        let rate = |pair: &VertexEdge| {
            let (away, sq) = separation(bodies, pair);
            let distance = sq.sqrt();
            let closing = now.state.watch.closing(pair.bodies).unwrap_or(self.closing);
            let in_reach = distance > 0.0 && distance < pair.reach + closing;
            if in_reach {
                let near = Near {
                    bodies: pair.bodies,
                    normal: away / distance,
                    point: bodies.outline[pair.vertex as usize],
                    length: pair.reach,
                };
                crossing_rate(bodies, kicked, &near)
            } else {
                0.0
            }
        };
        now.list.pairs.iter().map(rate).fold(known, f64::max)
    }

    fn passed(&self, _: &Bodies) -> Option<PassedBodies> {
        self.outcomes.iter().find_map(|found| found.deep)
    }

    fn loss(&self) -> Loss {
        let mut loss = Loss::default();
        for found in &self.outcomes {
            loss += Loss {
                friction: found.loss[0].reduce_add(),
                viscous: found.loss[1].reduce_add(),
            };
        }
        loss
    }

    fn energy(&self, bodies: &Bodies) -> f64 {
        let now = self.lists.current();
        let pairs = now.list.pairs.iter().zip(&now.constants).zip(&self.next);
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

    fn collect_contacts(&self, bodies: &Bodies, found: &mut Vec<ContactState>) {
        let pairs = self.lists.current().list.pairs.chunks(CHUNK);
        for (outcomes, pairs) in self.outcomes.iter().zip(pairs) {
            for i in 0..outcomes.presses {
                let pair = &pairs[outcomes.numbers[i] as usize];
                let (away, sq) = separation(bodies, pair);
                let distance = sq.sqrt();
                let vertex = bodies.outline[pair.vertex as usize];
                let (overlap, normal) = (pair.reach - distance, away / distance);
                let at = contact_point(vertex, pair.radius, overlap, normal);
                found.push(between_bodies(pair.bodies, at, outcomes.on_vertex[i].force));
            }
        }
    }

    fn keep_list(&mut self) {
        self.lists.keep();
    }

    fn commit(&mut self) {
        self.keep_list();
        std::mem::swap(&mut self.lists.kept.state.history, &mut self.next);
        self.stale = self.stale.saturating_sub(1);
    }

    fn damping_ratio(&self) -> f64 {
        if self.outcomes.iter().all(|found| found.count == 0) {
            0.0
        } else {
            // `damped_mass` is for contacts of points only.
            self.law.damping_ratio(f64::INFINITY)
        }
    }

    fn contacts(&self) -> usize {
        self.outcomes.iter().map(|found| found.presses).sum()
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.lists.kept.state.watch.advance(speed, dt);
        self.slack = self.slack.map(|slack| slack - 2.0 * speed * dt);
    }

    fn bytes(&self) -> usize {
        self.lists.kept.bytes()
            + self.lists.fresh.bytes()
            + self.next.capacity() * size_of::<L::History>()
            + self.separations.count() * size_of::<Separations>()
            + self.outcomes.len() * size_of::<Outcomes>()
    }

    fn save(&self) -> Vec<u8> {
        pack("pairs", &self.lists.kept.state)
    }

    fn restore(&mut self, saved: &[u8], bodies: &Bodies) -> Result<(), Refusal> {
        let mut kept = Kept::of(unpack("pairs", saved)?);
        if let Some(then) = kept.state.watch.bodies_then(bodies) {
            kept.build(&self.law, &then);
        }
        one_for_each(&kept.state.history, kept.list.pairs.len())?;
        (self.lists.kept, self.lists.rebuilt) = (kept, false);
        self.slack = None;
        Ok(())
    }
}
