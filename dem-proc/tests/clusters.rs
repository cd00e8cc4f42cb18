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
