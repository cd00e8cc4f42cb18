//! The occupied part of the grid: the node tiles that some point's window reaches.

use crate::kernel::shape::Shape;
use crate::kernel::threads::over_items;
use crate::kernel::tiles::{Geometry, MARGIN, TILE, pitch, runs};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::VectorWindow;
use crate::state::images::{Images, Momenta};
use crate::state::points::{Cloud, LaneCopy, Tile};
use crate::state::stages::Damping;
use crate::state::walls::WallNodes;

/// Nodes of a tile.
pub const NODES: usize = TILE * TILE;

/// [`SeenTile::wanted`] of a whole tile.
pub const ALL_NODES: u64 = u64::MAX;
const _: () = assert!(NODES == u64::BITS as usize);

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
    /// Whether one of its nodes is an image, or has one ([`crate::state::images`]).
    pub imaged: bool,
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

/// What the grid sees of velocities that points have between two steps ([`crate::pass::xpic`], [`crate::pass::drift`]).
#[derive(Debug, Clone)]
pub struct SeenTile {
    /// Number of the node tile.
    tile: u32,
    /// Which of its nodes somebody asks for, a bit for each.
    pub wanted: u64,
    /// Velocities of its nodes in m/s.
    pub velocity: [[f64; 2]; NODES],
    /// Impulse of the walls in N s/m.
    pub impulse: [f64; 2],
}

/// What bodies do to the nodes.
#[derive(Debug, Clone)]
pub struct ContactNodes {
    /// `f_I^cont` in N/m (eq. 47).
    pub force: [[f64; 2]; NODES],
    /// `sum_p k_p S_Ip` in N/m per m.
    pub stiffness: [f64; NODES],
    /// `sum_p k_p T_Ip` in N/m per m ([`crate::kernel::spread`]).
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
    /// What is seen of velocities between two steps, for each node tile; empty where nobody asks.
    pub seen: Vec<SeenTile>,
    /// Nodes that are images of others.
    pub images: Images,
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
            seen: Vec::new(),
            images: Images::default(),
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
        let seen = !self.seen.is_empty();
        self.seen.clear();
        self.overlaps.clear();
        let mut places: Vec<[i32; 2]> = wanted.iter().map(|(at, _)| *at).collect();
        places.dedup();
        Images::complete(&self.walls, W, &mut places);
        let mut rest = &wanted[..];
        for place in places {
            // None where a tile only holds originals of images.
            let (group, others) = rest.split_at(rest.partition_point(|(at, _)| *at == place));
            rest = others;
            let at = [place[1], place[0]];
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
                imaged: false,
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
        self.images.find(&self.walls, W, &mut self.tiles);
        if !self.contact.is_empty() {
            self.contact.clear();
            self.hold_contact();
        }
        if seen {
            self.hold_seen();
        }
    }

    /// Whether there is room for the contact of bodies: all that is saved of a grid. The sum with a force of zero can
    /// turn the sign of a zero, so whether there is one matters to the bit.
    pub fn save(&self) -> bool {
        let Self {
            geometry: _, // of the configuration
            gravity: _,  // likewise
            walls: _,    // likewise
            tiles: _,    // laid out under the points' tiles; what they hold is of one step
            contact,     // zero again before it is used
            seen: _,     // made when somebody asks
            images: _,   // found among the tiles; what they hold is of one step
            overlaps: _, // laid out with the tiles
        } = self;
        !contact.is_empty()
    }

