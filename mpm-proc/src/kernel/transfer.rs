//! Transfers of velocity between points and grid (Jiang 2020 eqs. 26 to 31): PIC, FLIP, their blend, APIC and XPIC.

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::kernel::blocks::LaneCopy;
use crate::kernel::lanes::Lanes;

/// A transfer scheme. Its constants are known when the loops are compiled; what it does not use has no state.
pub trait Transfer: Copy + Send + Sync + 'static {
    /// State of four points besides their velocity.
    type Affine: AffineState;

    /// Whether points take the increment of the grid's velocity (FLIP) besides the velocity itself.
    const INCREMENT: bool;

    /// alpha of eq. 28: the share of the grid's velocity (PIC); the rest is the point's own plus the increment.
    fn pic_fraction(&self) -> f64;

    /// m of XPIC(m): how often the points' velocities are filtered before they take the increment; 0 for other transfers.
    fn order(&self) -> u32 {
        0
    }

    /// Sets a block's velocities aside.
    fn set_aside(_v: &[Lanes; 2], _aside: &mut Self::Affine) {}

    /// Replaces a block's velocities by those set aside less themselves.
    fn take_from_aside(_v: &mut [Lanes; 2], _aside: &Self::Affine) {}

    /// The same with another share of PIC, where it has one to choose.
    #[must_use]
    fn with_pic_fraction(self, _fraction: f64) -> Self {
        self
    }
}

/// Affine part of the velocity of four points: nothing, or a matrix.
pub trait AffineState: LaneCopy + Default + Serialize + DeserializeOwned + 'static {
    /// Whether there is one.
    const PRESENT: bool;

    /// `B_p D_p^-1 L` by columns: the change of velocity over one cell along x, and along y, in m/s.
    fn slopes(&self) -> [[Lanes; 2]; 2];

    /// The state with these slopes.
    fn from_slopes(slopes: [[Lanes; 2]; 2]) -> Self;
}

impl AffineState for () {
    const PRESENT: bool = false;

    #[inline(always)]
    fn slopes(&self) -> [[Lanes; 2]; 2] {
        [[crate::kernel::lanes::ZERO; 2]; 2]
    }

    #[inline(always)]
    fn from_slopes(_slopes: [[Lanes; 2]; 2]) -> Self {}
}

impl AffineState for [[Lanes; 2]; 2] {
    const PRESENT: bool = true;

    #[inline(always)]
    fn slopes(&self) -> [[Lanes; 2]; 2] {
        *self
    }

    #[inline(always)]
    fn from_slopes(slopes: [[Lanes; 2]; 2]) -> Self {
        slopes
    }
}

/// Particle in cell (eq. 26).
#[derive(Debug, Clone, Copy)]
pub struct Pic;

impl Transfer for Pic {
    type Affine = ();
    const INCREMENT: bool = false;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        1.0
    }
}

/// Fluid implicit particle (eq. 27).
#[derive(Debug, Clone, Copy)]
pub struct Flip;

impl Transfer for Flip {
    type Affine = ();
    const INCREMENT: bool = true;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        0.0
    }
}

/// A blend of the two (eq. 28).
#[derive(Debug, Clone, Copy)]
pub struct Blend {
    /// alpha of eq. 28, from 0 (FLIP) to 1 (PIC).
    pub pic_fraction: f64,
}

impl Transfer for Blend {
    type Affine = ();
    const INCREMENT: bool = true;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        self.pic_fraction
    }

    fn with_pic_fraction(self, pic_fraction: f64) -> Self {
        Self { pic_fraction }
    }
}

/// Affine particle in cell (eqs. 29 to 31).
#[derive(Debug, Clone, Copy)]
pub struct Apic;

impl Transfer for Apic {
    type Affine = [[Lanes; 2]; 2];
    const INCREMENT: bool = false;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        1.0
    }
}

/// Extended particle in cell of order m (Hammerquist and Nairn 2017).
#[derive(Debug, Clone, Copy)]
pub struct Xpic {
    /// m, at least 1 (which is PIC).
    pub order: u32,
}

/// Velocities set aside while the filter works on what is left of them.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Aside {
    /// Not saved: set aside and taken back within one step.
    #[serde(skip)]
    v: [Lanes; 2],
}

impl AffineState for Aside {
    const PRESENT: bool = false;

    #[inline(always)]
    fn slopes(&self) -> [[Lanes; 2]; 2] {
        [[crate::kernel::lanes::ZERO; 2]; 2]
    }

    #[inline(always)]
    fn from_slopes(_slopes: [[Lanes; 2]; 2]) -> Self {
        Self::default()
    }
}

impl LaneCopy for Aside {
    fn copy_lane(&mut self, to: usize, source: &Self, from: usize) {
        self.v.copy_lane(to, &source.v, from);
    }
}

impl Transfer for Xpic {
    type Affine = Aside;
    const INCREMENT: bool = true;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        0.0
    }

    fn order(&self) -> u32 {
        self.order
    }

    fn set_aside(v: &[Lanes; 2], aside: &mut Aside) {
        aside.v = *v;
    }

    fn take_from_aside(v: &mut [Lanes; 2], aside: &Aside) {
        *v = [aside.v[0] - v[0], aside.v[1] - v[1]];
    }
}
