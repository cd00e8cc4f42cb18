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
    /// Their values in the present step.
    times: Vec<f64>,
    /// How many parts depend on the initial position alone.
    of_place: usize,
    /// Their values, row by row for each block.
    places: Vec<Lanes>,
    /// What is left of the components, over the values of those parts.
    components: [Expression; 2],
    /// The acceleration in m/s^2 in the present step, if it is that of all points.
    uniform: Option<[Lanes; 2]>,
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

/// Slots of a formula: `x`, `y` (initial position, m) and `t` (s).
const SLOTS: usize = 3;

impl BodyForce {
    /// Of these components, for points at these positions.
    fn new(mut components: [Expression; 2], positions: &[[f64; 2]]) -> Self {
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
            times: vec![0.0; of_time.len()],
            of_time,
            of_place: of_place.len(),
            places,
            components,
            uniform: None,
        }
    }

    /// Makes `time` (s) the present one.
    pub fn set_time(&mut self, time: f64) {
        for (value, part) in self.times.iter_mut().zip(&self.of_time) {
            *value = part.evaluate(&[0.0, 0.0, time]);
        }
        if self.of_place == 0 {
            let of_time = |slot: usize| self.times[slot - SLOTS];
            let all = |component: &Expression| splat(component.evaluate_with(&of_time));
            self.uniform = Some(self.components.each_ref().map(all));
        }
    }

    /// Accelerations in m/s^2 of the four points of a block.
    pub fn at(&self, block: usize) -> [Lanes; 2] {
        if let Some(all) = self.uniform {
            return all;
        }
        let places = &self.places[block * self.of_place..][..self.of_place];
        let mut acceleration = [ZERO; 2];
        for k in 0..LANES {
            let of_point = |slot: usize| match self.times.get(slot - SLOTS) {
                Some(value) => *value,
                None => places[slot - SLOTS - self.times.len()].as_array()[k],
            };
            for a in 0..2 {
                acceleration[a].as_mut_array()[k] = self.components[a].evaluate_with(&of_point);
            }
        }
        acceleration
    }
}
