//! The continua of a scene: one for all groups of points, or a layer with nodes of its own for each group (Chen 2023
//! section 3.3), so that groups never exchange momentum through the grid. Points of layers touch in pairs, whose forces
//! come from the bodies' side as those of bodies do, or layers touch on their nodes ([`crate::grid_contact`]).
//!
//! Each layer has its own walls, loads and step limits. A contact force acts on the masses of one layer, so the
//! contribution of contact to the frequency is the largest of all layers, where the stiffness of a pair counts twice at
//! both ends: `k (e_p - e_q)(e_p - e_q)^T <= 2 k (e_p e_p^T + e_q e_q^T)`.

use core::ops::Range;

use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, PointState};
use interface::saved::ConfigurationMark;
use interface::solver::{Fault, MpmMeasurement, Refusal};
use interface::step::Step;
use mechanics::threads::Threads;
use serde::{Deserialize, Serialize};

use crate::grid_contact::{GridContact, Losses};
use crate::kernel::shape::Shape;
use crate::kernel::threads::over_groups;
use crate::kernel::transfer::AffineState;
use crate::pass::select_imps::select_imps;
use crate::pass::select_markers::select_markers;
use crate::pass::select_pairs::near_one_another;
use crate::scheme::Scheme;
use crate::several;
use crate::state::contact::ContactLoad;
use crate::state::continuum::{Continuum, SavedContinuum};
use crate::state::saved::FORMAT;
use crate::step;

/// A continuum with nodes of its own.
struct Layer<const W: usize, S: Shape<W>, A: AffineState> {
    continuum: Continuum<W, S, A>,
    /// Number of its first group.
    first: u32,
    /// Its IMPs among those of all layers.
    slots: Range<usize>,
    /// The contact and the result of the present step.
    load: ContactLoad,
    outcome: Result<Limits, Fault>,
}

/// The layers of a scene.
pub struct Layers<const W: usize, S: Shape<W>, A: AffineState> {
    all: Vec<Layer<W, S, A>>,
    /// Groups whose points touch.
    pairs: Vec<[usize; 2]>,
    /// Contact on the nodes, if there is any.
    on_grid: Option<GridContact>,
    threads: Threads,
    /// The IMPs of all layers by id; those of one layer follow one another.
    infos: Vec<ImpInfo>,
    states: Vec<ImpState>,
    measurement: MpmMeasurement,
}

/// The state of all layers.
#[derive(Serialize, Deserialize)]
struct SavedLayers<A> {
    layers: Vec<SavedContinuum<A>>,
    /// By contact on the nodes so far.
    lost: Losses,
}

impl<const W: usize, S: Shape<W>, A: AffineState> Layers<W, S, A> {
    /// One continuum, or one of a single cloud for each group, of which `pairs` touch.
    pub fn new(
        continua: Vec<Continuum<W, S, A>>,
        pairs: Vec<[usize; 2]>,
        on_grid: Option<GridContact>,
        threads: Threads,
    ) -> Self {
        let layers = (0..).zip(continua).map(|(first, continuum)| Layer {
            continuum,
            first,
            slots: 0..0,
            load: ContactLoad::default(),
            outcome: Ok(Limits::default()),
        });
        Self {
            all: layers.collect(),
            pairs,
            on_grid,
            threads,
            infos: Vec::new(),
            states: Vec::new(),
            measurement: MpmMeasurement::default(),
        }
    }

    fn continua(&self) -> impl Iterator<Item = &Continuum<W, S, A>> {
        self.all.iter().map(|layer| &layer.continuum)
    }

    /// Does `work` with every layer; returns the narrowest limits.
    fn each(
        &mut self,
        work: &(impl Fn(&mut Layer<W, S, A>) -> Result<Limits, Fault> + Sync),
    ) -> Result<Limits, Fault> {
        let tiles = |layer: &Layer<W, S, A>| {
            let clouds = layer.continuum.clouds.iter();
            clouds.map(|cloud| cloud.tiles.len()).sum()
        };
        over_groups(&self.threads, &mut self.all, tiles, &|threads, layer| {
            layer.continuum.threads.clone_from(threads);
            layer.outcome = work(layer);
        });
        let mut limits = Limits::default();
        for layer in &mut self.all {
            let of = core::mem::replace(&mut layer.outcome, Ok(Limits::default()))?;
            limits = several::narrowest(&limits, &of);
        }
        Ok(limits)
    }

