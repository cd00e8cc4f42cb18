//! Files that say what they are and have the rest packed: recordings and checkpoints.
//!
//! ```text
//! file  = name[8] length:u32 about[length] check content
//! about = JSON
//! check = first 8 bytes of the BLAKE3 hash of `about`
//! content = an LZ4 frame, with checksums of its blocks and of the whole
//! ```
//!
//! Numbers are little-endian. The name ends with the version of the format. LZ4's own document has its frames
//! (<https://github.com/lz4/lz4/blob/dev/doc/lz4_Frame_format.md>): any tool for them unpacks the content.

use std::io::{self, BufReader, Error, ErrorKind, Read, Write};

pub use lz4_flex::frame::BlockSize;
use lz4_flex::frame::{FrameDecoder, FrameEncoder, FrameInfo};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::message::control::PROTOCOL;
use crate::message::wire::layout_hash;

/// Longest description in bytes.
const ABOUT: u32 = 1 << 20;
/// Bytes of a check.
const CHECK: usize = 8;

/// What a file is of, and what made it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Made {
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene as resolved.
    pub scene_hash: String,
    /// Program that made it.
    pub made_by: String,
    /// Version of the protocol.
    pub protocol: (u32, u32),
    /// Hash of the records' layout (clause C-3).
    pub layout: String,
}

impl Made {
    /// By this build, of a run of this scene.
    pub fn of(scene: &str, scene_hash: &str) -> Self {
        Self {
            scene: scene.into(),
            scene_hash: scene_hash.into(),
            made_by: concat!("tandem ", env!("CARGO_PKG_VERSION")).into(),
            protocol: PROTOCOL,
            layout: layout_hash(),
        }
    }
}

/// What a file begins with.
///
/// # Panics
/// If `about` is no JSON. This is an assertion: descriptions are texts and numbers.
pub fn head(name: [u8; 8], about: &impl Serialize) -> Vec<u8> {
    let about = serde_json::to_vec(about).expect("a description is texts and numbers");
    let length = (about.len() as u32).to_le_bytes();
    [&name[..], &length, &about, &check(&about)].concat()
}

/// Reads that; returns the description and how many bytes were read. Memory is taken for what is there and not for what is
/// announced.
///
/// # Errors
/// [`ErrorKind::InvalidData`] with what is wrong with the file; the file cannot be read.
pub fn read_head<T: DeserializeOwned>(file: &mut impl Read, name: [u8; 8]) -> io::Result<(T, u64)> {
    let wrong = |what: String| Error::new(ErrorKind::InvalidData, what);
    let start = exactly(file, 12);
    let start = start.map_err(|e| match e.kind() {
        ErrorKind::UnexpectedEof => wrong("it is too short".into()),
        _ => e,
    })?;
    let (found, length) = start.split_at(8);
    if found != name {
        let name = String::from_utf8_lossy(&name);
        return Err(wrong(format!("it does not begin with `{name}`")));
    }
    let length = u32::from_le_bytes(length.try_into().expect("four bytes"));
    if length > ABOUT {
        return Err(wrong(format!("a description of {length} bytes")));
    }
    let damaged = || wrong("its description is damaged".into());
    let mut about = exactly(file, u64::from(length) + CHECK as u64).map_err(|_| damaged())?;
    let found = about.split_off(length as usize);
    if found != check(&about) {
        return Err(damaged());
    }
    let about = serde_json::from_slice(&about).map_err(|e| wrong(e.to_string()))?;
    Ok((about, 12 + u64::from(length) + CHECK as u64))
}

fn check(about: &[u8]) -> [u8; CHECK] {
    let hash = blake3::hash(about);
    *hash.as_bytes().first_chunk().expect("a hash has 32 bytes")
}

/// Packs what is written to it; [`FrameEncoder::try_finish`] writes the end.
pub fn packer<W: Write>(file: W, block: BlockSize) -> FrameEncoder<W> {
    let how = FrameInfo::new()
        .block_size(block)
        .block_checksums(true)
        .content_checksum(true);
    FrameEncoder::with_frame_info(how, file)
}

/// Unpacks what a [`packer`] has written. [`ErrorKind::UnexpectedEof`] says that the file ends before its end.
pub fn unpacker<R: Read>(file: R) -> FrameDecoder<BufReader<R>> {
    FrameDecoder::new(BufReader::new(file))
}

/// The next bytes, just so many; memory is taken for those that are there.
///
/// # Errors
/// [`ErrorKind::UnexpectedEof`] if they are fewer.
pub fn exactly(file: &mut impl Read, length: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    match file.take(length).read_to_end(&mut bytes)? as u64 {
        read if read == length => Ok(bytes),
        _ => Err(ErrorKind::UnexpectedEof.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAME: [u8; 8] = *b"ANYTHING";

    #[test]
    fn another_file_is_refused() {
        let refused = |file: &[u8]| {
            let error = read_head::<String>(&mut &file[..], NAME).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::InvalidData);
            error.to_string()
        };
        assert_eq!(refused(b"short"), "it is too short");
        assert!(refused(&[7; 100]).contains("begin with `ANYTHING`"));
        let long = [&NAME[..], &u32::MAX.to_le_bytes()].concat();
        assert_eq!(refused(&long), "a description of 4294967295 bytes");
    }
}
