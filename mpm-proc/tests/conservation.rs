//! Momentum, angular momentum, and the same bits whatever the threads.

use interface::config::{ShapeFunction, Spacing, Transfer};
use interface::message::wire::ImpForce;
use interface::solver::MpmSolver;

use crate::blocks::{Random, Stepper, block, configured, everywhere, points_fill};
use mpm_proc::Mpm;

fn random_cloud(shape: ShapeFunction, transfer: Transfer, threads: usize) -> (Mpm, Random) {
    let mut random = Random::new(7);
    let mut config = block();
    config.shape = shape;
    config.transfer = transfer;
    config.threads = threads;
    config.groups[0].fill = points_fill(
        (0..700)
            .map(|_| [random.between(0.0, 0.6), random.between(0.2, 0.8)])
            .collect(),
    );
    config.groups[0].spacing = Spacing::Distance(0.02);
    let mut mpm = configured(&config);
    mpm.select_imps(&everywhere());
    (mpm, random)
}

fn kick(mpm: &mut Mpm, stepper: &mut Stepper, random: &mut Random) {
    let forces: Vec<ImpForce> = (0..700)
        .map(|_| ImpForce {
            force: [random.between(-900.0, 900.0), random.between(-900.0, 900.0)],
            couple: random.between(-9.0, 9.0),
            ..ImpForce::default()
        })
        .collect();
    stepper
        .step(mpm, 2e-4, false, &forces)
        .expect("a sound step");
}

/// Linear momentum, angular momentum of the points' own velocities, and a scale for both.
fn momenta(mpm: &Mpm) -> ([f64; 2], f64, f64) {
    let mass = 1000.0 * 0.02 * 0.02;
    let (mut p, mut l, mut scale) = ([0.0; 2], 0.0, 0.0);
    for q in mpm.points() {
        let ([x, y], [u, v]) = (q.position, q.velocity);
        p[0] += mass * u;
        p[1] += mass * v;
        l += mass * (x * v - y * u);
        scale += mass * (u.abs() + v.abs());
    }
    (p, l, scale)
}

#[test]
fn transfers_conserve_momentum() {
    for (shape, transfer) in [
        (ShapeFunction::Ugimp, Transfer::Flip),
        (ShapeFunction::Ugimp, Transfer::Blend { pic_fraction: 0.2 }),
        (ShapeFunction::QuadraticBspline, Transfer::Pic),
        (ShapeFunction::QuadraticBspline, Transfer::Apic),
        (ShapeFunction::CubicBspline, Transfer::Apic),
    ] {
        let (mut mpm, mut random) = random_cloud(shape, transfer, 1);
        let mut stepper = Stepper::new();
        for _ in 0..5 {
            kick(&mut mpm, &mut stepper, &mut random);
        }
        let (p0, _, scale) = momenta(&mpm);
        stepper.run(&mut mpm, 2e-4, 20);
        let (p1, ..) = momenta(&mpm);
        for a in 0..2 {
            assert!(
                (p1[a] - p0[a]).abs() < 1e-13 * scale,
                "{shape:?} {transfer:?}: {:e}",
                (p1[a] - p0[a]) / scale
            );
        }
    }
}

#[test]
fn affine_transfers_conserve_angular_momentum() {
    // Counted where the scheme conserves it: that of the points with their affine part, sum m (x x v + B_yx - B_xy),
    // which only the Reference carries openly. Here: the grid's, seen through a body in free rotation far from walls.
    use mechanics::reference::{Kernel, RefPoint, Reference};
    for kernel in [Kernel::Quadratic, Kernel::Cubic] {
        let mut random = Random::new(3);
        let mut reference = Reference {
            points: (0..60)
                .map(|_| RefPoint {
                    x: [random.between(0.1, 0.5), random.between(0.1, 0.5)],
                    v: [random.between(-1.0, 1.0), random.between(-1.0, 1.0)],
                    b: [[0.0; 2]; 2].map(|r| r.map(|_: f64| random.between(-0.05, 0.05))),
                    stress: [1e3, -2e3, 0.0, 500.0],
                    ratio: 1.0,
                    mass: 1.0,
                    volume: 1e-3,
                    bulk: 5e5,
                    shear: 3e5,
                    ..RefPoint::default()
                })
                .collect(),
            kernels: [kernel; 2],
            spread: [kernel; 2],
            meets: false,
            stages: Vec::new(),
            transfer: Transfer::Apic,
            lower: [0.0; 2],
            cells: [6, 6],
            cell: 0.1,
            gravity: [0.0; 2],
            walls: interface::config::Walls::default(),
            stress_update: interface::config::StressUpdate::Usf,
            drift: interface::config::Drift::Nodal,
            body_force: None,
            time: 0.0,
            fastest_node: 0.0,
            totals: mechanics::reference::Totals::default(),
        };
        let spin = |r: &Reference| -> f64 {
            r.points
                .iter()
                .map(|p| p.mass * (p.x[0] * p.v[1] - p.x[1] * p.v[0] + p.b[1][0] - p.b[0][1]))
                .sum()
        };
        let before = spin(&reference);
        let mut given = 0.0;
        for _ in 0..10 {
            let forces = [(); 60].map(|()| ImpForce {
                couple: random.between(-9.0, 9.0),
                ..ImpForce::default()
            });
            given += 1e-3 * forces.iter().map(|f| f.couple).sum::<f64>();
            reference.step(1e-3, 1e-3, &forces);
        }
        let change = (spin(&reference) - before - given).abs();
        assert!(change < 1e-12 * 60.0, "{kernel:?}: {change:e}");
    }
}