    /// The rest of a step after the prediction.
    fn move_all(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        let count = self.number_slots();
        if !forces.is_empty() && forces.len() != count {
            return Err(Fault::Other(format!(
                "{} contact forces arrived for {count} identified material points",
                forces.len(),
            )));
        }
        self.each(&|layer| {
            let own = forces.get(layer.slots.clone()).unwrap_or_default();
            layer.load = step::move_nodes(&mut layer.continuum, step, own)?;
            Ok(Limits::default())
        })?;
        let mut lost = Losses::default();
        if let Some(contact) = &mut self.on_grid {
            let mut continua: Vec<_> = self.all.iter_mut().map(|l| &mut l.continuum).collect();
            lost = contact.act(&self.threads, &mut continua, step); // v_g~                               Bardenhagen (12) ... (24)
        }
        let limits =
            self.each(&|layer| step::move_points(&mut layer.continuum, step, layer.load))?;
        let combines = step.measure && self.all.len() > 1;
        if combines {
            let continua = self.all.iter().map(|layer| &layer.continuum);
            several::measure(&mut self.measurement, continua);
        }
        if let Some(contact) = &mut self.on_grid {
            if combines {
                contact.measure(&mut self.measurement.ledger, lost, step.centring());
            }
            contact.lost += lost;
        }
        Ok(limits)
    }

    /// Makes one list from the IMPs of all layers.
    fn write_infos(&mut self) {
        self.infos.clear();
        for Layer {
            continuum, first, ..
        } in &self.all
        {
            let infos = continuum.imps.infos.iter();
            self.infos.extend(infos.map(|info| ImpInfo {
                group: first + info.group,
                ..*info
            }));
        }
    }

    /// Says which slots each layer has; returns how many there are.
    fn number_slots(&mut self) -> usize {
        let mut end = 0;
        for layer in &mut self.all {
            let start = end;
            end += layer.continuum.imps.state.members.len();
            layer.slots = start..end;
        }
        end
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState> Scheme for Layers<W, S, A> {
    fn predict(&mut self, step: &Step) -> Result<(), Fault> {
        let threads = self.threads.clone();
        threads.in_step(true, || {
            self.each(&|layer| {
                step::predict(&mut layer.continuum, step).map(|()| Limits::default())
            })
        })?;
        Ok(())
    }

    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        let threads = self.threads.clone();
        threads.in_step(false, || self.move_all(step, forces))
    }
    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo] {
        for Layer { continuum, .. } in &mut self.all {
            let Continuum { imps, clouds, .. } = continuum;
            if imps.markers.is_some() {
                select_markers(imps, envelopes);
                imps.write_infos(clouds);
            } else {
                select_imps(imps, clouds, envelopes);
            }
        }
        let mut near = vec![Vec::new(); self.all.len()];
        for &[a, b] in &self.pairs {
            let [one, other] = [a, b].map(|group| &self.all[group].continuum);
            let found = near_one_another([&one.clouds[0], &other.clouds[0]], one.imps.skin);
            for (group, locals) in [a, b].into_iter().zip(found) {
                near[group].extend(locals);
            }
        }
        for (Layer { continuum, .. }, locals) in self.all.iter_mut().zip(near) {
            if !locals.is_empty() {
                continuum.imps.add(&locals, &continuum.clouds);
            }
            continuum.make_room_for_contact();
        }
        self.write_infos();
        &self.infos
    }

    fn travel(&self) -> f64 {
        let travels = self.continua().map(|continuum| continuum.imps.state.travel);
        travels.fold(0.0, f64::max)
    }

    fn imp_states(&mut self) -> &[ImpState] {
        self.states.clear();
        for Layer { continuum, .. } in &mut self.all {
            continuum
                .imps
                .add_states(&continuum.clouds, &mut self.states);
        }
        &self.states
    }

    fn measurement(&self) -> &MpmMeasurement {
        match &self.all[..] {
            [only] => &only.continuum.measurement,
            _ => &self.measurement,
        }
    }

    fn points(&self) -> Vec<PointState> {
        let mut points = Vec::new();
        for Layer {
            continuum, first, ..
        } in &self.all
        {
            continuum.add_points(*first, &mut points);
        }
        points
    }

    fn bytes(&self) -> usize {
        self.continua().map(Continuum::bytes).sum()
    }

    fn save(&self, mark: &ConfigurationMark) -> Vec<u8> {
        let layers = self.continua().map(Continuum::saved).collect();
        let lost = self
            .on_grid
            .as_ref()
            .map_or_else(Losses::default, |c| c.lost);
        mark.seal(FORMAT, &SavedLayers { layers, lost })
    }

    fn restore(&mut self, mark: &ConfigurationMark, saved: &[u8]) -> Result<(), Refusal> {
        let SavedLayers { layers, lost } = mark.open(FORMAT, saved)?;
        for (layer, saved) in self.all.iter_mut().zip(layers) {
            layer.continuum.take_over(saved)?;
        }
        if let Some(contact) = &mut self.on_grid {
            contact.lost = lost;
        }
        self.write_infos();
        Ok(())
    }
}
