//! What two bodies that have not met yet ask of the step.
//!
//! A penalty contact is nothing until it is touched, so stiffness alone lets bodies that are apart take any step: one may
//! be deep in another, or beyond it, at the next instant. Three things are needed, and none asks anything of bodies that
//! are far apart or slow:
//!
//! - *Whoever may touch is counted before.* The limits that follow step `n` are those of step `n + 1`, which ends at
//!   `t_{n+2}`. A contact found there is kicked by half of that step, so it has to have bound it. So two bodies count as
//!   in contact if they can meet within two steps, the second a tenth longer (the most that a step may grow by,
//!   PHYSICS.md section 4): [`Ahead`]. The lists reach as far: [`Watch`].
//! - *Nobody is carried through.* A pair in reach may come nearer by half the length in which its force has the right
//!   sign ([`crate::contact::passage`]) in a step: the counterpart of half the radius of a point in PHYSICS.md section 4. Only the
//!   approach counts, so a body may slide along a floor as fast as it likes. The limit is declared as a frequency:
//!   [`crossing_rate`].
//! - *Before the first step* its length is not known, and any two bodies may meet within it. So contact counts as if it
//!   were there, where anything moves at all: [`first_contact`]. It costs the steps in which the first one, stable in
//!   contact, grows to what it may be.

use interface::Vec2;
use interface::config::Motion;
use interface::solver::Refusal;
use interface::step::GROWTH;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::body::odometer::{Odometer, SavedOdometer};
use crate::setup::saved::{count, finite};
use mechanics::mass::cross;

/// Terms of the sum over vertices and edges in which two bodies can meet at once: flush squares with aligned corners
/// (PHYSICS.md section 5).
const TERMS: f64 = 8.0;

/// How far surfaces may go in the next two steps, by their speed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ahead {
    /// The two steps together in s.
    time: f64,
    /// What is gained by falling and by forces from outside in m.
    gained: f64,
}

impl Ahead {
    /// A step of `dt` (s) and the next one, after a kick of `kick` (s), all surfaces accelerated by `acceleration`
    /// (m/s^2) at most. Contact is not among what accelerates: one that is new has been counted, one that is not has
    /// been pushing before.
    pub fn new(kick: f64, dt: f64, acceleration: f64) -> Self {
        let next = GROWTH * dt;
        let time = dt + next;
        Self {
            time,
            gained: acceleration * (kick * time + 0.5 * (dt + next) * next),
        }
    }

    /// The two steps together in s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Of a surface with this speed (m/s), in m.
    pub fn way(&self, speed: f64) -> f64 {
        speed * self.time + self.gained
    }
}

/// When a list of pairs has to be built anew, and how far it reaches.
///
/// Each body may use up half of the skin, and what it may go ahead is kept free. Where the fastest one goes farther in
/// two steps than half the skin, the list is built in every step, with a margin of its own for each body: else one that
/// is fast and far would fill the lists of all others.
#[derive(Debug, Clone, Default)]
pub struct Watch {
    skin: f64,
    /// How far a surface may have gone, and be about to go, in m.
    limit: f64,
    /// Margin of each body in m; empty where they are all `limit`.
    margins: Vec<f64>,
    odometer: Odometer,
}

impl Watch {
    /// No list yet; with a skin in m.
    pub fn new(skin: f64) -> Self {
        Self {
            skin,
            ..Self::default()
        }
    }

    /// Whether the list still holds all pairs that may meet within two steps, with surfaces up to `speed` (m/s).
    pub fn holds(&mut self, bodies: &Bodies, ahead: &Ahead, speed: f64) -> bool {
        let left = self.limit - ahead.way(speed);
        left > 0.0 && self.odometer.stays_below(left, bodies)
    }

    /// A list is built here.
    pub fn begin(&mut self, bodies: &Bodies, ahead: &Ahead, speed: f64) {
        let (half, way) = (0.5 * self.skin, ahead.way(speed));
        self.margins.clear();
        if way <= half {
            self.limit = half + way;
        } else {
            self.limit = 0.0;
            let speed = bodies
                .state
                .iter()
                .map(|s| s.surface_speed(s.velocity, s.spin));
            self.margins.extend(speed.map(|v| half + ahead.way(v)));
        }
        self.odometer.reset(bodies);
    }

    /// How far a body's list reaches beyond contact in m: a pair is listed within the sum of both.
    #[inline]
    pub fn margin(&self, body: usize) -> f64 {
        self.margins.get(body).copied().unwrap_or(self.limit)
    }

    /// How far apart in m two bodies may be and still meet within two steps, where that is less than for the fastest.
    #[inline]
    pub fn closing(&self, [a, b]: [u32; 2]) -> Option<f64> {
        let own = |b: u32| self.margins.get(b as usize);
        Some(own(a)? + own(b)? - self.skin)
    }

    /// Whether [`Self::closing`] says anything.
    pub fn is_by_body(&self) -> bool {
        !self.margins.is_empty()
    }

    /// The bodies move on with surface speeds up to `speed` (m/s) for `dt` (s).
    pub fn advance(&mut self, speed: f64, dt: f64) {
        self.odometer.advance(speed, dt);
    }

    /// The bodies as they were where the list was built; `None` if there is no list yet.
    pub fn bodies_then(&self, bodies: &Bodies) -> Option<Bodies> {
        let poses = self.odometer.start();
        (!poses.is_empty()).then(|| bodies.placed(poses.iter().copied()))
    }

