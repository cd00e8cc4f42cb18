//! Contact of bodies with points in the present step: the nodes that loaded points touch.

use interface::message::wire::ImpForce;

use super::grid::Grid;
use super::nodes::NodeAt;
use crate::kernel::lanes::{LANES, Lanes, ZERO, splat};

/// A row of the nodes that a loaded point touches: `W` of four lanes, the others are 0.
#[derive(Debug, Clone, Copy)]
pub struct TouchRow {
    /// The nodes to which the force is applied.
    pub at: [NodeAt; LANES],
    /// The nodes that move: the same, or the originals of those that are images.
    pub of: [NodeAt; LANES],
    /// `S_Ip`, through which the point takes velocities.
    pub gather: Weighted,
    /// `(-dS_Ip/dy, dS_Ip/dx) / 2` in 1/m, through which it turns and gives couples; 0 where contact has no friction.
    pub curl: [Lanes; 2],
}

/// Shares in the motion or the force of a point, each with its weight there ([`Loaded::weighted`]).
#[derive(Debug, Clone, Copy)]
pub struct Weighted {
    /// `S_Ip`, or `T_Ip`, through which the point gives forces ([`crate::kernel::spread`]).
    pub share: Lanes,
    /// In N/m.
    pub weight: Lanes,
}

/// The nodes that the loaded points touch, `W` rows each.
#[derive(Debug, Default)]
pub struct Touches {
    pub rows: Vec<TouchRow>,
    /// `T_Ip` at these nodes, where it is not `S_Ip`.
    pub scatters: Vec<Weighted>,
}

impl Touches {
    /// Adds a row of a point, with `T_Ip` where it is not `S_Ip`.
    #[inline(always)]
    pub fn push(&mut self, row: TouchRow, scatter: Option<Weighted>) {
        self.rows.push(row);
        self.scatters.extend(scatter);
    }

    /// Gives the `forces` on the points to the nodes, and the weights to those that move.
    pub fn give<const W: usize>(&self, grid: &mut Grid, points: &[Loaded], forces: &[ImpForce]) {
        for (point, loaded) in points.iter().enumerate() {
            let ImpForce { force, couple, .. } = forces[loaded.slot];
            let turns = turns(&forces[loaded.slot]);
            for number in point * W..(point + 1) * W {
                let (row, scatter) = (&self.rows[number], self.scatters.get(number));
                let given = scatter.unwrap_or(&row.gather);
                let parts = [row.gather.share, given.share, row.curl[0], row.curl[1]];
                let [a, b, c, d] = parts.map(|part| part.simd_ne(ZERO));
                let reached = (a | b | c | d).to_bitmask();
                let weights = [row.gather, *given].map(|of| of.weight.to_array());
                let moving = force.map(|f| (given.share * splat(f)).to_array());
                let turning = row.curl.map(|g| (splat(couple) * g).to_array());
                for i in 0..W {
                    let (nodes, node) = grid.touch(row.at[i]);
                    nodes.reached |= u64::from(reached >> i & 1) << node;
                    let of_node = &mut nodes.force[node];
                    for a in 0..2 {
                        of_node[a] += moving[a][i];
                        if turns {
                            of_node[a] += turning[a][i];
                        }
                    }
                    let (nodes, node) = grid.touch(row.of[i]);
                    nodes.stiffness[node] += weights[0][i];
                    if scatter.is_some() {
                        nodes.scattered[node] += weights[1][i];
                    }
                }
            }
        }
    }

    /// Leaves none.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.scatters.clear();
    }
}

/// Whether bodies may turn a point: by a couple, or by friction on its surface.
#[inline(always)]
pub fn turns(force: &ImpForce) -> bool {
    force.couple != 0.0 || force.tangential > 0.0
}

/// A point that a body presses on, or may press on in the next step.
#[derive(Debug, Clone, Copy)]
pub struct Loaded {
    /// Its slot.
    pub slot: usize,
    /// In N/m.
    pub stiffness: f64,
    /// Tangential stiffness on the surface of the point in N/m.
    pub tangential: f64,
    /// Of that surface in m.
    pub radius: f64,
}

impl Loaded {
    /// Shares of its motion at nodes, with its weights there in the bound of the frequency of contact.
    #[inline(always)]
    pub fn weighted(&self, share: Lanes, curl: [Lanes; 2]) -> Weighted {
        let weight = if self.tangential == 0.0 {
            share * splat(self.stiffness)
        } else {
            let turned = splat(self.radius) * (curl[0] * curl[0] + curl[1] * curl[1]).sqrt();
            let moved = share * splat(self.stiffness.max(self.tangential));
            moved.fast_max(splat(0.5 * self.tangential) * turned)
        };
        Weighted { share, weight }
    }
}

/// The contribution of contact to the largest squared frequency.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactLoad {
    /// Bound of `lambda_max(S k S^T M^-1)` in 1/s^2.
    pub omega_sq: f64,
    /// Largest stiffness on a point in N/m.
    pub stiffness: f64,
}
