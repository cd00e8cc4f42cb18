//! Two toy solvers that compute next to nothing, exactly: points that move along x, and a wall that repels them. They have all
//! that a session can be about: sets that change, springs that remember, limits that fall, a state that can be saved.

#![allow(dead_code, reason = "tests and benches use different parts")]

use std::time::{Duration, Instant};

use interface::config::capability::{Capabilities, PLASTIC_STRAIN, SAVE};
use interface::config::{ContactLaw, DemConfig, MpmConfig, Scheme};
use interface::forces::Forces;
use interface::message::control::{Configure, Party};
use interface::message::wire::{
    BodyState, Budget, EnvelopeVertex, Grant, GroupState, ImpForce, ImpInfo, ImpState, Limits,
    PointState, Report,
};
use interface::saved;
use interface::session::{Next, Part, Solvers, Stop, Supervisor};
use interface::solver::{
    Answer, DemMeasurement, DemSolver, Fault, MpmMeasurement, MpmSolver, Readiness, Refusal,
};
use interface::step::{Clock, Step};
use serde::{Deserialize, Serialize};

/// Contact radius of a point in m.
pub const RADIUS: f64 = 0.01;
/// Stiffness of the wall in N/m.
pub const STIFFNESS: f64 = 1e4;
const POINTS_FORMAT: &str = "toy points 1";
const WALL_FORMAT: &str = "toy wall 1";

/// Points of mass 1 kg/m that move freely along x, and the faults that a test can ask for.
pub struct Points {
    pub state: PointsState,
    pub states: Vec<ImpState>,
    pub measurement: MpmMeasurement,
    /// How many there are.
    pub count: usize,
    /// Position in m and velocity in m/s of a point at the start.
    pub start: fn(usize) -> [f64; 2],
    /// Points whose discs are nearer to the wall than this (m) are in the set.
    pub skin: f64,
    /// Reports this squared frequency from this step on.
    pub limit_at: Option<(u64, f64)>,
    /// Refuses its configuration.
    pub refuse: bool,
    /// Reports this when it is ready.
    pub says: Option<Readiness>,
    /// Reports this plastic strain of its points.
    pub plastic_strain: Option<f64>,
}

/// What is saved of points.
#[derive(Debug, Default, Clone, Serialize, Deserialize)]
pub struct PointsState {
    pub x: Vec<f64>,
    pub v: Vec<f64>,
    pub travel: f64,
    pub set: Vec<ImpInfo>,
}

impl Points {
    /// This many, without a fault, which are always in the set.
    pub fn new(count: usize) -> Self {
        Self {
            state: PointsState::default(),
            states: Vec::new(),
            measurement: MpmMeasurement::default(),
            count,
            start: |i| [0.1 + 0.05 * i as f64, -1.0],
            skin: f64::INFINITY,
            limit_at: None,
            refuse: false,
            says: None,
            plastic_strain: None,
        }
    }
}

impl Default for Points {
    fn default() -> Self {
        Self::new(2)
    }
}

impl MpmSolver for Points {
    fn identity(&self) -> String {
        "toy points".into()
    }

    fn capabilities(&self) -> Capabilities {
        match self.plastic_strain {
            Some(_) => Capabilities::of(&[SAVE, PLASTIC_STRAIN]),
            None => Capabilities::of(&[SAVE]),
        }
    }

    fn configure(&mut self, config: &MpmConfig) -> Result<Readiness, Refusal> {
        if self.refuse {
            return Err(Refusal::new(
                "mpm.cell",
                format!("{} is not to the toy's taste", config.cell),
            ));
        }
        let start = (0..self.count).map(self.start);
        (self.state.x, self.state.v) = start.map(|[x, v]| (x, v)).unzip();
        if let Some(message) = &self.says {
            return Ok(message.clone());
        }
        Ok(Readiness {
            items: self.count as u64,
            mass_min: 1.0,
            ..Readiness::default()
        })
    }

    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo] {
        let state = &mut self.state;
        state.travel = 0.0;
        let wall = envelopes.first().map_or(0.0, |vertex| vertex.position[0]);
        let near = |&(_, x): &(u64, &f64)| x - wall <= RADIUS + self.skin;
        let near = (0..).zip(&state.x).filter(near);
        let info = |(id, _)| ImpInfo {
            id,
            radius: RADIUS,
            mass: 1.0,
            ..ImpInfo::default()
        };
        state.set = near.map(info).collect();
        &state.set
    }

    fn travel(&self) -> f64 {
        self.state.travel
    }

    fn imp_states(&mut self) -> &[ImpState] {
        let PointsState { x, v, set, .. } = &self.state;
        self.states.clear();
        self.states.extend(set.iter().map(|imp| ImpState {
            position: [x[imp.id as usize], 0.0],
            velocity: [v[imp.id as usize], 0.0],
            ..ImpState::default()
        }));
        &self.states
    }

    fn predict(&mut self, _: &Step) -> Result<(), Fault> {
        Ok(())
    }

    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        let state = &mut self.state;
        for (imp, force) in state.set.iter().zip(forces) {
            state.v[imp.id as usize] += step.kick() * force.force[0];
        }
        for (x, v) in state.x.iter_mut().zip(&state.v) {
            *x += step.dt * v;
        }
        let fastest = state.v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        state.travel += step.dt * fastest;
        if step.measure {
            self.measurement.groups = vec![GroupState {
                mass: self.count as f64,
                ..GroupState::default()
            }];
        }
        let omega_sq = match self.limit_at {
            Some((at, omega_sq)) if step.index >= at => omega_sq,
            _ => 1.0,
        };
        Ok(Limits {
            omega_sq,
            contact_omega_sq: forces.iter().fold(0.0, |m: f64, f| m.max(f.stiffness)),
            radius_min: RADIUS,
            speed: fastest,
            ..Limits::default()
        })
    }

    fn measurement(&self) -> &MpmMeasurement {
        &self.measurement
    }

    fn points(&self) -> Vec<PointState> {
        let state = |(id, (&x, &v))| PointState {
            id,
            position: [x, 0.0],
            velocity: [v, 0.0],
            plastic_strain: self.plastic_strain.unwrap_or_default() as f32,
            ..PointState::default()
        };
        let pairs = self.state.x.iter().zip(&self.state.v);
        (0..).zip(pairs).map(state).collect()
    }

    fn save(&self) -> Result<Vec<u8>, Fault> {
        Ok(saved::pack(POINTS_FORMAT, &self.state))
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        self.state = saved::unpack(POINTS_FORMAT, bytes)?;
        Ok(())
    }
}