    /// Lays out the grid under clouds that have been restored; `contact` is what [`Self::save`] gave.
    pub fn restore<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        contact: bool,
        clouds: &mut [Cloud<W, S, A>],
    ) {
        self.contact.clear();
        self.cover(clouds);
        if contact {
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
                tile.before[i] = [sum[1], sum[2]];
            }
            if !tile.imaged {
                tile.divide_momentum(walls, pic_fraction);
            }
        });
        if !self.images.is_empty() {
            self.images.gather_momentum(&mut self.tiles);
            over_items(grain, &mut self.tiles, &|tile: &mut NodeTile| {
                if tile.imaged {
                    tile.divide_momentum(walls, pic_fraction);
                }
            });
            self.images.spread_before(&mut self.tiles, pic_fraction);
        }
    }

    /// Velocities `p_I / m_I` of the nodes from the clouds' windows, walls obeyed, into [`Self::seen`] where wanted,
    /// without touching the nodes' own.
    pub fn project<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        grain: usize,
        clouds: &[Cloud<W, S, A>],
    ) {
        let (walls, overlaps, tiles) = (&self.walls, &self.overlaps, &self.tiles);
        over_items(grain, &mut self.seen, &|seen: &mut SeenTile| {
            if seen.wanted == 0 {
                return;
            }
            let tile = &tiles[seen.tile as usize];
            let mut sum = [[0.0; 4]; NODES];
            for o in tile.overlapping(overlaps) {
                let window = &clouds[o.cloud as usize].mass_momentum[o.tile as usize];
                add_window::<W, 4>(&mut sum, &window.0, o);
            }
            for (v, sum) in seen.velocity.iter_mut().zip(&sum) {
                *v = [sum[1], sum[2]];
            }
            seen.impulse = [0.0; 2];
            if !tile.imaged {
                seen.divide_momentum(tile, walls);
            }
        });
        if !self.images.is_empty() {
            self.images.gather_vectors(&mut self.seen);
            over_items(grain, &mut self.seen, &|seen: &mut SeenTile| {
                let tile = &tiles[seen.tile as usize];
                if tile.imaged && seen.wanted != 0 {
                    seen.divide_momentum(tile, walls);
                }
            });
            self.images.spread_vectors(&mut self.seen, 1.0);
        }
    }

    /// Makes room for [`Self::project`].
    pub fn hold_seen(&mut self) {
        let tile = |tile| SeenTile {
            tile,
            wanted: 0,
            velocity: [[0.0; 2]; NODES],
            impulse: [0.0; 2],
        };
        let held = self.seen.len() as u32;
        self.seen.extend((held..self.tiles.len() as u32).map(tile));
    }

    /// Tells `of_points` the cloud and tile of all points that the wanted velocities depend on.
    ///
    /// Where a node is an image, or has one, all images are wanted: they may stand anywhere along the walls.
    pub fn points_behind<const W: usize>(&mut self, mut of_points: impl FnMut(usize, usize)) {
        let imaged = |(tile, seen): (&NodeTile, &SeenTile)| tile.imaged && seen.wanted != 0;
        if self.tiles.iter().zip(&self.seen).any(imaged) {
            for (tile, seen) in self.tiles.iter().zip(&mut self.seen) {
                if tile.imaged {
                    seen.wanted = ALL_NODES;
                }
            }
        }
        let covered = const { covered(W) };
        for (tile, seen) in self.tiles.iter().zip(&self.seen) {
            if seen.wanted == 0 {
                continue;
            }
            for o in tile.overlapping(&self.overlaps) {
                let [x, y] = o.run.map(usize::from);
                if seen.wanted & covered[y][x] != 0 {
                    of_points(o.cloud as usize, o.tile as usize);
                }
            }
        }
    }

    /// `v_I^{n+1/2} = v_I^{n-1/2} + (f_I^int + f_I^cont + m_I g) / m_I kick`, walls obeyed (eqs. 17, 48).
    ///
    /// `damping` is that of the present stage in 1/s ([`crate::state::stages`]).
    pub fn update<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        grain: usize,
        clouds: &[Cloud<W, S, A>],
        kick: f64,
        damping: f64,
    ) {
        let (overlaps, contact, gravity) = (&self.overlaps, &self.contact, self.gravity);
        let act = Kick {
            length: kick,
            gravity,
            damping: Damping::over(damping, kick),
            walls: &self.walls,
        };
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
            if tile.imaged {
                tile.after = force;
            } else {
                tile.kick(&force, &act);
            }
        });
        if !self.images.is_empty() {
            self.images.gather_force(&mut self.tiles, gravity);
            over_items(grain, &mut self.tiles, &|tile: &mut NodeTile| {
                if tile.imaged {
                    let force = tile.after;
                    tile.kick(&force, &act);
                }
            });
            self.images.spread_after(&mut self.tiles, kick);
        }
    }
}

