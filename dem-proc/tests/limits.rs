//! The declared limits are stable, and they are not far too low (C07, C20).

use crate::alone::Alone;
use crate::small_scenes::*;
use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, Motion};
use interface::solver::DemSolver;

/// Largest separation speed of points of mass `m` resting against a free disc of mass `big`, after many steps of
/// `factor` times the limit composed as docs/physics.md section 4: a small push grows without bound where unstable, until the
/// solver itself ends the run (a point deep in a body), which counts as infinite.
fn growth(big: f64, count: usize, factor: f64) -> f64 {
    let (k, m) = (1e6, 1.0);
    let mut config = scene(vec![body(BodyShape::Disc, 1.0)], spring(k));
    config.bodies[0].inertia = BodyInertia::Mass(big);
    let depth = 0.02;
    // Two groups on opposite sides press on the disc with constant forces, so that contacts never open.
    let each: Vec<_> = (0..count)
        .map(|i| {
            (
                info(i as u64, 0.05, m),
                at(if i % 2 == 0 { 1.0 } else { -1.0 } * (1.05 - depth), 0.0),
            )
        })
        .collect();
    let mut points = Points::new(&each);
    let mut dem = configured(&config);
    dem.imp_set(&points.set);
    let limits = points.step(&mut dem, &OPENING).limits;
    let omega = (limits.contact_omega_sq + k / m).sqrt(); // the points' own share: k W_mpm, with W = 1/m
    let dt = factor * 2.0 / omega;
    points.states[0].velocity[0] += 1e-9;
    let mut largest: f64 = 0.0;
    for i in 0..4000 {
        let step = step(if i == 0 { 0.0 } else { dt }, dt);
        if dem
            .contact(&step, &points.states, &mut points.forces)
            .is_err()
        {
            return f64::INFINITY;
        }
        for (i, (state, force)) in points.states.iter_mut().zip(&points.forces).enumerate() {
            let press = if i % 2 == 0 { -k * depth } else { k * depth };
            state.velocity[0] += (force.force[0] + press) / m * step.kick();
            state.position[0] += state.velocity[0] * dt;
            largest = largest.max(state.velocity[0].abs());
        }
        dem.advance(&step).unwrap();
    }
    largest
}

/// Two discs that fly at one another came out of their collision at 366 m/s instead of 20 if a third one, of a radius of 1e-7 m,
/// lay far away: the first step was bound by a contact as deep as the smallest body.
#[test]
fn a_small_body_far_away_does_not_lengthen_the_first_step() {
    let disc = |x, radius, speed| BodyConfig {
        position: [x, 0.0],
        velocity: [speed, 0.0],
        inertia: BodyInertia::Mass(1.0),
        ..body(BodyShape::Disc, radius)
    };
    let first = |more: Option<BodyConfig>| {
        let two = vec![disc(0.0, 0.1, 20.0), disc(0.202, 0.1, -20.0)];
        let mut config = scene(two, hertz_law(1e8, 0.3, 0.0, 1.0, 0.0));
        config.bodies.extend(more);
        let answer = configured(&config).contact(&OPENING, &[], &mut []);
        answer.unwrap().limits.omega_sq
    };
    let alone = first(None);
    let same = |other: f64| assert!((other / alone - 1.0).abs() < 1e-12, "{other} {alone}");
    same(first(Some(disc(9.0, 1e-7, 0.0))));
    // A large one that forces do not move is never the smaller of two.
    let wall = BodyConfig {
        motion: Motion::Fixed,
        ..disc(-9.0, 5.0, 0.0)
    };
    same(first(Some(wall)));
}

#[test]
fn a_body_that_is_not_finite_is_named() {
    let pushed = |x, force| BodyConfig {
        position: [x, 0.0],
        motion: Motion::Pushed {
            force: [force, 0.0],
            torque: 0.0,
            ramp: 0.0,
            until: None,
        },
        ..body(BodyShape::Disc, 0.1)
    };
    let bodies = vec![pushed(0.0, 1.0), pushed(1.0, f64::MAX)];
    let mut dem = configured(&scene(bodies, spring(1e4)));
    let fault = dem.contact(&step(1e3, 1e3), &[], &mut []).unwrap_err();
    assert!(fault.to_string().contains("body 1"), "{fault}");
}

#[test]
fn a_step_at_the_declared_limit_is_stable_for_any_mass_ratio_and_number_of_points() {
    for big in [1e-4, 1e-2, 1.0, 1e2, 1e4] {
        for count in [2, 20, 200] {
            let at_limit = growth(big, count, 0.95);
            assert!(at_limit < 1e-6, "M/m = {big}, {count} points: {at_limit}");
            let beyond = growth(big, count, 1.1);
            assert!(
                beyond > 1e-3,
                "M/m = {big}, {count} points: the limit is too low, {beyond}"
            );
        }
    }
}

