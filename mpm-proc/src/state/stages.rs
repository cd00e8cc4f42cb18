//! Stages of loading: damping of the nodes and a share of PIC that change with time, such as a settling phase before a
//! pile is driven (Chen 2023 section 4.3).
//!
//! Damping is proportional to mass, `dv/dt = a - c v`, and is solved exactly over the kick with the acceleration held:
//!
//! ```text
//! v^{n+1/2} = E v^{n-1/2} + (1 - E)/(c k) a k,   E = exp(-c k),   k the kick
//! ```
//!
//! unlike the centred form `((1 - c k/2) v + a k)/(1 + c k/2)` it never turns a velocity round, however large `c k`; both
//! have the same terminal velocity `a / c`. It does not narrow the step limit: on a spring of frequency `w` it is stable
//! up to `(w k)^2 (1 - E)/(c k) = 2 (1 + E)`, and since `(1 - E)/(1 + E) = tanh(c k/2) <= c k/2` that is at least
//! `w k = 2`.
//!
//! Only what the grid sees is damped: a FLIP point keeps the part of its own velocity that its nodes average away. The
//! momentum taken out counts as applied impulse, the energy as viscous work.

use interface::config::{MpmConfig, Stage, Transfer as TransferConfig};
use interface::solver::Refusal;

use crate::kernel::shape::Shape;
use crate::kernel::transfer::Transfer;
use crate::state::continuum::Continuum;
use crate::state::grid::{NODES, NodeTile};
use crate::state::points::LaneCopy;

/// The stages of a scene, in order of their beginning.
#[derive(Debug, Clone, Default)]
pub struct Stages {
    stages: Vec<Stage>,
    /// Share of PIC where a stage does not say.
    pic_fraction: f64,
}

impl Stages {
    /// The stages of a scene.
    ///
    /// # Errors
    /// A [`Refusal`] that names the key.
    pub fn new(config: &MpmConfig) -> Result<Self, Refusal> {
        let stages = config.forcing.stages.clone();
        let refuse = |i: usize, name: &str, message: String| {
            Err(Refusal::new(format!("mpm.stage.{i}.{name}"), message))
        };
        for (i, stage) in stages.iter().enumerate() {
            if !(stage.from.is_finite() && (i == 0 || stage.from > stages[i - 1].from)) {
                let message = format!("{} s must come after the stage before it", stage.from);
                return refuse(i, "from", message);
            }
            if !(stage.damping.is_finite() && stage.damping >= 0.0) {
                return refuse(
                    i,
                    "damping",
                    format!("{} 1/s must be 0 or more", stage.damping),
                );
            }
            let Some(fraction) = stage.pic_fraction else {
                continue;
            };
            if !(0.0..=1.0).contains(&fraction) {
                let message = format!("{fraction} must lie between 0 (FLIP) and 1 (PIC)");
                return refuse(i, "pic_fraction", message);
            }
            if !matches!(
                config.transfer,
                TransferConfig::Flip | TransferConfig::Blend { .. }
            ) {
                let message = "needs transfer = \"flip\" or transfer.blend";
                return refuse(i, "pic_fraction", message.into());
            }
        }
        let pic_fraction = match config.transfer {
            TransferConfig::Blend { pic_fraction } => pic_fraction,
            _ => 0.0,
        };
        Ok(Self {
            stages,
            pic_fraction,
        })
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.stages.is_empty()
    }

    /// The transfer that the loops are compiled for: FLIP with a share of PIC in some stage is a blend.
    pub fn transfer(&self, asked: TransferConfig) -> TransferConfig {
        let blends = self.stages.iter().any(|s| s.pic_fraction.is_some());
        match asked {
            TransferConfig::Flip if blends => TransferConfig::Blend { pic_fraction: 0.0 },
            other => other,
        }
    }

    /// Damping in 1/s and share of PIC at `time` (s): of the last stage that has begun.
    fn at(&self, time: f64) -> (f64, f64) {
        let begun = self.stages.partition_point(|s| s.from <= time);
        match begun.checked_sub(1).map(|i| &self.stages[i]) {
            Some(s) => (s.damping, s.pic_fraction.unwrap_or(self.pic_fraction)),
            None => (0.0, self.pic_fraction),
        }
    }
}

