//! The kit's own continuum: mass points that nothing but contact moves, in the leapfrog of T-1.

use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::step::Step;

/// Mass points. Their states are those that go out in the next step: positions at `t_n`, velocities at `t_{n-1/2}`.
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
        self.states.push(ImpState { position, velocity });
        self
    }

    /// Kick and drift of a step by the forces in it.
    pub fn advance(&mut self, step: &Step, forces: &[ImpForce]) {
        for ((state, info), f) in self.states.iter_mut().zip(&self.set).zip(forces) {
            for i in 0..2 {
                state.velocity[i] += f.force[i] / info.mass * step.kick();
                state.position[i] += state.velocity[i] * step.dt;
            }
        }
    }

    /// Sum of `m v` in N s/m.
    pub fn momentum(&self) -> [f64; 2] {
        let points = self.states.iter().zip(&self.set);
        points.fold([0.0; 2], |[x, y], (s, i)| {
            [x + i.mass * s.velocity[0], y + i.mass * s.velocity[1]]
        })
    }
}
