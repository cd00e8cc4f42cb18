//! Scenarios from seeds, what must hold in each, and the smallest one that breaks it.

use std::cell::RefCell;
use std::collections::HashMap;

use interface::message::control::Party;
use interface::message::wire::{BodyState, PointState};
use interface::session::SessionError;
use mechanics::generate::Random;

use crate::fault::{Corruption, Fault, FaultKind};
use crate::fault::{SECOND, Time};
use crate::host::SimulatedHost;
use crate::session::{DEADLINE, Plan, SessionOutcome, SolverPair, run};
use crate::toys::{MOST, TOYS};

/// A session and what goes wrong in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Of the schedule: delays, wake-ups, turns.
    pub seed: u64,
    /// What the session is about.
    pub plan: Plan,
    /// Longest delay of a message in ns.
    pub delay: Time,
    /// Chance that a wake-up is lost.
    pub lost_wakes: f64,
    /// What goes wrong.
    pub faults: Vec<Fault>,
}

/// How a scenario ended that broke nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// In order, with the bits of the run without faults.
    Whole,
    /// With a verdict that names the culprit.
    Blamed,
    /// The same, and the run was resumed to the bits of the run without faults.
    Resumed,
}

/// Things done in a session without faults, about: where faults may strike.
const EVENTS_OF_START: u64 = 12;
const EVENTS_OF_STEP: u64 = 8;

impl Scenario {
    /// The scenario of a seed, with toys.
    pub fn new(seed: u64) -> Self {
        Self::with(TOYS, seed)
    }

    /// The scenario of a seed with these solvers.
    pub fn with(solvers: SolverPair, seed: u64) -> Self {
        let mut random = Random::new(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ 0x7a6e_de37);
        let mut below = |n: u64| (random.unit() * n as f64) as u64;
        let steps = 2 + below(9);
        let plan = Plan {
            solvers,
            points: below(MOST as u64 + 1) as usize,
            steps,
            window: 1 + below(5),
            checkpoint: (below(3) == 0).then(|| 1 + below(steps)),
            outputs: 2 + below(4),
            stiffens_at: 1 + below(2 * steps),
            damps_at: 1 + below(2 * steps),
        };
        let delay = [0, 1_000, 100_000, 50_000_000][below(4) as usize];
        let lost_wakes = [0.0, 0.1, 1.0][below(3) as usize];
        let count = [0, 1, 1, 1, 2][below(5) as usize];
        let events = EVENTS_OF_START + EVENTS_OF_STEP * (steps + 2);
        let faults = (0..count).map(|_| {
            let party = Party::ALL[below(3) as usize];
            let kind = match below(5) {
                0 => FaultKind::Die,
                1 => FaultKind::Freeze(None),
                2 => FaultKind::Freeze(Some(below(4 * SECOND))),
                _ => {
                    // A coupler that loses its own message accuses others: nobody else can know.
                    let kinds = if party == Party::Coupler { 6 } else { 8 };
                    FaultKind::Corrupt(Corruption::ALL[below(kinds) as usize])
                }
            };
            let at = 1 + below(events);
            Fault { party, at, kind }
        });
        let faults = faults.collect();
        Self {
            seed,
            plan,
            delay,
            lost_wakes,
            faults,
        }
    }

    fn host(&self, faults: Vec<Fault>) -> SimulatedHost {
        SimulatedHost::new(self.seed, self.delay, self.lost_wakes, faults)
    }

    /// Plays the scenario and checks what must hold.
    ///
    /// # Errors
    /// What does not.
    pub fn judge(&self) -> Result<(Outcome, SessionOutcome), String> {
        let played = run(&self.plan, self.host(self.faults.clone()), None);
        if let Some(violation) = played.violations.first() {
            return Err(violation.0.clone());
        }
        Self::all_have_ended(&played)?;
        let first = first_error(&played);
        let Some((who, error)) = first else {
            if played.verdicts[0].is_some() {
                self.same_bits(played.finals.as_ref(), "the run")?;
            }
            return Ok((Outcome::Whole, played));
        };
        self.names_the_culprit(who, error, &played)?;
        let outcome = self.resumes(&played)?;
        Ok((outcome, played))
    }

    /// Whoever has not been stopped has a verdict.
    fn all_have_ended(played: &SessionOutcome) -> Result<(), String> {
        for (n, party) in Party::ALL.into_iter().enumerate() {
            let stopped = played
                .struck
                .iter()
                .any(|(f, _)| f.party == party && !matches!(f.kind, FaultKind::Corrupt(_)));
            if played.verdicts[n].is_none() && !stopped {
                return Err(format!("the {party} has not ended"));
            }
        }
        Ok(())
    }

