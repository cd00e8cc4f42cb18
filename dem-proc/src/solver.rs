//! Implements [`DemSolver`] for the built-in bodies.

use interface::config::DemConfig;
use interface::config::capability::Capabilities;
use interface::forces::{Forces, Points};
use interface::message::wire::{ContactState, EnvelopeVertex, ImpInfo, ImpState};
use interface::saved::ConfigurationMark;
use interface::solver::{Answer, DemMeasurement, DemSolver, Fault, Readiness, Refusal};
use interface::step::Step;

use crate::body::bodies::Bodies;
use crate::setup::capabilities::capabilities;
use crate::setup::configure::configure;
use crate::setup::saved::{FORMAT, Saved};
use crate::system::{BODIES, Sdem};

impl Default for Sdem {
    fn default() -> Self {
        let nothing = DemConfig {
            threads: 1,
            ..DemConfig::default()
        };
        let (solver, _) = configure(&nothing).expect("nothing in it is refused");
        Self {
            mark: ConfigurationMark::default(),
            ..solver
        }
    }
}

impl Sdem {
    /// The present state of the bodies, for tests and for uncoupled use.
    pub fn bodies(&self) -> &Bodies {
        &self.bodies
    }

    /// Vertex-edge pairs of bodies that pressed on one another in the last step.
    pub fn contacts(&self) -> usize {
        let bodies = self.sides[BODIES].as_ref();
        bodies.map_or(0, |bodies| bodies.sums().presses)
    }

    /// The measurement of the last step that had [`Step::measure`].
    pub fn measurement(&self) -> &DemMeasurement {
        &self.measurement
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
        let (mut solver, readiness) = configure(config)?;
        solver.none_passed_at_the_start()?;
        *self = solver;
        Ok(readiness)
    }

    fn envelopes(&mut self) -> &[EnvelopeVertex] {
        self.publish()
    }

    fn imp_set(&mut self, set: &[ImpInfo]) {
        self.state.sets.replace(set);
    }

    fn contact(
        &mut self,
        step: &Step,
        points: &Points<'_>,
        forces: &mut Forces,
    ) -> Result<Answer, Fault> {
        self.contact(step, points.states, forces.on_points_mut())
    }

    fn advance(&mut self, step: &Step) -> Result<(), Fault> {
        self.move_on(step);
        Ok(())
    }

    fn measurement(&self) -> Option<&DemMeasurement> {
        Some(&self.measurement)
    }

    fn contacts(&self, _: &Step, _: &[ImpState]) -> Vec<ContactState> {
        self.contacts.clone()
    }

    fn save(&self) -> Result<Vec<u8>, Fault> {
        Ok(self.mark.seal(FORMAT, &self.saved()))
    }

    fn restore(&mut self, saved: &[u8]) -> Result<(), Refusal> {
        let saved: Saved = self.mark.open(FORMAT, saved)?;
        self.take(saved)
    }
}
