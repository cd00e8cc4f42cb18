//! The loads of contact on one body.

use interface::Vec2;

/// Sums over the contacts of one body with points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Load {
    /// Force in N/m.
    pub force: Vec2,
    /// Torque about the centre of mass in N.
    pub torque: f64,
    /// Upper bound of the squared frequency of the body on its contacts in reach, with all else fixed, in 1/s^2: `sum k
    /// (1/m + (r x n)^2 / I)` over their normal and tangential springs, the trace of `M^-1 K`.
    pub rate: f64,
    /// `sum (1/m + (r x n)^2 / I)` over the contacts in reach in 1/kg, at least the `W_dem` of docs/physics.md section 4.
    pub mobility: f64,
    /// The same along the tangents.
    pub along: f64,
    /// Contacts that press.
    pub contacts: u32,
}

impl std::ops::AddAssign for Load {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
        self.rate += other.rate;
        self.mobility += other.mobility;
        self.along += other.along;
        self.contacts += other.contacts;
    }
}

/// Sums over the contacts of one body with other bodies.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct PairLoad {
    /// Force in N/m.
    pub force: Vec2,
    /// Torque about the centre of mass in N.
    pub torque: f64,
    /// As [`Load::rate`].
    pub rate: f64,
}

impl PairLoad {
    /// A load from force, torque and rate as four numbers.
    #[inline]
    pub fn from_row([x, y, torque, rate]: [f64; 4]) -> Self {
        Self {
            force: Vec2::new(x, y),
            torque,
            rate,
        }
    }
}

impl std::ops::AddAssign for PairLoad {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
        self.rate += other.rate;
    }
}
