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

use interface::config::ContactForceScheme;

/// The scheme of the scene, with what it needs of each cloud.
#[derive(Debug, Clone)]
pub struct Spread {
    scheme: ContactForceScheme,
    /// `l_p / L` of each cloud, along x and y.
    half_width: Vec<[f64; 2]>,
}

impl Spread {
    /// The scheme of a scene whose groups have points with boxes of half width `half_width` (cells) along x and y.
    pub fn new(scheme: ContactForceScheme, half_width: Vec<[f64; 2]>) -> Self {
        Self { scheme, half_width }
    }

    /// The same for some of the groups, in their order.
    #[must_use]
    pub fn of(&self, groups: core::ops::Range<usize>) -> Self {
        Self::new(self.scheme, self.half_width[groups].to_vec())
    }

    /// Whether forces reach the grid through the shape function itself.
    pub fn is_shape(&self) -> bool {
        self.scheme == ContactForceScheme::Point
    }

    /// `T` along `axis` at the `W` nodes from the base node on, for a point of `cloud` at `d` cells from the base node
    /// with shape function `shape` there.
    pub fn weights<const W: usize>(
        &self,
        cloud: usize,
        axis: usize,
        d: f64,
        shape: [f64; W],
    ) -> [f64; W] {
        match self.scheme {
            ContactForceScheme::Point => shape,
            ContactForceScheme::NearestNodes => {
                core::array::from_fn(|i| (1.0 - (d - i as f64).abs()).max(0.0))
            }
            ContactForceScheme::Traction => {
                let l = self.half_width[cloud][axis].min(0.5);
                core::array::from_fn(|i| averaged_hat((d - i as f64).abs(), l))
            }
        }
    }
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
