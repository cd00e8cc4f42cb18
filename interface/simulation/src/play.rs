//! Plays one session: decides whose turn it is, and keeps what each party says at its end.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use interface::core::SessionError;
use interface::core::Wait;
use interface::core::coupler::{Coupler, Decision, Part, Question};
use interface::message::control::{Configure, Party};
use interface::message::wire::{BodyState, Grant, PointState, flags};
use interface::session::solver::Clocked;
use interface::session::turns::{Turn, Turns};
use interface::session::{CouplerSide, DemSide, MpmSide, Stop, Supervisor};
use interface::solver::{DemSolver, MpmSolver};
use interface::step::Clock;

use crate::fault::Fault;
use crate::fault::{SECOND, Time};
use crate::world::{Breach, Ends, Stopped, World, number};

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
pub struct Cast {
    /// Their name.
    pub name: &'static str,
    /// Configurations of the continuum and of the bodies, as they are sent.
    pub configs: fn() -> [String; 2],
    /// Groups and bodies of a measurement.
    pub measured: [usize; 2],
    /// The solvers for a plan.
    pub solvers: fn(&Plan) -> Pair,
}

impl std::fmt::Debug for Cast {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Cast {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// What a session is about.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Between whom.
    pub cast: Cast,
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

/// What a session came to.
#[derive(Debug)]
pub struct Played {
    /// Verdicts of the coupler, the continuum and the bodies, and when; `None` of the dead and the frozen.
    pub verdicts: [Option<(Result<(), SessionError>, Time)>; 3],
    /// Points and bodies at the end, if it was reached.
    pub finals: Option<(Vec<PointState>, Vec<BodyState>)>,
    /// The last checkpoint.
    pub checkpoint: Option<Checkpoint>,
    /// What has happened that must not.
    pub breaches: Vec<Breach>,
    /// Faults that have struck, and when.
    pub struck: Vec<(Fault, Time)>,
    /// First steps that are not done, when the first fault struck: of the coupler's books, the continuum, the bodies.
    pub steps: [u64; 3],
    /// Things done.
    pub events: u64,
}

/// Leads a toy session.
struct Toy<'a> {
    plan: &'a Plan,
    configs: [String; 2],
    world: Rc<RefCell<World>>,
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

impl Toy<'_> {
    fn configure(&mut self) -> Decision {
        let part = |i: usize| Part {
            configure: Configure {
                scene_hash: "toy".into(),
                config: self.configs[i].clone(),
                coupled: true,
                deadline: DEADLINE,
                restore: false,
                other_polls: false,
            },
            measured: self.plan.cast.measured[i],
            restore: self.from.as_ref().map(|from| from.states[i].clone()),
        };
        Decision::Configure(vec![part(0), part(1)])
    }

    fn next(&mut self) -> Decision {
        let at = self.clock.index();
        let (opening, closing) = (at == 0, at == self.plan.steps + 1);
        if at > self.plan.steps + 1 {
            return Decision::Drain;
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
            [f64::MAX; 3]
        } else {
            [self.budget, 100.0, self.damping]
        };
        Decision::Grant(grant, vec![budget; 2])
    }

    fn collected(&mut self, coupler: &mut Coupler) {
        if let Some(mut pending) = self.pending.take() {
            for (state, party) in pending.states.iter_mut().zip([Party::Mpm, Party::Dem]) {
                match coupler.take_saved(party) {
                    Some(saved) => *state = saved,
                    None => self.breach(format!("no saved state of the {party}")),
                }
            }
            self.checkpoint = Some(pending);
        }
        let round = coupler.round();
        self.clock.advance_by(round.steps);
        let within = round.within;
        if self.clock.index() == self.plan.steps + 2 {
            self.finals = Some((Vec::new(), round.bodies.clone()));
        }
        if !within && self.clock.index() > 1 {
            let limits = |party| coupler.report(party).map(|r| r.limits).unwrap_or_default();
            let (mpm, dem) = (limits(Party::Mpm), limits(Party::Dem));
            self.budget = self.budget.max(2.0 * (mpm.omega_sq + mpm.contact_omega_sq));
            self.damping = self.damping.max(dem.damping);
            // Another step, so that the bits depend on where the halt was.
            self.dt *= 0.9;
        }
    }

