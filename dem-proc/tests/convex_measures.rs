//! Other measures of the overlap of two convex bodies: the nearest edge of every vertex, and the common area.

use crate::small_scenes::*;
use interface::Vec2;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion, OverlapMeasure,
};

fn square(side: f64) -> BodyShape {
    rectangle_shape(side, side)
}

fn measured(measure: OverlapMeasure, bodies: Vec<BodyConfig>, law: ContactLaw) -> DemConfig {
    DemConfig {
        overlap: measure,
        ..scene(bodies, law)
    }
}

/// The counts of docs/physics.md section 5.
#[test]
fn how_often_a_pair_counts() {
    let pair = |x: f64, y: f64, angle: f64| {
        let other = BodyConfig {
            position: [x, y],
            angle,
            ..body(square(1.0), 0.1)
        };
        vec![body(square(1.0), 0.1), other]
    };
    let half = 0.5_f64.sqrt();
    let (corner, turned) = (1.0 + 0.19 * half, 0.25 * std::f64::consts::PI);
    let rows = [
        ("vertex on edge", pair(0.69 + half, 0.0, turned), [1, 1]),
        ("edge on edge, shifted", pair(1.19, 0.4, 0.0), [2, 2]),
        ("vertex on vertex", pair(corner, corner, 0.0), [4, 2]),
        ("flush, corners aligned", pair(1.19, 0.0, 0.0), [8, 4]),
    ];
    for (case, bodies, expected) in rows {
        let measures = [OverlapMeasure::EachEdge, OverlapMeasure::NearestEdge];
        for (measure, count) in measures.into_iter().zip(expected) {
            let config = measured(measure, bodies.clone(), spring(1e4));
            let mut dem = configured(&config);
            dem.contact(&OPENING, &[], &mut []).unwrap();
            assert_eq!(dem.contacts(), count, "{case}, {measure:?}");
            let force = dem.measurement().bodies[1].body_force;
            let each = 1e4 * 0.01; // every contact has an overlap of 0.2 - 0.19
            assert!(
                (Vec2::from(force).norm() - count as f64 * each).abs() < 1e-9,
                "{case}, {measure:?}: {force:?}"
            );
        }
    }
}

/// A disc is driven along an edge and past the corner. The contact stays the same one, and friction keeps its spring.
#[test]
fn friction_goes_round_a_corner_with_its_vertex() {
    let disc = BodyConfig {
        position: [0.69, 0.45],
        motion: Motion::Driven,
        velocity: [0.0, 0.1],
        ..body(BodyShape::Disc, 0.1)
    };
    let heavy = BodyConfig {
        inertia: BodyInertia::Mass(1e9),
        ..body(square(1.0), 0.1)
    };
    let config = measured(
        OverlapMeasure::NearestEdge,
        vec![heavy, disc],
        frictional(1e4, 5e3, 10.0),
    );
    let mut dem = configured(&config);
    let dt = 1e-3;
    let mut stored: Option<f64> = None;
    for i in 0..800 {
        go(&mut dem, i == 0, dt);
        let contact = dem.measurement().ledger.contact;
        // k_t u du = 5e3 x 0.1 x 1e-4 a step at most; a spring that starts anew at the corner loses 6 J/m.
        let before = stored.replace(contact).unwrap_or(contact);
        assert!(
            (contact - before).abs() < 0.06,
            "step {i}: {before} {contact}"
        );
        assert_eq!(dem.contacts(), 1, "step {i}");
    }
    assert!(stored.unwrap() > 6.0, "{stored:?}");
}
