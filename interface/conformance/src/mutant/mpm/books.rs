//! Broken reports and books.

use super::spoil::{groups, measured, report, reports};
use crate::mutant::Mutant;

/// In the order of the clauses.
pub const MUTANTS: &[Mutant] = &[
    Mutant::new(
        "R-1a",
        "leaves the epoch out of the report's header",
        || reports(|header, _| header.epoch = 0),
    ),
    Mutant::new("R-1b", "counts an IMP too many", || {
        report(|report| report.imps += 1)
    }),
    Mutant::new("R-3a", "says an energy that was not asked for", || {
        report(|report| {
            if report.measured == 0 {
                report.ledger.kinetic = 1e-3;
            }
        })
    }),
    Mutant::new("R-3b", "sends its groups backwards", || {
        groups(|_, groups| groups.reverse())
    }),
    Mutant::new("R-3c", "counts the boxes of points into the extent", || {
        groups(|_, groups| {
            for group in groups {
                group.lower = group.lower.map(|x| x - 0.0125);
            }
        })
    }),
    Mutant::new("R-3d", "counts points that are near for touched", || {
        groups(|_, groups| {
            for group in groups.iter_mut().filter(|g| g.contacts == 0) {
                group.contacts = 1;
            }
        })
    }),
    Mutant::new("N-1a", "books some gravity too much", || {
        measured(|report| report.ledger.applied_impulse[1] *= 1.0 + 1e-6)
    }),
    Mutant::new("N-1b", "books some contact too much", || {
        measured(|report| report.ledger.contact_impulse[0] *= 1.0 + 1e-6)
    }),
    Mutant::new("N-1c", "measures some elastic energy too much", || {
        measured(|report| report.ledger.elastic *= 1.01)
    }),
    Mutant::new("N-1d", "measures some potential energy too much", || {
        measured(|report| report.ledger.gravity *= 1.0 + 1e-6)
    }),
    Mutant::new("N-1e", "loses energy to nothing", || {
        measured(|report| report.ledger.plastic_work = 0.2 * report.ledger.kinetic)
    }),
];
