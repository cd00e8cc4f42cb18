//! The trait that a material implements.

use super::point::{Deformation, Dissipated, Point, Stress};
use crate::kernel::blocks::PointBlock;
use crate::kernel::lanes::{Lanes, ZERO};

/// A constitutive model. The loops over points are compiled for it; what they call is `#[inline(always)]`.
///
/// An example: a gas at constant temperature, of pressure `p = p_0 (1/J - 1)` over that outside, with `J` the volume over
/// the initial one.
///
/// ```
/// use mpm_proc::kernel::lanes::{Lanes, splat};
/// use mpm_proc::material::{Deformation, Dissipated, Material, Point};
///
/// #[derive(Clone, Copy)]
/// struct Gas {
///     pressure: f64, // p_0 in Pa
///     density: f64,  // in kg/m^3
/// }
///
/// impl Material for Gas {
///     type State = (); // stress and volume are the whole state
///     const DISSIPATES: bool = false;
///
///     #[inline(always)]
///     fn update(&self, point: &mut Point<()>, by: &Deformation, _per_dt: f64) -> Dissipated {
///         let one = splat(1.0);
///         let half = splat(0.5) * (by.xx + by.yy);
///         point.volume = point.volume * (one + half) / (one - half);
///         let stress = splat(self.pressure) * (one - one / point.volume); // tension is positive
///         (point.stress.xx, point.stress.yy, point.stress.zz) = (stress, stress, stress);
///         Dissipated::NOTHING
///     }
///
///     // K = p_0 / J in the plane over rho_0 / J, and the largest eigenvalue of [[K, K], [K, K]] is 2 K.
///     fn stiffness_over_density(&self, _point: &Point<()>) -> Lanes {
///         splat(2.0 * self.pressure / self.density)
///     }
///
///     fn elastic_energy(&self, point: &Point<()>) -> Lanes {
///         splat(self.pressure) * (point.volume - splat(1.0) - point.volume.ln())
///     }
///
///     fn sound_speed(&self) -> f64 {
///         (self.pressure / self.density).sqrt()
///     }
/// }
///
/// // Squeezed to half of its volume, in small steps and along x alone.
/// let gas = Gas { pressure: 1.0e5, density: 1.2 };
/// let mut point = gas.initial();
/// let steps = 1000;
/// let squeeze = Deformation {
///     xx: splat(0.5_f64.ln() / f64::from(steps)),
///     ..Deformation::NOTHING
/// };
/// for _ in 0..steps {
///     gas.update(&mut point, &squeeze, 0.0);
/// }
/// let pressure = -point.stress.yy.to_array()[0];
/// assert!((pressure - 1.0e5).abs() < 1.0); // twice the pressure outside, less that
/// ```
///
/// To let scenes choose it, see "Where to add" in ARCHITECTURE.md.
pub trait Material: Copy + Send + Sync + 'static {
    /// The state of four points besides stress and volume.
    type State: PointBlock + Default;

    /// Whether [`Self::update`] can dissipate anything.
    const DISSIPATES: bool;

    /// Whether [`Self::volume_rate`] can be other than 0. The loops of all other models leave this part out.
    const SHARES_VOLUMES: bool = false;

    /// The state of unstressed points; zeros unless the model says otherwise.
    fn initial(&self) -> Point<Self::State> {
        Point::unstressed(Self::State::default())
    }

    /// The state of points that have this stress (Pa) at the start. An update without strain must leave it: which forces the first
    /// step has, and what the ledger begins with, would else depend on when stress is updated.
    ///
    /// # Errors
    /// Why the model cannot have it.
    fn prestressed(&self, stress: Stress) -> Result<Point<Self::State>, String> {
        let mut point = self.initial();
        point.stress = stress;
        let mut updated = point;
        self.update(&mut updated, &Deformation::NOTHING, 0.0);
        let [given, left] =
            [stress, updated.stress].map(|s| [s.xx, s.yy, s.zz, s.xy].map(|s| s.as_array()[0]));
        let size = given.iter().fold(0.0_f64, |size, s| size.max(s.abs()));
        let stays = |(given, left): (&f64, &f64)| (given - left).abs() <= 1e-9 * size;
        if !given.iter().zip(&left).all(stays) {
            return Err(format!(
                "its material cannot have that; without any strain it makes {left:?} Pa of it"
            ));
        }
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

    /// Rate in 1/s at which points share their volumes ([`crate::pass::volumes`]); 0: each has its own.
    fn volume_rate(&self) -> f64 {
        0.0
    }

    /// The plastic strain in the state of the points, which never decreases; 0 for a model that does not store it.
    fn plastic_strain(&self, _point: &Point<Self::State>) -> Lanes {
        ZERO
    }

    /// Elastic energy per initial volume in Pa.
    fn elastic_energy(&self, point: &Point<Self::State>) -> Lanes;

    /// Largest wave speed of the undeformed material in m/s (Jiang 2020 eq. 51).
    fn sound_speed(&self) -> f64;
}
