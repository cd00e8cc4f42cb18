//! A run of either side, as far as clauses of both sides need one: it is begun, goes on, and waits for its peer.

use core::ops::{Deref, DerefMut};
use std::time::Duration;

use interface::message::control::{Configure, Failure, Notice, Order, Party};
use interface::message::wire::Grant;
use interface::solver::Refusal;

use crate::bench::{Bench, BodiesRun, ContinuumRun, KitRun, around_all, configure};
use crate::clause::dem::scene::{one_disc, pressed};
use crate::clause::mpm::scene::{push, single};
use crate::mutant::Flaw;
use crate::verdict::{Judgement, Unmet, broken, require};

/// A run of the side under test.
pub enum Run<'b> {
    /// Of a bodies' side, pressed by two points.
    Bodies(Box<BodiesRun<'b>>),
    /// Of a continuum.
    Continuum(Box<ContinuumRun<'b>>),
}

/// The configuration of a run in which physics does not matter: one disc, or one point.
pub fn order(bench: &Bench) -> Configure {
    match bench.subject.party {
        Party::Mpm => configure(&single([0.0; 2])),
        _ => configure(&one_disc(bench)),
    }
}

impl<'b> Deref for Run<'b> {
    type Target = KitRun<'b>;

    fn deref(&self) -> &KitRun<'b> {
        match self {
            Self::Bodies(play) => &play.lead,
            Self::Continuum(flow) => &flow.lead,
        }
    }
}

impl DerefMut for Run<'_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        match self {
            Self::Bodies(play) => &mut play.lead,
            Self::Continuum(flow) => &mut flow.lead,
        }
    }
}

impl<'b> From<KitRun<'b>> for Run<'b> {
    fn from(lead: KitRun<'b>) -> Self {
        if lead.session.is_of_bodies() {
            let mut play = BodiesRun::from(lead);
            play.set(&pressed().set);
            Self::Bodies(Box::new(play))
        } else {
            let mut flow = ContinuumRun::from(lead);
            flow.outlines = around_all(&single([0.0; 2]));
            Self::Continuum(Box::new(flow))
        }
    }
}

impl<'b> Run<'b> {
    /// After a measured opening step.
    pub fn begun(bench: &'b Bench) -> Result<Self, Unmet> {
        let mut run = Self::from(bench.run_coupled(&order(bench))?);
        run.step(0.0)?;
        Ok(run)
    }

    /// Ends the run's part in the session.
    pub fn into_lead(self) -> KitRun<'b> {
        match self {
            Self::Bodies(play) => play.lead,
            Self::Continuum(flow) => flow.lead,
        }
    }

    /// One measured step.
    pub fn step(&mut self, dt: f64) -> Result<(), Unmet> {
        self.grant(dt, 1, true)?;
        self.exchange()?;
        self.report().map(|_| ())
    }

    /// The exchange of a granted step.
    pub fn exchange(&mut self) -> Result<(), Unmet> {
        match self {
            Self::Bodies(play) => play.exchange(&pressed().states).map(|_| ()),
            Self::Continuum(flow) => flow.exchange().map(|_| ()),
        }
    }

    /// The same, with the flags and numbers that the solver sends in it; nothing where it halts before it.
    pub fn answer(&mut self) -> Result<Option<(u64, Vec<f64>)>, Unmet> {
        match self {
            Self::Bodies(play) => {
                let answer = play.exchange(&pressed().states)?;
                let numbers = answer
                    .forces
                    .iter()
                    .flat_map(|f| [f.force[0], f.force[1], f.stiffness]);
                Ok(Some((answer.header.flags, numbers.collect())))
            }
            Self::Continuum(flow) => {
                let Some(shown) = flow.states_or_halt()? else {
                    return Ok(None);
                };
                flow.forces(&flow.no_forces())?;
                let numbers = shown
                    .states
                    .iter()
                    .flat_map(|s| [s.position, s.velocity])
                    .flatten();
                Ok(Some((shown.header.flags, numbers.collect())))
            }
        }
    }

    /// The next grant, of one step.
    pub fn next_step(&mut self) -> Grant {
        self.next_grant(1e-4, 1, false)
    }

    /// Grants a step and leaves the solver where it waits for its peer.
    pub fn wait_for_peer(&mut self) -> Result<(), Unmet> {
        self.grant(1e-4, 1, false)?;
        match self {
            Self::Bodies(_) => interface::transport::wait::nap(Duration::from_millis(20)),
            Self::Continuum(flow) => {
                flow.states()?;
            }
        }
        Ok(())
    }

    /// Sends all that belongs to a step, a new set or new outlines and a force included.
    fn whole_step(&mut self) -> Result<(), Unmet> {
        self.grant(1e-4, 2, false)?;
        match self {
            Self::Bodies(play) => {
                play.set(&pressed().set);
                play.exchange(&pressed().states)?;
            }
            Self::Continuum(flow) => {
                flow.states()?;
                flow.forces(&[push([0.0, 1e-3], 10.0)])?;
                flow.states()?;
            }
        }
        Ok(())
    }
}

/// What the solver says to a step in which the kit says something wrong.
pub fn failure(bench: &Bench, said: Flaw) -> Result<Failure, Unmet> {
    let mut run = Run::from(bench.run_coupled(&order(bench))?);
    if let Run::Continuum(flow) = &mut run {
        // So far that it asks for outlines again.
        flow.travel = 1.0;
    }
    run.step(0.0)?;
    run.session.flaw = Some(said);
    let went_on = run.whole_step().is_ok();
    require(!went_on, "Failed", "an answer").map_err(|e| e.at(1))?;
    run.session.failure()
}

/// The solver fails where the kit says something wrong in a step.
pub fn refuses(bench: &Bench, said: Flaw) -> Judgement {
    Ok(failure(bench, said)?.message)
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
    let refusal = match answer(bench, sent)? {
        Notice::Refused(refusal) => refusal,
        other => return Err(broken("Refused", format_args!("{other:?}"))),
    };
    let Refusal {
        key: named,
        message,
        ..
    } = &refusal;
    let said = named.contains(key) && !named.is_empty() && !message.is_empty();
    require(
        said,
        format_args!("the key `{key}` and a message"),
        &refusal,
    )?;
    Ok(refusal.to_string())
}
