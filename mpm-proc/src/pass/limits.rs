//! The continuum's contribution to the largest stable step (docs/physics.md section 4).
//!
//! The grid's motion without contact is `M a = -K u`, `K = sum_p V_p B_p^T C_p B_p`, with lumped masses that split into
//! those of the points, `M = sum_p M_p`, `(M_p)_II = m_p S_Ip`. By the element eigenvalue theorem the largest squared
//! frequency is at most that of one point with its own share of the masses:
//!
//! ```text
//! omega^2 <= max_p lambda_max( M_p^-1 V_p B_p^T C_p B_p ) = max_p lambda_max( C_p H_p ) / rho_p
//! H_p = sum_I B_Ip B_Ip^T / S_Ip
//! ```
//!
//! (the nonzero eigenvalues of a product do not depend on the order of its factors). For a product of one-dimensional
//! functions `sum_I grad S grad S^T / S = diag(g_x, g_y)` with `g_a = sum_i S_i'^2 / S_i` of the function along `a`
//! alone, because the weights along the other axis sum to one and the gradients to zero. So `H_p` is at most
//! `g diag(1, 1, 2)` in the order xx, yy, xy, with `g` the largest value of either axis
//! ([`Shape::stiffest`]): the bound is `g` times [`crate::material::Material::stiffness_over_density`].
//!
//! Sharper bounds from the actual masses of the nodes were tried; they cost more than they save
//! (`docs/decisions/0012`).
//!
//! A scheme that keeps velocities on points applies `S M^-1 S^T M_p` between steps, whose eigenvalues lie between 0 and
//! 1, so it can only lower these frequencies.

use interface::message::wire::Limits;

use super::images::{gather_sums, spread_values};
use crate::kernel::lanes::{Lanes, ZERO, largest, splat};
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerTile, over_tiles};
use crate::kernel::tiles::{NODES, Place, pitch};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::{
    NO_VECTORS, VectorWindow, add_window, clear, fill_window, gather_row, scatter_row,
};
use crate::state::contact::ContactLoad;
use crate::state::continuum::Continuum;
use crate::state::images::Images;

/// The limits for the next step, with the contribution of contact in this step.
pub fn limits<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    load: ContactLoad,
) -> Limits {
    let speed_sq = continuum
        .imps
        .state
        .members
        .iter()
        .map(|m| {
            let [x, y] = continuum.imps.velocity(*m, &continuum.clouds);
            x * x + y * y
        })
        .fold(0.0, f64::max);
    Limits {
        omega_sq: elastic_omega_sq(continuum),
        contact_omega_sq: load.omega_sq,
        damping: 0.0,
        speed: speed_sq.sqrt(),
        radius_min: 0.0, // the session adds it
        mobility: if load.stiffness > 0.0 {
            load.omega_sq / load.stiffness
        } else {
            0.0
        },
    }
}

/// Bound of the largest squared frequency without contact, in 1/s^2.
fn elastic_omega_sq<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) -> f64 {
    let cell = continuum.grid.geometry.cell;
    if continuum
        .clouds
        .iter()
        .any(|c| c.shape.stiffest(0).is_none())
    {
        return omega_sq_of_points(continuum);
    }
    continuum
        .clouds
        .iter()
        .map(|cloud| {
            let stiffest = cloud
                .state
                .stress_reports
                .iter()
                .map(|r| r.stiffness)
                .fold(0.0, f64::max);
            let place = stiffest_place(&cloud.shape) / (cell * cell);
            with_viscosity(stiffest * place, cloud.material.viscosity() * place)
        })
        .fold(0.0, f64::max)
}

