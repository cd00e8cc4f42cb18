//! Points of two groups that touch (Chen 2023): the force, its balance, friction, energy, and what is remembered.

use dem_proc::Sdem;
use interface::Vec2;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, GroupPair, Motion,
};
use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::solver::{DemSolver, Fault};
use interface::step::Step;

const K: f64 = 1e5;
const RADIUS: [f64; 3] = [0.05, 0.1, 0.05];
const MASS: [f64; 3] = [2.0, 3.0, 5.0];

fn linear(friction: f64) -> ContactLaw {
    ContactLaw::Linear {
        normal_stiffness: K,
        tangential_stiffness: 0.5 * K,
        friction,
        damping_ratio: 0.0,
        damped_mass: 0.0,
    }
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
        let state =
            |&(_, position, velocity): &(u32, [f64; 2], [f64; 2])| ImpState { position, velocity };
        Self {
            infos: points.iter().enumerate().map(info).collect(),
            states: points.iter().map(state).collect(),
        }
    }

    fn momentum(&self) -> Vec2 {
        let all = self.infos.iter().zip(&self.states);
        all.map(|(i, s)| i.mass * Vec2::from(s.velocity)).sum()
    }

    fn kinetic(&self) -> f64 {
        let all = self.infos.iter().zip(&self.states);
        all.map(|(i, s)| 0.5 * i.mass * Vec2::from(s.velocity).norm_squared())
            .sum()
    }
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
        }
        Ok(forces)
    }
}

#[test]
fn the_force_is_that_of_a_spring_along_the_line_of_centres() {
    let way = Vec2::new(0.6, 0.8);
    for (distance, pressed) in [(0.12, 0.03), (0.15, 0.0), (0.16, 0.0), (0.2, 0.0)] {
        let far: [f64; 2] = (Vec2::new(1.0, 2.0) + way * distance).into();
        let points = Points::new(&[(0, [1.0, 2.0], [0.0; 2]), (1, far, [0.0; 2])]);
        let mut run = TestRun::new(&scene(linear(0.3)), points, 1e-4);
        let forces = run.step().unwrap();
        let [a, b] = [0, 1].map(|slot| Vec2::from(forces[slot].force));
        assert_eq!(a, -b);
        assert!(
            (a + way * (K * pressed)).norm() < 1e-9 * K,
            "{distance}: {a}"
        );
        // In reach: half of the smaller radius beyond contact.
        let stiffness = if distance < 0.175 { 2.0 * K } else { 0.0 };
        assert_eq!([forces[0].stiffness, forces[1].stiffness], [stiffness; 2]);
        let stored = run.dem.measurement().ledger.contact;
        assert!((stored - 0.5 * K * pressed * pressed).abs() < 1e-9);
    }
}

#[test]
fn only_the_groups_of_a_pair_touch_each_by_its_law() {
    let overlapping =
        |a: u32, b: u32| Points::new(&[(a, [0.0, 0.0], [0.0; 2]), (b, [0.05, 0.0], [0.0; 2])]);
    let mut config = scene(linear(0.0));
    let stiff = ContactLaw::Linear {
        normal_stiffness: 7.0 * K,
        tangential_stiffness: 0.0,
        friction: 0.0,
        damping_ratio: 0.0,
        damped_mass: 0.0,
    };
    config.group_pairs.push(GroupPair {
        between: [1, 2],
        law: stiff,
    });
    let gap = |a: u32, b: u32| RADIUS[a as usize] + RADIUS[b as usize] - 0.05;
    for (a, b, stiffness) in [
        (0, 1, K),
        (1, 2, 7.0 * K),
        (0, 2, 0.0),
        (0, 0, 0.0),
        (1, 1, 0.0),
        (2, 2, 0.0),
    ] {
        let mut run = TestRun::new(&config, overlapping(a, b), 1e-4);
        let forces = run.step().unwrap();
        let expected = -stiffness * gap(a, b);
        let error = (forces[0].force[0] - expected).abs();
        assert!(error < 1e-9 * K, "{a} {b}: {:?}", forces[0]);
        assert_eq!(forces[0].stiffness, 2.0 * stiffness);
    }
}

