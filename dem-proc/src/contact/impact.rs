//! Finds the contacts that open or close, which the step has to resolve.
//!
//! With a step at the limit of stability, `omega dt` of 1.55, a bounce has two steps: whether the first of them falls
//! early or late in the contact changes the energy by up to 30 %, of either sign. So while two surfaces come into contact
//! or separate, their frequency counts `2 / r` times, with the resolution `r` of
//! [`interface::config::DemConfig::resolutions`]. A contact that stays closed is a spring, for which leapfrog
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
//! at most that of the bodies' relative motion ([`SurfaceMotion`]), computed for four pairs at a time. Only pairs above
//! this bound are examined.
//!
//! Of a point only the velocity is known, so its amplitude is taken to be `omega u`. In the middle of an impact that is
//! too little, but the step stays what it was when the contact closed: it is lengthened only after an epoch, by a tenth.

#![expect(clippy::inline_always, reason = "so that lanes stay in registers")]

use interface::Vec2;

use crate::body::bodies::{Bodies, Rigid};
use crate::contact::approach::Near;
use crate::contact::pair_geometry::{LANES, Lanes, each};
use crate::lists::now::Ahead;

/// Speeds below this share of the fastest surface's speed are ignored: their energy is a millionth.
const NEGLIGIBLE: f64 = 1e-3;

/// Overlap, force and stiffness of two that are near.
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
#[derive(Debug, Clone, Copy, Default)]
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
    /// How many times the squared frequency of an impact counts.
    pub count: f64,
}

/// The relative motion of a pair along its normal, positive if the two separate.
#[derive(Debug, Clone, Copy)]
struct Along {
    /// In 1/kg.
    mobility: f64,
    /// In m/s.
    velocity: f64,
    /// In m/s^2.
    acceleration: f64,
    /// Additional acceleration in m/s^2 and velocity in m/s by which a pair that does not touch may approach by rotation.
    turning: [f64; 2],
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

    /// The rate in 1/s^2.
    #[inline]
    pub fn rate(&self) -> f64 {
        self.velocity.to_array()[3]
    }
}

/// The relative motions of four pairs.
#[derive(Debug, Clone, Copy)]
pub struct Relative {
    /// The sums of both rates in 1/s^2.
    pub rate: Lanes,
    velocity: [Lanes; 3],
    acceleration: [Lanes; 3],
    mobility: Lanes,
}

impl Relative {
    /// Of these pairs of bodies.
    #[inline(always)]
    pub fn of(motions: &[SurfaceMotion], pairs: [[u32; 2]; LANES]) -> Self {
        let motion = |b: u32| &motions[b as usize];
        let both = each(|l| motion(pairs[l][0]).against(motion(pairs[l][1])));
        let [x, y, turning, rate] = Lanes::transpose(each(|l| both[l].velocity));
        let [a_x, a_y, a_turning, mobility] = Lanes::transpose(each(|l| both[l].acceleration));
        Self {
            rate,
            velocity: [x, y, turning],
            acceleration: [a_x, a_y, a_turning],
            mobility,
        }
    }

    /// Which of them do not open if they press, as bits. `stiffness` (N/m) is the largest of a contact. The bound is a
    /// tenth lower than it could be, which is more than all rounding.
    #[inline(always)]
    pub fn calm(&self, stiffness: f64, impacts: &Impacts) -> u32 {
        let omega_sq = Lanes::splat(stiffness) * self.mobility;
        let square = |i: usize| {
            let (u, a) = (self.velocity[i], self.acceleration[i]);
            (u * u).mul_add(omega_sq, a * a)
        };
        let (x, y, turning) = (square(0), square(1), square(2));
        // (p + q)^2 <= 2 p^2 + 2 q^2; without rotation only p^2 is left.
        let turns = turning.simd_gt(Lanes::ZERO);
        let share = turns.select(Lanes::splat(2.0), Lanes::ONE);
        let limit = Lanes::splat(0.9 * impacts.outer * impacts.outer);
        (share * (x + y + turning)).simd_le(limit).to_bitmask()
    }
}

