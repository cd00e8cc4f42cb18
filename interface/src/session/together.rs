//! All parties of a session in one thread: they take turns, and messages are swapped ([`crate::transport::direct`]).

use std::time::{Duration, Instant};

use super::{Clocked, Session, SessionError, Supervisor, Turn, cpu_time};
use crate::hosted::Host;
use crate::message::control::Party;
use crate::transport::direct::Direct;

/// The parties of a session.
pub struct Together<'a> {
    /// The coupler.
    pub coupler: Session<'a>,
    /// The continuum, if there is one.
    pub mpm: Option<Session<'a>>,
    /// The bodies, if there are any.
    pub dem: Option<Session<'a>>,
}

impl<'a> Together<'a> {
    /// The coupler, in which `supervisor` decides, and these solvers.
    pub fn of(supervisor: &'a mut dyn Supervisor, solvers: impl IntoIterator<Item = Host>) -> Self {
        let hub = Direct::new();
        let ends = || Box::new(hub.clone());
        let (mut parties, mut mpm, mut dem) = (Vec::new(), None, None);
        for host in solvers {
            let party = host.party();
            let side = if party == Party::Mpm {
                &mut mpm
            } else {
                &mut dem
            };
            *side = Some(Session::solver(host, ends(), Clocked::Shared));
            parties.push(party);
        }
        Self {
            coupler: Session::coupler(&parties, supervisor, ends()),
            mpm,
            dem,
        }
    }

    /// Lets the parties take turns until all sessions are over. Returns how that of the coupler ended, and those of the
    /// continuum and the bodies.
    pub fn run(mut self) -> [Result<(), SessionError>; 3] {
        self.parties()
            .for_each(|party| party.io.stepwise.set(false));
        self.take_turns();
        let verdict = |side: Option<Session<'_>>| side.map_or(Ok(()), Session::into_verdict);
        [
            self.coupler.into_verdict(),
            verdict(self.mpm),
            verdict(self.dem),
        ]
    }

    fn parties(&mut self) -> impl Iterator<Item = &mut Session<'a>> {
        std::iter::once(&mut self.coupler)
            .chain(&mut self.mpm)
            .chain(&mut self.dem)
    }

    fn take_turns(&mut self) {
        let mut watch = Watch::start();
        let (mut still, mut asked) = (0, true);
        loop {
            let mut round = Round::default();
            // While the solvers wait for one another, the coupler has nothing to do.
            if asked {
                watch.close([self.mpm.as_ref(), self.dem.as_ref()]);
                watch.led(round.add(&mut self.coupler));
            } else {
                watch.next([self.mpm.as_ref(), self.dem.as_ref()]);
            }
            if let Some(side) = &mut self.mpm {
                round.add(side);
                watch.divide(0, side);
            }
            if let Some(side) = &mut self.dem {
                round.add(side);
                watch.divide(1, side);
            }
            if asked && round.ended {
                return;
            }
            // If no party has anything to do, look for messages that no party waits for, and then end the waits.
            still = if round.went || !asked { 0 } else { still + 1 };
            asked = round.asks || !round.went;
            if still > 0 {
                self.look_up(still > 1);
            }
        }
    }

    fn look_up(&mut self, expire: bool) {
        let mut up = false;
        for party in self.parties() {
            up |= party.look_up();
        }
        if expire && !up {
            // In one thread nothing can arrive any more, so a wait would never end.
            self.parties()
                .for_each(|party| party.expire(Duration::ZERO));
        }
    }
}

/// The result of a round of turns.
struct Round {
    went: bool,
    ended: bool,
    /// A party waits for the coupler, or has ended.
    asks: bool,
}

impl Default for Round {
    fn default() -> Self {
        Self {
            went: false,
            ended: true,
            asks: false,
        }
    }
}

impl Round {
    /// A party's turn; returns whether it did anything.
    fn add(&mut self, party: &mut Session<'_>) -> bool {
        let before = party.io.messages.get();
        match party.turn() {
            Turn::Waits(wait) => {
                self.ended = false;
                self.asks |= wait.from == Party::Coupler;
            }
            Turn::Ended | Turn::Went => self.asks = true,
        }
        let went = party.io.messages.get() != before;
        self.went |= went;
        went
    }
}

