//! Bodies that have not met yet limit the step in time, only by the limits that the solver declares: without a longest
//! step and without points.

use crate::alone::{Alone, Pace};
use crate::small_scenes::*;
use interface::config::{BodyConfig, BodyInertia, BodyShape, DemConfig, Motion, OverlapMeasure};
use interface::solver::Fault;

/// A run until `end` (s) or a fault, as docs/physics.md section 4 has it, its longest step, and the fault.
fn uncapped(config: &DemConfig, safety: f64, end: f64) -> (Alone, f64, Option<Fault>) {
    let mut run = Alone::paced(config, f64::INFINITY, Pace::step_by_step(safety));
    let mut longest = 0.0_f64;
    while run.time < end {
        if let Err(fault) = run.step(false) {
            return (run, longest, Some(fault));
        }
        longest = longest.max(run.dt);
    }
    (run, longest, None)
}

/// A thin floor, its top at y = 0.
fn floor(a: f64) -> BodyConfig {
    let ends = [[-5.0, -a], [5.0, -a]];
    fixed(segment_shape(ends), a)
}

fn falling(shape: BodyShape, a: f64, height: f64, speed: f64) -> BodyConfig {
    BodyConfig {
        position: [0.1, height],
        velocity: [0.0, -speed],
        ..body(shape, a)
    }
}

fn needle() -> BodyShape {
    segment_shape([[-0.05, 0.0], [0.05, 0.0]])
}

/// From near, from far, from rest and in rotation, with steps that would carry a body far through the floor.
#[test]
fn a_fast_body_bounces_off_a_thin_floor_whatever_its_way_there() {
    for (speed, gravity, stiffness) in [(100.0, 0.0, 1e10), (3.0, 9.81, 1e8), (0.0, 9.81, 1e8)] {
        for height in [0.012, 0.3, 2.0] {
            for (name, shape, a, spin) in [
                ("disc", BodyShape::Disc, 0.01, 0.0),
                ("needle", needle(), 2e-3, 0.0),
                ("spinning needle", needle(), 2e-3, 300.0),
                ("square", rectangle_shape(0.1, 0.1), 2e-3, 5.0),
            ] {
                let high = if name == "disc" {
                    height
                } else {
                    height + 0.08
                };
                let mover = BodyConfig {
                    spin,
                    angle: 0.3,
                    ..falling(shape, a, high, speed)
                };
                let mut config = scene(vec![floor(1e-3), mover], spring(stiffness));
                config.gravity = [0.0, -gravity];
                config.skin = 1e-3;
                // Until some time after the first touch.
                let way = (speed * speed + 2.0 * gravity * high).sqrt();
                let touch = 2.0 * high / (speed + way);
                let (ended, _, fault) = uncapped(&config, 0.2, 1.3 * touch);
                let case = format!("{name} from {high} at {speed}");
                assert_eq!(fault, None, "{case}");
                let state = &ended.dem.bodies().state[1];
                assert!(state.center.y > 0.0, "{case}: at {}", state.center);
                let mass = &ended.dem.bodies().properties[1];
                let energy = 0.5 * mass.mass * state.velocity.norm_squared()
                    + 0.5 * mass.inertia * state.spin * state.spin
                    + mass.mass * gravity * state.center.y;
                let start = 0.5 * mass.mass * speed * speed
                    + 0.5 * mass.inertia * spin * spin
                    + mass.mass * gravity * high;
                // (omega dt)^2 / 4 of an impact at 0.2 of the limit is 0.04; what is still in the spring may lack.
                assert!(energy < 1.05 * start, "{case}: {energy} of {start}");
                assert!(energy > 0.3 * start, "{case}: {energy} of {start}");
                assert!(ended.steps < 20_000, "{case}: {} steps", ended.steps);
            }
        }
    }
}

