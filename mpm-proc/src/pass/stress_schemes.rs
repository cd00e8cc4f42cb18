//! When the stress is updated within the step: first (USF), last (USL, MUSL), or both (USAVG).

use interface::config::StressUpdate;

use super::grid_to_points::transfer_pass;
use super::measure::sum_stress_ahead;
use super::points_to_grid::points_to_grid;
use super::stress::{Velocity, stress_pass};
use super::volumes::map_volumes;
use crate::kernel::point_tile::Which;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;

/// The stress at `t_n`, from the interval of `dt` (s) before it, and its internal forces. Schemes that update the stress
/// last have it already, so only the forces are summed.
pub fn update_stress_first<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) {
    let strained = match continuum.stress_update {
        StressUpdate::Usf => Some(dt),
        StressUpdate::Usavg => Some(0.5 * dt),
        StressUpdate::Usl | StressUpdate::Musl => None,
    };
    map_volumes(continuum);
    stress_pass(continuum, strained, Velocity::Before, true);
}

/// The stress at `t_{n+1}`, from velocities after the kick: those of the nodes (USL), or those of the points, mapped to
/// the nodes once more (MUSL; and USAVG, which updates up to the middle of the step). Contact on the grid has acted on the
/// first alone, so there USAVG takes those (docs/energy.md).
pub fn update_stress_last<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) {
    let dt = match continuum.stress_update {
        StressUpdate::Usf => return,
        StressUpdate::Usl | StressUpdate::Musl => dt,
        StressUpdate::Usavg => 0.5 * dt,
    };
    let velocity = if continuum.maps_kicked() {
        transfer_pass::<W, true, false, S, A>(continuum, Which::All, 0.0);
        points_to_grid(continuum);
        Velocity::Before
    } else {
        Velocity::After
    };
    stress_pass(continuum, Some(dt), velocity, false);
    sum_stress_ahead(continuum);
}
