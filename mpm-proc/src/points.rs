//! The points of one group, four to a block, sorted by tile and within a tile by cell.
//!
//! All points of a group share mass, initial volume and shape function, so a point carries only what really differs.
//! They stay sorted as long as none has moved by a cell since they were (as in a Verlet list), see [`crate::tiles`].

use crate::lanes::{LANES, Lanes, ZERO, first, splat};
use crate::loads::Loads;
use crate::material::Constitutive;
use crate::shape::Shape;
use crate::stress::StressReport;
use crate::tiles::{Frame, Geometry};
use crate::transfer::AffineState;
use crate::window::{NO_MOMENTUM, NO_VECTORS, NodalWindow, VectorWindow};

/// In [`Cloud::ids`]: a lane without a point. Such lanes fill up the last block of a tile. They have no mass and drift
/// along with the first point of their tile, so that their numbers stay harmless.
pub const NO_POINT: u32 = u32::MAX;

/// A tile of a cloud: a run of blocks whose points lie in it.
#[derive(Debug, Clone)]
pub struct Tile {
    /// Which tile of the grid.
    pub at: [i32; 2],
    /// Number in [`Cloud::tiles`].
    pub index: usize,
    /// First block.
    pub first: usize,
    /// Blocks.
    pub blocks: usize,
    /// Points; the last block may have fewer than four.
    pub points: usize,
    /// Where its window lies.
    pub frame: Frame,
    /// The node tiles that own the window: the 3 x 3 around it, row by row from below.
    pub around: [u32; 9],
    /// Whether its points count where bodies press in this step ([`crate::drift`]).
    pub near_load: bool,
}

/// Tiles that a pass is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// All.
    All,
    /// Those near a load, [`Tile::near_load`].
    NearLoad,
    /// The others.
    Elsewhere,
}

impl Which {
    /// Whether a tile is among them.
    pub fn has(self, tile: &Tile) -> bool {
        match self {
            Self::All => true,
            Self::NearLoad => tile.near_load,
            Self::Elsewhere => !tile.near_load,
        }
    }
}

impl Tile {
    /// One in the lanes of block `block` of the tile that have a point, zero in the others.
    #[inline(always)]
    pub fn live(&self, block: usize) -> Lanes {
        if block + 1 < self.blocks {
            splat(1.0)
        } else {
            first(self.points - block * LANES)
        }
    }
}

/// Data of four points of which one lane at a time can be copied.
pub trait LaneCopy: Copy + Send + Sync {
    /// Copies lane `from` of `source` into lane `to`.
    fn copy_lane(&mut self, to: usize, source: &Self, from: usize);
}

impl LaneCopy for Lanes {
    #[inline]
    fn copy_lane(&mut self, to: usize, source: &Self, from: usize) {
        self.as_mut_array()[to] = source.as_array()[from];
    }
}

impl LaneCopy for () {
    fn copy_lane(&mut self, _to: usize, _source: &Self, _from: usize) {}
}

impl<T: LaneCopy, const N: usize> LaneCopy for [T; N] {
    #[inline]
    fn copy_lane(&mut self, to: usize, source: &Self, from: usize) {
        for (a, b) in self.iter_mut().zip(source) {
            a.copy_lane(to, b, from);
        }
    }
}

/// Velocities of four points.
#[derive(Debug, Clone, Copy)]
pub struct Motion<A> {
    /// `v_p^{n-1/2}` in m/s.
    pub v: [Lanes; 2],
    /// Affine part.
    pub affine: A,
}

impl<A: AffineState + LaneCopy> LaneCopy for Motion<A> {
    #[inline]
    fn copy_lane(&mut self, to: usize, source: &Self, from: usize) {
        self.v.copy_lane(to, &source.v, from);
        self.affine.copy_lane(to, &source.affine, from);
    }
}

/// What moving the points of a tile tells of them.
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
}

/// New places of points: for every lane, where it comes from. Lanes without a point come from the first of their tile.
pub type Sources = [u32];

