//! The kit's random cases: forces, stiffness, travel, motion, limits, ledger, frames and saved states beside its oracle.

use std::ops::Range;

use conformance::random_cases;
use dem_proc::Sdem;
use interface::hosted::{Host, Subject};

#[test]
fn random_cases_agree_with_the_oracle_of_the_kit() {
    agree(0..120);
}

/// The force of Hertz's law at an overlap of 4e-9 m, whose own rounding is a part in a thousand of its stiffness; two bodies
/// that part by more than their reach within one step, whose dashpot the oracle forgot; a point that passes the middle of a corner
/// of a fast spinning body, which no run may do: the kit looked for where it had been beside the body without the body's turn; a
/// point 5e-7 m from an edge, for which the oracle took the way from the edge as the normal.
#[test]
fn cases_that_the_oracle_judged_wrongly_agree() {
    agree(114_170..114_190);
    agree(1_786_150..1_786_160);
    agree(45_905..45_915);
    agree(320_636..320_644);
}

/// Of chains: markers that come or leave while a disc presses them, two radii near one disc, the minimum at the beginning of a
/// chain, and damping before the first set.
#[test]
fn cases_that_the_solver_answered_wrongly_agree() {
    // Seeds 19 and 36 are among those of the first test.
    agree(1_500..1_520);
    agree(1_750..1_770);
    agree(5_330..5_335);
}

/// What few cases show: a body on a hinge, which has no mass for a dashpot on a fixed one; a contact of grains that has rolled when it
/// opens.
#[test]
fn cases_of_what_is_rare_agree() {
    agree(1_270..1_280);
    agree(4_745..4_755);
}

fn agree(seeds: Range<u64>) {
    let subject = Subject::in_thread(|| Host::Dem(Box::new(Sdem::default())));
    let broken = random_cases(&subject, seeds).unwrap();
    assert!(broken.is_empty(), "{broken:#?}");
}
