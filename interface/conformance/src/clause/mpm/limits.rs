//! Section 8: limits that hold.

use interface::config::{GroupConfig, InitialFields};

use super::scene::{block, scene};
use crate::bench::Bench;
use crate::clause::{Clause, clauses};
use crate::verdict::{Judgement, Unmet, require};

pub const CLAUSES: &[Clause] = clauses! {
    Must "L-2c" "omega_sq bounds the solver's own frequencies" by stable, needs: &["feature:fields"];
    Should "L-2h" "the step limit by its own stiffness is at most ten times too small" by not_too_careful,
        needs: &["feature:fields"], after: &["L-2c"];
};

/// Kinetic energy of a block that rings, with steps of `share` of its own limit: the largest seen, over that of the
/// start.
fn growth(bench: &Bench, share: f64) -> Result<f64, Unmet> {
    // A wave as short as the grid can hold, with displacements of a hundredth of a cell.
    let field = |text: &str| text.to_string();
    let ringing = GroupConfig {
        fields: InitialFields {
            velocity: Some([field("0.1*cos(40*x)*cos(25*y)"), field("0.1*cos(30*y)")]),
            stress: None,
        },
        ..block([0.4; 2], [0.0; 2])
    };
    let mut flow = bench.run_continuum(&scene(vec![ringing]))?;
    let (_, reported) = flow.free_step(0.0)?;
    let start = reported.report.ledger.kinetic;
    let mut omega_sq = reported.report.limits.omega_sq;
    let mut largest: f64 = 0.0;
    for _ in 0..12 {
        let dt = share * 2.0 / omega_sq.sqrt();
        flow.coast(dt, 32)?;
        let (_, reported) = flow.free_step(dt)?;
        omega_sq = reported.report.limits.omega_sq;
        largest = largest.max(reported.report.ledger.kinetic / start);
    }
    Ok(largest)
}

fn stable(bench: &Bench) -> Judgement {
    let growth = growth(bench, 0.95)?;
    let expected = "kinetic energy below twice that of the start";
    require(growth < 2.0, expected, format_args!("{growth:.3e} times"))?;
    Ok(format!("kinetic energy up to {growth:.2} of the start"))
}

fn not_too_careful(bench: &Bench) -> Judgement {
    // Beyond what is stable the solver may fail, which shows it as well.
    let growth = growth(bench, 9.5).unwrap_or(f64::INFINITY);
    let got = format_args!("kinetic energy {growth:.2} of the start");
    require(growth > 2.0, "no stability with ten times the step", got)?;
    Ok("unstable with ten times the step".into())
}
