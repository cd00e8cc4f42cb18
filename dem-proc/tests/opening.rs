//! Contacts that open: the bound below which none does, the amplitude above which one does, and how far surfaces may go
//! ahead.

use crate::small_scenes::{body, rectangle_shape};
use dem_proc::body::bodies::Bodies;
use dem_proc::contact::approach::{Near, outer_accelerations};
use dem_proc::contact::impact::{Impacts, Pressing, Relative, SurfaceMotion};
use dem_proc::contact::pair_geometry::LANES;
use dem_proc::lists::now::Ahead;
use interface::Vec2;
use interface::config::{BodyConfig, BodyShape, DemConfig, Motion};
use mechanics::generate::Random;

/// Bodies of 1 kg/m at these places, with a sphero-radius of 0.1 m.
fn grains(shape: &BodyShape, places: [[f64; 2]; 2]) -> DemConfig {
    let grain = |position| BodyConfig {
        position,
        angle: 0.3,
        ..body(shape.clone(), 0.1)
    };
    DemConfig {
        bodies: places.map(grain).into(),
        ..DemConfig::default()
    }
}

#[test]
fn no_contact_below_the_bound_opens() {
    let square = rectangle_shape(0.3, 0.2);
    let mut random = Random::new(7);
    let (mut calm_pairs, mut impacts) = (0, 0);
    for shape in [BodyShape::Disc, square] {
        let config = grains(&shape, [[0.0; 2], [0.15, 0.05]]);
        let mut bodies = Bodies::new(&config).expect("two bodies");
        let point = bodies.outline_of(0)[0];
        let normal = (bodies.state[0].center - bodies.state[1].center).normalize();
        let (kick, stiffness) = (1e-3, 1e4);
        for _ in 0..20_000 {
            let size = 10_f64.powf(random.between(-6.0, 1.0));
            let mut any = || size * random.between(-1.0, 1.0);
            let bulk = Vec2::new(any(), any()) * 100.0;
            let mut motion = || (bulk + Vec2::new(any(), any()), any());
            let kicked = [motion(), motion()];
            let before = kicked.map(|(v, spin)| {
                let mut change = || 10.0 * any() * kick;
                (v + Vec2::new(change(), change()), spin + change())
            });
            for (state, before) in bodies.state.iter_mut().zip(before) {
                (state.velocity, state.spin) = before;
            }
            let impacts_of = Impacts {
                kicked: &kicked,
                kick,
                ahead: Ahead::new(kick, kick, 9.81),
                speed: 0.0,
                energy: 0.0,
                weight: 9.81,
                span: [0.0; 2],
                count: 1.0,
            };
            let near = Near {
                bodies: [0, 1],
                normal,
                point,
                length: 0.2,
            };
            let pressing = Pressing {
                overlap: 1e-3,
                force: 0.0,
                stiffness,
                width: 0.0,
            };
            let motions = [0, 1].map(|b| {
                let (now, was) = (kicked[b], before[b]);
                let accelerated = ((now.0 - was.0) / kick, (now.1 - was.1) / kick);
                SurfaceMotion::of(&bodies.state[b], now, accelerated, 0.0)
            });
            let both = Relative::of(&motions, [[0, 1]; LANES]);
            let calm = both.calm(stiffness, &impacts_of) != 0;
            let is_one = impacts_of.is_one(&bodies, &near, &pressing);
            assert!(!(calm && is_one), "{kicked:?} {before:?}");
            calm_pairs += usize::from(calm);
            impacts += usize::from(is_one);
        }
    }
    // Both answers are common, so the bound has something to hide.
    assert!(
        calm_pairs > 1000 && impacts > 1000,
        "{calm_pairs} {impacts}"
    );
}

/// The amplitude `sqrt(a^2 + omega^2 u^2)` against the overlap at rest `F w - a` and what is negligible.
#[test]
fn a_contact_opens_if_its_amplitude_is_larger_than_its_overlap_at_rest() {
    let config = grains(&BodyShape::Disc, [[0.0; 2], [0.19, 0.0]]);
    let mut bodies = Bodies::new(&config).expect("two bodies");
    let (kick, stiffness, mobility): (f64, f64, f64) = (1e-3, 1e4, 2.0);
    let omega = (stiffness * mobility).sqrt();
    let near = Near {
        bodies: [0, 1],
        normal: Vec2::new(-1.0, 0.0),
        point: Vec2::new(0.1, 0.0),
        length: 0.2,
    };
    for (force, acceleration, outer, speed, energy) in [
        (5.0, 0.0, 0.0, 0.0, 0.0),
        (5.0, 2.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.5, 0.0, 0.0),
        (5.0, 0.0, 0.5, 0.0, 1.0),
        (5.0, -2.0, 9.81, 20.0, 1e3),
        (5.0, -2.0, 9.81, 20.0, 2.0),
    ] {
        let slow = 1e-3 * f64::min(speed, f64::sqrt(energy * mobility));
        let least = force * mobility - acceleration + outer + omega * slow;
        for share in [0.99, 1.01] {
            let amplitude: f64 = share * least;
            let velocity = (amplitude * amplitude - acceleration * acceleration).sqrt() / omega;
            let kicked = [(near.normal * velocity, 0.0), (Vec2::zeros(), 0.0)];
            bodies.state[0].velocity = near.normal * (velocity - acceleration * kick);
            let impacts = Impacts {
                kicked: &kicked,
                kick,
                ahead: Ahead::new(kick, kick, outer),
                speed,
                energy,
                weight: outer,
                span: [0.0; 2],
                count: 1.0,
            };
            let pressing = Pressing {
                overlap: 1e-2,
                force,
                stiffness,
                width: 0.0,
            };
            let opens = impacts.is_one(&bodies, &near, &pressing);
            assert_eq!(opens, share > 1.0, "{force} {acceleration} {outer} {share}");
        }
    }
}

/// Gravity, a push of 5 N and a moment of 0.3 N that turns the surface of a disc of 0.1 m and 1 kg/m.
#[test]
fn what_pushes_and_turns_a_body_adds_up_at_its_surface() {
    let mut config = grains(&BodyShape::Disc, [[0.0; 2], [1.0, 0.0]]);
    config.bodies[0].motion = Motion::Pushed {
        force: [3.0, -4.0],
        torque: -0.3,
        ramp: 0.0,
        until: None,
    };
    let bodies = Bodies::new(&config).expect("two bodies");
    let [weight, found] = outer_accelerations(&bodies, Vec2::new(0.0, -9.81));
    assert_eq!(weight, 9.81);
    let expected = 9.81 + 5.0 + 0.3 * 0.1 / (0.5 * 0.1 * 0.1);
    assert!((found - expected).abs() < 1e-12, "{found}");
}

#[test]
fn the_displacement_ahead_is_two_steps_of_free_fall() {
    // From rest: half a kick, a step, a kick, and a step that is a tenth longer.
    let (dt, g) = (1e-3, 10.0);
    let first = 0.5 * dt * g;
    let second = first + g * 0.5 * (dt + 1.1 * dt);
    let way = first * dt + second * 1.1 * dt;
    let ahead = Ahead::new(0.5 * dt, dt, g);
    assert!((ahead.way(0.0) / way - 1.0).abs() < 1e-12);
    assert!((ahead.way(3.0) - way - 3.0 * 2.1 * dt).abs() < 1e-15);
}
