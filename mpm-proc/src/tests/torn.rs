//! States that are torn or tampered with: refused, or taken without a panic.

use std::sync::LazyLock;

use interface::config::{MpmConfig, ShapeFunction, Transfer};
use interface::solver::MpmSolver;
use proptest::prelude::*;

use super::configured;
use super::saved::{Driver, flying, force, grains, surround, under_way};
use crate::state::saved::{Bytes, FORMAT};

/// Configurations whose states are torn: with IMPs and loads, with points that go, with grains, with hats.
static TORN: LazyLock<Vec<(MpmConfig, Driver, Vec<u8>)>> = LazyLock::new(|| {
    let mut cases = vec![
        flying(),
        flying(),
        flying(),
        grains([false, true]),
        flying(),
    ];
    force(&mut cases[0]);
    surround(&mut cases[1], 3);
    surround(&mut cases[2], 2);
    (cases[4].shape, cases[4].transfer) = (ShapeFunction::Linear, Transfer::Pic);
    surround(&mut cases[4], 1);
    cases
        .into_iter()
        .map(|config| {
            let (driver, mpm) = under_way(&config);
            let bytes = mpm.save().unwrap();
            (config, driver, bytes)
        })
        .collect()
});

/// Whatever comes of the bytes, nothing panics; steps end with a fault at worst.
fn survives(case: usize, bytes: &[u8]) -> bool {
    let (config, driver, _) = &TORN[case];
    let mut mpm = configured(config);
    let taken = mpm.restore(bytes);
    if let Err(refusal) = &taken {
        assert_eq!(refusal.key, "restore");
        return false;
    }
    let mut driver = driver.clone();
    let _ = (0..6).try_for_each(|_| driver.step(&mut mpm).map(drop));
    mpm.points();
    true
}

/// A state with IMPs, and no room for their contact, was taken once.
#[test]
fn a_flag_that_is_cleared_never_panics() {
    for (case, (_, _, bytes)) in TORN.iter().enumerate() {
        for at in (0..bytes.len()).filter(|&at| bytes[at] == 1).take(400) {
            let cleared = [&bytes[..at], &[0], &bytes[at + 1..]].concat();
            survives(case, &cleared);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_state_cut_short_is_refused(case in 0..5_usize, at in any::<prop::sample::Index>()) {
        let bytes = &TORN[case].2;
        prop_assert!(!survives(case, &bytes[..at.index(bytes.len())]));
    }

    #[test]
    fn flipped_bits_never_panic(
        case in 0..5_usize,
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0..8_u8), 1..6),
    ) {
        let mut bytes = TORN[case].2.clone();
        for (at, bit) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        survives(case, &bytes);
    }

    /// Where a list begins and what stands at the ends of numbers is hit more often than by chance alone.
    #[test]
    fn extreme_bytes_never_panic(
        case in 0..5_usize,
        at in any::<prop::sample::Index>(),
        with in prop::collection::vec(prop_oneof![Just(0_u8), Just(0x7f), Just(0xf0), Just(0xff)], 8),
    ) {
        let mut bytes = TORN[case].2.clone();
        let at = at.index(bytes.len() - 8) / 4 * 4;
        bytes[at..at + 8].copy_from_slice(&with);
        survives(case, &bytes);
    }

    #[test]
    fn random_bytes_are_refused(case in 0..5_usize, bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(!survives(case, &bytes));
        // The same behind the right marks.
        let sealed = configured(&TORN[case].0)
            .mark()
            .seal(FORMAT, &Bytes(bytes));
        prop_assert!(!survives(case, &sealed));
    }
}