    /// The first verdict blames one at whom a fault has struck, at the step at which it has.
    fn names_the_culprit(
        &self,
        who: Party,
        error: &SessionError,
        played: &SessionOutcome,
    ) -> Result<(), String> {
        let verdict = || format!("the {who} says: {error}");
        let Some(blamed) = blamed(error) else {
            return Err(format!("{}; nobody is blamed", verdict()));
        };
        let culprits: Vec<Party> = played.struck.iter().map(|(f, _)| f.party).collect();
        if hidden(blamed, played) {
            return Ok(());
        }
        if !culprits.contains(&blamed) {
            return Err(format!("{}; the culprit is {culprits:?}", verdict()));
        }
        let Some(step) = step_of(error) else {
            return Ok(());
        };
        let [coupler, mpm, dem] = played.steps;
        // A message that was sent in one step may be found wrong later: one that is sent twice, at its next reading.
        let late = played
            .struck
            .iter()
            .any(|(f, _)| matches!(f.kind, FaultKind::Corrupt(_)));
        let thawed = played
            .struck
            .iter()
            .any(|(f, _)| matches!(f.kind, FaultKind::Freeze(Some(_))));
        let last = if late || thawed || played.struck.len() > 1 {
            self.plan.steps + 2
        } else {
            mpm.max(dem) + self.plan.window
        };
        if step < coupler.min(mpm).min(dem) || step > last {
            return Err(format!(
                "{}; the fault was at step {coupler}, {mpm}, {dem}",
                verdict()
            ));
        }
        Ok(())
    }

    /// A run that ended after a checkpoint goes on from there to the same bits.
    fn resumes(&self, played: &SessionOutcome) -> Result<Outcome, String> {
        let Some(checkpoint) = &played.checkpoint else {
            return Ok(Outcome::Blamed);
        };
        let again = run(&self.plan, self.host(Vec::new()), Some(checkpoint));
        if let Some((who, error)) = first_error(&again) {
            return Err(format!("resumed, the {who} says: {error}"));
        }
        self.same_bits(again.finals.as_ref(), "the resumed run")?;
        Ok(Outcome::Resumed)
    }

    fn same_bits(&self, finals: Option<&Finals>, what: &str) -> Result<(), String> {
        let expected = reference(&self.plan)?;
        match finals {
            None => Err(format!("{what} has no end state")),
            Some(finals) if *finals == expected => Ok(()),
            Some(finals) => Err(format!(
                "{what} ends with {finals:?}, expected {expected:?}"
            )),
        }
    }

    /// Scenarios that are a little smaller.
    fn smaller(&self) -> Vec<Self> {
        let mut all = Vec::new();
        let mut add = |change: &dyn Fn(&mut Self)| {
            let mut smaller = self.clone();
            change(&mut smaller);
            if smaller != *self {
                all.push(smaller);
            }
        };
        for k in 0..self.faults.len() {
            add(&|s| {
                s.faults.remove(k);
            });
            add(&|s| s.faults[k].at = (s.faults[k].at / 2).max(1));
            add(&|s| s.faults[k].at = (s.faults[k].at - 1).max(1));
        }
        add(&|s| s.delay = 0);
        add(&|s| s.lost_wakes = 0.0);
        add(&|s| s.plan.checkpoint = None);
        add(&|s| s.plan.points = 0);
        add(&|s| s.plan.points = s.plan.points.saturating_sub(1));
        add(&|s| s.plan.window = 1);
        add(&|s| s.plan.steps = (s.plan.steps / 2).max(1));
        add(&|s| s.plan.steps = (s.plan.steps - 1).max(1));
        add(&|s| s.plan.stiffens_at = 1000);
        add(&|s| s.plan.damps_at = 1000);
        add(&|s| s.plan.outputs = 100);
        all
    }
}

type Finals = (Vec<PointState>, Vec<BodyState>);

/// The smallest scenario found that still breaks something, and what.
pub fn shrink(scenario: Scenario, what: String) -> (Scenario, String) {
    let (mut best, mut why) = (scenario, what);
    'again: loop {
        for smaller in best.smaller() {
            if let Err(what) = smaller.judge() {
                (best, why) = (smaller, what);
                continue 'again;
            }
        }
        return (best, why);
    }
}

