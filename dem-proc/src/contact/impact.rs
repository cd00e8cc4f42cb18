//! Finds the contacts that open or close, which the step has to resolve.
//!
//! With a step at the limit of stability, `omega dt` of 1.55, a bounce has two steps: whether the first of them falls
//! early or late in the contact changes the energy by up to 30 %, of either sign. So while two bodies come into contact
//! or separate, their frequency counts `2 / r` times, with the resolution `r` of
//! [`interface::config::DemConfig::contact_resolution`]. A contact that stays closed is a spring, for which leapfrog
//! conserves an energy at any phase: the limit of stability is enough.
//!
//! A closed contact oscillates about the overlap at which its force balances the other accelerations of the pair. With
//! the relative velocity `u` and acceleration `a` along the normal (apart), its own `omega^2 = k w`, mobility `w` and
//! force `F`, that overlap times `omega^2` is `F w - a`, and the amplitude times `omega^2` is `sqrt(a^2 + omega^2
//! u^2)`, at any time of the oscillation. The contact opens if the amplitude is larger. In three cases only the limit
//! of stability applies, because their energy is negligible or they are rare:
//!
//! - contacts that begin within the first step of a run, whose length is not known before; that step is a fraction of
//!   what contact allows anyway ([`crate::contact::approach::first_contact`]);
//! - speeds below a thousandth of the speed of the fastest surface;
//! - impacts with an overlap no larger than that from a body's own weight or an external force: a pile at rest has
//!   contacts that hardly carry load and open and close all the time.
//!
//! The third case is that of most contacts, and a bound shows it without the geometry of the contact: the amplitude is
//! at most that of the bodies' relative motion ([`SurfaceMotion`]). Only pairs above this bound are
//! examined one by one.

use interface::Vec2;

use crate::body::bodies::{Bodies, Rigid};
use crate::contact::approach::Near;
use crate::contact::pair_geometry::Lanes;
use crate::lists::watch::Ahead;

/// Speeds below this share of the fastest surface's speed are ignored: their energy is a millionth.
const NEGLIGIBLE: f64 = 1e-3;

/// Overlap, force and stiffness of two bodies that are near.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pressing {
    /// Overlap `xi` in m; negative if they do not touch.
    pub overlap: f64,
    /// Normal force in N/m, 0 if they do not touch.
    pub force: f64,
    /// Bound of the stiffness in N/m.
    pub stiffness: f64,
    /// Largest distance in m of the first contact point from the nearest point; 0 if the point itself is listed.
    pub width: f64,
}

/// The data to recognise impacts in a step.
#[derive(Debug, Clone, Copy)]
pub struct Impacts<'a> {
    /// Velocities and spins at `t_{n+1/2}`; those at `t_{n-1/2}` are in [`Bodies::state`].
    pub kicked: &'a [(Vec2, f64)],
    /// Length of the kick in s.
    pub kick: f64,
    /// The largest displacement of surfaces in the next two steps.
    pub ahead: Ahead,
    /// Speed of the fastest surface in m/s.
    pub speed: f64,
    /// Largest acceleration of any surface by gravity and external forces, in m/s^2.
    pub outer: f64,
}

/// How a body moves after the kick, and its share in the frequency of its contacts: the numbers of a bound for all of
/// its contacts, arranged so that a pair takes two vector operations.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct SurfaceMotion {
    /// Velocity along `x` and `y` and largest normal velocity by rotation, in m/s; and
    /// [`crate::body::load::PairLoad::rate`].
    velocity: Lanes,
    /// The three accelerations in m/s^2, and an upper bound of the mobility in 1/kg.
    acceleration: Lanes,
}

impl SurfaceMotion {
    /// Of a body with velocity and spin `kicked`, and with this acceleration and angular acceleration in the kick.
    #[inline]
    pub fn of(state: &Rigid, kicked: (Vec2, f64), accelerated: (Vec2, f64), rate: f64) -> Self {
        let lever = state.lever();
        let row = |(v, spin): (Vec2, f64), last| Lanes::new([v.x, v.y, spin.abs() * lever, last]);
        let mobility = state.inverse_mass + state.inverse_inertia * lever * lever;
        Self {
            velocity: row(kicked, rate),
            acceleration: row(accelerated, mobility),
        }
    }

    /// The same body with another motion.
    #[must_use]
    pub fn moved(&self, state: &Rigid, kicked: (Vec2, f64), accelerated: (Vec2, f64)) -> Self {
        Self::of(state, kicked, accelerated, self.velocity.to_array()[3])
    }

