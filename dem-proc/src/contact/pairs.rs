//! Contact between bodies: the literal sum over vertex-edge pairs both ways (Jiang 2020 eqs. 38 to 41, 43).
//!
//! Every term is a function `k xi^2 / 2` of one distance, so the sum is conservative. At a corner a pair has up to four
//! terms, and at aligned edges eight. The step limit sums the same terms, so it takes this into account.

#![expect(
    clippy::inline_always,
    reason = "without it the compiler calls a function for each pair, which costs a quarter of the step"
)]

use interface::Vec2;
use interface::message::wire::ContactState;

use crate::body::bodies::Bodies;
use crate::body::edge::vertex_edge;
use crate::body::load::PairLoad;
use crate::contact::approach::Near;
use crate::contact::engine::{Chunk, Listing, On, PairKind};
use crate::contact::frame_contacts::{BODY, between};
use crate::contact::impact::{Nears, Pressing, Relative};
use crate::contact::pair_geometry::{
    Answers, LANES, Lanes, Numbers, Room, Separations, away, bits, dot, each, first, gather,
    gather_vec,
};
use crate::contact::passage::{Own, Passage, Passed};
use crate::contact::side::{AfterKick, Sums, Targets};
use crate::law::{Law, Loss, PairProperties, reduced};
use crate::lists::neighbours::{BodyList, VertexEdge};
use crate::lists::now::Among;
use crate::lists::watch::{Look, Watch};
use crate::threads::CHUNK;
use mechanics::outline::contact_point;

/// Pairs of a vertex and an edge.
#[derive(Debug)]
pub struct VertexEdges;

/// The constants of two bodies for a law, with these radii of curvature (m) at their contact. A body that forces move
/// counts with its mass, also if they only rotate it.
pub fn pair_properties(bodies: &Bodies, pair: [u32; 2], radii: [f64; 2]) -> PairProperties {
    let [a, b] = pair.map(|b| bodies.state[b as usize].falls / bodies.properties[b as usize].mass);
    PairProperties {
        mass: 1.0 / (a + b),
        radius: reduced(radii[0], radii[1]),
        surfaces: pair.map(|b| bodies.properties[b as usize].surface),
    }
}

/// Vector from the edge to the vertex of a pair, and its squared length.
#[inline(always)]
fn separation(bodies: &Bodies, pair: &VertexEdge) -> (Vec2, f64) {
    let at = |i: u32| bodies.outline[i as usize];
    let inverse = bodies.inverse_length_sq[pair.edge[0] as usize];
    vertex_edge(at(pair.vertex), at(pair.edge[0]), at(pair.edge[1]), inverse)
}

/// The pairs of a chunk that are in reach.
#[derive(Debug, Default)]
pub struct Outcomes {
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
    /// Pairs that press on one another.
    presses: usize,
}

/// What a chunk adds to sums.
#[derive(Debug, Default)]
pub struct Added {
    /// As [`Outcomes`] has it.
    pair_bodies: Room<[u32; 2]>,
    /// The loads on the owners of the vertices, and on those of the edges.
    on_vertex: Room<PairLoad>,
    on_edge: Room<PairLoad>,
    /// Pairs in reach, and those of them that press.
    count: [usize; 2],
    /// The largest stiffness in N/m of a pair that presses, lane by lane.
    stiffest: Lanes,
    /// Dissipated over the last step by friction and by dashpots in J/m, lane by lane.
    loss: [Lanes; 2],
    /// The first pair whose overlap is too large.
    deep: Option<Passed>,
    /// The pairs that press with the energy in J/m of their springs, if that is wanted.
    contacts: Vec<(ContactState, f64)>,
}

impl Outcomes {
    /// Which of the contacts of four entries open or close, as bits.
    #[inline(always)]
    fn impacts(&self, entries: [u32; LANES], pairs: &[VertexEdge], after: &AfterKick) -> u32 {
        let bodies = after.bodies;
        let at = each(|l| entries[l] as usize);
        let pair = each(|l| &pairs[self.numbers[at[l]] as usize]);
        let (away, _) = away::<false>(bodies, pair);
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
        after.impacts.among(bodies, &near, &pressing)
    }

    /// Adds the first `count` lanes of four evaluated pairs.
    #[inline(always)]
    fn add(
        &mut self,
        count: usize,
        numbers: [u32; LANES],
        pair_bodies: [[u32; 2]; LANES],
        answers: &Answers,
    ) {
        let lanes = self.count..self.count + LANES;
        assert!(lanes.end <= CHUNK + LANES);
        self.pair_bodies[lanes.clone()].copy_from_slice(&pair_bodies);
        self.numbers[lanes.clone()].copy_from_slice(&numbers);
        self.force[lanes.clone()].copy_from_slice(&answers.force[0]);
        self.stiffness[lanes].copy_from_slice(&answers.stiffness[0]);
        self.count += count;
    }
}

