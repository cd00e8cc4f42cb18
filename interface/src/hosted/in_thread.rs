//! A solver that takes turns with its caller in one thread. What it does depends on no machine: a wait ends when nothing more
//! can come, and takes no time.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use super::host::Host;
use crate::session::{Clocked, Session, Turn, Wait};
use crate::transport::Ends;

/// A solver with its side of a session.
pub struct Served {
    session: Session<'static>,
    /// Time in which the caller waited too.
    waited: Duration,
    /// The wait in which it is, and when that began.
    waits: Option<(Wait, Duration)>,
    ended: Option<String>,
}

impl Served {
    /// A solver that has done nothing yet.
    pub fn new(host: Host, ends: Ends) -> Self {
        Self {
            session: Session::solver(host, ends, Clocked::Shared),
            waited: Duration::ZERO,
            waits: None,
            ended: None,
        }
    }

    /// Time in which it and its caller waited.
    pub fn waited(&self) -> Duration {
        self.waited
    }

    /// How it ended, if it has.
    pub fn ended(&self) -> Option<String> {
        self.ended.clone()
    }

    /// Lets it do what it can; returns whether it did anything.
    pub fn turn(&mut self) -> bool {
        self.go_on(|session| Some(session.turn()))
            || self.go_on(|session| session.look_up().then_some(Turn::Went))
    }

    /// Lets time pass, `at_most` and no more than it waits for.
    pub fn skip(&mut self, at_most: Duration) {
        let wait = self.waits.filter(|_| self.ended.is_none());
        let Some((wait, since)) = wait else {
            self.waited += at_most;
            return;
        };
        let left = (since + wait.at_most).saturating_sub(self.waited);
        self.waited += left.min(at_most);
        if left <= at_most {
            let waited = self.waited.saturating_sub(since);
            self.go_on(|session| {
                session.expire(waited);
                Some(Turn::Went)
            });
        }
    }

    /// Lets the session act; returns whether it did anything.
    fn go_on(&mut self, act: impl FnOnce(&mut Session<'static>) -> Option<Turn>) -> bool {
        if self.ended.is_some() {
            return false;
        }
        let session = &mut self.session;
        let Ok(turn) = catch_unwind(AssertUnwindSafe(|| act(session))) else {
            self.ended = Some("panicked".into());
            return true;
        };
        if let Some(verdict) = self.session.verdict() {
            let status = if verdict.is_ok() { 0 } else { 3 };
            self.ended = Some(format!("ended with exit status {status}"));
            return true;
        }
        let before = self.waits.map(|(wait, _)| wait);
        match turn {
            None => return false,
            Some(Turn::Waits(wait)) if before == Some(wait) => return false,
            Some(Turn::Waits(wait)) => self.waits = Some((wait, self.waited)),
            Some(Turn::Went | Turn::Ended) => self.waits = None,
        }
        true
    }
}
