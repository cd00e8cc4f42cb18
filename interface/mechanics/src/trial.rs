//! Whether the loops of a solver are shared, found by trial.
//!
//! What a second thread gains depends on the length of the loops, on how far the processors are from one another (a message
//! there and back takes 0.09 or 0.45 us on one and the same rented machine), and on what else runs. So every now and then some
//! steps are done alone and some shared, and the way with the smaller median is kept. Both give the same bits.

use std::time::Duration;

/// Steps in a row that are done in the same way. The first of them is not timed: what it needs is in the cache of
/// another thread.
const BURST: usize = 4;

/// Timed steps of each way.
const SAMPLES: usize = 8 * (BURST - 1);

/// Steps of a trial.
const TRIED: usize = 16 * BURST;

/// Steps until the next trial: after the first one, and at most. Each trial doubles them. A trial does 32 steps in the slower
/// way, so at the end it costs 0.8 % where that way takes twice as long.
const KEPT: [usize; 2] = [256, 4096];

/// Loops are shared only if a step then takes less than this part of its time alone: it needs more processors.
const GAIN: f64 = 0.95;

/// The present trial, and what the last one has found.
#[derive(Debug)]
pub struct Trial {
    /// The present step, counted from the first of the trial.
    step: usize,
    /// Steps until the next trial.
    kept: usize,
    /// What the present step has taken so far.
    elapsed: Duration,
    /// Times of the steps alone, and of those shared.
    times: [[Duration; SAMPLES]; 2],
    shares: bool,
}

impl Default for Trial {
    fn default() -> Self {
        Self {
            step: TRIED + KEPT[0],
            kept: KEPT[0] / 2,
            elapsed: Duration::ZERO,
            times: Default::default(),
            shares: false,
        }
    }
}

impl Trial {
    /// Begins a step; returns whether its loops are shared.
    pub fn begin_step(&mut self) -> bool {
        let elapsed = std::mem::take(&mut self.elapsed);
        if self.tries()
            && let Some(timed) = (self.step % BURST).checked_sub(1)
        {
            let burst = self.step / BURST;
            self.times[burst % 2][burst / 2 * (BURST - 1) + timed] = elapsed;
        }
        self.step += 1;
        if self.step == TRIED {
            let [alone, shared] = &mut self.times;
            self.shares = median(shared) < median(alone).mul_f64(GAIN);
        }
        if self.step >= TRIED + self.kept {
            self.step = 0;
            self.kept = (2 * self.kept).min(KEPT[1]);
        }
        if self.tries() {
            self.step / BURST % 2 == 1
        } else {
            self.shares
        }
    }

    /// Whether the present step has to be timed.
    pub fn tries(&self) -> bool {
        self.step < TRIED
    }

    /// Counts what a part of the present step has taken.
    pub fn took(&mut self, time: Duration) {
        self.elapsed += time;
    }
}

fn median(times: &mut [Duration]) -> Duration {
    let middle = times.len() / 2;
    *times.select_nth_unstable(middle).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of so many steps that are done together, if that takes `shared` of the time alone.
    fn shared_part(trial: &mut Trial, steps: usize, shared: f64) -> f64 {
        let mut together = 0;
        for step in 0..steps {
            let shares = trial.begin_step();
            let mut time = if shares { shared } else { 1.0 };
            if step % 10 == 0 {
                time *= 7.0; // lists are made anew
            }
            if trial.tries() {
                trial.took(Duration::from_secs_f64(0.3 * time));
                trial.took(Duration::from_secs_f64(0.7 * time));
            }
            together += usize::from(shares);
        }
        together as f64 / steps as f64
    }

    #[test]
    fn the_faster_way_is_kept_and_tried_again() {
        let mut trial = Trial::default();
        assert!(shared_part(&mut trial, 20_000, 0.7) > 0.98);
        // The processors come to lie far from one another, and near again.
        shared_part(&mut trial, TRIED + KEPT[1], 1.3);
        let part = shared_part(&mut trial, 20_000, 1.3);
        assert!(part > 0.0 && part < 0.01, "{part}");
        shared_part(&mut trial, TRIED + KEPT[1], 0.7);
        assert!(shared_part(&mut trial, 20_000, 0.7) > 0.99);
        // A gain that is not worth a processor.
        shared_part(&mut trial, TRIED + KEPT[1], 0.97);
        assert!(shared_part(&mut trial, 20_000, 0.97) < 0.01);
    }
}
