//! One point against one body: table of overlaps, balance of force and torque, stiffness, invariance. Friction, its limit and
//! its history are judged by the kit's random cases (F-7).

use crate::small_scenes::*;
use interface::Vec2;
use interface::config::{BodyConfig, BodyShape, ContactLaw, Motion};
use interface::message::wire::{ImpForce, ImpState};
use interface::solver::DemSolver;

const K: f64 = 1e5;
const RADIUS: f64 = 0.05;
const A: f64 = 0.1;

/// A square of side 2 about the origin with a notch from above down to (0, 0).
fn notched() -> BodyShape {
    BodyShape::Polygon {
        vertices: vec![
            [-1., -1.],
            [1., -1.],
            [1., 1.],
            [0.5, 1.],
            [0., 0.],
            [-0.5, 1.],
            [-1., 1.],
        ],
    }
}

/// Force on a point at `p`, and the body's torque.
fn force(shape: BodyShape, p: [f64; 2]) -> (Vec2, f64) {
    let config = scene(vec![fixed(shape, A)], spring(K));
    let (forces, dem, _) = forces(&config, RADIUS, &[at(p[0], p[1])]);
    let torque = dem.measurement().bodies[0].point_torque;
    (forces[0].force.into(), torque)
}

#[test]
#[expect(clippy::too_many_lines, reason = "a table")]
fn table_of_overlaps() {
    let square = BodyShape::Rectangle {
        width: 2.0,
        height: 2.0,
    };
    let half = 0.5_f64.sqrt();
    let slope = Vec2::new(-1.0, 0.5).normalize(); // outward normal of the notch's right flank, into the notch
    let reach = A + RADIUS;
    let rows: &[(&str, BodyShape, [f64; 2], Vec2, f64)] = &[
        ("edge", square.clone(), [1.12, 0.3], Vec2::x(), 0.12),
        (
            "vertex cap",
            square.clone(),
            [1.06, 1.06],
            Vec2::new(half, half),
            0.06 / half,
        ),
        (
            "edge at the corner",
            square.clone(),
            [1.1, 1.0],
            Vec2::x(),
            0.1,
        ),
        (
            "inside the core",
            square.clone(),
            [0.7, 0.2],
            Vec2::x(),
            -0.3,
        ),
        ("deep inside", square.clone(), [0.2, 0.1], Vec2::x(), -0.8),
        (
            "on the outline",
            square.clone(),
            [1.0, 0.25],
            Vec2::x(),
            0.0,
        ),
        (
            "on a vertex",
            square.clone(),
            [1.0, 1.0],
            Vec2::new(half, half),
            0.0,
        ),
        ("inside at a corner", square, [0.9, 0.8], Vec2::x(), -0.1),
        (
            "in the notch",
            notched(),
            [0.05, 0.3],
            slope,
            (0.15 - 0.05) / 1.25_f64.sqrt(),
        ),
        (
            "below the notch's root",
            notched(),
            [0.0, -0.05],
            Vec2::y(),
            -0.05,
        ),
        ("disc", BodyShape::Disc, [0.0, -0.13], -Vec2::y(), 0.13),
        (
            "segment from above",
            BodyShape::Segment {
                ends: [[-1., 0.], [1., 0.]],
            },
            [0.3, 0.04],
            Vec2::y(),
            0.04,
        ),
        (
            "segment from below",
            BodyShape::Segment {
                ends: [[-1., 0.], [1., 0.]],
            },
            [0.3, -0.04],
            -Vec2::y(),
            0.04,
        ),
        (
            "end of a segment",
            BodyShape::Segment {
                ends: [[-1., 0.], [1., 0.]],
            },
            [1.1, 0.0],
            Vec2::x(),
            0.1,
        ),
        (
            "on the end of a segment",
            BodyShape::Segment {
                ends: [[-1., 0.], [1., 0.]],
            },
            [1.0, 0.0],
            Vec2::x(),
            0.0,
        ),
        (
            "out of reach",
            BodyShape::Disc,
            [0.0, -0.15 - 1e-15],
            -Vec2::y(),
            reach,
        ),
    ];
    for (name, shape, p, normal, distance) in rows {
        let (f, _) = force(shape.clone(), *p);
        let expected = normal * (K * (reach - distance));
        assert!(
            (f - expected).norm() <= 1e-12 * K * reach,
            "{name}: {f} instead of {expected}"
        );
    }
}

#[test]
fn no_contact_means_exactly_nothing_up_to_the_last_bit() {
    let config = scene(vec![body(BodyShape::Disc, A)], spring(K));
    let touching = A + RADIUS;
    for x in [touching, touching.next_up(), touching + 0.4 * RADIUS] {
        let (f, dem, answer) = forces(&config, RADIUS, &[at(x, 0.0)]);
        assert_eq!(f[0].force, [0.0, 0.0]);
        assert_eq!(f[0].stiffness, K, "in reach: may touch in the next step");
        assert_eq!(answer.limits.contact_omega_sq, K);
        assert_eq!(dem.measurement().bodies[0].point_torque, 0.0);
        assert_eq!(dem.measurement().ledger.contacts, 0);
    }
    let (f, _, answer) = forces(&config, RADIUS, &[at(touching + 0.51 * RADIUS, 0.0)]);
    assert_eq!((f[0].stiffness, answer.limits.contact_omega_sq), (0.0, 0.0));
}

