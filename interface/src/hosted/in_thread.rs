//! A solver that takes turns with its caller in one thread. What it does depends on no machine: a wait ends when nothing more
//! can come, and takes no time.

use std::cell::Cell;
use std::future::poll_fn;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use super::host::{Ends, Host};
use crate::session::{Clocked, Turn, Wait};

/// What the session of a solver is to do next.
#[derive(Clone, Copy)]
enum Next {
    Turn,
    LookUp,
    Expire(Duration),
}

/// A solver with its side of a session.
pub struct Served {
    /// Does what `next` says whenever it is polled; ready with its exit status when the session is over.
    session: Pin<Box<dyn Future<Output = u8>>>,
    next: Rc<Cell<Next>>,
    /// What came of it.
    turn: Rc<Cell<Turn>>,
    /// Time in which the caller waited too.
    waited: Duration,
    /// The wait in which it is, and when that began.
    waits: Option<(Wait, Duration)>,
    ended: Option<String>,
}

impl Served {
    /// A solver that has done nothing yet.
    pub fn new(host: Host, ends: Ends) -> Self {
        let next = Rc::new(Cell::new(Next::Turn));
        let turn = Rc::new(Cell::new(Turn::Went));
        Self {
            session: Box::pin(served(host, ends, next.clone(), turn.clone())),
            next,
            turn,
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
        self.go_on(Next::Turn) || self.go_on(Next::LookUp)
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
            self.go_on(Next::Expire(self.waited.saturating_sub(since)));
        }
    }

    fn go_on(&mut self, next: Next) -> bool {
        if self.ended.is_some() {
            return false;
        }
        self.next.set(next);
        let context = &mut Context::from_waker(Waker::noop());
        let poll = || self.session.as_mut().poll(context);
        self.ended = match catch_unwind(AssertUnwindSafe(poll)) {
            Ok(Poll::Pending) => None,
            Ok(Poll::Ready(status)) => Some(format!("ended with exit status {status}")),
            Err(_) => Some("panicked".into()),
        };
        let before = self.waits.map(|(wait, _)| wait);
        match self.turn.get() {
            _ if self.ended.is_some() => {}
            Turn::Waits(wait) if before == Some(wait) => return false,
            Turn::Waits(wait) => self.waits = Some((wait, self.waited)),
            Turn::Went | Turn::Ended => self.waits = None,
        }
        true
    }
}

/// The session of a solver, which does one thing whenever it is polled.
async fn served(mut host: Host, mut ends: Ends, next: Rc<Cell<Next>>, turn: Rc<Cell<Turn>>) -> u8 {
    let mut session = host.session(&mut *ends, Clocked::Shared);
    poll_fn(|_| {
        match next.get() {
            Next::Turn => turn.set(session.turn()),
            Next::LookUp => {
                if session.look_up() {
                    turn.set(Turn::Went);
                }
            }
            Next::Expire(waited) => {
                session.expire(waited);
                turn.set(Turn::Went);
            }
        }
        match session.verdict() {
            None => Poll::Pending,
            Some(verdict) => Poll::Ready(if verdict.is_ok() { 0 } else { 3 }),
        }
    })
    .await
}
