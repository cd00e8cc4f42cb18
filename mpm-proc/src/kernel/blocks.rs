//! Blocks of four points: how one point is copied from a block to another, and how all points are put into a new order.

use super::lanes::{LANES, Lanes};

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

/// The new order of points: for every lane, the lane that it comes from. Lanes without a point come from the first lane
/// of their tile.
pub type Sources = [u32];

/// Puts `blocks` into the order of `sources`, using `scratch`, with which it is swapped.
pub fn reorder<T: LaneCopy>(blocks: &mut Vec<T>, scratch: &mut Vec<T>, sources: &Sources) {
    reorder_rows(blocks, 1, scratch, sources);
}

/// The same for `count` items of each block.
pub fn reorder_rows<T: LaneCopy>(
    rows: &mut Vec<T>,
    count: usize,
    scratch: &mut Vec<T>,
    sources: &Sources,
) {
    scratch.clear();
    let wanted = sources.len() / LANES * count;
    if scratch.capacity() < wanted {
        // A little more than needed, because the number of half empty blocks changes with every sorting.
        scratch.reserve_exact(wanted + wanted / 16);
    }
    for lanes in sources.chunks_exact(LANES) {
        for row in 0..count {
            let mut block = rows[lanes[0] as usize / LANES * count + row];
            for (to, &source) in lanes.iter().enumerate() {
                let source = source as usize;
                block.copy_lane(to, &rows[source / LANES * count + row], source % LANES);
            }
            scratch.push(block);
        }
    }
    core::mem::swap(rows, scratch);
}
