//! The traits that a solver implements, one for each side. The session ([`crate::session`]) calls them in the order of
//! the protocol, so an implementation cannot answer twice, skip a step or send a message out of order.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::config::capability::Capabilities;
use crate::config::{ConfigFault, DemConfig, MpmConfig};
use crate::forces::{Forces, Points};
use crate::message::wire::{
    BodyState, ContactState, EnvelopeVertex, GroupState, ImpForce, ImpInfo, ImpState, Ledger,
    Limits, PointState, Report,
};
use crate::step::Step;

/// The reason why a solver does not take its configuration.
#[derive(Debug, Clone, PartialEq, Eq, Error, Serialize, Deserialize)]
#[error("{key}: {message}")]
pub struct Refusal {
    /// Dotted key of the configuration that is not acceptable, such as `mpm.shape`.
    pub key: String,
    /// What is wrong and what would be accepted.
    pub message: String,
}

impl Refusal {
    /// A refusal of `key` for the reason `message`.
    pub fn new(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            message: message.into(),
        }
    }
}

impl From<&ConfigFault> for Refusal {
    fn from(fault: &ConfigFault) -> Self {
        Self::new(&fault.key, fault.to_string())
    }
}

/// Why a solver cannot continue.
#[derive(Debug, Clone, PartialEq, Error, Serialize, Deserialize)]
pub enum Fault {
    /// A number of the state is no longer finite.
    #[error("{what} of {item} is not finite")]
    NotFinite {
        /// The quantity, such as "velocity".
        what: String,
        /// The point or body, such as "point 17" or "body 2 (target)".
        item: String,
    },
    /// A point left the grid's domain.
    #[error("point {id} left the domain at {}", crate::text::place([*.x, *.y]))]
    LeftDomain {
        /// Identity of the point.
        id: u64,
        /// Position in m.
        x: f64,
        /// Position in m.
        y: f64,
    },
    /// The constitutive model cannot handle the deformation.
    #[error("point {id}: {message}")]
    Material {
        /// Identity of the point.
        id: u64,
        /// What happened.
        message: String,
    },
    /// The exchange with the other side failed; the session knows why.
    #[error("the exchange with the other side failed")]
    Exchange,
    /// Anything else.
    #[error("{0}")]
    Other(String),
}

/// Largest number of points or bodies: slots are numbered with 32 bits.
const MOST_ITEMS: u64 = 1 << 32;
/// Largest number of bytes: the largest count that a double represents exactly.
const MOST_BYTES: u64 = 1 << 53;
/// Longest time in a report: 36 years, in ns.
const LONGEST_NS: u64 = 1 << 60;

/// The properties that a configured solver reports.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Readiness {
    /// Points or bodies.
    pub items: u64,
    /// Bytes of memory that the state takes; 0 if the solver does not know.
    pub bytes: u64,
    /// Continuum: `L / c_max` in s. Bodies: 0. For the criterion of Jiang 2020 eq. 51.
    pub courant_time: f64,
    /// Bodies: mass of the lightest free body in kg/m; continuum: of the lightest point.
    pub mass_min: f64,
    /// Bodies: largest normal stiffness of a contact with points in N/m. Continuum: 0.
    pub stiffness_max: f64,
    /// Messages for the user: warnings, and what is left out.
    pub notes: Vec<String>,
}

impl Readiness {
    /// The first impossible value (clause S-6): a number that is negative or not finite, or a count larger than any
    /// memory.
    pub fn impossible_value(&self) -> Option<String> {
        let reals = [
            ("courant_time", self.courant_time),
            ("mass_min", self.mass_min),
            ("stiffness_max", self.stiffness_max),
        ];
        let counts = [
            ("items", self.items, MOST_ITEMS),
            ("bytes", self.bytes, MOST_BYTES),
        ];
        let real = reals.iter().find(|(_, x)| !(x.is_finite() && *x >= 0.0));
        let count = counts.iter().find(|(_, n, most)| n > most);
        let real = real
            .map(|(name, x)| format!("ready with {name} = {x}, expected a number of 0 or more"));
        real.or_else(|| {
            count.map(|(name, n, most)| format!("ready with {name} = {n}, expected {most} at most"))
        })
    }

