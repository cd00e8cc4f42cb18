//! Where along a chain of markers the distance from the centre of a disc has its minima and maxima.
//!
//! A disc presses where the distance has a local minimum: at a foot within a segment, or at a convex corner of the
//! chain. Near a reflex corner both segments have a foot, and the corner between them is a local *maximum*. If only the
//! two minima counted, a flat boundary would count twice wherever a corner is reflex by a millionth of a degree, and a
//! contact would appear and disappear at full force. So the maximum between them counts with the sign -1. Along any
//! span of the chain within reach, the number of minima less that of maxima is one. A minimum and a maximum appear
//! and disappear together, at equal distances, so energy and force are continuous along any chain. In a sharp corner
//! whose vertex the disc does not reach, the two walls are two contacts.

use std::ops::{Add, Mul};

use interface::Vec2;
use interface::message::wire::ImpInfo;

/// The segments between slots: which slot follows which.
#[derive(Debug, Clone, Default)]
pub struct Links {
    next: Vec<Option<u32>>,
    previous: Vec<Option<u32>>,
}

impl Links {
    /// The links of a set. A link is ignored if it leads to no slot, to its own slot, or to a slot to which another
    /// link leads.
    pub fn of(set: &[ImpInfo]) -> Self {
        let mut links = Self {
            next: vec![None; set.len()],
            previous: vec![None; set.len()],
        };
        for (slot, info) in (0..).zip(set) {
            let next = info.next.checked_sub(1).filter(|next| *next != slot);
            let Some(next) = next.filter(|next| (*next as usize) < set.len()) else {
                continue;
            };
            if links.previous[next as usize].is_none() {
                links.next[slot as usize] = Some(next);
                links.previous[next as usize] = Some(slot);
            }
        }
        links
    }

    /// The slot that a segment leads to from this one.
    pub fn next(&self, slot: u32) -> Option<u32> {
        self.next[slot as usize]
    }

    /// The slot from which a segment leads to this one.
    pub fn previous(&self, slot: u32) -> Option<u32> {
        self.previous[slot as usize]
    }
}

/// A place on a chain: `(1 - s)` times one slot plus `s` times another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Slots of the ends of the segment; at a vertex, both are the same.
    pub slots: [u32; 2],
    /// Share of the second slot; 0 at a vertex.
    pub s: f64,
}

impl Foot {
    /// The foot at a vertex.
    fn vertex(slot: u32) -> Self {
        Self {
            slots: [slot, slot],
            s: 0.0,
        }
    }

    /// Shares of the two slots.
    pub fn shares(&self) -> [f64; 2] {
        [1.0 - self.s, self.s]
    }

    /// The value at the foot of something that has these values at the slots.
    pub fn mean<T: Mul<f64, Output = T> + Add<Output = T>>(&self, [a, b]: [T; 2]) -> T {
        a * (1.0 - self.s) + b * self.s
    }
}

/// A local minimum or maximum of the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremum {
    /// Its place on the chain.
    pub foot: Foot,
    /// Its position in m.
    pub point: Vec2,
    /// Distance from the centre of the disc in m.
    pub distance: f64,
    /// Whether it is a minimum, which counts once, or a maximum, which is subtracted once.
    pub least: bool,
    /// Whether the centre of the disc is on the outside of the chain there, which is its right side.
    pub outside: bool,
    /// For a maximum: whether one of its two segments contains no minimum, because its foot lies beyond the segment's
    /// other end.
    pub alone: bool,
    /// Number of the span. Extrema with the same number are connected: the chain between them is within the contact
    /// distance.
    pub span: u32,
}

/// A segment, and where the foot of a disc's centre is on it.
#[derive(Debug, Clone, Copy)]
struct Seen {
    from: u32,
    to: u32,
    /// Foot of the centre on its line, 0 at its beginning and 1 at its end.
    s: f64,
    /// Outward normal, not of unit length.
    normal: Vec2,
}

/// Finds the extrema of the distance of `center` (m) along the segments that begin at the slots `segments` (ascending),
/// in the order of the chain. Markers are at `x` (m). `contact` gives the distance (m) below which the disc and the marker of a
/// slot touch.
pub fn extrema(
    links: &Links,
    x: &[Vec2],
    segments: &[u32],
    center: Vec2,
    contact: &dyn Fn(u32) -> f64,
    found: &mut Vec<Extremum>,
) {
    found.clear();
    let see = |from: u32| {
        let to = links.next(from)?;
        let (a, b) = (x[from as usize], x[to as usize]);
        let along = b - a;
        let length_sq = along.norm_squared();
        // On a segment without length every foot is right.
        let s = if length_sq > 0.0 {
            (center - a).dot(&along) / length_sq
        } else {
            0.5
        };
        let normal = Vec2::new(along.y, -along.x);
        Some(Seen {
            from,
            to,
            s,
            normal,
        })
    };
    let listed = |slot: u32| segments.binary_search(&slot).is_ok();
    let begins = |slot: u32| links.previous(slot).is_none_or(|before| !listed(before));
    let mut walk = Walk {
        x,
        center,
        contact,
        span: 0,
        found,
    };
    let mut walked = 0;
    for &start in segments.iter().filter(|&&slot| begins(slot)) {
        walked += walk.run(start, false, &see, &listed);
    }
    if walked == segments.len() {
        return;
    }
    // A ring that is near everywhere has no beginning, so it begins at its lowest slot.
    let lowest = |start: u32| around(links, start).all(|slot| slot >= start);
    for &start in segments {
        if on_a_ring(links, start, &listed) && lowest(start) {
            walk.run(start, true, &see, &listed);
        }
    }
}

