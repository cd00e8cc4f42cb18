//! Sections 3 to 9: what a continuum does and says, judged by random cases beside the oracle ([`crate::random`]).

use std::collections::HashMap;

use interface::config::capability::PLASTIC_STRAIN;
use interface::config::{
    GridContact, MaterialModel, MpmConfig, ShapeFunction, StressUpdate, Transfer, Walls,
};
use interface::transport::raw::Payload;

use crate::clause::{Clause, clauses};
use crate::mutant::{Flaw, change};

pub const CLAUSES: &[Clause] = clauses! {
    Must "S-2c" "Ready has the number of points, the mass of the lightest, and the time in which a wave crosses a cell",
        often: "the time of a cell without the shear modulus in the wave's speed; or the mass of a group for that of a point";
        - "counts one point too many": change::ready(|ready| ready.readiness.items += 1);
        - "reports another time": change::ready(|ready| ready.readiness.courant_time *= 1.01);
        - "reports the mass of two points": change::ready(|ready| ready.readiness.mass_min *= 2.0);
    Must "I-8a" "generations count from 1, by 1 for every set, also an empty or the same one",
        often: "a generation that does not rise where the new set is the old one";
        - "counts sets by two": Flaw::set(|header, _| header.set += u64::from(header.set > 1));
    Must "I-1c" "states carry the step, the epoch and their number",
        often: "step or epoch of the step before";
        - "leaves out the epoch": Flaw::states(|header, _| header.epoch = 0);
    Must "I-2g" "the ids of a set rise, and it has radius, mass and group of each point",
        often: "ids by slot; or the radius of the cell, not of the group";
        - "exchanges the ids of two points":
            Flaw::set(|_, set| { if let [a, b, ..] = &mut set[..] { std::mem::swap(&mut a.id, &mut b.id); } });
        - "reports too large masses": Flaw::info(|info| info.mass *= 1.5);
    Must "T-1a" "points move by the leapfrog, as their materials, transfer, shape function and walls say", after: &["I-2g"],
        often: "a kick of a whole step where half of two is asked for; or the weights of another shape function or transfer; or \
                walls on the wrong nodes; or stress updated at the other end of the step";
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
    Must "F-1a" "a force acts in its step, once, at the position of its point", after: &["T-1a"],
        often: "a force that is kept for the next step, or goes to the nearest node; or no couple";
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
    Must "I-7a" "the set has all points within reach, radius and skin, all inside a body, and those of groups that touch", after: &["F-1a"],
        often: "the distance from a body's vertices, not from its edges; or without its reach, the point's radius or the skin";
        - "uses half of the reach of a segment": Flaw::envelopes(|_, vertices| {
            let bodies: Vec<u64> = vertices.iter().map(|v| v.body).collect();
            for vertex in vertices {
                if bodies.iter().filter(|body| **body == vertex.body).count() == 2 {
                    vertex.reach *= 0.5;
                }
            }
        });
        - "looks for points near bodies only": of_config(|config| config.group_pairs.clear());
    Must "I-6a" "asks for envelopes before points and bodies have used up the skin", after: &["F-1a"],
        often: "only what points have moved, not what bodies have; or the skin without half a radius";
        - "lets points use up more than the skin": lazy();
        - "does not look how far bodies have moved": Flaw::forces(|header, _| header.travel = 0.0);
    Must "L-2a" "limits bound the frequency of contact and the speed, and have the smallest radius", after: &["F-1a"],
        often: "the mass of a node where that of a point is asked for; or no tangential stiffness";
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
    Must "R-1b" "a report counts points, IMPs and sets",
        often: "points counted once for each layer; or sets since the last report";
        - "counts one IMP too many": Flaw::report(|report| report.imps += 1);
    Must "R-3e" "mass, motion, extent and contacts of a group are those of its points", after: &["F-1a"],
        often: "velocity at the end of the step, not in its middle; or points that are near counted as contacts";
        - "sends its groups in reverse order": Flaw::groups(|_, groups| groups.reverse());
        - "includes the boxes of points in the extent":
            Flaw::group(|group| group.lower = group.lower.map(|x| x - 0.0125));
        - "ends the extent of loaded points where it begins": Flaw::group(|group| group.loaded_upper = group.loaded_lower);
        - "counts points that are near as contacts": Flaw::group(|group| group.contacts = group.contacts.max(1));
    Must "N-1a" "every entry of the ledger is what section 9 says", after: &["F-1a"],
        often: "kinetic energy before the kick; or work of one step's force, not of the mean of two; or no impulse of walls and \
                supports";
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
    Must "R-5a" "with FRAME all points, as they are before the window, before the report", after: &["F-1a"],
        often: "points as they are after the window; or the volume of the start";
        - "reports all points as of the first group": Flaw::point(|point| point.group = 0);
        - "reports plastic strain of an elastic material": Flaw::point(|point| point.plastic_strain = 1e-3);
        - "reverses shear stress": Flaw::point(|point| point.stress[3] *= -1.0);
    Must "R-5e" "plastic strain is the equivalent one of von Mises' material and the shear strain of sand with a memory",
        needs: &[PLASTIC_STRAIN, "material:von_mises"], after: &["F-1a"],
        often: "the plastic shear strain, not the equivalent one; or its growth, not its sum";
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
    Must "D-1a" "all points at the end, in order of their ids, of the next step", after: &["F-1a"],
        often: "without the last half kick; or of the step before";
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
