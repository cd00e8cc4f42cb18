//! The coupler's side of a session (PROTOCOL.md sections 2, 5 and 9), and the run that makes the decisions.

use std::rc::Rc;
use std::time::Duration;

use super::error::{INDIRECT_WAIT_MARGIN, SessionError, broken};
use super::io::{Io, Signal, Wait};
use super::pieces;
use super::solvers::{Part, START, Sent, Solvers, clause_of};
use crate::config::capability::SAVE;
use crate::message::control::{Configure, Hello, Notice, Order, Party};
use crate::message::wire::{Budget, Grant, StepHeader, flags};
use crate::message::{Channel, Kind, Message, Records};

/// Time for the other solver to complain too, shorter than the [`super::connection::ANSWER`] for which the first one waits.
const HEARING: Duration = Duration::from_millis(250);

/// The run cannot continue; the solvers receive this reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stop(pub String);

/// The steps that come next, and the budget of each solver in the order of the solvers.
pub type Next = (Grant, Vec<Budget>);

/// The run that a session belongs to, which makes the decisions. A [`Stop`] ends the session.
pub trait Supervisor {
    /// All solvers have sent Hello: the configuration of each, in the order of the solvers.
    ///
    /// # Errors
    /// [`Stop`].
    fn configure(&mut self, solvers: &Solvers) -> Result<Vec<Part>, Stop>;

    /// All solvers are ready.
    ///
    /// # Errors
    /// [`Stop`].
    fn ready(&mut self, _solvers: &Solvers) -> Result<(), Stop> {
        Ok(())
    }

    /// The next grant; `None` if there are no more steps.
    ///
    /// # Errors
    /// [`Stop`].
    fn next(&mut self) -> Result<Option<Next>, Stop>;

    /// The reports on the last grant have come.
    ///
    /// # Errors
    /// [`Stop`].
    fn collected(&mut self, solvers: &mut Solvers) -> Result<(), Stop>;

    /// All points have arrived, at the end.
    ///
    /// # Errors
    /// [`Stop`].
    fn drained(&mut self, solvers: &mut Solvers) -> Result<(), Stop>;

    /// Longest wait for a solver before the first step: for its Hello, and then for its Ready.
    fn start_deadline(&self) -> Duration {
        START
    }

    /// A solver has sent Hello.
    fn joined(&mut self, _hello: &Hello) {}

    /// Asked during every long wait: a solver that is gone, and how it ended.
    fn gone(&mut self) -> Option<(Party, String)> {
        None
    }

    /// Asked during every long wait: the reason why the session has to end now. `arriving`: no grant has been sent yet;
    /// `silence`: how long the wait has lasted, as its deadline counts it.
    fn interrupted(&mut self, _arriving: bool, _silence: Duration) -> Option<Stop> {
        None
    }
}

impl From<Stop> for SessionError {
    fn from(Stop(reason): Stop) -> Self {
        Self::Aborted(reason)
    }
}

/// The coupler in a session.
pub(super) struct Coupler<'a> {
    io: Rc<Io>,
    supervisor: &'a mut dyn Supervisor,
    solvers: Solvers,
    /// Whether no grant has been sent yet.
    arriving: bool,
    /// Where messages arrive, one buffer for each kind, so that memory is reused.
    inbox: [Message; Kind::ALL.len()],
}

impl<'a> Coupler<'a> {
    pub fn new(io: Rc<Io>, parties: &[Party], supervisor: &'a mut dyn Supervisor) -> Self {
        Self {
            io,
            supervisor,
            solvers: Solvers::new(parties),
            arriving: true,
            inbox: Kind::ALL.map(Message::empty),
        }
    }

    /// A whole session.
    pub async fn session(mut self) -> Result<(), SessionError> {
        let Err(mut error) = self.lead().await else {
            return Ok(());
        };
        if let SessionError::Failed { who, failure } = &error
            && failure.fault.is_none()
            && let Some(earlier) = self.earlier_complaint(*who, failure.step).await
        {
            error = earlier;
        }
        let reason = match &error {
            SessionError::Aborted(reason) => reason.clone(),
            other => other.to_string(),
        };
        // If it cannot be sent, no further error is needed.
        for i in 0..self.solvers.each.len() {
            let _ = self.order(i, &Order::Abort(reason.clone())).await;
        }
        Err(error)
    }