/// `k_n (1/m + (r x n)^2 / I) + k_t (1/m + (r x t)^2 / I)`, and `1/m + (r x n)^2 / I`.
#[test]
fn a_contact_off_the_centre_declares_its_rate_and_mobility() {
    let (xi, k, nu): (f64, f64, f64) = (1e-3, 4e4, 0.25);
    let hertz = hertz_law(1e6, nu, 0.5, 1.0, 0.0);
    let k_hertz = 1.5 * 1e6 * xi.sqrt();
    for (law, [k_n, k_t]) in [
        (frictional(k, 0.6 * k, 0.5), [k, 0.6 * k]),
        (hertz, [k_hertz, k_hertz * 2.0 * (1.0 - nu) / (2.0 - nu)]),
    ] {
        let shape = rectangle_shape(0.8, 0.4);
        let config = scene(vec![body(shape, 0.1)], law);
        let (_, dem, answer) = forces(&config, 0.05, &[at(0.3, 0.35 - xi)]);
        let state = &dem.bodies().state[0];
        let (m, i) = (state.inverse_mass, state.inverse_inertia);
        // The contact is in the middle of the overlap; its normal is along y.
        let [along_normal, along_tangent]: [f64; 2] = [0.3, 0.3 - 0.5 * xi];
        let [across, along] = [along_normal, along_tangent].map(|r| m + i * r * r);
        let rate = k_n * across + k_t * along;
        let limits = answer.limits;
        assert!((limits.contact_omega_sq / rate - 1.0).abs() < 1e-10);
        assert!((limits.mobility / across - 1.0).abs() < 1e-10);
    }
}

/// Hertz's spring stiffens: declared is what it has after the overlap has grown for two steps, the second a tenth longer.
#[test]
fn bodies_that_press_and_approach_declare_the_stiffness_ahead() {
    let (constant, xi, speed, dt) = (1e8, 1e-4, 1.0, 1e-4);
    let disc = |x: f64, velocity: f64| BodyConfig {
        position: [x, 0.0],
        velocity: [velocity, 0.0],
        ..body(BodyShape::Disc, 0.1)
    };
    let hertz = hertz_law(constant, 0.3, 0.0, 1.0, 0.0);
    let mut dem = configured(&scene(
        vec![disc(0.0, speed), disc(0.2 - xi, -speed)],
        hertz,
    ));
    let limits = dem.contact(&step(0.0, dt), &[], &mut []).unwrap().limits;
    let ahead = xi + 2.0 * speed * 2.1 * dt;
    let expected = 2.0 * 1.5 * constant * ahead.sqrt(); // two bodies of 1 kg/m
    assert!(
        (limits.omega_sq / expected - 1.0).abs() < 1e-9,
        "{limits:?}"
    );
}

#[test]
fn damping_and_readiness_are_declared() {
    let law = ContactLaw::linear(7.0, 0.0, 0.0, 0.25);
    let mut config = scene(
        vec![body(BodyShape::Disc, 1.0), fixed(BodyShape::Disc, 1.0)],
        law,
    );
    config.bodies[1].position = [3.0, 0.0];
    let mut dem = dem_proc::Sdem::default();
    let ready = dem.configure(&config).unwrap();
    assert_eq!(
        (ready.items, ready.mass_min, ready.stiffness_max),
        (2, 1.0, 7.0)
    );
    assert!(ready.bytes > 0 && ready.courant_time == 0.0);
    let far = scene(vec![body(BodyShape::Disc, 1.0)], law);
    assert_eq!(forces(&far, 0.1, &[at(3.0, 0.0)]).2.limits.damping, 0.0);
    let ratio = forces(&far, 0.1, &[at(1.12, 0.0)]).2.limits.damping;
    assert!((ratio - 0.25).abs() < 1e-15, "{ratio}");
}

/// Dashpots of several contacts add up: at the step of one alone a rod rocked for ever at a ratio of 0.7, and so did ten
/// discs in a row at 0.5.
#[test]
fn what_many_dashpots_hold_comes_to_rest() {
    let ends = |half: f64| segment_shape([[-half, 0.0], [half, 0.0]]);
    let row = BodyShape::Cluster {
        centers: (0..10).map(|i| [0.1 * (f64::from(i) - 4.5), 0.0]).collect(),
        radii: vec![0.02; 10],
    };
    for (shape, radius, ratio) in [
        (ends(0.5), 0.02, 0.7),
        (ends(0.5), 0.02, 1.0),
        (row, 0.0, 0.5),
    ] {
        let floor = BodyConfig {
            position: [0.0, -0.1],
            ..fixed(ends(5.0), 0.1)
        };
        let lies = BodyConfig {
            position: [0.0, 0.0199],
            angle: 1e-4,
            ..body(shape, radius)
        };
        let mut config = scene(vec![floor, lies], ContactLaw::linear(1e4, 0.0, 0.0, ratio));
        config.gravity = [0.0, -9.81];
        let mut run = Alone::new(&config, 1e-2);
        while run.time < 3.0 {
            run.step(false).unwrap();
        }
        let spin = run.dem.bodies().state[1].spin;
        println!("{ratio}: {spin:e} after {} steps", run.steps);
        assert!(spin.abs() < 1e-9, "{ratio}: {spin:e}");
    }
}