    fn breach(&self, what: String) {
        self.world.borrow_mut().breaches.push(Breach(what));
    }
}

impl Supervisor for Toy<'_> {
    fn decide(&mut self, question: Question, coupler: &mut Coupler) -> Result<Decision, Stop> {
        Ok(match question {
            Question::Configure => self.configure(),
            Question::Ready => Decision::Noted,
            Question::Next => self.next(),
            Question::Collected => {
                self.collected(coupler);
                Decision::Noted
            }
            Question::Drained => {
                if let Some((points, _)) = &mut self.finals {
                    points.clone_from(&coupler.round().points);
                }
                Decision::Noted
            }
        })
    }

    fn gone(&mut self) -> Option<(Party, String)> {
        let world = self.world.borrow();
        let ended = |party: &Party| {
            let n = number(*party);
            world.stopped[n] == Stopped::Dead || world.ended[n]
        };
        let gone = [Party::Mpm, Party::Dem].into_iter().find(ended)?;
        // Told at the second look: what was said before the end has been looked for in between.
        if self.seen == Some(gone) {
            return Some((gone, "has ended".into()));
        }
        self.seen = Some(gone);
        None
    }
}

/// What a party of the play is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Doing {
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

/// Plays a session of `plan` on `world`, from a checkpoint if one is given.
pub fn play(plan: &Plan, world: World, from: Option<&Checkpoint>) -> Played {
    let world = Rc::new(RefCell::new(world));
    let (mut continuum, mut bodies) = (plan.cast.solvers)(plan);
    let mut toy = Toy {
        plan,
        configs: (plan.cast.configs)(),
        world: world.clone(),
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
    let mut leader = CouplerSide::new(&[Party::Mpm, Party::Dem], &mut toy);
    let mut mpm = MpmSide::new(&mut *continuum, Clocked::Shared);
    let mut dem = DemSide::new(&mut *bodies, Clocked::Shared);
    let mut stage = Schedule::new(&world);
    stage.run(&mut leader, &mut mpm, &mut dem);
    let (doing, ended, steps) = (stage.doing, stage.ended, stage.steps);
    let over = [0, 1, 2].map(|n| doing[n] == Doing::Ended);
    let verdicts = [
        over[0].then(|| (leader.take_verdict(), ended[0])),
        over[1].then(|| (mpm.take_verdict(), ended[1])),
        over[2].then(|| (dem.take_verdict(), ended[2])),
    ];
    drop(leader);
    let world = world.borrow();
    Played {
        verdicts,
        finals: toy.finals.take(),
        checkpoint: toy.checkpoint.take(),
        breaches: world.breaches.clone(),
        struck: world.struck.clone(),
        steps,
        events: world.events.iter().sum(),
    }
}

/// Whose turn it is.
struct Schedule<'w> {
    world: &'w Rc<RefCell<World>>,
    doing: [Doing; 3],
    ended: [Time; 3],
    steps: [u64; 3],
    noted: bool,
}

impl<'w> Schedule<'w> {
    fn new(world: &'w Rc<RefCell<World>>) -> Self {
        let mut first = [0; 3];
        {
            let mut world = world.borrow_mut();
            for time in &mut first {
                *time = (world.random.unit() * 1e6) as Time;
            }
        }
        Self {
            world,
            doing: first.map(Doing::Ready),
            ended: [0; 3],
            steps: [0; 3],
            noted: false,
        }
    }

