//! The steps of a case of a continuum: the kit is the bodies.

use std::collections::BTreeMap;

use interface::message::wire::{ImpForce, Limits, flags};

use super::super::judge::Judge;
use super::super::run::{Stop, Window, report};
use super::case::Case;
use super::oracle::{Expected, Oracle};
use crate::bench::{Run, at_least};

/// Where a run stands.
#[derive(Clone)]
pub struct Stand {
    pub(super) oracle: Oracle,
    step: u32,
    /// The point that has an id.
    ids: BTreeMap<u64, usize>,
    /// The points of the set, slot by slot.
    pub(super) set: Vec<usize>,
    /// Where all points were at the last selection, in m.
    pub(super) chosen: Vec<[f64; 2]>,
    /// Travel of the bodies in the forces of the step before, 0 after a selection, in m.
    pub(super) bodies: f64,
    /// Sets so far.
    pub(super) sets: u64,
    /// The highest speed so far in m/s.
    pub(super) fastest: f64,
    /// Whether anything has pressed.
    pub(super) pressed: bool,
    /// Whether the solver tells the work of the stress beside the stored energy.
    pub(super) works: bool,
}

impl Stand {
    /// At the start.
    pub fn new(oracle: Oracle, works: bool) -> Self {
        Self {
            step: 0,
            ids: BTreeMap::new(),
            set: Vec::new(),
            chosen: Vec::new(),
            bodies: 0.0,
            sets: 0,
            fastest: oracle.fastest(),
            pressed: false,
            works,
            oracle,
        }
    }

    /// The point that has this id. An id that is new belongs to the nearest point of its group that has none.
    pub fn named(&mut self, id: u64, group: u32, position: [f64; 2]) -> Option<usize> {
        if let Some(known) = self.ids.get(&id) {
            return (self.oracle.points[*known].group == group as usize).then_some(*known);
        }
        let free = |k: &usize| {
            self.oracle.points[*k].group == group as usize
                && !self.ids.values().any(|named| named == k)
        };
        let away = |k: &usize| {
            let [x, y] = self.oracle.point(*k).x;
            (x - position[0]).hypot(y - position[1])
        };
        let all = (0..self.oracle.points.len()).filter(free);
        let nearest = all.min_by(|a, b| away(a).total_cmp(&away(b)))?;
        self.ids.insert(id, nearest);
        Some(nearest)
    }
}

/// A step that was answered.
struct Answered {
    expected: Expected,
    forces: Vec<ImpForce>,
}

/// The steps of a grant, and the report on it.
pub fn window_of(
    flow: &mut Run,
    case: &Case,
    stand: &mut Stand,
    window: Window,
    judge: &mut Judge,
) -> Result<(), Stop> {
    let (first, next) = (stand.step, flow.next());
    flow.outlines = case.outlines();
    let before = stand.clone();
    let mut answered: Vec<Answered> = Vec::new();
    for k in 0..window.steps {
        judge.step = stand.step;
        if !stand.oracle.is_sound(window.dt) {
            return Err(Stop::Doubtful);
        }
        let own = flow.header();
        let shown = flow.states()?;
        let asked = shown
            .asked
            .iter()
            .map(|h| (h.step, h.epoch, h.count, h.flags));
        let wanted = shown
            .asked
            .iter()
            .map(|_| (own.step, own.epoch, 0, flags::WANT_ENVELOPES));
        let of = "step, epoch, count and flags of what asks for envelopes";
        judge.same("I-1c", of, asked.collect::<Vec<_>>(), wanted.collect())?;
        let said = [shown.header.step, shown.header.epoch, shown.header.count];
        let want = [own.step, own.epoch, shown.states.len() as u64];
        judge.same("I-1c", "step, epoch and count of states", said, want)?;
        let numbers = shown.states.iter().flat_map(|s| [s.position, s.velocity]);
        judge.keep(numbers.flatten());
        judge.set(&shown, flow.imps(), stand, case)?;
        judge.states(&shown, stand)?;
        let mut forces = vec![ImpForce::default(); stand.oracle.points.len()];
        for point in &stand.set {
            forces[*point] = case.push(stand.step, *point);
        }
        let sent: Vec<ImpForce> = stand.set.iter().map(|point| forces[*point]).collect();
        flow.travel = case.travel.at(stand.step);
        let granted = flow.coming(window.measured && k == 0);
        flow.press(&sent)?;
        stand.pressed |= forces.iter().any(|f| f.force != [0.0; 2]);
        let expected = stand.oracle.step(&granted, &forces, k + 1 == window.steps);
        stand.bodies = flow.travel;
        stand.fastest = stand.fastest.max(stand.oracle.fastest());
        stand.step += 1;
        answered.push(Answered { expected, forces });
    }
    judge.step = first;
    let told = report(flow, next, window, judge)?;
    judge.counts(&told.report, stand)?;
    if window.frame && told.points.is_none() {
        judge.differ("R-5a", "frame", "all points", "none")?;
    }
    if let Some((header, points)) = &told.points {
        let mut then = Stand {
            ids: stand.ids.clone(),
            ..before
        };
        judge.all_points("R-5a", (next, *header), points, &mut then)?;
        stand.ids = then.ids;
    }
    if window.measured {
        let expected = &answered[0].expected;
        judge.groups(
            expected,
            at_least(told.groups.as_ref(), expected.groups.len(), "groups")?,
            stand,
        )?;
        judge.books(expected, &told.report.ledger, stand)?;
    }
    if let Some(Answered { expected, forces }) = answered.pop() {
        judge.step = stand.step - 1;
        let limits: Limits = told.report.limits;
        judge.bounds(&limits, &expected, &forces, stand)?;
    }
    Ok(())
}
