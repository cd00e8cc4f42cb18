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

use crate::kernel::lanes::{LANES, Lanes};
use crate::kernel::point_tile::{Tile, owner};
use crate::kernel::shape::Shape;
use crate::kernel::tiles::NODES;
use crate::kernel::tiles::pitch;
use crate::kernel::transfer::AffineState;
use crate::state::contact::ContactLoad;
use crate::state::continuum::Continuum;

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

/// The bound for linear hats, from the masses that the nodes have in this step.
///
/// What is stepped in time is the velocity of the points, so the operator is `Q^T K Q` with
/// `Q = M^-1 S^T M_p^1/2` (nodes by points), the projection of the points' velocities to the nodes and back. Its
/// largest eigenvalue is at most the largest row sum of absolute values, weighted by `m_p^1/2` (Perron):
///
/// ```text
/// omega^2 <= max_q sum_I S_Iq a_I / m_I,   a_I = sum_p m_p c_p |grad S_Ip| sum_J |grad S_Jp|
/// ```
///
/// with `c_p` the stiffness over density. `S_Iq / m_I <= 1 / m_q` keeps it finite where a node has hardly any mass.
fn omega_sq_of_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) -> f64 {
    continuum.loads_of_nodes.clear();
    continuum
        .loads_of_nodes
        .resize(continuum.grid.tiles.len(), [0.0; NODES]);
    let cell = continuum.grid.geometry.cell;
    for cloud in &continuum.clouds {
        for tile in &cloud.tiles {
            let stiffness = cloud.state.stress_reports[tile.index].stiffness;
            for point in weights_of_points(&cloud.shape, tile, &cloud.state.x) {
                let mut gradients = [[0.0; W]; W];
                for (j, row) in gradients.iter_mut().enumerate() {
                    for (i, gradient) in row.iter_mut().enumerate() {
                        *gradient = point.gradient(i, j) / cell;
                    }
                }
                let total: f64 = gradients.iter().flatten().sum();
                for (n, gradient) in gradients.iter().flatten().enumerate() {
                    let (tile, node) = point.node(tile, n);
                    continuum.loads_of_nodes[tile][node] +=
                        cloud.mass * stiffness * gradient * total;
                }
            }
        }
    }
    let mut largest: f64 = 0.0;
    for cloud in &continuum.clouds {
        for tile in &cloud.tiles {
            for point in weights_of_points(&cloud.shape, tile, &cloud.state.x) {
                let row = (0..W * W).map(|n| {
                    let (tile, node) = point.node(tile, n);
                    let per_mass = continuum.grid.tiles[tile].per_mass[node];
                    let weight = point.weights[0][n % W] * point.weights[1][n / W];
                    weight * per_mass * continuum.loads_of_nodes[tile][node]
                });
                largest = largest.max(row.sum());
            }
        }
    }
    largest
}

/// The weights of a point along each axis, and their derivatives times the cell.
struct WeightsOfPoint<const W: usize> {
    /// Its first node in the window of its tile.
    base: usize,
    weights: [[f64; W]; 2],
    derivatives: [[f64; W]; 2],
}

impl<const W: usize> WeightsOfPoint<W> {
    /// `|grad S_Ip|` of the node in column `i` and row `j`, times the cell.
    fn gradient(&self, i: usize, j: usize) -> f64 {
        let ([s_x, s_y], [g_x, g_y]) = (&self.weights, &self.derivatives);
        (g_x[i] * s_y[j]).hypot(s_x[i] * g_y[j])
    }

    /// The node tile, and the node in it, of the point's node `n`, row by row.
    fn node(&self, tile: &Tile, n: usize) -> (usize, usize) {
        owner::<W>(tile, self.base + n / W * pitch(W) + n % W)
    }
}

/// The weights of all points of a tile whose positions are `x`.
fn weights_of_points<const W: usize, S: Shape<W>>(
    shape: &S,
    tile: &Tile,
    x: &[[Lanes; 2]],
) -> impl Iterator<Item = WeightsOfPoint<W>> {
    (0..tile.blocks).flat_map(move |block| {
        let place = tile.frame.locate(&x[tile.first + block], pitch(W));
        let weights = [0, 1].map(|axis| shape.weights(axis, place.d[axis]));
        let derivatives = [0, 1].map(|axis| shape.gradients(axis, place.d[axis]));
        let points = LANES.min(tile.points - block * LANES);
        (0..points).map(move |k| {
            let of_point = |lanes: [[Lanes; W]; 2]| lanes.map(|axis| axis.map(|w| w.as_array()[k]));
            WeightsOfPoint {
                base: place.base[k],
                weights: of_point(weights),
                derivatives: of_point(derivatives),
            }
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
