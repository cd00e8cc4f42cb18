//! A point or a body that goes through a body ends the run with a reason; one that only rolls round it, or presses deep,
//! does not.

use std::f64::consts::{PI, TAU};

use crate::small_scenes::*;
use interface::Vec2;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, DemConfig, GroupPair, Motion, OverlapMeasure,
};
use interface::message::wire::ImpForce;
use interface::solver::DemSolver;

const RADIUS: f64 = 0.05;
const DT: f64 = 1e-3;

fn polygon(vertices: &[[f64; 2]]) -> BodyShape {
    polygon_shape(vertices.to_vec())
}

fn segment() -> BodyShape {
    segment_shape([[-1.0, 0.0], [1.0, 0.0]])
}

/// Takes a point along a path past the bodies; the step at which the solver refuses to go on, and its reason.
fn refusal(config: &DemConfig, path: impl IntoIterator<Item = Vec2>) -> Option<(u64, String)> {
    let mut dem = configured(config);
    dem.imp_set(&[info(7, RADIUS, 1.0)]);
    let mut forces = [ImpForce::default()];
    for (index, p) in (0..).zip(path) {
        let step = step(if index == 0 { 0.0 } else { DT }, DT);
        if let Err(fault) = dem.contact(&step, &[at(p.x, p.y)], &mut forces) {
            return Some((index, fault.to_string()));
        }
        dem.advance(&step).unwrap();
    }
    None
}

/// Straight from one place to another in steps of a share of the point's radius.
fn way(from: [f64; 2], to: [f64; 2], share: f64) -> Vec<Vec2> {
    let (from, to) = (Vec2::from(from), Vec2::from(to));
    let steps = ((to - from).norm() / (share * RADIUS)).ceil();
    let at = |k: usize| from + (to - from) * (k as f64 / steps);
    (0..=steps as usize).map(at).collect()
}

/// Along a circle, in steps of a share of the point's radius.
fn round(centre: [f64; 2], radius: f64, angles: [f64; 2], share: f64) -> Vec<Vec2> {
    let steps = ((angles[1] - angles[0]).abs() * radius / (share * RADIUS)).ceil();
    let at = |k: usize| {
        let angle = angles[0] + (angles[1] - angles[0]) * (k as f64 / steps);
        Vec2::from(centre) + Vec2::new(angle.cos(), angle.sin()) * radius
    };
    (0..=steps as usize).map(at).collect()
}

/// The body as the only one, fixed.
fn alone(shape: BodyShape, a: f64) -> DemConfig {
    scene(vec![fixed(shape, a)], spring(1e4))
}

#[test]
fn a_point_driven_through_a_body_is_named_whatever_the_step() {
    let plate = [[-1.0, -0.004], [1.0, -0.004], [1.0, 0.004], [-1.0, 0.004]];
    let spike = [[-1.0, -0.1], [-1.0, 0.1], [1.0, 0.0]];
    let block = [[-1.0, -0.3], [1.0, -0.3], [1.0, 0.3], [-1.0, 0.3]];
    let gon = |n: usize| {
        let at = |k: usize| TAU * k as f64 / n as f64;
        let corners = (0..n).map(|k| [0.3 * at(k).cos(), 0.3 * at(k).sin()]);
        polygon_shape(corners.collect())
    };
    let (centers, radii) = (vec![[-0.2, 0.0], [0.2, 0.0]], vec![0.25, 0.25]);
    let cluster = BodyShape::Cluster { centers, radii };
    // Where it crosses; the run must stop in the middle, or a little later.
    let cases: &[(&str, BodyShape, f64, f64)] = &[
        ("disc", BodyShape::Disc, 0.2, 0.0),
        ("small disc", BodyShape::Disc, 0.01, 0.0),
        ("segment", segment(), 0.02, 0.3),
        ("plate", polygon(&plate), 0.0, 0.3),
        ("spike", polygon(&spike), 0.0, 0.9),
        ("block", polygon(&block), 0.0, 0.3),
        ("square", gon(4), 0.02, 0.01),
        ("hexagon", gon(6), 0.02, 0.01),
        ("many corners", gon(40), 0.02, 0.01),
        ("cluster", cluster, 0.0, 0.2),
    ];
    for (name, shape, a, x) in cases {
        for share in [0.5, 0.11, 0.003] {
            let path = way([*x, 0.6], [*x, -0.6], share);
            let (step, reason) = refusal(&alone(shape.clone(), *a), path.clone())
                .unwrap_or_else(|| panic!("{name}, {share}: it went through"));
            assert!(
                path[step as usize].y > -0.5 * RADIUS - 1e-9,
                "{name}, {share}: stopped at {}",
                path[step as usize]
            );
            for phrase in ["point 7", "body 0 (body)", "overlap of", "stiffer contact"] {
                assert!(reason.contains(phrase), "{name}: no `{phrase}` in {reason}");
            }
        }
    }
}

