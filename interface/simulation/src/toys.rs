//! Two solvers that compute next to nothing, exactly: points that fly along x, and a wall that repels them.
//!
//! They have all that a session can be about: IMP sets that change, springs that remember, limits that fall, a state that
//! can be saved.

use std::sync::LazyLock;

use interface::config::capability::Capabilities;
use interface::config::{DemConfig, MpmConfig};
use interface::forces::Forces;
use interface::message::wire::{
    BodyState, EnvelopeVertex, GroupState, ImpForce, ImpInfo, ImpState, Ledger, Limits, PointState,
};
use interface::saved;
use interface::solver::{
    Answer, DemMeasurement, DemSolver, Fault, MpmMeasurement, MpmSolver, Readiness, Refusal,
};
use interface::step::Step;
use serde::{Deserialize, Serialize};

use crate::session::SolverPair;

/// Stiffness of the wall in N/m.
const STIFFNESS: f64 = 1e4;
/// Contact radius of a point in m.
const RADIUS: f64 = 0.01;
/// Verlet skin in m.
const SKIN: f64 = 0.02;

/// The toys.
pub const TOYS: SolverPair = SolverPair {
    name: "toys",
    configs: || CONFIGS.clone(),
    measured: [1, 1],
    build: |plan| {
        let points = Points::new(plan.points, plan.stiffens_at);
        (Box::new(points), Box::new(Wall::new(plan.damps_at)))
    },
};

static CONFIGS: LazyLock<[String; 2]> = LazyLock::new(|| {
    let group = r#"{"name": "points", "material": 0, "fill": {"points": {"positions": []}}, "spacing": {"distance": 0.02},
        "velocity": [0, 0], "contact_radius": 0.01, "lattice": "grid", "fields": {}, "rigid": false, "keeps_spin": false}"#;
    let mpm = format!(
        r#"{{"domain": [[0, 0], [1, 1]], "cell": 0.1, "gravity": [0, 0], "shape": "linear", "transfer": "flip",
        "stress_update": "usf", "contact_force": "point",
        "forcing": {{"traction": [], "hold": [], "stage": []}}, "constants": {{}}, "leaving": "stop", "layers": false,
        "group_pair": [], "interface": "points", "chain": [], "probe": [], "plane": "strain", "walls": {{}}, "material": [], "points": [{group}], "skin": {SKIN},
        "threads": 1}}"#
    );
    let law = r#"{"linear": {"normal_stiffness": 10000}}"#;
    let dem = format!(
        r#"{{"gravity": [0, 0], "body": [], "contact": {law}, "body_contact": null, "skin": {SKIN}, "threads": 1,
        "overlap": "each_edge", "contact_pair": [], "point_surfaces": [], "group_pair": [], "interface": "points"}}"#
    );
    [mpm, dem]
});

/// Points of mass 1 kg/m that fly along x.
#[derive(Debug, Default)]
pub struct Points {
    state: PointsState,
    states: Vec<ImpState>,
    measurement: MpmMeasurement,
    count: usize,
    stiffens_at: u64,
}

impl Points {
    /// This many, whose squared frequency rises in the step `stiffens_at`.
    pub fn new(count: usize, stiffens_at: u64) -> Self {
        Self {
            count,
            stiffens_at,
            ..Self::default()
        }
    }
}

#[derive(Debug, Default, Clone, Serialize, Deserialize)]
struct PointsState {
    x: Vec<f64>,
    v: Vec<f64>,
    travel: f64,
    /// Index of each IMP.
    set: Vec<u64>,
}

const POINTS_FORMAT: &str = "toy points 1";
const WALL_FORMAT: &str = "toy wall 1";

impl MpmSolver for Points {
    fn identity(&self) -> String {
        "toy points".into()
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::of(&["save"])
    }

    fn configure(&mut self, _: &MpmConfig) -> Result<Readiness, Refusal> {
        self.state.x = (0..self.count).map(|i| 0.02 + 0.004 * i as f64).collect();
        self.state.v = (0..self.count).map(|i| -1.0 - 0.5 * i as f64).collect();
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
        let near = |i: &u64| state.x[*i as usize] - wall <= RADIUS + SKIN;
        state.set = (0..self.count as u64).filter(near).collect();
        self.infos()
    }

    fn travel(&self) -> f64 {
        self.state.travel
    }

