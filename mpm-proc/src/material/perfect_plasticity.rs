//! Hencky's elasticity up to a yield surface that does not move. The trial stress is returned to the surface, and the
//! difference in energy is dissipated.
//!
//! The surface is given in Cauchy stress, as published. The volume does not change during the return, so the Cauchy
//! stress follows the elastic strain with the moduli divided by the volume. The result on the surface depends only on
//! the ratio of the moduli, so the return is that of small strains.

use super::elastic::Moduli;
use super::model::Material;
use super::point::{Deformation, Dissipated, Point, Stress};
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// A yield surface with its flow rule.
pub trait YieldSurface: Copy + Send + Sync + 'static {
    /// Whether points may share their volumes ([`super::granular::Granular::volume_rate`]).
    const SHARES_VOLUMES: bool = false;

    /// The elastic part.
    fn moduli(&self) -> &Moduli;

    /// Returns a trial stress to the surface in an interval of `1/per_dt` s, at this volume over the initial one; of a
    /// material with a critical state, with this share of the dilation. Also returns the work per volume in Pa that
    /// plastic flow dissipates, by the moduli of small strains.
    fn flow(
        &self,
        trial: &Stress,
        volume: Lanes,
        share: Option<Lanes>,
        per_dt: f64,
    ) -> (Stress, Lanes);
}

impl<Y: YieldSurface> Material for Y {
    type State = ();
    const DISSIPATES: bool = true;

    #[inline(always)]
    fn update(&self, point: &mut Point<()>, by: &Deformation, per_dt: f64) -> Dissipated {
        let (trial, volume) = self.moduli().trial(&point.stress, point.volume, by);
        let (stress, work) = self.flow(&trial, volume, None, per_dt);
        point.stress = stress;
        point.volume = volume;
        Dissipated {
            // One factor comes from the volume. The other one comes from the moduli, which are divided by it.
            plastic: work * volume * volume,
            viscous: ZERO,
        }
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<()>) -> Lanes {
        let moduli = self.moduli();
        moduli.stiffness(&point.stress, point.volume) * splat(1.0 / moduli.density)
    }

    fn elastic_energy(&self, point: &Point<()>) -> Lanes {
        self.moduli().stored(&point.stress, point.volume)
    }

    fn sound_speed(&self) -> f64 {
        self.moduli().sound_speed()
    }
}
