//! The raw ends of a run, for those who examine a solver or play a broken one.
//!
//! A [`Stage`] creates every channel of a run for one solver and holds all other ends: the coupler's and the peer's. A
//! [`Seat`] is the solver's end. Both send and receive [`Message`]s as they are: any header, any records, any bytes,
//! in any order. Nothing is checked here; that is the point. Solvers and the coupler use [`crate::session`].

use std::time::Duration;

use iceoryx2::prelude::Service;
use serde::Serialize;

pub use crate::channel::ChannelError;
use crate::channel::{
    BODIES, Bell, Channel, ENVELOPES, GROUPS, IMP_FORCES, IMP_SET, IMP_STATES, Inlet, Made, Outlet,
    POINTS, Post, Rope, seat,
};
use crate::codec::{decode, encode};
use crate::control::{Notice, Order, Party};
use crate::domain::{Domain, OwnedDomain};
use crate::recording;
use crate::wire::{
    BodyState, EnvelopeVertex, Grant, GroupState, ImpForce, ImpInfo, ImpState, PointState, Record,
    Report, StepHeader,
};
use crate::{OneProcess, SharedMemory};

/// Longest that a send waits for room: who examines a solver that takes nothing wants to know soon.
const ROOM: Duration = Duration::from_secs(1);

/// Over what the parties talk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    /// Between processes: [`SharedMemory`].
    Processes,
    /// Between threads of this process: [`OneProcess`].
    Threads,
}

/// A channel of a run, by what it carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum Kind {
    /// `dem/orders` or `mpm/orders`.
    Order,
    /// `dem/notices` or `mpm/notices`.
    Notice,
    /// `dem/grants` or `mpm/grants`.
    Grant,
    /// `dem/reports` or `mpm/reports`.
    Report,
    /// `mpm/groups`.
    Groups,
    /// `mpm/points`.
    Points,
    /// `dem/bodies`.
    Bodies,
    /// `imp/set`.
    Set,
    /// `imp/states`.
    States,
    /// `imp/forces`.
    Forces,
    /// `imp/envelopes`.
    Envelopes,
}

impl Kind {
    /// All channels.
    pub const ALL: [Self; 11] = [
        Self::Order,
        Self::Notice,
        Self::Grant,
        Self::Report,
        Self::Groups,
        Self::Points,
        Self::Bodies,
        Self::Set,
        Self::States,
        Self::Forces,
        Self::Envelopes,
    ];

    /// Who sends and who receives, in a run of this solver.
    pub fn ends(self, solver: Party) -> (Party, Party) {
        match self {
            Self::Order | Self::Grant => (Party::Coupler, solver),
            Self::Notice | Self::Report => (solver, Party::Coupler),
            Self::Groups | Self::Points => (Party::Mpm, Party::Coupler),
            Self::Bodies => (Party::Dem, Party::Coupler),
            Self::Set | Self::States => (Party::Mpm, Party::Dem),
            Self::Forces | Self::Envelopes => (Party::Dem, Party::Mpm),
        }
    }

    /// Name of the channel in a run of this solver.
    pub fn channel(self, solver: Party) -> &'static str {
        let seat = || seat(solver);
        match self {
            Self::Order => seat().orders.name,
            Self::Notice => seat().notices.name,
            Self::Grant => seat().grants.name,
            Self::Report => seat().reports.name,
            Self::Groups => GROUPS.name,
            Self::Points => POINTS.name,
            Self::Bodies => BODIES.name,
            Self::Set => IMP_SET.name,
            Self::States => IMP_STATES.name,
            Self::Forces => IMP_FORCES.name,
            Self::Envelopes => ENVELOPES.name,
        }
    }

    /// What the channel of this name carries, if this solver has an end of it.
    pub fn of_channel(name: &str, solver: Party) -> Option<Self> {
        let its = |kind: &Self| {
            let (from, to) = kind.ends(solver);
            kind.channel(solver) == name && (from == solver || to == solver)
        };
        Self::ALL.into_iter().find(its)
    }

    /// Whether a ring of the bell follows (B-2): others are followed by a message that has one.
    pub fn rings(self) -> bool {
        !matches!(self, Self::Set | Self::Groups | Self::Points | Self::Bodies)
    }
}

