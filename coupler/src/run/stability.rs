//! The step limit, which only the coupler can compute: each side knows its own stiffness and mobility, and the limit
//! follows from their sum.
//!
//! docs/physics.md section 4: with `K` the stiffnesses of continuum, bodies and the contact between them, and a block
//! diagonal mass matrix, `lambda_max(M^-1 (K_mpm + K_dem + K_contact))` is at most the sum of the parts, and
//! `K_contact` splits into a part for the points and a part for the bodies. Leapfrog is stable for `omega dt <= 2`; a
//! dashpot of ratio `zeta` shortens that by `sqrt(1 + zeta^2) - zeta`.

use std::f64::consts::TAU;

use interface::message::wire::{Budget, Limits};
use interface::solver::Readiness;
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray};

use crate::record::summary::Criteria;
use crate::scene::TimePlan;

/// Factors of Jiang 2020 eq. 51 as the scenes of the paper have them here: of `L/c`, and of `2 pi sqrt(m_min/k_n)`.
const KAPPA_1: f64 = 0.8;
const KAPPA_2: f64 = 0.1;

/// The limit that determines the step.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    IntoStaticStr,
    VariantArray,
)]
#[strum(serialize_all = "snake_case")]
pub enum Bound {
    /// Waves in the continuum.
    Elastic,
    /// Contact between points and bodies.
    Contact,
    /// Contact between bodies.
    Bodies,
    /// No IMP moves by more than half its radius relative to a body.
    Kinematic,
    /// The scene's own longest step.
    Cap,
    /// The next output is less than a step away.
    Output,
    /// The step grows by at most 10 % at a time.
    Growth,
}

impl Bound {
    /// All of them.
    pub const ALL: &[Self] = Self::VARIANTS;

    /// Name in summaries and on the progress bar.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// The limits of both sides at one time, or their budgets.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Sides<T = Limits> {
    /// The continuum's; limits are zeros where there is none.
    pub mpm: T,
    /// The bodies', in the same way.
    pub dem: T,
}

/// How a scene computes the step limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stability {
    safety: f64,
    /// Multiple of the composed limit that the scene asks for.
    factor: f64,
    /// Step of Jiang 2020 eq. 51 in s, if its parts are known; constant in a run.
    jiang2020: f64,
    /// Step of eq. 51 with the mass of the lightest point in s, in the same way.
    lightest_point: f64,
}

/// A step and the budgets within which it stays stable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepLimit {
    /// Longest step in s; infinite if nothing limits it.
    pub dt: f64,
    /// The limit that determines it.
    pub bound: Bound,
}

impl Stability {
    /// The criterion of a scene, with what the solvers reported as ready.
    pub fn new(plan: &TimePlan, mpm: Option<&Readiness>, dem: Option<&Readiness>) -> Self {
        let stiffness = dem.map_or(0.0, |dem| dem.stiffness_max);
        let period = |side: Option<&Readiness>| match side {
            Some(side) if stiffness > 0.0 && side.mass_min > 0.0 => {
                (side.mass_min / stiffness).sqrt()
            }
            _ => f64::INFINITY,
        };
        let waves = mpm.map_or(f64::INFINITY, |mpm| KAPPA_1 * mpm.courant_time);
        Self {
            safety: plan.safety,
            factor: plan.step_factor,
            jiang2020: waves.min(TAU * KAPPA_2 * period(dem)),
            lightest_point: waves.min(2.0 * plan.safety * period(mpm)),
        }
    }

    /// The longest step by the composed criterion in s, and the limit that determines it.
    fn composed(&self, sides: &Sides) -> StepLimit {
        StepLimit {
            dt: self.safety * allowance(sides) / omega_sq(sides).sqrt(),
            bound: largest_share(sides),
        }
    }

    /// Adds the steps that the criteria allow with these limits.
    pub fn compare(&self, sides: &Sides, criteria: &mut Criteria) {
        let bound = |dt: f64| (dt.is_finite() && dt > 0.0).then_some(dt);
        let composed = self.composed(sides).dt;
        let shortest = criteria
            .composed
            .map_or(composed, |known| known.min(composed));
        *criteria = Criteria {
            composed: bound(shortest),
            jiang2020: bound(self.jiang2020),
            lightest_point: bound(self.lightest_point),
        };
    }

    /// The longest step that these limits allow.
    pub fn limit(&self, sides: &Sides) -> StepLimit {
        let mut stable = self.composed(sides);
        stable.dt *= self.factor;
        let kinematic = kinematic_limit(sides);
        if kinematic < stable.dt {
            StepLimit {
                dt: kinematic,
                bound: Bound::Kinematic,
            }
        } else {
            stable
        }
    }

