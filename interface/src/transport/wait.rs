//! The place where the program waits (clippy.toml). [`wait`] waits for a message of another process
//! (docs/decisions/0006-waiting.md): look for it for a short while, block until the other side wakes this one, look again,
//! and give up at the deadline. [`until`] and [`until_there`] wait for what wakes nobody: a process, a file, a
//! thread. Who may wait for long
//! looks for a signal too, in [`Awaited::interruption`] or in the look.

use std::time::{Duration, Instant};

/// Longest time to look again and again before blocking. To wake a processor that idles takes half of it, and the answer
/// of a party that has to be woken comes after that.
const LONGEST_SPIN: Duration = Duration::from_micros(100);
/// What is waited for, and how.
pub trait Awaited {
    /// What ends the wait.
    type Found;

    /// Longest block. It bounds how late a party sees what wakes nobody: the end of a process, a signal, an abort.
    const NAP: Duration = Duration::from_millis(10);

    /// What is waited for, if it is there.
    fn look(&mut self) -> Option<Self::Found>;

    /// Blocks until the other side wakes this one, for `at_most` at most. It may return early.
    fn block(&mut self, at_most: Duration);

    /// Asked every [`Self::NAP`]: what ends the wait without a wake-up, an abort or the end of a process. `_silence` is
    /// how long the wait has lasted, as its deadline counts it.
    fn interruption(&mut self, _silence: Duration) -> Option<Self::Found> {
        None
    }

    /// Whether another party is stopped, frozen or blocked, so that silence does not count at present (clause S-11).
    fn held(&mut self) -> bool {
        false
    }
}

/// Waits until `awaited` is found or interrupted, for a silence of `deadline` at most. `spin` belongs to the party that is
/// waited for.
///
/// # Errors
/// The silence, if it has lasted for `deadline`.
pub fn wait<A: Awaited>(
    awaited: &mut A,
    spin: &mut Spin,
    deadline: Duration,
) -> Result<A::Found, Duration> {
    let begin = Instant::now();
    let limit = spin.next();
    loop {
        let spun = begin.elapsed();
        if let Some(found) = awaited.look() {
            spin.ended(limit, begin.elapsed());
            return Ok(found);
        }
        if spun >= limit {
            break;
        }
        std::hint::spin_loop();
    }
    let mut silence = Silence::since(begin);
    let mut asked = begin;
    loop {
        let waited = silence.so_far(deadline, || awaited.held());
        if waited >= deadline {
            return Err(waited);
        }
        awaited.block(A::NAP.min(deadline.saturating_sub(waited)));
        if let Some(found) = awaited.look() {
            spin.ended(limit, begin.elapsed());
            return Ok(found);
        }
        if asked.elapsed() >= A::NAP.min(deadline) {
            asked = Instant::now();
            if let Some(found) = awaited.interruption(waited) {
                return Ok(found);
            }
        }
    }
}

/// Sleeps: nothing is waited for.
#[allow(clippy::disallowed_methods, reason = "here the program waits")]
pub fn nap(time: Duration) {
    std::thread::sleep(time);
}

/// Looks every so often until something is there, however long that takes.
pub fn until_there<T>(every: Duration, mut look: impl FnMut() -> Option<T>) -> T {
    loop {
        if let Some(found) = look() {
            return found;
        }
        nap(every);
    }
}

/// Looks every so often until something is there, for `at_most` at most.
pub fn until<T>(
    at_most: Duration,
    every: Duration,
    mut look: impl FnMut() -> Option<T>,
) -> Option<T> {
    let begin = Instant::now();
    loop {
        let found = look();
        if found.is_some() || begin.elapsed() >= at_most {
            return found;
        }
        nap(every);
    }
}

/// How long to look for a message of another party before blocking. The length follows what its answers have lately
/// taken. It is zero for some waits after a spin in vain: 1, 3, 7, up to 63, until one succeeds again. So a machine
/// with fewer free processors than parties, where the other side cannot run while this one spins, does not spin.
#[derive(Debug, Clone, Copy)]
pub struct Spin {
    /// The time of an answer, smoothed over those that a spin could await.
    usual: Duration,
    /// Spins in vain since the last one that was not.
    in_vain: u32,
    /// Waits to come without a spin.
    left_out: u32,
}