/// The bound for linear hats, from the masses that the nodes get from the present positions.
///
/// What is stepped in time is the velocity of the points, so the operator is `Q^T K Q` with
/// `Q = M^-1 S^T M_p^1/2` (nodes by points), the projection of the points' velocities to the nodes and back. Its
/// largest eigenvalue is at most the largest row sum of absolute values, weighted by `m_p^1/2` (Perron):
///
/// ```text
/// omega^2 <= max_q sum_I S_Iq a_I / m_I,   a_I = sum_p m_p c_p |grad S_Ip| sum_J |grad S_Jp|
/// ```
///
/// with `c_p` the stiffness over density. `S_Iq / m_I <= 1 / m_q` keeps it finite where a node has hardly any mass; so the
/// masses must belong to the same positions as `S`, and not to those before the points moved.
fn omega_sq_of_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) -> f64 {
    let Continuum {
        clouds,
        grid,
        threads,
        loads_of_nodes,
        ..
    } = continuum;
    let per_area = 1.0 / (grid.geometry.cell * grid.geometry.cell);
    // The windows of the internal forces, which have been used and are summed anew in the next step.
    for cloud in &mut *clouds {
        let (shape, x, reports) = (cloud.shape, &cloud.state.x, &cloud.state.stress_reports);
        let mass = cloud.mass;
        let scale = mass * per_area;
        let share = PerTile::one(&mut cloud.force[..]);
        over_tiles(threads, &cloud.tiles, share, || (), &|tile, window, ()| {
            let window = &mut window.items[0];
            clear::<W, 2>(&mut window.0);
            let stiffness = splat(scale * reports[tile.index].stiffness);
            let mass = splat(mass);
            for b in 0..tile.blocks {
                let place = tile.frame.locate(&x[tile.first + b], pitch(W));
                let sizes = gradient_sizes(&shape, &place);
                let total = sizes.as_flattened().iter().fold(ZERO, |sum, &s| sum + s);
                let load = stiffness * total * tile.live(b);
                let mass = mass * tile.live(b);
                let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
                for (j, row) in sizes.iter().enumerate() {
                    let of_row = mass * s[1][j];
                    let row: [_; W] = core::array::from_fn(|i| [load * row[i], of_row * s[0][i]]);
                    scatter_row(window, &place, j, &row);
                }
            }
        });
    }
    loads_of_nodes.resize(grid.tiles.len(), [[0.0; 2]; NODES]);
    for (loads, tile) in loads_of_nodes.iter_mut().zip(&grid.tiles) {
        *loads = [[0.0; 2]; NODES];
        for o in tile.overlapping(&grid.overlaps) {
            let window = &clouds[o.cloud as usize].force[o.tile as usize];
            add_window::<W, 2>(loads, &window.0, o.run);
        }
    }
    divide_by_mass(loads_of_nodes, &grid.images);
    let mut largest_row: f64 = 0.0;
    for cloud in clouds {
        let (shape, x) = (cloud.shape, &cloud.state.x);
        let share = PerTile::one(&mut cloud.reports[..]);
        over_tiles(
            threads,
            &cloud.tiles,
            share,
            || NO_VECTORS,
            &|tile, report, window: &mut VectorWindow| {
                fill_window::<W, _>(window, loads_of_nodes, tile, |loads| loads);
                let mut most = ZERO;
                for b in 0..tile.blocks {
                    let place = tile.frame.locate(&x[tile.first + b], pitch(W));
                    let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
                    let mut row_sum = ZERO;
                    for j in 0..W {
                        let row = gather_row::<W>(window, &place, j);
                        for i in 0..W {
                            row_sum = (s[0][i] * s[1][j]).mul_add(row[i][0], row_sum);
                        }
                    }
                    // Lanes without a point lie where one does.
                    most = most.fast_max(row_sum);
                }
                report.items[0].omega_sq = largest(most);
            },
        );
        let of_tiles = cloud.reports.iter().map(|report| report.omega_sq);
        largest_row = of_tiles.fold(largest_row, f64::max);
    }
    largest_row
}

/// Turns loads and masses of nodes into loads over masses. Nodes beyond a periodic wall are those at the other end; hats
/// have no other images.
fn divide_by_mass(nodes: &mut [[[f64; 2]; NODES]], images: &Images) {
    gather_sums(images, nodes, |tile, n| &mut tile[n]);
    for [load, mass] in nodes.as_flattened_mut() {
        if *mass > 0.0 {
            *load /= *mass;
        }
    }
    spread_values(images, nodes, |tile, n| &mut tile[n]);
}

/// `|grad S_Ip|` of four points times the cell, row by row.
#[inline(always)]
fn gradient_sizes<const W: usize, S: Shape<W>>(shape: &S, place: &Place) -> [[Lanes; W]; W] {
    let s = [0, 1].map(|a| shape.weights(a, place.d[a]));
    let g = [0, 1].map(|a| shape.gradients(a, place.d[a]));
    core::array::from_fn(|j| {
        core::array::from_fn(|i| {
            let [along, across] = [g[0][i] * s[1][j], s[0][i] * g[1][j]];
            along.mul_add(along, across * across).sqrt()
        })
    })
}

/// `g L^2` of a shape function.
pub fn stiffest_place<const W: usize, S: Shape<W>>(shape: &S) -> f64 {
    (0..2)
        .filter_map(|axis| shape.stiffest(axis))
        .fold(0.0, f64::max)
}

/// The squared frequency whose limit `2/omega` is that of an oscillator of `omega_sq` damped at the rate `damping` (1/s)
/// by forces of the velocity before the kick: `dt <= (2/omega) (sqrt(1 + z^2) - z)`, `z = damping / (2 omega)`.
fn with_viscosity(omega_sq: f64, damping: f64) -> f64 {
    ((omega_sq + 0.25 * damping * damping).sqrt() + 0.5 * damping).powi(2)
}
