//! Loads on points: a body force that is a formula, and dead loads on the points of a surface.
//!
//! Both are forces on points that reach the nodes through the shape function, `f_I = sum_p S_Ip f_p`, beside the
//! internal force. A group without a load has none of this.
//!
//! Their impulse is counted as applied. Their work is the trapezoidal rule over the way of each point,
//! `sum_p (f_p^n + f_p^{n+1}) / 2 . (x_p^{n+1} - x_p^n)`: exact for a dead load, and otherwise what the leapfrog pairs
//! (the force of `t_n` acts over half of the interval behind and half of the one ahead). It is counted as work of driven
//! boundaries.

use interface::solver::Fault;
use interface::step::Step;
use mechanics::expression::Expression;
use serde::{Deserialize, Serialize};

use crate::kernel::lanes::{LANES, Lanes, ZERO, splat, sum};
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerBlock, PerTile, over_tiles};
use crate::kernel::tiles::pitch;
use crate::kernel::transfer::{AffineState, Transfer};
use crate::kernel::window::scatter_row;
use crate::state::continuum::Continuum;
use crate::state::points::{Cloud, LaneCopy, NO_POINT, Sources, reorder};

/// The loads on a cloud.
pub struct Loads {
    body_force: Option<BodyForce>,
    points: Vec<Load>,
    scratch: Vec<Load>,
    reports: Vec<LoadReport>,
}

/// An acceleration in m/s^2 over the slots `x`, `y` (initial position, m) and `t` (s).
struct BodyForce {
    components: [Expression; 2],
    /// Whether it differs between points.
    varies: bool,
}

/// The loads on four points.
#[derive(Debug, Clone, Copy)]
struct Load {
    /// Position at the start in m: where a body force is asked for.
    start: [Lanes; 2],
    /// Dead load in N/m.
    dead: [Lanes; 2],
    /// `x_p` of the step before in m.
    x: [Lanes; 2],
    /// `f_p` of the step before in N/m.
    force: [Lanes; 2],
}

/// What a load remembers of the step before.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct LastLoad {
    x: [Lanes; 2],
    force: [Lanes; 2],
}

impl LaneCopy for Load {
    fn copy_lane(&mut self, to: usize, source: &Self, from: usize) {
        self.start.copy_lane(to, &source.start, from);
        self.dead.copy_lane(to, &source.dead, from);
        self.x.copy_lane(to, &source.x, from);
        self.force.copy_lane(to, &source.force, from);
    }
}

/// Sums over the points of a tile.
#[derive(Debug, Clone, Copy, Default)]
struct LoadReport {
    /// `sum f_p^n` in N/m.
    force: [f64; 2],
    /// Work over the interval behind in J/m.
    work: f64,
}

impl Loads {
    /// The loads on points at `positions` (m): a body force and, unless empty, a dead load on each (N/m). `None` if
    /// there are none.
    pub fn new(
        body_force: Option<[Expression; 2]>,
        positions: &[[f64; 2]],
        dead: &[[f64; 2]],
    ) -> Option<Box<Self>> {
        if body_force.is_none() && dead.is_empty() {
            return None;
        }
        let block = |b: usize, values: &[[f64; 2]]| {
            [0, 1].map(|a| {
                let mut lanes = ZERO;
                let of_block = values.iter().skip(b * LANES);
                for (lane, value) in lanes.as_mut_array().iter_mut().zip(of_block) {
                    *lane = value[a];
                }
                lanes
            })
        };
        Some(Box::new(Self {
            body_force: body_force.map(|components| BodyForce {
                varies: components.iter().any(|c| c.uses(&|slot| slot < 2)),
                components,
            }),
            points: (0..positions.len().div_ceil(LANES))
                .map(|b| Load {
                    start: block(b, positions),
                    dead: block(b, dead),
                    x: block(b, positions),
                    force: [ZERO; 2],
                })
                .collect(),
            scratch: Vec::new(),
            reports: Vec::new(),
        }))
    }

    /// Follows the points to their new places.
    pub fn reorder(&mut self, sources: &Sources, tiles: usize) {
        reorder(&mut self.points, &mut self.scratch, sources);
        self.reports.resize(tiles, LoadReport::default());
    }

    /// What the loads remember, block by block.
    pub fn save(&self) -> Vec<LastLoad> {
        let Self {
            body_force: _, // of the configuration
            points,
            scratch: _, // room to sort in
            reports: _, // of one step
        } = self;
        let last = |load: &Load| {
            let Load {
                start: _, // of the configuration, point by point
                dead: _,  // likewise
                x,
                force,
            } = *load;
            LastLoad { x, force }
        };
        points.iter().map(last).collect()
    }

    /// Takes over what [`Self::save`] gave, one for each block. `sources`: for every lane its point's present lane.
    pub fn restore(&mut self, saved: &[LastLoad], sources: &Sources, tiles: usize) {
        self.reorder(sources, tiles);
        for (load, last) in self.points.iter_mut().zip(saved) {
            (load.x, load.force) = (last.x, last.force);
        }
    }

