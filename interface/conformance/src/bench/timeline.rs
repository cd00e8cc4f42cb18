//! Steps and epochs of a run, and what is granted next: the same whichever side is under test.

use interface::step::Clock;
use interface::wire::{Grant, StepHeader, flags};

/// What a grant allows the solver's limits to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// 1/s^2.
    pub omega_sq: f64,
    /// m/s.
    pub speed: f64,
    /// Damping ratio.
    pub damping: f64,
}

impl Budget {
    /// Nothing limits.
    pub const ALL: Self = Self {
        omega_sq: f64::MAX,
        speed: f64::MAX,
        damping: f64::MAX,
    };
}

/// Steps and epochs of a run.
pub(super) struct Timeline {
    /// Its steps.
    pub clock: Clock,
    /// The epoch that it is in; 0 before the first.
    pub epoch: u64,
}

impl Timeline {
    pub fn new() -> Self {
        Self {
            clock: Clock::new(0.0),
            epoch: 0,
        }
    }

    /// Begins an epoch of steps of `dt` (s), as the coupler does after a halt.
    pub fn begin_epoch(&mut self, dt: f64) {
        self.clock.begin_epoch(dt);
        self.epoch += 1;
    }

    /// The next grant: of `steps` steps of `dt` (s). A measured one begins an epoch, as one with another step does.
    pub fn next_grant(&mut self, dt: f64, steps: u64, measure: bool, budget: &Budget) -> Grant {
        if measure || self.epoch == 0 || dt != self.clock.dt() {
            self.begin_epoch(dt);
        }
        let (epoch_start, steps_in_epoch, dt_before_epoch) = self.clock.epoch();
        Grant {
            epoch: self.epoch,
            first: self.clock.index(),
            steps,
            flags: if measure { flags::MEASURE } else { 0 },
            epoch_start,
            steps_in_epoch,
            dt_before_epoch,
            dt,
            budget_omega_sq: budget.omega_sq,
            budget_speed: budget.speed,
            budget_damping: budget.damping,
        }
    }

    /// Header of a message that belongs to the next step.
    pub fn header(&self) -> StepHeader {
        StepHeader {
            epoch: self.epoch,
            step: self.clock.index(),
            ..StepHeader::default()
        }
    }
}
