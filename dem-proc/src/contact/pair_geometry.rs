//! Geometry of vertex-edge pairs: which pairs of a list are in reach, and the normal, overlap and motion of each. The
//! formulas are those of [`crate::body::edge`], for four pairs at a time, one in each lane.
//!
//! The work for one pair is a long chain of dependent operations with two square roots and a division. Four of them in
//! parallel cost little more than one.

#![expect(
    clippy::inline_always,
    reason = "without it the compiler calls functions for each pair, which costs a quarter of the step"
)]

use std::ops::{Deref, DerefMut};

use interface::Vec2;
use wide::f64x4;

use crate::body::bodies::{Bodies, Rigid};
use crate::body::frame::{Frame, LastMove};
use crate::body::load::PairLoad;
use crate::contact::passage::DEEP;
use crate::law::Kinematics;
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
    const FIRST: [[f64; LANES]; LANES + 1] = [
        [0.0; LANES],
        [1.0, 0.0, 0.0, 0.0],
        [1.0, 1.0, 0.0, 0.0],
        [1.0, 1.0, 1.0, 0.0],
        [1.0; LANES],
    ];
    Lanes::new(FIRST[count.min(LANES)])
}

/// Room for a chunk, and for the unused lanes of its last pairs.
#[derive(Debug)]
pub struct Room<T>([T; CHUNK + LANES]);

impl<T: Copy + Default> Default for Room<T> {
    fn default() -> Self {
        Self([T::default(); CHUNK + LANES])
    }
}

impl<T> Deref for Room<T> {
    type Target = [T; CHUNK + LANES];
    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<T> DerefMut for Room<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// The first `count` bits.
#[inline(always)]
pub fn bits(count: usize) -> u32 {
    (1 << count.min(LANES)) - 1
}

/// Numbers of some pairs of a chunk, ascending.
#[derive(Debug, Default)]
pub struct Numbers {
    list: Room<u32>,
    count: usize,
}

impl Numbers {
    /// How many there are.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The numbers.
    #[inline(always)]
    pub fn all(&self) -> &[u32] {
        &self.list[..self.count]
    }

    /// Four numbers from the one at `i` on. Beyond the end there may be any, or after [`Self::pad`] the last one.
    #[inline(always)]
    pub fn four(&self, i: usize) -> [u32; LANES] {
        let four = &self.list[i..i + LANES];
        each(|l| four[l])
    }

    /// The numbers at four places.
    #[inline(always)]
    pub fn at(&self, places: [u32; LANES]) -> [u32; LANES] {
        each(|l| self.list[places[l] as usize])
    }

    /// Appends, of the four numbers from `first` on, those whose bits are set. It has no branch.
    #[inline(always)]
    pub fn append(&mut self, bits: u32, first: u32) {
        // The lanes of each set of bits, in order; then any.
        const SETS: [[u32; LANES]; 1 << LANES] = {
            let (mut sets, mut bits) = ([[0; LANES]; 1 << LANES], 0);
            while bits < 1 << LANES {
                let (mut lane, mut at) = (0, 0);
                while lane < LANES {
                    if bits >> lane & 1 == 1 {
                        sets[bits][at] = lane as u32;
                        at += 1;
                    }
                    lane += 1;
                }
                bits += 1;
            }
            sets
        };
        let lanes = &SETS[(bits & 15) as usize];
        self.list[self.count..self.count + LANES].copy_from_slice(&each(|l| first + lanes[l]));
        self.count += bits.count_ones() as usize;
    }

    /// Makes these the numbers below `count`.
    pub fn fill(&mut self, count: usize) {
        for (k, number) in (0..).zip(&mut self.list[..count]) {
            *number = k;
        }
        self.count = count;
        self.pad();
    }

    /// Writes the last number into the unused lanes.
    #[inline(always)]
    pub fn pad(&mut self) {
        let last = self.all().last().copied().unwrap_or_default();
        self.list[self.count..self.count + LANES].fill(last);
    }

