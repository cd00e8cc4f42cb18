//! What must hold of every path of deformation: energy is a function of state, and its changes are the work of the stress.

use interface::config::material::Frictional;
use nalgebra::Matrix2;
use proptest::prelude::*;

use super::single_point::{Path, stress};
use crate::material::{
    DruckerPrager, Jaumann, Material, Moduli, MohrCoulomb, NeoHookean, PlaneStrain, PlaneStress,
    VonMises,
};

const MODULI: Moduli = Moduli {
    bulk: 5.0e5,
    shear: 3.0e5,
    density: 1000.0,
};

const HENCKY: PlaneStrain = PlaneStrain(MODULI);

/// A deformation gradient: principal stretches, and turns before and after it, so small that the straight way to it from
/// the identity does not come near a point.
fn gradient(stretch: f64) -> impl Strategy<Value = Matrix2<f64>> {
    (
        [-stretch..stretch, -stretch..stretch],
        [-0.6_f64..0.6, -0.6_f64..0.6],
    )
        .prop_map(|([a, b], [first, then])| {
            let turn = |angle: f64| {
                let (sin, cos) = angle.sin_cos();
                Matrix2::new(cos, -sin, sin, cos)
            };
            turn(then) * Matrix2::new(a.exp(), 0.0, 0.0, b.exp()) * turn(first)
        })
}

/// Takes the point from `from` to `to` along the straight line between them.
fn go<M: Material>(path: &mut Path<M>, from: Matrix2<f64>, to: Matrix2<f64>, steps: usize) {
    let at = |i: usize| from + (to - from) * (i as f64 / steps as f64);
    for i in 0..steps {
        let f = at(i + 1) * at(i).try_inverse().expect("a regular deformation");
        let one = Matrix2::identity();
        // The same as seen from the middle of the step.
        let middle = (f - one) * 2.0 * (f + one).try_inverse().expect("no half turn");
        path.apply([[middle.m11, middle.m12], [middle.m21, middle.m22]], 1);
    }
}

/// Around the corners and back to the first.
fn around<M: Material>(model: M, corners: &[Matrix2<f64>], steps: usize) -> Path<M> {
    let mut path = Path::new(model);
    let mut at = Matrix2::identity();
    for &to in corners.iter().chain(&[Matrix2::identity()]) {
        go(&mut path, at, to, steps);
        at = to;
    }
    path
}

/// Corners whose straight ways stay far from what turns the material inside out.
fn loops() -> impl Strategy<Value = Vec<Matrix2<f64>>> {
    proptest::collection::vec(gradient(0.3), 1..4).prop_filter("regular all the way", |corners| {
        let mut at = Matrix2::identity();
        corners.iter().chain(&[Matrix2::identity()]).all(|&to| {
            let least = (0..=20)
                .map(|i| (at + (to - at) * (0.05 * f64::from(i))).determinant())
                .fold(f64::INFINITY, f64::min);
            at = to;
            least > 0.3
        })
    })
}

