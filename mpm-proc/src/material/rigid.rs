//! No stress: for the points of a body that moves as one ([`crate::grains`]).

use super::model::Material;
use super::point::{Deformation, Dissipated, Point};
use crate::kernel::lanes::{Lanes, ZERO};

/// The model of points that do not strain, because their grain moves them as one body.
#[derive(Debug, Clone, Copy)]
pub struct Rigid;

impl Material for Rigid {
    type State = ();
    const DISSIPATES: bool = false;

    fn initial(&self) -> Point<()> {
        Point::unstressed(())
    }

    #[inline(always)]
    fn update(&self, _point: &mut Point<()>, _by: &Deformation, _per_dt: f64) -> Dissipated {
        Dissipated::NOTHING
    }

    fn stiffness_over_density(&self, _point: &Point<()>) -> Lanes {
        ZERO
    }

    fn elastic_energy(&self, _point: &Point<()>) -> Lanes {
        ZERO
    }

    fn sound_speed(&self) -> f64 {
        0.0
    }
}
