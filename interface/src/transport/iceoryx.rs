//! Channels over iceoryx2: shared memory between processes, or within one. The only files that name it are
//! this one, [`crate::message::wire`], whose records are sent as they are, and [`crate::transport::domain`], which
//! configures it.
//!
//! A channel has one sender and one receiver, carries slices of one record type with a [`StepHeader`], never drops and
//! never overwrites. Lockstep keeps at most a few messages in flight, so a full channel means that the receiver is
//! gone, and sending then fails after the deadline instead of blocking for ever.
//! A party is woken for a message through [`crate::transport::wake`].

use std::time::Duration;

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::{BackpressureAction, BackpressureInfo};
use iceoryx2::prelude::{
    AllocationStrategy, AttributeSpecifier, AttributeVerifier, BackpressureStrategy, Node,
    NodeBuilder, SignalHandlingMode, ipc::Service as Ipc,
};
use iceoryx2::service::builder::publish_subscribe;
use iceoryx2::service::port_factory::{self, PortFactory as _};

use super::{Transport, TransportError};
use crate::message::control::Party;
use crate::message::wire::{Record, StepHeader, layout_hash};
use crate::message::{CHANNELS, Channel, Kind, Payload, Records, each_kind};
use crate::transport::domain::{Domain, Part};
use crate::transport::liveness::Hold;
use crate::transport::names::WAKES;
use crate::transport::vanished;
use crate::transport::wait::nap;
use crate::transport::wake::Wakes;

/// Messages that may wait in a channel. Lockstep needs two; a failure notice and a goodbye may follow a report.
const BUFFER: usize = 4;
/// The same between the solvers of a recorded run: more than cross while the tap sleeps.
const RECORDED_BUFFER: usize = 64;
/// Records of the first segment of a channel; it grows by doubling.
const FIRST_LENGTH: usize = 64;
/// The same of notices, more than any takes: a message for which the segment must grow is lost when its sender ends
/// before the receiver has seen the new segment, and last words are notices (clause C-6). The memory is reserved, not
/// touched.
const NOTICE_BYTES: usize = 64 << 10;
const LAYOUT_KEY: &str = "layout";
/// Longest wait of a send to a full channel (clause C-7). In lockstep no channel is full, unless the receiver takes nothing
/// any more.
pub const SEND_TIMEOUT: Duration = Duration::from_secs(10);

/// After this a send that waits looks whether the coupler lives (clause S-12).
const LOOK: Duration = Duration::from_millis(10);

fn refused<E: core::fmt::Debug>(
    channel: &str,
    action: &'static str,
) -> impl FnOnce(E) -> TransportError {
    move |e| TransportError::Refused {
        channel: channel.to_string(),
        action,
        reason: format!("{e:?}"),
    }
}

/// Creates every channel of a run, and the file of its wake-ups, with these solvers (the coupler's privilege), to be kept for as long as the
/// run lasts. In a `recorded` run a second subscriber may listen between the solvers.
///
/// # Errors
/// [`TransportError`].
pub fn create(
    domain: &Domain,
    solvers: &[Party],
    recorded: bool,
) -> Result<Created, TransportError> {
    let node = node(domain, Party::Coupler)?;
    domain.close_to_others();
    Wakes::create(domain.directory()).map_err(refused(WAKES, "create it"))?;
    let mut made = Vec::new();
    let takes_part = |party| party == Party::Coupler || solvers.contains(&party);
    for channel in Channel::ALL {
        if takes_part(channel.from()) && takes_part(channel.to()) {
            made.push(create_channel(&node, channel, recorded)?);
        }
    }
    Ok(Created(made))
}

/// The ends of `party` in a run that has been created. A solver's line to the coupler is open at once, the rest after
/// [`Transport::open`]; the coupler's lines to `solvers` are open at once. A send to a full channel waits for `send_timeout`
/// at most.
///
/// # Errors
/// [`TransportError`].
pub fn join(
    domain: &Domain,
    party: Party,
    solvers: &[Party],
    send_timeout: Duration,
) -> Result<Box<dyn Transport>, TransportError> {
    vanished::say_so();
    let ends = Ends::join(domain, party, solvers, send_timeout)?;
    Ok(Box::new(ends))
}

/// A second receiver of everything between the solvers of a recorded run.
///
/// # Errors
/// [`TransportError`].
pub fn listen(domain: &Domain) -> Result<Box<dyn Transport>, TransportError> {
    Ok(Box::new(Ends::listen(domain)?))
}

