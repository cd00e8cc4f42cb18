//! Driving a single point along a path of deformation, for tests of models against closed forms.

use super::elastic::power;
use super::model::Material;
use super::point::{Deformation, Point};
use crate::kernel::lanes::{ZERO, splat};

/// Length of a step of a path in s.
pub const DT: f64 = 1e-3;

/// A model and a point of it.
pub struct Path<M: Material> {
    pub model: M,
    pub point: Point<M::State>,
    /// Plastic and viscous work per initial volume so far in Pa.
    pub plastic: f64,
    pub viscous: f64,
    /// Work of the stress per initial volume so far in Pa, as the ledger sums it.
    pub work: f64,
}

impl<M: Material> Path<M> {
    pub fn new(model: M) -> Self {
        Self {
            model,
            point: model.initial(),
            plastic: 0.0,
            viscous: 0.0,
            work: 0.0,
        }
    }

    /// In so many steps, of each the velocity gradient in the middle times its length: `by` in all.
    pub fn apply(&mut self, by: [[f64; 2]; 2], steps: usize) {
        let by = by.map(|row| row.map(|x| splat(x / steps as f64)));
        let by = Deformation {
            xx: by[0][0],
            xy: by[0][1],
            yx: by[1][0],
            yy: by[1][1],
        };
        for _ in 0..steps {
            let before = self.point.volume * power(&self.point.stress, &by);
            let lost = self.model.update(&mut self.point, &by, 1.0 / DT);
            let after = self.point.volume * power(&self.point.stress, &by);
            self.work += 0.5 * (before + after).to_array()[0];
            self.plastic += lost.plastic.to_array()[0];
            self.viscous += lost.viscous.to_array()[0];
        }
    }

    /// Energy stored per initial volume in Pa.
    pub fn energy(&self) -> f64 {
        self.model.elastic_energy(&self.point).to_array()[0]
    }

    /// Logarithmic strains along x and y.
    pub fn stretch(&mut self, strain: [f64; 2], steps: usize) {
        self.apply([[strain[0], 0.0], [0.0, strain[1]]], steps);
    }

    /// Simple shear `dv_x/dy` to `gamma`.
    pub fn shear(&mut self, gamma: f64, steps: usize) {
        self.apply([[0.0, gamma], [0.0, 0.0]], steps);
    }

    /// Rotation by `angle` in rad.
    pub fn turn(&mut self, angle: f64, steps: usize) {
        self.apply([[0.0, -angle], [angle, 0.0]], steps);
    }
}

/// What `steps` steps with a velocity gradient of `strain` in all stretch by.
pub fn cayley(strain: f64, steps: usize) -> f64 {
    let half = 0.5 * strain / steps as f64;
    ((1.0 + half) / (1.0 - half)).powi(steps as i32)
}

/// xx, yy, zz, xy in Pa. All lanes must agree.
pub fn stress<P>(point: &Point<P>) -> [f64; 4] {
    let s = point.stress;
    [s.xx, s.yy, s.zz, s.xy].map(|s| {
        let lanes = s.to_array();
        assert!((s - splat(lanes[0])).abs() == ZERO);
        lanes[0]
    })
}
