//! The whole step against the oracle, on random clouds under random contact forces.

use interface::config::{Fill, ShapeFunction, Spacing, StressUpdate, Transfer, Wall, Walls};
use interface::solver::MpmSolver;
use interface::wire::{EnvelopeVertex, ImpForce};

use super::{BULK, Given, Random, SHEAR, Stepper, block, configured};
use crate::reference::{Kernel, RefPoint, Reference};

/// An outline so large that every point is an IMP.
pub fn everywhere() -> Vec<EnvelopeVertex> {
    [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]
        .map(|position| EnvelopeVertex {
            body: 0,
            position,
            reach: 0.0,
        })
        .to_vec()
}

fn compare(shape: ShapeFunction, transfer: Transfer, stress_update: StressUpdate, seed: u64) {
    let mut random = Random::new(seed);
    let mut config = block();
    config.shape = shape;
    config.transfer = transfer;
    config.stress_update = stress_update;
    config.gravity = [1.0, -9.81];
    config.walls = Walls {
        left: Wall::Slip,
        bottom: Wall::Fixed,
        ..Walls::default()
    };
    // Against the left and lower wall, over several tiles.
    let positions: Vec<[f64; 2]> = (0..150)
        .map(|_| [random.between(-0.19, 0.45), random.between(0.11, 0.7)])
        .collect();
    let side = 0.04;
    config.groups[0].fill = Fill::Points {
        positions: positions.clone(),
    };
    config.groups[0].spacing = Spacing::Distance(side);
    config.groups[0].velocity = [0.3, -0.2];
    let mut mpm = configured(&config);
    assert_eq!(mpm.select_imps(&everywhere()).len(), positions.len());

    let volume = side * side;
    let mut reference = Reference {
        points: positions
            .iter()
            .map(|&x| RefPoint {
                x,
                v: [0.3, -0.2],
                b: [[0.0; 2]; 2],
                stress: [0.0; 4],
                ratio: 1.0,
                mass: 1000.0 * volume,
                volume,
            })
            .collect(),
        kernels: [match shape {
            ShapeFunction::Linear => Kernel::Linear,
            ShapeFunction::Ugimp => Kernel::Ugimp(0.5 * side / 0.05),
            ShapeFunction::QuadraticBspline => Kernel::Quadratic,
            ShapeFunction::CubicBspline => Kernel::Cubic,
        }; 2],
        transfer,
        lower: config.domain[0],
        cells: [20, 16],
        cell: 0.05,
        gravity: config.gravity,
        walls: config.walls,
        stress_update,
        bulk: BULK,
        shear: SHEAR,
        wall_impulse: [0.0; 2],
    };

    let mut stepper = Stepper::new();
    let mut impulse = [0.0; 2];
    let mass: f64 = reference.points.iter().map(|p| p.mass).sum();
    for n in 0..12 {
        let dt = random.between(2e-4, 5e-4);
        let forces: Vec<[f64; 2]> = positions
            .iter()
            .map(|_| [random.between(-900.0, 900.0), random.between(-900.0, 900.0)])
            .collect();
        let before = stepper.before;
        let given = forces.iter().map(|&force| ImpForce {
            force,
            stiffness: 0.0,
        });
        stepper
            .step(&mut mpm, dt, true, &mut Given(given.collect()))
            .expect("a sound step");
        reference.step(before, dt, &forces);
        for a in 0..2 {
            impulse[a] +=
                reference.wall_impulse[a] + 0.5 * (before + dt) * mass * config.gravity[a];
        }
        for (p, r) in mpm.points().iter().zip(&reference.points) {
            for a in 0..2 {
                let (dx, dv) = (p.position[a] - r.x[a], p.velocity[a] - r.v[a]);
                assert!(
                    dx.abs() < 1e-13 && dv.abs() < 1e-11,
                    "{shape:?} {transfer:?}: point {} in step {n}: {dx:e} m, {dv:e} m/s",
                    p.id
                );
            }
        }
        let applied = mpm.measurement().ledger.applied_impulse;
        for a in 0..2 {
            assert!(
                (applied[a] - impulse[a]).abs() < 1e-10 * mass,
                "impulse of gravity and walls"
            );
        }
    }
    // The test must have tested something: the forces have stirred the points.
    let speeds = || mpm.points().into_iter().map(|p| p.velocity[0]);
    let spread = speeds().fold(f64::MIN, f64::max) - speeds().fold(f64::MAX, f64::min);
    assert!(spread > 0.1, "{spread}");
}

#[test]
fn every_shape_and_transfer_agrees_with_the_oracle() {
    let shapes = [
        ShapeFunction::Linear,
        ShapeFunction::Ugimp,
        ShapeFunction::QuadraticBspline,
        ShapeFunction::CubicBspline,
    ];
    let transfers = [
        Transfer::Pic,
        Transfer::Flip,
        Transfer::Blend { pic_fraction: 0.3 },
        Transfer::Apic,
        Transfer::Xpic { order: 1 },
        Transfer::Xpic { order: 3 },
    ];
    for (i, shape) in shapes.into_iter().enumerate() {
        for (j, transfer) in transfers.into_iter().enumerate() {
            let affine = matches!(
                shape,
                ShapeFunction::QuadraticBspline | ShapeFunction::CubicBspline
            );
            if affine || transfer != Transfer::Apic {
                compare(shape, transfer, StressUpdate::Usf, 10 * i as u64 + j as u64);
            }
        }
    }
}

#[test]
fn stresses_updated_last_agree_with_the_oracle() {
    for update in [StressUpdate::Usl, StressUpdate::Musl] {
        compare(ShapeFunction::QuadraticBspline, Transfer::Apic, update, 50);
        compare(ShapeFunction::Ugimp, Transfer::Flip, update, 51);
        compare(
            ShapeFunction::Linear,
            Transfer::Blend { pic_fraction: 0.4 },
            update,
            52,
        );
    }
}
