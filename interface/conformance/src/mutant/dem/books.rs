//! Broken limits, halts, reports and books.

use interface::wire::flags;

use super::spoil::{ledger, limits, shared};
use crate::mutant::{Flaw, Mutant};

/// In the order of the clauses.
pub const MUTANTS: &[Mutant] = &[
    Mutant::new("L-1a", "has a negative frequency", || {
        limits(|l| l.omega_sq = -1.0)
    }),
    Mutant::new("L-2a", "says half its contact frequency", || {
        limits(|l| l.contact_omega_sq *= 0.5)
    }),
    Mutant::new("L-2b", "says ten times its contact frequency", || {
        limits(|l| l.contact_omega_sq *= 10.0)
    }),
    Mutant::new(
        "L-2c",
        "forgets contact between bodies in its limits",
        || limits(|l| l.omega_sq = 0.0),
    ),
    Mutant::new("L-2d", "says half its speed", || limits(|l| l.speed *= 0.5)),
    Mutant::new("L-2e", "does not tell of damping", || {
        limits(|l| l.damping = 0.0)
    }),
    Mutant::new("H-2a", "never halts", || {
        Flaw::grants(|_, grants| {
            for grant in grants {
                grant.budget_omega_sq = f64::MAX;
                grant.budget_speed = f64::MAX;
                grant.budget_damping = f64::MAX;
            }
        })
    }),
    Mutant::new("L-5a", "halts on the last step too", || {
        let (budget, short) = shared(f64::MAX);
        let mut flaw = Flaw::grants(move |_, grants| {
            grants.iter().for_each(|g| budget.set(g.budget_speed));
        });
        flaw.outbound = Flaw::reports(move |_, reports| {
            if short.get() == 0.0 {
                reports.iter_mut().for_each(|report| report.halted = 1);
            }
        })
        .outbound;
        flaw
    }),
    Mutant::new("H-1a", "does not own to a halt of the other side", || {
        let (halted, hidden) = shared(false);
        let mut flaw =
            Flaw::states(move |header, _| halted.set(header.flags & flags::HALT_BEFORE != 0));
        flaw.outbound = Flaw::reports(move |_, reports| {
            if hidden.get() {
                reports.iter_mut().for_each(|report| report.halted = 0);
            }
        })
        .outbound;
        flaw
    }),
    Mutant::new("H-5a", "takes another step after a halt", || {
        let (halted, next) = shared(false);
        let mut flaw = Flaw::grants(move |_, grants| {
            for grant in grants.iter_mut().filter(|_| next.get()) {
                grant.dt *= 1.0 + 1e-6;
            }
        });
        flaw.outbound = Flaw::reports(move |_, reports| {
            reports
                .iter()
                .for_each(|report| halted.set(report.halted == 1));
        })
        .outbound;
        flaw
    }),
    Mutant::new("R-1a", "reports on another epoch", || {
        Flaw::reports(|_, reports| reports.iter_mut().for_each(|report| report.epoch += 1))
    }),
    Mutant::new("R-2a", "reports a NaN", || {
        limits(|l| l.mobility = f64::NAN)
    }),
    Mutant::new("R-3a", "measures the next step", || {
        Flaw::bodies(|header, _| header.step += 1)
    }),
    Mutant::new(
        "R-3b",
        "says that it has measured though nobody asked",
        || Flaw::reports(|_, reports| reports.iter_mut().for_each(|report| report.measured = 1)),
    ),
    Mutant::new("R-3c", "counts a contact too many", || {
        Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.contacts += 1))
    }),
    Mutant::new("R-3d", "turns torques round", || {
        Flaw::bodies(|_, bodies| bodies.iter_mut().for_each(|body| body.point_torque *= -1.0))
    }),
    Mutant::new("N-1a", "forgets a share of what gravity gives", || {
        ledger(|l| l.applied_impulse = l.applied_impulse.map(|p| 0.9 * p))
    }),
    Mutant::new("N-1b", "forgets the energy in springs", || {
        ledger(|l| l.contact = 0.0)
    }),
    Mutant::new("N-1c", "forgets half of what sliding dissipates", || {
        ledger(|l| l.friction_work *= 0.5)
    }),
    Mutant::new("N-1d", "forgets half of what dashpots dissipate", || {
        ledger(|l| l.viscous_work *= 0.5)
    }),
    Mutant::new("N-1e", "forgets half of what pushes put in", || {
        ledger(|l| l.driven_work *= 0.5)
    }),
    Mutant::new("N-1f", "books contact as felt by the points", || {
        ledger(|l| l.contact_force = l.contact_force.map(|f| -f))
    }),
];
