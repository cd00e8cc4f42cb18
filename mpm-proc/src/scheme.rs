//! A configured solver: one trait for all shape functions and transfers.

use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, PointState};
use interface::saved::ConfigurationMark;
use interface::solver::{Fault, MpmMeasurement, Refusal};
use interface::step::Step;

/// The functions of a continuum that the solver needs, for any shape function and transfer.
pub trait Scheme: Send {
    /// The part of a step that needs no contact force.
    fn predict(&mut self, step: &Step) -> Result<(), Fault>;

    /// The rest of the step, with the forces on the IMPs.
    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault>;

    /// Chooses the IMPs anew.
    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo];

    /// Largest displacement since the last selection in m.
    fn travel(&self) -> f64;

    /// States of the IMPs.
    fn imp_states(&mut self) -> &[ImpState];

    /// The last measurement.
    fn measurement(&self) -> &MpmMeasurement;

    /// All points by id.
    fn points(&self) -> Vec<PointState>;

    /// Bytes of memory in use.
    fn bytes(&self) -> usize;

    /// The state before the next step, with the mark of the configuration.
    fn save(&self, mark: &ConfigurationMark) -> Vec<u8>;

    /// Restores what [`Self::save`] returned.
    ///
    /// # Errors
    /// A [`Refusal`] if the bytes are not a state of this configuration; the scheme can then not be used any more.
    fn restore(&mut self, mark: &ConfigurationMark, saved: &[u8]) -> Result<(), Refusal>;
}