/// One body of a pair that is near.
struct Side<'a> {
    state: &'a Rigid,
    /// Velocity and spin after the kick.
    kicked: (Vec2, f64),
    /// Lever arm of the contact in m, and across the normal.
    arm: Vec2,
    across: f64,
}

impl Side<'_> {
    /// Acceleration in m/s^2 by which the surface leaves its tangent.
    fn bend(&self) -> f64 {
        self.kicked.1 * self.kicked.1 * dot(self.arm, self.arm).sqrt()
    }

    /// In 1/kg.
    fn mobility(&self) -> f64 {
        self.state.inverse_mass + self.state.inverse_inertia * self.across * self.across
    }
}

/// The dot product, with one rounding less.
#[inline]
fn dot(a: Vec2, b: Vec2) -> f64 {
    a.x.mul_add(b.x, a.y * b.y)
}

impl Impacts<'_> {
    /// Whether the contact of two bodies that are near opens or closes.
    pub fn is_one(&self, bodies: &Bodies, near: &Near, pressing: &Pressing) -> bool {
        let normal = near.normal;
        let [own, other] = near.bodies.map(|b| {
            let state = &bodies.state[b as usize];
            let arm = near.point - state.center;
            Side {
                state,
                kicked: self.kicked[b as usize],
                arm,
                across: arm.x.mul_add(normal.y, -(arm.y * normal.x)),
            }
        });
        // The component along the normal, of the first body less that of the second.
        let along = |(velocity, spin): (Vec2, f64), (other_velocity, other_spin): (Vec2, f64)| {
            let turning = spin * own.across - other_spin * other.across;
            dot(velocity - other_velocity, normal) + turning
        };
        let velocity = along(own.kicked, other.kicked);
        let before = |side: &Side| (side.state.velocity, side.state.spin);
        let acceleration = if self.kick > 0.0 {
            (velocity - along(before(&own), before(&other))) / self.kick
        } else {
            0.0
        };
        let along = Along {
            mobility: own.mobility() + other.mobility(),
            velocity,
            acceleration,
            turning: [
                own.bend() + other.bend(),
                (own.kicked.1 - other.kicked.1).abs() * pressing.width,
            ],
        };
        self.open_or_close(&along, pressing)
    }

    /// How many times the stiffness of a contact of points counts.
    #[inline]
    pub fn count(&self, velocity: f64, mobility: f64, pressing: &Pressing) -> f64 {
        if self.count == 1.0 || velocity.abs() <= NEGLIGIBLE * self.speed {
            return 1.0;
        }
        let along = Along {
            mobility,
            velocity,
            acceleration: 0.0,
            turning: [0.0; 2],
        };
        if self.open_or_close(&along, pressing) {
            self.count
        } else {
            1.0
        }
    }

    #[inline]
    fn open_or_close(&self, along: &Along, pressing: &Pressing) -> bool {
        let positive = |x: f64| if x > 0.0 { x } else { 0.0 };
        let Along {
            mobility,
            velocity,
            acceleration,
            turning: [bend, turning],
        } = *along;
        let omega_sq = pressing.stiffness * mobility;
        let omega = omega_sq.sqrt();
        let negligible = self.outer + omega * (NEGLIGIBLE * self.speed);
        if pressing.overlap > 0.0 {
            let amplitude_sq = acceleration * acceleration + omega_sq * velocity * velocity;
            let least = positive(pressing.force * mobility - acceleration) + negligible;
            return amplitude_sq > least * least;
        }
        let time = self.ahead.time();
        let drawn = positive(-acceleration) + bend;
        let closing = positive(turning - velocity);
        let way = closing * time + 0.5 * drawn * time * time;
        let speed = closing + drawn * time;
        way > -pressing.overlap && omega * speed > negligible
    }
}
