//! rapier as the bodies' side of Tandem: an example of a solver of another kind than the built-in one.
//!
//! Bodies meet by rapier's impulses, without rebound, and rapier moves them; material points push them by springs, the
//! law `linear` of PROTOCOL.md section 7 without dashpots, with distances that rapier's shapes measure. What differs
//! from the built-in solver stands in `docs/solver-authors.md`.
#![forbid(unsafe_code)]

pub mod body;

use std::collections::BTreeMap;

use interface::config::{ContactLaw, DemConfig};
use interface::solver::{Answer, DemMeasurement, DemSolver, Fault, Readiness, Refusal};
use interface::step::Step;
use interface::wire::{BodyState, EnvelopeVertex, ImpForce, ImpInfo, ImpState, Ledger, Limits};
use rapier2d_f64::prelude::*;

use body::Body;

/// Bodies that meet may pass speed on, and a far end may get more than the end that was hit; twice is ample for convex
/// ones of even mass.
const PASSED_ON: f64 = 2.0;

/// The solver: without bodies until it is configured.
#[derive(Default)]
pub struct Rapier {
    world: PhysicsWorld,
    bodies: Vec<Body>,
    gravity: Vector,
    /// Whether bodies touch one another.
    meeting: bool,
    /// Whether one of them is fixed.
    held: bool,
    stiffness: [f64; 2],
    friction: f64,
    set: Vec<ImpInfo>,
    /// Tangential springs by point and body: before this step, and after it, in m.
    springs: [BTreeMap<(u64, usize), f64>; 2],
    /// Where the points were one step before.
    previous: BTreeMap<u64, Vector>,
    envelopes: Vec<EnvelopeVertex>,
    /// So far, but for this step; what this step adds is made in `contact` and taken over at its end.
    totals: Totals,
    energy: f64,
    loss: f64,
    measured: DemMeasurement,
}

/// Sums over the run.
#[derive(Clone, Copy, Default)]
struct Totals {
    friction: f64,
    /// Kinetic energy that rapier's solver has taken.
    impulses: f64,
    applied: Vector,
    by_points: Vector,
}

impl DemSolver for Rapier {
    fn identity(&self) -> String {
        format!("rapier-dem {}", env!("CARGO_PKG_VERSION"))
    }

    fn configure(&mut self, config: &DemConfig) -> Result<Readiness, Refusal> {
        let ContactLaw::Linear {
            normal_stiffness,
            tangential_stiffness,
            friction,
            damping_ratio,
        } = config.point_contact
        else {
            return Err(Refusal::new(
                "dem.point_contact",
                "only `linear` is known here",
            ));
        };
        if config.threads == 0 {
            return Err(Refusal::new("dem.threads", "expected 1 or more"));
        }
        if damping_ratio != 0.0 {
            let key = "dem.point_contact.linear.damping_ratio";
            return Err(Refusal::new(
                key,
                "there are no dashpots here: 0 is accepted",
            ));
        }
        if friction > 0.0 && tangential_stiffness <= 0.0 {
            let key = "dem.point_contact.linear.tangential_stiffness";
            return Err(Refusal::new(key, "friction needs a positive one"));
        }
        if !config.contact_pairs.is_empty() {
            return Err(Refusal::new(
                "dem.contact_pairs",
                "one law for all here: none is accepted",
            ));
        }
        let mut notes = Vec::new();
        let between = match config.body_contact {
            None => None,
            Some(ContactLaw::Linear { friction, .. }) => {
                notes.push("bodies meet by impulses, without rebound: of body_contact friction alone is used, of overlap nothing".into());
                Some(friction)
            }
            Some(_) => {
                return Err(Refusal::new(
                    "dem.body_contact",
                    "only `linear` is known here",
                ));
            }
        };
        *self = Self {
            gravity: config.gravity.into(),
            meeting: between.is_some(),
            stiffness: [
                normal_stiffness,
                if friction > 0.0 {
                    tangential_stiffness
                } else {
                    0.0
                },
            ],
            friction,
            ..Self::default()
        };
        for (i, body) in config.bodies.iter().enumerate() {
            self.bodies
                .push(Body::insert(&mut self.world, i, body, between)?);
        }
        self.held = self.bodies.iter().any(|b| !b.is_free());
        // Gravity is part of the kick. Lengths are those of the smallest body; nothing is slowed down or swept.
        self.world.gravity = Vector::ZERO;
        let smallest = self.bodies.iter().map(|b| b.extent).fold(1.0, f64::min);
        let parameters = &mut self.world.integration_parameters;
        parameters.length_unit = smallest;
        parameters.normalized_max_linear_velocity = f64::MAX;
        parameters.max_ccd_substeps = 0;
        let free = self.bodies.iter().filter(|b| b.is_free());
        let lightest = free.map(|b| b.mass).reduce(f64::min);
        Ok(Readiness {
            items: self.bodies.len() as u64,
            mass_min: lightest.unwrap_or(0.0),
            stiffness_max: normal_stiffness,
            notes,
            ..Readiness::default()
        })
    }

