//! What acts on points besides gravity and bodies: body forces as expressions, dead loads on surfaces, and stages of
//! damping. A scene without them has none of this.

use interface::config::Stage;
use interface::expression::Expression;

use crate::continuum::Continuum;
use crate::lanes::{Lanes, ZERO, sum};
use crate::points::{Cloud, LaneCopy, NO_POINT};
use crate::shape::Shape;
use crate::tiles::pitch;
use crate::transfer::{AffineState, Transfer};
use crate::window::scatter_row;

/// Loads on the points of a group.
#[derive(Debug, Clone)]
pub struct Loads {
    /// Acceleration in m/s^2 over the slots `x`, `y` (initial position in m) and `t` (s).
    pub body_force: Option<[Expression; 2]>,
    /// Initial position of each point in m, by identity; empty without a body force.
    pub start: Vec<[f64; 2]>,
    /// Dead load on each point in N/m, by identity; empty without tractions.
    pub dead: Vec<[f64; 2]>,
    /// Forces of the present step in N/m.
    force: Vec<[Lanes; 2]>,
}

impl Loads {
    /// Loads of a group, or `None` if there are none.
    pub fn new(
        body_force: Option<[Expression; 2]>,
        positions: &[[f64; 2]],
        dead: Vec<[f64; 2]>,
    ) -> Option<Self> {
        if body_force.is_none() && dead.is_empty() {
            return None;
        }
        let start = if body_force.is_some() {
            positions.to_vec()
        } else {
            Vec::new()
        };
        Some(Self {
            body_force,
            start,
            dead,
            force: Vec::new(),
        })
    }

    /// Force on a point of mass `mass` (kg/m) at `time` (s), in N/m.
    fn on(&self, local: usize, mass: f64, time: f64) -> [f64; 2] {
        let mut force = self.dead.get(local).copied().unwrap_or_default();
        if let Some(body_force) = &self.body_force {
            let [x, y] = self.start[local];
            for (f, expression) in force.iter_mut().zip(body_force) {
                *f += mass * expression.evaluate(&[x, y, time]);
            }
        }
        force
    }
}

/// Impulse and work of the loads of a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct LoadSum {
    /// Sum of forces in N/m.
    pub force: [f64; 2],
    /// Power with the points' velocities in W/m.
    pub power: f64,
}

impl<const W: usize, S: Shape<W>, T: Transfer> Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    /// Adds the loads at `time` (s) to the forces in the windows of the tiles.
    pub fn apply_loads(&mut self, time: f64) {
        for cloud in &mut self.clouds {
            cloud.apply_loads(time);
        }
    }

    /// Sum and power of the loads with the points' present velocities.
    pub fn load_sum(&self) -> LoadSum {
        let mut total = LoadSum::default();
        for cloud in &self.clouds {
            for (f, motion) in cloud.loads.iter().flat_map(|l| &l.force).zip(&cloud.motion) {
                for a in 0..2 {
                    total.force[a] += sum(f[a]);
                    total.power += sum(f[a] * motion.v[a]);
                }
            }
        }
        total
    }

    /// The stage at `time` (s): damping in 1/s; a stage may also change the transfer.
    pub fn begin_stage(&mut self, time: f64) -> f64 {
        let stage: Option<&Stage> = self.stages.iter().rev().find(|s| s.from <= time);
        if let Some(fraction) = stage.and_then(|s| s.pic_fraction) {
            self.transfer = self.transfer.with_pic_fraction(fraction);
        }
        stage.map_or(0.0, |s| s.damping)
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState + LaneCopy> Cloud<W, S, A> {
    fn apply_loads(&mut self, time: f64) {
        let Some(loads) = &mut self.loads else {
            return;
        };
        let mut forces = core::mem::take(&mut loads.force);
        forces.clear();
        forces.extend(self.ids.iter().map(|ids| {
            let mut force = [ZERO; 2];
            for (k, &id) in ids.iter().enumerate().filter(|(_, id)| **id != NO_POINT) {
                let on = loads.on(id as usize, self.mass, time);
                for a in 0..2 {
                    force[a].as_mut_array()[k] = on[a];
                }
            }
            force
        }));
        loads.force = forces;
        for tile in &self.tiles {
            for block in tile.first..tile.first + tile.blocks {
                let force = loads.force[block];
                let place = tile.frame.locate(&self.x[block], pitch(W));
                let s = [0, 1].map(|a| self.shape.weights(a, place.d[a]));
                for j in 0..W {
                    let mut row = [[ZERO; 2]; W];
                    for i in 0..W {
                        let weight = s[0][i] * s[1][j];
                        row[i] = [force[0] * weight, force[1] * weight];
                    }
                    scatter_row(&mut self.force[tile.index], &place, j, &row);
                }
            }
        }
    }
}