/// Two free points: `omega^2 = k (1/m_a + 1/m_b)`, contact of half a period, velocities exchanged as in an elastic impact.
#[test]
fn two_points_bounce_off_one_another() {
    let v = 2.0;
    let points = Points::new(&[(0, [0.0; 2], [v, 0.1]), (1, [0.15, 0.0], [0.0, 0.1])]);
    let reduced = MASS[0] * MASS[1] / (MASS[0] + MASS[1]);
    let half_period = std::f64::consts::PI * (reduced / K).sqrt();
    let mut run = TestRun::new(&scene(linear(0.0)), points, half_period / 400.0);
    let (momentum, energy) = (run.points.momentum(), run.points.kinetic());
    let mut in_contact = 0;
    for _ in 0..480 {
        let forces = run.step().unwrap();
        in_contact += u64::from(forces[0].force[0] != 0.0);
        assert_eq!(forces[0].force, forces[1].force.map(|f| -f));
        let error = (run.points.momentum() - momentum).norm();
        assert!(error < 1e-14 * momentum.norm(), "{error:e}");
    }
    assert!((395..=405).contains(&in_contact), "{in_contact}");
    let after = [0, 1].map(|i| run.points.states[i].velocity[0]);
    let expected = [v * (MASS[0] - MASS[1]), 2.0 * MASS[0] * v].map(|p| p / (MASS[0] + MASS[1]));
    for i in 0..2 {
        assert!(
            (after[i] - expected[i]).abs() < 2e-4 * v,
            "{after:?} {expected:?}"
        );
    }
    assert!((run.points.kinetic() / energy - 1.0).abs() < 1e-4);
    assert_eq!(run.dem.measurement().ledger.contact, 0.0);
}

