//! Bodies in motion: bounces, collisions, spin, ledger, determinism.

use crate::small_scenes::*;
use interface::Vec2;
use interface::config::{BodyConfig, BodyShape, ContactLaw, DemConfig};
use interface::solver::DemSolver;
use mechanics::generate::{Grain, Packing, Sizes, open_box};

/// A point hits a free disc head-on; returns restitution and the largest energy seen over the initial one.
fn bounce(omega_dt: f64, phase: f64) -> (f64, f64) {
    let (k, m, mass) = (1e5, 1.0, 3.0);
    let mut config = scene(vec![body(BodyShape::Disc, 0.1)], spring(k));
    config.bodies[0].inertia = interface::config::BodyInertia::Mass(mass);
    config.skin = 0.01;
    let omega = (k * (1.0 / m + 1.0 / mass)).sqrt();
    let dt = omega_dt / omega;
    let mut dem = configured(&config);
    let speed = 1.0;
    let start = 0.15 + 2e-3 + speed * dt * phase;
    let mut state = at(start, 0.0);
    state.velocity = [-speed, 0.0];
    let mut points = Points::new(&[(info(0, 0.05, m), state)]);
    dem.imp_set(&points.set);
    let mut before = 0.0;
    let (mut touched, mut steps) = (false, 0);
    loop {
        points.step(&mut dem, &step(before, dt));
        before = dt;
        touched |= points.forces[0].force[0] > 0.0;
        steps += 1;
        assert!(steps < 100_000);
        if touched && points.forces[0].force[0] == 0.0 {
            break;
        }
    }
    let v = points.states[0].velocity[0] - dem.bodies().state[0].velocity.x;
    let momentum = points.momentum().x + mass * dem.bodies().state[0].velocity.x;
    assert!((momentum + m * speed).abs() < 1e-14 * f64::from(steps));
    (v / speed, dem.bodies().state[0].velocity.y.abs())
}

/// C18: a force that is one step late gives 1.17 at 0.1.
#[test]
fn a_central_bounce_keeps_its_energy_over_64_phases() {
    for omega_dt in [0.05, 0.1] {
        let e: Vec<f64> = (0..64)
            .map(|i| bounce(omega_dt, f64::from(i) / 64.0).0)
            .collect();
        let mean = e.iter().sum::<f64>() / 64.0;
        assert!((mean - 1.0).abs() < 1e-3, "{omega_dt}: {mean}");
    }
}

#[test]
fn a_fixed_body_bounces_a_point_in_half_a_period() {
    let (k, m, v) = (1e5_f64, 1.0, 0.5);
    let config = scene(vec![fixed(BodyShape::Disc, 0.1)], spring(k));
    let omega = (k / m).sqrt();
    let dt = 0.01 / omega;
    let mut state = at(0.15, 0.0);
    state.velocity = [-v, 0.0];
    let mut points = Points::new(&[(info(0, 0.05, m), state)]);
    let mut dem = configured(&config);
    dem.imp_set(&points.set);
    let (mut largest, mut steps) = (0.0_f64, 0);
    loop {
        points.step(&mut dem, &step(if steps == 0 { 0.0 } else { dt }, dt));
        steps += 1;
        let f = points.forces[0].force[0];
        largest = largest.max(f);
        if steps > 2 && f == 0.0 {
            break;
        }
    }
    let time = f64::from(steps - 1) * dt;
    assert!(
        (time / (std::f64::consts::PI / omega) - 1.0).abs() < 0.01,
        "{time}"
    );
    assert!(
        (largest / (v * (k * m).sqrt()) - 1.0).abs() < 1e-4,
        "{largest}"
    );
}

fn two_polygons(law: ContactLaw) -> DemConfig {
    let mut random = Random(5);
    let make = |vertices, x: f64, v: [f64; 2], spin| BodyConfig {
        position: [x, 0.05 * x],
        velocity: v,
        spin,
        ..body(BodyShape::Polygon { vertices }, 0.1)
    };
    let a = make(random.star(5, 0.7, 1.0), -1.3, [1.0, 0.2], 0.5);
    let b = make(random.star(6, 0.7, 1.0), 1.3, [-1.0, 0.0], -0.8);
    scene(vec![a, b], law)
}

/// Total energy, momentum and angular momentum about the origin at the last measured step.
fn totals(dem: &dem_proc::Sdem) -> (f64, Vec2, f64) {
    let m = dem.measurement();
    let l = &m.ledger;
    let energy = l.kinetic + l.kinetic_rotation + l.gravity + l.contact;
    let angular = |b: &interface::message::wire::BodyState| {
        b.inertia * b.spin + b.mass * cross(b.position.into(), b.velocity.into())
    };
    (
        energy,
        l.momentum.into(),
        m.bodies.iter().map(angular).sum(),
    )
}

#[test]
fn two_polygons_collide_without_losing_energy_or_momentum() {
    let config = two_polygons(spring(1e5));
    let dt = 2e-5;
    let mut dem = configured(&config);
    let mut touched = false;
    let (mut first, mut last) = (None, (0.0, Vec2::zeros(), 0.0));
    for i in 0..60_000 {
        let step = step(if i == 0 { 0.0 } else { dt }, dt);
        let answer = dem.contact(&step, &[], &mut []).unwrap();
        assert!(answer.limits.omega_sq * dt * dt < 0.1);
        dem.advance(&step).unwrap();
        last = totals(&dem);
        first.get_or_insert(last);
        touched |= dem.measurement().ledger.contact > 0.0;
    }
    let first = first.unwrap();
    assert!(touched);
    assert!(
        (last.0 / first.0 - 1.0).abs() < 1e-4,
        "energy {} {}",
        first.0,
        last.0
    );
    assert!((last.1 - first.1).norm() < 1e-12);
    assert!(
        (last.2 - first.2).abs() < 1e-10,
        "angular momentum {} {}",
        first.2,
        last.2
    );
}

