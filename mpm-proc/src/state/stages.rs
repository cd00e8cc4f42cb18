//! Stages of loading: damping of the nodes and a share of PIC that change with time, such as a settling phase before a
//! pile is driven (Chen 2023 section 4.3).

use interface::config::{MpmConfig, Stage, Transfer as TransferConfig};

/// The stages of a scene, in order of their beginning.
#[derive(Debug, Clone, Default)]
pub struct Stages {
    stages: Vec<Stage>,
    /// Share of PIC where a stage does not say.
    pic_fraction: f64,
}

impl Stages {
    /// The stages of a scene.
    pub fn new(config: &MpmConfig) -> Self {
        let pic_fraction = match config.transfer {
            TransferConfig::Blend { pic_fraction } => pic_fraction,
            _ => 0.0,
        };
        Self {
            stages: config.forcing.stages.clone(),
            pic_fraction,
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.stages.is_empty()
    }

    /// Damping in 1/s and share of PIC at `time` (s): of the last stage that has begun.
    pub fn at(&self, time: f64) -> (f64, f64) {
        let begun = self.stages.partition_point(|s| s.from <= time);
        match begun.checked_sub(1).map(|i| &self.stages[i]) {
            Some(s) => (s.damping, s.pic_fraction.unwrap_or(self.pic_fraction)),
            None => (0.0, self.pic_fraction),
        }
    }
}

/// Damping over one kick ([`crate::pass::damping`]).
#[derive(Debug, Clone, Copy)]
pub struct Damping {
    /// `E = exp(-c k)`.
    pub kept: f64,
    /// `(1 - E)/(c k)`.
    pub gained: f64,
}

impl Damping {
    /// At rate `rate` (1/s) over `kick` (s); nothing if either is zero.
    pub fn over(rate: f64, kick: f64) -> Option<Self> {
        let lost = rate * kick;
        (lost > 0.0).then(|| Self {
            kept: (-lost).exp(),
            gained: -(-lost).exp_m1() / lost,
        })
    }
}
