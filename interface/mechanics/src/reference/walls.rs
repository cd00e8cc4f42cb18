//! The walls of the oracle: the nodes that are images beyond them, and what they do to velocities.

use interface::config::Wall;

use super::continuum::{Kernel, Reference};
use super::nodes::{Image, Node, Nodes, RIM, driven};

/// What walls leave of a node's velocity.
pub(super) struct Held {
    /// In m/s.
    pub velocity: [f64; 2],
    /// By friction, in m/s.
    pub taken: [f64; 2],
    /// Whether it moved into a wall with friction, across x and across y.
    pub pressed: [bool; 2],
    /// The least speed in m/s at which it moved across a wall with friction that acts on it, if one does.
    pub across: Option<f64>,
}

/// What walls have done to a node.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Obeyed {
    /// Taken of its velocity, in m/s.
    pub stopped: [f64; 2],
    /// Impulse that friction has taken, in N s/m.
    pub rubbed: [f64; 2],
    /// As in [`Held`].
    pub pressed: [bool; 2],
    pub across: Option<f64>,
}

impl Obeyed {
    /// Of a velocity (m/s) with which this mass (kg/m) moved.
    fn of(free: [f64; 2], held: &Held, mass: f64) -> Self {
        Self {
            stopped: [0, 1].map(|a| free[a] - held.velocity[a]),
            rubbed: held.taken.map(|v| mass * v),
            pressed: held.pressed,
            across: held.across,
        }
    }
}

/// When walls act on a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Acting {
    /// Before a kick.
    Mapped,
    /// After a kick before which they have taken this velocity (m/s), as points feel it.
    Kicked([f64; 2]),
    /// Walls with friction let everything pass.
    Free,
}

/// An index along an axis, and all indices at which it appears.
type Along = (i64, Vec<Image<i64>>);

impl Reference {
    /// Along `axis`: numbers of nodes with their places and signs.
    fn along(&self, axis: usize) -> Vec<Along> {
        let n = self.cells[axis];
        let [low, high] = self.config.walls.by_axis()[axis].map(|(_, wall)| wall);
        if low == Wall::Periodic {
            return (0..n)
                .map(|i| (i, [i - n, i, i + n].map(Image::own).to_vec()))
                .collect();
        }
        let mirrors = |wall| self.mirrors(wall, axis);
        let image = |wall, at| {
            let sign = match wall {
                Wall::Slip => [0, 1].map(|a| if a == axis { -1.0 } else { 1.0 }),
                Wall::Tangential => [0, 1].map(|a| if a == axis { 1.0 } else { -1.0 }),
                _ => [-1.0; 2],
            };
            let moves = driven(wall, axis).map_or([0.0; 2], |v| v.map(|v| 2.0 * v));
            Image { at, sign, moves }
        };
        let (first, last) = (
            if mirrors(low) { 0 } else { -RIM },
            if mirrors(high) { n } else { n + RIM },
        );
        (first..=last)
            .map(|i| {
                let mut places = vec![Image::own(i)];
                if mirrors(low) && i > 0 {
                    places.push(image(low, -i));
                }
                if mirrors(high) && i < n {
                    places.push(image(high, 2 * n - i));
                }
                (i, places)
            })
            .collect()
    }

    /// Whether nodes beyond a wall across `axis` are images. One that touches others moves by itself.
    pub(super) fn mirrors(&self, wall: Wall, axis: usize) -> bool {
        let bspline = matches!(self.kernels[axis], Kernel::Quadratic | Kernel::Cubic);
        let open = matches!(wall, Wall::Open | Wall::Friction { .. } | Wall::Periodic);
        bspline && self.config.grid_contact.is_none() && !open
    }

