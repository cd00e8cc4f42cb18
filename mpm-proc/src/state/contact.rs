//! Contact of bodies with points in the present step: the nodes that loaded points touch.

use super::nodes::NodeAt;

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
