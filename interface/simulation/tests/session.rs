//! Runs one session: decides whose turn it is, and keeps the verdict of each party.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use interface::hosted::Host;
use interface::message::control::{Configure, Party};
use interface::message::wire::{BodyState, Budget, Grant, PointState, flags};
use interface::session::{
    Clocked, Next, Part, Session, SessionError, Solvers, Stop, Supervisor, Turn, Wait,
};
use interface::solver::{DemSolver, MpmSolver};
use interface::step::Clock;

use crate::fault::Fault;
use crate::fault::{SECOND, Time};
use crate::host::{Ends, SimulatedHost, Stopped, Violation};

/// Longest sleep before looking again (clause B-3).
const NAP: Time = SECOND / 100;
/// What a turn takes at most, in ns.
const TURN: f64 = 2000.0;
/// After the coupler's end a solver that still runs is killed (clause S-11).
const GRACE: Time = 2 * SECOND;
/// Longest session in virtual time: beyond it, it hangs. Longer than any deadline of S-11 and what may follow it.
const HANG: Time = 1000 * SECOND;
/// Longest wait for another party within a step, in s.
pub const DEADLINE: f64 = 2.0;

/// A continuum and bodies.
pub type Pair = (Box<dyn MpmSolver>, Box<dyn DemSolver>);

/// The solvers of a session.
#[derive(Clone, Copy)]
pub struct SolverPair {
    /// Their name.
    pub name: &'static str,
    /// Configurations of the continuum and of the bodies, as they are sent.
    pub configs: fn() -> [String; 2],
    /// Groups and bodies of a measurement.
    pub measured: [usize; 2],
    /// The solvers for a plan.
    pub build: fn(&Plan) -> Pair,
}

impl std::fmt::Debug for SolverPair {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for SolverPair {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// What a session is about.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Its solvers.
    pub solvers: SolverPair,
    /// Points of the toy continuum.
    pub points: usize,
    /// Steps between the opening and the closing one.
    pub steps: u64,
    /// Most steps granted at once.
    pub window: u64,
    /// Step whose window saves the state, if one does.
    pub checkpoint: Option<u64>,
    /// Measure and frame at each multiple of so many steps.
    pub outputs: u64,
    /// Step from which the points are stiffer.
    pub stiffens_at: u64,
    /// Step from which the wall damps.
    pub damps_at: u64,
}

/// Where a session can be taken up again.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Checkpoint {
    /// States of the continuum and of the bodies.
    states: [Vec<u8>; 2],
    clock: Option<Clock>,
    epoch: u64,
    budget: f64,
    damping: f64,
}

/// The outcome of a session.
#[derive(Debug)]
pub struct SessionOutcome {
    /// Verdicts of the coupler, the continuum and the bodies, and when; `None` of the dead and the frozen.
    pub verdicts: [Option<(Result<(), SessionError>, Time)>; 3],
    /// Points and bodies at the end, if it was reached.
    pub finals: Option<(Vec<PointState>, Vec<BodyState>)>,
    /// The last checkpoint.
    pub checkpoint: Option<Checkpoint>,
    /// Rules that were broken.
    pub violations: Vec<Violation>,
    /// Faults that have occurred, and when.
    pub struck: Vec<(Fault, Time)>,
    /// First steps that are not done, when the first fault struck: as the coupler, the continuum and the bodies count.
    pub steps: [u64; 3],
    /// Things done.
    pub events: u64,
}

/// The supervisor of a toy session.
struct ToySupervisor<'a> {
    plan: &'a Plan,
    configs: [String; 2],
    host: Rc<RefCell<SimulatedHost>>,
    clock: Clock,
    epoch: u64,
    dt: f64,
    budget: f64,
    damping: f64,
    pending: Option<Checkpoint>,
    checkpoint: Option<Checkpoint>,
    from: Option<Checkpoint>,
    finals: Option<(Vec<PointState>, Vec<BodyState>)>,
    /// A solver whose end has been seen once.
    seen: Option<Party>,
}

