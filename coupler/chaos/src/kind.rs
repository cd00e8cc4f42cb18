//! What can happen to a run, and when.

use std::time::Duration;

use rustix::process::Signal;

use crate::random::Random;

/// A process of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// The one that was started.
    Coupler,
    /// The continuum's.
    Mpm,
    /// The bodies'.
    Dem,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Coupler, Self::Mpm, Self::Dem];

    /// As the program names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Coupler => "coupler",
            Self::Mpm => "mpm",
            Self::Dem => "dem",
        }
    }
}

/// What happens to a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Nothing: it starts while others start and sweep.
    Start,
    /// One solver is killed.
    KillSolver,
    /// The coupler is killed.
    KillCoupler,
    /// Several processes are killed, one right after the other.
    KillSeveral,
    /// One process is stopped for a while.
    FreezeOne,
    /// Several are.
    FreezeSeveral,
    /// A solver is stopped and then killed.
    FreezeKill,
    /// A solver is stopped, and the run interrupted.
    FreezeInterrupt,
    /// The run is asked to end.
    Interrupt,
    /// The run is asked for checkpoints.
    Save,
    /// Nobody reads standard error.
    Unread,
    /// No file may be longer than that.
    Files,
    /// Somebody removes the run's files from shared memory.
    Unlink,
    /// The disk has little room.
    Disk,
    /// Shared memory has little room.
    Memory,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 15] = [
        Self::Start,
        Self::KillSolver,
        Self::KillCoupler,
        Self::KillSeveral,
        Self::FreezeOne,
        Self::FreezeSeveral,
        Self::FreezeKill,
        Self::FreezeInterrupt,
        Self::Interrupt,
        Self::Save,
        Self::Unread,
        Self::Files,
        Self::Unlink,
        Self::Disk,
        Self::Memory,
    ];

    /// Its name on the command line and in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::KillSolver => "kill-solver",
            Self::KillCoupler => "kill-coupler",
            Self::KillSeveral => "kill-several",
            Self::FreezeOne => "freeze-one",
            Self::FreezeSeveral => "freeze-several",
            Self::FreezeKill => "freeze-kill",
            Self::FreezeInterrupt => "freeze-interrupt",
            Self::Interrupt => "interrupt",
            Self::Save => "save",
            Self::Unread => "unread",
            Self::Files => "files",
            Self::Unlink => "unlink",
            Self::Disk => "disk",
            Self::Memory => "memory",
        }
    }

    /// The kind of this name.
    ///
    /// # Errors
    /// The names that there are.
    pub fn parse(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("expected one of {names}")
        })
    }

    /// Whether it needs a mount namespace of its own.
    pub fn needs_mounts(self) -> bool {
        matches!(self, Self::Disk | Self::Memory)
    }
}

/// A signal to a process at a moment after the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Act {
    /// When.
    pub at: Duration,
    /// To whom.
    pub to: Target,
    /// What.
    pub signal: Signal,
}

/// How little room there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Room {
    /// As much as there is.
    #[default]
    Enough,
    /// KiB of a file.
    File(u64),
    /// KiB of the disk of the run directory.
    Disk(u64),
    /// KiB of shared memory.
    Memory(u64),
}

/// What happens in a round, as chosen.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plan {
    /// Signals, by time.
    pub acts: Vec<Act>,
    /// How little room there is.
    pub room: Room,
    /// When the run's files in shared memory are removed.
    pub unlink: Option<Duration>,
    /// Nobody reads standard error.
    pub unread: bool,
    /// Others sweep meanwhile.
    pub sweeps: bool,
}

/// A moment of a run that takes `takes`: a third of them are in its beginning.
fn moment(random: &mut Random, takes: Duration) -> Duration {
    let share = if random.once_in(3) { 0.15 } else { 1.05 };
    takes.mul_f64(share * random.share())
}

/// Some of the processes, in some order, at least two.
fn several(random: &mut Random) -> Vec<Target> {
    let mut all = Target::ALL.to_vec();
    for k in (1..all.len()).rev() {
        all.swap(k, random.below(k as u64 + 1) as usize);
    }
    all.truncate(2 + random.below(2) as usize);
    all
}

