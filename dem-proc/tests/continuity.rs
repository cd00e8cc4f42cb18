//! Forces do not jump: when the nearest feature changes, at the rebuild of a list, and at a corner.

use crate::small_scenes::*;
use interface::Vec2;
use interface::config::BodyConfig;
use interface::message::wire::ImpForce;
use interface::solver::DemSolver;

/// A point goes round a convex outline at a constant distance, and across a star's notches: the force changes by no
/// more than stiffness times path, plus, in a reflex corner, the turn of the normal where two edges are equally near
/// (there a signed distance has a crease: docs/physics.md section 5 promises smoothness along convex outlines).
#[test]
fn the_force_on_a_point_does_not_jump_round_a_convex_outline() {
    let k = 1e5;
    let vertices = vec![[0.0, 0.0], [1.0, 0.0], [1.3, 0.8], [0.4, 1.2], [-0.2, 0.7]];
    let config = scene(vec![fixed(polygon_shape(vertices), 0.1)], spring(k));
    let mut dem = configured(&config);
    dem.imp_set(&[info(0, 0.05, 1.0)]);
    let mut f = [ImpForce::default()];
    let mut last: Option<(Vec2, Vec2)> = None;
    let n = 40_000;
    let mut touched = 0;
    for i in 0..n {
        let t = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
        let p = Vec2::new(0.5 + 0.95 * t.cos(), 0.55 + 0.85 * t.sin());
        dem.contact(&OPENING, &[at(p.x, p.y)], &mut f).unwrap();
        let force = Vec2::from(f[0].force);
        if let Some((q, before)) = last {
            // |dF| <= k |dx| (1 + xi / d): the normal turns faster than the point moves near a corner, d >= 0.05.
            assert!(
                (force - before).norm() <= k * (p - q).norm() * 4.0,
                "at {p}"
            );
        }
        touched += usize::from(force != Vec2::zeros());
        last = Some((p, force));
    }
    assert!(touched > 1000, "{touched}");
}

/// The bits do not depend on the skin, and so not on when lists are rebuilt: with friction, damping, points and bodies.
#[test]
fn lists_leave_no_trace() {
    let run = |skin: f64| {
        let mut random = Random::new(4);
        let mut bodies = walls::open_box(0.8, 1.0, 0.05);
        for i in 0..16 {
            let shape = star(&mut random, 5, 0.06, 0.08);
            bodies.push(BodyConfig {
                position: [0.1 + 0.2 * f64::from(i % 4), 0.1 + 0.2 * f64::from(i / 4)],
                velocity: [random.between(-1.0, 1.0), -1.0],
                spin: random.between(-9.0, 9.0),
                ..body(shape, 0.02)
            });
        }
        let law = linear_law(1e6, 3e5, 0.4, 0.1);
        let mut config = scene(bodies, law);
        config.gravity = [0.0, -9.81];
        config.skin = skin;
        // Between the bodies.
        let mut gap = |k: u64| 0.2 * (1 + k % 3) as f64 + random.between(-0.02, 0.02);
        let points: Vec<_> = (0..100_u64)
            .map(|i| (info(i, 0.01, 0.01), at(gap(i), gap(i / 3))))
            .collect();
        let mut points = Points::new(&points);
        let mut dem = configured(&config);
        dem.imp_set(&points.set);
        let dt = 1e-5;
        for i in 0..8000 {
            points.step(&mut dem, &step(if i == 0 { 0.0 } else { dt }, dt));
        }
        assert!(dem.measurement().ledger.friction_work > 0.0);
        (points.states.clone(), dem.measurement().clone())
    };
    let (few, often) = (run(0.1), run(0.004));
    assert_eq!(few.0, often.0);
    assert_eq!(few.1, often.1);
}
