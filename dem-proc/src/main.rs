//! The rigid-body solver as a program of its own.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

fn main() -> std::process::ExitCode {
    interface::session::process::serve_dem(dem_proc::Sdem::default())
}