    /// The relative motion of two bodies, with the sums of what has no direction.
    #[inline]
    #[must_use]
    pub fn against(&self, other: &Self) -> Self {
        let signs = Lanes::new([-1.0, -1.0, 1.0, 1.0]);
        Self {
            velocity: other.velocity.mul_add(signs, self.velocity),
            acceleration: other.acceleration.mul_add(signs, self.acceleration),
        }
    }

    /// The sum of both rates in 1/s^2.
    #[inline]
    pub fn rate(&self) -> f64 {
        self.velocity.to_array()[3]
    }
}

/// The bound below which no closed contact opens.
#[derive(Debug, Clone, Copy)]
pub struct Calm {
    /// The largest stiffness of a contact in N/m.
    stiffness: f64,
    /// In m^2/s^4.
    limit: f64,
}

impl Calm {
    /// Whether two bodies that press on one another are below the bound, from their relative motion.
    #[inline]
    pub fn holds(&self, both: &SurfaceMotion) -> bool {
        let mobility = both.acceleration.to_array()[3];
        let omega_sq = Lanes::splat(self.stiffness * mobility);
        let squares = both.acceleration * both.acceleration;
        let squares = (both.velocity * both.velocity).mul_add(omega_sq, squares);
        let [x, y, turning, _] = squares.to_array();
        // (p + q)^2 <= 2 p^2 + 2 q^2; without rotation only p^2 is left.
        let share = if turning > 0.0 { 2.0 } else { 1.0 };
        share * (x + y + turning) <= self.limit
    }
}