    /// Makes these the pairs of a chunk whose surfaces are within `margin` (m) of one another.
    pub fn find_near(&mut self, bodies: &Bodies, pairs: &[VertexEdge], margin: f64) {
        self.count = 0;
        for (i, four) in (0..).step_by(LANES).zip(pairs.chunks(LANES)) {
            let of = each(|l| &four[l.min(four.len() - 1)]);
            let (away, _) = away::<false>(bodies, of);
            let far = gather(|l| of[l].reach) + Lanes::splat(margin);
            let near = dot(away, away).simd_lt(far * far).to_bitmask();
            self.append(near & bits(four.len()), i);
        }
        self.pad();
    }
}

/// `x` and `y` of four vectors.
pub type LaneVec = [Lanes; 2];

/// Their dot products.
#[inline(always)]
pub fn dot(a: LaneVec, b: LaneVec) -> Lanes {
    a[0].mul_add(b[0], a[1] * b[1])
}

/// Their cross products.
#[inline(always)]
pub fn cross(a: LaneVec, b: LaneVec) -> Lanes {
    a[0].mul_add(b[1], -(a[1] * b[0]))
}

/// Their differences.
#[inline(always)]
pub fn sub(a: LaneVec, b: LaneVec) -> LaneVec {
    [a[0] - b[0], a[1] - b[1]]
}

/// Something of each of four pairs. The compiler does not always inline `core::array::from_fn` and `map`.
#[inline(always)]
pub fn each<T>(f: impl Fn(usize) -> T) -> [T; LANES] {
    [f(0), f(1), f(2), f(3)]
}

/// One number from each of four pairs.
#[inline(always)]
pub fn gather(f: impl Fn(usize) -> f64) -> Lanes {
    Lanes::new(each(f))
}

/// One vector from each of four pairs.
#[inline(always)]
pub fn gather_vec(f: impl Fn(usize) -> Vec2) -> LaneVec {
    let v = each(f);
    [gather(|l| v[l].x), gather(|l| v[l].y)]
}

/// The edges of four pairs from their beginning to their end in m.
#[inline(always)]
fn edges(bodies: &Bodies, pairs: [&VertexEdge; LANES]) -> LaneVec {
    let end = |k: usize| gather_vec(|l| bodies.outline[pairs[l].edge[k] as usize]);
    sub(end(1), end(0))
}

/// By how much the distances of four places from points have grown over a step, if they have moved by `n` along the normal and by
/// `t` across it; `moves` is 0 if these are velocities. A difference of two lengths that are almost the same would be rounding,
/// and two more roots and quotients would cost 5 % of a step of discs: `1 - sqrt(1 - x)` is `x/2 + x^2/8 + ...`.
#[inline(always)]
fn grown([n, t]: LaneVec, [distance, per_distance]: LaneVec, moves: Lanes) -> Lanes {
    let c = Lanes::splat;
    let both = moves.mul_neg_add(n, distance + distance);
    let share = n.mul_sub(both, moves * (t * t)) * per_distance;
    let x = share * (per_distance * moves);
    if x.abs().simd_lt(c(1.0 / 256.0)).all() {
        let xx = x * x;
        let low = x.mul_add(c(1.0 / 8.0), c(1.0 / 2.0));
        let middle = x.mul_add(c(5.0 / 128.0), c(1.0 / 16.0));
        let high = x.mul_add(c(21.0 / 1024.0), c(7.0 / 256.0));
        return share * xx.mul_add(xx.mul_add(high, middle), low);
    }
    share / (Lanes::ONE + (Lanes::ONE - x).sqrt())
}

/// Shares of an edge that are on it.
#[inline(always)]
fn clamped(along: Lanes) -> Lanes {
    along.fast_max(Lanes::ZERO).fast_min(Lanes::ONE)
}

/// Vectors from the edges to the vertices of four pairs in m, and the shares of the edges at which the feet of the vertices are
/// on their lines; `ROUND` as in [`Separations::find`].
#[inline(always)]
pub fn away<const ROUND: bool>(bodies: &Bodies, pairs: [&VertexEdge; LANES]) -> (LaneVec, Lanes) {
    let at = |i: u32| bodies.outline[i as usize];
    let a = gather_vec(|l| at(pairs[l].edge[0]));
    let from_a = sub(gather_vec(|l| at(pairs[l].vertex)), a);
    if ROUND {
        return (from_a, Lanes::ZERO);
    }
    let edge = edges(bodies, pairs);
    let inverse = gather(|l| bodies.inverse_length_sq[pairs[l].edge[0] as usize]);
    let along = dot(from_a, edge) * inverse;
    let share = clamped(along);
    let away = [
        share.mul_neg_add(edge[0], from_a[0]),
        share.mul_neg_add(edge[1], from_a[1]),
    ];
    (away, along)
}

/// How the bodies have moved over the last step.
#[derive(Debug, Clone, Copy)]
pub struct Moves<'a> {
    /// Before the first step these have velocities and spins in place of displacements and rotations.
    frames: &'a [Frame],
    /// What a displacement in `frames` is multiplied by: for a displacement, and for a velocity.
    scale: [f64; 2],
}

