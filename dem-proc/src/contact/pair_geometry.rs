//! Geometry of vertex-edge pairs: which pairs of a list are in reach, and the normal, overlap and motion of each. The
//! formulas are those of [`crate::body::edge`], for four pairs at a time, one in each lane.
//!
//! The work for one pair is a long chain of dependent operations with two square roots and a division. Four of them in
//! parallel cost little more than one.

#![expect(
    clippy::inline_always,
    reason = "without it the compiler calls functions for each pair, which costs a quarter of the step"
)]

use interface::Vec2;
use wide::f64x4;

use crate::body::bodies::Bodies;
use crate::body::edge::normal_on;
use crate::body::frame::Frame;
use crate::body::load::PairLoad;
use crate::contact::passage::DEEP;
use crate::law::{Kinematics, LastStep};
use crate::lists::neighbours::VertexEdge;
use crate::threads::CHUNK;

/// One number for each of four pairs.
pub type Lanes = f64x4;

/// Number of pairs that are computed in parallel.
pub const LANES: usize = 4;

const _: () = assert!(CHUNK.is_multiple_of(LANES));

/// One in the first `count` lanes, zero in the others.
#[inline(always)]
pub fn first(count: usize) -> Lanes {
    Lanes::new(core::array::from_fn(|l| if l < count { 1.0 } else { 0.0 }))
}

/// `x` and `y` of four vectors.
type LaneVec = [Lanes; 2];

#[inline(always)]
fn dot(a: LaneVec, b: LaneVec) -> Lanes {
    a[0].mul_add(b[0], a[1] * b[1])
}

#[inline(always)]
fn cross(a: LaneVec, b: LaneVec) -> Lanes {
    a[0].mul_add(b[1], -(a[1] * b[0]))
}

#[inline(always)]
fn sub(a: LaneVec, b: LaneVec) -> LaneVec {
    [a[0] - b[0], a[1] - b[1]]
}

/// One number from each of four pairs.
#[inline(always)]
fn gather(f: impl Fn(usize) -> f64) -> Lanes {
    Lanes::new(core::array::from_fn(f))
}

#[inline(always)]
fn gather_vec(f: impl Fn(usize) -> Vec2) -> LaneVec {
    let v: [Vec2; LANES] = core::array::from_fn(f);
    [gather(|l| v[l].x), gather(|l| v[l].y)]
}

/// The distances of the pairs of a chunk, and which of them are in reach.
#[derive(Debug, Default)]
pub struct Separations {
    /// Vector from the edge to the vertex of every pair in m.
    x: Vec<f64>,
    y: Vec<f64>,
    /// Its squared length in m^2.
    distance_sq: Vec<f64>,
    /// Indices, within the chunk, of the pairs that press on one another, ascending.
    pressing: Vec<u32>,
    /// The same for the pairs that do not press but are in reach.
    close: Vec<u32>,
    /// Number of entries in `pressing` and in `close`.
    counts: [usize; 2],
    /// Whether the overlap of a pair is too large.
    any_deep: bool,
}

/// If the squared distance is below this share of the squared contact distance, the vertex is too near to the edge.
const TOO_NEAR_SQ: f64 = (1.0 - DEEP) * (1.0 - DEEP);

impl Separations {
    /// Bytes on the heap.
    pub const BYTES: usize = CHUNK * (3 * size_of::<f64>() + 2 * size_of::<u32>());