    fn envelopes(&mut self) -> &[EnvelopeVertex] {
        self.envelopes.clear();
        for (i, b) in self.bodies.iter_mut().enumerate() {
            let pose = *self.world.bodies[b.handle].position();
            b.published = (pose.translation, b.angle);
            self.envelopes
                .extend(b.outline.0.iter().map(|&arm| EnvelopeVertex {
                    body: i as u64,
                    position: (pose * arm).into(),
                    reach: b.outline.1,
                }));
        }
        &self.envelopes
    }

    fn imp_set(&mut self, set: &[ImpInfo]) {
        self.set = set.to_vec();
    }

    fn contact(
        &mut self,
        step: &Step,
        imps: &[ImpState],
        forces: &mut [ImpForce],
    ) -> Result<Answer, Fault> {
        (self.energy, self.loss) = (0.0, 0.0);
        let [before, mut after] = std::mem::take(&mut self.springs);
        after.clear();
        for (i, b) in self.bodies.iter_mut().enumerate() {
            (b.load, b.reach) = ((Vector::ZERO, 0.0), (0.0, 0.0, 0));
            let pose = *self.world.bodies[b.handle].position();
            for ((info, state), force) in self.set.iter().zip(imps).zip(&mut *forces) {
                let key = (info.id, i);
                let was = self.previous.get(&info.id).copied();
                let spring = before.get(&key).copied().unwrap_or(0.0);
                let touch = Touch {
                    stiffness: self.stiffness,
                    friction: self.friction,
                    spring,
                    was,
                };
                let Some(press) = touch.press(b, &pose, info.radius, state.position.into()) else {
                    continue;
                };
                force.force[0] += press.force.x;
                force.force[1] += press.force.y;
                force.stiffness += self.stiffness[0];
                self.energy += press.energy;
                self.loss += press.loss;
                if press.spring != 0.0 {
                    after.insert(key, press.spring);
                }
            }
        }
        self.kick(step)?;
        if step.measure {
            self.measure(step);
        }
        self.springs = [before, after];
        if step.dt_before > 0.0 || step.dt > 0.0 {
            self.springs.swap(0, 1);
            self.totals = self.totals_after(step);
            let places = self
                .set
                .iter()
                .zip(imps)
                .map(|(info, s)| (info.id, s.position.into()));
            self.previous = places.collect();
        }
        Ok(self.answer(step))
    }

