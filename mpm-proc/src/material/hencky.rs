//! Logarithmic strain of four points in the plane, and how an interval changes it, exactly and without matrices.
//!
//! Hencky's energy is `W = K/2 tr(eps)^2 + G dev(eps):dev(eps)` per initial volume, with `eps = ln(b_e)/2` of the elastic left
//! Cauchy-Green tensor, so the Kirchhoff stress is `tau = K tr(eps) 1 + 2 G dev(eps)`: a linear map, by which `tau` is all that
//! has to be kept of `b_e`. An interval turns and stretches it, `b_e <- f b_e f^T`.
//!
//! In the plane `b_e = e^t (c 1 + P)`, where `t = tr(eps)`, `P` is symmetric without a trace, and `c^2 = 1 + |P|^2` since the
//! factor has determinant 1. With `x` the difference of the principal strains, `c = cosh x` and `P = sinh(x)/x` times twice
//! the deviator of `eps`: hence no eigenvectors, and no cancellation at small strains. With `f` the Cayley transform of the
//! gradient `h 1 + S + w J` in the middle of the interval (`S` symmetric without a trace, `J` a quarter turn) and
//! `D = h^2 - |S|^2 + w^2` its determinant,
//!
//! ```text
//! f         = (k 1 + S + w J) / (1 - h + D/4),   k = 1 - D/4
//! det f     = (1 + h + D/4) / (1 - h + D/4),     ln det f = 2 artanh( h / (1 + D/4) )
//! P <- { 2 c (k S + w J S) + (k^2 - |S|^2 - w^2) P + 2 k w J P + 2 (S.P) S } / { (1 + D/4)^2 - h^2 }
//! ```
//!
//! (`docs/decisions/0017-hencky.md`). Stress and energy are functions of the deformation, for any path and any step.

use super::point::Deformation;
use crate::kernel::lanes::{Lanes, splat};

/// The result of an interval for four points.
#[derive(Debug, Clone, Copy)]
pub struct Strained {
    /// Half the difference of the normal Kirchhoff stresses in the plane, and the shear, in Pa.
    pub deviator: [Lanes; 2],
    /// `ln det f`: the part that is added to the strain and is the same in all directions of the plane.
    pub trace: Lanes,
    /// Volume over the initial one after the interval in plane strain, and its inverse.
    pub volume: Lanes,
    pub per_volume: Lanes,
}

/// Strains points that have this `deviator` of the Kirchhoff stress in the plane (Pa) and this `volume` over the initial
/// one, with the modulus `shear` (Pa).
///
/// If a point is turned inside out, which only a step far beyond all limits can do, the results are NaN.
#[inline(always)]
pub fn strain(shear: f64, deviator: [Lanes; 2], volume: Lanes, by: &Deformation) -> Strained {
    let (strained, far) = strain_by::<Near>(shear, deviator, volume, by);
    // One branch, with no value kept across it: a call in the middle of the step would cost all registers.
    if far.any() {
        strain_far(shear, deviator, volume, by)
    } else {
        strained
    }
}

#[cold]
#[inline(never)]
fn strain_far(shear: f64, deviator: [Lanes; 2], volume: Lanes, by: &Deformation) -> Strained {
    strain_by::<Far>(shear, deviator, volume, by).0
}

