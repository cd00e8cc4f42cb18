//! A coupled run from scene to summary.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use interface::control::{Configure, Party};
use interface::recording::{self, About};
use interface::session::{SessionError, coupler::Session};
use interface::solver::Readiness;
use interface::wire::{BodyState, Grant, GroupState, Ledger, PointState, flags};
use interface::{OneProcess, SharedMemory, Transport};

use crate::account::Account;
use crate::failure::RunError;
use crate::frames::{Frames, Instant as FrameInstant};
use crate::launch::{Crew, Start};
use crate::pace::{Collapsed, Epoch};
use crate::progress::{Progress, Standing};
use crate::quantity::{Measured, Sample};
use crate::rundir::{History, RunDir, RunDirError};
use crate::scene::Scene;
use crate::stability::{Bound, Sides, Stability};
use crate::summary::{Summary, state_hash};

/// A window is cut so that it takes about this long: the bar moves and Ctrl-C is heard.
const WINDOW_TIME: Duration = Duration::from_millis(200);
/// A positive energy residual beyond this share of the energy in play is an instability, not an error of the scheme.
const BLOW_UP: f64 = 0.5;

/// How a scene is run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// How the continuum solver is started.
    pub mpm: Start,
    /// How the rigid-body solver is started.
    pub dem: Start,
    /// Threads of each solver.
    pub threads: usize,
    /// Most steps granted at once; the scene's own where absent.
    pub window: Option<u32>,
    /// Whether everything that crosses is recorded in the run directory.
    pub record: bool,
    /// Whether a bar is wanted on a terminal.
    pub progress: bool,
    /// Set from outside to end the run in order.
    pub interrupt: Arc<AtomicBool>,
}

/// Runs `scene` and writes what it shows to `dir`. A run that fails has a summary too: its status and reason.
///
/// # Errors
/// [`RunDirError`] when not even the summary can be written.
pub fn run(scene: &Scene, options: &RunOptions, dir: &RunDir) -> Result<Summary, RunDirError> {
    dir.write_scene(&scene.resolved_toml)?;
    let threads = [&options.mpm, &options.dem]
        .iter()
        .any(|start| matches!(start, Start::Thread(_)));
    if threads {
        run_over::<OneProcess>(scene, options, dir)
    } else {
        run_over::<SharedMemory>(scene, options, dir)
    }
}

fn run_over<S: Transport + 'static>(
    scene: &Scene,
    options: &RunOptions,
    dir: &RunDir,
) -> Result<Summary, RunDirError> {
    let started = Instant::now();
    let mut account = Account::new(scene);
    let mut crew = Crew::default();
    let ended = recorder(scene, options, dir).and_then(|recorder| {
        let tape = recorder.as_ref().map(recording::Recorder::tape);
        let mut session = Session::<S>::open_recorded(&parties(scene), tape)?;
        let ended = Run::begin(scene, options, dir, &mut account, &mut session, &mut crew)
            .and_then(Run::finish);
        if let Err(error) = &ended {
            session.abort(&error.to_string());
        }
        crew.dismiss();
        drop(session);
        let recorded = recorder.map_or(Ok(()), recording::Recorder::finish);
        ended.and_then(|()| Ok(recorded.map_err(SessionError::from)?))
    });
    let summary = account.summarise(&ended, started.elapsed());
    dir.write_summary(&summary)?;
    Ok(summary)
}

fn recorder(
    scene: &Scene,
    options: &RunOptions,
    dir: &RunDir,
) -> Result<Option<recording::Recorder>, RunError> {
    if !options.record {
        return Ok(None);
    }
    let made_by = concat!("tandem ", env!("CARGO_PKG_VERSION"));
    let about = About::run(&scene.name, &scene.hash, made_by);
    let recorder =
        recording::Recorder::create(&dir.recording(), &about).map_err(SessionError::from)?;
    Ok(Some(recorder))
}

fn parties(scene: &Scene) -> Vec<Party> {
    let mut parties = Vec::new();
    parties.extend(scene.mpm.is_some().then_some(Party::Mpm));
    parties.extend(scene.dem.is_some().then_some(Party::Dem));
    parties
}