#[test]
fn rolling_round_corners_caps_and_tips_is_no_passage() {
    let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let needle = [[-1.0, -0.01], [1.0, 0.0], [-1.0, 0.01]];
    for share in [0.5, 0.1] {
        for (name, shape, a, corner) in [
            ("square", polygon(&square), 0.0, [1.0, 1.0]),
            ("needle", polygon(&needle), 0.0, [1.0, 0.0]),
            ("segment", segment(), 0.01, [1.0, 0.0]),
        ] {
            // From light contact to an overlap of six tenths of the point's radius.
            for distance in [1.0, 0.7, 0.4] {
                let path = round(corner, a + distance * RADIUS, [-0.6 * PI, 0.6 * PI], share);
                let refused = refusal(&alone(shape.clone(), a), path);
                assert_eq!(refused, None, "{name}, {share}, {distance}");
            }
        }
        // Past the corner of a square from one side to the other, with the centre inside.
        let path = way([0.97, 0.4], [0.97, 1.5], share);
        assert_eq!(refusal(&alone(polygon(&square), 0.0), path), None);
        let path = way([0.9, 0.97], [0.97, 0.9], share);
        assert_eq!(refusal(&alone(polygon(&square), 0.0), path), None);
    }
}

/// From wall to wall of a notch of 23 degrees the normal turns by 157.
#[test]
fn the_nearer_wall_of_a_notch_may_change() {
    let notched = polygon(&[
        [-1.0, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [0.2, 1.0],
        [0.0, 0.0],
        [-0.2, 1.0],
        [-1.0, 1.0],
    ]);
    let path = way([-0.02, 0.3], [0.02, 0.3], 0.1);
    assert_eq!(refusal(&alone(notched, 0.0), path), None);
}

/// A point that goes round with a body does not turn as the body sees it, and a body that turns onto a point does.
#[test]
fn the_body_s_own_rotation_is_not_the_point_s() {
    let spin = 0.4 / DT; // as far as the kinematic limit lets a body of this size turn, and eight times more
    let rod = BodyConfig {
        motion: Motion::Driven,
        spin,
        ..body(segment(), 0.02)
    };
    let config = scene(vec![rod], spring(1e4));
    let along = (0..100).map(|k| {
        let angle = spin * DT * f64::from(k);
        Vec2::new(
            0.5 * angle.cos() - 0.03 * angle.sin(),
            0.5 * angle.sin() + 0.03 * angle.cos(),
        )
    });
    assert_eq!(refusal(&config, along), None);
    let slow = BodyConfig {
        motion: Motion::Driven,
        spin: 0.02 / DT,
        ..body(segment(), 0.02)
    };
    let still = std::iter::repeat_n(Vec2::new(0.5, 0.06), 20);
    let (step, _) =
        refusal(&scene(vec![slow], spring(1e4)), still).expect("the rod passes over it");
    let angle = 0.02 * step as f64;
    assert!((0.06_f64 / 0.5).atan() <= angle && angle < (0.06_f64 / 0.5).atan() + 0.02);
}

/// The trace of a pair follows its point into another set and another list.
#[test]
fn a_new_set_forgets_nothing() {
    let mut dem = configured(&alone(segment(), 0.02));
    let mut forces = [ImpForce::default(); 2];
    let mut stopped = None;
    for (index, p) in (0..).zip(way([0.3, 0.06], [0.3, -0.06], 0.3)) {
        let step = step(if index == 0 { 0.0 } else { DT }, DT);
        let here = at(p.x, p.y);
        let elsewhere = at(-0.5, 0.06);
        let (set, states) = if index % 2 == 0 {
            (vec![info(7, RADIUS, 1.0)], vec![here])
        } else {
            (
                vec![info(3, RADIUS, 1.0), info(7, RADIUS, 1.0)],
                vec![elsewhere, here],
            )
        };
        dem.imp_set(&set);
        if let Err(fault) = dem.contact(&step, &states, &mut forces[..set.len()]) {
            stopped = Some((p, fault.to_string()));
            break;
        }
        dem.advance(&step).unwrap();
    }
    let (p, reason) = stopped.expect("it goes through");
    assert!(
        reason.contains("point 7 has passed through") && p.y > -0.3 * RADIUS,
        "{p} {reason}"
    );
}

/// A driven body that comes down on one that can hardly be moved, a share of `length` in each step: the lowest point of
/// its outline when the solver refuses to go on, and the reason.
fn driven_into(
    mover: BodyConfig,
    floor: BodyConfig,
    overlap: OverlapMeasure,
    step_by: f64,
    way: f64,
) -> Option<(f64, String)> {
    let mover = BodyConfig {
        name: "mover".into(),
        motion: Motion::Driven,
        velocity: [0.0, -step_by / DT],
        ..mover
    };
    let floor = BodyConfig {
        name: "floor".into(),
        inertia: BodyInertia::Mass(1e12),
        ..floor
    };
    let config = DemConfig {
        overlap,
        ..scene(vec![mover, floor], spring(1e4))
    };
    let mut dem = configured(&config);
    for i in 0..(way / step_by) as usize {
        let step = step(if i == 0 { 0.0 } else { DT }, DT);
        if let Err(fault) = dem.contact(&step, &[], &mut []) {
            let outline = dem.bodies().outline_of(0).iter();
            let lowest = outline.map(|p| p.y).fold(f64::INFINITY, f64::min);
            return Some((lowest, fault.to_string()));
        }
        dem.advance(&step).unwrap();
    }
    None
}

fn high(shape: BodyShape, a: f64) -> BodyConfig {
    BodyConfig {
        position: [0.013, 0.6],
        ..body(shape, a)
    }
}

#[test]
fn a_body_driven_through_a_body_is_named_whatever_the_measure() {
    use OverlapMeasure::{Area, EachEdge, NearestEdge};
    let plate = polygon(&[[-1.0, -0.02], [1.0, -0.02], [1.0, 0.02], [-1.0, 0.02]]);
    let needle = polygon(&[[-0.1, 0.3], [0.0, -0.3], [0.1, 0.3]]);
    let cluster = BodyShape::Cluster {
        centers: vec![[-0.1, 0.0], [0.1, 0.0]],
        radii: vec![0.04, 0.05],
    };
    let (rod, flat) = (|a| body(segment(), a), |a| body(plate.clone(), a));
    let (disc, ball) = (high(BodyShape::Disc, 0.05), body(BodyShape::Disc, 0.1));
    let (block, pair) = (|a| high(rectangle_shape(0.4, 0.4), a), high(cluster, 0.0));
    let wedge = |a| high(needle.clone(), a);
    // The length in which the force has the right sign, and the lowest place of the outline that is not too late.
    let cases = [
        ("disc", disc.clone(), rod(0.02), EachEdge, 0.07, 0.0),
        ("square", block(0.01), rod(0.02), EachEdge, 0.03, 0.0),
        ("on a plate", block(0.01), flat(0.01), EachEdge, 0.02, 0.02),
        ("needle", wedge(5e-3), rod(5e-3), EachEdge, 0.01, 0.0),
        ("cluster", pair, rod(0.01), EachEdge, 0.05, 0.0),
        ("disc on disc", disc, ball, EachEdge, 0.15, 0.0),
        ("nearest", block(0.01), flat(0.0), NearestEdge, 0.03, -0.02),
        ("narrow", wedge(0.01), flat(0.01), NearestEdge, 0.04, -0.02),
        ("area", block(0.0), flat(0.0), Area, 0.04, -0.01),
        // Its normal never turns.
        ("narrow area", wedge(0.0), flat(0.0), Area, 0.04, -0.01),
    ];
    for (name, mover, floor, measure, length, lowest) in cases {
        for share in [0.5, 0.13, 0.01] {
            let by = share * length;
            let stopped = driven_into(mover.clone(), floor.clone(), measure, by, 1.2);
            let (y, reason) = stopped.unwrap_or_else(|| panic!("{name}, {share}: it went through"));
            assert!(y > lowest - by, "{name}, {share}: stopped at {y}: {reason}");
            let phrases = ["(mover)", "(floor)", "overlap of", "stiffer contact"];
            assert!(phrases.iter().all(|p| reason.contains(p)), "{reason}");
            if measure == EachEdge && name != "cluster" {
                let overlap = reason.split("overlap of ").nth(1).expect("an overlap");
                let overlap = overlap.split(' ').next().expect("a number").parse::<f64>();
                let of_length = overlap.expect("a number") / length;
                assert!((0.749..1.001).contains(&of_length), "{name}: {reason}");
            }
        }
    }
}

/// A corner that comes down past the tip of a needle may cut off a quarter of the needle's thickness along the outline, or the
/// sum of the sphero-radii if that is more; `2 d cos(alpha/2)` at a distance `d` from the tip.
#[test]
fn a_corner_may_cut_off_a_small_tip() {
    let needle = polygon(&[[-0.6, -0.1], [0.0, 0.0], [-0.6, 0.1]]);
    let cos = 0.6 / 0.6_f64.hypot(0.1);
    let quarter = 0.25 * 0.2 * cos; // thin across a long side
    for (a, allowed) in [(0.0, quarter), (0.02, quarter), (0.03, 0.06)] {
        for (share, goes) in [(0.95, true), (1.05, false)] {
            let away = 0.5 * share * allowed / cos;
            let diamond = BodyConfig {
                position: [0.2 * 2.0_f64.sqrt() - away, 0.6],
                angle: 0.25 * PI,
                ..body(rectangle_shape(0.4, 0.4), a)
            };
            let floor = body(needle.clone(), a);
            let stopped = driven_into(diamond, floor, OverlapMeasure::NearestEdge, 1e-3, 1.2);
            assert_eq!(stopped.is_none(), goes, "{a}, {share}: {stopped:?}");
            let through = |(_, reason): (f64, String)| reason.contains("has passed through");
            assert!(stopped.is_none_or(through));
        }
    }
}

/// A tip that has cut off a small tip of another body comes to lie across it. Then no vertex of either is in the other, and no force
/// holds them.
#[test]
fn bodies_that_lie_across_one_another_are_named() {
    let needle = polygon(&[[-0.6, -0.1], [0.0, 0.0], [-0.6, 0.1]]);
    let rod = segment_shape([[-0.6, 0.0], [0.0, 0.0]]);
    let quarter = 0.25 * 0.2 * 0.6 / 0.6_f64.hypot(0.1); // thin across a long side
    for (shape, a, allowed) in [(needle, 0.0, quarter), (rod, 0.02, 0.04)] {
        for by in [1e-3, 1e-4] {
            let mover = BodyConfig {
                position: [-0.01, 0.3],
                angle: -PI / 3.0,
                ..body(shape.clone(), a)
            };
            let floor = body(shape.clone(), a);
            let stopped = driven_into(mover, floor, OverlapMeasure::NearestEdge, by, 0.7);
            let (_, reason) = stopped.unwrap_or_else(|| panic!("{shape:?}, {a}: unseen"));
            assert!(
                reason.contains("(mover) lies across body 1 (floor)"),
                "{reason}"
            );
            let overlap = reason.split("overlap of ").nth(1).expect("an overlap");
            let overlap = overlap.split(' ').next().expect("a number").parse::<f64>();
            let more = overlap.expect("a number") - allowed;
            assert!(
                (-1e-4..by + 1e-4).contains(&more),
                "{a}, {by}: {more}, {reason}"
            );
        }
    }
}

/// Two points of 5 and 10 cm, of groups that touch.
#[test]
fn points_that_would_pass_through_one_another_stop_the_run() {
    let point = |id: u64, radius, x, y| {
        let mut info = info(10 * id, radius, 2.0);
        info.group = id as u32;
        (info, at(x, y))
    };
    let mut points = Points::new(&[point(0, RADIUS, 0.0, 0.0), point(1, 0.1, 0.16, 0.001)]);
    let mut config = scene(Vec::new(), spring(1e5));
    config.group_pairs.push(GroupPair {
        between: [1, 0],
        law: spring(1e5),
    });
    let mut dem = configured(&config);
    dem.imp_set(&points.set);
    let fault = (0..100).find_map(|_| {
        points.states[0].position[0] += 0.01;
        let result = dem.contact(&step(DT, DT), &points.states, &mut points.forces);
        result.err()
    });
    let text = fault.expect("a fault").to_string();
    assert!(
        text.contains("points 0 and 10 of groups 0 and 1 overlap"),
        "{text}"
    );
}
