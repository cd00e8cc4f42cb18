//! The occupied part of the grid: the node tiles that some point's window reaches.

use crate::points::{Cloud, LaneCopy, Tile};
use crate::shape::Shape;
use crate::stages::Damping;
use crate::threads::over_items;
use crate::tiles::{Geometry, MARGIN, TILE, pitch, runs};
use crate::transfer::AffineState;
use crate::walls::WallNodes;
use crate::window::VectorWindow;

/// Nodes of a tile.
pub const NODES: usize = TILE * TILE;

/// Below this mass (kg/m) a node counts as empty. Far below any mass that a shape function can give while its
/// quotients keep their digits.
const EMPTY: f64 = 1e-250;

/// A tile of nodes.
#[derive(Debug, Clone)]
pub struct NodeTile {
    /// Which tile of the grid.
    pub at: [i32; 2],
    /// Number in [`Grid::tiles`].
    pub index: usize,
    /// First of the windows that overlap it, in the grid's list.
    first: u32,
    /// How many do.
    count: u32,
    /// Whether a condition of a wall acts on one of its nodes.
    pub walled: bool,
    /// `m_I` in kg/m.
    pub mass: [f64; NODES],
    /// `1 / m_I` in m/kg, 0 for an empty node.
    pub per_mass: [f64; NODES],
    /// `v_I^{n-1/2}` in m/s, walls obeyed.
    pub before: [[f64; 2]; NODES],
    /// `v_I^{n+1/2}` in m/s.
    pub after: [[f64; 2]; NODES],
    /// Work of damping in the present step in J/m.
    pub damping_work: f64,
    /// Impulse of walls and damping in the present step, as the points feel it, in N s/m.
    pub wall_impulse: [f64; 2],
    /// Work of wall friction in the present step in J/m.
    pub friction_work: f64,
}

/// The window of a cloud's tile that overlaps a node tile.
#[derive(Debug, Clone, Copy)]
struct Overlap {
    cloud: u32,
    tile: u32,
    /// Which run of the window lies in the node tile, along x and y.
    run: [u8; 2],
}

/// What bodies do to the nodes.
#[derive(Debug, Clone)]
pub struct ContactNodes {
    /// `f_I^cont` in N/m (eq. 47).
    pub force: [[f64; 2]; NODES],
    /// `sum_p k_p S_Ip` in N/m per m.
    pub stiffness: [f64; NODES],
    /// `sum_p k_p T_Ip` in N/m per m ([`crate::spread`]).
    pub scattered: [f64; NODES],
}

impl ContactNodes {
    /// Nothing.
    pub const NONE: Self = Self {
        force: [[0.0; 2]; NODES],
        stiffness: [0.0; NODES],
        scattered: [0.0; NODES],
    };
}

/// The occupied part of the grid.
#[derive(Debug)]
pub struct Grid {
    /// The regular grid that it is part of.
    pub geometry: Geometry,
    /// Acceleration of gravity in m/s^2.
    pub gravity: [f64; 2],
    /// Conditions on the walls.
    pub walls: WallNodes,
    /// Node tiles by row and column.
    pub tiles: Vec<NodeTile>,
    /// Contact of each node tile, or nothing where there are no IMPs.
    pub contact: Vec<ContactNodes>,
    overlaps: Vec<Overlap>,
}

impl Grid {
    /// A grid without tiles.
    pub fn new(geometry: Geometry, gravity: [f64; 2], walls: WallNodes) -> Self {
        Self {
            geometry,
            gravity,
            walls,
            tiles: Vec::new(),
            contact: Vec::new(),
            overlaps: Vec::new(),
        }
    }

