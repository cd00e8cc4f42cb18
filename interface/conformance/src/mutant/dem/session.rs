//! Broken sessions: the handshake, refusals, and the end.

use interface::control::{Notice, Order, Party};
use interface::stage::{Kind, Payload};
use serde_json::{Value, json};

use super::super::nap_for_many;
use super::spoil::{hello, json_config, manners, orders, shared};
use crate::mutant::{Flaw, Mutant};

/// In the order of the clauses.
pub const MUTANTS: &[Mutant] = &[
    Mutant::new("S-2a", "says that it is the mpm", || {
        hello(|hello| hello.party = Party::Mpm)
    }),
    Mutant::new("V-1a", "speaks another major version", || {
        hello(|hello| hello.protocol.0 += 1)
    }),
    Mutant::new("O-1a", "gives another process's id", || {
        hello(|hello| hello.pid += 1)
    }),
    Mutant::new("S-6a", "repeats another scene's hash", || {
        Flaw::notices(|notice| {
            if let Notice::Ready(ready) = notice {
                ready.scene_hash = "deadbeef".into();
            }
        })
    }),
    Mutant::new("S-7a", "opens a channel only after Ready", || {
        manners(|m| m.opens_late = true)
    }),
    Mutant::new("S-2b", "says Bye twice", || {
        Flaw::outbound(|message| match message.as_notice() {
            Ok(Notice::Bye) => vec![message.clone(), message],
            _ => vec![message],
        })
    }),
    Mutant::new("S-1a", "overlooks bytes behind an order", || {
        orders(|bytes| {
            bytes.pop();
        })
    }),
    Mutant::new(
        "M-1a",
        "waits for the rest of an order that is too short",
        || {
            Flaw::inbound(|message| match &message.payload {
                Payload::Order(bytes) if bytes.len() > 12 && bytes[4..12] == [0xff; 8] => {
                    Vec::new()
                }
                _ => vec![message],
            })
        },
    ),
    Mutant::new("S-4a", "overlooks orders before Configure", || {
        let mut configured = false;
        Flaw::inbound(move |message| {
            configured |= matches!(
                message.as_order(),
                Ok(Order::Configure(_) | Order::Abort(_)) | Err(_)
            );
            if configured {
                vec![message]
            } else {
                Vec::new()
            }
        })
    }),
    Mutant::new("S-3a", "overlooks a second Configure", || {
        let mut configured = false;
        Flaw::inbound(move |message| {
            if matches!(message.as_order(), Ok(Order::Configure(_))) {
                if configured {
                    return Vec::new();
                }
                configured = true;
            }
            vec![message]
        })
    }),
    Mutant::new("J-1a", "overlooks fields that it does not know", || {
        json_config(|config| {
            config.remove("buoyancy");
        })
    }),
    Mutant::new("S-5a", "makes up a missing field", || {
        json_config(|config| {
            config.entry("skin").or_insert(json!(1e-3));
        })
    }),
    Mutant::new("S-5b", "takes a word for a number", || {
        json_config(|config| {
            if config.get("skin").is_some_and(Value::is_string) {
                config.insert("skin".into(), json!(1e-3));
            }
        })
    }),
    Mutant::new("S-8a", "takes no threads for one", || {
        Flaw::bodies_config(|config| config.threads = config.threads.max(1))
    }),
    Mutant::new("S-9a", "overlooks Abort", || {
        Flaw::inbound(|message| match message.as_order() {
            Ok(Order::Abort(_)) => Vec::new(),
            _ => vec![message],
        })
    }),
    Mutant::new("S-9b", "overlooks Abort within a step", || {
        let (busy, free) = shared(false);
        let mut flaw = Flaw::inbound(move |message| {
            if message.kind() == Kind::Grant {
                busy.set(true);
            }
            match message.as_order() {
                Ok(Order::Abort(_)) if busy.get() => Vec::new(),
                _ => vec![message],
            }
        });
        flaw.outbound = Box::new(move |message| {
            if message.kind() == Kind::Report {
                free.set(false);
            }
            vec![message]
        });
        flaw
    }),
    Mutant::new("X-3a", "does not look whether its coupler lives", || {
        manners(|m| m.never_looks_up = true)
    }),
    Mutant::new(
        "X-3b",
        "does not look whether its coupler lives within a step",
        || manners(|m| m.never_looks_up_in_a_step = true),
    ),
    Mutant::new("S-11a", "waits for ever", || {
        Flaw::configure(|configure| configure.deadline = 600.0)
    }),
    Mutant::new("S-11b", "waits for the coupler for ever", || {
        manners(|m| m.waits_for_ever = true)
    }),
    Mutant::new("D-2a", "goes after Bye", || {
        manners(|m| m.goes_at_bye = true)
    }),
    Mutant::new("X-1a", "does not say which clause", || {
        Flaw::notices(|notice| {
            if let Notice::Failed(failure) = notice {
                failure.message = failure.message.replace("G-2", "a clause");
            }
        })
    }),
    Mutant::new("X-2a", "ends with status 1", || {
        manners(|m| m.status_closed = Some(1))
    }),
    Mutant::new("X-2b", "ends with status 0 though it failed", || {
        manners(|m| m.status_failed = Some(0))
    }),
    Mutant::new(
        "X-2c",
        "ends with status 0 though there is nothing to join",
        || manners(|m| m.status_unjoined = Some(0)),
    ),
    Mutant::new("X-5a", "ends on Ctrl-C", || {
        manners(|m| m.ends_on_interrupt = true)
    }),
    Mutant::new("X-6a", "keeps all that it is told", || {
        let mut kept = Vec::new();
        Flaw::inbound(move |message| {
            kept.push(message.clone());
            vec![message]
        })
    }),
    Mutant::new("G-10a", "takes a nap before it answers many points", || {
        Flaw::forces(|_, forces| nap_for_many(forces.len()))
    }),
    Mutant::new("O-6a", "removes the run's lock", || {
        manners(|m| m.removes_the_lock = true)
    }),
];
