//! A solver's side of a session: its state machine, the solver that does its tasks, and the messages received.

use std::time::{Duration, Instant};

use super::stopwatch::{Activity, Stopwatch, cpu_ns};
use super::turns::{Inbox, Turn, Turns, drive};
use crate::core::SessionError;
use crate::core::bodies::Bodies;
use crate::core::continuum::Continuum;
use crate::core::{Action, Done, Event, Machine, Task, broken, fastest};
use crate::message::codec::encode;
use crate::message::control::{Hello, Notice, Party};
use crate::message::wire::{ContactState, EnvelopeVertex, ImpForce, ImpInfo, ImpState, StepHeader};
use crate::message::{Channel, Kind, Payload, Records};
use crate::session::process::started_as;
use crate::solver::{DemSolver, MpmSolver};
use crate::transport::Transport;
use crate::transport::domain::Domain;
use crate::transport::iceoryx::{self, Medium, SEND_TIMEOUT};

/// Longest wait of a solver on the wrong side for the end of the session.
const GRACE: Duration = Duration::from_secs(2);

/// Whose CPU time a report has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clocked {
    /// The process: it runs only the solver.
    Process,
    /// The thread: it runs only the solver.
    Thread,
    /// Nobody's: all parties share a thread, and the caller that lets them take turns measures their time.
    Shared,
}

/// Joins the run of `domain` as the continuum and serves until the session is closed.
///
/// # Errors
/// Any [`SessionError`]; it was sent to the coupler.
pub fn serve_mpm(
    medium: Medium,
    domain: &Domain,
    solver: &mut dyn MpmSolver,
    own_process: bool,
) -> Result<(), SessionError> {
    let clocked = clocked(own_process);
    serve(medium, domain, MpmSide::new(solver, clocked), own_process)
}

/// Joins the run of `domain` as the bodies and serves until the session is closed.
///
/// # Errors
/// Any [`SessionError`]; it was sent to the coupler.
pub fn serve_dem(
    medium: Medium,
    domain: &Domain,
    solver: &mut dyn DemSolver,
    own_process: bool,
) -> Result<(), SessionError> {
    let clocked = clocked(own_process);
    serve(medium, domain, DemSide::new(solver, clocked), own_process)
}

fn clocked(own_process: bool) -> Clocked {
    if own_process {
        Clocked::Process
    } else {
        Clocked::Thread
    }
}

fn serve<P: Perform>(
    medium: Medium,
    domain: &Domain,
    mut side: Side<P>,
    own_process: bool,
) -> Result<(), SessionError> {
    let party = side.party();
    if own_process && let Some(expected) = started_as().filter(|&expected| expected != party) {
        return Err(say_on_the_wrong_side(
            domain,
            expected,
            side.performer.machine().line().hello(),
        ));
    }
    let mut transport = iceoryx::join(medium, domain, party, &[], SEND_TIMEOUT)?;
    drive(&mut side, &mut *transport);
    side.take_verdict()
}

/// Sends Hello on the channel on which the coupler expects another party, and waits until the session has ended (O-1,
/// D-2).
fn say_on_the_wrong_side(domain: &Domain, expected: Party, hello: Hello) -> SessionError {
    let own = hello.party;
    let notice = encode(&Notice::Hello(hello));
    let header = StepHeader {
        count: notice.len() as u64,
        ..StepHeader::default()
    };
    match iceoryx::say_as(domain, expected, &header, &notice) {
        Ok(_ends) => {
            let start = Instant::now();
            while domain.coupler_lives() && start.elapsed() < GRACE {
                std::thread::sleep(Duration::from_millis(10));
            }
            broken(own, "O-1", 0, format!("started as the {expected}"))
        }
        Err(error) => error.into(),
    }
}

/// The continuum's side.
pub type MpmSide<'a> = Side<MpmPerformer<'a>>;
/// The bodies' side.
pub type DemSide<'a> = Side<DemPerformer<'a>>;

/// A solver's side of a session.
pub struct Side<P: Perform> {
    performer: P,
    action: Action,
    inbox: Inbox,
    watch: Stopwatch,
    clocked: Clocked,
}

