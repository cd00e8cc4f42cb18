//! Smoothing at a rate: the same time smooths the same, whatever the steps.

use interface::config::{MaterialModel, MpmConfig, ShapeFunction, Spacing, Transfer, Wall};
use interface::solver::MpmSolver;
use nalgebra::{DMatrix, DVector};

use crate::blocks::{Stepper, block, configured, rectangle_fill, walls};

/// Cells of the box, along which everything varies.
const CELLS: usize = 8;

/// Points along x in each cell.
const PER_CELL: usize = 2;

const CELL: f64 = 0.05;

/// Velocities in m/s, so small that no point moves to speak of: a wave over the box, and what only points can see.
fn velocity(point: usize) -> f64 {
    let x = (point as f64 + 0.5) / (CELLS * PER_CELL) as f64;
    let wave = (2.0 * core::f64::consts::TAU * x).sin();
    1e-9 * (wave + if point.is_multiple_of(2) { 0.5 } else { -0.5 })
}

/// Dust without forces in a periodic box.
fn dust(transfer: Transfer) -> MpmConfig {
    let mut config = block();
    (config.shape, config.transfer) = (ShapeFunction::QuadraticBspline, transfer);
    config.cell = CELL;
    config.domain = [[0.0, 0.0], [CELLS as f64 * CELL, 4.0 * CELL]];
    let wall = Wall::Periodic;
    config.walls = walls(wall, wall, wall, wall);
    config.materials[0].model = MaterialModel::Fluid {
        bulk_modulus: 1e-9,
        exponent: 1.0,
        viscosity: 0.0,
    };
    let [lower, upper] = config.domain;
    config.groups[0].fill = rectangle_fill(lower, upper);
    config.groups[0].spacing = Spacing::PerCell((PER_CELL * PER_CELL) as u32);
    let wave = format!(
        "1e-9*(sin(4*pi*x/{0}) + 0.5*sign(sin(2*pi*x/{CELL})))",
        CELLS as f64 * CELL
    );
    config.groups[0].fields.velocity = Some([wave, "0".into()]);
    config
}

/// Velocities of the points along x after a time, the mean over y, in order of x.
fn left_after(transfer: Transfer, end: f64, steps: usize) -> Vec<f64> {
    let mut mpm = configured(&dust(transfer));
    let start = mpm.points();
    Stepper::new().run(&mut mpm, end / steps as f64, steps);
    let mut sum = [0.0; CELLS * PER_CELL];
    for (at, now) in start.iter().zip(mpm.points()) {
        let i = (at.position[0] / CELL * PER_CELL as f64) as usize;
        sum[i] += now.velocity[0];
    }
    let rows = (start.len() / sum.len()) as f64;
    // Half a kick is missing at the end: the velocities are those of the middle of the last step.
    sum.iter().map(|v| v / rows).collect()
}

/// Quadratic B-spline at `d` cells from its node.
fn spline(d: f64) -> f64 {
    match d.abs() {
        d if d < 0.5 => 0.75 - d * d,
        d if d < 1.5 => 0.5 * (1.5 - d) * (1.5 - d),
        _ => 0.0,
    }
}

/// What a smoothing cannot see of velocities of points, as a matrix: built from the shape function alone.
fn unseen(transfer: Transfer) -> DMatrix<f64> {
    let points = CELLS * PER_CELL;
    let distance = |i: usize, p: usize| {
        let d = i as f64 - (p as f64 + 0.5) / PER_CELL as f64;
        let n = CELLS as f64;
        d - n * (d / n).round()
    };
    let s = DMatrix::from_fn(points, CELLS, |p, i| spline(distance(i, p)));
    let moment = DMatrix::from_fn(points, CELLS, |p, i| {
        spline(distance(i, p)) * distance(i, p)
    });
    let average = |from: &DMatrix<f64>| from.transpose() / PER_CELL as f64; // M^-1 (.)^T m
    let one = DMatrix::identity(points, points);
    match transfer {
        Transfer::FlipPic { .. } => one - &s * average(&s),
        Transfer::FlipXpic { order, .. } => (one - &s * average(&s)).pow(order),
        Transfer::Aflip { .. } => {
            let back = average(&moment) * 4.0 * &moment; // 1/D = 4/L^2
            let nodes = (DMatrix::identity(CELLS, CELLS) - back)
                .try_inverse()
                .expect("the affine part smooths");
            one - &s * nodes * average(&s)
        }
        _ => unreachable!("not a transfer with a rate"),
    }
}

/// `exp(-x R)`, by squaring.
fn decayed(unseen: &DMatrix<f64>, x: f64) -> DMatrix<f64> {
    let mut e = DMatrix::identity(unseen.nrows(), unseen.nrows()) - unseen * (x / 2f64.powi(24));
    for _ in 0..24 {
        e = &e * &e;
    }
    e
}

const RATE: f64 = 15.0;
const END: f64 = 0.1;
const STEPS: usize = 120;

/// Against `v(t) = exp(-r R t) v(0)`: waves that the grid sees a part of, and the part that it does not see at all.
#[test]
fn the_same_time_smooths_the_same() {
    let pic_rate = RATE;
    for transfer in [
        Transfer::FlipPic { pic_rate },
        Transfer::Aflip { pic_rate },
        Transfer::FlipXpic { order: 2, pic_rate },
        Transfer::FlipXpic { order: 5, pic_rate },
    ] {
        let start = DVector::from_fn(CELLS * PER_CELL, |p, _| velocity(p));
        for steps in [STEPS, 2 * STEPS, 20 * STEPS] {
            // The first kick is that of half a step.
            let time = END * (1.0 - 0.5 / steps as f64);
            let expected = decayed(&unseen(transfer), RATE * time) * &start;
            let found = DVector::from_vec(left_after(transfer, END, steps));
            let (off, lost) = ((&found - &expected).norm(), (&start - &expected).norm());
            println!("{transfer:?} {steps}: {:.5}", off / expected.norm());
            assert!(off < 0.01 * expected.norm(), "{transfer:?} {steps}");
            assert!(lost > 0.3 * start.norm(), "nothing smoothed");
        }
    }
}

/// What a share of every step does instead.
#[test]
fn a_share_of_every_step_smooths_the_more_the_shorter() {
    let left = |transfer, steps| DVector::from_vec(left_after(transfer, END, steps)).norm();
    for transfer in [
        Transfer::Blend { pic_fraction: 0.01 },
        Transfer::Apic,
        Transfer::Xpic { order: 2 },
    ] {
        let [long, short] = [10, 200].map(|steps| left(transfer, steps));
        println!("{transfer:?}: {:.4}", short / long);
        assert!(short < 0.95 * long, "{transfer:?}");
    }
}

/// Without a rate nothing is lost: of FLIP not a bit, and of the affine field no energy in the long run.
#[test]
fn a_rate_of_zero_smooths_nothing() {
    let flip = left_after(Transfer::Flip, END, 50);
    let still = [
        Transfer::FlipPic { pic_rate: 0.0 },
        Transfer::Aflip { pic_rate: 0.0 },
    ];
    for transfer in still {
        let left = left_after(transfer, END, 50);
        assert!(left.iter().zip(&flip).all(|(a, b)| (a - b).abs() < 1e-20));
    }
}
