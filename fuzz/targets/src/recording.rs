//! Recordings with the right checksums, read as `tandem replay` reads them before it starts a solver.
//!
//! An input is a recording without its checks: the length of the description and the description, then blocks of twelve
//! bytes and a body.

use std::io::Write as _;

use interface::message::control::{Notice, Party};
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
    // Files with buffers; a block makes at most 255 bytes of each of its own.
    base: 1 << 16,
    per_byte: 600,
};

/// Bytes before the description: name, format, length.
const START: usize = 16;
const BLOCK: usize = 12;
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
    let check = |parts: &[&[u8]]| {
        let mut hasher = blake3::Hasher::new();
        for part in parts {
            hasher.update(part);
        }
        hasher.finalize().as_bytes()[..CHECK].to_vec()
    };
    let mut file = b"TANDEMRC".to_vec();
    file.extend(1_u32.to_le_bytes());
    let (length, mut rest) = input.split_at(input.len().min(4));
    file.extend(length);
    let about = length.try_into().map_or(0, u32::from_le_bytes) as usize;
    let (about, blocks) = rest.split_at(rest.len().min(about));
    file.extend(about);
    file.extend(check(&[about]));
    rest = blocks;
    for number in 0_u64.. {
        let Some((header, body)) = rest.split_at_checked(BLOCK) else {
            break;
        };
        let stored = u32::from_le_bytes(header[..4].try_into().expect("4 bytes")) as usize;
        let (body, more) = body.split_at(body.len().min(stored));
        file.extend(header);
        file.extend(check(&[&number.to_le_bytes(), header]));
        file.extend(body);
        file.extend(check(&[body]));
        rest = more;
    }
    file.extend(rest);
    file
}

/// The recording of the small run: as it is, with blocks that are not packed, and only its beginning.
fn seeds() -> Vec<Vec<u8>> {
    let file = &LEFT.recording;
    let number = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("4 bytes"));
    let about = START + number(12) as usize;
    let mut packed = file[12..about].to_vec();
    let mut at = about + CHECK;
    while at < file.len() {
        let body = at + BLOCK + CHECK;
        let end = body + number(at) as usize;
        packed.extend(&file[at..at + BLOCK]);
        packed.extend(&file[body..end]);
        at = end + CHECK;
    }
    let mut plain = file[12..about].to_vec();
    for messages in LEFT.messages.chunks(20).take(4) {
        let mut body = Vec::new();
        for (channel, message) in messages {
            let records = message.payload.records();
            body.push(channel.number() as u8);
            body.extend((records.bytes().len() as u32).to_le_bytes());
            body.extend(interface::message::wire::bytes_of(&[message.header]));
            body.extend(records.bytes());
        }
        let numbers = [body.len() as u32, body.len() as u32, messages.len() as u32];
        plain.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        plain.extend(body);
    }
    let beginning = plain[..about - 12 + 200].to_vec();
    vec![packed, plain, beginning]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Otherwise the target would not reach what it is about.
    #[test]
    fn a_seed_is_the_recording_that_it_is_made_of() {
        assert_eq!(sealed(&seeds()[0]), LEFT.recording);
    }
}
