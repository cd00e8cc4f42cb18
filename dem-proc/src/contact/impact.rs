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
//! - speeds below a thousandth of the speed of the fastest surface, with less than a millionth of the energy of a body
//!   that forces move;
//! - impacts with an overlap no larger than that from the weight or an external force of one of the two: a pile at rest has
//!   contacts that hardly carry load and open and close all the time.
//!
//! The third case is that of most contacts, and a bound shows it without the geometry of the contact: the amplitude is
//! at most that of the bodies' relative motion ([`SurfaceMotion`]). Only pairs above this bound are examined, four at a
//! time.
//!
//! Of a point only the velocity is known, so its amplitude is taken to be `omega u`. In the middle of an impact that is
//! too little, but the step stays what it was when the contact closed: it is lengthened only after an epoch, by a tenth.

#![expect(clippy::inline_always, reason = "so that lanes stay in registers")]

use interface::Vec2;

use crate::body::bodies::{Bodies, Rigid};
use crate::contact::approach::Near;
use crate::contact::pair_geometry::{
    LANES, LaneVec, Lanes, cross, dot, each, gather, gather_vec, sub,
};
use crate::law::Stiffness;
use crate::lists::now::Ahead;

/// Speeds below this share of the fastest surface's speed are ignored, if the energy is below its square.
const NEGLIGIBLE: f64 = 1e-3;

/// Overlap, force and stiffness of two bodies that are near, or of four such pairs.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pressing<N> {
    /// Overlap `xi` in m; negative if they do not touch.
    pub overlap: N,
    /// Normal force in N/m, 0 if they do not touch.
    pub force: N,
    /// Bound of the stiffness in N/m.
    pub stiffness: N,
    /// Largest distance in m of the first contact point from the nearest point; 0 if the point itself is listed.
    pub width: N,
}

impl Pressing<f64> {
    /// Four of the same.
    #[inline]
    fn of_four(&self) -> Pressing<Lanes> {
        Pressing {
            overlap: Lanes::splat(self.overlap),
            force: Lanes::splat(self.force),
            stiffness: Lanes::splat(self.stiffness),
            width: Lanes::splat(self.width),
        }
    }
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
    /// Largest `m v^2` in J/m of a body that forces move; in contacts of points, of a point.
    pub energy: f64,
    /// Largest acceleration of any surface by gravity, in m/s^2.
    pub weight: f64,
    /// That of the kick in s, for the pushes of the pair's own bodies.
    pub span: [f64; 2],
    /// How many times the squared frequency of an impact counts.
    pub count: f64,
}

/// The relative motion of four pairs along their normals, positive if they separate.
#[derive(Debug, Clone, Copy)]
struct Along {
    /// In 1/kg.
    mobility: Lanes,
    /// In m/s.
    velocity: Lanes,
    /// In m/s^2.
    acceleration: Lanes,
    /// By their own weights and pushes, in m/s^2.
    outer: Lanes,
    /// Additional acceleration in m/s^2 and velocity in m/s by which pairs that do not touch may approach by rotation.
    turning: [Lanes; 2],
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
        let limit = Lanes::splat(0.9 * impacts.weight * impacts.weight);
        (share * (x + y + turning)).simd_le(limit).to_bitmask()
    }
}

/// Four pairs that are near, as [`Near`].
#[derive(Debug, Clone, Copy)]
pub struct Nears {
    /// The bodies that the normals point to, then the others.
    pub bodies: [[u32; LANES]; 2],
    /// Unit normals.
    pub normal: LaneVec,
    /// Contact points on the first bodies in m.
    pub point: LaneVec,
}

/// One body of each of four pairs.
struct Side {
    /// Lever arm of the contact in m, and across the normal.
    arm: LaneVec,
    across: Lanes,
    /// After the kick.
    velocity: LaneVec,
    spin: Lanes,
    before: LaneVec,
    spin_before: Lanes,
    mobility: Lanes,
}

impl Side {
    #[inline(always)]
    fn new(bodies: &Bodies, kicked: &[(Vec2, f64)], near: &Nears, side: usize) -> Self {
        let state = each(|l| &bodies.state[near.bodies[side][l] as usize]);
        let kicked = each(|l| &kicked[near.bodies[side][l] as usize]);
        let arm = sub(near.point, gather_vec(|l| state[l].center));
        let across = cross(arm, near.normal);
        let inverse_mass = gather(|l| state[l].inverse_mass);
        Self {
            arm,
            across,
            velocity: gather_vec(|l| kicked[l].0),
            spin: gather(|l| kicked[l].1),
            before: gather_vec(|l| state[l].velocity),
            spin_before: gather(|l| state[l].spin),
            mobility: inverse_mass + gather(|l| state[l].inverse_inertia) * across * across,
        }
    }

