//! Damping in a stage of loading, such as a settling phase before a pile is driven (Chen 2023 section 4.3).
//!
//! Damping is proportional to mass, `dv/dt = a - c v`, and is solved exactly over the kick with the acceleration held.
//! Nodes do it before the walls act:
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
//! A transfer by increments (FLIP) damps the velocity of each point in the same way, so that the part which its nodes
//! average away decays too, and with it all that shakes a body at rest:
//!
//! ```text
//! v_p <- E v_p + sum_I S_Ip (v_I^{n+1/2} - E v_I^{n-1/2})
//! ```
//!
//! The momentum taken out counts as applied impulse, the energy as viscous work: at the points, what damping takes of the velocity
//! of each times the mean of its velocities before and after. Nodes do not count it: they may take a kick in every step that no
//! point sees (a body at rest needs the forces to vanish at its points, not at its nodes), and have velocities that a
//! transfer by smoothing never gives to a point.

use interface::config::Transfer as TransferConfig;
use interface::impulse::at;
use interface::step::Step;

use crate::kernel::shape::Shape;
use crate::kernel::tiles::NODES;
use crate::kernel::transfer::{AffineState, Transfer};
use crate::state::continuum::Continuum;
use crate::state::damping::Damping;
use crate::state::grid::Grid;
use crate::state::nodes::NodeTile;
use crate::state::points::Cloud;

/// Sets transfer and damping for a step: those of the last stage that has begun, over its kick.
pub fn begin_stage<const W: usize, S: Shape<W>, A: AffineState>(
    c: &mut Continuum<W, S, A>,
    step: &Step,
) {
    let stage = c.stages.iter().rev().find(|stage| stage.from <= step.time);
    // A stage has a share of PIC with FLIP and its blend alone (a fault of the configuration).
    let blend = stage.and_then(|stage| stage.pic_fraction);
    let blend = blend.map(|pic_fraction| TransferConfig::Blend { pic_fraction });
    c.transfer = Transfer::of(blend.unwrap_or(c.configured), step.kick());
    c.damping = stage.and_then(|stage| Damping::over(stage.damping, step.kick()));
}

impl Damping {
    /// Damps the new velocities of a tile, before the walls act.
    pub fn act(&self, tile: &mut NodeTile) {
        for i in 0..NODES {
            let mut impulse = [0.0; 2];
            for a in 0..2 {
                let (before, free) = (tile.before[i][a], tile.after[i][a]);
                let damped = self.kept * before + self.gained * (free - before);
                impulse[a] = tile.mass[i] * (damped - free);
                tile.after[i][a] = damped;
            }
            tile.damping.push(impulse);
        }
    }

    /// The impulse in N s/m that points which damp the share `own` of their velocities get beyond that of the nodes: the momenta
    /// of both differ where a wall or a support has changed the velocities of the nodes. Called before the points take the kick.
    pub fn beyond_nodes<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        clouds: &[Cloud<W, S, A>],
        grid: &Grid,
        own: f64,
    ) -> [f64; 3] {
        let geometry = &grid.geometry;
        let mut momentum = [0.0; 3];
        let mut add = |sign: f64, p: [f64; 3]| {
            momentum = [0, 1, 2].map(|a| momentum[a] + sign * p[a]);
        };
        for cloud in clouds {
            let (motions, turning) = (cloud.motions(), cloud.angular_momentum(geometry.cell));
            add(1.0, [motions.momentum[0], motions.momentum[1], turning]);
        }
        for tile in &grid.tiles {
            add(-1.0, tile.momentum_before(geometry));
        }
        // Points that reach an image feel its velocity, though its mass is at the original.
        for image in &grid.images.0 {
            let [own, original] = [image.at, image.of].map(|at| {
                let (tile, n) = at.split();
                grid.tiles[tile].before[n]
            });
            let [here, there] = image.places;
            let moment = at(here, own)[2] - at(there, original)[2];
            add(
                -image.mass,
                [own[0] - original[0], own[1] - original[1], moment],
            );
        }
        momentum.map(|p| own * (self.kept - 1.0) * p)
    }

    /// What the points' loss leaves out where others have `taken` (J/m) from the nodes in the same kick: it is a part of what forces
    /// seem to have added.
    pub fn beside(&self, taken: f64) -> f64 {
        (1.0 / self.gained - 1.0) * taken
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
