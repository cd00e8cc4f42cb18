//! A solver of this program, whichever side it is.

use crate::message::control::{Hello, Party};
use crate::solver::{DemSolver, MpmSolver};

/// A solver of this program.
pub enum Host {
    /// A continuum.
    Mpm(Box<dyn MpmSolver>),
    /// A bodies' side.
    Dem(Box<dyn DemSolver>),
}

impl Host {
    /// Its side.
    pub fn party(&self) -> Party {
        match self {
            Self::Mpm(_) => Party::Mpm,
            Self::Dem(_) => Party::Dem,
        }
    }

    /// Its Hello.
    pub(crate) fn hello(&self) -> Hello {
        match self {
            Self::Mpm(solver) => Hello::of(Party::Mpm, solver.identity(), solver.capabilities()),
            Self::Dem(solver) => Hello::of(Party::Dem, solver.identity(), solver.capabilities()),
        }
    }
}
