//! Broken contact.

use interface::wire::ImpForce;

use super::spoil::{law, moving, scale, shared, stiffness};
use crate::mutant::{Flaw, Mutant};

/// In the order of the clauses.
pub const MUTANTS: &[Mutant] = &[
    Mutant::new("F-7a", "sends the force on the body, at the start", || {
        // Later on points would be drawn through bodies, which ends the run.
        Flaw::forces(|header, forces| {
            if header.step == 0 {
                scale(forces, -1.0);
            }
        })
    }),
    Mutant::new("F-7b", "is never stiffer than 100 kN/m", || {
        law(|k, _, _, _| *k = k.min(1e5))
    }),
    Mutant::new("F-7c", "forgets the second of two bodies", || {
        Flaw::forces(|_, forces| {
            for force in forces.iter_mut().filter(|f| f.stiffness == 1.2e5) {
                force.force[1] = 0.0;
            }
        })
    }),
    Mutant::new("F-7e", "has no normal on the outline", || {
        Flaw::forces(|_, forces| {
            for force in forces
                .iter_mut()
                .filter(|f| (f.force[1] - 1800.0).abs() < 1e-6)
            {
                force.force = [0.0; 2];
            }
        })
    }),
    Mutant::new("F-8a", "pushes before it touches", || {
        Flaw::forces(|_, forces| {
            for force in forces
                .iter_mut()
                .filter(|f| f.force == [0.0; 2] && f.stiffness > 0.0)
            {
                force.force = [0.0, 1e-30];
            }
        })
    }),
    Mutant::new("F-8b", "adds to the forces of points that stay", || {
        let (count, stayed) = shared(0);
        let mut last = Vec::new();
        let mut flaw = Flaw::states(move |_, states| {
            let stays = !states.is_empty() && *states == last;
            count.set(if stays { count.get() + 1 } else { 0 });
            last.clone_from(states);
        });
        flaw.outbound = Flaw::forces(move |_, forces| {
            if stayed.get() >= 2 {
                scale(forces, 1.0 + 1e-9);
            }
        })
        .outbound;
        flaw
    }),
    Mutant::new("F-7d", "answers with the forces of the step before", || {
        let mut last: Vec<ImpForce> = Vec::new();
        Flaw::forces(move |_, forces| {
            let now = forces.clone();
            if last.len() == forces.len() {
                forces.clone_from(&last);
            }
            last = now;
        })
    }),
    Mutant::new("F-7f", "loses digits far from the origin", || {
        let (far, lost) = shared(false);
        let mut flaw = Flaw::states(move |_, states| {
            far.set(states.iter().any(|s| s.position[0].abs() > 100.0));
        });
        flaw.outbound = Flaw::forces(move |_, forces| {
            if lost.get() {
                scale(forces, 1.001);
            }
        })
        .outbound;
        flaw
    }),
    Mutant::new("F-7g", "does not turn bodies", || {
        Flaw::bodies_config(|config| {
            // But for those whose envelopes are looked at.
            if config.bodies.len() > 2 {
                config.bodies.iter_mut().for_each(|body| body.angle = 0.0);
            }
        })
    }),
    Mutant::new(
        "F-5a",
        "gives no stiffness to a point that is pushed",
        || stiffness(|force| force.force != [0.0; 2]),
    ),
    Mutant::new(
        "F-6a",
        "gives no stiffness to a point that is not yet pushed",
        || stiffness(|force| force.force == [0.0; 2]),
    ),
    Mutant::new(
        "I-9a",
        "has the slots of a later set the other way round",
        || {
            Flaw::forces(|header, forces| {
                if header.set > 1 {
                    forces.reverse();
                }
            })
        },
    ),
    Mutant::new("F-9a", "says half its travel", || {
        Flaw::forces(|header, _| header.travel *= 0.5)
    }),
    Mutant::new("F-7k", "rubs twice as hard", || {
        law(|_, _, mu, _| *mu *= 2.0)
    }),
    Mutant::new("F-7l", "has a stiffer tangential spring", || {
        law(|_, k_t, _, _| *k_t *= 1.1)
    }),
    Mutant::new("F-7m", "rubs although mu is 0", || {
        law(|_, k_t, mu, _| {
            if *k_t > 0.0 && *mu == 0.0 {
                *mu = 0.1;
            }
        })
    }),
    Mutant::new(
        "F-7n",
        "remembers the spring of a contact that has opened",
        || {
            let mut memory: Vec<(f64, bool)> = Vec::new();
            Flaw::forces(move |_, forces| {
                memory.resize(forces.len(), (0.0, false));
                for (force, (friction, opened)) in forces.iter_mut().zip(&mut memory) {
                    if force.force == [0.0; 2] {
                        *opened = true;
                    } else if *opened {
                        force.force[0] += *friction;
                    } else {
                        *friction = force.force[0];
                    }
                }
            })
        },
    ),
    Mutant::new("I-10a", "forgets all springs at a new set", || {
        Flaw::forces(|header, forces| {
            if header.set > 1 {
                forces.iter_mut().for_each(|force| force.force[0] = 0.0);
            }
        })
    }),
    Mutant::new("F-7o", "damps half as much", || {
        law(|_, _, _, zeta| *zeta *= 0.5)
    }),
    Mutant::new("F-7p", "pulls points that leave fast", || {
        let (speed, fast) = shared(0.0);
        let mut flaw = Flaw::states(move |_, states| {
            speed.set(states.iter().map(|s| s.velocity[1]).fold(0.0, f64::max));
        });
        flaw.outbound = Flaw::forces(move |_, forces| {
            if fast.get() > 5.0 {
                forces.iter_mut().for_each(|force| force.force[1] -= 1.0);
            }
        })
        .outbound;
        flaw
    }),
    Mutant::new(
        "F-7i",
        "pushes moving points harder than it is pushed",
        || {
            moving(
                |v| v > 0.5,
                |force| force.force = force.force.map(|f| 1.001 * f),
            )
        },
    ),
    Mutant::new("F-7j", "does not turn", || {
        Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.spin *= 0.99))
    }),
    Mutant::new("F-7h", "drags at points that are fast", || {
        moving(|v| v > 30.0, |force| force.force[0] -= 1.0)
    }),
    Mutant::new("T-1d", "damps a little where it should not", || {
        law(|_, k_t, mu, zeta| {
            if *zeta == 0.0 && *mu == 0.0 && *k_t == 0.0 {
                *zeta = 0.002;
            }
        })
    }),
];
