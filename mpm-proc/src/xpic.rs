//! The filter of XPIC(m) (Hammerquist and Nairn 2017): velocities of points less what the grid cannot see of them.
//!
//! ```text
//! v_p <- v_p - (1 - S S+)^m v_p,    S+ = M^-1 S^T M_p
//! ```
//!
//! then the increment of the grid, as in FLIP. With m = 1 this is PIC; the larger m, the less is filtered out.

use crate::continuum::Continuum;
use crate::grid::{NODES, fill_window};
use crate::points::LaneCopy;
use crate::points_to_grid::points_to_grid;
use crate::shape::Shape;
use crate::stress::functions;
use crate::tiles::pitch;
use crate::transfer::Transfer;
use crate::window::{NO_VECTORS, gather_row};

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
        for motion in self.clouds.iter_mut().flat_map(|c| &mut c.motion) {
            T::set_aside(&motion.v, &mut motion.affine);
        }
        let grain = self.grain();
        let mut seen = vec![[[0.0; 2]; NODES]; self.grid.tiles.len()];
        let mut impulse = [0.0; 2];
        for _ in 0..self.transfer.order() {
            let clouds = &mut self.clouds;
            self.threads.run(|| {
                for cloud in clouds {
                    points_to_grid(grain, cloud);
                }
            });
            impulse = self.grid.project(&self.clouds, &mut seen);
            self.subtract(&seen);
        }
        for motion in self.clouds.iter_mut().flat_map(|c| &mut c.motion) {
            T::take_from_aside(&mut motion.v, &motion.affine);
        }
        self.books.applied_impulse += impulse;
    }

    /// `v_p -= sum_I S_Ip v_I`.
    fn subtract(&mut self, velocity: &[[[f64; 2]; NODES]]) {
        let mut window = NO_VECTORS;
        for cloud in &mut self.clouds {
            for tile in &cloud.tiles {
                fill_window::<W>(&mut window, &self.grid.tiles, tile, |t| &velocity[t.index]);
                for block in tile.first..tile.first + tile.blocks {
                    let place = tile.frame.locate(&cloud.x[block], pitch(W));
                    let [s, _] = functions(&cloud.shape, &place);
                    let v = &mut cloud.motion[block].v;
                    for j in 0..W {
                        let row = gather_row::<W>(&window, &place, j);
                        for i in 0..W {
                            let weight = s[0][i] * s[1][j];
                            for a in 0..2 {
                                v[a] -= weight * row[i][a];
                            }
                        }
                    }
                }
            }
        }
    }
}
