//! Sections 6 and 10: what the configuration says of bodies is so, and their envelopes hold them.

use interface::config::{BodyConfig, Motion};

use super::scene::{STIFFNESS, block_or_disc, disc, elastic, one_disc, scene};
use crate::bench::Bench;
use crate::clause::Clause;
use crate::mutant::Flaw;
use crate::verdict::{Judgement, Unmet, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "E-1a",
        "answers a request with outlines of that step, then with forces",
        asked,
    )
    .mutant("sends outlines of the next step", || {
        Flaw::envelopes(|header, _| header.step += 1)
    }),
    Clause::must(
        "E-4a",
        "sends outlines in the order of the bodies, each with one reach",
        in_order,
    )
    .mutant("sends bodies in another order", || {
        Flaw::envelopes(|_, vertices| vertices.reverse())
    }),
];

const DT: f64 = 1e-4;
fn asked(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&one_disc(bench))?;
    play.step(0.0, &[])?;
    play.grant(DT, 2, false)?;
    play.exchange(&[])?;
    let expected = play.header();
    let (header, vertices) = play.envelopes()?;
    let same = (header.step, header.epoch) == (expected.step, expected.epoch);
    let words = |step, epoch| format!("step {step} of epoch {epoch}");
    require(
        same,
        words(expected.step, expected.epoch),
        words(header.step, header.epoch),
    )?;
    play.exchange(&[])?;
    play.report()?;
    Ok(format!("{} vertices, then forces", vertices.len()))
}

/// Envelopes of a disc and a block, both turned, with the bodies.
fn envelopes(
    bench: &Bench,
) -> Result<
    (
        Vec<BodyConfig>,
        Vec<interface::message::wire::EnvelopeVertex>,
    ),
    Unmet,
> {
    let mut bodies = vec![disc([0.5, 0.25]), block_or_disc(bench, [-0.5, 0.0])];
    for body in &mut bodies {
        body.motion = Motion::Fixed;
    }
    bodies[1].angle = 0.4;
    let mut play = bench.run_bodies(&scene(bodies.clone(), elastic(STIFFNESS)))?;
    play.grant(0.0, 1, true)?;
    let (_, vertices) = play.envelopes()?;
    Ok((bodies, vertices))
}

fn in_order(bench: &Bench) -> Judgement {
    let (bodies, vertices) = envelopes(bench)?;
    let order: Vec<u64> = vertices.iter().map(|vertex| vertex.body).collect();
    let rising = order.is_sorted() && order.iter().all(|&b| b < bodies.len() as u64);
    let both = (0..bodies.len() as u64).all(|b| order.contains(&b));
    require(
        rising && both,
        "bodies 0 and 1, one after the other",
        format_args!("{order:?}"),
    )?;
    for pair in vertices
        .windows(2)
        .filter(|pair| pair[0].body == pair[1].body)
    {
        require(pair[0].reach == pair[1].reach, pair[0].reach, pair[1].reach)?;
    }
    let least = vertices
        .iter()
        .map(|vertex| vertex.reach)
        .fold(f64::INFINITY, f64::min);
    require(least >= 0.0, "a reach that is not negative", least)?;
    Ok(format!("{} vertices", vertices.len()))
}
