//! Impacts are resolved, between bodies and of points; contacts at rest do not shorten the step.

use std::f64::consts::TAU;

use crate::alone::Alone;
use crate::small_scenes::*;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DAMPED_RESOLUTION, DemConfig,
    ELASTIC_RESOLUTION, GroupPair, Motion, OverlapMeasure, RESOLUTION_OF_POINTS,
    ratio_of_restitution,
};
use interface::solver::DemSolver;

/// A pentagon of 1 cm radius that flies at 1 m/s and spins, between two walls 10 cm apart; with or without a
/// sphero-radius.
fn pentagon(overlap: OverlapMeasure, sphero_radius: f64, spin: f64) -> DemConfig {
    let at = |k: usize| TAU * k as f64 / 5.0 + 0.3;
    let vertices = (0..5).map(|k| [0.01 * at(k).cos(), 0.01 * at(k).sin()]);
    let pentagon = BodyConfig {
        inertia: BodyInertia::Density(2000.0),
        velocity: [1.0, 0.0],
        spin,
        ..body(polygon_shape(vertices.collect()), sphero_radius)
    };
    let wall = |x: f64| BodyConfig {
        position: [x, 0.0],
        ..fixed(rectangle_shape(0.02, 2.0), 0.0)
    };
    DemConfig {
        overlap,
        contact_resolution: None,
        skin: 2e-3,
        ..scene(vec![pentagon, wall(-0.06), wall(0.06)], spring(1e6))
    }
}

const PENTAGONS: [(OverlapMeasure, f64); 4] = [
    (OverlapMeasure::EachEdge, 0.0015),
    (OverlapMeasure::NearestEdge, 0.0015),
    (OverlapMeasure::NearestEdge, 0.0),
    (OverlapMeasure::Area, 0.0),
];

/// The relative gain of energy of a pentagon after some bounces, the largest on the way, and the number of steps.
fn bounces(config: &DemConfig, count: usize) -> (f64, f64, u64) {
    let mut run = Alone::new(config, 0.02);
    let begin = run.kinetic(0);
    let (mut bounced, mut touches, mut largest) = (0, false, 0.0_f64);
    let mut gained = 0.0;
    while bounced < count {
        run.step(false).unwrap();
        let touched = std::mem::replace(&mut touches, run.dem.contacts() > 0);
        if touched && !touches {
            bounced += 1;
            gained = run.kinetic(0) / begin - 1.0;
            largest = largest.max(gained.abs());
        }
        assert!(gained.abs() < 0.5, "{gained} after {bounced} bounces");
        // Far along the walls they are as good as no wall.
        assert!(run.dem.bodies().state[0].center.y.abs() < 0.9 || bounced > 0);
    }
    (gained, largest, run.steps)
}

#[test]
fn a_thousand_bounces_keep_the_energy_at_the_default_step() {
    for (overlap, radius) in PENTAGONS {
        let (gained, largest, steps) = bounces(&pentagon(overlap, radius, 20.0), 1000);
        println!("{overlap:?} {radius}: {gained:.2e}, {largest:.2e} on the way, {steps} steps");
        assert!(largest < 0.01, "{overlap:?} {radius}: {largest}");
    }
}

/// A disc that falls onto a floor. Its impact is resolved, and at rest the step is that of stability; with
/// `damping_ratio`.
fn dropped(resolution: Option<f64>, damping_ratio: f64) -> DemConfig {
    let disc = BodyConfig {
        position: [0.0, 0.11],
        ..body(BodyShape::Disc, 0.1)
    };
    let floor = BodyConfig {
        position: [0.0, -0.1],
        ..fixed(rectangle_shape(2.0, 0.1), 0.05)
    };
    let law = ContactLaw::linear(1e6, 0.0, 0.0, damping_ratio);
    DemConfig {
        gravity: [0.0, -9.81],
        contact_resolution: resolution,
        ..scene(vec![disc, floor], law)
    }
}

