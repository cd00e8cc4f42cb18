//! The motion of a run: its frames, as little of them as a page has room for.
//!
//! ```text
//! frames/ --load--> Loaded: kept frames and points --pack--> Motion: text and what it means
//! ```

mod load;
mod pack;

use serde::Serialize;

use crate::field::Shown;
use crate::thin::Amount;

pub use load::{Loaded, load};

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
    /// Range of x in m that 16 bits tell.
    pub x: [f64; 2],
    /// Likewise of y.
    pub y: [f64; 2],
    /// Side in m of the largest point as it is drawn; 8 bits tell that of each.
    pub side: f64,
}

/// The bodies of a motion, as outlines that move rigidly.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bodies {
    /// Vertices of each outline.
    pub vertices: Vec<usize>,
    /// Range of x of their middles in m that 16 bits tell.
    pub x: [f64; 2],
    /// Likewise of y.
    pub y: [f64; 2],
}

impl Loaded {
    /// The motion in at most `room` bytes of text, as far as that is possible at all.
    pub fn into_motion(self, room: usize) -> Motion {
        let all = Amount {
            frames: self.times.len(),
            points: self.points.len(),
        };
        let fixed = pack::room_of_bodies(&self);
        let mut samples = all.frames * (all.points + fixed);
        let mut motion = pack::motion(&self, all);
        for _ in 0..8 {
            if motion.packed.len() <= room {
                break;
            }
            let share = room as f64 / motion.packed.len() as f64;
            samples = (samples as f64 * share * 0.97) as usize;
            motion = pack::motion(&self, crate::thin::shares(all, fixed, samples));
        }
        motion.notes = self.notes(&motion);
        motion
    }

    fn notes(&self, motion: &Motion) -> Vec<String> {
        let mut notes = self.faults.clone();
        let shown = motion.times.len();
        if shown < self.all.frames {
            notes.push(format!(
                "{shown} of {} frames are shown, evenly spread in time, to keep the page small.",
                self.all.frames
            ));
        }
        let points = motion.points.as_ref().map_or(0, |points| points.count);
        if points < self.all.points {
            notes.push(format!(
                "{} of {} points are shown, evenly spread and drawn larger, to keep the page small.",
                crate::words::count(points as u64),
                crate::words::count(self.all.points as u64)
            ));
        }
        notes
    }
}