impl<'a> Moves<'a> {
    /// The frames for [`Self::of`] before the first step; empty in any other.
    pub fn opening(bodies: &Bodies, last_step: f64) -> Vec<Frame> {
        let frame = |(frame, state): (&Frame, &Rigid)| Frame {
            last: LastMove {
                shift: state.velocity,
                sin: state.spin,
                versine: 0.0,
            },
            ..*frame
        };
        let all = bodies.frames.iter().zip(&bodies.state);
        let wanted = if last_step > 0.0 { 0 } else { all.len() };
        all.take(wanted).map(frame).collect()
    }

    /// Over `last_step` (s), with the result of [`Self::opening`].
    pub fn of(bodies: &'a Bodies, last_step: f64, opening: &'a [Frame]) -> Self {
        if last_step > 0.0 {
            Self {
                frames: &bodies.frames,
                scale: [1.0, 1.0 / last_step],
            }
        } else {
            Self {
                frames: opening,
                scale: [0.0, 1.0],
            }
        }
    }

    /// Whether there was a step, so that the frames have displacements.
    pub fn are_known(&self) -> bool {
        self.scale[0] > 0.0
    }

    /// Of a body.
    #[inline]
    pub fn frame(&self, body: u32) -> &Frame {
        &self.frames[body as usize]
    }

    /// The displacement and the velocity for a displacement by these frames.
    #[inline]
    pub fn scaled(&self, moved: [f64; 2]) -> [[f64; 2]; 2] {
        self.scale.map(|scale| moved.map(|u| u * scale))
    }
}

/// The distances of pairs of a chunk, and which of them are in reach.
#[derive(Debug, Default)]
pub struct Separations {
    /// Vector from the edge to the vertex of every pair in m.
    x: Room<f64>,
    y: Room<f64>,
    /// Its squared length in m^2.
    distance_sq: Room<f64>,
    /// Where the foot of the vertex is on the line of the edge: 0 at its beginning, 1 at its end.
    along: Room<f64>,
    /// Places, among the pairs that were looked at, of those that press on one another.
    pub pressing: Numbers,
    /// The same for the pairs that do not press but are in reach.
    pub close: Numbers,
    /// Whether the overlap of a pair is too large.
    pub any_deep: bool,
}

/// If the squared distance is below this share of the squared contact distance, the vertex is too near to the edge.
const TOO_NEAR_SQ: f64 = (1.0 - DEEP) * (1.0 - DEEP);