impl Supervisor for ToySupervisor<'_> {
    fn configure(&mut self, _: &Solvers) -> Result<Vec<Part>, Stop> {
        let part = |i: usize| Part {
            configure: Configure {
                scene_hash: "toy".into(),
                config: self.configs[i].clone(),
                coupled: true,
                deadline: DEADLINE,
                restore: false,
            },
            measured: self.plan.solvers.measured[i],
            restore: self.from.as_ref().map(|from| from.states[i].clone()),
        };
        Ok(vec![part(0), part(1)])
    }

    fn next(&mut self) -> Result<Option<Next>, Stop> {
        let at = self.clock.index();
        let (opening, closing) = (at == 0, at == self.plan.steps + 1);
        if at > self.plan.steps + 1 {
            return Ok(None);
        }
        if opening || closing {
            self.clock.begin_epoch(0.0);
            self.epoch += 1;
        } else if self.clock.dt() != self.dt {
            self.clock.begin_epoch(self.dt);
            self.epoch += 1;
        }
        let (epoch_start, steps_in_epoch, dt_before_epoch) = self.clock.epoch();
        let left = if opening || closing {
            1
        } else {
            // A window ends before a step that is asked for more than a report.
            let next_output = (at / self.plan.outputs + 1) * self.plan.outputs;
            let next_save = self.plan.checkpoint.filter(|&c| c > at).unwrap_or(u64::MAX);
            (self.plan.steps + 1).min(next_output).min(next_save) - at
        };
        let mut asked = 0;
        if opening || closing || at.is_multiple_of(self.plan.outputs) {
            asked |= flags::MEASURE | flags::FRAME;
        }
        if self.plan.checkpoint == Some(at) && self.from.is_none() {
            asked |= flags::CHECKPOINT;
            self.pending = Some(Checkpoint {
                states: Default::default(),
                clock: Some(self.clock),
                epoch: self.epoch,
                budget: self.budget,
                damping: self.damping,
            });
        }
        let grant = Grant {
            epoch: self.epoch,
            first: at,
            steps: self.plan.window.min(left),
            flags: asked,
            epoch_start,
            steps_in_epoch,
            dt_before_epoch,
            dt: self.clock.dt(),
            ..Grant::default()
        };
        let budget = if opening || closing {
            Budget::UNLIMITED
        } else {
            Budget {
                omega_sq: self.budget,
                speed: 100.0,
                damping: self.damping,
            }
        };
        Ok(Some((grant, vec![budget; 2])))
    }

    fn collected(&mut self, solvers: &mut Solvers) -> Result<(), Stop> {
        if let Some(mut pending) = self.pending.take() {
            for (state, party) in pending.states.iter_mut().zip([Party::Mpm, Party::Dem]) {
                match solvers.take_saved(party) {
                    Some(saved) => *state = saved,
                    None => self.violation(format!("no saved state of the {party}")),
                }
            }
            self.checkpoint = Some(pending);
        }
        let round = solvers.round();
        self.clock.advance_by(round.steps);
        let within = round.within;
        if self.clock.index() == self.plan.steps + 2 {
            self.finals = Some((Vec::new(), round.bodies.clone()));
        }
        if !within && self.clock.index() > 1 {
            let limits = |party| solvers.report(party).map(|r| r.limits).unwrap_or_default();
            let (mpm, dem) = (limits(Party::Mpm), limits(Party::Dem));
            self.budget = self.budget.max(2.0 * (mpm.omega_sq + mpm.contact_omega_sq));
            self.damping = self.damping.max(dem.damping);
            // Another step, so that the bits depend on where the halt was.
            self.dt *= 0.9;
        }
        Ok(())
    }

    fn drained(&mut self, solvers: &mut Solvers) -> Result<(), Stop> {
        if let Some((points, _)) = &mut self.finals {
            points.clone_from(&solvers.round().points);
        }
        Ok(())
    }

    fn gone(&mut self) -> Option<(Party, String)> {
        let host = self.host.borrow();
        let ended = |party: &Party| {
            let n = *party as usize;
            host.stopped[n] == Stopped::Dead || host.ended[n]
        };
        let gone = [Party::Mpm, Party::Dem].into_iter().find(ended)?;
        // Reported at the second look: what was sent before the end has been looked for in between.
        if self.seen == Some(gone) {
            return Some((gone, "has ended".into()));
        }
        self.seen = Some(gone);
        None
    }
}

