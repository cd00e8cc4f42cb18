//! Plans steps: an epoch is an interval of equal steps. A new one begins when a limit changes, at each output, and
//! every 64 steps; never because of how many steps a grant covers, so the window cannot change a bit of the result.

use std::collections::BTreeMap;

use interface::step::GROWTH;
use serde::{Deserialize, Serialize};

use crate::run::stability::{Bound, Sides, Stability, StepLimit};
use crate::scene::TimePlan;

/// Steps after which the limits are asked for again although none was exceeded.
const EPOCH: u64 = 64;
/// The same while the step is still growing towards its limit.
const EPOCH_WHILE_GROWING: u64 = 4;
/// A new step uses this share of its limit, so that a limit that fluctuates does not end every epoch at once.
const HEADROOM: f64 = 0.97;
/// A step that is shortened by more than this to meet an output counts as limited by the output.
const OUTPUT_SHARE: f64 = 0.95;

/// An interval of equal steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// Step in s.
    pub dt: f64,
    /// Most steps in it.
    pub steps: u64,
    /// Whether the last of these steps ends on the next output.
    pub lands: bool,
    /// The limit that determines the step.
    pub bound: Bound,
}

/// Plans epochs, and counts the steps by the limit that determined them.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    plan: TimePlan,
    every: f64,
    /// The steps planned so far; a run that goes on takes those of another process.
    pub so_far: SoFar,
}

/// The steps planned so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SoFar {
    /// Outputs done; the next is due at `(outputs + 1) every`.
    pub outputs: u64,
    dt_last: Option<f64>,
    /// The last step in s, and the limit that determined it.
    pub last: Option<(f64, Bound)>,
    /// Number of steps by each limit.
    pub bound_by: BTreeMap<Bound, u64>,
    /// Shortest and longest step so far in s.
    pub range: Option<(f64, f64)>,
}

impl Pace {
    /// Steps for `plan` with an output each `every` s.
    pub fn new(plan: TimePlan, every: f64) -> Self {
        Self {
            plan,
            every,
            so_far: SoFar::default(),
        }
    }

    /// Continues at `time` (s) the plan of a run of another scene: steps grow from its last one, and the counts begin
    /// at zero.
    pub fn branch(&mut self, from: &SoFar, time: f64) {
        self.so_far = SoFar {
            outputs: (time / self.every + 1e-9) as u64,
            dt_last: from.dt_last,
            last: from.last,
            ..SoFar::default()
        };
    }

    /// Time of the next output in s: a multiple of the interval, or the end.
    pub fn next_output(&self) -> f64 {
        let due = (self.so_far.outputs + 1) as f64 * self.every;
        // If the interval does not divide the run, the last interval is shorter. A rounding error must not become an
        // interval.
        if due > self.plan.end - 1e-9 * self.every {
            self.plan.end
        } else {
            due
        }
    }

    /// The next epoch from `time` (s) on.
    ///
    /// # Errors
    /// The limit, if it requires a step below the shortest one of the scene.
    pub fn epoch(
        &mut self,
        time: f64,
        stability: &Stability,
        sides: &Sides,
    ) -> Result<Epoch, StepLimit> {
        let StepLimit {
            dt: limit,
            mut bound,
        } = stability.limit(sides);
        let mut dt = HEADROOM * limit;
        if let Some(cap) = self.plan.max_step
            && cap < dt
        {
            (dt, bound) = (cap, Bound::Cap);
        }
        let mut steps = EPOCH;
        if let Some(last) = self.so_far.dt_last
            && GROWTH * last < dt
        {
            (dt, bound) = (GROWTH * last, Bound::Growth);
            steps = EPOCH_WHILE_GROWING;
        }
        if dt.is_nan() || dt < self.plan.shortest() {
            return Err(StepLimit { dt, bound });
        }
        let left = self.next_output() - time;
        let needed = (left / dt * (1.0 - 1e-12)).ceil().max(1.0);
        if left / needed < OUTPUT_SHARE * dt {
            bound = Bound::Output;
        }
        self.so_far.dt_last = Some(left / needed);
        let needed_steps = if needed < 1e18 {
            needed as u64
        } else {
            u64::MAX
        };
        let lands = needed_steps <= steps;
        Ok(Epoch {
            dt: left / needed,
            steps: steps.min(needed_steps),
            lands,
            bound,
        })
    }

    /// Counts `steps` steps of an epoch.
    pub fn book(&mut self, epoch: &Epoch, steps: u64) {
        let so_far = &mut self.so_far;
        so_far.last = Some((epoch.dt, epoch.bound));
        *so_far.bound_by.entry(epoch.bound).or_default() += steps;
        let (low, high) = so_far.range.unwrap_or((epoch.dt, epoch.dt));
        so_far.range = Some((low.min(epoch.dt), high.max(epoch.dt)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface::message::wire::Limits;

    fn pace(end: f64, every: f64) -> Pace {
        let plan = TimePlan {
            safety: 1.0,
            min_step: Some(1e-12),
            ..TimePlan::until(end)
        };
        Pace::new(plan, every)
    }

    fn sides(omega: f64) -> Sides {
        Sides {
            mpm: Limits {
                omega_sq: omega * omega,
                ..Limits::default()
            },
            dem: Limits::default(),
        }
    }

    fn stability() -> Stability {
        Stability::new(&pace(1.0, 1.0).plan, None, None)
    }

    #[test]
    fn outputs_are_met_exactly_with_equal_steps() {
        let mut pace = pace(1.0, 0.3);
        let mut time = 0.0;
        let mut met = Vec::new();
        while time < 1.0 {
            let epoch = pace.epoch(time, &stability(), &sides(20.0)).unwrap();
            assert!(epoch.dt <= HEADROOM * 2.0 / 20.0);
            if epoch.lands {
                time = pace.next_output();
                pace.so_far.outputs += 1;
                met.push(time);
            } else {
                time += epoch.dt * epoch.steps as f64;
            }
        }
        assert_eq!(met, [0.3, 0.6, 0.3 * 3.0, 1.0]);
    }

    #[test]
    fn the_step_shrinks_at_once_and_grows_slowly() {
        let mut pace = pace(1e6, 1e6);
        let slow = pace.epoch(0.0, &stability(), &sides(1.0)).unwrap();
        assert_eq!(slow.bound, Bound::Elastic);
        let small = pace.epoch(1.0, &stability(), &sides(100.0)).unwrap();
        assert!(small.dt < slow.dt / 90.0);
        let grown = pace.epoch(2.0, &stability(), &sides(1.0)).unwrap();
        assert!(grown.dt <= GROWTH * small.dt * (1.0 + 1e-6) && grown.bound == Bound::Growth);
        assert_eq!(grown.steps, EPOCH_WHILE_GROWING);
    }

    #[test]
    fn a_step_below_the_shortest_is_an_error() {
        let collapsed = pace(1.0, 1.0)
            .epoch(0.0, &stability(), &sides(1e13))
            .unwrap_err();
        assert_eq!(collapsed.bound, Bound::Elastic);
        assert!(
            pace(1.0, 1.0)
                .epoch(0.0, &stability(), &sides(f64::NAN))
                .is_err()
        );
    }

    #[test]
    fn nothing_binds_but_the_output() {
        // The whole interval is one step.
        let epoch = pace(1.0, 0.5)
            .epoch(0.0, &stability(), &Sides::default())
            .unwrap();
        assert_eq!(
            (epoch.dt, epoch.steps, epoch.lands, epoch.bound),
            (0.5, 1, true, Bound::Output)
        );
    }
}
