//! Sections 5, 9 and 12: reports, the same bits in every run of the same steps, and states that are saved and restored.

use std::sync::atomic::Ordering;

use interface::message::control::{Configure, Order};
use interface::message::wire::{StepHeader, flags};
use interface::transport::raw::{Message, Payload};

use super::run::order;
use crate::bench::{Bench, Run};
use crate::clause::{Clause, clauses};
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, require};

const SAVES: &[&str] = &["save"];

pub const CLAUSES: &[Clause] = clauses! {
    Must "K-3a" "sends its state before the report, in pieces with their hash" by saves, after: &["S-6a"],
        needs: SAVES;
        - "sends another hash": damage();
    Must "K-4b" "refuses a state that is damaged" by damaged, after: &["K-3a"], needs: SAVES;
        - "corrects the hash of a damaged state": corrects_the_hash();
    Must "R-1a" "sends one report for each grant, with its epoch and its last step";
        - "leaves the epoch out of the report's header": Flaw::reports(|header, _| header.epoch = 0);
        - "reports on another epoch": Flaw::report(|report| report.epoch += 1);
    Must "C-4" "the header counts the records that follow";
        - "does not count its records": Flaw::reports(|header, _| header.count = 0);
    Must "R-2a" "the numbers of a report are finite";
        - "reports a NaN": change::limits(|l| l.mobility = f64::NAN);
    Must "L-1a" "limits are finite and not negative";
        - "has a negative frequency": change::limits(|l| l.omega_sq = -1.0);
    Must "R-3a" "sends a measurement when asked, of the measured step, before the report";
        - "measures the next step":
            Flaw::bodies(|header, _| header.step += 1).with(Flaw::groups(|header, _| header.step += 1));
    Must "R-3b" "measures nothing when not asked";
        - "reports an energy that was not asked for":
            Flaw::report(|report| { if report.measured == 0 { report.ledger.kinetic = 1e-3; } });
        - "reports a measurement that was not asked for": Flaw::report(|report| report.measured = 1);
    Must "T-6a" "two runs give the same bits";
        - "has other bits in every run": {
            let run = change::RUNS.fetch_add(1, Ordering::Relaxed);
            let ulps = 1 + run.wrapping_add(std::process::id()) % 31;
            change::nudges(move |_| ulps)
        };
    Must "T-6b" "windows of any length give the same bits";
        - "has other bits in windows of one step": change::nudges(|now| u32::from(now.grant.steps == 1));
    Must "K-4a" "after a restore in a new process, continues with the same bits", needs: SAVES;
        - "starts from the beginning": begins_anew();
};

/// Changes the pieces of a saved state, whichever way they go.
fn pieces(mut change: impl FnMut(&StepHeader, &mut Vec<u8>) + 'static) -> Flaw {
    Flaw::each(move |message| {
        if let Payload::Saved(piece) | Payload::Restore(piece) = &mut message.payload {
            change(&message.header, piece);
        }
    })
}

/// Another hash than that of the bytes before.
fn damage() -> Flaw {
    pieces(|header, piece| {
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
    pieces(move |header, piece| {
        if header.flags & flags::LAST == 0 {
            state.extend_from_slice(piece);
        } else {
            *piece = blake3::hash(&std::mem::take(&mut state))
                .as_bytes()
                .to_vec();
        }
    })
}

/// The state before a step of a run, and the run after it.
fn saved(bench: &Bench) -> Result<(Vec<u8>, Run<'_>), Unmet> {
    let mut run = Run::begun(bench)?;
    let mut grant = run.next_grant(1e-4, 1, false);
    grant.flags |= flags::CHECKPOINT;
    run.send_grant(grant)?;
    run.exchange()?;
    run.report()?;
    Ok((run.session.saved()?, run))
}

fn saves(bench: &Bench) -> Judgement {
    let (state, mut run) = saved(bench)?;
    // Nothing may be sent without a request.
    run.step(1e-4)?;
    let more = run.session.saved();
    require(more.is_err(), "no state without CHECKPOINT", "one")?;
    Ok(format!("{} bytes", state.len()))
}

fn damaged(bench: &Bench) -> Judgement {
    let (state, _) = saved(bench)?;
    let mut session = bench.greeted()?;
    session.flaw = Some(damage());
    let reply = session.restore(&order(bench), &state);
    require(reply.is_err(), "a refusal of the damaged state", "Ready")?;
    Ok("refused".into())
}
