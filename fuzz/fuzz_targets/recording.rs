//! A recording, read as `tandem replay` reads it before it starts a solver. The input is a recording without its checksums:
//! the length of the description, the description, and what is packed.

#![no_main]

use std::io::Write as _;

use interface::packed::{BlockSize, packer};
use interface::recording::Playback;
use libfuzzer_sys::fuzz_target;

/// The recording, with the checksums that belong to it.
fn sealed(input: &[u8]) -> Vec<u8> {
    let (length, rest) = input.split_at(input.len().min(4));
    let about = length.try_into().map_or(0, u32::from_le_bytes) as usize;
    let (about, content) = rest.split_at(rest.len().min(about));
    let check = blake3::hash(about);
    let head = [b"TANDEMR2", length, about, &check.as_bytes()[..8]].concat();
    let mut packer = packer(head, BlockSize::Max64KB);
    packer.write_all(content).expect("memory takes an input");
    packer.finish().expect("memory takes an input")
}

fuzz_target!(|input: &[u8]| {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("recording.tandem");
    std::fs::write(&path, sealed(input)).expect("room for an input");
    let _ = Playback::verify(&path);
    let Ok(mut playback) = Playback::open(&path) else {
        return;
    };
    while let Ok(Some((_, message))) = playback.message() {
        let _ = message.as_order();
        let _ = message.as_notice();
        let _ = message.payload.records().check();
    }
});
