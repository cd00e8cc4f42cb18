//! The file of a checkpoint, one of [`packed`] that is named `TANDEMC3`. Its content:
//!
//! ```text
//! of the coupler, then of each solver that takes part (continuum, bodies): length (u64) and bytes of its state
//! ```
//!
//! The description ([`About`]) has the hash of the content as it is packed. It is checked first, so an incomplete file is
//! detected before anything in it is used.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use interface::files::{self, How, STATE, TABLE};
use interface::message::control::Party;
use interface::packed::{self, BlockSize, Made, exactly};
use interface::saved;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::state::CouplerState;
use crate::record::log;
use crate::record::rundir::{CHECKPOINTS, COURSE, HISTORY, LOG, SCENE, aside};
use crate::record::{FileError, Sealed, fail};
use crate::scene::Scene;

const NAME: [u8; 8] = *b"TANDEMC3";
/// Format of the coupler's own state.
const FORMAT: &str = "tandem-coupler 10";

/// Beginning of what a run says that takes no checkpoints.
pub(crate) const CANNOT_RESUME: &str = "this run cannot be resumed";

/// Why the run in a directory takes no checkpoints, as its log has it.
fn cannot_resume(dir: &Path) -> Option<String> {
    let log = files::read_text(dir, LOG, TABLE).ok()?;
    let lines = log::parse(&log).0;
    let mut messages = lines.iter().map(log::Line::message);
    let message = messages.find(|message| message.starts_with(CANNOT_RESUME));
    message.map(str::to_owned)
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
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
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
    /// BLAKE3 of these, in hexadecimal digits.
    hash: String,
}

impl About {
    /// The description of a run of this program.
    pub fn of(scene: &Scene) -> Self {
        Self {
            made: Made::of(&scene.name, &scene.hash),
            step: 0,
            time: 0.0,
            solvers: scene.parties(),
            kept: false,
            start: scene.begins_with(),
            bytes: 0,
            hash: String::new(),
        }
    }

    /// The first difference that prevents a run like `ours` from continuing with this checkpoint.
    fn differs(&self, ours: &Self) -> Option<String> {
        let differs = |what: &str, theirs: &str, ours: &str| {
            (theirs != ours).then(|| format!("its {what} is {theirs}, here it is {ours}"))
        };
        let version = |(major, minor): (u32, u32)| format!("{major}.{minor}");
        let protocols = [self, ours].map(|about| version(about.made.protocol));
        let solvers = [self, ours].map(|about| format!("{:?}", about.solvers));
        let (made, here) = (&self.made, &ours.made);
        differs("program", &made.made_by, &here.made_by)
            .or_else(|| differs("protocol", &protocols[0], &protocols[1]))
            .or_else(|| differs("layout of records", &made.layout, &here.layout))
            .or_else(|| differs("scene", &made.scene, &here.scene))
            .or_else(|| differs("list of solvers", &solvers[0], &solvers[1]))
            .or_else(|| differs("scene hash", &made.scene_hash, &here.scene_hash))
    }
}

/// A path as a shell takes it, for commands that people paste.
pub fn as_word(path: &Path) -> String {
    let word = path.to_string_lossy();
    let quoted = shlex::try_quote(&word).expect("a path has no zero byte");
    quoted.into_owned()
}

/// A checkpoint cannot be used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] FileError),
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
    #[error("{} is not as the run has written it: {source}; `tandem resume --new-tables` puts it aside and begins a new one, `tandem run {} --out OTHER` starts the run again", dir.join(table).display(), as_word(&dir.join(SCENE)))]
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
    let own = saved::pack(FORMAT, &checkpoint.state);
    let solvers = checkpoint.solvers.iter().map(|(_, state)| state);
    let mut packer = packed::packer(Vec::new(), BlockSize::Max4MB);
    for state in std::iter::once(&own).chain(solvers) {
        let length = (state.len() as u64).to_le_bytes();
        let written = packer.write_all(&length);
        written
            .and_then(|()| packer.write_all(state))
            .expect("memory takes what is written");
    }
    let states = packer.finish().expect("memory takes what is written");
    let about = About {
        bytes: states.len() as u64,
        hash: blake3::hash(&states).to_string(),
        ..checkpoint.about.clone()
    };
    let mut bytes = packed::head(NAME, &about);
    bytes.extend(states);
    bytes
}

