//! rapier as the bodies' side of Tandem: an example of a solver of another kind than the built-in one.
//!
//! Bodies meet by rapier's impulses, without rebound, and rapier moves them; material points push them by springs, as
//! [`mechanics::rigid`] has it. What differs from the built-in solver stands in `docs/solver-authors.md`.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

use interface::Vec2;
use interface::config::capability::Capabilities;
use interface::config::{ContactLaw, DemConfig, Motion};
use interface::forces::{Forces, Points};
use interface::impulse::at;
use interface::ledger::{self, Totals};
use interface::message::wire::{BodyState, EnvelopeVertex};
use interface::solver::{Answer, DemMeasurement, DemSolver, Fault, Readiness, Refusal};
use interface::step::Step;
use mechanics::rigid::{Body, PointContact};
use rapier2d_f64::prelude::*;

/// What the solver takes ([`interface::config::capability`]). Not `save`: rapier keeps of its contacts what it does not give. Of the
/// family `overlap` nothing, since bodies meet by impulses, whatever the measure.
const CAPABILITIES: [&str; 12] = [
    "shape:disc",
    "shape:segment",
    "shape:polygon",
    "shape:rectangle",
    "law:linear",
    "motion:free",
    "motion:fixed",
    "inertia:density",
    "inertia:mass",
    "feature:friction",
    "feature:body_contact",
    "feature:impulses",
];

/// The solver: without bodies until it is configured.
#[derive(Default)]
pub struct Rapier {
    world: PhysicsWorld,
    bodies: Vec<Body>,
    /// The same in rapier's set.
    handles: Vec<RigidBodyHandle>,
    gravity: Vec2,
    springs: PointContact,
    /// Velocity (m/s) and spin (rad/s) of each body after the last step. Those in `bodies` are of the last evaluation.
    reached: Vec<([f64; 2], f64)>,
    envelopes: Vec<EnvelopeVertex>,
    totals: Totals,
    /// What `totals` are to be after the step that was last evaluated.
    next_totals: Totals,
    measured: DemMeasurement,
}

impl DemSolver for Rapier {
    fn identity(&self) -> String {
        format!("rapier-dem {}", env!("CARGO_PKG_VERSION"))
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::of(&CAPABILITIES)
    }

    fn configure(&mut self, config: &DemConfig) -> Result<Readiness, Refusal> {
        let refuse = |key: &str, text: &str| Err(Refusal::new(key, text));
        if let Some(fault) = config.faults().first() {
            return Err(fault.into());
        }
        if !config.contact_pairs.is_empty() {
            let text = "one law for all here: none is accepted";
            return refuse("contact_pair", text);
        }
        if config.contact_resolution.is_some() {
            let text = "bodies meet by impulses, which have nothing to resolve: none is accepted";
            return refuse("dem.contact_resolution", text);
        }
        let (friction, notes) = match config.body_contact {
            None => (None, Vec::new()),
            Some(ContactLaw::Linear { friction, .. }) => {
                let note = "bodies meet by impulses, without rebound: of body_contact friction alone is used, of overlap nothing";
                (Some(friction), vec![note.into()])
            }
            Some(_) => return refuse("body_contact", "only `linear` is known here"),
        };
        *self = Self {
            gravity: config.gravity.into(),
            springs: PointContact::new(&config.point_contact)?,
            ..Self::default()
        };
        for (i, body) in config.bodies.iter().enumerate() {
            if !matches!(body.motion, Motion::Free | Motion::Fixed) {
                let key = format!("dem.body.{i}.motion");
                return refuse(&key, "only `free` and `fixed` are known here");
            }
            self.bodies.push(Body::new(i, body)?);
            self.insert(friction).ok_or_else(|| {
                let key = format!("dem.body.{i}.shape");
                Refusal::new(key, "rapier takes it for degenerate")
            })?;
        }
        let velocities = self.bodies.iter().map(|b| &b.entry);
        self.reached = velocities.map(|e| (e.velocity, e.spin)).collect();
        // Gravity is part of the kick. Lengths are those of the smallest body; nothing is slowed down or swept.
        self.world.gravity = Vector::ZERO;
        let parameters = &mut self.world.integration_parameters;
        parameters.length_unit = self.bodies.iter().map(|b| b.extent).fold(1.0, f64::min);
        parameters.normalized_max_linear_velocity = f64::MAX;
        parameters.max_ccd_substeps = 0;
        let free = self.bodies.iter().filter(|b| b.yields());
        let lightest = free.map(|b| b.entry.body.mass).reduce(f64::min);
        Ok(Readiness {
            items: self.bodies.len() as u64,
            mass_min: lightest.unwrap_or(0.0),
            stiffness_max: self.springs.normal,
            notes,
            ..Readiness::default()
        })
    }

    fn envelopes(&mut self) -> &[EnvelopeVertex] {
        let bodies = self.bodies.iter().enumerate();
        self.envelopes = bodies.flat_map(|(i, b)| b.envelope(i)).collect();
        &self.envelopes
    }

