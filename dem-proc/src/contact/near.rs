//! A list of the segments of a boundary chain that are near each disc.

use interface::Vec2;
use interface::message::wire::ImpInfo;

use crate::body::bodies::Bodies;
use crate::contact::chain::Links;
use crate::lists::neighbours::REACH;
use mechanics::outline::foot;

/// A disc with segments near it.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    /// Its body.
    pub body: u32,
    /// Index of its vertex in the outline of the body.
    pub part: u32,
    /// Its segments in [`NearSegments::segments`]: index of the first, and their number.
    segments: [u32; 2],
}

/// The segments near each disc.
#[derive(Debug, Default)]
pub struct NearSegments {
    discs: Vec<Near>,
    /// Slots at which segments begin, ascending for each disc.
    segments: Vec<u32>,
    /// Buffer for the segments around a body. It is kept, so that no step allocates.
    around: Vec<u32>,
}

impl NearSegments {
    /// Lists the segments up to `skin` (m) farther away than they can matter. The markers of `set` are at `positions` (m).
    pub fn list(
        &mut self,
        bodies: &Bodies,
        (set, links): (&[ImpInfo], &Links),
        positions: &[Vec2],
        skin: f64,
    ) {
        // Whether the segment that begins at a slot is near a disc of radius `r` (m) around `center` (m).
        let is_near = |from: u32, center: Vec2, r: f64| {
            links.next(from).is_some_and(|to| {
                let [a, b] = [from, to].map(|slot| positions[slot as usize]);
                let margin = (1.0 + REACH) * set[from as usize].radius + skin;
                (foot(a, b, center).0 - center).norm() <= r + margin
            })
        };
        self.discs.clear();
        self.segments.clear();
        for (body, state) in bodies.state.iter().enumerate() {
            let all = 0..set.len() as u32;
            self.around.clear();
            (self.around).extend(all.filter(|&from| is_near(from, state.center, state.extent)));
            if self.around.is_empty() {
                continue;
            }
            for (part, &at) in (0..).zip(bodies.outline_of(body)) {
                let radius = bodies.radius_at(body, part);
                let first = self.segments.len();
                let around = self.around.iter().copied();
                (self.segments).extend(around.filter(|&from| is_near(from, at, radius)));
                let count = self.segments.len() - first;
                if count > 0 {
                    self.discs.push(Near {
                        body: body as u32,
                        part,
                        segments: [first, count].map(|n| n as u32),
                    });
                }
            }
        }
    }

    /// The discs with segments near them, in the order of the bodies.
    pub fn discs(&self) -> &[Near] {
        &self.discs
    }

    /// Slots at which the segments near a disc begin, ascending; there is at least one.
    pub fn of(&self, near: &Near) -> &[u32] {
        let [first, count] = near.segments.map(|n| n as usize);
        &self.segments[first..first + count]
    }
}
