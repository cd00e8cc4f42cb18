//! What is wrong with messages: what the kit says wrongly on purpose.

use interface::message::control::{Configure, Order};
use interface::message::wire::{
    BodyState, ContactState, EnvelopeVertex, Grant, GroupState, ImpForce, ImpInfo, ImpState,
    PointState, Report, StepHeader,
};
use interface::message::{Message, Payload};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// A change of messages on their way. The broken solvers that test the kit (`tests/mutant`) are made of such changes, too.
pub struct Flaw(Box<dyn FnMut(Message) -> Vec<Message>>);

impl Flaw {
    /// Passes on this instead of a message: nothing, the message, or several.
    pub fn passing(pass: impl FnMut(Message) -> Vec<Message> + 'static) -> Self {
        Self(Box::new(pass))
    }

    /// What is passed on instead of a message.
    pub fn pass(&mut self, message: Message) -> Vec<Message> {
        (self.0)(message)
    }

    /// Changes each message that passes.
    pub fn each(mut change: impl FnMut(&mut Message) + 'static) -> Self {
        Self::passing(move |mut message| {
            change(&mut message);
            vec![message]
        })
    }

    /// This one, and then another one.
    #[must_use]
    pub fn with(mut self, mut other: Self) -> Self {
        Self::passing(move |message| {
            let passed = self.pass(message).into_iter();
            passed.flat_map(|message| other.pass(message)).collect()
        })
    }

    /// Changes the bytes of orders.
    pub fn orders(mut change: impl FnMut(&mut Vec<u8>) + 'static) -> Self {
        Self::each(move |message| {
            if let Payload::Order(bytes) = &mut message.payload {
                change(bytes);
            }
        })
    }

    /// Changes the pieces of a saved state, whichever way they go.
    pub fn pieces(mut change: impl FnMut(&StepHeader, &mut Vec<u8>) + 'static) -> Self {
        Self::each(move |message| {
            if let Payload::Saved(piece) | Payload::Restore(piece) = &mut message.payload {
                change(&message.header, piece);
            }
        })
    }

    /// Changes the order to configure.
    pub fn configure(mut change: impl FnMut(&mut Configure) + 'static) -> Self {
        Self::passing(move |message| match message.as_order() {
            Ok(Order::Configure(mut configure)) => {
                change(&mut configure);
                vec![Message::order(&Order::Configure(configure))]
            }
            _ => vec![message],
        })
    }

    /// Changes a configuration, where it parses; one that is left as it was keeps its bytes.
    pub fn config<C: Clone + PartialEq + Serialize + DeserializeOwned>(
        mut change: impl FnMut(&mut C) + 'static,
    ) -> Self {
        Self::configure(move |configure| {
            if let Ok(config) = serde_json::from_str::<C>(&configure.config) {
                let mut changed = config.clone();
                change(&mut changed);
                if changed != config {
                    configure.config = serde_json::to_string(&changed).expect("it was JSON before");
                }
            }
        })
    }

    /// Changes the fields of a configuration.
    pub fn json(change: impl FnMut(&mut Map<String, Value>) + 'static) -> Self {
        Self::config(change)
    }
}

/// For each kind of record a constructor that changes the header and all records of a message, and one that changes each
/// record.
macro_rules! change {
    ($($all:ident, $one:ident: $payload:ident of $record:ty;)*) => {
        impl Flaw {
            $(#[doc = concat!("Changes messages of [`Payload::", stringify!($payload), "`].")]
            pub fn $all(mut change: impl FnMut(&mut StepHeader, &mut Vec<$record>) + 'static) -> Self {
                Self::each(move |message| {
                    if let Payload::$payload(records) = &mut message.payload {
                        change(&mut message.header, records);
                    }
                })
            }

            #[doc = concat!("Changes each record of [`Payload::", stringify!($payload), "`].")]
            pub fn $one(mut change: impl FnMut(&mut $record) + 'static) -> Self {
                Self::$all(move |_, records| records.iter_mut().for_each(&mut change))
            })*
        }
    };
}

change! {
    grants, grant: Grant of Grant;
    set, info: Set of ImpInfo;
    states, state: States of ImpState;
    forces, force: Forces of ImpForce;
    envelopes, vertex: Envelopes of EnvelopeVertex;
    reports, report: Report of Report;
    bodies, body: Bodies of BodyState;
    contacts, contact: Contacts of ContactState;
    groups, group: Groups of GroupState;
    points, point: Points of PointState;
}