    /// A solver has complained in this step. Where each waits for the other, both complain, in either order, and the complaint of
    /// the earlier step is right: whoever is further has not sent what the other one needs before that.
    async fn earlier_complaint(&mut self, who: Party, step: u64) -> Option<SessionError> {
        let i = self
            .solvers
            .each
            .iter()
            .position(|sent| sent.party != who)?;
        let sent = &self.solvers.each[i];
        let (from, channel) = (sent.party, sent.channel(Kind::Notice));
        let wait = Wait {
            from,
            at_most: HEARING,
        };
        let (io, inbox) = (self.io.clone(), &mut self.inbox[Kind::Notice as usize]);
        let heard = io.arrival(wait, |signal| match (io.receive(channel, inbox)?, signal) {
            (true, _) => Ok(Some(true)),
            (false, Signal::Expired(_)) => Ok(Some(false)),
            (false, _) => Ok(None),
        });
        if !heard.await.ok()? {
            return None;
        }
        let complaint = self.read_notice(i).err()?;
        let is_earlier =
            matches!(&complaint, SessionError::Failed { failure, .. } if failure.step < step);
        is_earlier.then_some(complaint)
    }

    async fn lead(&mut self) -> Result<(), SessionError> {
        self.hellos().await?;
        let parts = self.supervisor.configure(&self.solvers)?;
        self.configure(parts).await?;
        self.readies().await?;
        self.arriving = false;
        self.supervisor.ready(&self.solvers)?;
        while let Some((grant, budgets)) = self.supervisor.next()? {
            if grant.epoch != self.solvers.round.grant.epoch {
                self.io.mark("epoch");
            }
            self.solvers.grant(grant, &budgets)?;
            self.grant().await?;
            for i in 0..self.solvers.each.len() {
                self.report(i).await?;
            }
            self.solvers.stopped_alike()?;
            self.supervisor.collected(&mut self.solvers)?;
        }
        self.order_all(&Order::Drain).await?;
        self.byes().await?;
        self.final_points()?;
        self.supervisor.drained(&mut self.solvers)?;
        self.order_all(&Order::Close).await
    }

    /// S-2.
    async fn hellos(&mut self) -> Result<(), SessionError> {
        let deadline = self.supervisor.start_deadline();
        while let Some(missing) = self.missing(|sent| sent.hello.is_none()) {
            let (i, notice) = self.notice(missing, "its hello", deadline).await?;
            let sent = &mut self.solvers.each[i];
            match notice {
                Notice::Hello(hello) if sent.hello.is_none() => {
                    sent.greet(hello)?;
                    if let Some(hello) = &sent.hello {
                        self.supervisor.joined(hello);
                    }
                }
                other => return Err(self.out_of_turn(i, &other)),
            }
        }
        Ok(())
    }

    /// S-4, K-4: sends each solver its configuration, and the state from which it continues.
    async fn configure(&mut self, parts: Vec<Part>) -> Result<(), SessionError> {
        for (i, part) in parts.into_iter().enumerate() {
            let sent = &mut self.solvers.each[i];
            if part.restore.is_some() && !sent.has(SAVE) {
                let message = "a state to restore, and no capability `save`".into();
                return Err(broken(Party::Coupler, "K-4", sent.step, message));
            }
            sent.measured = part.measured;
            // A solver may itself wait for the other one, which has this deadline.
            sent.deadline = Duration::from_secs_f64(part.configure.deadline) + INDIRECT_WAIT_MARGIN;
            sent.scene_hash.clone_from(&part.configure.scene_hash);
            let channel = sent.channel(Kind::Restore);
            let configure = Configure {
                restore: part.restore.is_some(),
                ..part.configure
            };
            self.order(i, &Order::Configure(configure)).await?;
            if let Some(state) = part.restore {
                pieces::send(&self.io, channel, 0, &state).await?;
            }
        }
        Ok(())
    }

