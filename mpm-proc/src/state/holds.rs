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
//! combinations of others are left out, and the nodal velocities are unique. Weights over the root of the mass are at
//! most `m_p^-1/2` since `m_I >= m_p S_Ip`, whatever is nearly empty. Nodes beyond mirrors move with their originals, to
//! which their weights go with their sign; nodes that a wall holds have no mobility.
//!
//! The rows are orthogonalised by reflections that reach only the nodes of neighbouring points ([`super::reflections`]).
//! Where the rows leave the nodes nothing, as inside a body that is held in a region of some cells, the velocities of
//! the nodes are zero. Which rows are independent does not depend on masses, and is found once for points that stay.

use core::ops::Range;

use super::nodes::NodeAt;
use super::point_set::PointSet;
use super::reflections::Reflections;

/// All held points.
#[derive(Debug, Default)]
pub struct Holds {
    /// Set by set, in the order of the configuration.
    pub all: Vec<Hold>,
    /// The held points at their present positions.
    pub rows: Vec<Row>,
    /// Weights of the rows, one row after another.
    pub weights: Vec<Weight>,
    /// The nodes that they reach, each once, neighbours near one another.
    pub nodes: Vec<HeldNode>,
    /// Nodes and rows that do not reach one another: where the nodes of each group begin and end, and its rows in the
    /// order of their nodes.
    groups: Vec<Group>,
    /// The allocation of the grid, [`super::grid::Grid::allocations`], and the places of the held points in m for which all
    /// above and the independent rows were found.
    pub found_for: (u64, Vec<[f64; 2]>),
    /// Impulse of the supports on the nodes in the present step, as points feel it, in N s/m, and its moment about the origin in N s.
    pub impulse: [f64; 3],
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

    /// Finds the nodes of new rows and which of these are independent, and orthogonalises the rows with the masses of now.
    /// `mobility` is `1/m_I` in m/kg, 0 along the directions that a wall holds.
    pub fn prepare(&mut self, new: bool, mobility: &dyn Fn(NodeAt) -> [f64; 2]) {
        if new {
            self.number_nodes();
        }
        for node in &mut self.nodes {
            node.mobility = mobility(node.at);
        }
        for a in 0..2 {
            if new {
                self.find_independent(a);
            }
            self.orthogonalise(a);
        }
    }

    /// Numbers the nodes from one end of each group of rows to the other (Cuthill and McKee), and fills in the numbers in
    /// the weights.
    fn number_nodes(&mut self) {
        let mut places: Vec<NodeAt> = self.weights.iter().map(|w| w.at).collect();
        places.sort_unstable();
        places.dedup();
        for weight in &mut self.weights {
            let found = places.binary_search(&weight.at);
            weight.node = found.expect("all are there") as u32;
        }
        let (order, groups) = breadth_first(&self.rows, &self.weights, places.len());
        let mut number = vec![0; order.len()];
        for (n, old) in order.iter().enumerate() {
            number[*old as usize] = n as u32;
        }
        for weight in &mut self.weights {
            weight.node = number[weight.node as usize];
        }
        self.nodes.clear();
        self.nodes.extend(order.iter().map(|old| HeldNode {
            at: places[*old as usize],
            mobility: [0.0; 2],
        }));
        self.groups = groups;
    }

    /// Finds the rows that are independent along an axis, and where they leave the nodes nothing.
    fn find_independent(&mut self, a: usize) {
        let axis = &mut self.axes[a];
        axis.scale.clear();
        let mobile = self.nodes.iter().map(|node| node.mobility[a] > 0.0);
        axis.scale.extend(mobile.map(|m| f64::from(u8::from(m))));
        for group in &mut self.groups {
            let columns = &axis.scale[group.nodes.clone()];
            let mobile = columns.iter().filter(|s| **s > 0.0).count();
            let first = group.nodes.start;
            let reflections = &mut group.reflections[a];
            reflections.begin(columns.len());
            group.independent[a].clear();
            for p in &group.rows {
                let row = &self.rows[*p as usize];
                let entries = row.entries(a, &self.weights, &axis.scale, first);
                if row.along[a] != 0.0 && reflections.take(entries, INDEPENDENT) {
                    group.independent[a].push(*p);
                }
            }
            group.free[a] = group.independent[a].len() < mobile;
        }
    }

    /// Orthogonalises the independent rows along an axis in the inner product of the masses, for [`Self::project`].
    fn orthogonalise(&mut self, a: usize) {
        let axis = &mut self.axes[a];
        axis.scale.clear();
        axis.scale
            .extend(self.nodes.iter().map(|node| node.mobility[a].sqrt()));
        for group in self.groups.iter_mut().filter(|group| group.free[a]) {
            let first = group.nodes.start;
            let reflections = &mut group.reflections[a];
            reflections.begin(group.nodes.len());
            for p in &group.independent[a] {
                let row = &self.rows[*p as usize];
                reflections.take(row.entries(a, &self.weights, &axis.scale, first), 0.0);
            }
        }
    }

