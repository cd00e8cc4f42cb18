//! The points of one group, four to a block, sorted by tile and within a tile by cell.
//!
//! All points of a group share mass, initial volume and shape function, so a point stores only what differs. They stay
//! sorted until one has moved by a cell since the last sorting (as in a Verlet list), see [`crate::kernel::tiles`].

use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::kernel::blocks::{LaneCopy, reorder};
use crate::kernel::lanes::{LANES, Lanes, ZERO};
use crate::kernel::point_tile::Tile;
use crate::kernel::shape::Shape;
use crate::kernel::tiles::{Geometry, TILE};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::{NO_MOMENTUM, NO_VECTORS, NodalWindow, VectorWindow};
use crate::state::constitutive::{Constitutive, StressReport};
use crate::state::loads::{LastLoad, Loads};
use crate::state::saved::{Bytes, refusal};

/// In [`Cloud::ids`]: a lane without a point. Such lanes fill up the last block of a tile. They have no mass and move
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

impl<A: AffineState> LaneCopy for Motion<A> {
    #[inline]
    fn copy_lane(&mut self, to: usize, source: &Self, from: usize) {
        self.v.copy_lane(to, &source.v, from);
        self.affine.copy_lane(to, &source.affine, from);
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
}

/// The data that all points of a group share.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Mass of a point in kg/m.
    pub mass: f64,
    /// Contact radius in m.
    pub radius: f64,
    /// Sides of a point's box in m.
    pub sides: [f64; 2],
    /// Whether the nodes are given the spin of the group.
    pub keeps_spin: bool,
}

/// The points of one group.
pub struct Cloud<const W: usize, S: Shape<W>, A: AffineState> {
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
    /// Spin of the group at the last map to the grid in rad/s, where the nodes are given it.
    pub spin: Option<f64>,
    /// Identity of the first point; the others follow.
    pub first_id: u64,
    /// `x_p^n` in m.
    pub x: Vec<[Lanes; 2]>,
    /// Velocities.
    pub motion: Vec<Motion<A>>,
    /// Velocities set aside while XPIC filters what is left of them; empty with other transfers.
    pub aside: Vec<[Lanes; 2]>,
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
    /// `f_I^int` likewise, in N/m ([`crate::kernel::window`]).
    pub force: Vec<VectorWindow>,
    /// Report of each tile.
    pub reports: Vec<TileReport>,
    /// Report of the stress pass for each tile.
    pub stress_reports: Vec<StressReport>,
    scratch: Scratch<A>,
}

struct Scratch<A> {
    x: Vec<[Lanes; 2]>,
    motion: Vec<Motion<A>>,
    keys: Vec<(u64, u32)>,
    sources: Vec<u32>,
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
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
            spin: kind.keeps_spin.then_some(0.0),
            first_id,
            x,
            motion: v
                .into_iter()
                .map(|v| Motion {
                    v,
                    affine: A::default(),
                })
                .collect(),
            aside: Vec::new(),
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