    /// A count or a time of a report that no solver can have that was ready so (clause R-2).
    pub fn absurd(&self, report: &Report) -> Option<String> {
        let bounds = [
            ("items", report.items, self.items),
            ("imps", report.imps, MOST_ITEMS),
            ("compute_ns", report.compute_ns, LONGEST_NS),
            ("exchange_ns", report.exchange_ns, LONGEST_NS),
            ("wait_ns", report.wait_ns, LONGEST_NS),
            ("cpu_ns", report.cpu_ns, LONGEST_NS),
        ];
        let beyond = bounds.iter().find(|(_, number, most)| number > most);
        beyond.map(|(name, number, most)| {
            format!("report with {name} = {number}, expected {most} at most")
        })
    }
}

/// Measurement at `t_n` of a step with [`Step::measure`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MpmMeasurement {
    /// Energies, momenta, impulses.
    pub ledger: Ledger,
    /// One record for each point group, in the order of the configuration.
    pub groups: Vec<GroupState>,
}

/// Measurement at `t_n` of a step with [`Step::measure`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DemMeasurement {
    /// Energies, momenta, impulses.
    pub ledger: Ledger,
    /// One record for each body, in the order of the configuration.
    pub bodies: Vec<BodyState>,
}

/// A continuum solver. A step is one call of [`Self::predict`] and then one of [`Self::correct`].
///
/// An example: a single free point of 1 kg/m, which is an IMP whenever there is a body.
///
/// ```
/// use interface::config::MpmConfig;
/// use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, PointState};
/// use interface::solver::{Fault, MpmMeasurement, MpmSolver, Readiness, Refusal};
/// use interface::step::Step;
///
/// #[derive(Default)]
/// struct OnePoint {
///     gravity: [f64; 2],
///     state: ImpState, // position at t_n, velocity at t_{n-1/2}
///     info: ImpInfo,
///     travel: f64,
///     measurement: MpmMeasurement,
/// }
///
/// impl MpmSolver for OnePoint {
///     fn identity(&self) -> String {
///         "one-point 1.0".into()
///     }
///
///     fn configure(&mut self, config: &MpmConfig) -> Result<Readiness, Refusal> {
///         self.gravity = config.gravity;
///         self.info = ImpInfo { radius: 0.5 * config.cell, mass: 1.0, ..ImpInfo::default() };
///         Ok(Readiness { items: 1, mass_min: 1.0, ..Readiness::default() })
///     }
///
///     fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo] {
///         self.travel = 0.0;
///         let seen = usize::from(!envelopes.is_empty());
///         &core::slice::from_ref(&self.info)[..seen]
///     }
///
///     fn travel(&self) -> f64 {
///         self.travel
///     }
///
///     fn imp_states(&mut self) -> &[ImpState] {
///         core::slice::from_ref(&self.state)
///     }
///
///     fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
///         let force = forces.first().map_or([0.0; 2], |f| f.force);
///         for a in 0..2 {
///             self.state.velocity[a] += step.kick() * (self.gravity[a] + force[a] / self.info.mass);
///             self.state.position[a] += step.dt * self.state.velocity[a];
///         }
///         let speed = self.state.velocity[0].hypot(self.state.velocity[1]);
///         self.travel += step.dt * speed;
///         Ok(Limits { speed, ..Limits::default() })
///     }
///
///     fn measurement(&self) -> &MpmMeasurement {
///         &self.measurement // energies and momenta, where the step asks for them
///     }
///
///     fn points(&self) -> Vec<PointState> {
///         let ImpState { position, velocity, .. } = self.state;
///         vec![PointState { position, velocity, mass: self.info.mass, ..PointState::default() }]
///     }
/// }
///
/// let info = ImpInfo { mass: 1.0, ..ImpInfo::default() }; // what configure gives it
/// let mut solver = OnePoint { gravity: [0.0, -10.0], info, ..OnePoint::default() };
/// let dt = 1e-3;
/// let mut step = Step { index: 0, time: 0.0, dt_before: 0.0, dt, measure: false };
/// for index in 0..1000 {
///     step = Step { index, time: index as f64 * dt, dt_before: if index == 0 { 0.0 } else { dt }, ..step };
///     solver.step(&step, &[])?;
/// }
/// let fallen = -solver.points()[0].position[1];
/// assert!((fallen - 5.0).abs() < 1e-6); // g t^2 / 2 after 1 s
/// # Ok::<(), Fault>(())
/// ```
///
/// `docs/solver-authors.md` says how such a type becomes a program that `tandem run` starts.
pub trait MpmSolver {
    /// Name and version, such as `tandem-mpm 0.1.0`.
    fn identity(&self) -> String;