#[test]
fn action_equals_reaction_and_torque_is_taken_at_the_contact_point() {
    let mut random = Random(7);
    let mut touched = 0;
    for _ in 0..300 {
        let shape = BodyShape::Polygon {
            vertices: random.star(7, 0.5, 1.0),
        };
        let config = scene(vec![fixed(shape, A)], spring(K));
        let points: Vec<ImpState> = (0..5)
            .map(|_| {
                let (r, angle) = (random.between(0.6, 1.2), random.between(0.0, 6.3));
                at(r * angle.cos(), r * angle.sin())
            })
            .collect();
        let (f, dem, _) = forces(&config, RADIUS, &points);
        let state = &dem.measurement().bodies[0];
        let c = Vec2::from(state.position);
        let (mut sum, mut torque, mut scale) =
            (Vec2::from(state.point_force), state.point_torque, 0.0);
        for (f, p) in f.iter().zip(&points) {
            let f = Vec2::from(f.force);
            sum += f;
            // Frictionless: the contact point lies on the line of the force through the point.
            torque += cross(Vec2::from(p.position) - c, f);
            scale += f.norm();
            touched += usize::from(f.norm() > 0.0);
        }
        assert!(sum.norm() <= 1e-13 * scale);
        assert!(torque.abs() <= 1e-12 * scale, "{torque} {scale}");
    }
    assert!(touched > 300);
}

/// Fixed star, three points, friction: sliding in a frame that is turned, mirrored, shifted or moving.
fn trajectory(map: impl Fn(Vec2) -> Vec2, boost: Vec2) -> Vec<Vec2> {
    let mut random = Random(99);
    let star = random.star(6, 0.5, 1.0);
    let vertices = star
        .iter()
        .map(|&v| (map(v.into()) - map(Vec2::zeros())).into())
        .collect();
    let origin = map(Vec2::zeros());
    let config = scene(
        vec![BodyConfig {
            position: origin.into(),
            velocity: boost.into(),
            motion: Motion::Driven,
            ..body(BodyShape::Polygon { vertices }, A)
        }],
        frictional(K, 0.4 * K, 0.3),
    );
    let mut dem = configured(&config);
    let starts: Vec<Vec2> = (0..3).map(|i| Vec2::from(star[i]) * 1.05).collect();
    let dt = 1e-4;
    let set: Vec<_> = (0..3).map(|i| info(i, RADIUS, 1.0)).collect();
    dem.imp_set(&set);
    let mut forces = [ImpForce::default(); 3];
    for i in 0..200 {
        let step = step(if i == 0 { 0.0 } else { dt }, dt);
        let t = f64::from(i) * dt;
        let states: Vec<ImpState> = starts
            .iter()
            .map(|s| {
                let p = map(s + Vec2::new(0.3, -0.2) * t * 10.0) + boost * t;
                at(p.x, p.y)
            })
            .collect();
        dem.contact(&step, &states, &mut forces).unwrap();
        dem.advance(&step).unwrap();
    }
    forces.iter().map(|f| f.force.into()).collect()
}

#[test]
fn forces_follow_rotation_mirror_shift_and_boost() {
    let plain = trajectory(|p| p, Vec2::zeros());
    let scale = plain.iter().map(Vec2::norm).fold(0.0, f64::max);
    assert!(scale > 100.0);
    let same = |got: Vec<Vec2>, map: &dyn Fn(Vec2) -> Vec2, tolerance: f64| {
        for (f, g) in plain.iter().zip(got) {
            assert!((map(*f) - g).norm() < tolerance * scale, "{f} {g}");
        }
    };
    let turn = |p: Vec2| Vec2::new(0.6 * p.x - 0.8 * p.y, 0.8 * p.x + 0.6 * p.y);
    same(trajectory(turn, Vec2::zeros()), &turn, 1e-11);
    let mirror = |p: Vec2| Vec2::new(-p.x, p.y);
    same(trajectory(mirror, Vec2::zeros()), &mirror, 1e-11);
    let shift = Vec2::new(1e6, -2e6);
    // Positions near 1e6 have an ulp of 1e-10, overlaps are 0.1, and the k_t spring sums 200 of them.
    same(trajectory(|p| p + shift, Vec2::zeros()), &|f| f, 1e-6);
    same(trajectory(|p| p, Vec2::new(30.0, -12.0)), &|f| f, 1e-10);
}

