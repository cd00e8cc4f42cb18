//! Small scenes in which everything that a contact remembers changes in every step, and a driver that tells the bits of
//! what a solver answers.

use dem_proc::Sdem;
use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion};
use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::solver::DemSolver;
use interface::step::Step;

use crate::small_scenes::{
    Random, hertz_law, info, linear_law, polygon_shape, rectangle_shape, segment_shape,
};

/// Step in s.
const DT: f64 = 1e-4;

pub const LINEAR: ContactLaw = linear_law(1e5, 5e4, 0.3, 0.2);

pub const HERTZ: ContactLaw = hertz_law(2e6, 0.3, 0.3, 0.7, 0.0);

fn polygon(n: usize, radius: f64) -> BodyShape {
    let corner = |i: usize| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
        [radius * cos, radius * sin]
    };
    polygon_shape((0..n).map(corner).collect())
}

/// Shapes of about 0.05 m with their sphero-radii in m.
fn shapes() -> [(BodyShape, f64); 7] {
    let notched = vec![
        [-0.04, -0.03],
        [0.04, -0.03],
        [0.04, 0.03],
        [0.0, 0.01],
        [-0.04, 0.03],
    ];
    let cluster = BodyShape::Cluster {
        centers: vec![[-0.02, 0.0], [0.02, 0.0], [0.0, 0.02]],
        radii: vec![0.02, 0.025, 0.015],
    };
    [
        (BodyShape::Disc, 0.045),
        (segment_shape([[-0.03, 0.0], [0.03, 0.01]]), 0.015),
        (polygon(5, 0.04), 0.01),
        (rectangle_shape(0.07, 0.04), 0.01),
        (polygon_shape(notched), 0.005),
        (polygon(20, 0.04), 0.01),
        (cluster, 0.0),
    ]
}

/// All motions in turn, free ones most.
fn motion(i: usize) -> Motion {
    match i {
        3 => Motion::Driven,
        5 => Motion::Guided {
            hold_x: false,
            hold_y: true,
            hold_angle: false,
        },
        7 => Motion::Guided {
            hold_x: true,
            hold_y: false,
            hold_angle: true,
        },
        9 => Motion::Pushed {
            force: [3.0, -2.0],
            torque: 0.05,
            ramp: 50.0 * DT,
            until: Some(90.0 * DT),
        },
        10 => Motion::Fixed,
        _ => Motion::Free,
    }
}

/// Bodies of all shapes and motions on a grid, thrown at one another above a fixed floor.
fn bodies() -> Vec<BodyConfig> {
    let shapes = shapes();
    let mut random = Random::new(7);
    let mut bodies = vec![BodyConfig {
        name: "floor".into(),
        shape: rectangle_shape(1.0, 0.1),
        sphero_radius: 0.01,
        inertia: BodyInertia::Mass(1.0),
        position: [0.2, -0.12],
        motion: Motion::Fixed,
        ..BodyConfig::default()
    }];
    for i in 0..14 {
        let (shape, sphero_radius) = shapes[i % shapes.len()].clone();
        let motion = motion(i);
        let moves = if motion == Motion::Fixed { 0.0 } else { 1.0 };
        bodies.push(BodyConfig {
            name: format!("body {i}"),
            shape,
            sphero_radius,
            inertia: if i % 2 == 0 {
                BodyInertia::Density(20.0)
            } else {
                BodyInertia::Mass(0.1)
            },
            position: [0.108 * (i % 5) as f64, 0.108 * (i / 5) as f64],
            angle: random.between(-3.0, 3.0),
            velocity: [random.between(-2.0, 2.0), random.between(-2.0, 1.0)].map(|v| moves * v),
            spin: moves * random.between(-20.0, 20.0),
            motion,
            surface: String::new(),
        });
    }
    bodies
}

/// A scene of bodies of all kinds.
pub fn scene() -> DemConfig {
    DemConfig {
        gravity: [0.3, -9.81],
        bodies: bodies(),
        point_contact: LINEAR,
        body_contact: Some(LINEAR),
        point_surfaces: vec!["sand".into(), "clay".into()],
        skin: 0.004,
        threads: 1,
        ..DemConfig::default()
    }
}

/// A solver with points that fly by themselves and are chosen anew now and then.
pub struct TestRun {
    pub dem: Sdem,
    pub points: Cloud,
    /// Steps done, the opening one among them.
    pub done: u64,
}

/// Points that obey Newton's law, and those of them that the solver knows of.
#[derive(Clone, Default)]
pub struct Cloud {
    infos: Vec<ImpInfo>,
    states: Vec<ImpState>,
    chosen: Vec<usize>,
}

impl Cloud {
    /// Points in the gaps between the bodies of a [`scene`].
    pub fn new(count: usize) -> Self {
        let mut random = Random::new(11);
        let mut cloud = Self::default();
        for _ in 0..count {
            let cell = |x: f64| 0.108 * x.floor() + 0.054 + 0.02 * (x - x.floor() - 0.5);
            let place = [random.between(-1.0, 5.0), random.between(-0.6, 3.0)];
            let radius = random.between(0.004, 0.008);
            let velocity = [random.between(-2.0, 2.0), random.between(-2.0, 2.0)];
            cloud.add(radius, place.map(cell), velocity);
        }
        cloud
    }

