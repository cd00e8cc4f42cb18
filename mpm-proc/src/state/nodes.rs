//! Node tiles: the data of the nodes.

use interface::impulse::at;

use crate::kernel::tiles::{Geometry, NODES, first_node, node};

/// [`MappedTile::wanted`] if all nodes of the tile are needed.
pub const ALL_NODES: u64 = u64::MAX;
const _: () = assert!(NODES == u64::BITS as usize);

/// The numbers of the bits that are set.
pub fn bits(mut set: u64) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let next = (set != 0).then(|| set.trailing_zeros() as usize)?;
        set &= set - 1;
        Some(next)
    })
}

/// A tile of nodes.
#[derive(Debug, Clone)]
pub struct NodeTile {
    /// Which tile of the grid.
    pub at: [i32; 2],
    /// Number in the list of the grid's node tiles.
    pub index: usize,
    /// First of the windows that overlap it, in the grid's list.
    pub first: u32,
    /// How many do.
    pub count: u32,
    /// Its nodes on which a wall acts and that are no images, a bit for each.
    pub walled: u64,
    /// Those of [`Self::walled`] on which a wall with friction acts by their [`Column`](super::columns::Column), a bit for each.
    pub in_columns: u64,
    /// Whether one of its nodes is an image, or has one ([`crate::state::images`]).
    pub imaged: bool,
    /// `m_I` in kg/m.
    pub mass: [f64; NODES],
    /// `1 / m_I` in m/kg, 0 for an empty node.
    pub per_mass: [f64; NODES],
    /// `v_I^{n-1/2}` in m/s, walls obeyed.
    pub before: [[f64; 2]; NODES],
    /// `v_I^{n+1/2}` in m/s.
    pub after: [[f64; 2]; NODES],
    /// Impulse of damping on each node in the present step in N s/m; none without damping.
    pub damping: Vec<[f64; 2]>,
    /// Work of driven walls on the part of the momentum that is smoothed into the points, in J/m: the transfer takes it on.
    pub smoothing_work: f64,
    /// For each of [`Self::walled`], what walls have taken of its velocity before the kick, as points feel it, in m/s.
    pub stopped: Vec<[f64; 2]>,
    /// What walls and damping give in the present step.
    pub wall: WallContribution,
    /// Impulses of wall friction in the present step in N s/m, with the numbers of the nodes that it acts on.
    pub friction: Vec<(usize, [f64; 2])>,
    /// The nodes that the kick has pressed into walls with friction across x and across y, a bit for each.
    pub pressed: [u64; 2],
}

impl NodeTile {
    /// Whether a wall with friction acts on node `i` by itself, and not by its column.
    pub fn is_alone(&self, i: usize) -> bool {
        self.in_columns >> i & 1 == 0
    }

    /// What damping takes of the nodes in the kick, in J/m.
    pub fn lost_by_damping(&self) -> f64 {
        self.lost(self.damping.iter().copied().enumerate())
    }

    /// What wall friction dissipates in the kick, in J/m.
    pub fn lost_by_friction(&self) -> f64 {
        self.lost(self.friction.iter().copied())
    }

    /// What impulses (N s/m) on nodes in the kick take of their energy, in J/m: each times the mean of the velocities before and
    /// after all that acts on its node, walls, supports and contact on the grid too.
    fn lost(&self, impulses: impl Iterator<Item = (usize, [f64; 2])>) -> f64 {
        let mut work = 0.0;
        for (node, impulse) in impulses {
            for a in 0..2 {
                work -= impulse[a] * (0.5 * (self.before[node][a] + self.after[node][a]));
            }
        }
        work
    }

    /// Kinetic energy that its nodes gain in the kick, in J/m.
    pub fn gained(&self) -> f64 {
        let nodes = self.mass.iter().zip(&self.before).zip(&self.after);
        let twice = nodes.map(|((m, before), after)| {
            let gain = |a: usize| (after[a] - before[a]) * (after[a] + before[a]);
            m * (gain(0) + gain(1))
        });
        0.5 * twice.sum::<f64>()
    }

