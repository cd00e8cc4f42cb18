//! Waiting for another process: poll for a while, then sleep on its bell, look again, and give up at the deadline
//! (docs/decisions/0006-waiting.md; measurements in MEASURED.md section 4).

use std::time::{Duration, Instant};

/// How long to look again and again before sleeping, yielding the processor between the looks.
pub const POLL: Duration = Duration::from_micros(50);
/// Longest sleep before looking again. iceoryx2 0.10 can lose a wakeup, so no wait relies on one.
pub const NAP: Duration = Duration::from_millis(10);

/// How to wait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaitPolicy {
    /// How long to look again and again before sleeping. Between the looks the processor is yielded: with three
    /// processes on two cores a spin would hold back the process that is waited for.
    pub poll: Duration,
    /// Longest sleep before looking again. iceoryx2 0.10 can lose a wakeup, so no wait relies on one.
    pub nap: Duration,
    /// Longest wait in all.
    pub deadline: Duration,
}

impl WaitPolicy {
    /// Polls for 50 us, sleeps for at most 10 ms at a time, and gives up after `deadline`.
    pub fn until(deadline: Duration) -> Self {
        Self {
            poll: POLL,
            nap: NAP,
            deadline,
        }
    }
}

/// Waits until `look` finds something.
///
/// `sleep` blocks for at most the given time or until the bell rings. After each sleep `alarm` may end the wait with an
/// error, for an abort or the end of a process. At the deadline the error is `expired(time waited)`.
///
/// # Errors
/// The errors of `look`, `alarm` or `expired`.
pub fn wait<T, E>(
    policy: WaitPolicy,
    mut look: impl FnMut() -> Result<Option<T>, E>,
    mut sleep: impl FnMut(Duration),
    mut alarm: impl FnMut() -> Result<(), E>,
    expired: impl FnOnce(Duration) -> E,
) -> Result<T, E> {
    if let Some(found) = look()? {
        return Ok(found);
    }
    let start = Instant::now();
    loop {
        let window = Instant::now();
        while window.elapsed() < policy.poll {
            std::thread::yield_now();
            if let Some(found) = look()? {
                return Ok(found);
            }
        }
        let waited = start.elapsed();
        if waited >= policy.deadline {
            return Err(expired(waited));
        }
        sleep(policy.nap.min(policy.deadline.saturating_sub(waited)));
        if let Some(found) = look()? {
            return Ok(found);
        }
        alarm()?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    fn quick(deadline_ms: u64) -> WaitPolicy {
        WaitPolicy {
            poll: Duration::from_micros(10),
            ..WaitPolicy::until(Duration::from_millis(deadline_ms))
        }
    }

    #[test]
    fn what_is_there_is_found_without_sleeping() {
        let found = wait::<_, ()>(
            quick(1),
            || Ok(Some(7)),
            |_| panic!("slept"),
            || Ok(()),
            |_| (),
        );
        assert_eq!(found, Ok(7));
    }

    #[test]
    fn a_message_whose_bell_was_lost_is_found_on_the_next_look() {
        let slept = Cell::new(0);
        let found = wait::<_, ()>(
            quick(1000),
            || Ok((slept.get() > 2).then_some(1)),
            |_| slept.set(slept.get() + 1),
            || Ok(()),
            |_| (),
        );
        assert_eq!((found, slept.get()), (Ok(1), 3));
    }

    #[test]
    fn the_deadline_ends_the_wait() {
        let waited = wait::<(), _>(
            quick(20),
            || Ok(None),
            std::thread::sleep,
            || Ok(()),
            |waited| waited,
        )
        .unwrap_err();
        assert!(waited >= Duration::from_millis(20));
    }

    #[test]
    fn the_alarm_ends_the_wait() {
        let end = wait::<(), _>(
            quick(10_000),
            || Ok(None),
            |_| {},
            || Err("dead"),
            |_| "late",
        );
        assert_eq!(end, Err("dead"));
    }
}