/// What a message carries: bytes, or records.
#[derive(Debug, Clone, PartialEq)]
pub enum Payload {
    /// An order's bytes.
    Order(Vec<u8>),
    /// A notice's bytes.
    Notice(Vec<u8>),
    /// Grants; one in a message of a coupler that keeps G-1.
    Grant(Vec<Grant>),
    /// Reports, likewise.
    Report(Vec<Report>),
    /// Point groups.
    Groups(Vec<GroupState>),
    /// Material points.
    Points(Vec<PointState>),
    /// Bodies.
    Bodies(Vec<BodyState>),
    /// An IMP set.
    Set(Vec<ImpInfo>),
    /// States of IMPs.
    States(Vec<ImpState>),
    /// Forces on IMPs.
    Forces(Vec<ImpForce>),
    /// Outlines of bodies.
    Envelopes(Vec<EnvelopeVertex>),
}

/// The same for every kind of payload.
macro_rules! each {
    ($payload:expr, $records:ident => $value:expr) => {
        match $payload {
            Payload::Order($records) => $value,
            Payload::Notice($records) => $value,
            Payload::Grant($records) => $value,
            Payload::Report($records) => $value,
            Payload::Groups($records) => $value,
            Payload::Points($records) => $value,
            Payload::Bodies($records) => $value,
            Payload::Set($records) => $value,
            Payload::States($records) => $value,
            Payload::Forces($records) => $value,
            Payload::Envelopes($records) => $value,
        }
    };
}

impl Payload {
    /// The channel that it belongs on.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Order(_) => Kind::Order,
            Self::Notice(_) => Kind::Notice,
            Self::Grant(_) => Kind::Grant,
            Self::Report(_) => Kind::Report,
            Self::Groups(_) => Kind::Groups,
            Self::Points(_) => Kind::Points,
            Self::Bodies(_) => Kind::Bodies,
            Self::Set(_) => Kind::Set,
            Self::States(_) => Kind::States,
            Self::Forces(_) => Kind::Forces,
            Self::Envelopes(_) => Kind::Envelopes,
        }
    }

    /// Number of bytes or records.
    pub fn len(&self) -> usize {
        each!(self, records => records.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A message as it is on the wire.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// As sent, or to be sent as it is: `count` may be wrong.
    pub header: StepHeader,
    /// What follows.
    pub payload: Payload,
}

impl Message {
    /// A message whose header has the right count.
    pub fn new(header: StepHeader, payload: Payload) -> Self {
        let count = payload.len() as u64;
        Self {
            header: StepHeader { count, ..header },
            payload,
        }
    }

    /// A message of a recording; `None` if it does not consist of whole records.
    pub fn recorded(kind: Kind, message: &recording::Message) -> Option<Self> {
        let payload = match kind {
            Kind::Order => Payload::Order(message.payload.clone()),
            Kind::Notice => Payload::Notice(message.payload.clone()),
            Kind::Grant => Payload::Grant(message.records()?),
            Kind::Report => Payload::Report(message.records()?),
            Kind::Groups => Payload::Groups(message.records()?),
            Kind::Points => Payload::Points(message.records()?),
            Kind::Bodies => Payload::Bodies(message.records()?),
            Kind::Set => Payload::Set(message.records()?),
            Kind::States => Payload::States(message.records()?),
            Kind::Forces => Payload::Forces(message.records()?),
            Kind::Envelopes => Payload::Envelopes(message.records()?),
        };
        Some(Self {
            header: message.header,
            payload,
        })
    }

    /// An order as a coupler sends it.
    pub fn order(order: &Order) -> Self {
        Self::new(StepHeader::default(), Payload::Order(encode(order)))
    }

    /// A notice as a solver sends it at `step`.
    pub fn notice(step: u64, notice: &Notice) -> Self {
        let header = StepHeader {
            step,
            ..StepHeader::default()
        };
        Self::new(header, Payload::Notice(encode(notice)))
    }

    /// The channel that it belongs on.
    pub fn kind(&self) -> Kind {
        self.payload.kind()
    }

    /// The order in it.
    ///
    /// # Errors
    /// Why it is none.
    pub fn as_order(&self) -> Result<Order, String> {
        match &self.payload {
            Payload::Order(bytes) => decode(bytes).map_err(|e| e.to_string()),
            other => Err(format!("{:?} instead of an order", other.kind())),
        }
    }

    /// The notice in it.
    ///
    /// # Errors
    /// Why it is none.
    pub fn as_notice(&self) -> Result<Notice, String> {
        match &self.payload {
            Payload::Notice(bytes) => decode(bytes).map_err(|e| e.to_string()),
            other => Err(format!("{:?} instead of a notice", other.kind())),
        }
    }
}

/// The other ends of one solver's run: the coupler's and the peer's. Dropping it ends the run as a coupler's death does.
pub struct Stage {
    solver: Party,
    ports: Box<dyn AnyPorts>,
    made: Vec<Made>,
    // Last, so that the ports are gone before the directory is.
    domain: OwnedDomain,
}

impl Stage {
    /// Creates every channel that `solver` may open, those of a coupled run included.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn open(medium: Medium, solver: Party) -> Result<Self, ChannelError> {
        let domain = OwnedDomain::create()?;
        let (ports, made) = match medium {
            Medium::Processes => stage_ports::<SharedMemory>(domain.domain(), solver)?,
            Medium::Threads => stage_ports::<OneProcess>(domain.domain(), solver)?,
        };
        Ok(Self {
            solver,
            ports,
            made,
            domain,
        })
    }

    /// The run's names, by which the solver joins.
    pub fn domain(&self) -> &Domain {
        self.domain.domain()
    }

    /// To the solver the coupler is gone from now on, though the channels are still there.
    pub fn release(&self) {
        self.domain.release();
    }

    /// Sends a message as it is, without a bell.
    ///
    /// # Errors
    /// [`ChannelError::Full`] when the solver takes nothing.
    pub fn send_silently(&self, message: &Message) -> Result<(), ChannelError> {
        self.ports.send(message)
    }

    /// Sends a message as it is, with the bell of B-2.
    ///
    /// # Errors
    /// [`ChannelError::Full`] when the solver takes nothing.
    pub fn send(&self, message: &Message) -> Result<(), ChannelError> {
        send_and_ring(&*self.ports, message, self.solver)
    }

    /// The next message of this kind, if there is one.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn receive(&self, kind: Kind) -> Result<Option<Message>, ChannelError> {
        self.ports.receive(kind)
    }

    /// Sleeps until the bell that goes with this kind rings, for `nap` at most; returns how often it rang.
    pub fn sleep(&self, kind: Kind, nap: Duration) -> u64 {
        let (from, to) = kind.ends(self.solver);
        self.ports.sleep(from, to, nap)
    }

    /// Channels and bells that the solver has not opened at its end.
    pub fn unopened(&self) -> Vec<&str> {
        let theirs = |made: &&Made| {
            let (senders, receivers) = made.service.ends();
            (made.from == self.solver && senders == 0) || (made.to == self.solver && receivers == 0)
        };
        self.made
            .iter()
            .filter(theirs)
            .map(|made| made.name.as_str())
            .collect()
    }
}