impl Impacts<'_> {
    /// The bound for contacts whose stiffness (N/m) is at most `stiffness`. It is a tenth lower than it could be, which
    /// is more than all rounding.
    pub fn calm(&self, stiffness: f64) -> Calm {
        Calm {
            stiffness,
            limit: 0.9 * self.outer * self.outer,
        }
    }

    /// Whether the contact of two bodies that are near opens or closes.
    pub fn is_one(&self, bodies: &Bodies, near: &Near, pressing: &Pressing) -> bool {
        let state = near.bodies.map(|b| &bodies.state[b as usize]);
        let kicked = near.bodies.map(|b| self.kicked[b as usize]);
        let arms = state.map(|s| near.point - s.center);
        // The component along the normal, of the first body less that of the second.
        let along = |of: [(Vec2, f64); 2]| {
            let [a, b] = [0, 1].map(|i| {
                let (velocity, spin) = of[i];
                velocity + Vec2::new(-arms[i].y, arms[i].x) * spin
            });
            (a - b).dot(&near.normal)
        };
        let velocity = along(kicked);
        let acceleration = if self.kick > 0.0 {
            let before = state.map(|s| (s.velocity, s.spin));
            (velocity - along(before)) / self.kick
        } else {
            0.0
        };
        let mobility: f64 = (0..2)
            .map(|i| {
                let across = mechanics::mass::cross(arms[i], near.normal);
                state[i].inverse_mass + state[i].inverse_inertia * across * across
            })
            .sum();
        let omega_sq = pressing.stiffness * mobility;
        let negligible = || self.outer + NEGLIGIBLE * omega_sq.sqrt() * self.speed;
        if pressing.overlap > 0.0 {
            let amplitude_sq = acceleration * acceleration + omega_sq * velocity * velocity;
            let held = (pressing.force * mobility - acceleration).max(0.0);
            let least = held + negligible();
            amplitude_sq > least * least
        } else {
            let time = self.ahead.time();
            let bend: f64 = (0..2).map(|i| kicked[i].1.powi(2) * arms[i].norm()).sum();
            let drawn = (-acceleration).max(0.0) + bend;
            let turning = (kicked[0].1 - kicked[1].1).abs() * pressing.width;
            let closing = (turning - velocity).max(0.0);
            let way = closing * time + 0.5 * drawn * time * time;
            let speed = closing + drawn * time;
            way > -pressing.overlap && omega_sq.sqrt() * speed > negligible()
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use interface::config::{BodyConfig, BodyInertia, BodyShape, DemConfig, Motion};
    use mechanics::generate::Random;

    use super::*;

    /// Of 1 kg/m, with a sphero-radius of 0.1 m.
    pub fn body(shape: BodyShape, position: [f64; 2]) -> BodyConfig {
        BodyConfig {
            name: "grain".into(),
            shape,
            sphero_radius: 0.1,
            inertia: BodyInertia::Mass(1.0),
            position,
            angle: 0.3,
            velocity: [0.0; 2],
            spin: 0.0,
            motion: Motion::Free,
            surface: String::new(),
        }
    }

    #[test]
    fn no_contact_below_the_bound_opens() {
        let square = BodyShape::Rectangle {
            width: 0.3,
            height: 0.2,
        };
        let mut random = Random::new(7);
        let (mut calm_pairs, mut impacts) = (0, 0);
        for shape in [BodyShape::Disc, square] {
            let config = DemConfig {
                bodies: vec![body(shape.clone(), [0.0; 2]), body(shape, [0.15, 0.05])],
                ..DemConfig::default()
            };
            let mut bodies = Bodies::new(&config).expect("two bodies");
            let point = bodies.outline_of(0)[0];
            let normal = (bodies.state[0].center - bodies.state[1].center).normalize();
            let (kick, stiffness) = (1e-3, 1e4);
            for _ in 0..20_000 {
                let size = 10_f64.powf(random.between(-6.0, 1.0));
                let mut any = || size * random.between(-1.0, 1.0);
                let bulk = Vec2::new(any(), any()) * 100.0;
                let mut motion = || (bulk + Vec2::new(any(), any()), any());
                let kicked = [motion(), motion()];
                let before = kicked.map(|(v, spin)| {
                    let mut change = || 10.0 * any() * kick;
                    (v + Vec2::new(change(), change()), spin + change())
                });
                for (state, before) in bodies.state.iter_mut().zip(before) {
                    (state.velocity, state.spin) = before;
                }
                let impacts_of = Impacts {
                    kicked: &kicked,
                    kick,
                    ahead: Ahead::new(kick, kick, 9.81),
                    speed: 0.0,
                    outer: 9.81,
                };
                let near = Near {
                    bodies: [0, 1],
                    normal,
                    point,
                    length: 0.2,
                };
                let pressing = Pressing {
                    overlap: 1e-3,
                    force: 0.0,
                    stiffness,
                    width: 0.0,
                };
                let motions = [0, 1].map(|b| {
                    let (now, was) = (kicked[b], before[b]);
                    let accelerated = ((now.0 - was.0) / kick, (now.1 - was.1) / kick);
                    SurfaceMotion::of(&bodies.state[b], now, accelerated, 0.0)
                });
                let calm = impacts_of
                    .calm(stiffness)
                    .holds(&motions[0].against(&motions[1]));
                let is_one = impacts_of.is_one(&bodies, &near, &pressing);
                assert!(!(calm && is_one), "{kicked:?} {before:?}");
                calm_pairs += usize::from(calm);
                impacts += usize::from(is_one);
            }
        }
        // Both answers are common, so the bound has something to hide.
        assert!(
            calm_pairs > 1000 && impacts > 1000,
            "{calm_pairs} {impacts}"
        );
    }

    /// The amplitude `sqrt(a^2 + omega^2 u^2)` against the overlap at rest `F w - a` and what is negligible.
    #[test]
    fn a_contact_opens_if_its_amplitude_is_larger_than_its_overlap_at_rest() {
        let discs = [[0.0; 2], [0.19, 0.0]].map(|x| body(BodyShape::Disc, x));
        let config = DemConfig {
            bodies: discs.into(),
            ..DemConfig::default()
        };
        let mut bodies = Bodies::new(&config).expect("two bodies");
        let (kick, stiffness, mobility): (f64, f64, f64) = (1e-3, 1e4, 2.0);
        let omega = (stiffness * mobility).sqrt();
        let near = Near {
            bodies: [0, 1],
            normal: Vec2::new(-1.0, 0.0),
            point: Vec2::new(0.1, 0.0),
            length: 0.2,
        };
        for (force, acceleration, outer, speed) in [
            (5.0, 0.0, 0.0, 0.0),
            (5.0, 2.0, 0.0, 0.0),
            (0.0, 0.0, 0.5, 0.0),
            (5.0, 0.0, 0.5, 0.0),
            (5.0, -2.0, 9.81, 20.0),
        ] {
            let least = force * mobility - acceleration + outer + 1e-3 * omega * speed;
            for share in [0.99, 1.01] {
                let amplitude: f64 = share * least;
                let velocity = (amplitude * amplitude - acceleration * acceleration).sqrt() / omega;
                let kicked = [(near.normal * velocity, 0.0), (Vec2::zeros(), 0.0)];
                bodies.state[0].velocity = near.normal * (velocity - acceleration * kick);
                let impacts = Impacts {
                    kicked: &kicked,
                    kick,
                    ahead: Ahead::new(kick, kick, outer),
                    speed,
                    outer,
                };
                let pressing = Pressing {
                    overlap: 1e-2,
                    force,
                    stiffness,
                    width: 0.0,
                };
                let opens = impacts.is_one(&bodies, &near, &pressing);
                assert_eq!(opens, share > 1.0, "{force} {acceleration} {outer} {share}");
            }
        }
    }
}