/// Says one message on the channel of `expected`, as a solver does that was started as another party (clause O-1).
///
/// # Errors
/// [`TransportError`].
pub fn say_as(
    domain: &Domain,
    expected: Party,
    header: &StepHeader,
    notice: &[u8],
) -> Result<Box<dyn Transport>, TransportError> {
    let mut ends = Ends::new(domain, expected, SEND_TIMEOUT)?;
    let channel = Channel::of(expected, Kind::Notice);
    ends.open_channel(channel)?;
    ends.send(channel, header, Records::Notice(notice))?;
    ends.wake(Party::Coupler);
    Ok(Box::new(ends))
}

/// The channels of a run. They exist for as long as somebody holds them.
pub struct Created(Vec<Made>);

struct Made {
    name: String,
    from: Party,
    to: Party,
    service: Box<dyn Opened>,
}

impl Created {
    /// Whether all of them have their segment in the shared memory of `domain`: nobody has removed one while others
    /// were made.
    pub fn are_there(&self, domain: &Domain) -> bool {
        domain.services() >= self.0.len()
    }

    /// Channels that `party` has not opened at its end.
    pub fn unopened(&self, party: Party) -> Vec<&str> {
        let not_open = |made: &&Made| {
            let (senders, receivers) = made.service.ends();
            (made.from == party && senders == 0) || (made.to == party && receivers == 0)
        };
        let made = self.0.iter().filter(not_open);
        made.map(|made| made.name.as_str()).collect()
    }
}

/// How many hold a sending and a receiving end at present.
trait Opened {
    fn ends(&self) -> (usize, usize);
}

impl<T: Record> Opened for port_factory::publish_subscribe::PortFactory<Ipc, [T], StepHeader> {
    fn ends(&self) -> (usize, usize) {
        let open = self.dynamic_config();
        (open.number_of_publishers(), open.number_of_subscribers())
    }
}

fn node(domain: &Domain, party: Party) -> Result<Node<Ipc>, TransportError> {
    let name = party.name().try_into();
    NodeBuilder::new()
        .name(&name.map_err(refused("node", "name it"))?)
        .config(&domain.config()?)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create()
        .map_err(refused("node", "create it"))
}

/// The service of a channel, with the quality that clause C-1 asks for at least.
fn service<T: Record>(
    node: &Node<Ipc>,
    channel: Channel,
    recorded: bool,
) -> Result<publish_subscribe::Builder<[T], StepHeader, Ipc>, TransportError> {
    let (subscribers, buffer) = if recorded && channel.is_between_solvers() {
        (2, RECORDED_BUFFER)
    } else {
        (1, BUFFER)
    };
    let name = channel.name();
    let name = name.try_into().map_err(refused(name, "name it"))?;
    Ok(node
        .service_builder(&name)
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

fn create_channel(
    node: &Node<Ipc>,
    channel: Channel,
    recorded: bool,
) -> Result<Made, TransportError> {
    fn of<T: Record>(
        node: &Node<Ipc>,
        channel: Channel,
        recorded: bool,
    ) -> Result<Box<dyn Opened>, TransportError> {
        let hash = layout_hash();
        let layout = AttributeSpecifier::new()
            .define(
                &LAYOUT_KEY.try_into().expect("a short ASCII key"),
                &hash.as_str().try_into().expect("16 hexadecimal digits"),
            )
            .map_err(refused(channel.name(), "describe it"))?;
        let service = service::<T>(node, channel, recorded)?
            .create_with_attributes(&layout)
            .map_err(refused(channel.name(), "create it"))?;
        Ok(Box::new(service))
    }
    macro_rules! by_kind {
        ($($kind:ident: $record:ty),*) => {
            match channel.kind { $(Kind::$kind => of::<$record>(node, channel, recorded)?),* }
        };
    }
    Ok(Made {
        name: channel.name().to_string(),
        from: channel.from(),
        to: channel.to(),
        service: each_kind!(by_kind),
    })
}

fn open_service<T: Record>(
    node: &Node<Ipc>,
    channel: Channel,
) -> Result<port_factory::publish_subscribe::PortFactory<Ipc, [T], StepHeader>, TransportError> {
    let hash = layout_hash();
    let layout = AttributeVerifier::new()
        .require(
            &LAYOUT_KEY.try_into().expect("a short ASCII key"),
            &hash.as_str().try_into().expect("16 hexadecimal digits"),
        )
        .map_err(refused(channel.name(), "describe it"))?;
    service::<T>(node, channel, false)?
        .open_with_attributes(&layout)
        .map_err(refused(channel.name(), "open it"))
}

/// A sending end, whatever it sends.
trait Sender {
    fn send(&self, header: &StepHeader, records: Records<'_>) -> Result<(), TransportError>;
}

struct SenderOf<T: Record> {
    publisher: Publisher<Ipc, [T], StepHeader>,
    channel: Channel,
    pick: for<'a> fn(Records<'a>) -> Option<&'a [T]>,
}

impl<T: Record> SenderOf<T> {
    fn open(
        node: &Node<Ipc>,
        channel: Channel,
        domain: &Domain,
        send_timeout: Duration,
        pick: for<'a> fn(Records<'a>) -> Option<&'a [T]>,
    ) -> Result<Self, TransportError> {
        let first = if channel.kind == Kind::Notice {
            NOTICE_BYTES
        } else {
            FIRST_LENGTH
        };
        let domain = domain.clone();
        let publisher = open_service::<T>(node, channel)?
            .publisher_builder()
            .initial_max_slice_len(first)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::RetryUntilDelivered)
            .set_backpressure_handler(move |info: &BackpressureInfo| {
                // A receiver that was killed leaves its channel full, and its run without a coupler.
                let over = info.elapsed_time > send_timeout;
                if over || (info.elapsed_time > LOOK && !domain.coupler_lives()) {
                    BackpressureAction::DiscardDataAndFail
                } else {
                    BackpressureAction::Retry
                }
            })
            .create()
            .map_err(refused(channel.name(), "send on it"))?;
        Ok(Self {
            publisher,
            channel,
            pick,
        })
    }
}

