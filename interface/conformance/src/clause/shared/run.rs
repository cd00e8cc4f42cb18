//! A run of either side, as far as clauses of both sides need one: it is begun, goes on, and waits for its peer.

use std::time::{Duration, Instant};

use interface::control::{Configure, Order, Party};
use interface::stage::{Kind, Message, Payload};
use interface::wire::{Grant, StepHeader};

use crate::bench::{Bench, Flow, Play, Session, configure};
use crate::clause::dem::scene::one_disc;
use crate::clause::mpm::scene::single;
use crate::verdict::Unmet;

/// A run in which physics does not matter: one disc, or one point.
pub enum Run<'b> {
    /// Of a bodies' side.
    Bodies(Box<Play<'b>>),
    /// Of a continuum.
    Continuum(Box<Flow<'b>>),
}

/// The configuration of such a run.
pub fn order(bench: &Bench) -> Configure {
    match bench.subject.party {
        Party::Mpm => configure(&single([0.0; 2])),
        _ => configure(&one_disc(bench)),
    }
}

impl<'b> Run<'b> {
    /// Configured by `order`, and no step done.
    pub fn ready(bench: &'b Bench, order: &Configure) -> Result<Self, Unmet> {
        if bench.subject.party == Party::Mpm {
            return Ok(Self::Continuum(Box::new(bench.flow_by(order)?)));
        }
        let mut session = bench.session()?;
        session.hello()?;
        session.ready(order)?;
        Ok(Self::Bodies(Box::new(Play::new(session, bench.window))))
    }

    /// After a measured opening step.
    pub fn begun(bench: &'b Bench) -> Result<Self, Unmet> {
        let mut run = Self::ready(bench, &order(bench))?;
        run.step(0.0)?;
        Ok(run)
    }

    /// The session.
    pub fn session(&mut self) -> &mut Session<'b> {
        match self {
            Self::Bodies(play) => &mut play.session,
            Self::Continuum(flow) => &mut flow.session,
        }
    }

    /// Ends the run's part in the session.
    pub fn into_session(self) -> Session<'b> {
        match self {
            Self::Bodies(play) => play.session,
            Self::Continuum(flow) => flow.session,
        }
    }

    /// One measured step in which nothing presses.
    pub fn step(&mut self, dt: f64) -> Result<(), Unmet> {
        match self {
            Self::Bodies(play) => play.step(dt, &[]).map(|_| ()),
            Self::Continuum(flow) => flow.free_step(dt).map(|_| ()),
        }
    }

    /// The next grant, of one step.
    pub fn next_grant(&mut self) -> Grant {
        match self {
            Self::Bodies(play) => play.next_grant(1e-4, 1, false),
            Self::Continuum(flow) => flow.next_grant(1e-4, 1, false),
        }
    }

    /// Sends these grants in one message.
    pub fn send_grants(&mut self, grants: &[Grant]) -> Result<(), Unmet> {
        let header = grants
            .first()
            .map_or_else(StepHeader::default, |grant| StepHeader {
                epoch: grant.epoch,
                step: grant.first,
                ..StepHeader::default()
            });
        let grants = Payload::Grant(grants.to_vec());
        self.session().send(&Message::new(header, grants))
    }

    /// Grants a step and leaves the solver where it waits for its peer.
    pub fn wait_for_peer(&mut self) -> Result<(), Unmet> {
        let grant = self.next_grant();
        self.send_grants(&[grant])?;
        match self {
            Self::Bodies(_) => std::thread::sleep(Duration::from_millis(20)),
            Self::Continuum(flow) => {
                flow.states()?;
            }
        }
        Ok(())
    }

    /// Ends the run in order.
    pub fn closed(mut self) -> Result<Session<'b>, Unmet> {
        self.session().close()?;
        Ok(self.into_session())
    }

    /// Ends the run by an Abort.
    pub fn aborted(mut self) -> Result<Session<'b>, Unmet> {
        let order = Order::Abort("the kit has seen enough".into());
        self.session().order(&order)?;
        Ok(self.into_session())
    }
}

/// The next notice that comes within `time`, if one does: none is expected.
pub fn unexpected(session: &mut Session, time: Duration) -> Result<Option<Message>, Unmet> {
    let start = Instant::now();
    loop {
        let message = session.take(Kind::Notice)?;
        if message.is_some() || start.elapsed() >= time {
            return Ok(message);
        }
        session.stage.sleep(Kind::Notice, Duration::from_millis(1));
    }
}
