//! Section 9: all points at the end, and in frames.

use super::ledger::{frame, stressed};
use super::scene::{DT, IN_BLOCK, block, scene};
use crate::bench::Bench;
use crate::clause::Clause;
use crate::mutant::Flaw;
use crate::verdict::{Judgement, Largest, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "D-1a",
        "all points at the end, in order of their ids",
        points,
    )
    .after(&["T-1a"])
    .mutant("sends its points in reverse order", || {
        Flaw::points(|_, points| points.reverse())
    }),
    Clause::must(
        "D-1b",
        "the final points are numbered and of the next step",
        header,
    )
    .mutant("leaves the step out of the final header", || {
        Flaw::points(|header, _| header.step = 0)
    }),
    Clause::must(
        "R-5a",
        "with FRAME all points, as they are before the window, before the report",
        frame,
    )
    .after(&[
        "I-2g", "I-2h", "I-9b", "T-6a", "T-1a", "R-3a", "D-1a", "D-1b",
    ])
    .mutant("reports all points as of the first group", || {
        Flaw::points(|_, points| points.iter_mut().for_each(|p| p.group = 0))
    }),
    Clause::must("R-5b", "stress and volume of a point are right", stressed)
        .needs(&["feature:fields"])
        .after(&["R-5a"])
        .mutant("reverses shear stress", || {
            Flaw::points(|_, points| points.iter_mut().for_each(|p| p.stress[3] *= -1.0))
        }),
];

fn points(bench: &Bench) -> Judgement {
    let velocity = [0.6, -0.3];
    let config = scene(vec![
        block([0.2, 0.6], velocity),
        block([0.6, 0.2], velocity),
    ]);
    let mut flow = bench.run_continuum(&config)?;
    let (first, _) = flow.free_step(DT)?;
    flow.coast(DT, 20)?;
    let t = 21.0 * DT;
    flow.free_step(0.0)?;
    let (_, points) = flow.drain()?;
    require(
        points.len() as u64 == 2 * IN_BLOCK,
        "128 points",
        points.len(),
    )?;
    let mut largest = Largest::default();
    for ((point, info), state) in points.iter().zip(flow.imps()).zip(&first.states) {
        require(
            point.id == info.id,
            format_args!("point {}", info.id),
            point.id,
        )?;
        for i in 0..2 {
            let x = state.position[i] + t * velocity[i];
            largest.near("position", point.position[i], x, 1e-12, 1.0)?;
            largest.near("velocity", point.velocity[i], velocity[i], 1e-12, 1.0)?;
        }
    }
    Ok(format!("128 points within {largest} m or m/s"))
}

fn header(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&scene(vec![block([0.4; 2], [0.0; 2])]))?;
    flow.coast(DT, 3)?;
    let (header, _) = flow.drain()?;
    let said = (header.step, header.count);
    require(
        said == (3, IN_BLOCK),
        format_args!("{IN_BLOCK} points of step 3"),
        format_args!("{} of step {}", said.1, said.0),
    )?;
    Ok("64 points of step 3".into())
}
