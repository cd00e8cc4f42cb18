//! Conditions on the walls of the domain. They act on the nodes at a wall and on those beyond it, which all shape
//! functions except linear ones also reach.
//!
//! For B-splines a wall that holds a velocity is a mirror: the velocity that it holds is odd about it, the other even.
//! So both are odd at a fixed wall, that through a slip wall is odd and that along it even, and at a wall that holds
//! the tangential component it is the other way round: even through the wall, as befits the face that is free of normal
//! stress there (held along itself it has no strain along itself, so no strain through the wall either). Nodes beyond
//! the wall are then images of those within ([`crate::state::images`]), and a field that is linear up to the wall stays
//! so. Holding them instead, as for the other shape functions, which hardly reach them, would hold a part of the first
//! cell and shorten the body by it. A wall with friction can separate, so it is not a mirror; velocities are linear across it
//! instead ([`crate::pass::columns`]). It takes hold where the surface of the material is at it ([`crate::pass::gaps`]), of nodes
//! beyond it like of those on it. Forces decide whether it lets go of a node: one that forces have pressed into the wall in a
//! kick is held in the next step too, wherever its mass has come to, and begins it at rest across the wall. What it has from a
//! smoothing transfer then, the motion of material that already returns, would lift it against the force, whose work has no
//! share of that (docs/energy.md).
//!
//! A driven wall is a fixed wall in the frame that moves with it. In that frame it does no work, so in the frame at
//! rest its work is its velocity times its impulse, for every shape function and transfer.

use interface::config::{Wall, Walls};
use serde::{Deserialize, Serialize};

use crate::kernel::tiles::{MARGIN, NODES, node};

/// Largest distance in cells beyond a wall at which a point may be: one, and the margin of a tile's window.
const BEYOND: i64 = 1 + MARGIN as i64;

/// What a wall does to the velocity of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hold {
    Nothing,
    Normal,
    Tangential,
    Everything,
    /// Everything but the velocity of the wall, in m/s.
    Driven([f64; 2]),
    /// Nothing moves into the wall; along it, Coulomb friction with this coefficient.
    Into(f64),
}

/// What walls with friction leave to the next step: along x and y, at the low end and at the high end, for each node of the wall
/// from [`REACH`] before the first on, whether the last kick has pressed it, or a node beyond it, into the wall. Empty for
/// other walls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WallsState([[Vec<bool>; 2]; 2]);

/// The walls, as conditions on nodes.
#[derive(Debug, Clone)]
pub struct WallNodes {
    /// Cells of the domain along x and y.
    pub cells: [i64; 2],
    /// Along x and y: at the low end, at the high end.
    hold: [[Hold; 2]; 2],
    /// Likewise, what stands beyond.
    beyond: [[Beyond; 2]; 2],
    /// Likewise, for each node of a wall with friction from [`REACH`] before the first on, whether material is apart from it:
    /// the sum that is above 0 then ([`crate::pass::gaps`]). Empty for other walls.
    pub apart: [[Vec<f64>; 2]; 2],
    /// Likewise, whether velocities are linear across a wall with friction ([`crate::pass::columns`]).
    linear: [[bool; 2]; 2],
    /// What is saved.
    pub state: WallsState,
}

/// A node's velocity after the walls have acted.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    /// In m/s.
    pub velocity: [f64; 2],
    /// What friction has taken of it in m/s.
    pub rubbed: [f64; 2],
    /// Whether it moved into a wall with friction, across x and across y.
    pub pressed: [bool; 2],
}

/// How many nodes beyond the domain points within it reach at most.
pub const REACH: i64 = 4;

/// Place of `node` in the lists of a wall across `axis`; beyond their ends for a node that no point moves.
fn along(node: [i64; 2], axis: usize) -> usize {
    (node[1 - axis] + REACH) as usize
}