/// A wall at x <= 0, which may come closer, and the faults that a test can ask for.
#[derive(Default)]
pub struct HalfPlane {
    pub state: WallState,
    /// Overlaps that each point has had, after the step that has been evaluated.
    pub next: Vec<(u64, f64)>,
    pub envelope: Vec<EnvelopeVertex>,
    pub measurement: DemMeasurement,
    /// Its velocity in m/s.
    pub speed: f64,
    /// How much stiffer a contact becomes with the sum of its overlaps, in 1/m: a history.
    pub stiffening: f64,
    /// Reports a larger damping ratio from this step on.
    pub damps_at: Option<u64>,
    /// Time that it needs to take its configuration.
    pub configures_for: std::time::Duration,
    /// Sleeps this long in every step.
    pub sleeps_for: std::time::Duration,
}

/// What is saved of a wall.
#[derive(Debug, Default, Clone, Serialize, Deserialize)]
pub struct WallState {
    x: f64,
    /// Where the envelope was published.
    published: f64,
    /// Identity of each IMP.
    set: Vec<u64>,
    /// Sum of the overlaps that each point has had, by identity; it survives new sets.
    history: Vec<(u64, f64)>,
}

impl DemSolver for HalfPlane {
    fn identity(&self) -> String {
        "toy wall".into()
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::of(&[SAVE])
    }

    fn configure(&mut self, _: &DemConfig) -> Result<Readiness, Refusal> {
        std::thread::sleep(self.configures_for);
        Ok(Readiness {
            items: 1,
            stiffness_max: STIFFNESS,
            ..Readiness::default()
        })
    }

    fn envelopes(&mut self) -> &[EnvelopeVertex] {
        self.state.published = self.state.x;
        self.envelope = vec![EnvelopeVertex {
            position: [self.state.x, 0.0],
            ..EnvelopeVertex::default()
        }];
        &self.envelope
    }

    fn imp_set(&mut self, set: &[ImpInfo]) {
        self.state.set = set.iter().map(|imp| imp.id).collect();
    }

    fn contact(
        &mut self,
        step: &Step,
        points: &interface::forces::Points<'_>,
        forces: &mut Forces,
    ) -> Result<Answer, Fault> {
        std::thread::sleep(self.sleeps_for);
        let state = &self.state;
        self.next.clear();
        let pairs = points.states.iter().zip(forces.on_points_mut());
        for ((imp, force), &id) in pairs.zip(&state.set) {
            let overlap = RADIUS - (imp.position[0] - state.x);
            if overlap > -0.5 * RADIUS {
                let pressed = overlap.max(0.0);
                let known = state.history.iter().find(|(known, _)| *known == id);
                let sum = known.map_or(0.0, |(_, sum)| *sum) + pressed;
                force.stiffness = STIFFNESS;
                force.force[0] = STIFFNESS * pressed * (1.0 + self.stiffening * sum);
                if overlap > 0.0 {
                    self.next.push((id, sum));
                }
            }
        }
        if step.measure {
            self.measurement.bodies = vec![BodyState {
                position: [state.x, 0.0],
                velocity: [self.speed, 0.0],
                ..BodyState::default()
            }];
        }
        let damps = self.damps_at.is_some_and(|at| step.index >= at);
        let damping = if damps { 0.1 } else { 0.0 };
        Ok(Answer {
            limits: Limits {
                speed: self.speed,
                damping,
                ..Limits::default()
            },
            travel: Some(state.x + self.speed * step.dt - state.published),
        })
    }