    /// The budget of each side for steps of `dt`. The difference between the allowed step and the present state is
    /// divided evenly, so that both sides together stay within the limit.
    pub fn budgets(&self, sides: &Sides, dt: f64) -> Sides<Budget> {
        if dt == 0.0 {
            return Sides {
                mpm: Budget::UNLIMITED,
                dem: Budget::UNLIMITED,
            };
        }
        // A change that shortens the step by one and a half percent; what is left goes to stiffness.
        let mut damping = sides.mpm.damping.max(sides.dem.damping);
        if damping > 0.0 {
            damping += 0.015 * damping.hypot(1.0);
        }
        // Stiffness of contacts takes most, since their dashpots come with it: `y^2` is what it may be.
        let dt_at_limit = dt / (self.factor * self.safety);
        let beside = 1.0 - sides.mpm.omega_sq * (0.5 * dt_at_limit).powi(2);
        let y = 2.0 * ((damping * damping + beside).max(0.0).sqrt() - damping) / dt_at_limit;
        let spare = 0.5 * (y.max(0.0).powi(2) - contact_omega_sq(sides)).max(0.0);
        let [mut mpm, mut dem] = [&sides.mpm, &sides.dem].map(|side| Budget {
            damping,
            omega_sq: own(side) + spare,
            ..Budget::UNLIMITED
        });
        if sides.mpm.radius_min > 0.0 {
            let allowed = 0.5 * sides.mpm.radius_min / dt;
            let spare = 0.5 * (allowed - sides.mpm.speed - sides.dem.speed).max(0.0);
            mpm.speed = sides.mpm.speed + spare;
            dem.speed = sides.dem.speed + spare;
        }
        Sides { mpm, dem }
    }
}

fn own(limits: &Limits) -> f64 {
    limits.omega_sq + limits.contact_omega_sq
}

/// The part of [`omega_sq`] that is of contacts.
fn contact_omega_sq(sides: &Sides) -> f64 {
    sides.mpm.contact_omega_sq + own(&sides.dem)
}

/// Bound of the largest squared frequency of the coupled system in 1/s^2: stiffnesses add.
fn omega_sq(sides: &Sides) -> f64 {
    own(&sides.mpm) + own(&sides.dem)
}

/// `2 (sqrt(1 + zeta^2) - zeta)`: the largest stable `omega dt`. The ratio that the sides report is that of contacts on their
/// springs; with the stiffness of the continuum beside these it is smaller.
fn allowance(sides: &Sides) -> f64 {
    let all = omega_sq(sides);
    let share = if all > 0.0 {
        contact_omega_sq(sides) / all
    } else {
        1.0
    };
    let zeta = sides.mpm.damping.max(sides.dem.damping) * share.sqrt();
    2.0 * ((1.0 + zeta * zeta).sqrt() - zeta)
}

fn kinematic_limit(sides: &Sides) -> f64 {
    let speed = sides.mpm.speed + sides.dem.speed;
    if sides.mpm.radius_min > 0.0 && speed > 0.0 {
        0.5 * sides.mpm.radius_min / speed
    } else {
        f64::INFINITY
    }
}