/// A solver's end of a run.
pub struct Seat {
    solver: Party,
    domain: Domain,
    ports: Box<dyn AnyPorts>,
}

impl Seat {
    /// Joins a run, with the channels and bells that a solver opens before its Hello.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn join(medium: Medium, domain: &Domain, solver: Party) -> Result<Self, ChannelError> {
        let ports = match medium {
            Medium::Processes => seat_ports::<SharedMemory>(domain, solver)?,
            Medium::Threads => seat_ports::<OneProcess>(domain, solver)?,
        };
        Ok(Self {
            solver,
            domain: domain.clone(),
            ports,
        })
    }

    /// Opens where the solver measures to: before its Ready.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn open_measurement(&mut self) -> Result<(), ChannelError> {
        self.ports.open_measurement(self.solver)
    }

    /// Opens the channels and bells between the solvers, in a coupled run: before its Ready.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn open_exchange(&mut self) -> Result<(), ChannelError> {
        self.ports.open_exchange()
    }

    /// Whether the coupler lives.
    pub fn coupler_lives(&self) -> bool {
        self.domain.coupler_lives()
    }

    /// Sends a message as it is, without a bell.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn send_silently(&self, message: &Message) -> Result<(), ChannelError> {
        self.ports.send(message)
    }

    /// Sends a message as it is, with the bell of B-2.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn send(&self, message: &Message) -> Result<(), ChannelError> {
        send_and_ring(&*self.ports, message, self.solver)
    }

    /// The next message of this kind, if there is one.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn receive(&self, kind: Kind) -> Result<Option<Message>, ChannelError> {
        self.ports.receive(kind)
    }

    /// Sleeps until the bell that goes with this kind rings, for `nap` at most; returns how often it rang.
    pub fn sleep(&self, kind: Kind, nap: Duration) -> u64 {
        let (from, to) = kind.ends(self.solver);
        self.ports.sleep(from, to, nap)
    }
}