    /// Lays out node tiles under the windows of all clouds, and tells the clouds' tiles which they are.
    pub fn cover<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        clouds: &mut [Cloud<W, S, A>],
    ) {
        let mut wanted: Vec<([i32; 2], Overlap)> = Vec::new();
        for (c, cloud) in clouds.iter().enumerate() {
            for tile in &cloud.tiles {
                for (i, run) in RUNS_AROUND.iter().enumerate() {
                    let (dx, dy) = (i as i32 % 3 - 1, i as i32 / 3 - 1);
                    wanted.push((
                        [tile.at[1] + dy, tile.at[0] + dx],
                        Overlap {
                            cloud: c as u32,
                            tile: tile.index as u32,
                            run: *run,
                        },
                    ));
                }
            }
        }
        wanted.sort_unstable_by_key(|(at, o)| (*at, o.cloud, o.tile));
        self.tiles.clear();
        self.overlaps.clear();
        for group in wanted.chunk_by(|a, b| a.0 == b.0) {
            let at = [group[0].0[1], group[0].0[0]];
            let number = self.tiles.len() as u32;
            for (_, overlap) in group {
                let around = usize::from(overlap.run[1]) * 3 + usize::from(overlap.run[0]);
                clouds[overlap.cloud as usize].tiles[overlap.tile as usize].around[around] = number;
            }
            self.tiles.push(NodeTile {
                at,
                index: self.tiles.len(),
                first: self.overlaps.len() as u32,
                count: group.len() as u32,
                walled: self.walls.touch(first_node(at)),
                mass: [0.0; NODES],
                per_mass: [0.0; NODES],
                before: [[0.0; 2]; NODES],
                after: [[0.0; 2]; NODES],
                damping_work: 0.0,
                wall_impulse: [0.0; 2],
                friction_work: 0.0,
            });
            self.overlaps.extend(group.iter().map(|(_, o)| *o));
        }
        if !self.contact.is_empty() {
            self.contact.clear();
            self.hold_contact();
        }
    }

    /// Makes room for the contact of bodies.
    pub fn hold_contact(&mut self) {
        self.contact.resize(self.tiles.len(), ContactNodes::NONE);
    }

    /// Sums mass and momentum over the clouds' windows, in their order, and obeys the walls (eqs. 18 to 20).
    ///
    /// `pic_fraction` is the share of the momentum taken away here that the points will feel.
    pub fn sum_momentum<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        grain: usize,
        clouds: &[Cloud<W, S, A>],
        pic_fraction: f64,
    ) {
        let (walls, overlaps) = (&self.walls, &self.overlaps);
        over_items(grain, &mut self.tiles, &|tile: &mut NodeTile| {
            let mut sum = [[0.0; 4]; NODES];
            for o in tile.overlapping(overlaps) {
                let window = &clouds[o.cloud as usize].mass_momentum[o.tile as usize];
                add_window::<W, 4>(&mut sum, &window.0, o);
            }
            tile.wall_impulse = [0.0; 2];
            tile.friction_work = 0.0;
            tile.damping_work = 0.0;
            for (i, sum) in sum.iter().enumerate() {
                tile.mass[i] = sum[0];
            }
            for (per_mass, mass) in tile.per_mass.iter_mut().zip(&tile.mass) {
                *per_mass = if *mass > EMPTY { 1.0 / mass } else { 0.0 };
            }
            for ((v, per_mass), sum) in tile.before.iter_mut().zip(&tile.per_mass).zip(&sum) {
                *v = [sum[1] * per_mass, sum[2] * per_mass];
            }
            if tile.walled {
                let origin = first_node(tile.at);
                for i in 0..NODES {
                    let held = walls.hold(node(origin, i), tile.before[i]);
                    for a in 0..2 {
                        tile.wall_impulse[a] +=
                            pic_fraction * tile.mass[i] * (held[a] - tile.before[i][a]);
                    }
                    tile.before[i] = held;
                }
            }
        });
    }

    /// Velocities `p_I / m_I` of the nodes from the clouds' windows, walls obeyed, without touching the nodes' own.
    /// Returns the impulse of the walls in N s/m.
    pub fn project<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &self,
        clouds: &[Cloud<W, S, A>],
        velocity: &mut [[[f64; 2]; NODES]],
    ) -> [f64; 2] {
        let mut impulse = [0.0; 2];
        for (tile, velocity) in self.tiles.iter().zip(velocity) {
            let mut sum = [[0.0; 4]; NODES];
            for o in tile.overlapping(&self.overlaps) {
                let window = &clouds[o.cloud as usize].mass_momentum[o.tile as usize];
                add_window::<W, 4>(&mut sum, &window.0, o);
            }
            let origin = first_node(tile.at);
            for i in 0..NODES {
                let free = [1, 2].map(|a| sum[i][a] * tile.per_mass[i]);
                velocity[i] = self.walls.hold(node(origin, i), free);
                for a in 0..2 {
                    impulse[a] += tile.mass[i] * (velocity[i][a] - free[a]);
                }
            }
        }
        impulse
    }

    /// `v_I^{n+1/2} = v_I^{n-1/2} + (f_I^int + f_I^cont + m_I g) / m_I kick`, walls obeyed (eqs. 17, 48).
    ///
    /// `damping` is that of the present stage in 1/s ([`crate::stages`]).
    pub fn update<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        grain: usize,
        clouds: &[Cloud<W, S, A>],
        kick: f64,
        damping: f64,
    ) {
        let (walls, overlaps, gravity) = (&self.walls, &self.overlaps, self.gravity);
        let contact = &self.contact;
        let damping = Damping::over(damping, kick);
        over_items(grain, &mut self.tiles, &|tile: &mut NodeTile| {
            let mut force = [[0.0; 2]; NODES];
            for o in tile.overlapping(overlaps) {
                let window = &clouds[o.cloud as usize].force[o.tile as usize];
                add_window::<W, 2>(&mut force, &window.0, o);
            }
            if let Some(contact) = contact.get(tile.index) {
                for (f, c) in force.iter_mut().zip(&contact.force) {
                    f[0] += c[0];
                    f[1] += c[1];
                }
            }
            // An empty node falls like any other; no point will ever ask it.
            let fall = [gravity[0] * kick, gravity[1] * kick];
            let nodes = tile.after.iter_mut().zip(&tile.before);
            for (((after, before), per_mass), f) in nodes.zip(&tile.per_mass).zip(&force) {
                let gain = per_mass * kick;
                for a in 0..2 {
                    after[a] = f[a].mul_add(gain, before[a] + fall[a]);
                }
            }
            let damped = damping.map(|d| d.act(tile));
            if tile.walled {
                let origin = first_node(tile.at);
                for i in 0..NODES {
                    let free = tile.after[i];
                    let held = walls.hold_after_kick(node(origin, i), free);
                    tile.friction_work += tile.mass[i] * walls.slid(node(origin, i), free, held);
                    for a in 0..2 {
                        tile.wall_impulse[a] += tile.mass[i] * (held[a] - free[a]);
                    }
                    tile.after[i] = held;
                }
            }
            if let Some(impulse) = &damped {
                Damping::count(impulse, tile);
            }
        });
    }
}