/// A run in progress.
struct Run<'a, S: Transport> {
    scene: &'a Scene,
    options: &'a RunOptions,
    account: &'a mut Account,
    session: &'a mut Session<S>,
    crew: &'a mut Crew,
    parties: Vec<Party>,
    stability: Stability,
    dir: &'a RunDir,
    history: History,
    frames: Option<Frames>,
    progress: Progress,
    sides: Sides,
    groups: Vec<GroupState>,
    bodies: Vec<BodyState>,
    points: Vec<PointState>,
    sample: Sample,
    /// Wall time of a step in the last window.
    step_time: Option<Duration>,
}

impl<'a, S: Transport + 'static> Run<'a, S> {
    /// Open and configure.
    fn begin(
        scene: &'a Scene,
        options: &'a RunOptions,
        dir: &'a RunDir,
        account: &'a mut Account,
        session: &'a mut Session<S>,
        crew: &'a mut Crew,
    ) -> Result<Self, RunError> {
        let parties = parties(scene);
        let history = dir.history(&account.recorder.header())?;
        let frames = Frames::begin(dir, scene)?;
        for &party in &parties {
            let start = if party == Party::Mpm {
                &options.mpm
            } else {
                &options.dem
            };
            crew.start(party, start, session.domain())?;
        }
        for &party in &parties {
            let hello = arriving(session, crew, options, |session, alarm| {
                session.hello(party, alarm)
            })?;
            tracing::info!(%party, identity = hello.identity, pid = hello.pid, "joined");
        }
        let coupled = parties.len() == 2;
        for &party in &parties {
            let config = match party {
                Party::Mpm => scene.mpm.clone().map(|c| {
                    to_json(&interface::config::MpmConfig {
                        threads: options.threads,
                        ..c
                    })
                }),
                _ => scene.dem.clone().map(|c| {
                    to_json(&interface::config::DemConfig {
                        threads: options.threads,
                        ..c
                    })
                }),
            };
            let configure = Configure {
                scene_hash: scene.hash.clone(),
                config: config.expect("only parties of the scene take part"),
                coupled,
                deadline: scene.coupling.deadline.as_secs_f64(),
            };
            session.configure(party, &configure)?;
        }
        let mut readiness: BTreeMap<Party, Readiness> = BTreeMap::new();
        for &party in &parties {
            let ready = arriving(session, crew, options, |session, alarm| {
                session.ready(party, &scene.hash, alarm)
            })?;
            tracing::info!(%party, items = ready.items, bytes = ready.bytes, "ready");
            for note in &ready.notes {
                tracing::info!(%party, "{note}");
            }
            readiness.insert(party, ready);
        }
        let (mpm, dem) = (readiness.get(&Party::Mpm), readiness.get(&Party::Dem));
        let stability = Stability::new(&scene.time, mpm, dem);
        let progress = Progress::new(scene.time.end, options.progress);
        Ok(Self {
            scene,
            options,
            account,
            session,
            crew,
            parties,
            stability,
            dir,
            history,
            frames,
            progress,
            sides: Sides::default(),
            groups: Vec::new(),
            bodies: Vec::new(),
            points: Vec::new(),
            sample: Sample::default(),
            step_time: None,
        })
    }

    /// Step and drain.
    fn finish(mut self) -> Result<(), RunError> {
        let stepped = self.step_to_the_end();
        self.progress.finish();
        self.history.flush()?;
        let framed = self.frames.as_mut().map_or(Ok(()), Frames::finish);
        stepped?;
        framed?;
        let points = watched(self.session, self.crew, |session, alarm| {
            session.drain(alarm)
        })?;
        let reports = &self.account.reports;
        let known = reports.get(&Party::Mpm).map_or(0, |report| report.items);
        whole_cloud(&points, known, "D-1", self.session.step_of(Party::Mpm))?;
        if !self.account.interrupted {
            self.account.state_hash = Some(state_hash(&points, &self.bodies));
            if let Some(dem) = &self.scene.dem {
                let names = dem.bodies.iter().map(|body| body.name.as_str());
                self.dir.write_bodies(names, &self.bodies)?;
            }
        }
        Ok(())
    }

    fn step_to_the_end(&mut self) -> Result<(), RunError> {
        // Opening: nothing moves; forces, limits and energies of the start.
        let opening = Epoch {
            dt: 0.0,
            steps: 1,
            lands: false,
            bound: Bound::Output,
        };
        let ends = self.asked(true);
        self.epoch(&opening, ends)?;
        let mut asked = 0; // the opening step has measured the start
        while self.account.clock.time() < self.scene.time.end && !self.interrupted() {
            let time = self.account.clock.time();
            self.stability
                .compare(&self.sides, &mut self.account.criteria);
            let epoch = self
                .account
                .pace
                .epoch(time, &self.stability, &self.sides)
                .map_err(|e| self.collapsed(e))?;
            asked = self.epoch(&epoch, asked)?;
        }
        // Closing: the last half kick brings the velocities to the time of the positions.
        let closing = Epoch {
            dt: 0.0,
            steps: 1,
            lands: false,
            bound: Bound::Output,
        };
        self.epoch(&closing, ends)?;
        Ok(())
    }

    fn interrupted(&mut self) -> bool {
        self.account.interrupted |= self.options.interrupt.load(Ordering::Relaxed);
        self.account.interrupted
    }

    /// What is asked for at an output, as flags of its grant: the measurement, and a frame if one is `due`.
    fn asked(&self, due: bool) -> u64 {
        if due && self.frames.is_some() {
            flags::MEASURE | flags::FRAME
        } else {
            flags::MEASURE
        }
    }

    /// The steps of one epoch, until a limit changes or it is done. `asked`: the flags of its first grant. Returns those
    /// of the next epoch's.
    fn epoch(&mut self, epoch: &Epoch, mut asked: u64) -> Result<u64, RunError> {
        self.account.clock.begin_epoch(epoch.dt);
        self.account.epochs += 1;
        let budgets = self.stability.budgets(&self.sides, epoch.dt);
        let mut done = 0;
        while done < epoch.steps {
            let window = self.window().min(epoch.steps - done);
            let start = Instant::now();
            let (epoch_start, steps_in_epoch, dt_before_epoch) = self.account.clock.epoch();
            let grant = Grant {
                epoch: self.account.epochs,
                first: self.account.clock.index(),
                steps: window,
                flags: asked,
                epoch_start,
                steps_in_epoch,
                dt_before_epoch,
                dt: epoch.dt,
                ..Grant::default()
            };
            let mut grants = Vec::with_capacity(2);
            for &party in &self.parties {
                let budget = if party == Party::Mpm {
                    budgets.mpm
                } else {
                    budgets.dem
                };
                let grant = Grant {
                    budget_omega_sq: budget.omega_sq,
                    budget_speed: budget.speed,
                    budget_damping: budget.damping,
                    ..grant
                };
                self.session.grant(party, &grant)?;
                grants.push((party, grant));
            }
            self.account.grants += 1;
            let within = self.collect(&grants)?;
            let advanced = self.advanced(&grant)?;
            let at = self.account.clock.step(asked != 0);
            self.account.clock.advance_by(advanced);
            done += advanced;
            if epoch.dt > 0.0 {
                self.account.pace.book(epoch, advanced);
            }
            if asked != 0 {
                self.record(at.time, epoch, asked & flags::FRAME != 0)?;
                asked = 0;
            }
            self.step_time = Some(start.elapsed() / advanced.max(1) as u32);
            self.show(epoch);
            if !within || self.interrupted() {
                break;
            }
        }
        if epoch.lands && done == epoch.steps {
            self.account.clock.land_on(self.account.pace.next_output());
            self.account.pace.output_done();
            // At the end the closing step measures.
            let every = self.scene.output.frames;
            let due = every.is_some_and(|rows| self.account.pace.outputs().is_multiple_of(rows));
            let goes_on = self.account.clock.time() < self.scene.time.end;
            return Ok(if goes_on { self.asked(due) } else { 0 });
        }
        Ok(asked)
    }

    /// Steps that fit the time of a window; before anything is known of their cost, one.
    fn window(&self) -> u64 {
        let most = self.options.window.unwrap_or(self.scene.coupling.window);
        let time = WINDOW_TIME.min(self.scene.coupling.deadline / 4);
        match self.step_time {
            Some(t) => (time.as_nanos() / t.as_nanos().max(1)).clamp(1, most.into()) as u64,
            None => 1,
        }
    }

    /// Waits for all reports on a grant; returns whether all sides may go on with the step.
    fn collect(&mut self, grants: &[(Party, Grant)]) -> Result<bool, RunError> {
        let start = Instant::now();
        let mut within = true;
        for (party, grant) in grants {
            let report = watched(self.session, self.crew, |session, alarm| {
                session.report(*party, grant, alarm)
            })?;
            match party {
                Party::Mpm => self.sides.mpm = report.limits,
                _ => self.sides.dem = report.limits,
            }
            let wanted = grant.flags & flags::MEASURE != 0;
            if wanted != (report.measured == 1) {
                let message = format!("measured is {}, asked for: {wanted}", report.measured);
                return Err(broken(*party, "R-3", grant.first, message));
            }
            if wanted {
                let step = grant.first;
                let (got, expected) = if *party == Party::Mpm {
                    self.session.groups(step, &mut self.groups)?;
                    (
                        self.groups.len(),
                        self.scene.mpm.as_ref().map_or(0, |mpm| mpm.groups.len()),
                    )
                } else {
                    self.session.bodies(step, &mut self.bodies)?;
                    (
                        self.bodies.len(),
                        self.scene.dem.as_ref().map_or(0, |dem| dem.bodies.len()),
                    )
                };
                if got != expected {
                    let message = format!("{got} records of a measurement, expected {expected}");
                    return Err(broken(*party, "R-3", step, message));
                }
            }
            if grant.flags & flags::FRAME != 0 && *party == Party::Mpm {
                self.session.points(grant.first, &mut self.points)?;
                whole_cloud(&self.points, report.items, "R-5", grant.first)?;
            }
            within &= report.halted == 0 && grant.allows(&report.limits);
            self.account.imps_max = self.account.imps_max.max(report.imps);
            self.account.reports.insert(*party, report);
        }
        self.account.waited += start.elapsed();
        Ok(within)
    }

    /// Steps that all sides have done; a session's sides stop at one boundary (clause R-4).
    fn advanced(&self, grant: &Grant) -> Result<u64, RunError> {
        let mut ends = self.account.reports.values().map(|report| report.next);
        let end = ends.next().unwrap_or(grant.first + grant.steps);
        if let Some(other) = ends.find(|&other| other != end) {
            let message = format!("the sides stopped at steps {end} and {other}");
            return Err(broken(Party::Mpm, "R-4", grant.first, message));
        }
        Ok(end - grant.first)
    }

    /// Takes the measurement of the first step of the last grant.
    fn record(&mut self, time: f64, epoch: &Epoch, frame: bool) -> Result<(), RunError> {
        let account = &mut *self.account;
        let ledger = |party| {
            account
                .reports
                .get(&party)
                .map_or_else(Ledger::default, |report| report.ledger)
        };
        let (mpm, dem) = (ledger(Party::Mpm), ledger(Party::Dem));
        account
            .balance
            .take(&mpm, &dem, moving(&self.groups, &self.bodies));
        let measured = Measured {
            time,
            mpm: &mpm,
            dem: &dem,
            groups: &self.groups,
            bodies: &self.bodies,
            momentum_error: account.balance.momentum_error,
            energy_residual: account.balance.residual,
            energy_residual_relative: account.balance.residual_relative(),
        };
        self.scene.quantities.fill(&mut self.sample, &measured);
        account.recorder.record(&self.sample);
        self.history.row(account.recorder.row())?;
        if frame && let Some(frames) = &mut self.frames {
            frames.take(FrameInstant {
                time,
                points: std::mem::take(&mut self.points),
                bodies: self.bodies.clone(),
            })?;
        }
        let residual = account.balance.residual_relative();
        // Sums of numbers that are finite each can still be beyond all bounds.
        if residual > BLOW_UP || !residual.is_finite() {
            // The opening and the closing step have no length: the one that led here is the last that had.
            let (dt, bound) = account.pace.last().unwrap_or((epoch.dt, epoch.bound));
            return Err(RunError::BlowUp {
                time,
                step: account.clock.index(),
                percent: 100.0 * residual,
                dt,
                bound: bound.name(),
            });
        }
        Ok(())
    }

    fn show(&mut self, epoch: &Epoch) {
        let standing = Standing {
            step: self.account.clock.index(),
            time: self.account.clock.time(),
            dt: epoch.dt,
            bound: epoch.bound.name(),
        };
        self.progress.show(&standing);
    }

    fn collapsed(&self, collapsed: Collapsed) -> RunError {
        RunError::Collapsed {
            time: self.account.clock.time(),
            step: self.account.clock.index(),
            bound: collapsed.bound,
            dt: collapsed.dt,
            min_step: self.scene.time.min_step,
        }
    }
}

