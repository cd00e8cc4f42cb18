//! Reads a recording.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use super::{About, BLOCK_HEADER, CHECK, FORMAT, MAGIC, MESSAGE_HEADER, RecordingError, check};
use crate::files;
use crate::message::wire::{StepHeader, layout_hash, records_of};
use crate::message::{Channel, Message, Payload};

/// Longest description of a run in bytes.
const ABOUT: u32 = 1 << 20;

/// A recording being read.
pub struct Playback {
    file: BufReader<File>,
    path: PathBuf,
    about: About,
    /// The messages of the present block that have not been read yet.
    block: Vec<u8>,
    next: usize,
    blocks: u64,
    /// Byte at which the next block begins.
    pub(super) offset: u64,
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
        /// Byte after which nothing can be used.
        at: u64,
    },
}

impl Playback {
    /// Opens a recording and reads its description.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = files::open_named(path).map_err(RecordingError::file("open", path))?;
        let foreign = |reason: String| RecordingError::Foreign {
            path: path.to_path_buf(),
            reason,
        };
        let mut file = BufReader::new(file);
        let mut start = [0; 16];
        let got = fill(&mut file, &mut start).map_err(RecordingError::file("read", path))?;
        if got < start.len() || start[..8] != MAGIC[..] {
            return Err(foreign("it does not begin as one".into()));
        }
        let [format, length] = [8, 12].map(|at| u32_at(&start, at));
        if format != FORMAT {
            return Err(foreign(format!("format {format}, this is {FORMAT}")));
        }
        if length > ABOUT {
            return Err(foreign(format!("a description of {length} bytes")));
        }
        let length = length as usize;
        let read = up_to(&mut file, length + CHECK);
        let about = read.map_err(RecordingError::file("read", path))?;
        let parts = about.split_at_checked(length);
        let whole = parts.filter(|(about, sum)| check(&[about]) == *sum);
        let Some((about, _)) = whole else {
            return Err(RecordingError::Damaged {
                path: path.to_path_buf(),
                at: 16,
                what: "the description of the run",
            });
        };
        let about: About = serde_json::from_slice(about).map_err(|e| foreign(e.to_string()))?;
        let ours = layout_hash();
        if about.layout != ours || about.channels != super::channel_names() {
            let theirs = &about.layout;
            return Err(foreign(format!("layout {theirs}, this is {ours}")));
        }
        Ok(Self {
            file,
            path: path.to_path_buf(),
            about,
            block: Vec::new(),
            next: 0,
            blocks: 0,
            offset: (16 + length + CHECK) as u64,
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
        while self.next == self.block.len() {
            if self.end.is_some() || !self.read_block()? {
                return Ok(None);
            }
        }
        let bytes = &self.block[self.next..];
        let damaged = self.damaged("a message");
        if bytes.len() < MESSAGE_HEADER {
            return Err(damaged);
        }
        let (header, rest) = bytes.split_at(MESSAGE_HEADER);
        let length = u32_at(header, 1) as usize;
        let Some(&channel) = Channel::ALL.get(usize::from(header[0])) else {
            return Err(damaged);
        };
        let payload = rest.get(..length);
        let Some(payload) = payload.and_then(|bytes| Payload::read(channel.kind, bytes)) else {
            return Err(damaged);
        };
        let Some(&[header]) = records_of::<StepHeader>(&header[5..]).as_deref() else {
            return Err(damaged);
        };
        self.next += MESSAGE_HEADER + length;
        self.messages += 1;
        Ok(Some((channel, Message { header, payload })))
    }

    fn damaged(&self, what: &'static str) -> RecordingError {
        RecordingError::Damaged {
            path: self.path.clone(),
            at: self.offset,
            what,
        }
    }

    /// Reads the next block; false at the end.
    fn read_block(&mut self) -> Result<bool, RecordingError> {
        self.block.clear();
        self.next = 0;
        let torn = End::Torn {
            messages: self.messages,
            at: self.offset,
        };
        let mut header = [0; BLOCK_HEADER + CHECK];
        if self.fill(&mut header)? < header.len() {
            self.end = Some(torn);
            return Ok(false);
        }
        let (numbers, sum) = header.split_at(BLOCK_HEADER);
        if check(&[&self.blocks.to_le_bytes(), numbers]) != sum {
            return Err(self.damaged("the beginning of a block"));
        }
        let [stored, raw, messages] = [0, 4, 8].map(|at| u32_at(numbers, at));
        let announced = stored as usize + CHECK;
        let read = up_to(&mut self.file, announced);
        let mut body = read.map_err(RecordingError::file("read", &self.path))?;
        if body.len() < announced {
            self.end = Some(torn);
            return Ok(false);
        }
        let sum = body.split_off(stored as usize);
        if check(&[&body]) != sum[..] {
            return Err(self.damaged("a block"));
        }
        // LZ4 makes at most 255 bytes of each byte.
        if u64::from(raw) > 255 * (u64::from(stored) + 1) {
            return Err(self.damaged("the length of a block"));
        }
        self.block = if stored < raw {
            lz4_flex::block::decompress(&body, raw as usize)
                .map_err(|_| self.damaged("a compressed block"))?
        } else {
            body
        };
        self.blocks += 1;
        let whole = (header.len() + stored as usize + CHECK) as u64;
        if messages == 0 {
            if self.block != self.messages.to_le_bytes() {
                return Err(self.damaged("the number of messages"));
            }
            let mut more = [0];
            self.offset += whole;
            if self.fill(&mut more)? > 0 {
                return Err(self.damaged("something after the end"));
            }
            self.block.clear();
            self.end = Some(End::Whole {
                messages: self.messages,
            });
            return Ok(false);
        }
        self.offset += whole;
        Ok(true)
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<usize, RecordingError> {
        fill(&mut self.file, bytes).map_err(RecordingError::file("read", &self.path))
    }
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4 bytes"))
}

/// The next bytes, as many as are announced where they are there; memory only for those that are.
pub(super) fn up_to(file: &mut impl Read, announced: usize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(announced as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads until `bytes` are full or the file ends; returns how many were read.
fn fill(file: &mut impl Read, bytes: &mut [u8]) -> io::Result<usize> {
    let mut got = 0;
    while got < bytes.len() {
        match file.read(&mut bytes[got..])? {
            0 => break,
            more => got += more,
        }
    }
    Ok(got)
}
