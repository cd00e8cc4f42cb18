//! What can go wrong, where.

use interface::message::control::Party;

/// Virtual time in ns.
pub type Time = u64;

/// A second.
pub const SECOND: Time = 1_000_000_000;

/// Something that goes wrong when a party does its `at`-th thing (sends a message or does a task), counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// Whose.
    pub party: Party,
    /// At which of its events.
    pub at: u64,
    /// What.
    pub kind: FaultKind,
}

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
    /// The process ends at once.
    Die,
    /// The process stops, and goes on after so many ns of virtual time, or never.
    Freeze(Option<Time>),
    /// The message that is being sent is wrong.
    Corrupt(Corruption),
}

/// How a message is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corruption {
    /// Another step in its header.
    Step,
    /// Another epoch.
    Epoch,
    /// Another generation of the IMP set.
    Set,
    /// Another number of records.
    Count,
    /// HALT_AFTER where it is not, or not where it is.
    Flags,
    /// A number that is not finite, or bytes that do not decode.
    Records,
    /// It is not sent.
    Drop,
    /// It is sent twice.
    Twice,
}

impl Corruption {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Step,
        Self::Epoch,
        Self::Set,
        Self::Count,
        Self::Flags,
        Self::Records,
        Self::Drop,
        Self::Twice,
    ];
}

impl FaultKind {
    /// Name in tables.
    pub fn name(self) -> String {
        match self {
            Self::Die => "death".into(),
            Self::Freeze(None) => "freeze".into(),
            Self::Freeze(Some(_)) => "freeze and thaw".into(),
            Self::Corrupt(corruption) => format!("message: {corruption:?}"),
        }
    }
}
