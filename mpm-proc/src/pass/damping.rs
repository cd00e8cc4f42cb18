//! Damping of the nodes in a stage of loading.
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

use interface::step::Step;

use crate::kernel::tiles::NODES;
use crate::kernel::transfer::Transfer;
use crate::state::nodes::NodeTile;
use crate::state::stages::Stages;

/// Sets the transfer for a step: the share for its kick, and that of the stage to which the step belongs. Returns the
/// damping of that stage in 1/s.
pub fn begin_stage(stages: &Stages, transfer: &mut Transfer, step: &Step) -> f64 {
    *transfer = transfer.over(step.kick());
    if stages.is_empty() {
        return 0.0;
    }
    let (damping, pic_fraction) = stages.at(step.time);
    *transfer = transfer.with_pic_fraction(pic_fraction);
    damping
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

    /// Damps the new velocities of a tile, before the walls act. Returns the impulse of each node in N s/m.
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

    /// Counts impulse and dissipation of a tile, after the walls have acted: a kick changes the kinetic energy of a
    /// node by its impulse times the mean of the velocities before and after.
    pub fn count(impulse: &[[f64; 2]; NODES], tile: &mut NodeTile) {
        for i in 0..NODES {
            for a in 0..2 {
                tile.wall.impulse[a] += impulse[i][a];
                let mean = 0.5 * (tile.before[i][a] + tile.after[i][a]);
                tile.damping_work -= impulse[i][a] * mean;
            }
        }
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
}