/// A machine and the solver that does its tasks.
pub trait Perform {
    /// The machine.
    type Machine: Machine;
    /// The machine.
    fn machine(&mut self) -> &mut Self::Machine;
    /// Lets the solver do a task with the messages received, passes the result to the machine, and sends it if the
    /// machine says so.
    fn perform(&mut self, task: Task, outbox: &mut Outbox<'_>) -> Action;
}

/// What a task may use: the messages received, and the way to send.
pub struct Outbox<'a> {
    inbox: &'a mut Inbox,
    transport: &'a mut dyn Transport,
    watch: &'a mut Stopwatch,
}

impl Outbox<'_> {
    fn forces(&mut self) -> &[ImpForce] {
        match self.inbox.of(Kind::Forces) {
            Payload::Forces(forces) => forces,
            _ => &[],
        }
    }

    fn states(&mut self) -> &[ImpState] {
        match self.inbox.of(Kind::States) {
            Payload::States(states) => states,
            _ => &[],
        }
    }

    fn set(&mut self) -> &[ImpInfo] {
        match self.inbox.of(Kind::Set) {
            Payload::Set(set) => set,
            _ => &[],
        }
    }

    fn envelopes(&mut self) -> &[EnvelopeVertex] {
        match self.inbox.of(Kind::Envelopes) {
            Payload::Envelopes(envelopes) => envelopes,
            _ => &[],
        }
    }

    /// The solver has given `records`, and the machine has returned `action`. Sends the records if the action is to
    /// send them.
    fn send(&mut self, machine: &mut impl Machine, action: Action, records: Records<'_>) -> Action {
        match action {
            Action::Send(channel) if channel.kind == records.kind() => {
                self.watch.lap(Activity::Compute);
                let header = machine.line().header_to_send();
                let event = sent(self.transport, channel, header, records);
                self.watch.lap(Activity::Exchange);
                machine.on(event)
            }
            other => other,
        }
    }
}

/// Sends a message and wakes its receiver.
fn sent(
    transport: &mut dyn Transport,
    channel: Channel,
    header: &StepHeader,
    records: Records<'_>,
) -> Event<'static> {
    match transport.send(channel, header, records) {
        Ok(()) => {
            if channel.wakes() {
                transport.wake(channel.to());
            }
            Event::Sent
        }
        Err(error) => Event::Broken(error.into()),
    }
}

impl<P: Perform> Side<P> {
    fn with(mut performer: P, clocked: Clocked) -> Self {
        let action = performer.machine().start();
        let watch = Stopwatch::start(clocked != Clocked::Shared);
        Self {
            performer,
            action,
            inbox: Inbox::new(),
            watch,
            clocked,
        }
    }

    /// Which side it is.
    pub fn party(&mut self) -> Party {
        self.performer.machine().line().party()
    }

    /// First step that is not done.
    pub fn step(&mut self) -> u64 {
        self.performer.machine().line().step()
    }

    /// How the session ended.
    ///
    /// # Errors
    /// Any [`SessionError`]: that of the session, or that it has not ended.
    pub fn take_verdict(&mut self) -> Result<(), SessionError> {
        let verdict = self.performer.machine().line_mut().take_verdict();
        verdict.unwrap_or_else(|| Err(SessionError::Aborted("the session has not ended".into())))
    }

    /// Adds computing time that the caller has measured, for a side that is [`Clocked::Shared`].
    pub fn book(&mut self, computed: Duration) {
        self.watch.compute_ns += computed.as_nanos() as u64;
    }

    fn on(&mut self, event: Event<'_>) {
        self.action = self.performer.machine().on(event);
    }

    /// Takes the next message of `channel`; returns whether there was one.
    fn take(&mut self, channel: Channel, transport: &mut dyn Transport) -> bool {
        let into = self.inbox.of(channel.kind);
        match transport.receive(channel, into) {
            Ok(None) => return false,
            Ok(Some(header)) => {
                self.watch.lap(Activity::Wait);
                let event = Event::Received(&header, into.records());
                self.action = self.performer.machine().on(event);
            }
            Err(error) => self.on(Event::Broken(error.into())),
        }
        true
    }

