//! Contact between layers on the nodes that they share (Bardenhagen 2000 eqs. 12 to 23).
//!
//! Where layers have mass at the same node, their velocity there is compared with that of all of them together. If a
//! layer is faster along its outward normal, its normal velocity is set to the common one (eq. 14), and friction
//! reduces the tangential difference up to its limit (eq. 23). In the paper each layer takes the direction from its own
//! density alone, "which results in small errors in momentum conservation". Here the direction of a layer is that of
//! the gradient of its own density less that of the others', so that two layers have the same line. The imbalance of
//! three or more layers is distributed to all in proportion to mass. So momentum is conserved to rounding.

use core::ops::AddAssign;

use mechanics::threads::Threads;
use serde::{Deserialize, Serialize};

use crate::kernel::shape::Shape;
use crate::kernel::threads::{PARTS, over_items};
use crate::kernel::tiles::{NODES, first_node, node};
use crate::kernel::transfer::AffineState;
use crate::pass::images::follow;
use crate::state::continuum::Continuum;
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
    /// The tiles that more than one layer has, by row, column and layer.
    shared: Vec<Shared>,
    /// How often the grids had allocated tiles when these were listed.
    allocations: u64,
    /// What each layer has of them.
    layers: Vec<LayerNodes>,
}

/// The node tile of a layer at a place that others have too.
#[derive(Debug)]
struct Shared {
    /// Row and column.
    at: [i32; 2],
    /// Number of the layer.
    layer: u32,
    /// Number of the tile in the layer's grid.
    tile: u32,
    /// Number among the shared tiles of the layer.
    number: u32,
    /// Its nodes at which the layer has mass and another one too, a bit for each.
    met: u64,
    /// Velocities of those after contact.
    after: [[f64; 2]; NODES],
    /// What contact takes of the layer there.
    lost: Losses,
}

/// What a layer has of the shared tiles.
#[derive(Debug, Default)]
pub struct LayerNodes {
    /// For each of its node tiles, its number among the shared ones, or [`ALONE`].
    numbers: Vec<u32>,
    /// Where its shared tiles stand in the list of all.
    slots: Vec<u32>,
    /// The gradients of its density at the nodes of those that others have met.
    gradients: Vec<Gradients>,
    /// For each of its node tiles, the nodes at which its density counts, a bit for each.
    counted: Vec<u64>,
}

/// One layer at one node.
#[derive(Debug, Clone, Copy)]
struct Party {
    /// Number among the layers at the place.
    of: usize,
    mass: f64,
    /// Before the kick of the step.
    before: [f64; 2],
    velocity: [f64; 2],
    /// Gradient of density.
    gradient: [f64; 2],
    /// The change of velocity by contact: along the normal, and along the surface.
    change: [[f64; 2]; 2],
    lost: Losses,
}

impl SharedNodes {
    /// Finds the nodes where more than one layer has mass.
    pub fn find(&mut self, threads: &Threads, grids: &[&Grid]) {
        let allocations = grids.iter().map(|grid| grid.allocations).sum();
        if allocations != self.allocations {
            self.list(grids);
            self.allocations = allocations;
        }
        over_places(threads, &mut self.shared, |together, _| {
            let (mut once, mut twice) = (0, 0);
            for shared in &mut *together {
                let tile = &grids[shared.layer as usize].tiles[shared.tile as usize];
                shared.met = has_mass(tile);
                twice |= once & shared.met;
                once |= shared.met;
            }
            for shared in together {
                shared.met &= twice;
            }
        });
    }

