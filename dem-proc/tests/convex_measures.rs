//! Other measures of the overlap of two convex bodies: the nearest edge of every vertex, and the common area.

use crate::small_scenes::*;
use dem_proc::Sdem;
use dem_proc::contact::overlap::OverlapArea;
use interface::Vec2;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion, OverlapMeasure,
};
use interface::solver::DemSolver;

fn square(side: f64) -> BodyShape {
    rectangle_shape(side, side)
}

fn measured(measure: OverlapMeasure, bodies: Vec<BodyConfig>, law: ContactLaw) -> DemConfig {
    DemConfig {
        overlap: measure,
        ..scene(bodies, law)
    }
}

/// A convex polygon with `n` corners on an ellipse, at irregular angles.
fn convex(random: &mut Random, n: usize, size: f64) -> Vec<[f64; 2]> {
    let flat = random.between(0.6, 1.0);
    let turn = random.between(0.0, std::f64::consts::TAU);
    (0..n)
        .map(|i| {
            let t = (i as f64 + random.between(0.1, 0.9)) * std::f64::consts::TAU / n as f64;
            let (x, y) = (size * t.cos(), size * flat * t.sin());
            [
                x * turn.cos() - y * turn.sin(),
                x * turn.sin() + y * turn.cos(),
            ]
        })
        .collect()
}

