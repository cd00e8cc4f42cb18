//! What the targets of `cargo fuzz` have in common: how an input is run and how it is changed.

#![forbid(unsafe_code)]

use fuzzing::Target;
use fuzzing::change::Changer;
pub use libfuzzer_sys;

/// The whole of a target; its name is that of the program.
#[macro_export]
macro_rules! fuzz {
    () => {
        use std::sync::LazyLock;

        use $crate::libfuzzer_sys::{fuzz_mutator, fuzz_target};

        static FUZZED: LazyLock<$crate::Fuzzed> =
            LazyLock::new(|| $crate::Fuzzed::of(env!("CARGO_BIN_NAME")));

        fuzz_target!(|input: &[u8]| FUZZED.run(input));
        fuzz_mutator!(|input: &mut [u8], size: usize, most: usize, seed: u32| {
            FUZZED.change(input, size, most, seed)
        });
    };
}

/// A target with its seeds.
#[derive(Debug)]
pub struct Fuzzed {
    target: Target,
    seeds: Vec<Vec<u8>>,
}

impl Fuzzed {
    /// The one of this name.
    ///
    /// # Panics
    ///
    /// There is none.
    pub fn of(name: &str) -> Self {
        let target = fuzzing::target(name).expect("a target of this name");
        let seeds = (target.seeds)();
        Self { target, seeds }
    }

    /// Runs an input.
    ///
    /// # Panics
    ///
    /// As the target does, and where it takes too much memory.
    pub fn run(&self, input: &[u8]) {
        if let Some(bytes) = self.target.too_much(input) {
            panic!("{bytes} bytes at a time for an input of {}", input.len());
        }
    }

    /// Changes an input as the fuzzer does, or as the target does, which knows its form.
    pub fn change(&self, input: &mut [u8], size: usize, most: usize, seed: u32) -> usize {
        if seed.is_multiple_of(2) {
            return libfuzzer_sys::fuzzer_mutate(input, size, most);
        }
        let mut changed = input[..size].to_vec();
        let mut changer = Changer::new(u64::from(seed));
        (self.target.change)(&mut changer, &mut changed, &self.seeds);
        changed.truncate(most);
        input[..changed.len()].copy_from_slice(&changed);
        changed.len()
    }
}