fn send_and_ring(
    ports: &dyn AnyPorts,
    message: &Message,
    solver: Party,
) -> Result<(), ChannelError> {
    ports.send(message)?;
    let kind = message.kind();
    if kind.rings() {
        let (from, to) = kind.ends(solver);
        ports.ring(from, to);
    }
    Ok(())
}

/// Ports over either medium.
trait AnyPorts {
    fn send(&self, message: &Message) -> Result<(), ChannelError>;
    fn receive(&self, kind: Kind) -> Result<Option<Message>, ChannelError>;
    fn ring(&self, from: Party, to: Party);
    fn sleep(&self, from: Party, to: Party, nap: Duration) -> u64;
    fn open_measurement(&mut self, solver: Party) -> Result<(), ChannelError>;
    fn open_exchange(&mut self) -> Result<(), ChannelError>;
}

fn stage_ports<S: Service + 'static>(
    domain: &Domain,
    solver: Party,
) -> Result<(Box<dyn AnyPorts>, Vec<Made>), ChannelError> {
    let post = Post::<S>::open(domain, Party::Coupler)?.with_room(ROOM);
    let mut made = post.create_all(&[Party::Mpm, Party::Dem])?;
    // The peer's line to the coupler has both of its ends here.
    made.retain(|made| made.from == solver || made.to == solver);
    let others = [Party::Coupler, Party::Mpm, Party::Dem];
    let mine = others.into_iter().filter(|&party| party != solver);
    let mut ports = Ports::new(post, mine.collect());
    ports.open_line(solver)?;
    ports.open_measurement(solver)?;
    ports.open_exchange()?;
    Ok((Box::new(ports), made))
}

fn seat_ports<S: Service + 'static>(
    domain: &Domain,
    solver: Party,
) -> Result<Box<dyn AnyPorts>, ChannelError> {
    let post = Post::<S>::open(domain, solver)?.with_room(ROOM);
    let mut ports = Ports::new(post, vec![solver]);
    ports.open_line(solver)?;
    Ok(Box::new(ports))
}

/// An end of one channel, if there is one here.
enum Port<S: Service, T: Record> {
    Absent,
    Out(Outlet<S, T>),
    In(Inlet<S, T>),
}

impl<S: Service + 'static, T: Record> Port<S, T> {
    fn send(&self, header: StepHeader, records: &[T]) -> Result<(), ChannelError> {
        match self {
            Self::Out(outlet) => outlet.send_as_is(header, records),
            _ => Err(ChannelError::NotHere),
        }
    }

    fn receive(
        &self,
        payload: impl FnOnce(Vec<T>) -> Payload,
    ) -> Result<Option<Message>, ChannelError> {
        let Self::In(inlet) = self else {
            return Ok(None);
        };
        let mut records = Vec::new();
        let header = inlet.receive(&mut records)?;
        Ok(header.map(|header| Message {
            header,
            payload: payload(records),
        }))
    }
}

/// The ends of some parties in one run.
struct Ports<S: Service> {
    mine: Vec<Party>,
    orders: Port<S, u8>,
    notices: Port<S, u8>,
    grants: Port<S, Grant>,
    reports: Port<S, Report>,
    groups: Port<S, GroupState>,
    points: Port<S, PointState>,
    bodies: Port<S, BodyState>,
    set: Port<S, ImpInfo>,
    states: Port<S, ImpState>,
    forces: Port<S, ImpForce>,
    envelopes: Port<S, EnvelopeVertex>,
    ropes: Vec<(Party, Party, Rope<S>)>,
    bells: Vec<(Party, Party, Bell<S>)>,
    // Last: the node outlives its ports.
    post: Post<S>,
}

