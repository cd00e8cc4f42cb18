//! Strain and spin rate, and internal force (Jiang 2020 eqs. 13, 21 and 22), of a batch of points.

use super::volumes::swelling;
use crate::kernel::lanes::{Lanes, ZERO, splat};
use crate::kernel::shape::Shape;
use crate::kernel::tiles::Place;
use crate::kernel::window::{VectorWindow, gather_row, scatter_row};
use crate::material::{Deformation, Stress, Stressed};

/// The end of the strained interval to which the positions of the points belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PositionsAt {
    /// Its start.
    Start,
    /// Its end.
    End,
}

/// How points are strained.
#[derive(Debug, Clone, Copy)]
pub struct Strain {
    /// Length of the interval in s.
    pub dt: f64,
    /// To which of its ends the positions of the points belong.
    pub positions_at: PositionsAt,
}

/// Blocks that go through a sweep together, one stage after the other: the processor then has several independent
/// blocks to work on while one waits for a division or a root.
pub const BATCH: usize = 16;

/// Where four points are: `S` and `L dS/dx` along both axes.
#[derive(Clone, Copy)]
pub struct At<const W: usize> {
    place: Place,
    s: [[Lanes; W]; 2],
    g: [[Lanes; W]; 2],
}

impl<const W: usize> At<W> {
    /// At the first node.
    pub const NOWHERE: Self = Self {
        place: Place::NOWHERE,
        s: [[ZERO; W]; 2],
        g: [[ZERO; W]; 2],
    };

    /// With what `shape` gives there.
    #[inline(always)]
    fn new<S: Shape<W>>(shape: &S, place: &Place) -> Self {
        Self {
            s: [0, 1].map(|a| shape.weights(a, place.d[a])),
            g: [0, 1].map(|a| shape.gradients(a, place.d[a])),
            place: *place,
        }
    }
}

/// Computes what `shape` gives to the points of a batch.
pub fn weigh<const W: usize, S: Shape<W>>(shape: S, places: &[Place], at: &mut [At<W>; BATCH]) {
    for (place, at) in places.iter().zip(at) {
        *at = At::new(&shape, place);
    }
}

/// The deformations of the points of a batch over an interval, by velocities of the nodes: eqs. 21 and 22.
pub fn deform<const W: usize>(
    velocity: &VectorWindow,
    at: &[At<W>],
    (strain, per_cell): (Strain, f64),
    by: &mut [Deformation; BATCH],
) {
    let scale = splat(strain.dt * per_cell);
    let half = splat(match strain.positions_at {
        PositionsAt::Start => -0.5,
        PositionsAt::End => 0.5,
    });
    for (at, by) in at.iter().zip(by) {
        *by = deformation(velocity, at, scale).in_the_middle(half);
    }
}

/// The changes of `ln J` by which points of a batch share their volumes.
pub fn swell<const W: usize>(
    ratio: &VectorWindow,
    at: &[At<W>],
    points: &[Stressed],
    shares: [f64; 2],
) -> [Lanes; BATCH] {
    let mut swell = [ZERO; BATCH];
    for (swell, (point, at)) in swell.iter_mut().zip(points.iter().zip(at)) {
        *swell = swelling(ratio, &at.place, &at.s, point.volume, shares);
    }
    swell
}

/// Adds the internal forces of the points of a batch to the window: eq. 13. `load` is `-V_p / L` before any strain.
pub fn press<const W: usize>(
    at: &[At<W>],
    points: &[Stressed],
    live: &[Lanes; BATCH],
    load: f64,
    force: &mut VectorWindow,
) {
    for ((point, at), live) in points.iter().zip(at).zip(live) {
        let volume = point.volume * splat(load) * *live;
        add_internal_force(force, at, &point.stress, volume);
    }
}

/// `L_ij dt = sum_I v_iI S_I,j dt` (eqs. 21, 22) of four points.
#[inline(always)]
fn deformation<const W: usize>(
    velocity: &VectorWindow,
    At { place, s, g }: &At<W>,
    scale: Lanes,
) -> Deformation {
    let (mut xx, mut xy, mut yx, mut yy) = (ZERO, ZERO, ZERO, ZERO);
    for j in 0..W {
        let row = gather_row::<W>(velocity, place, j);
        let (mut gx, mut gy, mut sx, mut sy) = (ZERO, ZERO, ZERO, ZERO);
        for i in 0..W {
            let [vx, vy] = row[i];
            gx = g[0][i].mul_add(vx, gx);
            gy = g[0][i].mul_add(vy, gy);
            sx = s[0][i].mul_add(vx, sx);
            sy = s[0][i].mul_add(vy, sy);
        }
        xx = s[1][j].mul_add(gx, xx);
        yx = s[1][j].mul_add(gy, yx);
        xy = g[1][j].mul_add(sx, xy);
        yy = g[1][j].mul_add(sy, yy);
    }
    Deformation {
        xx: xx * scale,
        xy: xy * scale,
        yx: yx * scale,
        yy: yy * scale,
    }
}

/// `f_I^int -= V_p sigma_p grad S_Ip` (eq. 13); `volume` is `-V_p / L`, zero in lanes without a point.
#[inline(always)]
fn add_internal_force<const W: usize>(
    force: &mut VectorWindow,
    At { place, s, g }: &At<W>,
    stress: &Stress,
    volume: Lanes,
) {
    let xx = stress.xx * volume;
    let yy = stress.yy * volume;
    let xy = stress.xy * volume;
    for j in 0..W {
        let along = [s[1][j] * xx, s[1][j] * xy];
        let across = [g[1][j] * xy, g[1][j] * yy];
        let mut row = [[ZERO; 2]; W];
        for i in 0..W {
            for a in 0..2 {
                row[i][a] = g[0][i].mul_add(along[a], s[0][i] * across[a]);
            }
        }
        scatter_row(force, place, j, &row);
    }
}