/// What is beyond a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Beyond {
    /// Nodes of their own.
    Nodes,
    /// The other end of the domain.
    OtherEnd,
    /// Mirror images whose velocity is this multiple of that of their originals.
    Mirror([f64; 2]),
}

impl WallNodes {
    /// The walls of a domain of `cells` cells; with `mirrors`, walls that hold a velocity are mirrors.
    pub fn new(walls: &Walls, cells: [i64; 2], mirrors: bool) -> Self {
        let hold = |wall: Wall, axis: usize| match wall {
            Wall::Driven { speed } => {
                Hold::Driven([0, 1].map(|a| if a == axis { 0.0 } else { speed }))
            }
            Wall::Fixed => Hold::Everything,
            Wall::Slip => Hold::Normal,
            Wall::Tangential => Hold::Tangential,
            Wall::Friction { coefficient } => Hold::Into(coefficient),
            Wall::Open | Wall::Periodic => Hold::Nothing,
        };
        let beyond = |wall: Wall, axis: usize| match wall {
            Wall::Periodic => Beyond::OtherEnd,
            Wall::Fixed | Wall::Driven { .. } if mirrors => Beyond::Mirror([-1.0; 2]),
            Wall::Slip if mirrors => {
                Beyond::Mirror([0, 1].map(|a| if a == axis { -1.0 } else { 1.0 }))
            }
            Wall::Tangential if mirrors => {
                Beyond::Mirror([0, 1].map(|a| if a == axis { 1.0 } else { -1.0 }))
            }
            _ => Beyond::Nodes,
        };
        let ends = [[walls.left, walls.right], [walls.bottom, walls.top]];
        let hold = [0, 1].map(|a| ends[a].map(|wall| hold(wall, a)));
        let length = |a: usize, hold| match hold {
            Hold::Into(_) => (cells[1 - a] + 2 * REACH + 1) as usize,
            _ => 0,
        };
        let lengths = [0, 1].map(|a| hold[a].map(|hold| length(a, hold)));
        Self {
            cells,
            linear: hold.map(|of_axis| of_axis.map(|h| mirrors && matches!(h, Hold::Into(_)))),
            hold,
            apart: lengths.map(|of_axis| of_axis.map(|length| vec![0.0; length])),
            state: WallsState(lengths.map(|of_axis| of_axis.map(|length| vec![false; length]))),
            beyond: [0, 1].map(|a| ends[a].map(|wall| beyond(wall, a))),
        }
    }

    /// The components of the velocity of `node` that no wall prescribes: 1 or 0 along x and y.
    pub fn free(&self, node: [i64; 2]) -> [f64; 2] {
        let mut free = [1.0; 2];
        for a in 0..2 {
            match self.at(node, a).0 {
                Hold::Nothing | Hold::Into(_) => {}
                Hold::Normal => free[a] = 0.0,
                Hold::Tangential => free[1 - a] = 0.0,
                Hold::Everything | Hold::Driven(_) => return [0.0; 2],
            }
        }
        free
    }

    /// Velocity in m/s of the driven wall that `node` is on or beyond, if it is.
    pub fn driven(&self, node: [i64; 2]) -> Option<[f64; 2]> {
        [0, 1].into_iter().find_map(|a| match self.at(node, a).0 {
            Hold::Driven(velocity) => Some(velocity),
            _ => None,
        })
    }

    /// Work in J/m of the driven wall at `node`, if there is one, when it changes the velocity of `mass` (kg/m) from
    /// `free` to `held` (m/s).
    pub fn drive(&self, node: [i64; 2], mass: f64, free: [f64; 2], held: [f64; 2]) -> f64 {
        match self.driven(node) {
            None => 0.0,
            Some(wall) => mass * (wall[0] * (held[0] - free[0]) + wall[1] * (held[1] - free[1])),
        }
    }

