//! Broken time, and broken bodies.

use std::time::{SystemTime, UNIX_EPOCH};

use interface::config::{BodyInertia, ContactLaw, Motion};

use super::spoil::{motion, next_up, shared};
use crate::mutant::{Flaw, Mutant};

/// In the order of the clauses.
pub const MUTANTS: &[Mutant] = &[
    Mutant::new("T-1a", "takes half the granted step", || {
        Flaw::grants(|_, grants| {
            for grant in grants {
                grant.dt *= 0.5;
                grant.dt_before_epoch *= 0.5;
            }
        })
    }),
    Mutant::new("T-2a", "begins with a whole kick", || {
        Flaw::grants(|_, grants| {
            for grant in grants.iter_mut().filter(|g| g.first == 0) {
                grant.dt_before_epoch = grant.dt;
            }
        })
    }),
    Mutant::new("T-1b", "begins every window with half a kick", || {
        Flaw::grants(|_, grants| {
            for grant in grants.iter_mut().filter(|g| g.steps_in_epoch > 0) {
                grant.epoch_start += grant.dt * grant.steps_in_epoch as f64;
                grant.steps_in_epoch = 0;
                grant.dt_before_epoch = 0.0;
            }
        })
    }),
    Mutant::new(
        "T-1c",
        "stays with the first step that it was granted",
        || {
            let mut first = 0.0;
            Flaw::grants(move |_, grants| {
                for grant in grants.iter_mut().filter(|g| g.dt > 0.0) {
                    first = if first > 0.0 { first } else { grant.dt };
                    grant.dt = first;
                }
            })
        },
    ),
    Mutant::new("T-4a", "closes without a kick", || {
        Flaw::grants(|_, grants| {
            for grant in grants.iter_mut().filter(|g| g.dt == 0.0) {
                grant.dt_before_epoch = 0.0;
            }
        })
    }),
    Mutant::new("T-5a", "measures velocities of half a step later", || {
        let (dt, kick) = shared(0.0);
        let mut flaw = Flaw::grants(move |_, grants| {
            grants
                .iter()
                .for_each(|g| dt.set(if g.first > 0 { g.dt } else { 0.0 }));
        });
        flaw.outbound = Flaw::bodies(move |_, bodies| {
            for body in bodies {
                body.velocity[1] -= 9.81 * kick.get() / 2.0;
            }
        })
        .outbound;
        flaw
    }),
    Mutant::new("T-6a", "rounds by the time of day", || {
        Flaw::forces(|_, forces| {
            let now = SystemTime::now().duration_since(UNIX_EPOCH);
            if now.is_ok_and(|now| now.subsec_micros() % 2 == 1) {
                next_up(forces);
            }
        })
    }),
    Mutant::new("T-6b", "rounds by the window", || {
        let (window, steps) = shared(0);
        let mut flaw = Flaw::grants(move |_, grants| {
            grants.iter().for_each(|g| window.set(g.steps));
        });
        flaw.outbound = Flaw::forces(move |_, forces| {
            if steps.get() > 1 {
                next_up(forces);
            }
        })
        .outbound;
        flaw
    }),
    Mutant::new("E-1a", "sends outlines of the next step", || {
        Flaw::envelopes(|header, _| header.step += 1)
    }),
    Mutant::new("E-4a", "sends bodies in another order", || {
        Flaw::envelopes(|_, vertices| vertices.reverse())
    }),
    Mutant::new("E-4b", "sends outlines without the sphero-radius", || {
        Flaw::envelopes(|_, vertices| vertices.iter_mut().for_each(|v| v.reach *= 0.5))
    }),
    Mutant::new("J-1b", "lets fixed bodies fall", || {
        motion(|motion| matches!(motion, Motion::Fixed).then_some(Motion::Free))
    }),
    Mutant::new("J-1c", "lets driven bodies fall", || {
        motion(|motion| matches!(motion, Motion::Driven).then_some(Motion::Free))
    }),
    Mutant::new("J-1d", "lets guided bodies go", || {
        motion(|motion| matches!(motion, Motion::Guided { .. }).then_some(Motion::Free))
    }),
    Mutant::new("J-1e", "does not push", || {
        motion(|motion| matches!(motion, Motion::Pushed { .. }).then_some(Motion::Free))
    }),
    Mutant::new(
        "J-1f",
        "lets bodies pass through one another half as hard",
        || {
            Flaw::bodies_config(|config| {
                if let Some(ContactLaw::Linear {
                    normal_stiffness, ..
                }) = &mut config.body_contact
                {
                    *normal_stiffness *= 0.5;
                }
            })
        },
    ),
    Mutant::new("J-1g", "takes a density for a mass", || {
        Flaw::bodies_config(|config| {
            for body in &mut config.bodies {
                if let BodyInertia::Density(density) = body.inertia {
                    body.inertia = BodyInertia::Mass(density);
                }
            }
        })
    }),
    Mutant::new("T-3a", "moves in the opening step", || {
        Flaw::grants(|_, grants| {
            for grant in grants.iter_mut().filter(|g| g.first == 0 && g.dt == 0.0) {
                grant.dt = 1e-4;
            }
        })
    }),
];
