//! The steps of a case of a continuum: the kit is the bodies.

use std::collections::BTreeMap;
use std::time::Duration;

use interface::config::capability::{Capabilities, PLASTIC_STRAIN, STRESS_WORK};
use interface::message::control::{Configure, Order};
use interface::message::wire::{ImpForce, Limits, flags};
use mechanics::reference::layers::{Expected, Oracle};

use super::super::judge::Judge;
use super::super::plan::Epoch;
use super::super::run::{self, Begun, Stop, Window, report};
use super::case::Case;
use super::generate;
use crate::bench::{Bench, Run, at_least, configure};

/// Most cells of a domain; most of the drawn ones have some two hundred.
const MOST_CELLS: f64 = 2000.0;

/// Which ids the points have.
#[derive(Clone)]
struct Names {
    /// The point that has an id.
    ids: BTreeMap<u64, usize>,
    /// Whether a point has none yet.
    free: Vec<bool>,
}

/// Where a run stands.
#[derive(Clone)]
pub struct Stand {
    pub(super) oracle: Oracle,
    step: u32,
    names: Names,
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
    /// Whether the solver reports the work of the stress beside the stored energy.
    pub(super) works: bool,
    /// Whether it reports the plastic strain of points.
    pub(super) strains: bool,
}

impl Stand {
    /// At the start.
    pub fn new(oracle: Oracle, [works, strains]: [bool; 2]) -> Self {
        Self {
            step: 0,
            names: Names {
                ids: BTreeMap::new(),
                free: vec![true; oracle.points.len()],
            },
            set: Vec::new(),
            chosen: Vec::new(),
            bodies: 0.0,
            sets: 0,
            fastest: oracle.fastest(),
            pressed: false,
            works,
            strains,
            oracle,
        }
    }

    /// The point that has this id. An id that is new belongs to the nearest point of its group that has none.
    pub fn named(&mut self, id: u64, group: u32, position: [f64; 2]) -> Option<usize> {
        if let Some(known) = self.names.ids.get(&id) {
            return (self.oracle.points[*known].group == group as usize).then_some(*known);
        }
        let free =
            |k: &usize| self.oracle.points[*k].group == group as usize && self.names.free[*k];
        let away = |k: &usize| {
            let [x, y] = self.oracle.point(*k).x;
            (x - position[0]).hypot(y - position[1])
        };
        let all = (0..self.oracle.points.len()).filter(free);
        let nearest = all.min_by(|a, b| away(a).total_cmp(&away(b)))?;
        self.names.ids.insert(id, nearest);
        self.names.free[nearest] = false;
        Some(nearest)
    }

    /// What was `before`, with the ids that points have got since.
    fn back_to(&self, before: Self) -> Self {
        Self {
            names: self.names.clone(),
            ..before
        }
    }
}

