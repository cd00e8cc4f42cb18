//! The cases of a solver of bodies: points that walk along bodies as the kit says.

mod admit;
mod case;
mod compare;
mod generate;
mod law;
mod oracle;
mod run;

use std::time::Duration;

use interface::config::capability::Capabilities;
use interface::message::control::Configure;

use super::judge::Judge;
use super::plan::Epoch;
use super::run::{Begun, Stop, Window};
use crate::bench::{Bench, Run, configure};
pub use case::Case;
use run::Stand;

impl super::run::Case for Case {
    type Stand = Stand;
    const CAUSES: &'static [&'static str] = &["T-1", "J-1", "F-8", "F-7", "F-5", "F-6"];

    fn of_seed(seed: u64, takes: &Capabilities) -> Self {
        generate::case(seed, takes)
    }

    fn epochs(&mut self) -> &mut Vec<Epoch> {
        &mut self.epochs
    }

    fn possible(&self) -> u32 {
        admit::steps(self)
    }

    fn order(&self) -> Configure {
        configure(&self.config)
    }

    fn begun<'b>(&self, bench: &'b Bench, _: &mut Judge) -> Result<Begun<'b, Self>, Stop> {
        Ok((bench.run_bodies(&self.config)?, Stand::new(self)))
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

    fn end(&self, run: Run, _: Stand, _: &mut Judge) -> Result<(), Stop> {
        run.closed()?.end(Duration::from_millis(500));
        Ok(())
    }

    fn barer(&self) -> Self {
        self.clone()
    }

    fn later(&self, first: u32) -> Option<Self> {
        Some(self.begun_in(first))
    }
}
