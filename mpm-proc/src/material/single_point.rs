//! Driving a single point along a path of deformation, for tests of the stiffness that counts for the step. Stress and energy are
//! for the kit to judge (`tests/kit.rs`).

use super::model::Material;
use super::point::{Deformation, Point};
use crate::kernel::lanes::splat;

/// A model and a point of it.
pub struct Path<M: Material> {
    pub model: M,
    pub point: Point<M::State>,
}

impl<M: Material> Path<M> {
    pub fn new(model: M) -> Self {
        Self {
            model,
            point: model.initial(),
        }
    }

    /// In so many steps of 1 ms, of each the velocity gradient in the middle times its length: `by` in all.
    fn apply(&mut self, by: [[f64; 2]; 2], steps: usize) {
        let by = by.map(|row| row.map(|x| splat(x / steps as f64)));
        let by = Deformation {
            xx: by[0][0],
            xy: by[0][1],
            yx: by[1][0],
            yy: by[1][1],
        };
        for _ in 0..steps {
            self.model.update(&mut self.point, &by, 1e3);
        }
    }

    /// Logarithmic strains along x and y.
    pub fn stretch(&mut self, strain: [f64; 2], steps: usize) {
        self.apply([[strain[0], 0.0], [0.0, strain[1]]], steps);
    }

    /// Rotation by `angle` in rad.
    pub fn turn(&mut self, angle: f64, steps: usize) {
        self.apply([[0.0, -angle], [angle, 0.0]], steps);
    }

    /// Simple shear `dv_x/dy` to `gamma`.
    pub fn shear(&mut self, gamma: f64, steps: usize) {
        self.apply([[0.0, gamma], [0.0, 0.0]], steps);
    }
}
