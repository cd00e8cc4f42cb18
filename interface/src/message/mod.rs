//! The messages between the parties: the channels, and the content of a message on each.
//!
//! A channel has one sender, one receiver and one type of record.

pub(crate) mod codec;
pub mod control;
pub mod wire;

use std::any::Any;

use serde::Serialize;

use crate::message::codec::encode;
use crate::message::control::{Notice, Order, Party};
use crate::message::wire::{Record, StepHeader, bytes_of, fill};

/// What a channel carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum Kind {
    /// From the coupler: control messages.
    Order,
    /// To the coupler: control messages.
    Notice,
    /// From the coupler: steps.
    Grant,
    /// To the coupler: what a grant has led to.
    Report,
    /// To the coupler: pieces of a saved state.
    Saved,
    /// From the coupler: pieces of a state to restore.
    Restore,
    /// From the continuum to the coupler: sums over point groups.
    Groups,
    /// From the continuum to the coupler: all points.
    Points,
    /// From the bodies to the coupler: all bodies.
    Bodies,
    /// From the bodies to the coupler: contacts of a frame.
    Contacts,
    /// From the continuum to the bodies: which points are IMPs.
    Set,
    /// From the continuum to the bodies: their states.
    States,
    /// From the bodies to the continuum: forces on them.
    Forces,
    /// From the bodies to the continuum: outlines.
    Envelopes,
}

/// One channel of a run: what it carries, and to which solver it belongs (for those between the solvers: to the
/// continuum).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Channel {
    /// What it carries.
    pub kind: Kind,
    solver: Party,
}

/// Number of channels.
pub const CHANNELS: usize = 20;

impl Kind {
    /// The names of its channels, that of the continuum and that of the bodies; its sender and its receiver. `None` is the
    /// solver to which the channel belongs. All other facts about channels follow from these rows.
    const fn row(self) -> ([&'static str; 2], Option<Party>, Option<Party>) {
        use Party::{Coupler, Dem, Mpm};
        match self {
            Self::Order => (["mpm/orders", "dem/orders"], Some(Coupler), None),
            Self::Notice => (["mpm/notices", "dem/notices"], None, Some(Coupler)),
            Self::Grant => (["mpm/grants", "dem/grants"], Some(Coupler), None),
            Self::Report => (["mpm/reports", "dem/reports"], None, Some(Coupler)),
            Self::Saved => (["mpm/saved", "dem/saved"], None, Some(Coupler)),
            Self::Restore => (["mpm/restore", "dem/restore"], Some(Coupler), None),
            Self::Groups => (["mpm/groups"; 2], Some(Mpm), Some(Coupler)),
            Self::Points => (["mpm/points"; 2], Some(Mpm), Some(Coupler)),
            Self::Bodies => (["dem/bodies"; 2], Some(Dem), Some(Coupler)),
            Self::Contacts => (["dem/contacts"; 2], Some(Dem), Some(Coupler)),
            Self::Set => (["imp/set"; 2], Some(Mpm), Some(Dem)),
            Self::States => (["imp/states"; 2], Some(Mpm), Some(Dem)),
            Self::Forces => (["imp/forces"; 2], Some(Dem), Some(Mpm)),
            Self::Envelopes => (["imp/envelopes"; 2], Some(Dem), Some(Mpm)),
        }
    }

    /// Whether each solver has a channel of this kind.
    const fn is_of_each(self) -> bool {
        let (_, from, to) = self.row();
        from.is_none() || to.is_none()
    }
}

impl Channel {
    /// All channels; the place in this list is the channel's number in a recording.
    pub const ALL: [Self; CHANNELS] = {
        let mut all = [Self::of(Party::Mpm, Kind::Order); CHANNELS];
        let mut n = 0;
        while n < Kind::ALL.len() {
            let kind = Kind::ALL[n];
            let (mpm, dem) = (Self::of(Party::Mpm, kind), Self::of(Party::Dem, kind));
            all[mpm.number()] = mpm;
            all[dem.number()] = dem;
            n += 1;
        }
        all
    };

    /// The channel of this kind in the session of `solver`.
    pub const fn of(solver: Party, kind: Kind) -> Self {
        let solver = match kind.row() {
            (_, None, _) | (_, _, None) => solver,
            (_, Some(Party::Dem), Some(Party::Coupler)) => Party::Dem,
            _ => Party::Mpm,
        };
        Self { kind, solver }
    }

