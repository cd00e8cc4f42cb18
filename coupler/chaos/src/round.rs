//! One round: a run, what happens to it, what follows, and what is wrong with that.

use std::collections::BTreeSet;
use std::fmt::{self, Display};
use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use rustix::process::Signal;

use crate::command::{Ended, Program};
use crate::error::{ChaosError, file};
use crate::kind::{Kind, Plan, Room, Target};
use crate::options::Options;
use crate::random::Random;
use crate::result::RunResult;

/// A run is gone on with so often; what happens to it after the first time does so at most [`AGAIN`] times.
const PARTS: u32 = 8;
const AGAIN: u32 = 2;
/// An interrupted run ends within this time, whoever is stopped.
const PROMPTLY: Duration = Duration::from_secs(8);
/// Other ways to go on, which must not change a bit.
const WAYS: [&[&str]; 5] = [
    &[],
    &[],
    &["--threads", "2"],
    &["--window", "7"],
    &["--in-process"],
];
/// One of these is in what a run that had no room says.
const NO_ROOM: [&str; 5] = [
    "File too large",
    "No space left",
    "shared memory",
    "limits the size",
    "disk is full",
];

/// What can be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wrong {
    /// It does not end by itself.
    Hang,
    /// Something is left after the next start.
    Leftover,
    /// The cause is not reported, reported late, or wrong.
    Culprit,
    /// The result differs from that of an undisturbed run.
    Bits,
    /// It ends in another way than it may.
    End,
}

/// What is wrong with a round.
#[derive(Debug, Clone)]
pub struct Failure {
    /// What.
    pub wrong: Wrong,
    /// In words.
    pub words: String,
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wrong = match self.wrong {
            Wrong::Hang => "hang",
            Wrong::Leftover => "leftover",
            Wrong::Culprit => "wrong culprit",
            Wrong::Bits => "different bits",
            Wrong::End => "wrong end",
        };
        write!(f, "{wrong}: {}", self.words)
    }
}

/// What a round has come to.
#[derive(Debug, Clone, Default)]
pub struct Verdict {
    /// It could not be played on this machine.
    pub skipped: bool,
    /// Nothing could stop it.
    pub went_through: bool,
    /// It was resumed so often.
    pub resumed: u32,
    /// It was begun anew so often, since there was no checkpoint yet.
    pub anew: u32,
    /// What is wrong.
    pub failures: Vec<Failure>,
}

/// One round.
#[derive(Debug)]
pub struct Round {
    /// Its number.
    pub number: u64,
    /// What happens.
    pub kind: Kind,
    /// How and when.
    pub plan: Plan,
    random: Random,
    takes: Duration,
    dir: PathBuf,
}

impl Round {
    /// The round of this number. Its kind depends on the number, the rest on number and seed.
    pub fn new(number: u64, options: &Options, takes: Duration) -> Self {
        let kind = options.kinds[(number % options.kinds.len() as u64) as usize];
        let mut random = Random::new(options.seed, number);
        let plan = Plan::choose(kind, &mut random, takes);
        Self {
            number,
            kind,
            plan,
            random,
            takes,
            dir: options.out.join(format!("round-{number:06}")),
        }
    }

    /// Plays it. The directory of a round without failure is removed.
    pub fn run(&self, program: &Program<'_>, undisturbed: &RunResult) -> Verdict {
        let mut verdict = Verdict::default();
        if let Err(error) = self.go(program, undisturbed, &mut verdict) {
            verdict.fail(Wrong::End, error.to_string());
        }
        if verdict.failures.is_empty() {
            self.remove();
        }
        verdict
    }

    fn remove(&self) {
        for dir in [&self.dir, &self.kept()] {
            let _ = fs::remove_dir_all(dir);
        }
        let _ = fs::remove_file(self.dir.with_extension("err"));
    }

    /// Where what was on a small disk is kept.
    fn kept(&self) -> PathBuf {
        let mut name = self.dir.clone().into_os_string();
        name.push(".kept");
        name.into()
    }

