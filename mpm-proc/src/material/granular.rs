//! Separation of grains and the end of dilation: models of sand in addition to its yield surface.
//!
//! **Separation.** Sand without cohesion that is pulled apart has no stress until its grains touch again, which is at
//! the volume at which they separated (Dunatunga and Kamrin 2015: no stress below the density of contact; Tampubolon
//! and others 2017: the volume gained is stored and first reduced to zero). What is kept is the `gap`, the logarithm of
//! the volume over that of contact. A trial state with the gap added to its strain decides. If it is in tension, the
//! point is open, has no stress, and the strain beyond contact is the new gap. Otherwise grains touch, and only the
//! strain beyond contact compresses them. So stress begins at zero, and opening and closing do no work. Volume from
//! dilation in shear is not a gap: its grains touch.
//!
//! An open point limits the step with the stiffness of unstressed material, for any gap, because it may close in the
//! next step, whose length is chosen before.
//!
//! **Critical state.** Sand in continued shear does not dilate without end. The slope `q_psi` of the potential is
//! multiplied by a factor that falls with the plastic shear strain, `exp(-gamma/gamma_c)` (softening of this form:
//! Yerro, Alonso and Pinyol 2016), or with the volume, `(1/J - 1/J_c)/(1 - 1/J_c)`: dilatancy in proportion to the
//! solid fraction above the critical one (Roux and Radjai 1998; Pailha and Pouliquen 2009), here not below zero. It is
//! that of the start of the interval.

use interface::config::CriticalState;

use super::model::Material;
use super::perfect_plasticity::YieldSurface;
use super::point::{Deformation, Dissipated, Point, Stress};
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// A granular material with the gap between its grains, a critical state, or both.
#[derive(Debug, Clone, Copy)]
pub struct Granular<G> {
    /// The law by which it flows.
    pub grains: G,
    /// The end of its dilation.
    pub critical: Option<CriticalState>,
    /// Whether its grains can separate.
    pub separates: bool,
    /// Rate in 1/s at which points share their volumes; 0: each has its own.
    pub volume_rate: f64,
}

impl<G: YieldSurface> Granular<G> {
    /// The remaining share of the dilation.
    #[inline(always)]
    fn share(&self, volume: Lanes, sheared: Lanes) -> Lanes {
        match self.critical {
            None => splat(1.0),
            Some(CriticalState::ShearStrain(of)) => (sheared * splat(-1.0 / of)).exp(),
            Some(CriticalState::Volume(critical)) => {
                let least = 1.0 / critical;
                let above = (splat(1.0) / volume - splat(least)) * splat(1.0 / (1.0 - least));
                above.fast_max(ZERO).fast_min(splat(1.0))
            }
        }
    }
}

impl<G: YieldSurface> Material for Granular<G> {
    /// Gap, and plastic shear strain.
    type State = [Lanes; 2];
    const DISSIPATES: bool = true;
    const SHARES_VOLUMES: bool = <G as YieldSurface>::SHARES_VOLUMES;

    #[inline(always)]
    fn update(&self, point: &mut Point<[Lanes; 2]>, by: &Deformation, per_dt: f64) -> Dissipated {
        let moduli = self.grains.moduli();
        let [gap, sheared] = point.state;
        let share = self.share(point.volume, sheared);
        let (mut trial, volume) = moduli.trial(&point.stress, point.volume, by);
        let mut open = ZERO; // no lane
        let mut new_gap = gap;
        if self.separates {
            let (before, deviator) = trial.split();
            let mean = splat(moduli.bulk) * gap / volume + before;
            open = mean.simd_gt(ZERO);
            // If grains come into contact within an interval, only the part after contact shears them.
            let meets = gap.simd_gt(ZERO) & !open;
            let after = meets.select(mean / before, splat(1.0));
            trial = deviator.scaled_about(mean, after);
            new_gap = open.select(mean * volume * splat(1.0 / moduli.bulk), ZERO);
        }
        let (flowed, work) = self.grains.flow(&trial, volume, Some(share), per_dt);
        let closed = |s: Lanes| open.select(ZERO, s);
        point.stress = Stress {
            xx: closed(flowed.xx),
            yy: closed(flowed.yy),
            zz: closed(flowed.zz),
            xy: closed(flowed.xy),
        };
        point.volume = volume;
        let strain = shear_between(&trial, &flowed) * volume * splat(1.0 / moduli.shear);
        point.state = [new_gap, sheared + closed(strain)];
        Dissipated {
            // One factor comes from the volume. The other one comes from the moduli, which are divided by it.
            plastic: closed(work) * volume * volume,
            viscous: ZERO,
        }
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<[Lanes; 2]>) -> Lanes {
        let moduli = self.grains.moduli();
        moduli.stiffness(&point.stress, point.volume) * splat(1.0 / moduli.density)
    }

    fn plastic_strain(&self, point: &Point<[Lanes; 2]>) -> Lanes {
        point.state[1]
    }

    fn volume_rate(&self) -> f64 {
        self.volume_rate
    }

    fn elastic_energy(&self, point: &Point<[Lanes; 2]>) -> Lanes {
        self.grains.moduli().stored(&point.stress, point.volume)
    }