impl Separations {
    /// Finds, of the pairs with numbers `among`, those that press, and those whose surfaces are within `closing` (m) of
    /// one another. There is no branch for a pair, because a processor cannot predict which pairs touch. `ROUND`: all
    /// pairs are of discs, whose only vertex is their centre, and which have no edge.
    #[inline(always)]
    pub fn find<const ROUND: bool>(
        &mut self,
        bodies: &Bodies,
        pairs: &[VertexEdge],
        among: &Numbers,
        closing: f64,
    ) {
        let mut deep = 0;
        (self.pressing.count, self.close.count) = (0, 0);
        for i in (0..among.count).step_by(LANES) {
            let numbers = among.four(i);
            let of = each(|l| &pairs[numbers[l] as usize]);
            let (away, along) = away::<ROUND>(bodies, of);
            let sq = dot(away, away);
            let here = i..i + LANES;
            self.x[here.clone()].copy_from_slice(&away[0].to_array());
            self.y[here.clone()].copy_from_slice(&away[1].to_array());
            if !ROUND {
                self.along[here.clone()].copy_from_slice(&along.to_array());
            }
            self.distance_sq[here].copy_from_slice(&sq.to_array());
            let reach = gather(|l| of[l].reach);
            let far = reach + Lanes::splat(closing);
            let exist = bits(among.count - i);
            let reach_sq = reach * reach;
            let presses = sq.simd_lt(reach_sq).to_bitmask() & exist;
            deep |= sq
                .simd_lt(reach_sq * Lanes::splat(TOO_NEAR_SQ))
                .to_bitmask();
            self.pressing.append(presses, i as u32);
            let is_close = sq.simd_lt(far * far).to_bitmask() & exist & !presses;
            if is_close != 0 {
                self.close.append(is_close, i as u32);
            }
        }
        self.pressing.pad();
        self.close.pad();
        self.any_deep = deep != 0;
    }

    /// The first pair whose overlap is too large ([`crate::contact::passage`]), and its overlap in m. The arguments are
    /// those of [`Self::find`].
    #[cold]
    pub fn first_deep<'a>(
        &self,
        pairs: &'a [VertexEdge],
        among: &Numbers,
    ) -> Option<(&'a VertexEdge, f64)> {
        let mut pressing = self.pressing.all().iter().map(|&j| {
            let pair = &pairs[among.list[j as usize] as usize];
            (pair, self.distance_sq[j as usize])
        });
        let deep = pressing.find(|(pair, sq)| *sq < TOO_NEAR_SQ * pair.reach * pair.reach);
        deep.map(|(pair, sq)| (pair, pair.reach - sq.sqrt()))
    }

    /// Of the pairs in reach, keeps those whose surfaces are within `closing` (m), which depends on the two bodies.
    #[cold]
    pub fn keep_close(
        &mut self,
        pairs: &[VertexEdge],
        among: &Numbers,
        closing: impl Fn([u32; 2]) -> f64,
    ) {
        let mut kept = 0;
        for i in 0..self.close.count {
            let j = self.close.list[i];
            let pair = &pairs[among.list[j as usize] as usize];
            if self.distance_sq[j as usize].sqrt() < pair.reach + closing(pair.bodies) {
                self.close.list[kept] = j;
                kept += 1;
            }
        }
        self.close.count = kept;
        self.close.pad();
    }

    /// Normal, overlap and relative motion of pairs, of which these are the places in [`Self::find`]; `ROUND` as there.
    #[inline(always)]
    pub fn geometry<const ROUND: bool>(
        &self,
        bodies: &Bodies,
        moves: &Moves,
        pair: [&VertexEdge; LANES],
        places: [u32; LANES],
    ) -> PairGeometry {
        let of = |all: &Room<f64>| gather(|l| all[places[l] as usize]);
        let distance = of(&self.distance_sq).sqrt();
        let overlap = gather(|l| pair[l].reach) - distance;
        let per_distance = Lanes::ONE / distance;
        let away = [of(&self.x), of(&self.y)];
        // If a vertex is exactly on an edge, this is not a number. The overlap is too large, and the run ends here.
        let normal = away.map(|x| x * per_distance);
        // Eq. 41: p = X - (a_V - xi/2) N, as a lever arm about either centre, along N and T.
        let back = Lanes::HALF.mul_neg_add(overlap, gather(|l| pair[l].radius));
        let [of_vertex, of_edge] = [each(|l| pair[l].bodies[0]), each(|l| pair[l].bodies[1])];
        let sides = if ROUND {
            // A disc's vertex is its centre, and so is the edge of the other disc.
            [
                Side::new(moves, of_vertex, [Lanes::ZERO, -back]),
                Side::new(moves, of_edge, [Lanes::ZERO, distance - back]),
            ]
        } else {
            let vertex = gather_vec(|l| bodies.outline[pair[l].vertex as usize]);
            let side = |of: [u32; LANES]| {
                let r = sub(vertex, gather_vec(|l| moves.frame(of[l]).center));
                Side::new(moves, of, [cross(r, normal), dot(r, normal) - back])
            };
            [side(of_vertex), side(of_edge)]
        };
        let [v, e] = &sides;
        let shift = sub(v.shift, e.shift);
        let shift = [dot(shift, normal), cross(normal, shift)];
        let [moves, speeds] = moves.scale.map(Lanes::splat);
        let (slid, fallen) = if ROUND {
            let slid = e.sin.mul_neg_add(e.t, v.sin.mul_add(v.t, shift[1]));
            (slid, grown(shift, [distance, per_distance], moves))
        } else {
            let turned = sub(v.turned(), e.turned());
            let at_contact = [shift[0] + turned[0], shift[1] + turned[1]];
            let at_vertex = [
                (v.versine - e.versine).mul_add(back, at_contact[0]),
                (v.sin - e.sin).mul_add(back, at_contact[1]),
            ];
            let [n, t] = e.seen(at_vertex, moves);
            // Whether the foot of the vertex has come from beyond an end of the edge, or from within.
            let along = of(&self.along);
            let inverse = gather(|l| bodies.inverse_length_sq[pair[l].edge[0] as usize]);
            let to_end = along.abs().fast_min((Lanes::ONE - along).abs());
            let far = dot([n, t], [n, t]) * (inverse * moves);
            let moved = if far.simd_lt(to_end * to_end).all() {
                let is_within = along.simd_gt(Lanes::ZERO) & along.simd_lt(Lanes::ONE);
                [n, is_within.select(Lanes::ZERO, t)]
            } else {
                let edge = edges(bodies, pair);
                let edge = [dot(edge, normal), cross(normal, edge)];
                let before = along - dot([n, t], edge) * (inverse * moves);
                let foot = clamped(along) - clamped(before);
                [foot.mul_neg_add(edge[0], n), foot.mul_neg_add(edge[1], t)]
            };
            let fallen = grown(moved, [distance, per_distance], moves);
            (at_contact[1], fallen)
        };
        let moved = [fallen, slid];
        PairGeometry {
            normal,
            overlap,
            moved: moved.map(|u| u * moves),
            velocity: moved.map(|u| u * speeds),
            sines: [v.sin, e.sin].map(|sine| sine * moves),
            sides,
        }
    }
}

