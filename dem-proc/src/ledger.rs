//! Energies, momenta and impulses of the bodies' side (PHYSICS.md section 7).
//!
//! Order: kinetic energies are the weighted mean of the two half-step values. Losses are trapezoid sums over the
//! steps done, work of driven bodies is force at `t_n` times velocity (constant for a driven body) over the kick,
//! half a kick of which belongs to the time before `t_n`: all second order in the step.

use interface::Vec2;
use interface::impulse::Impulse;
use interface::solver::DemMeasurement;
use interface::step::Step;
use interface::wire::{BodyState, ImpState, Ledger};

use crate::body::Bodies;
use crate::configure::System;
use crate::law::Loss;
use crate::load::{Load, PairLoad};

/// Sums over the whole run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Dissipated by friction and by dashpots in J/m.
    pub loss: Loss,
    /// Done by driven bodies in J/m.
    pub driven_work: f64,
    /// Gravity on free bodies and the holders of the others in N s/m.
    pub applied_impulse: Impulse,
    /// Of the points on all bodies in N s/m.
    pub contact_impulse: Impulse,
}

/// What a kick adds.
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
    /// Whether there are points; without, their loads are zero.
    pub coupled: bool,
    /// Loads by points.
    pub point_loads: &'a [Load],
    /// Loads by bodies.
    pub body_loads: &'a [PairLoad],
    /// Dissipated over the step before by either kind of contact.
    pub losses: [Loss; 2],
}

impl Totals {
    /// The totals at the end of `kick`.
    #[must_use]
    pub fn after(mut self, kick: &Kick) -> Self {
        for loss in kick.losses {
            self.loss.friction += loss.friction;
            self.loss.viscous += loss.viscous;
        }
        // The holders of fixed and driven bodies take up what contacts exert on them: none of it appears as momentum.
        let held = kick.bodies.held.iter().map(|&b| b as usize);
        let reactions: Vec2 = held
            .map(|b| kick.point_loads[b].force + kick.body_loads[b].force)
            .sum();
        if kick.coupled {
            let by_points: Vec2 = kick.point_loads.iter().map(|load| load.force).sum();
            self.contact_impulse += by_points * kick.length;
        }
        let weight = kick.gravity * kick.bodies.free_mass;
        self.applied_impulse += (weight - reactions) * kick.length;
        self.driven_work += driven_power(kick) * kick.length;
        for &b in &kick.bodies.special {
            let (force, power) = from_outside(kick, b as usize);
            self.applied_impulse += force * kick.length;
            self.driven_work += power * kick.length;
        }
        self
    }
}

/// Force (N/m) on a guided or pushed body by what is outside, its weight included, and the power (W/m) of all of it
/// but the weight, over the kick.
fn from_outside(kick: &Kick, b: usize) -> (Vec2, f64) {
    let (body, state) = (&kick.bodies.fixed[b], &kick.bodies.state[b]);
    let (points, others) = (&kick.point_loads[b], &kick.body_loads[b]);
    let (push, torque) = body.push(kick.time);
    let weight = kick.gravity * body.mass;
    let inner = points.force + others.force + weight + push;
    let held = |i: usize| 1.0 - body.yielding[i];
    let guide = -Vec2::new(inner.x * held(0), inner.y * held(1));
    let guide_torque = -(points.torque + others.torque + torque) * held(2);
    let (after, spin_after) = kick.kicked[b];
    // The work of a force over a leapfrog kick is force times the mean of the velocities before and after.
    let velocity = (state.velocity + after) * 0.5;
    let spin = 0.5 * (state.spin + spin_after);
    let power = (push + guide).dot(&velocity) + (torque + guide_torque) * spin;
    (weight + push + guide, power)
}

/// Power that the holders of driven bodies put into the system, in W/m.
fn driven_power(kick: &Kick) -> f64 {
    let held = kick.bodies.held.iter().map(|&b| b as usize);
    held.map(|b| {
        let (points, others) = (&kick.point_loads[b], &kick.body_loads[b]);
        let state = &kick.bodies.state[b];
        let power = (points.force + others.force).dot(&state.velocity);
        -(power + (points.torque + others.torque) * state.spin)
    })
    .sum()
}

/// The measurement at `t_n`, between kick and commit: `bodies.state` has the velocities before, `kicked` those after.
pub fn measure(system: &System, step: &Step, imps: &[ImpState]) -> DemMeasurement {
    let w = step.centring();
    let bodies = &system.bodies;
    let after = system.totals_after(step);
    let excess = after.driven_work - system.totals.driven_work;
    let share = if step.kick() > 0.0 {
        0.5 * step.dt_before / step.kick()
    } else {
        0.0
    };
    let mut ledger = Ledger {
        contact: system.points.energy(bodies, imps)
            + system
                .pairs
                .as_ref()
                .map_or(0.0, |pairs| pairs.energy(bodies)),
        friction_work: after.loss.friction,
        viscous_work: after.loss.viscous,
        driven_work: system.totals.driven_work + share * excess,
        applied_impulse: after.applied_impulse.value(),
        contact_impulse: after.contact_impulse.value(),
        ..Ledger::default()
    };
    let (mut momentum, mut contact_force) = (Vec2::zeros(), Vec2::zeros());
    let mut states = Vec::with_capacity(bodies.len());
    for (b, (body, state)) in bodies.fixed.iter().zip(&bodies.state).enumerate() {
        let (points, others) = (&system.point_loads[b], &system.body_loads[b]);
        let (v, spin) = system.kicked[b];
        let centred = |before: f64, after: f64| (1.0 - w) * before + w * after;
        if body.yields() {
            ledger.kinetic +=
                0.5 * body.mass * centred(state.velocity.norm_squared(), v.norm_squared());
            ledger.kinetic_rotation +=
                0.5 * body.inertia * centred(state.spin * state.spin, spin * spin);
            ledger.gravity -= body.mass * system.gravity.dot(&state.center);
            momentum += v * body.mass;
        }
        contact_force += points.force;
        ledger.contacts += u64::from(points.contacts > 0);
        states.push(BodyState {
            position: state.center.into(),
            velocity: (state.velocity * (1.0 - w) + v * w).into(),
            angle: state.angle,
            spin: centred(state.spin, spin),
            mass: body.mass,
            inertia: body.inertia,
            point_force: points.force.into(),
            point_torque: points.torque,
            body_force: others.force.into(),
            body_torque: others.torque,
            contacts: u64::from(points.contacts),
        });
    }
    ledger.momentum = momentum.into();
    ledger.contact_force = contact_force.into();
    DemMeasurement {
        ledger,
        bodies: states,
    }
}
