//! The resources that a run needs besides memory: space in shared memory, and open files. They are checked before the
//! run begins, and named if a lack of them causes another error.

use std::collections::BTreeMap;
use std::fmt::{self, Display};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use interface::config::{BodyConfig, DemConfig, Motion, polygon};
use interface::files::{self, SMALL};
use interface::message::wire::PointState;
use interface::session::SessionError;
use interface::transport::domain::Domain;
use interface::transport::iceoryx::Created;
use interface::transport::wait::until;
use rustix::fs::statvfs;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use thiserror::Error;

use crate::scene::Scene;

/// The directory in which channels are.
const SHARED_MEMORY: &str = "/dev/shm";
/// Bytes that the channels of a run need before any message was sent; measured.
const CHANNELS: u64 = 1 << 20;
/// Largest number of bytes for pieces of saved states: two pieces of 1 MiB for each solver.
const SAVED: u64 = 4 << 20;
/// Largest number of open files of a process of a run; measured, with a margin.
const FILES: u64 = 256;
/// If less than this is free, shared memory counts as full.
const FULL: u64 = 256 << 10;

/// Least memory in bytes that the solver takes for a point, and for a cell with points; measured, of the simplest material.
const POINT: f64 = 200.0;
const CELL: f64 = 200.0;
/// The same for a body, and for two bodies whose boxes overlap.
const BODY: f64 = 1500.0;
const PAIR: f64 = 100.0;
/// Address space in bytes that every process of a run needs for its program, its threads and its channels; measured, with
/// a margin.
const ADDRESSES: u64 = 512 << 20;

/// The machine lacks a resource that a run needs, and what the user can do about it.
#[derive(Debug, Error)]
pub enum ResourceError {
    /// Memory is too small.
    #[error("about {what} need at least {about} of memory, and {free} can be had (use larger cells or a wider spacing of \
             points (it may be meant along the other axis), and do not put bodies in one place)", about = Bytes(*.needed), free = Bytes(*.free))]
    Memory {
        /// Numbers of points, or of bodies and their pairs.
        what: String,
        /// In bytes.
        needed: u64,
        /// In bytes.
        free: u64,
    },
    /// The address space is too small for any run.
    #[error("the system allows {} of address space, and each process needs {} (raise the limit (`ulimit -v unlimited`))", Bytes(*.0), Bytes(ADDRESSES))]
    Addresses(u64),
    /// Shared memory is too small.
    #[error("the run needs about {about} of shared memory, and /dev/shm has {free} free (make it larger \
             (`mount -o remount,size=1G /dev/shm`; `--shm-size` of a container), remove what is in it, or run with \
             --in-process)", about = Bytes(*.needed), free = Bytes(*.free))]
    SharedMemory {
        /// In bytes.
        needed: u64,
        /// In bytes.
        free: u64,
    },
    /// Files may not be as long as the run needs in shared memory.
    #[error("the system allows files of {free} at most, and shared memory needs files of {about} (the \
             system limits the size of files: raise the limit (`ulimit -f`), or run with --in-process)", free = Bytes(*.allowed), about = Bytes(*.needed))]
    FileSize {
        /// In bytes.
        needed: u64,
        /// In bytes.
        allowed: u64,
    },
    /// Too few files may be open.
    #[error("too many open files: each process of the run needs up to {needs}, and the system allows {0} (raise the \
             limit (`ulimit -n 1024`), or run with --in-process)", needs = FILES)]
    Files(u64),
}

/// A number of bytes, formatted for people: `4.9 MiB`.
#[derive(Debug, Clone, Copy)]
pub struct Bytes(pub u64);

impl Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = [("GiB", 1_u64 << 30), ("MiB", 1 << 20), ("KiB", 1 << 10)];
        match units.iter().find(|(_, size)| self.0 >= *size) {
            Some((unit, size)) => write!(f, "{:.1} {unit}", self.0 as f64 / *size as f64),
            None => write!(f, "{} B", self.0),
        }
    }
}

/// Estimate of the shared memory in bytes that a run of this scene needs.
pub fn needed(scene: &Scene) -> u64 {
    // All points are sent at the end, in one of two buffers. Numbers that are too large become the largest.
    let cloud = (scene.points_estimate().ceil() * size_of::<PointState>() as f64) as u64;
    let saved = scene
        .output
        .checkpoint
        .as_ref()
        .map_or(0, |_| SAVED.min(cloud.saturating_mul(8)));
    cloud.saturating_mul(2).saturating_add(CHANNELS + saved)
}

