//! Nodes of the oracle's dense grid, and the positions at which they appear.

use interface::config::Wall;

/// A node that is free or held, and all positions at which it appears: its own position, and those beyond walls where it is an
/// image.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) at: [i64; 2],
    pub(super) places: Vec<Image<[i64; 2]>>,
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
