//! Nodes that are images of others: nodes beyond a wall whose velocities follow from those of nodes within the domain.
//!
//! A node beyond a periodic wall is the node at the other end. A node beyond a wall that holds B-splines is the mirror
//! image of the one as far within ([`crate::state::walls`]): its velocity is `sigma v`, with `sigma` -1 for the
//! components that the wall holds and 1 for the others. Either way the velocities of images are a linear function of
//! those of their originals, `v_image = sigma v`, and the motion of the originals is what is left of d'Alembert's
//! principle:
//!
//! ```text
//! m <- m + m_image,   p <- p + sigma p_image,   f <- f + sigma (f_image + m_image g) - m_image g
//! ```
//!
//! (the last two because `m g` of the sum is added to every node). The mass stays diagonal because `sigma^2 = 1`.
//! Afterwards velocities go the other way. An image has no mass of its own between, so nothing is counted twice.
//!
//! Beyond a driven wall all this is so in the frame of the wall: `v_image = V + sigma (v - V)`.
//!
//! The points feel the image's own mass times `sigma v`. Where sigma is -1, the wall takes up an impulse that the sums
//! over the originals do not contain: `-2 (m_image dv + (f_image + m_image g) kick)` in a kick, and `-2 (m_image v +
//! p_image)` where velocities are computed from momenta.

use interface::impulse::at;

use super::nodes::{NodeAt, NodeTile, WallContribution};
use super::walls::WallNodes;
use crate::kernel::tiles::{Geometry, MARGIN, NODES, TILE, first_node, node};

/// Largest distance in cells beyond a wall at which a point may be: one, and the margin of a tile's window.
const BEYOND: i64 = 1 + MARGIN as i64;

/// An image.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// Its position.
    pub at: NodeAt,
    /// Its original.
    pub of: NodeAt,
    /// Where it and its original are, in m.
    pub places: [[f64; 2]; 2],
    /// Velocity over that of the original.
    pub sign: [f64; 2],
    /// Whether it stands beyond a periodic wall.
    pub periodic: bool,
    /// Velocity of the driven wall in m/s that it stands beyond, if it does.
    pub driven: Option<[f64; 2]>,
    /// `m_I` in kg/m of its own points.
    pub mass: f64,
    /// `p_I` in N s/m likewise.
    pub momentum: [f64; 2],
    /// Force in N/m likewise, with gravity.
    pub force: [f64; 2],
}

/// The images among the nodes of the occupied tiles, by place.
#[derive(Debug, Default)]
pub struct Images(pub Vec<Image>);

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
    pub fn find(
        &mut self,
        geometry: &Geometry,
        walls: &WallNodes,
        w: usize,
        tiles: &mut [NodeTile],
    ) {
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
                    places: [node(first, n), of].map(|node| geometry.place(node)),
                    sign,
                    periodic,
                    driven: walls.driven(node(first, n)),
                    mass: 0.0,
                    momentum: [0.0; 2],
                    force: [0.0; 2],
                });
            }
        }
    }
}

impl Image {
    /// Velocity of the image where that of the original is `v`.
    pub fn velocity(&self, v: [f64; 2]) -> [f64; 2] {
        let turned = [self.sign[0] * v[0], self.sign[1] * v[1]];
        match self.driven {
            None => turned,
            Some(wall) => [0, 1].map(|a| turned[a] + (1.0 - self.sign[a]) * wall[a]),
        }
    }

    /// Momentum in N s/m of its own points, less what the wall gives it at any velocity of the original.
    pub fn free_momentum(&self) -> [f64; 2] {
        match self.driven {
            None => self.momentum,
            Some(wall) => {
                [0, 1].map(|a| self.momentum[a] - self.mass * (1.0 - self.sign[a]) * wall[a])
            }
        }
    }

    /// Counts what the wall gives: an impulse (N s/m) to the points of the image, and its negative, mirrored, to those of the
    /// original.
    pub fn count(&self, own: [f64; 2], wall: &mut WallContribution) {
        let impulse = [0, 1].map(|a| (1.0 - self.sign[a]) * own[a]);
        let back = [0, 1].map(|a| -self.sign[a] * own[a]);
        let [here, there] = self.places;
        let moment = at(here, own)[2] + at(there, back)[2];
        for (sum, of) in (wall.impulse.iter_mut()).zip([impulse[0], impulse[1], moment]) {
            *sum += of;
        }
        if let Some(velocity) = self.driven {
            wall.work += velocity[0] * impulse[0] + velocity[1] * impulse[1];
        }
    }
}

/// The original of a node, if it is an image that points of `w` nodes can reach.
fn original(walls: &WallNodes, w: usize, node: [i64; 2]) -> Option<([i64; 2], [f64; 2], bool)> {
    let reached = |a: usize| (-BEYOND..=walls.cells()[a] + w as i64).contains(&node[a]);
    if reached(0) && reached(1) {
        walls.original(node)
    } else {
        None
    }
}
