//! One point against one body where rounding decides. Everywhere else the kit's random cases judge force, stiffness, torque
//! and history (`kit.rs`).

use crate::small_scenes::*;
use interface::Vec2;
use interface::config::BodyShape;

const K: f64 = 1e5;
const RADIUS: f64 = 0.05;
const A: f64 = 0.1;

/// A square of side 2 about the origin with a notch from above down to (0, 0).
fn notched() -> BodyShape {
    polygon_shape(vec![
        [-1., -1.],
        [1., -1.],
        [1., 1.],
        [0.5, 1.],
        [0., 0.],
        [-0.5, 1.],
        [-1., 1.],
    ])
}

/// Where two normals or none are as right, and rounding decides: random cases stop there.
#[test]
fn points_on_an_outline_and_at_a_notch_are_pushed_out() {
    let square = || rectangle_shape(2.0, 2.0);
    let segment = || segment_shape([[-1., 0.], [1., 0.]]);
    let half = 0.5_f64.sqrt();
    let reach = A + RADIUS;
    let rows: [(BodyShape, [f64; 2], Vec2, f64); 6] = [
        (square(), [1.0, 0.25], Vec2::x(), 0.0),
        (square(), [1.0, 1.0], Vec2::new(half, half), 0.0),
        (square(), [1.1, 1.0], Vec2::x(), 0.1),
        (notched(), [0.0, -0.05], Vec2::y(), -0.05),
        (segment(), [1.0, 0.0], Vec2::x(), 0.0),
        (BodyShape::Disc, [0.0, -0.15 - 1e-15], -Vec2::y(), reach),
    ];
    for (shape, p, normal, distance) in rows {
        let config = scene(vec![fixed(shape, A)], spring(K));
        let (forces, ..) = forces(&config, RADIUS, &[at(p[0], p[1])]);
        let (got, want) = (
            Vec2::from(forces[0].force),
            normal * (K * (reach - distance)),
        );
        assert!(
            (got - want).norm() <= 1e-12 * K * reach,
            "{p:?}: {got}, not {want}"
        );
    }
}
