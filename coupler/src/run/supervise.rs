//! A run that is in progress, and what its session asks it to decide: the configuration of each solver (`configure`), the next
//! steps (`steps`, `checkpoints`), and what is recorded of the reports (`reports`, `outputs`).

mod checkpoints;
mod configure;
mod outputs;
mod reports;
mod steps;

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use interface::config::capability::STRESS_WORK;
use interface::message::control::{Hello, Party};
use interface::message::wire::flags;
use interface::session::{self, Next, Part, SessionError, Stop, Supervisor};

use self::outputs::Outputs;
use self::reports::Latest;
use self::steps::Schedule;
use crate::record::background::Mark;
use crate::record::rundir::{RunDir, RunDirError};
use crate::run::account::Account;
use crate::run::checkpoint::writer::CheckpointWriter;
use crate::run::checkpoint::{Checkpoint, CouplerState, Origin, Phase};
use crate::run::disk::Disk;
use crate::run::failure::RunError;
use crate::run::launch::Processes;
use crate::run::options::{RunOptions, Solvers};
use crate::run::pause::Pauses;
use crate::run::resources::{REMOVED, SharedMemory};
use crate::run::stability::Stability;
use crate::scene::Scene;

/// After an interrupt, longest wait for a solver's next message, a report, a piece of its state or its goodbye, beside
/// the time of four steps. With what follows a run ends within 8 s.
const ANSWER: Duration = Duration::from_secs(5);
/// That the run did not wait for its solvers, and that a second interrupt has come.
const ALONE: &str = "without the end of the solvers";
const TWICE: &str = "it was asked twice";

/// A run in progress.
pub(crate) struct Run<'a> {
    scene: &'a Scene,
    pub(crate) options: &'a RunOptions,
    account: &'a mut Account,
    dir: &'a RunDir,
    parties: Vec<Party>,
    pub(crate) resources: Resources,
    pub(crate) outputs: Outputs,
    checkpoints: Checkpoints,
    schedule: Schedule,
    latest: Latest,
    stability: Option<Stability>,
    /// The saved states with which the solvers begin.
    restored: Vec<(Party, Vec<u8>)>,
    failure: Option<RunError>,
}

/// The external causes that can stop or delay a run.
pub(crate) struct Resources {
    /// The solvers that are processes.
    pub processes: Processes,
    /// Solvers that are alive and do not run.
    pauses: Pauses,
    /// The disk that the run may have to wait for.
    pub disk: Disk,
    /// The shared memory through which the solvers join.
    pub shared_memory: Option<SharedMemory>,
    /// When a wait first heard that the run is to end.
    heard: Option<Instant>,
    /// When a summary was kept last for the case that shared memory vanishes.
    left: Option<Instant>,
}

/// The checkpoints of a run.
#[derive(Default)]
struct Checkpoints {
    /// Writes them, if all solvers can save.
    writer: Option<CheckpointWriter>,
    /// The coupler's own state at a checkpoint whose window is in progress.
    pending: Option<(CouplerState, Vec<Mark>)>,
    /// Whether that checkpoint is kept for other scenes.
    kept: bool,
    /// Whether an interrupted run has asked for its last checkpoint.
    last_asked: bool,
}

