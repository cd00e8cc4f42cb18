//! Broken sessions: the handshake, orders and grants, and the end.

use interface::control::{Notice, Order, Party};
use interface::stage::Payload;

use super::super::nap_for_many;
use super::spoil::{config, deaf_to, each_grant, first, grants, points, ready, words};
use crate::mutant::{Flaw, Manners, Mutant};

/// In the order of the clauses.
pub const MUTANTS: &[Mutant] = &[
    Mutant::new("S-2a", "says it is a dem", || {
        Flaw::notices(|notice| {
            if let Notice::Hello(hello) = notice {
                hello.party = Party::Dem;
            }
        })
    }),
    Mutant::new("V-1a", "speaks another major version", || {
        Flaw::notices(|notice| {
            if let Notice::Hello(hello) = notice {
                hello.protocol.0 += 1;
            }
        })
    }),
    Mutant::new("O-1a", "says another process's id", || {
        Flaw::notices(|notice| {
            if let Notice::Hello(hello) = notice {
                hello.pid += 1;
            }
        })
    }),
    Mutant::new("S-6a", "repeats another scene's hash", || {
        Flaw::notices(|notice| {
            if let Notice::Ready(ready) = notice {
                ready.scene_hash = "deadbeef".into();
            }
        })
    }),
    Mutant::new("S-7a", "joins the exchange after Ready", || {
        Flaw::manners(Manners {
            opens_late: true,
            ..Manners::default()
        })
    }),
    Mutant::new("S-2b", "counts a point too many", || {
        ready(|ready| ready.items += 1)
    }),
    Mutant::new("S-2c", "says a time of its own", || {
        ready(|ready| ready.courant_time *= 1.01)
    }),
    Mutant::new("S-2d", "says the mass of two points", || {
        ready(|ready| ready.mass_min *= 2.0)
    }),
    Mutant::new(
        "S-8a",
        "takes a cell of its own where there is none",
        || {
            config(|config| {
                if config.cell == 0.0 {
                    config.cell = 0.05;
                }
            })
        },
    ),
    Mutant::new(
        "S-8b",
        "takes the first material where there is none",
        || {
            config(|config| {
                let materials = config.materials.len();
                for group in config.groups.iter_mut().filter(|g| g.material >= materials) {
                    group.material = 0;
                }
            })
        },
    ),
    Mutant::new("J-1a", "overlooks what it does not know", || {
        Flaw::configure(|configure| {
            let value = serde_json::from_str::<serde_json::Value>(&configure.config);
            if let Ok(serde_json::Value::Object(mut object)) = value
                && object.remove("buoyancy").is_some()
            {
                configure.config = serde_json::Value::Object(object).to_string();
            }
        })
    }),
    Mutant::new("S-1a", "overlooks an order that does not decode", || {
        deaf_to(|order| order.is_err())
    }),
    Mutant::new("S-4a", "overlooks an order before Configure", || {
        let mut configured = false;
        deaf_to(move |order| {
            configured |= matches!(order, Ok(Order::Configure(_)));
            !configured && matches!(order, Ok(Order::Drain))
        })
    }),
    Mutant::new("G-1a", "takes the first of two grants", || {
        grants(|header, grants| {
            grants.truncate(1);
            header.count = 1;
        })
    }),
    Mutant::new("G-2a", "takes a step of no number for 0", || {
        each_grant(|grant| {
            if grant.dt.is_nan() {
                grant.dt = 0.0;
            }
        })
    }),
    Mutant::new("G-3a", "takes an old grant for the next one", || {
        first(u64::max)
    }),
    Mutant::new("G-3b", "takes a late grant for the next one", || {
        first(u64::min)
    }),
    Mutant::new("G-3c", "takes a grant of no steps for one of one", || {
        each_grant(|grant| grant.steps = grant.steps.max(1))
    }),
    Mutant::new("S-3a", "overlooks Close before Drain", || {
        let mut drained = false;
        deaf_to(move |order| {
            drained |= matches!(order, Ok(Order::Drain));
            !drained && matches!(order, Ok(Order::Close))
        })
    }),
    Mutant::new("D-1a", "sends its points backwards", || {
        points(|_, points| points.reverse())
    }),
    Mutant::new("D-1b", "leaves the step out of the final header", || {
        points(|header, _| header.step = 0)
    }),
    Mutant::new(
        "R-5a",
        "says that all points are of the first group",
        || points(|_, points| points.iter_mut().for_each(|p| p.group = 0)),
    ),
    Mutant::new("R-5b", "turns shear stress round", || {
        points(|_, points| points.iter_mut().for_each(|p| p.stress[3] *= -1.0))
    }),
    Mutant::new("D-2a", "goes after Bye", || {
        Flaw::manners(Manners {
            goes_at_bye: true,
            ..Manners::default()
        })
    }),
    Mutant::new("X-2a", "ends with status 3", || {
        Flaw::manners(Manners {
            status_closed: Some(3),
            ..Manners::default()
        })
    }),
    Mutant::new("X-2b", "ends with status 0", || {
        Flaw::manners(Manners {
            status_failed: Some(0),
            ..Manners::default()
        })
    }),
    Mutant::new("S-9a", "is deaf to Abort", || {
        deaf_to(|order| matches!(order, Ok(Order::Abort(_))))
    }),
    Mutant::new("S-9b", "complains of Abort", || {
        Flaw::inbound(|mut message| {
            if let (Ok(Order::Abort(_)), Payload::Order(bytes)) =
                (message.as_order(), &mut message.payload)
            {
                bytes.push(0);
            }
            vec![message]
        })
    }),
    Mutant::new("S-11a", "does not say who is silent", || {
        words("dem", "other")
    }),
    Mutant::new("S-11b", "waits for the coupler for ever", || {
        Flaw::manners(Manners {
            waits_for_ever: true,
            ..Manners::default()
        })
    }),
    Mutant::new("X-6a", "keeps all that it is told", || {
        let mut kept = Vec::new();
        Flaw::inbound(move |message| {
            kept.push(message.clone());
            vec![message]
        })
    }),
    Mutant::new("G-10a", "takes a nap before it sends many points", || {
        Flaw::outbound(|message| {
            if let Payload::States(states) = &message.payload {
                nap_for_many(states.len());
            }
            vec![message]
        })
    }),
    Mutant::new("X-3a", "lives on without its coupler", || {
        Flaw::manners(Manners {
            never_looks_up: true,
            ..Manners::default()
        })
    }),
    Mutant::new("X-5a", "ends on Ctrl-C", || {
        Flaw::manners(Manners {
            ends_on_interrupt: true,
            ..Manners::default()
        })
    }),
];
