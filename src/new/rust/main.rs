//! `tandem run SCENE --dem target/release/NAME`

fn main() -> std::process::ExitCode {
    interface::session::process::serve_dem(solver::Solver::default())
}
