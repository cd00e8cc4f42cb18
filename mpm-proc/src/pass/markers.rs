//! The markers of a boundary in a step: their weights, the forces that they give to the nodes, and their motion (Singer
//! 2022 eqs. 14 and 24, with one weight for both; [`crate::state::markers`]).

use interface::config::StressUpdate;
use interface::message::wire::ImpForce;
use interface::solver::Fault;
use interface::text;

use super::drift::FieldOfMotion;
use crate::kernel::lanes::{LANES, Lanes, splat};
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::contact::{Loaded, TouchRow, turns};
use crate::state::continuum::Continuum;
use crate::state::grid::Grid;
use crate::state::markers::{LEAST_SPREAD, Markers, Weight};
use crate::state::nodes::NodeAt;

/// Finds the weights of all markers from the masses of the nodes.
///
/// # Errors
/// [`Fault::Other`] that names a marker near which no node has mass.
pub fn place_markers<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) -> Result<(), Fault> {
    let Some(markers) = &mut continuum.imps.markers else {
        return Ok(());
    };
    markers.weights.clear();
    markers.torque.fill(0.0);
    for marker in 0..markers.state.x.len() {
        let shape = continuum.clouds[markers.chain(marker).cloud as usize].shape;
        weigh::<W, S>(markers, marker, shape, &continuum.grid)?;
    }
    Ok(())
}

/// Appends the `W^2` weights of one marker; a node that is not allocated, or has no mass, has the weight zero.
fn weigh<const W: usize, S: Shape<W>>(
    markers: &mut Markers,
    marker: usize,
    shape: S,
    grid: &Grid,
) -> Result<(), Fault> {
    let (x, full) = (markers.state.x[marker], markers.chain(marker).full);
    let (cell, lower, offset) = (grid.geometry.cell, grid.geometry.lower, shape.offset());
    let xi = [0, 1].map(|a| (x[a] - lower[a]) / cell);
    let base = [0, 1].map(|a| (xi[a] - offset[a]).floor());
    let s = [0, 1].map(|a| {
        let weights = shape.weights(a, splat(xi[a] - base[a]));
        weights.map(|w| w.as_array()[0])
    });
    let first = markers.weights.len();
    let (mut sum, mut mean) = (0.0, [0.0; 2]);
    for j in 0..W {
        for i in 0..W {
            let node = [base[0] as i64 + i as i64, base[1] as i64 + j as i64];
            let at = grid.holder(node).map(|(tile, node)| NodeAt {
                tile,
                node: node as u32,
            });
            let image = at.and_then(|at| grid.image(at));
            let of = image.map(|image| image.of).or(at);
            let per_mass = of.map_or(0.0, |of| {
                let (tile, node) = of.split();
                grid.tiles[tile].per_mass[node]
            });
            // At an empty node the quotient 1 / 0 would count as a full node.
            let share = if per_mass > 0.0 {
                s[0][i] * s[1][j] * (1.0 / (per_mass * full)).min(1.0)
            } else {
                0.0
            };
            sum += share;
            for a in 0..2 {
                mean[a] += share * (node[a] as f64 - xi[a]);
            }
            let arm = [0, 1].map(|a| cell * (node[a] as f64 - xi[a]));
            markers.weights.push(Weight {
                at: at.unwrap_or_default(),
                of: of.unwrap_or_default(),
                share,
                arm,
            });
        }
    }
    if !(sum > 0.0 && sum.is_finite()) {
        return Err(lost(markers, marker));
    }
    for weight in &mut markers.weights[first..] {
        weight.share /= sum;
    }
    markers.shift[marker] = mean.map(|m| m / sum * cell);
    Ok(())
}

fn lost(markers: &Markers, marker: usize) -> Fault {
    let (chain, at) = (markers.chain_of[marker], markers.state.x[marker]);
    let number = marker - markers.chain(marker).first;
    if !at.iter().all(|x| x.is_finite()) {
        return Fault::NotFinite {
            what: "position".into(),
            item: format!("marker {number} of chain {chain}"),
        };
    }
    Fault::Other(format!(
        "marker {number} of chain {chain} at {} has lost its material: no node near it has mass, so it can neither move nor \
         bear a force; let bodies meet points (mpm.interface = \"points\") where a boundary tears",
        text::place(at)
    ))
}