#[test]
fn a_blow_is_resolved_and_what_rests_is_not() {
    let omega = 1e6_f64.sqrt(); // a disc of 1 kg on a floor that does not move
    for (resolution, damping, asked) in [
        (None, 0.2, DAMPED_RESOLUTION),
        (None, 0.0, ELASTIC_RESOLUTION),
        (Some(0.5), 0.2, 0.5),
        (Some(2.0), 0.2, 2.0),
    ] {
        let mut run = Alone::new(&dropped(resolution, damping), 1e-2);
        let zeta: f64 = damping;
        let allowed = 0.97 * 0.8 * (zeta.hypot(1.0) - zeta) / omega;
        // From the first contact to the first separation, no step is longer than that of the resolution.
        while run.dem.contacts() == 0 {
            run.step(false).unwrap();
        }
        let mut longest = 0.0_f64;
        while run.dem.contacts() > 0 {
            longest = longest.max(run.dt);
            run.step(false).unwrap();
        }
        let ratio = longest / (asked * allowed);
        // The ratio is smaller if the step was still growing when they met.
        assert!(ratio > 0.7 && ratio < 1.0 + 1e-9, "{asked}: {ratio}");
        if damping == 0.0 {
            continue;
        }
        // At rest the step is that of stability again, for any resolution of impacts.
        while run.time < 3.0 {
            run.step(false).unwrap();
        }
        assert!(run.dem.contacts() == 1);
        assert!((run.dt / (2.0 * allowed) - 1.0).abs() < 1e-9, "{asked}");
    }
}

/// Change of the energy of a point of 1 g/m that comes at 1 m/s and is thrown back by a wall or by a point that is as good
/// as fixed, over its energy: rms over 200 phases and steps of 0.8 to 1 of what its contact allows, over the `0.105 (omega
/// dt)^2` of docs/stability.md; and the largest over `(omega dt)^2 / 4`, which two errors of opposite sign have together.
fn rebounds(config: &DemConfig, asked: f64, wall: bool) -> [f64; 2] {
    const MASS: f64 = 1e-3;
    let (mut squares, mut expected, mut largest) = (0.0, 0.0, 0.0_f64);
    for run in 0..200 {
        let [phase, share] = [0.618_034, 0.754_878].map(|p| (p * f64::from(run)).fract());
        let mut points = vec![(info(0, 0.05, MASS), at(0.0, 0.051 + 1e-5 * phase))];
        if !wall {
            let mut other = (info(1, 0.05, 1e9), at(0.0, -0.05));
            other.0.group = 1;
            points.push(other);
        }
        points[0].1.velocity = [0.0, -1.0];
        let mut points = Points::new(&points);
        let mut dem = configured(config);
        dem.imp_set(&points.set);
        let safety = 0.8 * 0.97 * (1.0 - 0.2 * share);
        let (mut before, mut dt, mut left) = (0.0, 0.0, 0);
        while points.states[0].velocity[1] < 0.0 || points.forces[0].force[1] > 0.0 {
            points.step(&mut dem, &step(before, dt));
            let limit = 2.0 * (MASS / points.forces[0].stiffness).sqrt();
            (before, left) = (dt, left - 1);
            if dt == 0.0 || dt > 0.8 * limit || left <= 0 {
                // As epochs do: shorter at once, longer by a tenth at their end.
                let longest = if dt > 0.0 { 1.1 * dt } else { f64::INFINITY };
                (dt, left) = (longest.min(safety * limit), 64);
            }
        }
        let change = points.states[0].velocity[1].powi(2) - 1.0;
        // Two points count twice their stiffness.
        let angle_sq = (safety * asked).powi(2) / if wall { 1.0 } else { 2.0 };
        squares += change * change;
        expected += (0.105 * angle_sq).powi(2);
        largest = largest.max(change.abs() / (angle_sq / 4.0));
    }
    [f64::sqrt(squares / expected), largest]
}

#[test]
fn a_rebound_of_a_point_keeps_its_energy_within_what_its_resolution_leaves() {
    let floor = BodyConfig {
        position: [0.0, -0.1],
        ..fixed(rectangle_shape(2.0, 0.1), 0.05)
    };
    for (resolution, asked) in [(None, 1.0), (Some(0.01), 0.25), (Some(0.02), 0.5)] {
        let on_a_wall = DemConfig {
            contact_resolution: resolution,
            ..scene(vec![floor.clone()], spring(1e6))
        };
        let mut on_a_point = on_a_wall.clone();
        on_a_point.bodies.clear();
        on_a_point.group_pairs.push(GroupPair {
            between: [0, 1],
            law: spring(1e6),
        });
        for (config, wall) in [(on_a_wall, true), (on_a_point, false)] {
            let [rms, largest] = rebounds(&config, asked, wall);
            println!("{resolution:?}, wall {wall}: {rms:.3}, largest {largest:.3}");
            assert!((rms - 1.0).abs() < 0.2 && largest < 1.5, "{rms} {largest}");
        }
    }
    assert_eq!(RESOLUTION_OF_POINTS * ELASTIC_RESOLUTION, 1.0);
}