    /// Finds the pairs that press, and those whose surfaces are within `closing` (m) of one another. There is no branch
    /// for a pair, because a processor cannot predict which pairs touch. `ROUND`: all pairs are of discs, whose only vertex
    /// is their centre, and which have no edge.
    #[inline(always)]
    pub fn find<const ROUND: bool>(&mut self, bodies: &Bodies, pairs: &[VertexEdge], closing: f64) {
        assert!(pairs.len() <= CHUNK);
        for kept in [&mut self.x, &mut self.y, &mut self.distance_sq] {
            kept.resize(CHUNK, 0.0);
        }
        for found in [&mut self.pressing, &mut self.close] {
            found.resize(CHUNK + 1, 0);
        }
        let (x, y) = (&mut self.x[..CHUNK], &mut self.y[..CHUNK]);
        let distance_sq = &mut self.distance_sq[..CHUNK];
        let (pressing, close) = (&mut self.pressing[..=CHUNK], &mut self.close[..=CHUNK]);
        let (mut counts, mut deep) = ([0; 2], 0);
        for (q, quad) in pairs.chunks(LANES).enumerate() {
            let last = quad.len() - 1;
            let of = |l: usize| &quad[l.min(last)];
            let at = |i: u32| bodies.outline[i as usize];
            let vertex = gather_vec(|l| at(of(l).vertex));
            let a = gather_vec(|l| at(of(l).edge[0]));
            let from_a = sub(vertex, a);
            let away = if ROUND {
                from_a
            } else {
                let b = gather_vec(|l| at(of(l).edge[1]));
                let inverse = gather(|l| bodies.inverse_length_sq[of(l).edge[0] as usize]);
                let edge = sub(b, a);
                let along = dot(from_a, edge) * inverse;
                let along = along.fast_max(Lanes::ZERO).fast_min(Lanes::ONE);
                [
                    along.mul_neg_add(edge[0], from_a[0]),
                    along.mul_neg_add(edge[1], from_a[1]),
                ]
            };
            let sq = dot(away, away);
            let here = q * LANES..(q + 1) * LANES;
            x[here.clone()].copy_from_slice(&away[0].to_array());
            y[here.clone()].copy_from_slice(&away[1].to_array());
            distance_sq[here].copy_from_slice(&sq.to_array());
            let reach = gather(|l| of(l).reach);
            let far = reach + Lanes::splat(closing);
            let exist = (2 << last) - 1;
            let reach_sq = reach * reach;
            let presses = sq.simd_lt(reach_sq).to_bitmask() & exist;
            deep |= sq
                .simd_lt(reach_sq * Lanes::splat(TOO_NEAR_SQ))
                .to_bitmask();
            let is_close = sq.simd_lt(far * far).to_bitmask() & exist & !presses;
            for l in 0..LANES {
                let number = (q * LANES + l) as u32;
                pressing[counts[0]] = number;
                counts[0] += (presses >> l & 1) as usize;
            }
            if is_close != 0 {
                for l in 0..LANES {
                    let number = (q * LANES + l) as u32;
                    close[counts[1]] = number;
                    counts[1] += (is_close >> l & 1) as usize;
                }
            }
        }
        self.counts = counts;
        self.any_deep = deep != 0;
    }

    /// The first pair whose overlap is too large ([`crate::contact::passage`]), and its overlap in m.
    #[inline(always)]
    pub fn deep(&self, pairs: &[VertexEdge]) -> Option<(u32, f64)> {
        if self.any_deep {
            self.first_deep(pairs)
        } else {
            None
        }
    }

    #[cold]
    fn first_deep(&self, pairs: &[VertexEdge]) -> Option<(u32, f64)> {
        let sq = |k: &u32| self.distance_sq[*k as usize];
        let reach = |k: &u32| pairs[*k as usize].reach;
        let mut pressing = self.pressing().iter().copied();
        let deep = pressing.find(|k| sq(k) < TOO_NEAR_SQ * reach(k) * reach(k));
        deep.map(|k| (k, reach(&k) - sq(&k).sqrt()))
    }

    /// Of the pairs in reach, keeps those whose surfaces are within `closing` (m), which depends on the two bodies.
    #[cold]
    pub fn keep_close(&mut self, pairs: &[VertexEdge], closing: impl Fn([u32; 2]) -> f64) {
        let mut kept = 0;
        for i in 0..self.counts[1] {
            let k = self.close[i];
            let pair = &pairs[k as usize];
            if self.distance_sq[k as usize].sqrt() < pair.reach + closing(pair.bodies) {
                self.close[kept] = k;
                kept += 1;
            }
        }
        self.counts[1] = kept;
    }

    /// The indices of the pairs that press.
    #[inline(always)]
    pub fn pressing(&self) -> &[u32] {
        &self.pressing[..self.counts[0]]
    }

    /// The indices of the pairs that are in reach and do not press.
    #[inline(always)]
    pub fn close(&self) -> &[u32] {
        &self.close[..self.counts[1]]
    }