/// End of the run without faults, step by step.
fn reference(plan: &Plan) -> Result<Finals, String> {
    type Key = (&'static str, usize, u64, u64, u64);
    thread_local! {
        static KNOWN: RefCell<HashMap<Key, Finals>> = RefCell::default();
    }
    let key = (
        plan.solvers.name,
        plan.points,
        plan.steps,
        plan.stiffens_at,
        plan.damps_at,
    );
    if let Some(known) = KNOWN.with_borrow(|known| known.get(&key).cloned()) {
        return Ok(known);
    }
    let plan = Plan {
        window: 1,
        checkpoint: None,
        outputs: 1000,
        ..plan.clone()
    };
    let played = run(&plan, SimulatedHost::new(0, 0, 0.0, Vec::new()), None);
    if let Some((who, error)) = first_error(&played) {
        return Err(format!("without faults, the {who} says: {error}"));
    }
    let finals = played.finals.ok_or("no end state without faults")?;
    KNOWN.with_borrow_mut(|known| known.insert(key, finals.clone()));
    Ok(finals)
}

/// Whether nobody can see that `blamed` is the wrong one.
fn hidden(blamed: Party, played: &SessionOutcome) -> bool {
    let struck = &played.struck;
    let solver = blamed != Party::Coupler;
    // A wrong halt flag shows as two sides that stop at different steps, a message that was never sent as two that wait
    // for one another: which of them it was cannot be seen.
    let corrupted = |kind: Corruption| {
        struck
            .iter()
            .any(|(f, _)| f.kind == FaultKind::Corrupt(kind))
    };
    if corrupted(Corruption::Drop) || (solver && corrupted(Corruption::Flags)) {
        return true;
    }
    // A solver that is slow more than once, but never too slow for the other one, holds up both reports: the coupler
    // cannot see which of them.
    let freezes = |(f, _): &&(Fault, Time)| matches!(f.kind, FaultKind::Freeze(_));
    if solver && struck.iter().filter(freezes).count() > 1 {
        return true;
    }
    let patience = (DEADLINE * SECOND as f64) as Time;
    let coupler_pauses = |from: Time, to: Time| {
        struck.iter().any(|(f, _)| {
            f.party == Party::Coupler
                && matches!(f.kind, FaultKind::Freeze(Some(time)) if (from..to).contains(&time))
        })
    };
    // A coupler that stops between its two grants for little longer than a solver waits for the other one answers in time
    // when that solver complains.
    if solver && coupler_pauses(patience - SECOND / 5, patience + 4 * SECOND / 5) {
        return true;
    }
    // One that stops for longer is the late one, since nobody answers the complaint; but a solver that dies before it can
    // take its complaint back leaves it standing (seed 628604).
    let accuser_dies = struck
        .iter()
        .any(|(f, _)| f.party != Party::Coupler && f.party != blamed && f.kind == FaultKind::Die);
    solver && accuser_dies && coupler_pauses(patience, Time::MAX)
}

/// The first party, in virtual time, whose verdict is not that of another one.
fn first_error(played: &SessionOutcome) -> Option<(Party, &SessionError)> {
    let mut first: Option<(Time, Party, &SessionError)> = None;
    for party in Party::ALL {
        if let Some((Err(error), at)) = &played.verdicts[party as usize]
            && !matches!(error, SessionError::Aborted(_))
            && first.is_none_or(|(time, ..)| *at < time)
        {
            first = Some((*at, party, error));
        }
    }
    first.map(|(_, party, error)| (party, error))
}

/// Whom a verdict blames.
fn blamed(error: &SessionError) -> Option<Party> {
    match error {
        SessionError::Late { who, .. }
        | SessionError::Contract { who, .. }
        | SessionError::Vanished { who, .. }
        | SessionError::Refused { who, .. } => Some(*who),
        SessionError::CouplerGone { .. } => Some(Party::Coupler),
        // Whom the failed one blames stands at the beginning of its words.
        SessionError::Failed { who, failure } => {
            let says = |party: &Party| {
                failure.message.starts_with(&format!("the {party} "))
                    || failure
                        .message
                        .starts_with(&format!("nothing from the {party} "))
            };
            Some(Party::ALL.into_iter().find(says).unwrap_or(*who))
        }
        _ => None,
    }
}

fn step_of(error: &SessionError) -> Option<u64> {
    match error {
        SessionError::Late { step, .. }
        | SessionError::Contract { step, .. }
        | SessionError::Vanished { step, .. }
        | SessionError::CouplerGone { step } => Some(*step),
        SessionError::Failed { failure, .. } => Some(failure.step),
        _ => None,
    }
}