/// Normal, overlap and relative motion of four pairs.
#[derive(Debug, Clone, Copy)]
pub struct PairGeometry {
    /// Unit normal `N`, from the edge to the vertex.
    normal: LaneVec,
    overlap: Lanes,
    moved: LaneVec,
    velocity: LaneVec,
    sines: LaneVec,
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
        let sines = self.sines.map(Lanes::to_array);
        each(|l| Kinematics {
            overlap: overlap[l],
            moved: [moved[0][l], moved[1][l]],
            velocity: [velocity[0][l], velocity[1][l]],
            sines: [sines[0][l], sines[1][l]],
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
    let rows = Lanes::transpose(columns);
    each(|l| PairLoad::from_row(rows[l].to_array()))
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
    fn new(moves: &Moves, of: [u32; LANES], [n, t]: LaneVec) -> Self {
        let frames = each(|l| moves.frame(of[l]));
        let row = |m: LastMove| Lanes::new([m.shift.x, m.shift.y, m.sin, m.versine]);
        let [x, y, sin, versine] = Lanes::transpose(each(|l| row(frames[l].last)));
        Self {
            shift: [x, y],
            sin,
            versine,
            inverse_mass: gather(|l| frames[l].inverse_mass),
            inverse_inertia: gather(|l| frames[l].inverse_inertia),
            n,
            t,
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

    /// A displacement of the last step, seen from the body as it is now.
    #[inline(always)]
    fn seen(&self, [n, t]: LaneVec, moves: Lanes) -> LaneVec {
        let sin = self.sin * moves;
        [
            n - self.versine.mul_add(n, sin * t),
            t - self.versine.mul_sub(t, sin * n),
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
