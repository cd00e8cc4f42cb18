//! Lists and trees beside the oracle, which has none: random moving scenes of many bodies, more than the cases of the kit
//! (`kit.rs`) have.

use interface::Vec2;
use interface::config::{BodyConfig, BodyShape, DemConfig, Motion};
use interface::message::wire::{BodyState, ImpForce, ImpInfo, ImpState};
use interface::solver::DemSolver;
use interface::step::Step;
use mechanics::reference::bodies::Oracle;

use dem_proc::Sdem;

use crate::small_scenes::{OPENING, Random, body, info, scene, segment_shape, spring, star, step};

/// Stiffness of points on bodies and of bodies on one another in N/m. Nothing holds the points back; bodies must not come so
/// deep that the solver stops.
const K: [f64; 2] = [1e4, 1e6];

/// Stars, discs and segments that move inside and around a fixed star with many edges, and points everywhere.
fn crowd(random: &mut Random, skin: f64) -> (DemConfig, Vec<ImpInfo>, Vec<ImpState>) {
    let make = |shape, sphero_radius, position, motion| BodyConfig {
        position,
        angle: 0.3,
        motion,
        ..body(shape, sphero_radius)
    };
    let mut bodies = vec![make(
        star(random, 400, 1.5, 1.6),
        0.02,
        [0.0, 0.0],
        Motion::Fixed,
    )];
    for i in 0..30 {
        let position = [random.between(-2.0, 2.0), random.between(-2.0, 2.0)];
        let shape = match i % 4 {
            0 => BodyShape::Disc,
            1 => segment_shape([[-0.2, 0.0], [0.2, 0.1]]),
            2 => star(random, 5, 0.1, 0.3),
            _ => star(random, 25, 0.25, 0.3),
        };
        let motion = if i % 7 == 0 {
            Motion::Driven
        } else {
            Motion::Free
        };
        let mut body = make(shape, 0.02, position, motion);
        body.velocity = [random.between(-3.0, 3.0), random.between(-3.0, 3.0)];
        body.spin = random.between(-20.0, 20.0);
        bodies.push(body);
    }
    let config = DemConfig {
        body_contact: Some(spring(K[1])),
        skin,
        ..scene(bodies, spring(K[0]))
    };
    let set: Vec<ImpInfo> = (0..200)
        .map(|id| info(id, random.between(0.005, 0.02), 1.0))
        .collect();
    let mut state = || ImpState {
        position: [random.between(-2.0, 2.0), random.between(-2.0, 2.0)],
        velocity: [random.between(-3.0, 3.0), random.between(-3.0, 3.0)],
        ..ImpState::default()
    };
    let states = set.iter().map(|_| state()).collect();
    (config, set, states)
}

/// A body that lies in another one, if any does, in a solver that gets this configuration.
fn overlapping(dem: &mut Sdem, config: &DemConfig) -> Option<usize> {
    if let Err(refusal) = dem.configure(config) {
        let number = |key: &str| {
            key.strip_prefix("dem.body.")?
                .split('.')
                .next()?
                .parse()
                .ok()
        };
        let body: Option<usize> = number(&refusal.key);
        return Some(body.unwrap_or_else(|| panic!("{refusal:?}")));
    }
    dem.contact(&OPENING, &[], &mut []).expect("none is deep");
    let pushed = |body: &BodyState| body.body_force != [0.0; 2];
    dem.measurement().bodies.iter().rposition(pushed)
}

#[test]
fn lists_and_trees_never_miss_a_contact() {
    let dt = 2e-4;
    for (seed, skin) in [(1, 0.0), (2, 0.03), (3, 0.1), (4, 0.5)] {
        let mut random = Random::new(seed);
        let (mut config, set, mut states) = crowd(&mut random, skin);
        let mut dem = Sdem::default();
        // Bodies that overlap are put elsewhere: they could come so deep that the solver stops. Stars with a sphero-radius of
        // 0.02 have no notch that is narrow enough to be refused.
        while let Some(body) = overlapping(&mut dem, &config) {
            config.bodies[body].position = [0; 2].map(|_| random.between(-2.0, 2.0));
        }
        dem.imp_set(&set);
        let mut got = vec![ImpForce::default(); set.len()];
        let mut oracle = Oracle::new(&config);
        let (mut touched, mut passages) = (0, 0);
        for i in 0..400 {
            let step = Step {
                index: i,
                ..step(if i == 0 { 0.0 } else { dt }, dt)
            };
            // A point that passes through a body stops the solver, and is put elsewhere.
            while let Err(fault) = dem.contact(&step, &states, &mut got) {
                let (text, id) = (fault.to_string(), |text: &str| {
                    text.strip_prefix("point ")?.split(' ').next()?.parse().ok()
                });
                let id: usize = id(&text).unwrap_or_else(|| panic!("step {i}: {text}"));
                states[id].position = [0; 2].map(|_| random.between(-2.0, 2.0));
                passages += 1;
            }
            // Motion is for the kit to judge.
            for (body, state) in oracle.bodies.iter_mut().zip(&dem.bodies().state) {
                body.pose = state.center.push(state.angle);
            }
            let expected = oracle.step(&step, &set, &states);
            for (slot, (a, b)) in got.iter().zip(&expected.points).enumerate() {
                let error = (Vec2::from(a.force) - b.force).norm();
                assert!(
                    error <= 1e-9 * K[0],
                    "seed {seed}, step {i}, slot {slot}: {a:?} {b:?}"
                );
                touched += usize::from(b.touched);
            }
            let bodies = dem.measurement().bodies.iter().zip(&expected.bodies);
            for (b, (got, want)) in bodies.enumerate() {
                for (f, t, force, torque) in [
                    (
                        got.point_force,
                        got.point_torque,
                        want.point_force,
                        want.point_torque,
                    ),
                    (
                        got.body_force,
                        got.body_torque,
                        want.body_force,
                        want.body_torque,
                    ),
                ] {
                    let off = (Vec2::from(f) - Vec2::from(force)).norm();
                    assert!(off <= 1e-9 * K[1], "step {i}, body {b}");
                    assert!((t - torque).abs() <= 1e-9 * K[1], "step {i}, body {b}");
                }
            }
            dem.advance(&step).expect("finite");
            for s in &mut states {
                for k in 0..2 {
                    s.position[k] += s.velocity[k] * dt;
                }
            }
        }
        assert!(touched > 10_000 && passages > 10, "{touched} {passages}");
    }
}
