//! A coupled run from scene to summary.
//!
//! | file | what is in it |
//! | --- | --- |
//! | [`options`] | how a scene is run |
//! | [`stability`], [`pace`] | the composed step limit, and the plan of steps between outputs |
//! | [`launch`], `supervise`, [`failure`] | solvers as processes, the decisions of a run, the reasons why a run ended early |
//! | [`resources`] | the shared memory and open files that a run needs |
//! | `account` | the accumulated results of a run |
//! | `disk`, `pause` | waiting for a slow disk, and for a solver that is stopped |
//! | [`checkpoint`], [`killed`] | the state of a run on disk, and a run whose coupler was killed |

mod account;
pub mod checkpoint;
mod course;
mod disk;
pub mod estimate;
pub mod failure;
pub mod killed;
pub mod launch;
pub mod options;
pub mod pace;
mod pause;
pub mod resources;
pub mod stability;
mod supervise;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use interface::files::{self, How};
use interface::hosted::Host;
use interface::message::control::Party;
use interface::message::{Channel, Kind};
use interface::recording::{About, Recorder, Tap};
use interface::session::together::Together;
use interface::session::{Session, SessionError, Supervisor, drive};
use interface::solver::{DemSolver, MpmSolver};
use interface::trace;
use interface::transport::domain::OwnedDomain;
use interface::transport::iceoryx::{self, SEND_TIMEOUT};

use crate::record::rundir::{RECORDING, RunDir, RunDirError};
use crate::record::summary::Summary;
use crate::run::account::Account;
use crate::run::checkpoint::branch::Branch;
use crate::run::checkpoint::file::{self, CheckpointError, newest};
use crate::run::checkpoint::{Checkpoint, Origin};
use crate::run::disk::Disk;
use crate::run::failure::RunError;
pub use crate::run::options::{RunOptions, Solvers};
use crate::run::resources::SharedMemory;
use crate::run::supervise::Run;
use crate::scene::Scene;
use crate::scene::diagnostic::SceneErrors;

/// The result of a run.
#[derive(Debug)]
pub struct Finished {
    /// The content of `summary.json`.
    pub summary: Summary,
    /// Path of its files: the run directory, or a folder in it if the run failed to start beside the result of another
    /// one.
    pub place: PathBuf,
    /// Why `summary.json` could not be written.
    pub unwritten: Option<RunDirError>,
    /// That a solver does not take the scene. A new run that is refused leaves no files.
    pub refused: Option<SceneErrors>,
}

/// Runs `scene` and writes the results to `dir`. With `branch` it begins with the state of another run. A run that
/// fails has a summary too, with status and reason.
pub fn run(scene: &Scene, options: &RunOptions, dir: &RunDir, branch: Option<Branch>) -> Finished {
    let from = branch.map_or(Origin::Scene, |branch| Origin::Another(branch.into()));
    run_from(scene, options, dir, from)
}

/// A run that continues from the newest usable checkpoint of its directory.
#[derive(Debug)]
pub struct Resumed {
    /// Path of the checkpoint.
    pub path: PathBuf,
    checkpoint: Checkpoint,
    /// The errors of newer checkpoints.
    pub passed_over: Vec<CheckpointError>,
    /// The tables that are put aside, with the reasons.
    pub aside: Vec<String>,
}

impl Resumed {
    /// Finds the newest usable checkpoint of `scene` in `dir`. With `new_tables`, a table that was changed before it does not
    /// stand in the way: the run puts it aside and begins a new one.
    ///
    /// # Errors
    /// [`CheckpointError`].
    pub fn find(scene: &Scene, dir: &RunDir, new_tables: bool) -> Result<Self, CheckpointError> {
        let (path, mut checkpoint, passed_over) = newest(dir.path(), &file::About::of(scene))?;
        let aside = file::unchanged(dir.path(), &mut checkpoint, new_tables)?;
        Ok(Self {
            path,
            checkpoint,
            passed_over,
            aside,
        })
    }

    /// The description of the checkpoint.
    pub fn about(&self) -> &file::About {
        &self.checkpoint.about
    }

    /// Continues the run.
    pub fn run(self, scene: &Scene, options: &RunOptions, dir: &RunDir) -> Finished {
        run_from(scene, options, dir, Origin::Itself(self.checkpoint.into()))
    }
}

fn run_from(scene: &Scene, options: &RunOptions, dir: &RunDir, from: Origin) -> Finished {
    let shared_thread = matches!(options.solvers, Solvers::InProcess { .. });
    let mut account = Account::new(scene, shared_thread);
    let is_new = !matches!(from, Origin::Itself(_));
    let ended = recorder(scene, options, dir, &from).and_then(|recorder| {
        let ended = Run::new(scene, options, dir, &mut account, from).and_then(|mut run| {
            run.outputs.sink = recorder.as_ref().map(Recorder::sink);
            let outcome = match &options.solvers {
                Solvers::Processes { mpm, dem } => {
                    let commands = BTreeMap::from([(Party::Mpm, mpm), (Party::Dem, dem)]);
                    processes(&mut run, &commands)
                }
                Solvers::InProcess { mpm, dem } => in_process(&mut run, *mpm, *dem),
            };
            run.end(outcome)
        });
        let recorded = recorder.map_or(Ok(()), Recorder::finish);
        ended.and_then(|()| Ok(recorded.map_err(SessionError::from)?))
    });
    let refused = ended.as_ref().err().and_then(|error| error.refusal(scene));
    let summary = account.summarise(&ended);
    dir.leave_summary(None);
    if refused.is_some() && is_new {
        dir.discard();
        return Finished {
            summary,
            place: dir.path().to_path_buf(),
            unwritten: None,
            refused,
        };
    }
    let written = dir.write_summary(&summary);
    let (place, settled) = match dir.settle() {
        Ok(place) => (place, Ok(())),
        Err(error) => (dir.path().to_path_buf(), Err(error)),
    };
    Finished {
        summary,
        place,
        unwritten: written.and(settled).err(),
        refused,
    }
}

