//! The trait that a material implements.

use serde::{Serialize, de::DeserializeOwned};

use super::point::{Deformation, Dissipated, Point, Stress};
use crate::kernel::blocks::LaneCopy;
use crate::kernel::lanes::Lanes;

/// A constitutive model.
pub trait Material: Copy + Send + Sync + 'static {
    /// What it remembers of four points besides stress and volume.
    type State: LaneCopy + Serialize + DeserializeOwned;

    /// Whether [`Self::update`] can dissipate anything.
    const DISSIPATES: bool;

    /// The state of unstressed points.
    fn initial(&self) -> Point<Self::State>;

    /// The state of points that have this stress (Pa) at the start.
    ///
    /// # Errors
    /// Why the model cannot have it.
    fn prestressed(&self, stress: Stress) -> Result<Point<Self::State>, String> {
        let mut point = self.initial();
        point.stress = stress;
        Ok(point)
    }

    /// Brings stress, volume and state from `t_{n-1}` to `t_n`.
    ///
    /// `per_dt` is one over the length of the interval in 1/s, zero for an interval of no length.
    fn update(
        &self,
        point: &mut Point<Self::State>,
        deformation: &Deformation,
        per_dt: f64,
    ) -> Dissipated;

    /// Upper bound of the squared wave speeds that count for the step: the largest eigenvalue of stiffness times
    /// `diag(1, 1, 2)` in the plane over the density, in m^2/s^2 ([`crate::pass::limits`]).
    fn stiffness_over_density(&self, point: &Point<Self::State>) -> Lanes;

    /// Largest eigenvalue of the viscous stiffness over the initial density in m^2/s.
    fn viscosity_over_density(&self) -> f64 {
        0.0
    }

    /// Elastic energy per initial volume in Pa.
    fn elastic_energy(&self, point: &Point<Self::State>) -> Lanes;

    /// Largest wave speed of the undeformed material in m/s (Jiang 2020 eq. 51).
    fn sound_speed(&self) -> f64;
}
