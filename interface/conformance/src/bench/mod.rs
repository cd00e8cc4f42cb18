//! Where a clause is judged: sessions with the solver under test, in which the kit is the coupler and the peer.
//!
//! Nothing here can hang: the kit waits for a message for [`PATIENCE`] at most, and not beyond the clause's `LIMIT`;
//! for Hello and Ready as long as [`Bench::startup`] says, which is not counted into it.

mod bodies_run;
mod continuum_run;
mod kit_run;
mod points;
mod saved;
mod session;
mod subject;

pub use bodies_run::{Answer, BodiesRun};
pub use continuum_run::{ContinuumRun, Shown, around_all, outline};
pub use kit_run::{Budget, KitRun, WindowReport};
pub use points::Points;
pub use session::{Bench, HASH, PATIENCE, Reply, Session, configure};
pub use subject::{Instead, Solve, Start, Subject, Worker};
