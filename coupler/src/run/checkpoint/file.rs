//! The file of a checkpoint.
//!
//! ```text
//! "tandem checkpoint 2\n"
//! length (u64), what made it and the length of what follows (JSON)
//! of the coupler, then of each solver that takes part (continuum, bodies):
//!     number of blocks (u64), then each: length (u64), LZ4 block of at most 16 MiB before packing
//! BLAKE3 of all bytes before (32 bytes)
//! ```
//!
//! All numbers are little-endian. The hash is checked first, so an incomplete file is detected before anything in it is
//! used.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use interface::files::{self, How, STATE, TABLE};
use interface::message::control::{PROTOCOL, Party};
use interface::message::wire::layout_hash;
use interface::saved;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::state::CouplerState;
use crate::record::Sealed;
use crate::record::log;
use crate::record::rundir::{CHECKPOINTS, COURSE, HISTORY, LOG, SCENE};
use crate::scene::Scene;

const MAGIC: &[u8] = b"tandem checkpoint 2\n";
/// Format of the coupler's own state.
const FORMAT: &str = "tandem-coupler 9";
const HASH: usize = 32;
/// Longest description of a checkpoint in bytes.
const ABOUT: u64 = 1 << 20;
/// Bytes of a block before it is compressed.
const BLOCK: usize = 16 << 20;

/// Beginning of what a run says that takes no checkpoints.
pub(crate) const CANNOT_RESUME: &str = "this run cannot be resumed";

/// Why the run in a directory takes no checkpoints, as its log has it.
fn cannot_resume(dir: &Path) -> Option<String> {
    let log = files::read_text(dir, LOG, TABLE).ok()?;
    let lines = log::parse(&log).0;
    let mut messages = lines.iter().map(log::Line::message);
    let said = messages.find(|message| message.starts_with(CANNOT_RESUME));
    said.map(str::to_owned)
}

/// The complete state of a run.
#[derive(Debug, Clone)]
pub(crate) struct Checkpoint {
    pub about: About,
    pub state: CouplerState,
    /// The state that each solver saved.
    pub solvers: Vec<(Party, Vec<u8>)>,
}

/// The description of a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// First step that is not done.
    pub step: u64,
    /// Simulated time in s.
    pub time: f64,
    /// The solvers that take part.
    pub solvers: Vec<Party>,
    /// Whether it is kept, for other scenes to begin with.
    pub kept: bool,
    /// The state with which the run itself began: `start.from` and `start.state` of its scene.
    pub start: Option<[String; 2]>,
    /// Length of the packed states in bytes.
    bytes: u64,
}

impl About {
    /// The description of a run of this program.
    pub fn of(scene: &Scene) -> Self {
        Self {
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            made_by: concat!("tandem ", env!("CARGO_PKG_VERSION")).to_owned(),
            protocol: PROTOCOL,
            layout: layout_hash(),
            step: 0,
            time: 0.0,
            solvers: scene.parties(),
            kept: false,
            start: scene.begins_with(),
            bytes: 0,
        }
    }

    /// The first difference that prevents a run like `ours` from continuing with this checkpoint.
    fn differs(&self, ours: &Self) -> Option<String> {
        let differs = |what: &str, theirs: &str, ours: &str| {
            (theirs != ours).then(|| format!("its {what} is {theirs}, here it is {ours}"))
        };
        let version = |(major, minor): (u32, u32)| format!("{major}.{minor}");
        let protocols = [self, ours].map(|about| version(about.protocol));
        let solvers = [self, ours].map(|about| format!("{:?}", about.solvers));
        differs("program", &self.made_by, &ours.made_by)
            .or_else(|| differs("protocol", &protocols[0], &protocols[1]))
            .or_else(|| differs("layout of records", &self.layout, &ours.layout))
            .or_else(|| differs("scene", &self.scene, &ours.scene))
            .or_else(|| differs("list of solvers", &solvers[0], &solvers[1]))
            .or_else(|| differs("scene hash", &self.scene_hash, &ours.scene_hash))
    }
}