    /// Mass of all points in kg/m.
    pub fn total_mass(&self) -> f64 {
        self.mass * self.len() as f64
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

    /// Kinetic energy of a lane's point in J/m, with that of its affine part.
    pub fn kinetic_of(&self, lane: usize) -> f64 {
        let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
        let mut twice = square(self.velocity(lane));
        if A::PRESENT {
            let slopes = self.motion[lane / LANES].affine.slopes();
            let of_lane = |s: [Lanes; 2]| s.map(|s| s.as_array()[lane % LANES]);
            let affine: f64 = slopes.iter().map(|s| square(of_lane(*s))).sum();
            twice += affine / S::INVERSE_INERTIA.unwrap_or(1.0);
        }
        0.5 * self.mass * twice
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
            let (index, frame) = (self.tiles.len(), grid.frame(at, offset));
            self.tiles
                .push(Tile::new(at, index, first, run.len(), frame));
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
        self.find_lanes();
        self.make_room();
    }

    /// Fills in [`Self::lane_of`] from the identities.
    fn find_lanes(&mut self) {
        for (lane, &id) in self.ids.as_flattened().iter().enumerate() {
            if id != NO_POINT {
                self.lane_of[id as usize] = lane as u32;
            }
        }
    }

    /// Sizes windows and reports: one for each tile.
    fn make_room(&mut self) {
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
            + self.aside.capacity() * size_of::<[Lanes; 2]>()
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

/// The saved part of a cloud: the data that change from step to step. They are saved in their present order, since sums
/// depend on it.
#[derive(Serialize, Deserialize)]
pub struct SavedCloud<A> {
    /// Points at the start.
    points: u64,
    /// Which tile of the grid, and how many points are in it; tile by tile.
    tiles: Vec<([i32; 2], u32)>,
    ids: Vec<[u32; LANES]>,
    x: Vec<[Lanes; 2]>,
    pub(crate) motion: Vec<Motion<A>>,
    material: Bytes,
    loads: Option<Vec<LastLoad>>,
    stress_reports: Vec<StressReport>,
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    /// The state before the next step.
    pub fn save(&self) -> SavedCloud<A> {
        let Self {
            shape: _, // of the configuration
            material,
            loads,
            mass: _,     // of the configuration
            volume: _,   // likewise
            radius: _,   // likewise
            spin: _,     // likewise, and its number of one step
            first_id: _, // likewise
            x,
            motion,
            aside: _, // of one step
            ids,
            lane_of,    // follows from the ids, but for its length
            removed: _, // likewise
            tiles,
            mass_momentum: _, // of one step
            force: _,         // likewise
            reports: _,       // likewise
            stress_reports,
            scratch: _, // room to sort in
        } = self;
        let tile = |tile: &Tile| {
            let Tile {
                at,
                index: _,  // its place in the list
                first: _,  // follows from the points of those before it
                blocks: _, // follows from its points
                points,
                frame: _,     // follows from its place in the grid
                around: _,    // told by the grid
                near_load: _, // of one step
            } = tile;
            (*at, *points as u32)
        };
        SavedCloud {
            points: lane_of.len() as u64,
            tiles: tiles.iter().map(tile).collect(),
            ids: ids.clone(),
            x: x.clone(),
            motion: motion.clone(),
            material: material.save(),
            loads: loads.as_ref().map(|l| l.save()),
            stress_reports: stress_reports.clone(),
        }
    }

    /// Restores what [`Self::save`] returned. The caller then gives each tile its neighbours.
    ///
    /// # Errors
    /// A [`Refusal`] if it is not a state of this cloud.
    pub fn restore(&mut self, saved: SavedCloud<A>, grid: &Geometry) -> Result<(), Refusal> {
        if self.removed > 0 {
            return Err(refusal("this solver has done steps already"));
        }
        saved.check(self.len(), grid).map_err(refusal)?;
        let blocks = saved.x.len();
        self.material.restore(&saved.material, blocks)?;
        let offset = self.shape.offset();
        self.tiles.clear();
        let mut first = 0;
        for &(at, points) in &saved.tiles {
            let (index, frame) = (self.tiles.len(), grid.frame(at, offset));
            let tile = Tile::new(at, index, first, points as usize, frame);
            first += tile.blocks;
            self.tiles.push(tile);
        }
        // Loads that a branch no longer has are left out; its new loads begin at zero.
        if let Some(loads) = &mut self.loads {
            let mut sources = Vec::with_capacity(blocks * LANES);
            for tile in &self.tiles {
                let ids = saved.ids[tile.first..tile.first + tile.blocks].as_flattened();
                // Lanes without a point come from the first of their tile.
                let point = |&id: &u32| if id == NO_POINT { ids[0] } else { id };
                sources.extend(ids.iter().map(|id| self.lane_of[point(id) as usize]));
            }
            let last = saved.loads.as_deref().unwrap_or_default();
            loads.restore(last, &sources, self.tiles.len());
        }
        (self.x, self.motion, self.ids) = (saved.x, saved.motion, saved.ids);
        self.lane_of.fill(NO_POINT);
        self.find_lanes();
        self.removed = self.lane_of.iter().filter(|l| **l == NO_POINT).count();
        self.make_room();
        self.stress_reports = saved.stress_reports;
        Ok(())
    }
}

impl<A> SavedCloud<A> {
    /// Checks that it is a state of `points` points over `grid`, with all properties that later steps use without a
    /// check.
    fn check(&self, points: usize, grid: &Geometry) -> Result<(), String> {
        if self.points != points as u64 {
            let of = self.points;
            return Err(format!("{of} points, the configuration has {points}"));
        }
        let last = grid.cells.map(|c| c / TILE as i64 + TILES_BEYOND);
        let inside =
            |at: [i32; 2]| (0..2).all(|a| (-TILES_BEYOND..=last[a]).contains(&i64::from(at[a])));
        let empty_or_outside = |t: &&([i32; 2], u32)| t.1 == 0 || !inside(t.0);
        if let Some((at, points)) = self.tiles.iter().find(empty_or_outside) {
            return Err(format!("tile {at:?} with {points} points"));
        }
        if !self.tiles.is_sorted_by_key(|(at, _)| [at[1], at[0]])
            || self.tiles.windows(2).any(|t| t[0].0 == t[1].0)
        {
            return Err("tiles that are not ordered by row and column".into());
        }
        let of_tile = |t: &([i32; 2], u32)| u64::from(t.1).div_ceil(LANES as u64);
        let blocks = self.tiles.iter().map(of_tile).sum::<u64>();
        let loads = self.loads.as_ref().map_or(self.x.len(), Vec::len);
        for (what, found, expected) in [
            ("positions", self.x.len(), blocks),
            ("velocities", self.motion.len(), blocks),
            ("identities", self.ids.len(), blocks),
            ("loads", loads, blocks),
            (
                "reports",
                self.stress_reports.len(),
                self.tiles.len() as u64,
            ),
        ] {
            if found as u64 != expected {
                return Err(format!("{found} {what} where {expected} belong"));
            }
        }
        self.check_ids(points)?;
        self.check_positions(grid)
    }

    /// Checks that each point occurs at most once, and that lanes without a point are the last of their tile.
    fn check_ids(&self, points: usize) -> Result<(), String> {
        let mut seen = vec![false; points];
        let mut rest = self.ids.as_flattened();
        for &(at, count) in &self.tiles {
            let lanes = (count as usize).div_ceil(LANES) * LANES;
            let (ids, others) = rest.split_at(lanes);
            rest = others;
            let (ids, none) = ids.split_at(count as usize);
            let known = |&id: &u32| {
                let seen = seen.get_mut(id as usize);
                seen.is_some_and(|seen| !core::mem::replace(seen, true))
            };
            if !ids.iter().all(known) || none.iter().any(|id| *id != NO_POINT) {
                return Err(format!("unknown or repeated points in tile {at:?}"));
            }
        }
        Ok(())
    }

    /// Checks that all points are where a step can leave them: in the domain, or up to a cell beyond its walls.
    fn check_positions(&self, grid: &Geometry) -> Result<(), String> {
        let slack = 2.0 * grid.cell;
        let inside = |lanes: &Lanes, a: usize| {
            let within = grid.lower[a] - slack..=grid.upper[a] + slack;
            lanes.as_array().iter().all(|x| within.contains(x))
        };
        match self
            .x
            .iter()
            .find(|x| !(inside(&x[0], 0) && inside(&x[1], 1)))
        {
            Some(x) => Err(format!("positions out of the domain: {x:?} m")),
            None => Ok(()),
        }
    }
}

/// Tiles beyond the domain in which a base node can be: shape functions reach two cells beyond a point, and points one
/// beyond a wall.
const TILES_BEYOND: i64 = 1;

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