/// Where the path is closed: no stress, no energy, and no work but for its quadrature, which is of second order. Anything
/// that has no energy would be left with work that does not depend on the number of steps.
fn closes<M: Material>(
    model: M,
    corners: &[Matrix2<f64>],
    scale: f64,
) -> Result<(), TestCaseError> {
    let [coarse, fine] = [100, 200].map(|steps| around(model, corners, steps));
    prop_assert!(fine.energy().abs() < 1e-12 * scale, "{:e}", fine.energy());
    prop_assert!(stress(&fine.point).iter().all(|s| s.abs() < 1e-9 * scale));
    let (coarse, fine) = (coarse.work.abs(), fine.work.abs());
    prop_assert!(fine < 1e-3 * scale, "{fine:e}");
    prop_assert!(
        fine < 0.3 * coarse || fine < 1e-7 * scale,
        "{coarse:e} {fine:e}"
    );
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_closed_path_does_no_work(corners in loops()) {
        closes(HENCKY, &corners, MODULI.shear)?;
        closes(PlaneStress(MODULI), &corners, MODULI.shear)?;
        closes(NeoHookean(MODULI), &corners, MODULI.shear)?;
    }

    /// Swollen, sheared, shrunk and sheared back: the shear is paid for at one volume and given back at another. The Jaumann
    /// rate of Cauchy stress keeps `(J - 1) G gamma^2 / 2` of it to leading order, however small the steps.
    #[test]
    fn jaumann_does_work_on_a_closed_path(swell in 0.05..0.2_f64, gamma in 0.05..0.2_f64) {
        let work = |steps| {
            let mut path = Path::new(Jaumann(PlaneStrain(MODULI)));
            path.stretch([swell, swell], steps);
            path.shear(gamma, steps);
            path.stretch([-swell, -swell], steps);
            path.shear(-gamma, steps);
            path.work
        };
        let expected = 0.5 * ((2.0 * swell).exp() - 1.0) * MODULI.shear * gamma * gamma;
        let [coarse, fine] = [500, 1000].map(work);
        prop_assert!((fine / expected - 1.0).abs() < 0.05, "{fine:e} {expected:e}");
        prop_assert!((fine / coarse - 1.0).abs() < 1e-2, "{coarse:e} {fine:e}");
        let mut path = Path::new(HENCKY);
        path.stretch([swell, swell], 500);
        path.shear(gamma, 500);
        path.stretch([-swell, -swell], 500);
        path.shear(-gamma, 500);
        prop_assert!(path.work.abs() < 1e-4 * expected, "{:e}", path.work);
    }

    /// A turn of the whole takes the stress with it and leaves the energy; it does not matter when it comes.
    #[test]
    fn stress_turns_with_the_material(to in gradient(0.4), angle in -2.5..2.5_f64, steps in 1_usize..30) {
        let mut path = Path::new(HENCKY);
        go(&mut path, Matrix2::identity(), to, 40);
        let [xx, yy, zz, xy] = stress(&path.point);
        let energy = path.energy();
        // A step turns by twice the angle whose tangent is half its spin.
        let spin = 2.0 * (0.5 * angle / steps as f64).tan() * steps as f64;
        path.turn(spin, steps);
        let (sin, cos) = angle.sin_cos();
        let turn = Matrix2::new(cos, -sin, sin, cos);
        let turned = turn * Matrix2::new(xx, xy, xy, yy) * turn.transpose();
        let [txx, tyy, tzz, txy] = stress(&path.point);
        let off = (Matrix2::new(txx, txy, txy, tyy) - turned).norm() + (tzz - zz).abs();
        prop_assert!(off < 1e-12 * MODULI.shear, "{off:e}");
        prop_assert!((path.energy() - energy).abs() < 1e-12 * energy);
        let mut first = Path::new(HENCKY);
        first.turn(spin, steps);
        go(&mut first, turn, turn * to, 40);
        let [fxx, fyy, fzz, fxy] = stress(&first.point);
        let off = [fxx - txx, fyy - tyy, fzz - tzz, fxy - txy];
        prop_assert!(off.iter().all(|x| x.abs() < 1e-12 * MODULI.shear), "{off:?}");
    }

    /// Where it is, and not how it came there: the stress of the logarithm of the stretch, by eigenvectors.
    #[test]
    fn stress_is_a_function_of_the_deformation(corners in loops(), steps in 3_usize..50) {
        let mut path = Path::new(HENCKY);
        let mut at = Matrix2::identity();
        for &to in &corners {
            go(&mut path, at, to, steps);
            at = to;
        }
        let eigen = (at * at.transpose()).symmetric_eigen();
        let ln = eigen.eigenvalues.map(|b| 0.5 * b.ln());
        let strain = eigen.eigenvectors * Matrix2::from_diagonal(&ln) * eigen.eigenvectors.transpose();
        let j = at.determinant();
        let expected = (strain * (2.0 * MODULI.shear)
            + Matrix2::identity() * (MODULI.lame() * strain.trace())) / j;
        let [xx, yy, zz, xy] = stress(&path.point);
        let off = (Matrix2::new(xx, xy, xy, yy) - expected).norm();
        prop_assert!(off < 1e-10 * MODULI.shear, "{off:e}");
        prop_assert!((zz - MODULI.lame() * j.ln() / j).abs() < 1e-10 * MODULI.shear);
    }

    /// The energy is the integral of the power, and what plastic flow takes of it is never less than nothing.
    #[test]
    fn work_is_stored_or_dissipated(corners in loops(), psi in 0.0..30.0_f64, cohesion in 0.0..3e4_f64) {
        let numbers = Frictional {
            bulk_modulus: MODULI.bulk,
            shear_modulus: MODULI.shear,
            friction_angle: 30.0,
            dilation_angle: psi,
            cohesion,
            tensile_strength: 0.5 * cohesion,
            critical_state: None,
            separates: false,
        };
        balances(HENCKY, &corners)?;
        balances(DruckerPrager::new(1000.0, &numbers), &corners)?;
        balances(MohrCoulomb::new(1000.0, &numbers), &corners)?;
        let metal = VonMises {
            moduli: MODULI,
            yield_stress: 1e4 + cohesion,
            hardening: 1e5,
        };
        balances(metal, &corners)?;
    }
}

fn balances<M: Material>(model: M, corners: &[Matrix2<f64>]) -> Result<(), TestCaseError> {
    let off = |steps: usize| -> Result<f64, TestCaseError> {
        let mut path = Path::new(model);
        let (mut at, mut before) = (Matrix2::identity(), 0.0);
        for &to in corners {
            for i in 0..steps {
                let way = |i: usize| at + (to - at) * (i as f64 / steps as f64);
                go(&mut path, way(i), way(i + 1), 1);
                prop_assert!(path.plastic - before >= -1e-12 * MODULI.shear);
                before = path.plastic;
            }
            at = to;
        }
        Ok((path.work - path.energy() - path.plastic).abs() / MODULI.shear)
    };
    // First order where it flows, because the return mapping uses the strains at the end of a step.
    let [coarse, fine] = [off(100)?, off(400)?];
    if fine < 2e-3 && (fine < 0.4 * coarse || fine < 1e-4) {
        return Ok(());
    }
    // With long steps of much flow, or errors that cancel at one number of steps, the order shows at a quarter of the step.
    let finest = off(1600)?;
    prop_assert!(
        finest < 1e-3 && (finest < 0.4 * fine || finest < 1e-4),
        "{coarse:e} {fine:e} {finest:e}"
    );
    Ok(())
}
