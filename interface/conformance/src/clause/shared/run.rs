//! A run of either side, as far as clauses of both sides need one: it is begun, goes on, and waits for its peer.

use core::ops::{Deref, DerefMut};
use std::time::Duration;

use interface::message::control::{Configure, Party};
use interface::message::wire::Grant;

use crate::bench::{Bench, BodiesRun, ContinuumRun, KitRun, configure};
use crate::clause::dem::scene::one_disc;
use crate::clause::mpm::scene::single;
use crate::verdict::Unmet;

/// A run of the side under test.
pub enum Run<'b> {
    /// Of a bodies' side.
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
            Self::Bodies(Box::new(lead.into()))
        } else {
            Self::Continuum(Box::new(lead.into()))
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

    /// One measured step in which nothing presses.
    pub fn step(&mut self, dt: f64) -> Result<(), Unmet> {
        match self {
            Self::Bodies(play) => play.step(dt, &[]).map(|_| ()),
            Self::Continuum(flow) => flow.free_step(dt).map(|_| ()),
        }
    }

    /// The exchange of a granted step in which nothing presses.
    pub fn free_exchange(&mut self) -> Result<(), Unmet> {
        match self {
            Self::Bodies(play) => play.exchange(&[]).map(|_| ()),
            Self::Continuum(flow) => flow.exchange().map(|_| ()),
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
}