#[test]
fn other_measures_bind_the_step_as_well() {
    let plate = polygon_shape(vec![[-5.0, -4e-3], [5.0, -4e-3], [5.0, 0.0], [-5.0, 0.0]]);
    for overlap in [OverlapMeasure::NearestEdge, OverlapMeasure::Area] {
        let mut config = scene(
            vec![
                fixed(plate.clone(), 0.0),
                falling(rectangle_shape(0.1, 0.1), 0.0, 2.0, 100.0),
            ],
            spring(1e10),
        );
        config.overlap = overlap;
        config.skin = 1e-3;
        let (ended, _, fault) = uncapped(&config, 0.2, 0.025);
        assert_eq!(fault, None, "{overlap:?}");
        let state = &ended.dem.bodies().state[1];
        assert!(
            state.center.y > 0.05 && state.velocity.y > 50.0,
            "{overlap:?}: {state:?}"
        );
        config.body_contact = Some(spring(1e4));
        let (.., fault) = uncapped(&config, 0.8, 0.025);
        assert!(fault.is_some(), "{overlap:?}: it went through");
    }
}

/// The step is as long as the run if no bodies meet, and slow neighbours are not limited by a fast body far away.
#[test]
fn bodies_that_are_far_or_slow_do_not_limit_the_step() {
    let disc = |x: f64, speed: f64| BodyConfig {
        position: [x, 0.0],
        velocity: [speed, 0.0],
        ..body(BodyShape::Disc, 0.01)
    };
    // The distances are below the skin, and the bodies approach slowly: they meet after 0.4 s. The stable step in
    // contact is 0.1 ms. A step that grows all the time is at most an eleventh of the run.
    let mut slow = scene(vec![disc(0.0, 5e-4), disc(0.0204, -5e-4)], spring(1e8));
    slow.skin = 1e-3;
    let (_, alone, _) = uncapped(&slow, 0.8, 0.3);
    assert!(alone > 0.02, "{alone}");
    slow.bodies.push(disc(-1e3, 100.0));
    let (_, with_another, _) = uncapped(&slow, 0.8, 0.3);
    assert!(with_another > 0.02, "{with_another}");
    // They limit the step when they meet, not before.
    let mut meeting = scene(vec![disc(0.0, 1.0), disc(1.02, -1.0)], spring(1e8));
    meeting.skin = 1e-3;
    let (_, longest, _) = uncapped(&meeting, 0.8, 0.45);
    assert!(longest > 0.02, "{longest}");
    let (ended, ..) = uncapped(&meeting, 0.2, 0.55);
    assert!(ended.dem.bodies().state[0].velocity.x < -0.9);
}

/// A rod that rotates past a disc approaches it only by its rotation: `4 v / l` with the speed of its tip.
#[test]
fn rotation_is_an_approach() {
    let (spin, a) = (1e3, 1e-3);
    let rod = BodyConfig {
        motion: Motion::Driven,
        spin,
        ..body(segment_shape([[-0.1, 0.0], [0.1, 0.0]]), a)
    };
    let target = BodyConfig {
        position: [0.09, 2.01 * a],
        inertia: BodyInertia::Mass(1e9),
        ..body(BodyShape::Disc, a)
    };
    let mut config = scene(vec![rod, target], spring(1.0));
    config.skin = 1e-3;
    let mut dem = configured(&config);
    let dt = 1e-7;
    let answer = dem.contact(&step(0.0, dt), &[], &mut []).unwrap();
    let omega = 4.0 * spin * 0.09 / (2.0 * a);
    let ratio = answer.limits.omega_sq.sqrt() / omega;
    assert!((1.0..1.1).contains(&ratio), "{ratio}");
    // Motion away from the disc, or along it, does not limit the step.
    config.bodies[0].spin = -spin;
    config.bodies[0].velocity = [50.0, 0.0];
    let mut dem = configured(&config);
    let answer = dem.contact(&step(0.0, dt), &[], &mut []).unwrap();
    assert!(answer.limits.omega_sq.sqrt() < 0.3 * omega);
}

