//! What is recorded of a run: numbers while it goes on, files in its directory.
//!
//! | file | what is in it |
//! | --- | --- |
//! | [`quantity`] | the quantities that columns and checks may name |
//! | [`ledger`] | energies and momenta of both sides together |
//! | [`check`] | columns of the history, and what the run must show |
//! | [`rundir`], [`history`], [`frames`], [`summary`] | the run directory and its files |
//! | [`aside`], [`screen`] | threads that write to files and to standard error, so that no step waits for them |
//! | [`progress`] | what a user sees meanwhile |

pub mod aside;
pub mod check;
pub mod course;
mod error;
pub mod frames;
pub mod history;
pub mod ledger;
pub mod progress;
pub mod quantity;
pub mod rundir;
pub mod screen;
pub mod summary;
