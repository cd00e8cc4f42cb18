//! Sections 5 to 9: what the bodies do and say, judged by random cases beside the oracle ([`crate::random`]).

use interface::config::capability::{CONTACTS, OWN_FRICTION};
use interface::config::{BodyInertia, ContactLaw, DemConfig, Motion};

use super::segments::on_segments;
use crate::clause::{Clause, clauses};
use crate::mutant::{Flaw, change};

pub const CLAUSES: &[Clause] = clauses! {
    Must "J-1" "mass and inertia follow from the configuration",
        often: "the area without the sphero-radius; or the moment about another place than the centre of mass";
        - "uses the density as the mass": change::body(|body| {
            if let BodyInertia::Density(density) = body.inertia {
                body.inertia = BodyInertia::Mass(density);
            }
        });
        - "has half the moment of inertia": Flaw::body(|body| body.inertia *= 0.5);
    Must "F-8" "without overlap the force is exactly 0",
        often: "contact that begins at a distance; or springs that outlive an opening";
        - "pushes before contact": Flaw::force(|f| f.force[1] += if f.stiffness > 0.0 { 1e-30 } else { 0.0 });
    Must "F-7" "the force on a point is that of the law, for the positions of this step",
        often: "slip without the body's translation, its rotation or the point's spin; or springs kept by slot, beyond an \
                opening, or one for all bodies; or a force that is capped, or of another step";
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
    Must "F-5" "stiffness is above 0 where there is a force",
        often: "stiffness of contacts that do not press yet is left out";
        - "gives no stiffness to a point that is pushed": Flaw::force(|f| { if f.force != [0.0; 2] { f.stiffness = 0.0; } });
    Must "F-6" "stiffness is that of all contacts within reach", after: &["F-7"],
        often: "only contacts that touch are counted, not all within reach; or no tangential stiffness";
        - "gives no stiffness to a point that is not yet pushed": Flaw::force(|f| { if f.force == [0.0; 2] { f.stiffness = 0.0; } });
        - "counts half the stiffness": Flaw::force(|f| f.stiffness *= 0.5);
        - "counts half the tangential stiffness": Flaw::force(|f| f.tangential *= 0.5);
    Must "T-1" "bodies move by the leapfrog, as their motion and what touches them say", after: &["J-1", "F-7"],
        often: "a kick of a whole step where half of two is asked for; or drift by the velocity before the kick; or torque of \
                the wrong sign, or spin by the mass";
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
    Must "F-9" "travel bounds the displacement of every surface", needs: &["motion:free"], after: &["T-1"],
        often: "travel of the centre, without the rotation";
        - "reports half its travel": Flaw::forces(|header, _| header.travel *= 0.5);
    Must "E-1" "answers a request with outlines of that step";
        - "sends outlines of the next step": Flaw::envelopes(|header, _| header.step += 1);
    Must "F-2" "forces carry step and epoch";
        - "numbers forces by the next step": Flaw::forces(|header, _| header.step += 1);
    Must "F-3" "forces carry generation and number of the set";
        - "does not say which set forces belong to": Flaw::forces(|header, _| header.set = 0);
    Must "E-4" "envelopes hold the bodies, in their order, each with one reach", after: &["T-1"],
        often: "an outline without the sphero-radius";
        - "sends bodies in another order": Flaw::envelopes(|_, vertices| vertices.reverse());
        - "sends outlines without the sphero-radius": Flaw::vertex(|v| v.reach *= 0.5);
    Must "R-3" "forces, torques and contacts of each body are those of what touches it", after: &["F-7"],
        often: "torque of the wrong sign, or about another place; or no part of fixed bodies";
        - "counts one contact too many": Flaw::body(|body| body.contacts += 1);
        - "reverses torques": Flaw::body(|body| body.point_torque *= -1.0);
        - "leaves out the bodies' contact with one another": Flaw::body(|body| body.body_force = [0.0; 2]);
    Must "L-2" "limits bound frequencies, damping and speed of the next step", needs: &["motion:free"], after: &["T-1"],
        often: "no lever arm, or no tangential stiffness, in the frequency; or speed without the rotation";
        - "reports half its contact frequency": change::limits(|l| l.contact_omega_sq *= 0.5);
        - "forgets contact between bodies in its limits": change::limits(|l| l.omega_sq = 0.0);
        - "reports half its speed": change::limits(|l| l.speed *= 0.5);
        - "does not report damping": change::limits(|l| l.damping = 0.0);
    Must "N-1" "every entry of the ledger is what section 9 says", after: &["T-1"],
        often: "energy of only one of the springs; or work of one step's force, not of the mean of two; or no impulse of \
                supports";
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
    Must "R-6" "a frame has every contact, with its force and its place", needs: &[CONTACTS], after: &["F-7"];
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
