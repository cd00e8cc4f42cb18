//! Shape functions `S_Ip` and their gradients (Jiang 2020 appendix; docs/physics.md section 1).
//!
//! Every shape is a product of one function of each coordinate. A point touches `W` nodes along an axis: from its
//! *base* node, which is `floor(xi - offset)` with `xi` the coordinate in cells, to `base + W - 1`. What the functions
//! take is the distance `d = xi - base` from the base node in cells, between `offset` and `offset + 1`.

use crate::kernel::lanes::{Lanes, ZERO, splat};

/// A shape function that touches `W` nodes along each axis.
///
/// An example: the linear hat function, which touches two nodes.
///
/// ```
/// use mpm_proc::kernel::lanes::{Lanes, splat};
/// use mpm_proc::kernel::shape::Shape;
///
/// #[derive(Clone, Copy)]
/// struct Hat;
///
/// impl Shape<2> for Hat {
///     const MIRRORED: bool = false; // a point within the domain reaches no node beyond it
///     const INVERSE_INERTIA: Option<f64> = None; // D_p changes with the position
///
///     fn offset(&self) -> [f64; 2] {
///         [0.0, 0.0] // the base node is the corner of the point's cell
///     }
///
///     #[inline(always)]
///     fn weights(&self, _axis: usize, d: Lanes) -> [Lanes; 2] {
///         [splat(1.0) - d, d]
///     }
///
///     #[inline(always)]
///     fn gradients(&self, _axis: usize, _d: Lanes) -> [Lanes; 2] {
///         [splat(-1.0), splat(1.0)]
///     }
///
///     fn stiffest(&self, _axis: usize) -> Option<f64> {
///         None // 1/d + 1/(1 - d) has no bound
///     }
/// }
///
/// // Four points at once, at these distances from their base nodes: the weights of each add up to one.
/// let [left, right] = Hat.weights(0, Lanes::new([0.0, 0.25, 0.5, 0.75]));
/// assert_eq!((left + right).to_array(), [1.0; 4]);
/// assert_eq!(right.to_array(), [0.0, 0.25, 0.5, 0.75]);
/// ```
///
/// To let scenes choose it, see "Where to add" in ARCHITECTURE.md.
pub trait Shape<const W: usize>: Copy + Send + Sync + 'static {
    /// Smallest distance of a point from its base node, along x and y, in cells.
    fn offset(&self) -> [f64; 2];

    /// `S` at the nodes `base`, `base + 1`, ... along `axis` for points at `d` cells from the base node.
    fn weights(&self, axis: usize, d: Lanes) -> [Lanes; W];

    /// `dS/dxi` likewise, per cell.
    fn gradients(&self, axis: usize, d: Lanes) -> [Lanes; W];

    /// Upper bound over all positions of `sum_I (dS_I/dxi)^2 / S_I` along `axis`, per cell squared: the stiffest
    /// place that a point can lie at, relative to the mass that it has there. `None` where there is no bound (linear
    /// hats: a point that has just entered a cell loads a node to which it gives no mass).
    fn stiffest(&self, axis: usize) -> Option<f64>;

    /// Whether fixed and slip walls are mirrors to it ([`crate::state::walls`]): where points within the domain reach nodes beyond.
    const MIRRORED: bool;

    /// `L^2 D_p^-1` of affine transfers (eq. 29), where `D_p` is the same at every position.
    const INVERSE_INERTIA: Option<f64>;
}

/// Quadratic B-spline (docs/physics.md section 1, Jiang 2020 A4 corrected).
#[derive(Debug, Clone, Copy)]
pub struct QuadraticBspline;

impl Shape<3> for QuadraticBspline {
    const MIRRORED: bool = true;
    const INVERSE_INERTIA: Option<f64> = Some(4.0);

    fn offset(&self) -> [f64; 2] {
        [0.5, 0.5]
    }

    #[inline(always)]
    fn weights(&self, _axis: usize, d: Lanes) -> [Lanes; 3] {
        let (left, middle, right) = (splat(1.5) - d, d - splat(1.0), d - splat(0.5));
        [
            splat(0.5) * left * left,
            middle.mul_neg_add(middle, splat(0.75)),
            splat(0.5) * right * right,
        ]
    }

    #[inline(always)]
    fn gradients(&self, _axis: usize, d: Lanes) -> [Lanes; 3] {
        [
            d - splat(1.5),
            d.mul_neg_add(splat(2.0), splat(2.0)),
            d - splat(0.5),
        ]
    }

    // With t = d - 1: (1/2 - t)^2 / (1/2 (1/2 - t)^2) = 2 at either side, and 4 t^2 / (3/4 - t^2) between, which
    // is largest at t = 1/2.
    fn stiffest(&self, _axis: usize) -> Option<f64> {
        Some(6.0)
    }
}

/// Cubic B-spline (Jiang 2020 A4).
#[derive(Debug, Clone, Copy)]
pub struct CubicBspline;

impl Shape<4> for CubicBspline {
    const MIRRORED: bool = true;
    const INVERSE_INERTIA: Option<f64> = Some(3.0);

    fn offset(&self) -> [f64; 2] {
        [1.0, 1.0]
    }

    #[inline(always)]
    fn weights(&self, _axis: usize, d: Lanes) -> [Lanes; 4] {
        let t = d - splat(1.0);
        let u = splat(1.0) - t;
        let near = |t: Lanes| (t * t).mul_add(t.mul_sub(splat(0.5), splat(1.0)), splat(2.0 / 3.0));
        [
            splat(1.0 / 6.0) * (u * u) * u,
            near(t),
            near(u),
            splat(1.0 / 6.0) * (t * t) * t,
        ]
    }

