//! Bodies and points at `t_n`, and the largest displacement of surfaces within two steps.

use interface::message::wire::{ImpInfo, ImpState};
use interface::step::GROWTH;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use mechanics::threads::Threads;

/// The largest displacement of surfaces in the next two steps, as a function of their speed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ahead {
    /// The two steps together in s.
    time: f64,
    /// Additional displacement by gravity and external forces in m.
    gained: f64,
}

impl Ahead {
    /// A step of `dt` (s) and the next one, after a kick of `kick` (s), if all surfaces are accelerated by at most
    /// `acceleration` (m/s^2). Contact forces are not part of the acceleration: a new contact has been counted, and an
    /// old one has acted before.
    pub fn new(kick: f64, dt: f64, acceleration: f64) -> Self {
        let next = GROWTH * dt;
        let time = dt + next;
        Self {
            time,
            gained: acceleration * (kick * time + 0.5 * (dt + next) * next),
        }
    }

    /// The two steps together in s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Largest displacement of a surface with this speed (m/s), in m.
    pub fn way(&self, speed: f64) -> f64 {
        speed * self.time + self.gained
    }
}

/// The sets of points.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Sets {
    /// The present one.
    pub now: Vec<ImpInfo>,
    /// The set to which lists and histories belong, if it was replaced since.
    pub replaced: Option<Vec<ImpInfo>>,
}

impl Sets {
    /// Replaces the set. Lists and histories have the order of the set before the first of several replacements.
    pub fn replace(&mut self, set: &[ImpInfo]) {
        let old = std::mem::replace(&mut self.now, set.to_vec());
        self.replaced.get_or_insert(old);
    }
}

/// Bodies and points at `t_n`.
#[derive(Debug, Clone, Copy)]
pub struct Now<'a> {
    /// The bodies.
    pub bodies: &'a Bodies,
    /// The sets of points.
    pub sets: &'a Sets,
    /// The points of the present set.
    pub states: &'a [ImpState],
    /// The largest displacement of surfaces in the next two steps.
    pub ahead: Ahead,
    /// Largest speed of the surface of a body in m/s.
    pub speed: f64,
}

/// What a list is made of.
#[derive(Debug, Clone, Copy)]
pub struct Among<'a> {
    /// The bodies, in the poses for which the list is.
    pub bodies: &'a Bodies,
    /// The set of points.
    pub set: &'a [ImpInfo],
    /// Who searches.
    pub threads: &'a Threads,
}

/// In which slots the points of the present set were before.
#[derive(Debug)]
pub struct Slots<'a> {
    set: &'a [ImpInfo],
    /// Ids and slots of the set that was replaced, if one was.
    before: Option<Vec<(u64, u32)>>,
}

impl<'a> Slots<'a> {
    /// Of these sets.
    pub fn of(sets: &'a Sets) -> Self {
        let by_id = |old: &Vec<ImpInfo>| {
            let mut ids: Vec<_> = old.iter().map(|info| info.id).zip(0..).collect();
            ids.sort_unstable();
            ids
        };
        Self {
            set: &sets.now,
            before: sets.replaced.as_ref().map(by_id),
        }
    }

    /// The slot before; `None` for a new point.
    pub fn before(&self, slot: u32) -> Option<u32> {
        let Some(before) = &self.before else {
            return Some(slot);
        };
        let id = self.set[slot as usize].id;
        let found = before.binary_search_by_key(&id, |&(id, _)| id);
        found.ok().map(|i| before[i].1)
    }
}