/// A checkpoint cannot be used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The file cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// Where.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It is damaged.
    #[error("{path} is damaged: {what}")]
    Damaged {
        /// Where.
        path: PathBuf,
        /// In what way.
        what: String,
    },
    /// It belongs to another program, protocol or scene.
    #[error("{path} is not of this run: {what}")]
    Differs {
        /// Where.
        path: PathBuf,
        /// What differs.
        what: String,
    },
    /// A table was changed before the moment of the checkpoint.
    #[error("{} is not as the run has written it: {source}; `tandem resume --new-tables` puts it aside and begins a new one, `tandem run {}/{SCENE} --out OTHER` starts the run again", dir.join(table).display(), dir.display())]
    Changed {
        /// Of which run.
        dir: PathBuf,
        /// Its name.
        table: &'static str,
        /// Where it differs, or why it cannot be read.
        source: io::Error,
    },
    /// There is no checkpoint.
    #[error("{} has no checkpoint ({why})", dir.display())]
    None {
        /// Of which run.
        dir: PathBuf,
        /// Why it has none.
        why: String,
    },
    /// There is no checkpoint at that time or before.
    #[error("{dir} has no checkpoint of t = {time} s or before; it has those of {there}")]
    Later {
        /// Of which run.
        dir: PathBuf,
        /// In s.
        time: f64,
        /// The times of the checkpoints that exist.
        there: String,
    },
}

impl Checkpoint {
    /// Hash of the states of the solvers. It is the same for the same state, however it was reached.
    pub fn state_hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for (_, state) in &self.solvers {
            hasher.update(&(state.len() as u64).to_le_bytes());
            hasher.update(state);
        }
        hasher.finalize().to_hex().to_string()
    }
}

/// The bytes of a checkpoint.
pub(crate) fn write(checkpoint: &Checkpoint) -> Vec<u8> {
    let mut states = Vec::new();
    pack(&mut states, &saved::pack(FORMAT, &checkpoint.state));
    for (_, state) in &checkpoint.solvers {
        pack(&mut states, state);
    }
    let about = About {
        bytes: states.len() as u64,
        ..checkpoint.about.clone()
    };
    let about = serde_json::to_vec(&about).expect("no map with other keys than strings");
    let mut bytes = MAGIC.to_vec();
    number(&mut bytes, about.len());
    bytes.extend(about);
    bytes.extend(states);
    let hash = blake3::hash(&bytes);
    bytes.extend(hash.as_bytes());
    bytes
}

fn number(bytes: &mut Vec<u8>, number: usize) {
    bytes.extend((number as u64).to_le_bytes());
}

fn pack(bytes: &mut Vec<u8>, state: &[u8]) {
    number(bytes, state.len().div_ceil(BLOCK));
    for block in state.chunks(BLOCK) {
        let packed = lz4_flex::block::compress_prepend_size(block);
        number(bytes, packed.len());
        bytes.extend(packed);
    }
}

/// The checkpoint in `bytes`.
///
/// # Errors
/// What is wrong with the bytes.
pub(crate) fn read(bytes: &[u8]) -> Result<Checkpoint, String> {
    let Some(body) = bytes.len().checked_sub(HASH) else {
        return Err("it is too short".into());
    };
    let (body, hash) = bytes.split_at(body);
    after_magic(body)?;
    if blake3::hash(body).as_bytes() != hash {
        return Err("its hash is not that of its content".into());
    }
    let (about, mut rest) = description(body)?;
    let state = unpack(&mut rest)?;
    let state = saved::unpack(FORMAT, &state).map_err(|e| e.message)?;
    let mut solvers = Vec::new();
    for &party in &about.solvers {
        solvers.push((party, unpack(&mut rest)?));
    }
    if !rest.is_empty() {
        return Err(format!("{} bytes are left over", rest.len()));
    }
    Ok(Checkpoint {
        about,
        state,
        solvers,
    })
}

fn after_magic(bytes: &[u8]) -> Result<&[u8], String> {
    let rest = bytes.strip_prefix(MAGIC);
    rest.ok_or_else(|| "it does not begin like a checkpoint".into())
}

/// The description at the beginning of a checkpoint, and what follows.
fn description(bytes: &[u8]) -> Result<(About, &[u8]), String> {
    let mut rest = after_magic(bytes)?;
    let length = take_number(&mut rest)?;
    let about = serde_json::from_slice(take(&mut rest, length)?).map_err(|e| e.to_string())?;
    Ok((about, rest))
}