    /// The nodes between these walls.
    pub(super) fn between_walls(&self) -> Nodes {
        let (columns, rows) = (self.along(0), self.along(1));
        let mut nodes = Vec::new();
        for (j, in_column) in &rows {
            for (i, in_row) in &columns {
                let mut places = Vec::new();
                for y in in_column {
                    for x in in_row {
                        places.push(Image {
                            at: [x.at, y.at],
                            sign: [0, 1].map(|a| x.sign[a] * y.sign[a]),
                            // Across a driven wall others are open or periodic.
                            moves: [0, 1].map(|a| x.moves[a] + y.moves[a]),
                        });
                    }
                }
                nodes.push(Node {
                    at: [*i, *j],
                    places,
                });
            }
        }
        Nodes::new(nodes, self.cells)
    }

    /// The walls that act at a node: each with its axis, and the sign of the way out.
    pub(super) fn walls_at(
        &self,
        node: [i64; 2],
    ) -> impl Iterator<Item = (Wall, usize, f64)> + use<> {
        let ends = self.config.walls.by_axis().into_iter().enumerate();
        let cells = self.cells;
        ends.flat_map(move |(axis, [(_, low), (_, high)])| {
            let before = (node[axis] <= 0).then_some((low, axis, -1.0));
            let beyond = (node[axis] >= cells[axis]).then_some((high, axis, 1.0));
            before.into_iter().chain(beyond)
        })
    }

    /// The nodes beyond and within beside one on a wall with friction across which velocities are linear: with B-splines, and not
    /// within two cells of another such wall, nor across fewer than three.
    fn beside(&self, node: [i64; 2]) -> Option<[[i64; 2]; 2]> {
        let bspline = |axis: usize| matches!(self.kernels[axis], Kernel::Quadratic | Kernel::Cubic);
        let rough = |wall: Wall| matches!(wall, Wall::Friction { .. });
        let walls = self.config.walls.by_axis();
        let (_, axis, out) = self.walls_at(node).find(|&(wall, axis, _)| {
            let is_on = self.on_wall(node, axis) == node && self.cells[axis] > 2;
            is_on && rough(wall) && bspline(axis) && self.config.grid_contact.is_none()
        })?;
        let [low, high] = walls[1 - axis].map(|(_, wall)| wall);
        let (j, last) = (node[1 - axis], self.cells[1 - axis]);
        if rough(low) && j < 2 || rough(high) && last - j < 2 {
            return None;
        }
        Some([out, -out].map(|by| {
            let mut at = node;
            at[axis] += by as i64;
            at
        }))
    }

    /// Lets walls act on the velocities of the nodes. Across a wall with friction velocities become linear by the least change by
    /// mass, and the wall acts on the node on it, which moves the mass of all three.
    pub(super) fn obey(
        &self,
        mass: &[f64],
        velocity: &mut [[f64; 2]],
        acting: impl Fn(usize) -> Acting,
    ) -> Vec<Obeyed> {
        let nodes = &self.nodes.list;
        let column = |n: usize| {
            let [beyond, within] = self.beside(nodes[n].at)?;
            Some([self.nodes.at(beyond)?, n, self.nodes.at(within)?])
        };
        let columns: Vec<[usize; 3]> = (0..nodes.len()).filter_map(column).collect();
        let mut obeyed = vec![Obeyed::default(); nodes.len()];
        for n in (0..nodes.len()).filter(|&n| mass[n] > 0.0) {
            let in_column = columns.iter().any(|c| c[..2].contains(&n));
            let acting = if in_column { Acting::Free } else { acting(n) };
            let held = self.act(nodes[n].at, velocity[n], acting);
            obeyed[n] = Obeyed::of(velocity[n], &held, mass[n]);
            velocity[n] = held.velocity;
        }
        for [o, n, i] in columns.into_iter().filter(|[_, n, _]| mass[*n] > 0.0) {
            let per = |n: usize| if mass[n] > 0.0 { 1.0 / mass[n] } else { 0.0 };
            let bend = |v: &[[f64; 2]]| [0, 1].map(|a| v[o][a] - 2.0 * v[n][a] + v[i][a]);
            let mut own = mass[n];
            let straighten = |v: &mut [[f64; 2]], middle: f64| {
                let all = per(o) + 4.0 * middle + per(i);
                for (a, bend) in bend(v).into_iter().enumerate().filter(|_| mass[o] > 0.0) {
                    v[o][a] -= bend / all * per(o);
                    v[n][a] += 2.0 * bend / all * middle;
                    v[i][a] -= bend / all * per(i);
                }
            };
            straighten(velocity, per(n));
            let free = velocity[n];
            let held = self.act(nodes[n].at, free, acting(n));
            velocity[n] = held.velocity;
            straighten(velocity, 0.0);
            if mass[o] > 0.0 {
                own += 4.0 / (per(o) + per(i));
            }
            obeyed[n] = Obeyed::of(free, &held, own);
        }
        obeyed
    }

