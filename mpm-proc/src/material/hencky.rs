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
//! (`docs/decisions/0017-hencky.md`). Stress and energy are functions of where the material is, whatever the path and the step.

use super::Deformation;
use crate::lanes::{Lanes, splat};

/// What an interval makes of four points.
#[derive(Debug, Clone, Copy)]
pub struct Strained {
    /// Half the difference of the normal Kirchhoff stresses in the plane, and the shear, in Pa.
    pub deviator: [Lanes; 2],
    /// `ln det f`: what it adds to the strain that is the same in all directions of the plane.
    pub trace: Lanes,
    /// `det f`: area after it over area before.
    pub swelling: Lanes,
}

/// Strains points that have this `deviator` of the Kirchhoff stress in the plane (Pa), with the modulus `shear` (Pa).
///
/// Turned inside out, which needs a step beyond all limits, nothing of it is a number.
#[inline(always)]
pub fn strain(shear: f64, deviator: [Lanes; 2], by: &Deformation) -> Strained {
    let (one, two) = (splat(1.0), splat(2.0));
    let h = splat(0.5) * (by.xx + by.yy);
    let s = [splat(0.5) * (by.xx - by.yy), splat(0.5) * (by.xy + by.yx)];
    let w = splat(0.5) * (by.yx - by.xy);
    let quarter = splat(0.25) * (by.xx * by.yy - by.xy * by.yx);
    let (k, sum) = (one - quarter, one + quarter);
    let (up, down) = (sum + h, sum - h);
    let product = up * down;
    let per = one / (product * sum);
    let per_product = per * sum;

    let strain = deviator.map(|s| s * splat(1.0 / shear));
    let ratio = sinh_over(strain[0].mul_add(strain[0], strain[1] * strain[1]));
    let p = strain.map(|x| x * ratio);
    let c = p[0].mul_add(p[0], p[1].mul_add(p[1], one)).sqrt();
    let keep = k * k - s[0].mul_add(s[0], s[1].mul_add(s[1], w * w));
    let turn = two * k * w;
    let along = two * s[0].mul_add(p[0], s[1] * p[1]);
    // J turns (a, b), which stands for a matrix ((a, b), (b, -a)), into (-b, a).
    let stretch = two * c * k + along;
    let slant = two * c * w;
    let p = [
        stretch.mul_add(s[0], keep * p[0]) - slant.mul_add(s[1], turn * p[1]),
        stretch.mul_add(s[1], keep * p[1]) + slant.mul_add(s[0], turn * p[0]),
    ]
    .map(|p| p * per_product);
    let back = splat(shear) * arsinh_over(p[0].mul_add(p[0], p[1] * p[1]));
    Strained {
        deviator: p.map(|p| p * back),
        trace: twice_artanh(h * product * per),
        swelling: up * up * per_product,
    }
}

/// Where the squares of strains and stretches are below it, polynomials do: principal strains that differ by up to a half.
const SMALL: f64 = 0.25;

/// `sinh(x)/x` of `square = x^2`. Series: the next term is below 1e-16 of it where the square is small.
#[inline(always)]
fn sinh_over(square: Lanes) -> Lanes {
    const PER_FACTORIAL: [f64; 7] = [
        1.0,
        1.0 / 6.0,
        1.0 / 120.0,
        1.0 / 5_040.0,
        1.0 / 362_880.0,
        1.0 / 39_916_800.0,
        1.0 / 6_227_020_800.0,
    ];
    let near = polynomial(&PER_FACTORIAL, square);
    let far = square.simd_gt(splat(SMALL));
    if far.any() {
        far.select(far_sinh_over(square), near)
    } else {
        near
    }
}

#[cold]
#[inline(never)]
fn far_sinh_over(square: Lanes) -> Lanes {
    let x = square.sqrt();
    let e = x.exp();
    splat(0.5) * (e - splat(1.0) / e) / x
}

/// `arsinh(r)/r` of `square = r^2`. Polynomial through Chebyshev's nodes of [0, 1/4], whose error is 1.4e-17.
#[inline(always)]
fn arsinh_over(square: Lanes) -> Lanes {
    const FITTED: [f64; 12] = [
        1.0,
        -0.16666666666665123,
        0.07499999999704385,
        -0.04464285692054213,
        0.030381935774005903,
        -0.02237195860704631,
        0.017349806102795153,
        -0.013935825648041482,
        0.011358946619800086,
        -0.008891787699318211,
        0.005766357220813826,
        -0.0021645995498866606,
    ];
    let near = polynomial(&FITTED, square);
    let far = square.simd_gt(splat(SMALL));
    if far.any() {
        far.select(far_arsinh_over(square), near)
    } else {
        near
    }
}

#[cold]
#[inline(never)]
fn far_arsinh_over(square: Lanes) -> Lanes {
    let r = square.sqrt();
    (r + (square + splat(1.0)).sqrt()).ln() / r
}

/// `2 artanh(z)`. Series: the next term is below 1e-16 of it up to strains of 6 % in the interval.
#[inline(always)]
fn twice_artanh(z: Lanes) -> Lanes {
    const SERIES: [f64; 6] = [2.0, 2.0 / 3.0, 2.0 / 5.0, 2.0 / 7.0, 2.0 / 9.0, 2.0 / 11.0];
    let square = z * z;
    let near = z * polynomial(&SERIES, square);
    let far = square.simd_gt(splat(1.0 / 1024.0));
    if far.any() {
        far.select(far_twice_artanh(z), near)
    } else {
        near
    }
}

#[cold]
#[inline(never)]
fn far_twice_artanh(z: Lanes) -> Lanes {
    ((splat(1.0) + z) / (splat(1.0) - z)).ln()
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

    /// Near and far, and where one gives way to the other.
    #[test]
    fn functions_are_the_library_s() {
        for i in 1..4000 {
            let x = 1e-3 * f64::from(i);
            let found = |f: fn(Lanes) -> Lanes, x: f64| f(splat(x)).to_array()[0];
            let sinh = found(sinh_over, x * x);
            assert!((sinh * x / x.sinh() - 1.0).abs() < 2e-15, "{x} {sinh}");
            let arsinh = found(arsinh_over, x * x);
            assert!((arsinh * x / x.asinh() - 1.0).abs() < 2e-15, "{x} {arsinh}");
            let z = 2.4e-4 * f64::from(i);
            let artanh = found(twice_artanh, z);
            assert!(
                (artanh / (2.0 * z.atanh()) - 1.0).abs() < 1e-14,
                "{z} {artanh}"
            );
        }
        for f in [sinh_over, arsinh_over] {
            assert_eq!(f(splat(0.0)).to_array(), [1.0; 4]);
        }
    }
}
