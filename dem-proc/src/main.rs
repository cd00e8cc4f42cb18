//! The rigid-body solver as a program of its own.
#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    interface::session::process::serve_dem(dem_proc::Sdem::default())
}
