//! A recording of a run at the interface: every message, as it was sent, in a file.
//!
//! The coupler writes it ([`Recorder`]), for solvers in any language. It records its own messages, and reads those
//! between the two solvers as a second subscriber (PROTOCOL.md clause C-1). [`Playback`] reads the file, [`replay`] plays it
//! to one solver. Within a channel the order is that of sending; between channels it is only approximately so.
//!
//! Layout, all numbers little-endian:
//!
//! ```text
//! file    = "TANDEMRC" format:u32 length:u32 about[length] check(about) block* end?
//! block   = stored:u32 raw:u32 messages:u32 check(number of the block as u64, these 12 bytes) body[stored] check(body)
//! body    = raw bytes of messages; compressed as one LZ4 block where stored < raw
//! message = channel:u8 length:u32 header[48] payload[length]
//! end     = a block with messages = 0, whose body is the number of all messages, u64
//! check   = first 8 bytes of the BLAKE3 hash
//! ```
//!
//! `about` is JSON ([`About`]). `channel` counts its `channels`; `header` and `payload` are the bytes of section 4 of
//! PROTOCOL.md. A file without its end belongs to a run that was killed; it is complete up to the last block.

mod playback;
mod recorder;
pub mod replay;
mod tap;

use std::io;
use std::path::{Path, PathBuf};

pub use playback::{End, Playback};
pub use recorder::{Recorder, RecordingSink};
use serde::{Deserialize, Serialize};
pub use tap::Tap;
use thiserror::Error;

use crate::message::Channel;
use crate::message::control::PROTOCOL;
use crate::message::wire::{LAYOUT, StepHeader, layout_hash};

const MAGIC: &[u8; 8] = b"TANDEMRC";
/// Version of the file's layout.
const FORMAT: u32 = 1;
/// Bytes of a [`check`].
const CHECK: usize = 8;
/// Bytes of a block before its body, without the check.
const BLOCK_HEADER: usize = 12;
/// Bytes of a message before its payload.
const MESSAGE_HEADER: usize = 1 + 4 + size_of::<StepHeader>();
/// A block is closed when it has this many bytes. One message may be longer. A torn file loses at most its last block.
const BLOCK: usize = 1 << 16;

/// The run that a recording belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct About {
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
    /// The records' layout, line by line.
    pub records: Vec<String>,
    /// Names of the channels, by number.
    pub channels: Vec<String>,
}

impl About {
    /// The description of a run with this program's protocol.
    pub fn run(scene: &str, scene_hash: &str, made_by: &str) -> Self {
        Self {
            scene: scene.into(),
            scene_hash: scene_hash.into(),
            made_by: made_by.into(),
            protocol: PROTOCOL,
            layout: layout_hash(),
            records: LAYOUT.map(String::from).to_vec(),
            channels: channel_names(),
        }
    }
}

/// A recording could not be made or read.
#[derive(Debug, Clone, Error)]
pub enum RecordingError {
    /// The file cannot be used.
    #[error("cannot {action} the recording {path}: {reason}")]
    File {
        /// What was tried.
        action: &'static str,
        /// Which file.
        path: PathBuf,
        /// The error message of the system.
        reason: String,
    },
    /// The transport does not let the recorder subscribe.
    #[error("cannot listen to the messages between the solvers: {0}")]
    Tap(String),
    /// It is not a recording, or not one that this program reads.
    #[error("{path} is not a recording that this program reads: {reason}")]
    Foreign {
        /// Which file.
        path: PathBuf,
        /// What was found and what was expected.
        reason: String,
    },
    /// The bytes differ from those that were written.
    #[error("the recording {path} is damaged at byte {at}: {what}")]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// Byte at which the part that does not fit its checksum begins.
        at: u64,
        /// What does not fit.
        what: &'static str,
    },
}

impl RecordingError {
    fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |e| Self::File {
            action,
            path,
            reason: e.to_string(),
        }
    }
}

/// Names of all channels, by number.
fn channel_names() -> Vec<String> {
    Channel::ALL.map(|channel| channel.name().into()).to_vec()
}

fn check(parts: &[&[u8]]) -> [u8; CHECK] {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(part);
    }
    let mut check = [0; CHECK];
    check.copy_from_slice(&hasher.finalize().as_bytes()[..CHECK]);
    check
}

#[cfg(test)]
mod tests;
