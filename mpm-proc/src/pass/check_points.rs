//! Checks the reports of the pass that moved the points: how far they moved, and whether all are finite and within the
//! domain.

use interface::config::Leaving;
use interface::solver::Fault;

use crate::kernel::lanes::LANES;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::points::{Cloud, NO_POINT};

/// Adds up the displacement of the points, and refuses values that are not finite or positions outside the domain.
pub fn check_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) -> Result<(), Fault> {
    let closed = continuum.grid.walls.closed();
    let (lower, upper) = (continuum.grid.geometry.lower, continuum.grid.geometry.upper);
    let periodic = continuum.grid.geometry.periodic;
    // A wall that holds its nodes lets a point come closer than its nodes do, by less than a cell.
    let slack = |axis: usize, end: usize| {
        if periodic[axis] {
            f64::INFINITY
        } else if closed[axis][end] {
            continuum.grid.geometry.cell
        } else {
            0.0
        }
    };
    let lower = [lower[0] - slack(0, 0), lower[1] - slack(1, 0)];
    let upper = [upper[0] + slack(0, 1), upper[1] + slack(1, 1)];
    let mut speed_sq: f64 = 0.0;
    for (number, cloud) in continuum.clouds.iter().enumerate() {
        for (tile, report) in cloud.tiles.iter().zip(&cloud.reports) {
            let inside = (0..2).all(|a| report.lower[a] >= lower[a] && report.upper[a] <= upper[a]);
            if !report.sum.is_finite() || !inside {
                for block in tile.first..tile.first + tile.blocks {
                    for k in 0..LANES {
                        let lane = block * LANES + k;
                        match cloud.check_point(lane, lower, upper) {
                            Err(Fault::LeftDomain { .. })
                                if continuum.leaving == Leaving::Remove =>
                            {
                                continuum.gone.push((number, lane));
                            }
                            other => other?,
                        }
                    }
                }
            }
            speed_sq = speed_sq.max(report.speed_sq);
        }
    }
    let moved = speed_sq.sqrt() * dt;
    continuum.state.moved += moved;
    if continuum.imps.markers.is_none() {
        continuum.imps.state.travel += moved;
    }
    Ok(())
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    fn check_point(&self, lane: usize, lower: [f64; 2], upper: [f64; 2]) -> Result<(), Fault> {
        let local = self.state.ids[lane / LANES][lane % LANES];
        if local == NO_POINT {
            return Ok(());
        }
        let id = self.first_id + u64::from(local);
        let (_, volume) = self.state.stresses.of_lane(lane);
        if volume.is_nan() || volume <= 0.0 {
            return Err(Fault::Material {
                id,
                message: "its volume has vanished; a smaller step or a finer grid may help".into(),
            });
        }
        let [x, v] = [self.position(lane), self.velocity(lane)];
        let quantity = [(v, "velocity"), (x, "position")]
            .into_iter()
            // If a square overflows, there is no finite kinetic energy.
            .find(|(q, _)| !(q[0] * q[0] + q[1] * q[1]).is_finite());
        if let Some((_, what)) = quantity {
            return Err(Fault::NotFinite {
                what: what.into(),
                item: format!("point {id}"),
            });
        }
        if (0..2).any(|a| x[a] < lower[a] || x[a] > upper[a]) {
            return Err(Fault::LeftDomain {
                id,
                x: x[0],
                y: x[1],
            });
        }
        Ok(())
    }
}
