//! Grid to points: velocities, affine part, and the move to `t_{n+1}` (Jiang 2020 eqs. 26 to 28 and 31).

use interface::config::{Drift, StressUpdate};
use interface::solver::Fault;

use super::check_points::check_points;
use super::drift::find_near_loads;
use super::holds::hold_mapped;
use super::markers::move_markers;
use super::measure::sum_stress_ahead;
use super::points_to_grid::map_velocities;
use super::stress::{PositionsAt, Strain};
use super::sweep::{Sweep, Velocity, kicks, sweep};
use super::velocities::Carry;
use crate::kernel::point_tile::Which;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;

/// Velocities and positions of all points after the kick, by the scheme's choice of the velocity with which points move.
///
/// # Errors
/// A [`Fault`] that names the point which is not finite or has left the domain.
pub fn grid_to_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) -> Result<(), Fault> {
    let mapped = continuum.drift == Drift::Mapped && !continuum.loaded.is_empty();
    match continuum.stress_update {
        // The velocities were gathered, and mapped to the field that strains the points.
        StressUpdate::Musl | StressUpdate::Usavg => {
            sweep(continuum, &moves(continuum, Which::All, dt));
        }
        StressUpdate::Usf if mapped => {
            find_near_loads(continuum);
            sweep(continuum, &kicks(continuum, Which::NearLoad));
            map_velocities(continuum, Which::NearLoad);
            hold_mapped(continuum);
            continuum.grid.complete_mapped();
            sweep(continuum, &moves(continuum, Which::NearLoad, dt));
            sweep(continuum, &kicks_and_moves(continuum, Which::Elsewhere, dt));
        }
        StressUpdate::Usf => {
            sweep(continuum, &kicks_and_moves(continuum, Which::All, dt));
        }
        // The stress at t_{n+1} comes from the same velocities, and its forces are those of the next step.
        StressUpdate::Usl => {
            let what = Sweep {
                strain: Some(Strain {
                    dt,
                    positions_at: PositionsAt::Start,
                }),
                load: true,
                ..kicks_and_moves(continuum, Which::All, dt)
            };
            sweep(continuum, &what);
            sum_stress_ahead(continuum);
        }
    }
    if continuum.imps.markers.is_some() {
        move_markers(continuum, mapped, dt)?;
    }
    check_points(continuum, dt)
}

/// Points take velocities and move over `dt` (s) with them.
fn kicks_and_moves<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &Continuum<W, S, A>,
    which: Which,
    dt: f64,
) -> Sweep {
    let mut what = kicks(continuum, which);
    what.carry = what.carry.map(|how| Carry {
        drift: true,
        dt,
        ..how
    });
    what
}

/// Points that have their velocities move over `dt` (s).
fn moves<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &Continuum<W, S, A>,
    which: Which,
    dt: f64,
) -> Sweep {
    let mut what = kicks_and_moves(continuum, which, dt);
    what.carry = what.carry.map(|how| Carry { kick: false, ..how });
    if !continuum.moves_by_kicked() {
        what.by = Velocity::Before;
    }
    what
}
