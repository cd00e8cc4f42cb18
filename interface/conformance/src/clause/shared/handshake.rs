//! Sections 2 and 3: the session until the solver is ready.

use std::time::Duration;

use interface::message::control::{Notice, Order, PROTOCOL, Party};
use interface::message::wire::StepHeader;
use interface::transport::raw::{Kind, Message, Payload};
use serde_json::{Value, json};

use super::run::{Run, order};
use crate::bench::{Bench, HASH, Session};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, broken, require};
use interface::config::capability::{FAMILIES, VERBS};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "S-2a",
        "says Hello first, as the party of its channels",
        hello,
    )
    .mutant("says that it is the other side", || {
        change::hello(|hello| {
            hello.party = hello.party.other_solver().expect("a solver says Hello");
        })
    }),
    Clause::must("V-1a", "speaks this major version", version)
        .mutant("speaks another major version", || {
            change::hello(|hello| hello.protocol.0 += 1)
        }),
    Clause::must("O-1a", "the process that was started says Hello", pid)
        .of_processes()
        .mutant("gives another process's id", || {
            change::hello(|hello| hello.pid += 1)
        }),
    Clause::must(
        "K-1a",
        "every capability is a verb or a member of a known family",
        names,
    )
    .mutant("states an unknown capability", || {
        change::hello(|hello| hello.capabilities.0.push("does everything".into()))
    }),
    Clause::must("S-6a", "Ready repeats the scene hash", hash).mutant(
        "repeats another scene's hash",
        || {
            Flaw::notices(|notice| {
                if let Notice::Ready(ready) = notice {
                    ready.scene_hash = "deadbeef".into();
                }
            })
        },
    ),
    Clause::must(
        "S-7a",
        "opens its control channels before Hello, all channels before Ready",
        opened,
    )
    .mutant("opens a channel only after Ready", || {
        Flaw::process(|m| m.opens_late = true)
    }),
    Clause::must(
        "S-2b",
        "says Hello, Ready and Bye, once each, and nothing else",
        notices,
    )
    .mutant("says Bye twice", || {
        Flaw::passing(|message| match message.as_notice() {
            Ok(Notice::Bye) => vec![message.clone(), message],
            _ => vec![message],
        })
    }),
    Clause::must("S-1a", "refuses an order with a byte too many", |bench| {
        first_order(bench, |bytes| bytes.push(0))
    })
    .mutant("ignores bytes after an order", || {
        change::orders(|bytes| {
            bytes.pop();
        })
    }),
    Clause::must("M-1a", "refuses an impossible length", |bench| {
        // The length of the hash, behind the variant's four bytes.
        first_order(bench, |bytes| {
            bytes[4..12].copy_from_slice(&u64::MAX.to_le_bytes());
        })
    })
    .mutant("waits for the rest of an order that is too short", || {
        let absurd = |bytes: &[u8]| bytes.len() > 12 && bytes[4..12] == [0xff; 8];
        Flaw::passing(move |message| match &message.payload {
            Payload::Order(bytes) if absurd(bytes) => Vec::new(),
            _ => vec![message],
        })
    }),
    Clause::must(
        "S-4a",
        "refuses a first order other than Configure",
        no_configuration,
    )
    .mutant("ignores orders before Configure", || {
        let mut configured = false;
        change::ignoring(move |order| {
            configured |= matches!(order, Ok(Order::Configure(_) | Order::Abort(_)) | Err(_));
            !configured
        })
    }),
    Clause::must("S-3a", "refuses a second Configure", |bench| {
        out_of_turn(bench, &Order::Configure(order(bench)))
    })
    .mutant("ignores a second Configure", || {
        let mut configured = false;
        change::ignoring(move |order| {
            let again = configured;
            configured |= matches!(order, Ok(Order::Configure(_)));
            again && matches!(order, Ok(Order::Configure(_)))
        })
    }),
    Clause::must("S-3b", "refuses Close before Drain", |bench| {
        out_of_turn(bench, &Order::Close)
    })
    .mutant("ignores Close before Drain", || {
        let mut drained = false;
        change::ignoring(move |order| {
            drained |= matches!(order, Ok(Order::Drain));
            !drained && matches!(order, Ok(Order::Close))
        })
    }),
    Clause::should("J-1a", "refuses a field that it does not know", |bench| {
        unfit(bench, |config| config["buoyancy"] = json!(1.0))
    })
    .mutant("ignores fields that it does not know", || {
        change::json_config(|config| {
            config.remove("buoyancy");
        })
    }),
    Clause::must(
        "S-5a",
        "refuses a configuration with a field missing",
        |bench| {
            unfit(bench, |config| {
                config.as_object_mut().map(|fields| fields.remove("skin"));
            })
        },
    )
    .mutant("uses a default for a missing field", || {
        change::json_config(|config| {
            config.entry("skin").or_insert(json!(1e-3));
        })
    }),
    Clause::must("S-5b", "refuses a field of the wrong type", |bench| {
        unfit(bench, |config| config["skin"] = json!("thick"))
    })
    .mutant("accepts text as a number", || {
        change::json_config(|config| {
            if config.get("skin").is_some_and(Value::is_string) {
                config.insert("skin".into(), json!(1e-3));
            }
        })
    }),
    Clause::must(
        "S-8a",
        "answers an impossible value with Refused and its key",
        refused,
    )
    .mutant("uses a default instead of 0", || {
        change::json_config(|config| {
            for (key, some) in [("threads", json!(1)), ("cell", json!(0.05))] {
                if config.get(key).and_then(Value::as_f64) == Some(0.0) {
                    config.insert(key.into(), some);
                }
            }
        })
    }),
];

