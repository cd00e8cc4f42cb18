//! Typed channels over an iceoryx2 service type: shared memory between processes (`ipc`) or within one (`local`).
//!
//! A channel has one sender and one receiver, carries slices of one record type with a [`StepHeader`], never drops and
//! never overwrites. Lockstep keeps at most a few messages in flight, so a full channel means that the receiver is
//! gone, and sending then fails after the deadline instead of blocking for ever.
//!
//! Each ordered pair of parties has one bell. iceoryx2 0.10 loses wakeups when a listener has two notifiers; with one
//! it does not, and every wait looks again after a nap anyway.

use core::marker::PhantomData;
use std::time::Duration;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::{BackpressureAction, BackpressureInfo};
use iceoryx2::prelude::{
    AllocationStrategy, AttributeSpecifier, AttributeVerifier, BackpressureStrategy, Node,
    NodeBuilder, Service, SignalHandlingMode,
};
use iceoryx2::service::port_factory::{PortFactory as _, event, publish_subscribe};
use thiserror::Error;

use crate::control::Party;
use crate::domain::{Domain, DomainError};
use crate::recording::Tape;
use crate::wire::{
    BodyState, EnvelopeVertex, Grant, GroupState, ImpForce, ImpInfo, ImpState, Number, PointState,
    Record, Report, StepHeader, layout_hash,
};

/// A channel could not be made, opened or used.
#[derive(Debug, Error)]
pub enum ChannelError {
    /// The run's names cannot be used.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// The transport refused; its own words follow.
    #[error("channel {channel}: cannot {action}: {reason}")]
    Transport {
        /// Name of the channel.
        channel: String,
        /// What was tried.
        action: &'static str,
        /// The transport's error.
        reason: String,
    },
    /// This end has no sender of the channel.
    #[error("the sending end of this channel is not open here")]
    NotHere,
    /// The receiver has not taken what was sent before.
    #[error("channel {channel}: full; the receiver takes nothing")]
    Full {
        /// Name of the channel.
        channel: String,
    },
}

fn transport<E: core::fmt::Debug>(
    channel: &str,
    action: &'static str,
) -> impl FnOnce(E) -> ChannelError {
    move |e| ChannelError::Transport {
        channel: channel.to_string(),
        action,
        reason: format!("{e:?}"),
    }
}

/// Name and record of a channel.
pub(crate) struct Channel<T> {
    pub(crate) name: &'static str,
    /// Records of the first segment; it grows by doubling.
    first_length: usize,
    record: PhantomData<fn() -> T>,
}

impl<T> Channel<T> {
    const fn new(name: &'static str) -> Self {
        Self {
            name,
            first_length: 64,
            record: PhantomData,
        }
    }

    /// For last words: a message for which the segment must grow is lost when its sender ends before the receiver
    /// has seen the new segment.
    const fn with_room(name: &'static str, first_length: usize) -> Self {
        Self {
            first_length,
            ..Self::new(name)
        }
    }
}

/// The channels of one solver to and from the coupler.
pub(crate) struct Seat {
    pub(crate) party: Party,
    pub(crate) orders: Channel<u8>,
    pub(crate) notices: Channel<u8>,
    pub(crate) grants: Channel<Grant>,
    pub(crate) reports: Channel<Report>,
}

pub(crate) const MPM_SEAT: Seat = Seat {
    party: Party::Mpm,
    orders: Channel::new("mpm/orders"),
    notices: Channel::with_room("mpm/notices", NOTICE_BYTES),
    grants: Channel::new("mpm/grants"),
    reports: Channel::new("mpm/reports"),
};
pub(crate) const DEM_SEAT: Seat = Seat {
    party: Party::Dem,
    orders: Channel::new("dem/orders"),
    notices: Channel::with_room("dem/notices", NOTICE_BYTES),
    grants: Channel::new("dem/grants"),
    reports: Channel::new("dem/reports"),
};
/// The seat of a solver.
pub(crate) fn seat(party: Party) -> &'static Seat {
    match party {
        Party::Mpm => &MPM_SEAT,
        Party::Dem => &DEM_SEAT,
        Party::Coupler => unreachable!("the coupler has no seat at its own table"),
    }
}