/// Reading the clock twice takes a large part of a round that is shorter than this.
const SHORT: Duration = Duration::from_micros(2);
/// Number of short rounds that are timed together.
const TOGETHER: u32 = 15;

/// The thread's CPU time is read this often: reading it takes longer than a short round.
const CPU_EVERY: Duration = Duration::from_millis(4);

/// Divides the time of a round between the solvers. Short rounds that follow one another are timed together, and their
/// time is divided in the proportion of the last round that was timed by itself.
struct Watch {
    /// Time up to which everything has been divided.
    mark: Instant,
    /// The parts of the continuum and of the bodies in the last round that was timed by itself.
    parts: [Duration; 2],
    /// Number of rounds since `mark` that have not been divided.
    rounds: u32,
    /// Whether the present round is timed by itself.
    divides: bool,
    /// When the thread's CPU time was read last, and what it was.
    cpu_read: (Instant, Duration),
    /// The time of the continuum and of the bodies since then.
    since: [Duration; 2],
}

impl Watch {
    fn start() -> Self {
        let now = Instant::now();
        Self {
            mark: now,
            parts: [Duration::ZERO; 2],
            rounds: 0,
            divides: true,
            cpu_read: (now, cpu_time()),
            since: [Duration::ZERO; 2],
        }
    }

    /// The coupler has had its turns. If it did anything, its time counts for no solver. The next round is timed by
    /// itself, since a solver may do more in it than in others.
    fn led(&mut self, went: bool) {
        if went {
            self.lap();
        }
        self.divides = true;
    }

    /// The next round begins.
    fn next(&mut self, sides: [Option<&Session<'_>>; 2]) {
        let [mpm_part, dem_part] = self.parts;
        self.divides = self.rounds == TOGETHER || mpm_part + dem_part >= SHORT;
        if self.divides {
            self.close(sides);
        } else {
            self.rounds += 1;
        }
    }

    /// A solver has had its turns.
    fn divide(&mut self, which: usize, side: &Session<'_>) {
        if self.divides {
            let part = self.lap();
            self.parts[which] = part;
            self.book(which, side, part);
        }
    }

    fn book(&mut self, which: usize, side: &Session<'_>, part: Duration) {
        self.since[which] += part;
        side.io.watch().book(part);
    }

    /// Adds the time of the rounds that are not divided. Takes off what the thread did not run in.
    fn close(&mut self, sides: [Option<&Session<'_>>; 2]) {
        self.add_rounds(sides);
        let wall = self.mark.duration_since(self.cpu_read.0);
        if wall < CPU_EVERY {
            return;
        }
        let cpu = cpu_time();
        let ran = cpu.saturating_sub(self.cpu_read.1);
        let idle = wall.saturating_sub(ran).as_secs_f64() / wall.as_secs_f64();
        for (side, time) in sides.into_iter().zip(std::mem::take(&mut self.since)) {
            if let Some(side) = side {
                side.io.watch().idle(time.mul_f64(idle));
            }
        }
        self.cpu_read = (self.mark, cpu);
    }

    fn add_rounds(&mut self, sides: [Option<&Session<'_>>; 2]) {
        if core::mem::take(&mut self.rounds) == 0 {
            return;
        }
        let (all, [first, second]) = (self.lap(), self.parts.map(|part| part.as_secs_f64()));
        let of_mpm = all.mul_f64(first / (first + second).max(f64::MIN_POSITIVE));
        let parts = [of_mpm, all.saturating_sub(of_mpm)];
        for (which, (side, part)) in sides.into_iter().zip(parts).enumerate() {
            if let Some(side) = side {
                self.book(which, side, part);
            }
        }
    }

    fn lap(&mut self) -> Duration {
        let now = Instant::now();
        let lap = now.duration_since(self.mark);
        self.mark = now;
        lap
    }
}
