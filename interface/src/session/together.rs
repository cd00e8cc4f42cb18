//! All parties of a session in one thread: they take turns, and messages are swapped ([`crate::transport::direct`]).

use std::time::{Duration, Instant};

use super::coupler::CouplerSide;
use super::solver::{DemSide, MpmSide, Perform, Side};
use super::turns::{Turn, Turns};
use crate::message::control::Party;
use crate::transport::Transport;

/// The parties of a session, each with its ends of the channels.
pub struct Together<'a, 'b> {
    /// The coupler.
    pub coupler: &'a mut CouplerSide<'b>,
    /// The continuum, if there is one.
    pub mpm: Option<&'a mut MpmSide<'b>>,
    /// The bodies, if there are any.
    pub dem: Option<&'a mut DemSide<'b>>,
    /// Ends of the coupler, the continuum and the bodies.
    pub transports: [&'a mut dyn Transport; 3],
}

impl Together<'_, '_> {
    /// Lets the parties take turns until all sessions are over.
    pub fn run(&mut self) {
        let mut watch = Watch::start();
        let (mut still, mut asked) = (0, true);
        loop {
            let [coupler, mpm, dem] = &mut self.transports;
            let mut round = Round::default();
            // While the solvers wait for one another, the coupler has nothing to do.
            if asked {
                watch.close(&mut self.mpm, &mut self.dem);
                let took = round.add(turns(&mut *self.coupler, &mut **coupler));
                watch.led(took.went);
            } else {
                watch.next(&mut self.mpm, &mut self.dem);
            }
            if let Some(side) = &mut self.mpm {
                round.add(turns(&mut **side, &mut **mpm));
                watch.divide(0, side);
            }
            if let Some(side) = &mut self.dem {
                round.add(turns(&mut **side, &mut **dem));
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
        let [coupler, mpm, dem] = &mut self.transports;
        let mut up = self.coupler.look_up(&mut **coupler);
        if let Some(side) = &mut self.mpm {
            up |= side.look_up(&mut **mpm);
        }
        if let Some(side) = &mut self.dem {
            up |= side.look_up(&mut **dem);
        }
        if expire && !up {
            // In one thread nothing can arrive any more, so a wait would never end.
            self.coupler.expire(Duration::ZERO);
            if let Some(side) = &mut self.mpm {
                side.expire(Duration::ZERO);
            }
            if let Some(side) = &mut self.dem {
                side.expire(Duration::ZERO);
            }
        }
    }
}

struct Took {
    went: bool,
    /// Not [`Turn::Went`].
    end: Turn,
}

/// Gives turns to a party until it has nothing to do.
fn turns(party: &mut impl Turns, transport: &mut dyn Transport) -> Took {
    let mut went = false;
    loop {
        match party.turn(transport) {
            Turn::Went => went = true,
            end => return Took { went, end },
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
    fn add(&mut self, took: Took) -> Took {
        self.went |= took.went;
        match took.end {
            Turn::Waits(wait) => {
                self.ended = false;
                self.asks |= wait.from == Party::Coupler;
            }
            Turn::Ended | Turn::Went => self.asks = true,
        }
        took
    }
}

/// Reading the clock twice takes a large part of a round that is shorter than this.
const SHORT: Duration = Duration::from_micros(2);
/// Number of short rounds that are timed together.
const TOGETHER: u32 = 15;

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
}

impl Watch {
    fn start() -> Self {
        Self {
            mark: Instant::now(),
            parts: [Duration::ZERO; 2],
            rounds: 0,
            divides: true,
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
    fn next(&mut self, mpm: &mut Option<&mut MpmSide>, dem: &mut Option<&mut DemSide>) {
        let [mpm_part, dem_part] = self.parts;
        self.divides = self.rounds == TOGETHER || mpm_part + dem_part >= SHORT;
        if self.divides {
            self.close(mpm, dem);
        } else {
            self.rounds += 1;
        }
    }

    /// A solver has had its turns.
    fn divide<P: Perform>(&mut self, which: usize, side: &mut Side<P>) {
        if self.divides {
            let part = self.lap();
            self.parts[which] = part;
            side.book(part);
        }
    }

    /// Adds the time of the rounds that are not divided.
    fn close(&mut self, mpm: &mut Option<&mut MpmSide>, dem: &mut Option<&mut DemSide>) {
        if core::mem::take(&mut self.rounds) == 0 {
            return;
        }
        let (all, [first, second]) = (self.lap(), self.parts.map(|part| part.as_secs_f64()));
        let of_mpm = all.mul_f64(first / (first + second).max(f64::MIN_POSITIVE));
        if let Some(side) = mpm {
            side.book(of_mpm);
        }
        if let Some(side) = dem {
            side.book(all.saturating_sub(of_mpm));
        }
    }

    fn lap(&mut self) -> Duration {
        let now = Instant::now();
        let lap = now.duration_since(self.mark);
        self.mark = now;
        lap
    }
}
