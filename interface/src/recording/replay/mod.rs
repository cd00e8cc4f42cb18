//! Plays a recording to one solver and compares what it answers: `tandem replay`.
//!
//! The program is the coupler and the other solver, as they were: orders, grants and what the other side sent come from
//! the recording, whatever the solver answers. So a difference does not grow by being fed back through the other side,
//! and a solver can be stepped through in a debugger without the rest of the run.

mod compare;
mod script;

use std::path::Path;
use std::time::Duration;

pub use compare::Comparison;
pub use script::ReplayError;
use script::Script;

use super::{End, Playback};
use crate::config::capability::CONTACTS;
use crate::hosted::{Hosted, Subject};
use crate::message::control::{Configure, Failure, Hello, Notice, Order, Party};
use crate::message::wire::{Grant, Report, flags};
use crate::message::{Kind, Message, Payload};

/// Longest wait for Hello, Ready, Bye, and for the end after Close.
const CONTROL: Duration = Duration::from_mins(2);

/// What a replay has shown.
#[derive(Debug)]
pub struct Outcome {
    /// Steps that were replayed.
    pub steps: u64,
    /// What was the same and what was not.
    pub comparison: Comparison,
    /// How the recording ends.
    pub end: End,
    /// The last words of the solver, when it failed just as it was recorded to.
    pub failed_as_recorded: Option<String>,
}

/// Why the play is over before the recorded session is closed.
enum Stop {
    /// The recording has no more of what comes next.
    Over,
    /// The answers are so different that the rest of the recording does not fit them.
    Diverged,
    /// The solver failed, with the same words as then.
    FailedAsRecorded(String),
    Error(ReplayError),
}

impl<E: Into<ReplayError>> From<E> for Stop {
    fn from(error: E) -> Self {
        Self::Error(error.into())
    }
}

/// Plays the recording at `path` to `subject`. `tolerance` is the largest difference of a number, relative to the largest of its
/// unit (all energies, all lengths, ...) so far in the recording; 0: the same bits. `set` are values of the solver's configuration
/// other than those recorded, as `key.key=JSON`.
///
/// # Errors
/// [`ReplayError`].
pub fn replay(
    path: &Path,
    subject: &Subject,
    tolerance: f64,
    set: &[String],
) -> Result<Outcome, ReplayError> {
    // All of it is read once before anything is started.
    let end = Playback::verify(path)?;
    let party = subject.party;
    let script = Script::open(path, party)?;
    let solver = subject.start();
    let mut replay = Replay {
        party,
        set,
        script,
        solver: solver.map_err(|why| ReplayError::Start(party, why))?,
        comparison: Comparison::new(party, tolerance),
        patience: CONTROL,
        coupled: false,
        lists_contacts: false,
        step: 0,
    };
    let failed_as_recorded = match replay.run() {
        Ok(()) | Err(Stop::Over | Stop::Diverged) => None,
        Err(Stop::FailedAsRecorded(words)) => Some(words),
        Err(Stop::Error(error)) => return Err(error),
    };
    Ok(Outcome {
        steps: replay.step,
        comparison: replay.comparison,
        end,
        failed_as_recorded,
    })
}

struct Replay<'a> {
    party: Party,
    set: &'a [String],
    script: Script,
    solver: Hosted,
    comparison: Comparison,
    /// Longest wait for an answer.
    patience: Duration,
    coupled: bool,
    /// Whether both the recorded solver and this one list their contacts.
    lists_contacts: bool,
    /// First step that is not replayed.
    step: u64,
}