    /// Lists the tiles that more than one layer has.
    fn list(&mut self, grids: &[&Grid]) {
        let mut tiles = Vec::new();
        self.layers.resize_with(grids.len(), LayerNodes::default);
        for ((layer, grid), own) in (0..).zip(grids).zip(&mut self.layers) {
            let all = grid.tiles.iter();
            tiles.extend(all.map(|t| ([t.at[1], t.at[0]], layer, t.index as u32)));
            own.numbers.clear();
            own.numbers.resize(grid.tiles.len(), ALONE);
            own.slots.clear();
        }
        tiles.sort_unstable();
        self.shared.clear();
        let places = tiles.chunk_by(|a, b| a.0 == b.0);
        for &(at, layer, tile) in places.filter(|together| together.len() > 1).flatten() {
            let own = &mut self.layers[layer as usize];
            let number = own.slots.len() as u32;
            own.numbers[tile as usize] = number;
            own.slots.push(self.shared.len() as u32);
            self.shared.push(Shared {
                at,
                layer,
                tile,
                number,
                met: 0,
                after: [[0.0; 2]; NODES],
                lost: Losses::default(),
            });
        }
        for own in &mut self.layers {
            own.gradients.resize(own.slots.len(), [[0.0; 2]; NODES]);
        }
    }

    /// Computes the gradients of the layers' densities at the nodes where others have mass too.
    pub fn find_gradients<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        threads: &Threads,
        layers: &[&mut Continuum<W, S, A>],
    ) {
        let shared = &self.shared;
        let mut all: Vec<_> = layers.iter().zip(&mut self.layers).collect();
        over_items(threads, &mut all, &|(layer, own)| {
            own.begin(shared, &layer.grid.images);
            own.add_density_gradients(layer);
            own.keep_along_walls(shared, &layer.grid.walls);
        });
    }

    /// Corrects the velocities of approaching layers at every shared node. Returns what that dissipates.
    pub fn touch(&mut self, threads: &Threads, grids: &[&Grid], friction: f64) -> Losses {
        let layers = &self.layers;
        over_places(threads, &mut self.shared, |together, parties| {
            let mut met = 0;
            for shared in &mut *together {
                met |= shared.met;
                shared.lost = Losses::default();
            }
            for i in bits(met) {
                parties.clear();
                for (of, shared) in together.iter().enumerate() {
                    if shared.met >> i & 1 == 1 {
                        let layer = shared.layer as usize;
                        let tile = &grids[layer].tiles[shared.tile as usize];
                        parties.push(Party {
                            of,
                            mass: tile.mass[i],
                            before: tile.before[i],
                            velocity: tile.after[i],
                            gradient: layers[layer].gradients[shared.number as usize][i],
                            change: [[0.0; 2]; 2],
                            lost: Losses::default(),
                        });
                    }
                }
                collide(parties, friction);
                for p in &*parties {
                    together[p.of].after[i] = p.velocity;
                    together[p.of].lost += p.lost;
                }
            }
        });
        let mut lost = Losses::default();
        for shared in &self.shared {
            lost += shared.lost;
        }
        lost
    }

    /// Gives the layers the velocities that contact leaves them.
    pub fn give_back<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        threads: &Threads,
        layers: &mut [&mut Continuum<W, S, A>],
    ) {
        let mut all: Vec<_> = layers.iter_mut().zip(&self.layers).collect();
        over_items(threads, &mut all, &|(layer, own)| {
            let Grid { tiles, images, .. } = &mut layer.grid;
            for &slot in &own.slots {
                let shared = &self.shared[slot as usize];
                for i in bits(shared.met) {
                    tiles[shared.tile as usize].after[i] = shared.after[i];
                }
            }
            follow(images, tiles);
        });
    }
}

impl LayerNodes {
    /// Sets the gradients to zero, and finds the nodes at which the density counts: those where others have mass too, and their
    /// images.
    fn begin(&mut self, shared: &[Shared], images: &Images) {
        self.counted.clear();
        self.counted.resize(self.numbers.len(), 0);
        for (&slot, gradients) in self.slots.iter().zip(&mut self.gradients) {
            let shared = &shared[slot as usize];
            self.counted[shared.tile as usize] = shared.met;
            for i in bits(shared.met) {
                gradients[i] = [0.0; 2];
            }
        }
        for image in &images.0 {
            let [(to, m), (from, n)] = [image.of, image.at].map(NodeAt::split);
            self.counted[from] |= (self.counted[to] >> m & 1) << n;
        }
    }

    /// The nodes of a tile at which the density counts, a bit for each.
    pub fn counted(&self, tile: u32) -> u64 {
        self.counted.get(tile as usize).copied().unwrap_or(0) // none for NO_TILE
    }