    /// Work in J/m on a lane's point since loads were last applied, if it is taken away at `x` (m).
    pub fn last_work(&self, lane: usize, x: [f64; 2]) -> f64 {
        let load = &self.points[lane / LANES];
        let k = lane % LANES;
        (0..2)
            .map(|a| load.force[a].as_array()[k] * (x[a] - load.x[a].as_array()[k]))
            .sum()
    }

    /// Bytes of memory in use.
    pub fn bytes(&self) -> usize {
        (self.points.capacity() + self.scratch.capacity()) * size_of::<Load>()
    }
}

impl BodyForce {
    /// Accelerations in m/s^2 of four points that began at `start`.
    fn at(&self, start: &[Lanes; 2], time: f64) -> [Lanes; 2] {
        let mut acceleration = [ZERO; 2];
        for k in 0..LANES {
            let slots = [start[0].as_array()[k], start[1].as_array()[k], time];
            for a in 0..2 {
                acceleration[a].as_mut_array()[k] = self.components[a].evaluate(&slots);
            }
        }
        acceleration
    }
}

/// Adds the loads of `time` (s) to the forces on a cloud's nodes, in a domain of size `size` (m).
fn apply<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
    grain: usize,
    cloud: &mut Cloud<W, S, A>,
    size: [f64; 2],
    time: f64,
) {
    let Some(loads) = &mut cloud.loads else {
        return;
    };
    let (shape, x, mass) = (cloud.shape, &cloud.x, splat(cloud.mass));
    let body_force = loads.body_force.as_ref();
    let uniform = match body_force {
        Some(b) if !b.varies => b.at(&[ZERO; 2], time),
        _ => [ZERO; 2],
    };
    let share = (
        PerBlock(&mut loads.points[..]),
        PerTile {
            items: &mut cloud.force[..],
            stride: 1,
        },
        PerTile {
            items: &mut loads.reports[..],
            stride: 1,
        },
    );
    over_tiles(
        grain,
        &cloud.tiles,
        share,
        || (),
        &|tile, (points, force, report), ()| {
            let force = &mut force.items[0];
            let (mut total, mut work) = ([ZERO; 2], ZERO);
            for (b, load) in points.0.iter_mut().enumerate() {
                let (x, live) = (&x[tile.first + b], tile.live(b));
                let acceleration = match body_force {
                    Some(formula) if formula.varies => formula.at(&load.start, time),
                    _ => uniform,
                };
                let mut f = [ZERO; 2];
                for a in 0..2 {
                    f[a] = live * (load.dead[a] + mass * acceleration[a]);
                    let mean = splat(0.5) * (load.force[a] + f[a]);
                    // A point that a periodic wall has moved by the size of the domain has not gone that way.
                    let way = x[a] - load.x[a];
                    let way = way - splat(size[a]) * (way * splat(1.0 / size[a])).round();
                    work += live * mean * way;
                    total[a] += f[a];
                }
                load.x = *x;
                load.force = f;
                let place = tile.frame.locate(x, pitch(W));
                let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
                for j in 0..W {
                    let row: [[Lanes; 2]; W] = core::array::from_fn(|i| {
                        let weight = s[0][i] * s[1][j];
                        [weight * f[0], weight * f[1]]
                    });
                    scatter_row(force, &place, j, &row);
                }
            }
            report.items[0] = LoadReport {
                force: total.map(sum),
                work: sum(work),
            };
        },
    );
}

impl<const W: usize, S: Shape<W>, T: Transfer> Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    /// Adds loads to the nodes, and counts their impulse and work.
    ///
    /// # Errors
    /// [`Fault::NotFinite`] with the point at which a formula gives no number.
    pub fn apply_loads(&mut self, step: &Step) -> Result<(), Fault> {
        if self.clouds.iter().all(|c| c.loads.is_none()) {
            return Ok(());
        }
        let grain = self.grain();
        let (clouds, geometry) = (&mut self.clouds, &self.grid.geometry);
        let size = [0, 1].map(|a| geometry.upper[a] - geometry.lower[a]);
        self.threads.run(|| {
            for cloud in clouds {
                apply(grain, cloud, size, step.time);
            }
        });
        for cloud in &self.clouds {
            let Some(loads) = &cloud.loads else {
                continue;
            };
            let mut force = [0.0; 2];
            for report in &loads.reports {
                force[0] += report.force[0];
                force[1] += report.force[1];
                self.books.driven_work += report.work;
            }
            if !(force[0] + force[1]).is_finite() {
                return Err(loads.fault(&cloud.ids, cloud.first_id));
            }
            self.books.applied_impulse += force.map(|f| step.kick() * f);
        }
        Ok(())
    }
}

impl Loads {
    fn fault(&self, ids: &[[u32; LANES]], first_id: u64) -> Fault {
        let unsound = |(block, load): (usize, &Load)| {
            (0..LANES).find_map(|k| {
                let id = ids[block][k];
                let sound = load.force.iter().all(|f| f.as_array()[k].is_finite());
                (id != NO_POINT && !sound).then_some(first_id + u64::from(id))
            })
        };
        let item = match self.points.iter().enumerate().find_map(unsound) {
            Some(id) => format!("point {id}"),
            None => "all points together".into(),
        };
        Fault::NotFinite {
            what: "body force".into(),
            item,
        }
    }
}
