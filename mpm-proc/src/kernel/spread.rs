//! Ways for a contact force to reach the grid (docs/physics.md section 3; Jiang 2020 eq. 47 and section 5.4; Chen 2023
//! section 3.2.3).
//!
//! Each is a product of one function of each coordinate whose values are 0 or more and sum to one over the nodes, so
//! that momentum is exact whatever the choice: `f_I = sum_p T_Ip f_p`. Points take velocities back through `S_Ip` in
//! all of them.
//!
//! - *point*: `T = S`. The only one that is the gradient of a potential, so that a contact spring keeps its energy.
//! - *nearest nodes*: `T` is the hat function, at the corners of the cell that the point is in.
//! - *traction*: `T` is the hat function averaged over the point's own box, half width `l_p`, that does not deform.
//!   Chen spreads the force over segments of the box's rim and shrinks the rim by a factor that is called an open issue;
//!   the mean over the box has the same nodes, needs no such factor, and is what a traction that is uniform over the
//!   points of a surface adds up to. With uGIMP it is the point scheme.

/// `T` along an axis at the `W` nodes from the base node on, of a point at `d` cells from it: the hat function averaged over a box
/// of half width `l` (cells, at most 1/2). Nearest nodes have `l = 0`.
pub fn weights<const W: usize>(d: f64, l: f64) -> [f64; W] {
    core::array::from_fn(|i| averaged_hat((d - i as f64).abs(), l))
}

/// The hat function averaged over a box of half width `l <= 1/2` at distance `r` from the node, in cells (Jiang 2020 A2).
fn averaged_hat(r: f64, l: f64) -> f64 {
    if r < l {
        1.0 - (r * r + l * l) / (2.0 * l)
    } else if r <= 1.0 - l {
        1.0 - r
    } else if r < 1.0 + l {
        (1.0 + l - r) * (1.0 + l - r) / (4.0 * l)
    } else {
        0.0
    }
}
