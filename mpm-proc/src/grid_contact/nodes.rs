//! Contact between layers on the nodes that they share (Bardenhagen 2000 eqs. 12 to 23).
//!
//! Where layers have mass at the same node, their velocity there is compared with that of all of them together. If a
//! layer is faster along its outward normal, its normal velocity is set to the common one (eq. 14), and friction
//! reduces the tangential difference up to its limit (eq. 23). In the paper each layer takes the direction from its own
//! density alone, "which results in small errors in momentum conservation". Here the direction of a layer is that of
//! the gradient of its own density less that of the others', so that two layers have the same line. The imbalance of
//! three or more layers is distributed to all in proportion to mass. So momentum is conserved to rounding.

use core::ops::AddAssign;

use serde::{Deserialize, Serialize};

use crate::kernel::tiles::{NODES, first_node, node};
use crate::state::grid::Grid;
use crate::state::images::Images;
use crate::state::nodes::{NodeAt, NodeTile, bits};
use crate::state::walls::WallNodes;

/// The gradient of a layer's density at the nodes of a tile, up to a factor that is the same for all layers.
pub type Gradients = [[f64; 2]; NODES];

/// Marks a tile that no other layer has.
const ALONE: u32 = u32::MAX;

/// Energies in J/m that contact dissipates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Losses {
    /// By friction.
    pub friction: f64,
    /// By impulses along the normal, since impacts of nodes are inelastic. Negative where they give energy: a node may
    /// part before the kick that presses it on another.
    pub impact: f64,
    /// By a stage's damping, as far as `Damping::loss` leaves it out: what contact has taken looks to it as if forces had given less.
    pub damping: f64,
}

impl AddAssign for Losses {
    fn add_assign(&mut self, other: Self) {
        self.friction += other.friction;
        self.impact += other.impact;
        self.damping += other.damping;
    }
}

/// The nodes on which layers may touch.
#[derive(Debug, Default)]
pub struct SharedNodes {
    /// The tiles that more than one layer has, by row, column and layer, with their gradients.
    shared: Vec<Shared>,
    /// How often the grids had allocated tiles when these were listed.
    allocations: u64,
    /// For each layer and tile of it, its number in `shared`, or [`ALONE`].
    slots: Vec<Vec<u32>>,
    /// For each tile of one layer, the nodes at which its density is wanted, a bit for each.
    counted: Vec<u64>,
}

/// The node tile of a layer at a place that others have too.
#[derive(Debug)]
pub struct Shared {
    /// Row and column.
    pub at: [i32; 2],
    /// Number of the layer.
    pub layer: u32,
    /// Number of the tile in the layer's grid.
    pub tile: u32,
    /// Its nodes at which the layer has mass and another one too, a bit for each.
    pub met: u64,
    /// Gradient of the layer's density at those.
    pub gradient: Gradients,
}

/// One layer at one node.
#[derive(Debug, Clone, Copy)]
struct Party {
    layer: usize,
    tile: usize,
    mass: f64,
    /// Before the kick of the step.
    before: [f64; 2],
    velocity: [f64; 2],
    /// Gradient of density.
    gradient: [f64; 2],
    /// The change of velocity by contact: along the normal, and along the surface.
    change: [[f64; 2]; 2],
}

