//! Sections 5, 9 and 12: reports, the same bits in every run of the same steps, and states that are saved and restored.

use interface::message::wire::flags;

use super::run::order;
use crate::bench::{Bench, Run};
use crate::clause::{Clause, clauses};
use crate::flaw::Flaw;
use crate::verdict::{Judgement, Unmet, require};

const SAVES: &[&str] = &["save"];

pub const CLAUSES: &[Clause] = clauses! {
    Must "K-3a" "sends its state before the report, in pieces with their hash" by saves, after: &["S-6a"],
        needs: SAVES;
    Must "K-4b" "refuses a state that is damaged" by damaged, after: &["K-3a"], needs: SAVES;
    Must "R-1a" "sends one report for each grant, with its epoch and its last step";
    Must "C-4" "the header counts the records that follow";
    Must "R-2a" "the numbers of a report are finite";
    Must "L-1a" "limits are finite and not negative";
    Must "R-3a" "sends a measurement when asked, of the measured step, before the report";
    Must "R-3b" "measures nothing when not asked";
    Must "T-6a" "two runs give the same bits";
    Must "T-6b" "windows of any length give the same bits";
    Must "K-4a" "after a restore in a new process, continues with the same bits", needs: SAVES;
};

/// Another hash than that of the bytes before.
fn damage() -> Flaw {
    Flaw::pieces(|header, piece| {
        if header.flags & flags::LAST != 0 {
            piece[5] ^= 0x10;
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