/// The state that each solver saved in the checkpoint in `bytes`.
///
/// # Errors
/// What is wrong with the bytes, in words.
pub fn solver_states(bytes: &[u8]) -> Result<Vec<(Party, Vec<u8>)>, String> {
    Ok(read(bytes)?.solvers)
}

fn take<'a>(rest: &mut &'a [u8], length: usize) -> Result<&'a [u8], String> {
    let Some((taken, left)) = rest.split_at_checked(length) else {
        return Err(format!(
            "{length} bytes are announced, {} follow",
            rest.len()
        ));
    };
    *rest = left;
    Ok(taken)
}

fn take_number(rest: &mut &[u8]) -> Result<usize, String> {
    let bytes = take(rest, 8)?;
    let number = u64::from_le_bytes(bytes.try_into().expect("eight bytes"));
    usize::try_from(number).map_err(|_| format!("a length of {number}"))
}

fn unpack(rest: &mut &[u8]) -> Result<Vec<u8>, String> {
    let blocks = take_number(rest)?;
    let mut state = Vec::new();
    for _ in 0..blocks {
        let length = take_number(rest)?;
        let block = lz4_flex::block::decompress_size_prepended(take(rest, length)?);
        state.extend(block.map_err(|e| e.to_string())?);
    }
    Ok(state)
}

/// Ending of the names of checkpoints that are kept.
const KEPT: &str = ".kept.tandem";

/// Name of the file in the run directory.
pub(crate) fn name(about: &About) -> String {
    let ending = if about.kept { KEPT } else { ".tandem" };
    format!("{CHECKPOINTS}/{:012}{ending}", about.step)
}

/// Whether a checkpoint is kept for other scenes.
pub(crate) fn is_kept(name: &str) -> bool {
    name.ends_with(KEPT)
}

/// The names of the checkpoints in a run directory, newest first.
pub(crate) fn list(dir: &Path) -> Vec<String> {
    let names = files::names(dir, CHECKPOINTS).unwrap_or_default();
    let ours = names.iter().rev().filter(|name| name.ends_with(".tandem"));
    ours.map(|name| format!("{CHECKPOINTS}/{name}")).collect()
}

/// Whether a run directory has a checkpoint.
pub fn is_in(dir: &Path) -> bool {
    !list(dir).is_empty()
}

/// The newest checkpoint of a run directory that can be used, its path, and the errors of newer ones.
pub(crate) type Found = (PathBuf, Checkpoint, Vec<CheckpointError>);

/// The newest good checkpoint in `dir` of a run like `ours`.
///
/// # Errors
/// [`CheckpointError`]: there is none, or it belongs to another run, program or protocol.
pub(crate) fn newest(dir: &Path, ours: &About) -> Result<Found, CheckpointError> {
    let mut passed_over = Vec::new();
    for name in list(dir) {
        match usable(dir, &name, ours) {
            Ok(checkpoint) => return Ok((dir.join(name), checkpoint, passed_over)),
            Err(error @ CheckpointError::Differs { .. }) => return Err(error),
            Err(error) => passed_over.push(error),
        }
    }
    Err(passed_over.into_iter().next().unwrap_or_else(|| none(dir)))
}

/// Compares the tables of a run directory with what they had at a checkpoint. With `new_tables` the checkpoint forgets a table
/// that was changed; what is said of those is returned.
///
/// # Errors
/// [`CheckpointError::Changed`].
pub(crate) fn unchanged(
    dir: &Path,
    checkpoint: &mut Checkpoint,
    new_tables: bool,
) -> Result<Vec<String>, CheckpointError> {
    let mut aside = Vec::new();
    let CouplerState {
        history, course, ..
    } = &mut checkpoint.state;
    for (table, sealed) in [(HISTORY, history), (COURSE, course)] {
        match sealed.compare(dir, table) {
            Ok(_) => {}
            Err(source) if new_tables => {
                aside.push(format!(
                    "{table} is not as the run has written it: {source}; it is put aside as {table}.changed"
                ));
                *sealed = Sealed::default();
            }
            Err(source) => {
                return Err(CheckpointError::Changed {
                    dir: dir.to_path_buf(),
                    table,
                    source,
                });
            }
        }
    }
    Ok(aside)
}

