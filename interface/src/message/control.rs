//! Control messages: everything outside the steps. Encoded by [`crate::message::codec`], described in PROTOCOL.md section 3.

use std::borrow::Cow;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::config::capability::Capabilities;
use crate::message::codec::{DecodeError, decode, decode_first};
use crate::solver::{Fault, Readiness, Refusal};
use crate::text;

/// Version of the protocol. Another major version is refused, another minor one accepted.
pub const PROTOCOL: (u32, u32) = (8, 0);

/// The parties of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Party {
    /// It decides the step and when it is done.
    Coupler,
    /// The continuum.
    Mpm,
    /// The bodies.
    Dem,
}

impl Party {
    /// The coupler, then the solvers.
    pub const ALL: [Self; 3] = [Self::Coupler, Self::Mpm, Self::Dem];

    /// The name used in channels, logs and summaries.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Coupler => "coupler",
            Self::Mpm => "mpm",
            Self::Dem => "dem",
        }
    }

    /// The solver beside this one; none beside the coupler.
    pub const fn other_solver(self) -> Option<Self> {
        match self {
            Self::Coupler => None,
            Self::Mpm => Some(Self::Dem),
            Self::Dem => Some(Self::Mpm),
        }
    }
}

impl core::fmt::Display for Party {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Largest control message in bytes (clause M-1): a scene's part with ten thousand bodies takes a few MB.
const MAX_BYTES: usize = 256 << 20;

/// The bytes of a message, if they are not too many for one.
fn of_message(bytes: &[u8]) -> Result<&[u8], DecodeError> {
    let sound = Some(bytes).filter(|bytes| bytes.len() <= MAX_BYTES);
    sound.ok_or_else(|| DecodeError::too_long(bytes.len()))
}

/// From the coupler to a solver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Order {
    /// The solver's part of the scene.
    Configure(Configure),
    /// No more grants will come: send the final state, say goodbye and wait for [`Order::Close`].
    Drain,
    /// The final state has arrived; the process may end. (A sample may be lost if its sender ends too early.)
    Close,
    /// The session is over, for this reason.
    Abort(String),
}

impl Order {
    /// The order in `bytes`.
    ///
    /// # Errors
    /// [`DecodeError`] when bytes are missing, left over or out of range.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        decode(of_message(bytes)?)
    }
}

/// The message that configures a solver before the first step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Configure {
    /// Hash of the scene as resolved, to be repeated in [`Notice::Ready`].
    pub scene_hash: String,
    /// [`crate::config::MpmConfig`] or [`crate::config::DemConfig`] as JSON.
    pub config: String,
    /// Whether there is another solver to exchange with.
    pub coupled: bool,
    /// Longest wait for another party within a step, in s.
    pub deadline: f64,
    /// Whether the solver goes on from a saved state, which follows on its channel for it (clause K-4).
    pub restore: bool,
}

impl Configure {
    /// Longest deadline: thirty years, so that sums of times do not overflow.
    const LONGEST: f64 = 1e9;

    /// The deadline; `None` if it is not a time above zero, or longer than the longest deadline.
    pub fn longest_wait(&self) -> Option<Duration> {
        let sensible = self.deadline > 0.0 && self.deadline <= Self::LONGEST;
        sensible.then(|| Duration::from_secs_f64(self.deadline))
    }
}

/// From a solver to the coupler.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Notice {
    /// First message.
    Hello(Hello),
    /// The configuration is taken.
    Ready(Ready),
    /// The configuration is not taken.
    Refused(Refusal),
    /// The solver cannot go on.
    Failed(Failure),
    /// Last message of an orderly session.
    Bye,
}

impl Notice {
    /// The notice in `bytes`. A Hello may end with fields that this version does not know (clause V-2).
    ///
    /// # Errors
    /// [`DecodeError`] when bytes are missing, left over or out of range.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        let (mut notice, used) = decode_first(of_message(bytes)?)?;
        if used < bytes.len() && !matches!(notice, Self::Hello(_)) {
            return Err(DecodeError::left_over(bytes.len() - used));
        }
        notice.escape();
        Ok(notice)
    }

    /// Makes every text one line without control characters: all are shown to people.
    fn escape(&mut self) {
        let texts = match self {
            Self::Hello(hello) => vec![&mut hello.identity],
            Self::Ready(ready) => ready.readiness.notes.iter_mut().collect(),
            Self::Refused(refusal) => vec![&mut refusal.key, &mut refusal.message],
            Self::Failed(failure) => vec![&mut failure.message],
            Self::Bye => Vec::new(),
        };
        for shown in texts {
            if let Cow::Owned(escaped) = text::line(shown) {
                *shown = escaped;
            }
        }
    }
}

/// A solver's first message.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// Protocol spoken, major and minor.
    pub protocol: (u32, u32),
    /// Which side it is.
    pub party: Party,
    /// Name and version of the solver.
    pub identity: String,
    /// Its process id, for messages.
    pub pid: u32,
    /// What it can do and what it takes.
    pub capabilities: Capabilities,
}

impl Hello {
    /// That of a solver in this process.
    pub(crate) fn of(party: Party, identity: String, capabilities: Capabilities) -> Self {
        Self {
            protocol: PROTOCOL,
            party,
            identity,
            pid: std::process::id(),
            capabilities,
        }
    }
}

/// The configuration is taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ready {
    /// As received.
    pub scene_hash: String,
    /// What the solver reports of itself.
    pub readiness: Readiness,
}

/// Why and where a solver stopped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// Step in which it happened.
    pub step: u64,
    /// The solver's own fault, if it was one.
    pub fault: Option<Fault>,
    /// The whole message.
    pub message: String,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::codec::encode;

    /// D17: these values ended the process that read them.
    #[test]
    fn a_deadline_that_is_no_time_is_no_wait() {
        let wait = |deadline| {
            let configure = Configure {
                scene_hash: String::new(),
                config: String::new(),
                coupled: true,
                deadline,
                restore: false,
            };
            configure.longest_wait()
        };
        for deadline in [f64::NAN, -1.0, 0.0, f64::INFINITY, 1e300] {
            assert_eq!(wait(deadline), None, "{deadline}");
        }
        assert_eq!(wait(2.5), Some(Duration::from_millis(2500)));
    }

    #[test]
    fn hello_may_be_longer_and_texts_are_made_one_line() {
        let mut hello = encode(&Notice::Hello(Hello {
            protocol: PROTOCOL,
            party: Party::Dem,
            identity: "x 1".into(),
            pid: 7,
            capabilities: Capabilities::of(&["save"]),
        }));
        let mut bye = encode(&Notice::Bye);
        let whole = Notice::decode(&hello).unwrap();
        // What a later version appends to Hello is ignored.
        hello.extend([1, 2, 3]);
        bye.extend([1, 2, 3]);
        assert_eq!(Notice::decode(&hello).unwrap(), whole);
        assert!(Notice::decode(&bye).is_err());
        // Texts of a solver reach a terminal as one line.
        let notice = Notice::Refused(Refusal::new("a\nb", "\u{1b}[2J"));
        let heard = Notice::Refused(Refusal::new("a\\nb", "\\u{1b}[2J"));
        assert_eq!(Notice::decode(&encode(&notice)).unwrap(), heard);
    }
}
