//! Velocities, affine part and positions of points after the kick (Jiang 2020 eqs. 26 to 28 and 31), of a batch of points.

use crate::kernel::lanes::{Lanes, ZERO, largest, smallest, splat, sum};
use crate::kernel::shape::Shape;
use crate::kernel::tiles::Place;
use crate::kernel::transfer::{AffineState, Transfer};
use crate::kernel::window::{VectorWindow, gather_row};
use crate::state::points::{Motion, TileReport};
use crate::state::settling::Settling;

/// How points take velocities from the nodes, and how they move with them.
#[derive(Debug, Clone, Copy)]
pub struct Carry {
    /// Whether they take velocities.
    pub kick: bool,
    /// Whether they move.
    pub drift: bool,
    /// The transfer of velocities.
    pub transfer: Transfer,
    /// What damping leaves of the velocities before.
    pub kept: f64,
    /// Length of the step in s.
    pub dt: f64,
    /// What positions take over.
    pub settling: Settling,
}

impl Carry {
    /// Whether the transfer takes energy that has to be counted. FLIP alone takes nothing.
    pub fn takes<A: AffineState>(&self) -> bool {
        let smooths = self.transfer.pic_fraction() > 0.0;
        self.kick && (!self.transfer.increment || A::PRESENT || self.filters() || smooths)
    }

    /// Whether velocities are filtered.
    pub fn filters(&self) -> bool {
        self.transfer.filter.is_some()
    }

    /// Whether the increment of the nodes' velocities is needed.
    pub fn compares<A: AffineState>(&self) -> bool {
        self.kick && self.transfer.increment || self.takes::<A>()
    }
}

/// The blocks of a batch that are carried.
pub struct Carried<'a, A> {
    /// Positions in m.
    pub x: &'a mut [[Lanes; 2]],
    /// Velocities.
    pub motion: &'a mut [Motion<A>],
    /// What is not settled of the positions, in m.
    pub unsettled: &'a mut [[Lanes; 2]],
    /// Velocities set aside, if the transfer filters.
    pub aside: &'a [[Lanes; 2]],
    /// Where the points were.
    pub places: &'a [Place],
    /// One in lanes with a point, zero in others.
    pub live: &'a [Lanes],
}

/// Sums over the points of a tile that are carried.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    speed_sq: Lanes,
    total: Lanes,
    taken: Lanes,
    lower: [Lanes; 2],
    upper: [Lanes; 2],
}

impl Course {
    /// Of points of which some are at `x` (m).
    pub fn from(x: [Lanes; 2]) -> Self {
        Self {
            speed_sq: ZERO,
            total: ZERO,
            taken: ZERO,
            lower: x,
            upper: x,
        }
    }

    /// Writes the report of the tile.
    pub fn write(&self, report: &mut TileReport, kick: bool) {
        *report = TileReport {
            speed_sq: largest(self.speed_sq),
            sum: sum(self.total),
            lower: self.lower.map(smallest),
            upper: self.upper.map(largest),
            omega_sq: 0.0,
            taken: if kick { sum(self.taken) } else { report.taken },
        };
    }
}

/// Carries the points of a batch by the velocities of the nodes and their increments in the kick.
pub fn carry<const W: usize, S: Shape<W>, A: AffineState>(
    shape: S,
    nodes: [&VectorWindow; 2],
    how: &Carry,
    points: Carried<'_, A>,
    course: &mut Course,
) {
    match (how.kick, how.drift, how.transfer.increment) {
        (true, true, true) => {
            blocks::<W, true, true, true, S, A>(shape, nodes, how, points, course)
        }
        (true, true, false) => {
            blocks::<W, true, true, false, S, A>(shape, nodes, how, points, course);
        }
        (true, false, true) => {
            blocks::<W, true, false, true, S, A>(shape, nodes, how, points, course);
        }
        (true, false, false) => {
            blocks::<W, true, false, false, S, A>(shape, nodes, how, points, course);
        }
        (false, ..) => blocks::<W, false, true, false, S, A>(shape, nodes, how, points, course),
    }
}

/// [`carry`] with velocities for the points if `KICK`, by increments if `INCREMENT`, and a move if `DRIFT`.
fn blocks<
    const W: usize,
    const KICK: bool,
    const DRIFT: bool,
    const INCREMENT: bool,
    S: Shape<W>,
    A: AffineState,
