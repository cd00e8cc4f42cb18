//! Recordings with the right checksums, read as `tandem replay` reads them before it starts a solver.
//!
//! An input is a recording without its checks: the length of the description and the description, then what is packed.

use std::io::{Read as _, Write as _};

use interface::message::control::{Notice, Party};
use interface::packed::{BlockSize, packer, unpacker};
use interface::recording::Playback;
use interface::transport::raw::Kind;

use crate::run::{LEFT, directory};
use crate::target::Target;

/// Recordings.
pub const TARGET: Target = Target {
    name: "recording",
    run,
    seeds,
    change: |changer, input, seeds| changer.bytes(input, seeds),
    // Files with buffers and blocks. A text in a control message is taken to be up to 256 times as long as the message.
    base: 1 << 18,
    per_byte: 300,
};

/// Bytes before the length of the description, and of the check after it.
const NAME: usize = 8;
const CHECK: usize = 8;

fn run(input: &[u8]) {
    let dir = directory();
    let path = dir.path().join("recording.tandem");
    let written = std::fs::File::create(&path).and_then(|mut file| file.write_all(&sealed(input)));
    written.expect("room for an input");
    let _ = Playback::verify(&path);
    let Ok(mut playback) = Playback::open(&path) else {
        return;
    };
    while let Ok(Some((channel, message))) = playback.message() {
        match channel.kind {
            Kind::Order => drop(message.as_order()),
            Kind::Notice => {
                if let Ok(Notice::Hello(hello)) = message.as_notice() {
                    let _ = hello.party == Party::Dem;
                }
            }
            _ => drop(message.payload.records().check()),
        }
    }
}

/// A recording with the checks that belong to it.
fn sealed(input: &[u8]) -> Vec<u8> {
    let (length, rest) = input.split_at(input.len().min(4));
    let about = length.try_into().map_or(0, u32::from_le_bytes) as usize;
    let (about, content) = rest.split_at(rest.len().min(about));
    let check = blake3::hash(about);
    let head = [b"TANDEMR2", length, about, &check.as_bytes()[..CHECK]].concat();
    let mut packer = packer(head, BlockSize::Max64KB);
    packer.write_all(content).expect("memory takes an input");
    packer.finish().expect("memory takes an input")
}

/// The recording of the small run: as it is, and only its beginning.
fn seeds() -> Vec<Vec<u8>> {
    let file = &LEFT.recording;
    let length = file[NAME..NAME + 4].try_into().expect("4 bytes");
    let about = NAME + 4 + u32::from_le_bytes(length) as usize;
    let mut whole = file[NAME..about].to_vec();
    let mut content = unpacker(&file[about + CHECK..]);
    content.read_to_end(&mut whole).expect("it is whole");
    let beginning = whole[..about - NAME + 200].to_vec();
    vec![whole, beginning]
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface::recording::End;

    /// Otherwise the target would not reach what it is about.
    #[test]
    fn a_seed_is_the_recording_that_it_is_made_of() {
        let place = tempfile::tempdir().unwrap();
        let ends = seeds().into_iter().map(|seed| {
            let path = place.path().join("recording.tandem");
            std::fs::write(&path, sealed(&seed)).unwrap();
            Playback::verify(&path).unwrap()
        });
        let ends: Vec<End> = ends.collect();
        let messages = LEFT.messages.len() as u64;
        assert_eq!(ends[0], End::Whole { messages });
        assert!(matches!(ends[1], End::Torn { .. }));
    }
}
