//! The solver accepts exactly what it lists as its capabilities.

use dem_proc::Sdem;
use interface::config::capability::SAVE;
use interface::solver::DemSolver;

#[test]
fn what_is_listed_is_taken_and_the_rest_refused() {
    crate::capability_samples::check::<Sdem>();
    let capabilities = Sdem::default().capabilities();
    assert!(capabilities.has(SAVE));
    for family in ["shape", "law", "motion", "overlap", "inertia", "feature"] {
        assert!(capabilities.members(family).next().is_some(), "{family}");
    }
}
