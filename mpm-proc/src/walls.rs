//! Conditions on the walls of the domain. They act on the nodes at a wall and on those beyond it, which shape functions
//! wider than a hat also reach.

use interface::config::{Wall, Walls};

/// What a wall does to the velocity of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hold {
    Nothing,
    Normal,
    Everything,
    /// Nothing moves into the wall; along it, Coulomb friction with this coefficient.
    Into(f64),
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
            Wall::Friction { coefficient } => Hold::Into(coefficient),
            Wall::Open | Wall::Periodic => Hold::Nothing,
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

    /// The condition that acts on `node` along `axis`, and the sign of the way out of the domain there.
    fn at(&self, node: [i64; 2], axis: usize) -> (Hold, f64) {
        if node[axis] <= 0 {
            (self.hold[axis][0], -1.0)
        } else if node[axis] >= self.cells[axis] {
            (self.hold[axis][1], 1.0)
        } else {
            (Hold::Nothing, 0.0)
        }
    }

    /// The velocity of `node` with the walls obeyed, but for friction.
    pub fn hold(&self, node: [i64; 2], v: [f64; 2]) -> [f64; 2] {
        self.act(node, v, 0.0)
    }

    /// The velocity of `node` after a kick, with the walls obeyed: what a wall takes of the velocity into it, times the
    /// coefficient of friction, is what it can take of the velocity along it.
    pub fn hold_after_kick(&self, node: [i64; 2], v: [f64; 2]) -> [f64; 2] {
        self.act(node, v, 1.0)
    }

    fn act(&self, node: [i64; 2], mut v: [f64; 2], friction: f64) -> [f64; 2] {
        for a in 0..2 {
            match self.at(node, a) {
                (Hold::Nothing, _) => {}
                (Hold::Normal, _) => v[a] = 0.0,
                (Hold::Everything, _) => v = [0.0; 2],
                (Hold::Into(coefficient), out) => {
                    let into = (v[a] * out).max(0.0);
                    v[a] -= into * out;
                    let most = friction * coefficient * into;
                    v[1 - a] -= v[1 - a].clamp(-most, most);
                }
            }
        }
        v
    }

    /// Work per mass that friction took between two velocities of a node after a kick, in m^2/s^2.
    pub fn slid(&self, node: [i64; 2], free: [f64; 2], held: [f64; 2]) -> f64 {
        let mut work = 0.0;
        for a in 0..2 {
            if let (Hold::Into(_), _) = self.at(node, a) {
                let along = 1 - a;
                work += 0.5 * (free[along] - held[along]) * (free[along] + held[along]);
            }
        }
        work
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
    fn friction_takes_at_most_its_share_and_lets_go() {
        let friction = Wall::Friction { coefficient: 0.5 };
        let walls = WallNodes::new(
            &Walls {
                bottom: friction,
                ..Walls::default()
            },
            [10, 20],
        );
        assert_eq!(walls.hold_after_kick([5, 0], [3.0, -2.0]), [2.0, 0.0]);
        assert_eq!(walls.hold_after_kick([5, 0], [-0.5, -2.0]), [0.0, 0.0]);
        assert_eq!(walls.hold_after_kick([5, 0], [3.0, 2.0]), [3.0, 2.0]);
        assert_eq!(walls.hold([5, 0], [3.0, -2.0]), [3.0, 0.0]);
    }

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
