//! Points that are held: kinematic constraints on the nodes through them.
//!
//! A held point p keeps its position if the nodal velocity there is zero, `sum_I S_Ip v_I = 0` in the held directions.
//! As for a frictionless support, the impulses `lambda_p` reach the nodes through the same weights. So of all
//! velocities that keep the points in place, the nodes get those that are nearest to their own in the norm of kinetic
//! energy:
//!
//! ```text
//! v_I <- v_I + sum_p S_Ip lambda_p / m_I,      sum_q (sum_I S_Ip S_Iq / m_I) lambda_q = -sum_I S_Ip v_I
//! ```
//!
//! This is done to the velocities before the kick and to those after it. The constraint then holds at both times, so
//! the supports do no work for any force. Prescribing the velocities of the points instead would not work: the nodes
//! would continue to move, strain the points at rest, and take the momentum of the supports from their neighbours.
//!
//! There may be more held points than nodes, or points with nearly the same weights: rows of weights that are linear
//! combinations of earlier ones are left out, and the nodal velocities are unique. Weights over the root of the mass
//! are at most `m_p^-1/2` since `m_I >= m_p S_Ip`, whatever is nearly empty. Nodes beyond mirrors move with their
//! originals, to which their weights go with their sign; nodes that a wall holds have no mobility. The cost grows with
//! the square of the nodes that are held: it is made for supports, not for bodies.

use super::imps::Member;
use super::nodes::NodeAt;
use super::point_set::PointSet;

/// All held points.
#[derive(Debug, Default)]
pub struct Holds {
    /// Set by set, in the order of the configuration.
    pub all: Vec<Hold>,
    /// The held points at their present positions.
    pub rows: Vec<Row>,
    /// Weights of the rows, one row after another.
    pub weights: Vec<Weight>,
    /// The nodes that they reach, each once.
    pub nodes: Vec<HeldNode>,
    /// Impulse of the supports on the nodes in the present step, as points feel it, in N s/m.
    pub impulse: [f64; 2],
    /// The constraints along x, and along y.
    pub axes: [Axis; 2],
}

/// Points held in the same directions.
#[derive(Debug)]
pub struct Hold {
    /// The points.
    pub points: PointSet,
    /// Whether they are held along x, and along y.
    pub along: [bool; 2],
    /// Impulse of the support on the points in the present step in N s/m.
    pub impulse: [f64; 2],
}

/// A held point.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Number of its hold.
    pub hold: u32,
    /// Directions in which this row holds it: 1 or 0 along x and y. A point of two holds is held once in each direction.
    pub along: [f64; 2],
    /// First of its weights.
    pub first: u32,
    /// How many there are.
    pub count: u32,
}

/// Weight of a node in the velocity of a held point.
#[derive(Debug, Clone, Copy)]
pub struct Weight {
    /// Index in [`Holds::nodes`]; while rows are collected only `at` is valid.
    pub node: u32,
    /// The node, or its original if it is an image.
    pub at: NodeAt,
    /// `S_Ip`, times the sign of the image, along x and y.
    pub along: [f64; 2],
}

/// A node that held points reach.
#[derive(Debug, Clone, Copy)]
pub struct HeldNode {
    /// The node.
    pub at: NodeAt,
    /// `1/m_I` in m/kg; 0 along the directions that a wall holds.
    pub mobility: [f64; 2],
}

impl Holds {
    /// The holds of a configuration.
    pub fn new(all: Vec<Hold>) -> Self {
        Self {
            all,
            ..Self::default()
        }
    }

    /// Whether nothing is held.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// In which directions a point is held.
    pub fn along(&self, of: Member) -> [bool; 2] {
        let mut along = [false; 2];
        for hold in &self.all {
            if hold.points.has(of.cloud, of.local) {
                along = [0, 1].map(|a| along[a] || hold.along[a]);
            }
        }
        along
    }

    /// Numbers the nodes, and fills in the numbers in the weights from their positions.
    pub fn number_nodes(&mut self, mobility: impl Fn(NodeAt) -> [f64; 2]) {
        self.nodes.clear();
        let places = self.weights.iter().map(|w| w.at);
        self.nodes.extend(places.map(|at| HeldNode {
            at,
            mobility: [0.0; 2],
        }));
        self.nodes.sort_unstable_by_key(|n| n.at);
        self.nodes.dedup_by_key(|n| n.at);
        for node in &mut self.nodes {
            node.mobility = mobility(node.at);
        }
        for weight in &mut self.weights {
            let found = self.nodes.binary_search_by_key(&weight.at, |n| n.at);
            weight.node = found.expect("all are there") as u32;
        }
    }