impl ToySupervisor<'_> {
    fn violation(&self, what: String) {
        self.host.borrow_mut().violations.push(Violation(what));
    }
}

/// What a party is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Activity {
    /// It gets a turn then.
    Ready(Time),
    /// It waits since then, and looks again then.
    Waiting {
        wait: Wait,
        since: Time,
        until: Time,
    },
    /// Its session is over.
    Ended,
}

/// Runs a session of `plan` on `host`, from a checkpoint if one is given.
pub fn run(plan: &Plan, host: SimulatedHost, from: Option<&Checkpoint>) -> SessionOutcome {
    let host = Rc::new(RefCell::new(host));
    let (continuum, bodies) = (plan.solvers.build)(plan);
    let mut toy = ToySupervisor {
        plan,
        configs: (plan.solvers.configs)(),
        host: host.clone(),
        clock: from.and_then(|c| c.clock).unwrap_or(Clock::new(0.0)),
        epoch: from.map_or(0, |c| c.epoch),
        dt: from
            .and_then(|c| c.clock)
            .map_or(1e-3, |c| if c.dt() > 0.0 { c.dt() } else { 1e-3 }),
        budget: from.map_or(1e6, |c| c.budget),
        damping: from.map_or(0.0, |c| c.damping),
        pending: None,
        checkpoint: None,
        from: from.cloned(),
        finals: None,
        seen: None,
    };
    let [to_coupler, to_mpm, to_dem] = Party::ALL.map(|party| {
        let host = host.clone();
        Box::new(Ends { party, host })
    });
    let mut parties = [
        Session::coupler(&[Party::Mpm, Party::Dem], &mut toy, to_coupler),
        Session::solver(Host::Mpm(continuum), to_mpm, Clocked::Shared),
        Session::solver(Host::Dem(bodies), to_dem, Clocked::Shared),
    ];
    let mut schedule = Schedule::new(&host);
    schedule.run(&mut parties);
    let steps = schedule.steps;
    let mut ends = schedule.doing.into_iter().zip(schedule.ended);
    let verdicts = parties.map(|party| {
        let (doing, when) = ends.next()?;
        (doing == Activity::Ended).then(|| (party.into_verdict(), when))
    });
    let host = host.borrow();
    SessionOutcome {
        verdicts,
        finals: toy.finals.take(),
        checkpoint: toy.checkpoint.take(),
        violations: host.violations.clone(),
        struck: host.struck.clone(),
        steps,
        events: host.events.iter().sum(),
    }
}

/// Whose turn it is.
struct Schedule<'w> {
    host: &'w Rc<RefCell<SimulatedHost>>,
    doing: [Activity; 3],
    ended: [Time; 3],
    steps: [u64; 3],
    noted: bool,
}

impl<'w> Schedule<'w> {
    fn new(host: &'w Rc<RefCell<SimulatedHost>>) -> Self {
        let mut first = [0; 3];
        {
            let mut host = host.borrow_mut();
            for time in &mut first {
                *time = (host.random.unit() * 1e6) as Time;
            }
        }
        Self {
            host,
            doing: first.map(Activity::Ready),
            ended: [0; 3],
            steps: [0; 3],
            noted: false,
        }
    }