impl SharedNodes {
    /// Finds the nodes where more than one layer has mass.
    pub fn find<'a>(&mut self, grids: impl Iterator<Item = &'a Grid>) {
        let grids: Vec<&Grid> = grids.collect();
        let allocations = grids.iter().map(|grid| grid.allocations).sum();
        if allocations != self.allocations {
            self.list(&grids);
            self.allocations = allocations;
        }
        for together in self.shared.chunk_by_mut(|a, b| a.at == b.at) {
            let (mut once, mut twice) = (0, 0);
            for shared in &mut *together {
                let tile = &grids[shared.layer as usize].tiles[shared.tile as usize];
                shared.met = has_mass(tile);
                twice |= once & shared.met;
                once |= shared.met;
            }
            for shared in together {
                shared.met &= twice;
                for i in bits(shared.met) {
                    shared.gradient[i] = [0.0; 2];
                }
            }
        }
    }

    /// Lists the tiles that more than one layer has.
    fn list(&mut self, grids: &[&Grid]) {
        let mut tiles = Vec::new();
        self.slots.clear();
        for (layer, grid) in (0..).zip(grids) {
            let own = grid.tiles.iter();
            tiles.extend(own.map(|t| ([t.at[1], t.at[0]], layer, t.index as u32)));
            self.slots.push(vec![ALONE; grid.tiles.len()]);
        }
        tiles.sort_unstable();
        self.shared.clear();
        let places = tiles.chunk_by(|a, b| a.0 == b.0);
        for &(at, layer, tile) in places.filter(|together| together.len() > 1).flatten() {
            self.slots[layer as usize][tile as usize] = self.shared.len() as u32;
            self.shared.push(Shared {
                at,
                layer,
                tile,
                met: 0,
                gradient: [[0.0; 2]; NODES],
            });
        }
    }

    /// A tile of a layer that others have too.
    pub fn shared(&mut self, layer: usize, tile: u32) -> Option<&mut Shared> {
        match self.slots[layer][tile as usize] {
            ALONE => None,
            slot => Some(&mut self.shared[slot as usize]),
        }
    }

    /// Finds the nodes of a layer at which its density counts: those where others have mass too, and their images.
    pub fn count(&mut self, layer: usize, images: &Images) {
        self.counted.clear();
        for &slot in &self.slots[layer] {
            let shared = self.shared.get(slot as usize); // none for ALONE
            self.counted.push(shared.map_or(0, |shared| shared.met));
        }
        for image in &images.0 {
            let [(to, m), (from, n)] = [image.of, image.at].map(NodeAt::split);
            self.counted[from] |= (self.counted[to] >> m & 1) << n;
        }
    }

    /// Those of a tile, a bit for each, of the layer that was asked for last.
    pub fn counted(&self, tile: u32) -> u64 {
        self.counted.get(tile as usize).copied().unwrap_or(0) // none for NO_TILE
    }

    /// Removes from the gradients of a layer the components across walls that hold nodes. The density ends there, but
    /// the layer does not, and contact must not move what is held.
    pub fn keep_along_walls(&mut self, layer: usize, walls: &WallNodes) {
        for &slot in self.slots[layer].iter().filter(|&&slot| slot != ALONE) {
            let shared = &mut self.shared[slot as usize];
            let origin = first_node([shared.at[1], shared.at[0]]);
            for i in bits(shared.met) {
                let (free, gradient) = (walls.free(node(origin, i)), &mut shared.gradient[i]);
                *gradient = [gradient[0] * free[0], gradient[1] * free[1]];
            }
        }
    }

    /// The shared tiles, place by place; in each the tiles of the layers that have it.
    fn places(&self) -> impl Iterator<Item = &[Shared]> {
        self.shared.chunk_by(|a, b| a.at == b.at)
    }

    /// Corrects the velocities of approaching layers at every shared node. `nodes` are the tiles of each layer.
    pub fn touch(&self, nodes: &mut [&mut [NodeTile]], friction: f64) -> Losses {
        let mut losses = Losses::default();
        let mut parties = Vec::new();
        for together in self.places() {
            for i in bits(together.iter().fold(0, |met, shared| met | shared.met)) {
                parties.clear();
                parties.extend(together.iter().filter_map(|shared| {
                    let tile = &nodes[shared.layer as usize][shared.tile as usize];
                    (shared.met >> i & 1 == 1).then_some(Party {
                        layer: shared.layer as usize,
                        tile: shared.tile as usize,
                        mass: tile.mass[i],
                        before: tile.before[i],
                        velocity: tile.after[i],
                        gradient: shared.gradient[i],
                        change: [[0.0; 2]; 2],
                    })
                }));
                if parties.len() > 1 {
                    losses += collide(&mut parties, friction);
                    for p in &parties {
                        nodes[p.layer][p.tile].after[i] = p.velocity;
                    }
                }
            }
        }
        losses
    }
}

/// The nodes of a tile that have mass, a bit for each. An image counts as without mass: its original is in contact with
/// others, and the image follows it.
fn has_mass(tile: &NodeTile) -> u64 {
    let mut has = 0;
    for i in 0..NODES {
        has |= u64::from(tile.per_mass[i] > 0.0 && tile.mass[i] > 0.0) << i;
    }
    has
}

/// The unit vector away from a layer towards others, by the gradients of their densities; `None` if these cancel.
fn way_out(own: [f64; 2], others: [f64; 2]) -> Option<[f64; 2]> {
    let way = [0, 1].map(|a| others[a] - own[a]);
    let length = (way[0] * way[0] + way[1] * way[1]).sqrt();
    (length > 0.0).then(|| way.map(|c| c / length))
}

/// Contact of the layers at one node.
fn collide(parties: &mut [Party], friction: f64) -> Losses {
    let mass: f64 = parties.iter().map(|p| p.mass).sum();
    let (mut common, mut density) = ([0.0; 2], [0.0; 2]); // v_i
    for p in &*parties {
        for a in 0..2 {
            common[a] += p.mass * p.velocity[a] / mass;
            density[a] += p.gradient[a];
        }
    }
    for p in parties.iter_mut() {
        let others = [0, 1].map(|a| density[a] - p.gradient[a]);
        let Some(n) = way_out(p.gradient, others) else {
            continue;
        };
        let relative = [0, 1].map(|a| p.velocity[a] - common[a]);
        let approach = relative[0] * n[0] + relative[1] * n[1]; // (12)
        if approach > 0.0 {
            let along = [0, 1].map(|a| relative[a] - approach * n[a]);
            let speed = (along[0] * along[0] + along[1] * along[1]).sqrt();
            let held = if speed > friction * approach {
                friction * approach / speed // (22): slips
            } else {
                1.0 // sticks
            };
            p.change = [n.map(|n| -approach * n), along.map(|v| -held * v)]; // (14), (23)
        }
    }
    // The changes must not change the momentum of the node, so their sum is subtracted from all.
    let excess = [0, 1].map(|k| {
        let total = |a: usize| parties.iter().map(|p| p.mass * p.change[k][a]).sum::<f64>() / mass;
        [total(0), total(1)]
    });
    // The work of an impulse in a kick is the impulse times the mean of the velocities before and after the whole kick.
    // So sticking dissipates nothing: friction removes the energy that forces supplied in the same kick.
    let mut losses = Losses::default();
    for p in parties {
        for a in 0..2 {
            let [pressed, rubbed] = [0, 1].map(|k| p.change[k][a] - excess[k][a]);
            p.velocity[a] += pressed;
            p.velocity[a] += rubbed;
            let mean = 0.5 * (p.before[a] + p.velocity[a]);
            losses.impact -= p.mass * pressed * mean;
            losses.friction -= p.mass * rubbed * mean;
        }
    }
    losses
}