    /// The velocity that walls leave of one of a node. With friction nothing moves into them, and what the last kick has pressed into
    /// them begins the next at rest across them; of the velocity along them a kick loses as much as across, times their
    /// coefficient. Of two walls in a corner each takes what it takes across before one rubs.
    pub(super) fn act(&self, node: [i64; 2], mut v: [f64; 2], acting: Acting) -> Held {
        for (wall, axis, _) in self.walls_at(node) {
            match wall {
                Wall::Fixed => v = [0.0; 2],
                Wall::Slip => v[axis] = 0.0,
                Wall::Tangential => v[1 - axis] = 0.0,
                Wall::Driven { .. } => v = driven(wall, axis).unwrap_or_default(),
                _ => {}
            }
        }
        let (mut most, mut taken, mut pressed) = ([0.0; 2], [0.0; 2], [false; 2]);
        let mut across: Option<f64> = None;
        for (wall, axis, out) in self.walls_at(node) {
            let Wall::Friction { coefficient } = wall else {
                continue;
            };
            let was_pressed = self.pressed.contains(&(axis, self.on_wall(node, axis)));
            let lets_go = !was_pressed && self.is_apart(node, axis);
            if acting == Acting::Free || self.free(node)[axis] == 0.0 || lets_go {
                continue;
            }
            across = Some(across.map_or(v[axis].abs(), |least| least.min(v[axis].abs())));
            let into = (v[axis] * out).max(0.0);
            v[axis] -= into * out;
            pressed[axis] = into > 0.0;
            if let Acting::Kicked(stopped) = acting {
                most[1 - axis] = coefficient * (into + stopped[axis] * out).max(0.0);
            } else if was_pressed {
                v[axis] = 0.0;
            }
        }
        for a in 0..2 {
            taken[a] = v[a].clamp(-most[a], most[a]);
            v[a] -= taken[a];
        }
        Held {
            velocity: v,
            taken,
            pressed,
            across,
        }
    }

    /// The components of the velocity of a node that no wall prescribes: 1 or 0.
    pub(super) fn free(&self, node: [i64; 2]) -> [f64; 2] {
        let mut walls = self.walls_at(node);
        if walls.any(|(wall, axis, _)| driven(wall, axis).is_some()) {
            return [0.0; 2];
        }
        self.act(node, [1.0; 2], Acting::Free).velocity
    }

    /// The node on a wall across `axis` that is nearest to one on or beyond it.
    pub(super) fn on_wall(&self, node: [i64; 2], axis: usize) -> [i64; 2] {
        let mut at = node;
        at[axis] = node[axis].clamp(0, self.cells[axis]);
        at
    }

    /// Whether the mass that reaches the node of a wall across `axis` which is nearest to `node` is on the whole farther from it
    /// than where its surface is at the wall.
    fn is_apart(&self, node: [i64; 2], axis: usize) -> bool {
        let at = self.on_wall(node, axis);
        let inward = if at[axis] == 0 { 1.0 } else { -1.0 };
        let mut sum = 0.0;
        for p in &self.points {
            let of_wall = self.seen(p).filter(|(n, _)| self.nodes.list[*n].at == at);
            for (_, place) in of_wall {
                let distance = inward * self.distance(p, at)[axis];
                sum += p.mass * self.weight(p, place.at) * (distance - p.touching[axis]);
            }
        }
        sum > 0.0
    }
}