    /// For a saved state.
    pub fn save(&self) -> SavedWatch {
        let Self {
            skin: _, // of the configuration
            limit,
            margins,
            odometer,
        } = self;
        SavedWatch {
            limit: *limit,
            margins: margins.clone(),
            odometer: odometer.save(),
        }
    }

    /// With the skin of this one, as it was saved.
    ///
    /// # Errors
    /// A refusal if it is not of these bodies.
    pub fn restored(&self, saved: &SavedWatch, bodies: &Bodies) -> Result<Self, Refusal> {
        let SavedWatch {
            limit,
            margins,
            odometer,
        } = saved;
        finite(|| "a margin".into(), margins)?;
        finite(|| "a margin".into(), &[*limit])?;
        if !margins.is_empty() {
            count("margins", margins.len(), bodies.len())?;
        }
        Ok(Self {
            skin: self.skin,
            limit: *limit,
            margins: margins.clone(),
            odometer: Odometer::restored(odometer, bodies)?,
        })
    }
}

/// A [`Watch`] in a saved state, in m.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SavedWatch {
    limit: f64,
    margins: Vec<f64>,
    odometer: SavedOdometer,
}

/// Where two bodies are near one another.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    /// The body that the normal points to, the other.
    pub bodies: [u32; 2],
    /// Unit normal.
    pub normal: Vec2,
    /// The place on the first body in m: a vertex, or a point of the line of force.
    pub point: Vec2,
    /// How much nearer the two may come from touch on until the force has the wrong sign, in m.
    pub length: f64,
}

/// Frequency in 1/s at which a step of `2 / omega` carries the two nearer by half their length, with velocities and spins
/// `kicked`: `omega = 4 v / l` for an approach at `v`.
///
/// The distance from a convex outline is convex, so in a straight line the pair comes nearer by `v dt` at most; by
/// rotation a point at `r` leaves its tangent by `(spin dt)^2 r / 2`.
pub fn crossing_rate(bodies: &Bodies, kicked: &[(Vec2, f64)], near: &Near) -> f64 {
    let [a, b] = near.bodies.map(|b| b as usize);
    let arms = [a, b].map(|b| near.point - bodies.state[b].center);
    let at = |b: usize, r: Vec2| kicked[b].0 + Vec2::new(-r.y, r.x) * kicked[b].1;
    let approach = (at(b, arms[1]) - at(a, arms[0])).dot(&near.normal).max(0.0);
    // A disc looks the same however it turns.
    let turns = |b: usize, r: Vec2| {
        let round = bodies.outline_of(b).len() == 1;
        if round {
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

/// Largest acceleration in m/s^2 that gravity and forces from outside give any surface.
pub fn outer_acceleration(bodies: &Bodies, gravity: Vec2) -> f64 {
    let of = |(body, state): (&crate::body::bodies::Body, &crate::body::bodies::Rigid)| {
        let (force, torque) = match body.motion {
            Motion::Pushed { force, torque, .. } => (Vec2::from(force), torque),
            _ => (Vec2::zeros(), 0.0),
        };
        gravity.norm() * state.falls
            + force.norm() * state.inverse_mass
            + torque.abs() * state.inverse_inertia * state.extent
    };
    bodies
        .fixed
        .iter()
        .zip(&bodies.state)
        .map(of)
        .fold(0.0, f64::max)
}

/// Bound of the squared frequency in 1/s^2 of two bodies that touch with a stiffness (N/m) wherever they meet.
pub fn first_contact(bodies: &Bodies, stiffness: f64) -> f64 {
    let mobility = bodies
        .state
        .iter()
        .map(|s| s.inverse_mass + s.inverse_inertia * s.extent * s.extent);
    2.0 * TERMS * stiffness * mobility.fold(0.0, f64::max)
}

/// The smallest width of a convex outline in m: the thickness of a plate, 0 of a segment or a point.
pub fn thickness(outline: &[Vec2]) -> f64 {
    let n = outline.len();
    if n < 3 {
        return 0.0;
    }
    let width = |i: usize| {
        let (a, edge) = (outline[i], outline[(i + 1) % n] - outline[i]);
        let heights = outline.iter().map(|p| cross(edge, p - a).abs());
        heights.fold(0.0, f64::max) / edge.norm()
    };
    (0..n).map(width).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_ahead_is_two_steps_of_falling() {
        // From rest: half a kick, a step, a kick, a step a tenth longer.
        let (dt, g) = (1e-3, 10.0);
        let first = 0.5 * dt * g;
        let second = first + g * 0.5 * (dt + 1.1 * dt);
        let way = first * dt + second * 1.1 * dt;
        let ahead = Ahead::new(0.5 * dt, dt, g);
        assert!((ahead.way(0.0) / way - 1.0).abs() < 1e-12);
        assert!((ahead.way(3.0) - way - 3.0 * 2.1 * dt).abs() < 1e-15);
    }

    #[test]
    fn the_smallest_width_is_that_of_the_plate() {
        let v = |x: f64, y: f64| Vec2::new(x, y);
        let plate = [v(-1.0, 0.0), v(1.0, 0.0), v(1.0, 0.02), v(-1.0, 0.02)];
        assert!((thickness(&plate) - 0.02).abs() < 1e-15);
        assert_eq!(thickness(&plate[..2]), 0.0);
        // Equilateral: its height.
        let triangle = [v(0.0, 0.0), v(1.0, 0.0), v(0.5, 0.75_f64.sqrt())];
        assert!((thickness(&triangle) - 0.75_f64.sqrt()).abs() < 1e-15);
    }
}
