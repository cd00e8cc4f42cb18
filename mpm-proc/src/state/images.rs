//! Nodes that are images of others: those beyond a wall of which the nodes within the domain are all that is free.
//!
//! A node beyond a periodic wall is the node at the other end. A node beyond a wall that holds B-splines is the mirror
//! image of the one as far within ([`crate::state::walls`]): its velocity is `sigma v`, with `sigma` -1 for the components that the
//! wall holds and 1 for the others. Either way the velocities of images are a linear function of those of their originals,
//! `v_image = sigma v`, and the motion of the originals is what is left of d'Alembert's principle:
//!
//! ```text
//! m <- m + m_image,   p <- p + sigma p_image,   f <- f + sigma (f_image + m_image g) - m_image g
//! ```
//!
//! (the last two because `m g` of the sum is added to every node). The mass stays diagonal because `sigma^2 = 1`. Afterwards
//! velocities go the other way. An image has no mass of its own between, so nothing is counted twice.
//!
//! What points feel of an image is its own mass times `sigma v`. Where sigma is -1 the wall takes what
//! the originals' own bookkeeping does not show: `-2 (m_image dv + (f_image + m_image g) kick)` in a kick, and
//! `-2 (m_image v + p_image)` where velocities are set from momenta.

use crate::kernel::tiles::{MARGIN, TILE};
use crate::state::grid::{NODES, NodeTile, first_node, node};
use crate::state::walls::WallNodes;

/// Cells beyond a wall at which a point may be: one, and the margin of a tile's window.
const BEYOND: i64 = 1 + MARGIN as i64;

/// A node of a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeAt {
    /// Number of the node tile.
    pub tile: u32,
    /// Number of the node in it.
    pub node: u32,
}

/// An image.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// Where it stands.
    pub at: NodeAt,
    /// What it is an image of.
    pub of: NodeAt,
    /// Velocity over that of the original.
    pub sign: [f64; 2],
    /// Whether it stands beyond a periodic wall.
    pub periodic: bool,
    /// `m_I` in kg/m of its own points.
    mass: f64,
    /// `p_I` in N s/m likewise.
    momentum: [f64; 2],
    /// Force in N/m likewise, with gravity.
    force: [f64; 2],
}

/// Nodes of a tile whose momenta become velocities.
pub trait Momenta {
    /// Momenta in N s/m, then velocities in m/s; and the impulse of walls on the points in N s/m.
    fn vectors(&mut self) -> (&mut [[f64; 2]; NODES], &mut [f64; 2]);
}

/// The images among the nodes of the occupied tiles, by place.
#[derive(Debug, Default)]
pub struct Images(Vec<Image>);

impl Images {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The image at a node, if it is one.
    pub fn at(&self, at: NodeAt) -> Option<&Image> {
        let found = self.0.binary_search_by_key(&at, |image| image.at).ok()?;
        Some(&self.0[found])
    }

    /// Adds to the tiles at `places` (row, column) those that hold originals of their nodes, for shape functions that
    /// touch `w` nodes along each axis; sorted, each once.
    pub fn complete(walls: &WallNodes, w: usize, places: &mut Vec<[i32; 2]>) {
        for i in 0..places.len() {
            let first = first_node([places[i][1], places[i][0]]);
            if !walls.have_images(first) {
                continue;
            }
            for n in 0..NODES {
                if let Some((of, ..)) = original(walls, w, node(first, n)) {
                    let place = of.map(|i| i.div_euclid(TILE as i64) as i32);
                    places.push([place[1], place[0]]);
                }
            }
        }
        places.sort_unstable();
        places.dedup();
    }

    /// Finds the images among the nodes of `tiles`, which are ordered by row and column.
    pub fn find(&mut self, walls: &WallNodes, w: usize, tiles: &mut [NodeTile]) {
        self.0.clear();
        for tile in 0..tiles.len() {
            let first = first_node(tiles[tile].at);
            if !walls.have_images(first) {
                continue;
            }
            for n in 0..NODES {
                let Some((of, sign, periodic)) = original(walls, w, node(first, n)) else {
                    continue;
                };
                let place = of.map(|i| i.div_euclid(TILE as i64) as i32);
                let [x, y] = of.map(|i| i.rem_euclid(TILE as i64) as u32);
                let holder = tiles
                    .binary_search_by_key(&[place[1], place[0]], |t| [t.at[1], t.at[0]])
                    .expect("the tiles were completed");
                tiles[tile].imaged = true;
                tiles[holder].imaged = true;
                self.0.push(Image {
                    at: NodeAt {
                        tile: tile as u32,
                        node: n as u32,
                    },
                    of: NodeAt {
                        tile: holder as u32,
                        node: y * TILE as u32 + x,
                    },
                    sign,
                    periodic,
                    mass: 0.0,
                    momentum: [0.0; 2],
                    force: [0.0; 2],
                });
            }
        }
    }

