//! Broken motion: time, forces, limits and halts.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::atomic::Ordering;

use interface::control::Order;
use interface::stage::{Message, Payload};
use interface::wire::{StepHeader, flags};

use super::spoil::{
    RUNS, after_others, at_report, each_grant, forces, halts, measured, nudged, report, reported,
    states, states_of_grant, with,
};
use crate::mutant::{Flaw, Mutant};

/// In the order of the clauses.
pub const MUTANTS: &[Mutant] = &[
    Mutant::new("T-1a", "drifts", || {
        states(|header, states| {
            for state in states {
                state.position[0] += 1e-11 * header.step as f64;
            }
        })
    }),
    Mutant::new("T-2a", "kicks by a whole step at first", || {
        each_grant(|grant| {
            if grant.dt_before_epoch == 0.0 {
                grant.dt_before_epoch = grant.dt;
            }
        })
    }),
    Mutant::new("T-1b", "slows down", || {
        states(|header, states| {
            for state in states.iter_mut().filter(|_| header.step > 2) {
                state.velocity[1] *= 1.0 - 1e-9;
            }
        })
    }),
    Mutant::new("T-1c", "takes all steps for equal", || {
        each_grant(|grant| {
            if grant.dt_before_epoch > 0.0 && grant.dt > 0.0 {
                grant.dt_before_epoch = grant.dt;
            }
        })
    }),
    Mutant::new("T-3a", "drifts in the opening step", || {
        each_grant(|grant| {
            if grant.first == 0 && grant.dt == 0.0 {
                grant.dt = 1e-9;
            }
        })
    }),
    Mutant::new("T-4a", "leaves out the last half kick", || {
        each_grant(|grant| {
            if grant.dt == 0.0 {
                grant.dt_before_epoch = 0.0;
            }
        })
    }),
    Mutant::new("T-5a", "measures some energy too much", || {
        measured(|report| {
            if report.next > 2 {
                report.ledger.kinetic *= 1.0 + 1e-9;
            }
        })
    }),
    Mutant::new("T-6b", "is another one every time", || {
        let run = RUNS.fetch_add(1, Ordering::Relaxed);
        let ulps = 1 + run.wrapping_add(std::process::id()) % 31;
        states_of_grant(move |_, state| nudged(state, ulps))
    }),
    Mutant::new("T-6a", "is another one in windows of one step", || {
        states_of_grant(|grant, state| nudged(state, u32::from(grant.steps == 1)))
    }),
    Mutant::new("T-1d", "feels more at the right and below", || {
        let centre = Rc::new(Cell::new([0.0; 2]));
        let seen = Rc::clone(&centre);
        with(
            forces(move |_, forces| {
                let [x, y] = centre.get();
                for force in forces.iter_mut().filter(|_| x > 0.55 && y < 0.5) {
                    force.force = force.force.map(|f| 1.001 * f);
                }
            }),
            states(move |_, states| {
                let n = states.len().max(1) as f64;
                let sum = |i: usize| states.iter().map(|s| s.position[i]).sum::<f64>();
                seen.set([sum(0) / n, sum(1) / n]);
            }),
        )
    }),
    Mutant::new("F-1a", "feels forces a step late", || {
        after_others(|before, now| now.copy_from_slice(before))
    }),
    Mutant::new("F-1b", "keeps a tenth of a force for the next step", || {
        after_others(|before, now| {
            for (now, before) in now.iter_mut().zip(before) {
                if before.force != [0.0; 2] {
                    now.force = [0, 1].map(|i| now.force[i] + 0.1 * before.force[i]);
                    now.stiffness = now.stiffness.max(before.stiffness);
                }
            }
        })
    }),
    Mutant::new("F-1d", "feels the later points more", || {
        forces(|_, forces| {
            for force in forces.iter_mut().skip(32) {
                force.force = force.force.map(|f| f * (1.0 + 1e-6));
            }
        })
    }),
    Mutant::new("F-1e", "exchanges the forces on two points", || {
        forces(|_, forces| {
            if forces.len() == 2 {
                forces.swap(0, 1);
            }
        })
    }),
    Mutant::new("L-2a", "halves what contact adds", || {
        report(|report| report.limits.contact_omega_sq *= 0.5)
    }),
    Mutant::new("L-2b", "does not forget contact", || {
        let mut touched = false;
        report(move |report| {
            touched |= report.limits.contact_omega_sq > 0.0;
            if touched && report.limits.contact_omega_sq == 0.0 {
                report.limits.contact_omega_sq = 1e-3;
            }
        })
    }),
    Mutant::new("L-2c", "is five times too careful", || {
        report(|report| report.limits.contact_omega_sq *= 5.0)
    }),
    Mutant::new("L-2d", "says half of its speed", || {
        report(|report| report.limits.speed *= 0.5)
    }),
    Mutant::new("L-2e", "says twice its radius", || {
        report(|report| report.limits.radius_min *= 2.0)
    }),
    Mutant::new("L-2f", "says a hundredth of its stiffness", || {
        report(|report| report.limits.omega_sq *= 0.01)
    }),
    Mutant::new("L-2g", "says four hundred times its stiffness", || {
        report(|report| report.limits.omega_sq *= 400.0)
    }),
    Mutant::new("H-1a", "does not heed the budget of speed", || {
        each_grant(|grant| grant.budget_speed = f64::MAX)
    }),
    Mutant::new("H-1b", "halts in windows of one step", || {
        at_report(|window, message| {
            let report = reported(&message);
            let beyond = report.limits.speed > window.grant.budget_speed;
            halts(message, beyond && window.grant.steps == 1)
        })
    }),
    Mutant::new("H-1c", "does not feel stiff contacts", || {
        forces(|_, forces| {
            for force in forces.iter_mut().filter(|f| f.stiffness > 1e8) {
                force.stiffness = 1.0;
            }
        })
    }),
    Mutant::new("H-2a", "goes on after HALT_AFTER", || {
        forces(|header, _| header.flags = 0)
    }),
    Mutant::new("H-2b", "halts where the window ends anyway", || {
        at_report(|window, message| {
            let ends = reported(&message).next == window.grant.first + window.grant.steps;
            halts(message, window.bodies_halt && ends)
        })
    }),
    Mutant::new("H-3a", "says HALT_BEFORE after HALT_AFTER", || {
        at_report(|window, message| {
            let report = reported(&message);
            if !window.bodies_halt || report.limits.speed <= window.grant.budget_speed {
                return vec![message];
            }
            let header = StepHeader {
                epoch: report.epoch,
                step: report.next,
                flags: flags::HALT_BEFORE,
                ..StepHeader::default()
            };
            let halt = Message::new(header, Payload::States(Vec::new()));
            vec![halt, message]
        })
    }),
    Mutant::new("H-4a", "heeds no budget without bodies", || {
        let mut alone = false;
        Flaw::inbound(move |mut message| {
            if let Ok(Order::Configure(configure)) = message.as_order() {
                alone = !configure.coupled;
            }
            if let Payload::Grant(grants) = &mut message.payload
                && alone
            {
                for grant in grants {
                    grant.budget_omega_sq = f64::MAX;
                }
            }
            vec![message]
        })
    }),
    Mutant::new("H-5a", "is another one after a halt", || {
        let mut halted = false;
        Flaw::outbound(move |mut message| {
            halted |= reported(&message).halted == 1;
            if let Payload::States(states) = &mut message.payload {
                for state in states.iter_mut().filter(|_| halted) {
                    nudged(state, 1);
                }
            }
            vec![message]
        })
    }),
];