    #[inline(always)]
    fn gradients(&self, _axis: usize, d: Lanes) -> [Lanes; 4] {
        let t = d - splat(1.0);
        let u = splat(1.0) - t;
        let near = |t: Lanes| t * t.mul_sub(splat(1.5), splat(2.0));
        [splat(-0.5) * u * u, near(t), -near(u), splat(0.5) * t * t]
    }

    // The two outer nodes give 3/2 together; the sum of the inner ones has its largest value, 1.63682, at a quarter of
    // a cell from either node, found by scanning all positions (a test does it again).
    fn stiffest(&self, _axis: usize) -> Option<f64> {
        Some(3.13683)
    }
}

/// Linear hat function: the original material point method.
///
/// A hat has its whole gradient where it vanishes. A node that a point reaches without a weight would have a part in the
/// gradient of the velocity and no mass, so no velocity. So a point is at least [`NEAREST`] away from the nodes of its cell.
#[derive(Debug, Clone, Copy)]
pub struct Linear;

/// Least distance in cells of a point from a node with hats: as much as positions are rounded by in a domain of thousands
/// of cells.
const NEAREST: f64 = 1e-12;

impl Shape<2> for Linear {
    const MIRRORED: bool = false;
    const INVERSE_INERTIA: Option<f64> = None;

    fn offset(&self) -> [f64; 2] {
        [0.0, 0.0]
    }

    #[inline(always)]
    fn weights(&self, _axis: usize, d: Lanes) -> [Lanes; 2] {
        let d = d.fast_max(splat(NEAREST)).fast_min(splat(1.0 - NEAREST));
        [splat(1.0) - d, d]
    }

    #[inline(always)]
    fn gradients(&self, _axis: usize, _d: Lanes) -> [Lanes; 2] {
        [splat(-1.0), splat(1.0)]
    }

    fn stiffest(&self, _axis: usize) -> Option<f64> {
        None
    }
}

/// Uniform generalised interpolation (Jiang 2020 A2): the hat function averaged over a box of half width `l_p`.
///
/// With `u = max(0, d - (1 - l))` and `q = u^2 / 4l`, `l = l_p / L <= 1/2`, the seven branches of A2 are the three
/// polynomials `1 - d + q`, `d - 2q`, `q` at the nodes 0, 1, 2 from the base `floor(xi - l)`. Where the box spans a node, the
/// first is `(2l - u)^2 / 4l`, and is computed so: the difference would be 0 before its gradient is, and a node would get
/// forces without mass.
#[derive(Debug, Clone, Copy)]
pub struct Ugimp {
    /// `l_p / L` along x and y.
    half_width: [f64; 2],
}

impl Ugimp {
    /// Boxes of half width `half_width` (cells, above 0 and at most one half) along x and y.
    pub fn new(half_width: [f64; 2]) -> Self {
        debug_assert!(half_width.iter().all(|&l| l > 0.0 && l <= 0.5));
        Self { half_width }
    }
}

impl Shape<3> for Ugimp {
    const MIRRORED: bool = false;
    const INVERSE_INERTIA: Option<f64> = None;

    fn offset(&self) -> [f64; 2] {
        self.half_width
    }

    #[inline(always)]
    fn weights(&self, axis: usize, d: Lanes) -> [Lanes; 3] {
        let l = self.half_width[axis];
        let u = (d - splat(1.0 - l)).fast_max(ZERO);
        let q = splat(0.25 / l) * u * u;
        let left = splat(2.0 * l) - u;
        let first = u
            .simd_gt(ZERO)
            .select(splat(0.25 / l) * left * left, splat(1.0) - d);
        [first, d - q - q, q]
    }

    #[inline(always)]
    fn gradients(&self, axis: usize, d: Lanes) -> [Lanes; 3] {
        let l = self.half_width[axis];
        let u = (d - splat(1.0 - l)).fast_max(ZERO);
        let slope = splat(0.5 / l) * u;
        let left = splat(0.5 / l) * (splat(2.0 * l) - u);
        let first = u.simd_gt(ZERO).select(left, splat(1.0));
        [-first, splat(1.0) - slope - slope, slope]
    }

    // While the box spans a node, either outer node gives 1/l and the middle one at most 1/(1 - l), at the ends of
    // that range; while it lies within a cell the two nodes give 1/d + 1/(1 - d) <= 1/l + 1/(1 - l).
    fn stiffest(&self, axis: usize) -> Option<f64> {
        let l = self.half_width[axis];
        Some(2.0 / l + 1.0 / (1.0 - l))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over a thousand places in a cell. The bound is reached within 2 %.
    fn check<const W: usize, S: Shape<W>>(shape: S) {
        let mut stiffest: f64 = 0.0;
        let places = (0..1000).map(|step| (f64::from(step) + 0.5) / 1000.0);
        for place in places.chain([1e-9, 1.0 - 1e-9]) {
            let d = splat(shape.offset()[0] + place);
            let [w, g] =
                [shape.weights(0, d), shape.gradients(0, d)].map(|of| of.map(|x| x.to_array()[2]));
            let own = (0..W).filter(|&i| g[i] != 0.0).map(|i| g[i] * g[i] / w[i]);
            stiffest = stiffest.max(own.sum());
        }
        let bound = shape.stiffest(0).expect("a bound");
        assert!(stiffest <= bound * (1.0 + 1e-12), "{stiffest} {bound}");
        assert!(stiffest > 0.98 * bound, "{stiffest} {bound}");
    }

    #[test]
    fn no_place_is_stiffer_than_the_bound() {
        check(QuadraticBspline);
        check(CubicBspline);
        for l in [0.05, 0.25, 1.0 / 6.0, 0.5] {
            check(Ugimp::new([l, 0.3]));
        }
    }
}
