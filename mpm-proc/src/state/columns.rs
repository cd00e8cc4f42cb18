//! Three nodes across a wall with friction, between which velocities are linear ([`crate::pass::columns`]).

use super::nodes::NodeAt;

/// Three nodes across a wall with friction.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// The one beyond the wall, the one on it and the one within.
    pub nodes: [NodeAt; 3],
    /// The one on the wall.
    pub on: [i64; 2],
    /// What the wall has taken of its velocity before the kick, as points feel it, in m/s.
    pub stopped: [f64; 2],
}
