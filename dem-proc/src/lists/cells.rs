//! Broad phase: finds overlapping boxes with a grid of cells for the many of similar size and a tree for the few that
//! are much larger. A grid is built and searched in a fifth of the time of a tree, but a wall would fill all of it.

use interface::Vec2;
use mechanics::outline::Bounds;

use crate::parry::BoxTree;

/// Boxes with a longer side than this many times the median are kept out of the grid: the cells are as large as the
/// largest box in it, and boxes of the median size would crowd them.
const MUCH_LARGER: f64 = 3.0;

/// Number of boxes, spread over all, whose median is taken.
const SAMPLE: usize = 500;

/// Largest number of cells for each box, so that a few boxes far apart do not take much memory.
const CELLS_PER_BOX: f64 = 4.0;

/// Boxes, sorted by position.
#[derive(Debug)]
pub struct Cells {
    origin: [f64; 2],
    per_side: f64,
    /// Columns and rows.
    size: [usize; 2],
    /// Index in `items` of the first box of each cell, row after row.
    starts: Vec<u32>,
    /// Boxes by cell, ascending within each.
    items: Vec<u32>,
    /// The large boxes, and their numbers in the order of the tree's leaves.
    large: Option<(BoxTree, Vec<u32>)>,
}

fn side(b: &Bounds) -> f64 {
    (b.upper.x - b.lower.x).max(b.upper.y - b.lower.y)
}

fn center(b: &Bounds) -> Vec2 {
    (b.lower + b.upper) * 0.5
}

impl Cells {
    /// Sorts `boxes` into cells.
    pub fn new(boxes: &[Bounds]) -> Self {
        let some = boxes.iter().step_by(boxes.len() / SAMPLE + 1);
        let mut sides: Vec<f64> = some.map(side).collect();
        let half = sides.len() / 2;
        let limit = if sides.is_empty() {
            0.0
        } else {
            MUCH_LARGER * *sides.select_nth_unstable_by(half, f64::total_cmp).1
        };
        let is_large = |b: &Bounds| side(b) > limit;
        let numbered = || boxes.iter().zip(0_u32..);
        let large: Vec<u32> = numbered()
            .filter(|(b, _)| is_large(b))
            .map(|(_, i)| i)
            .collect();
        let tree = |large: Vec<u32>| {
            let boxes = large.iter().map(|&i| boxes[i as usize]);
            (BoxTree::new(boxes), large)
        };
        let small = || numbered().filter(|(b, _)| !is_large(b));
        // No cell is smaller than a box of the grid, so boxes that overlap are in the same cell or in neighbouring
        // ones.
        let largest = small().map(|(b, _)| side(b)).fold(0.0, f64::max);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (b, _) in small() {
            let c = center(b);
            for i in 0..2 {
                low[i] = low[i].min(c[i]);
                high[i] = high[i].max(c[i]);
            }
        }
        let extent = [0, 1].map(|i| (high[i] - low[i]).max(0.0));
        let count = boxes.len() as f64;
        let roomy = (extent[0] * extent[1] / (CELLS_PER_BOX * count)).sqrt();
        let long = (extent[0] + extent[1]) / (CELLS_PER_BOX * count);
        let cell = largest.max(roomy).max(long);
        let per_side = if cell > 0.0 { 1.0 / cell } else { 0.0 };
        let size = extent.map(|e| (e * per_side) as usize + 1);
        let mut cells = Self {
            origin: low,
            per_side,
            size,
            starts: vec![0; size[0] * size[1] + 1],
            items: Vec::new(),
            large: (!large.is_empty()).then(|| tree(large)),
        };
        // A counting sort keeps the order of the numbers within a cell.
        let place: Vec<(u32, usize)> = small()
            .map(|(b, i)| {
                let [column, row] = cells.cell(center(b));
                (i, row * size[0] + column)
            })
            .collect();
        for &(_, cell) in &place {
            cells.starts[cell + 1] += 1;
        }
        for cell in 0..size[0] * size[1] {
            cells.starts[cell + 1] += cells.starts[cell];
        }
        let mut next = cells.starts.clone();
        cells.items.resize(place.len(), 0);
        for (i, cell) in place {
            cells.items[next[cell] as usize] = i;
            next[cell] += 1;
        }
        cells
    }

    fn cell(&self, at: Vec2) -> [usize; 2] {
        [0, 1].map(|i| {
            let index = ((at[i] - self.origin[i]) * self.per_side) as usize;
            index.min(self.size[i] - 1)
        })
    }

    /// Appends to `found` the numbers above `i` of the boxes that overlap box `i`. `boxes` must be the boxes that were
    /// sorted. The order is ascending, so that the results do not depend on cells or trees.
    pub fn above(&self, i: u32, boxes: &[Bounds], found: &mut Vec<u32>) {
        let from = found.len();
        let own = &boxes[i as usize];
        let mut is_large = false;
        if let Some((tree, large)) = &self.large {
            is_large = large.binary_search(&i).is_ok();
            // A number is below `i` for all leaves before some leaf, since leaves are in the order of the numbers.
            let first = large.partition_point(|&j| j <= i);
            if first < large.len() {
                tree.meeting(own, found);
                let below = found[from..].partition_point(|&leaf| (leaf as usize) < first);
                found.drain(from..from + below);
                for leaf in &mut found[from..] {
                    *leaf = large[*leaf as usize];
                }
            }
        }
        // Of a large box from the cell of its lower corner to that of its upper corner; and one more on each side.
        let corners = if is_large {
            [own.lower, own.upper]
        } else {
            [center(own); 2]
        };
        let [low, high] = corners.map(|corner| self.cell(corner));
        let columns = low[0].saturating_sub(1)..(high[0] + 2).min(self.size[0]);
        for row in low[1].saturating_sub(1)..(high[1] + 2).min(self.size[1]) {
            let start = |column: usize| self.starts[row * self.size[0] + column] as usize;
            for &j in &self.items[start(columns.start)..start(columns.end)] {
                if j > i && own.meets(&boxes[j as usize]) {
                    found.push(j);
                }
            }
        }
        found[from..].sort_unstable();
    }
}