/// Puts `blocks` into the order of `sources`, by way of `scratch`, which is exchanged with it.
pub fn reorder<T: LaneCopy>(blocks: &mut Vec<T>, scratch: &mut Vec<T>, sources: &Sources) {
    scratch.clear();
    let wanted = sources.len() / LANES;
    if scratch.capacity() < wanted {
        // A little more than wanted: the number of half empty blocks changes from one sorting to the next.
        scratch.reserve_exact(wanted + wanted / 16);
    }
    scratch.extend(sources.chunks_exact(LANES).map(|lanes| {
        let mut block = blocks[lanes[0] as usize / LANES];
        for (to, &source) in lanes.iter().enumerate() {
            let source = source as usize;
            block.copy_lane(to, &blocks[source / LANES], source % LANES);
        }
        block
    }));
    core::mem::swap(blocks, scratch);
}

/// What all points of a group have in common.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Mass of a point in kg/m.
    pub mass: f64,
    /// Contact radius in m.
    pub radius: f64,
    /// Sides of a point's box in m.
    pub sides: [f64; 2],
}

/// The points of one group.
pub struct Cloud<const W: usize, S: Shape<W>, A: AffineState + LaneCopy> {
    /// Shape function, with the half width of the points' boxes where it has one.
    pub shape: S,
    /// Constitutive model and its state.
    pub material: Box<dyn Constitutive<W, S>>,
    /// Loads besides gravity and bodies.
    pub loads: Option<Box<Loads>>,
    /// Mass of a point in kg/m.
    pub mass: f64,
    /// Initial volume of a point in m^2.
    pub volume: f64,
    /// Contact radius in m.
    pub radius: f64,
    /// Identity of the first point; the others follow.
    pub first_id: u64,
    /// `x_p^n` in m.
    pub x: Vec<[Lanes; 2]>,
    /// Velocities.
    pub motion: Vec<Motion<A>>,
    /// Identity of each lane's point less `first_id`, or [`NO_POINT`].
    pub ids: Vec<[u32; LANES]>,
    /// Lane of each point, by identity less `first_id`; [`NO_POINT`] once it has been removed.
    pub lane_of: Vec<u32>,
    /// How many points have been removed.
    pub removed: usize,
    /// Tiles with points, ordered by row and column.
    pub tiles: Vec<Tile>,
    /// `(m_I, p_I, 0)` in each tile's window, of this cloud's points alone.
    pub mass_momentum: Vec<NodalWindow>,
    /// `f_I^int` likewise, in N/m ([`crate::window`]).
    pub force: Vec<VectorWindow>,
    /// Report of each tile.
    pub reports: Vec<TileReport>,
    /// What updating the stress of each tile told.
    pub stress_reports: Vec<StressReport>,
    scratch: Scratch<A>,
}

struct Scratch<A> {
    x: Vec<[Lanes; 2]>,
    motion: Vec<Motion<A>>,
    keys: Vec<(u64, u32)>,
    sources: Vec<u32>,
}

impl<const W: usize, S: Shape<W>, A: AffineState + LaneCopy> Cloud<W, S, A> {
    /// Points of one `kind` at `positions` (m) with `velocities` (m/s); not sorted yet.
    pub fn new(
        shape: S,
        material: Box<dyn Constitutive<W, S>>,
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
            first_id,
            x,
            motion: v
                .into_iter()
                .map(|v| Motion {
                    v,
                    affine: A::default(),
                })
                .collect(),
            loads,
            ids: (0..blocks as u32)
                .map(|b| {
                    [0, 1, 2, 3].map(|k| {
                        let id = b * LANES as u32 + k;
                        if id < count { id } else { NO_POINT }
                    })
                })
                .collect(),
            lane_of: (0..count).collect(),
            removed: 0,
            tiles: Vec::new(),
            mass_momentum: Vec::new(),
            force: Vec::new(),
            reports: Vec::new(),
            stress_reports: Vec::new(),
            scratch: Scratch {
                x: Vec::new(),
                motion: Vec::new(),
                keys: Vec::new(),
                sources: Vec::new(),
            },
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.lane_of.len() - self.removed
    }

    /// Position of a lane's point in m.
    pub fn position(&self, lane: usize) -> [f64; 2] {
        self.x[lane / LANES].map(|x| x.as_array()[lane % LANES])
    }

    /// Velocity of a lane's point in m/s.
    pub fn velocity(&self, lane: usize) -> [f64; 2] {
        self.motion[lane / LANES]
            .v
            .map(|v| v.as_array()[lane % LANES])
    }

    /// The tile that holds a lane.
    pub fn tile_of_lane(&self, lane: usize) -> &Tile {
        let block = lane / LANES;
        &self.tiles[self.tiles.partition_point(|t| t.first <= block) - 1]
    }