    /// Whether the tile that begins at `first` can have nodes that are images.
    pub fn have_images(&self, first: [i64; 2]) -> bool {
        let last = first.map(|i| i + crate::kernel::tiles::TILE as i64 - 1);
        (0..2).any(|a| {
            (first[a] < 0 && self.beyond[a][0] != Beyond::Nodes)
                || (last[a] >= self.cells[a] && self.beyond[a][1] != Beyond::Nodes)
        })
    }

    /// What `node` is an image of, the sign of its velocity along x and y, and whether it stands beyond a periodic wall.
    pub fn original(&self, node: [i64; 2]) -> Option<([i64; 2], [f64; 2], bool)> {
        let (mut of, mut sign, mut periodic) = (node, [1.0; 2], false);
        for a in 0..2 {
            let [low, high] = self.beyond[a];
            if low == Beyond::OtherEnd {
                of[a] = of[a].rem_euclid(self.cells[a]);
                periodic |= of[a] != node[a];
                continue;
            }
            // More than one round is needed only if a shape function is wider than the domain.
            loop {
                let turned = match (low, high) {
                    (Beyond::Mirror(turned), _) if of[a] < 0 => {
                        of[a] = -of[a];
                        turned
                    }
                    (_, Beyond::Mirror(turned)) if of[a] > self.cells[a] => {
                        of[a] = 2 * self.cells[a] - of[a];
                        turned
                    }
                    _ => break,
                };
                sign = [sign[0] * turned[0], sign[1] * turned[1]];
            }
        }
        (of != node).then_some((of, sign, periodic))
    }

    /// The nodes of the tile that begins at `origin` on which a wall acts and which points of `w` nodes can reach, a bit for each.
    pub fn acts_on(&self, origin: [i64; 2], w: usize) -> u64 {
        let held = |node: [i64; 2], a: usize| {
            let low = node[a] <= 0 && self.hold[a][0] != Hold::Nothing;
            let high = node[a] >= self.cells[a] && self.hold[a][1] != Hold::Nothing;
            (low || high) && self.reached(node, a, w)
        };
        let bit = |i: usize| u64::from((0..2).any(|a| held(node(origin, i), a))) << i;
        (0..NODES).map(bit).sum()
    }

