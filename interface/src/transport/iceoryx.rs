//! Channels over iceoryx2: shared memory between processes, or within one. The only files that name it are
//! this one, [`crate::message::wire`], whose header is sent as it is, and [`crate::transport::domain`], which
//! configures it.
//!
//! A channel has one sender and one receiver, carries the bytes of records of one type under a [`StepHeader`], never drops
//! and never overwrites. All channels are of one type, because iceoryx2 is compiled again for each.
//! Lockstep keeps at most a few messages in flight, so a full channel means that the receiver is gone or has not looked
//! yet, and sending then fails after the deadline instead of blocking for ever.
//! A party is woken for a message through [`crate::transport::wake`].

use std::time::{Duration, Instant};

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::{BackpressureAction, BackpressureInfo};
use iceoryx2::prelude::{
    AllocationStrategy, AttributeSpecifier, AttributeVerifier, BackpressureStrategy, Node,
    NodeBuilder, SignalHandlingMode, ipc::Service as Ipc,
};
use iceoryx2::service::attribute::{AttributeKey, AttributeValue};
use iceoryx2::service::builder::publish_subscribe;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::{Transport, TransportError};
use crate::message::control::Party;
use crate::message::wire::{StepHeader, layout_hash};
use crate::message::{CHANNELS, Channel, Kind, Message, Records};
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
/// Bytes of a message for which the first segment of a channel has room; it grows by doubling.
const FIRST_BYTES: usize = 8 << 10;
/// The same of notices, more than any takes: a message for which the segment must grow is lost when its sender ends
/// before the receiver has seen the new segment, and last words are notices (clause C-6). The memory is reserved, not
/// touched.
const NOTICE_BYTES: usize = 64 << 10;
/// A channel's service.
type Service = PortFactory<Ipc, [u8], StepHeader>;
/// The sending end of a channel, and the channel, which knows its receivers.
type Sender = (Service, Publisher<Ipc, [u8], StepHeader>);
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

/// Creates every channel of a run, and the file of its wake-ups, with these solvers (the coupler's privilege), to be kept
/// for as long as the run lasts. In a `recorded` run a second subscriber may listen between the solvers.
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
            made.push((channel, create_channel(&node, channel, recorded)?));
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
    let mut ends = Ends::new(domain, party, send_timeout)?;
    let later = Channel::before_ready(party, true);
    let is_opened = |channel: &Channel| match party {
        Party::Coupler => solvers.iter().any(|solver| channel.is_of(*solver)),
        _ => !later.contains(channel),
    };
    let own = Channel::ALL.into_iter().filter(|c| c.is_of(party));
    for channel in own.filter(is_opened) {
        ends.open_channel(channel)?;
    }
    Ok(Box::new(ends))
}

/// A second receiver of everything between the solvers of a recorded run.
///
/// # Errors
/// [`TransportError`].
pub fn listen(domain: &Domain) -> Result<Box<dyn Transport>, TransportError> {
    let mut ends = Ends::new(domain, Party::Coupler, SEND_TIMEOUT)?;
    ends.wakes = None;
    let all = Channel::ALL.into_iter();
    for channel in all.filter(|channel| channel.is_between_solvers()) {
        ends.open_receiver(channel)?;
    }
    Ok(Box::new(ends))
}

/// The channels of a run. They exist for as long as somebody holds them.
pub struct Created(Vec<(Channel, Service)>);

impl Created {
    /// Whether all of them have their segment in the shared memory of `domain`: nobody has removed one while others
    /// were made.
    pub fn are_there(&self, domain: &Domain) -> bool {
        domain.services() >= self.0.len()
    }