impl NodeTile {
    fn overlapping<'a>(&self, overlaps: &'a [Overlap]) -> &'a [Overlap] {
        &overlaps[self.first as usize..(self.first + self.count) as usize]
    }
}

/// For each of the 3 x 3 node tiles around a tile, row by row from below, the run of its window that lies there.
const RUNS_AROUND: [[u8; 2]; 9] = [
    [0, 0],
    [1, 0],
    [2, 0],
    [0, 1],
    [1, 1],
    [2, 1],
    [0, 2],
    [1, 2],
    [2, 2],
];

/// The first node of a tile.
pub fn first_node(at: [i32; 2]) -> [i64; 2] {
    at.map(|t| i64::from(t) * TILE as i64)
}

/// Node `i` of the tile that begins at `origin`.
#[inline]
pub fn node(origin: [i64; 2], i: usize) -> [i64; 2] {
    [origin[0] + (i % TILE) as i64, origin[1] + (i / TILE) as i64]
}

/// Adds the part of a window that lies in a node tile; `N` numbers of it belong to one node.
#[inline(always)]
fn add_window<const W: usize, const N: usize>(
    sum: &mut [[f64; N]; NODES],
    window: &[f64],
    overlap: &Overlap,
) {
    let (window, _) = window.as_chunks::<N>();
    let y = runs(W)[usize::from(overlap.run[1])];
    for row in 0..y.length {
        let from = &window[(y.window + row) * pitch(W)..][..pitch(W)];
        let to = &mut sum[(y.own + row) * TILE..][..TILE];
        // Lengths known to the compiler: a few vector additions each, no loops.
        match overlap.run[0] {
            0 => add::<MARGIN, N>(&mut to[TILE - MARGIN..], from),
            1 => add::<TILE, N>(to, &from[MARGIN..]),
            _ => {
                for i in 0..W {
                    add::<1, N>(&mut to[i..], &from[MARGIN + TILE + i..]);
                }
            }
        }
    }
}

#[inline(always)]
fn add<const LENGTH: usize, const N: usize>(to: &mut [[f64; N]], from: &[[f64; N]]) {
    for (to, from) in to[..LENGTH].iter_mut().zip(&from[..LENGTH]) {
        for n in 0..N {
            to[n] += from[n];
        }
    }
}

/// Copies a nodal vector field into the window of a point tile.
#[inline(always)]
pub fn fill_window<'a, const W: usize>(
    window: &mut VectorWindow,
    nodes: &'a [NodeTile],
    tile: &Tile,
    field: impl Fn(&'a NodeTile) -> &'a [[f64; 2]; NODES],
) {
    for run in 0..3 {
        let y = runs(W)[run];
        let nodes_of = |x: usize| field(&nodes[tile.around[3 * run + x] as usize]).as_flattened();
        let (left, own, right) = (nodes_of(0), nodes_of(1), nodes_of(2));
        for row in 0..y.length {
            let to = &mut window.0[2 * (y.window + row) * pitch(W)..][..2 * pitch(W)];
            let from = 2 * (y.own + row) * TILE;
            copy::<{ 2 * MARGIN }>(to, left, from + 2 * (TILE - MARGIN));
            copy::<{ 2 * TILE }>(&mut to[2 * MARGIN..], own, from);
            for i in 0..W {
                copy::<2>(&mut to[2 * (MARGIN + TILE + i)..], right, from + 2 * i);
            }
        }
    }
}

#[inline(always)]
fn copy<const N: usize>(to: &mut [f64], from: &[f64], at: usize) {
    to[..N].copy_from_slice(&from[at..at + N]);
}

/// The node tile, and the node in it, of node `index` of a point tile's window.
pub fn owner<const W: usize>(tile: &Tile, index: usize) -> (usize, usize) {
    let along = |i: usize| {
        let run = if i < runs(W)[1].window {
            0
        } else {
            1 + usize::from(i >= runs(W)[2].window)
        };
        (run, runs(W)[run].own + i - runs(W)[run].window)
    };
    let ((run_x, x), (run_y, y)) = (along(index % pitch(W)), along(index / pitch(W)));
    (tile.around[run_y * 3 + run_x] as usize, y * TILE + x)
}
