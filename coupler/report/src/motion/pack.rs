//! Puts a motion into few bytes. The order of the arrays is that in which `templates/motion.js` takes them out again.

use super::data::{Bodies, Motion, Points};
use super::load::{Instant, Loaded};
use crate::field::{self, Field, Shown};
use crate::pack::{Packer, Scale, turn};
use crate::thin::{Amount, evenly};

/// Room around what moves, as a share of its longer side.
const MARGIN: f64 = 0.05;
/// How much more of what rests is shown around that, likewise.
const SURROUNDINGS: f64 = 0.12;
/// Most frames that 16 bits count.
const FRAMES: usize = u16::MAX as usize;

/// Frames and points of a motion that are kept.
struct Kept<'a> {
    loaded: &'a Loaded,
    frames: Vec<&'a Instant>,
    points: Vec<usize>,
}

/// A field with its numbers as shades of colour.
struct Shaded {
    shown: Shown,
    scale: Scale,
    /// Place among the fields of points, and of bodies.
    of_points: Option<usize>,
    of_bodies: Option<usize>,
}

/// How many points the bodies of a frame are worth.
pub(super) fn room_of_bodies(loaded: &Loaded) -> usize {
    2 * loaded.outlines.len()
}

/// The motion, with so much of it.
pub(super) fn motion(loaded: &Loaded, amount: Amount) -> Motion {
    let frames = evenly(loaded.frames.len(), amount.frames.min(FRAMES));
    let kept = Kept {
        loaded,
        points: evenly(loaded.points.len(), amount.points),
        frames: frames.iter().map(|&k| &loaded.frames[k]).collect(),
    };
    let fields = kept.fields();
    let mut packer = Packer::default();
    let points = (!kept.points.is_empty()).then(|| kept.pack_points(&mut packer, &fields));
    let bodies = (!loaded.outlines.is_empty()).then(|| kept.pack_bodies(&mut packer, &fields));
    Motion {
        times: frames.iter().map(|&k| loaded.times[k]).collect(),
        view: kept.view(),
        domain: None,
        points,
        bodies,
        fields: fields.into_iter().map(|field| field.shown).collect(),
        packed: packer.finish(),
        notes: Vec::new(),
    }
}