/// Checks whether this process, and those that it starts, can have the memory that they need for any scene.
///
/// # Errors
/// [`ResourceError`].
pub fn check_addresses() -> Result<(), ResourceError> {
    match getrlimit(Resource::As).current {
        Some(allowed) if allowed < ADDRESSES => Err(ResourceError::Addresses(allowed)),
        _ => Ok(()),
    }
}

/// The least number of pairs of bodies whose boxes overlap: those of about one size whose centres are in one square of
/// that size.
fn pairs(dem: &DemConfig) -> f64 {
    let mut squares = BTreeMap::<_, f64>::new();
    let moves = |body: &&BodyConfig| body.motion == Motion::Free;
    for body in dem.bodies.iter().filter(moves) {
        let [lower, upper] = polygon::bounds(&body.placed());
        let half = (upper[0] - lower[0]).min(upper[1] - lower[1]) / 2.0 + body.sphero_radius;
        let size = half.log2().floor();
        let centre = [0, 1].map(|axis| lower[axis].midpoint(upper[axis]));
        let square = centre.map(|along| (along / size.exp2()).floor().to_bits());
        *squares.entry((size.to_bits(), square)).or_default() += 1.0;
    }
    let each = squares.values().map(|count| count * (count - 1.0) / 2.0);
    each.sum()
}

/// Checks whether the machine has the memory for the points and bodies of this scene, before any is taken.
///
/// # Errors
/// [`ResourceError`].
pub fn check_memory(scene: &Scene) -> Result<(), ResourceError> {
    let (points, cells) = (scene.points_estimate(), scene.cells_estimate());
    let bodies = scene.dem.as_ref().map_or(0, |dem| dem.bodies.len());
    let touching = scene.dem.as_ref().filter(|dem| dem.body_contact.is_some());
    let pairs = touching.map_or(0.0, pairs);
    let of_points = points * POINT + cells * CELL;
    let of_bodies = bodies as f64 * BODY + pairs * PAIR;
    let needed = (of_points + of_bodies) as u64;
    let allowed = getrlimit(Resource::As).current;
    let free = free_main_memory().into_iter().chain(allowed).min();
    match free {
        Some(free) if free < needed => Err(ResourceError::Memory {
            what: if of_points > of_bodies {
                format!("{points:.2e} points")
            } else {
                format!("{bodies} bodies, of which {pairs:.2e} pairs lie on one another,")
            },
            needed,
            free,
        }),
        _ => Ok(()),
    }
}

/// Bytes of memory that can be had without that others lose theirs, if the system reports them.
fn free_main_memory() -> Option<u64> {
    let text = files::read_named_text(Path::new("/proc/meminfo"), SMALL).ok()?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kib << 10)
}

/// Free bytes of shared memory, if the system reports them.
pub fn free_memory() -> Option<u64> {
    let found = statvfs(SHARED_MEMORY).ok()?;
    Some(found.f_bavail.saturating_mul(found.f_frsize))
}

/// One line: the shared memory that a run of this scene needs, and how much is free.
pub fn in_words(scene: &Scene) -> String {
    let free = free_memory().map_or_else(|| "unknown".to_owned(), |free| Bytes(free).to_string());
    format!(
        "about {} ({free} free in {SHARED_MEMORY})",
        Bytes(needed(scene))
    )
}

/// Checks whether the machine has the resources for a run of this scene with solvers in processes. Raises the limit of
/// open files as far as the system allows.
///
/// # Errors
/// [`ResourceError`].
pub fn check(scene: &Scene) -> Result<(), ResourceError> {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if current.is_some_and(|current| current < FILES) {
        let raised = Rlimit {
            current: maximum,
            maximum,
        };
        let _ = setrlimit(Resource::Nofile, raised);
    }
    match getrlimit(Resource::Nofile).current {
        Some(current) if current < FILES => return Err(ResourceError::Files(current)),
        _ => {}
    }
    let needed = needed(scene);
    match getrlimit(Resource::Fsize).current {
        Some(allowed) if allowed < needed => {
            return Err(ResourceError::FileSize { needed, allowed });
        }
        _ => {}
    }
    match free_memory() {
        Some(free) if free < needed => Err(ResourceError::SharedMemory { needed, free }),
        _ => Ok(()),
    }
}

/// Time between two looks at shared memory while solvers join.
const LOOK: Duration = Duration::from_millis(250);

/// Time in which all files of a run are removed, once somebody has begun to remove them.
const MOMENT: Duration = Duration::from_millis(100);

