//! Elasticity up to a yield surface that does not move: the trial stress is returned to it, and what is taken is
//! dissipated.

use super::elastic::{Moduli, volume_ratio};
use super::{Deformation, Dissipated, Material, Point, Stress};
use crate::lanes::{Lanes, ZERO, splat};

/// A yield surface with its flow rule.
pub trait YieldSurface: Copy + Send + Sync + 'static {
    /// The elastic part.
    fn moduli(&self) -> &Moduli;

    /// Returns a trial stress to the surface, and tells the work per volume in Pa that plastic flow has taken.
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
        let trial = self.moduli().trial(&point.stress, by);
        let (stress, work) = self.return_stress(&trial);
        point.stress = stress;
        point.volume *= volume_ratio(by);
        Dissipated {
            plastic: work * point.volume,
            viscous: ZERO,
        }
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<()>) -> Lanes {
        point.volume * splat(self.moduli().plane_stiffness() / self.moduli().density)
    }

    fn elastic_energy(&self, point: &Point<()>) -> Lanes {
        self.moduli().energy(&point.stress) * point.volume
    }

    fn sound_speed(&self) -> f64 {
        self.moduli().sound_speed()
    }
}
