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
//! What is stepped in time is not the motion of the nodes. A scheme that keeps velocities on points has `w = M^-1 S^T m v` at
//! the nodes, and a force on the nodes reaches the points by the transposed of that map: [`stepped_share`] is how much of
//! the frequency is left. It is proven for any cloud; measuring the frequency instead would gain less than it costs
//! (`docs/decisions/0012`).

use interface::config::{Drift, StressUpdate};
use interface::message::wire::Limits;

use super::images::spread_values;
use super::node_momentum::sum_numbers;
use crate::kernel::lanes::{Lanes, ZERO, largest, splat};
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerTile, over_tiles};
use crate::kernel::tiles::{Place, pitch};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::{
    NO_VECTORS, VectorWindow, clear, fill_window, gather_row, scatter_row,
};
use crate::state::contact::ContactLoad;
use crate::state::continuum::Continuum;
use crate::state::points::Cloud;

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
    // With USL points move with the velocities after the kick, so contact has the factor of waves (`stepped_share`).
    let contact = match continuum.stress_update {
        StressUpdate::Usl => 2.0 * load.omega_sq,
        StressUpdate::Usf | StressUpdate::Musl | StressUpdate::Usavg => load.omega_sq,
    };
    Limits {
        omega_sq: elastic_omega_sq(continuum),
        contact_omega_sq: contact,
        damping: 0.0,
        speed: speed_sq.sqrt(),
        radius_min: 0.0, // the session adds it
        mobility: if load.stiffness > 0.0 {
            contact / load.stiffness
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
        let omega_sq = row_sum_of_points(continuum, |_, stiffness| stiffness);
        if continuum
            .clouds
            .iter()
            .all(|c| c.material.viscosity() == 0.0)
        {
            return omega_sq;
        }
        return with_viscosity(
            omega_sq,
            row_sum_of_points(continuum, |viscosity, _| viscosity),
        );
    }
    let share = stepped_share(continuum);
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
            let place = share * stiffest_place(&cloud.shape) / (cell * cell);
            with_viscosity(stiffest * place, cloud.material.viscosity() * place)
        })
        .fold(0.0, f64::max)
}

/// The bound of the squared frequency that the scheme steps, over that of single points on the grid, `g c^2`.
///
/// With `Z = M^-1/2 S^T m^1/2`, whose singular values are at most 1, `v = m^1/2 v_p` and `N` the strains of the points by
/// the velocities of the nodes (times the roots of stiffness and mass), FLIP steps `v' = -Z^T N^T s`, `s' = N Z v`: the
/// eigenvalues of `Z^T N^T N Z`. Gradients of shape functions sum to zero, so a point is strained by how the velocities of
/// its nodes differ from their mean alone: `|N u|^2 <= g c^2 sum_p m_p (sum_I S u^2 - (sum_I S u)^2)`, that is
/// `N^T N <= g c^2 (1 - Z Z^T)`. What the grid shows well it strains little, and what it strains much the points hardly
/// see:
///
/// ```text
/// USF, MUSL, USAVG     Z^T N^T N Z <= g c^2 x (1 - x),   x = Z^T Z from 0 to 1: at most 1/4
/// with smoothing       v <- Q v - dt Z^T N^T s,  Q = 1 - alpha (1 - x) at least: dt^2 g c^2 x (1 - x) <= 2 (1 + Q),
///                      which is 4 if dt^2 g c^2 = 4 (1 + sqrt(1 - alpha/2))^2
/// USL                  s <- s + dt N (Z v - dt Z Z^T N^T s) - dt^2 N (1 - Z Z^T) N^T s: dt^2 N (2 - Z Z^T) N^T <= 4, so 2;
///                      with an affine part 4/3 (all is passed on by the nodes: dt^2 N^T N <= 2 (1 + Z Z^T))
/// ```
///
/// (a smoothing, and with USL the last term, is a dashpot that acts a step late.) Walls, supports and images project the
/// velocities of the nodes, which replaces `Z` by another such map; the spin of a group changes the motion that strains
/// nothing. Affine parts show the nodes what single points do not:
/// a lone point with one has two thirds of `g c^2` (quadratic splines), and all of it is taken. With contact on the grid
/// the forces that the points take are not those that the strains belong to. And uGIMP with USF keeps the step of the grid: it
/// creates energy where points cross cells, sixty times as much with twice the step (a soft disc that rings in flight).
fn stepped_share<const W: usize, S: Shape<W>, A: AffineState>(c: &Continuum<W, S, A>) -> f64 {
    if c.stress_update == StressUpdate::Usl {
        return if A::PRESENT && !c.transfer.increment {
            4.0 / 3.0
        } else {
            2.0
        };
    }
    // Only splines are mirrored; linear hats have a bound of their own.
    let creates = c.stress_update == StressUpdate::Usf && !S::MIRRORED;
    if A::PRESENT || c.drift == Drift::Nodal || creates {
        return 1.0;
    }
    let of_filter = c.transfer.filter.map_or(0.0, |filter| filter.share);
    let smooths = c.transfer.pic_fraction.max(of_filter);
    (1.0 + (1.0 - 0.5 * smooths).sqrt()).powi(-2)
}