impl run::Case for Case {
    type Stand = Stand;
    const CAUSES: &'static [&'static str] = &["T-1a", "F-1a", "I-2g", "I-7a", "I-6a"];

    fn of_seed(seed: u64, takes: &Capabilities) -> Self {
        generate::case(seed, takes)
    }

    fn epochs(&mut self) -> &mut Vec<Epoch> {
        &mut self.epochs
    }

    fn is_possible(&self) -> bool {
        let drawn = self.bodies.iter().all(|body| !body.vertices.is_empty());
        let sound = self.config.faults().is_empty() && !self.config.groups.is_empty();
        // A case made smaller may have a wider domain by rounding, and the oracle keeps every node of it.
        let [lower, upper] = self.config.domain;
        let cells = [0, 1].map(|a| (upper[a] - lower[a]) / self.config.cell);
        drawn
            && sound
            && self.begins_elastic()
            && cells[0] * cells[1] < MOST_CELLS
            && Oracle::new(&self.config).is_some()
    }

    fn order(&self) -> Configure {
        configure(&self.config)
    }

    fn begun<'b>(&self, bench: &'b Bench, judge: &mut Judge) -> Result<Begun<'b, Self>, Stop> {
        let oracle = Oracle::new(&self.config).ok_or(Stop::Doubtful)?;
        let run = bench.run_continuum(&self.config)?;
        judge.readiness(&oracle, &run.ready.readiness)?;
        let reports = [STRESS_WORK, PLASTIC_STRAIN].map(|name| bench.takes(name));
        Ok((run, Stand::new(oracle, reports)))
    }

    fn window(
        &self,
        flow: &mut Run,
        stand: &mut Stand,
        window: Window,
        judge: &mut Judge,
    ) -> Result<(), Stop> {
        let (first, next) = (stand.step, flow.next());
        flow.outlines = self.outlines();
        let before = stand.clone();
        // Of each step.
        let mut answered: Vec<(Expected, Vec<ImpForce>)> = Vec::new();
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
            let there = shown.states.len() as u64;
            let sent = [shown.header.step, shown.header.epoch, there];
            let want = [own.step, own.epoch, flow.at.set.len() as u64];
            judge.same("I-1c", "step, epoch and count of states", sent, want)?;
            let numbers = shown.states.iter().flat_map(|s| [s.position, s.velocity]);
            judge.keep(numbers.flatten());
            judge.set(&shown, &flow.at.set, stand, self)?;
            judge.states(&shown, stand)?;
            let mut forces = vec![ImpForce::default(); stand.oracle.points.len()];
            for point in &stand.set {
                forces[*point] = self.push(stand.step, *point);
            }
            let sent: Vec<ImpForce> = stand.set.iter().map(|point| forces[*point]).collect();
            flow.travel = self.travel.at(stand.step);
            let granted = flow.coming(window.measured && k == 0);
            flow.press(&sent)?;
            let presses = |f: &ImpForce| f.force != [0.0; 2] || f.couple != 0.0;
            stand.pressed |= forces.iter().any(presses);
            let expected = stand.oracle.step(&granted, &forces, k + 1 == window.steps);
            let expected = expected.ok_or(Stop::Doubtful)?;
            stand.bodies = flow.travel;
            stand.fastest = stand.fastest.max(stand.oracle.fastest());
            stand.step += 1;
            answered.push((expected, forces));
        }
        judge.step = first;
        let records = answered
            .first()
            .map_or(0, |(expected, _)| expected.groups.len());
        let reported = report(flow, (next, records), window, judge)?;
        judge.counts(&reported.report, stand)?;
        if window.frame && reported.points.is_none() {
            judge.differ("R-5a", "frame", "all points", "none")?;
        }
        if let Some((header, points)) = &reported.points {
            let mut then = stand.back_to(before);
            judge.all_points("R-5a", (next, *header), points, &mut then)?;
            stand.names = then.names;
        }
        if window.measured {
            let (expected, _) = &answered[0];
            judge.groups(
                expected,
                at_least(reported.groups.as_ref(), expected.groups.len(), "groups")?,
                stand,
            )?;
            judge.books(expected, &reported.report.ledger, stand)?;
        }
        if let Some((expected, forces)) = answered.pop() {
            judge.step = stand.step - 1;
            let limits: Limits = reported.report.limits;
            judge.bounds(&limits, &expected, &forces, stand)?;
        }
        Ok(())
    }

    fn end(&self, mut run: Run, stand: &mut Stand, judge: &mut Judge) -> Result<(), Stop> {
        let (header, points) = run.drain()?;
        judge.all_points("D-1a", (run.next(), header), &points, stand)?;
        run.session.order(&Order::Close)?;
        run.session.solver.end(Duration::from_millis(500));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame has the points before the window, in which some of them have got their ids.
    #[test]
    fn a_point_that_has_an_id_gets_no_other_one_in_a_frame() {
        let takes = Capabilities::of(&["fill:points"]);
        let of_seed = |seed| generate::case(seed, &takes).config;
        let mut oracles = (0..).filter_map(|seed| Oracle::new(&of_seed(seed)));
        let oracle = oracles.find(|oracle| oracle.points.len() > 1);
        let before = Stand::new(oracle.expect("a case of two points"), [false; 2]);
        let mut stand = before.clone();
        let (x, group) = (stand.oracle.point(0).x, stand.oracle.points[0].group as u32);
        assert_eq!(stand.named(7, group, x), Some(0));
        assert_ne!(stand.back_to(before).named(8, group, x), Some(0));
    }
}
