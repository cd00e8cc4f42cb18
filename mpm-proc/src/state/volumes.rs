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
            last if last == walls.cells[a] => last + 1,
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

#[cfg(test)]
mod tests {
    use interface::config::{Wall, Walls};

    use super::*;

    /// Nodes on a wall that is a mirror have half a cell; beyond a periodic wall the domain goes on, and at an open one too.
    #[test]
    fn a_node_on_a_wall_has_half_of_the_room() {
        let walls = Walls {
            left: Wall::Slip,
            right: Wall::Slip,
            bottom: Wall::Fixed,
            top: Wall::Open,
        };
        let nodes = WallNodes::new(&walls, [4, 6], true);
        let of = |node| room(&nodes, node);
        assert_eq!(
            [[0, 0], [4, 0], [2, 0], [0, 3]].map(of),
            [0.25, 0.25, 0.5, 0.5]
        );
        assert_eq!([[2, 3], [2, 6], [2, 7]].map(of), [1.0; 3]);
        let around = Walls {
            left: Wall::Periodic,
            right: Wall::Periodic,
            ..walls
        };
        let nodes = WallNodes::new(&around, [4, 6], true);
        assert!((room(&nodes, [0, 3]) - 1.0).abs() < 1e-15);
    }
}
