//! Sections 5 and 9: reports, measurements, and a ledger that balances.

use interface::config::{BodyShape, Motion};
use interface::message::wire::{Ledger, Record};

use super::order::pressed;
use super::scene::{STIFFNESS, body, elastic, one_disc, scene};
use crate::bench::{Answer, Bench, WindowReport};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "R-1a",
        "sends one report for each grant, with its epoch and its last step",
        report,
    )
    .mutant("reports on another epoch", || {
        Flaw::reports(|_, reports| reports.iter_mut().for_each(|report| report.epoch += 1))
    }),
    Clause::must("R-2a", "the numbers of a report are finite", finite)
        .after(&["L-1a"])
        .mutant("reports a NaN", || change::limits(|l| l.mobility = f64::NAN)),
    Clause::must(
        "R-3a",
        "sends a measurement when asked: one record for each body or group, of the measured step, before the report",
        measured,
    )
    .mutant("measures the next step", || {
        Flaw::bodies(|header, _| header.step += 1)
    }),
    Clause::must("R-3b", "measures nothing when not asked", unmeasured)
        .mutant("reports a measurement that was not asked for", || {
            Flaw::reports(|_, reports| reports.iter_mut().for_each(|report| report.measured = 1))
        }),
];

fn report(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    let points = pressed();
    play.set(&points.set);
    play.step(0.0, &points.states)?;
    for steps in [1, 3] {
        let grant = play.next_grant(1e-5, steps, true);
        play.send_grants(&[grant])?;
        for _ in 0..steps {
            play.exchange(&points.states)?;
        }
        let got = play.report()?.report;
        let said = (got.epoch, got.next, got.halted);
        let expected = (grant.epoch, grant.first + steps, 0);
        let words = |(epoch, next, halted)| format!("epoch {epoch}, next {next}, halted {halted}");
        require(said == expected, words(expected), words(said))?;
    }
    Ok("windows of 1 and 3 steps".into())
}

/// A measured step of length 0 of a disc that two points press.
fn opened(bench: &Bench) -> Result<(Answer, WindowReport), Unmet> {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    let points = pressed();
    play.set(&points.set);
    play.step(0.0, &points.states)
}

fn finite(bench: &Bench) -> Judgement {
    let (_, measured) = opened(bench)?;
    let wrong = measured.report.check().err();
    require(
        wrong.is_none(),
        "finite numbers",
        format_args!("{wrong:?}: {:?}", measured.report),
    )?;
    Ok("all of them".into())
}

fn measured(bench: &Bench) -> Judgement {
    let held = |k| body(BodyShape::Disc, [f64::from(k), 0.0], Motion::Fixed);
    let bodies = (0..3).map(held).collect();
    let mut play = bench.run_bodies(&scene(bodies, elastic(STIFFNESS)))?;
    play.step(0.0, &[])?;
    play.grant(1e-4, 2, true)?;
    play.exchange(&[])?;
    play.exchange(&[])?;
    let got = play.report()?;
    require(
        got.report.measured == 1,
        "measured = 1",
        got.report.measured,
    )?;
    let bodies = got.bodies(3)?;
    require(bodies.len() == 3, "3 bodies", bodies.len())?;
    for (k, body) in (0..).zip(bodies) {
        near(
            "position of the body in its place",
            body.position[0],
            f64::from(k),
            1e-12,
        )?;
    }
    let step = got.bodies.as_ref().map_or(0, |(header, _)| header.step);
    require(
        step == 1,
        "states of step 1",
        format_args!("of step {step}"),
    )?;
    Ok("3 bodies of the window's first step".into())
}

fn unmeasured(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    play.grant(1e-4, 1, false)?;
    play.exchange(&[])?;
    let got = play.report()?;
    require(
        got.report.measured == 0,
        "measured = 0",
        got.report.measured,
    )?;
    require(
        got.report.ledger == Ledger::default(),
        "a ledger of 0",
        format_args!("{:?}", got.report.ledger),
    )?;
    require(got.bodies.is_none(), "no bodies", "bodies")?;
    Ok("measured = 0, no ledger, no bodies".into())
}
