//! The solver as the session sees it.

use interface::config::MpmConfig;
use interface::solver::{Fault, MpmMeasurement, MpmSolver, Readiness, Refusal};
use interface::step::Step;
use interface::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, PointState};

use crate::configure::build;
use crate::continuum::Scheme;

/// The continuum solver.
#[derive(Default)]
pub struct Mpm {
    scheme: Option<Box<dyn Scheme>>,
    none: MpmMeasurement,
}

impl Mpm {
    /// A solver that has not been configured.
    pub fn new() -> Self {
        Self::default()
    }

    /// Bytes of memory that the state takes at present.
    pub fn bytes(&self) -> usize {
        self.scheme.as_ref().map_or(0, |s| s.bytes())
    }

    fn configured(&mut self) -> Result<&mut dyn Scheme, Fault> {
        match &mut self.scheme {
            Some(scheme) => Ok(&mut **scheme),
            None => Err(Fault::Other("the solver has not been configured".into())),
        }
    }
}

impl MpmSolver for Mpm {
    fn identity(&self) -> String {
        concat!("tandem-mpm ", env!("CARGO_PKG_VERSION")).into()
    }

    fn configure(&mut self, config: &MpmConfig) -> Result<Readiness, Refusal> {
        let (scheme, readiness) = build(config)?;
        self.scheme = Some(scheme);
        Ok(readiness)
    }

    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo] {
        self.scheme
            .as_mut()
            .map_or(&[], |s| s.select_imps(envelopes))
    }

    fn travel(&self) -> f64 {
        self.scheme.as_ref().map_or(0.0, |s| s.travel())
    }

    fn imp_states(&mut self) -> &[ImpState] {
        self.scheme.as_mut().map_or(&[], |s| s.imp_states())
    }

    fn predict(&mut self, step: &Step) -> Result<(), Fault> {
        self.configured()?.predict(step)
    }

    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        self.configured()?.correct(step, forces)
    }

    fn measurement(&self) -> &MpmMeasurement {
        self.scheme.as_ref().map_or(&self.none, |s| s.measurement())
    }

    fn points(&self) -> Vec<PointState> {
        self.scheme.as_ref().map_or_else(Vec::new, |s| s.points())
    }
}