impl Default for Spin {
    fn default() -> Self {
        Self {
            usual: LONGEST_SPIN / 2,
            in_vain: 0,
            left_out: 0,
        }
    }
}

impl Spin {
    /// A spin ends a while after the usual time: answers vary, and a block costs more.
    const MARGIN: Duration = Duration::from_micros(5);
    /// At least one wait of 2 to this power has a spin.
    const RAREST: u32 = 6;

    /// For how long the next wait spins.
    fn next(&mut self) -> Duration {
        if self.left_out > 0 {
            self.left_out -= 1;
            return Duration::ZERO;
        }
        LONGEST_SPIN.min(2 * self.usual + Self::MARGIN)
    }

    /// The answer came `after` the begin of a wait that was to spin for `limit`.
    fn ended(&mut self, limit: Duration, after: Duration) {
        if after <= LONGEST_SPIN {
            self.usual = (7 * self.usual + after) / 8;
        }
        if limit.is_zero() {
            return;
        }
        // A spin that ends late has lost its processor to another process.
        if after <= limit + Self::MARGIN {
            self.in_vain = 0;
        } else {
            self.in_vain = Self::RAREST.min(self.in_vain + 1);
            self.left_out = (1 << self.in_vain) - 1;
        }
    }
}

/// How long a party has been silent that could have sent something (clause S-11). Time in which this process or another
/// one of the run was stopped, frozen or blocked does not count.
struct Silence {
    /// Silence up to the last test whether the others run.
    counted: Duration,
    /// Silence since then.
    since: Duration,
    mark: Instant,
}

impl Silence {
    /// Longest time between two rounds of a wait that counts. A round is a short sleep, so a process that returns later
    /// was itself held up.
    const ROUND: Duration = Duration::from_millis(100);
    /// Silence after which the wait tests whether the others run.
    const LOOK: Duration = Duration::from_millis(50);

    fn since(mark: Instant) -> Self {
        Self {
            counted: Duration::ZERO,
            since: Duration::ZERO,
            mark,
        }
    }