/// The counts of docs/physics.md section 5.
#[test]
fn how_often_a_pair_counts() {
    let step = |x: f64, y: f64, angle: f64| {
        let other = BodyConfig {
            position: [x, y],
            angle,
            ..body(square(1.0), 0.1)
        };
        vec![body(square(1.0), 0.1), other]
    };
    let half = 0.5_f64.sqrt();
    let corner = 1.0 + 0.19 * half;
    let rows = [
        (
            "vertex on edge",
            step(0.5 + half + 0.19, 0.0, 0.25 * std::f64::consts::PI),
            [1, 1],
        ),
        ("edge on edge, shifted", step(1.19, 0.4, 0.0), [2, 2]),
        ("vertex on vertex", step(corner, corner, 0.0), [4, 2]),
        ("flush, corners aligned", step(1.19, 0.0, 0.0), [8, 4]),
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

/// Two convex polygons collide and separate.
fn collision(measure: OverlapMeasure, sphero_radius: f64, seed: u64) -> DemConfig {
    let mut random = Random(seed);
    let mut make = |n, x: f64, v: [f64; 2], spin| BodyConfig {
        position: [x, 0.05 * x],
        velocity: v,
        spin,
        ..body(polygon_shape(convex(&mut random, n, 1.0)), sphero_radius)
    };
    let a = make(5, -1.3, [1.0, 0.2], 0.5);
    let b = make(6, 1.3, [-1.0, 0.0], -0.8);
    measured(measure, vec![a, b], spring(1e4))
}

/// Relative changes over a collision: energy, momentum, angular momentum; and the most energy in contact.
fn balance(config: &DemConfig, dt: f64) -> [f64; 4] {
    let mut dem = configured(config);
    let totals = |dem: &Sdem| {
        let m = dem.measurement();
        let l = &m.ledger;
        let angular = |b: &interface::message::wire::BodyState| {
            b.inertia * b.spin + b.mass * cross(b.position.into(), b.velocity.into())
        };
        let energy = l.kinetic + l.kinetic_rotation + l.contact;
        let turning: f64 = m.bodies.iter().map(angular).sum();
        (energy, Vec2::from(l.momentum), turning)
    };
    let (mut first, mut last) = (None, (0.0, Vec2::zeros(), 0.0));
    let mut stored: f64 = 0.0;
    for i in 0..(2.0 / dt) as usize {
        let step = step(if i == 0 { 0.0 } else { dt }, dt);
        let answer = dem.contact(&step, &[], &mut []).unwrap();
        assert!(answer.limits.omega_sq * dt * dt < 1.0);
        dem.advance(&step).unwrap();
        last = totals(&dem);
        first.get_or_insert(last);
        stored = stored.max(dem.measurement().ledger.contact);
    }
    let first = first.unwrap();
    assert_eq!(dem.measurement().ledger.contact, 0.0, "apart again");
    [
        (last.0 / first.0 - 1.0).abs(),
        (last.1 - first.1).norm(),
        (last.2 - first.2).abs(),
        stored / first.0,
    ]
}

/// The table of docs/physics.md section 5: at steps of 4e-4, 2e-4, 1e-4 s errors fall, to about 1e-4 at the last.
#[test]
fn either_measure_conserves_energy_as_the_step_falls() {
    use OverlapMeasure::{Area, EachEdge, NearestEdge};
    for (measure, sphero_radius) in [(EachEdge, 0.1), (NearestEdge, 0.1), (Area, 0.0)] {
        let mut worst = [0.0_f64; 3];
        for seed in [5, 6, 7, 8] {
            let config = collision(measure, sphero_radius, seed);
            for (worst, dt) in worst.iter_mut().zip([4e-4, 2e-4, 1e-4]) {
                let [energy, momentum, angular, stored] = balance(&config, dt);
                assert!(
                    stored > 0.05,
                    "{measure:?}, seed {seed}: no collision, {stored}"
                );
                assert!(momentum < 1e-12, "{measure:?}, seed {seed}: {momentum}");
                assert!(angular < 1e-10, "{measure:?}, seed {seed}: {angular}");
                *worst = worst.max(energy);
            }
        }
        println!("{measure:?}: energy errors {worst:?}");
        assert!(worst[0] < 2e-3, "{measure:?}: {worst:?}");
        assert!(worst[2] < 2e-4, "{measure:?}: {worst:?}");
    }
}

/// A vertex that is past the bare outline is pushed back out, as a point is.
#[test]
fn a_vertex_past_the_outline_is_pushed_back() {
    let small = BodyConfig {
        position: [0.0, 0.5 + 0.1 - 0.03],
        angle: 0.25 * std::f64::consts::PI,
        ..body(square(0.1 * 2.0_f64.sqrt()), 0.01)
    };
    let config = measured(
        OverlapMeasure::NearestEdge,
        vec![fixed(square(1.0), 0.01), small],
        spring(1e4),
    );
    let mut dem = configured(&config);
    dem.contact(&OPENING, &[], &mut []).unwrap();
    let force = dem.measurement().bodies[1].body_force;
    assert!((force[1] - 1e4 * 0.05).abs() < 1e-6, "{force:?}");
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

fn vectors(vertices: &[[f64; 2]]) -> Vec<Vec2> {
    vertices.iter().map(|&v| v.into()).collect()
}

/// The common area of two convex polygons, by horizontal slabs between all heights at which an outline has a corner or
/// two outlines cross. Within a slab the width is linear, so the trapezoidal rule is exact. This method cuts no
/// polygon, unlike the tested one.
fn area_by_slabs(a: &[Vec2], b: &[Vec2]) -> f64 {
    let edges = |p: &[Vec2]| -> Vec<(Vec2, Vec2)> {
        (0..p.len()).map(|i| (p[i], p[(i + 1) % p.len()])).collect()
    };
    let mut heights: Vec<f64> = a.iter().chain(b).map(|p| p.y).collect();
    for (p, q) in edges(a) {
        for (r, s) in edges(b) {
            let (u, v) = (q - p, s - r);
            let along = cross(r - p, v) / cross(u, v);
            if along.is_finite() && (0.0..=1.0).contains(&along) {
                heights.push((p + u * along).y);
            }
        }
    }
    heights.sort_by(f64::total_cmp);
    let span = |polygon: &[Vec2], y: f64| {
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for (p, q) in edges(polygon) {
            if (p.y > y) != (q.y > y) {
                let x = p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y);
                span = [span[0].min(x), span[1].max(x)];
            }
        }
        span
    };
    let width = |y: f64| {
        let (s, t) = (span(a, y), span(b, y));
        (s[1].min(t[1]) - s[0].max(t[0])).max(0.0)
    };
    let slabs = heights.array_windows();
    // The width is linear within a slab, so the value at its middle is its mean.
    slabs
        .map(|[low, high]| (high - low) * width(0.5 * (low + high)))
        .sum()
}

#[test]
fn two_squares_overlap_by_a_rectangle() {
    let at = |x: f64, y: f64| -> Vec<Vec2> {
        let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        corners.map(|c| Vec2::from(c) + Vec2::new(x, y)).to_vec()
    };
    let overlap = OverlapArea::default()
        .overlap(&at(0.0, 0.0), &at(0.9, 0.7))
        .unwrap();
    let (w, h) = (0.1, 0.3);
    assert!((overlap.area - w * h).abs() < 1e-15);
    assert!((overlap.gradient - Vec2::new(-h, -w)).norm() < 1e-15);
    assert!((overlap.centroid - Vec2::new(0.45, 0.35)).norm() < 1e-14);
    // The middle of the chord is that of the rectangle, so there is no moment about it.
    assert!(overlap.turning.abs() < 1e-15);
    assert_eq!(
        OverlapArea::default().overlap(&at(0.0, 0.0), &at(1.1, 0.0)),
        None
    );
}

#[test]
fn a_thousand_random_overlaps_agree_with_slabs_and_push_along_the_gradient() {
    let mut random = Random(77);
    let mut measure = OverlapArea::default();
    let (mut overlapping, mut apart) = (0, 0);
    while overlapping < 1000 {
        let corners = |random: &mut Random| 3 + (random.unit() * 7.0) as usize;
        let n = corners(&mut random);
        let a = vectors(&convex(&mut random, n, 1.0));
        let n = corners(&mut random);
        let shift = Vec2::new(random.between(-2.0, 2.0), random.between(-2.0, 2.0));
        let size = random.between(0.3, 1.0);
        let other = convex(&mut random, n, size);
        let b: Vec<Vec2> = vectors(&other).iter().map(|p| p + shift).collect();
        let expected = area_by_slabs(&a, &b);
        let Some(overlap) = measure.overlap(&a, &b) else {
            assert!(expected < 1e-14, "{expected}");
            apart += 1;
            continue;
        };
        overlapping += 1;
        assert!(
            (overlap.area - expected).abs() < 1e-13,
            "{} {expected}",
            overlap.area
        );
        // Central differences of a function that is quadratic between changes of corners.
        let e = 1e-5;
        let moved = |by: &dyn Fn(&Vec2) -> Vec2| {
            let moved: Vec<Vec2> = a.iter().map(by).collect();
            area_by_slabs(&moved, &b)
        };
        let along = |d: Vec2| (moved(&|p| p - d * e) - moved(&|p| p + d * e)) / (2.0 * e);
        let numeric = Vec2::new(along(Vec2::x()), along(Vec2::y()));
        let c = overlap.centroid;
        let turned = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            move |p: &Vec2| {
                let d = p - c;
                c + Vec2::new(cos * d.x - sin * d.y, sin * d.x + cos * d.y)
            }
        };
        let turning = (moved(&turned(-e)) - moved(&turned(e))) / (2.0 * e);
        assert!(
            (numeric - overlap.gradient).norm() < 3e-4,
            "{numeric} {}",
            overlap.gradient
        );
        assert!(
            (turning - overlap.turning).abs() < 3e-4,
            "{turning} {}",
            overlap.turning
        );
    }
    assert!(apart > 300, "{apart}");
}

/// Along a path through a contact, including corners and flush edges, the force does not jump: its largest change
/// decreases with the length of a step. And it grows no faster than the stiffness that the step limit uses.
///
/// Where two edges that face the same way coincide, the force does jump, by `k A / l` times the depth over `l`: an
/// example is a block that leaves a table with its edge flush. So the path along the edge is not taken at angle 0.
#[test]
fn the_force_of_the_area_is_continuous() {
    let k = 1e4;
    let force = |p: Vec2, angle: f64| {
        let other = BodyConfig {
            position: p.into(),
            angle,
            ..fixed(square(0.5), 0.0)
        };
        let bodies = vec![body(square(1.0), 0.0), other];
        let mut dem = configured(&measured(OverlapMeasure::Area, bodies, spring(k)));
        dem.contact(&OPENING, &[], &mut []).unwrap();
        Vec2::from(dem.measurement().bodies[0].body_force)
    };
    let largest_jump = |from: Vec2, to: Vec2, angle: f64, n: i32| {
        let step = (to - from) / f64::from(n);
        let (mut last, mut most, mut jump) = (force(from, angle), 0.0_f64, 0.0_f64);
        for i in 1..=n {
            let f = force(from + step * f64::from(i), angle);
            let stiffness = (f - last).dot(&step) / step.norm_squared();
            assert!(
                stiffness <= 1.5 * k,
                "angle {angle}, {i} of {n}: {stiffness}"
            );
            jump = jump.max((f - last).norm());
            most = most.max(f.norm());
            last = f;
        }
        assert!(most > 50.0, "angle {angle}: no contact, {most}");
        jump
    };
    let onto_corner = ([1.2, 0.9], [0.6, 0.5], [0.0, 0.01, 0.4]);
    let onto_edge = ([0.8, 0.0], [0.6, 0.0], [0.0, 0.01, 0.4]);
    let along_edge = ([0.72, -1.0], [0.72, 1.0], [0.01, 0.1, 0.4]);
    for (from, to, angles) in [onto_corner, onto_edge, along_edge] {
        for angle in angles {
            let jump = |n| largest_jump(Vec2::from(from), Vec2::from(to), angle, n);
            let (coarse, fine) = (jump(4000), jump(32_000));
            assert!(
                fine < 0.25 * coarse,
                "angle {angle}, {from:?}: {coarse} {fine}"
            );
        }
    }
}

/// A bare square on a bare floor: the floor carries its weight, and it stays where it is.
#[test]
fn a_square_rests_by_its_area() {
    let floor = BodyConfig {
        position: [0.0, -0.5],
        ..fixed(rectangle_shape(4.0, 1.0), 0.0)
    };
    // Width of the overlap over its length: 0.2 / (2 x 0.1 sqrt 2).
    let gain = 0.5_f64.sqrt();
    let k = 1e5;
    let depth = 9.81 / (k * gain * gain);
    let block = BodyConfig {
        position: [0.3, 0.1 - depth],
        ..body(square(0.2), 0.0)
    };
    let law = frictional(k, 0.5 * k, 0.4);
    let mut config = measured(OverlapMeasure::Area, vec![floor, block], law);
    config.gravity = [0.0, -9.81];
    let mut dem = configured(&config);
    let dt = 1e-4;
    for i in 0..5000 {
        go(&mut dem, i == 0, dt);
        let force = dem.measurement().bodies[0].body_force;
        assert!((force[1] + 9.81).abs() < 1e-6, "step {i}: {force:?}");
    }
    let state = &dem.bodies().state[1];
    assert!(
        (state.center - Vec2::new(0.3, 0.1 - depth)).norm() < 1e-9,
        "{}",
        state.center
    );
    assert!(state.angle.abs() < 1e-9);
}

/// Bodies that can only rotate have no mass for a dashpot.
#[test]
fn a_hinged_body_has_no_dashpot_on_a_fixed_one() {
    use OverlapMeasure::{Area, EachEdge, NearestEdge};
    for (measure, a) in [(EachEdge, 0.1), (NearestEdge, 0.1), (Area, 0.0)] {
        let pressed = |damping_ratio| {
            let hinged = BodyConfig {
                motion: Motion::Guided {
                    hold_x: true,
                    hold_y: true,
                    hold_angle: false,
                },
                position: [0.05, 1.0 + 2.0 * a - 1e-3],
                spin: 3.0,
                ..body(square(1.0), a)
            };
            let law = linear_law(1e5, 0.0, 0.0, damping_ratio);
            let bodies = vec![hinged, fixed(square(1.0), a)];
            let mut dem = configured(&measured(measure, bodies, law));
            dem.contact(&OPENING, &[], &mut []).unwrap();
            dem.measurement().bodies[0].body_force
        };
        assert!(pressed(0.0)[1] > 1.0, "{measure:?}");
        assert_eq!(pressed(0.3), pressed(0.0), "{measure:?}");
    }
}
