//! Strain and spin rate, stress, and internal force (Jiang 2020 eqs. 13 and 21 to 25): one pass over the points.

use super::volumes::{shares, swelling};
use crate::kernel::lanes::{Lanes, ZERO, largest, splat, sum};
use crate::kernel::point_tile::Tile;
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerBlock, PerTile, over_tiles};
use crate::kernel::tiles::{Frame, Place, pitch};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::{NO_VECTORS, VectorWindow, fill_window, gather_row, scatter_row};
use crate::material::{Deformation, Dissipated, Material, Point, power};
use crate::state::constitutive::{
    MaterialPoints, PositionsAt, StressPass, StressReport, UpdateStress, Velocity,
};
use crate::state::continuum::Continuum;
use crate::state::volumes::VolumeNodes;

/// Updates the stress of all points over `dt` (s) if `strain`, and sums their internal forces if `load`.
pub fn stress_pass<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
    (velocity, positions_at): (Velocity, PositionsAt),
    strain: bool,
    load: bool,
) {
    let threads = &continuum.threads;
    let (clouds, grid) = (&mut continuum.clouds, &continuum.grid);
    for cloud in clouds {
        let rate = cloud.material.volume_rate();
        let volumes = strain && rate > 0.0;
        cloud.material.update(StressPass {
            threads,
            shape: cloud.shape,
            dt,
            per_cell: 1.0 / grid.geometry.cell,
            volume: cloud.volume,
            tiles: &cloud.tiles,
            x: &cloud.state.x,
            nodes: &grid.tiles,
            volumes: volumes.then(|| (&grid.volumes[..], shares(rate, dt))),
            velocity,
            positions_at,
            strain,
            load,
            force: &mut cloud.force,
            reports: &mut cloud.state.stress_reports,
        });
    }
}

impl<const W: usize, S: Shape<W>, M: Material> UpdateStress<W, S> for MaterialPoints<M> {
    fn update(&mut self, pass: StressPass<'_, W, S>) {
        update_tiles(&self.model, &mut self.points, pass);
    }
}

/// Updates the stress of all points and sums their internal forces.
fn update_tiles<const W: usize, S: Shape<W>, M: Material>(
    model: &M,
    points: &mut [Point<M::State>],
    pass: StressPass<'_, W, S>,
) {
    let pitch = pitch(W);
    let StressPass {
        threads,
        shape,
        dt,
        per_cell,
        volume,
        tiles,
        x,
        nodes,
        volumes,
        velocity,
        positions_at,
        strain,
        load: loads,
        force,
        reports,
    } = pass;
    let volumes = volumes.filter(|_| M::SHARES_VOLUMES);
    let scale = splat(dt * per_cell);
    let per_dt = if dt > 0.0 { 1.0 / dt } else { 0.0 };
    let half = splat(match positions_at {
        PositionsAt::Start => -0.5,
        PositionsAt::End => 0.5,
    });
    let load = -volume * per_cell;
    let share = (PerBlock(points), PerTile::one(force), PerTile::one(reports));
    over_tiles(
        threads,
        tiles,
        share,
        Memory::new,
        &|tile, (points, force, report), memory| {
            let model = &{ *model }; // nothing can change its constants: what they give is computed once a tile
            fill_window::<W, _>(&mut memory.velocity, nodes, tile, |t| match velocity {
                Velocity::Before => &t.before,
                Velocity::After => &t.after,
            });
            memory.take_ratios::<W>(volumes.map(|(nodes, _)| nodes), tile);
            let (force, mut lost) = (&mut force.items[0], Losses::default());
            if loads {
                force.0.fill(0.0);
            }
            let batches = points
                .0
                .chunks_mut(BATCH)
                .zip(x[tile.first..].chunks(BATCH));
            for (batch, (points, x)) in batches.enumerate() {
                let live = |b: usize| tile.live(batch * BATCH + b);
                if strain {
                    memory.strains(&tile.frame, &shape, &x[..points.len()], (scale, half));
                    let swell = volumes.map(|(_, shares)| {
                        memory.swellings(&tile.frame, &shape, (points, x), shares)
                    });
                    for (b, (point, by)) in points.iter_mut().zip(&memory.by).enumerate() {
                        let more = swell.map(|swell| swell[b]);
                        lost.strain(model, point, (by, more), per_dt, live(b));
                    }
                }
                for point in points.iter() {
                    let stiffness = model.stiffness_over_density(point);
                    lost.stiffest = lost.stiffest.fast_max(stiffness);
                }
                if loads {
                    for (b, (point, x)) in points.iter().zip(x).enumerate() {
                        let place = tile.frame.locate(x, pitch);
                        let volume = point.volume * splat(load) * live(b);
                        add_internal_force(force, &place, &shape, point, volume);
                    }
                }
            }
            lost.write(&mut report.items[0], strain);
        },
    );
}

/// Blocks that go through the pass together, one stage after the other: the processor then has several independent
/// blocks to work on while one waits for a division or a root.
const BATCH: usize = 8;

/// The working memory of a thread.
struct Memory {
    velocity: VectorWindow,
    by: [Deformation; BATCH],
    ratio: VectorWindow,
}