    fn go(
        &self,
        program: &Program<'_>,
        undisturbed: &RunResult,
        verdict: &mut Verdict,
    ) -> Result<(), ChaosError> {
        self.remove();
        let mut random = self.random.clone();
        let mut couplers = BTreeSet::new();
        let first = program.start(program.run(&self.dir), &self.dir, Some(&self.plan), &[])?;
        let mut ended = first.wait();
        if ended.had_no_mount() {
            verdict.skipped = true;
            return Ok(());
        }
        if matches!(self.plan.room, Room::Disk(_)) {
            let _ = fs::remove_dir_all(&self.dir);
            fs::rename(self.kept(), &self.dir).map_err(file("take", &self.dir))?;
        }
        couplers.insert(ended.pid);
        verdict.went_through = ended.code == undisturbed.code;
        verdict.judge(&ended, &self.plan, undisturbed);
        let mut anew = false;
        for part in 0..PARTS {
            if ended.hung || ended.code == undisturbed.code {
                break;
            }
            let again = (part < AGAIN && random.once_in(4)).then(|| {
                let kind = random.pick(&[Kind::KillSolver, Kind::KillCoupler, Kind::Interrupt]);
                Plan::choose(kind, &mut random, self.takes)
            });
            let (words, way) = if anew {
                verdict.anew += 1;
                (program.run(&self.dir), WAYS[0])
            } else {
                verdict.resumed += 1;
                (program.resume(&self.dir), random.pick(&WAYS))
            };
            ended = program.start(words, &self.dir, again.as_ref(), way)?.wait();
            couplers.insert(ended.pid);
            let nothing_there = ended.code == Some(2) && is_nothing_to_resume(&ended.said());
            if nothing_there && !anew {
                // It was killed before it had a checkpoint.
                verdict.resumed -= 1;
                anew = true;
                continue;
            }
            let calm = Plan::default();
            verdict.judge(&ended, again.as_ref().unwrap_or(&calm), undisturbed);
            anew = false;
            if !verdict.failures.is_empty() {
                break;
            }
        }
        self.compare(&ended, undisturbed, verdict);
        let left = program.left_by(&couplers);
        if !left.is_empty() && is_swept(&ended, undisturbed) {
            verdict.fail(Wrong::Leftover, left.join(", "));
        }
        Ok(())
    }

    fn compare(&self, ended: &Ended, undisturbed: &RunResult, verdict: &mut Verdict) {
        if ended.code != undisturbed.code {
            if verdict.failures.is_empty() {
                let words = format!("does not come to its end: {}", ended.last_words());
                verdict.fail(Wrong::End, words);
            }
            return;
        }
        let result = RunResult::read(&self.dir);
        let difference = match &result {
            Some(result) => undisturbed.difference(result),
            None => Some("summary.json, which is missing".into()),
        };
        if let Some(what) = difference {
            verdict.fail(Wrong::Bits, format!("{what} differs"));
        }
    }
}

impl Verdict {
    /// Whether a part that this happened to may end so.
    fn judge(&mut self, ended: &Ended, plan: &Plan, undisturbed: &RunResult) {
        if ended.hung {
            self.fail(
                Wrong::Hang,
                format!("{} [{}]", ended.last_words(), plan.words()),
            );
            return;
        }
        if !ended.survivors.is_empty() {
            let words = format!(
                "processes {:?} after the end [{}]",
                ended.survivors,
                plan.words()
            );
            self.fail(Wrong::Leftover, words);
        }
        if ended.code == undisturbed.code {
            return;
        }
        let sent = |to: Target, signals: &[Signal]| {
            let acts = plan.acts.iter();
            let matching = acts.filter(move |act| act.to == to && signals.contains(&act.signal));
            matching.map(|act| act.signal.as_raw()).collect::<Vec<_>>()
        };
        let asked = sent(
            Target::Coupler,
            &[Signal::INT, Signal::TERM, Signal::HUP, Signal::XCPU],
        );
        // Before the program has asked for it, a signal does what it always does.
        let fatal = [
            &asked[..],
            &sent(Target::Coupler, &[Signal::KILL, Signal::USR1]),
        ]
        .concat();
        let killed: Vec<Target> = [Target::Mpm, Target::Dem]
            .into_iter()
            .filter(|&solver| !sent(solver, &[Signal::KILL]).is_empty())
            .collect();
        // Its own output: the summary can be that of the previous part, if this one failed to start.
        let said = ended.said();
        let reason = ended.last_words();
        match (ended.code, ended.signal) {
            (_, Some(signal)) if fatal.contains(&signal) => {}
            (Some(130), _) if !asked.is_empty() => {
                if ended.since_last_act > PROMPTLY {
                    let words = format!("ends {:.1?} after it was asked to", ended.since_last_act);
                    self.fail(Wrong::Culprit, format!("{words} [{}]", plan.words()));
                }
            }
            (Some(3), _) if !killed.is_empty() => {
                let named = |solver: &Target| {
                    said.contains(&format!(
                        "the {} solver was killed by signal 9",
                        solver.name()
                    ))
                };
                if !killed.iter().any(named) {
                    self.fail(Wrong::Culprit, format!("{reason} [{}]", plan.words()));
                }
            }
            (Some(2 | 3), _) if plan.room != Room::Enough || plan.unlink.is_some() => {
                if !NO_ROOM.iter().any(|words| said.contains(words)) {
                    self.fail(Wrong::Culprit, format!("{reason} [{}]", plan.words()));
                }
            }
            _ => self.fail(
                Wrong::End,
                format!("{}: {reason} [{}]", ended.words(), plan.words()),
            ),
        }
    }

    fn fail(&mut self, wrong: Wrong, words: String) {
        self.failures.push(Failure { wrong, words });
    }
}

/// Whether `resume` says that there is nothing to go on with.
fn is_nothing_to_resume(said: &str) -> bool {
    said.contains("has no checkpoint") || said.contains("scene.toml")
}

/// What a run has left is removed by the next start, so by the last part of a round unless that was ended too.
fn is_swept(ended: &Ended, undisturbed: &RunResult) -> bool {
    ended.code == undisturbed.code
}
