//! Loads on points: a body force that is a formula, and dead loads on the points of a surface.
//!
//! Both are forces on points that reach the nodes through the shape function, `f_I = sum_p S_Ip f_p`, beside the
//! internal force. A group without a load has none of this.

use mechanics::expression::Expression;
use serde::{Deserialize, Serialize};

use crate::kernel::blocks::{PointBlock, Sources, reorder};
use crate::kernel::lanes::{LANES, Lanes, ZERO};

/// The loads on a cloud.
pub struct Loads {
    /// Body force of the scene.
    pub body_force: Option<BodyForce>,
    /// Loads on the points, block by block.
    pub points: Vec<Load>,
    /// The loads in the step before, likewise: the whole state.
    pub last: Vec<LastLoad>,
    /// Report of each tile.
    pub reports: Vec<LoadReport>,
}

/// An acceleration in m/s^2 over the slots `x`, `y` (initial position, m) and `t` (s).
pub struct BodyForce {
    components: [Expression; 2],
    /// Whether it differs between points.
    pub varies: bool,
}

/// The loads on four points.
#[derive(Debug, Clone, Copy)]
pub struct Load {
    /// Position at the start in m, at which a body force is evaluated.
    pub start: [Lanes; 2],
    /// Dead load in N/m.
    pub dead: [Lanes; 2],
}

/// The load in the step before.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct LastLoad {
    /// `x_p` in m.
    pub x: [Lanes; 2],
    /// `f_p` in N/m.
    pub force: [Lanes; 2],
}

impl PointBlock for Load {
    const NUMBERS: usize = 4;

    fn number(&mut self, n: usize) -> &mut Lanes {
        [&mut self.start, &mut self.dead][n / 2].number(n % 2)
    }
}

impl PointBlock for LastLoad {
    const NUMBERS: usize = 4;

    fn number(&mut self, n: usize) -> &mut Lanes {
        [&mut self.x, &mut self.force][n / 2].number(n % 2)
    }
}

/// Sums over the points of a tile.
#[derive(Debug, Clone, Copy, Default)]
pub struct LoadReport {
    /// `sum f_p^n` in N/m, and its moment about the origin in N.
    pub force: [f64; 3],
    /// Work over the interval behind in J/m.
    pub work: f64,
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
                })
                .collect(),
            last: (0..positions.len().div_ceil(LANES))
                .map(|b| LastLoad {
                    x: block(b, positions),
                    force: [ZERO; 2],
                })
                .collect(),
            reports: Vec::new(),
        }))
    }

    /// Moves the loads of points to their new places.
    pub fn reorder(&mut self, scratch: &mut Vec<Lanes>, sources: &Sources, tiles: usize) {
        reorder(&mut self.points, scratch, sources);
        reorder(&mut self.last, scratch, sources);
        self.reports.resize(tiles, LoadReport::default());
    }

    /// Work in J/m on a lane's point since loads were last applied, if it is taken away at `x` (m).
    pub fn last_work(&self, lane: usize, x: [f64; 2]) -> f64 {
        let load = &self.last[lane / LANES];
        let k = lane % LANES;
        (0..2)
            .map(|a| load.force[a].as_array()[k] * (x[a] - load.x[a].as_array()[k]))
            .sum()
    }

    /// Bytes of memory in use.
    pub fn bytes(&self) -> usize {
        self.points.capacity() * size_of::<Load>() + self.last.capacity() * size_of::<LastLoad>()
    }
}

impl BodyForce {
    /// Accelerations in m/s^2 of four points that began at `start`.
    pub fn at(&self, start: &[Lanes; 2], time: f64) -> [Lanes; 2] {
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