    /// Sorts the points by tile and cell, and lays out the tiles. The caller then gives each tile its neighbours.
    pub fn sort(&mut self, grid: &Geometry) {
        let offset = self.shape.offset();
        let keys = &mut self.scratch.keys;
        keys.clear();
        for (block, ids) in self.ids.iter().enumerate() {
            for (k, &id) in ids.iter().enumerate() {
                if id != NO_POINT {
                    let position = self.x[block].map(|x| x.as_array()[k]);
                    let (tile, cell) = grid.tile_of(position, offset);
                    keys.push((key(tile, cell), (block * LANES + k) as u32));
                }
            }
        }
        // The lane is part of the key: points of one cell keep their order, and no other order is possible.
        keys.sort_unstable();

        self.tiles.clear();
        let sources = &mut self.scratch.sources;
        sources.clear();
        let mut ids = Vec::with_capacity(self.ids.len());
        for run in keys.chunk_by(|a, b| a.0 >> CELL_BITS == b.0 >> CELL_BITS) {
            let at = tile_of_key(run[0].0);
            let first = sources.len() / LANES;
            sources.extend(run.iter().map(|&(_, lane)| lane));
            let blocks = run.len().div_ceil(LANES);
            sources.resize((first + blocks) * LANES, run[0].1);
            self.tiles.push(Tile {
                at,
                index: self.tiles.len(),
                first,
                blocks,
                points: run.len(),
                frame: grid.frame(at, offset),
                around: [0; 9],
                near_load: false,
            });
            for block in 0..blocks {
                ids.push([0, 1, 2, 3].map(|k| {
                    run.get(block * LANES + k).map_or(NO_POINT, |&(_, lane)| {
                        self.ids[lane as usize / LANES][lane as usize % LANES]
                    })
                }));
            }
        }
        reorder(&mut self.x, &mut self.scratch.x, sources);
        reorder(&mut self.motion, &mut self.scratch.motion, sources);
        self.material.reorder(sources);
        if let Some(loads) = &mut self.loads {
            loads.reorder(sources, self.tiles.len());
        }
        self.ids = ids;
        for (block, ids) in self.ids.iter().enumerate() {
            for (k, &id) in ids.iter().enumerate() {
                if id != NO_POINT {
                    self.lane_of[id as usize] = (block * LANES + k) as u32;
                }
            }
        }
        self.mass_momentum.resize(self.tiles.len(), NO_MOMENTUM);
        self.force.resize(self.tiles.len(), NO_VECTORS);
        self.reports.resize(self.tiles.len(), TileReport::default());
        self.stress_reports
            .resize(self.tiles.len(), StressReport::default());
    }

    /// Bytes of memory in use.
    pub fn bytes(&self) -> usize {
        self.x.capacity() * size_of::<[Lanes; 2]>() * 2
            + self.motion.capacity() * size_of::<Motion<A>>() * 2
            + self.ids.capacity() * size_of::<[u32; LANES]>()
            + self.lane_of.capacity() * 8
            + self.scratch.keys.capacity() * 16
            + self.mass_momentum.capacity() * size_of::<NodalWindow>()
            + self.force.capacity() * size_of::<VectorWindow>()
            + self.tiles.capacity() * size_of::<Tile>()
            + self.material.bytes()
            + self.loads.as_ref().map_or(0, |l| l.bytes())
    }
}

/// Bits of the number of a base node in its tile, and of a tile along either axis: 64 together.
const CELL_BITS: u32 = 6;
const TILE_BITS: u32 = 29;
/// Tiles are numbered from minus this: cells along an axis stay below 2^31.
const TILE_ORIGIN: i64 = 1 << 28;

fn key(tile: [i32; 2], cell: usize) -> u64 {
    let [x, y] = tile.map(|t| (i64::from(t) + TILE_ORIGIN) as u64);
    (y << (TILE_BITS + CELL_BITS)) | (x << CELL_BITS) | cell as u64
}

fn tile_of_key(key: u64) -> [i32; 2] {
    let x = (key >> CELL_BITS) & ((1 << TILE_BITS) - 1);
    let y = key >> (TILE_BITS + CELL_BITS);
    [x, y].map(|t| (t as i64 - TILE_ORIGIN) as i32)
}
