//! What is broken in solvers of both sides, clause by clause.

use std::sync::atomic::Ordering;
use std::time::Duration;

use conformance::Flaw;
use interface::message::control::{Configure, Notice, Order};
use interface::message::wire::flags;
use interface::message::{Kind, Message, Payload};
use interface::transport::wait::nap;
use serde_json::{Value, json};

use super::row::{Row, rows};
use crate::change;
use crate::wrong::Wrong;

pub const ROWS: &[Row] = rows! {
    clause "S-2a":
        - "says that it is the other side":
            change::hello(|hello| { hello.party = hello.party.other_solver().expect("a solver says Hello"); });
    clause "V-1a":
        - "speaks another major version": change::hello(|hello| hello.protocol.0 += 1);
    clause "O-1a":
        - "gives another process's id": change::hello(|hello| hello.pid += 1);
    clause "K-1a":
        - "states an unknown capability": change::hello(|hello| hello.capabilities.0.push("does everything".into()));
    clause "S-6a":
        - "repeats another scene's hash": change::ready(|ready| ready.scene_hash = "deadbeef".into());
        - "is ready with a mass that is not a number": change::ready(|ready| ready.readiness.mass_min = f64::NAN);
        - "is ready with more memory than there is": change::ready(|ready| ready.readiness.bytes = 1 << 60);
    clause "S-7a":
        - "opens a channel only after Ready": Wrong::process(|m| m.opens_late = true);
    clause "S-2b":
        - "says Bye twice": change::twice(|message| matches!(message.as_notice(), Ok(Notice::Bye)));
    clause "S-1a":
        - "ignores bytes after an order": Flaw::each(|message| {
            let left_over = message.as_order().is_err_and(|why| why.contains("left over"));
            if let Payload::Order(bytes) = &mut message.payload {
                bytes.truncate(bytes.len() - usize::from(left_over));
            }
        });
    clause "M-1a":
        - "waits for the rest of an order that is too short": {
            let absurd = |bytes: &[u8]| bytes.len() > 12 && bytes[4..12] == [0xff; 8];
            Flaw::passing(move |message| match &message.payload {
                Payload::Order(bytes) if absurd(bytes) => Vec::new(),
                _ => vec![message],
            })
        };
    clause "S-4a":
        - "ignores orders before Configure": change::ignoring(|order, now| {
            now.configured.is_none() && !matches!(order, Ok(Order::Configure(_) | Order::Abort(_)) | Err(_))
        });
    clause "S-3a":
        - "ignores a second Configure": change::ignoring(|order, now| {
            now.configured.is_some() && matches!(order, Ok(Order::Configure(_)))
        });
    clause "S-3b":
        - "ignores Close before Drain":
            change::ignoring(|order, now| !now.drained && matches!(order, Ok(Order::Close)));
    clause "J-1a":
        - "ignores fields that it does not know": Flaw::json(|config| { config.remove("buoyancy"); });
    clause "S-5a":
        - "uses a default for a missing field":
            Flaw::json(|config| { config.entry("skin").or_insert(json!(1e-3)); });
    clause "S-5b":
        - "accepts text as a number": Flaw::json(|config| {
            if config.get("skin").is_some_and(Value::is_string) {
                config.insert("skin".into(), json!(1e-3));
            }
        });
    clause "S-8a":
        - "uses a default instead of 0": Flaw::json(|config| {
            for (key, some) in [("threads", json!(1)), ("cell", json!(0.05))] {
                if config.get(key).and_then(Value::as_f64) == Some(0.0) {
                    config.insert(key.into(), some);
                }
            }
        });
    clause "G-1a":
        - "uses the first of two grants": Flaw::grants(|header, grants| { grants.truncate(1); header.count = 1; });
    clause "G-2a":
        - "uses 0 instead of a NaN":
            Flaw::grant(|g| g.epoch_start = if g.epoch_start.is_nan() { 0.0 } else { g.epoch_start });
    clause "G-3a":
        - "accepts an old grant as the next one": change::grant(|g, now| g.first = g.first.max(now.step));
    clause "G-3b":
        - "accepts a grant that skips a step": change::grant(|g, now| g.first = g.first.min(now.step));
    clause "G-3c":
        - "takes a grant of no steps as one step": Flaw::grant(|grant| grant.steps = grant.steps.max(1));
    clause "S-9a":
        - "ignores Abort": change::ignoring(|order, _| matches!(order, Ok(Order::Abort(_))));
    clause "S-9b":
        - "ignores Abort within a step":
            change::ignoring(|order, now| now.granted && matches!(order, Ok(Order::Abort(_))));
    clause "S-9c":
        - "sends a notice after Abort": Flaw::passing(|message| match message.as_order() {
            Ok(Order::Abort(_)) => vec![Message::order(&Order::Close)],
            _ => vec![message],
        });
    clause "X-3a":
        - "does not look whether its coupler lives": Wrong::process(|m| m.never_looks_up = true);
    clause "X-3b":
        - "does not look whether its coupler lives within a step":
            Wrong::process(|m| m.never_looks_up_in_a_step = true);
    clause "S-11a":
        - "waits for ever": Flaw::configure(|configure| configure.deadline = 600.0);
        - "does not name the party that sends nothing":
            change::words("dem", "other").with(change::words("mpm", "other"));
    clause "S-11b":
        - "does not say that the coupler is silent": Wrong::process(|m| m.gives_up_silently = true);
    clause "D-2a":
        - "ends after Bye": Wrong::process(|m| m.goes_at_bye = true);
    clause "X-1a":
        - "does not say which clause": change::words("G-2", "a clause");
    clause "X-2a":
        - "ends with status 1": Wrong::process(|m| m.status_closed = Some(1));
    clause "X-2b":
        - "ends with status 0 although it failed": Wrong::process(|m| m.status_failed = Some(0));
    clause "X-2c":
        - "ends with status 0 although there is nothing to join": Wrong::process(|m| m.status_unjoined = Some(0));
    clause "X-5a":
        - "ends on Ctrl-C": Wrong::process(|m| m.ends_on_interrupt = true);
    clause "O-6a":
        - "removes the run's lock": Wrong::process(|m| m.removes_the_lock = true);
    clause "O-8a":
        - "removes its note": Wrong::process(|m| m.joins_without_note = true);
    clause "X-6b":
        - "leaks 200 kB a step": {
            let mut kept = Vec::new();
            // Written to, because untouched memory is not allocated.
            Flaw::states(move |_, _| kept.push(vec![1u8; 200_000]))
        };
    clause "X-6a":
        - "keeps all messages": { let mut kept = Vec::new(); Flaw::each(move |message| kept.push(message.clone())) };
    clause "B-3a":
        - "looks for messages only when woken": Wrong::process(|m| m.waits_to_be_woken = true);
    clause "B-2a":
        - "wakes nobody": Wrong::process(|m| m.wakes_nobody = true);
    clause "G-10a":
        // More often than answers are timed; in clauses with thousands of steps nobody has to wait for it.
        - "sleeps before it answers many points": {
            let mut naps = 0;
            Flaw::each(move |message| {
                let exchanged = matches!(message.kind(), Kind::States | Kind::Forces);
                if exchanged && message.payload.len() >= POINTS && naps < 100 {
                    naps += 1;
                    nap(Duration::from_millis(60));
                }
            })
        };
    clause "G-10b":
        - "sleeps for 5 ms in every thousandth step": {
            let mut steps = 0;
            Flaw::states(move |header, _| {
                steps += u64::from(header.flags == 0);
                if steps.is_multiple_of(1000) && steps > 0 {
                    nap(Duration::from_millis(5));
                }
            })
        };
    clause "K-3a":
        - "sends another hash": damage();
    clause "K-4b":
        - "corrects the hash of a damaged state": corrects_the_hash();
    clause "R-1a":
        - "leaves the epoch out of the report's header": Flaw::reports(|header, _| header.epoch = 0);
        - "reports on another epoch": Flaw::report(|report| report.epoch += 1);
        - "sends two reports in a message":
            Flaw::reports(|header, reports| { reports.extend_from_within(..); header.count = reports.len() as u64; });
    clause "C-4":
        - "does not count its records": Flaw::reports(|header, _| header.count = 0);
        - "does not count what it measures":
            Flaw::bodies(|header, _| header.count += 1).with(Flaw::groups(|header, _| header.count += 1));
    clause "R-2a":
        - "reports a NaN": change::limits(|l| l.mobility = f64::NAN);
        - "reports more points than there can be": Flaw::report(|report| report.imps = 1 << 50);
        - "reports a time of centuries": Flaw::report(|report| report.cpu_ns = 1 << 63);
    clause "L-1a":
        - "has a negative frequency": change::limits(|l| l.omega_sq = -1.0);
    clause "R-3a":
        - "measures the next step":
            Flaw::bodies(|header, _| header.step += 1).with(Flaw::groups(|header, _| header.step += 1));
        - "measures one too many": {
            let bodies = Flaw::bodies(|header, all| { all.extend_from_within(..1); header.count += 1; });
            bodies.with(Flaw::groups(|header, all| { all.extend_from_within(..1); header.count += 1; }))
        };
    clause "R-3b":
        - "reports an energy that was not asked for":
            Flaw::report(|report| { if report.measured == 0 { report.ledger.kinetic = 1e-3; } });
        - "reports a measurement that was not asked for": Flaw::report(|report| report.measured = 1);
    clause "T-6a":
        - "has other bits in every run": {
            let run = change::RUNS.fetch_add(1, Ordering::Relaxed);
            let ulps = 1 + run.wrapping_add(std::process::id()) % 31;
            change::nudges(move |_| ulps)
        };
    clause "T-6b":
        - "has other bits in windows of one step": change::nudges(|now| u32::from(now.grant.steps == 1));
    clause "K-4a":
        - "starts from the beginning": begins_anew();
    clause "L-2b":
        - "reports ten times its contact frequency": change::limits(|l| l.contact_omega_sq *= 10.0);
    clause "L-5a":
        - "halts on the last step too": change::report(|report, now| {
            let last = report.next == now.grant.first + now.grant.steps;
            report.halted |= u64::from(last && report.limits.speed > now.grant.budget_speed);
        });
    clause "H-5a":
        - "has other bits after a halt": change::nudges(|now| u32::from(now.halted));
};

