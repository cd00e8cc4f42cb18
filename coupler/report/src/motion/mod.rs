//! The motion of a run: its frames, as little of them as a page has room for.
//!
//! ```text
//! frames/ --load--> Loaded: kept frames and points --pack--> Motion: text and what it means
//! ```

mod data;
mod load;
mod pack;

use crate::thin::Amount;

pub use data::{Bodies, Motion, Points};
pub use load::{Loaded, load};

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