impl Memory {
    /// The volumes at the nodes around a tile, where there are any.
    fn take_ratios<const W: usize>(&mut self, nodes: Option<&[VolumeNodes]>, tile: &Tile) {
        if let Some(nodes) = nodes {
            fill_window::<W, _>(&mut self.ratio, nodes, tile, |t| &t.ratio);
        }
    }

    /// The deformations of the points of a batch, at their positions.
    #[inline(always)]
    fn strains<const W: usize, S: Shape<W>>(
        &mut self,
        frame: &Frame,
        shape: &S,
        x: &[[Lanes; 2]],
        (scale, half): (Lanes, Lanes),
    ) {
        for (x, by) in x.iter().zip(&mut self.by) {
            let place = frame.locate(x, pitch(W));
            let gradient = deformation(&self.velocity, &place, shape, scale);
            *by = gradient.in_the_middle(half);
        }
    }

    /// The change of `ln J` of the points of a batch, at their positions.
    #[inline(always)]
    fn swellings<const W: usize, S: Shape<W>, P>(
        &self,
        frame: &Frame,
        shape: &S,
        (points, x): (&[Point<P>], &[[Lanes; 2]]),
        shares: [f64; 2],
    ) -> [Lanes; BATCH] {
        let mut swell = [ZERO; BATCH];
        for (swell, (point, x)) in swell.iter_mut().zip(points.iter().zip(x)) {
            let place = frame.locate(x, pitch(W));
            *swell = swelling(&self.ratio, &place, shape, point.volume, shares);
        }
        swell
    }

    fn new() -> Self {
        Self {
            velocity: NO_VECTORS,
            by: [Deformation::NOTHING; BATCH],
            ratio: NO_VECTORS,
        }
    }
}

/// Sums over the points of a tile.
#[derive(Default)]
struct Losses {
    stiffest: Lanes,
    plastic: Lanes,
    viscous: Lanes,
    twice_work: Lanes,
}

impl Losses {
    /// Updates four points and counts the dissipated work. The work of an additional `swelling` of `ln J` counts as
    /// viscous work, which may then be negative.
    #[inline(always)]
    fn strain<M: Material>(
        &mut self,
        model: &M,
        point: &mut Point<M::State>,
        (by, swell): (&Deformation, Option<Lanes>),
        per_dt: f64,
        live: Lanes,
    ) {
        let before = point.volume * power(&point.stress, by);
        let dissipated = match swell {
            None => model.update(point, by, per_dt),
            Some(swell) => {
                let half = splat(0.5) * swell;
                let swollen = Deformation {
                    xx: by.xx + half,
                    yy: by.yy + half,
                    ..*by
                };
                let pressed = |point: &Point<M::State>| {
                    point.volume * (point.stress.xx + point.stress.yy) * half
                };
                let before = pressed(point);
                let dissipated = model.update(point, &swollen, per_dt);
                let given = splat(0.5) * (before + pressed(point));
                self.viscous = live.mul_neg_add(given, self.viscous);
                dissipated
            }
        };
        let after = point.volume * power(&point.stress, by);
        self.count::<M>(&dissipated, before + after, live);
    }

    /// Writes the sums into the report of the tile.
    fn write(&self, report: &mut StressReport, strained: bool) {
        report.stiffness = largest(self.stiffest);
        if strained {
            report.lost = [sum(self.plastic), sum(self.viscous)];
            report.work = 0.5 * sum(self.twice_work);
        }
    }

    /// The work by the trapezoidal rule is what the leapfrog of nodes and points does to the same stress: the force of t_n
    /// acts over half of the interval behind and half of the one ahead.
    #[inline(always)]
    fn count<M: Material>(&mut self, dissipated: &Dissipated, twice_work: Lanes, live: Lanes) {
        self.twice_work = live.mul_add(twice_work, self.twice_work);
        if M::DISSIPATES {
            self.plastic = live.mul_add(dissipated.plastic, self.plastic);
            self.viscous = live.mul_add(dissipated.viscous, self.viscous);
        }
    }
}

/// `S` and `L dS/dx` of four points along both axes.
#[inline(always)]
fn functions<const W: usize, S: Shape<W>>(shape: &S, place: &Place) -> [[[Lanes; W]; 2]; 2] {
    [
        [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])],
        [
            shape.gradients(0, place.d[0]),
            shape.gradients(1, place.d[1]),
        ],
    ]
}

/// `L_ij dt = sum_I v_iI S_I,j dt` (eqs. 21, 22) of four points.
#[inline(always)]
fn deformation<const W: usize, S: Shape<W>>(
    velocity: &VectorWindow,
    place: &Place,
    shape: &S,
    scale: Lanes,
) -> Deformation {
    let [s, g] = functions(shape, place);
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
fn add_internal_force<const W: usize, S: Shape<W>, P>(
    force: &mut VectorWindow,
    place: &Place,
    shape: &S,
    point: &Point<P>,
    volume: Lanes,
) {
    let [s, g] = functions(shape, place);
    let xx = point.stress.xx * volume;
    let yy = point.stress.yy * volume;
    let xy = point.stress.xy * volume;
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
