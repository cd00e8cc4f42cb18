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
    /// [`Loaded::weight`] with `gather` and with `scatter`.
    pub weights: [f64; 2],
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
    /// Of that surface in m.
    pub radius: f64,
}

impl Loaded {
    /// Its weight in N/m at a node with the share `along` of its motion, in the bound of the frequency of contact.
    pub fn weight(&self, along: f64, curl: [f64; 2]) -> f64 {
        if self.tangential == 0.0 {
            return along * self.stiffness;
        }
        let turned = self.radius * (curl[0] * curl[0] + curl[1] * curl[1]).sqrt();
        let moved = along * self.stiffness.max(self.tangential);
        moved.max(0.5 * self.tangential * turned)
    }
}

/// The contribution of contact to the largest squared frequency.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactLoad {
    /// Bound of `lambda_max(S k S^T M^-1)` in 1/s^2.
    pub omega_sq: f64,
    /// Largest stiffness on a point in N/m.
    pub stiffness: f64,
}
