//! The filter of XPIC(m) (Hammerquist and Nairn 2017): velocities of points less what the grid cannot see of them.
//!
//! ```text
//! v_p <- v_p - (1 - S S+)^m v_p,    S+ = M^-1 S^T M_p
//! ```
//!
//! then the increment of the grid, as in FLIP. With m = 1 this is PIC; the larger m, the less is filtered out.

use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerBlock, over_tiles};
use crate::kernel::tiles::pitch;
use crate::kernel::transfer::Transfer;
use crate::kernel::window::{NO_VECTORS, gather_row};
use crate::pass::points_to_grid::points_to_grid;
use crate::state::continuum::Continuum;
use crate::state::grid::{ALL_NODES, fill_window};
use crate::state::points::{LaneCopy, Motion, Which};

impl<const W: usize, S: Shape<W>, T: Transfer> Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    /// Filters the velocities of the points, where the transfer does. Walls hold what the grid sees; what they take away
    /// in the last round is an impulse on the points.
    pub fn filter_velocities(&mut self) {
        if self.transfer.order() == 0 {
            return;
        }
        self.grid.hold_seen();
        self.grid
            .seen
            .iter_mut()
            .for_each(|seen| seen.wanted = ALL_NODES);
        self.over_motion(|motion| T::set_aside(&motion.v, &mut motion.affine));
        let grain = self.grain();
        for _ in 0..self.transfer.order() {
            let (clouds, grid) = (&mut self.clouds, &mut self.grid);
            self.threads.run(|| {
                for cloud in &mut *clouds {
                    points_to_grid(grain, cloud, Which::All);
                }
                grid.project(grain, clouds);
            });
            self.subtract();
        }
        self.over_motion(|motion| T::take_from_aside(&mut motion.v, &motion.affine));
        for seen in &self.grid.seen {
            self.books.applied_impulse += seen.impulse;
        }
    }

    /// Calls `act` with the velocities of every block.
    fn over_motion(&mut self, act: impl Fn(&mut Motion<T::Affine>) + Sync) {
        let grain = self.grain();
        let clouds = &mut self.clouds;
        self.threads.run(|| {
            for cloud in clouds {
                let share = PerBlock(&mut cloud.motion[..]);
                over_tiles(grain, &cloud.tiles, share, || (), &|_, motion, ()| {
                    motion.0.iter_mut().for_each(&act);
                });
            }
        });
    }

    /// `v_p -= sum_I S_Ip v_I`, of what the grid has seen.
    fn subtract(&mut self) {
        let grain = self.grain();
        let (clouds, grid) = (&mut self.clouds, &self.grid);
        self.threads.run(|| {
            for cloud in clouds {
                let (shape, x) = (cloud.shape, &cloud.x);
                let share = PerBlock(&mut cloud.motion[..]);
                over_tiles(
                    grain,
                    &cloud.tiles,
                    share,
                    || NO_VECTORS,
                    &|tile, motion, window| {
                        fill_window::<W>(window, &grid.tiles, tile, |t| {
                            &grid.seen[t.index].velocity
                        });
                        for (x, motion) in x[tile.first..].iter().zip(motion.0.iter_mut()) {
                            let place = tile.frame.locate(x, pitch(W));
                            let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
                            for j in 0..W {
                                let row = gather_row::<W>(window, &place, j);
                                for i in 0..W {
                                    let weight = s[0][i] * s[1][j];
                                    for a in 0..2 {
                                        motion.v[a] -= weight * row[i][a];
                                    }
                                }
                            }
                        }
                    },
                );
            }
        });
    }
}