    fn sound_speed(&self) -> f64 {
        self.grains.moduli().sound_speed()
    }
}

/// `sqrt(s:s/2)` of the difference of the deviators of two stresses in Pa.
#[inline(always)]
fn shear_between(a: &Stress, b: &Stress) -> Lanes {
    let difference = Stress {
        xx: a.xx - b.xx,
        yy: a.yy - b.yy,
        zz: a.zz - b.zz,
        xy: a.xy - b.xy,
    };
    difference.split().1.shear()
}

#[cfg(test)]
mod tests {
    use interface::config::material::Frictional;

    use super::*;
    use crate::material::single_point::{Path, stress};
    use crate::material::{DruckerPrager, MohrCoulomb, MuI};

    const NUMBERS: Frictional = Frictional {
        bulk_modulus: 5.0e5,
        shear_modulus: 3.2e5,
        friction_angle: 35.0,
        dilation_angle: 25.0,
        cohesion: 0.0,
        tensile_strength: 0.0,
        critical_state: None,
        separates: true,
    };

    fn sand(critical: Option<CriticalState>) -> Granular<DruckerPrager> {
        Granular {
            grains: DruckerPrager::new(1500.0, &NUMBERS),
            critical,
            separates: true,
            volume_rate: 0.0,
        }
    }

    /// Compressed, pulled apart, sheared while open, and closed: the stress is the same, and no energy is created.
    /// Without separation the second compression begins where the first tension ended.
    fn opens_and_closes<G: YieldSurface>(grains: G) {
        let model = Granular {
            grains,
            critical: None,
            separates: true,
            volume_rate: 0.0,
        };
        let mut path = Path::new(model);
        path.stretch([-1e-3, -1e-3], 10);
        let (first, energy) = (stress(&path.point), path.energy());
        let volume = path.point.volume.to_array()[0];
        for _ in 0..20 {
            path.stretch([0.3, 0.3], 50);
            assert!(stress(&path.point).iter().all(|s| *s == 0.0), "open");
            assert!(path.point.state[0].to_array()[0] > 0.5);
            path.shear(0.2, 20);
            path.shear(-0.2, 20);
            assert!(stress(&path.point).iter().all(|s| *s == 0.0), "open");
            path.stretch([-0.3, -0.3], 50);
        }
        let last = stress(&path.point);
        for (a, b) in first.iter().zip(&last) {
            assert!((a - b).abs() < 1e-6 * first[0].abs(), "{first:?} {last:?}");
        }
        assert!((path.point.volume.to_array()[0] / volume - 1.0).abs() < 1e-12);
        assert!((path.energy() / energy - 1.0).abs() < 1e-6);
        assert!(path.plastic.abs() < 1e-9 * energy, "{}", path.plastic);
        // The interval in which grains separate loses what the interval in which they meet gains.
        let gained = path.energy() + path.plastic - path.work;
        assert!(gained.abs() < 0.1 * energy, "{gained:e} {energy:e}");
    }

    #[test]
    fn opening_and_closing_leaves_no_trace() {
        opens_and_closes(DruckerPrager::new(1500.0, &NUMBERS));
        opens_and_closes(MohrCoulomb::new(1500.0, &NUMBERS));
        opens_and_closes(MuI::SAMPLE);
    }

    /// For any gap, and for any speed with which its neighbours pull it.
    #[test]
    fn an_open_point_asks_no_more_of_the_step_than_one_at_rest() {
        let model = sand(None);
        let at_rest = model.stiffness_over_density(&model.initial()).to_array()[0];
        let mut path = Path::new(model);
        for _ in 0..8 {
            path.stretch([0.4, 0.3], 10);
            let asks = model.stiffness_over_density(&path.point).to_array()[0];
            assert!((asks / at_rest - 1.0).abs() < 1e-12, "{asks}");
        }
        assert!(path.point.volume.to_array()[0] > 100.0);
    }

    /// In shear at constant pressure: at most the volume of the critical state, and all of its way with the strain.
    #[test]
    fn dilation_ends() {
        let dilates = |critical| {
            let mut path = Path::new(sand(critical));
            path.stretch([-2e-3, -2e-3], 10);
            let pressure = -stress(&path.point)[1];
            for _ in 0..20_000 {
                path.shear(1e-4, 1);
                // The volume is released as far as the material has become denser.
                let over = -stress(&path.point)[1] - pressure;
                path.stretch([0.0, over / (3.0 * NUMBERS.bulk_modulus)], 1);
            }
            path.point.volume.to_array()[0].ln()
        };
        let for_ever = dilates(None);
        assert!(for_ever > 0.5, "{for_ever}");
        let by_volume = dilates(Some(CriticalState::Volume(1.05)));
        assert!((by_volume - 1.05_f64.ln()).abs() < 4e-3, "{by_volume}");
        // Of the potential tau + q_psi sigma_m: q_psi of volume for each unit of shear, so q_psi gamma_c in all.
        let by_strain = dilates(Some(CriticalState::ShearStrain(0.1)));
        let q_psi = interface::config::friction::cone_slope(25.0_f64.to_radians());
        let elastic = -4e-3;
        assert!(
            (by_strain - (0.1 * q_psi + elastic)).abs() < 2e-3,
            "{by_strain}"
        );
    }
}
