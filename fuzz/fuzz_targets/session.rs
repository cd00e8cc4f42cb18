#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| (fuzzing::target("session").expect("a target of this name").run)(input));
