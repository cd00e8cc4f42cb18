//! Where a clause is judged: sessions with the solver under test, in which the kit is the coupler and the peer.
//!
//! Nothing here can hang: the kit waits for a message for [`PATIENCE`] at most, and not beyond the clause's [`LIMIT`];
//! for Hello and Ready as long as [`Bench::startup`] says, which is not counted into it.

mod echo;
mod flow;
mod lead;
mod lockstep;
mod points;
mod saved;
mod session;
mod subject;

pub use echo::echo;
pub use flow::{Flow, Shown, around_all, outline};
pub use lead::{Budget, Lead, Sent, Stand, Told};
pub use lockstep::{Answer, Play};
pub use points::Points;
pub use session::{Bench, HASH, LIMIT, PATIENCE, Reply, STARTUP, Session, configure};
pub use subject::{Instead, Solve, Start, Subject, Worker};