/// The message for removed files.
pub const REMOVED: &str = "somebody has removed the run's files from shared memory (systemd does so when a user logs out: \
                           `RemoveIPC=no` in logind.conf, or `loginctl enable-linger`)";

/// The segments of a run in shared memory.
#[derive(Clone)]
pub struct SharedMemory {
    domain: Domain,
    /// The segments that existed after the channels had been created.
    found: Vec<PathBuf>,
    /// Whether there was one for each channel.
    complete: bool,
    looked: Option<Instant>,
}

impl SharedMemory {
    /// That of a run; `channels` have just been created, if there are any yet.
    pub fn of(domain: &Domain, channels: Option<&Created>) -> Self {
        Self {
            domain: domain.clone(),
            found: channels.map_or_else(Vec::new, |_| domain.segments()),
            complete: channels.is_none_or(|channels| channels.are_there(domain)),
            looked: None,
        }
    }

    /// Whether a segment has been removed.
    fn lacks_one(&self) -> bool {
        !(self.complete && self.domain.is_intact(&self.found))
    }

    /// Looks from time to time; returns whether a file was removed that a solver may still have to open. No error would
    /// show this: messages are sent, and the solver waits for them.
    pub fn is_lost(&mut self) -> bool {
        if self.looked.is_some_and(|at| at.elapsed() < LOOK) {
            return false;
        }
        self.looked = Some(Instant::now());
        self.lacks_one()
    }
}

/// What happened to shared memory, if it may be the cause of this end of a session.
pub fn cause(error: &SessionError, memory: &SharedMemory) -> Option<String> {
    if !may_be_of_memory(error) {
        return None;
    }
    // The removal may still be in progress, because the first missing file can end a run.
    let is_gone = || memory.lacks_one().then_some(());
    if until(MOMENT, MOMENT, is_gone).is_some() {
        return Some(REMOVED.to_owned());
    }
    let free = free_memory()?;
    let full = free < FULL || is_bus_error(error);
    full.then(|| format!("{SHARED_MEMORY} is full: {} are free", Bytes(free)))
}

/// Whether a process has used shared memory for which there was no space.
fn is_bus_error(error: &SessionError) -> bool {
    matches!(error, SessionError::Vanished { how, .. } if how == "was killed by signal 7")
}

/// Whether a session can end in this way because its files in shared memory are missing or have no space. A solver that
/// was killed by somebody, that refused its configuration, or that reported its own fault has another reason.
fn may_be_of_memory(error: &SessionError) -> bool {
    match error {
        SessionError::Vanished { how, .. } => {
            !how.starts_with("was killed by signal") || is_bus_error(error)
        }
        SessionError::Failed { failure, .. } => failure.fault.is_none(),
        SessionError::Channel(_)
        | SessionError::Contract { .. }
        | SessionError::Late { .. }
        | SessionError::CouplerGone { .. } => true,
        SessionError::Recording(_)
        | SessionError::Aborted(_)
        | SessionError::Fault { .. }
        | SessionError::Refused { .. } => false,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use interface::message::control::{Failure, Party};
    use interface::solver::Refusal;
    use interface::transport::domain::OwnedDomain;

    use super::*;

    fn vanished(how: &str) -> SessionError {
        SessionError::Vanished {
            who: Party::Dem,
            how: how.into(),
            step: 3,
        }
    }

    /// D3: the message named clause K-3, "ended with exit status 3" or another consequence instead.
    #[test]
    fn removed_files_are_the_cause_of_whatever_they_may_cause() {
        let owned = OwnedDomain::create().unwrap();
        let contract = SessionError::Contract {
            who: Party::Mpm,
            clause: "K-3",
            step: 1,
            message: "no answer".into(),
        };
        let failed = SessionError::Failed {
            who: Party::Mpm,
            failure: Failure {
                step: 1,
                message: "a channel cannot be opened".into(),
                fault: None,
            },
        };
        let of_memory = [vanished("ended with exit status 3"), contract, failed];
        let refused = SessionError::Refused {
            who: Party::Dem,
            refusal: Refusal::new("dem.body", "overlap"),
        };
        let others = [vanished("was killed by signal 9"), refused];
        let none = SharedMemory::of(owned.domain(), None);
        for error in &of_memory {
            assert_eq!(cause(error, &none), None, "{error}");
        }
        fs::remove_dir_all(owned.domain().directory()).unwrap();
        for error in &of_memory {
            let found = cause(error, &none);
            assert!(
                found.is_some_and(|cause| cause.contains("removed")),
                "{error}"
            );
        }
        for error in &others {
            assert_eq!(cause(error, &none), None, "{error}");
        }
    }
}