impl<T: Record> Sender for SenderOf<T> {
    fn send(&self, header: &StepHeader, records: Records<'_>) -> Result<(), TransportError> {
        let name = self.channel.name();
        let records = (self.pick)(records).ok_or(TransportError::NotHere(name))?;
        let mut sample = self
            .publisher
            .loan_slice_uninit(records.len())
            .map_err(refused(name, "loan memory from it"))?;
        *sample.user_header_mut() = *header;
        match sample.write_from_slice(records).send() {
            Ok(_) => Ok(()),
            Err(_) => Err(TransportError::Full {
                channel: name.to_string(),
            }),
        }
    }
}

/// A receiving end, whatever it receives.
trait Receiver {
    fn receive(&self, into: &mut Payload) -> Result<Option<StepHeader>, TransportError>;
}

struct ReceiverOf<T: Record> {
    subscriber: Subscriber<Ipc, [T], StepHeader>,
    channel: Channel,
    pick: for<'a> fn(&'a mut Payload) -> Option<&'a mut Vec<T>>,
}

impl<T: Record> ReceiverOf<T> {
    fn open(
        node: &Node<Ipc>,
        channel: Channel,
        pick: for<'a> fn(&'a mut Payload) -> Option<&'a mut Vec<T>>,
    ) -> Result<Self, TransportError> {
        let subscriber = open_service::<T>(node, channel)?
            .subscriber_builder()
            .create()
            .map_err(refused(channel.name(), "receive from it"))?;
        Ok(Self {
            subscriber,
            channel,
            pick,
        })
    }
}

impl<T: Record> Receiver for ReceiverOf<T> {
    fn receive(&self, into: &mut Payload) -> Result<Option<StepHeader>, TransportError> {
        let name = self.channel.name();
        let sample = self
            .subscriber
            .receive()
            .map_err(refused(name, "receive from it"))?;
        let Some(sample) = sample else {
            return Ok(None);
        };
        let records = (self.pick)(into).ok_or(TransportError::NotHere(name))?;
        records.clear();
        records.extend_from_slice(sample.payload());
        Ok(Some(*sample.user_header()))
    }
}

/// One party's ends.
struct Ends {
    party: Party,
    domain: Domain,
    send_timeout: Duration,
    senders: [Option<Box<dyn Sender>>; CHANNELS],
    receivers: [Option<Box<dyn Receiver>>; CHANNELS],
    /// `None` for one that only listens: nobody wakes it.
    wakes: Option<Wakes>,
    // The node outlives its ports.
    node: Node<Ipc>,
    // Last: after it this process makes nothing more in shared memory.
    _part: Option<Part>,
}

impl Ends {
    fn new(domain: &Domain, party: Party, send_timeout: Duration) -> Result<Self, TransportError> {
        // The coupler removes the run itself.
        let part = (party != Party::Coupler).then(|| domain.take_part());
        let part = part.transpose()?;
        Ok(Self {
            party,
            domain: domain.clone(),
            send_timeout,
            senders: [const { None }; CHANNELS],
            receivers: [const { None }; CHANNELS],
            wakes: Some(Wakes::open(domain.directory(), party).map_err(refused(WAKES, "open it"))?),
            node: node(domain, party)?,
            _part: part,
        })
    }

