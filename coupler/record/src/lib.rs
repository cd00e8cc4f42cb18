//! The records of a run: numbers during the run, and files in its directory.
//!
//! | file | what is in it |
//! | --- | --- |
//! | [`quantity`] | the quantities that columns and checks may name |
//! | [`ledger`] | energies and momenta of both sides together |
//! | [`check`] | columns of the history, and the checks of the scene |
//! | [`rundir`], [`history`], [`frames`], [`summary`], [`log`] | the run directory and its files |
//! | [`background`], [`screen`] | threads that write to files and to standard error, so that no step waits for them |
//! | [`progress`] | the progress bar |

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod background;
pub mod check;
mod error;
pub mod frames;
pub mod history;
pub mod ledger;
pub mod log;
pub mod progress;
pub mod quantity;
pub mod rundir;
pub mod screen;
mod seal;
pub mod summary;
pub mod table;

pub use error::{FileError, fail};
pub use seal::Sealed;
pub use summary::Summary;
pub use table::Table;
