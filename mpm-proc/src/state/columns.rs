//! Three nodes across a wall with friction, between which velocities are linear ([`crate::pass::columns`]).

use super::nodes::NodeAt;

/// Three nodes across a wall with friction.
#[derive(Debug, Clone, Copy, Default)]
pub struct Column {
    /// The one beyond the wall, the one on it and the one within.
    pub nodes: [NodeAt; 3],
    /// The one on the wall.
    pub on: [i64; 2],
    /// `1 / m_I` in m/kg of the three in this step, 0 for an empty node.
    pub per_mass: [f64; 3],
    /// `m_I` in kg/m of the one on the wall in this step.
    pub mass: f64,
    /// What the wall has taken of its velocity before the kick, as points feel it, in m/s.
    pub stopped: [f64; 2],
}