    /// The gradients at the nodes of a tile, if others have it too.
    pub fn gradients(&mut self, tile: usize) -> Option<&mut Gradients> {
        self.gradients.get_mut(self.numbers[tile] as usize) // none for ALONE
    }

    /// Removes from the gradients the components across walls that hold nodes. The density ends there, but the layer does not,
    /// and contact must not move what is held. Where nothing but rounding is left, no direction is.
    fn keep_along_walls(&mut self, shared: &[Shared], walls: &WallNodes) {
        for (&slot, gradients) in self.slots.iter().zip(&mut self.gradients) {
            let shared = &shared[slot as usize];
            let origin = first_node([shared.at[1], shared.at[0]]);
            for i in bits(shared.met) {
                let (free, gradient) = (walls.free(node(origin, i)), &mut gradients[i]);
                let whole = gradient[0].hypot(gradient[1]);
                *gradient = [gradient[0] * free[0], gradient[1] * free[1]];
                if gradient[0].hypot(gradient[1]) < ROUNDING * whole {
                    *gradient = [0.0; 2];
                }
            }
        }
    }
}

/// A share of a gradient that is rounding.
const ROUNDING: f64 = 1e-9;

/// Calls `work` with the tiles of every place, and with room for those who meet at a node.
fn over_places(
    threads: &Threads,
    shared: &mut [Shared],
    work: impl Fn(&mut [Shared], &mut Vec<Party>) + Sync,
) {
    let same = |a: &Shared, b: &Shared| a.at == b.at;
    let mut places: Vec<_> = shared.chunk_by_mut(same).collect();
    let part = threads.part(places.len(), PARTS, 1);
    threads.each(places.chunks_mut(part), |places| {
        let mut parties = Vec::new();
        for together in places {
            work(together, &mut parties);
        }
    });
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

/// Contact of the layers at one node.
fn collide(parties: &mut [Party], friction: f64) {
    let (mut mass, mut momentum, mut density) = (0.0, [0.0; 2], [0.0; 2]);
    for p in &*parties {
        mass += p.mass;
        for a in 0..2 {
            momentum[a] += p.mass * p.velocity[a];
            density[a] += p.gradient[a];
        }
    }
    let per_mass = 1.0 / mass;
    let common = momentum.map(|p| p * per_mass); // v_i
    let mut excess = [[0.0; 2]; 2];
    for p in parties.iter_mut() {
        // Away from the layer towards the others; nowhere if their gradients cancel.
        let way = [0, 1].map(|a| density[a] - p.gradient[a] - p.gradient[a]);
        let relative = [0, 1].map(|a| p.velocity[a] - common[a]);
        let along_way = relative[0] * way[0] + relative[1] * way[1];
        if along_way <= 0.0 {
            continue;
        }
        let per_length = 1.0 / (way[0] * way[0] + way[1] * way[1]).sqrt();
        let n = way.map(|c| c * per_length);
        let approach = along_way * per_length; // (12)
        let along = [0, 1].map(|a| relative[a] - approach * n[a]);
        let speed = (along[0] * along[0] + along[1] * along[1]).sqrt();
        let held = if speed > friction * approach {
            friction * approach / speed // (22): slips
        } else {
            1.0 // sticks
        };
        p.change = [n.map(|n| -approach * n), along.map(|v| -held * v)]; // (14), (23)
        for (excess, change) in excess.iter_mut().zip(p.change) {
            for a in 0..2 {
                excess[a] += p.mass * per_mass * change[a];
            }
        }
    }
    // The changes must not change the momentum of the node, so their sum is subtracted from all.
    //
    // The work of an impulse in a kick is the impulse times the mean of the velocities before and after the whole kick.
    // So sticking dissipates nothing: friction removes the energy that forces supplied in the same kick.
    for p in parties {
        for a in 0..2 {
            let [pressed, rubbed] = [0, 1].map(|k| p.change[k][a] - excess[k][a]);
            p.velocity[a] += pressed + rubbed;
            let mean = 0.5 * (p.before[a] + p.velocity[a]);
            p.lost.impact -= p.mass * pressed * mean;
            p.lost.friction -= p.mass * rubbed * mean;
        }
    }
}