    /// Channels that `party` has not opened at its end.
    pub fn unopened(&self, party: Party) -> Vec<&str> {
        let not_open = |(channel, service): &&(Channel, Service)| {
            let open = service.dynamic_config();
            (channel.from() == party && open.number_of_publishers() == 0)
                || (channel.to() == party && open.number_of_subscribers() == 0)
        };
        let made = self.0.iter().filter(not_open);
        made.map(|(channel, _)| channel.name()).collect()
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
fn service(
    node: &Node<Ipc>,
    channel: Channel,
    recorded: bool,
) -> Result<publish_subscribe::Builder<[u8], StepHeader, Ipc>, TransportError> {
    let (subscribers, buffer) = if recorded && channel.is_between_solvers() {
        (2, RECORDED_BUFFER)
    } else {
        (1, BUFFER)
    };
    let name = channel.name();
    let name = name.try_into().map_err(refused(name, "name it"))?;
    Ok(node
        .service_builder(&name)
        .publish_subscribe::<[u8]>()
        .user_header::<StepHeader>()
        .max_publishers(1)
        .max_subscribers(subscribers)
        .max_nodes(2 + subscribers)
        .subscriber_max_buffer_size(buffer)
        .subscriber_max_borrowed_samples(1)
        .history_size(0)
        .enable_safe_overflow(false))
}

/// The attribute of clause C-3.
fn layout() -> (AttributeKey, AttributeValue) {
    let key = "layout".try_into().expect("a short ASCII key");
    let hash = layout_hash().as_str().try_into();
    (key, hash.expect("16 hexadecimal digits"))
}

fn create_channel(
    node: &Node<Ipc>,
    channel: Channel,
    recorded: bool,
) -> Result<Service, TransportError> {
    let (key, hash) = layout();
    let layout = AttributeSpecifier::new()
        .define(&key, &hash)
        .map_err(refused(channel.name(), "describe it"))?;
    service(node, channel, recorded)?
        .create_with_attributes(&layout)
        .map_err(refused(channel.name(), "create it"))
}

fn open_service(node: &Node<Ipc>, channel: Channel) -> Result<Service, TransportError> {
    let (key, hash) = layout();
    let layout = AttributeVerifier::new()
        .require(&key, &hash)
        .map_err(refused(channel.name(), "describe it"))?;
    service(node, channel, false)?
        .open_with_attributes(&layout)
        .map_err(refused(channel.name(), "open it"))
}

/// One party's ends.
struct Ends {
    party: Party,
    domain: Domain,
    send_timeout: Duration,
    senders: [Option<Sender>; CHANNELS],
    receivers: [Option<Subscriber<Ipc, [u8], StepHeader>>; CHANNELS],
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

    /// Opens this party's end of a channel.
    fn open_channel(&mut self, channel: Channel) -> Result<(), TransportError> {
        if channel.from() != self.party {
            return self.open_receiver(channel);
        }
        let (domain, send_timeout) = (self.domain.clone(), self.send_timeout);
        let service = open_service(&self.node, channel)?;
        let publisher = service
            .publisher_builder()
            .initial_max_slice_len(if channel.kind == Kind::Notice {
                NOTICE_BYTES
            } else {
                FIRST_BYTES
            })
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
        self.senders[channel.number()] = Some((service, publisher));
        Ok(())
    }

    fn open_receiver(&mut self, channel: Channel) -> Result<(), TransportError> {
        let subscriber = open_service(&self.node, channel)?
            .subscriber_builder()
            .create()
            .map_err(refused(channel.name(), "receive from it"))?;
        self.receivers[channel.number()] = Some(subscriber);
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
        let name = channel.name();
        let sender = self.senders[channel.number()].as_ref();
        let (service, publisher) = sender.ok_or(TransportError::NotHere(name))?;
        let (bytes, start) = (records.bytes(), Instant::now());
        loop {
            let mut sample = publisher
                .loan_slice_uninit(bytes.len())
                .map_err(refused(name, "loan memory from it"))?;
            *sample.user_header_mut() = *header;
            match sample.write_from_slice(bytes).send() {
                // A receiver takes part from its first look on. Until then iceoryx2 drops what a full channel cannot take.
                Ok(0) if service.dynamic_config().number_of_subscribers() > 0 => {
                    if start.elapsed() < self.send_timeout && self.coupler_lives() {
                        nap(LOOK);
                        continue;
                    }
                }
                Ok(_) => return Ok(()),
                Err(_) => {}
            }
            let channel = name.to_string();
            return Err(TransportError::Full { channel });
        }
    }

    fn receive(&mut self, channel: Channel, into: &mut Message) -> Result<bool, TransportError> {
        let Some(subscriber) = &self.receivers[channel.number()] else {
            return Ok(false);
        };
        let name = channel.name();
        let sample = subscriber
            .receive()
            .map_err(refused(name, "receive from it"))?;
        let Some(sample) = sample else {
            return Ok(false);
        };
        if into.kind() != channel.kind {
            return Err(TransportError::NotHere(name));
        }
        if !into.payload.fill(sample.payload()) {
            let bytes = sample.payload().len();
            return Err(TransportError::Torn {
                channel: name,
                bytes,
            });
        }
        into.header = *sample.user_header();
        Ok(true)
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
    use std::sync::Barrier;

    use super::*;
    use crate::transport::domain::OwnedDomain;
    use crate::transport::wait::until;

    /// iceoryx2 sees bytes: what kept half a record out is ours to do.
    #[test]
    fn half_a_record_is_refused() {
        let owned = OwnedDomain::create().unwrap();
        let (domain, solvers) = (owned.domain(), [Party::Mpm]);
        let _made = create(domain, &solvers, false).unwrap();
        let join = |party| join(domain, party, &solvers, SEND_TIMEOUT).unwrap();
        let (mut coupler, mut mpm) = (join(Party::Coupler), join(Party::Mpm));
        let channel = Channel::of(Party::Mpm, Kind::Report);
        let mut look = |bytes: &[u8]| {
            let header = StepHeader::default();
            mpm.send(channel, &header, Records::Notice(bytes)).unwrap();
            let mut into = Message::empty(Kind::Report);
            let found = coupler.receive(channel, &mut into);
            found.map(|_| into.payload.len()).map_err(|e| e.to_string())
        };
        assert_eq!(look(&[0; 640]), Ok(2));
        let error = look(&[0; 321]).unwrap_err();
        assert!(
            error.contains("321 bytes") && error.contains("C-4"),
            "{error}"
        );
        assert_eq!(look(&[]), Ok(0));
    }

    /// A receiver that had not looked yet lost what came after four messages, and the sender was not told.
    #[test]
    fn a_full_channel_waits_for_its_receiver_to_look() {
        let owned = OwnedDomain::create().unwrap();
        let (domain, solvers) = (owned.domain(), [Party::Mpm]);
        let _made = create(domain, &solvers, false).unwrap();
        let join = |party| join(domain, party, &solvers, SEND_TIMEOUT).unwrap();
        let channel = Channel::of(Party::Mpm, Kind::Saved);
        let steps = 0..2 * BUFFER as u64;
        let both = Barrier::new(2);
        let received = std::thread::scope(|scope| {
            let coupler = scope.spawn(|| {
                let mut coupler = join(Party::Coupler);
                both.wait();
                nap(5 * LOOK);
                let mut look = || coupler.take(channel).unwrap();
                let next = |_| until(SEND_TIMEOUT / 2, LOOK, &mut look);
                steps
                    .clone()
                    .map_while(next)
                    .map(|message| message.header.step)
                    .collect::<Vec<_>>()
            });
            let mut mpm = join(Party::Mpm);
            mpm.open(&[channel]).unwrap();
            both.wait();
            for step in steps.clone() {
                let header = StepHeader {
                    step,
                    ..StepHeader::default()
                };
                mpm.send(channel, &header, Records::Saved(b"x")).unwrap();
            }
            coupler.join().unwrap()
        });
        assert_eq!(received, steps.collect::<Vec<_>>());
    }

    /// It went on trying for ten seconds after its coupler had been killed.
    #[test]
    fn a_send_to_a_full_channel_ends_when_the_coupler_is_gone() {
        for looks in [false, true] {
            let owned = OwnedDomain::create().unwrap();
            let (domain, solvers) = (owned.domain(), [Party::Mpm]);
            let _made = create(domain, &solvers, false).unwrap();
            let join = |party| join(domain, party, &solvers, SEND_TIMEOUT).unwrap();
            let (mut coupler, mut mpm) = (join(Party::Coupler), join(Party::Mpm));
            let channel = Channel::of(Party::Mpm, Kind::Notice);
            let mut say = || mpm.send(channel, &StepHeader::default(), Records::Notice(b"x"));
            say().unwrap();
            if looks {
                assert!(coupler.take(channel).unwrap().is_some());
            }
            let start = Instant::now();
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    std::thread::sleep(Duration::from_millis(50));
                    owned.release();
                });
                let error = (0..=BUFFER).find_map(|_| say().err());
                assert!(
                    matches!(error, Some(TransportError::Full { .. })),
                    "{error:?}"
                );
            });
            assert!(start.elapsed() < SEND_TIMEOUT / 2, "{:?}", start.elapsed());
        }
    }
}
