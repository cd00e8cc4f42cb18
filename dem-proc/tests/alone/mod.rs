//! Bodies without points, with the steps that the coupler would choose: composed with a safety, in epochs of equal steps, each at
//! most a tenth longer than the last.

use dem_proc::Sdem;
use interface::Vec2;
use interface::config::DemConfig;
use interface::message::wire::Limits;
use interface::solver::{DemSolver, Fault};
use interface::step::{GROWTH, Step};

use crate::small_scenes::{OPENING, configured, step};

/// How steps follow from limits.
pub struct Pace {
    safety: f64,
    headroom: f64,
    epoch: u32,
    epoch_while_growing: u32,
}

/// That of the coupler.
const COUPLER: Pace = Pace {
    safety: 0.8,
    headroom: 0.97,
    epoch: 64,
    epoch_while_growing: 4,
};

impl Pace {
    /// Each step is as long as the limits allow.
    pub fn step_by_step(safety: f64) -> Self {
        Self {
            safety,
            headroom: 1.0,
            epoch: 1,
            epoch_while_growing: 1,
        }
    }
}

/// A run of bodies without points.
pub struct Alone {
    pub dem: Sdem,
    pub time: f64,
    pub steps: u64,
    /// Length of the last step in s.
    pub dt: f64,
    longest: f64,
    pace: Pace,
    limits: Limits,
    /// What the limits may be until the next step length.
    allowed: f64,
    damping: f64,
    left: u32,
}

impl Alone {
    /// A run with steps up to `longest` (s).
    pub fn new(config: &DemConfig, longest: f64) -> Self {
        Self::paced(config, longest, COUPLER)
    }

    /// The same at another pace.
    pub fn paced(config: &DemConfig, longest: f64, pace: Pace) -> Self {
        let mut dem = configured(config);
        let opening = Step {
            measure: false,
            ..OPENING
        };
        let limits = dem.contact(&opening, &[], &mut []).unwrap().limits;
        dem.advance(&opening).unwrap();
        Self {
            dem,
            time: 0.0,
            steps: 0,
            dt: 0.0,
            longest,
            pace,
            limits,
            allowed: 0.0,
            damping: 0.0,
            left: 0,
        }
    }

    fn limits_hold(&self) -> bool {
        self.limits.omega_sq <= self.allowed && self.limits.damping <= self.damping
    }

    fn next(&mut self) -> f64 {
        if self.left == 0 || !self.limits_hold() {
            let (pace, zeta) = (&self.pace, self.limits.damping);
            // Largest allowed `omega dt`.
            let allowance = pace.safety * 2.0 * (zeta.hypot(1.0) - zeta);
            let limit = pace.headroom * allowance / self.limits.omega_sq.sqrt();
            let limit = limit.min(self.longest);
            let growing = self.dt > 0.0 && GROWTH * self.dt < limit;
            let dt = if growing { GROWTH * self.dt } else { limit };
            let epoch = [pace.epoch, pace.epoch_while_growing][usize::from(growing)];
            self.left = epoch - 1;
            (self.allowed, self.damping) = ((allowance / dt).powi(2), zeta);
            return dt;
        }
        self.left -= 1;
        self.dt
    }

    /// One step; `measure`: whether the ledger is measured.
    pub fn step(&mut self, measure: bool) -> Result<(), Fault> {
        let step = Step {
            index: self.steps,
            time: self.time,
            measure,
            ..step(self.dt, self.next())
        };
        self.limits = self.dem.contact(&step, &[], &mut [])?.limits;
        self.dem.advance(&step)?;
        self.dt = step.dt;
        self.time += step.dt;
        self.steps += 1;
        Ok(())
    }

    /// Kinetic energy of body `b` at the half step, in J/m.
    pub fn kinetic(&self, b: usize) -> f64 {
        let (state, body) = (
            &self.dem.bodies().state[b],
            &self.dem.bodies().properties[b],
        );
        let v: Vec2 = state.velocity;
        0.5 * (body.mass * v.norm_squared() + state.spin * state.spin / state.inverse_inertia)
    }
}
