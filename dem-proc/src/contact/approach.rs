//! Step limits by bodies that do not touch yet.
//!
//! A penalty contact has no stiffness before the bodies touch. So stiffness alone would allow any step for separate
//! bodies, and one could be deep inside another, or beyond it, after one step. Three limits prevent this, and a fourth keeps
//! friction right; none of them affects bodies that are far apart or slow:
//!
//! - *Contacts count before they close.* The limits after step `n` apply to step `n + 1`, which ends at `t_{n+2}`. A
//!   contact found there is kicked by half of that step, so it must have limited it. So two bodies count as in contact
//!   if they can meet within two steps, where the second may be a tenth longer (the largest growth of a step,
//!   docs/physics.md section 4): [`crate::lists::now::Ahead`]. The lists have the same margin:
//!   [`crate::lists::watch::Watch`].
//! - *No body passes through another in one step.* In a step the distance of a pair in reach may decrease by half the
//!   length in which its force has the right sign ([`crate::contact::passage`]). This corresponds to half the radius of
//!   a point in docs/physics.md section 4. Only the approach counts, so a body may slide along a floor at any speed.
//!   The limit is reported as a frequency: [`crossing_rate`].
//! - *No body that rubs on another turns far in one step*, by at most [`LARGEST_TURN`]. A disc may turn fast where it
//!   does not approach, and a closed contact has the step of stability: [`turning_rate`].
//! - *Before the first step* its length is not known, and any two bodies may meet within it. So if anything moves,
//!   every pair counts as in contact: [`first_contact`]. The cost is the number of steps in which the first step,
//!   stable in contact, grows to its normal length.

use interface::Vec2;
use interface::config::Motion;

use crate::body::bodies::{Bodies, Body, Rigid};

/// Terms of the sum over vertices and edges in which two bodies can meet at once: flush squares with aligned corners
/// (docs/physics.md section 5).
const TERMS: f64 = 8.0;

/// Most by which a body that is near another turns in a step, in rad, if the contact has friction or resists rolling. The
/// surfaces slide by the sine of the turn times the lever arm, and the sine tells a turn only up to a quarter. At the
/// default safety a body turns by 0.2, whose sine is 0.7 % less. It counts for every shape, since any sphero-radius may be
/// rolled on; and for the turn of each body, as a law gets the sine of each.
const LARGEST_TURN: f64 = 0.25;

/// Where two bodies are near one another.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    /// The body that the normal points to, the other.
    pub bodies: [u32; 2],
    /// Unit normal.
    pub normal: Vec2,
    /// The contact point on the first body in m: a vertex, or a point of the line of force.
    pub point: Vec2,
    /// Largest overlap at which the force has the right sign, in m.
    pub length: f64,
}

/// Frequency in 1/s for which a step of `2 / omega` reduces the distance of the two by half of `length`, with
/// velocities and spins `kicked`: `omega = 4 v / l` for an approach at `v`.
///
/// The distance from a convex outline is convex, so in a straight motion the distance decreases by at most `v dt`; by
/// rotation a point at `r` deviates from its tangent by `(spin dt)^2 r / 2`.
pub fn crossing_rate(bodies: &Bodies, kicked: &[(Vec2, f64)], near: &Near) -> f64 {
    let [a, b] = near.bodies.map(|b| b as usize);
    let arms = [a, b].map(|b| near.point - bodies.state[b].center);
    let at = |b: usize, r: Vec2| kicked[b].0 + Vec2::new(-r.y, r.x) * kicked[b].1;
    let approach = (at(b, arms[1]) - at(a, arms[0])).dot(&near.normal).max(0.0);
    // Rotation does not move the outline of a disc.
    let turns = |b: usize, r: Vec2| {
        if bodies.state[b].is_disc() {
            0.0
        } else {
            kicked[b].1.powi(2) * r.norm()
        }
    };
    let bend = turns(a, arms[0]) + turns(b, arms[1]);
    let allowed = 0.5 * near.length;
    // approach t + bend t^2 / 2 = allowed
    let per_step =
        (approach + (approach * approach + 2.0 * bend * allowed).sqrt()) / (2.0 * allowed);
    2.0 * per_step
}

/// Frequency in 1/s for which a step of `2 / omega` turns a body with this spin (rad/s) by [`LARGEST_TURN`].
pub fn turning_rate(spin: f64) -> f64 {
    2.0 / LARGEST_TURN * spin.abs()
}

/// Largest acceleration of any surface in m/s^2: by gravity, and by gravity and external forces.
pub fn outer_accelerations(bodies: &Bodies, gravity: Vec2) -> [f64; 2] {
    let pushed = |(body, state): (&Body, &Rigid)| match body.motion {
        Motion::Pushed { force, torque, .. } => state.surface_acceleration((force.into(), torque)),
        _ => 0.0,
    };
    let falls = bodies.state.iter().map(|state| state.falls);
    let weight = gravity.norm() * falls.fold(0.0, f64::max);
    let pushed = bodies.properties.iter().zip(&bodies.state).map(pushed);
    [weight, weight + pushed.fold(0.0, f64::max)]
}

/// Bound of the squared frequency in 1/s^2 of any two bodies in contact with a stiffness (N/m), at any contact point.
pub fn first_contact(bodies: &Bodies, stiffness: f64) -> f64 {
    let mobility = bodies
        .state
        .iter()
        .map(|s| s.inverse_mass + s.inverse_inertia * s.extent * s.extent);
    2.0 * TERMS * stiffness * mobility.fold(0.0, f64::max)
}