/// The result of an interval, and the lanes (all bits set) in which the functions of [`Near`] do not hold.
#[inline(always)]
fn strain_by<F: Functions>(
    shear: f64,
    deviator: [Lanes; 2],
    volume: Lanes,
    by: &Deformation,
) -> (Strained, Lanes) {
    // Everything but D is multiplied by four, so that sums replace products.
    let four = splat(4.0);
    let [xx, xy, yx, yy] = [by.xx + by.xx, by.xy + by.xy, by.yx + by.yx, by.yy + by.yy];
    let h = xx + yy;
    let s = [xx - yy, xy + yx];
    let w = yx - xy;
    let det = by.xx.mul_sub(by.yy, by.xy * by.yx);
    let (k, sum) = (four - det, four + det);
    let (up, down) = (sum + h, sum - h);
    let product = up * down;
    let with_volume = sum * volume;
    let per = splat(1.0) / (product * with_volume); // the only division
    let per_product = per * with_volume;

    let per_shear = splat(1.0 / shear);
    let strain = [deviator[0] * per_shear, deviator[1] * per_shear];
    let x = strain[0].mul_add(strain[0], strain[1] * strain[1]);
    let [ratio, c] = F::hyperbolic(x);
    let p = [strain[0] * ratio, strain[1] * ratio];
    let keep = (w + w).mul_neg_add(w, product); // k^2 - |S|^2 - w^2
    let turn = (k + k) * w;
    let along = s[0].mul_add(p[0], s[1] * p[1]);
    // J turns (a, b), which stands for a matrix ((a, b), (b, -a)), into (-b, a).
    let stretch = (c + c).mul_add(k, along + along);
    let slant = (c + c) * w;
    let p = [
        stretch.mul_add(s[0], keep * p[0]) - slant.mul_add(s[1], turn * p[1]),
        stretch.mul_add(s[1], keep * p[1]) + slant.mul_add(s[0], turn * p[0]),
    ];
    let p = [p[0] * per_product, p[1] * per_product];
    let r = p[0].mul_add(p[0], p[1] * p[1]);
    let back = splat(shear) * F::arsinh_over(r);
    let z = (h * product) * (per * volume);
    let z_square = z * z;
    let far = x.fast_max(r).fast_max(splat(64.0) * z_square);
    let strained = Strained {
        deviator: [p[0] * back, p[1] * back],
        trace: z * F::twice_artanh_over(z_square),
        volume: (up * volume) * (up * per_product),
        per_volume: (down * down) * (per * sum),
    };
    (strained, far.simd_gt(splat(SMALL)))
}

/// Polynomials are used if the squares of strains and stretches are below this: principal strains that differ by up to
/// an eighth, and an eighth of that in one interval.
const SMALL: f64 = 1.0 / 64.0;

/// The functions that strain and stretch need.
trait Functions {
    /// `sinh(x)/x` and `cosh(x)` of `square = x^2`.
    fn hyperbolic(square: Lanes) -> [Lanes; 2];
    /// `arsinh(r)/r` of `square = r^2`.
    fn arsinh_over(square: Lanes) -> Lanes;
    /// `2 artanh(z)/z` of `square = z^2`.
    fn twice_artanh_over(square: Lanes) -> Lanes;
}

/// For values up to [`SMALL`].
struct Near;

impl Functions for Near {
    /// Series: the next terms are below 1e-16.
    #[inline(always)]
    fn hyperbolic(square: Lanes) -> [Lanes; 2] {
        const SINH: [f64; 5] = [1.0, 1.0 / 6.0, 1.0 / 120.0, 1.0 / 5_040.0, 1.0 / 362_880.0];
        const COSH: [f64; 6] = [
            1.0,
            1.0 / 2.0,
            1.0 / 24.0,
            1.0 / 720.0,
            1.0 / 40_320.0,
            1.0 / 3_628_800.0,
        ];
        [polynomial(&SINH, square), polynomial(&COSH, square)]
    }

    /// Polynomial through Chebyshev's nodes of [0, 1/64], whose error is 3.7e-19.
    #[inline(always)]
    fn arsinh_over(square: Lanes) -> Lanes {
        const FITTED: [f64; 7] = [
            1.0,
            -0.166_666_666_666_664_35,
            0.074_999_999_997_618_22,
            -0.044_642_856_227_021_79,
            0.030_381_776_580_449_54,
            -0.022_356_334_566_458_733,
            0.016_609_582_368_610_487,
        ];
        polynomial(&FITTED, square)
    }

    /// Series: the next term is 4e-16 of it.
    #[inline(always)]
    fn twice_artanh_over(square: Lanes) -> Lanes {
        polynomial(&[2.0, 2.0 / 3.0, 2.0 / 5.0, 2.0 / 7.0], square)
    }
}