/// Finds the nodes to which the force and the couple on the marker of one slot go, if there are any, or a body is near enough to
/// press.
pub fn touch_marker<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    slot: usize,
) {
    let ImpForce {
        force,
        couple,
        stiffness,
        tangential,
    } = continuum.imps.forces[slot];
    let marker = continuum.imps.state.members[slot].local as usize;
    let Some(markers) = &mut continuum.imps.markers else {
        return;
    };
    let shift = markers.shift[marker];
    let weights = &markers.weights[marker * W * W..][..W * W];
    let from_mean = |w: &Weight| [w.arm[0] - shift[0], w.arm[1] - shift[1]];
    let turns = turns(&continuum.imps.forces[slot]);
    let (mut per_inertia, mut lacks) = (0.0, 0.0);
    if turns {
        let mut spread = 0.0;
        for w in weights {
            for x in from_mean(w) {
                spread += w.share * x * x;
            }
        }
        let inertia = spread.max(LEAST_SPREAD * continuum.grid.geometry.cell.powi(2));
        (per_inertia, lacks) = (1.0 / inertia, 1.0 - spread / inertia);
    }
    markers.torque[markers.chain_of[marker] as usize] +=
        shift[0] * force[1] - shift[1] * force[0] - lacks * couple;
    let loaded = Loaded {
        slot,
        stiffness,
        tangential,
        radius: markers.chain(marker).radius,
    };
    for weights in weights.chunks_exact(W) {
        let (mut at, mut of) = ([NodeAt::default(); LANES], [NodeAt::default(); LANES]);
        let (mut shares, mut curls) = ([0.0; LANES], [[0.0; LANES]; 2]);
        for (i, weight) in weights.iter().enumerate() {
            let share = weight.share;
            let [x, y] = from_mean(weight).map(|x| share * x * per_inertia);
            (at[i], of[i], shares[i]) = (weight.at, weight.of, share);
            (curls[0][i], curls[1][i]) = (-y, x);
        }
        let curl = curls.map(Lanes::new);
        let gather = loaded.weighted(Lanes::new(shares), curl);
        let row = TouchRow {
            at,
            of,
            gather,
            curl,
        };
        // The nodes of segments get forces by the shape functions alone (a fault of the configuration).
        continuum.touches.push(row, None);
    }
    continuum.loaded.push(loaded);
}

/// Moves all markers over `dt` (s) with the field that strains the points, as [`super::drift`] moves these. The half of an
/// interval that USAVG strains in the next step is not settled.
///
/// # Errors
/// [`Fault::NotFinite`] of a marker.
pub fn move_markers<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) -> Result<(), Fault> {
    let (by, settling) = (FieldOfMotion::of(continuum), continuum.settling);
    let settles = continuum.stress_update == StressUpdate::Usf && settling.settles();
    let Some(markers) = &mut continuum.imps.markers else {
        return Ok(());
    };
    let grid = &continuum.grid;
    let mut fastest: f64 = 0.0;
    for (marker, weights) in markers.weights.chunks_exact(W * W).enumerate() {
        let (mut v, mut strained) = ([0.0; 2], [0.0; 2]);
        for weight in weights.iter().filter(|weight| weight.share > 0.0) {
            let (tile, node) = weight.at.split();
            let of_node = by.at(grid, weight.at);
            for a in 0..2 {
                v[a] += weight.share * of_node[a];
                strained[a] += weight.share * grid.tiles[tile].before[node][a];
            }
        }
        let mut moves = v.map(|v| v * dt);
        if settles {
            let unsettled = &mut markers.state.unsettled[marker];
            for a in 0..2 {
                if settling.past > 0.0 {
                    moves[a] += settling.past * strained[a] - unsettled[a];
                }
                unsettled[a] = settling.ahead * v[a];
            }
        }
        for a in 0..2 {
            markers.state.x[marker][a] += moves[a];
        }
        markers.state.v[marker] = v;
        let way_sq = moves[0] * moves[0] + moves[1] * moves[1];
        if !way_sq.is_finite() {
            return Err(Fault::NotFinite {
                what: "velocity".into(),
                item: format!("marker {marker}"),
            });
        }
        fastest = fastest.max(way_sq);
    }
    continuum.imps.state.travel += fastest.sqrt();
    Ok(())
}

/// Sums the angular momentum that the weights give over a kick (s).
pub fn add_shift<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    kick: f64,
) {
    if let Some(markers) = &mut continuum.imps.markers {
        for (spun, torque) in markers.state.spun.iter_mut().zip(&markers.torque) {
            *spun += kick * torque;
        }
    }
}
