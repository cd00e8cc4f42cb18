//! A recording of a run at the interface: every message, as it was sent, in a file.
//!
//! The coupler writes it ([`Recorder`]), for solvers in any language. It records its own messages, and reads those
//! between the two solvers as a second subscriber (PROTOCOL.md clause C-1). [`Playback`] reads the file, [`replay`] plays it
//! to one solver. Within a channel the order is that of sending; between channels it is only approximately so.
//!
//! The file is one of [`packed`](crate::packed), named `TANDEMR2`. Its content:
//!
//! ```text
//! content = message* end?
//! message = channel:u8 length:u32 header[48] payload[length]
//! end     = a message on channel 255, whose payload is the number of all others, u64
//! ```
//!
//! `channel` counts the `channels` of the description ([`About`]); `header` and `payload` are the bytes of section 4 of
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
use crate::message::wire::{LAYOUT, StepHeader};
use crate::packed::Made;

const NAME: [u8; 8] = *b"TANDEMR2";
/// Bytes of a message before its payload.
const MESSAGE_HEADER: usize = 1 + 4 + size_of::<StepHeader>();
/// In the place of a channel: the end of the recording.
const END: u8 = u8::MAX;

/// The run that a recording belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct About {
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// The records' layout, line by line.
    pub records: Vec<String>,
    /// Names of the channels, by number.
    pub channels: Vec<String>,
}

impl About {
    /// The description of a run of this build.
    pub fn run(scene: &str, scene_hash: &str) -> Self {
        Self {
            made: Made::of(scene, scene_hash),
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
    #[error("the recording {path} is damaged after {messages} messages: {what}")]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// Messages before the part that does not fit its checksum.
        messages: u64,
        /// What does not fit.
        what: String,
    },
}

impl RecordingError {
    fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self + use<> {
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

#[cfg(test)]
mod tests;