/// Damping of nodes over one kick.
#[derive(Debug, Clone, Copy)]
pub struct Damping {
    /// `E`.
    kept: f64,
    /// `(1 - E)/(c k)`.
    gained: f64,
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

    /// Damps the new velocities of a tile, walls not yet obeyed. Returns the impulse of each node in N s/m.
    pub fn act(&self, tile: &mut NodeTile) -> [[f64; 2]; NODES] {
        let mut impulse = [[0.0; 2]; NODES];
        for i in 0..NODES {
            for a in 0..2 {
                let (before, free) = (tile.before[i][a], tile.after[i][a]);
                let damped = self.kept * before + self.gained * (free - before);
                impulse[i][a] = tile.mass[i] * (damped - free);
                tile.after[i][a] = damped;
            }
        }
        impulse
    }

    /// Counts impulse and dissipation of a tile, walls obeyed: a kick changes the kinetic energy of a node by its
    /// impulse times the mean of the velocities before and after.
    pub fn count(impulse: &[[f64; 2]; NODES], tile: &mut NodeTile) {
        for i in 0..NODES {
            for a in 0..2 {
                tile.wall_impulse[a] += impulse[i][a];
                let mean = 0.5 * (tile.before[i][a] + tile.after[i][a]);
                tile.damping_work -= impulse[i][a] * mean;
            }
        }
    }
}

impl<const W: usize, S: Shape<W>, T: Transfer> Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    /// Lets the stage of `time` (s) begin, if it has not, and returns its damping in 1/s.
    pub fn begin_stage(&mut self, time: f64) -> f64 {
        if self.stages.is_empty() {
            return 0.0;
        }
        let (damping, pic_fraction) = self.stages.at(time);
        self.transfer = self.transfer.with_pic_fraction(pic_fraction);
        damping
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_alone_is_the_exponential_and_keeps_the_terminal_velocity() {
        let (c, k, a) = (300.0, 1e-2, 7.0);
        let damping = Damping::over(c, k).expect("some");
        assert!((damping.kept - (-3.0_f64).exp()).abs() < 1e-16);
        let terminal = a / c;
        let next = damping.kept * terminal + damping.gained * a * k;
        assert!((next / terminal - 1.0).abs() < 1e-14);
        assert!(Damping::over(0.0, k).is_none() && Damping::over(c, 0.0).is_none());
        // Small rates: no cancellation.
        let little = Damping::over(1e-12, 1e-3).expect("some");
        assert!((little.gained - 1.0).abs() < 1e-14);
    }

    #[test]
    fn damping_never_narrows_the_step_limit() {
        // Leapfrog of v' = -w^2 x - c v with k = 1: both roots of z^2 - (1 + E - g w^2) z + E within the unit circle.
        for c in [0.01, 0.3, 2.0, 20.0] {
            let d = Damping::over(c, 1.0).expect("some");
            for w in [0.1, 1.0, 1.9, 1.999] {
                let trace: f64 = 1.0 + d.kept - d.gained * w * w;
                assert!(trace.abs() <= 1.0 + d.kept, "c {c}, w {w}");
            }
        }
    }

    #[test]
    fn the_last_stage_that_has_begun_counts() {
        let stage = |from, damping, pic_fraction| Stage {
            from,
            damping,
            pic_fraction,
        };
        let stages = Stages {
            stages: vec![stage(0.0, 5.0, Some(1.0)), stage(0.5, 0.0, None)],
            pic_fraction: 0.1,
        };
        assert_eq!(stages.at(0.0), (5.0, 1.0));
        assert_eq!(stages.at(0.49), (5.0, 1.0));
        assert_eq!(stages.at(0.5), (0.0, 0.1));
        let later = Stages {
            stages: vec![stage(1.0, 5.0, None)],
            pic_fraction: 0.2,
        };
        assert_eq!(later.at(0.0), (0.0, 0.2));
    }
}