/// What acts on the nodes in a kick besides forces.
struct Kick<'a> {
    /// Its length in s.
    length: f64,
    gravity: [f64; 2],
    damping: Option<Damping>,
    walls: &'a WallNodes,
}

impl Momenta for NodeTile {
    fn vectors(&mut self) -> (&mut [[f64; 2]; NODES], &mut [f64; 2]) {
        (&mut self.before, &mut self.wall_impulse)
    }
}

impl Momenta for SeenTile {
    fn vectors(&mut self) -> (&mut [[f64; 2]; NODES], &mut [f64; 2]) {
        (&mut self.velocity, &mut self.impulse)
    }
}

impl SeenTile {
    /// From momenta to velocities, walls obeyed.
    fn divide_momentum(&mut self, tile: &NodeTile, walls: &WallNodes) {
        let origin = first_node(tile.at);
        for i in 0..NODES {
            let free = self.velocity[i].map(|p| p * tile.per_mass[i]);
            let held = walls.hold(node(origin, i), free);
            for a in 0..2 {
                self.impulse[a] += tile.mass[i] * (held[a] - free[a]);
            }
            self.velocity[i] = held;
        }
    }
}

impl NodeTile {
    /// From momenta, in [`Self::before`], to velocities, walls obeyed.
    fn divide_momentum(&mut self, walls: &WallNodes, pic_fraction: f64) {
        for (per_mass, mass) in self.per_mass.iter_mut().zip(&self.mass) {
            *per_mass = if *mass > EMPTY { 1.0 / mass } else { 0.0 };
        }
        for (v, per_mass) in self.before.iter_mut().zip(&self.per_mass) {
            *v = [v[0] * per_mass, v[1] * per_mass];
        }
        if self.walled {
            let origin = first_node(self.at);
            for i in 0..NODES {
                let held = walls.hold(node(origin, i), self.before[i]);
                for a in 0..2 {
                    self.wall_impulse[a] +=
                        pic_fraction * self.mass[i] * (held[a] - self.before[i][a]);
                }
                self.before[i] = held;
            }
        }
    }

    fn kick(&mut self, force: &[[f64; 2]; NODES], act: &Kick) {
        // An empty node falls like any other; no point will ever ask it.
        let fall = act.gravity.map(|g| g * act.length);
        let nodes = self.after.iter_mut().zip(&self.before);
        for (((after, before), per_mass), f) in nodes.zip(&self.per_mass).zip(force) {
            let gain = per_mass * act.length;
            for a in 0..2 {
                after[a] = f[a].mul_add(gain, before[a] + fall[a]);
            }
        }
        let damped = act.damping.map(|d| d.act(self));
        if self.walled {
            let (origin, walls) = (first_node(self.at), act.walls);
            for i in 0..NODES {
                let free = self.after[i];
                let held = walls.hold_after_kick(node(origin, i), free);
                self.friction_work += self.mass[i] * walls.slid(node(origin, i), free, held);
                for a in 0..2 {
                    self.wall_impulse[a] += self.mass[i] * (held[a] - free[a]);
                }
                self.after[i] = held;
            }
        }
        if let Some(impulse) = &damped {
            Damping::count(impulse, self);
        }
    }

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

/// The nodes of a tile that each run of a window along y and x covers, a bit for each.
const fn covered(w: usize) -> [[u64; 3]; 3] {
    let runs = runs(w);
    let mut covered = [[0; 3]; 3];
    let mut i = 0;
    while i < 9 * NODES {
        let (y, x, node) = (i / NODES / 3, i / NODES % 3, i % NODES);
        let (row, column) = (node / TILE, node % TILE);
        let within_y = runs[y].own <= row && row < runs[y].own + runs[y].length;
        let within_x = runs[x].own <= column && column < runs[x].own + runs[x].length;
        if within_y && within_x {
            covered[y][x] |= 1 << node;
        }
        i += 1;
    }
    covered
}

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
