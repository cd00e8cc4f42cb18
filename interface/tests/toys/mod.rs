//! Two toy solvers: points that move freely along x, and a fixed wall that repels them.

#![allow(dead_code, reason = "tests and benches use different parts")]

use interface::config::capability::{Capabilities, PLASTIC_STRAIN};
use interface::config::{
    ContactLaw, DemConfig, MpmConfig, Plane, ShapeFunction, StressUpdate, Transfer, Walls,
};
use interface::forces::Forces;
use interface::message::control::{Configure, Party};
use interface::message::wire::{
    BodyState, EnvelopeVertex, Grant, GroupState, ImpForce, ImpInfo, ImpState, Ledger, Limits,
    PointState, Report, flags,
};
use interface::session::{Next, Part, Solvers, Stop, Supervisor};
use interface::solver::{
    Answer, DemMeasurement, DemSolver, Fault, MpmMeasurement, MpmSolver, Readiness, Refusal,
};
use interface::step::{Clock, Step};

/// Points of mass 1 kg/m that move freely along x, and the faults that a test can ask for.
pub struct Points {
    pub x: Vec<f64>,
    pub v: Vec<f64>,
    pub travel: f64,
    pub set: Vec<ImpInfo>,
    pub states: Vec<ImpState>,
    pub measurement: MpmMeasurement,
    /// How many there are.
    pub count: usize,
    /// Fails in this step.
    pub fail_at: Option<u64>,
    /// Reports this squared frequency from this step on.
    pub limit_at: Option<(u64, f64)>,
    /// Sleeps in this step.
    pub pause: Option<(u64, std::time::Duration)>,
    /// Refuses its configuration.
    pub refuse: bool,
    /// Reports this when it is ready.
    pub says: Option<Readiness>,
    /// Reports this plastic strain of its points.
    pub plastic_strain: Option<f64>,
}

