//! A run of either side, as far as clauses of both sides need one: it is begun, goes on, and waits for its peer.

use std::time::Duration;

use interface::message::control::{Configure, Failure, Notice, Order, Party};

use crate::bench::{Bench, Points, Run, around_all, configure};
use crate::clause::dem::scene::{one_disc, pressed};
use crate::clause::mpm::scene::{push, single};
use crate::flaw::Flaw;
use crate::verdict::{Judgement, Unmet, broken, require};

/// The configuration of a run in which physics does not matter: one disc, or one point.
pub fn order(bench: &Bench) -> Configure {
    match bench.subject.party {
        Party::Mpm => configure(&single([0.0; 2])),
        _ => configure(&one_disc(bench)),
    }
}

/// A run with this order; what the kit sends in it is two points on a disc, or an outline around all points.
pub fn led<'b>(bench: &'b Bench, order: &Configure) -> Result<Run<'b>, Unmet> {
    let mut run = bench.run(order)?;
    run.outlines = around_all(&single([0.0; 2]));
    run.place(pressed());
    Ok(run)
}

impl<'b> Run<'b> {
    /// After a measured opening step.
    pub fn begun(bench: &'b Bench) -> Result<Self, Unmet> {
        let mut run = led(bench, &order(bench))?;
        run.step(0.0)?;
        Ok(run)
    }

    /// From the next step on the kit is these points, where it is the continuum.
    pub fn place(&mut self, points: Points) {
        if self.session.is_of_bodies() {
            self.set(&points.set);
        }
        self.points = points;
    }

    /// One measured step.
    pub fn step(&mut self, dt: f64) -> Result<(), Unmet> {
        self.grant(dt, 1, true)?;
        self.exchange()?;
        self.report().map(|_| ())
    }

    /// The exchange of a granted step.
    pub fn exchange(&mut self) -> Result<(), Unmet> {
        let halt = broken("states", "HALT_BEFORE").at(self.next());
        self.exchange_or_halt()?.ok_or(halt).map(|_| ())
    }

    /// The same, with the flags and numbers that the solver sends in it; nothing where it halts before it.
    pub fn exchange_or_halt(&mut self) -> Result<Option<(u64, Vec<f64>)>, Unmet> {
        if self.session.is_of_bodies() {
            let answer = self.answer(&self.points.states.clone())?;
            let numbers = answer.forces.iter();
            let numbers = numbers.flat_map(|f| [f.force[0], f.force[1], f.stiffness]);
            return Ok(Some((answer.header.flags, numbers.collect())));
        }
        let Some(shown) = self.states_or_halt()? else {
            return Ok(None);
        };
        self.press(&self.no_forces())?;
        let numbers = shown.states.iter().flat_map(|s| [s.position, s.velocity]);
        Ok(Some((shown.header.flags, numbers.flatten().collect())))
    }

    /// Grants so many exchanges and goes on to where the solver waits for the peer's message of the first: a continuum sends
    /// its states before, so it needs a step more.
    pub fn await_peer(&mut self, dt: f64, exchanges: u64) -> Result<(), Unmet> {
        if self.session.is_of_bodies() {
            return self.grant(dt, exchanges, false);
        }
        self.grant(dt, exchanges + 1, false)?;
        self.states().map(|_| ())
    }

    /// Sends the message that the solver waits for, and takes its answer: forces, or the states of the next step.
    pub fn answered(&mut self) -> Result<(), Unmet> {
        if self.session.is_of_bodies() {
            return self.exchange();
        }
        self.press(&self.no_forces())?;
        self.states().map(|_| ())
    }

    /// Grants a step and leaves the solver where it waits for its peer.
    pub fn wait_for_peer(&mut self) -> Result<(), Unmet> {
        self.grant(1e-4, 1, false)?;
        if self.session.is_of_bodies() {
            self.session.solver.leave_alone(Duration::from_millis(20));
        } else {
            self.states()?;
        }
        Ok(())
    }

    /// Sends all that belongs to a step, a new set or new outlines and a force included.
    fn whole_step(&mut self) -> Result<(), Unmet> {
        self.grant(1e-4, 2, false)?;
        if self.session.is_of_bodies() {
            self.place(pressed());
            self.exchange()?;
        } else {
            self.states()?;
            self.press(&[push([0.0, 1e-3], 10.0)])?;
            self.states()?;
        }
        Ok(())
    }
}

/// What the solver says to a step in which the kit says something wrong.
pub fn failure(bench: &Bench, flaw: Flaw) -> Result<Failure, Unmet> {
    let mut run = led(bench, &order(bench))?;
    if !run.session.is_of_bodies() {
        // So far that it asks for outlines again.
        run.travel = 1.0;
    }
    run.step(0.0)?;
    run.session.flaw = Some(flaw);
    let went_on = run.whole_step().is_ok();
    require(!went_on, "Failed", "an answer").map_err(|e| e.at(1))?;
    run.session.failure()
}

/// The solver fails where the kit says something wrong in a step.
pub fn refuses(bench: &Bench, flaw: Flaw) -> Judgement {
    Ok(failure(bench, flaw)?.message)
}

/// What the solver says to a first order in which something is wrong.
fn answer(bench: &Bench, sent: Flaw) -> Result<Notice, Unmet> {
    let mut session = bench.greeted()?;
    session.flaw = Some(sent);
    session.order(&Order::Configure(order(bench)))?;
    session.notice()
}

/// The solver fails or refuses where something is wrong in its first order.
pub fn rejects(bench: &Bench, sent: Flaw) -> Judgement {
    match answer(bench, sent)? {
        Notice::Failed(failure) => Ok(failure.message),
        Notice::Refused(refusal) => Ok(refusal.to_string()),
        other => Err(broken("Failed or Refused", format_args!("{other:?}"))),
    }
}

/// The solver refuses a configuration and names what is wrong in it: a key with `key` in it.
pub fn names(bench: &Bench, key: &str, sent: Flaw) -> Judgement {
    let notice = answer(bench, sent)?;
    let Notice::Refused(refusal) = &notice else {
        return Err(broken("Refused", format_args!("{notice:?}")));
    };
    let complete =
        refusal.key.contains(key) && !refusal.key.is_empty() && !refusal.message.is_empty();
    require(
        complete,
        format_args!("the key `{key}` and a message"),
        refusal,
    )?;
    Ok(refusal.to_string())
}