fn hello(bench: &Bench) -> Judgement {
    let hello = bench.session()?.hello()?;
    let party = bench.subject.party;
    require(hello.party == party, party, hello.party)?;
    Ok(format!("`{}`", hello.identity))
}

fn version(bench: &Bench) -> Judgement {
    let (major, minor) = bench.session()?.hello()?.protocol;
    require(major == PROTOCOL.0, PROTOCOL.0, major)?;
    Ok(format!("{major}.{minor}"))
}

fn pid(bench: &Bench) -> Judgement {
    let mut session = bench.session()?;
    let said = session.hello()?.pid;
    match session.pid() {
        Some(pid) if pid == said => Ok(format!("pid {pid}")),
        pid => Err(broken(format_args!("pid {pid:?}"), said)),
    }
}

fn names(bench: &Bench) -> Judgement {
    let named = bench.session()?.hello()?.capabilities.0;
    let known = |name: &&String| match name.split_once(':') {
        Some((family, member)) => FAMILIES.contains(&family) && !member.is_empty(),
        None => VERBS.contains(&name.as_str()),
    };
    let unknown = named.iter().find(|name| !known(name));
    require(
        unknown.is_none(),
        "verbs and `family:member`",
        format_args!("{unknown:?}"),
    )?;
    Ok(if named.is_empty() {
        "none".into()
    } else {
        named.join(", ")
    })
}

fn hash(bench: &Bench) -> Judgement {
    let mut session = bench.greeted()?;
    let ready = session.ready(&order(bench))?;
    require(ready.scene_hash == HASH, HASH, &ready.scene_hash)?;
    Ok(ready.scene_hash)
}

fn opened(bench: &Bench) -> Judgement {
    let mut session = bench.greeted()?;
    let of_line = |name: &&str| {
        let line = ["orders", "notices", "grants", "reports", "coupler"];
        line.iter().any(|part| name.contains(part))
    };
    let unopened = session.raw_run.unopened();
    let missing: Vec<&str> = unopened.into_iter().filter(of_line).collect();
    require(
        missing.is_empty(),
        "its line open at Hello",
        format_args!("closed: {missing:?}"),
    )?;
    session.ready(&order(bench))?;
    // Clauses about a capability apply to solvers that have it.
    let asked = |name: &&str| match name.rsplit('/').next() {
        Some("saved" | "restore") => bench.takes("save"),
        Some("contacts") => bench.takes("contacts"),
        _ => true,
    };
    let unopened = session.raw_run.unopened();
    let missing: Vec<&str> = unopened.into_iter().filter(asked).collect();
    require(
        missing.is_empty(),
        "all open at Ready",
        format_args!("closed: {missing:?}"),
    )?;
    Ok("all open".into())
}

fn notices(bench: &Bench) -> Judgement {
    let mut run = Run::begun(bench)?;
    // How long the kit waits for messages that must not come.
    let grace = Duration::from_millis(10);
    for close in [true, false] {
        if let Some(notice) = run.session.unexpected(Kind::Notice, grace)? {
            return Err(broken(
                "no notice",
                format_args!("{:?}", notice.as_notice()),
            ));
        }
        if close {
            run.session.close()?;
        }
    }
    Ok("Hello, Ready, Bye".into())
}

/// Waits for Failed or Refused in answer to what cannot be taken.
fn rejection(session: &mut Session) -> Judgement {
    match session.notice()? {
        Notice::Failed(failure) => Ok(failure.message),
        Notice::Refused(refusal) => Ok(refusal.to_string()),
        other => Err(broken("Failed or Refused", format_args!("{other:?}"))),
    }
}

/// Sends bytes as the first order.
fn first_order(bench: &Bench, change: fn(&mut Vec<u8>)) -> Judgement {
    let mut session = bench.greeted()?;
    let right = Message::order(&Order::Configure(order(bench)));
    let Payload::Order(mut bytes) = right.payload else {
        unreachable!("an order is one");
    };
    change(&mut bytes);
    session.send(&Message::new(StepHeader::default(), Payload::Order(bytes)))?;
    rejection(&mut session)
}

fn no_configuration(bench: &Bench) -> Judgement {
    let mut session = bench.greeted()?;
    session.order(&Order::Drain)?;
    rejection(&mut session)
}

fn out_of_turn(bench: &Bench, order: &Order) -> Judgement {
    let mut run = Run::begun(bench)?;
    run.session.order(order)?;
    Ok(run.session.failure()?.message)
}

/// Hands over a configuration after `change`.
fn changed(bench: &Bench, change: fn(&mut Value)) -> Result<Session<'_>, Unmet> {
    let mut session = bench.greeted()?;
    let mut order = order(bench);
    let mut config = serde_json::from_str(&order.config).expect("a configuration is JSON");
    change(&mut config);
    order.config = config.to_string();
    session.order(&Order::Configure(order))?;
    Ok(session)
}

fn unfit(bench: &Bench, change: fn(&mut Value)) -> Judgement {
    rejection(&mut changed(bench, change)?)
}

fn refused(bench: &Bench) -> Judgement {
    let (key, change): (_, fn(&mut Value)) = match bench.subject.party {
        Party::Mpm => ("cell", |config| config["cell"] = json!(0.0)),
        _ => ("threads", |config| config["threads"] = json!(0)),
    };
    match changed(bench, change)?.notice()? {
        Notice::Refused(refusal) => {
            let named = refusal.key.contains(key) && !refusal.message.is_empty();
            require(
                named,
                format_args!("the key `{key}` and a message"),
                &refusal,
            )?;
            Ok(refusal.to_string())
        }
        other => Err(broken("Refused", format_args!("{other:?}"))),
    }
}