/// A point is led past another one at a constant overlap on a small way: `k_t s`, until `mu F_n`.
#[test]
fn friction_is_a_spring_up_to_coulombs_limit() {
    let (mu, overlap, speed, dt) = (0.05, 0.01, 1e-2, 1e-3);
    let at = |t: f64| [0.15 - overlap, speed * t];
    let points = Points::new(&[(0, [0.0; 2], [0.0; 2]), (1, at(0.0), [0.0, speed])]);
    let mut run = TestRun::new(&scene(linear(mu)), points, dt);
    let (mut slid, mut last) = (0.0, 0.0);
    for i in 0..200_u32 {
        let t = f64::from(i) * dt;
        run.points.states[0].position = [0.0; 2];
        run.points.states[0].velocity = [0.0; 2];
        run.points.states[1].position = at(t);
        run.points.states[1].velocity = [0.0, speed];
        let forces = run.step().unwrap();
        assert_eq!(forces[0].force, forces[1].force.map(|f| -f));
        // The line of centres turns by 0.014 at the end; the force has two components along it.
        let n = Vec2::from(at(t)).normalize();
        let f = Vec2::from(forces[1].force);
        let (normal, tangential) = (f.dot(&n), f.dot(&Vec2::new(-n.y, n.x)));
        let spring = 0.5 * K * speed * t;
        let expected = -spring.min(mu * normal);
        assert!(
            (tangential - expected).abs() < 1e-4 * K * overlap,
            "{i}: {tangential} {expected}"
        );
        if spring > mu * normal {
            slid += mu * normal * speed * dt;
        }
        last = tangential;
    }
    assert!((last / (-mu * K * overlap) - 1.0).abs() < 0.01, "{last}");
    let work = run.dem.measurement().ledger.friction_work;
    assert!((work / slid - 1.0).abs() < 0.02, "{work} {slid}");
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

/// Kinetic energy is that of half steps, so the balance is looked at before and after.
#[test]
fn many_points_keep_momentum_and_the_balance_of_energy() {
    let mut run = TestRun::new(&scene(linear(0.4)), heap(), 2e-5);
    let (momentum, energy) = (run.points.momentum(), run.points.kinetic());
    let scale = run.points.infos.iter().map(|i| i.mass).sum::<f64>() * 5.0;
    let mut pressing = 0;
    for _ in 0..15_000 {
        let forces = run.step().unwrap();
        pressing += usize::from(forces.iter().any(|f| f.force != [0.0; 2]));
    }
    assert!(pressing > 1000, "{pressing}");
    let error = (run.points.momentum() - momentum).norm() / scale;
    assert!(error < 1e-13, "{error:e}");
    let ledger = run.dem.measurement().ledger;
    assert!(ledger.friction_work > 0.01 * energy, "{ledger:?}");
    let after = run.points.kinetic() + ledger.contact + ledger.friction_work;
    assert!((after / energy - 1.0).abs() < 2e-3, "{after} {energy}");
    assert_eq!(ledger.contact_impulse, [0.0; 2]);
}

/// A set that has lost some points and got others changes no force between those that stay.
#[test]
fn what_is_remembered_follows_the_points_through_new_sets() {
    let config = scene(linear(0.4));
    let mut plain = TestRun::new(&config, heap(), 1e-4);
    let mut chosen = TestRun::new(&config, heap(), 1e-4);
    // Far away, untouched, and first, last or in the middle of the ids.
    let stranger = |id: u64| {
        let info = ImpInfo {
            id,
            radius: 0.05,
            mass: 1.0,
            group: 1,
            next: 0,
        };
        let state = ImpState {
            position: [50.0 + id as f64, 0.0],
            velocity: [0.0; 2],
        };
        (info, state)
    };
    for i in 0..1500_u64 {
        if i % 7 == 0 {
            let own = |info: &ImpInfo| info.id.is_multiple_of(10);
            let of = &chosen.points;
            let mut all: Vec<_> = (of.infos.iter().copied())
                .zip(of.states.iter().copied())
                .filter(|(info, _)| own(info))
                .collect();
            for k in 0..i % 4 {
                all.push(stranger((i * 31 + 117 * k) % 600 / 10 * 10 + 1 + k));
            }
            all.sort_by_key(|(info, _)| info.id);
            (chosen.points.infos, chosen.points.states) = all.into_iter().unzip();
            chosen.dem.imp_set(&chosen.points.infos);
        }
        let expected = plain.step().unwrap();
        let forces = chosen.step().unwrap();
        let own = forces.iter().zip(&chosen.points.infos);
        let own = own
            .filter(|(_, info)| info.id.is_multiple_of(10))
            .map(|(f, _)| *f);
        assert!(own.eq(expected), "step {i}");
    }
    assert!(plain.dem.measurement().ledger.friction_work > 0.0);
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

/// Points that touch each other and a body get the sum of both.
#[test]
fn pairs_and_bodies_act_together() {
    let wall = BodyConfig {
        name: "wall".into(),
        shape: BodyShape::Segment {
            ends: [[-1.0, 0.0], [1.0, 0.0]],
        },
        inertia: BodyInertia::Mass(1.0),
        motion: Motion::Fixed,
        sphero_radius: 0.01,
        position: [0.0; 2],
        angle: 0.0,
        velocity: [0.0; 2],
        spin: 0.0,
        surface: String::new(),
    };
    let body = DemConfig {
        bodies: vec![wall],
        point_contact: linear(0.0),
        skin: 0.02,
        threads: 1,
        ..DemConfig::default()
    };
    let both = DemConfig {
        group_pairs: scene(linear(0.0)).group_pairs,
        ..body.clone()
    };
    let points = Points::new(&[(0, [0.0, 0.04], [0.0; 2]), (1, [0.12, 0.09], [0.0; 2])]);
    let force = |config: &DemConfig| TestRun::new(config, points.clone(), 1e-4).step().unwrap();
    let (pairs, body, both) = (force(&scene(linear(0.0))), force(&body), force(&both));
    for slot in 0..2 {
        assert!(body[slot].force[1] > 0.0 && pairs[slot].force[0] != 0.0);
        for a in 0..2 {
            let sum = pairs[slot].force[a] + body[slot].force[a];
            assert!((both[slot].force[a] - sum).abs() < 1e-9);
        }
        assert_eq!(both[slot].stiffness, 3.0 * K);
    }
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
