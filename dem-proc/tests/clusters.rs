//! Rigid clusters of discs (Singer 2022).

use crate::small_scenes::walls::wall;
use crate::small_scenes::*;
use dem_proc::Sdem;
use interface::Vec2;
use interface::config::{BodyConfig, BodyInertia, BodyShape};
use interface::solver::DemSolver;

/// `n` x `n` discs of radius `a` that touch, about the origin.
fn grid(n: usize, a: f64) -> BodyShape {
    let at = |i: usize| 2.0 * a * (i as f64 - 0.5 * (n as f64 - 1.0));
    BodyShape::Cluster {
        centers: (0..n * n).map(|k| [at(k % n), at(k / n)]).collect(),
        radii: Vec::new(),
    }
}

fn cluster(centers: Vec<[f64; 2]>, radii: &[f64]) -> BodyShape {
    BodyShape::Cluster {
        centers,
        radii: radii.to_vec(),
    }
}

#[test]
fn mass_and_inertia_add_up() {
    use std::f64::consts::PI;
    let a = 0.1;
    let mut config = body(grid(2, a), a);
    config.inertia = BodyInertia::Density(10.0);
    config.position = [3.0, 4.0];
    let dem = configured(&scene(vec![config], spring(1.0)));
    let b = &dem.bodies().properties[0];
    let disc = 10.0 * PI * a * a;
    assert!((b.mass / (4.0 * disc) - 1.0).abs() < 1e-14);
    let inertia = 4.0 * (0.5 * disc * a * a + disc * 2.0 * a * a);
    assert!((b.inertia / inertia - 1.0).abs() < 1e-14);
    assert!((dem.bodies().state[0].center - Vec2::new(3.0, 4.0)).norm() < 1e-15);
    assert!((b.shape.extent - a * (1.0 + 2.0_f64.sqrt())).abs() < 1e-15);
}

/// Two blocks of 8 x 8 discs with Singer's kind of law, friction and adhesion, one on the other: they stay.
#[test]
fn two_cluster_blocks_rest_on_one_another() {
    let a = 0.00125;
    let block = |y: f64| BodyConfig {
        position: [0.0, y],
        inertia: BodyInertia::Mass(0.28),
        ..body(grid(8, a), a)
    };
    let law = hertz_law(1e8, 0.3, 0.6, 0.3, 30.0);
    let floor = wall("floor", [-0.1, -a], [0.1, -a], a);
    let mut config = scene(vec![floor, block(0.01), block(0.03)], law);
    config.gravity = [0.0, -9.81];
    config.skin = 0.0005;
    let mut dem = Sdem::default();
    dem.configure(&config).unwrap();
    let dt = 2e-6;
    for i in 0..40_000 {
        let mut step = step(if i == 0 { 0.0 } else { dt }, dt);
        step.measure = i == 39_999;
        dem.contact(&step, &[], &mut []).unwrap();
        dem.advance(&step).unwrap();
    }
    let m = dem.measurement();
    let weight = 2.0 * 0.28 * 9.81;
    assert!(
        (m.bodies[0].body_force[1] / -weight - 1.0).abs() < 1e-3,
        "{:?}",
        m.bodies[0]
    );
    for (b, y) in [(1, 0.01), (2, 0.03)] {
        let state = &dem.bodies().state[b];
        assert!(
            (state.center - Vec2::new(0.0, y)).norm() < 2e-5,
            "{}",
            state.center
        );
        assert!(state.angle.abs() < 1e-6 && state.velocity.norm() < 1e-4);
    }
}

/// Area, centroid and polar moment about the centroid of the covered region, from a million random points, and their
/// tolerance of four standard deviations.
fn by_chance(centers: &[[f64; 2]], radii: &[f64], random: &mut Random) -> ([f64; 4], [f64; 4]) {
    let n = 1_000_000;
    let lower = [0, 1].map(|k| {
        let ends = centers.iter().zip(radii).map(|(c, r)| c[k] - r);
        ends.fold(f64::INFINITY, f64::min)
    });
    let upper = [0, 1].map(|k| {
        let ends = centers.iter().zip(radii).map(|(c, r)| c[k] + r);
        ends.fold(f64::NEG_INFINITY, f64::max)
    });
    let mut sums = [0.0; 4];
    let mut squares = [0.0; 4];
    for _ in 0..n {
        let [x, y] = [0, 1].map(|k| random.between(lower[k], upper[k]));
        let covers = |(c, r): (&[f64; 2], &f64)| (x - c[0]).hypot(y - c[1]) < *r;
        if centers.iter().zip(radii).any(covers) {
            let row = [1.0, x, y, x * x + y * y];
            for k in 0..4 {
                sums[k] += row[k];
                squares[k] += row[k] * row[k];
            }
        }
    }
    let boxed = (upper[0] - lower[0]) * (upper[1] - lower[1]);
    let count = f64::from(n);
    let deviation = |k: usize| ((squares[k] / count - (sums[k] / count).powi(2)) / count).sqrt();
    (
        sums.map(|s| s / count * boxed),
        [0, 1, 2, 3].map(|k| 4.0 * deviation(k) * boxed),
    )
}

#[test]
fn unequal_discs_that_overlap_count_once() {
    let mut random = Random(99);
    for case in 0..12 {
        let n = 2 + case % 6;
        let centers: Vec<[f64; 2]> = (0..n)
            .map(|_| [random.between(-1.0, 1.0), random.between(-1.0, 1.0)])
            .collect();
        let radii: Vec<f64> = (0..n).map(|_| random.between(0.1, 0.9)).collect();
        let mut config = body(cluster(centers.clone(), &radii), 0.0);
        config.inertia = BodyInertia::Density(1.0);
        let dem = configured(&scene(vec![config], spring(1.0)));
        let b = &dem.bodies().properties[0];
        let c = b.shape.moments.centroid;
        // About the origin, as in the random measurement.
        let exact = [
            b.mass,
            b.mass * c.x,
            b.mass * c.y,
            b.inertia + b.mass * c.norm_squared(),
        ];
        let (chance, deviation) = by_chance(&centers, &radii, &mut random);
        for k in 0..4 {
            assert!(
                (exact[k] - chance[k]).abs() <= deviation[k],
                "case {case}, moment {k}: {exact:?} {chance:?} +- {deviation:?}"
            );
        }
    }
}

/// Two discs of radius 1 a distance 1 apart: two discs less the lens `2 pi / 3 - sqrt(3) / 2`; and a disc within
/// another adds nothing.
#[test]
fn a_lens_counts_once_and_a_hidden_disc_not_at_all() {
    use std::f64::consts::PI;
    let mass = |centers: Vec<[f64; 2]>, radii: &[f64]| {
        let mut config = body(cluster(centers, radii), 0.0);
        config.inertia = BodyInertia::Density(1.0);
        let dem = configured(&scene(vec![config], spring(1.0)));
        (
            dem.bodies().properties[0].mass,
            dem.bodies().properties[0].inertia,
        )
    };
    let (two, _) = mass(vec![[0.0, 0.0], [1.0, 0.0]], &[1.0, 1.0]);
    let lens = 2.0 * PI / 3.0 - 0.75_f64.sqrt();
    assert!((two - (2.0 * PI - lens)).abs() < 1e-14, "{two}");
    let (hidden, inertia) = mass(vec![[0.0, 0.0], [0.3, 0.0]], &[1.0, 0.5]);
    assert!((hidden - PI).abs() < 1e-14 && (inertia - 0.5 * PI).abs() < 1e-14);
}
