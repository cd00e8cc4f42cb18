//! The continuum solver as a program of its own.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

fn main() -> std::process::ExitCode {
    interface::session::process::serve_mpm(mpm_proc::Mpm::default())
}
