//! `tandem run SCENE --dem target/release/rapier-dem`
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

fn main() -> std::process::ExitCode {
    interface::session::process::serve_dem(rapier_dem::Rapier::default())
}