    /// What the solver can do and what it accepts, for Hello. A solver that lists nothing refuses in `configure` what
    /// it does not accept.
    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }

    /// Takes its part of the scene.
    ///
    /// # Errors
    /// A [`Refusal`] that names the key.
    fn configure(&mut self, config: &MpmConfig) -> Result<Readiness, Refusal>;

    /// Chooses a new set of IMPs: the points within `reach + r_p + V_d` of an envelope or inside one, ordered by id.
    /// Resets [`Self::travel`].
    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo];

    /// Largest displacement of any point since the last selection, in m (an upper bound is allowed).
    fn travel(&self) -> f64;

    /// Positions at `t_n` and velocities at `t_{n-1/2}` of the IMPs, in the order of the last selection.
    fn imp_states(&mut self) -> &[ImpState];

    /// The part of a step to `t_{n+1}` ([`Step`]) that needs no contact force, up to the internal forces, for a solver that
    /// computes it while the bodies' side computes the contact forces.
    ///
    /// # Errors
    /// A [`Fault`], after which the run ends.
    fn predict(&mut self, _step: &Step) -> Result<(), Fault> {
        Ok(())
    }

    /// The rest of the step, with the contact forces at `t_n` on the IMPs, slot by slot (none in an uncoupled run).
    /// Returns the limits for the next step. The session adds `radius_min` and the speed of points that are not IMPs.
    ///
    /// # Errors
    /// A [`Fault`], after which the run ends.
    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault>;

    /// A whole step with given forces.
    ///
    /// # Errors
    /// A [`Fault`], after which the run ends.
    fn step(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        self.predict(step)?;
        self.correct(step, forces)
    }

    /// The measurement of the last step that had [`Step::measure`].
    fn measurement(&self) -> &MpmMeasurement;

    /// All points in order of their ids: positions at `t_n`, velocities at `t_{n-1/2}` (after a closing step: at the
    /// end), stress and volume as they were last updated.
    fn points(&self) -> Vec<PointState>;

    /// The complete state before the next step. After [`Self::restore`], another solver with the same configuration
    /// must continue to the same bits. Called only if [`Capabilities`] have `save`.
    ///
    /// # Errors
    /// A [`Fault`], after which the run ends.
    fn save(&self) -> Result<Vec<u8>, Fault> {
        Err(Fault::Other("this solver cannot save its state".into()))
    }

    /// Takes over the state that [`Self::save`] gave. The solver has been configured and has done no step.
    ///
    /// # Errors
    /// A [`Refusal`]: the bytes are not a state of this solver and configuration.
    fn restore(&mut self, _saved: &[u8]) -> Result<(), Refusal> {
        Err(Refusal::new(
            "restore",
            "this solver cannot restore a state",
        ))
    }
}

