//! One sweep over the points, tile by tile: while the points of a tile are at hand, all is done with them for which the
//! velocities of the nodes are known.

use super::points_to_grid::map_blocks;
use super::stress::{At, BATCH, Strain, deform, press, swell, weigh};
use super::velocities::{Carried, Carry, Course, carry};
use super::volumes::shares;
use crate::kernel::lanes::{Lanes, ZERO};
use crate::kernel::point_tile::{Tile, Which};
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerBlock, PerTile, RowsPerBlock, over_tiles};
use crate::kernel::tiles::{Place, pitch};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::{NO_VECTORS, VectorWindow, clear, fill_window};
use crate::material::{Deformation, Straining, Sums};
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

/// What a sweep does, in this order.
#[derive(Debug, Clone, Copy)]
pub struct Sweep {
    /// With the points of which tiles.
    pub which: Which,
    /// By which velocities of the nodes.
    pub by: Velocity,
    /// Strains points and updates their stress: eqs. 21 to 25.
    pub strain: Option<Strain>,
    /// Gives points their velocities and moves them, eqs. 26 to 28 and 31; then sums their mass and momentum where they are, for
    /// what follows: eqs. 18, 19 and 30.
    pub carry: Option<Carry>,
    /// Sums internal forces: eq. 13.
    pub load: bool,
}

/// Does with all points what `what` says.
pub fn sweep<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    what: &Sweep,
) {
    let (clouds, grid) = (&mut continuum.clouds, &continuum.grid);
    for cloud in clouds {
        sweep_cloud(&continuum.threads, cloud, grid, what);
    }
}

/// Points take the velocities of the nodes after the kick.
pub fn kicks<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &Continuum<W, S, A>,
    which: Which,
) -> Sweep {
    let kept = continuum.damping_of_points().map_or(1.0, |d| d.kept);
    Sweep {
        which,
        by: Velocity::After,
        strain: None,
        carry: Some(Carry {
            kick: true,
            drift: false,
            transfer: continuum.transfer,
            kept,
            dt: 0.0,
            settling: continuum.settling,
        }),
        load: false,
    }
}