/// For any strain. Where [`Near`] holds, it is the same lane by lane, so that the stress of a point does not depend on
/// the other points of its block.
struct Far;

impl Functions for Far {
    fn hyperbolic(square: Lanes) -> [Lanes; 2] {
        let x = square.sqrt();
        let e = x.exp();
        let inverse = splat(1.0) / e;
        let half = splat(0.5);
        let [sinh, cosh] = Near::hyperbolic(square);
        let far = square.simd_gt(splat(SMALL));
        [
            far.select(half * (e - inverse) / x, sinh),
            far.select(half * (e + inverse), cosh),
        ]
    }

    fn arsinh_over(square: Lanes) -> Lanes {
        let r = square.sqrt();
        let far = (r + (square + splat(1.0)).sqrt()).ln() / r;
        square
            .simd_gt(splat(SMALL))
            .select(far, Near::arsinh_over(square))
    }

    fn twice_artanh_over(square: Lanes) -> Lanes {
        let z = square.sqrt();
        let far = ((splat(1.0) + z) / (splat(1.0) - z)).ln() / z;
        (splat(64.0) * square)
            .simd_gt(splat(SMALL))
            .select(far, Near::twice_artanh_over(square))
    }
}

#[inline(always)]
fn polynomial<const N: usize>(coefficients: &[f64; N], x: Lanes) -> Lanes {
    let mut value = splat(coefficients[N - 1]);
    for c in coefficients[..N - 1].iter().rev() {
        value = value.mul_add(x, splat(*c));
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn agree(of: fn(Lanes) -> Lanes, with: fn(f64) -> f64, x: f64, within: f64) {
        let (found, expected) = (of(splat(x)).to_array()[0], with(x));
        assert!(
            (found / expected - 1.0).abs() < within,
            "{x}: {found} {expected}"
        );
    }

    /// Near and far, and the limit between them.
    #[test]
    fn functions_are_the_library_s() {
        for i in 1..4000 {
            let x = 1e-3 * f64::from(i);
            agree(
                |x| Far::hyperbolic(x)[0],
                |x| x.sqrt().sinh() / x.sqrt(),
                x * x,
                2e-15,
            );
            agree(|x| Far::hyperbolic(x)[1], |x| x.sqrt().cosh(), x * x, 2e-15);
            agree(
                Far::arsinh_over,
                |x| x.sqrt().asinh() / x.sqrt(),
                x * x,
                2e-15,
            );
            let z = 2.4e-4 * f64::from(i);
            agree(
                Far::twice_artanh_over,
                |z| 2.0 * z.sqrt().atanh() / z.sqrt(),
                z * z,
                3e-14,
            );
        }
        assert_eq!(Near::arsinh_over(splat(0.0)).to_array(), [1.0; 4]);
        assert_eq!(
            Near::hyperbolic(splat(0.0)).map(Lanes::to_array),
            [[1.0; 4]; 2]
        );
    }

    /// A point gets the same bits whether its neighbours in the block are far or near.
    #[test]
    fn a_lane_is_strained_by_itself() {
        let by = |x: Lanes| Deformation {
            xx: x,
            xy: splat(0.001),
            yx: splat(-0.002),
            yy: splat(0.003),
        };
        let near = strain(3e5, [splat(1e3), splat(2e3)], splat(1.1), &by(splat(0.002)));
        for far in [[0.002, 0.5, 0.002, -0.3], [0.002, 0.002, 0.03, 0.002]] {
            let mixed = strain(
                3e5,
                [splat(1e3), splat(2e3)],
                splat(1.1),
                &by(Lanes::new(far)),
            );
            for (a, b) in [
                (near.deviator[0], mixed.deviator[0]),
                (near.trace, mixed.trace),
                (near.volume, mixed.volume),
            ] {
                assert_eq!(a.to_array()[0].to_bits(), b.to_array()[0].to_bits());
            }
        }
    }
}