/// What the bodies' side knows at the end of [`DemSolver::contact`], apart from the forces.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Answer {
    /// Limits for the next step. Where there is no `travel`, the driver adds what follows from the forces and the motion, so
    /// `omega_sq` of contact between bodies is all that a solver has to know, and 0 without such contact.
    pub limits: Limits,
    /// Largest displacement that any body's surface will have at `t_{n+1}`, since the envelopes were last asked for, in
    /// m. `None`: the driver moves the bodies before it answers, and measures. A solver that says it lets the continuum go on
    /// meanwhile.
    pub travel: Option<f64>,
}

/// A rigid-body solver. A step is one call of [`Self::contact`] and then one of [`Self::advance`].
///
/// Five methods make one. The driver keeps the ledger, measures how far surfaces move and makes the limits, by
/// [`Self::bodies`], which a solver has where forces move them. A solver that computes these itself, as the built-in one does,
/// says so with [`Answer::travel`] and [`Self::measurement`].
///
/// # Examples
///
/// Fixed discs that push points with a linear spring.
///
/// ```
/// use interface::Vec2;
/// use interface::config::{BodyShape, ContactLaw, DemConfig, Motion};
/// use interface::forces::{Contact, Forces, Points};
/// use interface::message::wire::{EnvelopeVertex, ImpInfo, ImpState};
/// use interface::solver::{Answer, DemSolver, Fault, Readiness, Refusal};
/// use interface::step::Step;
///
/// #[derive(Default)]
/// struct HeldDiscs {
///     stiffness: f64,
///     discs: Vec<EnvelopeVertex>,
/// }
///
/// impl DemSolver for HeldDiscs {
///     fn identity(&self) -> String {
///         "held-discs 0.1".to_owned()
///     }
///
///     fn configure(&mut self, config: &DemConfig) -> Result<Readiness, Refusal> {
///         let ContactLaw::Linear { normal_stiffness, friction: 0.0, damping_ratio: 0.0, .. } = config.point_contact else {
///             return Err(Refusal::new("contact", "expected `linear`, without friction and damping"));
///         };
///         for (i, body) in config.bodies.iter().enumerate() {
///             if body.shape != BodyShape::Disc || body.motion != Motion::Fixed {
///                 return Err(Refusal::new(format!("dem.body.{i}"), "expected a fixed disc"));
///             }
///             let (body, position, reach) = (i as u64, body.position, body.sphero_radius);
///             self.discs.push(EnvelopeVertex { body, position, reach });
///         }
///         self.stiffness = normal_stiffness;
///         let items = config.bodies.len() as u64;
///         Ok(Readiness { items, stiffness_max: normal_stiffness, ..Readiness::default() })
///     }
///
///     fn envelopes(&mut self) -> &[EnvelopeVertex] {
///         &self.discs
///     }
///
///     fn contact(&mut self, _: &Step, points: &Points, forces: &mut Forces) -> Result<Answer, Fault> {
///         for (slot, (info, state)) in points.set.iter().zip(points.states).enumerate() {
///             for (body, disc) in self.discs.iter().enumerate() {
///                 let away = Vec2::from(state.position) - Vec2::from(disc.position);
///                 let overlap = disc.reach + info.radius - away.norm();
///                 if overlap > -0.5 * info.radius {
///                     forces.add(&Contact {
///                         slot,
///                         body,
///                         at: state.position.into(),
///                         force: away.normalize() * (self.stiffness * overlap.max(0.0)),
///                         stiffness: self.stiffness,
///                         ..Contact::default()
///                     });
///                 }
///             }
///         }
///         Ok(Answer::default())
///     }
///
///     fn advance(&mut self, _: &Step) -> Result<(), Fault> {
///         Ok(()) // nothing moves
///     }
/// }
///
/// let disc = EnvelopeVertex { reach: 0.1, ..EnvelopeVertex::default() };
/// let mut solver = HeldDiscs { stiffness: 1e4, discs: vec![disc] };
/// // A point on the right of it, 0.01 m deep: 100 N push it on.
/// let set = [ImpInfo { radius: 0.01, mass: 1.0, ..ImpInfo::default() }];
/// let states = [ImpState { position: [0.1, 0.0], ..ImpState::default() }];
/// let step = Step { index: 1, time: 0.0, dt_before: 1e-3, dt: 1e-3, measure: false };
/// let mut forces = Forces::default();
/// forces.clear(&states, [Default::default()]);
/// solver.contact(&step, &Points { set: &set, states: &states }, &mut forces)?;
/// assert!((forces.on_points()[0].force[0] - 100.0).abs() < 1e-9);
/// # Ok::<(), Fault>(())
/// ```
pub trait DemSolver {
    /// Name and version, such as `tandem-dem 0.1.0`.
    fn identity(&self) -> String;

