//! Grid layers of the groups' own, and IMPs of groups that touch.

use interface::config::MpmConfig;

use super::scene::{DT, RADIUS, SKIN, block, points, scene};
use crate::bench::Bench;
use crate::clause::Clause;
use crate::mutant::Flaw;
use crate::verdict::{Judgement, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "J-1h",
        "groups on separate layers exchange nothing through the grid",
        apart,
    )
    .needs(&["layers"])
    .after(&["I-9b", "T-1a"])
    .mutant("has one grid for all groups", || {
        Flaw::config(|config: &mut MpmConfig| {
            // Groups in contact need layers.
            if config.group_pairs.is_empty() {
                config.layers = false;
            }
        })
    }),
    Clause::must(
        "I-7b",
        "for two groups in contact, the set has all points within both radii and the skin of the other group",
        near_others,
    )
    .needs(&["layers", "pairs"])
    .after(&["I-6a", "I-9b"])
    .mutant("looks for points near bodies only", || {
        Flaw::config(|config: &mut MpmConfig| config.group_pairs.clear())
    }),
];

/// Two blocks lie next to one another and move past one another.
fn apart(bench: &Bench) -> Judgement {
    let speeds = [0.5, -0.3];
    let mut config = scene(vec![
        block([0.2, 0.4], [0.0, speeds[0]]),
        block([0.4, 0.4], [0.0, speeds[1]]),
    ]);
    config.layers = true;
    let mut flow = bench.run_continuum(&config)?;
    let steps = 10;
    flow.grant(DT, steps, false)?;
    let mut last = Vec::new();
    for _ in 0..steps {
        last = flow.exchange()?.states;
    }
    for (info, state) in flow.imps().iter().zip(&last) {
        let want = speeds[info.group as usize];
        near("speed in m/s", state.velocity[1], want, 1e-9)?;
    }
    Ok(format!("{} points keep their speed", last.len()))
}

/// Points at distances around the one within which they are to be in the set.
fn near_others(bench: &Bench) -> Judgement {
    let reach = 2.0 * RADIUS + SKIN;
    let column = |x: f64, y: &[f64]| y.iter().map(|&y| [x, y]).collect::<Vec<_>>();
    let rows = [0.2, 0.4, 0.6, 0.8];
    let mut config = scene(vec![
        points(&column(0.4, &rows)),
        // Its lowest point is too far away, the next one is near the first group's, and so on.
        points(&[
            [0.4 + 1.001 * reach, rows[0]],
            [0.4 + 0.999 * reach, rows[1]],
            [0.4 + 0.6 * reach, rows[2] + 0.6 * reach],
            [0.4 + 0.8 * reach, rows[3] + 0.8 * reach],
        ]),
        // Near the first group, but without contact between them.
        points(&[[0.4 - 0.5 * reach, rows[0]]]),
    ]);
    config.layers = true;
    config.group_pairs = vec![[0, 1]];
    let mut flow = bench.run_continuum(&config)?;
    flow.outlines = Vec::new();
    flow.grant(DT, 1, false)?;
    let shown = flow.exchange()?;
    let mut found = Vec::new();
    for (info, state) in flow.imps().iter().zip(&shown.states) {
        let row = rows
            .iter()
            .position(|y| (y - state.position[1]).abs() < 0.9 * reach);
        found.push((info.group, row));
    }
    let want = [(0, Some(1)), (0, Some(2)), (1, Some(1)), (1, Some(2))];
    require(
        found == want,
        format_args!("points (group, row) {want:?}"),
        format_args!("{found:?}"),
    )?;
    Ok("4 of 9 points".into())
}
