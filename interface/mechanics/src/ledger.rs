//! The ledger of a bodies' side (PROTOCOL.md section 9): what any rigid-body solver has to report of its bodies.
//!
//! A solver makes an [`Entry`] of each body when it has kicked it, adds it to its [`Totals`], and where a step is
//! measured hands all entries to [`measure`]. Only what it alone knows is left to it: energy in springs, losses.
//!
//! Order: kinetic energies are the weighted mean of the two half-step values (T-5). Work from outside is force at
//! `t_n` times the mean of the velocities before and after the kick, half a kick of which belongs to the time before
//! `t_n`: all second order in the step (docs/physics.md section 7).

use serde::{Deserialize, Serialize};

use crate::impulse::Impulse;
use interface::Vec2;
use interface::message::wire::{BodyState, Ledger};
use interface::solver::DemMeasurement;
use interface::step::Step;

/// A body in the kick of a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Entry {
    /// Position, angle and loads at `t_n`; velocity and spin at `t_{n-1/2}`, before the kick.
    pub body: BodyState,
    /// At `t_{n+1/2}`, after the kick, in m/s.
    pub velocity: [f64; 2],
    /// At `t_{n+1/2}` in rad/s.
    pub spin: f64,
    /// 1 along x, along y and for the angle where forces move the body, 0 where they do not.
    pub yielding: [f64; 3],
}

impl Entry {
    /// Whether forces move the body in any direction.
    pub fn yields(&self) -> bool {
        self.yielding != [0.0; 3]
    }

    /// Force (N/m) on the body by what is outside: its weight if forces move it, in `gravity` (m/s^2), a push (N/m and
    /// N) and what guides or holds it; and the power (W/m) of all of it but the weight over the kick.
    fn outside_force(&self, gravity: Vec2, (push, torque): (Vec2, f64)) -> (Vec2, f64) {
        let b = &self.body;
        let weight = gravity * if self.yields() { b.mass } else { 0.0 };
        let held = self.yielding.map(|yields| 1.0 - yields);
        let inner = Vec2::from(b.point_force) + Vec2::from(b.body_force) + weight + push;
        let guide = -Vec2::new(inner.x * held[0], inner.y * held[1]);
        let guide_torque = -(b.point_torque + b.body_torque + torque) * held[2];
        // The work of a force over a leapfrog kick is force times the mean of the velocities before and after.
        let velocity = (Vec2::from(b.velocity) + Vec2::from(self.velocity)) * 0.5;
        let spin = 0.5 * (b.spin + self.spin);
        let power = (push + guide).dot(&velocity) + (torque + guide_torque) * spin;
        (weight + push + guide, power)
    }

    /// Puts the body into a ledger at `t_n`, where `w` is [`Step::centring`]; returns its record.
    fn enter(mut self, ledger: &mut Ledger, gravity: Vec2, w: f64) -> BodyState {
        let centred = |before: f64, after: f64| (1.0 - w) * before + w * after;
        let b = &mut self.body;
        let (before, after) = (Vec2::from(b.velocity), Vec2::from(self.velocity));
        if self.yielding != [0.0; 3] {
            let speeds = centred(before.norm_squared(), after.norm_squared());
            ledger.kinetic += 0.5 * b.mass * speeds;
            let spins = centred(b.spin * b.spin, self.spin * self.spin);
            ledger.kinetic_rotation += 0.5 * b.inertia * spins;
            ledger.gravity -= b.mass * gravity.dot(&Vec2::from(b.position));
            ledger.momentum[0] += b.mass * after.x;
            ledger.momentum[1] += b.mass * after.y;
        }
        ledger.contact_force[0] += b.point_force[0];
        ledger.contact_force[1] += b.point_force[1];
        ledger.contacts += u64::from(b.contacts > 0);
        b.velocity = (before * (1.0 - w) + after * w).into();
        b.spin = centred(b.spin, self.spin);
        *b
    }
}

/// Sums over a run, up to the end of a kick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// Dissipated by friction in J/m, up to `t_n`.
    pub friction_work: f64,
    /// Dissipated by dashpots in J/m, up to `t_n`.
    pub viscous_work: f64,
    /// Put in by driven bodies and pushes in J/m.
    pub driven_work: f64,
    /// By gravity and pushes on the bodies that forces move, and by what guides and holds bodies, in N s/m.
    pub applied_impulse: Impulse,
    /// By the points on all bodies in N s/m.
    pub contact_impulse: Impulse,
}

impl Totals {
    /// Adds what a body takes up in a kick of `length` (s), in `gravity` (m/s^2), with a push (N/m and N).
    pub fn add(&mut self, entry: &Entry, gravity: Vec2, push: (Vec2, f64), length: f64) {
        self.contact_impulse += Vec2::from(entry.body.point_force) * length;
        self.add_outside(entry, gravity, push, length);
    }

    /// The same without what the points do, where that is summed otherwise.
    pub fn add_outside(&mut self, entry: &Entry, gravity: Vec2, push: (Vec2, f64), length: f64) {
        let (force, power) = entry.outside_force(gravity, push);
        self.applied_impulse += force * length;
        self.driven_work += power * length;
    }
}

/// The measurement at `t_n` of `step`, of the entries of all bodies in the order of the configuration: `contact` is the
/// energy in springs (J/m), `totals` those before and after this step's kick, `gravity` in m/s^2.
pub fn measure(
    step: &Step,
    gravity: Vec2,
    contact: f64,
    [before, after]: [&Totals; 2],
    entries: impl Iterator<Item = Entry>,
) -> DemMeasurement {
    // The part of the kick that lies before `t_n`.
    let share = if step.kick() > 0.0 {
        0.5 * step.dt_before / step.kick()
    } else {
        0.0
    };
    let mut ledger = Ledger {
        contact,
        friction_work: after.friction_work,
        viscous_work: after.viscous_work,
        driven_work: before.driven_work + share * (after.driven_work - before.driven_work),
        applied_impulse: after.applied_impulse.value(),
        contact_impulse: after.contact_impulse.value(),
        ..Ledger::default()
    };
    let w = step.centring();
    let bodies = entries.map(|entry| entry.enter(&mut ledger, gravity, w));
    DemMeasurement {
        bodies: bodies.collect(),
        ledger,
    }
}
