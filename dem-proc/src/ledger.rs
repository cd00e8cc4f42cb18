//! Energies, momenta and impulses of the bodies' side (docs/physics.md section 7), computed with [`interface::ledger`].
//!
//! Losses are sums over all steps so far, by the trapezoidal rule.

use interface::Vec2;
use interface::ledger::{self, Entry, Totals};
use interface::message::wire::BodyState;
use interface::solver::DemMeasurement;
use interface::step::Step;

use crate::body::bodies::Rigid;
use crate::body::load::Load;
use crate::system::{BODIES, POINT_PAIRS, POINTS, Sdem};

/// The order of sums over contacts.
const LEDGER: [usize; 3] = [POINTS, POINT_PAIRS, BODIES];

impl Sdem {
    /// Energy in J/m in all contact springs ([`Sums::energy`](crate::contact::side::Sums)), in a measured or an opening step.
    pub(crate) fn contact_energy(&self) -> [f64; 2] {
        let sides = LEDGER.iter().filter_map(|&of| self.sides[of].as_ref());
        let energies = sides.map(|side| side.sums().energy);
        energies.fold([0.0; 2], |[all, held], [a, h]| [all + a, held + h])
    }

    /// The totals after the kick of this step. Free bodies, which only contact and gravity move, are summed together.
    pub(crate) fn totals_after(&self, step: &Step) -> Totals {
        let (mut after, length) = (self.state.totals, step.kick());
        for side in LEDGER.iter().filter_map(|&of| self.sides[of].as_ref()) {
            after.friction_work += side.sums().loss.friction;
            after.viscous_work += side.sums().loss.viscous;
        }
        let (bodies, loads) = (&self.bodies, &self.loads);
        if loads.any_by_points {
            let by_points: Vec2 = loads.by_points.iter().map(|load| load.force).sum();
            let moment =
                |(load, state): (&Load, &Rigid)| state.center.perp(&load.force) + load.torque;
            let moment: f64 = loads.by_points.iter().zip(&bodies.state).map(moment).sum();
            after.contact_impulse += [by_points.x, by_points.y, moment].map(|of| of * length);
        }
        let fall = self.gravity * bodies.free.1 * length;
        let place: Vec2 = self.kicked.moments.iter().sum();
        let moment = place.perp(&(self.gravity * length));
        after.applied_impulse += [fall.x, fall.y, moment];
        for &b in bodies.held.iter().chain(&bodies.special) {
            let b = b as usize;
            let push = bodies.properties[b].motion.push(step.span());
            after.add_outside(&self.entry(b), self.gravity, push, length);
        }
        after
    }

    /// The data of body `b` for the ledger.
    fn entry(&self, b: usize) -> Entry {
        let (body, state) = (&self.bodies.properties[b], &self.bodies.state[b]);
        let (points, others) = (&self.loads.by_points[b], &self.loads.by_bodies[b]);
        let (velocity, spin) = self.kicked.velocities[b];
        Entry {
            body: BodyState {
                position: state.center.into(),
                velocity: state.velocity.into(),
                angle: state.angle,
                spin: state.spin,
                mass: body.mass,
                inertia: body.inertia,
                point_force: points.force.into(),
                point_torque: points.torque,
                body_force: others.force.into(),
                body_torque: others.torque,
                contacts: u64::from(points.contacts),
            },
            velocity: velocity.into(),
            spin,
            yielding: body.yielding,
        }
    }

    /// The measurement at `t_n`, between kick and commit: `bodies.state` still has the velocities before the kick,
    /// `kicked` has those after it.
    pub(crate) fn measure(&self, step: &Step) -> DemMeasurement {
        let [contact, _] = self.contact_energy();
        let totals = [&self.state.totals, &self.totals_after(step)];
        let entries = (0..self.bodies.len()).map(|b| self.entry(b));
        ledger::measure(step, self.gravity, contact, totals, entries)
    }
}
