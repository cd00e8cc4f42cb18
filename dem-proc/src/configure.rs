//! From the configuration to a solver: every check, and the one `match` that chooses the contact laws.

use interface::Vec2;
use interface::config::{ContactLaw, DemConfig, Motion};
use interface::solver::{DemMeasurement, Readiness, Refusal};
use interface::wire::EnvelopeVertex;

use crate::body::{Bodies, Odometer};
use crate::law::{Coulomb, Elastic, Law, Linear, Smooth, Viscous};
use crate::ledger::Totals;
use crate::load::Load;
use crate::pairs::{BodyContacts, BodySide};
use crate::points::{PointContacts, PointSide};
use crate::threads::Threads;

/// A configured solver.
#[derive(Debug)]
pub struct System {
    /// Acceleration of gravity in m/s^2.
    pub gravity: Vec2,
    /// The bodies.
    pub bodies: Bodies,
    /// Contact with points.
    pub points: Box<dyn PointSide>,
    /// Contact between bodies, where the scene has a law for it and a body that can be moved.
    pub pairs: Option<Box<dyn BodySide>>,
    /// How loops are run.
    pub threads: Threads,
    /// Loads by points, by body.
    pub point_loads: Vec<Load>,
    /// Loads by bodies, by body.
    pub body_loads: Vec<Load>,
    /// Velocities and spins at `t_{n+1/2}`, not yet taken over.
    pub kicked: Vec<(Vec2, f64)>,
    /// Upper bound of the speed of any surface over the last step, in m/s.
    pub speed: f64,
    /// The same after the kick, not yet taken over.
    pub kicked_speed: f64,
    /// How far surfaces have gone since the last call of `envelopes`.
    pub published: Odometer,
    /// `V_d` in m.
    pub skin: f64,
    /// The envelopes.
    pub envelopes: Vec<EnvelopeVertex>,
    /// Sums over the run.
    pub totals: Totals,
    /// The last measurement.
    pub measurement: DemMeasurement,
}

impl Default for System {
    /// No bodies.
    fn default() -> Self {
        let law = Linear {
            stiffness: 0.0,
            tangent: Smooth,
            dashpot: Elastic,
        };
        Self {
            gravity: Vec2::zeros(),
            bodies: Bodies::default(),
            points: Box::new(PointContacts::new(law, 0.0)),
            pairs: None,
            threads: Threads::default(),
            point_loads: Vec::new(),
            body_loads: Vec::new(),
            kicked: Vec::new(),
            speed: 0.0,
            kicked_speed: 0.0,
            published: Odometer::default(),
            skin: 0.0,
            envelopes: Vec::new(),
            totals: Totals::default(),
            measurement: DemMeasurement::default(),
        }
    }
}

/// What is built from a law, whichever it is.
trait ForLaw {
    type Output;
    fn build<L: Law>(self, law: L) -> Self::Output;
}

struct PointsWith {
    skin: f64,
}

impl ForLaw for PointsWith {
    type Output = Box<dyn PointSide>;
    fn build<L: Law>(self, law: L) -> Self::Output {
        Box::new(PointContacts::new(law, self.skin))
    }
}

struct BodiesWith {
    skin: f64,
}

impl ForLaw for BodiesWith {
    type Output = Box<dyn BodySide>;
    fn build<L: Law>(self, law: L) -> Self::Output {
        Box::new(BodyContacts::new(law, self.skin))
    }
}

/// The one place where a law's parameters become a type.
fn with_law<F: ForLaw>(law: &ContactLaw, build: F) -> F::Output {
    match *law {
        ContactLaw::Linear {
            normal_stiffness: stiffness,
            tangential_stiffness,
            friction,
            damping_ratio: ratio,
        } => {
            let coulomb = Coulomb::new(tangential_stiffness, friction);
            match (friction > 0.0, ratio > 0.0) {
                (false, false) => build.build(Linear {
                    stiffness,
                    tangent: Smooth,
                    dashpot: Elastic,
                }),
                (false, true) => build.build(Linear {
                    stiffness,
                    tangent: Smooth,
                    dashpot: Viscous { ratio },
                }),
                (true, false) => build.build(Linear {
                    stiffness,
                    tangent: coulomb,
                    dashpot: Elastic,
                }),
                (true, true) => build.build(Linear {
                    stiffness,
                    tangent: coulomb,
                    dashpot: Viscous { ratio },
                }),
            }
        }
    }
}