    /// S-6.
    async fn readies(&mut self) -> Result<(), SessionError> {
        let deadline = self.supervisor.start_deadline();
        while let Some(missing) = self.missing(|sent| sent.readiness.is_none()) {
            let (i, notice) = self.notice(missing, "that it is ready", deadline).await?;
            let sent = &mut self.solvers.each[i];
            match notice {
                Notice::Ready(ready) if sent.readiness.is_none() => {
                    if ready.scene_hash != sent.scene_hash {
                        let (theirs, ours) = (ready.scene_hash, &sent.scene_hash);
                        let message = format!("ready for scene {theirs}, the coupler's is {ours}");
                        return Err(sent.broke("S-6", message));
                    }
                    if let Some(message) = ready.readiness.impossible_value() {
                        return Err(sent.broke("S-6", message));
                    }
                    sent.readiness = Some(ready.readiness);
                }
                Notice::Refused(refusal) => {
                    let who = sent.party;
                    return Err(SessionError::Refused { who, refusal });
                }
                other => return Err(self.out_of_turn(i, &other)),
            }
        }
        Ok(())
    }

    async fn grant(&self) -> Result<(), SessionError> {
        for sent in &self.solvers.each {
            let header = StepHeader {
                epoch: sent.grant.epoch,
                step: sent.grant.first,
                count: 1,
                ..StepHeader::default()
            };
            let grant = Records::Grant(std::slice::from_ref(&sent.grant));
            self.io
                .send(sent.channel(Kind::Grant), header, grant)
                .await?;
        }
        Ok(())
    }

    /// waits for the report of the i-th solver, and takes what it sent before. Saved states arrive in
    /// pieces, from either solver.
    async fn report(&mut self, i: usize) -> Result<(), SessionError> {
        let sent = &self.solvers.each[i];
        let (who, deadline) = (sent.party, sent.deadline);
        let [report, mpm, dem] = [
            sent.channel(Kind::Report),
            Channel::of(Party::Mpm, Kind::Saved),
            Channel::of(Party::Dem, Kind::Saved),
        ];
        let checkpoint = self.solvers.round.grant.flags & flags::CHECKPOINT != 0;
        let channels: &[Channel] = match (checkpoint, &self.solvers.each[..]) {
            (false, _) => &[report],
            (true, [one]) => &[report, one.channel(Kind::Saved)],
            (true, _) => &[report, mpm, dem],
        };
        loop {
            let channel = self.receive(channels, who, "its report", deadline).await?;
            if channel.kind == Kind::Report {
                break;
            }
            self.piece(channel)?;
        }
        let report = &self.inbox[Kind::Report as usize];
        self.solvers.each[i].report(report.payload.of())?;
        self.solvers.note_limits(i);
        self.io.step.set(self.solvers.step());
        // The rest of the state was sent before the report, and nobody has looked at it since.
        let sent = &self.solvers.each[i];
        if sent.grant.flags & flags::CHECKPOINT != 0 && sent.saved.is_none() {
            let channel = sent.channel(Kind::Saved);
            let of_step = (clause_of(channel.kind), self.solvers.round.grant.first);
            while {
                self.take(channel, of_step, "report")?;
                !self.piece(channel)?
            } {}
        }
        for channel in self.solvers.each[i].before_report() {
            let of_step = (clause_of(channel.kind), self.solvers.round.grant.first);
            self.take(channel, of_step, "report")?;
            let message = &self.inbox[channel.kind as usize];
            self.solvers.take(i, message, of_step)?;
        }
        Ok(())
    }

    /// K-3: a piece of a state has arrived; returns whether it was the last one.
    fn piece(&mut self, channel: Channel) -> Result<bool, SessionError> {
        let Message { header, payload } = &self.inbox[Kind::Saved as usize];
        let mut each = self.solvers.each.iter_mut();
        let sent = each.find(|sent| sent.party == channel.from());
        let sent = sent.expect("a solver of this session");
        sent.piece(header, payload.of())
    }

    async fn byes(&mut self) -> Result<(), SessionError> {
        while let Some(missing) = self.missing(|sent| !sent.bye) {
            let (i, notice) = self.notice(missing, "its goodbye", START).await?;
            match notice {
                Notice::Bye if !self.solvers.each[i].bye => self.solvers.each[i].bye = true,
                other => return Err(self.out_of_turn(i, &other)),
            }
        }
        Ok(())
    }

