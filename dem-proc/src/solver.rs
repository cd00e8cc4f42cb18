//! Implements [`DemSolver`] for the built-in bodies.

use interface::config::DemConfig;
use interface::config::capability::Capabilities;
use interface::forces::{Forces, Points};
use interface::message::wire::{ContactState, EnvelopeVertex, ImpForce, ImpInfo, ImpState};
use interface::saved::ConfigurationMark;
use interface::solver::{Answer, DemMeasurement, DemSolver, Fault, Readiness, Refusal};
use interface::step::Step;

use crate::body::bodies::Bodies;
use crate::setup::capabilities::capabilities;
use crate::setup::configure::{build, configure};
use crate::setup::saved::{FORMAT, Saved, mark};
use crate::system::System;

/// The spheropolygon solver. It has no bodies until it is configured.
#[derive(Debug)]
pub struct Sdem {
    pub(crate) system: System,
    /// Of the configuration, for saved states.
    mark: ConfigurationMark,
}

impl Default for Sdem {
    fn default() -> Self {
        let nothing = DemConfig {
            threads: 1,
            ..DemConfig::default()
        };
        Self {
            system: build(&nothing).expect("nothing in it is refused").0,
            mark: ConfigurationMark::default(),
        }
    }
}

impl Sdem {
    /// The present state of the bodies, for tests and for uncoupled use.
    pub fn bodies(&self) -> &Bodies {
        &self.system.bodies
    }

    /// Vertex-edge pairs of bodies that pressed on one another in the last step.
    pub fn contacts(&self) -> usize {
        let bodies = self.system.sides.bodies.as_ref();
        bodies.map_or(0, |bodies| bodies.sums().presses)
    }

    /// One evaluation, for a caller that has no session.
    ///
    /// # Errors
    /// As [`DemSolver::contact`].
    pub fn contact(
        &mut self,
        step: &Step,
        imps: &[ImpState],
        forces: &mut [ImpForce],
    ) -> Result<Answer, Fault> {
        self.system.contact(step, imps, forces)
    }

    /// The measurement of the last step that had [`Step::measure`].
    pub fn measurement(&self) -> &DemMeasurement {
        &self.system.measurement
    }
}

impl DemSolver for Sdem {
    fn identity(&self) -> String {
        format!("tandem-dem {}", env!("CARGO_PKG_VERSION"))
    }

    fn capabilities(&self) -> Capabilities {
        capabilities()
    }

    fn configure(&mut self, config: &DemConfig) -> Result<Readiness, Refusal> {
        let (mut system, readiness) = configure(config)?;
        if let Some(passed) = system.passed_at_the_start() {
            return Err(passed.refusal(&system.bodies));
        }
        (self.system, self.mark) = (system, mark(config));
        Ok(readiness)
    }

    fn envelopes(&mut self) -> &[EnvelopeVertex] {
        self.system.publish()
    }

    fn imp_set(&mut self, set: &[ImpInfo]) {
        self.system.state.sets.replace(set);
    }

    fn contact(
        &mut self,
        step: &Step,
        points: &Points<'_>,
        forces: &mut Forces,
    ) -> Result<Answer, Fault> {
        let forces = forces.on_points_mut();
        self.system.contact(step, points.states, forces)
    }

    fn advance(&mut self, step: &Step) -> Result<(), Fault> {
        self.system.advance(step);
        Ok(())
    }

    fn measurement(&self) -> Option<&DemMeasurement> {
        Some(&self.system.measurement)
    }

    fn contacts(&self, step: &Step, imps: &[ImpState]) -> Vec<ContactState> {
        self.system.frame_contacts(step, imps)
    }

    fn save(&self) -> Result<Vec<u8>, Fault> {
        Ok(self.mark.seal(FORMAT, &self.system.save()))
    }

    fn restore(&mut self, saved: &[u8]) -> Result<(), Refusal> {
        let saved: Saved = self.mark.open(FORMAT, saved)?;
        self.system.restore(saved)
    }
}
