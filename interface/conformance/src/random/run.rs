//! A case run: the kit is the coupler and the other side, and compares every answer with the oracle.

use interface::config::capability::Capabilities;
use interface::message::control::Configure;
use interface::message::wire::{Ledger, Record, StepHeader, flags};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::judge::{Difference, Judge};
use super::plan::Epoch;
use crate::bench::{Bench, Run, WindowReport};
use crate::verdict::Unmet;

/// A case of one side. A case is data, so it can be made smaller, kept in a file and run again.
pub trait Case: Clone + PartialEq + Serialize + DeserializeOwned + Send {
    /// What is expected, and where the run stands.
    type Stand: Clone;
    /// The clauses whose breach is the cause where others are broken too.
    const CAUSES: &'static [&'static str];

    /// The case of a seed, for a solver that takes this.
    fn of_seed(seed: u64, takes: &Capabilities) -> Self;
    /// Its steps.
    fn epochs(&mut self) -> &mut Vec<Epoch>;
    /// Whether it is a case that a coupled run may begin.
    fn is_possible(&self) -> bool;
    /// What the solver gets.
    fn order(&self) -> Configure;
    /// A run that is ready.
    fn begun<'b>(&self, bench: &'b Bench, judge: &mut Judge) -> Result<Begun<'b, Self>, Stop>;
    /// The steps of a grant, and the report on it.
    fn window(
        &self,
        run: &mut Run,
        stand: &mut Self::Stand,
        window: Window,
        judge: &mut Judge,
    ) -> Result<(), Stop>;
    /// The end of the run, after all steps.
    fn end(&self, run: Run, stand: &mut Self::Stand, judge: &mut Judge) -> Result<(), Stop>;
    /// What another run has to answer in the same way, after all steps that could be judged.
    fn again(&self, _: &Bench, _: &Self::Stand, _: &mut Judge) -> Result<(), Stop> {
        Ok(())
    }
    /// What a solver takes less some of it, if in cases of the rest it may keep a clause that it has broken.
    fn narrower(_broken: &str, _takes: &Capabilities) -> Option<Capabilities> {
        None
    }
    /// The same from a later step on, as if it were the first, where that can be.
    fn later(&self, _first: u32) -> Option<Self> {
        None
    }

    /// The same with other steps.
    fn with(&self, epochs: Vec<Epoch>) -> Self {
        let mut other = self.clone();
        *other.epochs() = epochs;
        other
    }
}

/// A run and where it stands.
pub type Begun<'b, C> = (Run<'b>, <C as Case>::Stand);

/// What a window is.
#[derive(Clone, Copy)]
pub struct Window {
    /// Its steps.
    pub steps: u32,
    /// Their length in s.
    pub dt: f64,
    /// Whether the outlines are asked for.
    pub outlines: bool,
    /// Whether its first step is measured.
    pub measured: bool,
    /// Whether its first step is a frame.
    pub frame: bool,
}

/// A run that does not go on.
pub enum Stop {
    /// An answer differs.
    Differs(Box<Difference>),
    /// There is no answer.
    Unmet(Unmet),
    /// From here on rounding decides, or the case is none that a run may have.
    Doubtful,
}

impl From<Unmet> for Stop {
    fn from(unmet: Unmet) -> Self {
        Self::Unmet(unmet)
    }
}

impl From<Box<Difference>> for Stop {
    fn from(difference: Box<Difference>) -> Self {
        Self::Differs(difference)
    }
}

/// Runs a case; stops where something differs, or where the solver does not take it.
pub fn run<C: Case>(bench: &Bench, case: &C, judge: &mut Judge) -> Result<(), Stop> {
    match steps(bench, &mut case.clone(), judge) {
        Err(Stop::Doubtful) => Ok(()),
        // A missing answer is a breach of the first of the causes that are asked for.
        Err(Stop::Unmet(Unmet::Broken(evidence))) => Err(Stop::Differs(Box::new(Difference {
            clause: C::CAUSES
                .iter()
                .chain(judge.selected)
                .find(|id| judge.selected.contains(id))
                .unwrap_or(&C::CAUSES[0]),
            step: judge.step,
            expected: evidence.expected,
            got: evidence.got,
            share: f64::INFINITY,
        }))),
        outcome => outcome,
    }
}

/// Whether other ways of doing the same steps give the same bits (T-6, K-4): each a clause and the case in that way.
pub fn ways<C: Case>(case: &C, saves: bool) -> Vec<(&'static str, C)> {
    let with = |change: &dyn Fn(&mut Epoch)| {
        let mut other = case.clone();
        other.epochs().iter_mut().for_each(change);
        other
    };
    let ones = with(&|epoch| epoch.windows = vec![1; epoch.steps() as usize]);
    let mut ways = vec![("T-6a", case.clone()), ("T-6b", ones)];
    if saves {
        let mut saved = case.clone();
        let later = saved.epochs().iter_mut().skip(1);
        later.for_each(|epoch| epoch.resumed = !epoch.resumed);
        ways.push(("K-4a", saved));
    }
    ways
}

