//! Contact of bodies with points in the present step: the points that are loaded, and the nodes that they touch.

use super::imps::Member;
use super::nodes::NodeAt;

/// A point that a body presses on.
#[derive(Debug, Clone, Copy)]
pub struct Loaded {
    /// The point.
    pub member: Member,
    /// Stiffness of its contacts in N/m.
    pub stiffness: f64,
}

/// A node that a loaded point touches.
#[derive(Debug, Clone, Copy)]
pub struct Touch {
    /// The node to which the force is applied.
    pub at: NodeAt,
    /// The node that moves: the same, or the original if it is an image.
    pub of: NodeAt,
    /// `S_Ip`, through which the point takes velocities.
    pub gather: f64,
    /// `T_Ip`, through which it gives forces ([`crate::kernel::spread`]).
    pub scatter: f64,
}

/// The contribution of contact to the largest squared frequency.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactLoad {
    /// Bound of `lambda_max(S k S^T M^-1)` in 1/s^2.
    pub omega_sq: f64,
    /// Largest stiffness on a point in N/m.
    pub stiffness: f64,
}