// From the continuum to the coupler.
pub(crate) const GROUPS: Channel<GroupState> = Channel::new("mpm/groups");
pub(crate) const POINTS: Channel<PointState> = Channel::new("mpm/points");
// From the bodies to the coupler.
pub(crate) const BODIES: Channel<BodyState> = Channel::new("dem/bodies");
// From the continuum to the bodies.
pub(crate) const IMP_SET: Channel<ImpInfo> = Channel::new("imp/set");
pub(crate) const IMP_STATES: Channel<ImpState> = Channel::new("imp/states");
// From the bodies to the continuum.
pub(crate) const IMP_FORCES: Channel<ImpForce> = Channel::new("imp/forces");
pub(crate) const ENVELOPES: Channel<EnvelopeVertex> = Channel::new("imp/envelopes");

/// Names of all channels, by the number that they have in a recording.
pub(crate) const CHANNELS: [&str; 15] = [
    MPM_SEAT.orders.name,
    MPM_SEAT.notices.name,
    MPM_SEAT.grants.name,
    MPM_SEAT.reports.name,
    DEM_SEAT.orders.name,
    DEM_SEAT.notices.name,
    DEM_SEAT.grants.name,
    DEM_SEAT.reports.name,
    GROUPS.name,
    POINTS.name,
    BODIES.name,
    IMP_SET.name,
    IMP_STATES.name,
    IMP_FORCES.name,
    ENVELOPES.name,
];

/// Plain bytes are a record too: control messages are slices of them.
impl Record for u8 {
    const LAYOUT: &'static str = "u8:1{}";
    fn check(&self) -> Result<(), &'static str> {
        Ok(())
    }
    fn write(&self, bytes: &mut [u8]) {
        bytes[0] = *self;
    }
    fn read(bytes: &[u8]) -> Self {
        bytes[0]
    }
    fn visit(&self, see: &mut dyn FnMut(&'static str, Number)) {
        see("byte", Number::Count((*self).into()));
    }
}

/// Messages that may wait in a channel. Lockstep needs two; a failure notice and a goodbye may follow a report.
const BUFFER: usize = 4;
/// The same between the solvers of a recorded run: more than cross while the tap sleeps.
const RECORDED_BUFFER: usize = 64;
/// More than any notice takes; the memory is reserved, not touched.
const NOTICE_BYTES: usize = 64 << 10;
const LAYOUT_KEY: &str = "layout";

/// Longest that a send waits for room. In lockstep there always is room, unless the receiver takes nothing any more.
const ROOM: Duration = Duration::from_secs(10);

/// A party's place in a run's corner.
pub(crate) struct Post<S: Service> {
    node: Node<S>,
    /// Where everything that is sent and received here is noted.
    tape: Option<Tape>,
    /// Longest that a send waits for room.
    room: Duration,
}

