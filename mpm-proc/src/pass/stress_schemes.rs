//! When the stress is updated within the step: first (USF), last (USL, MUSL), or both (USAVG).

use interface::config::StressUpdate;

use super::measure::sum_stress_ahead;
use super::points_to_grid::points_to_grid;
use super::stress::{PositionsAt, Strain};
use super::sweep::{Sweep, Velocity, kicks, sweep};
use super::volumes::map_volumes;
use crate::kernel::point_tile::Which;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;

/// The stress at `t_n`, from the interval of `dt` (s) before it, and its internal forces. Schemes that update the stress
/// last have it already, so only the forces are summed, where the sweep before has not.
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
    let what = Sweep {
        which: Which::All,
        by: Velocity::Before,
        strain: strained.map(|dt| Strain {
            dt,
            positions_at: PositionsAt::End,
        }),
        carry: None,
        load: true,
    };
    sweep(continuum, &what);
}

/// The stress at `t_{n+1}`, from the velocities of the points after the kick, mapped to the nodes once more (MUSL; and USAVG, which
/// updates up to the middle of the step). With USL it comes from those of the nodes, in the sweep that moves the points.
pub fn update_stress_last<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) {
    let dt = match continuum.stress_update {
        StressUpdate::Usf | StressUpdate::Usl => return,
        StressUpdate::Musl => dt,
        StressUpdate::Usavg => 0.5 * dt,
    };
    sweep(continuum, &kicks(continuum, Which::All));
    points_to_grid(continuum);
    let what = Sweep {
        which: Which::All,
        by: Velocity::Before,
        strain: Some(Strain {
            dt,
            positions_at: PositionsAt::Start,
        }),
        carry: None,
        load: false,
    };
    sweep(continuum, &what);
    sum_stress_ahead(continuum);
}