    /// Its place in [`Self::ALL`].
    pub const fn number(self) -> usize {
        let first = matches!(self.solver, Party::Mpm) && self.kind.is_of_each();
        self.kind as usize + if first { 0 } else { CHANNELS - Kind::ALL.len() }
    }

    /// Name of its service.
    pub const fn name(self) -> &'static str {
        let ([mpm, dem], ..) = self.kind.row();
        match self.solver {
            Party::Dem => dem,
            _ => mpm,
        }
    }

    /// The party that sends.
    pub const fn from(self) -> Party {
        match self.kind.row().1 {
            Some(party) => party,
            None => self.solver,
        }
    }

    /// The party that receives.
    pub const fn to(self) -> Party {
        match self.kind.row().2 {
            Some(party) => party,
            None => self.solver,
        }
    }

    /// The channels that a solver opens after Hello and before Ready (clause S-7): for measurements and saved states, and if
    /// the run is coupled those to the other solver.
    pub fn before_ready(solver: Party, coupled: bool) -> Vec<Self> {
        let is_opened = |channel: &Self| {
            channel.is_of(solver)
                && match channel.kind {
                    Kind::Order | Kind::Notice | Kind::Grant | Kind::Report | Kind::Restore => {
                        false
                    }
                    _ => coupled || !channel.is_between_solvers(),
                }
        };
        Self::ALL.into_iter().filter(is_opened).collect()
    }

    /// Whether a party sends or receives on it.
    pub fn is_of(self, party: Party) -> bool {
        self.from() == party || self.to() == party
    }

    /// Whether it runs between the two solvers.
    pub const fn is_between_solvers(self) -> bool {
        !matches!(self.from(), Party::Coupler) && !matches!(self.to(), Party::Coupler)
    }

    /// Whether its receiver is woken for a message (clause B-2). The others are directly followed by a message of such a channel.
    pub const fn wakes(self) -> bool {
        !matches!(
            self.kind,
            Kind::Set | Kind::Groups | Kind::Points | Kind::Bodies | Kind::Contacts
        )
    }
}

macro_rules! define {
    ($($kind:ident: $record:ty),*) => {
        /// The records of a message, borrowed.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Records<'a> {
            $(#[doc = concat!("Of [`Kind::", stringify!($kind), "`].")] $kind(&'a [$record])),*
        }

        /// The records of a message.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Payload {
            $(#[doc = concat!("Of [`Kind::", stringify!($kind), "`].")] $kind(Vec<$record>)),*
        }

        impl Kind {
            /// All kinds.
            pub const ALL: [Self; [$(Self::$kind),*].len()] = [$(Self::$kind),*];
        }

        impl Records<'_> {
            /// What they carry.
            pub fn kind(&self) -> Kind {
                match self { $(Self::$kind(_) => Kind::$kind),* }
            }

            /// How many there are.
            pub fn len(&self) -> usize {
                match self { $(Self::$kind(records) => records.len()),* }
            }

            /// The same, owned.
            pub fn to_payload(self) -> Payload {
                match self { $(Self::$kind(records) => Payload::$kind(records.to_vec())),* }
            }

            /// Whether every number is allowed on the wire (clause W-1).
            ///
            /// # Errors
            /// The index of the record, and the name of the field with a value that is not allowed.
            pub fn check(&self) -> Result<(), (usize, &'static str)> {
                match self { $(Self::$kind(records) => check_all(records)),* }
            }

            /// Shows every number with the slot of its record and the name of its field, in the order of the layout.
            pub fn visit(&self, see: &mut dyn FnMut(usize, &'static str, wire::Number)) {
                match self {
                    $(Self::$kind(records) => (0..).zip(*records).for_each(|(slot, record)| {
                        record.visit(&mut |name, number| see(slot, name, number));
                    })),*
                }
            }

            /// Their bytes, as on the wire.
            pub fn bytes(&self) -> &[u8] {
                match self { $(Self::$kind(records) => bytes_of(records)),* }
            }
        }

        impl Payload {
            /// No records of this kind.
            pub fn empty(kind: Kind) -> Self {
                match kind { $(Kind::$kind => Self::$kind(Vec::new())),* }
            }

            /// The records if they are of this type, else none.
            pub fn of<T: Record>(&self) -> &[T] {
                let records = match self {
                    $(Self::$kind(records) => (records as &dyn Any).downcast_ref::<Vec<T>>()),*
                };
                records.map_or(&[], Vec::as_slice)
            }

            /// The records.
            pub fn records(&self) -> Records<'_> {
                match self { $(Self::$kind(records) => Records::$kind(records)),* }
            }

            /// Copies `records`. Memory is reused if the kind stays the same.
            pub fn copy_from(&mut self, records: Records<'_>) {
                match (self, records) {
                    $((Self::$kind(own), Records::$kind(new)) => { own.clear(); own.extend_from_slice(new); })*
                    (own, other) => *own = other.to_payload(),
                }
            }

            /// Takes the records in `bytes`, as on the wire; whether they are whole records. Memory is reused.
            pub fn fill(&mut self, bytes: &[u8]) -> bool {
                match self { $(Self::$kind(records) => fill(records, bytes)),* }
            }

            /// The records of `kind` in `bytes`, as on the wire; `None` if they are not whole records.
            pub fn read(kind: Kind, bytes: &[u8]) -> Option<Self> {
                let mut payload = Self::empty(kind);
                payload.fill(bytes).then_some(payload)
            }
        }
    };
}
define! {
    Order: u8, Notice: u8, Grant: wire::Grant, Report: wire::Report, Saved: u8, Restore: u8, Groups: wire::GroupState,
    Points: wire::PointState, Bodies: wire::BodyState, Contacts: wire::ContactState, Set: wire::ImpInfo,
    States: wire::ImpState, Forces: wire::ImpForce, Envelopes: wire::EnvelopeVertex
}

