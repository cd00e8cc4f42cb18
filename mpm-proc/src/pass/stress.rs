//! Strain and spin rate, stress, and internal force (Jiang 2020 eqs. 13 and 21 to 25): one pass over the points.

use super::volumes::{shares, swelling};
use crate::kernel::lanes::{Lanes, ZERO, splat};
use crate::kernel::point_tile::Tile;
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerBlock, PerTile, RowsPerBlock, over_tiles};
use crate::kernel::tiles::{Frame, NODES, Place, pitch};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::{
    NO_VECTORS, VectorWindow, clear, fill_window, gather_row, scatter_row,
};
use crate::material::{Deformation, Straining, Stress, Stressed, Sums};
use crate::state::continuum::Continuum;
use crate::state::grid::Grid;
use crate::state::points::{Cloud, StressReport};
use mechanics::threads::Threads;

/// A velocity of the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Velocity {
    /// `v_I^{n-1/2}`.
    Before,
    /// `v_I^{n+1/2}`.
    After,
}

/// Updates the stress of all points over an interval of `strained` (s), if any, by a velocity of the nodes: up to their present
/// positions if it `loads`, that is sums their internal forces too, else from there on.
pub fn stress_pass<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    strained: Option<f64>,
    by: Velocity,
    loads: bool,
) {
    let (clouds, grid) = (&mut continuum.clouds, &continuum.grid);
    Cloud::each(&continuum.threads, clouds, |threads, cloud| {
        stress_cloud(threads, cloud, grid, (strained, by), loads);
    });
}

/// [`stress_pass`] of one cloud.
fn stress_cloud<const W: usize, S: Shape<W>, A: AffineState>(
    threads: &Threads,
    cloud: &mut Cloud<W, S, A>,
    grid: &Grid,
    (strained, velocity): (Option<f64>, Velocity),
    loads: bool,
) {
    let (shape, model, x) = (cloud.shape, &*cloud.material, &cloud.state.x);
    let rows = model.rows();
    let per_cell = 1.0 / grid.geometry.cell;
    let rate = model.sharing_rate();
    let (strain, dt) = (strained.is_some(), strained.unwrap_or(0.0));
    let volumes = (strain && rate > 0.0).then(|| (&grid.sums[..], shares(rate, dt)));
    let scale = splat(dt * per_cell);
    let per_dt = if dt > 0.0 { 1.0 / dt } else { 0.0 };
    let half = splat(if loads { 0.5 } else { -0.5 });
    let load = -cloud.volume * per_cell;
    let stresses = &mut cloud.state.stresses;
    let share = (
        PerBlock(&mut stresses.points[..]),
        RowsPerBlock {
            items: &mut stresses.rows[..],
            count: rows,
        },
        (
            PerTile(&mut cloud.force[..]),
            PerTile(&mut cloud.state.stress_reports[..]),
        ),
    );
    over_tiles(
        threads,
        &cloud.tiles,
        share,
        Memory::<W>::new,
        &|tile, (points, of_model, (force, report)), memory| {
            fill_window::<W, _>(
                &mut memory.velocity,
                &grid.tiles,
                tile,
                |t| match velocity {
                    Velocity::Before => &t.before,
                    Velocity::After => &t.after,
                },
            );
            memory.take_ratios(volumes.map(|(nodes, _)| nodes), tile);
            let (force, mut sums) = (&mut force.0[0], Sums::default());
            if loads {
                clear::<W, 2>(&mut force.0, tile);
            }
            for first in (0..tile.blocks).step_by(BATCH) {
                let batch = first..tile.blocks.min(first + BATCH);
                let x = &x[tile.first..][batch.clone()];
                let points = &mut points.0[batch.clone()];
                let of_model = &mut of_model.items[batch.start * rows..batch.end * rows];
                for (live, b) in memory.live.iter_mut().zip(batch) {
                    *live = tile.live(b);
                }
                memory.locate(&tile.frame, &shape, x);
                if strain {
                    memory.strains(x.len(), (scale, half));
                    let swell = volumes.map(|(_, shares)| memory.swellings(points, shares));
                    let by = Straining {
                        by: &memory.by,
                        swell: swell.as_ref().map(|swell| &swell[..]),
                        live: &memory.live,
                        per_dt,
                    };
                    model.strain(points, of_model, &by, &mut sums);
                }
                model.stiffen(points, of_model, &mut sums);
                if loads {
                    for ((point, at), live) in points.iter().zip(&memory.at).zip(&memory.live) {
                        let volume = point.volume * splat(load) * *live;
                        add_internal_force(force, at, &point.stress, volume);
                    }
                }
            }
            write(&mut report.0[0], &sums, strain);
        },
    );
}

/// Writes the sums into the report of a tile.
fn write(report: &mut StressReport, sums: &Sums, strained: bool) {
    report.stiffness = sums.stiffest();
    if strained {
        let [plastic, viscous, work] = sums.works();
        (report.lost, report.work) = ([plastic, viscous], work);
    }
}

/// Blocks that go through the pass together, one stage after the other: the processor then has several independent
/// blocks to work on while one waits for a division or a root.
const BATCH: usize = 16;

/// Where four points are: `S` and `L dS/dx` along both axes.
#[derive(Clone, Copy)]
struct At<const W: usize> {
    place: Place,
    s: [[Lanes; W]; 2],
    g: [[Lanes; W]; 2],
}

/// The working memory of a thread.
struct Memory<const W: usize> {
    velocity: VectorWindow,
    at: [At<W>; BATCH],
    by: [Deformation; BATCH],
    live: [Lanes; BATCH],
    ratio: VectorWindow,
}

impl<const W: usize> Memory<W> {
    /// The volumes at the nodes around a tile, where there are any.
    fn take_ratios(&mut self, nodes: Option<&[[[f64; 2]; NODES]]>, tile: &Tile) {
        if let Some(nodes) = nodes {
            fill_window::<W, _>(&mut self.ratio, nodes, tile, |ratios| ratios);
        }
    }

    /// Finds the points of a batch.
    #[inline(always)]
    fn locate<S: Shape<W>>(&mut self, frame: &Frame, shape: &S, x: &[[Lanes; 2]]) {
        for (x, at) in x.iter().zip(&mut self.at) {
            let place = frame.locate(x, pitch(W));
            *at = At {
                s: [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])],
                g: [
                    shape.gradients(0, place.d[0]),
                    shape.gradients(1, place.d[1]),
                ],
                place,
            };
        }
    }

    /// The deformations of a batch of so many.
    #[inline(always)]
    fn strains(&mut self, count: usize, (scale, half): (Lanes, Lanes)) {
        for (at, by) in self.at[..count].iter().zip(&mut self.by) {
            *by = deformation(&self.velocity, at, scale).in_the_middle(half);
        }
    }

    /// The change of `ln J` of the points of a batch.
    #[inline(always)]
    fn swellings(&self, points: &[Stressed], shares: [f64; 2]) -> [Lanes; BATCH] {
        let mut swell = [ZERO; BATCH];
        for (swell, (point, at)) in swell.iter_mut().zip(points.iter().zip(&self.at)) {
            *swell = swelling(&self.ratio, &at.place, &at.s, point.volume, shares);
        }
        swell
    }

    fn new() -> Self {
        Self {
            velocity: NO_VECTORS,
            at: [At {
                place: Place::NOWHERE,
                s: [[ZERO; W]; 2],
                g: [[ZERO; W]; 2],
            }; BATCH],
            by: [Deformation::NOTHING; BATCH],
            live: [ZERO; BATCH],
            ratio: NO_VECTORS,
        }
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