>(
    shape: S,
    [velocity, increment]: [&VectorWindow; 2],
    how: &Carry,
    points: Carried<'_, A>,
    course: &mut Course,
) {
    let filtered = how.filters();
    let takes = KICK && how.takes::<A>();
    let dt = splat(how.dt);
    let per_dt = splat(if how.dt > 0.0 { 1.0 / how.dt } else { 0.0 });
    let settles = how.settling.settles();
    let [past, ahead] = [how.settling.past, how.settling.ahead].map(splat);
    let per_kept = splat(1.0 / how.kept);
    let pic = splat(how.transfer.pic_fraction());
    let flip = splat(1.0 - how.transfer.pic_fraction());
    let own = splat(how.kept);
    let mut to = *course;
    let each = points.x.iter_mut().zip(points.motion);
    let each = each.zip(points.unsettled).enumerate();
    for (b, ((x, motion), unsettled)) in each {
        let (place, live) = (&points.places[b], points.live[b]);
        let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
        let (v, affine) = interpolate::<W, S, A>(velocity, place, &s);
        let old = *motion;
        let mut gain = Motion::at_rest();
        if takes {
            (gain.v, gain.affine) = interpolate::<W, S, A>(increment, place, &s);
        } else if INCREMENT {
            (gain.v, ()) = interpolate::<W, S, ()>(increment, place, &s);
        }
        if KICK && INCREMENT {
            for a in 0..2 {
                motion.v[a] = pic * v[a] + flip * own.mul_add(motion.v[a], gain.v[a]);
            }
        } else if KICK {
            motion.v = v;
        }
        if KICK {
            motion.affine = affine;
        }
        if takes {
            let mut old = old;
            if filtered {
                old.v = points.aside[b];
            }
            let of_block = taken_by_transfer::<W, S, A>(old, own, gain, motion);
            to.taken = live.mul_add(of_block, to.taken);
        }
        let mut moves = v;
        if settles {
            for a in 0..2 {
                if KICK {
                    // The kick and the share that damping leaves make the velocity after it out of the one before.
                    let before = (v[a] - gain.v[a]) * per_kept;
                    unsettled[a] = how.settling.correction(past * before, unsettled[a]);
                }
                if DRIFT {
                    moves[a] = unsettled[a].mul_add(per_dt, v[a]);
                    unsettled[a] = ahead * v[a];
                }
            }
        }
        for a in 0..2 {
            if DRIFT {
                x[a] = moves[a].mul_add(dt, x[a]);
            }
            to.lower[a] = to.lower[a].fast_min(x[a]);
            to.upper[a] = to.upper[a].fast_max(x[a]);
            to.total = motion.v[a].mul_add(motion.v[a], to.total);
        }
        to.speed_sq = to
            .speed_sq
            .fast_max(moves[0] * moves[0] + moves[1] * moves[1]);
    }
    *course = to;
}

/// What a transfer takes of the kinetic energy of four points in a kick, twice and per mass, in m^2/s^2.
///
/// Without the transfer's smoothing a point would have gained what the grid has. The velocity that it lacks acts as a
/// force would, so its work is that of a force in leapfrog: its impulse times the mean of the velocities before and
/// after the kick. `old` is from before XPIC's filter; damping leaves the share `own` of it.
#[inline(always)]
fn taken_by_transfer<const W: usize, S: Shape<W>, A: AffineState>(
    old: Motion<A>,
    own: Lanes,
    gain: Motion<A>,
    new: &Motion<A>,
) -> Lanes {
    let mut taken = ZERO;
    for a in 0..2 {
        let lacks = own.mul_add(old.v[a], gain.v[a]) - new.v[a];
        taken = lacks.mul_add(old.v[a] + new.v[a], taken);
    }
    if A::PRESENT {
        let mut of_affine = ZERO;
        let [old, gain, new] = [&old, &gain, new].map(|motion| motion.affine.slopes());
        for i in 0..2 {
            for a in 0..2 {
                let lacks = own.mul_add(old[i][a], gain[i][a]) - new[i][a];
                of_affine = lacks.mul_add(old[i][a] + new[i][a], of_affine);
            }
        }
        // The slopes are C L, and D = L^2 / S::INVERSE_INERTIA.
        let inertia = splat(1.0 / S::INVERSE_INERTIA.unwrap_or(1.0));
        taken = of_affine.mul_add(inertia, taken);
    }
    taken
}

/// `sum_I S_Ip v_I` of four points and, if wanted, `B_p D_p^-1 L = L D_p^-1 sum_I S_Ip v_I (x_I - x_p)`.
#[inline(always)]
fn interpolate<const W: usize, S: Shape<W>, A: AffineState>(
    velocity: &VectorWindow,
    place: &Place,
    s: &[[Lanes; W]; 2],
) -> ([Lanes; 2], A) {
    // S_Ip (x_I - x_p) L D^-1 along each axis.
    let inverse_inertia = splat(S::INVERSE_INERTIA.unwrap_or(0.0));
    let mut moment = [[ZERO; W]; 2];
    if A::PRESENT {
        for a in 0..2 {
            for i in 0..W {
                moment[a][i] = s[a][i] * ((splat(i as f64) - place.d[a]) * inverse_inertia);
            }
        }
    }
    let (mut v, mut slopes) = ([ZERO; 2], [[ZERO; 2]; 2]);
    for j in 0..W {
        let nodes = gather_row::<W>(velocity, place, j);
        let (mut row, mut row_moment) = ([ZERO; 2], [ZERO; 2]);
        for i in 0..W {
            for a in 0..2 {
                row[a] = s[0][i].mul_add(nodes[i][a], row[a]);
                if A::PRESENT {
                    row_moment[a] = moment[0][i].mul_add(nodes[i][a], row_moment[a]);
                }
            }
        }
        for a in 0..2 {
            v[a] = s[1][j].mul_add(row[a], v[a]);
            if A::PRESENT {
                slopes[0][a] = s[1][j].mul_add(row_moment[a], slopes[0][a]);
                slopes[1][a] = moment[1][j].mul_add(row[a], slopes[1][a]);
            }
        }
    }
    (v, A::from_slopes(slopes))
}
