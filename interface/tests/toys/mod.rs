//! Two solvers in a page each: points that fly freely along x, and a fixed wall that repels them.

use interface::config::{
    ContactLaw, DemConfig, MpmConfig, Plane, ShapeFunction, StressUpdate, Transfer, Walls,
};
use interface::solver::{
    Answer, DemMeasurement, DemSolver, Fault, MpmMeasurement, MpmSolver, Readiness, Refusal,
};
use interface::step::Step;
use interface::wire::{
    BodyState, EnvelopeVertex, GroupState, ImpForce, ImpInfo, ImpState, Ledger, Limits, PointState,
};

/// Points of mass 1 kg/m that fly freely along x, and their misbehaviour.
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
}

impl Points {
    /// This many, well behaved.
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

    fn configure(&mut self, config: &MpmConfig) -> Result<Readiness, Refusal> {
        if self.refuse {
            return Err(Refusal::new(
                "mpm.cell",
                format!("{} is not to the toy's taste", config.cell),
            ));
        }
        self.x = (0..self.count).map(|i| 0.1 + 0.05 * i as f64).collect();
        self.v = vec![-1.0; self.count];
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
            ..PointState::default()
        };
        (0..).zip(self.x.iter().zip(&self.v)).map(state).collect()
    }
}

/// A fixed wall at x <= 0, and its misbehaviour.
#[derive(Default)]
pub struct HalfPlane {
    pub stiffness: f64,
    pub envelope: Vec<EnvelopeVertex>,
    pub measurement: DemMeasurement,
    /// Answers NaN in this step.
    pub nan_at: Option<u64>,
    /// Reports a surface that is too fast from this step on.
    pub fast_at: Option<u64>,
}

impl DemSolver for HalfPlane {
    fn identity(&self) -> String {
        "toy wall".into()
    }

    fn configure(&mut self, _: &DemConfig) -> Result<Readiness, Refusal> {
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

    fn imp_set(&mut self, _: &[ImpInfo]) {}

    fn contact(
        &mut self,
        step: &Step,
        imps: &[ImpState],
        forces: &mut [ImpForce],
    ) -> Result<Answer, Fault> {
        let mut energy = 0.0;
        for (imp, force) in imps.iter().zip(forces) {
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
            travel: 0.0,
        })
    }

    fn advance(&mut self, _: &Step) -> Result<(), Fault> {
        Ok(())
    }

    fn measurement(&self) -> &DemMeasurement {
        &self.measurement
    }
}

/// A configuration that parses; the toys look at little of it.
pub fn mpm_config() -> MpmConfig {
    MpmConfig {
        domain: [[0.0, 0.0], [1.0, 1.0]],
        cell: 0.1,
        gravity: [0.0, 0.0],
        shape: ShapeFunction::Linear,
        transfer: Transfer::Flip,
        stress_update: StressUpdate::Usf,
        drift: interface::config::Drift::default(),
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
        interface: interface::config::Interface::Points,
        skin: 0.02,
        threads: 1,
    }
}

/// A configuration that parses; the toys look at little of it.
pub fn dem_config() -> DemConfig {
    let point_contact = ContactLaw::Linear {
        normal_stiffness: 1e4,
        tangential_stiffness: 0.0,
        friction: 0.0,
        damping_ratio: 0.0,
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