/// The ratio of the speeds of a disc of 5 cm after and before it bounces off a floor, while `other` is far away.
fn bounce_beside(other: BodyConfig, (mass, speed, stiffness): (f64, f64, f64)) -> f64 {
    let other = BodyConfig {
        position: [5.0, 5.0],
        ..other
    };
    let disc = BodyConfig {
        inertia: BodyInertia::Mass(mass),
        position: [0.0, 0.16],
        velocity: [0.0, -speed],
        ..body(BodyShape::Disc, 0.05)
    };
    let floor = BodyConfig {
        position: [0.0, -0.11],
        ..fixed(rectangle_shape(2.0, 0.2), 0.01)
    };
    let config = DemConfig {
        contact_resolution: None,
        ..scene(vec![disc, floor, other], spring(stiffness))
    };
    let mut run = Alone::new(&config, 1e-2);
    while run.dem.bodies().state[0].velocity.y < 0.0 || run.dem.contacts() > 0 {
        run.step(false).unwrap();
    }
    run.dem.bodies().state[0].velocity.y / speed
}

#[test]
fn an_impact_is_resolved_whatever_moves_elsewhere() {
    let light = BodyConfig {
        inertia: BodyInertia::Mass(1e-3),
        ..body(BodyShape::Disc, 0.01)
    };
    let pushed = BodyConfig {
        motion: Motion::Pushed {
            force: [1.0, 0.0],
            torque: 0.0,
            ramp: 0.0,
            until: Some(0.001),
        },
        ..light.clone()
    };
    let turning = BodyConfig {
        motion: Motion::Driven,
        spin: 314.0,
        ..body(BodyShape::Disc, 0.5)
    };
    let flying = |mass, speed| BodyConfig {
        inertia: BodyInertia::Mass(mass),
        velocity: [speed, 0.0],
        ..light.clone()
    };
    for (other, disc) in [
        (pushed, (1.0, 1.0, 1e5)),
        (turning, (1.0, 0.1, 1e6)),
        (flying(1e-3, 20.0), (1e3, 0.01, 1e8)),
        (flying(1e6, 1.0), (1e-3, 1.0, 1e5)),
    ] {
        let e = bounce_beside(other.clone(), disc);
        assert!((e - 1.0).abs() < 1e-3, "{e} beside {other:?}");
    }
}

/// What one gets of the restitution that is asked for at the default step: mean and largest error of 50 phases of the touch.
/// The bounds are the figures of docs/stability.md.
#[test]
fn restitution_at_the_default_step() {
    for (e, on_average, at_most) in [
        (0.1, 0.0575, 0.125),
        (0.3, 0.024, 0.075),
        (0.6, 0.0055, 0.0275),
        (0.9, 0.001, 0.0075),
    ] {
        let (mut worst, mut sum) = (0.0_f64, 0.0);
        for k in 0..50 {
            let mut config = dropped(None, ratio_of_restitution(e));
            config.gravity = [0.0; 2];
            config.bodies[0].velocity = [0.0, -1.0];
            config.bodies[0].position[1] += 1e-5 * f64::from(k);
            let mut run = Alone::new(&config, 1e-2);
            while run.dem.bodies().state[0].velocity.y < 0.0 || run.dem.contacts() > 0 {
                run.step(false).unwrap();
            }
            let given = run.dem.bodies().state[0].velocity.y;
            worst = worst.max((given / e - 1.0).abs());
            sum += given / e - 1.0;
        }
        let mean: f64 = sum / 50.0;
        println!("{e}: mean {mean:.2e}, largest {worst:.2e}");
        assert!(
            mean.abs() < on_average && worst < at_most,
            "{e}: {mean} {worst}"
        );
    }
}
