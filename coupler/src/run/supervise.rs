//! The decisions of a run: the configuration of each solver, the next steps, and what is recorded of the reports.

mod checkpoints;
mod configure;
mod outputs;

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use interface::config::capability::STRESS_WORK;
use interface::message::control::{Hello, Party};
use interface::message::wire::{BodyState, Grant, Ledger, flags};
use interface::recording::RecordingSink;
use interface::session::{self, Next, Part, Round, SessionError, Stop, Supervisor};
use interface::transport::vanished;

use self::outputs::Outputs;
use crate::record::background::Mark;
use crate::record::frames::{Instant as FrameInstant, ReportedFields};
use crate::record::ledger::{Moving, created_words};
use crate::record::progress;
use crate::record::quantity::{Ledgers, Measured, Sample};
use crate::record::rundir::{RunDir, RunDirError};
use crate::record::summary::state_hash;
use crate::run::account::Account;
use crate::run::checkpoint::writer::CheckpointWriter;
use crate::run::checkpoint::{Checkpoint, CouplerState, Origin, Phase, UnderWay};
use crate::run::disk::Disk;
use crate::run::failure::RunError;
use crate::run::launch::Processes;
use crate::run::options::{RunOptions, Solvers};
use crate::run::pace::Epoch;
use crate::run::pause::Pauses;
use crate::run::resources::{REMOVED, SharedMemory};
use crate::run::stability::{Bound, Sides, Stability, StepLimit};
use crate::scene::Scene;

/// A window takes about this long, so that the bar moves and Ctrl-C has an effect.
const WINDOW_TIME: Duration = Duration::from_millis(200);
/// A positive energy residual above this share of the energy in play is an instability, and not an error of the scheme.
const BLOW_UP: f64 = 0.5;
/// After an interrupt, longest wait for a solver's next message, a report, a piece of its state or its goodbye, beside
/// the time of four steps. With what follows a run ends within 8 s.
const ANSWER: Duration = Duration::from_secs(5);
/// That the run did not wait for its solvers, and that a second interrupt has come.
const ALONE: &str = "without the end of the solvers";
const TWICE: &str = "it was asked twice";
/// How old a summary for the case that shared memory vanishes may be.
const REMEMBERED: Duration = Duration::from_secs(1);
/// The opening and the closing step have no length. They give the forces, limits and energies at the start and at the
/// end.
const STANDSTILL: Epoch = Epoch {
    dt: 0.0,
    steps: 1,
    lands: false,
    bound: Bound::Output,
};

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

/// The steps that come next.
struct Schedule {
    phase: Phase,
    /// The epoch in progress.
    under_way: Option<UnderWay>,
    /// Flags of the next grant.
    asked: u64,
    /// More flags of the first grant. It asks for a frame, so that the memory for all points exists, and both sides
    /// know it, before anything is computed. At the end of the run all points are sent in that memory.
    touches: u64,
    /// When the last grant was decided.
    granted: Instant,
    /// Wall time of a step in the last window.
    step_time: Option<Duration>,
}