    fn send(&mut self, channel: Channel, transport: &mut dyn Transport) {
        self.watch.lap(Activity::Compute);
        let line = self.performer.machine().line_mut();
        if channel.kind == Kind::Report {
            let cpu = match self.clocked {
                Clocked::Process => cpu_ns(true),
                Clocked::Thread => cpu_ns(false),
                Clocked::Shared => self.watch.compute_ns,
            };
            line.stamp(|report| {
                report.compute_ns = self.watch.compute_ns;
                report.exchange_ns = self.watch.exchange_ns;
                report.wait_ns = self.watch.wait_ns;
                report.cpu_ns = cpu;
            });
        }
        // A message without records, on a channel whose records otherwise come from the solver: HALT_BEFORE,
        // WANT_ENVELOPES.
        let empty = Payload::empty(channel.kind);
        let records = line
            .ready_to_send(channel.kind)
            .unwrap_or_else(|| empty.records());
        let event = sent(transport, channel, line.header_to_send(), records);
        self.on(event);
        self.watch.lap(Activity::Exchange);
    }
}

impl<P: Perform> Turns for Side<P> {
    fn turn(&mut self, transport: &mut dyn Transport) -> Turn {
        match self.action {
            Action::Wait(wait) => {
                for channel in wait.on.into_iter().flatten() {
                    if self.take(channel, transport) {
                        return Turn::Went;
                    }
                }
                return Turn::Waits(wait);
            }
            Action::Do(task) => {
                let mut outbox = Outbox {
                    inbox: &mut self.inbox,
                    transport,
                    watch: &mut self.watch,
                };
                self.action = self.performer.perform(task, &mut outbox);
                self.watch.lap(Activity::Compute);
            }
            Action::Send(channel) => self.send(channel, transport),
            Action::Take(channel) => {
                if !self.take(channel, transport) {
                    self.on(Event::Absent);
                }
            }
            Action::Open { coupled } => {
                let opened = transport.open_measurement().and_then(|()| {
                    if coupled {
                        transport.open_exchange()
                    } else {
                        Ok(())
                    }
                });
                let event = match opened {
                    Ok(()) => Event::Opened,
                    Err(error) => Event::Broken(error.into()),
                };
                self.on(event);
            }
            Action::End => return Turn::Ended,
        }
        Turn::Went
    }

    fn look_up(&mut self, transport: &mut dyn Transport) -> bool {
        let orders = Channel::of(self.party(), Kind::Order);
        if self.take(orders, transport) {
            return true;
        }
        if transport.coupler_lives() {
            return false;
        }
        // An Abort may have arrived between the two looks, and it says why.
        if !self.take(orders, transport) {
            self.on(Event::CouplerGone);
        }
        true
    }

    fn expire(&mut self, waited: Duration) {
        self.on(Event::Expired(waited));
    }
}

/// The continuum's machine and solver.
pub struct MpmPerformer<'a> {
    machine: Continuum,
    solver: &'a mut dyn MpmSolver,
}

impl<'a> MpmSide<'a> {
    /// The side of `solver`.
    pub fn new(solver: &'a mut dyn MpmSolver, clocked: Clocked) -> Self {
        let machine = Continuum::new(solver.identity(), solver.capabilities());
        Side::with(MpmPerformer { machine, solver }, clocked)
    }
}