/// Points of an exchange in which answers are timed, at least.
const POINTS: usize = 100;

/// Another hash than that of the bytes before.
fn damage() -> Flaw {
    Flaw::pieces(|header, piece| {
        if header.flags & flags::LAST != 0 {
            piece[5] ^= 0x10;
        }
    })
}

/// Configures as if there were nothing to restore, and counts steps from 0.
fn begins_anew() -> Flaw {
    let (first, known) = change::shared(None::<u64>);
    let back = move |step: &mut u64| *step -= known.get().unwrap_or(0).min(*step);
    let mut restoring = false;
    Flaw::passing(move |mut message| match &mut message.payload {
        Payload::Restore(_) => Vec::new(),
        Payload::Order(_) => match message.as_order() {
            Ok(Order::Configure(order)) => {
                restoring = order.restore;
                let order = Configure {
                    restore: false,
                    ..order
                };
                vec![Message::order(&Order::Configure(order))]
            }
            _ => vec![message],
        },
        Payload::Grant(grants) if restoring => {
            for grant in grants {
                first.set(first.get().or(Some(grant.first)));
                back(&mut grant.first);
            }
            vec![message]
        }
        _ => vec![message],
    })
}

/// Gives every state that comes the hash that it has.
fn corrects_the_hash() -> Flaw {
    let mut state = Vec::new();
    Flaw::pieces(move |header, piece| {
        if header.flags & flags::LAST == 0 {
            state.extend_from_slice(piece);
        } else {
            *piece = blake3::hash(&std::mem::take(&mut state))
                .as_bytes()
                .to_vec();
        }
    })
}
