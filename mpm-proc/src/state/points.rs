//! The points of one group, four to a block, sorted by tile and within a tile by cell.
//!
//! All points of a group share mass, initial volume and shape function, so a point stores only what differs. They stay
//! sorted until one has moved by a cell since the last sorting (as in a Verlet list), see [`crate::kernel::tiles`].

use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::kernel::blocks::{PointBlock, reorder, reorder_rows};
use crate::kernel::lanes::{LANES, Lanes, ZERO, splat};
use crate::kernel::point_tile::{SortedTile, Tile};
use crate::kernel::shape::Shape;
use crate::kernel::threads::over_groups;
use crate::kernel::tiles::{Geometry, NODES, TILE};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::{NO_MOMENTUM, NO_VECTORS, NodalWindow, VectorWindow};
use crate::material::{Constitutive, Stressed, Stresses};
use crate::state::loads::{LastLoad, Loads};
use crate::state::saved::refusal;
use mechanics::threads::Threads;

/// In [`CloudState::ids`]: a lane without a point. Such lanes fill up the last block of a tile. They have no mass and move
/// with the first point of their tile, so that their numbers stay finite.
pub const NO_POINT: u32 = u32::MAX;

/// Velocities of four points.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Motion<A> {
    /// `v_p^{n-1/2}` in m/s.
    pub v: [Lanes; 2],
    /// Affine part.
    pub affine: A,
}

impl<A: AffineState> PointBlock for Motion<A> {
    const NUMBERS: usize = 2 + A::NUMBERS;

    #[inline]
    fn number(&mut self, n: usize) -> &mut Lanes {
        match n {
            0 | 1 => &mut self.v[n],
            _ => self.affine.number(n - 2),
        }
    }
}

/// How fast the points of a tile moved, and how far they reach: reported by the pass that moves them.
#[derive(Debug, Clone, Copy, Default)]
pub struct TileReport {
    /// Largest squared speed at which a point of the tile moved, in m^2/s^2.
    pub speed_sq: f64,
    /// Sum of squares of the new velocities: finite if, and in practice only if, all of them are.
    pub sum: f64,
    /// Smallest coordinates in m.
    pub lower: [f64; 2],
    /// Largest coordinates in m.
    pub upper: [f64; 2],
    /// Largest bound of a point's squared frequency in 1/s^2, where they are computed one by one ([`crate::pass::limits`]).
    pub omega_sq: f64,
    /// What the transfer has taken of kinetic energy in this kick, twice and per mass, summed over points, in m^2/s^2.
    pub taken: f64,
    /// Likewise what damping has taken.
    pub damped: f64,
}

/// What the stress pass reports of a tile.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct StressReport {
    /// Largest stiffness over density of its points in m^2/s^2; it bounds the next step.
    pub stiffness: f64,
    /// Work per initial volume lost to plastic flow and to viscous stress in this step, summed over points, in Pa.
    pub lost: [f64; 2],
    /// Work per initial volume of the stress in this step, summed over points, in Pa.
    pub work: f64,
}

/// The data that all points of a group share.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Mass of a point in kg/m.
    pub mass: f64,
    /// Contact radius in m.
    pub radius: f64,
    /// [`crate::pass::gaps::touching`] along x and y.
    pub touching: [f64; 2],
    /// Sides of a point's box in m.
    pub sides: [f64; 2],
    /// [`Cloud::spread`].
    pub spread: Option<[f64; 2]>,
    /// Whether the nodes are given the spin of the group.
    pub keeps_spin: bool,
}

