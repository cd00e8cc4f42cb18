//! Energies, momenta and impulses of the bodies' side (docs/physics.md section 7), computed with [`interface::ledger`].
//!
//! Losses are sums over all steps so far, by the trapezoidal rule.

use interface::Vec2;
use interface::ledger::{self, Entry, Totals};
use interface::message::wire::{BodyState, ImpState};
use interface::solver::DemMeasurement;
use interface::step::Step;

use crate::body::bodies::{Bodies, Rigid};
use crate::body::load::{Load, PairLoad};
use crate::contact::side::Side;
use crate::law::Loss;
use crate::system::System;

/// The contribution of one kick.
#[derive(Debug, Clone, Copy)]
pub struct Kick<'a> {
    /// Length of the kick in s.
    pub length: f64,
    /// `t_n` in s.
    pub time: f64,
    /// Velocities and spins after it.
    pub kicked: &'a [(Vec2, f64)],
    /// The bodies at `t_n`.
    pub bodies: &'a Bodies,
    /// In m/s^2.
    pub gravity: Vec2,
    /// Whether there are points; if not, their loads are zero.
    pub coupled: bool,
    /// Loads by points.
    pub point_loads: &'a [Load],
    /// Loads by bodies.
    pub body_loads: &'a [PairLoad],
    /// Energy dissipated over the last step by each kind of contact.
    pub losses: [Loss; 3],
}

impl Kick<'_> {
    /// The totals after the kick, from those before it. Free bodies, which only contact and gravity move, are summed
    /// together.
    #[must_use]
    pub fn after(&self, totals: &Totals) -> Totals {
        let mut after = *totals;
        for loss in self.losses {
            after.friction_work += loss.friction;
            after.viscous_work += loss.viscous;
        }
        if self.coupled {
            let by_points: Vec2 = self.point_loads.iter().map(|load| load.force).sum();
            let loads = self.point_loads.iter().zip(&self.bodies.state);
            let moment =
                |(load, state): (&Load, &Rigid)| state.center.perp(&load.force) + load.torque;
            let moment: f64 = loads.map(moment).sum();
            after.contact_impulse += [by_points.x, by_points.y, moment].map(|of| of * self.length);
        }
        let (masses, all) = &self.bodies.free;
        let fall = self.gravity * *all * self.length;
        let masses = self.bodies.state.iter().zip(masses);
        let place: Vec2 = masses.map(|(state, mass)| state.center * *mass).sum();
        let moment = place.perp(&(self.gravity * self.length));
        after.applied_impulse += [fall.x, fall.y, moment];
        for &b in self.bodies.held.iter().chain(&self.bodies.special) {
            let b = b as usize;
            let push = self.bodies.properties[b].motion.push(self.time);
            after.add_outside(&self.entry(b), self.gravity, push, self.length);
        }
        after
    }

    /// The data of body `b` for the ledger.
    fn entry(&self, b: usize) -> Entry {
        let (body, state) = (&self.bodies.properties[b], &self.bodies.state[b]);
        let (points, others) = (&self.point_loads[b], &self.body_loads[b]);
        let (velocity, spin) = self.kicked[b];
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
}

impl System {
    /// Energy in all contact springs of the last evaluation in J/m.
    pub(crate) fn contact_energy(&self, imps: &[ImpState]) -> f64 {
        let now = self.now(imps);
        let of = |side: Option<&dyn Side>| side.map_or(0.0, |side| side.energy(&now));
        let sides = &self.sides;
        sides.points.energy(&now) + of(sides.point_pairs.as_deref()) + of(sides.bodies.as_deref())
    }

    /// The kick of this step as the ledger needs it.
    pub(crate) fn kick_of(&self, step: &Step) -> Kick<'_> {
        let loss = |side: Option<&dyn Side>| side.map_or_else(Loss::default, |s| s.sums().loss);
        let sides = &self.sides;
        Kick {
            length: step.kick(),
            time: step.time,
            kicked: &self.kicked.velocities,
            bodies: &self.bodies,
            gravity: self.gravity,
            coupled: self.loads.any_by_points,
            point_loads: &self.loads.by_points,
            body_loads: &self.loads.by_bodies,
            losses: [
                sides.points.sums().loss,
                loss(sides.point_pairs.as_deref()),
                loss(sides.bodies.as_deref()),
            ],
        }
    }
}

/// The measurement at `t_n`, between kick and commit: `bodies.state` still has the velocities before the kick, `kicked`
/// has those after it.
pub fn measure(system: &System, step: &Step, imps: &[ImpState]) -> DemMeasurement {
    let contact = system.contact_energy(imps);
    let kick = system.kick_of(step);
    let totals = [&system.state.totals, &kick.after(&system.state.totals)];
    let entries = (0..system.bodies.len()).map(|b| kick.entry(b));
    ledger::measure(step, system.gravity, contact, totals, entries)
}