impl<S: Service + 'static> Post<S> {
    /// Opens the corner for `party`.
    pub(crate) fn open(domain: &Domain, party: Party) -> Result<Self, ChannelError> {
        let name = party
            .name()
            .try_into()
            .map_err(transport("node", "name it"))?;
        let node = NodeBuilder::new()
            .name(&name)
            .config(&domain.config()?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<S>()
            .map_err(transport("node", "create it"))?;
        Ok(Self {
            node,
            tape: None,
            room: ROOM,
        })
    }

    /// The same, noting everything that is sent and received. What it creates between the solvers has room for a tap.
    pub(crate) fn recording(self, tape: Tape) -> Self {
        Self {
            tape: Some(tape),
            ..self
        }
    }

    /// The same, giving up on a full channel after `room`.
    pub(crate) fn with_room(self, room: Duration) -> Self {
        Self { room, ..self }
    }

    /// Creates every channel and bell of a run with these solvers (the coupler's privilege), to be kept for as long as
    /// the run lasts.
    pub(crate) fn create_all(&self, solvers: &[Party]) -> Result<Vec<Made>, ChannelError> {
        let mut made = Vec::new();
        for &party in solvers {
            let seat = seat(party);
            made.push(self.create(&seat.orders, Party::Coupler, party)?);
            made.push(self.create(&seat.notices, party, Party::Coupler)?);
            made.push(self.create(&seat.grants, Party::Coupler, party)?);
            made.push(self.create(&seat.reports, party, Party::Coupler)?);
            made.push(self.create_bell(Party::Coupler, party)?);
            made.push(self.create_bell(party, Party::Coupler)?);
        }
        if solvers.contains(&Party::Mpm) {
            made.push(self.create(&GROUPS, Party::Mpm, Party::Coupler)?);
            made.push(self.create(&POINTS, Party::Mpm, Party::Coupler)?);
        }
        if solvers.contains(&Party::Dem) {
            made.push(self.create(&BODIES, Party::Dem, Party::Coupler)?);
        }
        if solvers.len() == 2 {
            made.push(self.create(&IMP_SET, Party::Mpm, Party::Dem)?);
            made.push(self.create(&IMP_STATES, Party::Mpm, Party::Dem)?);
            made.push(self.create(&IMP_FORCES, Party::Dem, Party::Mpm)?);
            made.push(self.create(&ENVELOPES, Party::Dem, Party::Mpm)?);
            made.push(self.create_bell(Party::Mpm, Party::Dem)?);
            made.push(self.create_bell(Party::Dem, Party::Mpm)?);
        }
        Ok(made)
    }

    fn create<T: Record>(
        &self,
        channel: &Channel<T>,
        from: Party,
        to: Party,
    ) -> Result<Made, ChannelError> {
        let mut layout = AttributeSpecifier::new();
        layout = define_layout(layout).map_err(transport(channel.name, "describe it"))?;
        let service = self
            .builder(channel)?
            .create_with_attributes(&layout)
            .map_err(transport(channel.name, "create it"))?;
        Ok(Made {
            name: channel.name.to_string(),
            from,
            to,
            service: Box::new(service),
        })
    }

    /// Creates the bell that `from` rings at `to`.
    fn create_bell(&self, from: Party, to: Party) -> Result<Made, ChannelError> {
        let name = bell_name(from, to);
        let service = self
            .event(&name)?
            .max_notifiers(1)
            .max_listeners(1)
            .max_nodes(3)
            .create()
            .map_err(transport(&name, "create it"))?;
        Ok(Made {
            name,
            from,
            to,
            service: Box::new(service),
        })
    }

    fn event(
        &self,
        name: &str,
    ) -> Result<iceoryx2::service::builder::event::Builder<S>, ChannelError> {
        let service = name.try_into().map_err(transport(name, "name it"))?;
        Ok(self.node.service_builder(&service).event())
    }

    fn builder<T: Record>(
        &self,
        channel: &Channel<T>,
    ) -> Result<
        iceoryx2::service::builder::publish_subscribe::Builder<[T], StepHeader, S>,
        ChannelError,
    > {
        let tapped = self.tape.is_some() && channel.name.starts_with("imp/");
        let (subscribers, buffer) = if tapped {
            (2, RECORDED_BUFFER)
        } else {
            (1, BUFFER)
        };
        Ok(self
            .node
            .service_builder(
                &channel
                    .name
                    .try_into()
                    .map_err(transport(channel.name, "name it"))?,
            )
            .publish_subscribe::<[T]>()
            .user_header::<StepHeader>()
            .max_publishers(1)
            .max_subscribers(subscribers)
            .max_nodes(2 + subscribers)
            .subscriber_max_buffer_size(buffer)
            .subscriber_max_borrowed_samples(1)
            .history_size(0)
            .enable_safe_overflow(false))
    }

    fn service<T: Record>(
        &self,
        channel: &Channel<T>,
    ) -> Result<publish_subscribe::PortFactory<S, [T], StepHeader>, ChannelError> {
        let layout = require_layout().map_err(transport(channel.name, "describe it"))?;
        self.builder(channel)?
            .open_with_attributes(&layout)
            .map_err(transport(channel.name, "open it"))
    }

    /// The sending end.
    pub(crate) fn outlet<T: Record>(
        &self,
        channel: &Channel<T>,
    ) -> Result<Outlet<S, T>, ChannelError> {
        let room = self.room;
        let publisher = self
            .service(channel)?
            .publisher_builder()
            .initial_max_slice_len(channel.first_length)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::RetryUntilDelivered)
            .set_backpressure_handler(move |info: &BackpressureInfo| {
                if info.elapsed_time > room {
                    BackpressureAction::DiscardDataAndFail
                } else {
                    BackpressureAction::Retry
                }
            })
            .create()
            .map_err(transport(channel.name, "send on it"))?;
        Ok(Outlet {
            publisher,
            name: channel.name,
            tape: self.tape_of(channel),
        })
    }

    /// The receiving end.
    pub(crate) fn inlet<T: Record>(
        &self,
        channel: &Channel<T>,
    ) -> Result<Inlet<S, T>, ChannelError> {
        let subscriber = self
            .service(channel)?
            .subscriber_builder()
            .create()
            .map_err(transport(channel.name, "receive from it"))?;
        Ok(Inlet {
            subscriber,
            name: channel.name,
            tape: self.tape_of(channel),
        })
    }

    fn tape_of<T>(&self, channel: &Channel<T>) -> Option<(Tape, u8)> {
        let number = CHANNELS.iter().position(|name| *name == channel.name);
        self.tape
            .clone()
            .zip(number.and_then(|number| u8::try_from(number).ok()))
    }

    /// The end of the bell that rings.
    pub(crate) fn rope(&self, from: Party, to: Party) -> Result<Rope<S>, ChannelError> {
        let name = bell_name(from, to);
        let service = self
            .event(&name)?
            .open()
            .map_err(transport(&name, "open it"))?;
        Ok(Rope(
            service
                .notifier_builder()
                .create()
                .map_err(transport(&name, "ring it"))?,
        ))
    }

    /// The end of the bell that wakes.
    pub(crate) fn bell(&self, from: Party, to: Party) -> Result<Bell<S>, ChannelError> {
        let name = bell_name(from, to);
        let service = self
            .event(&name)?
            .open()
            .map_err(transport(&name, "open it"))?;
        Ok(Bell(
            service
                .listener_builder()
                .create()
                .map_err(transport(&name, "listen to it"))?,
        ))
    }
}