/// Checks a configuration and builds the solver.
///
/// # Errors
/// A refusal that names the key.
pub fn configure(config: &DemConfig) -> Result<(System, Readiness), Refusal> {
    if !config.gravity.iter().all(|g| g.is_finite()) {
        let text = format!("{:?}: expected finite numbers in m/s^2", config.gravity);
        return Err(Refusal::new("dem.gravity", text));
    }
    if !(config.skin.is_finite() && config.skin >= 0.0) {
        let text = format!(
            "{} m: expected a finite distance that is not negative",
            config.skin
        );
        return Err(Refusal::new("dem.skin", text));
    }
    if config.threads == 0 {
        return Err(Refusal::new("dem.threads", "0: expected 1 or more"));
    }
    let point_stiffness = check_law("dem.point_contact", &config.point_contact)?;
    if let Some(law) = &config.body_contact {
        check_law("dem.body_contact", law)?;
    }
    let bodies = Bodies::new(config)?;
    let threads = Threads::new(config.threads)
        .map_err(|e| Refusal::new("dem.threads", format!("{}: {e}", config.threads)))?;

    let free = || bodies.fixed.iter().filter(|b| b.motion == Motion::Free);
    let mut notes = Vec::new();
    let law = config.body_contact.as_ref();
    let pairs = law.filter(|_| free().next().is_some() && bodies.len() > 1);
    if law.is_some() && pairs.is_none() {
        notes.push(
            "left out: contact between bodies (no two bodies of which forces move one)".to_owned(),
        );
    }
    let pairs = pairs.map(|law| with_law(law, BodiesWith { skin: config.skin }));
    let points = with_law(&config.point_contact, PointsWith { skin: config.skin });
    let n = bodies.len();
    let system = System {
        gravity: config.gravity.into(),
        points,
        pairs,
        threads,
        point_loads: vec![Load::default(); n],
        body_loads: vec![Load::default(); n],
        kicked: Vec::with_capacity(n),
        speed: bodies.initial_speed(),
        skin: config.skin,
        bodies,
        ..System::default()
    };
    let free = || {
        system
            .bodies
            .fixed
            .iter()
            .filter(|b| b.motion == Motion::Free)
    };
    let lightest = free().map(|b| b.mass).fold(f64::INFINITY, f64::min);
    let readiness = Readiness {
        items: n as u64,
        bytes: system.bytes() as u64,
        courant_time: 0.0,
        mass_min: if lightest.is_finite() { lightest } else { 0.0 },
        stiffness_max: if n > 0 { point_stiffness } else { 0.0 },
        notes,
    };
    Ok((system, readiness))
}

/// Checks a law and returns its normal stiffness in N/m.
fn check_law(key: &str, law: &ContactLaw) -> Result<f64, Refusal> {
    let ContactLaw::Linear {
        normal_stiffness,
        tangential_stiffness,
        friction,
        damping_ratio,
    } = *law;
    let refuse = |name: &str, value: f64, expected: &str| {
        Err(Refusal::new(
            format!("{key}.linear.{name}"),
            format!("{value}: expected {expected}"),
        ))
    };
    if !(normal_stiffness.is_finite() && normal_stiffness > 0.0) {
        return refuse(
            "normal_stiffness",
            normal_stiffness,
            "a positive number in N/m",
        );
    }
    if !(friction.is_finite() && friction >= 0.0) {
        return refuse("friction", friction, "0 or a positive number");
    }
    if !(tangential_stiffness.is_finite() && tangential_stiffness >= 0.0) {
        return refuse(
            "tangential_stiffness",
            tangential_stiffness,
            "0 or a positive number in N/m",
        );
    }
    if friction > 0.0 && tangential_stiffness == 0.0 {
        let expected =
            "a positive number in N/m, since friction is not zero (k_n/20 ... k_n is usual)";
        return refuse("tangential_stiffness", 0.0, expected);
    }
    if !(damping_ratio.is_finite() && damping_ratio >= 0.0) {
        return refuse(
            "damping_ratio",
            damping_ratio,
            "0 or a positive fraction of critical damping",
        );
    }
    Ok(normal_stiffness)
}

impl System {
    /// Bytes of memory in use.
    pub fn bytes(&self) -> usize {
        let trees = self
            .bodies
            .fixed
            .iter()
            .filter_map(|b| b.shape.edges.as_ref());
        let body = size_of::<crate::body::Body>()
            + size_of::<crate::body::Rigid>()
            + 2 * size_of::<Load>();
        self.bodies.len() * body
            + self.bodies.outline.len() * 2 * size_of::<Vec2>()
            + trees.map(crate::seam::BoxTree::bytes).sum::<usize>()
            + self.points.bytes()
            + self.pairs.as_ref().map_or(0, |p| p.bytes())
    }
}
