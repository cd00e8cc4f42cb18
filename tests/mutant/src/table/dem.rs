//! What is broken in solvers of bodies, clause by clause.

use conformance::Flaw;
use interface::config::capability::{CONTACTS, OWN_FRICTION};
use interface::config::{BodyInertia, ContactLaw, DemConfig, Motion};
use interface::message::wire::{ImpForce, flags};
use interface::message::{Kind, Payload};

use super::row::{Row, rows};
use crate::change;

pub const ROWS: &[Row] = rows! {
    clause "I-1a":
        - "does not look at the step of states": change::header(Kind::States, |h, now| h.step = now.step);
    clause "I-1b":
        - "does not look at the epoch of states": change::header(Kind::States, |h, now| h.epoch = now.grant.epoch);
    clause "I-2a":
        - "accepts ids in any order": Flaw::set(|_, set| {
            if set.windows(2).any(|pair| pair[0].id >= pair[1].id) {
                (0..).zip(set).for_each(|(k, info)| info.id = k);
            }
        });
    clause "I-2b":
        - "accepts a point without radius": Flaw::info(|info| info.radius = info.radius.max(1e-6));
    clause "I-2c":
        - "accepts a point without mass": Flaw::info(|info| info.mass = info.mass.max(1e-6));
    clause "I-2d":
        - "does not look at the count of a set": Flaw::set(|header, set| header.count = set.len() as u64);
    clause "I-2e":
        - "accepts any generation": change::in_step(|message, now| {
            let announced = message.kind() == Kind::Set || message.header.flags & flags::NEW_SET != 0;
            if announced {
                message.header.set = now.set.min(message.header.set);
            }
        });
    clause "I-2f":
        - "continues with the old set when a new one is missing": change::header(Kind::States, |h, now| {
            if h.flags == flags::NEW_SET && h.set == now.set + 1 {
                (h.flags, h.set) = (0, now.set);
            }
        });
    clause "I-3a":
        - "does not look at the generation of states": change::header(Kind::States, |h, now| {
            h.set = if h.flags == 0 { now.set } else { h.set };
        });
    clause "I-3b":
        - "adds missing states": change::in_step(|message, now| {
            if let Payload::States(states) = &mut message.payload
                && let Some(&last) = states.last()
            {
                states.resize(now.points, last);
                message.header.count = now.points as u64;
            }
        });
    clause "I-3c":
        - "uses 0 for a position that is NaN":
            Flaw::state(|s| s.position = s.position.map(|x| if x.is_nan() { 0.0 } else { x }));
    clause "I-3d":
        - "uses 0 for a velocity that is infinite":
            Flaw::state(|s| s.velocity = s.velocity.map(|v| if v.is_infinite() { 0.0 } else { v }));
    clause "W-2a":
        - "reads a reserved field": {
            let (seen, used) = change::shared(false);
            let flaw = Flaw::set(move |_, set| seen.set(set.iter().any(|info| info.next != 0)));
            flaw.with(Flaw::forces(move |_, forces| {
                if used.get() {
                    change::scale(forces, 2.0);
                }
            }))
        };
    clause "G-9a":
        - "answers twice": change::twice(|message| message.kind() == Kind::Forces);
    clause "C-1a":
        - "answers 4096 points at most":
            Flaw::forces(|header, forces| { forces.truncate(4096); header.count = forces.len() as u64; });
    clause "F-7w":
        - "counts a vertex for both of its segments": on_segments(|forces| {
            let all: f64 = forces.iter().map(|f| f[1]).sum();
            if forces[1][1] > 0.99 * all {
                forces[1] = forces[1].map(|f| 2.0 * f);
            }
        });
    clause "I-2i":
        - "ignores links to slots that do not exist": Flaw::set(|_, set| {
            let slots = set.len();
            (1..).zip(set).for_each(|(slot, info)| {
                if info.next as usize > slots || info.next == slot {
                    info.next = 0;
                }
            });
        });
    clause "H-2a":
        - "never halts": Flaw::grant(|g| {
            (g.budget_omega_sq, g.budget_speed, g.budget_damping) = (f64::MAX, f64::MAX, f64::MAX);
        });
    clause "L-3a":
        - "compares one of its frequencies with the budget":
            Flaw::grant(|g| g.budget_omega_sq = f64::MAX.min(2.0 * g.budget_omega_sq));
    clause "H-1c":
        - "does not report a halt of the other side":
            change::report(|report, now| { if now.of_states & flags::HALT_BEFORE != 0 { report.halted = 0; } });
    clause "J-1":
        - "uses the density as the mass": change::body(|body| {
            if let BodyInertia::Density(density) = body.inertia {
                body.inertia = BodyInertia::Mass(density);
            }
        });
        - "has half the moment of inertia": Flaw::body(|body| body.inertia *= 0.5);
    clause "F-8":
        - "pushes before contact": Flaw::force(|f| f.force[1] += if f.stiffness > 0.0 { 1e-30 } else { 0.0 });
    clause "F-7":
        - "sends the force on the body": Flaw::forces(|_, forces| change::scale(forces, -1.0));
        - "limits the stiffness": change::law(|k, _, _, _| *k = k.min(1e5));
        - "doubles friction": change::law(|_, _, mu, _| *mu *= 2.0);
        - "has friction although mu is 0":
            change::law(|k, k_t, mu, _| { if *mu == 0.0 { (*k_t, *mu) = (0.5 * *k, 0.1); } });
        - "leaves out the couple of friction": Flaw::force(|f| f.couple = 0.0);
        - "does not see points turn": Flaw::state(|s| s.spin = 0.0);
        - "has a stiffer tangential spring": change::law(|_, k_t, _, _| *k_t *= 1.1);
        - "damps half as much": change::law(|_, _, _, zeta| *zeta *= 0.5);
        - "has no adhesion": Flaw::config(|config: &mut DemConfig| {
            if let ContactLaw::Granular { adhesion, .. } = &mut config.point_contact {
                *adhesion = 0.0;
            }
        });
        - "has the area of a larger circle": Flaw::config(|config: &mut DemConfig| {
            if let ContactLaw::Area { area_stiffness, .. } = &mut config.point_contact {
                *area_stiffness *= 1.05;
            }
        });
        - "ignores the laws between surfaces": Flaw::config(|config: &mut DemConfig| config.contact_pairs.clear());
        - "exchanges the surfaces of two groups of points":
            Flaw::config(|config: &mut DemConfig| config.point_surfaces.reverse());
        - "halves the force between two points": Flaw::config(|config: &mut DemConfig| {
            for pair in &mut config.group_pairs {
                if let ContactLaw::Linear { normal_stiffness, .. } = &mut pair.law {
                    *normal_stiffness *= 0.5;
                }
            }
        });
        - "answers with the forces of the last step": {
            let mut last = Vec::new();
            Flaw::forces(move |_, forces| {
                let now = forces.clone();
                if last.len() == forces.len() {
                    forces.clone_from(&last);
                }
                last = now;
            })
        };
        - "adds a thousandth of the last force": change::after_others(|before, forces| {
            for (force, before) in forces.iter_mut().zip(before) {
                force.force = [0, 1].map(|i| force.force[i] + 1e-3 * before.force[i]);
            }
        });
        - "loses digits far from the origin": change::answers(|states, forces| {
            if states.iter().any(|s| s.position[0].abs() > 100.0) {
                change::scale(forces, 1.001);
            }
        });
        - "halves the forces where there are many points":
            Flaw::forces(|_, forces| { if forces.len() > 64 { change::scale(forces, 0.5); } });
        - "reverses the slots of a later set":
            Flaw::forces(|header, forces| { if header.set > 1 { forces.reverse(); } });
        - "keeps radii by slot": {
            let mut first: Vec<f64> = Vec::new();
            Flaw::set(move |_, set| {
                for (slot, info) in set.iter_mut().enumerate() {
                    match first.get(slot) {
                        Some(radius) => info.radius = *radius,
                        None => first.push(info.radius),
                    }
                }
            })
        };
        - "forgets all springs at a new set": without_contacts().with(Flaw::set(|header, set| {
            set.iter_mut().for_each(|info| info.id += 1000 * header.set);
        }));
        - "shares a force on a segment evenly": on_segments(|forces| {
            let mean = [0, 1].map(|i| 0.5 * (forces[0][i] + forces[1][i]));
            if forces[2] == [0.0; 2] {
                (forces[0], forces[1]) = (mean, mean);
            }
        });
        - "gives all of a force on a segment to the nearer marker": on_segments(|forces| {
            if forces[2] == [0.0; 2] {
                let sum = [0, 1].map(|i| forces[0][i] + forces[1][i]);
                let is_first = forces[0][0].hypot(forces[0][1]) >= forces[1][0].hypot(forces[1][1]);
                (forces[0], forces[1]) = if is_first { (sum, [0.0; 2]) } else { ([0.0; 2], sum) };
            }
        });
        - "keeps springs by slot": without_contacts().with(Flaw::set(|_, set| (0..).zip(set).for_each(|(slot, info)| info.id = slot)));
        - "has friction of its own beyond Coulomb's": own_friction().with(change::law(|_, _, mu, _| *mu *= 2.0));
        - "has friction of its own by the slots of points":
            own_friction().with(Flaw::states(|_, states| states.iter_mut().step_by(2).for_each(|s| s.spin = 0.0)));
        - "has friction of its own by the place": own_friction().with(Flaw::state(|s| if s.position[0] > 0.0 { s.spin = 0.0 }));
        - "has friction of its own by the sense of turning": own_friction().with(Flaw::state(|s| s.spin = s.spin.max(0.0)));
    clause "F-5":
        - "gives no stiffness to a point that is pushed": Flaw::force(|f| { if f.force != [0.0; 2] { f.stiffness = 0.0; } });
    clause "F-6":
        - "gives no stiffness to a point that is not yet pushed": Flaw::force(|f| { if f.force == [0.0; 2] { f.stiffness = 0.0; } });
        - "counts half the stiffness": Flaw::force(|f| f.stiffness *= 0.5);
        - "counts half the tangential stiffness": Flaw::force(|f| f.tangential *= 0.5);
    clause "T-1":
        - "takes half the granted step": Flaw::grant(|grant| { grant.dt *= 0.5; grant.dt_before_epoch *= 0.5; });
        - "begins with a whole kick":
            Flaw::grant(|grant| { if grant.first == 0 { grant.dt_before_epoch = grant.dt; } });
        - "begins every window with half a kick": Flaw::grant(|grant| {
            if grant.steps_in_epoch > 0 {
                grant.epoch_start += grant.dt * grant.steps_in_epoch as f64;
                grant.steps_in_epoch = 0;
                grant.dt_before_epoch = 0.0;
            }
        });
        - "keeps the first step length": {
            let mut first = 0.0;
            Flaw::grant(move |grant| {
                if grant.dt > 0.0 {
                    first = if first > 0.0 { first } else { grant.dt };
                    grant.dt = first;
                }
            })
        };
        - "kicks by the step before": Flaw::grant(|grant| {
            if grant.dt > 0.0 && grant.dt_before_epoch > 0.0 && grant.steps_in_epoch == 0 {
                let twice = 2.0 * grant.dt_before_epoch - grant.dt;
                grant.dt_before_epoch = twice.max(0.0);
            }
        });
        - "closes without a kick": Flaw::grant(|grant| { if grant.dt == 0.0 { grant.dt_before_epoch = 0.0; } });
        - "moves in the opening step":
            Flaw::grant(|grant| { if grant.first == 0 && grant.dt == 0.0 { grant.dt = 1e-4; } });
        - "lets fixed bodies fall": change::frees(|motion| matches!(motion, Motion::Fixed));
        - "lets driven bodies fall":
            change::frees(|motion| matches!(motion, Motion::Driven));
        - "lets guided bodies move freely":
            change::frees(|motion| matches!(motion, Motion::Guided { .. }));
        - "ignores the external force":
            change::frees(|motion| matches!(motion, Motion::Pushed { .. }));
        - "does not turn bodies":
            change::body(|body| body.angle = 0.0);
        - "turns too slowly": Flaw::body(|body| body.spin *= 0.99);
    clause "F-9":
        - "reports half its travel": Flaw::forces(|header, _| header.travel *= 0.5);
    clause "E-1":
        - "sends outlines of the next step": Flaw::envelopes(|header, _| header.step += 1);
    clause "F-2":
        - "numbers forces by the next step": Flaw::forces(|header, _| header.step += 1);
    clause "F-3":
        - "does not say which set forces belong to": Flaw::forces(|header, _| header.set = 0);
        - "sends a force too many":
            Flaw::forces(|header, forces| { forces.push(ImpForce::default()); header.count += 1; });
    clause "C-4":
        - "does not count forces": Flaw::forces(|header, _| header.count += 1);
    clause "E-4":
        - "sends bodies in another order": Flaw::envelopes(|_, vertices| vertices.reverse());
        - "sends outlines without the sphero-radius": Flaw::vertex(|v| v.reach *= 0.5);
    clause "R-3":
        - "counts one contact too many": Flaw::body(|body| body.contacts += 1);
        - "reverses torques": Flaw::body(|body| body.point_torque *= -1.0);
        - "leaves out the bodies' contact with one another": Flaw::body(|body| body.body_force = [0.0; 2]);
    clause "L-2":
        - "reports half its contact frequency": change::limits(|l| l.contact_omega_sq *= 0.5);
        - "forgets contact between bodies in its limits": change::limits(|l| l.omega_sq = 0.0);
        - "counts in the opening step only what touches": change::report(|report, _| {
            if report.next == 1 { report.limits.omega_sq = 0.0; }
        });
        - "reports half its speed": change::limits(|l| l.speed *= 0.5);
        - "does not report damping": change::limits(|l| l.damping = 0.0);
    clause "N-1":
        - "leaves out the energy in springs": change::ledger(|l| l.contact = 0.0);
        - "counts half of the energy dissipated by sliding": change::ledger(|l| l.friction_work *= 0.5);
        - "gets energy out of friction of its own": own_friction().with(change::ledger(|l| l.friction_work *= -1.0));
        - "counts half of the energy dissipated by dashpots": change::ledger(|l| l.viscous_work *= 0.5);
        - "counts half of the work of external forces": change::ledger(|l| l.driven_work *= 0.5);
        - "counts the contact forces on the points":
            change::ledger(|l| l.contact_force = l.contact_force.map(|f| -f));
        - "counts the impulse of gravity twice":
            change::ledger(|l| l.applied_impulse = l.applied_impulse.map(|p| 2.0 * p));
        - "leaves out the rotation": change::ledger(|l| l.kinetic_rotation = 0.0);
        - "measures the kinetic energy half a step late": change::ledger(|l| l.kinetic *= 1.001);
        - "leaves out its angular momentum": change::ledger(|l| l.angular_momentum = 0.0);
        - "counts the moment of gravity twice": change::ledger(|l| l.applied_moment *= 2.0);
        - "leaves out the moment of the points": change::ledger(|l| l.contact_moment = 0.0);
    clause "R-6":
        - "leaves out the last contact":
            Flaw::contacts(|header, contacts| { contacts.pop(); header.count = contacts.len() as u64; });
        - "gives the force on the point": Flaw::contact(|contact| contact.force = contact.force.map(|f| -f));
        - "gives the place of the first body": Flaw::contact(|contact| contact.position = [0.0; 2]);
        - "reports two points as a body and a point": Flaw::contact(|contact| contact.with = contact.with.min(1));
};

fn own_friction() -> Flaw {
    change::hello(|hello| hello.capabilities.0.push(OWN_FRICTION.into()))
}

/// Says that it has no contacts in its frames, which name points by their ids.
fn without_contacts() -> Flaw {
    change::hello(|hello| hello.capabilities.0.retain(|name| name != CONTACTS))
}

/// Changes the forces on the first three markers of a chain.
pub fn on_segments(mut change: impl FnMut(&mut [[f64; 2]; 3]) + 'static) -> Flaw {
    let (links, linked) = change::shared(false);
    let flaw = Flaw::set(move |_, set| links.set(set.iter().any(|info| info.next > 0)));
    flaw.with(Flaw::forces(move |_, forces| {
        if let [a, b, c, ..] = &mut forces[..]
            && linked.get()
        {
            let mut three = [a.force, b.force, c.force];
            change(&mut three);
            [a.force, b.force, c.force] = three;
        }
    }))
}