fn bell_name(from: Party, to: Party) -> String {
    format!("bell/{from}-{to}")
}

fn define_layout(
    attributes: AttributeSpecifier,
) -> Result<AttributeSpecifier, impl core::fmt::Debug> {
    let hash = layout_hash();
    attributes.define(
        &LAYOUT_KEY.try_into().expect("a short ASCII key"),
        &hash.as_str().try_into().expect("16 hexadecimal digits"),
    )
}

fn require_layout() -> Result<AttributeVerifier, impl core::fmt::Debug> {
    let hash = layout_hash();
    AttributeVerifier::new().require(
        &LAYOUT_KEY.try_into().expect("a short ASCII key"),
        &hash.as_str().try_into().expect("16 hexadecimal digits"),
    )
}

/// A channel or bell that was created. It exists for as long as somebody holds it.
pub(crate) struct Made {
    pub(crate) name: String,
    pub(crate) from: Party,
    pub(crate) to: Party,
    pub(crate) service: Box<dyn Ends>,
}

/// How many hold a sending and a receiving end at present.
pub(crate) trait Ends {
    fn ends(&self) -> (usize, usize);
}

impl<S: Service, T: Record> Ends for publish_subscribe::PortFactory<S, [T], StepHeader> {
    fn ends(&self) -> (usize, usize) {
        let open = self.dynamic_config();
        (open.number_of_publishers(), open.number_of_subscribers())
    }
}

