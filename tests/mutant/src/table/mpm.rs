//! What is broken in continua, clause by clause.

use std::collections::HashMap;

use conformance::Flaw;
use interface::config::{
    GridContact, MaterialModel, MpmConfig, ShapeFunction, StressUpdate, Transfer, Walls,
};
use interface::message::wire::{ImpForce, StepHeader, flags};
use interface::message::{Kind, Message, Payload};

use super::row::{Row, rows};
use crate::change;

pub const ROWS: &[Row] = rows! {
    clause "S-8b":
        - "uses the first material instead of an unknown one": Flaw::config(|config: &mut MpmConfig| {
            let materials = config.materials.len();
            for group in config.groups.iter_mut().filter(|g| g.material >= materials) {
                group.material = 0;
            }
        });
    clause "G-9b":
        - "sends empty states twice": change::twice(|message| {
            let header = message.header;
            let empty = matches!(&message.payload, Payload::States(states) if states.is_empty());
            empty && header.flags == 0 && header.step > 2 && header.set == 1
        });
    clause "E-2a":
        - "accepts envelopes of any step": change::header(Kind::Envelopes, |h, now| h.step = now.step);
    clause "E-2b":
        - "does not count envelopes": Flaw::envelopes(|h, vertices| h.count = vertices.len() as u64);
    clause "E-3a":
        - "uses 0 instead of a NaN":
            Flaw::vertex(|v| v.position = v.position.map(|x| if x.is_nan() { 0.0 } else { x }));
    clause "F-2b":
        - "accepts forces of any step": change::header(Kind::Forces, |h, now| h.step = now.step);
    clause "F-2c":
        - "accepts forces of any epoch": change::header(Kind::Forces, |h, now| h.epoch = now.grant.epoch);
    clause "F-3b":
        - "accepts forces of any set": change::header(Kind::Forces, |h, now| h.set = now.set);
    clause "F-3c":
        - "uses zero for missing forces": change::in_step(|message, now| {
            if let Payload::Forces(forces) = &mut message.payload
                && message.header.count == forces.len() as u64
            {
                forces.resize(now.points, ImpForce::default());
                message.header.count = now.points as u64;
            }
        });
    clause "F-3d":
        - "does not count forces": Flaw::forces(|h, forces| h.count = forces.len() as u64);
    clause "F-4a":
        - "uses 0 instead of a NaN": Flaw::force(|f| f.force = f.force.map(|x| if x.is_nan() { 0.0 } else { x }));
    clause "F-4b":
        - "uses 0 for an infinite travel":
            Flaw::forces(|h, _| h.travel = if h.travel.is_infinite() { 0.0 } else { h.travel });
    clause "F-5b":
        - "uses a default stiffness": Flaw::force(|f| {
            if f.stiffness == 0.0 && f.force != [0.0; 2] {
                f.stiffness = 1.0;
            }
        });
    clause "F-5c":
        - "uses the magnitude of a stiffness": Flaw::force(|f| f.stiffness = f.stiffness.abs());
    clause "I-6c":
        - "asks for envelopes in every step":
            Flaw::forces(|header, _| { if header.travel.is_finite() { header.travel = 10.0; } });
    clause "I-9c":
        - "sends five thousand states at most":
            Flaw::states(|header, states| { states.truncate(5000); header.count = states.len() as u64; });
    clause "L-2c":
        - "reports a hundredth of its stiffness": change::limits(|limits| limits.omega_sq *= 0.01);
    clause "L-2h":
        - "reports four hundred times its stiffness": change::limits(|limits| limits.omega_sq *= 400.0);
    clause "H-1a":
        - "ignores the budget of speed": Flaw::grant(|grant| grant.budget_speed = f64::MAX);
    clause "H-1b":
        - "compares one of its frequencies with the budget":
            Flaw::grant(|g| g.budget_omega_sq = f64::MAX.min(2.0 * g.budget_omega_sq));
    clause "H-2b":
        - "continues after HALT_AFTER": Flaw::forces(|header, _| header.flags = 0);
    clause "H-2c":
        - "halts at the end of the window": change::report(|report, now| {
            let ends = report.next == now.grant.first + now.grant.steps;
            report.halted |= u64::from(now.of_forces & flags::HALT_AFTER != 0 && ends);
        });
    clause "H-3a":
        - "sends HALT_BEFORE after HALT_AFTER": change::passing(|message, now| match &message.payload {
            Payload::Report(reports)
                if now.of_forces & flags::HALT_AFTER != 0 && reports[0].limits.speed > now.grant.budget_speed =>
            {
                let header = StepHeader {
                    epoch: reports[0].epoch,
                    step: reports[0].next,
                    flags: flags::HALT_BEFORE,
                    ..StepHeader::default()
                };
                vec![Message::new(header, Payload::States(Vec::new())), message]
            }
            _ => vec![message],
        });
    clause "H-4a":
        - "ignores budgets without bodies":
            change::grant(|g, now| { if now.configured == Some(false) { g.budget_omega_sq = f64::MAX; } });
    clause "S-2c":
        - "counts one point too many": change::ready(|ready| ready.readiness.items += 1);
        - "reports another time": change::ready(|ready| ready.readiness.courant_time *= 1.01);
        - "reports the mass of two points": change::ready(|ready| ready.readiness.mass_min *= 2.0);
    clause "I-8a":
        - "counts sets by two": Flaw::set(|header, _| header.set += u64::from(header.set > 1));
    clause "I-1c":
        - "leaves out the epoch": Flaw::states(|header, _| header.epoch = 0);
        - "sends a state too many": Flaw::states(|header, states| {
            states.extend_from_within(..states.len().min(1));
            header.count = states.len() as u64;
        });
    clause "C-4":
        - "does not count a set": Flaw::set(|header, _| header.count += 3);
        - "does not count all points": Flaw::points(|header, _| header.count += 3);
    clause "I-2g":
        - "exchanges the ids of two points":
            Flaw::set(|_, set| { if let [a, b, ..] = &mut set[..] { std::mem::swap(&mut a.id, &mut b.id); } });
        - "reports too large masses": Flaw::info(|info| info.mass *= 1.5);
    clause "T-1a":
        - "drifts": Flaw::states(|header, states| {
            for state in states {
                state.position[0] += 1e-11 * header.step as f64;
            }
        });
        - "loses velocity": Flaw::states(|header, states| {
            for state in states.iter_mut().filter(|_| header.step > 2) {
                state.velocity[1] *= 1.0 - 1e-9;
            }
        });
        - "exchanges the states of two points":
            Flaw::states(|_, states| { if states.len() > 1 { states.swap(0, 1); } });
        - "kicks by a whole step at first":
            Flaw::grant(|grant| { if grant.dt_before_epoch == 0.0 { grant.dt_before_epoch = grant.dt; } });
        - "assumes that all steps are equal": Flaw::grant(|grant| {
            if grant.dt_before_epoch > 0.0 && grant.dt > 0.0 {
                grant.dt_before_epoch = grant.dt;
            }
        });
        - "drifts in the opening step":
            Flaw::grant(|grant| { if grant.first == 0 && grant.dt == 0.0 { grant.dt = 1e-9; } });
        // Groups in contact need layers.
        - "has one grid for all groups": of_config(|config| config.layers &= !config.group_pairs.is_empty());
        - "has FLIP for every transfer": of_config(|config| config.transfer = Transfer::Flip);
        - "has a share of PIC that is a tenth too large": of_config(|config| match &mut config.transfer {
            Transfer::Blend { pic_fraction } => *pic_fraction = (1.1 * *pic_fraction).min(1.0),
            Transfer::FlipPic { pic_rate }
            | Transfer::Aflip { pic_rate }
            | Transfer::FlipXpic { pic_rate, .. } => *pic_rate *= 1.1,
            _ => {}
        });
        - "has XPIC of one order less": of_config(|config| match &mut config.transfer {
            Transfer::Xpic { order } | Transfer::FlipXpic { order, .. } => {
                *order = (*order - 1).max(1);
            }
            _ => {}
        });
        - "updates all stresses first": of_config(|config| config.stress_update = StressUpdate::Usf);
        - "has hats for boxes": of_config(|config| {
            if config.shape == ShapeFunction::Ugimp && config.stress_update != StressUpdate::Usl {
                config.shape = ShapeFunction::Linear;
            }
        });
        - "has quadratic splines for cubic ones": of_config(|config| {
            if config.shape == ShapeFunction::CubicBspline {
                config.shape = ShapeFunction::QuadraticBspline;
            }
        });
        - "is softer in shear":
            of_model(|model| { if let MaterialModel::LinearElastic(m) = model { m.shear_modulus *= 0.999; } });
        - "has no walls": of_config(|config| config.walls = Walls::default());
        - "does not fall": of_config(|config| config.gravity = [0.0; 2]);
        - "does not rub on the grid": of_config(|config| config.grid_contact = config.grid_contact.map(|_| GridContact { friction: 0.0 }));
        - "lets nodes of groups meet without contact": of_config(|config| config.grid_contact = None);
        - "gives nodes no spin": of_config(|config| config.groups.iter_mut().for_each(|group| group.keeps_spin = false));
        - "shares no volumes":
            of_model(|model| { if let MaterialModel::MuI(numbers) = model { numbers.volume_rate = 0.0; } });
    clause "F-1a":
        - "applies forces one step late": change::after_others(|before, now| now.copy_from_slice(before));
        - "keeps a tenth of a force for the next step": change::after_others(|before, now| {
            for (now, before) in now.iter_mut().zip(before) {
                if before.force != [0.0; 2] {
                    now.force = [0, 1].map(|i| now.force[i] + 0.1 * before.force[i]);
                    now.stiffness = now.stiffness.max(before.stiffness);
                }
            }
        });
        - "ignores couples": Flaw::force(|f| f.couple = 0.0);
        - "says that points do not turn": Flaw::state(|s| s.spin = 0.0);
        - "applies larger forces to later points": Flaw::forces(|_, forces| {
            if let [_, _, later @ ..] = &mut forces[..] {
                change::scale(later, 1.0 + 1e-6);
            }
        });
        - "exchanges the forces on two points":
            Flaw::forces(|_, forces| { if let [a, b, ..] = &mut forces[..] { std::mem::swap(a, b); } });
        - "has larger forces on the right": change::answers(|states, forces| {
            if states.iter().any(|state| state.position[0] > 0.5) {
                change::scale(forces, 1.001);
            }
        });
    clause "I-7a":
        - "uses half of the reach of a segment": Flaw::envelopes(|_, vertices| {
            let bodies: Vec<u64> = vertices.iter().map(|v| v.body).collect();
            for vertex in vertices {
                if bodies.iter().filter(|body| **body == vertex.body).count() == 2 {
                    vertex.reach *= 0.5;
                }
            }
        });
        - "looks for points near bodies only": of_config(|config| config.group_pairs.clear());
    clause "I-6a":
        - "lets points use up more than the skin": lazy();
        - "does not look how far bodies have moved": Flaw::forces(|header, _| header.travel = 0.0);
    clause "L-2a":
        - "halves what contact adds": change::limits(|limits| limits.contact_omega_sq *= 0.5);
        - "leaves the surface of points out of the frequency of contact": Flaw::force(|f| f.tangential *= 1e-3);
        - "keeps the last contact frequency": {
            let mut touched = false;
            Flaw::report(move |report| {
                touched |= report.limits.contact_omega_sq > 0.0;
                if touched && report.limits.contact_omega_sq == 0.0 {
                    report.limits.contact_omega_sq = 1e-3;
                }
            })
        };
        - "reports half of its speed": change::limits(|limits| limits.speed *= 0.5);
        - "reports twice its radius": change::limits(|limits| limits.radius_min *= 2.0);
    clause "R-1b":
        - "counts one IMP too many": Flaw::report(|report| report.imps += 1);
    clause "R-3e":
        - "sends its groups in reverse order": Flaw::groups(|_, groups| groups.reverse());
        - "includes the boxes of points in the extent":
            Flaw::group(|group| group.lower = group.lower.map(|x| x - 0.0125));
        - "ends the extent of loaded points where it begins": Flaw::group(|group| group.loaded_upper = group.loaded_lower);
        - "counts points that are near as contacts": Flaw::group(|group| group.contacts = group.contacts.max(1));
    clause "N-1a":
        - "adds to the measured energy":
            Flaw::report(|report| { if report.next > 2 { report.ledger.kinetic *= 1.0 + 1e-9; } });
        - "adds to the impulse of gravity": change::ledger(|ledger| ledger.applied_impulse[1] *= 1.0 + 1e-6);
        - "adds to the impulse of contact": change::ledger(|ledger| ledger.contact_impulse[0] *= 1.0 + 1e-6);
        - "adds to the elastic energy": change::ledger(|ledger| ledger.elastic *= 1.01);
        - "adds to the potential energy": change::ledger(|ledger| ledger.gravity *= 1.0 + 1e-6);
        - "loses energy": change::ledger(|ledger| ledger.plastic_work = 0.2 * ledger.kinetic);
        - "adds to the work of the stress": change::ledger(|ledger| ledger.stress_work *= 1.0 + 1e-6);
        - "adds to the angular momentum": change::ledger(|ledger| ledger.angular_momentum *= 1.0 + 1e-6);
        - "adds to the moment of gravity": change::ledger(|ledger| ledger.applied_moment *= 1.0 + 1e-6);
        - "adds to the moment of contact": change::ledger(|ledger| ledger.contact_moment *= 1.0 + 1e-6);
    clause "R-5a":
        - "reports all points as of the first group": Flaw::point(|point| point.group = 0);
        - "reports plastic strain of an elastic material": Flaw::point(|point| point.plastic_strain = 1e-3);
        - "reverses shear stress": Flaw::point(|point| point.stress[3] *= -1.0);
    clause "R-5e":
        - "reports the plastic shear strain": Flaw::point(|point| point.plastic_strain *= 3.0_f32.sqrt());
        - "reports the growth of plastic strain since the last frame": {
            let mut before = HashMap::new();
            Flaw::point(move |point| {
                let now = point.plastic_strain;
                point.plastic_strain -= before.insert(point.id, now).unwrap_or_default();
            })
        };
        - "reports negative plastic strain": Flaw::point(|point| point.plastic_strain *= -1.0);
        - "keeps no plastic strain": Flaw::point(|point| point.plastic_strain = 0.0);
        - "reports NaN for points that have flowed":
            Flaw::point(|point| { if point.plastic_strain > 0.0 { point.plastic_strain = f32::NAN; } });
        - "has half the hardening":
            of_model(|model| { if let MaterialModel::VonMises { hardening_modulus, .. } = model { *hardening_modulus *= 0.5; } });
    clause "D-1a":
        - "sends its points in reverse order": Flaw::points(|_, points| points.reverse());
        - "leaves the step out of the final header": Flaw::points(|header, _| header.step = 0);
        - "leaves out the last half kick":
            Flaw::grant(|grant| { if grant.dt == 0.0 { grant.dt_before_epoch = 0.0; } });
};

fn of_config(change: fn(&mut MpmConfig)) -> Flaw {
    Flaw::config(change)
}

fn of_model(change: fn(&mut MaterialModel)) -> Flaw {
    Flaw::config(move |config: &mut MpmConfig| {
        let models = config.materials.iter_mut().map(|m| &mut m.model);
        models.for_each(change);
    })
}

/// The travel that a set allows is less by half a radius, so it is more where radii are small and the skin has the rest.
fn lazy() -> Flaw {
    let inbound = of_config(|config| {
        for group in &mut config.groups {
            if let Some(radius) = &mut group.contact_radius {
                let shrunk = *radius / change::SHRUNK;
                config.skin += *radius - shrunk;
                *radius = shrunk;
            }
        }
    });
    let outbound = Flaw::passing(|mut message| {
        match &mut message.payload {
            Payload::Set(set) => set
                .iter_mut()
                .for_each(|info| info.radius *= change::SHRUNK),
            Payload::Report(reports) => reports.iter_mut().for_each(|report| {
                report.limits.radius_min *= change::SHRUNK;
                // That of surfaces of the right radius is not far above.
                report.limits.contact_omega_sq *= 16.0;
            }),
            _ => {}
        }
        vec![message]
    });
    inbound.with(outbound)
}