/// Reads a checkpoint of a run like `ours`.
fn usable(dir: &Path, name: &str, ours: &About) -> Result<Checkpoint, CheckpointError> {
    let checkpoint = open(dir, name)?;
    match checkpoint.about.differs(ours) {
        None => Ok(checkpoint),
        Some(what) => Err(CheckpointError::Differs {
            path: dir.join(name),
            what,
        }),
    }
}

/// Reads a checkpoint of a run directory.
fn open(dir: &Path, name: &str) -> Result<Checkpoint, CheckpointError> {
    // Another file, or one that was made longer, may be as long as a state: it is not read.
    let (_, written, file) = begin(dir, name)?;
    let there = file.metadata().map_err(unread(dir, name))?.len();
    if there != written {
        let what = format!("it has {there} bytes, and {written} were written");
        return Err(damaged(&dir.join(name), what));
    }
    let bytes = files::read(dir, name, STATE).map_err(unread(dir, name))?;
    read(&bytes).map_err(|what| damaged(&dir.join(name), what))
}

fn unread(dir: &Path, name: &str) -> impl FnOnce(io::Error) -> CheckpointError {
    let path = dir.join(name);
    move |source| CheckpointError::Read { path, source }
}

fn none(dir: &Path) -> CheckpointError {
    let no_reason = "its scene has no `output.checkpoint`, or it ended before the first one";
    CheckpointError::None {
        dir: dir.to_path_buf(),
        why: cannot_resume(dir).unwrap_or_else(|| no_reason.to_owned()),
    }
}

fn damaged(path: &Path, what: String) -> CheckpointError {
    let path = path.to_path_buf();
    CheckpointError::Damaged { path, what }
}

/// The description of a checkpoint, the length of its file as it was written, and the file: its states, which may be long, are
/// not read.
fn begin(dir: &Path, name: &str) -> Result<(About, u64, File), CheckpointError> {
    let mut begin = Vec::new();
    let first = MAGIC.len() as u64 + 8;
    let file = files::open(dir, name, How::Read).map_err(unread(dir, name))?;
    (&file)
        .take(first + ABOUT)
        .read_to_end(&mut begin)
        .map_err(unread(dir, name))?;
    let (about, rest) = description(&begin).map_err(|what| damaged(&dir.join(name), what))?;
    let before = (begin.len() - rest.len() + HASH) as u64;
    let written = before.saturating_add(about.bytes);
    Ok((about, written, file))
}

/// The last checkpoint in `dir` of a run like `ours` that is not after `time` (s), or the last one if there is no
/// `time`.
///
/// # Errors
/// [`CheckpointError`]: there is none, it is damaged, or it belongs to another run, program or protocol.
pub(crate) fn of_time(
    dir: &Path,
    ours: &About,
    time: Option<f64>,
) -> Result<Checkpoint, CheckpointError> {
    let mut there = Vec::new();
    for name in list(dir) {
        let at = begin(dir, &name)?.0.time;
        // A written time is rounded by at most this.
        if time.is_none_or(|time| at <= time * (1.0 + 1e-12)) {
            return usable(dir, &name, ours);
        }
        there.push(format!("{at} s"));
    }
    match time {
        Some(time) if !there.is_empty() => Err(CheckpointError::Later {
            dir: dir.to_path_buf(),
            time,
            there: there.join(", "),
        }),
        _ => Err(none(dir)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_come_back_whatever_their_length() {
        for length in [0, 1, 1000, BLOCK, BLOCK + 1] {
            let state: Vec<u8> = (0..length).map(|i| (i % 251) as u8).collect();
            let mut bytes = Vec::new();
            pack(&mut bytes, &state);
            let mut rest = &bytes[..];
            assert_eq!(unpack(&mut rest).unwrap(), state);
            assert!(rest.is_empty());
        }
    }

    #[test]
    fn a_file_that_is_damaged_or_no_checkpoint_is_refused() {
        let whole = |body: &[u8]| [body, blake3::hash(body).as_bytes()].concat();
        assert!(read(&[]).unwrap_err().contains("too short"));
        assert!(read(&[7; 100]).unwrap_err().contains("does not begin"));
        let torn = [MAGIC, &[0; 40][..]].concat();
        assert!(read(&torn).unwrap_err().contains("hash"));
        // The correct hash of a body that is too short.
        assert!(
            read(&whole(MAGIC))
                .unwrap_err()
                .contains("8 bytes are announced")
        );
    }
}
