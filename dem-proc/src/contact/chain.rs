//! A chain of markers as a disc sees it: where along the chain the distance from the disc's centre has its minima and maxima.
//!
//! A disc presses where the distance has a local minimum: at a foot within a segment, or at a corner that sticks out. At a
//! corner that is dented both segments have a foot near it, and the corner between is a local *maximum*. Counting the two
//! minima alone would count a flat boundary twice wherever it is dented by a millionth of a degree, and let a contact come and
//! go at full force. So the maximum between them counts too, with the sign -1. Along any stretch of the chain that is within
//! reach, minima less maxima are one. A pair of them comes and goes with equal distances, so energy and force are continuous
//! along any chain; and in a sharp corner, whose vertex the disc does not reach, the two walls are two contacts.

use interface::Vec2;
use interface::message::wire::ImpInfo;

/// Which slot follows which.
#[derive(Debug, Clone, Default)]
pub struct Links {
    next: Vec<Option<u32>>,
    previous: Vec<Option<u32>>,
}

impl Links {
    /// Those of a set. A link to nowhere, to itself, or to where another one leads is none.
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

/// A place on a chain: `(1 - s)` of one slot and `s` of another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Slots of the ends of the segment; the same twice at a vertex.
    pub slots: [u32; 2],
    /// Share of the second; 0 at a vertex.
    pub s: f64,
}

impl Foot {
    /// At a vertex.
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

    /// What lies there of vectors that the slots have.
    pub fn of(&self, vectors: &[Vec2]) -> Vec2 {
        let [a, b] = self.slots.map(|slot| vectors[slot as usize]);
        a * (1.0 - self.s) + b * self.s
    }
}

/// A local minimum or maximum of the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremum {
    /// Where.
    pub foot: Foot,
    /// Its place in m.
    pub point: Vec2,
    /// Distance of the centre from it in m.
    pub distance: f64,
    /// Whether it is a minimum, which counts once, or a maximum, which counts once less.
    pub least: bool,
    /// Whether the centre is on the outside of the chain there, to the right of it.
    pub outside: bool,
    /// Whether no other place is nearer in some direction along the chain: of a maximum whose segments have their feet beyond
    /// their other ends.
    pub alone: bool,
    /// Extrema with the same number hang together: the chain between them is within the contact distance.
    pub stretch: u32,
}

/// A segment as the centre of a disc sees it.
#[derive(Debug, Clone, Copy)]
struct Seen {
    from: u32,
    to: u32,
    /// Foot of the centre on its line, 0 at its beginning and 1 at its end.
    s: f64,
    /// Outward normal, not of unit length.
    normal: Vec2,
}

/// Finds the extrema of the distance of `center` (m) along the segments that begin at the slots `segments`, ascending, of
/// markers at `x` (m), in the order of the chain. `contact` is the distance (m) below which the two touch.
pub fn extrema(
    links: &Links,
    x: &[Vec2],
    segments: &[u32],
    center: Vec2,
    contact: f64,
    found: &mut Vec<Extremum>,
) {
    found.clear();
    let see = |from: u32| {
        let to = links.next(from)?;
        let (a, b) = (x[from as usize], x[to as usize]);
        let along = b - a;
        let length_sq = along.norm_squared();
        // A segment without length is its ends.
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
        stretch: 0,
        found,
    };
    let mut walked = 0;
    for &start in segments.iter().filter(|&&slot| begins(slot)) {
        walked += walk.run(start, &see, &listed);
    }
    if walked == segments.len() {
        return;
    }
    // A ring that is near all round has no beginning: it is walked from its lowest slot.
    let lowest = |start: u32| around(links, start).all(|slot| slot >= start);
    for &start in segments {
        if on_a_ring(links, start, &listed) && lowest(start) {
            walk.run(start, &see, &listed);
        }
    }
}

/// The slots from `start` on, as far as segments lead, or round a ring.
fn around(links: &Links, start: u32) -> impl Iterator<Item = u32> {
    let step = move |&slot: &u32| links.next(slot).filter(|&next| next != start);
    core::iter::successors(Some(start), step)
}

/// Whether segments lead back to `start`, all of them listed.
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
    contact: f64,
    stretch: u32,
    found: &'a mut Vec<Extremum>,
}

impl Walk<'_> {
    /// From the segment that begins at `start` as far as segments are listed, once round a ring; how many there were.
    fn run(
        &mut self,
        start: u32,
        see: &impl Fn(u32) -> Option<Seen>,
        listed: &impl Fn(u32) -> bool,
    ) -> usize {
        self.stretch += 1;
        let (begin, of_begin) = (self.found.len(), self.stretch);
        let Some(first) = see(start) else {
            return 0;
        };
        let (mut here, mut count) = (first, 1);
        let closes = loop {
            if here.s > 0.0 && here.s < 1.0 {
                let foot = Foot {
                    slots: [here.from, here.to],
                    s: here.s,
                };
                self.add(foot, true, here.normal, false);
            }
            let next = Some(here.to).filter(|&to| listed(to)).and_then(see);
            let Some(next) = next else {
                break false;
            };
            self.corner(&here, &next);
            if next.from == start {
                break true;
            }
            here = next;
            count += 1;
        };
        if closes {
            self.join_ends(begin, of_begin);
        } else {
            if first.s <= 0.0 {
                self.add(Foot::vertex(first.from), true, first.normal, false);
            }
            if here.s >= 1.0 {
                self.add(Foot::vertex(here.to), true, here.normal, false);
            }
        }
        count
    }

    /// Once round a ring: the stretch at the end goes on in that at the beginning, and stands before it.
    fn join_ends(&mut self, begin: usize, of_begin: u32) {
        if self.stretch == of_begin {
            return;
        }
        let of_ring = &mut self.found[begin..];
        let last = of_ring.iter_mut().rev();
        let last = last.take_while(|e| e.stretch == self.stretch);
        let joined = last.map(|e| e.stretch = of_begin).count();
        of_ring.rotate_right(joined);
    }

    /// The vertex between two segments.
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
        let point = foot.of(self.x);
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
            stretch: self.stretch,
        });
        // Beyond a place that is not reached another stretch begins.
        if !(least || outside && distance < self.contact) {
            self.stretch += 1;
        }
    }
}

/// A vector over its length; nothing of nothing.
fn unit(v: Vec2) -> Vec2 {
    v.try_normalize(0.0).unwrap_or_else(Vec2::zeros)
}

/// Calls `share` with the slots near a foot and the largest share that each can have of a foot within `way` (m) along the chain.
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
    // Beyond the ends, as far as the way leads.
    let walk = |mut at: u32, mut left: f64, forward: bool, share: &mut dyn FnMut(u32, f64)| {
        let mut steps = 0;
        while left > 0.0 && steps < 64 {
            let beyond = if forward {
                links.next(at)
            } else {
                links.previous(at)
            };
            let Some(beyond) = beyond else {
                return;
            };
            let length = length(at, beyond);
            share(beyond, (left / length).min(1.0));
            (at, left, steps) = (beyond, left - length, steps + 1);
        }
    };
    walk(to, way - first * own, true, &mut share);
    walk(from, way - second * own, false, &mut share);
}

/// Whether the centre of a disc has come through the chain: it is on the inside of a foot within a segment, nearer than a point
/// can go in a step.
pub fn came_through(extremum: &Extremum, radius: f64) -> bool {
    let [a, b] = extremum.foot.slots;
    a != b && !extremum.outside && extremum.distance <= 0.5 * radius
}
