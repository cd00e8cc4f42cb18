//! Conditions on the walls of the domain. They act on the nodes at a wall and on those beyond it, which shape functions
//! wider than a hat also reach.

use interface::config::{Wall, Walls};

/// What a wall does to the velocity of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hold {
    Nothing,
    Normal,
    Everything,
}

/// The walls, as conditions on nodes.
#[derive(Debug, Clone, Copy)]
pub struct WallNodes {
    cells: [i64; 2],
    /// Along x and y: at the low end, at the high end.
    hold: [[Hold; 2]; 2],
}

impl WallNodes {
    /// The walls of a domain of `cells` cells.
    pub fn new(walls: &Walls, cells: [i64; 2]) -> Self {
        let hold = |wall: Wall| match wall {
            Wall::Fixed => Hold::Everything,
            Wall::Slip => Hold::Normal,
            Wall::Open | Wall::Friction { .. } | Wall::Periodic => Hold::Nothing,
        };
        Self {
            cells,
            hold: [
                [hold(walls.left), hold(walls.right)],
                [hold(walls.bottom), hold(walls.top)],
            ],
        }
    }

    /// Whether a wall acts on one of the nodes of the tile that begins at `origin`.
    pub fn touch(&self, origin: [i64; 2]) -> bool {
        let last = origin.map(|i| i + crate::tiles::TILE as i64 - 1);
        (0..2).any(|a| {
            (origin[a] <= 0 && self.hold[a][0] != Hold::Nothing)
                || (last[a] >= self.cells[a] && self.hold[a][1] != Hold::Nothing)
        })
    }

    /// The velocity of `node` with the walls obeyed.
    pub fn hold(&self, node: [i64; 2], mut v: [f64; 2]) -> [f64; 2] {
        for a in 0..2 {
            let hold = if node[a] <= 0 {
                self.hold[a][0]
            } else if node[a] >= self.cells[a] {
                self.hold[a][1]
            } else {
                Hold::Nothing
            };
            match hold {
                Hold::Nothing => {}
                Hold::Normal => v[a] = 0.0,
                Hold::Everything => v = [0.0; 2],
            }
        }
        v
    }

    /// Whether points may lie a little beyond the wall, because it holds them: along x and y, low and high end.
    pub fn closed(&self) -> [[bool; 2]; 2] {
        self.hold.map(|ends| ends.map(|h| h != Hold::Nothing))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_act_at_and_beyond_the_edge_of_the_domain() {
        let walls = WallNodes::new(
            &Walls {
                left: Wall::Slip,
                bottom: Wall::Fixed,
                ..Walls::default()
            },
            [10, 20],
        );
        let v = [1.0, 2.0];
        assert_eq!(walls.hold([1, 1], v), v);
        assert_eq!(walls.hold([0, 1], v), [0.0, 2.0]);
        assert_eq!(walls.hold([-1, 1], v), [0.0, 2.0]);
        assert_eq!(walls.hold([5, 0], v), [0.0, 0.0]);
        assert_eq!(walls.hold([10, 20], v), v);
        assert!(walls.touch([0, 8]) && walls.touch([-8, 8]) && !walls.touch([8, 16]));
    }
}