/// The bound for linear hats, from the masses that the nodes get from the present positions, of `what` of a point's viscosity
/// over density and stiffness over density: that of the frequency, or that of the rate of viscous damping.
///
/// What is stepped in time is the velocity of the points, so the operator is `Q^T K Q` with
/// `Q = M^-1 S^T M_p^1/2` (nodes by points), the projection of the points' velocities to the nodes and back. Its
/// largest eigenvalue is at most the largest row sum of absolute values, weighted by `m_p^1/2` (Perron):
///
/// ```text
/// omega^2 <= max_q sum_I S_Iq a_I / m_I,   a_I = sum_p m_p c_p |grad S_Ip| sum_J |grad S_Jp|
/// ```
///
/// with `c_p` the stiffness over density, or the viscosity. `S_Iq / m_I <= 1 / m_q` keeps it finite where a node has hardly any mass; so the
/// masses must belong to the same positions as `S`, and not to those before the points moved.
fn row_sum_of_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    what: impl Fn(f64, f64) -> f64 + Sync,
) -> f64 {
    let Continuum {
        clouds,
        grid,
        threads,
        ..
    } = continuum;
    let per_area = 1.0 / (grid.geometry.cell * grid.geometry.cell);
    // The windows of the internal forces, which have been used and are summed anew in the next step.
    Cloud::each(threads, clouds, |threads, cloud| {
        let (shape, x, reports) = (cloud.shape, &cloud.state.x, &cloud.state.stress_reports);
        let mass = cloud.mass;
        let (scale, viscosity) = (mass * per_area, cloud.material.viscosity());
        let share = PerTile(&mut cloud.force[..]);
        over_tiles(threads, &cloud.tiles, share, || (), &|tile, window, ()| {
            let window = &mut window.0[0];
            clear::<W, 2>(&mut window.0, tile);
            let stiffness = splat(scale * what(viscosity, reports[tile.index].stiffness));
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
    });
    sum_numbers(grid, threads, clouds, |_| true);
    for [load, mass] in grid.sums.as_flattened_mut() {
        if *mass > 0.0 {
            *load /= *mass;
        }
    }
    // Nodes beyond a periodic wall are those at the other end; hats have no other images.
    spread_values(&grid.images, &mut grid.sums);
    Cloud::each(threads, clouds, |threads, cloud| {
        let (shape, x) = (cloud.shape, &cloud.state.x);
        let share = PerTile(&mut cloud.reports[..]);
        over_tiles(
            threads,
            &cloud.tiles,
            share,
            || NO_VECTORS,
            &|tile, report, window: &mut VectorWindow| {
                fill_window::<W, _>(window, &grid.sums, tile, |loads| loads);
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
                report.0[0].omega_sq = largest(most);
            },
        );
    });
    let reports = clouds.iter().flat_map(|cloud| &cloud.reports);
    reports.map(|report| report.omega_sq).fold(0.0, f64::max)
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
fn stiffest_place<const W: usize, S: Shape<W>>(shape: &S) -> f64 {
    (0..2)
        .filter_map(|axis| shape.stiffest(axis))
        .fold(0.0, f64::max)
}

/// The squared frequency whose limit `2/omega` is that of an oscillator of `omega_sq` damped at the rate `damping` (1/s)
/// by forces of the velocity before the kick: `dt <= (2/omega) (sqrt(1 + z^2) - z)`, `z = damping / (2 omega)`.
fn with_viscosity(omega_sq: f64, damping: f64) -> f64 {
    ((omega_sq + 0.25 * damping * damping).sqrt() + 0.5 * damping).powi(2)
}
