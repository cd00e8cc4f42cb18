//! Reads a recording.

use std::fs::File;
use std::io::{self, BufReader, Error, ErrorKind, Read};
use std::path::{Path, PathBuf};

use lz4_flex::frame::FrameDecoder;

use super::{About, END, MESSAGE_HEADER, NAME, RecordingError};
use crate::files;
use crate::message::wire::{StepHeader, layout_hash, records_of};
use crate::message::{Channel, Message, Payload};
use crate::packed::{self, exactly};

/// A recording being read.
pub struct Playback {
    file: FrameDecoder<BufReader<File>>,
    path: PathBuf,
    about: About,
    messages: u64,
    end: Option<End>,
}

/// How a recording ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// Complete, as its run ended.
    Whole {
        /// Number of messages.
        messages: u64,
    },
    /// Incomplete: its run, or its writer, was killed.
    Torn {
        /// Number of messages that can be read.
        messages: u64,
    },
}

impl Playback {
    /// Opens a recording and reads its description.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut file = files::open_named(path).map_err(RecordingError::file("open", path))?;
        let foreign = |reason: String| RecordingError::Foreign {
            path: path.to_path_buf(),
            reason,
        };
        let read = packed::read_head::<About>(&mut file, NAME);
        let (about, _) = read.map_err(|e| match e.kind() {
            ErrorKind::InvalidData => foreign(e.to_string()),
            _ => RecordingError::file("read", path)(e),
        })?;
        let (theirs, ours) = (&about.made.layout, layout_hash());
        if *theirs != ours || about.channels != super::channel_names() {
            return Err(foreign(format!("layout {theirs}, this is {ours}")));
        }
        Ok(Self {
            file: packed::unpacker(file),
            path: path.to_path_buf(),
            about,
            messages: 0,
            end: None,
        })
    }

    /// Reads a whole recording; returns how it ends.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn verify(path: &Path) -> Result<End, RecordingError> {
        let mut playback = Self::open(path)?;
        while playback.message()?.is_some() {}
        Ok(playback.end.expect("the end has been read"))
    }

    /// The run that the recording belongs to.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// How it ends, once the end has been read.
    pub fn end(&self) -> Option<End> {
        self.end
    }

    /// The next message and its channel; `None` at the end.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn message(&mut self) -> Result<Option<(Channel, Message)>, RecordingError> {
        if self.end.is_some() {
            return Ok(None);
        }
        let messages = self.messages;
        match self.next() {
            Ok(Some(message)) => {
                self.messages += 1;
                return Ok(Some(message));
            }
            Ok(None) => self.end = Some(End::Whole { messages }),
            Err(e) if e.kind() == ErrorKind::UnexpectedEof => {
                self.end = Some(End::Torn { messages });
            }
            Err(e) => {
                return Err(RecordingError::Damaged {
                    path: self.path.clone(),
                    messages,
                    what: e.to_string(),
                });
            }
        }
        Ok(None)
    }

    /// The next message; `None` if there is the end in its place.
    fn next(&mut self) -> io::Result<Option<(Channel, Message)>> {
        let damaged = |what: &str| Err(Error::new(ErrorKind::InvalidData, what));
        let mut begin = [0; MESSAGE_HEADER];
        self.file.read_exact(&mut begin)?;
        let ([number, length @ ..], header) = begin.split_first_chunk::<5>().expect("longer");
        let payload = exactly(&mut self.file, u32::from_le_bytes(*length).into())?;
        if *number == END {
            if payload != self.messages.to_le_bytes() {
                return damaged("the number of messages");
            }
            let rest = self.file.read(&mut [0]);
            return match (rest, self.file.get_mut().read(&mut [0])) {
                (Ok(0), Ok(0)) => Ok(None),
                _ => damaged("something after the end"),
            };
        }
        let Some(&channel) = Channel::ALL.get(usize::from(*number)) else {
            return damaged("the channel of a message");
        };
        let Some(payload) = Payload::read(channel.kind, &payload) else {
            return damaged("the records of a message");
        };
        let Some(&[header]) = records_of::<StepHeader>(header).as_deref() else {
            return damaged("the header of a message");
        };
        Ok(Some((channel, Message { header, payload })))
    }
}
