//! The points that a clause of bodies sends.

use interface::message::wire::{ImpInfo, ImpState};

/// Mass points, and their states in the next step: positions at `t_n`, velocities at `t_{n-1/2}`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Points {
    /// Who they are, ids rising.
    pub set: Vec<ImpInfo>,
    /// Where they are.
    pub states: Vec<ImpState>,
}

impl Points {
    /// None yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a point: position in m, velocity in m/s, contact radius in m, mass in kg/m. Ids are 0, 1, 2 and so on.
    #[must_use]
    pub fn with(mut self, position: [f64; 2], velocity: [f64; 2], radius: f64, mass: f64) -> Self {
        self.set.push(ImpInfo {
            id: self.set.len() as u64,
            radius,
            mass,
            ..ImpInfo::default()
        });
        self.states.push(ImpState {
            position,
            velocity,
            ..ImpState::default()
        });
        self
    }
}
