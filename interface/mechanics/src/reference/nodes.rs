//! Nodes of the oracle's dense grid, and the positions at which they appear.

use interface::config::Wall;

/// A node that is free or held, and all positions at which it appears: its own position, and those beyond walls where it is an
/// image.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) at: [i64; 2],
    pub(super) places: Vec<Image<[i64; 2]>>,
}

/// Nodes beyond the domain on each side.
pub(super) const RIM: i64 = 3;

/// All nodes, and which of them is where.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    pub(super) list: Vec<Node>,
    /// Row by row from [`RIM`] nodes below the domain to as many above it.
    places: Vec<Option<(usize, Image<[i64; 2]>)>>,
    /// Along x and y.
    counts: [i64; 2],
}

impl Nodes {
    pub(super) fn new(list: Vec<Node>, cells: [i64; 2]) -> Self {
        let counts = cells.map(|n| n + 1 + 2 * RIM);
        let [width, height] = counts;
        let mut places = vec![None; (width * height) as usize];
        for (n, node) in list.iter().enumerate() {
            for image in &node.places {
                let [i, j] = image.at.map(|i| i + RIM);
                if (0..width).contains(&i) && (0..height).contains(&j) {
                    places[(j * width + i) as usize] = Some((n, *image));
                }
            }
        }
        Self {
            list,
            places,
            counts,
        }
    }

    /// The one at a place, if it is no image.
    pub(super) fn at(&self, at: [i64; 2]) -> Option<usize> {
        self.list.iter().position(|node| node.at == at)
    }

    /// Those not farther along an axis from a place in the domain (in cells) than any shape function reaches, which is two cells.
    pub(super) fn around(
        &self,
        [x, y]: [f64; 2],
    ) -> impl Iterator<Item = (usize, &Image<[i64; 2]>)> {
        let near = |x: f64, count: i64| {
            let [first, last] = [(x - 2.0).ceil(), (x + 2.0).floor()].map(|i| i as i64 + RIM);
            first.max(0)..=last.min(count - 1)
        };
        let [width, height] = self.counts;
        let all = near(y, height).flat_map(move |j| near(x, width).map(move |i| j * width + i));
        all.filter_map(|at| self.places[at as usize].as_ref())
            .map(|(n, image)| (*n, image))
    }
}

/// Where a node appears.
#[derive(Debug, Clone, Copy)]
pub(super) struct Image<At> {
    pub(super) at: At,
    /// Its velocity there over its own.
    pub(super) sign: [f64; 2],
    /// What is added to it: of a driven wall twice the velocity, in m/s.
    pub(super) moves: [f64; 2],
}

impl<At> Image<At> {
    pub(super) fn own(at: At) -> Self {
        Self {
            at,
            sign: [1.0; 2],
            moves: [0.0; 2],
        }
    }

    pub(super) fn velocity(&self, v: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|a| self.sign[a] * v[a] + self.moves[a])
    }
}

/// The velocity in m/s of a wall across `axis` that moves along itself.
pub(super) fn driven(wall: Wall, axis: usize) -> Option<[f64; 2]> {
    match wall {
        Wall::Driven { speed } => Some([0, 1].map(|a| if a == axis { 0.0 } else { speed })),
        _ => None,
    }
}
