//! How positions take over the field that strains the points.
//!
//! A point moves by a velocity that is known after the kick, and its strain is that of the field which the grid has when the
//! velocities are mapped next. The two differ by `S (1 - P S) dv` ([`crate::pass::drift`]), which positions must not keep: so a
//! point moves in the next step by what the strains of the last interval have been more than that. The share of the interval
//! whose strain is known only then is all of it with USF and half with USAVG. MUSL knows the field at once, and USL strains
//! by the velocity after the kick itself.

use interface::config::{Drift, StressUpdate};
use interface::step::Step;

use crate::kernel::lanes::{Lanes, ZERO};

/// The parts of the last interval and of the present one whose strain is known only in the step that follows, in s.
#[derive(Debug, Clone, Copy, Default)]
pub struct Settling {
    /// Of the last interval; zero if there was none.
    pub past: f64,
    /// Of the present one.
    pub ahead: f64,
}

impl Settling {
    /// In this step.
    pub fn of(update: StressUpdate, drift: Drift, step: &Step) -> Self {
        let share = match update {
            StressUpdate::Usf => 1.0,
            StressUpdate::Usavg => 0.5,
            StressUpdate::Usl | StressUpdate::Musl => 0.0,
        };
        // A step of length zero moves nothing; what is not settled then stays so.
        if drift == Drift::Nodal || step.dt == 0.0 {
            return Self::default();
        }
        Self {
            past: share * step.dt_before,
            ahead: share * step.dt,
        }
    }

    /// Whether anything is to be done.
    pub fn settles(&self) -> bool {
        self.ahead > 0.0
    }

    /// What is missing to the displacement by the field, `strained` (m), after that of `unsettled` (m).
    #[inline(always)]
    pub fn correction(&self, strained: Lanes, unsettled: Lanes) -> Lanes {
        if self.past > 0.0 {
            strained - unsettled
        } else {
            ZERO
        }
    }
}