impl Plan {
    /// What happens to a run that takes `takes` when it is left alone.
    pub fn choose(kind: Kind, random: &mut Random, takes: Duration) -> Self {
        let at = moment(random, takes);
        let act = |at, to, signal| Act { at, to, signal };
        let solver = random.pick(&[Target::Mpm, Target::Dem]);
        let while_stopped = Duration::from_millis(1 + random.below(300));
        let mut room = Room::Enough;
        let acts = match kind {
            Kind::Start | Kind::Unread | Kind::Unlink => Vec::new(),
            Kind::KillSolver => vec![act(at, solver, Signal::KILL)],
            Kind::KillCoupler => vec![act(at, Target::Coupler, Signal::KILL)],
            Kind::KillSeveral => several(random)
                .into_iter()
                .map(|to| act(at, to, Signal::KILL))
                .collect(),
            Kind::FreezeOne => {
                let to = random.pick(&Target::ALL);
                vec![
                    act(at, to, Signal::STOP),
                    act(at + while_stopped, to, Signal::CONT),
                ]
            }
            Kind::FreezeSeveral => {
                let who = several(random);
                let stops = who.iter().map(|&to| act(at, to, Signal::STOP));
                let goes = who
                    .iter()
                    .map(|&to| act(at + while_stopped, to, Signal::CONT));
                stops.chain(goes).collect()
            }
            Kind::FreezeKill => vec![
                act(at, solver, Signal::STOP),
                act(at + while_stopped, solver, Signal::KILL),
            ],
            Kind::FreezeInterrupt => vec![
                act(at, solver, Signal::STOP),
                act(
                    at + while_stopped,
                    Target::Coupler,
                    random.pick(&[Signal::INT, Signal::TERM]),
                ),
            ],
            Kind::Interrupt => {
                let signal = random.pick(&[Signal::INT, Signal::TERM, Signal::HUP, Signal::XCPU]);
                vec![act(at, Target::Coupler, signal)]
            }
            Kind::Save => {
                let mut moments: Vec<_> = (0..=random.below(4))
                    .map(|_| moment(random, takes))
                    .collect();
                moments.sort();
                let save = |at| act(at, Target::Coupler, Signal::USR1);
                moments.into_iter().map(save).collect()
            }
            Kind::Files => {
                room = Room::File(1 + random.below(200));
                Vec::new()
            }
            Kind::Disk => {
                room = Room::Disk(4 * (1 + random.below(100)));
                Vec::new()
            }
            Kind::Memory => {
                room = Room::Memory(64 * (1 + random.below(64)));
                Vec::new()
            }
        };
        Self {
            acts,
            room,
            unlink: (kind == Kind::Unlink).then_some(at),
            unread: kind == Kind::Unread,
            sweeps: random.once_in(2),
        }
    }

    /// In words, for who reads of a failure.
    pub fn words(&self) -> String {
        let mut words: Vec<String> = self
            .acts
            .iter()
            .map(|act| format!("{:?} to {} after {:.1?}", act.signal, act.to.name(), act.at))
            .collect();
        let unlink = |at| format!("files in shared memory removed after {at:.1?}");
        words.extend(self.unlink.map(unlink));
        match self.room {
            Room::Enough => {}
            Room::File(kib) => words.push(format!("files of at most {kib} KiB")),
            Room::Disk(kib) => words.push(format!("a disk of {kib} KiB")),
            Room::Memory(kib) => words.push(format!("shared memory of {kib} KiB")),
        }
        words.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for kind in Kind::ALL {
            assert_eq!(Kind::parse(kind.name()), Ok(kind));
        }
        assert!(
            Kind::parse("earthquake")
                .unwrap_err()
                .contains("kill-several")
        );
    }

    #[test]
    fn a_stopped_process_continues_or_is_ended() {
        for number in 0..2000 {
            for kind in Kind::ALL {
                let mut random = Random::new(3, number);
                let plan = Plan::choose(kind, &mut random, Duration::from_millis(200));
                for (k, act) in plan.acts.iter().enumerate() {
                    let later = &plan.acts[k + 1..];
                    let ends = later
                        .iter()
                        .any(|a| a.at > act.at && (a.to == act.to || a.to == Target::Coupler));
                    assert!(act.signal != Signal::STOP || ends, "{kind:?}: {plan:?}");
                }
                assert!(plan.acts.is_sorted_by_key(|act| act.at));
            }
        }
    }
}