    fn join(
        domain: &Domain,
        party: Party,
        solvers: &[Party],
        send_timeout: Duration,
    ) -> Result<Self, TransportError> {
        let mut ends = Self::new(domain, party, send_timeout)?;
        if party == Party::Coupler {
            for channel in Channel::ALL {
                let solver = if channel.from() == party {
                    channel.to()
                } else {
                    channel.from()
                };
                if channel.is_of(party) && solvers.contains(&solver) {
                    ends.open_channel(channel)?;
                }
            }
        } else {
            for kind in [
                Kind::Order,
                Kind::Notice,
                Kind::Grant,
                Kind::Report,
                Kind::Restore,
            ] {
                ends.open_channel(Channel::of(party, kind))?;
            }
        }
        Ok(ends)
    }

    fn listen(domain: &Domain) -> Result<Self, TransportError> {
        let mut ends = Self::new(domain, Party::Coupler, SEND_TIMEOUT)?;
        ends.wakes = None;
        for channel in Channel::ALL {
            if channel.is_between_solvers() {
                ends.open_receiver(channel)?;
            }
        }
        Ok(ends)
    }

    /// Opens this party's end of a channel.
    fn open_channel(&mut self, channel: Channel) -> Result<(), TransportError> {
        if channel.from() != self.party {
            return self.open_receiver(channel);
        }
        let (node, domain, send_timeout) = (&self.node, &self.domain, self.send_timeout);
        macro_rules! by_kind {
            ($($kind:ident: $record:ty),*) => {
                match channel.kind {
                    $(Kind::$kind => Box::new(SenderOf::<$record>::open(node, channel, domain, send_timeout, |records| {
                        if let Records::$kind(records) = records { Some(records) } else { None }
                    })?)),*
                }
            };
        }
        self.senders[channel.number()] = Some(each_kind!(by_kind));
        Ok(())
    }

    fn open_receiver(&mut self, channel: Channel) -> Result<(), TransportError> {
        let node = &self.node;
        macro_rules! by_kind {
            ($($kind:ident: $record:ty),*) => {
                match channel.kind {
                    $(Kind::$kind => Box::new(ReceiverOf::<$record>::open(node, channel, |payload| {
                        if let Payload::$kind(records) = payload { Some(records) } else { None }
                    })?)),*
                }
            };
        }
        self.receivers[channel.number()] = Some(each_kind!(by_kind));
        Ok(())
    }
}

impl Transport for Ends {
    fn open(&mut self, channels: &[Channel]) -> Result<(), TransportError> {
        let mut channels = channels.iter();
        channels.try_for_each(|channel| self.open_channel(*channel))
    }

    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError> {
        match &self.senders[channel.number()] {
            Some(sender) => sender.send(header, records),
            None => Err(TransportError::NotHere(channel.name())),
        }
    }

    fn receive(
        &mut self,
        channel: Channel,
        into: &mut Payload,
    ) -> Result<Option<StepHeader>, TransportError> {
        match &self.receivers[channel.number()] {
            Some(receiver) => receiver.receive(into),
            None => Ok(None),
        }
    }

    fn wake(&mut self, to: Party) {
        if let Some(wakes) = &self.wakes {
            wakes.wake(to);
        }
    }

    fn sleep(&mut self, from: Party, at_most: Duration) -> u64 {
        if let Some(wakes) = &mut self.wakes {
            return wakes.block(from, at_most);
        }
        nap(at_most);
        0
    }

    fn coupler_lives(&self) -> bool {
        self.party == Party::Coupler || self.domain.coupler_lives()
    }

    fn held(&self) -> Option<(Party, Hold)> {
        self.domain.held(self.party)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;
    use crate::transport::domain::OwnedDomain;

    /// It went on trying for ten seconds after its coupler had been killed.
    #[test]
    fn a_send_to_a_full_channel_ends_when_the_coupler_is_gone() {
        let owned = OwnedDomain::create().unwrap();
        let (domain, solvers) = (owned.domain(), [Party::Mpm]);
        let _made = create(domain, &solvers, false).unwrap();
        let join = |party| join(domain, party, &solvers, SEND_TIMEOUT).unwrap();
        let (mut coupler, mut mpm) = (join(Party::Coupler), join(Party::Mpm));
        let channel = Channel::of(Party::Mpm, Kind::Notice);
        let mut say = || mpm.send(channel, &StepHeader::default(), Records::Notice(b"x"));
        // A receiver that has never looked is none, and nobody waits for it.
        say().unwrap();
        let found = coupler.receive(channel, &mut Payload::empty(Kind::Notice));
        assert!(found.unwrap().is_some());
        let start = Instant::now();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(50));
                owned.release();
            });
            let told = (0..=BUFFER).find_map(|_| say().err());
            assert!(
                matches!(told, Some(TransportError::Full { .. })),
                "{told:?}"
            );
        });
        assert!(start.elapsed() < SEND_TIMEOUT / 2, "{:?}", start.elapsed());
    }
}