    /// The nodes beyond and within where velocities are linear across the wall that `node` is on. Within two cells of another wall
    /// with friction they are not, as columns of the two would cross, nor across fewer than three.
    pub fn beside(&self, node: [i64; 2]) -> Option<[[i64; 2]; 2]> {
        let walls = [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter();
        let (axis, end) = walls
            .filter(|&(axis, end)| self.linear[axis][end] && self.cells[axis] > 2)
            .find(|&(axis, end)| node[axis] == [0, self.cells[axis]][end])?;
        let (b, out) = (1 - axis, [-1, 1][end]);
        let crosses = |end: usize, away: i64| self.linear[b][end] && away < 2;
        if crosses(0, node[b]) || crosses(1, self.cells[b] - node[b]) {
            return None;
        }
        Some([out, -out].map(|by| {
            let mut at = node;
            at[axis] += by;
            at
        }))
    }

    /// Whether points of `w` nodes that a wall across `axis` stops can reach `node`.
    pub fn reached(&self, node: [i64; 2], axis: usize, w: usize) -> bool {
        (-BEYOND..=self.cells[axis] + w as i64).contains(&node[axis])
    }

    /// The condition that acts on `node` along `axis`, and the sign of the way out of the domain there.
    fn at(&self, node: [i64; 2], axis: usize) -> (Hold, f64) {
        let (end, out) = if node[axis] <= 0 {
            (0, -1.0)
        } else if node[axis] >= self.cells[axis] {
            (1, 1.0)
        } else {
            return (Hold::Nothing, 0.0);
        };
        let apart = self.apart[axis][end].get(along(node, axis));
        if apart.is_some_and(|&apart| apart > 0.0) && !self.was_pressed(node, axis, end) {
            return (Hold::Nothing, out);
        }
        (self.hold[axis][end], out)
    }

    /// Whether the last kick has pressed the node of a wall with friction that is nearest to `node`, or one beyond that.
    fn was_pressed(&self, node: [i64; 2], axis: usize, end: usize) -> bool {
        let pressed = self.state.0[axis][end].get(along(node, axis));
        pressed == Some(&true)
    }

    /// Forgets which nodes have been pressed.
    pub fn begin_kick(&mut self) {
        for pressed in self.state.0.as_flattened_mut() {
            pressed.fill(false);
        }
    }

    /// Notes that the kick has pressed `node` into the wall with friction across `axis`.
    pub fn press(&mut self, node: [i64; 2], axis: usize) {
        let end = usize::from(node[axis] > 0);
        let column = along(node, axis);
        // Farther out no point moves a node.
        if let Some(pressed) = self.state.0[axis][end].get_mut(column) {
            *pressed = true;
        }
    }

    /// Goes on from a saved state. A wall with friction that it does not know has pressed nothing yet.
    pub fn take_over(&mut self, saved: WallsState) {
        let ends = self.state.0.as_flattened_mut().iter_mut();
        for (own, saved) in ends.zip(saved.0.into_iter().flatten()) {
            if own.len() == saved.len() {
                *own = saved;
            }
        }
    }

    /// The velocity `v` of `node` before a kick or after it, after the walls have acted. After a kick friction can reduce the velocity
    /// along a wall by its coefficient times the velocity into the wall that the wall takes, in the kick and before it: of
    /// that, points have felt `stopped` (m/s). In a corner all that walls take across them goes before friction, so that no axis
    /// comes first; a velocity that another wall holds does not press. Walls with friction act only if that `is_rough`.
    pub fn act(
        &self,
        node: [i64; 2],
        mut v: [f64; 2],
        stopped: Option<[f64; 2]>,
        is_rough: bool,
    ) -> Held {
        let mut rough = [None; 2];
        for a in 0..2 {
            match self.at(node, a) {
                (Hold::Into(coefficient), out) if is_rough && self.free(node)[a] > 0.0 => {
                    rough[a] = Some((coefficient, out));
                }
                (Hold::Nothing | Hold::Into(_), _) => {}
                (Hold::Normal, _) => v[a] = 0.0,
                (Hold::Tangential, _) => v[1 - a] = 0.0,
                (Hold::Everything, _) => v = [0.0; 2],
                (Hold::Driven(velocity), _) => v = velocity,
            }
        }
        let (mut most, mut rubbed, mut pressed) = ([0.0; 2], [0.0; 2], [false; 2]);
        for a in 0..2 {
            let Some((coefficient, out)) = rough[a] else {
                continue;
            };
            let into = (v[a] * out).max(0.0);
            if let Some(stopped) = stopped {
                v[a] -= into * out;
                pressed[a] = into > 0.0;
                most[1 - a] = coefficient * (into + stopped[a] * out).max(0.0);
            } else if into > 0.0 || self.was_pressed(node, a, usize::from(out > 0.0)) {
                v[a] = 0.0;
            }
        }
        for a in 0..2 {
            if most[a] > 0.0 {
                let along = v[a];
                v[a] -= along.clamp(-most[a], most[a]);
                rubbed[a] = along - v[a];
            }
        }
        Held {
            velocity: v,
            rubbed,
            pressed,
        }
    }

    /// Cells that belong to a node: half as many for each wall that holds points and that it lies on.
    pub fn room(&self, node: [i64; 2]) -> f64 {
        let (closed, ends) = (self.closed(), self.cells.map(|last| [0, last]));
        let on = |a: usize| (0..2).any(|end| closed[a][end] && node[a] == ends[a][end]);
        [0, 1]
            .map(|a| if on(a) { 0.5 } else { 1.0 })
            .iter()
            .product()
    }

    /// The node as far within as `node` is beyond walls that hold points and are no mirrors.
    pub fn within(&self, mut node: [i64; 2]) -> [i64; 2] {
        for a in 0..2 {
            let closed = self.closed()[a];
            let own = [0, 1].map(|end| closed[end] && self.beyond[a][end] == Beyond::Nodes);
            if own[0] && node[a] < 0 {
                node[a] = -node[a];
            } else if own[1] && node[a] > self.cells[a] {
                node[a] = 2 * self.cells[a] - node[a];
            }
        }
        node
    }

    /// Whether points may lie a little beyond the wall, because it holds them: along x and y, low and high end.
    pub fn closed(&self) -> [[bool; 2]; 2] {
        self.hold.map(|ends| ends.map(|h| h != Hold::Nothing))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A domain narrower than the function, which random cases have not: from one mirror into the other.
    #[test]
    fn a_node_beyond_two_mirrors_is_an_image_of_an_image() {
        let ends = Walls {
            left: Wall::Slip,
            right: Wall::Fixed,
            ..Walls::default()
        };
        let narrow = WallNodes::new(&ends, [1, 20], true);
        assert_eq!(narrow.original([-2, 5]), Some(([0, 5], [1.0, -1.0], false)));
    }

    /// A corner at the low ends and its mirror image about the diagonal, before a kick and after it, on its way in, out and
    /// along.
    #[test]
    fn in_a_corner_no_axis_comes_first() {
        let rough = Wall::Friction { coefficient: 0.5 };
        let at = |[left, bottom]: [Wall; 2]| {
            let ends = Walls {
                left,
                bottom,
                ..Walls::default()
            };
            WallNodes::new(&ends, [9, 9], false)
        };
        for other in [rough, Wall::Slip, Wall::Tangential, Wall::Fixed, Wall::Open] {
            let [one, mirrored] = [[rough, other], [other, rough]].map(at);
            for v in [[-3.0, -1.0], [-3.0, 1.0], [1.0, -3.0], [-1.0, -3.0]] {
                for stopped in [None, Some([0.0; 2]), Some([-0.25, -2.0])] {
                    let turned = |v: [f64; 2]| [v[1], v[0]];
                    let a = one.act([0, 0], v, stopped, true);
                    let b = mirrored.act([0, 0], turned(v), stopped.map(turned), true);
                    assert_eq!(
                        a.velocity,
                        turned(b.velocity),
                        "{other:?} {v:?} {stopped:?}"
                    );
                    assert_eq!(a.rubbed, turned(b.rubbed), "{other:?} {v:?} {stopped:?}");
                    assert_eq!(a.pressed, [b.pressed[1], b.pressed[0]], "{other:?}");
                }
            }
        }
        // Both are pressed, and nothing is left to rub.
        let corner = at([rough; 2]).act([0, 0], [-3.0, -1.0], Some([0.0; 2]), true);
        assert_eq!((corner.velocity, corner.rubbed), ([0.0; 2], [0.0; 2]));
        assert_eq!(corner.pressed, [true; 2]);
        // What a tangential wall has held before the kick has pressed nothing.
        let held = at([rough, Wall::Tangential]).act([0, 0], [-3.0, 1.0], Some([-2.0, 0.0]), true);
        assert_eq!(held.velocity, [0.0, 1.0]);
    }

    /// Nodes on a wall that holds points have half a cell; beyond a periodic wall the domain goes on, and at an open one too.
    #[test]
    fn a_node_on_a_wall_has_half_of_the_room() {
        let walls = Walls {
            left: Wall::Slip,
            right: Wall::Slip,
            bottom: Wall::Fixed,
            top: Wall::Open,
        };
        let nodes = WallNodes::new(&walls, [4, 6], true);
        let of = |node| nodes.room(node);
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
        assert!((nodes.room([0, 3]) - 1.0).abs() < 1e-15);
    }
}
