//! Plays a recording to one solver and compares what it answers: `tandem replay`.
//!
//! The kit is the coupler and the other solver, as they were: orders, grants and what the other side sent come from
//! the recording, whatever the solver answers. So a difference does not grow by being fed back through the other side,
//! and a solver can be stepped through in a debugger without the rest of the run.

mod compare;
mod error;
mod script;

use std::path::Path;
use std::time::Duration;

use interface::message::control::{Configure, Notice, Order, Party};
use interface::message::wire::{Grant, flags};
use interface::recording::{End, Playback};
use interface::transport::raw::{Kind, Message, Payload, RawRun};
use interface::transport::wait::{Awaited, Spin, wait};

pub use compare::{Comparison, Difference};
pub use error::ReplayError;
use error::Stop;
use script::Script;

use crate::bench::{Instead, Subject, Worker};

/// Longest wait for Hello, and for the end after Close.
const ARRIVAL: Duration = Duration::from_secs(30);
/// Longest wait for Ready and Bye.
const CONFIGURATION: Duration = Duration::from_mins(2);

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

/// How a recording is replayed.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Largest difference of a number, relative to the largest of its unit (all energies, all lengths, ...) so far in
    /// the recording; 0: the same bits.
    pub tolerance: f64,
    /// Values of the solver's configuration other than those recorded, as `key.key=JSON`.
    pub set: Vec<String>,
}

/// Plays the recording at `path` to `subject`.
///
/// # Errors
/// [`ReplayError`].
pub fn replay(path: &Path, subject: &Subject, options: &Options) -> Result<Outcome, ReplayError> {
    // All of it is read once before anything is started.
    let end = Playback::verify(path)?;
    let party = subject.party;
    let script = Script::open(path, party)?;
    let raw_run = RawRun::open(subject.medium(), party)?;
    let worker = subject.start(raw_run.domain());
    let mut replay = Replay {
        party,
        set: &options.set,
        script,
        raw_run,
        worker: worker.map_err(|e| ReplayError::Start(party, e))?,
        comparison: Comparison::new(party, options.tolerance),
        patience: ARRIVAL,
        coupled: false,
        step: 0,
    };
    let failed_as_recorded = match replay.run() {
        Ok(()) | Err(Stop::Over | Stop::Diverged) => None,
        Err(Stop::FailedAsRecorded(words)) => Some(words),
        Err(Stop::Error(error)) => return Err(error),
    };
    let steps = replay.step;
    Ok(Outcome {
        steps,
        comparison: std::mem::take(&mut replay.comparison),
        end,
        failed_as_recorded,
    })
}

struct Replay<'a> {
    party: Party,
    set: &'a [String],
    script: Script,
    raw_run: RawRun,
    worker: Worker,
    comparison: Comparison,
    /// Longest wait for an answer within a step.
    patience: Duration,
    coupled: bool,
    /// First step that is not replayed.
    step: u64,
}

