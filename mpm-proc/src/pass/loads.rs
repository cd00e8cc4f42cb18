//! Puts the loads on points onto the nodes, and their impulse and work into the ledger.
//!
//! Their impulse is counted as applied. Their work is the trapezoidal rule, as the leapfrog pairs it: the force of `t_n` acts over
//! half of the interval behind and half of the one ahead. It is counted as work of driven boundaries.

use interface::config::StressUpdate;
use interface::solver::Fault;
use interface::step::Step;

use crate::kernel::lanes::{LANES, Lanes, ZERO, splat, sum};
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerBlock, PerTile, over_tiles};
use crate::kernel::tiles::pitch;
use crate::kernel::transfer::AffineState;
use crate::kernel::window::{NO_VECTORS, fill_window, gather_row, scatter_row};
use crate::state::continuum::Continuum;
use crate::state::loads::{LastLoad, LoadReport, Loads};
use crate::state::nodes::NodeTile;
use crate::state::points::{Cloud, NO_POINT};
use mechanics::threads::Threads;

/// Adds loads to the nodes, and counts their impulse and work.
///
/// # Errors
/// [`Fault::NotFinite`] with the point at which a formula gives no number.
pub fn apply_loads<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    step: &Step,
) -> Result<(), Fault> {
    if continuum.clouds.iter().all(|c| c.loads.is_none()) {
        return Ok(());
    }
    let threads = &continuum.threads;
    let (clouds, geometry) = (&mut continuum.clouds, &continuum.grid.geometry);
    let size = [0, 1].map(|a| geometry.upper[a] - geometry.lower[a]);
    // USL computes strains from the velocities with which points move.
    let by_field = (continuum.stress_update != StressUpdate::Usl).then_some(step.dt_before);
    let nodes = &continuum.grid.tiles;
    Cloud::each(threads, clouds, |threads, cloud| {
        apply(threads, cloud, (size, nodes), step.time, by_field);
    });
    for cloud in &continuum.clouds {
        let Some(loads) = &cloud.loads else {
            continue;
        };
        let mut force = [0.0; 3];
        for report in &loads.reports {
            for (sum, of) in force.iter_mut().zip(report.force) {
                *sum += of;
            }
            continuum.state.totals.driven_work += report.work;
        }
        if !(force[0] + force[1]).is_finite() {
            return Err(fault(loads, &cloud.state.ids, cloud.first_id));
        }
        continuum.state.totals.applied_impulse += force.map(|f| step.kick() * f);
    }
    Ok(())
}

/// Adds the loads of `time` (s) to the forces on a cloud's nodes, in a domain of size `size` (m).
///
/// With `by_field`, the length of the interval behind in s, the work of a dead load is that on the velocity of the nodes, with which
/// the strain of the interval is computed and on which the load has acted. Points move otherwise, by what is smoothed or averaged
/// away after each kick: a share of PIC in every step makes work of that, at any step (docs/energy.md). A body force is that of the
/// points' masses, and its work is on their way, as that of gravity is.
fn apply<const W: usize, S: Shape<W>, A: AffineState>(
    threads: &Threads,
    cloud: &mut Cloud<W, S, A>,
    (size, nodes): ([f64; 2], &[NodeTile]),
    time: f64,
    by_field: Option<f64>,
) {
    let Some(loads) = &mut cloud.loads else {
        return;
    };
    let (shape, x, mass) = (cloud.shape, &cloud.state.x, splat(cloud.mass));
    if let Some(formula) = &mut loads.body_force {
        formula.set_time(time);
    }
    let body_force = loads.body_force.as_ref();
    let dead = &loads.dead;
    let share = (
        PerBlock(&mut loads.last[..]),
        PerTile(&mut cloud.force[..]),
        PerTile(&mut loads.reports[..]),
    );
    over_tiles(
        threads,
        &cloud.tiles,
        share,
        || NO_VECTORS,
        &|tile, (lasts, force, report), velocity| {
            let force = &mut force.0[0];
            let held = &dead[tile.first..][..tile.blocks];
            let by_field = by_field.filter(|_| held.iter().any(|dead| *dead != [ZERO; 2]));
            if by_field.is_some() {
                fill_window::<W, _>(velocity, nodes, tile, |t| &t.before);
            }
            let (mut total, mut work) = ([ZERO; 3], ZERO);
            for (b, last) in lasts.0.iter_mut().enumerate() {
                let block = tile.first + b;
                let (x, live, dead) = (&x[block], tile.live(b), &held[b]);
                let acceleration = body_force.map_or([ZERO; 2], |formula| formula.at(block));
                let place = tile.frame.locate(x, pitch(W));
                let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
                let of_field = by_field.map(|dt| {
                    let mut v = [ZERO; 2];
                    for j in 0..W {
                        let row = gather_row::<W>(velocity, &place, j);
                        for (i, at_node) in row.iter().enumerate() {
                            let weight = s[0][i] * s[1][j];
                            v = [0, 1].map(|a| weight.mul_add(at_node[a], v[a]));
                        }
                    }
                    v.map(|v| v * splat(dt))
                });
                let mut f = [ZERO; 2];
                for a in 0..2 {
                    f[a] = live * (dead[a] + mass * acceleration[a]);
                    let mean = splat(0.5) * (last.force[a] + f[a]);
                    // A periodic wall may have moved the point by the size of the domain, which is no displacement.
                    let way = x[a] - last.x[a];
                    let way = way - splat(size[a]) * (way * splat(1.0 / size[a])).round();
                    // A dead load is its own mean; the rest is of the body force.
                    let of_dead = dead[a] * of_field.map_or(way, |way| way[a]);
                    work += live * (of_dead + (mean - dead[a]) * way);
                    total[a] += f[a];
                }
                total[2] += x[0] * f[1] - x[1] * f[0];
                *last = LastLoad { x: *x, force: f };
                for j in 0..W {
                    let row: [[Lanes; 2]; W] = core::array::from_fn(|i| {
                        let weight = s[0][i] * s[1][j];
                        [weight * f[0], weight * f[1]]
                    });
                    scatter_row(force, &place, j, &row);
                }
            }
            report.0[0] = LoadReport {
                force: total.map(sum),
                work: sum(work),
            };
        },
    );
}

/// Names a point whose load is not finite.
fn fault(loads: &Loads, ids: &[[u32; LANES]], first_id: u64) -> Fault {
    let unsound = |(block, load): (usize, &LastLoad)| {
        (0..LANES).find_map(|k| {
            let id = ids[block][k];
            let sound = load.force.iter().all(|f| f.as_array()[k].is_finite());
            (id != NO_POINT && !sound).then_some(first_id + u64::from(id))
        })
    };
    let item = match loads.last.iter().enumerate().find_map(unsound) {
        Some(id) => format!("point {id}"),
        None => "all points together".into(),
    };
    Fault::NotFinite {
        what: "body force".into(),
        item,
    }
}