/// Runs a case, and if nothing differs also in those other ways whose clauses are asked for.
pub fn run_in_all_ways<C: Case>(bench: &Bench, case: &C, judge: &mut Judge) -> Result<(), Stop> {
    run(bench, case, judge)?;
    let ways = ways(case, bench.takes("save")).into_iter();
    for (clause, other) in ways.filter(|(clause, _)| judge.selected.contains(clause)) {
        let mut again = Judge::new(&[]);
        match run(bench, &other, &mut again) {
            Err(Stop::Differs(mut difference)) => {
                difference.clause = clause;
                return Err(difference.into());
            }
            outcome => outcome?,
        }
        let place = judge.bits.iter().zip(&again.bits).position(|(a, b)| a != b);
        let counts = [judge.bits.len(), again.bits.len()];
        let place = place.or((counts[0] != counts[1]).then_some(counts[0]));
        let of = "the first number that is another one in another run of these steps";
        judge.step = 0;
        judge.same(clause, of, place, None)?;
    }
    Ok(())
}

fn steps<C: Case>(bench: &Bench, case: &mut C, judge: &mut Judge) -> Result<(), Stop> {
    let (mut play, mut stand) = case.begun(bench, judge)?;
    let ended = each_step(bench, case, (&mut play, &mut stand), judge);
    match ended {
        // Not kept waiting while another run goes on.
        Err(Stop::Doubtful) => drop(play),
        ended => {
            ended?;
            case.end(play, &mut stand, judge)?;
        }
    }
    case.again(bench, &stand, judge)
}

fn each_step<'b, C: Case>(
    bench: &'b Bench,
    case: &mut C,
    (play, stand): (&mut Run<'b>, &mut C::Stand),
    judge: &mut Judge,
) -> Result<(), Stop> {
    for epoch in case.epochs().clone() {
        for (k, &steps) in epoch.windows.iter().enumerate() {
            let first = k == 0;
            let saves = epoch.resumed;
            let window = Window {
                steps,
                dt: epoch.dt,
                outlines: first && epoch.outlines,
                measured: first,
                frame: first && epoch.frame,
            };
            let from = saves.then(|| (play.at.clone(), stand.clone(), judge.bits.len()));
            let mut grant = play.next_grant(epoch.dt, u64::from(steps), first);
            grant.flags |= u64::from(window.frame) * flags::FRAME;
            grant.flags |= u64::from(saves) * flags::CHECKPOINT;
            play.send_grant(grant)?;
            case.window(play, stand, window, judge)?;
            if let Some((run, begun, bits)) = from {
                judge.bits.truncate(bits);
                let state = play.session.saved()?;
                *play = bench.resumed(&case.order(), &state, &run)?;
                *stand = begun;
                grant.flags &= !flags::CHECKPOINT;
                let _ = play.next_grant(epoch.dt, u64::from(steps), first);
                play.send_grant(grant)?;
                case.window(play, stand, window, judge)?;
            }
        }
    }
    Ok(())
}

/// The announced and the true number of records of a message.
fn counts<T>(sent: Option<&(StepHeader, Vec<T>)>) -> Option<[u64; 2]> {
    sent.map(|(header, records)| [header.count, records.len() as u64])
}

/// The report on a grant whose first step is `first`, and whether it is one; a measurement has so many records.
pub fn report(
    run: &mut Run,
    (first, records): (u64, usize),
    window: Window,
    judge: &mut Judge,
) -> Result<WindowReport, Stop> {
    let reported = run.report()?;
    let (report, header, own) = (&reported.report, reported.header, run.header());
    let reports = reported.reports as u64;
    let [bodies, groups] = [
        counts(reported.bodies.as_ref()),
        counts(reported.groups.as_ref()),
    ];
    let sent = [
        Some([header.count, reports]),
        bodies,
        groups,
        counts(reported.contacts.as_ref()),
    ];
    for [announced, there] in sent.into_iter().flatten() {
        let of = "count in the header of a report or of what came before it";
        judge.same("C-4", of, announced, there)?;
    }
    judge.same("R-1a", "reports in a message", reports, 1)?;
    let got = (report.epoch, report.next, report.halted);
    let want = (own.epoch, own.step, 0);
    judge.same("R-1a", "epoch, next and halted of a report", got, want)?;
    let (got, want) = ([header.epoch, header.step], [own.epoch, own.step]);
    judge.same("R-1a", "epoch and step of its header", got, want)?;
    let l = report.limits;
    let limits = [l.omega_sq, l.contact_omega_sq, l.damping, l.speed];
    let least = limits.into_iter().fold(0.0, f64::min);
    judge.same("L-1a", "the least limit, if it is below 0", least, 0.0)?;
    let wrong = report.check().err().map(|fault| format!("{fault:?}"));
    let wrong = wrong.or_else(|| run.ready.readiness.absurd(report));
    judge.same("R-2a", "what is not finite or cannot be", wrong, None)?;
    let sent = reported.bodies.as_ref().map(|(header, _)| header.step);
    let sent = sent.or(reported.groups.as_ref().map(|(header, _)| header.step));
    if window.measured {
        let there = bodies.or(groups).map(|[_, there]| there);
        let got = (report.measured, sent, there);
        let want = (1, Some(first), Some(records as u64));
        let of = "measured, the measured step, and its number of records";
        judge.same("R-3a", of, got, want)?;
    } else {
        let ledger = report.ledger == Ledger::default();
        let got = (report.measured, ledger, sent, reported.points.is_some());
        let of = "measured, whether the ledger is 0, and what is sent";
        judge.same("R-3b", of, got, (0, true, None, false))?;
    }
    Ok(reported)
}