/// The slots from `start` on, to the last one that segments lead to, or once round a ring.
fn around(links: &Links, start: u32) -> impl Iterator<Item = u32> {
    let step = move |&slot: &u32| links.next(slot).filter(|&next| next != start);
    core::iter::successors(Some(start), step)
}

/// Whether segments, all of them listed, lead back to `start`.
fn on_a_ring(links: &Links, start: u32, listed: &impl Fn(u32) -> bool) -> bool {
    let mut last = start;
    for slot in around(links, start) {
        if !listed(slot) {
            return false;
        }
        last = slot;
    }
    links.next(last) == Some(start)
}

/// A walk along a chain.
struct Walk<'a> {
    x: &'a [Vec2],
    center: Vec2,
    contact: &'a dyn Fn(u32) -> f64,
    span: u32,
    found: &'a mut Vec<Extremum>,
}

impl Walk<'_> {
    /// Goes from the segment that begins at `start` to the last one that is listed, or once round a ring. Returns
    /// the number of segments.
    fn run(
        &mut self,
        start: u32,
        ring: bool,
        see: &impl Fn(u32) -> Option<Seen>,
        listed: &impl Fn(u32) -> bool,
    ) -> usize {
        self.span += 1;
        let (begin, of_begin) = (self.found.len(), self.span);
        let Some(first) = see(start) else {
            return 0;
        };
        let (mut here, mut count) = (first, 1);
        if !ring && first.s <= 0.0 {
            self.add(Foot::vertex(first.from), true, first.normal, false);
        }
        loop {
            if here.s > 0.0 && here.s < 1.0 {
                let foot = Foot {
                    slots: [here.from, here.to],
                    s: here.s,
                };
                self.add(foot, true, here.normal, false);
            }
            let next = Some(here.to).filter(|&to| listed(to)).and_then(see);
            let Some(next) = next else {
                break;
            };
            self.corner(&here, &next);
            if next.from == start {
                break;
            }
            here = next;
            count += 1;
        }
        if ring {
            self.join_ends(begin, of_begin);
        } else if here.s >= 1.0 {
            self.add(Foot::vertex(here.to), true, here.normal, false);
        }
        count
    }

    /// Joins the span at the end of a ring to that at its beginning, and moves its extrema to the front.
    fn join_ends(&mut self, begin: usize, of_begin: u32) {
        if self.span == of_begin {
            return;
        }
        let of_ring = &mut self.found[begin..];
        let last = of_ring.iter_mut().rev();
        let last = last.take_while(|e| e.span == self.span);
        let joined = last.map(|e| e.span = of_begin).count();
        of_ring.rotate_right(joined);
    }

    /// Adds the vertex between two segments.
    fn corner(&mut self, before: &Seen, after: &Seen) {
        let [ends, begins] = [before.s >= 1.0, after.s <= 0.0];
        let bisector = unit(before.normal) + unit(after.normal);
        let foot = Foot::vertex(after.from);
        if ends && begins {
            self.add(foot, true, bisector, false);
        } else if !ends && !begins {
            let alone = before.s <= 0.0 || after.s >= 1.0;
            self.add(foot, false, bisector, alone);
        }
    }

    fn add(&mut self, foot: Foot, least: bool, normal: Vec2, alone: bool) {
        let point = foot.mean(foot.slots.map(|slot| self.x[slot as usize]));
        let away = self.center - point;
        let distance = away.norm();
        let outside = away.dot(&normal) > 0.0;
        self.found.push(Extremum {
            foot,
            point,
            distance,
            least,
            outside,
            alone,
            span: self.span,
        });
        // After a place out of reach a new span begins.
        if !(least || outside && distance < (self.contact)(foot.slots[0])) {
            self.span += 1;
        }
    }
}

/// The unit vector in a direction; zero for a vector without length.
fn unit(v: Vec2) -> Vec2 {
    v.try_normalize(0.0).unwrap_or_else(Vec2::zeros)
}

/// Calls `share` with the slots near a foot, and with the largest share that each can have of any foot within `way` (m)
/// along the chain.
pub fn shares_within(
    links: &Links,
    x: &[Vec2],
    foot: &Foot,
    way: f64,
    mut share: impl FnMut(u32, f64),
) {
    let [from, to] = foot.slots;
    let length = |a: u32, b: u32| (x[b as usize] - x[a as usize]).norm();
    let own = length(from, to);
    let [first, second] = foot.shares();
    if from == to {
        share(from, 1.0);
    } else {
        share(from, (first + way / own).min(1.0));
        share(to, (second + way / own).min(1.0));
    }
    // Slots beyond the ends of the segment, as far as `way` leads, and at most once round a ring.
    let walk = |end: u32, mut left: f64, forward: bool, share: &mut dyn FnMut(u32, f64)| {
        let mut at = end;
        while left > 0.0 {
            let beyond = if forward {
                links.next(at)
            } else {
                links.previous(at)
            };
            let Some(beyond) = beyond.filter(|&slot| slot != end) else {
                return;
            };
            let length = length(at, beyond);
            share(beyond, (left / length).min(1.0));
            (at, left) = (beyond, left - length);
        }
    };
    walk(to, way - first * own, true, &mut share);
    walk(from, way - second * own, false, &mut share);
}

/// Whether the centre of a disc has passed through the chain: it is on the inside of a foot within a segment, and
/// nearer to it than a point can move in a step.
pub fn came_through(extremum: &Extremum, radius: f64) -> bool {
    let [a, b] = extremum.foot.slots;
    a != b && !extremum.outside && extremum.distance <= 0.5 * radius
}