/// The checkpoint in `bytes`.
///
/// # Errors
/// What is wrong with the bytes.
pub(crate) fn read(mut bytes: &[u8]) -> Result<Checkpoint, String> {
    let head = packed::read_head::<About>(&mut bytes, NAME);
    let (about, _) = head.map_err(|e| e.to_string())?;
    if blake3::hash(bytes).to_string() != about.hash {
        return Err("its hash is not that of its content".into());
    }
    let mut states = packed::unpacker(bytes);
    let mut next = || {
        let mut length = [0; 8];
        let read = states.read_exact(&mut length);
        let state = read.and_then(|()| exactly(&mut states, u64::from_le_bytes(length)));
        state.map_err(|e| format!("a state that is not whole: {e}"))
    };
    let state = saved::unpack(FORMAT, &next()?).map_err(|e| e.message)?;
    let solvers = about.solvers.iter().map(|&party| Ok((party, next()?)));
    Ok(Checkpoint {
        solvers: solvers.collect::<Result<_, String>>()?,
        about,
        state,
    })
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
/// that was changed; the messages about those are returned.
///
/// # Errors
/// [`CheckpointError::Changed`].
pub(crate) fn unchanged(
    dir: &Path,
    checkpoint: &mut Checkpoint,
    new_tables: bool,
) -> Result<Vec<String>, CheckpointError> {
    let mut told = Vec::new();
    let CouplerState {
        history, course, ..
    } = &mut checkpoint.state;
    for (table, sealed) in [(HISTORY, history), (COURSE, course)] {
        match sealed.compare(dir, table) {
            Ok(_) => {}
            Err(source) if new_tables => {
                told.push(format!(
                    "{table} is not as the run has written it: {source}; it is put aside as {}",
                    aside(dir, table)
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
    Ok(told)
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
    let path = dir.join(name);
    let there = file.metadata().map_err(fail("read", &path))?.len();
    if there != written {
        let what = format!("it has {there} bytes, and {written} were written");
        return Err(CheckpointError::Damaged { path, what });
    }
    let bytes = files::read(dir, name, STATE).map_err(fail("read", &path))?;
    read(&bytes).map_err(|what| CheckpointError::Damaged { path, what })
}

fn none(dir: &Path) -> CheckpointError {
    let no_reason = "its scene has no `output.checkpoint`, or it ended before the first one";
    CheckpointError::None {
        dir: dir.to_path_buf(),
        why: cannot_resume(dir).unwrap_or_else(|| no_reason.to_owned()),
    }
}

/// The description of a checkpoint, the length of its file as it was written, and the file: its states, which may be long, are
/// not read.
fn begin(dir: &Path, name: &str) -> Result<(About, u64, File), CheckpointError> {
    let path = dir.join(name);
    let mut file = files::open(dir, name, How::Read).map_err(fail("read", &path))?;
    match packed::read_head::<About>(&mut file, NAME) {
        Ok((about, length)) => {
            let written = length.saturating_add(about.bytes);
            Ok((about, written, file))
        }
        Err(error) if error.kind() == ErrorKind::InvalidData => Err(CheckpointError::Damaged {
            path,
            what: error.to_string(),
        }),
        Err(error) => Err(fail("read", &path)(error).into()),
    }
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
    fn a_file_that_is_damaged_or_no_checkpoint_is_refused() {
        assert!(read(&[]).unwrap_err().contains("too short"));
        assert!(read(&[7; 100]).unwrap_err().contains("does not begin"));
        let scene = include_str!("../../../../scenes/jiang2020/collision_hard.toml");
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("scene.toml");
        std::fs::write(&path, scene).unwrap();
        let about = About::of(&Scene::load(&path, None, &[]).unwrap());
        let with = |states: &[u8], hash: &[u8]| {
            let about = About {
                hash: blake3::hash(hash).to_string(),
                ..about.clone()
            };
            read(&[&packed::head(NAME, &about), states].concat()).unwrap_err()
        };
        assert!(with(b"states", b"others").contains("hash"));
        // The correct hash of what is no frame, and of one that is too short.
        assert!(with(b"states", b"states").contains("not whole"));
        let none = packed::packer(Vec::new(), BlockSize::Max4MB)
            .finish()
            .unwrap();
        assert!(with(&none, &none).contains("not whole"));
    }
}
