//! Sorting of the points by tile and cell, when they could have left the windows of their tiles.

use crate::kernel::lanes::LANES;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::points::{Cloud, NO_POINT};

/// Share of a cell that points may have moved before they are sorted again: just below the margin of a tile's window,
/// so that rounding cannot carry one over it.
const SORT_AFTER: f64 = 0.99;

/// Sorts the points and allocates the grid, if points could have left the windows of their tiles.
pub fn keep_sorted<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    if continuum.state.moved > SORT_AFTER * continuum.grid.geometry.cell {
        sort(continuum);
    }
}

/// Sorts the points and allocates the grid; points that have crossed a periodic wall enter at the other end.
pub fn sort<const W: usize, S: Shape<W>, A: AffineState>(continuum: &mut Continuum<W, S, A>) {
    enter_again(continuum);
    for cloud in &mut continuum.clouds {
        cloud.sort(&continuum.grid.geometry);
    }
    continuum.grid.cover(&mut continuum.clouds);
    continuum.state.moved = 0.0;
}

/// Moves points that have crossed a periodic wall to the other end; the caller sorts.
fn enter_again<const W: usize, S: Shape<W>, A: AffineState>(continuum: &mut Continuum<W, S, A>) {
    let geometry = continuum.grid.geometry;
    if geometry.periodic == [false; 2] {
        return;
    }
    let gravity = continuum.grid.gravity;
    let mut crossed = false;
    for cloud in &mut continuum.clouds {
        for lane in 0..cloud.state.ids.len() * LANES {
            let x = cloud.position(lane);
            let entered = geometry.entered(x);
            if entered == x {
                continue;
            }
            cloud.place(lane, entered);
            if cloud.state.ids[lane / LANES][lane % LANES] != NO_POINT {
                crossed = true;
                for a in 0..2 {
                    continuum.state.totals.driven_work -=
                        cloud.mass * gravity[a] * (entered[a] - x[a]);
                }
            }
        }
    }
    if crossed {
        // Other bodies may be near now, so the IMPs are selected again before they are used.
        continuum.imps.state.travel = f64::INFINITY;
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    /// Moves a lane's point to `x` (m).
    fn place(&mut self, lane: usize, x: [f64; 2]) {
        for a in 0..2 {
            self.state.x[lane / LANES][a].as_mut_array()[lane % LANES] = x[a];
        }
    }
}
