//! Blocks of four points, and how all points are put into a new order.

use super::lanes::{LANES, Lanes, ZERO};

/// Numbers of four points.
pub trait PointBlock: Copy {
    /// How many numbers each point has.
    const NUMBERS: usize;

    /// Number `n` of each point.
    fn number(&mut self, n: usize) -> &mut Lanes;
}

impl PointBlock for () {
    const NUMBERS: usize = 0;

    fn number(&mut self, _n: usize) -> &mut Lanes {
        unreachable!("it has no numbers")
    }
}

impl PointBlock for Lanes {
    const NUMBERS: usize = 1;

    #[inline]
    fn number(&mut self, _n: usize) -> &mut Lanes {
        self
    }
}

impl<T: PointBlock, const N: usize> PointBlock for [T; N] {
    const NUMBERS: usize = N * T::NUMBERS;

    #[inline]
    fn number(&mut self, n: usize) -> &mut Lanes {
        self[n / T::NUMBERS].number(n % T::NUMBERS)
    }
}

/// The new order of points: for every lane, the lane that it comes from. Lanes without a point come from the first lane
/// of their tile.
pub type Sources = [u32];

/// Puts `blocks` into the order of `sources`, number by number, so that `scratch` holds one number of each point.
pub fn reorder<T: PointBlock>(blocks: &mut Vec<T>, scratch: &mut Vec<Lanes>, sources: &Sources) {
    reorder_rows(blocks, 1, scratch, sources);
}

/// The same for `count` items of each block.
pub fn reorder_rows<T: PointBlock>(
    rows: &mut Vec<T>,
    count: usize,
    scratch: &mut Vec<Lanes>,
    sources: &Sources,
) {
    let blocks = sources.len() / LANES;
    let wanted = blocks * count;
    let Some(&some) = rows.first() else { return };
    make_room(rows, wanted);
    make_room(scratch, blocks);
    rows.resize(wanted.max(rows.len()), some);
    for (row, n) in (0..count).flat_map(|row| (0..T::NUMBERS).map(move |n| (row, n))) {
        scratch.clear();
        scratch.extend(sources.as_chunks::<LANES>().0.iter().map(|lanes| {
            let mut sorted = ZERO;
            for (to, &source) in sorted.as_mut_array().iter_mut().zip(lanes) {
                let source = source as usize;
                let block = &mut rows[source / LANES * count + row];
                *to = block.number(n).as_array()[source % LANES];
            }
            sorted
        }));
        for (block, sorted) in rows.iter_mut().skip(row).step_by(count).zip(&*scratch) {
            *block.number(n) = *sorted;
        }
    }
    rows.truncate(wanted);
}

/// Makes room for `wanted` items and a few more, because the number of half empty blocks changes with every sorting.
fn make_room<T>(items: &mut Vec<T>, wanted: usize) {
    if items.capacity() < wanted {
        items.reserve_exact(wanted + wanted / 32 - items.len());
    }
}