impl Replay<'_> {
    fn run(&mut self) -> Result<(), Stop> {
        let hello = self.await_notice(ARRIVAL)?;
        if !matches!(hello, Notice::Hello(_)) {
            return Err(self.solver(format!("{hello:?} instead of Hello")));
        }
        self.recorded(Kind::Notice)?;
        loop {
            let message = self.script.lead()?.ok_or(Stop::Over)?;
            match &message.payload {
                Payload::Grant(grants) => {
                    let [grant] = grants[..] else {
                        return Err(senseless("a message of several grants"));
                    };
                    // The states that the run saved are not needed.
                    let unsaved = Grant {
                        flags: grant.flags & !flags::CHECKPOINT,
                        ..grant
                    };
                    let header = message.header;
                    self.raw_run
                        .send(&Message::new(header, Payload::Grant(vec![unsaved])))?;
                    self.window(&grant)?;
                }
                _ => match message.as_order().map_err(|e| senseless(&e))? {
                    Order::Configure(order) => self.configure(order)?,
                    Order::Drain => self.drain(&message)?,
                    Order::Close => {
                        self.raw_run.send(&message)?;
                        return self.await_end();
                    }
                    // The recorded run ended here, because of the other side or of the coupler.
                    Order::Abort(_) => return self.epilogue(),
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
        // As long as the coupler waits for a party that waits for another one (S-11).
        let deadline = order.longest_wait();
        let deadline =
            deadline.ok_or_else(|| senseless(&format!("a deadline of {} s", order.deadline)))?;
        self.patience = deadline + Duration::from_secs(1);
        let restores = order.restore;
        let order = Message::order(&Order::Configure(order));
        self.raw_run.send(&order)?;
        // The run began with the state of another one.
        let mut more = restores;
        while more {
            let piece = self.recorded(Kind::Restore)?;
            self.raw_run.send(&piece)?;
            more = piece.header.flags & flags::LAST == 0;
        }
        let reply = self.await_notice(CONFIGURATION)?;
        let recorded = self.recorded(Kind::Notice)?;
        let recorded = recorded.as_notice().map_err(|e| senseless(&e))?;
        match (&recorded, &reply) {
            (Notice::Ready(then), Notice::Ready(now)) => self.comparison.ready(then, now),
            (then, now) if then == now => {}
            (then, now) => {
                self.comparison
                    .words(0, format!("{then:?}"), format!("{now:?}"));
                return Err(Stop::Diverged);
            }
        }
        Ok(())
    }

    fn window(&mut self, grant: &Grant) -> Result<(), Stop> {
        let end = grant.first.saturating_add(grant.steps);
        let granted = |states: &Message| {
            states.header.epoch == grant.epoch && (grant.first..end).contains(&states.header.step)
        };
        let (mut done, mut torn) = (0, false);
        while self.coupled {
            // The window may have ended early: its report tells.
            match self.script.peek(Kind::States)? {
                Some(states) if granted(states) => done += u64::from(self.exchange()?),
                states => {
                    torn = states.is_none();
                    break;
                }
            }
        }
        let report = self.recorded(Kind::Report)?;
        if let Payload::Report(reports) = &report.payload
            && let Some(told) = reports.first()
            && torn
            && (told.halted == 1 || grant.first + done < told.next)
        {
            // Messages between the solvers are recorded a little later than reports, so the last ones are missing here.
            return Err(Stop::Over);
        }
        let replayed = self.await_message(Kind::Report, self.patience)?;
        if grant.flags & flags::MEASURE != 0 {
            self.compare_sent(self.measurement())?;
        }
        if grant.flags & flags::FRAME != 0 && self.party == Party::Mpm {
            self.compare_sent(Kind::Points)?;
        }
        if let Payload::Report(reports) = &report.payload
            && let [report] = reports[..]
        {
            self.step = report.next;
        }
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
                self.raw_run.send(&set)?;
            }
            self.raw_run.send(&states)?;
            if let Some(kind) = answer {
                let recorded = self.recorded(kind)?;
                let replayed = self.await_message(kind, self.patience)?;
                self.compare(&recorded, &replayed)?;
            }
        } else {
            let replayed = self.await_message(Kind::States, self.patience)?;
            if set && replayed.header.flags == states.header.flags {
                self.compare_sent(Kind::Set)?;
            }
            self.compare(&states, &replayed)?;
            if let Some(kind) = answer {
                let recorded = self.recorded(kind)?;
                self.raw_run.send(&recorded)?;
            }
        }
        Ok(answer == Some(Kind::Forces))
    }

    fn drain(&mut self, order: &Message) -> Result<(), Stop> {
        self.raw_run.send(order)?;
        let recorded = self.recorded(Kind::Notice)?;
        let bye = self.await_notice(CONFIGURATION)?;
        if recorded.as_notice().as_ref() != Ok(&bye) {
            let recorded = format!("{:?}", recorded.as_notice());
            self.comparison
                .words(self.step, recorded, format!("{bye:?}"));
            return Err(Stop::Diverged);
        }
        if self.party == Party::Mpm {
            self.compare_sent(Kind::Points)?;
        }
        Ok(())
    }

    fn measurement(&self) -> Kind {
        if self.party == Party::Mpm {
            Kind::Groups
        } else {
            Kind::Bodies
        }
    }

    /// The next recorded message of a kind, or what the recording ends with instead.
    fn recorded(&mut self, kind: Kind) -> Result<Message, Stop> {
        match self.script.next(kind)? {
            Some(message) => Ok(message),
            None => Err(self.epilogue().err().unwrap_or(Stop::Over)),
        }
    }

    /// The recording has nothing more for the solver: if that is because the solver failed, it fails again.
    fn epilogue(&mut self) -> Result<(), Stop> {
        let Some(message) = self.script.next(Kind::Notice)? else {
            return Err(Stop::Over);
        };
        match message.as_notice() {
            Ok(Notice::Failed(_)) => {
                let replayed = self.await_notice(self.patience)?;
                Err(self.failed(Some(&message), &replayed))
            }
            _ => Err(Stop::Over),
        }
    }

    /// The solver has failed: as it was recorded, or otherwise.
    fn failed(&mut self, recorded: Option<&Message>, replayed: &Notice) -> Stop {
        let (then, Notice::Failed(now)) = (recorded.and_then(|m| m.as_notice().ok()), replayed)
        else {
            return self.solver(format!("{replayed:?}"));
        };
        match then {
            Some(Notice::Failed(then)) if then == *now => {
                self.step = now.step;
                Stop::FailedAsRecorded(now.message.clone())
            }
            Some(Notice::Failed(then)) => {
                let of = |failure: &interface::message::control::Failure| {
                    format!("failed at step {}: {}", failure.step, failure.message)
                };
                self.comparison.words(now.step, of(&then), of(now));
                Stop::Diverged
            }
            _ => self.solver(now.message.clone()),
        }
    }

    /// A message that has been sent before another one that has arrived.
    fn compare_sent(&mut self, kind: Kind) -> Result<(), Stop> {
        let recorded = self.recorded(kind)?;
        let Some(replayed) = self.raw_run.receive(kind)? else {
            return Err(self.solver(format!("no {kind:?} before what follows them")));
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

    fn await_notice(&mut self, patience: Duration) -> Result<Notice, Stop> {
        let message = self.await_message(Kind::Notice, patience)?;
        message
            .as_notice()
            .map_err(|e| self.solver(format!("a notice that does not decode: {e}")))
    }

    fn await_message(&mut self, kind: Kind, patience: Duration) -> Result<Message, Stop> {
        match self.worker.expect(&self.raw_run, kind, patience) {
            Ok(message) => Ok(message),
            Err(Instead::Channel(error)) => Err(error.into()),
            Err(Instead::End(how)) => Err(self.solver(how)),
            Err(Instead::Silence(waited)) => {
                let waited = waited.as_secs_f64();
                let how = format!("says nothing for {waited:.1} s, {kind:?} expected");
                Err(self.solver(how))
            }
            Err(Instead::Notice(message)) => {
                let replayed = message
                    .as_notice()
                    .map_err(|e| self.solver(format!("a notice that does not decode: {e}")))?;
                let recorded = self.script.next(Kind::Notice)?;
                Err(match (recorded, replayed) {
                    // It fails where it did not: what the recording has instead says more than its words alone.
                    (None, Notice::Failed(now)) => {
                        self.solver(format!("{} ({kind:?} expected of it)", now.message))
                    }
                    (recorded, replayed) => self.failed(recorded.as_ref(), &replayed),
                })
            }
        }
    }

    /// After Close.
    fn await_end(&mut self) -> Result<(), Stop> {
        let how = wait(&mut Exit(&mut self.worker), &mut Spin::default(), ARRIVAL);
        let how = how.unwrap_or_else(|waited| {
            format!("has not ended {:.0} s after Close", waited.as_secs_f64())
        });
        if how.ends_with("exit status 0") {
            Ok(())
        } else {
            Err(self.solver(how))
        }
    }

    fn solver(&self, how: String) -> Stop {
        Stop::Error(ReplayError::Solver {
            party: self.party,
            step: self.step,
            how,
        })
    }
}

/// The end of a solver.
struct Exit<'a>(&'a mut Worker);

impl Awaited for Exit<'_> {
    type Found = String;

    fn look(&mut self) -> Option<String> {
        self.0.ended()
    }

    fn block(&mut self, at_most: Duration) {
        interface::transport::wait::nap(at_most);
    }
}

impl Drop for Replay<'_> {
    fn drop(&mut self) {
        // A solver that still runs gets an Abort; one that does not read it sees that the coupler is gone.
        let over = Order::Abort("the replay is over".into());
        if self.worker.ended().is_none() {
            let _ = self.raw_run.send(&Message::order(&over));
        }
        self.raw_run.release();
        self.worker.dismiss();
    }
}

fn senseless(why: &str) -> Stop {
    ReplayError::Senseless(why.into()).into()
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