fn largest_share(sides: &Sides) -> Bound {
    let contact = sides.mpm.contact_omega_sq + sides.dem.contact_omega_sq;
    let shares = [
        (sides.mpm.omega_sq, Bound::Elastic),
        (contact, Bound::Contact),
        (sides.dem.omega_sq, Bound::Bodies),
    ];
    shares
        .into_iter()
        .fold((f64::NEG_INFINITY, Bound::Elastic), |a, b| {
            if b.0 > a.0 { b } else { a }
        })
        .1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sides() -> Sides {
        Sides {
            mpm: Limits {
                omega_sq: 3e8,
                contact_omega_sq: 1e8,
                speed: 2.0,
                radius_min: 1e-3,
                ..Limits::default()
            },
            dem: Limits {
                contact_omega_sq: 2e6,
                speed: 1.0,
                ..Limits::default()
            },
        }
    }

    fn ready(courant_time: f64, mass_min: f64, stiffness_max: f64) -> Readiness {
        Readiness {
            courant_time,
            mass_min,
            stiffness_max,
            ..Readiness::default()
        }
    }

    fn plan(safety: f64) -> TimePlan {
        TimePlan {
            safety,
            ..TimePlan::until(1.0)
        }
    }

    fn composed(safety: f64) -> Stability {
        Stability::new(&plan(safety), None, None)
    }

    #[test]
    fn stiffnesses_add() {
        let limit = composed(1.0).limit(&sides());
        assert_eq!(limit.dt, 2.0 / 4.02e8f64.sqrt());
        assert_eq!(limit.bound, Bound::Elastic);
    }

    #[test]
    fn a_dashpot_shortens_the_step() {
        let dem = Limits {
            damping: 0.75,
            ..sides().dem
        };
        let mut damped = Sides {
            mpm: Limits::default(),
            dem,
        };
        let undamped = 2.0 / dem.contact_omega_sq.sqrt();
        let ratio = composed(1.0).limit(&damped).dt / undamped;
        assert!((ratio - 0.5).abs() < 1e-15, "sqrt(1 + 9/16) - 3/4 is 1/2");
        // With three times the stiffness beside it the ratio is half.
        damped.mpm.omega_sq = 3.0 * dem.contact_omega_sq;
        let ratio = composed(1.0).limit(&damped).dt / (0.5 * undamped);
        assert!((ratio - (1.0_f64 + 0.375 * 0.375).sqrt() + 0.375).abs() < 1e-15);
    }

    #[test]
    fn no_point_moves_more_than_half_its_radius() {
        let mut fast = sides();
        fast.mpm.speed = 499.0;
        let limit = composed(1.0).limit(&fast);
        assert_eq!((limit.dt, limit.bound), (1e-6, Bound::Kinematic));
    }

    #[test]
    fn what_both_budgets_allow_together_is_stable() {
        let stability = composed(0.8);
        let mut sides = sides();
        sides.dem.damping = 0.3;
        let dt = 0.97 * stability.limit(&sides).dt;
        let budgets = stability.budgets(&sides, dt);
        let mut used = sides;
        used.mpm.contact_omega_sq = budgets.mpm.omega_sq - used.mpm.omega_sq;
        used.dem.contact_omega_sq = budgets.dem.omega_sq;
        used.dem.damping = budgets.dem.damping;
        used.mpm.speed = budgets.mpm.speed;
        used.dem.speed = budgets.dem.speed;
        assert!((stability.limit(&used).dt / dt - 1.0).abs() < 1e-12);
        assert!(budgets.mpm.omega_sq > own(&sides.mpm) && budgets.dem.omega_sq > own(&sides.dem));
    }

    #[test]
    fn a_forced_step_is_a_multiple_of_the_limit_and_its_budgets_allow_it() {
        let plain = composed(0.8);
        let forced = Stability::new(
            &TimePlan {
                step_factor: 3.0,
                ..plan(0.8)
            },
            None,
            None,
        );
        let mut slow = sides();
        slow.mpm.speed = 0.0;
        let dt = forced.limit(&slow).dt;
        assert!((dt / plain.limit(&slow).dt - 3.0).abs() < 1e-12);
        // Neither side halts at once: the budget is at least what the side uses now.
        let budgets = forced.budgets(&slow, 0.97 * dt);
        assert!(budgets.mpm.omega_sq > own(&slow.mpm));
        // The factor applies to the limit of stability only.
        let mut fast = sides();
        fast.mpm.speed = 499.0;
        assert_eq!(forced.limit(&fast).bound, Bound::Kinematic);
    }

    #[test]
    fn criteria_are_compared_at_the_hardest_contact() {
        let (mpm, dem) = (ready(4e-5, 2.5e-4, 0.0), ready(0.0, 2.5, 6e9));
        let plan = plan(0.8);
        let stability = Stability::new(&plan, Some(&mpm), Some(&dem));
        let mut criteria = Criteria::default();
        stability.compare(&sides(), &mut criteria);
        let mut apart = sides();
        apart.mpm.contact_omega_sq = 0.0;
        stability.compare(&apart, &mut criteria);
        let near = |a: Option<f64>, b: f64| (a.unwrap() / b - 1.0).abs() < 1e-12;
        assert!(near(criteria.composed, 0.8 * 2.0 / 4.02e8f64.sqrt()));
        assert!(near(criteria.jiang2020, 0.1 * TAU * (2.5f64 / 6e9).sqrt()));
        assert!(near(
            criteria.lightest_point,
            1.6 * (2.5e-4f64 / 6e9).sqrt()
        ));
        // Where contact is soft, waves limit eq. 51.
        let soft = ready(0.0, 2.5, 6e4);
        Stability::new(&plan, Some(&mpm), Some(&soft)).compare(&sides(), &mut criteria);
        assert!(near(criteria.jiang2020, 0.8 * 4e-5));
        // Without points there is no lightest one.
        Stability::new(&plan, None, Some(&dem)).compare(&sides(), &mut criteria);
        assert_eq!(criteria.lightest_point, None);
    }
}