fn check_all<T: Record>(records: &[T]) -> Result<(), (usize, &'static str)> {
    // Nearly always all values are allowed, and this test is much cheaper than the exact one.
    if T::fault_bits_of(records) >> 63 == 0 {
        return Ok(());
    }
    for (slot, record) in records.iter().enumerate() {
        record.check().map_err(|field| (slot, field))?;
    }
    Ok(())
}

impl Payload {
    /// What it carries.
    pub fn kind(&self) -> Kind {
        self.records().kind()
    }

    /// How many records.
    pub fn len(&self) -> usize {
        self.records().len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Records<'_> {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A message as it is on the wire.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// The header as sent, or to be sent without a check: `count` may be wrong.
    pub header: StepHeader,
    /// The records.
    pub payload: Payload,
}

impl Message {
    /// A place where messages of this kind arrive.
    pub fn empty(kind: Kind) -> Self {
        Self::new(StepHeader::default(), Payload::empty(kind))
    }

    /// A message whose header has the right count.
    pub fn new(header: StepHeader, payload: Payload) -> Self {
        let count = payload.len() as u64;
        Self {
            header: StepHeader { count, ..header },
            payload,
        }
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

    /// What it carries.
    pub fn kind(&self) -> Kind {
        self.payload.kind()
    }

    /// The order in it.
    ///
    /// # Errors
    /// Why it is not an order.
    pub fn as_order(&self) -> Result<Order, String> {
        match &self.payload {
            Payload::Order(bytes) => Order::decode(bytes).map_err(|e| e.to_string()),
            other => Err(format!("{:?} instead of an order", other.kind())),
        }
    }

    /// The notice in it.
    ///
    /// # Errors
    /// Why it is not a notice.
    pub fn as_notice(&self) -> Result<Notice, String> {
        match &self.payload {
            Payload::Notice(bytes) => Notice::decode(bytes).map_err(|e| e.to_string()),
            other => Err(format!("{:?} instead of a notice", other.kind())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::wire::ImpState;

    #[test]
    fn every_channel_has_its_number_and_name() {
        for (number, channel) in Channel::ALL.into_iter().enumerate() {
            assert_eq!(channel.number(), number);
            assert_ne!(channel.from(), channel.to());
            assert_eq!(Channel::of(channel.solver, channel.kind), channel);
        }
        assert_eq!(
            Channel::of(Party::Dem, Kind::Set),
            Channel::of(Party::Mpm, Kind::Set)
        );
    }

    /// In every slot, also where the number of numbers is no multiple of what is tested at once.
    #[test]
    fn a_number_that_is_not_finite_is_found_wherever_it_is() {
        for (count, slot) in (1..9).flat_map(|count| (0..count).map(move |slot| (count, slot))) {
            let mut states = vec![ImpState::default(); count];
            for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                states[slot].spin = wrong;
                let found = Records::States(&states).check();
                assert_eq!(found, Err((slot, "spin")), "{wrong} of {count}");
            }
            for right in [-0.0, f64::MAX, f64::MIN, f64::from_bits(1)] {
                states[slot].spin = right;
                assert_eq!(Records::States(&states).check(), Ok(()), "{right}");
            }
        }
    }
}