impl<S: Service + 'static> Ports<S> {
    fn new(post: Post<S>, mine: Vec<Party>) -> Self {
        Self {
            mine,
            orders: Port::Absent,
            notices: Port::Absent,
            grants: Port::Absent,
            reports: Port::Absent,
            groups: Port::Absent,
            points: Port::Absent,
            bodies: Port::Absent,
            set: Port::Absent,
            states: Port::Absent,
            forces: Port::Absent,
            envelopes: Port::Absent,
            ropes: Vec::new(),
            bells: Vec::new(),
            post,
        }
    }

    fn port<T: Record>(
        &self,
        channel: &Channel<T>,
        (from, to): (Party, Party),
    ) -> Result<Port<S, T>, ChannelError> {
        Ok(match (self.mine.contains(&from), self.mine.contains(&to)) {
            (true, false) => Port::Out(self.post.outlet(channel)?),
            (false, true) => Port::In(self.post.inlet(channel)?),
            _ => Port::Absent,
        })
    }

    /// The bells between two parties, both ways.
    fn open_bells(&mut self, one: Party, other: Party) -> Result<(), ChannelError> {
        for (from, to) in [(one, other), (other, one)] {
            match (self.mine.contains(&from), self.mine.contains(&to)) {
                (true, false) => self.ropes.push((from, to, self.post.rope(from, to)?)),
                (false, true) => self.bells.push((from, to, self.post.bell(from, to)?)),
                _ => {}
            }
        }
        Ok(())
    }

    fn open_line(&mut self, solver: Party) -> Result<(), ChannelError> {
        let seat = seat(solver);
        self.orders = self.port(&seat.orders, Kind::Order.ends(solver))?;
        self.notices = self.port(&seat.notices, Kind::Notice.ends(solver))?;
        self.grants = self.port(&seat.grants, Kind::Grant.ends(solver))?;
        self.reports = self.port(&seat.reports, Kind::Report.ends(solver))?;
        self.open_bells(Party::Coupler, solver)
    }
}

impl<S: Service + 'static> AnyPorts for Ports<S> {
    fn send(&self, message: &Message) -> Result<(), ChannelError> {
        let header = message.header;
        match &message.payload {
            Payload::Order(bytes) => self.orders.send(header, bytes),
            Payload::Notice(bytes) => self.notices.send(header, bytes),
            Payload::Grant(records) => self.grants.send(header, records),
            Payload::Report(records) => self.reports.send(header, records),
            Payload::Groups(records) => self.groups.send(header, records),
            Payload::Points(records) => self.points.send(header, records),
            Payload::Bodies(records) => self.bodies.send(header, records),
            Payload::Set(records) => self.set.send(header, records),
            Payload::States(records) => self.states.send(header, records),
            Payload::Forces(records) => self.forces.send(header, records),
            Payload::Envelopes(records) => self.envelopes.send(header, records),
        }
    }

    fn receive(&self, kind: Kind) -> Result<Option<Message>, ChannelError> {
        match kind {
            Kind::Order => self.orders.receive(Payload::Order),
            Kind::Notice => self.notices.receive(Payload::Notice),
            Kind::Grant => self.grants.receive(Payload::Grant),
            Kind::Report => self.reports.receive(Payload::Report),
            Kind::Groups => self.groups.receive(Payload::Groups),
            Kind::Points => self.points.receive(Payload::Points),
            Kind::Bodies => self.bodies.receive(Payload::Bodies),
            Kind::Set => self.set.receive(Payload::Set),
            Kind::States => self.states.receive(Payload::States),
            Kind::Forces => self.forces.receive(Payload::Forces),
            Kind::Envelopes => self.envelopes.receive(Payload::Envelopes),
        }
    }

    fn ring(&self, from: Party, to: Party) {
        let ropes = self.ropes.iter();
        for (_, _, rope) in ropes.filter(|(f, t, _)| (*f, *t) == (from, to)) {
            rope.ring();
        }
    }

    fn sleep(&self, from: Party, to: Party, nap: Duration) -> u64 {
        let mut bells = self.bells.iter();
        if let Some((_, _, bell)) = bells.find(|(f, t, _)| (*f, *t) == (from, to)) {
            bell.rings(nap)
        } else {
            std::thread::sleep(nap);
            0
        }
    }

    fn open_measurement(&mut self, solver: Party) -> Result<(), ChannelError> {
        if solver == Party::Mpm {
            self.groups = self.port(&GROUPS, Kind::Groups.ends(solver))?;
            self.points = self.port(&POINTS, Kind::Points.ends(solver))?;
        } else {
            self.bodies = self.port(&BODIES, Kind::Bodies.ends(solver))?;
        }
        Ok(())
    }

    fn open_exchange(&mut self) -> Result<(), ChannelError> {
        // These have the same ends whichever solver it is.
        let (there, back) = ((Party::Mpm, Party::Dem), (Party::Dem, Party::Mpm));
        self.set = self.port(&IMP_SET, there)?;
        self.states = self.port(&IMP_STATES, there)?;
        self.forces = self.port(&IMP_FORCES, back)?;
        self.envelopes = self.port(&ENVELOPES, back)?;
        self.open_bells(Party::Mpm, Party::Dem)
    }
}