    fn advance(&mut self, step: &Step) -> Result<(), Fault> {
        self.state.x += self.speed * step.dt;
        core::mem::swap(&mut self.state.history, &mut self.next);
        Ok(())
    }

    fn measurement(&self) -> Option<&DemMeasurement> {
        Some(&self.measurement)
    }

    fn save(&self) -> Result<Vec<u8>, Fault> {
        Ok(saved::pack(WALL_FORMAT, &self.state))
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        self.state = saved::unpack(WALL_FORMAT, bytes)?;
        Ok(())
    }
}

/// A configuration that parses. The toys use little of it.
pub fn mpm_config() -> MpmConfig {
    MpmConfig {
        scheme: Scheme {
            domain: [[0.0, 0.0], [1.0, 1.0]],
            cell: 0.1,
            ..Scheme::default()
        },
        skin: 0.02,
        threads: 1,
        ..MpmConfig::default()
    }
}

/// A configuration that parses. The toys use little of it.
pub fn dem_config() -> DemConfig {
    DemConfig {
        gravity: [0.0, 0.0],
        bodies: Vec::new(),
        point_contact: ContactLaw::linear(1e4, 0.0, 0.0, 0.0),
        body_contact: None,
        skin: 0.02,
        threads: 1,
        ..DemConfig::default()
    }
}

/// Controls a run of equal steps of 0.1 ms.
pub struct Course {
    /// How many steps.
    pub steps: u64,
    /// Steps of a grant.
    pub window: u64,
    /// Budget of squared frequencies in 1/s^2.
    pub budget: f64,
    /// The points at the end.
    pub finals: Vec<PointState>,
    /// The bodies' last report.
    pub bodies: Report,
    pub clock: Clock,
    epoch: u64,
    /// Steps before it is timed.
    pub warm: u64,
    from: Option<Instant>,
    /// Wall time of the steps after those, at the end.
    pub spent: Duration,
}

impl Course {
    /// This many.
    pub fn new(steps: u64, window: u64) -> Self {
        let mut clock = Clock::new(0.0);
        clock.begin_epoch(1e-4);
        Self {
            steps,
            window,
            budget: 1e6,
            finals: Vec::new(),
            bodies: Report::default(),
            clock,
            epoch: 0,
            warm: 0,
            from: None,
            spent: Duration::ZERO,
        }
    }

    /// The same of steps so short that nothing moves far, without a halt: no set after the first.
    pub fn still(steps: u64, window: u64) -> Self {
        let mut course = Self::new(steps, window);
        course.budget = f64::MAX;
        course.clock.begin_epoch(1e-12);
        course
    }

    /// Steps that are done.
    pub fn done(&self) -> u64 {
        self.clock.index()
    }

    /// Whether all steps are done.
    pub fn is_done(&self) -> bool {
        self.done() == self.steps
    }

    fn parts() -> Vec<Part> {
        let part = |config: String| Part {
            configure: Configure {
                scene_hash: "hash".into(),
                config,
                coupled: true,
                deadline: 2.0,
                restore: false,
            },
            measured: 1,
            restore: None,
        };
        vec![
            part(serde_json::to_string(&mpm_config()).unwrap()),
            part(serde_json::to_string(&dem_config()).unwrap()),
        ]
    }
}

impl Supervisor for Course {
    fn configure(&mut self, _: &Solvers) -> Result<Vec<Part>, Stop> {
        Ok(Self::parts())
    }

    fn next(&mut self) -> Result<Option<Next>, Stop> {
        if self.done() >= self.warm {
            self.from.get_or_insert_with(Instant::now);
        }
        if self.is_done() {
            self.spent = self.from.map_or(Duration::ZERO, |from| from.elapsed());
            return Ok(None);
        }
        let (epoch_start, steps_in_epoch, dt_before_epoch) = self.clock.epoch();
        let grant = Grant {
            epoch: self.epoch,
            first: self.clock.index(),
            steps: self.window.min(self.steps - self.clock.index()),
            epoch_start,
            steps_in_epoch,
            dt_before_epoch,
            dt: self.clock.dt(),
            ..Grant::default()
        };
        let budget = Budget {
            omega_sq: self.budget,
            speed: 10.0,
            damping: 0.0,
        };
        Ok(Some((grant, vec![budget; 2])))
    }

    fn collected(&mut self, solvers: &mut Solvers) -> Result<(), Stop> {
        let steps = solvers.round().steps;
        self.clock.advance_by(steps);
        let [mpm, dem] = [Party::Mpm, Party::Dem].map(|party| *solvers.report(party).unwrap());
        self.bodies = dem;
        if mpm.halted + dem.halted > 0 {
            self.epoch += 1;
            let dt = self.clock.dt();
            self.clock.begin_epoch(dt);
        }
        Ok(())
    }

    fn drained(&mut self, solvers: &mut Solvers) -> Result<(), Stop> {
        self.finals.clone_from(&solvers.round().points);
        Ok(())
    }
}