impl<'a> Run<'a> {
    /// A run that begins with its scene, or with the state of a checkpoint: its own, or that of another run.
    pub(crate) fn new(
        scene: &'a Scene,
        options: &'a RunOptions,
        dir: &'a RunDir,
        account: &'a mut Account,
        from: Origin,
    ) -> Result<Self, RunError> {
        // Of another run's state: whether the scene continues as that run would.
        let (checkpoint, branch) = match from {
            Origin::Scene => (None, None),
            Origin::Itself(checkpoint) => (Some(*checkpoint), None),
            Origin::Another(branch) => (Some(branch.checkpoint), Some(branch.as_before)),
        };
        let state = checkpoint.as_ref().map(|checkpoint| &checkpoint.state);
        if let Some(state) = state {
            if branch.is_some() {
                let from_zero = scene.start.as_ref().is_some_and(|start| start.from_zero);
                account.branch(&state.account, from_zero);
            } else {
                account.resume(state.account.clone());
            }
        }
        let own = state.filter(|_| branch.is_none());
        let origin = state.map_or(&[][..], |state| &state.origin);
        let outputs = Outputs::open(scene, options, dir, account, own, origin)?;
        let mut run = Self {
            scene,
            options,
            account,
            dir,
            parties: scene.parties(),
            resources: Resources {
                processes: Processes::new(dir.clone(), options.screen.clone()),
                pauses: Pauses::new(options.patience),
                disk: Disk::default(),
                shared_memory: None,
                heard: None,
                left: None,
            },
            outputs,
            checkpoints: Checkpoints::default(),
            schedule: Schedule {
                phase: Phase::Opening,
                under_way: None,
                flags: 0,
                touches: match options.solvers {
                    Solvers::Processes { .. } if scene.mpm.is_some() => flags::FRAME,
                    _ => 0,
                },
                granted: Instant::now(),
                step_time: None,
            },
            latest: Latest::default(),
            stability: None,
            restored: Vec::new(),
            failure: None,
        };
        run.schedule.flags = run.flags_at_output(true);
        if let Some(checkpoint) = checkpoint {
            run.go_on(checkpoint, branch);
        }
        Ok(run)
    }

    /// Takes the state of a checkpoint: its own, or that of another run, which says whether the scene continues as that
    /// run would.
    fn go_on(&mut self, Checkpoint { state, solvers, .. }: Checkpoint, branch: Option<bool>) {
        self.latest.sides = state.sides;
        self.latest.bodies = state.bodies;
        self.latest.origin = state.origin;
        self.restored = solvers;
        let (schedule, at) = (&mut self.schedule, state.under_way);
        // A branch has a last epoch of its own, and its own first one unless it continues as that run would.
        let is_within = state.phase == Phase::Stepping;
        match branch {
            None => {
                (schedule.phase, schedule.flags) = (state.phase, state.flags);
                schedule.under_way = Some(at);
                // A recording that continues must not have a message twice.
                schedule.touches = 0;
            }
            Some(true) => {
                schedule.phase = Phase::Stepping;
                schedule.under_way = is_within.then_some(at);
                // Only the first grant of an epoch may measure (G-8).
                if is_within && at.done > 0 {
                    schedule.flags = state.flags;
                }
            }
            Some(false) => (schedule.phase, schedule.flags) = (Phase::Arriving, 0),
        }
    }

    /// The solvers that take part.
    pub(crate) fn parties(&self) -> &[Party] {
        &self.parties
    }

    /// Ends the run with the outcome of the session, after all files are written.
    pub(crate) fn end(mut self, outcome: Result<(), RunError>) -> Result<(), RunError> {
        let written = self.outputs.finish();
        if let Some(writer) = &mut self.checkpoints.writer {
            writer.finish();
        }
        // An error of the run itself has precedence, because it ended the session.
        let ended = match self.failure.take() {
            Some(failure) => Err(failure),
            None => outcome,
        };
        if let Err(error) = &ended {
            let words = error.party().and_then(|who| {
                let words = self.resources.processes.last_words(who)?;
                Some((who, words.to_owned()))
            });
            self.account.last_words = words;
            // A run that ended early keeps the bodies of the last row of the history.
            if self.account.recorder.has_begun()
                && let Err(error) = self.write_bodies()
            {
                tracing::warn!("{error}");
            }
        }
        ended?;
        for result in written {
            result?;
        }
        Ok(())
    }

    fn write_bodies(&self) -> Result<(), RunDirError> {
        let Some(dem) = &self.scene.dem else {
            return Ok(());
        };
        let names = dem.bodies.iter().map(|body| body.name.as_str());
        self.dir.write_bodies(names, &self.latest.bodies)
    }