#[test]
fn many_points_add_up_and_one_point_feels_two_bodies() {
    let config = scene(vec![fixed(BodyShape::Disc, A)], spring(K));
    let (f, dem, _) = forces(&config, RADIUS, &[at(0.14, 0.0); 40]);
    let total = Vec2::from(dem.measurement().ledger.contact_force);
    assert!(
        (total.x + 40.0 * f[0].force[0]).abs() < 1e-10
            && dem.measurement().bodies[0].contacts == 40
    );
    let other = BodyConfig {
        position: [0.2, 0.2],
        ..fixed(BodyShape::Disc, A)
    };
    let (both, _, _) = forces(
        &scene(vec![fixed(BodyShape::Disc, A), other.clone()], spring(K)),
        RADIUS,
        &[at(0.12, 0.1)],
    );
    let (one, _, _) = forces(&config, RADIUS, &[at(0.12, 0.1)]);
    let (two, _, _) = forces(&scene(vec![other], spring(K)), RADIUS, &[at(0.12, 0.1)]);
    for k in 0..2 {
        assert_eq!(both[0].force[k], one[0].force[k] + two[0].force[k]);
    }
    assert_eq!(both[0].stiffness, one[0].stiffness + two[0].stiffness);
}

/// On an outline without sphero-radius the radius of curvature of a contact is the point's own: the area law gives the
/// segment of the point's disc that is beyond a straight edge, and adhesion pulls over that disc's chord.
#[test]
fn laws_with_a_radius_take_the_points_on_a_bare_polygon() {
    let square = || BodyShape::Rectangle {
        width: 2.0,
        height: 2.0,
    };
    let area = ContactLaw::Area {
        area_stiffness: 1e6,
        tangential_stiffness: 0.0,
        friction: 0.0,
    };
    let sticky = ContactLaw::Granular {
        normal_stiffness: K,
        tangential_stiffness: 0.0,
        friction: 0.0,
        damping_ratio: 0.0,
        damped_mass: 0.0,
        adhesion: 300.0,
        rolling_friction: 0.0,
    };
    let pressed = |law, overlap: f64| {
        let config = scene(vec![fixed(square(), 0.0)], law);
        let (forces, ..) = forces(&config, RADIUS, &[at(0.3, 1.0 + RADIUS - overlap)]);
        assert_eq!(forces[0].force[0], 0.0);
        forces[0]
    };
    // Half sunk, it is half of the disc, and no overlap makes it stiffer than its diameter.
    let half = pressed(area, RADIUS);
    let expected = 1e6 * std::f64::consts::FRAC_PI_2 * RADIUS * RADIUS;
    assert!((half.force[1] - expected).abs() < 1e-12 * expected);
    assert!((half.stiffness - 1e6 * 2.0 * RADIUS).abs() < 1e-6);
    for overlap in [1e-4, 0.01, 0.04] {
        let c = (overlap * (2.0 * RADIUS - overlap)).sqrt();
        let expected = 1e6 * (RADIUS * RADIUS * (c / RADIUS).asin() - (RADIUS - overlap) * c);
        let got = pressed(area, overlap);
        // The root of the overlap carries 1e-12 of it, and the two terms nearly cancel at small ones.
        assert!((got.force[1] - expected).abs() < 1e-9 * expected, "{got:?}");
        assert!(got.stiffness >= 1e6 * 2.0 * c * (1.0 - 1e-9));
        let pull = 300.0 * 2.0 * (2.0 * RADIUS * overlap).sqrt();
        let got = pressed(sticky, overlap).force[1];
        assert!((got - (K * overlap - pull)).abs() < 1e-9 * K * overlap);
    }
}

/// It has no position of one step before, so nothing is known of how it has slid (docs/physics.md, "The laws").
#[test]
fn a_point_that_is_new_to_the_set_has_not_slid_over_a_moving_body() {
    let moving = BodyConfig {
        velocity: [1.0, 0.0],
        motion: Motion::Driven,
        ..body(BodyShape::Disc, A)
    };
    let law = ContactLaw::Linear {
        normal_stiffness: K,
        tangential_stiffness: K,
        friction: 1.0,
        damping_ratio: 0.1,
        damped_mass: 0.0,
    };
    let mut dem = configured(&scene(vec![moving], law));
    let dt = 1e-3;
    dem.imp_set(&[]);
    dem.contact(&step(0.0, dt), &[], &mut []).unwrap();
    dem.advance(&step(0.0, dt)).unwrap();
    let above = |id| interface::message::wire::ImpInfo {
        id,
        radius: RADIUS,
        mass: 1.0,
        ..Default::default()
    };
    // A first one far away, so that there are positions of one step before; then one in contact.
    let far = at(10.0, 10.0);
    let mut forces = [ImpForce::default(); 2];
    dem.imp_set(&[above(1)]);
    dem.contact(&step(dt, dt), &[far], &mut forces[..1])
        .unwrap();
    dem.advance(&step(dt, dt)).unwrap();
    dem.imp_set(&[above(1), above(2)]);
    let touching = at(2.0 * dt, A + 0.9 * RADIUS);
    dem.contact(&step(dt, dt), &[far, touching], &mut forces)
        .unwrap();
    let [x, y] = forces[1].force;
    assert!(
        x.abs() < 1e-9 * K && (y - 0.1 * RADIUS * K).abs() < 1e-9 * K,
        "{x} {y}"
    );
}
