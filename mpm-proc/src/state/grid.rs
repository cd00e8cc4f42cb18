//! The occupied part of the grid: the node tiles that some point's window reaches.

use super::columns::Column;
use super::images::{Image, Images};
use super::nodes::{
    ALL_NODES, ContactNodes, MappedTile, NodeAt, NodeTile, Overlap, WallContribution, bits,
};
use super::points::Cloud;
use super::walls::WallNodes;
use crate::kernel::shape::Shape;
use crate::kernel::tiles::{Geometry, NODES, TILE, first_node, node, runs};
use crate::kernel::transfer::AffineState;

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
    /// Velocities of the points mapped between two steps, for each node tile; empty where no pass needs them.
    pub mapped: Vec<MappedTile>,
    /// Two numbers at each node for the present pass: volumes, or what hats bound the step by; empty where neither is needed.
    pub sums: Vec<[[f64; 2]; NODES]>,
    /// Nodes that are images of others.
    pub images: Images,
    /// Nodes across walls with friction.
    pub columns: Vec<Column>,
    /// Windows of the clouds' tiles over the node tiles, node tile by node tile.
    pub overlaps: Vec<Overlap>,
    /// How often the tiles have been allocated: the numbers of tiles hold until the next time.
    pub allocations: u64,
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
            mapped: Vec::new(),
            sums: Vec::new(),
            images: Images::default(),
            columns: Vec::new(),
            overlaps: Vec::new(),
            allocations: 0,
        }
    }

    /// Allocates node tiles where points of all clouds may reach until they are sorted again, and stores in each tile of a cloud
    /// those that its window overlaps.
    pub fn cover<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        clouds: &mut [Cloud<W, S, A>],
    ) {
        let mut wanted: Vec<([i32; 2], Overlap)> = Vec::new();
        for (c, cloud) in clouds.iter().enumerate() {
            for tile in &cloud.tiles {
                let spans = [tile.span(W, 0), tile.span(W, 1)];
                // The 3 x 3 node tiles around it, row by row from below, and the run of its window that lies there.
                for i in 0..9_u8 {
                    let run = [i % 3, i / 3];
                    let part = |a: usize| runs(W)[usize::from(run[a])].part(&spans[a]);
                    let rows = part(1);
                    if part(0).is_empty() || rows.is_empty() {
                        continue;
                    }
                    let [dx, dy] = run.map(|run| i32::from(run) - 1);
                    wanted.push((
                        [tile.at[1] + dy, tile.at[0] + dx],
                        Overlap {
                            cloud: c as u32,
                            tile: tile.index as u32,
                            run,
                            rows: [rows.start as u8, rows.end as u8],
                        },
                    ));
                }
            }
        }
        self.allocate(wanted, W, &mut |overlap, number| {
            let around = usize::from(overlap.run[1]) * 3 + usize::from(overlap.run[0]);
            clouds[overlap.cloud as usize].tiles[overlap.tile as usize].around[around] = number;
        });
    }

    /// Allocates the node tiles that are `wanted` for shape functions of this width, and calls `found` with the number of the
    /// one of each window's part.
    fn allocate(
        &mut self,
        mut wanted: Vec<([i32; 2], Overlap)>,
        width: usize,
        found: &mut dyn FnMut(Overlap, u32),
    ) {
        wanted.sort_unstable_by_key(|(at, o)| (*at, o.cloud, o.tile));
        self.allocations += 1;
        self.tiles.clear();
        let seen = !self.mapped.is_empty();
        self.mapped.clear();
        self.overlaps.clear();
        let mut places: Vec<[i32; 2]> = wanted.iter().map(|(at, _)| *at).collect();
        places.dedup();
        Images::complete(&self.walls, width, &mut places);
        let mut rest = &wanted[..];
        for place in places {
            // None where a tile only holds originals of images.
            let (group, others) = rest.split_at(rest.partition_point(|(at, _)| *at == place));
            rest = others;
            let at = [place[1], place[0]];
            let number = self.tiles.len() as u32;
            for (_, overlap) in group {
                found(*overlap, number);
            }
            self.tiles.push(NodeTile {
                at,
                index: self.tiles.len(),
                first: self.overlaps.len() as u32,
                count: group.len() as u32,
                walled: self.walls.acts_on(first_node(at), width),
                in_columns: 0,
                imaged: false,
                mass: [0.0; NODES],
                per_mass: [0.0; NODES],
                before: [[0.0; 2]; NODES],
                after: [[0.0; 2]; NODES],
                damping: Vec::new(),
                smoothing_work: 0.0,
                wall: WallContribution::default(),
                stopped: Vec::new(),
                friction: Vec::new(),
                pressed: [0; 2],
            });
            self.overlaps.extend(group.iter().map(|(_, o)| *o));
        }
        (self.images).find(&self.geometry, &self.walls, width, &mut self.tiles);
        self.find_columns();
        if !self.contact.is_empty() {
            self.contact.clear();
            self.make_room_for_contact();
        }
        if seen {
            self.make_room_for_mapped();
        }
    }

    /// Finds the columns. Where no tile holds one of their nodes, no point moves it.
    fn find_columns(&mut self) {
        self.columns.clear();
        for tile in 0..self.tiles.len() {
            let (first, walled) = (first_node(self.tiles[tile].at), self.tiles[tile].walled);
            for on in bits(walled).map(|i| node(first, i)) {
                let Some([beyond, within]) = self.walls.beside(on) else {
                    continue;
                };
                let holders = [beyond, on, within].map(|node| self.holder(node));
                let [Some(beyond), Some(on_wall), Some(within)] = holders else {
                    continue;
                };
                for (tile, n) in [beyond, on_wall] {
                    self.tiles[tile as usize].in_columns |= 1 << n;
                }
                let at = |(tile, n): (u32, usize)| NodeAt {
                    tile,
                    node: n as u32,
                };
                self.columns.push(Column {
                    nodes: [beyond, on_wall, within].map(at),
                    on,
                    ..Column::default()
                });
            }
        }
    }

    /// The tile that holds a node, and the node's number in it, if the tile is allocated.
    pub fn holder(&self, node: [i64; 2]) -> Option<(u32, usize)> {
        let [column, row] = node.map(|i| i.div_euclid(TILE as i64) as i32);
        let [x, y] = node.map(|i| i.rem_euclid(TILE as i64) as usize);
        let at = |t: &NodeTile| [t.at[1], t.at[0]];
        let tile = self.tiles.binary_search_by_key(&[row, column], at).ok()?;
        Some((tile as u32, y * TILE + x))
    }

    /// What a node is an image of, if it is one.
    pub fn image(&self, at: NodeAt) -> Option<&Image> {
        let imaged = self.tiles[at.tile as usize].imaged;
        imaged.then(|| self.images.at(at)).flatten()
    }

    /// The contact of the tile of a node that is given some, and the node's number in it.
    pub fn touch(&mut self, at: NodeAt) -> (&mut ContactNodes, usize) {
        let (tile, node) = at.split();
        let nodes = &mut self.contact[tile];
        nodes.touched = true;
        (nodes, node)
    }

    /// Makes room for the contact of bodies.
    pub fn make_room_for_contact(&mut self) {
        self.contact.resize(self.tiles.len(), ContactNodes::NONE);
    }

    /// Makes room for [`Self::mapped`].
    pub fn make_room_for_mapped(&mut self) {
        let tile = |tile| MappedTile {
            tile,
            wanted: 0,
            moves: 0,
            velocity: [[0.0; 2]; NODES],
            wall: WallContribution::default(),
        };
        let held = self.mapped.len() as u32;
        self.mapped
            .extend((held..self.tiles.len() as u32).map(tile));
    }

    /// Lets all nodes that are at most `reach` from the wanted ones, along both axes, move points with mapped velocities; these
    /// are wanted then.
    pub fn widen_wanted(&mut self, reach: usize) {
        for mapped in &mut self.mapped {
            mapped.moves = 0;
        }
        for number in 0..self.tiles.len() {
            let wanted = self.mapped[number].wanted;
            if wanted == 0 {
                continue;
            }
            let rows = widened(wanted, reach);
            let origin = first_node(self.tiles[number].at);
            for (i, around) in (0..9).map(|i| (i, [i % 3, i / 3])) {
                let [x, y] = around.map(|run| run * TILE);
                let bits = (0..TILE).fold(0, |bits, row| {
                    let own = u64::from(rows[y + row] >> x) & ((1 << TILE) - 1);
                    bits | own << (row * TILE)
                });
                let node = [0, 1].map(|a| origin[a] + ([x, y][a] as i64 - TILE as i64));
                let holder = if bits == 0 { None } else { self.holder(node) };
                debug_assert!(i != 4 || holder.is_some_and(|(tile, _)| tile as usize == number));
                if let Some((tile, _)) = holder {
                    self.mapped[tile as usize].moves |= bits;
                }
            }
        }
        for mapped in &mut self.mapped {
            mapped.wanted = mapped.moves;
        }
    }

    /// Gives the nodes that do not move points with mapped velocities those after the kick, where others of their tile do.
    pub fn complete_mapped(&mut self) {
        for (mapped, tile) in self.mapped.iter_mut().zip(&self.tiles) {
            for i in 0..NODES {
                if mapped.moves != 0 && mapped.moves >> i & 1 == 0 {
                    mapped.velocity[i] = tile.after[i];
                }
            }
        }
    }

    /// Calls `of_points` with the cloud and tile of all points that the wanted velocities depend on.
    ///
    /// Where a node is an image, or has one, all images are wanted: they may stand anywhere along the walls.
    pub fn points_behind<const W: usize>(&mut self, mut of_points: impl FnMut(usize, usize)) {
        let imaged = |(tile, mapped): (&NodeTile, &MappedTile)| tile.imaged && mapped.wanted != 0;
        if self.tiles.iter().zip(&self.mapped).any(imaged) {
            for (tile, mapped) in self.tiles.iter().zip(&mut self.mapped) {
                if tile.imaged {
                    mapped.wanted = ALL_NODES;
                }
            }
        }
        for column in &self.columns {
            let nodes = column.nodes.map(NodeAt::split);
            if nodes
                .iter()
                .any(|&(tile, n)| self.mapped[tile].wanted >> n & 1 == 1)
            {
                for (tile, n) in nodes {
                    self.mapped[tile].wanted |= 1 << n;
                }
            }
        }
        let covered = const { covered(W) };
        for (tile, mapped) in self.tiles.iter().zip(&self.mapped) {
            if mapped.wanted == 0 {
                continue;
            }
            for o in tile.overlapping(&self.overlaps) {
                let [x, y] = o.run.map(usize::from);
                if mapped.wanted & covered[y][x] != 0 {
                    of_points(o.cloud as usize, o.tile as usize);
                }
            }
        }
    }
}

/// The nodes at most `reach` from these of a tile along both axes, a bit for each: the rows of the 3 x 3 tiles around it, from
/// below.
fn widened(nodes: u64, reach: usize) -> [u32; 3 * TILE] {
    let mut rows = [0_u32; 3 * TILE];
    for (y, row) in nodes.to_le_bytes().into_iter().enumerate() {
        let row = u32::from(row) << TILE;
        rows[TILE + y] = (1..=reach).fold(row, |all, k| all | row << k | row >> k);
    }
    core::array::from_fn(|y| {
        let near = y.saturating_sub(reach)..(y + reach + 1).min(3 * TILE);
        rows[near].iter().fold(0, |all, row| all | row)
    })
}

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