    /// What the solver can do and what it accepts, for Hello. A solver that lists nothing refuses in `configure` what
    /// it does not accept.
    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }

    /// Takes its part of the scene.
    ///
    /// # Errors
    /// A [`Refusal`] that names the key.
    fn configure(&mut self, config: &DemConfig) -> Result<Readiness, Refusal>;

    /// The outlines of all bodies at `t_n`; [`Answer::travel`] counts from these positions.
    fn envelopes(&mut self) -> &[EnvelopeVertex];

    /// Adds the forces at `t_n` on the points to `forces`. It only evaluates: the state of bodies and contacts does not
    /// change before [`Self::advance`].
    ///
    /// # Errors
    /// A [`Fault`], after which the run ends.
    fn contact(
        &mut self,
        step: &Step,
        points: &Points<'_>,
        forces: &mut Forces,
    ) -> Result<Answer, Fault>;

    /// Kicks the bodies by the forces of the last [`Self::contact`], negated; commits the history of contacts; and moves
    /// the bodies to `t_{n+1}`. Not called in the opening step, in which nothing moves (T-3).
    ///
    /// # Errors
    /// A [`Fault`], after which the run ends.
    fn advance(&mut self, step: &Step) -> Result<(), Fault>;

    /// Where the bodies are at `t_n`, their velocities at `t_{n-1/2}`, masses and moments of inertia, in the order of the
    /// configuration. Needed where one is no fixed disc; loads and contacts are not read.
    fn bodies(&self) -> Vec<BodyState> {
        Vec::new()
    }

    /// The IMP set was rebuilt: slots now have the order of `set`. For who prepares something for each slot.
    fn imp_set(&mut self, _set: &[ImpInfo]) {}

    /// The solver's own measurement of the last step that had [`Step::measure`], which the driver then does not make.
    fn measurement(&self) -> Option<&DemMeasurement> {
        None
    }

    /// The contacts that press at `t_n`, in an order that is a function of the state, for a frame. Asked after
    /// [`Self::contact`] of the same step and states and before [`Self::advance`], and only where [`Capabilities`] have
    /// `contacts`.
    fn contacts(&self, _step: &Step, _imps: &[ImpState]) -> Vec<ContactState> {
        Vec::new()
    }

    /// The complete state before the next step. After [`Self::restore`], another solver with the same configuration
    /// must continue to the same bits. Called only if [`Capabilities`] have `save`.
    ///
    /// # Errors
    /// A [`Fault`], after which the run ends.
    fn save(&self) -> Result<Vec<u8>, Fault> {
        Err(Fault::Other("this solver cannot save its state".into()))
    }

    /// Restores the state that [`Self::save`] returned. The solver has been configured and has done no step.
    ///
    /// # Errors
    /// A [`Refusal`]: the bytes are not a state of this solver and configuration.
    fn restore(&mut self, _saved: &[u8]) -> Result<(), Refusal> {
        Err(Refusal::new(
            "restore",
            "this solver cannot restore a state",
        ))
    }
}
