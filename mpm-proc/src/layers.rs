//! A grid layer for each group (Chen 2023 section 3.3): every group of points is a continuum with its own nodes, so
//! that groups never exchange momentum through the grid. They interact only through the forces of the bodies' side,
//! which bodies and points of other groups exert on their points.
//!
//! The layers are stepped one after another. Each has its own walls, loads and step limits. A contact force acts on the
//! masses of one layer, so the contribution of contact to the frequency is the largest of all layers, where the
//! stiffness of a pair counts twice at both ends: `k (e_p - e_q)(e_p - e_q)^T <= 2 k (e_p e_p^T + e_q e_q^T)`.

use core::ops::Range;

use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, PointState};
use interface::saved::ConfigurationMark;
use interface::solver::{Fault, MpmMeasurement, Refusal};
use interface::step::Step;

use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::pass::select_imps::select_imps;
use crate::pass::select_pairs::near_one_another;
use crate::scheme::Scheme;
use crate::several;
use crate::state::continuum::{Continuum, SavedContinuum};
use crate::state::saved::FORMAT;
use crate::step;

/// The layers of a scene.
pub struct Layers<const W: usize, S: Shape<W>, A: AffineState> {
    /// One continuum of one cloud for each group.
    all: Vec<Continuum<W, S, A>>,
    /// Groups whose points touch.
    pairs: Vec<[usize; 2]>,
    /// The IMPs of all layers by id; those of one layer follow one another.
    infos: Vec<ImpInfo>,
    states: Vec<ImpState>,
    measurement: MpmMeasurement,
}

impl<const W: usize, S: Shape<W>, A: AffineState> Layers<W, S, A> {
    /// Layers of one cloud each, of which `pairs` touch.
    pub fn new(all: Vec<Continuum<W, S, A>>, pairs: Vec<[usize; 2]>) -> Self {
        Self {
            all,
            pairs,
            infos: Vec::new(),
            states: Vec::new(),
            measurement: MpmMeasurement::default(),
        }
    }

    /// Makes one list from the IMPs of all layers.
    fn write_infos(&mut self) {
        self.infos.clear();
        for (group, layer) in (0..).zip(&self.all) {
            let infos = layer.imps.infos.iter();
            self.infos
                .extend(infos.map(|info| ImpInfo { group, ..*info }));
        }
    }

    /// The slots of each layer.
    fn slots(&self) -> Vec<Range<usize>> {
        let mut end = 0;
        let of = |layer: &Continuum<W, S, A>| {
            let start = end;
            end += layer.imps.state.members.len();
            start..end
        };
        self.all.iter().map(of).collect()
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState> Scheme for Layers<W, S, A> {
    fn predict(&mut self, step: &Step) -> Result<(), Fault> {
        (self.all.iter_mut()).try_for_each(|layer| step::predict(layer, step))
    }

    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        let slots = self.slots();
        let count = slots.last().map_or(0, |last| last.end);
        if !forces.is_empty() && forces.len() != count {
            return Err(Fault::Other(format!(
                "{} contact forces arrived for {count} identified material points",
                forces.len(),
            )));
        }
        let mut limits = Limits::default();
        for (layer, slots) in self.all.iter_mut().zip(slots) {
            let forces = forces.get(slots).unwrap_or_default();
            limits = several::narrowest(&limits, &step::correct(layer, step, forces)?);
        }
        if step.measure {
            several::measure(&mut self.measurement, self.all.iter());
        }
        Ok(limits)
    }

    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo] {
        for layer in &mut self.all {
            select_imps(&mut layer.imps, &layer.clouds, envelopes);
        }
        for &[a, b] in &self.pairs {
            let skin = self.all[a].imps.skin;
            let clouds = [a, b].map(|group| &self.all[group].clouds[0]);
            for (group, locals) in [a, b].into_iter().zip(near_one_another(clouds, skin)) {
                self.all[group].imps.add(&locals);
            }
        }
        for layer in &mut self.all {
            layer.imps.close(&layer.clouds);
            layer.make_room_for_contact();
        }
        self.write_infos();
        &self.infos
    }

    fn travel(&self) -> f64 {
        several::travel(self.all.iter())
    }

    fn imp_states(&mut self) -> &[ImpState] {
        self.states.clear();
        for layer in &mut self.all {
            self.states.extend_from_slice(layer.imp_states());
        }
        &self.states
    }

    fn measurement(&self) -> &MpmMeasurement {
        &self.measurement
    }

    fn points(&self) -> Vec<PointState> {
        several::points(self.all.iter())
    }

    fn bytes(&self) -> usize {
        self.all.iter().map(Scheme::bytes).sum()
    }

    fn save(&self, mark: &ConfigurationMark) -> Vec<u8> {
        let all: Vec<_> = self.all.iter().map(Continuum::saved).collect();
        mark.seal(FORMAT, &all)
    }

    fn restore(&mut self, mark: &ConfigurationMark, saved: &[u8]) -> Result<(), Refusal> {
        let all: Vec<SavedContinuum<A>> = mark.open(FORMAT, saved)?;
        for (layer, saved) in self.all.iter_mut().zip(all) {
            layer.take_over(saved)?;
        }
        self.write_infos();
        Ok(())
    }
}