    /// The silence so far; `held` tests whether another party is held up.
    fn so_far(&mut self, at_most: Duration, held: impl FnOnce() -> bool) -> Duration {
        let now = Instant::now();
        self.since += (now - self.mark).min(Self::ROUND);
        self.mark = now;
        if self.since >= Self::LOOK || self.counted + self.since >= at_most {
            if !held() {
                self.counted += self.since;
            }
            self.since = Duration::ZERO;
        }
        self.counted + self.since
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT_MOST: Duration = Duration::from_millis(500);

    /// Found at the look of this number; interrupted at the question of that number.
    struct Script {
        found_at: usize,
        interrupted_at: usize,
        looks: usize,
        questions: usize,
        blocks: Vec<Duration>,
    }

    impl Script {
        fn new(found_at: usize, interrupted_at: usize) -> Self {
            Self {
                found_at,
                interrupted_at,
                looks: 0,
                questions: 0,
                blocks: Vec::new(),
            }
        }
    }

    impl Awaited for Script {
        type Found = &'static str;

        fn look(&mut self) -> Option<&'static str> {
            self.looks += 1;
            (self.looks > self.found_at).then_some("found")
        }

        fn block(&mut self, at_most: Duration) {
            self.blocks.push(at_most);
            std::thread::sleep(at_most);
        }

        fn interruption(&mut self, _: Duration) -> Option<&'static str> {
            self.questions += 1;
            (self.questions > self.interrupted_at).then_some("interrupted")
        }
    }

    fn without_a_spin() -> Spin {
        Spin {
            left_out: 1,
            ..Spin::default()
        }
    }

    #[test]
    fn what_is_there_is_found_without_blocking() {
        let mut script = Script::new(0, usize::MAX);
        assert_eq!(
            wait(&mut script, &mut without_a_spin(), AT_MOST),
            Ok("found")
        );
        assert!(script.blocks.is_empty());
    }

    #[test]
    fn a_message_without_a_wake_up_is_found_after_a_nap() {
        let mut script = Script::new(3, usize::MAX);
        assert_eq!(
            wait(&mut script, &mut without_a_spin(), AT_MOST),
            Ok("found")
        );
        assert_eq!(script.blocks, [Script::NAP; 3]);
    }

    #[test]
    fn the_deadline_ends_the_wait_and_is_not_slept_past() {
        let mut script = Script::new(usize::MAX, usize::MAX);
        let deadline = Script::NAP / 2;
        let waited = wait(&mut script, &mut without_a_spin(), deadline).unwrap_err();
        assert!(waited >= deadline && !script.blocks.is_empty());
        assert!(script.blocks.iter().all(|nap| *nap <= deadline));
    }

    #[test]
    fn an_interruption_ends_the_wait() {
        let mut script = Script::new(usize::MAX, 1);
        assert_eq!(
            wait(&mut script, &mut Spin::default(), AT_MOST),
            Ok("interrupted")
        );
        assert_eq!(script.questions, 2);
    }

    const SOON: Duration = Duration::from_micros(4);

    #[test]
    fn a_spin_is_a_little_longer_than_answers_take() {
        let mut spin = Spin::default();
        assert_eq!(spin.next(), LONGEST_SPIN);
        for _ in 0..100 {
            let limit = spin.next();
            spin.ended(limit, SOON);
        }
        assert!(spin.next() > 2 * SOON && spin.next() <= 2 * SOON + 2 * Spin::MARGIN);
    }

    #[test]
    fn spins_in_vain_become_rare_and_return_with_the_first_that_succeeds() {
        let mut spin = Spin::default();
        let late = Duration::from_millis(3);
        let mut spins = 0;
        for _ in 0..6400 {
            let limit = spin.next();
            spins += u32::from(!limit.is_zero());
            spin.ended(limit, late);
        }
        assert!((100..110).contains(&spins), "{spins}");
        // Answers come soon again.
        let waits = std::iter::from_fn(|| {
            let limit = spin.next();
            spin.ended(limit, SOON);
            Some(limit)
        });
        assert!(waits.take_while(Duration::is_zero).count() < 64);
        assert!((0..100).all(|_| {
            let limit = spin.next();
            spin.ended(limit, SOON);
            !limit.is_zero()
        }));
    }

    #[test]
    fn a_spin_that_lost_its_processor_was_in_vain() {
        let mut spin = Spin::default();
        let limit = spin.next();
        spin.ended(limit, limit + 2 * Spin::MARGIN);
        assert_eq!(spin.next(), Duration::ZERO);
    }

    fn after(silence: &mut Silence, ms: u64, held: bool) -> Duration {
        silence.mark = Instant::now()
            .checked_sub(Duration::from_millis(ms))
            .expect("the machine has been up for a minute");
        silence.so_far(AT_MOST, || held)
    }

    #[test]
    fn silence_adds_up() {
        let mut silence = Silence::since(Instant::now());
        for _ in 0..49 {
            assert!(after(&mut silence, 10, false) < AT_MOST);
        }
        assert!(after(&mut silence, 11, false) >= AT_MOST);
    }

    #[test]
    fn a_pause_of_this_process_counts_as_one_round() {
        let mut silence = Silence::since(Instant::now());
        let waited = after(&mut silence, 60_000, false);
        assert_eq!(waited, Silence::ROUND);
    }

    #[test]
    fn a_pause_of_another_one_does_not_count() {
        let mut silence = Silence::since(Instant::now());
        for _ in 0..6000 {
            assert!(after(&mut silence, 10, true) < AT_MOST);
        }
        for _ in 0..60 {
            after(&mut silence, 10, false);
        }
        assert!(silence.counted >= AT_MOST);
    }
}
