//! Implements the solver's trait for the session.

use interface::config::MpmConfig;
use interface::config::capability::Capabilities;
use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, PointState};
use interface::saved::ConfigurationMark;
use interface::solver::{Fault, MpmMeasurement, MpmSolver, Readiness, Refusal};
use interface::step::Step;

use crate::scheme::Scheme;
use crate::setup::capabilities::capabilities;
use crate::setup::configure::build;
use crate::state::saved::{mark, refusal};

/// The continuum solver.
#[derive(Default)]
pub struct Mpm {
    scheme: Option<Box<dyn Scheme>>,
    /// Of the configuration, for saved states.
    mark: ConfigurationMark,
    no_measurement: MpmMeasurement,
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

    fn capabilities(&self) -> Capabilities {
        capabilities()
    }

    fn configure(&mut self, config: &MpmConfig) -> Result<Readiness, Refusal> {
        let (scheme, readiness) = build(config)?;
        self.scheme = Some(scheme);
        self.mark = mark(config);
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
        self.scheme
            .as_ref()
            .map_or(&self.no_measurement, |s| s.measurement())
    }

    fn points(&self) -> Vec<PointState> {
        self.scheme.as_ref().map_or_else(Vec::new, |s| s.points())
    }

    fn save(&self) -> Result<Vec<u8>, Fault> {
        match &self.scheme {
            Some(scheme) => Ok(scheme.save(&self.mark)),
            None => Err(Fault::Other("the solver has not been configured".into())),
        }
    }

    /// After a refusal the solver has to be configured anew.
    fn restore(&mut self, saved: &[u8]) -> Result<(), Refusal> {
        let Some(mut scheme) = self.scheme.take() else {
            return Err(refusal("the solver has not been configured"));
        };
        scheme.restore(&self.mark, saved)?;
        self.scheme = Some(scheme);
        Ok(())
    }
}
