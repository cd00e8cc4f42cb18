//! Time: a granted step, and the clock that makes steps. All time arithmetic of Tandem is in this file.

use serde::{Deserialize, Serialize};

/// Most by which a step may be longer than the one before it, as a factor (PROTOCOL.md clause L-6).
///
/// The coupler lengthens the step by at most 10 % from one step to the next, and shortens it at once. A bodies' side
/// relies on this for contacts that begin: the limits that it declares with one step have to hold for the next one,
/// whose length it does not know yet. For the first step there is no such bound.
pub const GROWTH: f64 = 1.1;

/// One coupled step from `t_n` to `t_{n+1}`, as both solvers see it.
///
/// Positions belong to `t_n`, velocities to `t_{n-1/2}` (leapfrog, Jiang 2020 eq. 17). The step may differ from the
/// one before it; then the leapfrog kick spans half of each:
///
/// ```text
/// stress   sigma^n   = sigma^{n-1} + rate(v^{n-1/2}) dt_before        the interval that the points have just crossed
/// kick     v^{n+1/2} = v^{n-1/2}   + a^n (dt_before + dt) / 2
/// drift    x^{n+1}   = x^n         + v^{n+1/2} dt
/// ```
///
/// With equal steps this is the paper's scheme. The first step has `dt_before = 0`, so that the initial velocity is
/// that of `t_0`; the closing step has `dt = 0`, so that the last velocity is that of the end. An *opening* step has
/// both zero: nothing moves, forces and limits are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Number of the exchange within the session, from 0; the opening and closing steps count.
    pub index: u64,
    /// `t_n` in s.
    pub time: f64,
    /// `t_n - t_{n-1}` in s.
    pub dt_before: f64,
    /// `t_{n+1} - t_n` in s.
    pub dt: f64,
    /// Whether energies, momenta, and the states of groups and bodies at `t_n` are measured in this step.
    pub measure: bool,
}

impl Step {
    /// Whether it is an opening step, in which nothing moves.
    pub fn is_opening(&self) -> bool {
        self.dt_before == 0.0 && self.dt == 0.0
    }

    /// Length of the kick in s: half of the interval behind and half of the one ahead.
    #[inline]
    pub fn kick(&self) -> f64 {
        0.5 * (self.dt_before + self.dt)
    }

    /// Beginning and end of the kick in s, over which an external force acts with its mean.
    #[inline]
    pub fn span(&self) -> [f64; 2] {
        [self.time - 0.5 * self.dt_before, self.time + 0.5 * self.dt]
    }

    /// Weight of `v^{n+1/2}` in a quantity at `t_n`: `q^n = (1 - w) q^{n-1/2} + w q^{n+1/2}`.
    ///
    /// One half for equal steps (docs/physics.md section 7); 0 in the first step, 1 in the closing one, where the
    /// velocity before, respectively after, the kick is that of `t_n` itself.
    #[inline]
    pub fn centring(&self) -> f64 {
        if self.dt_before + self.dt > 0.0 {
            self.dt_before / (self.dt_before + self.dt)
        } else {
            0.0
        }
    }
}

/// Simulated time as an epoch's start plus whole steps of equal length.
///
/// Within an epoch time is `start + k dt`, not a running sum, so it does not drift; an epoch that ends on an output
/// time ends on exactly that number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    index: u64,
    epoch_start: f64,
    steps_in_epoch: u64,
    dt_before: f64,
    dt: f64,
}

impl Clock {
    /// A clock at the time `start` (s), before the opening step.
    pub fn new(start: f64) -> Self {
        Self {
            index: 0,
            epoch_start: start,
            steps_in_epoch: 0,
            dt_before: 0.0,
            dt: 0.0,
        }
    }

    /// A clock in the middle of an epoch, from the fields of a grant. So both solvers compute exactly the times that
    /// the coupler computes, for every window.
    pub fn within_epoch(
        index: u64,
        epoch_start: f64,
        steps_in_epoch: u64,
        dt_before_epoch: f64,
        dt: f64,
    ) -> Self {
        Self {
            index,
            epoch_start,
            steps_in_epoch,
            dt_before: dt_before_epoch,
            dt,
        }
    }

    /// Start of the epoch in s, number of steps done in it, and the interval before it in s: the values that a grant
    /// has.
    pub fn epoch(&self) -> (f64, u64, f64) {
        (self.epoch_start, self.steps_in_epoch, self.dt_before)
    }

    /// Starts an epoch of steps of length `dt` (s) at the present time.
    pub fn begin_epoch(&mut self, dt: f64) {
        self.epoch_start = self.time();
        self.dt_before = self.interval_behind();
        self.steps_in_epoch = 0;
        self.dt = dt;
    }

    /// The step that begins now.
    pub fn step(&self, measure: bool) -> Step {
        Step {
            index: self.index,
            time: self.time(),
            dt_before: self.interval_behind(),
            dt: self.dt,
            measure,
        }
    }

    /// Moves to the end of the present step.
    pub fn advance(&mut self) {
        self.index += 1;
        self.steps_in_epoch += 1;
    }

    /// Moves to the end of `n` steps at once.
    pub fn advance_by(&mut self, n: u64) {
        self.index += n;
        self.steps_in_epoch += n;
    }

    /// Sets the present time to exactly `time` (s). The epoch was planned to end there, but `start + k dt` may differ
    /// from it by rounding.
    pub fn land_on(&mut self, time: f64) {
        let gap = (self.time() - time).abs();
        debug_assert!(gap <= 1e-9 * time.abs().max(self.dt));
        self.dt_before = self.interval_behind();
        self.epoch_start = time;
        self.steps_in_epoch = 0;
    }

    /// The present time `t_n` in s.
    pub fn time(&self) -> f64 {
        self.epoch_start + self.steps_in_epoch as f64 * self.dt
    }

    /// Number of the step that begins now.
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Length of the steps of this epoch in s.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// `t_n - t_{n-1}` in s.
    pub fn interval_behind(&self) -> f64 {
        if self.steps_in_epoch == 0 {
            self.dt_before
        } else {
            self.dt
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_does_not_drift_over_a_million_steps() {
        let mut clock = Clock::new(0.0);
        clock.begin_epoch(0.1);
        clock.advance_by(1_000_000);
        assert_eq!(clock.time(), 1_000_000.0 * 0.1);
        assert_eq!(clock.index(), 1_000_000);
    }

    #[test]
    fn a_new_epoch_remembers_the_interval_behind_it() {
        let mut clock = Clock::new(0.0);
        assert_eq!(clock.step(false).centring(), 0.0);
        clock.begin_epoch(0.5);
        assert_eq!(clock.step(false).kick(), 0.25);
        clock.advance();
        assert_eq!(clock.step(false).kick(), 0.5);
        clock.begin_epoch(1.0);
        let step = clock.step(false);
        assert_eq!((step.dt_before, step.dt, step.kick()), (0.5, 1.0, 0.75));
        clock.advance();
        clock.begin_epoch(0.0);
        assert_eq!(clock.step(true).centring(), 1.0);
    }

    #[test]
    fn landing_keeps_the_interval_behind() {
        let mut clock = Clock::new(0.0);
        clock.begin_epoch(0.1);
        clock.advance_by(3);
        clock.land_on(0.3);
        assert_eq!(clock.time(), 0.3);
        assert_eq!(clock.interval_behind(), 0.1);
        clock.begin_epoch(0.2);
        assert_eq!(clock.step(false).dt_before, 0.1);
    }
}
