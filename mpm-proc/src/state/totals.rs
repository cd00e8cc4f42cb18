//! The ledger: sums of impulses and work over the run.

use interface::impulse::Impulse;
use serde::{Deserialize, Serialize};

/// Sums over the run.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Totals {
    /// Impulse of gravity, walls, loads and damping so far, less the momentum of points removed, in N s/m.
    pub applied_impulse: Impulse,
    /// Impulse of the bodies so far in N s/m.
    pub contact_impulse: Impulse,
    /// Dissipated by walls with friction so far in J/m.
    pub friction_work: f64,
    /// Work of loads and driven walls so far, less the energy of points removed, in J/m.
    pub driven_work: f64,
    /// Dissipated by plastic flow so far in J/m.
    pub plastic_work: f64,
    /// Dissipated by viscous stress so far in J/m.
    pub viscous_work: f64,
    /// Taken from the motion by the transfer between points and nodes so far in J/m.
    pub transfer_work: f64,
    /// Work of the stress so far, less what plastic flow and viscous stress took of it and less the elastic energy of
    /// points removed, in J/m.
    pub stress_work: f64,
    /// For stress that is updated last: the energy lost to plastic flow and to viscous stress, and the work of the
    /// stress, on the way to the next step, in J/m. They count in that step.
    pub ahead: [f64; 3],
}

/// Work in the kick of one step in J/m.
#[derive(Debug, Clone, Copy, Default)]
pub struct KickWork {
    /// Of walls with friction.
    pub friction: f64,
    /// Of damping.
    pub damping: f64,
    /// Of driven walls.
    pub driven: f64,
    /// What the transfer has taken.
    pub transfer: f64,
}
