//! Turns: one party does one thing at a time.

use std::time::{Duration, Instant};

use crate::core::Wait;
use crate::message::Payload;
use crate::transport::Transport;
use crate::transport::wait::{NAP, POLL};

/// The result of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// Something was done, and there may be more to do.
    Went,
    /// There is nothing to do until a message arrives.
    Waits(Wait),
    /// The session of this party is over.
    Ended,
}

/// A party that takes turns.
pub trait Turns {
    /// Does one thing, or looks once for the message that it waits for.
    fn turn(&mut self, transport: &mut dyn Transport) -> Turn;

    /// Looks during a long wait for what nobody waits for: an abort, or the end of a process. Returns whether there was
    /// something.
    fn look_up(&mut self, transport: &mut dyn Transport) -> bool;

    /// The deadline of the present wait is over.
    fn expire(&mut self, waited: Duration);
}

/// Lets `party` take turns until its session is over, waiting as [`crate::transport::wait`] says.
pub fn drive(party: &mut dyn Turns, transport: &mut dyn Transport) {
    loop {
        match party.turn(transport) {
            Turn::Went => {}
            Turn::Waits(wait) => block(party, transport, &wait),
            Turn::Ended => return,
        }
    }
}

/// Waits until there is something to do.
fn block(party: &mut dyn Turns, transport: &mut dyn Transport, wait: &Wait) {
    let mut silence = Silence::begin();
    loop {
        let window = Instant::now();
        // The last look comes after the whole time; clause B-4 relies on this.
        loop {
            std::thread::yield_now();
            let looks = window.elapsed();
            if !matches!(party.turn(transport), Turn::Waits(_)) {
                return;
            }
            if looks >= POLL {
                break;
            }
        }
        let waited = silence.so_far(wait.at_most, || transport.held().is_some());
        if waited >= wait.at_most {
            return party.expire(waited);
        }
        transport.sleep(wait.from, NAP.min(wait.at_most.saturating_sub(waited)));
        if !matches!(party.turn(transport), Turn::Waits(_)) || party.look_up(transport) {
            return;
        }
    }
}

/// How long a party has been silent that could have sent something (clause S-11). Time in which this process or another
/// one of the run was stopped, frozen or blocked does not count.
struct Silence {
    /// Silence up to the last test whether the others run.
    counted: Duration,
    /// Silence since then.
    since: Duration,
    mark: Instant,
}

impl Silence {
    /// Longest time between two rounds of a wait that counts. A round is a short sleep, so a process that returns later
    /// was itself held up.
    const ROUND: Duration = Duration::from_millis(100);
    /// Silence after which the wait tests whether the others run.
    const LOOK: Duration = Duration::from_millis(50);

    fn begin() -> Self {
        Self {
            counted: Duration::ZERO,
            since: Duration::ZERO,
            mark: Instant::now(),
        }
    }

    /// The silence so far; `held` tests whether another party is held up.
    fn so_far(&mut self, at_most: Duration, held: impl FnOnce() -> bool) -> Duration {
        let now = Instant::now();
        self.since += (now - self.mark).min(Self::ROUND);
        self.mark = now;
        if self.since >= Self::LOOK || self.counted + self.since >= at_most {
            if !held() {
                self.counted += self.since;
            }
            self.since = Duration::ZERO;
        }
        self.counted + self.since
    }
}

/// Buffers for received messages, one for each kind, so that memory is reused.
pub(crate) struct Inbox([Payload; crate::message::Kind::ALL.len()]);

impl Inbox {
    pub(crate) fn new() -> Self {
        Self(crate::message::Kind::ALL.map(Payload::empty))
    }

    /// The buffer for messages of this kind.
    pub(crate) fn of(&mut self, kind: crate::message::Kind) -> &mut Payload {
        &mut self.0[kind as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT_MOST: Duration = Duration::from_millis(500);

    fn after(silence: &mut Silence, ms: u64, held: bool) -> Duration {
        silence.mark = Instant::now()
            .checked_sub(Duration::from_millis(ms))
            .expect("the machine has been up for a minute");
        silence.so_far(AT_MOST, || held)
    }

    #[test]
    fn silence_adds_up() {
        let mut silence = Silence::begin();
        for _ in 0..49 {
            assert!(after(&mut silence, 10, false) < AT_MOST);
        }
        assert!(after(&mut silence, 11, false) >= AT_MOST);
    }

    #[test]
    fn a_pause_of_this_process_counts_as_one_round() {
        let mut silence = Silence::begin();
        let waited = after(&mut silence, 60_000, false);
        assert_eq!(waited, Silence::ROUND);
    }

    #[test]
    fn a_pause_of_another_one_does_not_count() {
        let mut silence = Silence::begin();
        for _ in 0..6000 {
            assert!(after(&mut silence, 10, true) < AT_MOST);
        }
        for _ in 0..60 {
            after(&mut silence, 10, false);
        }
        assert!(silence.counted >= AT_MOST);
    }
}