    /// rapier's step: impulses between the bodies, then the drift.
    fn advance(&mut self, step: &Step) -> Result<(), Fault> {
        if step.dt_before == 0.0 && step.dt == 0.0 {
            return Ok(());
        }
        for b in self.bodies.iter().filter(|b| b.is_free()) {
            let body = &mut self.world.bodies[b.handle];
            body.set_linvel(b.kicked.0, true);
            body.set_angvel(b.kicked.1, true);
        }
        if step.dt == 0.0 {
            return Ok(());
        }
        let places: Vec<Pose> = self
            .bodies
            .iter()
            .map(|b| *self.world.bodies[b.handle].position())
            .collect();
        self.world.integration_parameters.dt = step.dt;
        self.world.step();
        for (b, was) in self
            .bodies
            .iter_mut()
            .zip(places)
            .filter(|(b, _)| b.is_free())
        {
            let body = &mut self.world.bodies[b.handle];
            let (now, velocity) = (*body.position(), (body.linvel(), body.angvel()));
            if velocity == b.kicked {
                // Nothing has hit it. rapier turns by a linear step in each of its substeps, too little by
                // (omega dt/4)^2/3 of the turn: the drift of T-1 instead.
                b.moved = (velocity.0 * step.dt, velocity.1 * step.dt);
                b.angle += b.moved.1;
                body.set_position(Pose::new(was.translation + b.moved.0, b.angle), true);
            } else {
                let turn = (was.rotation.inverse() * now.rotation).angle();
                b.moved = (now.translation - was.translation, turn);
                b.angle += turn;
            }
            if self.held {
                // What fixed bodies do to free ones comes from outside; what free ones do to each other adds up to
                // nothing, and is not booked where there are no others, so that it shows.
                self.totals.applied += (velocity.0 - b.kicked.0) * b.mass;
            }
            let [taken, left] = [b.kicked, velocity].map(|v| b.kinetic(v).iter().sum::<f64>());
            self.totals.impulses += taken - left;
        }
        Ok(())
    }

    fn measurement(&self) -> &DemMeasurement {
        &self.measured
    }
}

/// A point and a body near one another, before their forces are known.
struct Touch {
    stiffness: [f64; 2],
    friction: f64,
    spring: f64,
    was: Option<Vector>,
}

/// What a body does to a point within its reach.
struct Press {
    force: Vector,
    spring: f64,
    energy: f64,
    loss: f64,
}

impl Touch {
    /// The law `linear`; books the negative on the body. `None` out of reach (F-6).
    fn press(&self, b: &mut Body, pose: &Pose, radius: f64, x: Vector) -> Option<Press> {
        let nearest = b.shape.project_point(pose, x, false);
        let apart = x - nearest.point;
        let distance = if nearest.is_inside {
            -apart.length()
        } else {
            apart.length()
        };
        let overlap = b.margin + radius - distance;
        if overlap <= -0.5 * radius {
            return None;
        }
        let n = if distance == 0.0 {
            Vector::Y
        } else {
            apart / distance
        };
        let t = Vector::new(-n.y, n.x);
        let arm = x - n * (radius - 0.5 * overlap) - pose.translation;
        let [k_n, k_t] = self.stiffness;
        let (r_n, r_t) = (arm.perp_dot(n), arm.perp_dot(t));
        let [m, i] = b.inverse;
        b.reach.0 += k_n * (m + i * r_n * r_n) + k_t * (m + i * r_t * r_t);
        b.reach.1 += m + i * r_n * r_n;
        let moved = self.was.map_or(0.0, |was| {
            let (shift, turn) = b.moved;
            let material = shift + arm - Rotation::new(-turn) * arm;
            (x - was - material).dot(t)
        });
        let mut press = Press {
            force: Vector::ZERO,
            spring: 0.0,
            energy: 0.0,
            loss: 0.0,
        };
        if overlap <= 0.0 {
            press.loss = 0.5 * k_t * self.spring * (moved + self.spring);
            return Some(press);
        }
        let normal = k_n * overlap;
        if k_t > 0.0 {
            let longest = self.friction * normal / k_t;
            press.spring = (self.spring + moved).clamp(-longest, longest);
            let stretched = press.spring - self.spring;
            press.loss = 0.5 * k_t * (press.spring + self.spring) * (moved - stretched);
        }
        press.energy = 0.5 * (k_n * overlap * overlap + k_t * press.spring * press.spring);
        press.force = n * normal - t * (k_t * press.spring);
        b.load.0 -= press.force;
        b.load.1 -= arm.perp_dot(press.force);
        b.reach.2 += 1;
        Some(press)
    }
}

