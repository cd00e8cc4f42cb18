//! B-4: who polls finds a message that comes soon, though no bell rings.

use std::time::{Duration, Instant};

use crate::verdict::{Judgement, Unmet, require};

/// What the clause says.
pub const POLLS: &str = "polls, and finds a message at once although no bell rang";
/// Exchanges without a bell.
pub const EXCHANGES: u64 = 40;
/// So many of them must be fast. A busy machine takes the processor from a solver that polls, and most of the others are
/// slow then. A solver that sleeps is never fast: its nap begins when the exchange does.
const FAST: usize = 5;
/// Before each exchange: less than the 40 us of B-4.
const PAUSE: Duration = Duration::from_micros(20);
/// Half a nap of B-3.
const LIMIT: Duration = Duration::from_millis(5);

/// Judges a solver by exchanges without a bell, each begun right after the one before.
pub fn polls(mut exchange: impl FnMut() -> Result<(), Unmet>) -> Judgement {
    let mut times = Vec::new();
    for _ in 0..EXCHANGES {
        let start = Instant::now();
        // The solver has begun to wait by then, and still polls.
        while start.elapsed() < PAUSE {
            std::hint::spin_loop();
        }
        exchange()?;
        times.push(start.elapsed());
    }
    times.sort_unstable();
    let slowest = times[FAST - 1];
    let micros = slowest.as_secs_f64() * 1e6;
    require(
        slowest < LIMIT,
        format_args!("{FAST} of {EXCHANGES} exchanges without a bell within {LIMIT:?} each"),
        format_args!("{micros:.0} us"),
    )?;
    Ok(format!(
        "an exchange without a bell takes {micros:.0} us where the machine lets it"
    ))
}