impl Kept<'_> {
    /// Where the points are that have not left.
    fn places(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let all = self.frames.iter().flat_map(|frame| {
            let at = |&k: &usize| frame.at.get(k).copied().flatten();
            self.points.iter().filter_map(at)
        });
        all.map(|[x, y]| [f64::from(x), f64::from(y)])
    }

    fn pack_points(&self, packer: &mut Packer, fields: &[Shaded]) -> Points {
        let count = self.points.len();
        // Each drawn larger where there are fewer.
        let larger = (self.loaded.all.points as f64 / count as f64).sqrt();
        let sides = || self.points.iter().map(|&k| self.loaded.points[k] * larger);
        let largest = sides().fold(0.0, f64::max);
        let last = |k: usize| {
            let there = |frame: &&&Instant| frame.at.get(k).is_some_and(Option::is_some);
            self.frames.iter().take_while(there).count() as u16
        };
        let gone: Vec<u16> = self.points.iter().map(|&k| last(k)).collect();
        packer.words(&gone);
        let size = Scale {
            low: 0.0,
            high: largest,
        };
        let sizes: Vec<u8> = sides().map(|side| size.coarse(side)).collect();
        packer.bytes(&sizes);
        let scales = [0, 1].map(|axis| Scale::of(self.places().map(|place| place[axis])));
        for (axis, scale) in scales.iter().enumerate() {
            // A point that has left keeps its last position, which takes no space and is not shown.
            let at = |frame: usize, k: usize| {
                let seen = frame.min(usize::from(gone[k]).saturating_sub(1));
                let place = self.frames[seen].at.get(self.points[k]).copied().flatten();
                place.map_or(0, |place| scale.fine(f64::from(place[axis])))
            };
            packer.track(self.frames.len(), count, at);
        }
        for field in fields {
            if let Some(number) = field.of_points {
                packer.shades(self.frames.len(), count, |frame, k| {
                    let values = self.frames[frame].of_points.get(number);
                    let value = values.map_or(f32::NAN, |values| values[self.points[k]]);
                    field.scale.coarse(f64::from(value))
                });
            }
        }
        let [x, y] = scales.map(|scale| [scale.low, scale.high]);
        Points {
            count,
            x,
            y,
            side: largest,
        }
    }

    fn pack_bodies(&self, packer: &mut Packer, fields: &[Shaded]) -> Bodies {
        let outlines = &self.loaded.outlines;
        let vertices: Vec<f32> = outlines
            .iter()
            .flatten()
            .flatten()
            .map(|&x| x as f32)
            .collect();
        packer.reals(&vertices);
        let (frames, count) = (self.frames.len(), outlines.len());
        let pose = |frame: usize, k: usize| {
            let poses = &self.frames[frame].poses;
            poses.get(k).copied().unwrap_or_default()
        };
        let scales = [0, 1].map(|axis| {
            let poses = self.frames.iter().flat_map(|frame| &frame.poses);
            Scale::of(poses.map(|pose| pose[axis]))
        });
        for (axis, scale) in scales.iter().enumerate() {
            packer.track(frames, count, |frame, k| scale.fine(pose(frame, k)[axis]));
        }
        packer.track(frames, count, |frame, k| turn(pose(frame, k)[2]));
        for field in fields {
            if let Some(number) = field.of_bodies {
                packer.shades(frames, count, |frame, k| {
                    let values = self.frames[frame].of_bodies.get(number);
                    let value = values.and_then(|v| v.get(k)).copied().unwrap_or(f32::NAN);
                    field.scale.coarse(f64::from(value))
                });
            }
        }
        let [x, y] = scales.map(|scale| [scale.low, scale.high]);
        Bodies {
            vertices: outlines.iter().map(Vec::len).collect(),
            x,
            y,
        }
    }

    /// The fields that change, and the speed, which a reader looks for.
    fn fields(&self) -> Vec<Shaded> {
        let (points, bodies) = (&self.loaded.point_fields, &self.loaded.body_fields);
        let mut all: Vec<&Field> = points.iter().collect();
        all.extend(bodies.iter().filter(|field| !points.contains(field)));
        let place = |fields: &[Field], field: &Field| fields.iter().position(|f| f == field);
        all.into_iter()
            .map(|field| self.shaded(field, place(points, field), place(bodies, field)))
            .filter(|f| f.shown.extremes[0] < f.shown.extremes[1] || f.shown.field.name == "speed")
            .collect()
    }

    fn shaded(&self, field: &Field, points: Option<usize>, bodies: Option<usize>) -> Shaded {
        let mut numbers = Vec::new();
        for frame in &self.frames {
            if let Some(values) = points.and_then(|k| frame.of_points.get(k)) {
                numbers.extend(self.points.iter().map(|&k| values[k]));
            }
        }
        let (mut scale, mut all) = field::range(&mut numbers);
        // Bodies are few, and each is seen.
        let of_bodies = bodies.map(|k| {
            let values = self
                .frames
                .iter()
                .filter_map(|frame| frame.of_bodies.get(k));
            Scale::of(values.flatten().map(|&value| f64::from(value)))
        });
        if let Some(own) = of_bodies {
            let none = numbers.is_empty();
            for range in [&mut scale, &mut all] {
                let joined = Scale {
                    low: range.low.min(own.low),
                    high: range.high.max(own.high),
                };
                *range = if none { own } else { joined };
            }
        }
        Shaded {
            shown: Shown {
                field: field.clone(),
                range: [scale.low, scale.high],
                extremes: [all.low, all.high],
                points: points.is_some(),
                bodies: bodies.is_some(),
            },
            scale,
            of_points: points,
            of_bodies: bodies,
        }
    }

    /// What is shown of the plane: all that moves, and what rests near it.
    fn view(&self) -> [f64; 4] {
        let (mut moving, mut resting) = (Vec::new(), Vec::new());
        for (k, outline) in self.loaded.outlines.iter().enumerate() {
            let poses: Vec<[f64; 3]> = self
                .frames
                .iter()
                .filter_map(|frame| frame.poses.get(k).copied())
                .collect();
            let still = poses.iter().all(|pose| *pose == poses[0]);
            let list = if still { &mut resting } else { &mut moving };
            for [x, y, angle] in poses {
                let (sin, cos) = angle.sin_cos();
                let place = |&[u, v]: &[f64; 2]| [x + cos * u - sin * v, y + sin * u + cos * v];
                list.extend(outline.iter().map(place));
                if still {
                    break;
                }
            }
        }
        let core: Vec<[f64; 2]> = self.places().chain(moving).collect();
        let side = self.loaded.points.iter().copied().fold(0.0, f64::max);
        let (core, surroundings) = if core.is_empty() {
            (corners(&resting), Vec::new())
        } else {
            (grown(corners(&core), 0.5 * side), resting)
        };
        let longer = (core[2] - core[0]).max(core[3] - core[1]);
        let near = grown(core, SURROUNDINGS * longer);
        let within = |[x, y]: [f64; 2]| [x.clamp(near[0], near[2]), y.clamp(near[1], near[3])];
        let seen: Vec<[f64; 2]> = surroundings
            .into_iter()
            .map(within)
            .chain([[core[0], core[1]], [core[2], core[3]]])
            .collect();
        let margin = if longer > 0.0 { MARGIN * longer } else { 1.0 };
        grown(corners(&seen), margin)
    }
}

/// Left, bottom, right, top.
fn corners(places: &[[f64; 2]]) -> [f64; 4] {
    let [x, y] = [0, 1].map(|axis| Scale::of(places.iter().map(|place| place[axis])));
    [x.low, y.low, x.high, y.high]
}

fn grown([left, bottom, right, top]: [f64; 4], by: f64) -> [f64; 4] {
    [left - by, bottom - by, right + by, top + by]
}