/// [`sweep`] of one cloud.
fn sweep_cloud<const W: usize, S: Shape<W>, A: AffineState>(
    threads: &Threads,
    cloud: &mut Cloud<W, S, A>,
    grid: &Grid,
    what: &Sweep,
) {
    let (shape, model, mass) = (cloud.shape, &*cloud.material, cloud.mass);
    let (aside, spins) = (&cloud.aside, cloud.spin.is_some());
    let rows = model.rows();
    let per_cell = 1.0 / grid.geometry.cell;
    let rate = model.sharing_rate();
    let volumes = what.strain.filter(|_| rate > 0.0);
    let volumes = volumes.map(|strain| (&grid.volumes[..], shares(rate, strain.dt)));
    let dt = what.strain.map_or(0.0, |strain| strain.dt);
    let per_dt = if dt > 0.0 { 1.0 / dt } else { 0.0 };
    let load = -cloud.volume * per_cell;
    let only_loads = what.strain.is_none() && what.carry.is_none();
    // The spin of a group is known when all its points have moved: then a sweep of its own has to sum.
    let sums_ahead = what.carry.is_some() && !spins;
    let loads = what.load && (sums_ahead || what.carry.is_none());
    let stresses = &mut cloud.state.stresses;
    let share = (
        (
            PerBlock(&mut cloud.state.x[..]),
            PerBlock(&mut cloud.state.motion[..]),
            PerBlock(&mut cloud.state.unsettled[..]),
        ),
        (
            PerBlock(&mut stresses.points[..]),
            RowsPerBlock {
                items: &mut stresses.rows[..],
                count: rows,
            },
        ),
        (
            PerTile::one(&mut cloud.mass_momentum[..]),
            PerTile::one(&mut cloud.force[..]),
            (
                PerTile::one(&mut cloud.reports[..]),
                PerTile::one(&mut cloud.state.stress_reports[..]),
            ),
        ),
    );
    over_tiles(
        threads,
        &cloud.tiles,
        share,
        Memory::<W>::new,
        &|tile, part, memory| {
            if !what.which.has(tile) {
                return;
            }
            let ((x, motion, unsettled), (points, of_model), windows) = part;
            let (momentum, force, (report, stress_report)) = windows;
            let (momentum, force) = (&mut momentum.items[0], &mut force.items[0]);
            if only_loads && force.current {
                return;
            }
            memory.fill::<A>(grid, tile, what);
            if let Some((nodes, _)) = volumes {
                fill_window::<W, _>(&mut memory.ratio, nodes, tile, |t| &t.ratio);
            }
            if sums_ahead {
                clear::<W, 4>(&mut momentum.nodes.0);
            }
            if loads {
                clear::<W, 2>(&mut force.nodes.0);
            }
            let (mut sums, mut course) = (Sums::default(), Course::from(x.0[0]));
            for first in (0..tile.blocks).step_by(BATCH) {
                let batch = first..tile.blocks.min(first + BATCH);
                let count = batch.len();
                for (live, b) in memory.live.iter_mut().zip(batch.clone()) {
                    *live = tile.live(b);
                }
                let x = &mut x.0[batch.clone()];
                let places = &mut memory.places[..count];
                for (place, x) in places.iter_mut().zip(&*x) {
                    *place = tile.frame.locate(x, pitch(W));
                }
                let points = &mut points.0[batch.clone()];
                let of_model = &mut of_model.items[batch.start * rows..batch.end * rows];
                if what.strain.is_some() || what.load {
                    weigh(shape, places, &mut memory.at);
                }
                if let Some(strain) = what.strain {
                    let at = &memory.at[..count];
                    deform(&memory.velocity, at, (strain, per_cell), &mut memory.by);
                    let swell = volumes.map(|(_, shares)| swell(&memory.ratio, at, points, shares));
                    let by = Straining {
                        by: &memory.by,
                        swell: swell.as_ref().map(|swell| &swell[..]),
                        live: &memory.live,
                        per_dt,
                    };
                    model.strain(points, of_model, &by, &mut sums);
                }
                if what.strain.is_some() || what.load {
                    model.stiffen(points, of_model, &mut sums);
                }
                if let Some(how) = &what.carry {
                    let motion = &mut motion.0[batch.clone()];
                    let carried = Carried {
                        x,
                        motion,
                        unsettled: &mut unsettled.0[batch.clone()],
                        aside: if how.filters() {
                            &aside[tile.first..][batch]
                        } else {
                            &[]
                        },
                        places,
                        live: &memory.live,
                    };
                    let nodes = [&memory.velocity, &memory.increment];
                    carry(shape, nodes, how, carried, &mut course);
                    if sums_ahead {
                        map_blocks(
                            (tile, first),
                            shape,
                            (x, motion),
                            (mass, None),
                            places,
                            &mut momentum.nodes,
                        );
                        if loads {
                            weigh(shape, places, &mut memory.at);
                        }
                    }
                }
                if loads {
                    press(
                        &memory.at[..count],
                        points,
                        &memory.live,
                        load,
                        &mut force.nodes,
                    );
                }
            }
            if let Some(how) = &what.carry {
                course.write(&mut report.items[0], how.kick);
                momentum.current = sums_ahead;
            }
            if what.strain.is_some() || what.load {
                write(&mut stress_report.items[0], &sums, what.strain.is_some());
            }
            force.current = loads;
        },
    );
}

/// Writes the sums over stresses into the report of a tile.
fn write(report: &mut StressReport, sums: &Sums, strained: bool) {
    report.stiffness = sums.stiffest();
    if strained {
        let [plastic, viscous, work] = sums.works();
        (report.lost, report.work) = ([plastic, viscous], work);
    }
}

/// The working memory of a thread.
struct Memory<const W: usize> {
    velocity: VectorWindow,
    increment: VectorWindow,
    ratio: VectorWindow,
    at: [At<W>; BATCH],
    places: [Place; BATCH],
    by: [Deformation; BATCH],
    live: [Lanes; BATCH],
}

impl<const W: usize> Memory<W> {
    fn new() -> Self {
        Self {
            velocity: NO_VECTORS,
            increment: NO_VECTORS,
            ratio: NO_VECTORS,
            at: [At::NOWHERE; BATCH],
            places: [Place::NOWHERE; BATCH],
            by: [Deformation::NOTHING; BATCH],
            live: [ZERO; BATCH],
        }
    }

    /// Takes the velocities of the nodes around a tile, and their increments where they are needed.
    fn fill<A: AffineState>(&mut self, grid: &Grid, tile: &Tile, what: &Sweep) {
        let nodes = &grid.tiles;
        let mapped = tile.near_load && what.carry.is_some_and(|how| !how.kick);
        fill_window::<W, _>(&mut self.velocity, nodes, tile, |t| match what.by {
            _ if mapped && grid.mapped[t.index].moves != 0 => &grid.mapped[t.index].velocity,
            Velocity::Before => &t.before,
            Velocity::After => &t.after,
        });
        if let Some(how) = what.carry.filter(Carry::compares::<A>) {
            fill_window::<W, _>(&mut self.increment, nodes, tile, |t| &t.before);
            for (b, a) in self.increment.0.iter_mut().zip(&self.velocity.0) {
                *b = a - how.kept * *b;
            }
        }
    }
}