#[test]
fn with_friction_and_damping_the_ledger_closes() {
    let law = ContactLaw::Linear {
        normal_stiffness: 1e5,
        tangential_stiffness: 3e4,
        friction: 0.4,
        damping_ratio: 0.1,
        damped_mass: 0.0,
    };
    let residual = |dt: f64| {
        let mut dem = configured(&two_polygons(law));
        let mut first = None;
        let mut worst: f64 = 0.0;
        for i in 0..(1.2 / dt) as usize {
            let step = step(if i == 0 { 0.0 } else { dt }, dt);
            dem.contact(&step, &[], &mut []).unwrap();
            dem.advance(&step).unwrap();
            let l = dem.measurement().ledger;
            let total = totals(&dem).0 + l.friction_work + l.viscous_work;
            worst = worst.max((total / *first.get_or_insert(total) - 1.0).abs());
        }
        let l = dem.measurement().ledger;
        assert!(l.friction_work > 1e-4 && l.viscous_work > 1e-3, "{l:?}");
        worst
    };
    let (coarse, fine) = (residual(4e-5), residual(1e-5));
    assert!(fine < 2e-4, "{coarse} {fine}");
}

#[test]
fn two_discs_collide_with_momentum_to_rounding_and_swap_velocities() {
    let disc = |x: f64, v: f64| BodyConfig {
        position: [x, 0.0],
        velocity: [v, 0.0],
        ..body(BodyShape::Disc, 0.1)
    };
    let config = scene(vec![disc(-0.2, 1.0), disc(0.2, 0.0)], spring(1e5));
    let mut dem = configured(&config);
    let dt = 1e-5;
    for i in 0..60_000 {
        let step = step(if i == 0 { 0.0 } else { dt }, dt);
        dem.contact(&step, &[], &mut []).unwrap();
        dem.advance(&step).unwrap();
        let p = dem.bodies().state[0].velocity + dem.bodies().state[1].velocity;
        assert!((p - Vec2::x()).norm() < 1e-14);
    }
    assert!((dem.bodies().state[1].velocity.x - 1.0).abs() < 1e-5);
    assert!(dem.bodies().state[0].velocity.x.abs() < 1e-5);
}

/// Enough bodies, in a mixed order, that every loop over bodies or pairs is shared, and chunks of pairs of all parts.
fn heap(threads: usize) -> Vec<f64> {
    let packing = |grain, largest: f64| Packing {
        grain,
        sizes: Sizes::Uniform {
            from: 0.9 * largest,
            to: largest,
        },
        density: 2000.0,
        looseness: 0.01 / largest - 1.0,
        seed: 1,
    };
    let mut bodies = open_box(1.0, 4.0, 0.01);
    let discs = packing(Grain::Disc, 0.01).rows(4200, 1.0);
    let mut pentagons = packing(Grain::PENTAGON, 0.005).rows(4200, 1.0);
    for pentagon in &mut pentagons {
        pentagon.position[1] += 0.02 / 3.0_f64.sqrt(); // into the holes between three discs, which are too small for it
    }
    bodies.extend(discs);
    bodies.extend(pentagons);
    let law = ContactLaw::Linear {
        normal_stiffness: 1e5,
        tangential_stiffness: 5e4,
        friction: 0.5,
        damping_ratio: 0.3,
        damped_mass: 0.0,
    };
    let mut config = scene(bodies, law);
    config.gravity = [0.0, -9.81];
    config.threads = threads;
    config.skin = 0.002;
    let mut dem = configured(&config);
    let dt = 2e-5;
    let mut bits = Vec::new();
    for i in 0..120 {
        let step = step(if i == 0 { 0.0 } else { dt }, dt);
        let limits = dem.contact(&step, &[], &mut []).unwrap().limits;
        bits.extend([limits.omega_sq, limits.speed]);
        dem.advance(&step).unwrap();
    }
    let ledger = dem.measurement().ledger;
    assert!(dem.contacts() > 10_000, "{}", dem.contacts());
    bits.extend([ledger.friction_work, ledger.viscous_work, ledger.contact]);
    for s in &dem.bodies().state {
        bits.extend([s.center.x, s.center.y, s.angle, s.velocity.x, s.spin]);
    }
    bits
}

#[test]
fn a_heap_has_the_same_bits_on_any_number_of_threads() {
    let one = heap(1);
    for threads in [2, 3] {
        for (i, (a, b)) in one.iter().zip(&heap(threads)).enumerate() {
            assert_eq!(a.to_bits(), b.to_bits(), "{threads} threads, number {i}");
        }
    }
}

#[test]
fn an_opening_step_changes_nothing() {
    let mut config = two_polygons(frictional(1e5, 1e5, 0.5));
    config.gravity = [0.0, -9.81];
    let run = |openings: bool| {
        let mut dem = configured(&config);
        let dt = 1e-4;
        for i in 0..6000 {
            if openings && i % 100 == 0 {
                dem.contact(&OPENING, &[], &mut []).unwrap();
                dem.advance(&OPENING).unwrap();
            }
            let step = step(if i == 0 { 0.0 } else { dt }, dt);
            dem.contact(&step, &[], &mut []).unwrap();
            dem.advance(&step).unwrap();
        }
        dem.measurement().clone()
    };
    assert_eq!(run(true), run(false));
}