impl<L: Law> Chunk<'_, VertexEdges, L> {
    /// Evaluates all pairs. `ROUND`: all are of discs.
    #[inline(always)]
    fn evaluate<const ROUND: bool>(
        &self,
        next: &mut [(L::History, ())],
        separations: &mut Separations,
        (outcomes, added): (&mut Outcomes, &mut Added),
    ) {
        let On {
            bodies,
            watch,
            interval,
            look,
            ..
        } = self.on;
        let closing = interval.closing;
        match look {
            Look::All => outcomes.looked_at.fill(self.pairs.len()),
            Look::Within(margin) => outcomes.looked_at.find_near(bodies, self.pairs, margin),
            Look::Same => {}
        }
        if watch.is_stale() {
            next.fill(Default::default());
        } else {
            for &k in outcomes.looked_at.all() {
                next[k as usize] = Default::default();
            }
        }
        let looked_at = &outcomes.looked_at;
        separations.find::<ROUND>(bodies, self.pairs, looked_at, closing);
        if watch.is_by_body() {
            separations.keep_close(self.pairs, looked_at, |pair| watch.closing(pair, closing));
        }
        added.deep = None;
        if separations.any_deep {
            let deep = separations.first_deep(self.pairs, looked_at);
            added.deep = deep.map(|(pair, overlap)| Passed::Body {
                own: Own::Body(pair.bodies[0]),
                body: pair.bodies[1],
                passage: Passage::Deep,
                overlap,
            });
        }
        outcomes.count = 0;
        added.stiffest = Lanes::ZERO;
        added.loss = [Lanes::ZERO; 2];
        let (pressing, close) = (&separations.pressing, &separations.close);
        for i in (0..pressing.count()).step_by(LANES) {
            let places = (pressing.four(i), pressing.count() - i);
            self.quad::<true, ROUND>(separations, places, next, (outcomes, added));
        }
        outcomes.presses = outcomes.count;
        added.contacts.clear();
        if interval.measured {
            self.measure(next, outcomes, added);
        }
        for i in (0..close.count()).step_by(LANES) {
            let places = (close.four(i), close.count() - i);
            self.quad::<false, ROUND>(separations, places, next, (outcomes, added));
        }
        added.count = [outcomes.count, outcomes.presses];
    }

    /// Notes the contacts that press, and their energies.
    #[cold]
    fn measure(&self, next: &[(L::History, ())], outcomes: &Outcomes, added: &mut Added) {
        let bodies = self.on.bodies;
        for i in 0..outcomes.presses {
            let k = outcomes.numbers[i] as usize;
            let pair = &self.pairs[k];
            let (away, sq) = separation(bodies, pair);
            let distance = sq.sqrt();
            let vertex = bodies.outline[pair.vertex as usize];
            let (overlap, normal) = (pair.reach - distance, away / distance);
            let at = contact_point(vertex, pair.radius, overlap, normal);
            let (ids, force) = (pair.bodies.map(u64::from), added.on_vertex[i].force);
            let energy = if overlap > 0.0 {
                (self.law).energy(&self.constants[k], overlap, &next[k].0)
            } else {
                0.0
            };
            (added.contacts).push((between(ids, BODY, at, force), energy));
        }
    }

    /// Evaluates law, forces and torques of up to four pairs, of which all press or none does. Unused lanes repeat the
    /// last pair; their results are not summed.
    #[inline(always)]
    fn quad<const PRESS: bool, const ROUND: bool>(
        &self,
        separations: &Separations,
        (places, left): ([u32; LANES], usize),
        next: &mut [(L::History, ())],
        (outcomes, added): (&mut Outcomes, &mut Added),
    ) {
        let count = left.min(LANES);
        let numbers = outcomes.looked_at.at(places);
        let k = each(|l| numbers[l] as usize);
        let pair = each(|l| &self.pairs[k[l]]);
        let geometry = separations.geometry::<ROUND>(self.on.bodies, &self.on.moves, pair, places);
        let kinematics = geometry.kinematics();
        // With one length for all slices, an index is compared only once.
        let all = self.pairs.len();
        let (constants, history) = (&self.constants[..all], &self.history[..all]);
        let next = &mut next[..all];
        let (constants, before) = (each(|l| constants[k[l]]), each(|l| history[k[l]].0));
        let mut answers = Answers::default();
        let mut after = before;
        // There is no branch, so that the compiler can vectorise the four evaluations.
        for l in 0..LANES {
            let (constants, kinematics) = (&constants[l], &kinematics[l]);
            let stiffness = self
                .law
                .stiffness(constants, kinematics.overlap + self.on.interval.closing);
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
                next[k[l]].0 = after[l];
            }
            let stiffness = Lanes::new(answers.stiffness[0]);
            added.stiffest = added.stiffest.fast_max(stiffness);
        }
        let valid = first(count);
        for (sum, loss) in added.loss.iter_mut().zip(answers.loss) {
            *sum += Lanes::new(loss) * valid;
        }
        let pair_bodies = each(|l| pair[l].bodies);
        let lanes = outcomes.count..outcomes.count + LANES;
        outcomes.add(count, numbers, pair_bodies, &answers);
        let [on_vertex, on_edge] = geometry.loads(&answers);
        added.pair_bodies[lanes.clone()].copy_from_slice(&pair_bodies);
        added.on_vertex[lanes.clone()].copy_from_slice(&on_vertex);
        added.on_edge[lanes].copy_from_slice(&on_edge);
    }
}