    /// Normal, overlap and relative motion of the pairs `k`; `ROUND` as in [`Self::find`].
    #[inline(always)]
    pub fn geometry<const ROUND: bool>(
        &self,
        bodies: &Bodies,
        last_step: LastStep,
        pairs: &[VertexEdge],
        k: [usize; LANES],
    ) -> PairGeometry {
        let pair = k.map(|k| &pairs[k]);
        // With one length for all slices, an index is compared only once.
        let all = pairs.len();
        let (x, y) = (&self.x[..all], &self.y[..all]);
        let distance_sq = &self.distance_sq[..all];
        let distance = gather(|l| distance_sq[k[l]]).sqrt();
        let overlap = gather(|l| pair[l].reach) - distance;
        let per_distance = Lanes::ONE / distance;
        let away = [gather(|l| x[k[l]]), gather(|l| y[k[l]])];
        let mut normal = away.map(|x| x * per_distance);
        if distance.simd_eq(Lanes::ZERO).any() {
            normal = at_zero_distance(bodies, pair, distance, normal);
        }
        // Eq. 41: p = X - (a_V - xi/2) N, as a lever arm about either centre, along N and T.
        let back = Lanes::HALF.mul_neg_add(overlap, gather(|l| pair[l].radius));
        let pair_bodies = pair.map(|p| p.bodies);
        let [of_vertex, of_edge] = [pair_bodies.map(|[v, _]| v), pair_bodies.map(|[_, e]| e)];
        // A disc's vertex is its centre, and so is the edge of the other disc.
        let arms = if ROUND {
            [[Lanes::ZERO; 2], away]
        } else {
            let vertex = gather_vec(|l| bodies.outline[pair[l].vertex as usize]);
            let center = |of: u32| bodies.frames[of as usize].center;
            [
                sub(vertex, gather_vec(|l| center(of_vertex[l]))),
                sub(vertex, gather_vec(|l| center(of_edge[l]))),
            ]
        };
        let sides = [
            Side::new(bodies, of_vertex, last_step, (arms[0], back), normal),
            Side::new(bodies, of_edge, last_step, (arms[1], back), normal),
        ];
        let mut geometry = PairGeometry {
            normal,
            overlap,
            moved: [Lanes::ZERO; 2],
            velocity: [Lanes::ZERO; 2],
            rolled: Lanes::ZERO,
            sides,
        };
        let [v, e] = &geometry.sides;
        let shift = sub(v.shift, e.shift);
        let (turned_v, turned_e) = (v.turned(), e.turned());
        let moved = [
            dot(shift, normal) + (turned_v[0] - turned_e[0]),
            cross(normal, shift) + (turned_v[1] - turned_e[1]),
        ];
        if last_step.dt > 0.0 {
            geometry.moved = moved;
            geometry.velocity = moved.map(|u| u * Lanes::splat(last_step.per_dt));
            // The sine equals the angle up to a third-order term; only lengths need the exact rotation.
            geometry.rolled = v.sin - e.sin;
        } else {
            geometry.velocity = moved;
        }
        geometry
    }
}

/// Replaces the normals of pairs whose vertex is exactly on the edge.
#[cold]
fn at_zero_distance(
    bodies: &Bodies,
    pair: [&VertexEdge; LANES],
    distance: Lanes,
    normal: LaneVec,
) -> LaneVec {
    let (distance, [x, y]) = (distance.to_array(), normal.map(Lanes::to_array));
    let mended: [Vec2; LANES] = core::array::from_fn(|l| {
        if distance[l] > 0.0 {
            return Vec2::new(x[l], y[l]);
        }
        let [a, b] = pair[l].edge.map(|i| bodies.outline[i as usize]);
        normal_on(a, b)
    });
    gather_vec(|l| mended[l])
}

/// Normal, overlap and relative motion of four pairs.
#[derive(Debug, Clone, Copy)]
pub struct PairGeometry {
    /// Unit normal `N`, from the edge to the vertex.
    normal: LaneVec,
    overlap: Lanes,
    moved: LaneVec,
    velocity: LaneVec,
    rolled: Lanes,
    /// The bodies that own the vertices, and those that own the edges.
    sides: [Side; 2],
}

impl PairGeometry {
    /// The arguments of the contact law, for each pair.
    #[inline(always)]
    pub fn kinematics(&self) -> [Kinematics; LANES] {
        let overlap = self.overlap.to_array();
        let (moved, velocity) = (
            self.moved.map(Lanes::to_array),
            self.velocity.map(Lanes::to_array),
        );
        let rolled = self.rolled.to_array();
        core::array::from_fn(|l| Kinematics {
            overlap: overlap[l],
            moved: [moved[0][l], moved[1][l]],
            velocity: [velocity[0][l], velocity[1][l]],
            rolled: rolled[l],
        })
    }