    /// Computes the change of the nodal velocities along one axis after which the held points have no velocity. It
    /// replaces the velocities in [`Axis::velocity`].
    pub fn project(&mut self, a: usize) {
        let axis = &mut self.axes[a];
        for group in &mut self.groups {
            let nodes = group.nodes.clone();
            let (v, scale) = (&mut axis.velocity[nodes.clone()], &axis.scale[nodes]);
            if group.free[a] {
                for (v, scale) in v.iter_mut().zip(scale) {
                    *v = if *scale > 0.0 { *v / scale } else { 0.0 };
                }
                group.reflections[a].remove_from(v);
                for (v, scale) in v.iter_mut().zip(scale) {
                    *v *= scale;
                }
            } else {
                for (v, scale) in v.iter_mut().zip(scale) {
                    *v = if *scale > 0.0 { -*v } else { 0.0 };
                }
            }
        }
    }

    /// Adds impulses of the nodes along one axis to the holds, in proportion to the weights of their points at each node.
    pub fn share(&mut self, a: usize, impulses: &[f64]) {
        let Self {
            all, rows, weights, ..
        } = self;
        if let [only] = &mut all[..] {
            only.impulse[a] += impulses.iter().sum::<f64>();
            return;
        }
        let mut total = vec![0.0; impulses.len()];
        let part = |row: &Row, w: &Weight| row.along[a] * w.along[a].abs();
        for row in rows.iter() {
            for w in row.of(weights) {
                total[w.node as usize] += part(row, w);
            }
        }
        for row in rows.iter() {
            for w in row.of(weights).iter().filter(|w| part(row, w) > 0.0) {
                let n = w.node as usize;
                all[row.hold as usize].impulse[a] += impulses[n] * part(row, w) / total[n];
            }
        }
    }
}

/// Nodes in the order of a search in breadth along the rows, and the groups of rows that share no node.
fn breadth_first(rows: &[Row], weights: &[Weight], nodes: usize) -> (Vec<u32>, Vec<Group>) {
    let mut rows_of: Vec<Vec<u32>> = vec![Vec::new(); nodes];
    for (p, row) in rows.iter().enumerate() {
        for w in row.of(weights) {
            rows_of[w.node as usize].push(p as u32);
        }
    }
    let (mut numbered, mut visited) = (vec![false; nodes], vec![false; rows.len()]);
    let (mut order, mut groups) = (Vec::with_capacity(nodes), Vec::new());
    for start in 0..nodes as u32 {
        if numbered[start as usize] {
            continue;
        }
        let (first, mut own_rows, mut next) = (order.len(), Vec::new(), order.len());
        numbered[start as usize] = true;
        order.push(start);
        while next < order.len() {
            for p in &rows_of[order[next] as usize] {
                if core::mem::replace(&mut visited[*p as usize], true) {
                    continue;
                }
                own_rows.push(*p);
                for w in rows[*p as usize].of(weights) {
                    if !core::mem::replace(&mut numbered[w.node as usize], true) {
                        order.push(w.node);
                    }
                }
            }
            next += 1;
        }
        groups.push(Group::new(first..order.len(), own_rows));
    }
    (order, groups)
}

/// Rows that share nodes, and these nodes.
#[derive(Debug)]
struct Group {
    nodes: Range<usize>,
    /// In the order in which the search came to them.
    rows: Vec<u32>,
    /// Those that are independent along x and along y.
    independent: [Vec<u32>; 2],
    /// Whether they leave the nodes a velocity along x and along y.
    free: [bool; 2],
    reflections: [Reflections; 2],
}

impl Group {
    fn new(nodes: Range<usize>, rows: Vec<u32>) -> Self {
        Self {
            nodes,
            rows,
            independent: [Vec::new(), Vec::new()],
            free: [false; 2],
            reflections: [Reflections::default(), Reflections::default()],
        }
    }
}

/// The constraints along one axis, orthogonal in the inner product of the masses: `u = M^-1/2 S`.
#[derive(Debug, Default)]
pub struct Axis {
    /// `m_I^-1/2`; 0 where a wall holds the node.
    scale: Vec<f64>,
    /// Velocities of the nodes in m/s.
    pub velocity: Vec<f64>,
}

/// A row that is this near to others, relative to its size, adds no constraint, because the nodes cannot distinguish it
/// from them. Its point then moves by this share of the motion of the nodes.
const INDEPENDENT: f64 = 1e-6;

impl Row {
    fn of<'a>(&self, weights: &'a [Weight]) -> &'a [Weight] {
        &weights[self.first as usize..(self.first + self.count) as usize]
    }

    /// Its weights along an axis times the scale of their nodes, by the numbers of these after `first`.
    fn entries<'a>(
        &self,
        a: usize,
        weights: &'a [Weight],
        scale: &'a [f64],
        first: usize,
    ) -> impl Iterator<Item = (usize, f64)> + use<'a> {
        self.of(weights).iter().map(move |w| {
            let n = w.node as usize;
            (n - first, scale[n] * w.along[a])
        })
    }
}