/// The recording of a run that begins, if it is to have one.
fn recorder(
    scene: &Scene,
    options: &RunOptions,
    dir: &RunDir,
    from: &Origin,
) -> Result<Option<Recorder>, RunError> {
    if matches!(from, Origin::Itself(_)) && files::is_there(dir.path(), RECORDING) {
        tracing::warn!(
            "the run continues without its recording, which ends where the run was cut short"
        );
    }
    if !options.record {
        return Ok(None);
    }
    let about = About::run(&scene.name, &scene.hash);
    let (file, path) = dir.open(RECORDING, How::Replace)?;
    let recorder = Recorder::create(file, &path, &about).map_err(SessionError::from)?;
    Ok(Some(recorder))
}

/// Whether a channel is recorded: all are except saved states, which would be most of the file.
fn noted(channel: Channel) -> bool {
    channel.kind != Kind::Saved
}

/// Runs the session with the solvers in separate processes.
fn processes(run: &mut Run<'_>, commands: &BTreeMap<Party, &Vec<String>>) -> Result<(), RunError> {
    let parties = run.parties().to_vec();
    let sink = run.outputs.sink.clone();
    // Values are dropped in reverse order: first the ports, then the channels, then the directory.
    let domain = OwnedDomain::create().map_err(|e| SessionError::Channel(e.into()))?;
    let names = domain.domain();
    run.resources.disk = Disk::of(names.clone(), run.start_deadline());
    let with_cause =
        |error: SessionError, memory: &SharedMemory| match resources::cause(&error, memory) {
            Some(cause) => RunError::SharedMemory { error, cause },
            None => RunError::from(error),
        };
    let channels = iceoryx::create(names, &parties, sink.is_some())
        .map_err(|error| with_cause(error.into(), &SharedMemory::of(names, None)))?;
    let memory = SharedMemory::of(names, Some(&channels));
    run.resources.shared_memory = Some(memory.clone());
    let caused = |error| with_cause(error, &memory);
    let ends = iceoryx::join(names, Party::Coupler, &parties, SEND_TIMEOUT)
        .map_err(|error| caused(error.into()))?;
    let mut tap = match &sink {
        Some(sink) if parties.len() == 2 => {
            let tap = Tap::open(names, sink.clone());
            Some(tap.map_err(|error| caused(error.into()))?)
        }
        _ => None,
    };
    if let Some(path) = &run.options.trace
        && let Err(e) = names.note_trace(path)
    {
        tracing::warn!("no timeline in {}: {e}", path.display());
    }
    let mut start = |&party: &Party| {
        let processes = &mut run.resources.processes;
        processes.start(party, commands[&party], names)
    };
    let mut verdict = parties
        .iter()
        .try_for_each(&mut start)
        .map_err(RunError::from);
    let mut open = None;
    if verdict.is_ok() {
        let session = Session::coupler(&parties, &mut *run, ends);
        open = Some(session.ends());
        let session = session.recorded(sink.as_ref(), noted);
        verdict = drive(session.traced(names, Party::Coupler)).map_err(caused);
    }
    // The messages that are still in the channels between the solvers are recorded before their senders end (D-2).
    tap.take();
    if verdict.is_err() {
        // A solver that had not opened its channels missed the Abort (S-7), so it checks whether the coupler lives.
        domain.release();
    }
    run.resources.processes.end_all();
    drop(open); // what was sent is there until the solvers have ended
    if let Some(path) = &run.options.trace
        && let Err(e) = trace::end(path)
    {
        tracing::warn!("the timeline has no end: {e}");
    }
    verdict
}

/// Runs the session with the solvers in this thread.
fn in_process(
    run: &mut Run<'_>,
    mpm: fn() -> Box<dyn MpmSolver>,
    dem: fn() -> Box<dyn DemSolver>,
) -> Result<(), RunError> {
    let parties = run.parties().to_vec();
    let sink = run.outputs.sink.clone();
    let hosts = parties.iter().map(|party| match party {
        Party::Mpm => Host::Mpm(mpm()),
        _ => Host::Dem(dem()),
    });
    let mut together = Together::of(run, hosts);
    // Each message is recorded once: the coupler records its own, and the continuum those between the solvers.
    together.coupler = together.coupler.recorded(sink.as_ref(), noted);
    let between = Channel::is_between_solvers;
    together.mpm = together.mpm.map(|mpm| mpm.recorded(sink.as_ref(), between));
    match catch_unwind(AssertUnwindSafe(|| together.run())) {
        Ok([coupler, ..]) => Ok(coupler?),
        Err(panic) => {
            let words = panic.downcast_ref::<String>().cloned();
            Err(RunError::Panicked(words.unwrap_or_default()))
        }
    }
}