    /// Momentum of the nodes before the kick in N s/m, and their angular momentum in N s.
    pub fn momentum_before(&self, geometry: &Geometry) -> [f64; 3] {
        let origin = first_node(self.at);
        let mut sum = [0.0; 3];
        for (i, (m, v)) in self.mass.iter().zip(&self.before).enumerate() {
            let of = at(geometry.place(node(origin, i)), *v);
            sum = [0, 1, 2].map(|a| sum[a] + m * of[a]);
        }
        sum
    }
}

/// The window of a cloud's tile that overlaps a node tile.
#[derive(Debug, Clone, Copy)]
pub struct Overlap {
    /// Number of the cloud.
    pub cloud: u32,
    /// Number of the tile in the cloud.
    pub tile: u32,
    /// Which run of the window lies in the node tile, along x and y.
    pub run: [u8; 2],
    /// The first of the rows of that run which points reach, and the one after the last.
    pub rows: [u8; 2],
}

impl Overlap {
    /// Which part of the window lies in the node tile, for [`crate::kernel::window::add_window`].
    pub fn part(&self) -> ([u8; 2], [u8; 2]) {
        (self.run, self.rows)
    }
}

/// Velocities of the points mapped to the nodes of a tile between two steps, for passes that need them there.
#[derive(Debug, Clone)]
pub struct MappedTile {
    /// Number of the node tile.
    pub tile: u32,
    /// Which of its nodes a pass needs, a bit for each.
    pub wanted: u64,
    /// Which of its nodes move points with the mapped velocity, a bit for each ([`crate::pass::drift`]).
    pub moves: u64,
    /// Velocities of its nodes in m/s.
    pub velocity: [[f64; 2]; NODES],
    /// What the walls give.
    pub wall: WallContribution,
}

/// What walls give to the nodes of a tile.
#[derive(Debug, Clone, Copy, Default)]
pub struct WallContribution {
    /// Impulse in N s/m, as the points feel it, and its moment about the origin in N s.
    pub impulse: [f64; 3],
    /// Work of driven walls in J/m.
    pub work: f64,
}

impl WallContribution {
    /// Counts an impulse (N s/m) at a place (m).
    pub fn count(&mut self, place: [f64; 2], impulse: [f64; 2]) {
        for (sum, of) in self.impulse.iter_mut().zip(at(place, impulse)) {
            *sum += of;
        }
    }
}

/// Contact of bodies with the nodes of a tile.
#[derive(Debug, Clone)]
pub struct ContactNodes {
    /// Whether contact has given anything to its nodes in this step. If not, all numbers are 0.
    pub touched: bool,
    /// Its nodes that take forces from points, a bit for each.
    pub reached: u64,
    /// `f_I^cont` in N/m (eq. 47).
    pub force: [[f64; 2]; NODES],
    /// `sum_p k_p S_Ip` in N/m per m, and more with friction (`Loaded::weight`).
    pub stiffness: [f64; NODES],
    /// The same with `T_Ip` ([`crate::kernel::spread`]).
    pub scattered: [f64; NODES],
}

impl ContactNodes {
    /// No contact.
    pub const NONE: Self = Self {
        touched: false,
        reached: 0,
        force: [[0.0; 2]; NODES],
        stiffness: [0.0; NODES],
        scattered: [0.0; NODES],
    };
}

impl NodeTile {
    /// The windows of the clouds' tiles that overlap it, out of the grid's list.
    pub fn overlapping<'a>(&self, overlaps: &'a [Overlap]) -> &'a [Overlap] {
        &overlaps[self.first as usize..(self.first + self.count) as usize]
    }
}

/// A node of a tile.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeAt {
    /// Number of the node tile.
    pub tile: u32,
    /// Number of the node in it.
    pub node: u32,
}

impl NodeAt {
    /// Tile and node as indices.
    pub fn split(self) -> (usize, usize) {
        (self.tile as usize, self.node as usize)
    }
}
