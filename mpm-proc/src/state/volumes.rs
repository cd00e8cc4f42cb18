//! Volumes of points at the nodes ([`crate::pass::volumes`]).

use super::walls::WallNodes;
use crate::kernel::tiles::NODES;

/// Volumes at the nodes of a tile.
#[derive(Debug, Clone)]
pub struct VolumeNodes {
    /// Number of the node tile.
    pub tile: usize,
    /// `sum_p V_p0 S_Ip` and `sum_p V_p S_Ip` in m^2.
    pub sum: [[f64; 2]; NODES],
    /// Mean volume over the initial one, and the volume for which there is space.
    pub ratio: [[f64; 2]; NODES],
}

impl VolumeNodes {
    /// Those of a node tile, empty.
    pub fn of(tile: usize) -> Self {
        Self {
            tile,
            sum: [[0.0; 2]; NODES],
            ratio: [[1.0; 2]; NODES],
        }
    }
}

/// Cells that belong to a node. For each axis along which it lies on a mirror wall, the number is halved.
pub fn room(walls: &WallNodes, node: [i64; 2]) -> f64 {
    let mut room = 1.0;
    for a in 0..2 {
        let beyond = match node[a] {
            0 => -1,
            last if last == walls.cells()[a] => last + 1,
            _ => continue,
        };
        let mut next = node;
        next[a] = beyond;
        if walls.original(next).is_some_and(|(.., periodic)| !periodic) {
            room *= 0.5;
        }
    }
    room
}