    fn imp_states(&mut self) -> &[ImpState] {
        let state = &self.state;
        self.states.clear();
        self.states.extend(state.set.iter().map(|&i| ImpState {
            position: [state.x[i as usize], 0.0],
            velocity: [state.v[i as usize], 0.0],
            ..ImpState::default()
        }));
        &self.states
    }

    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        let state = &mut self.state;
        let kinetic = |v: &[f64]| 0.5 * v.iter().map(|v| v * v).sum::<f64>();
        let before = kinetic(&state.v);
        for (&i, force) in state.set.iter().zip(forces) {
            state.v[i as usize] += step.kick() * force.force[0];
        }
        for (x, v) in state.x.iter_mut().zip(&state.v) {
            *x += step.dt * v;
        }
        let fastest = state.v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        state.travel += step.dt * fastest;
        if step.measure {
            let w = step.centring();
            self.measurement.ledger = Ledger {
                kinetic: (1.0 - w) * before + w * kinetic(&state.v),
                ..Ledger::default()
            };
            self.measurement.groups = vec![GroupState {
                mass: self.count as f64,
                ..GroupState::default()
            }];
        }
        let stiff = step.index >= self.stiffens_at;
        Ok(Limits {
            omega_sq: if stiff { 2e6 } else { 1.0 },
            contact_omega_sq: forces.iter().fold(0.0, |m: f64, f| m.max(f.stiffness)),
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

impl Points {
    fn infos(&self) -> &[ImpInfo] {
        // The set of a toy is small and always of the same points: one table serves all.
        static TABLE: LazyLock<Vec<Vec<ImpInfo>>> = LazyLock::new(|| {
            let sets = 0_u32..1 << MOST;
            sets.map(|bits| {
                let of = (0..MOST as u64).filter(|i| bits >> i & 1 == 1);
                of.map(|id| ImpInfo {
                    id,
                    radius: RADIUS,
                    mass: 1.0,
                    ..ImpInfo::default()
                })
                .collect()
            })
            .collect()
        });
        let bits = self.state.set.iter().fold(0, |bits, i| bits | 1 << i);
        &TABLE[bits as usize]
    }
}

/// Most points of a toy.
pub const MOST: usize = 4;

/// A wall at x <= 0 that comes closer at a constant speed.
#[derive(Debug, Default)]
pub struct Wall {
    state: WallState,
    /// Springs after the step that has been evaluated.
    next: Vec<(u64, f64)>,
    envelope: Vec<EnvelopeVertex>,
    measurement: DemMeasurement,
    /// The wall reports a larger damping ratio from this step on.
    damps_at: u64,
}

#[derive(Debug, Default, Clone, Serialize, Deserialize)]
struct WallState {
    x: f64,
    /// Where the envelope was published.
    published: f64,
    /// Identity of each IMP.
    set: Vec<u64>,
    /// Sum of the overlaps that each point has had, by identity: a history that must survive new sets.
    history: Vec<(u64, f64)>,
}

impl Wall {
    /// A wall whose damping ratio rises in this step.
    pub fn new(damps_at: u64) -> Self {
        Self {
            damps_at,
            ..Self::default()
        }
    }
}

const SPEED: f64 = 0.25;

impl DemSolver for Wall {
    fn identity(&self) -> String {
        "toy wall".into()
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::of(&["save"])
    }

    fn configure(&mut self, _: &DemConfig) -> Result<Readiness, Refusal> {
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
        let state = &self.state;
        self.next.clear();
        let mut energy = 0.0;
        for ((imp, force), &id) in points
            .states
            .iter()
            .zip(forces.on_points_mut())
            .zip(&state.set)
        {
            let overlap = RADIUS - (imp.position[0] - state.x);
            if overlap <= -0.5 * RADIUS {
                continue;
            }
            let known = state.history.iter().find(|(known, _)| *known == id);
            let sum = known.map_or(0.0, |(_, sum)| *sum) + overlap.max(0.0);
            force.stiffness = STIFFNESS;
            if overlap > 0.0 {
                force.force[0] = STIFFNESS * overlap * (1.0 + 1e-3 * sum);
                self.next.push((id, sum));
            }
            energy += 0.5 * STIFFNESS * overlap.max(0.0).powi(2);
        }
        if step.measure {
            self.measurement.ledger = Ledger {
                contact: energy,
                ..Ledger::default()
            };
            self.measurement.bodies = vec![BodyState {
                position: [state.x, 0.0],
                velocity: [SPEED, 0.0],
                ..BodyState::default()
            }];
        }
        Ok(Answer {
            limits: Limits {
                speed: SPEED,
                damping: if step.index >= self.damps_at {
                    0.1
                } else {
                    0.0
                },
                ..Limits::default()
            },
            travel: Some(state.x + SPEED * step.dt - state.published),
        })
    }

    fn advance(&mut self, step: &Step) -> Result<(), Fault> {
        self.state.x += SPEED * step.dt;
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