    /// The loads on the two bodies of each pair, with their rates. They follow from the forces along `N` and `T` (N/m)
    /// and the moment (N) on the owner of the vertex.
    #[inline(always)]
    pub fn loads(&self, answers: &Answers) -> [[PairLoad; LANES]; 2] {
        let [f_n, f_t] = answers.force.map(Lanes::new);
        let [n_x, n_y] = self.normal;
        let force = [n_x.mul_add(f_n, -(n_y * f_t)), n_y.mul_add(f_n, n_x * f_t)];
        let moment = Lanes::new(answers.moment);
        let k = answers.stiffness.map(Lanes::new);
        let [v, e] = &self.sides;
        let torque = [
            v.n.mul_add(f_n, v.t * f_t) + moment,
            e.n.mul_add(f_n, e.t * f_t) + moment,
        ];
        [
            rows([force[0], force[1], torque[0], v.rate(k)]),
            rows([-force[0], -force[1], -torque[1], e.rate(k)]),
        ]
    }
}

#[inline(always)]
fn rows(columns: [Lanes; 4]) -> [PairLoad; LANES] {
    Lanes::transpose(columns).map(|row| PairLoad::from_row(row.to_array()))
}

/// The answers of a law for four pairs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Answers {
    /// Along `N` and `T` in N/m.
    pub force: [[f64; LANES]; 2],
    /// In N.
    pub moment: [f64; LANES],
    /// Normal, tangential and rolling stiffness.
    pub stiffness: [[f64; LANES]; 3],
    /// Dissipated by friction and by dashpots in J/m.
    pub loss: [[f64; LANES]; 2],
}

/// One body of each of four pairs.
#[derive(Debug, Clone, Copy)]
struct Side {
    /// Displacement of the centre over the last step; its velocity if there was no step.
    shift: LaneVec,
    /// Sine of the rotation over the last step; the spin if there was no step.
    sin: Lanes,
    /// One minus the cosine of that rotation; 0 if there was no step.
    versine: Lanes,
    inverse_mass: Lanes,
    inverse_inertia: Lanes,
    /// Lever arm of the contact along `N` and `T`: `r x N` and `r x T`. All effects of rotation follow from it.
    n: Lanes,
    t: Lanes,
}

impl Side {
    /// The bodies `of`, with the vertices at `r` (m) from their centres, and the contact points `back` (m) behind the
    /// vertices, along the normals.
    #[inline(always)]
    fn new(
        bodies: &Bodies,
        of: [u32; LANES],
        last_step: LastStep,
        (r, back): (LaneVec, Lanes),
        normal: LaneVec,
    ) -> Self {
        let frames: [&Frame; LANES] = of.map(|b| &bodies.frames[b as usize]);
        let mut shift = gather_vec(|l| frames[l].last.shift);
        let [mut sin, mut versine, inverse_mass, inverse_inertia] =
            Lanes::transpose(frames.map(|f| Lanes::new(f.turn())));
        if last_step.dt == 0.0 {
            let state = of.map(|b| &bodies.state[b as usize]);
            shift = gather_vec(|l| state[l].velocity);
            sin = gather(|l| state[l].spin);
            versine = Lanes::ZERO;
        }
        Self {
            shift,
            sin,
            versine,
            inverse_mass,
            inverse_inertia,
            n: cross(r, normal),
            t: dot(r, normal) - back, // T is N turned by +90 degrees, so r x T = r . N
        }
    }

    /// Displacement along `N` and `T` of the material at the contact by the rotation in the last step; exact for any
    /// angle.
    #[inline(always)]
    fn turned(&self) -> LaneVec {
        [
            self.sin.mul_add(self.n, self.versine * self.t),
            self.sin.mul_add(self.t, -(self.versine * self.n)),
        ]
    }

    /// `sum k (1/m + (r x n)^2 / I)` over both directions, and `k_r / I`.
    #[inline(always)]
    fn rate(&self, [normal, tangential, rolling]: [Lanes; 3]) -> Lanes {
        let along = (normal * self.n).mul_add(self.n, rolling);
        let turning = (tangential * self.t).mul_add(self.t, along);
        self.inverse_inertia
            .mul_add(turning, (normal + tangential) * self.inverse_mass)
    }
}