    /// Moves masses and momenta to the originals.
    pub fn gather_momentum(&mut self, tiles: &mut [NodeTile]) {
        for image in &mut self.0 {
            let (tile, n) = image.at.split();
            image.mass = core::mem::take(&mut tiles[tile].mass[n]);
            let (tile, n) = image.of.split();
            tiles[tile].mass[n] += image.mass;
        }
        self.gather_vectors(tiles);
    }

    /// Moves momenta to the originals.
    pub fn gather_vectors(&mut self, tiles: &mut [impl Momenta]) {
        for image in &mut self.0 {
            let (tile, n) = image.at.split();
            image.momentum = core::mem::take(&mut tiles[tile].vectors().0[n]);
            let (tile, n) = image.of.split();
            let to = &mut tiles[tile].vectors().0[n];
            for a in 0..2 {
                to[a] += image.sign[a] * image.momentum[a];
            }
        }
    }

    /// Gives the images the velocities before the kick, and the masses of their originals for quotients by them.
    pub fn spread_before(&self, tiles: &mut [NodeTile], pic_fraction: f64) {
        for image in &self.0 {
            let (tile, n) = image.of.split();
            let per_mass = tiles[tile].per_mass[n];
            let (tile, n) = image.at.split();
            tiles[tile].per_mass[n] = per_mass;
        }
        self.spread_vectors(tiles, pic_fraction);
    }

    /// Gives the images the velocities that the momenta have become, and counts what the wall has taken there, of which
    /// points feel `share`.
    pub fn spread_vectors(&self, tiles: &mut [impl Momenta], share: f64) {
        for image in &self.0 {
            let (tile, n) = image.of.split();
            let (velocity, impulse) = tiles[tile].vectors();
            let v = velocity[n];
            for a in 0..2 {
                let felt = image.mass * v[a] + image.momentum[a];
                impulse[a] -= share * (1.0 - image.sign[a]) * felt;
            }
            let (tile, n) = image.at.split();
            tiles[tile].vectors().0[n] = image.velocity(v);
        }
    }

    /// Moves forces (in [`NodeTile::after`]) to the originals.
    pub fn gather_force(&mut self, tiles: &mut [NodeTile], gravity: [f64; 2]) {
        for image in &mut self.0 {
            let (tile, n) = image.at.split();
            let force = core::mem::take(&mut tiles[tile].after[n]);
            let weight = gravity.map(|g| image.mass * g);
            image.force = [force[0] + weight[0], force[1] + weight[1]];
            let (tile, n) = image.of.split();
            for a in 0..2 {
                // As much as the original's own gravity will add for the image's mass is taken off.
                let turned = if image.sign[a] < 0.0 {
                    -image.force[a] - weight[a]
                } else {
                    force[a]
                };
                tiles[tile].after[n][a] += turned;
            }
        }
    }

    /// Gives the images the velocities after the kick, and counts what the wall has taken there.
    pub fn spread_after(&self, tiles: &mut [NodeTile], kick: f64) {
        for image in &self.0 {
            let (tile, n) = image.of.split();
            let original = &mut tiles[tile];
            let v = original.after[n];
            for a in 0..2 {
                let felt = image.mass * (v[a] - original.before[n][a]) + kick * image.force[a];
                original.wall_impulse[a] -= (1.0 - image.sign[a]) * felt;
            }
            let (tile, n) = image.at.split();
            tiles[tile].after[n] = image.velocity(v);
        }
    }
}

impl Image {
    /// Velocity of the image where that of the original is `v`.
    fn velocity(&self, v: [f64; 2]) -> [f64; 2] {
        [self.sign[0] * v[0], self.sign[1] * v[1]]
    }
}

impl NodeAt {
    /// Tile and node as indices.
    pub fn split(self) -> (usize, usize) {
        (self.tile as usize, self.node as usize)
    }
}

/// What a node is an image of, if points of `w` nodes can reach it.
fn original(walls: &WallNodes, w: usize, node: [i64; 2]) -> Option<([i64; 2], [f64; 2], bool)> {
    let reached = |a: usize| (-BEYOND..=walls.cells()[a] + w as i64).contains(&node[a]);
    if reached(0) && reached(1) {
        walls.original(node)
    } else {
        None
    }
}