/// The points of one group.
pub struct Cloud<const W: usize, S: Shape<W>, A: AffineState> {
    /// Shape function, with the half width of the points' boxes where it has one.
    pub shape: S,
    /// Constitutive model.
    pub material: Box<dyn Constitutive>,
    /// Loads besides gravity and bodies.
    pub loads: Option<Box<Loads>>,
    /// Mass of a point in kg/m.
    pub mass: f64,
    /// Initial volume of a point in m^2.
    pub volume: f64,
    /// Contact radius in m.
    pub radius: f64,
    /// Mean distance in cells of its mass from walls that it touches, along x and y ([`crate::pass::gaps`]).
    pub touching: [f64; 2],
    /// Half widths along x and y, in cells, of the boxes over which contact forces are spread ([`crate::kernel::spread`]); `None`: by
    /// the shape function.
    pub spread: Option<[f64; 2]>,
    /// Spin of the group at the last map to the grid in rad/s, where the nodes are given it.
    pub spin: Option<f64>,
    /// Identity of the first point; the others follow.
    pub first_id: u64,
    /// What a step leaves to the next one.
    pub state: CloudState<A>,
    /// Velocities before the kick, set aside while XPIC filters what is left of them; empty
    /// otherwise.
    pub aside: Vec<[Lanes; 2]>,
    /// Lane of each point, by identity less `first_id`; [`NO_POINT`] once it has been removed.
    pub lane_of: Vec<u32>,
    /// How many points have been removed.
    pub removed: usize,
    /// Tiles with points: those of the state, with their places.
    pub tiles: Vec<Tile>,
    /// Number of the tile of each block.
    tile_of: Vec<u32>,
    /// `(m_I, p_I, 0)` in each tile's window, of this cloud's points alone.
    pub mass_momentum: Vec<NodalWindow>,
    /// `f_I^int` likewise, in N/m ([`crate::kernel::window`]).
    pub force: Vec<VectorWindow>,
    /// Report of each tile.
    pub reports: Vec<TileReport>,
    scratch: Scratch,
}

/// The state of a cloud's points, all of which is saved; in its present order, since sums depend on it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CloudState<A> {
    /// Tiles with points, ordered by row and column.
    pub tiles: Vec<SortedTile>,
    /// Identity of each lane's point less the cloud's first, or [`NO_POINT`].
    pub ids: Vec<[u32; LANES]>,
    /// `x_p^n` in m.
    pub x: Vec<[Lanes; 2]>,
    /// Velocities.
    pub motion: Vec<Motion<A>>,
    /// How far the points have moved by a velocity that is still to be compared with the field of their strains, in m
    /// ([`crate::pass::drift`]).
    pub unsettled: Vec<[Lanes; 2]>,
    /// Stress, volume and further numbers of the material.
    pub stresses: Stresses,
    /// Report of the stress pass for each tile.
    pub stress_reports: Vec<StressReport>,
}

