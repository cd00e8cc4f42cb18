//! What the driver does for a bodies' side that says where its bodies are and no more: it keeps the ledger, makes the limits
//! and measures how far surfaces have moved.

use serde::{Deserialize, Serialize};

use crate::Vec2;
use crate::config::{BodyShape, DemConfig, Motion};
use crate::forces::{Forces, Load};
use crate::ledger::{Entry, Totals, measure};
use crate::message::wire::{BodyState, EnvelopeVertex, Limits};
use crate::solver::{DemMeasurement, Fault, Refusal};
use crate::step::Step;

/// Follows bodies through a session.
#[derive(Debug, Default)]
pub(super) struct Follower {
    gravity: Vec2,
    motions: Vec<Motion>,
    names: Vec<String>,
    /// Where they are at `t_n`, and their velocities at `t_{n-1/2}`.
    pub bodies: Vec<BodyState>,
    state: State,
    pub measured: DemMeasurement,
}

/// What has to survive.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct State {
    totals: Totals,
    surfaces: Vec<Surface>,
}

/// A body when its envelope was last asked for: centre of mass in m, angle in rad; and the largest distance of its surface
/// from there in m.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Surface {
    center: [f64; 2],
    angle: f64,
    extent: f64,
}

impl Follower {
    /// Follows the bodies of a configuration: as the solver has them, or fixed discs where it has nothing to say.
    ///
    /// # Errors
    /// A [`Refusal`] of bodies that the solver has to speak for.
    pub fn new(config: &DemConfig, bodies: Vec<BodyState>) -> Result<Self, Refusal> {
        let held = || -> Result<Vec<BodyState>, Refusal> {
            config.bodies.iter().enumerate().map(Self::held).collect()
        };
        Ok(Self {
            gravity: config.gravity.into(),
            motions: config.bodies.iter().map(|body| body.motion).collect(),
            names: config.bodies.iter().map(|body| body.name.clone()).collect(),
            bodies: match bodies.len() {
                0 => held()?,
                n if n == config.bodies.len() => bodies,
                n => {
                    let text = format!("the solver has {n} bodies of {}", config.bodies.len());
                    return Err(Refusal::new("dem.body", text));
                }
            },
            ..Self::default()
        })
    }

    /// A fixed disc, of whose mass nothing depends.
    fn held((i, body): (usize, &crate::config::BodyConfig)) -> Result<BodyState, Refusal> {
        if body.motion != Motion::Fixed || body.shape != BodyShape::Disc {
            let text = "a solver that has no `bodies` takes fixed discs only";
            return Err(Refusal::new(format!("dem.body.{i}"), text));
        }
        Ok(BodyState {
            position: body.position,
            angle: body.angle,
            mass: 1.0,
            inertia: 1.0,
            ..BodyState::default()
        })
    }

    /// No loads yet.
    pub fn loads(&self) -> impl Iterator<Item = Load> {
        let bodies = self.bodies.iter().zip(&self.motions);
        bodies.map(|(body, motion)| Load::none(body, motion.yielding()))
    }

    /// The outlines were asked for.
    pub fn publish(&mut self, envelopes: &[EnvelopeVertex]) {
        let surface = |body: &BodyState| Surface {
            center: body.position,
            angle: body.angle,
            extent: 0.0,
        };
        self.state.surfaces = self.bodies.iter().map(surface).collect();
        for vertex in envelopes {
            if let Some(surface) = self.state.surfaces.get_mut(vertex.body as usize) {
                let away = Vec2::from(vertex.position) - Vec2::from(surface.center);
                surface.extent = surface.extent.max(away.norm() + vertex.reach);
            }
        }
    }

    /// The bodies have made the step and are now as `after` says.
    ///
    /// # Errors
    /// [`Fault::NotFinite`].
    pub fn moved(
        &mut self,
        step: &Step,
        after: Vec<BodyState>,
        forces: &Forces,
    ) -> Result<(), Fault> {
        let after = match after.len() {
            0 => self.bodies.clone(),
            n if n == self.bodies.len() => after,
            n => {
                let were = self.bodies.len();
                return Err(Fault::Other(format!("{n} bodies, there were {were}")));
            }
        };
        let sum = |b: &BodyState| {
            let numbers = [b.position, b.velocity, [b.angle, b.spin]];
            numbers.as_flattened().iter().map(|x| x.abs()).sum::<f64>()
        };
        if let Some(i) = after.iter().position(|body| !sum(body).is_finite()) {
            return Err(Fault::NotFinite {
                what: "velocity".into(),
                item: format!("body {i} ({})", self.names[i]),
            });
        }
        let entry = |(((&before, after), load), motion): (_, &Motion)| {
            let (before, after, load): (BodyState, &BodyState, &Load) = (before, after, load);
            Entry {
                body: BodyState {
                    point_force: load.force.into(),
                    point_torque: load.torque,
                    contacts: load.contacts,
                    ..before
                },
                velocity: after.velocity,
                spin: after.spin,
                yielding: motion.yielding(),
            }
        };
        let bodies = self.bodies.iter().zip(&after).zip(forces.on_bodies());
        let entries: Vec<Entry> = bodies.zip(&self.motions).map(entry).collect();
        let mut totals = self.state.totals;
        totals.friction_work += forces.slid;
        totals.viscous_work += forces.damped;
        for (entry, motion) in entries.iter().zip(&self.motions) {
            totals.add(entry, self.gravity, motion.push(step.span()), step.kick());
        }
        if step.measure {
            let both = [&self.state.totals, &totals];
            self.measured = measure(step, self.gravity, forces.stored, both, entries.into_iter());
        }
        if !step.is_opening() {
            self.state.totals = totals;
            self.bodies = after;
        }
        Ok(())
    }

    /// The solver's limits, with what follows from the forces and from the motion.
    pub fn limits(&self, limits: Limits, forces: &Forces) -> Limits {
        let surfaces = self.bodies.iter().zip(&self.state.surfaces);
        let speeds = surfaces
            .map(|(b, surface)| Vec2::from(b.velocity).norm() + b.spin.abs() * surface.extent);
        let loads = forces.on_bodies().iter();
        loads.fold(
            Limits {
                speed: speeds.fold(limits.speed, f64::max),
                ..limits
            },
            |most, load| Limits {
                contact_omega_sq: most.contact_omega_sq.max(load.rate),
                mobility: most.mobility.max(load.mobility),
                ..most
            },
        )
    }

    /// Largest displacement of a surface since the envelopes were asked for, in m (F-9).
    pub fn travel(&self) -> f64 {
        let surfaces = self.bodies.iter().zip(&self.state.surfaces);
        let way = |(b, from): (&BodyState, &Surface)| {
            let shift = Vec2::from(b.position) - Vec2::from(from.center);
            shift.norm() + (b.angle - from.angle).abs() * from.extent
        };
        surfaces.map(way).fold(0.0, f64::max)
    }

    /// What has to survive in a saved state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Goes on with a saved state; the solver's `bodies` are those of then.
    ///
    /// # Errors
    /// A [`Refusal`].
    pub fn restore(&mut self, state: State, bodies: Vec<BodyState>) -> Result<(), Refusal> {
        if state.surfaces.len() != self.bodies.len() {
            let text = format!("a state of {} bodies", state.surfaces.len());
            return Err(Refusal::new("restore", text));
        }
        self.state = state;
        if !bodies.is_empty() {
            self.bodies = bodies;
        }
        Ok(())
    }
}
