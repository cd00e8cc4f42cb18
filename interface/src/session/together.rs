//! All parties of a session in one thread: they take turns, and messages change hands ([`crate::transport::direct`]).

use std::time::{Duration, Instant};

use super::coupler::CouplerSide;
use super::solver::{DemSide, MpmSide};
use super::turns::{Turn, Turns};
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
        let mut mark = Instant::now();
        let mut still = 0;
        loop {
            let [coupler, mpm, dem] = &mut self.transports;
            let turn = turns(&mut *self.coupler, &mut **coupler);
            let mut went = turn.went;
            let mut ended = turn.ended;
            if went {
                lap(&mut mark);
            }
            if let Some(side) = &mut self.mpm {
                let took = turns(&mut **side, &mut **mpm);
                went |= took.went;
                ended &= took.ended;
                side.book(lap(&mut mark));
            }
            if let Some(side) = &mut self.dem {
                let took = turns(&mut **side, &mut **dem);
                went |= took.went;
                ended &= took.ended;
                side.book(lap(&mut mark));
            }
            if ended {
                return;
            }
            // Nobody has anything to do: what nobody waits for, then the end of the waits.
            still = if went { 0 } else { still + 1 };
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
            // In one thread nothing can still come: whoever waits would wait for ever.
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
    ended: bool,
}

/// Turns until there is nothing to do.
fn turns(party: &mut dyn Turns, transport: &mut dyn Transport) -> Took {
    let mut went = false;
    loop {
        match party.turn(transport) {
            Turn::Went => went = true,
            Turn::Waits(_) => return Took { went, ended: false },
            Turn::Ended => return Took { went, ended: true },
        }
    }
}

fn lap(mark: &mut Instant) -> Duration {
    let now = Instant::now();
    let lap = now.duration_since(*mark);
    *mark = now;
    lap
}