impl Replay<'_> {
    fn run(&mut self) -> Result<(), Stop> {
        let hello = match self.notice()? {
            Notice::Hello(hello) => hello,
            other => return Err(self.wrong(format!("{other:?} instead of Hello"))),
        };
        let recorded = self.recorded(Kind::Notice)?.as_notice();
        if let Notice::Hello(then) = recorded.map_err(ReplayError::Senseless)? {
            let lists = |hello: &Hello| hello.capabilities.has(CONTACTS);
            self.lists_contacts = lists(&then) && lists(&hello);
        }
        loop {
            let message = self.script.lead()?.ok_or(Stop::Over)?;
            match &message.payload {
                Payload::Grant(grants) => {
                    let [grant] = grants[..] else {
                        let several = "a message of several grants".into();
                        return Err(ReplayError::Senseless(several).into());
                    };
                    // The states that the run saved are not needed.
                    let unsaved = Grant {
                        flags: grant.flags & !flags::CHECKPOINT,
                        ..grant
                    };
                    let unsaved = Message::new(message.header, Payload::Grant(vec![unsaved]));
                    self.send(&unsaved)?;
                    self.window(&grant)?;
                }
                _ => match message.as_order().map_err(ReplayError::Senseless)? {
                    Order::Configure(order) => self.configure(order)?,
                    Order::Drain => {
                        self.send(&message)?;
                        self.patience = CONTROL;
                        self.compare_notice()?;
                        if self.party == Party::Mpm {
                            self.compare_sent(Kind::Points)?;
                        }
                    }
                    Order::Close => {
                        self.send(&message)?;
                        let end = self.solver.end(CONTROL);
                        let end = end.unwrap_or_else(|| "has not ended after Close".into());
                        let right = end.ends_with("exit status 0");
                        return if right { Ok(()) } else { Err(self.wrong(end)) };
                    }
                    // The recorded run ended here, because of the other side or of the coupler.
                    Order::Abort(_) => return Err(self.over()),
                },
            }
        }
    }

    fn configure(&mut self, mut order: Configure) -> Result<(), Stop> {
        for set in self.set {
            order.config = with(&order.config, set)
                .map_err(|why| ReplayError::Override(format!("{set}: {why}")))?;
        }
        self.coupled = order.coupled;
        let deadline = order.longest_wait();
        let absurd = || ReplayError::Senseless(format!("a deadline of {} s", order.deadline));
        let deadline = deadline.ok_or_else(absurd)?;
        // The run began with the state of another one.
        let mut more = order.restore;
        self.send(&Message::order(&Order::Configure(order)))?;
        while more {
            let piece = self.recorded(Kind::Restore)?;
            self.send(&piece)?;
            more = piece.header.flags & flags::LAST == 0;
        }
        self.compare_notice()?;
        // As long as the coupler waits for a party that waits for another one (S-11).
        self.patience = deadline + Duration::from_secs(1);
        Ok(())
    }

    fn window(&mut self, grant: &Grant) -> Result<(), Stop> {
        let end = grant.first.saturating_add(grant.steps);
        let granted = |states: &Message| {
            states.header.epoch == grant.epoch && (grant.first..end).contains(&states.header.step)
        };
        let (mut done, mut torn) = (0, false);
        while self.coupled {
            // The window may have ended early: its report says so.
            match self.script.peek(Kind::States)? {
                Some(states) if granted(states) => done += u64::from(self.exchange()?),
                states => {
                    torn = states.is_none();
                    break;
                }
            }
        }
        let report = self.recorded(Kind::Report)?;
        let reports: &[Report] = report.payload.of();
        let reported = reports.first().copied().unwrap_or_default();
        if torn && (reported.halted == 1 || grant.first + done < reported.next) {
            // Messages between the solvers are recorded a little later than reports, so the last ones are missing here.
            return Err(Stop::Over);
        }
        let replayed = self.message(Kind::Report)?;
        let of_points = self.party == Party::Mpm;
        if grant.flags & flags::MEASURE != 0 {
            self.compare_sent(if of_points {
                Kind::Groups
            } else {
                Kind::Bodies
            })?;
        }
        if grant.flags & flags::FRAME != 0 {
            if of_points {
                self.compare_sent(Kind::Points)?;
            } else if self.lists_contacts {
                self.compare_sent(Kind::Contacts)?;
            }
        }
        self.step = reported.next;
        self.compare(&report, &replayed)
    }

    /// What crosses between the solvers for one message of states; whether it was that of a step.
    fn exchange(&mut self) -> Result<bool, Stop> {
        let states = self.recorded(Kind::States)?;
        self.step = states.header.step;
        let has = |flag| states.header.flags & flag != 0;
        let answer = if has(flags::WANT_ENVELOPES) {
            Some(Kind::Envelopes)
        } else if has(flags::HALT_BEFORE) {
            None
        } else {
            Some(Kind::Forces)
        };
        let set = has(flags::NEW_SET);
        if self.party == Party::Dem {
            if set {
                let set = self.recorded(Kind::Set)?;
                self.comparison.take_set(&set);
                self.send(&set)?;
            }
            self.send(&states)?;
            if let Some(kind) = answer {
                let recorded = self.recorded(kind)?;
                let replayed = self.message(kind)?;
                self.compare(&recorded, &replayed)?;
            }
        } else {
            let replayed = self.message(Kind::States)?;
            if set && replayed.header.flags == states.header.flags {
                self.compare_sent(Kind::Set)?;
            }
            self.compare(&states, &replayed)?;
            if let Some(kind) = answer {
                let recorded = self.recorded(kind)?;
                self.send(&recorded)?;
            }
        }
        Ok(answer == Some(Kind::Forces))
    }

    fn send(&mut self, message: &Message) -> Result<(), Stop> {
        Ok(self.solver.send(message)?)
    }

    /// The next recorded message of a kind, or what the recording ends with instead.
    fn recorded(&mut self, kind: Kind) -> Result<Message, Stop> {
        let message = self.script.next(kind)?;
        message.ok_or_else(|| self.over())
    }

    /// The recording has nothing more for the solver: if that is because the solver failed, it fails again.
    fn over(&mut self) -> Stop {
        let last = self.script.peek(Kind::Notice);
        let last = last.map(|message| message.map(Message::as_notice));
        match last {
            Ok(Some(Ok(Notice::Failed(_)))) => match self.notice() {
                Ok(notice) => self.wrong(format!("{notice:?} instead of its last words")),
                Err(stop) => stop,
            },
            Ok(_) => Stop::Over,
            Err(error) => error.into(),
        }
    }

    /// The solver has failed: as it was recorded, or otherwise.
    fn failed(&mut self, now: Failure) -> Stop {
        let then = match self.script.next(Kind::Notice) {
            Ok(message) => message.and_then(|message| message.as_notice().ok()),
            Err(error) => return error.into(),
        };
        let Some(Notice::Failed(then)) = then else {
            return self.wrong(now.message);
        };
        if then == now {
            self.step = now.step;
            return Stop::FailedAsRecorded(now.message);
        }
        let of = |f: &Failure| format!("failed at step {}: {}", f.step, f.message);
        self.comparison.words(now.step, &of(&then), &of(&now));
        Stop::Diverged
    }

    /// Ready, Refused or Bye.
    fn compare_notice(&mut self) -> Result<(), Stop> {
        let replayed = self.notice()?;
        let recorded = self
            .recorded(Kind::Notice)?
            .as_notice()
            .map_err(ReplayError::Senseless)?;
        match (&recorded, &replayed) {
            (Notice::Ready(then), Notice::Ready(now)) => self.comparison.ready(then, now),
            (then, now) if then == now => {}
            (then, now) => {
                let [then, now] = [then, now].map(|notice| format!("{notice:?}"));
                self.comparison.words(self.step, &then, &now);
                return Err(Stop::Diverged);
            }
        }
        Ok(())
    }

    /// A message that has been sent before another one that has arrived.
    fn compare_sent(&mut self, kind: Kind) -> Result<(), Stop> {
        let recorded = self.recorded(kind)?;
        let Some(replayed) = self.solver.receive(kind)? else {
            return Err(self.wrong(format!("no {kind:?} before what follows them")));
        };
        self.compare(&recorded, &replayed)
    }

    fn compare(&mut self, recorded: &Message, replayed: &Message) -> Result<(), Stop> {
        self.comparison.messages(self.step, recorded, replayed);
        // The rest of the recording belongs to another request.
        let (then, now) = (&recorded.header, &replayed.header);
        let fits = then.flags == now.flags && recorded.payload.len() == replayed.payload.len();
        if fits { Ok(()) } else { Err(Stop::Diverged) }
    }

    fn notice(&mut self) -> Result<Notice, Stop> {
        let message = self.message(Kind::Notice)?;
        let notice = message.as_notice();
        match notice.map_err(|e| self.wrong(format!("a notice that does not decode: {e}")))? {
            Notice::Failed(failure) => Err(self.failed(failure)),
            other => Ok(other),
        }
    }

    fn message(&mut self, kind: Kind) -> Result<Message, Stop> {
        let message = self.solver.expect(kind, self.patience);
        message.map_err(|instead| match self.solver.failed.take() {
            Some(failure) => self.failed(failure),
            None => self.wrong(format!("expected {kind:?}, got {instead}")),
        })
    }

    fn wrong(&self, how: String) -> Stop {
        Stop::Error(ReplayError::Solver {
            party: self.party,
            step: self.step,
            how,
        })
    }
}

/// A JSON object with another value at a dotted key.
fn with(config: &str, set: &str) -> Result<String, String> {
    let (key, value) = set.split_once('=').ok_or("expected KEY=VALUE")?;
    let value = serde_json::from_str(value).map_err(|e| format!("the value is not JSON: {e}"))?;
    let mut config: serde_json::Value =
        serde_json::from_str(config).map_err(|e| format!("the configuration is not JSON: {e}"))?;
    let pointer: String = key.split('.').flat_map(|part| ["/", part]).collect();
    let place = config.pointer_mut(&pointer);
    *place.ok_or("the recorded configuration has no such key")? = value;
    Ok(config.to_string())
}