impl Perform for MpmPerformer<'_> {
    type Machine = Continuum;

    fn machine(&mut self) -> &mut Continuum {
        &mut self.machine
    }

    fn perform(&mut self, task: Task, outbox: &mut Outbox<'_>) -> Action {
        let (machine, solver) = (&mut self.machine, &mut *self.solver);
        let done = match task {
            Task::Configure => Done::configure(solver.configure(machine.config()), || {
                if machine.is_coupled() {
                    fastest(&solver.points())
                } else {
                    0.0
                }
            }),
            Task::Restore => Done::restore(solver.restore(machine.restored()), || solver.travel()),
            Task::Save => Done::save(solver.save()),
            Task::Points => {
                let points = solver.points();
                let action = machine.on(Event::Done(Done::Points(&points)));
                return outbox.send(machine, action, Records::Points(&points));
            }
            Task::Measure => {
                let measurement = solver.measurement();
                let groups = Records::Groups(&measurement.groups);
                let measured = Done::Measured(&measurement.ledger, groups);
                let action = machine.on(Event::Done(measured));
                return outbox.send(machine, action, groups);
            }
            Task::Select => {
                let set = solver.select_imps(outbox.envelopes());
                let action = machine.on(Event::Done(Done::Selected(set)));
                return outbox.send(machine, action, Records::Set(set));
            }
            Task::States => {
                let states = solver.imp_states();
                let action = machine.on(Event::Done(Done::States(states)));
                return outbox.send(machine, action, Records::States(states));
            }
            Task::Predict => Done::part(solver.predict(&machine.line().present()), Done::Predicted),
            Task::Correct => match solver.correct(&machine.line().present(), outbox.forces()) {
                Ok(limits) => {
                    let done = Done::Corrected(&limits, solver.travel());
                    return machine.on(Event::Done(done));
                }
                Err(fault) => Done::Failed(fault.into()),
            },
            Task::Envelopes
            | Task::TakeSet
            | Task::Contact
            | Task::Advance
            | Task::ListContacts => {
                unreachable!("{task:?} is for bodies")
            }
        };
        machine.on(Event::Done(done))
    }
}

/// The bodies' machine and solver.
pub struct DemPerformer<'a> {
    machine: Bodies,
    solver: &'a mut dyn DemSolver,
    forces: Vec<ImpForce>,
    /// The contacts in the first step of the window, if a frame is asked for.
    contacts: Vec<ContactState>,
}

impl<'a> DemSide<'a> {
    /// The side of `solver`.
    pub fn new(solver: &'a mut dyn DemSolver, clocked: Clocked) -> Self {
        let machine = Bodies::new(solver.identity(), solver.capabilities());
        let performer = DemPerformer {
            machine,
            solver,
            forces: Vec::new(),
            contacts: Vec::new(),
        };
        Side::with(performer, clocked)
    }
}

impl Perform for DemPerformer<'_> {
    type Machine = Bodies;

    fn machine(&mut self) -> &mut Bodies {
        &mut self.machine
    }

    fn perform(&mut self, task: Task, outbox: &mut Outbox<'_>) -> Action {
        let (machine, solver) = (&mut self.machine, &mut *self.solver);
        let done = match task {
            Task::Configure => Done::configure(solver.configure(machine.config()), || 0.0),
            Task::Restore => Done::restore(solver.restore(machine.restored()), || 0.0),
            Task::Save => Done::save(solver.save()),
            Task::Measure => {
                let measurement = solver.measurement();
                let bodies = Records::Bodies(&measurement.bodies);
                let measured = Done::Measured(&measurement.ledger, bodies);
                let action = machine.on(Event::Done(measured));
                return outbox.send(machine, action, bodies);
            }
            Task::Envelopes => {
                let envelopes = solver.envelopes();
                let action = machine.on(Event::Done(Done::Envelopes(envelopes)));
                return outbox.send(machine, action, Records::Envelopes(envelopes));
            }
            Task::TakeSet => {
                solver.imp_set(outbox.set());
                Done::SetTaken
            }
            Task::Contact => {
                // Forces must not accumulate from one step to the next (F-8).
                let forces = &mut self.forces;
                forces.clear();
                forces.resize(machine.imps(), ImpForce::default());
                let states = outbox.states();
                let states = &states[..forces.len().min(states.len())];
                let step = machine.line().present();
                match solver.contact(&step, states, forces) {
                    Ok(answer) => {
                        if machine.line().is_first_of_frame() {
                            self.contacts = solver.contacts(&step, states);
                        }
                        let action = machine.on(Event::Done(Done::Contacts(&answer, forces)));
                        return outbox.send(machine, action, Records::Forces(forces));
                    }
                    Err(fault) => Done::Failed(fault.into()),
                }
            }
            Task::Advance => Done::part(solver.advance(&machine.line().present()), Done::Advanced),
            Task::ListContacts => {
                let action = machine.on(Event::Done(Done::Listed(&self.contacts)));
                return outbox.send(machine, action, Records::Contacts(&self.contacts));
            }
            Task::Points | Task::Select | Task::States | Task::Predict | Task::Correct => {
                unreachable!("{task:?} is for the continuum")
            }
        };
        machine.on(Event::Done(done))
    }
}
