//! What the tests share: small scenes, and a driver that steps bodies and points together.

pub mod walls;

use dem_proc::Sdem;
use interface::Vec2;
use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion};
use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::solver::{Answer, DemSolver, Fault};
use interface::step::Step;
pub use mechanics::generate::Random;

/// A free body of 1 kg/m at the origin.
pub fn body(shape: BodyShape, sphero_radius: f64) -> BodyConfig {
    BodyConfig {
        name: "body".into(),
        shape,
        sphero_radius,
        inertia: BodyInertia::Mass(1.0),
        ..BodyConfig::default()
    }
}

pub fn fixed(shape: BodyShape, sphero_radius: f64) -> BodyConfig {
    BodyConfig {
        motion: Motion::Fixed,
        ..body(shape, sphero_radius)
    }
}

pub fn spring(normal_stiffness: f64) -> ContactLaw {
    ContactLaw::linear(normal_stiffness, 0.0, 0.0, 0.0)
}

pub fn frictional(normal_stiffness: f64, tangential_stiffness: f64, friction: f64) -> ContactLaw {
    ContactLaw::linear(normal_stiffness, tangential_stiffness, friction, 0.0)
}

/// k_n and k_t in N/m, mu, zeta, adhesion in Pa, mu_r.
pub const fn granular_law(
    normal_stiffness: f64,
    tangential_stiffness: f64,
    friction: f64,
    damping_ratio: f64,
    adhesion: f64,
    rolling_friction: f64,
) -> ContactLaw {
    ContactLaw::Granular {
        normal_stiffness,
        tangential_stiffness,
        friction,
        damping_ratio,
        damped_mass: 0.0,
        adhesion,
        rolling_friction,
    }
}

/// K in N/m^1.5, nu, mu, e, adhesion in Pa.
pub const fn hertz_law(
    hertz_constant: f64,
    poisson_ratio: f64,
    friction: f64,
    restitution: f64,
    adhesion: f64,
) -> ContactLaw {
    ContactLaw::HertzMindlin {
        hertz_constant,
        poisson_ratio,
        friction,
        restitution,
        adhesion,
    }
}

pub const fn rectangle_shape(width: f64, height: f64) -> BodyShape {
    BodyShape::Rectangle { width, height }
}

pub const fn polygon_shape(vertices: Vec<[f64; 2]>) -> BodyShape {
    BodyShape::Polygon { vertices }
}

pub const fn segment_shape(ends: [[f64; 2]; 2]) -> BodyShape {
    BodyShape::Segment { ends }
}

/// With the limit of stability alone, which most tests are about.
pub fn scene(bodies: Vec<BodyConfig>, law: ContactLaw) -> DemConfig {
    DemConfig {
        contact_resolution: Some(2.0),
        gravity: [0.0, 0.0],
        bodies,
        point_contact: law,
        body_contact: Some(law),
        skin: 0.05,
        threads: 1,
        ..DemConfig::default()
    }
}

pub fn configured(config: &DemConfig) -> Sdem {
    let mut dem = Sdem::default();
    dem.configure(config).unwrap();
    dem.envelopes();
    dem
}

pub fn info(id: u64, radius: f64, mass: f64) -> ImpInfo {
    ImpInfo {
        id,
        radius,
        mass,
        ..ImpInfo::default()
    }
}

pub fn at(x: f64, y: f64) -> ImpState {
    ImpState {
        position: [x, y],
        velocity: [0.0, 0.0],
        ..ImpState::default()
    }
}

pub const fn step(dt_before: f64, dt: f64) -> Step {
    Step {
        index: 0,
        time: 0.0,
        dt_before,
        dt,
        measure: true,
    }
}

pub const OPENING: Step = step(0.0, 0.0);

/// The next step without points, the first of a run or another.
pub fn go(dem: &mut Sdem, first: bool, dt: f64) {
    let step = step(if first { 0.0 } else { dt }, dt);
    dem.contact(&step, &[], &mut []).unwrap();
    dem.advance(&step).unwrap();
}

/// Forces on points that do not move, evaluated once.
pub fn forces(
    config: &DemConfig,
    radius: f64,
    points: &[ImpState],
) -> (Vec<ImpForce>, Sdem, Answer) {
    let mut dem = configured(config);
    let set: Vec<ImpInfo> = (0..points.len() as u64)
        .map(|id| info(id, radius, 1.0))
        .collect();
    dem.imp_set(&set);
    let mut forces = vec![ImpForce::default(); points.len()];
    let answer = dem.contact(&OPENING, points, &mut forces).unwrap();
    (forces, dem, answer)
}

/// Points that obey Newton's law on their own: the simplest continuum.
#[derive(Clone)]
pub struct Points {
    pub set: Vec<ImpInfo>,
    pub states: Vec<ImpState>,
    pub forces: Vec<ImpForce>,
}

impl Points {
    pub fn new(points: &[(ImpInfo, ImpState)]) -> Self {
        Self {
            set: points.iter().map(|p| p.0).collect(),
            states: points.iter().map(|p| p.1).collect(),
            forces: vec![ImpForce::default(); points.len()],
        }
    }

    /// The first half of a step of the bodies.
    pub fn contact(&mut self, dem: &mut Sdem, step: &Step) -> Result<Answer, Fault> {
        dem.contact(step, &self.states, &mut self.forces)
    }

    /// One step of both sides.
    pub fn step(&mut self, dem: &mut Sdem, step: &Step) -> Answer {
        let answer = self.contact(dem, step).unwrap();
        for ((state, force), info) in self.states.iter_mut().zip(&self.forces).zip(&self.set) {
            for k in 0..2 {
                state.velocity[k] += force.force[k] / info.mass * step.kick();
                state.position[k] += state.velocity[k] * step.dt;
            }
        }
        dem.advance(step).unwrap();
        answer
    }

    pub fn kinetic(&self) -> f64 {
        let each = self.states.iter().zip(&self.set);
        each.map(|(s, i)| 0.5 * i.mass * Vec2::from(s.velocity).norm_squared())
            .sum()
    }
}

/// A star-shaped polygon with `n` vertices at distances `low..high` from the origin: simple, rarely convex.
pub fn star(random: &mut Random, n: usize, low: f64, high: f64) -> BodyShape {
    let vertex = |i: usize| {
        let angle = (i as f64 + random.between(0.2, 0.8)) * std::f64::consts::TAU / n as f64;
        let r = random.between(low, high);
        [r * angle.cos(), r * angle.sin()]
    };
    polygon_shape((0..n).map(vertex).collect())
}
