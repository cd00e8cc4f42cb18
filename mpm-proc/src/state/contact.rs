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
    /// `(-dS_Ip/dy, dS_Ip/dx) / 2` in 1/m, through which it turns and gives couples; 0 where contact has no friction.
    pub curl: [f64; 2],
    /// How much of this node a turn of the surface of the point takes part in: its radius times `|curl|`.
    pub turned: f64,
}

impl Touch {
    /// `radius |curl|` of a surface with this radius in m.
    pub fn turned_by(curl: [f64; 2], radius: f64) -> f64 {
        // Most points have no friction, and the length of a vector is slow.
        if curl == [0.0; 2] {
            return 0.0;
        }
        radius * curl[0].hypot(curl[1])
    }
}

/// A point that a body presses on, or may press on in the next step.
#[derive(Debug, Clone, Copy)]
pub struct Loaded {
    /// Its slot.
    pub slot: usize,
    /// In N/m.
    pub stiffness: f64,
    /// Tangential stiffness on the surface of the point in N/m.
    pub tangential: f64,
}

/// The contribution of contact to the largest squared frequency.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactLoad {
    /// Bound of `lambda_max(S k S^T M^-1)` in 1/s^2.
    pub omega_sq: f64,
    /// Largest stiffness on a point in N/m.
    pub stiffness: f64,
}
