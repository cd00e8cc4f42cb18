//! Points of two groups that touch (Chen 2023), as far as the kit's random cases do not judge it (`kit.rs`): angular momentum,
//! threads, and passage.

use crate::small_scenes::linear_law;
use dem_proc::Sdem;
use interface::config::{ContactLaw, DemConfig, GroupPair};
use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::solver::{DemSolver, Fault};
use interface::step::Step;

const K: f64 = 1e5;
const RADIUS: [f64; 3] = [0.05, 0.1, 0.05];
const MASS: [f64; 3] = [2.0, 3.0, 5.0];

fn linear(friction: f64) -> ContactLaw {
    linear_law(K, 0.5 * K, friction, 0.0)
}

/// Groups 0 and 1 touch; there are no bodies.
fn scene(law: ContactLaw) -> DemConfig {
    DemConfig {
        group_pairs: vec![GroupPair {
            between: [1, 0],
            law,
        }],
        skin: 0.02,
        threads: 1,
        ..DemConfig::default()
    }
}

/// Free points with the masses and radii of their groups.
#[derive(Clone)]
struct Points {
    infos: Vec<ImpInfo>,
    states: Vec<ImpState>,
}

impl Points {
    /// Of these groups, at these places (m), with these velocities (m/s); identities are ten times their number.
    fn new(points: &[(u32, [f64; 2], [f64; 2])]) -> Self {
        let info = |(i, &(group, ..)): (usize, &(u32, [f64; 2], [f64; 2]))| ImpInfo {
            id: 10 * i as u64,
            radius: RADIUS[group as usize],
            mass: MASS[group as usize],
            group,
            next: 0,
        };
        let state = |&(_, position, velocity): &(u32, [f64; 2], [f64; 2])| ImpState {
            position,
            velocity,
            ..ImpState::default()
        };
        Self {
            infos: points.iter().enumerate().map(info).collect(),
            states: points.iter().map(state).collect(),
        }
    }

    /// About the origin, with their spins.
    fn angular_momentum(&self) -> f64 {
        let all = self.infos.iter().zip(&self.states);
        all.map(|(i, s)| {
            let ([x, y], [u, v]) = (s.position, s.velocity);
            i.mass * (x * v - y * u) + inertia(i) * s.spin
        })
        .sum()
    }
}

/// Here points are discs, so that couples turn them.
fn inertia(info: &ImpInfo) -> f64 {
    0.5 * info.mass * info.radius * info.radius
}

/// A solver with points, in a run of equal steps.
struct TestRun {
    dem: Sdem,
    points: Points,
    done: u64,
    dt: f64,
}

impl TestRun {
    fn new(config: &DemConfig, points: Points, dt: f64) -> Self {
        let mut dem = Sdem::default();
        dem.configure(config).unwrap();
        dem.imp_set(&points.infos);
        Self {
            dem,
            points,
            done: 0,
            dt,
        }
    }

    /// One step; the first kick is half a step.
    fn step(&mut self) -> Result<Vec<ImpForce>, Fault> {
        let step = Step {
            index: self.done,
            time: self.done as f64 * self.dt,
            dt_before: if self.done == 0 { 0.0 } else { self.dt },
            dt: self.dt,
            measure: true,
        };
        self.done += 1;
        let mut forces = vec![ImpForce::default(); self.points.states.len()];
        self.dem.contact(&step, &self.points.states, &mut forces)?;
        self.dem.advance(&step)?;
        let all = self.points.states.iter_mut().zip(&self.points.infos);
        for ((state, info), force) in all.zip(&forces) {
            for a in 0..2 {
                state.velocity[a] += step.kick() * force.force[a] / info.mass;
                state.position[a] += step.dt * state.velocity[a];
            }
            state.spin += step.kick() * force.couple / inertia(info);
        }
        Ok(forces)
    }
}

/// A heap of points of two groups that are thrown at one another, with friction.
fn heap() -> Points {
    let mut points = Vec::new();
    for i in 0..60_u32 {
        let (group, [x, y]) = (i / 30, [f64::from(i % 5), f64::from(i % 30 / 5)]);
        let side = if group == 0 { 0.1 } else { 0.2 };
        let from = [1.3 * f64::from(group), 0.03 * f64::from(group)];
        points.push((
            group,
            [from[0] + side * x, from[1] + side * y],
            [if group == 0 { 4.0 } else { -6.0 }, 0.5 * f64::from(i % 3)],
        ));
    }
    Points::new(&points)
}

#[test]
fn friction_turns_points_and_keeps_their_angular_momentum() {
    let mut run = TestRun::new(&scene(linear(0.4)), heap(), 2e-5);
    let angular = run.points.angular_momentum();
    for _ in 0..15_000 {
        run.step().unwrap();
    }
    let scale = run.points.infos.iter().map(|i| i.mass).sum::<f64>() * 5.0;
    let error = (run.points.angular_momentum() - angular).abs() / scale;
    assert!(error < 1e-13, "{error:e}");
    let turning = run.points.states.iter().filter(|s| s.spin.abs() > 1.0);
    assert!(turning.count() > 30);
}

#[test]
fn a_state_goes_on_to_the_same_bits_on_any_number_of_threads() {
    let config = scene(linear(0.4));
    let mut straight = TestRun::new(&config, heap(), 1e-4);
    for _ in 0..800 {
        straight.step().unwrap();
    }
    let mut resumed: Vec<TestRun> = [1, 3]
        .map(|threads| {
            let config = DemConfig {
                threads,
                ..config.clone()
            };
            let mut other = TestRun::new(&config, straight.points.clone(), straight.dt);
            other.dem.restore(&straight.dem.save().unwrap()).unwrap();
            other.done = straight.done;
            other
        })
        .into();
    for i in 0..800 {
        let expected = straight.step().unwrap();
        assert!(i > 0 || expected.iter().any(|f| f.force != [0.0; 2]));
        for other in &mut resumed {
            assert_eq!(other.step().unwrap(), expected, "step {i}");
            let [a, b] = [&straight, other].map(|w| w.dem.measurement().ledger);
            assert_eq!(a, b);
        }
    }
    // Of a scene without pairs it is no state.
    let mut other = Sdem::default();
    let without = DemConfig {
        group_pairs: Vec::new(),
        ..config
    };
    other.configure(&without).unwrap();
    assert!(other.restore(&straight.dem.save().unwrap()).is_err());
}

#[test]
fn points_that_would_pass_through_one_another_stop_the_run() {
    let points = Points::new(&[(0, [0.0; 2], [100.0, 0.0]), (1, [0.16, 0.001], [0.0; 2])]);
    let mut run = TestRun::new(&scene(linear(0.0)), points, 1e-4);
    let fault = (0..100).find_map(|_| run.step().err()).unwrap();
    let text = fault.to_string();
    assert!(
        text.contains("points 0 and 10 of groups 0 and 1 overlap"),
        "{text}"
    );
}