    /// All solvers are ready, so that the run begins: its files take the place of an earlier run's.
    fn begin_run(&mut self, solvers: &session::Solvers) -> Result<(), RunError> {
        self.resources.disk.during(|| self.dir.take_place())?;
        self.resources.disk.started();
        for &party in &self.parties {
            let Some(ready) = solvers.readiness(party) else {
                continue;
            };
            tracing::info!(%party, items = ready.items, bytes = ready.bytes, "ready");
            for note in &ready.notes {
                tracing::info!(%party, "{note}");
            }
        }
        self.account.tally.balance.keeps_stress_work = solvers.can(Party::Mpm, STRESS_WORK);
        let mpm = self.scene.mpm.as_ref();
        let goes_round = mpm.is_some_and(|mpm| mpm.walls.periodic().contains(&true));
        self.account.tally.balance.goes_round = goes_round;
        if let Some(frames) = &mut self.outputs.frames {
            frames.reported_by(mpm, |party, capability| solvers.can(party, capability));
        }
        let [mpm, dem] = [Party::Mpm, Party::Dem].map(|party| solvers.readiness(party));
        self.stability = Some(Stability::new(&self.scene.time, mpm, dem));
        if let Some(sink) = &self.outputs.sink {
            sink.listen();
        }
        Ok(())
    }

    /// An error of the run ends the session.
    fn stopping<T>(&mut self, result: Result<T, RunError>) -> Result<T, Stop> {
        result.map_err(|error| {
            let reason = error.to_string();
            self.failure = Some(error);
            Stop(reason)
        })
    }
}

impl Supervisor for Run<'_> {
    fn configure(&mut self, solvers: &session::Solvers) -> Result<Vec<Part>, Stop> {
        let parts = self.parts(solvers);
        self.stopping(parts)
    }

    fn ready(&mut self, solvers: &session::Solvers) -> Result<(), Stop> {
        let begun = self.begin_run(solvers);
        self.stopping(begun)
    }

    fn next(&mut self) -> Result<Option<Next>, Stop> {
        let next = self.next_grant();
        self.stopping(next)
    }

    fn collected(&mut self, solvers: &mut session::Solvers) -> Result<(), Stop> {
        let taken = self.take_reports(solvers);
        self.stopping(taken)
    }

    fn drained(&mut self, solvers: &mut session::Solvers) -> Result<(), Stop> {
        let taken = self.take_end(solvers.round());
        self.stopping(taken)
    }

    fn start_deadline(&self) -> Duration {
        self.scene.coupling.start_deadline()
    }

    fn joined(&mut self, hello: &Hello) {
        let party = hello.party;
        tracing::info!(%party, identity = hello.identity, pid = hello.pid, "joined");
    }

    fn gone(&mut self) -> Option<(Party, String)> {
        let pauses = &mut self.resources.pauses;
        let processes = &mut self.resources.processes;
        processes
            .ended()
            .or_else(|| pauses.look(|| processes.held()))
    }

    /// Before the first step there is nothing to finish, so an interrupt ends the session. Later the run ends in order,
    /// unless something has stopped a solver (D16), its next message does not come, or a second interrupt does not wait for it.
    fn interrupted(&mut self, arriving: bool, silence: Duration) -> Option<Stop> {
        if arriving
            && self
                .resources
                .shared_memory
                .as_mut()
                .is_some_and(SharedMemory::is_lost)
        {
            self.failure = Some(RunError::SharedMemory {
                error: SessionError::Aborted("the solvers cannot be reached".into()),
                cause: REMOVED.into(),
            });
            return Some(Stop(REMOVED.into()));
        }
        if !self.options.interrupt.load(Ordering::Relaxed) {
            return None;
        }
        let heard = self.resources.heard.get_or_insert_with(Instant::now);
        let patience = ANSWER + 4 * self.schedule.step_time.unwrap_or_default();
        let no_answer = silence.min(heard.elapsed()) > patience;
        let at_once = self.options.at_once.load(Ordering::Relaxed);
        let failure = match self.resources.pauses.held_now() {
            _ if arriving => "before the first step".to_owned(),
            Some((party, hold)) => format!("while the {party} solver was {hold}"),
            None if at_once => format!("{ALONE}: {TWICE}"),
            None if no_answer => format!("{ALONE}: they did not answer"),
            None => return None,
        };
        self.failure = Some(RunError::Interrupted(failure));
        Some(Stop("interrupted".into()))
    }
}