impl Points {
    /// This many points, without a fault.
    pub fn new(count: usize) -> Self {
        Self {
            x: Vec::new(),
            v: Vec::new(),
            travel: 0.0,
            set: Vec::new(),
            states: Vec::new(),
            measurement: MpmMeasurement::default(),
            count,
            fail_at: None,
            limit_at: None,
            pause: None,
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
        let told = self.plastic_strain.map(|_| PLASTIC_STRAIN);
        Capabilities::of(told.as_slice())
    }

    fn configure(&mut self, config: &MpmConfig) -> Result<Readiness, Refusal> {
        if self.refuse {
            return Err(Refusal::new(
                "mpm.cell",
                format!("{} is not to the toy's taste", config.cell),
            ));
        }
        self.x = (0..self.count).map(|i| 0.1 + 0.05 * i as f64).collect();
        self.v = vec![-1.0; self.count];
        if let Some(said) = &self.says {
            return Ok(said.clone());
        }
        Ok(Readiness {
            items: self.count as u64,
            mass_min: 1.0,
            ..Readiness::default()
        })
    }

    fn select_imps(&mut self, _: &[EnvelopeVertex]) -> &[ImpInfo] {
        self.travel = 0.0;
        let info = |id| ImpInfo {
            id,
            radius: 0.01,
            mass: 1.0,
            ..ImpInfo::default()
        };
        self.set = (0..self.x.len() as u64).map(info).collect();
        &self.set
    }

    fn travel(&self) -> f64 {
        self.travel
    }

    fn imp_states(&mut self) -> &[ImpState] {
        let state = |(&x, &v)| ImpState {
            position: [x, 0.0],
            velocity: [v, 0.0],
            ..ImpState::default()
        };
        self.states = self.x.iter().zip(&self.v).map(state).collect();
        &self.states
    }

    fn predict(&mut self, step: &Step) -> Result<(), Fault> {
        if self.fail_at == Some(step.index) {
            return Err(Fault::NotFinite {
                what: "velocity".into(),
                item: "point 0".into(),
            });
        }
        if let Some((_, pause)) = self.pause.filter(|(at, _)| *at == step.index) {
            std::thread::sleep(pause);
        }
        Ok(())
    }

    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        let kinetic = |v: &[f64]| 0.5 * v.iter().map(|v| v * v).sum::<f64>();
        let before = kinetic(&self.v);
        for (i, (x, v)) in self.x.iter_mut().zip(&mut self.v).enumerate() {
            *v += step.kick() * forces.get(i).map_or(0.0, |f| f.force[0]);
            *x += step.dt * *v;
        }
        self.travel += step.dt * self.v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        if step.measure {
            let w = step.centring();
            let kinetic = (1.0 - w) * before + w * kinetic(&self.v);
            self.measurement.ledger = Ledger {
                kinetic,
                ..Ledger::default()
            };
            self.measurement.groups = vec![GroupState {
                mass: 2.0,
                ..GroupState::default()
            }];
        }
        let omega_sq = match self.limit_at {
            Some((at, omega_sq)) if step.index >= at => omega_sq,
            _ => 1.0,
        };
        let contact_omega_sq = forces.iter().fold(0.0, |m: f64, f| m.max(f.stiffness));
        Ok(Limits {
            omega_sq,
            contact_omega_sq,
            radius_min: 0.01,
            speed: 1.0,
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
        (0..).zip(self.x.iter().zip(&self.v)).map(state).collect()
    }
}

/// A fixed wall at x <= 0, and the faults that a test can ask for.
#[derive(Default)]
pub struct HalfPlane {
    pub stiffness: f64,
    pub envelope: Vec<EnvelopeVertex>,
    pub measurement: DemMeasurement,
    /// Answers NaN in this step.
    pub nan_at: Option<u64>,
    /// Reports a surface that is too fast from this step on.
    pub fast_at: Option<u64>,
    /// Time that it needs to take its configuration.
    pub configures_for: std::time::Duration,
}

impl DemSolver for HalfPlane {
    fn identity(&self) -> String {
        "toy wall".into()
    }

    fn configure(&mut self, _: &DemConfig) -> Result<Readiness, Refusal> {
        std::thread::sleep(self.configures_for);
        self.stiffness = 1e4;
        Ok(Readiness {
            items: 1,
            stiffness_max: self.stiffness,
            ..Readiness::default()
        })
    }

    fn envelopes(&mut self) -> &[EnvelopeVertex] {
        self.envelope = vec![EnvelopeVertex::default()];
        &self.envelope
    }

    fn contact(
        &mut self,
        step: &Step,
        points: &interface::forces::Points<'_>,
        forces: &mut Forces,
    ) -> Result<Answer, Fault> {
        let mut energy = 0.0;
        for (imp, force) in points.states.iter().zip(forces.on_points_mut()) {
            let overlap = 0.01 - imp.position[0];
            if overlap > -0.005 {
                force.stiffness = self.stiffness;
                force.force[0] = self.stiffness * overlap.max(0.0);
                energy += 0.5 * self.stiffness * overlap.max(0.0).powi(2);
            }
            if self.nan_at == Some(step.index) {
                force.force[1] = f64::NAN;
            }
        }
        if step.measure {
            self.measurement.ledger = Ledger {
                contact: energy,
                ..Ledger::default()
            };
            self.measurement.bodies = vec![BodyState::default()];
        }
        let speed = if self.fast_at.is_some_and(|at| step.index >= at) {
            1e3
        } else {
            0.0
        };
        Ok(Answer {
            limits: Limits {
                speed,
                ..Limits::default()
            },
            travel: Some(0.0),
        })
    }

    fn advance(&mut self, _: &Step) -> Result<(), Fault> {
        Ok(())
    }

    fn measurement(&self) -> Option<&DemMeasurement> {
        Some(&self.measurement)
    }
}

/// A configuration that parses. The toys use little of it.
pub fn mpm_config() -> MpmConfig {
    MpmConfig {
        domain: [[0.0, 0.0], [1.0, 1.0]],
        cell: 0.1,
        gravity: [0.0, 0.0],
        shape: ShapeFunction::Linear,
        transfer: Transfer::Flip,
        stress_update: StressUpdate::Usf,
        plane: Plane::Strain,
        walls: Walls::default(),
        materials: Vec::new(),
        groups: Vec::new(),
        contact_force: interface::config::ContactForceScheme::default(),
        forcing: interface::config::Forcing::default(),
        constants: std::collections::BTreeMap::new(),
        leaving: interface::config::Leaving::default(),
        grid_contact: None,
        layers: false,
        group_pairs: Vec::new(),
        interface: interface::config::Interface::Points,
        chains: Vec::new(),
        skin: 0.02,
        probes: Vec::new(),
        threads: 1,
    }
}

/// A configuration that parses. The toys use little of it.
pub fn dem_config() -> DemConfig {
    let point_contact = ContactLaw::Linear {
        normal_stiffness: 1e4,
        tangential_stiffness: 0.0,
        friction: 0.0,
        damping_ratio: 0.0,
        damped_mass: 0.0,
    };
    DemConfig {
        gravity: [0.0, 0.0],
        bodies: Vec::new(),
        point_contact,
        body_contact: None,
        skin: 0.02,
        threads: 1,
        ..DemConfig::default()
    }
}

/// Controls a run of equal steps of 0.1 ms that measures the first step of each window.
pub struct Course {
    /// How many steps.
    pub steps: u64,
    /// Steps of a grant.
    pub window: u64,
    /// Whether windows are measured.
    pub measures: bool,
    /// Budget of squared frequencies in 1/s^2.
    pub budget: f64,
    /// Reports of the continuum and of the bodies, window by window.
    pub reports: Vec<(Report, Report)>,
    /// The points at the end.
    pub finals: Vec<PointState>,
    clock: Clock,
    epoch: u64,
}

impl Course {
    /// This many.
    pub fn new(steps: u64, window: u64) -> Self {
        let mut clock = Clock::new(0.0);
        clock.begin_epoch(1e-4);
        Self {
            steps,
            window,
            measures: true,
            budget: 1e6,
            reports: Vec::new(),
            finals: Vec::new(),
            clock,
            epoch: 0,
        }
    }

    /// Continues with steps of another length (s).
    pub fn begin_epoch(&mut self, dt: f64) {
        self.clock.begin_epoch(dt);
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
        if self.is_done() {
            return Ok(None);
        }
        let (epoch_start, steps_in_epoch, dt_before_epoch) = self.clock.epoch();
        let grant = Grant {
            epoch: self.epoch,
            first: self.clock.index(),
            steps: self.window.min(self.steps - self.clock.index()),
            flags: if self.measures { flags::MEASURE } else { 0 },
            epoch_start,
            steps_in_epoch,
            dt_before_epoch,
            dt: self.clock.dt(),
            ..Grant::default()
        };
        Ok(Some((grant, vec![[self.budget, 10.0, 0.0]; 2])))
    }

    fn collected(&mut self, solvers: &mut Solvers) -> Result<(), Stop> {
        let steps = solvers.round().steps;
        self.clock.advance_by(steps);
        let [mpm, dem] = [Party::Mpm, Party::Dem].map(|party| *solvers.report(party).unwrap());
        if mpm.halted + dem.halted > 0 {
            self.epoch += 1;
            let dt = self.clock.dt();
            self.clock.begin_epoch(dt);
        }
        if self.measures {
            self.reports.push((mpm, dem));
        }
        Ok(())
    }

    fn drained(&mut self, solvers: &mut Solvers) -> Result<(), Stop> {
        self.finals.clone_from(&solvers.round().points);
        Ok(())
    }
}