impl<S: Service> Ends for event::PortFactory<S> {
    fn ends(&self) -> (usize, usize) {
        let open = self.dynamic_config();
        (open.number_of_notifiers(), open.number_of_listeners())
    }
}

/// The sending end of a channel.
pub(crate) struct Outlet<S: Service, T: Record> {
    publisher: Publisher<S, [T], StepHeader>,
    name: &'static str,
    tape: Option<(Tape, u8)>,
}

impl<S: Service, T: Record> Outlet<S, T> {
    /// Sends `records` under `header`, whose count is set here.
    pub(crate) fn send(&self, header: StepHeader, records: &[T]) -> Result<(), ChannelError> {
        let count = records.len() as u64;
        self.send_as_is(StepHeader { count, ..header }, records)
    }

    /// Sends `records` under `header`, whose count may be wrong.
    pub(crate) fn send_as_is(&self, header: StepHeader, records: &[T]) -> Result<(), ChannelError> {
        let mut sample = self
            .publisher
            .loan_slice_uninit(records.len())
            .map_err(transport(self.name, "loan memory from it"))?;
        *sample.user_header_mut() = header;
        if let Some((tape, channel)) = &self.tape {
            tape.note(*channel, &header, records);
        }
        let delivered = sample.write_from_slice(records).send();
        match delivered {
            Ok(_) => Ok(()),
            Err(_) => Err(ChannelError::Full {
                channel: self.name.to_string(),
            }),
        }
    }
}

/// The receiving end of a channel.
pub(crate) struct Inlet<S: Service, T: Record> {
    subscriber: Subscriber<S, [T], StepHeader>,
    name: &'static str,
    tape: Option<(Tape, u8)>,
}

impl<S: Service, T: Record> Inlet<S, T> {
    /// Copies the next message, if there is one, to `records` and returns its header. A copy, because a peer can
    /// write to the shared memory at any time and what has been checked must stay what it was.
    pub(crate) fn receive(&self, records: &mut Vec<T>) -> Result<Option<StepHeader>, ChannelError> {
        let sample = self
            .subscriber
            .receive()
            .map_err(transport(self.name, "receive from it"))?;
        Ok(sample.map(|sample| {
            records.clear();
            records.extend_from_slice(sample.payload());
            let header = *sample.user_header();
            if let Some((tape, channel)) = &self.tape {
                tape.note(*channel, &header, records);
            }
            header
        }))
    }

    pub(crate) fn name(&self) -> &'static str {
        self.name
    }
}

/// The end of a bell that rings.
pub(crate) struct Rope<S: Service>(Notifier<S>);

impl<S: Service> Rope<S> {
    /// Rings. A failure is not an error: the other side looks again by itself.
    pub(crate) fn ring(&self) {
        if let Err(e) = self.0.notify() {
            tracing::trace!("a bell did not ring: {e:?}");
        }
    }
}

/// The end of a bell that wakes.
pub(crate) struct Bell<S: Service>(Listener<S>);

impl<S: Service> Bell<S> {
    /// Sleeps until rung, for `nap` at most.
    pub(crate) fn sleep(&self, nap: Duration) {
        self.rings(nap);
    }

    /// The same; returns how often it has been rung.
    pub(crate) fn rings(&self, nap: Duration) -> u64 {
        let mut rings = 0;
        let waited = if nap.is_zero() {
            // A timed wait of zero is one without end: the transport hands it to a socket, as no timeout.
            self.0.try_wait(|_| rings += 1).map(|_| ())
        } else {
            self.0.timed_wait(|_| rings += 1, nap).map(|_| ())
        };
        if let Err(e) = waited {
            tracing::trace!("a bell could not be waited for: {e:?}");
            std::thread::sleep(Duration::from_millis(1).min(nap));
        }
        rings
    }
}
