//! The cases of a continuum: clouds of elastic points, on which bodies press as the kit says.

mod case;
mod compare;
mod generate;
mod oracle;
mod run;

use std::time::Duration;

use interface::config::capability::{Capabilities, STRESS_WORK};
use interface::message::control::{Configure, Order};

use super::judge::Judge;
use super::plan::Epoch;
use super::run::{Begun, Stop, Window};
use crate::bench::{Bench, Run, configure};
pub use case::Case;
use oracle::Oracle;
use run::Stand;

impl super::run::Case for Case {
    type Stand = Stand;
    const CAUSES: &'static [&'static str] = &["T-1a", "F-1a", "I-2g", "I-7a", "I-6a"];

    fn of_seed(seed: u64, takes: &Capabilities) -> Self {
        generate::case(seed, takes)
    }

    fn epochs(&mut self) -> &mut Vec<Epoch> {
        &mut self.epochs
    }

    fn possible(&self) -> u32 {
        let drawn = self.bodies.iter().all(|body| !body.vertices.is_empty());
        let sound = self.config.faults().is_empty() && !self.config.groups.is_empty();
        let known = drawn && sound && Oracle::new(&self.config).is_some();
        u32::from(known) * super::plan::steps(&self.epochs)
    }

    fn order(&self) -> Configure {
        configure(&self.config)
    }

    fn begun<'b>(&self, bench: &'b Bench, judge: &mut Judge) -> Result<Begun<'b, Self>, Stop> {
        let oracle = Oracle::new(&self.config).ok_or(Stop::Doubtful)?;
        let run = bench.run_continuum(&self.config)?;
        judge.readiness(&oracle, &run.ready.readiness)?;
        Ok((run, Stand::new(oracle, bench.takes(STRESS_WORK))))
    }

    fn window(
        &self,
        run: &mut Run,
        stand: &mut Stand,
        window: Window,
        judge: &mut Judge,
    ) -> Result<(), Stop> {
        run::window_of(run, self, stand, window, judge)
    }

    fn end(&self, mut run: Run, mut stand: Stand, judge: &mut Judge) -> Result<(), Stop> {
        let (header, points) = run.drain()?;
        judge.all_points("D-1a", (run.next(), header), &points, &mut stand)?;
        run.session.order(&Order::Close)?;
        run.session.end(Duration::from_millis(500));
        Ok(())
    }

    fn barer(&self) -> Self {
        let pushes = Vec::new();
        Self {
            pushes,
            ..self.clone()
        }
    }

    fn later(&self, _: u32) -> Option<Self> {
        None
    }
}