impl Listing for VertexEdges {
    const POINTS: u32 = 0;
    type Pair = VertexEdge;
    type Key = (u32, u32, bool, u32, u32);
    type Extra = BodyList;
    type Watch = Watch;

    fn list(&self, among: &Among, watch: &Watch, pairs: &mut Vec<VertexEdge>, list: &mut BodyList) {
        list.build(among, watch, pairs);
    }

    fn key(pair: VertexEdge, _: impl Fn(u32) -> Option<u32>) -> Option<Self::Key> {
        Some(pair.key())
    }

    fn properties(&self, among: &Among, pair: VertexEdge) -> PairProperties {
        let radii = [pair.radius, pair.reach - pair.radius];
        pair_properties(among.bodies, pair.bodies, radii)
    }

    fn bodies(pair: VertexEdge) -> [Option<u32>; 2] {
        pair.bodies.map(Some)
    }
}

impl PairKind for VertexEdges {
    type Memory = ();
    type Found = Outcomes;
    type Added = Added;
    type Room<L: Law> = Box<Separations>;

    #[inline(always)]
    fn evaluate<L: Law>(
        chunk: &Chunk<Self, L>,
        room: &mut Box<Separations>,
        next: &mut [(L::History, ())],
        results: (&mut Outcomes, &mut Added),
    ) {
        if chunk.on.extra.chunks[chunk.number].0 {
            chunk.evaluate::<true>(next, room, results);
        } else {
            chunk.evaluate::<false>(next, room, results);
        }
    }

    #[inline(always)]
    fn add(_: &On<Self>, added: &Added, to: &mut Targets, sums: &mut Sums) {
        let loads = &mut *to.by_bodies;
        let [in_reach, presses] = added.count;
        let both = added.on_vertex.iter().zip(added.on_edge.iter());
        for ([v, e], (on_vertex, on_edge)) in added.pair_bodies[..in_reach].iter().zip(both) {
            loads[*v as usize] += *on_vertex;
            loads[*e as usize] += *on_edge;
        }
        let [friction, viscous] = added.loss.map(Lanes::reduce_add);
        sums.loss += Loss { friction, viscous };
        sums.in_reach += in_reach;
        sums.presses += presses;
        let stiffest = added.stiffest.to_array().into_iter();
        sums.stiffest = stiffest.fold(sums.stiffest, f64::max);
        for (contact, energy) in &added.contacts {
            to.contacts.push(*contact);
            sums.hold(*energy);
        }
        sums.passed = sums.passed.or(added.deep);
    }

    fn rates(
        found: &Outcomes,
        pairs: &[VertexEdge],
        [largest, mut of_impact]: [f64; 2],
        after: &AfterKick,
        stiffest: f64,
    ) -> [f64; 2] {
        let motions = after.motions;
        let mut largest = Lanes::splat(largest);
        let mut asked = Numbers::default();
        for i in (0..found.count).step_by(LANES) {
            let four = &found.pair_bodies[i..i + LANES];
            let both = Relative::of(motions, each(|l| four[l]));
            largest = largest.fast_max(both.rate * first(found.count - i));
            let calm = bits(found.presses.saturating_sub(i)) & both.calm(stiffest, &after.impacts);
            let higher = both.rate.simd_gt(Lanes::splat(of_impact)).to_bitmask();
            let may_open = higher & !calm & bits(found.count - i);
            if may_open != 0 {
                asked.append(may_open, i as u32);
            }
        }
        asked.pad();
        for i in (0..asked.count()).step_by(LANES) {
            let entries = asked.four(i);
            let opening = found.impacts(entries, pairs, after);
            for (l, entry) in entries.into_iter().enumerate() {
                if opening >> l & 1 == 1 {
                    let of = found.pair_bodies[entry as usize].map(|b| &motions[b as usize]);
                    of_impact = of_impact.max(of[0].rate() + of[1].rate());
                }
            }
        }
        let largest = largest.to_array().into_iter().fold(0.0, f64::max);
        [largest, of_impact]
    }

    /// Two surfaces approach by twice the speed of one. That is doubled for the curvature of paths under rotation,
    /// which is smaller than that as long as a step moves surfaces by less than the contact distance.
    fn fastest_crossing(list: &BodyList, speed: f64) -> f64 {
        4.0 * (2.0 * 2.0 * speed) / list.smallest_reach
    }

    fn each_near(
        _: &Outcomes,
        pairs: &[VertexEdge],
        bodies: &Bodies,
        (watch, closing): (&Watch, f64),
        mut act: impl FnMut(usize, &Near),
    ) {
        for (number, pair) in pairs.iter().enumerate() {
            let (away, sq) = separation(bodies, pair);
            let distance = sq.sqrt();
            if distance > 0.0 && distance < pair.reach + watch.closing(pair.bodies, closing) {
                let near = Near {
                    bodies: pair.bodies,
                    normal: away / distance,
                    point: bodies.outline[pair.vertex as usize],
                    length: pair.reach,
                };
                act(number, &near);
            }
        }
    }
}
