//! The motion as the page has it: what its script reads.

use serde::Serialize;

use crate::field::Shown;

/// The motion as the page has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Motion {
    /// Times of the frames in s.
    pub times: Vec<f64>,
    /// What is shown of the plane: left, bottom, right, top in m.
    pub view: [f64; 4],
    /// The domain of the continuum, likewise.
    pub domain: Option<[f64; 4]>,
    /// The points, if there are any.
    pub points: Option<Points>,
    /// The bodies, if there are any.
    pub bodies: Option<Bodies>,
    /// What colours can say; the first is shown unless the reader chooses another.
    pub fields: Vec<Shown>,
    /// All that, as [`crate::pack::Packer`] packs it.
    #[serde(skip)]
    pub packed: String,
    /// What the page does not have of the motion, for people.
    #[serde(skip)]
    pub notes: Vec<String>,
}

/// The points of a motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Points {
    /// How many are shown.
    pub count: usize,
    /// Range of x in m that 16 bits represent.
    pub x: [f64; 2],
    /// Likewise of y.
    pub y: [f64; 2],
    /// Side in m of the largest point as it is drawn; 8 bits represent that of each.
    pub side: f64,
}

/// The bodies of a motion, as outlines that move rigidly.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bodies {
    /// Vertices of each outline.
    pub vertices: Vec<usize>,
    /// Range of x of their centres in m that 16 bits represent.
    pub x: [f64; 2],
    /// Likewise of y.
    pub y: [f64; 2],
}