/// The latest reports.
#[derive(Default)]
struct Latest {
    sides: Sides,
    sample: Sample,
    bodies: Vec<BodyState>,
    /// The bodies at their initial positions.
    origin: Vec<BodyState>,
    /// The share of created energy that was told last.
    created_told: f64,
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
                asked: 0,
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
        run.schedule.asked = run.asked_at_output(true);
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
                (schedule.phase, schedule.asked) = (state.phase, state.asked);
                schedule.under_way = Some(at);
                // A recording that continues must not have a message twice.
                schedule.touches = 0;
            }
            Some(true) => {
                schedule.phase = Phase::Stepping;
                schedule.under_way = is_within.then_some(at);
                // Only the first grant of an epoch may measure (G-8).
                if is_within && at.done > 0 {
                    schedule.asked = state.asked;
                }
            }
            Some(false) => (schedule.phase, schedule.asked) = (Phase::Arriving, 0),
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
        self.outputs.reported = ReportedFields::by(self.scene.mpm.as_ref(), |party, capability| {
            solvers.can(party, capability)
        });
        let [mpm, dem] = [Party::Mpm, Party::Dem].map(|party| solvers.readiness(party));
        self.stability = Some(Stability::new(&self.scene.time, mpm, dem));
        if let Some(sink) = &self.outputs.sink {
            sink.listen();
        }
        Ok(())
    }

    fn stability(&self) -> &Stability {
        self.stability.as_ref().expect("all solvers are ready")
    }

    /// Whether so much waits for the disk that nothing should be added.
    fn is_behind(&self) -> bool {
        let checkpoints = self.checkpoints.writer.as_ref();
        self.outputs.is_behind() || checkpoints.is_some_and(CheckpointWriter::is_behind)
    }

    /// The next grant, or the end of them.
    fn next_grant(&mut self) -> Result<Option<Next>, RunError> {
        let at_once = &self.options.at_once;
        if !(self.resources.disk).wait(|| self.is_behind(), at_once) {
            return Err(RunError::Interrupted(format!("{ALONE}: {TWICE}")));
        }
        if let Some(error) = self.outputs.sink.as_ref().and_then(RecordingSink::failure) {
            return Err(SessionError::from(error).into());
        }
        let under_way = match self.schedule.under_way {
            Some(under_way) => under_way,
            None => match self.next_epoch()? {
                Some(epoch) => self.begin(epoch),
                None => return Ok(None),
            },
        };
        let checkpoint = self.checkpoint(&under_way)?;
        let window = self.window().min(under_way.epoch.steps - under_way.done);
        let (epoch_start, steps_in_epoch, dt_before_epoch) = self.account.tally.clock.epoch();
        let grant = Grant {
            epoch: self.account.tally.epochs,
            first: self.account.tally.clock.index(),
            steps: window,
            flags: self.schedule.asked | checkpoint | std::mem::take(&mut self.schedule.touches),
            epoch_start,
            steps_in_epoch,
            dt_before_epoch,
            dt: under_way.epoch.dt,
            ..Grant::default()
        };
        let Sides { mpm, dem } = under_way.budgets;
        let budget = |party: &Party| match party {
            Party::Mpm => mpm,
            Party::Dem => dem,
            Party::Coupler => unreachable!("the coupler is granted nothing"),
        };
        let budgets = self.parties.iter().map(budget).collect();
        self.account.tally.grants += 1;
        self.schedule.granted = Instant::now();
        Ok(Some((grant, budgets)))
    }

    fn begin(&mut self, epoch: Epoch) -> UnderWay {
        self.account.tally.clock.begin_epoch(epoch.dt);
        self.account.tally.epochs += 1;
        let under_way = UnderWay {
            budgets: self.stability().budgets(&self.latest.sides, epoch.dt),
            epoch,
            done: 0,
        };
        self.schedule.under_way = Some(under_way);
        under_way
    }

    /// The next epoch, if there is one.
    fn next_epoch(&mut self) -> Result<Option<Epoch>, RunError> {
        if self.schedule.phase == Phase::Stepping {
            let time = self.account.tally.clock.time();
            if time < self.scene.time.end && !self.ends_early() {
                let stability = *self.stability();
                stability.compare(&self.latest.sides, &mut self.account.tally.criteria);
                let epoch = self
                    .account
                    .pace
                    .epoch(time, &stability, &self.latest.sides);
                return epoch.map(Some).map_err(|e| self.collapsed(e));
            }
            self.schedule.phase = Phase::Closing;
            self.schedule.asked = self.asked_at_output(true);
        }
        match self.schedule.phase {
            Phase::Arriving => {
                self.schedule.phase = Phase::Opening;
                Ok(Some(STANDSTILL))
            }
            Phase::Opening => {
                self.schedule.phase = Phase::Stepping;
                self.schedule.asked = self.asked_at_output(true);
                Ok(Some(STANDSTILL))
            }
            Phase::Closing => {
                self.schedule.phase = Phase::Done;
                Ok(Some(STANDSTILL))
            }
            Phase::Stepping | Phase::Done => Ok(None),
        }
    }

    /// Whether the run is interrupted, and its last checkpoint, if it writes any, has been asked for.
    fn ends_early(&mut self) -> bool {
        self.interrupted() && (self.checkpoints.last_asked || self.checkpoints.writer.is_none())
    }

    fn interrupted(&mut self) -> bool {
        let asked = self.options.interrupt.load(Ordering::Relaxed);
        let most = self.options.stepping;
        self.account.interrupted |=
            asked || most.is_some_and(|most| self.account.is_stepping_for(most));
        self.account.interrupted
    }

    /// The flags of a grant at an output: the measurement, and a frame if one is `due`.
    fn asked_at_output(&self, due: bool) -> u64 {
        if due && self.outputs.frames.is_some() {
            flags::MEASURE | flags::FRAME
        } else {
            flags::MEASURE
        }
    }

    /// Number of steps that fit into the time of a window; one, as long as the time of a step is not known.
    fn window(&self) -> u64 {
        let most = self.options.window.unwrap_or(self.scene.coupling.window);
        let time = WINDOW_TIME.min(self.scene.coupling.deadline() / 4);
        match self.schedule.step_time {
            Some(t) => (time.as_nanos() / t.as_nanos().max(1)).clamp(1, most.into()) as u64,
            None => 1,
        }
    }

    /// Takes the reports on the last grant.
    fn take_reports(&mut self, solvers: &mut session::Solvers) -> Result<(), RunError> {
        self.account.waited += self.schedule.granted.elapsed();
        self.keep(solvers);
        for &party in &self.parties {
            let report = *solvers.report(party).expect("a solver of this session");
            match party {
                Party::Mpm => self.latest.sides.mpm = report.limits,
                Party::Dem => self.latest.sides.dem = report.limits,
                Party::Coupler => unreachable!("the coupler reports to nobody"),
            }
            self.account.tally.imps_max = self.account.tally.imps_max.max(report.imps);
            self.account.reports.insert(party, report);
        }
        self.account.reported();
        let round = solvers.round();
        let mut under_way = self.schedule.under_way.take().expect("a grant was given");
        let epoch = under_way.epoch;
        let asked = std::mem::take(&mut self.schedule.asked);
        let at = self.account.tally.clock.step(asked != 0);
        // Before the steps of the window count: a run that stops here has done those before the measurement, in any window.
        if asked != 0 {
            self.outputs.course.before(&self.account.pace);
            self.record(at.time, &epoch, asked & flags::FRAME != 0, round)?;
        }
        self.account.tally.clock.advance_by(round.steps);
        under_way.done += round.steps;
        if epoch.dt > 0.0 {
            self.account.pace.book(&epoch, round.steps);
        }
        round.points = Vec::new();
        self.schedule.step_time = Some(self.schedule.granted.elapsed() / round.steps.max(1) as u32);
        self.leave_summary();
        self.show(&epoch);
        let whole = under_way.done == epoch.steps;
        if !whole && round.within && !self.ends_early() {
            self.schedule.under_way = Some(under_way);
        }
        if epoch.lands && whole {
            self.land();
        }
        Ok(())
    }

    /// The epoch has ended on an output.
    fn land(&mut self) {
        self.account
            .tally
            .clock
            .land_on(self.account.pace.next_output());
        self.account.pace.so_far.outputs += 1;
        // At the end the closing step is measured instead.
        let every = self.scene.output.frames;
        let due = every.is_some_and(|rows| self.account.pace.so_far.outputs.is_multiple_of(rows));
        if self.account.tally.clock.time() < self.scene.time.end {
            self.schedule.asked = self.asked_at_output(due);
        }
    }

    /// Takes the measurement of the first step of the last grant.
    fn record(
        &mut self,
        time: f64,
        epoch: &Epoch,
        frame: bool,
        round: &mut Round,
    ) -> Result<(), RunError> {
        self.latest.bodies.clone_from(&round.bodies);
        if self.latest.origin.is_empty() {
            self.latest.origin.clone_from(&round.bodies);
        }
        let groups = self.scene.mpm.as_ref().map_or(0, |mpm| mpm.groups.len());
        let account = &mut *self.account;
        let ledger = |party| {
            account
                .reports
                .get(&party)
                .map_or_else(Ledger::default, |report| report.ledger)
        };
        let [mpm, dem] = [Party::Mpm, Party::Dem].map(ledger);
        let [mpm, dem] = account.tally.since.count([mpm, dem]);
        let moving = Moving::of(&round.groups[..groups], &round.bodies);
        account.tally.balance.take(&mpm, &dem, &moving);
        let measured = Measured {
            ledgers: Ledgers {
                time,
                mpm,
                dem,
                balance: account.tally.balance,
            },
            groups: &round.groups,
            bodies: &round.bodies,
        };
        let first = account.recorder.initial();
        self.scene
            .quantities
            .fill(&mut self.latest.sample, &measured, first);
        account.recorder.record(&self.latest.sample);
        self.outputs.history.row(account.recorder.row())?;
        self.outputs.course.row(time, &account.tally.balance.now)?;
        if frame && let Some(frames) = &mut self.outputs.frames {
            frames.take(FrameInstant {
                time,
                points: std::mem::take(&mut round.points),
                bodies: round.bodies.clone(),
                plastic_strain: self.outputs.reported.plastic_strain.clone(),
                contacts: self
                    .outputs
                    .reported
                    .contacts
                    .then(|| round.contacts.clone()),
            })?;
        }
        let residual = account.tally.balance.residual_relative();
        // A sum of finite numbers can still be infinite.
        if residual > BLOW_UP || !residual.is_finite() {
            // The opening and the closing step have no length, so the last step with a length is the cause.
            let (dt, bound) = account.pace.so_far.last.unwrap_or((epoch.dt, epoch.bound));
            return Err(RunError::BlowUp {
                time,
                step: account.tally.clock.index(),
                percent: 100.0 * residual,
                dt,
                bound: bound.name(),
                stable: self.scene.time.is_stable(),
            });
        }
        self.tell_created(time, residual);
        Ok(())
    }

    /// Keeps a summary of the run so far, from time to time, for the case that its shared memory vanishes: the system then ends
    /// this process, and a signal handler cannot make one.
    fn leave_summary(&mut self) {
        let shared = matches!(self.options.solvers, Solvers::Processes { .. });
        let old = (self.resources.left).is_none_or(|left| left.elapsed() >= REMEMBERED);
        if shared && old {
            let cause = vanished::CAUSE.to_owned();
            let error = SessionError::Aborted("the solvers cannot be reached".into());
            let ended = Err(RunError::SharedMemory { error, cause });
            let summary = self.account.summarise(&ended);
            self.dir.leave_summary(Some(&summary));
            self.resources.left = Some(Instant::now());
        }
    }

    /// Warns of created energy, a share of the energy in play, while the run goes on: when it is first worth a word,
    /// and whenever it has doubled.
    fn tell_created(&mut self, time: f64, created: f64) {
        if created > 2.0 * self.latest.created_told
            && let Some(words) = created_words(created)
        {
            self.latest.created_told = created;
            tracing::warn!(
                "at t = {time:.6e} s {words}; a run that ends with more than time.created_energy = {} has failed",
                self.scene.time.created_energy
            );
        }
    }

    fn show(&mut self, epoch: &Epoch) {
        let state = progress::State {
            step: self.account.tally.clock.index(),
            time: self.account.tally.clock.time(),
            dt: epoch.dt,
            bound: epoch.bound.name(),
        };
        self.outputs.progress.show(&state);
    }

    fn collapsed(&self, limit: StepLimit) -> RunError {
        RunError::Collapsed {
            time: self.account.tally.clock.time(),
            step: self.account.tally.clock.index(),
            bound: limit.bound,
            dt: limit.dt,
            min_step: self.scene.time.shortest(),
        }
    }

    /// All points have arrived, at the end.
    fn take_end(&mut self, round: &Round) -> Result<(), RunError> {
        self.account.drained();
        if !self.account.interrupted {
            self.account.state_hash = Some(state_hash(&round.points, &self.latest.bodies));
        }
        self.resources.disk.during(|| self.write_bodies())?;
        Ok(())
    }
}

impl Run<'_> {
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