/// Of each measure: the limit holds where there is friction, and a body near by.
#[test]
fn what_rubs_on_a_body_turns_by_a_quarter_of_a_radian_in_a_step() {
    let (spin, g, rubs) = (1e3, 1e-5, frictional(1.0, 1.0, 0.3));
    for (overlap, shape, a) in [
        (OverlapMeasure::EachEdge, BodyShape::Disc, 0.05),
        (
            OverlapMeasure::EachEdge,
            segment_shape([[-0.01, 0.0], [0.01, 0.0]]),
            0.05,
        ),
        (OverlapMeasure::NearestEdge, rectangle_shape(0.1, 0.1), 0.0),
        (OverlapMeasure::Area, rectangle_shape(0.1, 0.1), 0.0),
    ] {
        for (law, gap, limited) in [(rubs, g, true), (spring(1.0), g, false), (rubs, 0.1, false)] {
            let roller = BodyConfig {
                motion: Motion::Driven,
                spin,
                ..body(shape.clone(), a)
            };
            let plate = BodyConfig {
                position: [0.0, 0.3 + gap],
                ..body(rectangle_shape(2.0, 0.5 - 2.0 * a), a)
            };
            let mut config = scene(vec![roller, plate], law);
            config.overlap = overlap;
            let answer = configured(&config).contact(&step(0.0, 1e-7), &[], &mut []);
            let omega = answer.unwrap().limits.omega_sq.sqrt();
            let at_limit = (omega * 0.25 / (2.0 * spin) - 1.0).abs() < 1e-12;
            let case = format!("{overlap:?}, {law:?}, {gap}: {omega}");
            assert!(at_limit == limited && omega < 8.1 * spin, "{case}");
        }
    }
}

/// A plank on a driven roller, and a disc that spins on a floor and resists rolling. In steps as long as
/// stability allows the sine of the turn dragged the plank the other way, and the disc lost half of what it should.
#[test]
fn a_fast_roller_rubs_and_resists_as_a_slow_one() {
    let (g, end, r) = (9.81, 1.0, 0.05);
    let near = |value: f64, expected: f64| {
        assert!((value / expected - 1.0).abs() < 0.01, "{value} {expected}");
    };
    let held = |hold_x, hold_angle| Motion::Guided {
        hold_x,
        hold_y: false,
        hold_angle,
    };
    let ended = |bodies, law| {
        let mut config = scene(bodies, law);
        config.gravity = [0.0, -g];
        let (mut run, _, fault) = uncapped(&config, 0.8, end);
        assert_eq!(fault, None);
        run.step(true).unwrap();
        run
    };
    let spin = 314.0;
    let roller = BodyConfig {
        motion: Motion::Driven,
        spin,
        ..body(BodyShape::Disc, r)
    };
    let plank = BodyConfig {
        position: [0.0, r + 0.06 - 2e-4 * g],
        motion: held(false, true),
        ..body(rectangle_shape(9.0, 0.1), 0.01)
    };
    let run = ended(vec![roller, plank], frictional(5e3, 2.5e3, 0.3));
    let t = run.time;
    near(run.dem.bodies().state[1].velocity.x, -0.3 * g * t);
    // They touch in the middle of the overlap.
    let slip = spin * (r - 1e-4 * g) * t - 0.5 * 0.3 * g * t * t;
    near(run.dem.measurement().ledger.friction_work, 0.3 * g * slip);
    let disc = BodyConfig {
        position: [0.0, r - 1e-3 * g],
        motion: held(true, false),
        spin,
        ..body(BodyShape::Disc, r)
    };
    let run = ended(
        vec![floor(r), disc],
        granular_law(1e3, 5e2, 0.0, 0.1, 0.0, 0.2),
    );
    let slowing = 0.2 * 0.5 * r * g / (0.5 * r * r);
    near(spin - run.dem.bodies().state[1].spin, slowing * run.time);
}
