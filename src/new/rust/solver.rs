//! NAME: a bodies' side for Tandem.
//!
//! ```sh
//! cargo build --release --manifest-path NAME/Cargo.toml
//! tandem run TREE/scenes/jiang2020/collision_hard.toml --dem NAME/target/release/NAME
//! tandem conformance --require held --dem NAME/target/release/NAME
//! ```
//!
//! Bodies are rigid, free or fixed; they touch material points, not one another. Replace what your own code does better.
//! The guide is TREE/docs/solver-authors.md.

use interface::config::DemConfig;
use interface::config::capability::Capabilities;
use interface::forces::{Forces, Load, Points};
use interface::message::wire::{BodyState, EnvelopeVertex, bytes_of, records_of};
use interface::saved::{pack, unpack};
use interface::solver::{Answer, DemSolver, Fault, Readiness, Refusal};
use interface::step::Step;
use mechanics::rigid::{Body, History, PointContact};

/// Marks a saved state, so that another one is refused.
const FORMAT: &str = "NAME 1";

/// What it takes. Tandem refuses a scene that needs more, and the kit judges it by these.
const CAPABILITIES: [&str; 10] = [
    "save",
    "shape:disc",
    "shape:segment",
    "shape:rectangle",
    "motion:free",
    "motion:fixed",
    "inertia:density",
    "inertia:mass",
    "law:linear",
    "feature:friction",
];

/// The solver: without bodies until it is configured.
#[derive(Default)]
pub struct Solver {
    gravity: [f64; 2],
    bodies: Vec<Body>,
    springs: PointContact,
    /// What the points do to the bodies, by the last evaluation.
    loads: Vec<Load>,
    envelopes: Vec<EnvelopeVertex>,
}

impl DemSolver for Solver {
    fn identity(&self) -> String {
        concat!("NAME ", env!("CARGO_PKG_VERSION")).to_owned()
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::of(&CAPABILITIES)
    }

    fn configure(&mut self, config: &DemConfig) -> Result<Readiness, Refusal> {
        if config.body_contact.is_some() || !config.contact_pairs.is_empty() {
            let text = "bodies do not touch one another here: null, and no contact_pair";
            return Err(Refusal::new("body_contact", text));
        }
        // Numbers that no solver could accept.
        if let Some(fault) = config.faults().first() {
            return Err(fault.into());
        }
        self.gravity = config.gravity;
        self.springs = PointContact::new(&config.point_contact)?;
        for (i, body) in config.bodies.iter().enumerate() {
            self.bodies.push(Body::new(i, body)?);
        }
        let free = self.bodies.iter().filter(|body| body.yields());
        let lightest = free.map(|body| body.state().mass).reduce(f64::min);
        Ok(Readiness {
            items: self.bodies.len() as u64,
            mass_min: lightest.unwrap_or(0.0),
            stiffness_max: self.springs.normal,
            ..Readiness::default()
        })
    }

    fn bodies(&self) -> Vec<BodyState> {
        self.bodies.iter().map(Body::state).collect()
    }

    fn envelopes(&mut self) -> &[EnvelopeVertex] {
        let bodies = self.bodies.iter_mut().enumerate();
        self.envelopes = bodies.flat_map(|(i, body)| body.envelope(i)).collect();
        &self.envelopes
    }

    /// The forces at `t_n`. Nothing may change yet.
    fn contact(
        &mut self,
        step: &Step,
        points: &Points<'_>,
        forces: &mut Forces,
    ) -> Result<Answer, Fault> {
        self.springs.evaluate(step, points, &self.bodies, forces);
        self.loads = forces.on_bodies().to_vec();
        Ok(Answer::default())
    }

    /// The leapfrog: a kick of half the step before and half of this one, then the drift to `t_{n+1}`.
    fn advance(&mut self, step: &Step) -> Result<(), Fault> {
        self.springs.commit();
        for (body, load) in self.bodies.iter_mut().zip(&self.loads) {
            body.kick(step, load, self.gravity.into())?;
            body.drift(step.dt);
        }
        Ok(())
    }

    /// What the next step reads before it writes it; the rest is of the configuration.
    fn save(&self) -> Result<Vec<u8>, Fault> {
        let bodies = self.bodies();
        Ok(pack(FORMAT, &(bytes_of(&bodies), self.springs.history())))
    }

    fn restore(&mut self, saved: &[u8]) -> Result<(), Refusal> {
        let (states, history): (Vec<u8>, History) = unpack(FORMAT, saved)?;
        let states = records_of::<BodyState>(&states).unwrap_or_default();
        if states.len() != self.bodies.len() {
            return Err(Refusal::new("restore", "a state of other bodies"));
        }
        for (body, state) in self.bodies.iter_mut().zip(&states) {
            body.restore(state);
        }
        self.springs.restore(history, states.len())
    }
}
