//! Hencky's elasticity up to a yield surface that does not move: the trial stress is returned to it, and what is taken is
//! dissipated.
//!
//! The surface is one of Cauchy stress, as it is published. The volume stays during the return, so the Cauchy stress follows
//! the elastic strain with the moduli over it, and where a trial ends on a surface does not depend on the size of the moduli,
//! only on their ratio: the return is that of small strains.

use super::elastic::Moduli;
use super::model::Material;
use super::point::{Deformation, Dissipated, Point, Stress};
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// A yield surface with its flow rule.
pub trait YieldSurface: Copy + Send + Sync + 'static {
    /// The elastic part.
    fn moduli(&self) -> &Moduli;

    /// Returns a trial stress to the surface, and tells the work per volume in Pa that plastic flow has taken, by the moduli of
    /// small strains.
    fn return_stress(&self, trial: &Stress) -> (Stress, Lanes);
}

impl<Y: YieldSurface> Material for Y {
    type State = ();
    const DISSIPATES: bool = true;

    fn initial(&self) -> Point<()> {
        Point::unstressed(())
    }

    #[inline(always)]
    fn update(&self, point: &mut Point<()>, by: &Deformation, _per_dt: f64) -> Dissipated {
        let (trial, volume) = self.moduli().trial(&point.stress, point.volume, by);
        let (stress, work) = self.return_stress(&trial);
        point.stress = stress;
        point.volume = volume;
        Dissipated {
            // One factor is from the volume, one from the moduli, which are divided by it.
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
