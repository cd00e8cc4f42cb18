//! Section 5, messages of a step, and what is wrong with those of the bodies.

use interface::config::MpmConfig;
use interface::message::Kind;

use super::scene::{DT, push, single};
use crate::bench::Bench;
use crate::clause::{Clause, clauses, names};
use crate::flaw::Flaw;
use crate::verdict::{Judgement, require};

pub const CLAUSES: &[Clause] = clauses! {
    Must "S-8b" "refuses an unknown material and names its key"
        by |bench| names(bench, "", Flaw::config(|config: &mut MpmConfig| config.groups[0].material = 7));
    Must "G-9b" "sends one message of states in a step" by once;
    Must "E-2a" "refuses envelopes of another step" refuses Flaw::envelopes(|h, _| h.step += 1);
    Must "E-2b" "refuses envelopes of another number" refuses Flaw::envelopes(|h, _| h.count += 1);
    Must "E-3a" "refuses envelopes that are not finite" refuses Flaw::envelopes(|_, v| v[1].position[0] = f64::NAN);
    Must "F-2b" "refuses forces of another step" refuses Flaw::forces(|h, _| h.step -= 1);
    Must "F-2c" "refuses forces of another epoch" refuses Flaw::forces(|h, _| h.epoch += 1);
    Must "F-3b" "refuses forces of another set" refuses Flaw::forces(|h, _| h.set += 1);
    Must "F-3c" "refuses fewer forces than points" refuses Flaw::forces(|h, forces| { forces.pop(); h.count -= 1; });
    Must "F-3d" "refuses forces whose number is wrong" refuses Flaw::forces(|h, _| h.count += 1);
    Must "F-4a" "refuses a force that is not finite" refuses Flaw::force(|f| f.force[1] = f64::NAN);
    Must "F-4b" "refuses a travel that is not finite" refuses Flaw::forces(|h, _| h.travel = f64::INFINITY);
    Must "F-5b" "refuses a force without a stiffness" refuses Flaw::force(|f| *f = push([1.0, 0.0], 0.0));
    Must "F-5c" "refuses a stiffness below zero" refuses Flaw::force(|f| *f = push([1.0, 0.0], -1e3));
};

/// Without any point too: an empty message is a message.
fn once(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
    flow.outlines.clear();
    flow.grant(DT, 8, false)?;
    for _ in 0..8 {
        let (step, sent) = (flow.next(), flow.free()?.header.step);
        let expected = format_args!("states of step {step}");
        require(sent == step, expected, format_args!("of step {sent}")).map_err(|e| e.at(step))?;
    }
    flow.report()?;
    let more = flow.session.take(Kind::States)?;
    require(more.is_none(), "no more states", format_args!("{more:?}"))?;
    Ok("8 messages in 8 steps".into())
}
