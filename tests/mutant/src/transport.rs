//! A transport around another one that changes what passes.

use std::collections::VecDeque;
use std::time::Duration;

use interface::message::control::{Notice, Order, Party};
use interface::message::wire::StepHeader;
use interface::message::{Channel, Kind, Message, Records};
use interface::transport::liveness::Hold;
use interface::transport::{Transport, TransportError};

use crate::wrong::Wrong;

/// How much later than Ready a mutant opens what it should have opened before, and than Bye it goes.
const LATE: Duration = Duration::from_millis(20);
/// What comes to a solver, in such an order that what was sent before a message that is there is looked for after it.
const LATE_FIRST: [Kind; 7] = [
    Kind::States,
    Kind::Set,
    Kind::Forces,
    Kind::Envelopes,
    Kind::Grant,
    Kind::Restore,
    Kind::Order,
];

/// One solver's ends with a flaw.
pub struct Flawed {
    inner: Box<dyn Transport>,
    party: Party,
    wrong: Wrong,
    /// What has come and the solver has not asked for yet, kind by kind.
    coming: [VecDeque<Message>; Kind::ALL.len()],
    /// Somebody has woken it since it last looked.
    woken: bool,
    /// Between a grant and the report on it.
    in_step: bool,
    /// Channels that it opens after Ready.
    late: Vec<Channel>,
    /// It has sent Ready.
    ready: bool,
}

impl Flawed {
    /// Around the ends of `party`.
    pub fn new(inner: Box<dyn Transport>, party: Party, wrong: Wrong) -> Self {
        Self {
            inner,
            party,
            wrong,
            coming: [const { VecDeque::new() }; Kind::ALL.len()],
            woken: false,
            in_step: false,
            late: Vec::new(),
            ready: false,
        }
    }

    /// Takes all that is there, in the order in which it was sent, past the flaw.
    fn look(&mut self) -> Result<(), TransportError> {
        if self.wrong.process.waits_to_be_woken && !self.was_woken() {
            return Ok(());
        }
        loop {
            let mut taken = Vec::new();
            for kind in LATE_FIRST {
                taken.extend(self.inner.take(Channel::of(self.party, kind))?);
            }
            if taken.is_empty() {
                return Ok(());
            }
            for message in taken.into_iter().rev() {
                self.in_step |= message.kind() == Kind::Grant;
                for message in self.wrong.messages.pass(message) {
                    self.coming[message.kind() as usize].push_back(message);
                }
            }
        }
    }

    fn was_woken(&mut self) -> bool {
        for party in Party::ALL {
            if party != self.party {
                self.sleep(party, Duration::ZERO);
            }
        }
        std::mem::take(&mut self.woken)
    }

    /// Sends what the flaw makes of a message, with its wake-ups.
    fn pass_on(&mut self, message: Message) -> Result<(), TransportError> {
        for message in self.wrong.messages.pass(message) {
            let channel = Channel::of(self.party, message.kind());
            let records = message.payload.records();
            self.inner.send(channel, &message.header, records)?;
            if channel.wakes() && !self.wrong.process.wakes_nobody {
                self.inner.wake(channel.to());
            }
        }
        Ok(())
    }
}

impl Transport for Flawed {
    fn open(&mut self, channels: &[Channel]) -> Result<(), TransportError> {
        if !self.wrong.process.opens_late {
            return self.inner.open(channels);
        }
        let between = |channel: &Channel| channel.is_between_solvers();
        let (exchange, late): (Vec<_>, _) = channels.iter().partition(|channel| between(channel));
        self.late = late;
        self.inner.open(&exchange)
    }

    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError> {
        self.in_step &= channel.kind != Kind::Report;
        let message = Message {
            header: *header,
            payload: records.to_payload(),
        };
        let process = self.wrong.process;
        match message.as_notice() {
            Ok(Notice::Ready(_)) => {
                self.pass_on(message)?;
                self.ready = true;
            }
            Ok(Notice::Failed(failure))
                if process.gives_up_silently && failure.message.contains("the next grant") => {}
            Ok(Notice::Bye) if process.goes_at_bye => {
                self.pass_on(message)?;
                // It assumes Close when the last points have been received: they are lost when their sender ends.
                interface::transport::wait::nap(LATE);
                self.coming[Kind::Order as usize].push_back(Message::order(&Order::Close));
            }
            _ => self.pass_on(message)?,
        }
        Ok(())
    }

    fn receive(&mut self, channel: Channel, into: &mut Message) -> Result<bool, TransportError> {
        if !self.late.is_empty() && self.ready {
            interface::transport::wait::nap(LATE);
            self.inner.open(&std::mem::take(&mut self.late))?;
        }
        let kind = channel.kind as usize;
        if self.coming[kind].is_empty() {
            self.look()?;
        }
        let next = self.coming[kind].pop_front();
        Ok(next.map(|message| *into = message).is_some())
    }

    /// What is sent has woken its receiver already.
    fn wake(&mut self, _: Party) {}

    fn sleep(&mut self, from: Party, at_most: Duration) -> u64 {
        let times = self.inner.sleep(from, at_most);
        self.woken |= times > 0;
        times
    }

    fn coupler_lives(&self) -> bool {
        let process = self.wrong.process;
        let looks_away =
            process.never_looks_up || (process.never_looks_up_in_a_step && self.in_step);
        looks_away || self.inner.coupler_lives()
    }

    fn held(&self) -> Option<(Party, Hold)> {
        self.inner.held()
    }
}