    /// The forces on points and what these, gravity and pushes do to the bodies. All of it is worked out from where the last
    /// step ended, so it may be asked for again; what bodies do to one another is rapier's and comes in [`Self::advance`].
    fn contact(
        &mut self,
        step: &Step,
        points: &Points<'_>,
        forces: &mut Forces,
    ) -> Result<Answer, Fault> {
        self.springs.evaluate(step, points, &self.bodies, forces);
        self.next_totals = self.totals;
        self.next_totals.friction_work += forces.slid;
        let reached = self.reached.iter().zip(forces.on_bodies());
        for (body, (reached, load)) in self.bodies.iter_mut().zip(reached) {
            (body.entry.velocity, body.entry.spin) = *reached;
            body.kick(step, load, self.gravity)?;
            let push = body.push(step);
            self.next_totals
                .add(&body.entry, self.gravity, push, step.kick());
        }
        if step.measure {
            let totals = [&self.totals, &self.next_totals];
            let entries = self.bodies.iter().map(|b| b.entry);
            self.measured = ledger::measure(step, self.gravity, forces.stored, totals, entries);
        }
        // The driver measures speed and travel after rapier's impulses (L-2).
        Ok(Answer::default())
    }

    /// Takes over what was evaluated; then rapier's step.
    fn advance(&mut self, step: &Step) -> Result<(), Fault> {
        self.totals = self.next_totals;
        self.springs.commit();
        if step.dt > 0.0 {
            self.drift(step);
        }
        for (b, reached) in self.bodies.iter().zip(&mut self.reached) {
            *reached = (b.entry.velocity, b.entry.spin);
        }
        Ok(())
    }

    fn bodies(&self) -> Vec<BodyState> {
        self.bodies.iter().map(Body::state).collect()
    }

    /// Its own: the velocity after the kick is not that of the step's end, which rapier's impulses have changed.
    fn measurement(&self) -> Option<&DemMeasurement> {
        Some(&self.measured)
    }
}

impl Rapier {
    /// rapier's step: impulses between the bodies, then the drift.
    fn drift(&mut self, step: &Step) {
        for (b, handle) in self.bodies.iter().zip(&self.handles) {
            let body = &mut self.world.bodies[*handle];
            body.set_linvel(vector(b.entry.velocity), true);
            body.set_angvel(b.entry.spin, true);
        }
        self.world.integration_parameters.dt = step.dt;
        // By the bodies' own masses: rapier knows those of new bodies only after its first step.
        let kinetic = |world: &PhysicsWorld| -> f64 {
            let each = self.bodies.iter().zip(&self.handles).map(|(b, handle)| {
                let (moving, own) = (&world.bodies[*handle], &b.entry.body);
                let linear = moving.linvel().length_squared() * own.mass;
                0.5 * (linear + moving.angvel().powi(2) * own.inertia)
            });
            each.sum()
        };
        let before = kinetic(&self.world);
        self.world.step();
        let lost = before - kinetic(&self.world);
        self.totals.viscous_work += lost;
        let held = self.bodies.iter().any(|b| !b.yields());
        let free = self.bodies.iter_mut().zip(&self.handles);
        for (b, handle) in free.filter(|(b, _)| b.yields()) {
            let body = &mut self.world.bodies[*handle];
            let (velocity, spin): ([f64; 2], f64) = (body.linvel().into(), body.angvel());
            let kicked = (b.entry.velocity, b.entry.spin);
            (b.entry.velocity, b.entry.spin) = (velocity, spin);
            if (velocity, spin) == kicked {
                // Nothing has hit it. rapier turns by a linear step in each of its substeps, too little by
                // (omega dt/4)^2/3 of the turn: the drift of T-1 instead.
                b.drift(step.dt);
                body.set_position(pose(b), true);
                continue;
            }
            let turn = Rotation::new(b.entry.body.angle).inverse() * *body.rotation();
            b.moved_to(<[f64; 2]>::from(body.translation()).into(), turn.angle());
            if held {
                // What fixed bodies do to free ones comes from outside; what free ones do to each other adds up to
                // nothing, and is not booked where there are no others, so that it shows.
                let taken = (Vec2::from(velocity) - Vec2::from(kicked.0)) * b.entry.body.mass;
                let [x, y, moment] = at(b.entry.body.position, taken);
                let turned = (spin - kicked.1) * b.entry.body.inertia;
                self.totals.applied_impulse += [x, y, moment + turned];
            }
        }
    }

    /// Puts the last of the bodies into rapier's world; a collider too if it has `friction` with others. `None` where
    /// rapier finds no area.
    fn insert(&mut self, friction: Option<f64>) -> Option<()> {
        let b = self.bodies.last()?;
        let kind = if b.yields() {
            RigidBodyType::Dynamic
        } else {
            RigidBodyType::Fixed
        };
        let record = &b.entry.body;
        let masses = MassProperties::new(Vector::ZERO, record.mass, record.inertia);
        let body = RigidBodyBuilder::new(kind)
            .pose(pose(b))
            .can_sleep(false)
            .additional_mass_properties(masses);
        let handle = self.world.insert_body(body);
        self.handles.push(handle);
        if let Some(friction) = friction {
            let outline: Vec<Vector> = b.outline.iter().map(|&v| vector(v.into())).collect();
            let swept = match *outline {
                [_] => SharedShape::ball(b.radius),
                [p, q] => SharedShape::capsule(p, q, b.radius),
                _ => SharedShape::round_convex_polyline(outline, b.radius)?,
            };
            let collider = ColliderBuilder::new(swept).density(0.0).friction(friction);
            self.world.insert_collider(collider, Some(handle));
        }
        Some(())
    }
}

fn vector([x, y]: [f64; 2]) -> Vector {
    Vector::new(x, y)
}

fn pose(b: &Body) -> Pose {
    Pose::new(vector(b.entry.body.position), b.entry.body.angle)
}