    /// D-1: takes the points that the continuum sent before its Bye.
    fn final_points(&mut self) -> Result<(), SessionError> {
        let mut each = self.solvers.each.iter();
        let Some(i) = each.position(|sent| sent.party == Party::Mpm) else {
            self.solvers.round.points.clear();
            return Ok(());
        };
        let sent = &self.solvers.each[i];
        let of_end = ("D-1", sent.step);
        self.take(sent.channel(Kind::Points), of_end, "goodbye")?;
        let points = &self.inbox[Kind::Points as usize];
        self.solvers.take(i, points, of_end)
    }

    /// Takes a message that was sent before the one that has just arrived.
    fn take(
        &mut self,
        channel: Channel,
        (clause, step): (&'static str, u64),
        before: &str,
    ) -> Result<(), SessionError> {
        let into = &mut self.inbox[channel.kind as usize];
        if self.io.receive(channel, into)? {
            return Ok(());
        }
        let message = format!("nothing on {} before the {before}", channel.name());
        Err(broken(channel.from(), clause, step, message))
    }

    async fn order_all(&self, order: &Order) -> Result<(), SessionError> {
        for i in 0..self.solvers.each.len() {
            self.order(i, order).await?;
        }
        Ok(())
    }

    async fn order(&self, i: usize, order: &Order) -> Result<(), SessionError> {
        let Message { header, payload } = Message::order(order);
        let channel = self.solvers.each[i].channel(Kind::Order);
        self.io.send(channel, header, payload.records()).await
    }

    /// The first solver of which something is missing.
    fn missing(&self, is_missing: fn(&&Sent) -> bool) -> Option<Party> {
        let first = self.solvers.each.iter().find(is_missing);
        first.map(|sent| sent.party)
    }

    /// Waits for a notice of any solver. `missing` is the one that is late if none comes.
    async fn notice(
        &mut self,
        missing: Party,
        awaited: &'static str,
        deadline: Duration,
    ) -> Result<(usize, Notice), SessionError> {
        let each = self.solvers.each.iter();
        let channels: Vec<Channel> = each.map(|sent| sent.channel(Kind::Notice)).collect();
        let channel = self.receive(&channels, missing, awaited, deadline).await?;
        let mut each = self.solvers.each.iter();
        let i = each.position(|sent| sent.party == channel.from());
        let i = i.expect("a solver of this session");
        Ok((i, self.read_notice(i)?))
    }

    /// The notice that has arrived, unless it says that the solver cannot go on.
    fn read_notice(&self, i: usize) -> Result<Notice, SessionError> {
        let bytes = self.inbox[Kind::Notice as usize].payload.of();
        let sent = &self.solvers.each[i];
        match Notice::decode(bytes).map_err(|e| sent.broke("S-1", e.to_string()))? {
            Notice::Failed(failure) => Err(SessionError::Failed {
                who: sent.party,
                failure,
            }),
            notice => Ok(notice),
        }
    }

    fn out_of_turn(&self, i: usize, notice: &Notice) -> SessionError {
        self.solvers.each[i].broke("S-2", format!("{notice:?} out of turn"))
    }

    /// Waits for a message of one of these channels, until the run or a solver ends the session, a solver is gone, or the
    /// deadline for `who` is over.
    async fn receive(
        &mut self,
        channels: &[Channel],
        who: Party,
        awaited: &'static str,
        at_most: Duration,
    ) -> Result<Channel, SessionError> {
        let io = self.io.clone();
        let wait = Wait { from: who, at_most };
        let awaits_notices = channels.iter().all(|channel| channel.kind == Kind::Notice);
        io.arrival(wait, |signal| {
            let found = self.look(channels)?;
            if found.is_some() {
                return Ok(found);
            }
            match signal {
                Signal::None => Ok(None),
                Signal::Expired(waited) => Err(SessionError::Late {
                    who,
                    awaited,
                    step: self.solvers.of(who).map_or(0, |sent| sent.step),
                    waited,
                }),
                Signal::LookUp(silence) => {
                    if let Some(stop) = self.supervisor.interrupted(self.arriving, silence) {
                        return Err(stop.into());
                    }
                    // A notice is looked for before the end of a process: a solver that has ended may have sent the reason.
                    if !awaits_notices {
                        self.unexpected_notice()?;
                    }
                    let Some((gone, how)) = self.supervisor.gone() else {
                        return Ok(None);
                    };
                    let last_words = if awaits_notices {
                        self.look(channels)?
                    } else {
                        self.unexpected_notice()?;
                        None
                    };
                    match last_words {
                        Some(_) => Ok(last_words),
                        None => Err(SessionError::Vanished {
                            who: gone,
                            how,
                            step: self.solvers.of(gone).map_or(0, |sent| sent.step),
                        }),
                    }
                }
            }
        })
        .await
    }

    /// Takes the next message of these channels; returns its channel, if there is one.
    fn look(&mut self, channels: &[Channel]) -> Result<Option<Channel>, SessionError> {
        for &channel in channels {
            let into = &mut self.inbox[channel.kind as usize];
            if self.io.receive(channel, into)? {
                return Ok(Some(channel));
            }
        }
        Ok(None)
    }

    /// A notice that has arrived while the session waits for another message.
    fn unexpected_notice(&mut self) -> Result<(), SessionError> {
        for i in 0..self.solvers.each.len() {
            let channel = self.solvers.each[i].channel(Kind::Notice);
            let into = &mut self.inbox[Kind::Notice as usize];
            if self.io.receive(channel, into)? {
                let notice = self.read_notice(i)?;
                return Err(self.out_of_turn(i, &notice));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::control::Failure;
    use crate::session::{Session, Turn};
    use crate::solver::Fault;
    use crate::transport::Transport;
    use crate::transport::direct::Direct;

    /// No solver comes as far as to a decision.
    struct Nobody;

    impl Supervisor for Nobody {
        fn configure(&mut self, _: &Solvers) -> Result<Vec<Part>, Stop> {
            unreachable!("not all have sent Hello")
        }
        fn next(&mut self) -> Result<Option<Next>, Stop> {
            unreachable!("nobody is ready")
        }
        fn collected(&mut self, _: &mut Solvers) -> Result<(), Stop> {
            unreachable!("nobody is ready")
        }
        fn drained(&mut self, _: &mut Solvers) -> Result<(), Stop> {
            unreachable!("nobody is ready")
        }
    }

    fn complains(hub: &Direct, party: Party, step: u64, fault: Option<Fault>) {
        let message = format!("said by {party}");
        let failure = Failure {
            step,
            fault,
            message,
        };
        let message = Message::notice(0, &Notice::Failed(failure));
        let solver: &mut dyn Transport = &mut hub.clone();
        let channel = Channel::of(party, Kind::Notice);
        solver.send_and_wake(channel, &message).unwrap();
    }

    /// The verdict if dem complains in step 1, and mpm in `step` a little later.
    fn verdict(step: Option<u64>, fault: Option<Fault>) -> String {
        let hub = Direct::new();
        let mut nobody = Nobody;
        let both = [Party::Mpm, Party::Dem];
        let mut session = Session::coupler(&both, &mut nobody, Box::new(hub.clone()));
        complains(&hub, Party::Dem, 1, fault);
        for _ in 0..10 {
            if matches!(session.turn(), Turn::Waits(_)) {
                break;
            }
        }
        match step {
            Some(step) => complains(&hub, Party::Mpm, step, None),
            None => session.expire(HEARING),
        }
        while session.verdict().is_none() {
            session.turn();
        }
        session.into_verdict().unwrap_err().to_string()
    }

    /// A solver that sends no forces waits for the next states, and was the first to report that the other one was silent.
    #[test]
    fn of_two_complaints_that_of_the_earlier_step_is_told() {
        let mpm = "the mpm ended the session at step 0: said by mpm";
        let dem = "the dem ended the session at step 1: said by dem";
        assert_eq!(verdict(Some(0), None), mpm);
        assert_eq!(verdict(Some(1), None), dem);
        assert_eq!(verdict(None, None), dem);
        let fault = Some(Fault::Other("x".into()));
        assert_eq!(
            verdict(Some(0), fault),
            "the dem stopped at step 1: said by dem"
        );
    }
}