/// All points that are left, in order of their ids (clauses D-1, R-5).
fn whole_cloud(
    points: &[PointState],
    known: u64,
    clause: &'static str,
    step: u64,
) -> Result<(), RunError> {
    let ordered = points.windows(2).all(|pair| pair[0].id < pair[1].id);
    if points.len() as u64 <= known && ordered {
        return Ok(());
    }
    let message = format!("{} points of {known}, ids rising: {ordered}", points.len());
    Err(broken(Party::Mpm, clause, step, message))
}

/// Sum of the magnitudes of the momenta of all groups and bodies in N s/m.
fn moving(groups: &[GroupState], bodies: &[BodyState]) -> f64 {
    let groups = groups.iter().map(|g| (g.mass, g.velocity));
    let bodies = bodies.iter().map(|b| (b.mass, b.velocity));
    let all = groups.chain(bodies);
    all.map(|(mass, [x, y])| mass * x.hypot(y)).sum()
}

/// As [`watched`], before the first step: there is nothing to drain yet, so an interrupt ends the wait.
fn arriving<S: Transport + 'static, T>(
    session: &mut Session<S>,
    crew: &mut Crew,
    options: &RunOptions,
    wait: impl FnOnce(
        &mut Session<S>,
        &mut dyn FnMut() -> Result<(), SessionError>,
    ) -> Result<T, SessionError>,
) -> Result<T, RunError> {
    let interrupted = || options.interrupt.load(Ordering::Relaxed);
    let waited = watched(session, crew, |session, alarm| {
        let mut alarm = || {
            if interrupted() {
                return Err(SessionError::Aborted("interrupted".into()));
            }
            alarm()
        };
        wait(session, &mut alarm)
    });
    match waited {
        Err(RunError::Session(SessionError::Aborted(_))) => Err(RunError::Interrupted),
        waited => waited,
    }
}

/// Waits for a solver while watching that all of them live.
fn watched<S: Transport + 'static, T>(
    session: &mut Session<S>,
    crew: &mut Crew,
    wait: impl FnOnce(
        &mut Session<S>,
        &mut dyn FnMut() -> Result<(), SessionError>,
    ) -> Result<T, SessionError>,
) -> Result<T, RunError> {
    let steps: BTreeMap<Party, u64> = [Party::Mpm, Party::Dem]
        .into_iter()
        .map(|party| (party, session.step_of(party)))
        .collect();
    let mut alarm = || match crew.casualty() {
        None => Ok(()),
        Some((who, how)) => Err(SessionError::Vanished {
            who,
            how,
            step: steps[&who],
        }),
    };
    Ok(wait(session, &mut alarm)?)
}

fn broken(who: Party, clause: &'static str, step: u64, message: String) -> RunError {
    let error = SessionError::Contract {
        who,
        clause,
        step,
        message,
    };
    error.into()
}

fn to_json<T: serde::Serialize>(config: &T) -> String {
    serde_json::to_string(config).expect("configurations have string keys only")
}
