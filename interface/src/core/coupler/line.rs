//! The coupler's connection to one solver: its Hello, Ready and reports, and its configuration.

use std::time::Duration;

use crate::config::capability::SAVE;
use crate::core::error::{SessionError, broken};
use crate::core::pieces::{Incoming, Outgoing};
use crate::message::codec::encode;
use crate::message::control::{Configure, Hello, Order, PROTOCOL, Party};
use crate::message::wire::{Grant, Report};
use crate::message::{Channel, Kind};
use crate::solver::Readiness;

/// Longest wait for a solver to take its configuration, unless the run sets another one: the solver may have to fill
/// millions of points.
pub(super) const CONFIGURATION: Duration = Duration::from_mins(2);

/// The coupler's line to one solver.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) party: Party,
    pub(super) hello: Option<Hello>,
    pub(super) readiness: Option<Readiness>,
    pub(super) scene_hash: String,
    /// The bytes of its Configure, until it is sent.
    pub(super) told: Vec<u8>,
    pub(super) measured: usize,
    pub(super) restore: Option<Outgoing>,
    pub(super) deadline: Duration,
    /// First step that is not reported.
    pub(super) step: u64,
    pub(super) grant: [Grant; 1],
    pub(super) report: Report,
    pub(super) incoming: Incoming,
    pub(super) saved: Option<Vec<u8>>,
    pub(super) bye: bool,
}

impl Line {
    pub(super) fn new(party: Party) -> Self {
        Self {
            party,
            hello: None,
            readiness: None,
            scene_hash: String::new(),
            told: Vec::new(),
            measured: 0,
            restore: None,
            deadline: CONFIGURATION,
            step: 0,
            grant: [Grant::default()],
            report: Report::default(),
            incoming: Incoming::default(),
            saved: None,
            bye: false,
        }
    }

    pub(super) fn has(&self, capability: &str) -> bool {
        self.hello
            .as_ref()
            .is_some_and(|h| h.capabilities.has(capability))
    }

    pub(super) fn channel(&self, kind: Kind) -> Channel {
        Channel::of(self.party, kind)
    }

    pub(super) fn broke(&self, clause: &'static str, message: String) -> SessionError {
        broken(self.party, clause, self.step, message)
    }
}

impl Line {
    /// S-2, V-1.
    pub(super) fn greet(&mut self, hello: Hello) -> Result<(), SessionError> {
        if hello.party != self.party {
            let (own, theirs, who) = (self.party, hello.party, &hello.identity);
            let message = format!(
                "what was started as the {own} is `{who}`, which says that it is the {theirs}: it may be given by \
                 `--{theirs}` only"
            );
            return Err(self.broke("S-2", message));
        }
        let ((theirs, _), (ours, _)) = (hello.protocol, PROTOCOL);
        if theirs != ours {
            let message = format!(
                "`{}` speaks protocol {theirs}, this coupler speaks {ours}",
                hello.identity
            );
            return Err(self.broke("V-1", message));
        }
        self.hello = Some(hello);
        Ok(())
    }

    pub(super) fn configure(&mut self, configure: Configure) -> Result<(), SessionError> {
        if configure.restore && !self.has(SAVE) {
            let message = "a state to restore, and no capability `save`".into();
            return Err(broken(Party::Coupler, "K-4", self.step, message));
        }
        self.told = encode(&Order::Configure(configure));
        Ok(())
    }
}