    /// Acceleration in m/s^2 by which the surface leaves its tangent.
    #[inline(always)]
    fn bend(&self) -> Lanes {
        self.spin * self.spin * dot(self.arm, self.arm).sqrt()
    }
}

impl Impacts<'_> {
    /// Whether the contact of two bodies that are near opens or closes.
    pub fn is_one(&self, bodies: &Bodies, near: &Near, pressing: &Pressing<f64>) -> bool {
        let all = |v: Vec2| gather_vec(|_| v);
        let nears = Nears {
            bodies: near.bodies.map(|b| [b; LANES]),
            normal: all(near.normal),
            point: all(near.point),
        };
        self.among(bodies, &nears, &pressing.of_four()) != 0
    }

    /// Which of the contacts of four pairs open or close, as bits.
    #[inline(always)]
    pub fn among(&self, bodies: &Bodies, near: &Nears, pressing: &Pressing<Lanes>) -> u32 {
        let zero = Lanes::ZERO;
        let own = Side::new(bodies, self.kicked, near, 0);
        let other = Side::new(bodies, self.kicked, near, 1);
        // The component along the normal, of the first body less that of the second.
        let along = |[a, b]: [LaneVec; 2], [spin, other_spin]: [Lanes; 2]| {
            let turning = spin * own.across - other_spin * other.across;
            dot(sub(a, b), near.normal) + turning
        };
        let velocity = along([own.velocity, other.velocity], [own.spin, other.spin]);
        let acceleration = if self.kick > 0.0 {
            let before = along(
                [own.before, other.before],
                [own.spin_before, other.spin_before],
            );
            (velocity - before) / Lanes::splat(self.kick)
        } else {
            zero
        };
        let pushed = |side: usize, l: usize| {
            let b = near.bodies[side][l] as usize;
            let push = bodies.properties[b].motion.push(self.span);
            bodies.state[b].surface_acceleration(push)
        };
        let pushed = if bodies.special.is_empty() {
            zero
        } else {
            gather(|l| pushed(0, l).max(pushed(1, l)))
        };
        let along = Along {
            mobility: own.mobility + other.mobility,
            velocity,
            acceleration,
            outer: Lanes::splat(self.weight) + pushed,
            turning: [
                own.bend() + other.bend(),
                (own.spin - other.spin).abs() * pressing.width,
            ],
        };
        self.open_or_close(&along, pressing)
    }

    /// The stiffness of a contact of points with this overlap (m) and normal force (N/m), as often as it counts.
    #[inline]
    pub fn counted(
        &self,
        stiffness: Stiffness,
        [overlap, force]: [f64; 2],
        velocity: f64,
        mobility: f64,
    ) -> Stiffness {
        let least = NEGLIGIBLE * self.speed.min((self.energy * mobility).sqrt());
        if self.count == 1.0 || velocity.abs() <= least {
            return stiffness;
        }
        let pressing = Pressing {
            overlap,
            force,
            stiffness: stiffness.normal,
            width: 0.0,
        };
        let along = Along {
            mobility: Lanes::splat(mobility),
            velocity: Lanes::splat(velocity),
            acceleration: Lanes::ZERO,
            outer: Lanes::splat(self.weight),
            turning: [Lanes::ZERO; 2],
        };
        if self.open_or_close(&along, &pressing.of_four()) == 0 {
            stiffness
        } else {
            stiffness.times(self.count)
        }
    }

    #[inline(always)]
    fn open_or_close(&self, along: &Along, pressing: &Pressing<Lanes>) -> u32 {
        let zero = Lanes::ZERO;
        let Along {
            mobility,
            velocity,
            acceleration,
            outer,
            turning: [bend, turning],
        } = *along;
        let omega_sq = pressing.stiffness * mobility;
        let omega = omega_sq.sqrt();
        let of_energy = (Lanes::splat(self.energy) * mobility).sqrt();
        let speed = of_energy.fast_min(Lanes::splat(self.speed));
        let negligible = outer + omega * (Lanes::splat(NEGLIGIBLE) * speed);
        let amplitude_sq = acceleration * acceleration + omega_sq * velocity * velocity;
        let least = (pressing.force * mobility - acceleration).fast_max(zero) + negligible;
        let opens = amplitude_sq.simd_gt(least * least).to_bitmask();
        let presses = pressing.overlap.simd_gt(zero).to_bitmask();
        if presses == (1 << LANES) - 1 {
            return opens;
        }
        let time = Lanes::splat(self.ahead.time());
        let drawn = (-acceleration).fast_max(zero) + bend;
        let closing = (turning - velocity).fast_max(zero);
        let way = closing * time + Lanes::HALF * drawn * time * time;
        let speed = closing + drawn * time;
        let closes = way.simd_gt(-pressing.overlap) & (omega * speed).simd_gt(negligible);
        presses & opens | !presses & closes.to_bitmask()
    }
}