impl Rapier {
    /// The leapfrog's kick, by points and gravity (T-1): rapier's own would be by the step ahead alone.
    fn kick(&mut self, step: &Step) -> Result<(), Fault> {
        for (i, b) in self
            .bodies
            .iter_mut()
            .enumerate()
            .filter(|(_, b)| b.is_free())
        {
            let body = &self.world.bodies[b.handle];
            let acceleration = b.load.0 * b.inverse[0] + self.gravity;
            let spin = body.angvel() + b.load.1 * b.inverse[1] * step.kick();
            b.kicked = (body.linvel() + acceleration * step.kick(), spin);
            if !b.speed().is_finite() {
                let (what, item) = ("velocity".into(), format!("body {i} ({})", b.name));
                return Err(Fault::NotFinite { what, item });
            }
        }
        Ok(())
    }

    fn answer(&self, step: &Step) -> Answer {
        let most = |of: &dyn Fn(&Body) -> f64| self.bodies.iter().map(of).fold(0.0, f64::max);
        let mut speed = most(&Body::speed);
        if self.meeting {
            let parameters = &self.world.integration_parameters;
            speed = PASSED_ON
                * (speed + parameters.normalized_max_corrective_velocity * parameters.length_unit);
        }
        let gone = most(&|b| {
            let (at, angle) = b.published;
            let shift = self.world.bodies[b.handle].translation() - at;
            shift.length() + (b.angle - angle).abs() * b.extent
        });
        Answer {
            limits: Limits {
                contact_omega_sq: most(&|b| b.reach.0),
                mobility: most(&|b| b.reach.1),
                speed,
                ..Limits::default()
            },
            travel: gone + speed * step.dt,
        }
    }

    /// The sums with this step's kick.
    fn totals_after(&self, step: &Step) -> Totals {
        let mut totals = self.totals;
        totals.friction += self.loss;
        for b in &self.bodies {
            totals.by_points += b.load.0 * step.kick();
            // What is fixed is held: its holder takes up what the points exert on it.
            let outside = if b.is_free() {
                self.gravity * b.mass
            } else {
                -b.load.0
            };
            totals.applied += outside * step.kick();
        }
        totals
    }

    fn measure(&mut self, step: &Step) {
        let w = step.centring();
        let totals = self.totals_after(step);
        let mut ledger = Ledger {
            contact: self.energy,
            friction_work: totals.friction,
            viscous_work: totals.impulses,
            applied_impulse: totals.applied.into(),
            contact_impulse: totals.by_points.into(),
            ..Ledger::default()
        };
        self.measured.bodies.clear();
        for b in &self.bodies {
            let body = &self.world.bodies[b.handle];
            let (x, before) = (body.translation(), (body.linvel(), body.angvel()));
            if b.is_free() {
                let [of_before, of_after] = [before, b.kicked].map(|v| b.kinetic(v));
                ledger.kinetic += (1.0 - w) * of_before[0] + w * of_after[0];
                ledger.kinetic_rotation += (1.0 - w) * of_before[1] + w * of_after[1];
                ledger.gravity -= b.mass * self.gravity.dot(x);
                ledger.momentum[0] += b.mass * b.kicked.0.x;
                ledger.momentum[1] += b.mass * b.kicked.0.y;
            }
            ledger.contact_force[0] += b.load.0.x;
            ledger.contact_force[1] += b.load.0.y;
            ledger.contacts += u64::from(b.reach.2 > 0);
            self.measured.bodies.push(BodyState {
                position: x.into(),
                velocity: (before.0 * (1.0 - w) + b.kicked.0 * w).into(),
                angle: b.angle,
                spin: before.1 * (1.0 - w) + b.kicked.1 * w,
                mass: b.mass,
                inertia: b.inertia,
                point_force: b.load.0.into(),
                point_torque: b.load.1,
                contacts: b.reach.2,
                ..BodyState::default()
            });
        }
        self.measured.ledger = ledger;
    }
}
