//! What contact does to one body.

use interface::Vec2;

/// Sums over the contacts of one body, of one kind (with points, or with bodies).
#[derive(Debug, Clone, Copy, Default)]
pub struct Load {
    /// Force in N/m.
    pub force: Vec2,
    /// Torque about the centre of mass in N.
    pub torque: f64,
    /// Upper bound of the squared frequency that the contacts in reach give the body by itself, in 1/s^2:
    /// `sum k (1/m + (r x n)^2 / I)` over their normal and tangential springs, the trace of `M^-1 K`.
    pub rate: f64,
    /// `sum (1/m + (r x n)^2 / I)` over the contacts in reach in 1/kg, at least the `W_dem` of PHYSICS.md section 4.
    pub mobility: f64,
    /// Contacts that press.
    pub contacts: u32,
}
