//! Contact of bodies with points in the present step: which points bear a force, and the nodes that they touch.

use super::imps::Member;
use super::nodes::NodeAt;

/// A point that a body presses on.
#[derive(Debug, Clone, Copy)]
pub struct Loaded {
    /// Which.
    pub member: Member,
    /// Stiffness of its contacts in N/m.
    pub stiffness: f64,
}

/// A node that a loaded point touches.
#[derive(Debug, Clone, Copy)]
pub struct Touch {
    /// Where the force is.
    pub at: NodeAt,
    /// The node that moves by it: the same, or what it is an image of.
    pub of: NodeAt,
    /// `S_Ip`, through which the point takes velocities.
    pub gather: f64,
    /// `T_Ip`, through which it gives forces ([`crate::kernel::spread`]).
    pub scatter: f64,
}

/// What contact adds to the largest squared frequency.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactLoad {
    /// Bound of `lambda_max(S k S^T M^-1)` in 1/s^2.
    pub omega_sq: f64,
    /// Largest stiffness on a point in N/m.
    pub stiffness: f64,
}
