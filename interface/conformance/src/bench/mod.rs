//! Where a clause is judged: sessions with the solver under test, in which the kit is the coupler and the peer.
//!
//! Nothing here can hang: the kit waits for a message for [`PATIENCE`] at most, and not beyond the clause's `LIMIT`;
//! for Hello and Ready as long as [`Bench::startup`] says, which is not counted into it.

mod bodies;
mod continuum;
mod run;
mod saved;
mod session;

pub use bodies::Answer;
pub use continuum::{Shown, around_all, outline};
pub use run::{Points, Run, WindowReport, at_least};
pub use session::{Bench, HASH, PATIENCE, Session, configure};
