//! The ledger of a bodies' side (PROTOCOL.md section 9): what is reported of its bodies, by the driver or, if it knows more,
//! by the solver itself.
//!
//! After a kick, a solver makes an [`Entry`] of each body and adds it to its [`Totals`]. If the step is measured, it
//! passes all entries to [`measure`]. The solver itself only has to supply what it alone knows: the energy in springs,
//! and the losses.
//!
//! Kinetic energies are the weighted mean of the two half-step values (T-5). External work is the force of a kick times
//! the mean of the velocities before and after the kick; half of a kick belongs to the time before `t_n`. All this is
//! of second order in the step (docs/physics.md section 7).

use serde::{Deserialize, Serialize};

use crate::Vec2;
use crate::impulse::{Impulse, at};
use crate::message::wire::{BodyState, Ledger};
use crate::solver::DemMeasurement;
use crate::step::Step;

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

    /// External force (N/m) on the body: its weight if forces move it, in `gravity` (m/s^2), a push (N/m and N), and
    /// the force that guides or holds it, with the moment about the origin. Also the power (W/m) over the kick of all of these
    /// except the weight.
    fn outside_force(&self, gravity: Vec2, (push, torque): (Vec2, f64)) -> ([f64; 3], f64) {
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
        let [x, y, moment] = at(b.position, weight + push + guide);
        ([x, y, moment + torque + guide_torque], power)
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
            let of_centre = Vec2::from(b.position).perp(&after);
            ledger.angular_momentum += b.mass * of_centre + b.inertia * self.spin;
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
    /// Work of driven bodies and pushes in J/m.
    pub driven_work: f64,
    /// By gravity and pushes on the bodies that forces move, and by what guides and holds bodies, in N s/m.
    pub applied_impulse: Impulse,
    /// By the points on all bodies in N s/m.
    pub contact_impulse: Impulse,
}

impl Totals {
    /// Adds the impulse and the work for a body in a kick of `length` (s), in `gravity` (m/s^2), with a push (N/m and
    /// N).
    pub fn add(&mut self, entry: &Entry, gravity: Vec2, push: (Vec2, f64), length: f64) {
        let [x, y, moment] = at(entry.body.position, entry.body.point_force);
        self.contact_impulse += [x, y, moment + entry.body.point_torque].map(|of| of * length);
        self.add_outside(entry, gravity, push, length);
    }

    /// The same without the impulse of the points, for a solver that sums it in another way.
    pub fn add_outside(&mut self, entry: &Entry, gravity: Vec2, push: (Vec2, f64), length: f64) {
        let (force, power) = entry.outside_force(gravity, push);
        self.applied_impulse += force.map(|of| of * length);
        self.driven_work += power * length;
    }
}

/// The measurement at `t_n` of `step`, from the entries of all bodies in the order of the configuration. `contact` is
/// the energy in springs (J/m), the totals are those before and after the kick of this step, and `gravity` is in m/s^2.
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
        applied_moment: after.applied_impulse.moment(),
        contact_moment: after.contact_impulse.moment(),
        ..Ledger::default()
    };
    let w = step.centring();
    let bodies = entries.map(|entry| entry.enter(&mut ledger, gravity, w));
    DemMeasurement {
        bodies: bodies.collect(),
        ledger,
    }
}
