//! Deterministic simulation of sessions: the three parties of [`interface::session`] with toy solvers in one thread, in
//! virtual time, with faults.
//!
//! A [`Scenario`](scenario::Scenario) follows from a seed: how long messages take, which wake-ups are lost, who dies, freezes,
//! thaws or answers wrongly, and at which of its events. [`judge`](scenario::Scenario::judge) plays it and checks what must
//! hold whatever happens: every survivor ends within its deadlines; the first verdict names the culprit; nothing is sent
//! after the end; a run without faults has the same bits whatever the schedule; a run that is cut short after a checkpoint
//! and resumed has them too. A scenario that breaks one of these is made smaller as long as it still does
//! ([`shrink`](scenario::shrink)), and its seed becomes a test.
//!
//! `SIMULATE_SEEDS=1000000 cargo test --release -p simulation scenarios_of_seeds -- --nocapture`

#![forbid(unsafe_code)]

mod fault;
mod host;
mod scenario;
mod session;
mod toys;

mod built_in;
mod seeds;
