//! A solver that is alive but does not run: it was stopped by a signal, its container is paused, or a disk does not
//! answer. It can continue where it was, with the same bits, so the run waits for it. A message tells the user, and an
//! option says how long to wait.

use std::time::{Duration, Instant};

use interface::message::control::Party;
use interface::transport::liveness::Hold;

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(250);
/// Longest time between two looks that counts: if it is longer, this process was stopped too.
const ROUND: Duration = Duration::from_secs(1);
/// A solver that is held for longer than this is not just writing to a disk.
const MOMENT: Duration = Duration::from_millis(500);
/// A wait of this length for a held solver is reported.
const NOTICE: Duration = Duration::from_secs(3);

/// Which solver is held, and since when.
#[derive(Debug)]
pub struct Pauses {
    patience: Duration,
    looked: Instant,
    held: Option<Held>,
}

#[derive(Debug)]
struct Held {
    party: Party,
    hold: Hold,
    lasted: Duration,
    named: bool,
}

impl Pauses {
    /// For a run that waits for at most `patience`.
    pub fn new(patience: Duration) -> Self {
        Self {
            patience,
            looked: Instant::now(),
            held: None,
        }
    }

    /// Checks at intervals whether a solver is held. Returns one that has been held for longer than the run waits.
    pub fn look(
        &mut self,
        held: impl FnOnce() -> Option<(Party, Hold)>,
    ) -> Option<(Party, String)> {
        let round = self.looked.elapsed();
        if round < LOOK {
            return None;
        }
        self.looked = Instant::now();
        self.after(round.min(ROUND), held())
    }

    /// The solver that is held for more than a moment, with the reason.
    pub fn held_now(&self) -> Option<(Party, Hold)> {
        let held = self.held.as_ref()?;
        (held.lasted >= MOMENT).then_some((held.party, held.hold))
    }

    fn after(&mut self, round: Duration, seen: Option<(Party, Hold)>) -> Option<(Party, String)> {
        let before = self.held.take();
        let Some((party, hold)) = seen else {
            if let Some(Held {
                party, named: true, ..
            }) = before
            {
                tracing::info!("the {party} solver runs again");
            }
            return None;
        };
        // Of the time before the first look nothing is known.
        let mut held = match before {
            Some(held) if held.party == party => Held {
                lasted: held.lasted + round,
                ..held
            },
            _ => Held {
                party,
                hold,
                lasted: Duration::ZERO,
                named: false,
            },
        };
        if held.lasted >= self.patience {
            return Some((party, format!("has been {hold} for {:.0?}", held.lasted)));
        }
        if held.lasted >= NOTICE && !held.named {
            held.named = true;
            tracing::warn!(
                "the {party} solver is {hold}: the run waits for it, for at most {:.0?} (--patience)",
                self.patience
            );
        }
        self.held = Some(held);
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STOPPED: Option<(Party, Hold)> = Some((Party::Dem, Hold::Stopped));

    #[test]
    fn a_solver_that_continues_gets_a_new_wait() {
        let mut pauses = Pauses::new(Duration::from_secs(10));
        for _ in 0..5 {
            for _ in 0..8 {
                assert_eq!(pauses.after(ROUND, STOPPED), None);
            }
            assert_eq!(pauses.after(ROUND, None), None);
        }
    }

    #[test]
    fn a_short_stop_is_not_reported() {
        let mut pauses = Pauses::new(Duration::from_secs(10));
        assert_eq!(pauses.after(ROUND, STOPPED), None);
        assert_eq!(pauses.held_now(), None);
        assert_eq!(pauses.after(LOOK, STOPPED), None);
        assert_eq!(pauses.after(LOOK, STOPPED), None);
        assert_eq!(pauses.held_now(), STOPPED);
        assert_eq!(pauses.after(LOOK, None), None);
        assert_eq!(pauses.held_now(), None);
    }
}
