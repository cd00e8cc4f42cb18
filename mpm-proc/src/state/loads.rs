//! Loads on points: a body force that is a formula, and dead loads on the points of a surface.
//!
//! Both are forces on points that reach the nodes through the shape function, `f_I = sum_p S_Ip f_p`, beside the
//! internal force. A group without a load has none of this.

use mechanics::expression::Expression;
use serde::{Deserialize, Serialize};

use crate::kernel::blocks::{PointBlock, Sources, reorder, reorder_rows};
use crate::kernel::lanes::{LANES, Lanes, ZERO, splat};

/// The loads on a cloud.
pub struct Loads {
    /// Body force of the scene.
    pub body_force: Option<BodyForce>,
    /// Dead loads on the points in N/m, block by block.
    pub dead: Vec<[Lanes; 2]>,
    /// The loads in the step before, likewise: the whole state.
    pub last: Vec<LastLoad>,
    /// Report of each tile.
    pub reports: Vec<LoadReport>,
}

/// An acceleration in m/s^2 that is a formula. What of it depends on the position of a point at the start alone is computed once,
/// and what depends on the time alone once in a step.
pub struct BodyForce {
    /// The parts that depend on the time alone, over slot 2, `t` in s.
    of_time: Vec<Expression>,
    /// How many parts depend on the initial position alone.
    of_place: usize,
    /// Their values, row by row for each block.
    places: Vec<Lanes>,
    /// What is left of the components, over the values of those parts.
    components: [Expression; 2],
}

/// The load in the step before.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct LastLoad {
    /// `x_p` in m.
    pub x: [Lanes; 2],
    /// `f_p` in N/m.
    pub force: [Lanes; 2],
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
        let blocks = 0..positions.len().div_ceil(LANES);
        let block = |b: usize, values: &[[f64; 2]]| {
            [0, 1].map(|a| four(values.iter().skip(b * LANES).map(|value| value[a])))
        };
        Some(Box::new(Self {
            body_force: body_force.map(|components| BodyForce::new(components, positions)),
            dead: blocks.clone().map(|b| block(b, dead)).collect(),
            last: blocks
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
        if let Some(BodyForce {
            of_place, places, ..
        }) = &mut self.body_force
        {
            reorder_rows(places, *of_place, scratch, sources);
        }
        reorder(&mut self.dead, scratch, sources);
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
        let places = self.body_force.as_ref().map_or(0, |b| b.places.capacity());
        places * size_of::<Lanes>()
            + self.dead.capacity() * size_of::<[Lanes; 2]>()
            + self.last.capacity() * size_of::<LastLoad>()
    }
}

/// The first four numbers in lanes, with zeros for those that are missing.
fn four(numbers: impl Iterator<Item = f64>) -> Lanes {
    let mut lanes = ZERO;
    for (lane, number) in lanes.as_mut_array().iter_mut().zip(numbers) {
        *lane = number;
    }
    lanes
}

impl BodyForce {
    /// Of components over the slots `x`, `y` (initial position, m) and `t`, for points at these positions.
    fn new(mut components: [Expression; 2], positions: &[[f64; 2]]) -> Self {
        const SLOTS: usize = 3;
        let (mut of_time, mut of_place) = (Vec::new(), Vec::new());
        for component in &mut components {
            of_time.extend(component.split_off(&|slot| slot == 2, SLOTS + of_time.len()));
        }
        let first = SLOTS + of_time.len();
        for component in &mut components {
            of_place.extend(component.split_off(&|slot| slot < 2, first + of_place.len()));
        }
        let mut places = Vec::with_capacity(positions.len().div_ceil(LANES) * of_place.len());
        for block in positions.chunks(LANES) {
            let value = |part: &Expression| four(block.iter().map(|x| part.evaluate(x)));
            places.extend(of_place.iter().map(value));
        }
        Self {
            of_time,
            of_place: of_place.len(),
            places,
            components,
        }
    }

    /// The slots of the components, with the values that belong to a time (s).
    pub fn slots(&self, time: f64) -> Vec<f64> {
        let mut slots = vec![0.0, 0.0, time];
        for part in &self.of_time {
            slots.push(part.evaluate(&slots[..3]));
        }
        slots
    }

    /// Whether it differs between points.
    pub fn varies(&self) -> bool {
        self.of_place > 0
    }

    /// The acceleration in m/s^2 of all points, if it does not.
    pub fn uniform(&self, slots: &[f64]) -> [Lanes; 2] {
        [0, 1].map(|a| splat(self.components[a].evaluate(slots)))
    }

    /// Accelerations in m/s^2 of the four points of a block. `slots` are [`Self::slots`], with or without the values of a place.
    pub fn at(&self, block: usize, slots: &mut Vec<f64>) -> [Lanes; 2] {
        let places = &self.places[block * self.of_place..][..self.of_place];
        let mut acceleration = [ZERO; 2];
        for k in 0..LANES {
            slots.truncate(3 + self.of_time.len());
            slots.extend(places.iter().map(|value| value.as_array()[k]));
            for a in 0..2 {
                acceleration[a].as_mut_array()[k] = self.components[a].evaluate(slots);
            }
        }
        acceleration
    }
}