    /// Orthogonalises the weights of the rows along both axes, for [`Self::project`].
    pub fn orthogonalise(&mut self) {
        let Self {
            rows,
            weights,
            nodes,
            axes,
            ..
        } = self;
        for (a, axis) in axes.iter_mut().enumerate() {
            axis.begin(nodes.iter().map(|node| node.mobility[a].sqrt()));
            for (p, row) in rows.iter().enumerate() {
                if row.along[a] == 0.0 {
                    continue;
                }
                axis.row.clear();
                axis.row.resize(nodes.len(), 0.0);
                for w in row.of(weights) {
                    let n = w.node as usize;
                    axis.row[n] += axis.scale[n] * w.along[a];
                }
                axis.take(p as u32);
            }
        }
    }

    /// Computes the change of the nodal velocities along one axis after which the held points have no velocity. It
    /// replaces the velocities in [`Axis::velocity`]. Impulses of the points are added to their holds, times `share`.
    pub fn project(&mut self, a: usize, share: f64) {
        let Self {
            all, rows, axes, ..
        } = self;
        let axis = &mut axes[a];
        for (v, scale) in axis.velocity.iter_mut().zip(&axis.scale) {
            *v = if *scale > 0.0 { *v / scale } else { 0.0 };
        }
        axis.row.clear();
        axis.row.resize(axis.velocity.len(), 0.0);
        let (nodes, rank) = (axis.velocity.len(), axis.taken.len());
        for k in 0..rank {
            let direction = &axis.directions[k * nodes..(k + 1) * nodes];
            let amount = -dot(direction, &axis.velocity);
            for (gain, d) in axis.row.iter_mut().zip(direction) {
                *gain += amount * d;
            }
            // A direction is a sum of its own row and earlier ones.
            let first = k * (k + 1) / 2;
            for (p, share_of_row) in axis.taken.iter().zip(&axis.combined[first..=first + k]) {
                let hold = rows[*p as usize].hold as usize;
                all[hold].impulse[a] += share * amount * share_of_row;
            }
        }
        for ((v, gain), scale) in axis.velocity.iter_mut().zip(&axis.row).zip(&axis.scale) {
            *v = gain * scale;
        }
    }
}

/// The constraints along one axis, made orthogonal in the inner product of the masses (Gram and Schmidt): `u = M^-1/2 S`.
#[derive(Debug, Default)]
pub struct Axis {
    /// `m_I^-1/2`; 0 where a wall holds the node.
    scale: Vec<f64>,
    /// Orthonormal combinations of rows, as long as there are nodes each.
    directions: Vec<f64>,
    /// Rows that have added a direction.
    taken: Vec<u32>,
    /// How much of each of the taken rows is in each direction: 1, 2, 3, ... numbers.
    combined: Vec<f64>,
    /// Velocities of the nodes in m/s.
    pub velocity: Vec<f64>,
    row: Vec<f64>,
    part: Vec<f64>,
}

/// A row that is this near to the rows already taken, relative to its size, adds no constraint, because the nodes
/// cannot distinguish it from them. Its point then moves by this share of the motion of the nodes.
const INDEPENDENT: f64 = 1e-6;

impl Axis {
    fn begin(&mut self, scale: impl Iterator<Item = f64>) {
        self.scale.clear();
        self.scale.extend(scale);
        self.directions.clear();
        self.taken.clear();
        self.combined.clear();
    }

    /// Takes the row in [`Self::row`], number `p`, if it adds a direction.
    fn take(&mut self, p: u32) {
        let (nodes, rank) = (self.row.len(), self.taken.len());
        let size = dot(&self.row, &self.row).sqrt();
        self.part.clear();
        self.part.resize(rank + 1, 0.0);
        // Two rounds are enough (Kahan and Parlett): the rounding error of the first is small compared with the
        // remainder.
        for _ in 0..2 {
            for k in 0..rank {
                let direction = &self.directions[k * nodes..(k + 1) * nodes];
                let amount = dot(direction, &self.row);
                for (r, d) in self.row.iter_mut().zip(direction) {
                    *r -= amount * d;
                }
                let first = k * (k + 1) / 2;
                for (sum, c) in self.part.iter_mut().zip(&self.combined[first..=first + k]) {
                    *sum -= amount * c;
                }
            }
        }
        let left = dot(&self.row, &self.row).sqrt();
        if left <= INDEPENDENT * size {
            return;
        }
        self.part[rank] = 1.0;
        self.directions.extend(self.row.iter().map(|r| r / left));
        self.combined.extend(self.part.iter().map(|c| c / left));
        self.taken.push(p);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Row {
    fn of<'a>(&self, weights: &'a [Weight]) -> impl Iterator<Item = &'a Weight> + use<'a> {
        weights[self.first as usize..(self.first + self.count) as usize].iter()
    }
}