    /// A point in each gap of the [`crowd`], near all four discs around it.
    pub fn in_gaps() -> Self {
        let mut random = Random::new(13);
        let mut cloud = Self::default();
        for i in 0..(SIDE - 1) * (SIDE - 1) {
            let place = [i % (SIDE - 1), i / (SIDE - 1)].map(|k| CROWDED * (k as f64 + 0.5));
            let velocity = [random.between(-0.1, 0.1), random.between(-0.1, 0.1)];
            cloud.add(0.0055, place, velocity);
        }
        cloud
    }

    fn add(&mut self, radius: f64, position: [f64; 2], velocity: [f64; 2]) {
        let id = self.infos.len() as u64;
        self.infos.push(ImpInfo {
            group: (id % 2) as u32,
            ..info(id, radius, 0.01)
        });
        self.states.push(ImpState {
            position,
            velocity,
            ..ImpState::default()
        });
    }

    /// Leaves out every fifth, others each time, and turns the order round now and then.
    fn choose(&mut self, turn: usize) -> Vec<ImpInfo> {
        self.chosen = (0..self.infos.len())
            .filter(|i| i % 5 != turn % 5)
            .collect();
        if turn % 3 == 1 {
            self.chosen.reverse();
        }
        self.chosen.iter().map(|&i| self.infos[i]).collect()
    }

    /// Of those chosen.
    fn states(&self) -> Vec<ImpState> {
        self.chosen.iter().map(|&i| self.states[i]).collect()
    }

    fn push(&mut self, forces: &[ImpForce], step: &Step) {
        let mut force = vec![[0.0; 2]; self.infos.len()];
        for (&i, f) in self.chosen.iter().zip(forces) {
            force[i] = f.force;
        }
        for ((state, info), force) in self.states.iter_mut().zip(&self.infos).zip(force) {
            for (k, force) in force.into_iter().enumerate() {
                state.velocity[k] += force / info.mass * step.kick();
                state.position[k] += state.velocity[k] * step.dt;
            }
        }
    }
}

impl TestRun {
    /// Before the opening step.
    pub fn new(config: &DemConfig, points: Cloud) -> Self {
        let mut dem = Sdem::default();
        dem.configure(config).unwrap();
        Self {
            dem,
            points,
            done: 0,
        }
    }

    /// The next step: the opening one, and others of unequal lengths.
    fn next(&self) -> Step {
        let length = |i: u64| match i {
            0 => 0.0,
            i if i % 20 < 10 => DT,
            _ => 0.9 * DT,
        };
        Step {
            index: self.done,
            time: (1..self.done).map(length).sum(),
            dt_before: self.done.checked_sub(1).map_or(0.0, length),
            dt: length(self.done),
            measure: self.done % 3 != 1,
        }
    }

    /// Does a step, with the points chosen anew where it is time to; its answers, in which every bit shows.
    pub fn step(&mut self) -> String {
        if self.done.is_multiple_of(17) {
            let set = self.points.choose(self.done as usize / 17);
            self.dem.envelopes();
            self.dem.imp_set(&set);
        }
        let step = self.next();
        let states = self.points.states();
        let mut forces = vec![ImpForce::default(); states.len()];
        let answer = self.dem.contact(&step, &states, &mut forces).unwrap();
        self.dem.advance(&step).unwrap();
        self.points.push(&forces, &step);
        self.done += 1;
        let measured = step.measure.then(|| self.dem.measurement());
        let bodies = &self.dem.bodies().state;
        let contacts = self.dem.contacts();
        format!("{forces:?} {answer:?} {measured:?} {bodies:?} {contacts}")
    }
}

/// Distance of neighbours in the [`crowd`] in m.
const CROWDED: f64 = 0.0215;
/// Discs along each side of it.
const SIDE: usize = 76;

/// More contacts between bodies, and with points in the gaps, than one thread does alone. Many are as far apart as the list
/// reaches, so that no two lists are alike.
pub fn crowd() -> DemConfig {
    let mut random = Random::new(17);
    let mut disc = |i: usize| BodyConfig {
        name: format!("disc {i}"),
        shape: BodyShape::Disc,
        sphero_radius: 0.01,
        inertia: BodyInertia::Density(500.0),
        position: [(i % SIDE) as f64, (i / SIDE) as f64]
            .map(|x| CROWDED * x + random.between(-7e-4, 7e-4)),
        velocity: [random.between(-1.0, 1.0), random.between(-1.0, 1.0)],
        spin: random.between(-5.0, 5.0),
        ..BodyConfig::default()
    };
    DemConfig {
        gravity: [0.0, -9.81],
        bodies: (0..SIDE * SIDE).map(&mut disc).collect(),
        point_contact: LINEAR,
        body_contact: Some(LINEAR),
        skin: 0.002,
        threads: 1,
        ..DemConfig::default()
    }
}
