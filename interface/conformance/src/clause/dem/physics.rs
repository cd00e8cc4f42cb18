//! Sections 5 to 9: what the bodies do and say, judged by random cases beside the oracle ([`crate::random`]).

use interface::config::capability::CONTACTS;
use interface::config::{BodyInertia, ContactLaw, Motion};
use interface::message::wire::ImpInfo;

use crate::clause::Clause;
use crate::mutant::{Flaw, change};

pub const CLAUSES: &[Clause] = &[
    Clause::random("J-1", "mass and inertia follow from the configuration")
        .mutant("uses the density as the mass", || {
            Flaw::bodies_config(|config| {
                for body in &mut config.bodies {
                    if let BodyInertia::Density(density) = body.inertia {
                        body.inertia = BodyInertia::Mass(density);
                    }
                }
            })
        })
        .mutant("has half the moment of inertia", || {
            Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.inertia *= 0.5))
        }),
    Clause::random(
        "T-1",
        "bodies move by the leapfrog, as their motion and what touches them say",
    )
    .mutant("takes half the granted step", || {
        change::each_grant(|grant| {
            grant.dt *= 0.5;
            grant.dt_before_epoch *= 0.5;
        })
    })
    .mutant("begins with a whole kick", || {
        change::each_grant(|grant| {
            if grant.first == 0 {
                grant.dt_before_epoch = grant.dt;
            }
        })
    })
    .mutant("begins every window with half a kick", || {
        change::each_grant(|grant| {
            if grant.steps_in_epoch > 0 {
                grant.epoch_start += grant.dt * grant.steps_in_epoch as f64;
                grant.steps_in_epoch = 0;
                grant.dt_before_epoch = 0.0;
            }
        })
    })
    .mutant("keeps the first step length", || {
        let mut first = 0.0;
        change::each_grant(move |grant| {
            if grant.dt > 0.0 {
                first = if first > 0.0 { first } else { grant.dt };
                grant.dt = first;
            }
        })
    })
    .mutant("kicks by the step before", || {
        change::each_grant(|grant| {
            if grant.dt > 0.0 && grant.dt_before_epoch > 0.0 && grant.steps_in_epoch == 0 {
                let twice = 2.0 * grant.dt_before_epoch - grant.dt;
                grant.dt_before_epoch = twice.max(0.0);
            }
        })
    })
    .mutant("closes without a kick", || {
        change::each_grant(|grant| {
            if grant.dt == 0.0 {
                grant.dt_before_epoch = 0.0;
            }
        })
    })
    .mutant("moves in the opening step", || {
        change::each_grant(|grant| {
            if grant.first == 0 && grant.dt == 0.0 {
                grant.dt = 1e-4;
            }
        })
    })
    .mutant("lets fixed bodies fall", || {
        change::motion(|motion| matches!(motion, Motion::Fixed).then_some(Motion::Free))
    })
    .mutant("lets driven bodies fall", || {
        change::motion(|motion| matches!(motion, Motion::Driven).then_some(Motion::Free))
    })
    .mutant("lets guided bodies move freely", || {
        change::motion(|motion| matches!(motion, Motion::Guided { .. }).then_some(Motion::Free))
    })
    .mutant("ignores the external force", || {
        change::motion(|motion| matches!(motion, Motion::Pushed { .. }).then_some(Motion::Free))
    })
    .mutant("does not turn bodies", || {
        Flaw::bodies_config(|config| config.bodies.iter_mut().for_each(|body| body.angle = 0.0))
    })
    .mutant("turns too slowly", || {
        Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.spin *= 0.99))
    }),
    Clause::random("F-8", "without overlap the force is exactly 0").mutant(
        "pushes before contact",
        || {
            Flaw::forces(|_, forces| {
                for force in forces
                    .iter_mut()
                    .filter(|f| f.force == [0.0; 2] && f.stiffness > 0.0)
                {
                    force.force = [0.0, 1e-30];
                }
            })
        },
    ),
    Clause::random(
        "F-7",
        "the force on a point is that of the law, for the positions of this step",
    )
    .mutant("sends the force on the body", || {
        Flaw::forces(|_, forces| change::scale(forces, -1.0))
    })
    .mutant("limits the stiffness", || {
        change::law(|k, _, _, _| *k = k.min(1e5))
    })
    .mutant("doubles friction", || change::law(|_, _, mu, _| *mu *= 2.0))
    .mutant("has friction although mu is 0", || {
        change::law(|k, k_t, mu, _| {
            if *mu == 0.0 {
                (*k_t, *mu) = (0.5 * *k, 0.1);
            }
        })
    })
    .mutant("has a stiffer tangential spring", || {
        change::law(|_, k_t, _, _| *k_t *= 1.1)
    })
    .mutant("damps half as much", || {
        change::law(|_, _, _, zeta| *zeta *= 0.5)
    })
    .mutant("has no adhesion", || {
        Flaw::bodies_config(|config| {
            if let ContactLaw::Granular { adhesion, .. } = &mut config.point_contact {
                *adhesion = 0.0;
            }
        })
    })
    .mutant("has the area of a larger circle", || {
        Flaw::bodies_config(|config| {
            if let ContactLaw::Area { area_stiffness, .. } = &mut config.point_contact {
                *area_stiffness *= 1.05;
            }
        })
    })
    .mutant("ignores the laws between surfaces", || {
        Flaw::bodies_config(|config| config.contact_pairs.clear())
    })
    .mutant("halves the force between two points", || {
        Flaw::bodies_config(|config| {
            for pair in &mut config.group_pairs {
                if let ContactLaw::Linear {
                    normal_stiffness, ..
                } = &mut pair.law
                {
                    *normal_stiffness *= 0.5;
                }
            }
        })
    })
    .mutant("answers with the forces of the last step", || {
        let mut last = Vec::new();
        Flaw::forces(move |_, forces| {
            let now = forces.clone();
            if last.len() == forces.len() {
                forces.clone_from(&last);
            }
            last = now;
        })
    })
    .mutant("adds a thousandth of the last force", || {
        change::after_others(|before, forces| {
            for (force, before) in forces.iter_mut().zip(before) {
                force.force = [0, 1].map(|i| force.force[i] + 1e-3 * before.force[i]);
            }
        })
    })
    .mutant("loses digits far from the origin", || {
        change::answers(|states, forces| {
            if states.iter().any(|s| s.position[0].abs() > 100.0) {
                change::scale(forces, 1.001);
            }
        })
    })
    .mutant("halves the forces where there are many points", || {
        Flaw::forces(|_, forces| {
            if forces.len() > 64 {
                change::scale(forces, 0.5);
            }
        })
    })
    .mutant("reverses the slots of a later set", || {
        Flaw::forces(|header, forces| {
            if header.set > 1 {
                forces.reverse();
            }
        })
    })
    .mutant("keeps radii by slot", || {
        let mut first: Vec<f64> = Vec::new();
        change::sets(move |set| {
            for (slot, info) in set.iter_mut().enumerate() {
                match first.get(slot) {
                    Some(radius) => info.radius = *radius,
                    None => first.push(info.radius),
                }
            }
        })
    })
    .mutant("forgets all springs at a new set", || {
        without_contacts().with(Flaw::set(|header, set| {
            set.iter_mut().for_each(|info| info.id += 1000 * header.set);
        }))
    })
    .mutant("keeps springs by slot", || {
        without_contacts().with(change::sets(|set| renumber(set)))
    }),
    Clause::random("F-5", "stiffness is above 0 where there is a force")
        .mutant("gives no stiffness to a point that is pushed", || {
            change::stiffness(|force| force.force != [0.0; 2])
        }),
    Clause::random("F-6", "stiffness is that of all contacts within reach")
        .mutant(
            "gives no stiffness to a point that is not yet pushed",
            || change::stiffness(|force| force.force == [0.0; 2]),
        )
        .mutant("counts half the stiffness", || {
            Flaw::forces(|_, forces| forces.iter_mut().for_each(|f| f.stiffness *= 0.5))
        }),
    Clause::random("F-9", "travel bounds the displacement of every surface")
        .needs(&["motion:free"])
        .mutant("reports half its travel", || {
            Flaw::forces(|header, _| header.travel *= 0.5)
        }),
    Clause::random("E-1", "answers a request with outlines of that step")
        .mutant("sends outlines of the next step", || {
            Flaw::envelopes(|header, _| header.step += 1)
        }),
    Clause::random("F-2", "forces carry step and epoch")
        .mutant("numbers forces by the next step", || {
            Flaw::forces(|header, _| header.step += 1)
        }),
    Clause::random("F-3", "forces carry generation and number of the set")
        .mutant("does not say which set forces belong to", || {
            Flaw::forces(|header, _| header.set = 0)
        }),
    Clause::random(
        "E-4",
        "envelopes hold the bodies, in their order, each with one reach",
    )
    .mutant("sends bodies in another order", || {
        Flaw::envelopes(|_, vertices| vertices.reverse())
    })
    .mutant("sends outlines without the sphero-radius", || {
        Flaw::envelopes(|_, vertices| vertices.iter_mut().for_each(|v| v.reach *= 0.5))
    }),
    Clause::random(
        "R-3",
        "forces, torques and contacts of each body are those of what touches it",
    )
    .mutant("counts one contact too many", || {
        Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.contacts += 1))
    })
    .mutant("reverses torques", || {
        Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.point_torque *= -1.0))
    })
    .mutant("leaves out the bodies' contact with one another", || {
        Flaw::bodies(|_, bodies| {
            bodies
                .iter_mut()
                .for_each(|body| body.body_force = [0.0; 2]);
        })
    }),
    Clause::random(
        "L-2",
        "limits bound frequencies, damping and speed of the next step",
    )
    .needs(&["motion:free"])
    .mutant("reports half its contact frequency", || {
        change::limits(|l| l.contact_omega_sq *= 0.5)
    })
    .mutant("forgets contact between bodies in its limits", || {
        change::limits(|l| l.omega_sq = 0.0)
    })
    .mutant("reports half its speed", || {
        change::limits(|l| l.speed *= 0.5)
    })
    .mutant("does not report damping", || {
        change::limits(|l| l.damping = 0.0)
    }),
    Clause::random("N-1", "every entry of the ledger is what section 9 says")
        .mutant("leaves out the energy in springs", || {
            change::ledger(|l| l.contact = 0.0)
        })
        .mutant("counts half of the energy dissipated by sliding", || {
            change::ledger(|l| l.friction_work *= 0.5)
        })
        .mutant("counts half of the energy dissipated by dashpots", || {
            change::ledger(|l| l.viscous_work *= 0.5)
        })
        .mutant("counts half of the work of external forces", || {
            change::ledger(|l| l.driven_work *= 0.5)
        })
        .mutant("counts the contact forces on the points", || {
            change::ledger(|l| l.contact_force = l.contact_force.map(|f| -f))
        })
        .mutant("counts the impulse of gravity twice", || {
            change::ledger(|l| l.applied_impulse = l.applied_impulse.map(|p| 2.0 * p))
        })
        .mutant("leaves out the rotation", || {
            change::ledger(|l| l.kinetic_rotation = 0.0)
        })
        .mutant("measures the kinetic energy half a step late", || {
            change::ledger(|l| l.kinetic *= 1.001)
        }),
    Clause::random(
        "R-6",
        "a frame has every contact, with its force and its place",
    )
    .needs(&[CONTACTS])
    .mutant("leaves out the last contact", || {
        Flaw::contacts(|header, contacts| {
            contacts.pop();
            header.count = contacts.len() as u64;
        })
    })
    .mutant("gives the force on the point", || {
        Flaw::contacts(|_, contacts| {
            contacts
                .iter_mut()
                .for_each(|contact| contact.force = contact.force.map(|f| -f));
        })
    })
    .mutant("gives the place of the first body", || {
        Flaw::contacts(|_, contacts| {
            contacts
                .iter_mut()
                .for_each(|contact| contact.position = [0.0; 2]);
        })
    })
    .mutant("reports two points as a body and a point", || {
        Flaw::contacts(|_, contacts| {
            for contact in contacts.iter_mut().filter(|contact| contact.with == 2) {
                contact.with = 1;
            }
        })
    }),
];

/// Ids by slot.
fn renumber(set: &mut [ImpInfo]) {
    (0..).zip(set).for_each(|(slot, info)| info.id = slot);
}

/// Says that it has no contacts in its frames, which name points by their ids.
fn without_contacts() -> Flaw {
    change::hello(|hello| hello.capabilities.0.retain(|name| name != CONTACTS))
}
