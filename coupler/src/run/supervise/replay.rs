//! A solver that cannot save its state, in a run that goes on: the coupler plays the recording to it up to the checkpoint,
//! and stands in for the other solver meanwhile. The other one is started afterwards and takes its saved state.

use std::time::Instant;

use interface::core::SessionError;
use interface::core::coupler::{Coupler, Decision, Limits, Question, Standing};
use interface::message::control::{Hello, Party};
use interface::recording::{RecordingError, Script};
use interface::session::turns::drive;
use interface::session::{CouplerSide, Stop, Supervisor};
use interface::transport::Transport;
use interface::transport::domain::Domain;
use interface::transport::iceoryx::stand_in;
use interface::transport::replayed::Replayed;

use super::Run;
use crate::run::failure::RunError;

impl Run<'_> {
    /// The solver to which the recording is to be played.
    pub(crate) fn to_replay(&self) -> Option<Party> {
        self.replayed
    }

    /// Plays the recording to `party`, which has just been started, over the ends of the coupler. It then waits for the
    /// grant with which the run goes on.
    pub(crate) fn replay(
        &mut self,
        party: Party,
        domain: &Domain,
        coupler: &mut dyn Transport,
    ) -> Result<Standing, RunError> {
        let began = Instant::now();
        let step = self.account.clock.index();
        tracing::info!(%party, steps = step, "the recording is played to the {party}, which cannot save its state");
        // It will wait for its next grant until the other solver has started, which may take longer than it waits by itself.
        self.resources.disk.starts_slowly();
        let path = self.dir.recording_path();
        let script = Script::open(&path, party).map_err(SessionError::from)?;
        let other = party.other_solver().expect("a solver is replayed");
        let other = stand_in(domain, other).map_err(SessionError::from)?;
        let mut transport = Replayed::new(coupler, other, script.clone());
        let mut replay = Replay {
            run: self,
            party,
            script,
        };
        let mut side = CouplerSide::new(&[party], &mut replay);
        drive(&mut side, &mut transport);
        let standing = side.hand_over(party);
        side.take_verdict()?;
        let standing = standing.expect("a session that ended well was handed over");
        if let Some(sink) = &self.outputs.sink {
            sink.had_its_handshake(party);
        }
        let seconds = began.elapsed().as_secs_f64();
        tracing::info!(%party, steps = step, seconds, "the {party} is where it was");
        Ok(standing)
    }
}

/// Decides what the solver is to do as the recording has it.
struct Replay<'r, 'a> {
    run: &'r mut Run<'a>,
    party: Party,
    script: Script,
}

impl Replay<'_, '_> {
    fn configure(&mut self, coupler: &Coupler) -> Result<Decision, RunError> {
        self.run.check_needs(self.party, coupler)?;
        Ok(Decision::Configure(vec![self.run.part(self.party)]))
    }

    fn next(&mut self) -> Result<Decision, RunError> {
        let grant = self.script.grant().map_err(differs)?;
        Ok(grant.map_or(Decision::HandOver, |grant| {
            let budgets = [
                grant.budget_omega_sq,
                grant.budget_speed,
                grant.budget_damping,
            ];
            Decision::Grant(grant, vec![budgets])
        }))
    }

    fn stop(&mut self, error: RunError) -> Stop {
        let reason = error.to_string();
        self.run.failure = Some(error);
        Stop(reason)
    }
}

fn differs(error: RecordingError) -> RunError {
    SessionError::from(error).into()
}

impl Supervisor for Replay<'_, '_> {
    fn decide(&mut self, question: Question, coupler: &mut Coupler) -> Result<Decision, Stop> {
        if let Some(stop) = self.interrupted(false) {
            return Err(stop);
        }
        let decision = match question {
            Question::Configure => self.configure(coupler),
            Question::Ready | Question::Collected | Question::Drained => Ok(Decision::Noted),
            Question::Next => self.next(),
        };
        decision.map_err(|error| self.stop(error))
    }

    fn limits(&self) -> Limits {
        self.run.limits()
    }

    fn joined(&mut self, hello: &Hello) {
        self.run.joined(hello);
    }

    fn gone(&mut self) -> Option<(Party, String)> {
        self.run.gone()
    }

    /// Nothing of the run is under way: an interrupt ends it at once.
    fn interrupted(&mut self, _arriving: bool) -> Option<Stop> {
        if let Some(error) = self.script.failure() {
            return Some(self.stop(differs(error)));
        }
        Supervisor::interrupted(&mut *self.run, true)
    }
}