/// What sorting needs.
#[derive(Default)]
struct Scratch {
    /// One number of each point.
    number: Vec<Lanes>,
    /// Halves of the key of a point's cell, and its lane: 12 bytes.
    keys: Vec<([u32; 2], u32)>,
    sources: Vec<u32>,
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    /// Points of one `kind` at `positions` (m) with `velocities` (m/s); not sorted yet.
    pub fn new(
        shape: S,
        (material, stresses): (Box<dyn Constitutive>, Stresses),
        kind: &Kind,
        first_id: u64,
        positions: &[[f64; 2]],
        velocities: &[[f64; 2]],
        loads: Option<Box<Loads>>,
    ) -> Self {
        let blocks = positions.len().div_ceil(LANES);
        let [x, v] = [positions, velocities].map(|values| {
            let mut lanes = vec![[ZERO; 2]; blocks];
            for (i, value) in values.iter().enumerate() {
                for a in 0..2 {
                    lanes[i / LANES][a].as_mut_array()[i % LANES] = value[a];
                }
            }
            lanes
        });
        let count = positions.len() as u32;
        Self {
            shape,
            material,
            mass: kind.mass,
            volume: kind.sides[0] * kind.sides[1],
            radius: kind.radius,
            touching: kind.touching,
            spread: kind.spread,
            spin: kind.keeps_spin.then_some(0.0),
            first_id,
            state: CloudState {
                tiles: Vec::new(),
                ids: (0..blocks as u32)
                    .map(|b| {
                        [0, 1, 2, 3].map(|k| {
                            let id = b * LANES as u32 + k;
                            if id < count { id } else { NO_POINT }
                        })
                    })
                    .collect(),
                x,
                motion: v
                    .into_iter()
                    .map(|v| Motion {
                        v,
                        affine: A::default(),
                    })
                    .collect(),
                unsettled: vec![[ZERO; 2]; blocks],
                stresses,
                stress_reports: Vec::new(),
            },
            aside: Vec::new(),
            loads,
            lane_of: (0..count).collect(),
            removed: 0,
            tiles: Vec::new(),
            tile_of: Vec::new(),
            mass_momentum: Vec::new(),
            force: Vec::new(),
            reports: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Calls `work` with every cloud, and with the threads that share its tiles.
    pub fn each(threads: &Threads, clouds: &mut [Self], work: impl Fn(&Threads, &mut Self) + Sync) {
        over_groups(threads, clouds, |cloud| cloud.tiles.len(), &work);
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.lane_of.len() - self.removed
    }

    /// Mass of all points in kg/m.
    pub fn total_mass(&self) -> f64 {
        self.mass * self.len() as f64
    }

    /// Position of a lane's point in m.
    pub fn position(&self, lane: usize) -> [f64; 2] {
        of_lane(&self.state.x[lane / LANES], lane)
    }

    /// Velocity of a lane's point in m/s.
    pub fn velocity(&self, lane: usize) -> [f64; 2] {
        of_lane(&self.state.motion[lane / LANES].v, lane)
    }

    /// Kinetic energy of a lane's point in J/m, with that of its affine part.
    pub fn kinetic_of(&self, lane: usize) -> f64 {
        let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
        let mut twice = square(self.velocity(lane));
        if A::PRESENT {
            let slopes = self.state.motion[lane / LANES].affine.slopes();
            let affine: f64 = slopes.iter().map(|s| square(of_lane(s, lane))).sum();
            twice += affine / S::INVERSE_INERTIA.unwrap_or(1.0);
        }
        0.5 * self.mass * twice
    }

    /// Angular momentum of a lane's point about the origin in N s, with that of its affine part, on cells of `cell` (m).
    pub fn angular_momentum_of(&self, lane: usize, cell: f64) -> f64 {
        self.angular_momentum_of_block(lane / LANES, cell)
            .as_array()[lane % LANES]
    }

    /// The same of the points of a block.
    pub fn angular_momentum_of_block(&self, block: usize, cell: f64) -> Lanes {
        let (x, motion) = (&self.state.x[block], &self.state.motion[block]);
        let mut turning = x[0] * motion.v[1] - x[1] * motion.v[0];
        if A::PRESENT {
            let [along_x, along_y] = motion.affine.slopes();
            let inertia = cell / S::INVERSE_INERTIA.unwrap_or(1.0);
            turning += (along_x[1] - along_y[0]) * splat(inertia);
        }
        turning * splat(self.mass)
    }

    /// Elastic energy per initial volume of a lane's point in Pa.
    pub fn energy_of(&self, lane: usize) -> f64 {
        self.energies(lane / LANES).as_array()[lane % LANES]
    }

    /// Elastic energy per initial volume of the points of a block in Pa.
    pub fn energies(&self, block: usize) -> Lanes {
        let (point, rows) = self.state.stresses.block(&*self.material, block);
        self.material.energy(point, rows)
    }

    /// `plastic_strain` of the model, of a lane's point.
    pub fn plastic_strain(&self, lane: usize) -> f64 {
        let (point, rows) = self.state.stresses.block(&*self.material, lane / LANES);
        self.material.flowed(point, rows).as_array()[lane % LANES]
    }

    /// The tile that holds a lane.
    pub fn tile_of_lane(&self, lane: usize) -> &Tile {
        &self.tiles[self.tile_of[lane / LANES] as usize]
    }

    /// Calls `found` with each point of a tile: its identity less the cloud's first, and its position in m.
    pub fn points_of(&self, tile: &Tile, found: &mut dyn FnMut(u32, [f64; 2])) {
        for block in tile.first..tile.first + tile.blocks {
            for (k, &local) in self.state.ids[block].iter().enumerate() {
                if local != NO_POINT {
                    found(local, self.position(block * LANES + k));
                }
            }
        }
    }

    /// Sorts the points by tile and cell, and lays out the tiles. The caller then gives each tile its neighbours.
    pub fn sort(&mut self, grid: &Geometry) {
        let offset = self.shape.offset();
        let keys = &mut self.scratch.keys;
        keys.clear();
        for (block, ids) in self.state.ids.iter().enumerate() {
            for (k, &id) in ids.iter().enumerate() {
                if id != NO_POINT {
                    let position = self.state.x[block].map(|x| x.as_array()[k]);
                    let (tile, cell) = grid.tile_of(position, offset);
                    keys.push((key(tile, cell), (block * LANES + k) as u32));
                }
            }
        }
        // The lane is part of the key: points of one cell keep their order, and no other order is possible.
        keys.sort_unstable();

        self.state.tiles.clear();
        let sources = &mut self.scratch.sources;
        sources.clear();
        let mut ids = Vec::with_capacity(self.state.ids.len());
        for run in keys.chunk_by(|a, b| tile_of_key(a.0) == tile_of_key(b.0)) {
            let at = tile_of_key(run[0].0);
            let first = sources.len() / LANES;
            sources.extend(run.iter().map(|&(_, lane)| lane));
            let blocks = run.len().div_ceil(LANES);
            sources.resize((first + blocks) * LANES, run[0].1);
            let cells = || run.iter().map(|&(key, _)| cell_of_key(key));
            self.state.tiles.push(SortedTile {
                at,
                points: run.len() as u32,
                bases: [
                    range(cells().map(|[x, _]| x)),
                    range(cells().map(|[_, y]| y)),
                ],
            });
            for block in 0..blocks {
                ids.push([0, 1, 2, 3].map(|k| {
                    run.get(block * LANES + k).map_or(NO_POINT, |&(_, lane)| {
                        self.state.ids[lane as usize / LANES][lane as usize % LANES]
                    })
                }));
            }
        }
        let number = &mut self.scratch.number;
        reorder(&mut self.state.x, number, sources);
        reorder(&mut self.state.motion, number, sources);
        reorder(&mut self.state.unsettled, number, sources);
        let stresses = &mut self.state.stresses;
        reorder(&mut stresses.points, number, sources);
        reorder_rows(&mut stresses.rows, self.material.rows(), number, sources);
        if let Some(loads) = &mut self.loads {
            loads.reorder(number, sources, self.state.tiles.len());
        }
        self.state.ids = ids;
        self.lay_out(grid);
    }

    /// Makes what follows from the state: places and windows of the tiles, and the lane of each point.
    fn lay_out(&mut self, grid: &Geometry) {
        let offset = self.shape.offset();
        self.tiles.clear();
        self.tile_of.clear();
        let mut first = 0;
        for (index, sorted) in self.state.tiles.iter().enumerate() {
            let frame = grid.frame(sorted.at, offset);
            let tile = Tile::new(sorted, index, first, frame);
            first += tile.blocks;
            self.tile_of.resize(first, index as u32);
            self.tiles.push(tile);
        }
        self.find_lanes();
        self.mass_momentum.resize(self.tiles.len(), NO_MOMENTUM);
        self.force.resize(self.tiles.len(), NO_VECTORS);
        self.reports.resize(self.tiles.len(), TileReport::default());
        let reports = &mut self.state.stress_reports;
        reports.resize(self.tiles.len(), StressReport::default());
    }

    /// Fills in [`Self::lane_of`] from the identities.
    fn find_lanes(&mut self) {
        for (lane, &id) in self.state.ids.as_flattened().iter().enumerate() {
            if id != NO_POINT {
                self.lane_of[id as usize] = lane as u32;
            }
        }
    }

    /// Bytes of memory in use.
    pub fn bytes(&self) -> usize {
        (self.state.x.capacity() + self.state.unsettled.capacity()) * size_of::<[Lanes; 2]>()
            + self.state.motion.capacity() * size_of::<Motion<A>>()
            + self.aside.capacity() * size_of::<[Lanes; 2]>()
            + self.state.ids.capacity() * size_of::<[u32; LANES]>()
            + (self.lane_of.capacity() + self.tile_of.capacity() + self.scratch.sources.capacity())
                * size_of::<u32>()
            + self.scratch.keys.capacity() * size_of::<([u32; 2], u32)>()
            + self.scratch.number.capacity() * size_of::<Lanes>()
            + self.mass_momentum.capacity() * size_of::<NodalWindow>()
            + self.force.capacity() * size_of::<VectorWindow>()
            + self.tiles.capacity() * size_of::<Tile>()
            + self.state.stresses.points.capacity() * size_of::<Stressed>()
            + self.state.stresses.rows.capacity() * size_of::<Lanes>()
            + self.loads.as_ref().map_or(0, |l| l.bytes())
    }
}

/// What a vector of four points has for the point of a lane. Its two numbers are read where they are; `map` would copy all eight.
#[inline(always)]
fn of_lane(vector: &[Lanes; 2], lane: usize) -> [f64; 2] {
    let [x, y] = vector;
    [x.as_array()[lane % LANES], y.as_array()[lane % LANES]]
}

/// The states of a cloud and of its parts.
#[derive(Serialize, Deserialize)]
pub struct SavedCloud<A> {
    pub(crate) points: CloudState<A>,
    loads: Option<Vec<LastLoad>>,
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    /// The state before the next step.
    pub fn saved(&self) -> SavedCloud<A> {
        SavedCloud {
            points: self.state.clone(),
            loads: self.loads.as_ref().map(|l| l.last.clone()),
        }
    }

    /// Restores what [`Self::saved`] returned. The caller then gives each tile its neighbours.
    ///
    /// # Errors
    /// A [`Refusal`] if it is not a state of this cloud.
    pub fn restore(&mut self, saved: SavedCloud<A>, grid: &Geometry) -> Result<(), Refusal> {
        if self.removed > 0 {
            return Err(refusal("this solver has done steps already"));
        }
        self.state = saved.points;
        // A branch may have parameters with which a model keeps more or fewer numbers: those begin as at rest.
        let (_, rows) = self.material.at_rest();
        let stresses = &mut self.state.stresses;
        if stresses.rows.len() != stresses.points.len() * rows.len() {
            stresses.rows = rows.repeat(stresses.points.len());
        }
        // Loads that a branch no longer has are left out; its new loads begin at zero.
        if let Some(loads) = &mut self.loads {
            let mut sources = Vec::with_capacity(self.state.ids.len() * LANES);
            let mut ids = &self.state.ids[..];
            for tile in &self.state.tiles {
                let (of_tile, others) = ids.split_at((tile.points as usize).div_ceil(LANES));
                for &id in of_tile.as_flattened() {
                    // Lanes without a point come from the first of their tile.
                    let point = if id == NO_POINT { of_tile[0][0] } else { id };
                    sources.push(self.lane_of[point as usize]);
                }
                ids = others;
            }
            let number = &mut self.scratch.number;
            loads.reorder(number, &sources, self.state.tiles.len());
            if let Some(last) = saved.loads {
                loads.last = last;
            } else {
                // The saved run had none: they work from here on.
                for (last, x) in loads.last.iter_mut().zip(&self.state.x) {
                    last.x = *x;
                }
            }
        }
        self.lane_of.fill(NO_POINT);
        self.lay_out(grid);
        self.removed = self.lane_of.iter().filter(|l| **l == NO_POINT).count();
        Ok(())
    }
}

/// Bits of the number of a base node in its tile, and of a tile along either axis: 64 together.
const CELL_BITS: u32 = 6;
const TILE_BITS: u32 = 29;
/// Tiles are numbered from minus this: cells along an axis stay below 2^31.
const TILE_ORIGIN: i64 = 1 << 28;

fn key(tile: [i32; 2], cell: usize) -> [u32; 2] {
    let [x, y] = tile.map(|t| (i64::from(t) + TILE_ORIGIN) as u64);
    let key = (y << (TILE_BITS + CELL_BITS)) | (x << CELL_BITS) | cell as u64;
    [(key >> 32) as u32, key as u32]
}

fn tile_of_key([high, low]: [u32; 2]) -> [i32; 2] {
    let key = u64::from(high) << 32 | u64::from(low);
    let x = (key >> CELL_BITS) & ((1 << TILE_BITS) - 1);
    let y = key >> (TILE_BITS + CELL_BITS);
    [x, y].map(|t| (t as i64 - TILE_ORIGIN) as i32)
}

/// Column and row of the base node in its tile.
fn cell_of_key([_, low]: [u32; 2]) -> [u8; 2] {
    let cell = low as usize % NODES;
    [cell % TILE, cell / TILE].map(|i| i as u8)
}

/// The smallest and the largest of some numbers; there is at least one.
fn range(numbers: impl Iterator<Item = u8> + Clone) -> [u8; 2] {
    let largest = numbers.clone().max();
    [numbers.min(), largest].map(Option::unwrap_or_default)
}