    fn run(&mut self, parties: &mut [Session<'_>; 3]) {
        loop {
            self.kill_remaining(matches!(parties[0].verdict(), Some(Err(_))));
            let Some((n, at)) = self.next() else {
                return;
            };
            if at > HANG {
                let who = Party::ALL[n];
                let doing = format!("the {who} hangs: {:?}", self.doing[n]);
                self.host.borrow_mut().violations.push(Violation(doing));
                return;
            }
            {
                let mut host = self.host.borrow_mut();
                host.now = host.now.max(at);
            }
            self.turn(n, &mut parties[n]);
            if !self.noted && !self.host.borrow().struck.is_empty() {
                self.noted = true;
                for (step, party) in self.steps.iter_mut().zip(&*parties) {
                    *step = party.step();
                }
            }
        }
    }

    /// The coupler ends its solvers when its session is over; the host does when the coupler is dead.
    fn kill_remaining(&mut self, failed: bool) {
        let mut host = self.host.borrow_mut();
        if self.doing[0] == Activity::Ended {
            let late = self.ended[0] + GRACE;
            // After a failure the lock is released at once: one that missed the Abort looks for it (S-7).
            host.coupler_gone |= failed || host.now > late;
            for n in [1, 2] {
                if self.doing[n] != Activity::Ended && host.stopped[n] != Stopped::Dead {
                    let frozen = host.stopped[n] == Stopped::Frozen
                        || matches!(host.stopped[n], Stopped::Until(t) if t > late);
                    if frozen {
                        host.stopped[n] = Stopped::Dead;
                    }
                }
            }
        }
    }

    /// Who is next, and when.
    fn next(&self) -> Option<(usize, Time)> {
        let host = self.host.borrow();
        let mut best: Option<(usize, Time)> = None;
        for n in 0..3 {
            let at = match self.doing[n] {
                Activity::Ready(at) => at,
                Activity::Waiting { until, wait, since } => {
                    let deadline = since.saturating_add(wait.at_most.as_nanos() as Time);
                    // A wake-up ends a nap; a message that comes while the party still spins needs none.
                    until.min(host.wake[n]).min(deadline.max(host.now))
                }
                Activity::Ended => continue,
            };
            let at = match host.stopped[n] {
                Stopped::No => at,
                Stopped::Until(thaw) => at.max(thaw),
                Stopped::Frozen | Stopped::Dead => continue,
            };
            if best.is_none_or(|(_, time)| at < time) {
                best = Some((n, at));
            }
        }
        best
    }

    fn turn(&mut self, n: usize, party: &mut Session<'_>) {
        let who = Party::ALL[n];
        let (now, waited) = {
            let mut host = self.host.borrow_mut();
            let waiting = matches!(self.doing[n], Activity::Waiting { .. });
            if let Stopped::Until(thaw) = host.stopped[n]
                && thaw <= host.now
            {
                host.stopped[n] = Stopped::No;
            }
            if !waiting {
                host.event(who, false);
                if host.stopped[n] != Stopped::No {
                    return;
                }
            }
            if host.wake[n] <= host.now {
                host.wake[n] = Time::MAX;
            }
            (host.now, waiting)
        };
        let turn = party.turn();
        let mut host = self.host.borrow_mut();
        let cost = 1 + (host.random.unit() * TURN) as Time;
        let soon = host.now + cost;
        self.doing[n] = match (turn, self.doing[n]) {
            (Turn::Ended, _) => {
                self.ended[n] = host.now;
                host.ended[n] = true;
                Activity::Ended
            }
            (Turn::Went, _) => Activity::Ready(soon),
            (
                Turn::Waits(wait),
                Activity::Waiting {
                    wait: before,
                    since,
                    until,
                },
            ) if wait == before => {
                let deadline = since + wait.at_most.as_nanos() as Time;
                drop(host);
                if now >= deadline {
                    party.expire(Duration::from_nanos(now - since));
                    self.doing[n] = Activity::Ready(soon);
                    return;
                }
                let up = waited && now >= until && party.look_up();
                self.doing[n] = if up {
                    Activity::Ready(soon)
                } else {
                    Activity::Waiting {
                        wait,
                        since,
                        until: if now >= until { now + NAP } else { until },
                    }
                };
                return;
            }
            (Turn::Waits(wait), _) => Activity::Waiting {
                wait,
                since: host.now,
                until: host.now + NAP,
            },
        };
    }
}