    fn run(&mut self, leader: &mut CouplerSide<'_>, mpm: &mut MpmSide<'_>, dem: &mut DemSide<'_>) {
        loop {
            self.kill_what_stays(matches!(leader.coupler().verdict(), Some(Err(_))));
            let Some((n, at)) = self.next() else {
                return;
            };
            if at > HANG {
                let who = Party::ALL[n];
                let doing = format!("the {who} hangs: {:?}", self.doing[n]);
                self.world.borrow_mut().breaches.push(Breach(doing));
                return;
            }
            {
                let mut world = self.world.borrow_mut();
                world.now = world.now.max(at);
            }
            match n {
                0 => self.turn(n, leader),
                1 => self.turn(n, mpm),
                _ => self.turn(n, dem),
            }
            if !self.noted && !self.world.borrow().struck.is_empty() {
                self.noted = true;
                let told = |party| leader.coupler().step_of(party);
                let told = told(Party::Mpm).min(told(Party::Dem));
                self.steps = [told, mpm.step(), dem.step()];
            }
        }
    }

    /// The coupler sees its solvers off when its session is over; so does the world when the coupler is dead.
    fn kill_what_stays(&mut self, failed: bool) {
        let mut world = self.world.borrow_mut();
        if self.doing[0] == Doing::Ended {
            let late = self.ended[0] + GRACE;
            // After a failure the lock is released at once: one that missed the Abort looks for it (S-7).
            world.coupler_gone |= failed || world.now > late;
            for n in [1, 2] {
                if self.doing[n] != Doing::Ended && world.stopped[n] != Stopped::Dead {
                    let frozen = world.stopped[n] == Stopped::Frozen
                        || matches!(world.stopped[n], Stopped::Until(t) if t > late);
                    if frozen {
                        world.stopped[n] = Stopped::Dead;
                    }
                }
            }
        }
    }

    /// Who is next, and when.
    fn next(&self) -> Option<(usize, Time)> {
        let world = self.world.borrow();
        let mut best: Option<(usize, Time)> = None;
        for n in 0..3 {
            let at = match self.doing[n] {
                Doing::Ready(at) => at,
                Doing::Waiting { until, wait, since } => {
                    let deadline = since.saturating_add(wait.at_most.as_nanos() as Time);
                    // A bell wakes; so does a message that comes while the party still polls, before its first nap.
                    until.min(world.wake[n]).min(deadline.max(world.now))
                }
                Doing::Ended => continue,
            };
            let at = match world.stopped[n] {
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

    fn turn(&mut self, n: usize, party: &mut dyn Turns) {
        let who = Party::ALL[n];
        let mut ends = Ends {
            party: who,
            world: self.world.clone(),
        };
        let (now, waited) = {
            let mut world = self.world.borrow_mut();
            let waiting = matches!(self.doing[n], Doing::Waiting { .. });
            if let Stopped::Until(thaw) = world.stopped[n]
                && thaw <= world.now
            {
                world.stopped[n] = Stopped::No;
            }
            if !waiting {
                world.event(who, false);
                if world.stopped[n] != Stopped::No {
                    return;
                }
            }
            if world.wake[n] <= world.now {
                world.wake[n] = Time::MAX;
            }
            (world.now, waiting)
        };
        let turn = party.turn(&mut ends);
        let mut world = self.world.borrow_mut();
        let cost = 1 + (world.random.unit() * TURN) as Time;
        let soon = world.now + cost;
        self.doing[n] = match (turn, self.doing[n]) {
            (Turn::Ended, _) => {
                self.ended[n] = world.now;
                world.ended[n] = true;
                Doing::Ended
            }
            (Turn::Went, _) => Doing::Ready(soon),
            (
                Turn::Waits(wait),
                Doing::Waiting {
                    wait: before,
                    since,
                    until,
                },
            ) if wait == before => {
                let deadline = since + wait.at_most.as_nanos() as Time;
                drop(world);
                if now >= deadline {
                    party.expire(Duration::from_nanos(now - since));
                    self.doing[n] = Doing::Ready(soon);
                    return;
                }
                let up = waited && now >= until && party.look_up(&mut ends);
                self.doing[n] = if up {
                    Doing::Ready(soon)
                } else {
                    Doing::Waiting {
                        wait,
                        since,
                        until: if now >= until { now + NAP } else { until },
                    }
                };
                return;
            }
            (Turn::Waits(wait), _) => Doing::Waiting {
                wait,
                since: world.now,
                until: world.now + NAP,
            },
        };
    }
}
