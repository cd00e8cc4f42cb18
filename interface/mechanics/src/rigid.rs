//! Rigid bodies for a solver that has none of its own, or no contact with material points. It is simple and meant for few
//! bodies: every point is compared with every edge.
//!
//! In a step: [`PointContact::evaluate`]; then [`PointContact::commit`], and for each body [`Body::kick`] and
//! [`Body::drift`], or [`Body::moved_to`] where the solver has moved it.

use std::collections::BTreeMap;

use crate::mass::swept;
use crate::outline::{contact_point, see};
use interface::Vec2;
use interface::config::{BodyConfig, BodyShape, ContactLaw, Motion};
use interface::forces::{Contact, Forces, Load, Points};
use interface::ledger::Entry;
use interface::message::wire::{BodyState, EnvelopeVertex};
use interface::solver::{Fault, Refusal};
use interface::step::Step;
use serde::{Deserialize, Serialize};

/// A disc, a rounded segment or a convex spheropolygon. Its frame lies at its centre of mass.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name in the scene.
    pub name: String,
    /// Vertices in its frame in m, counter-clockwise.
    pub outline: Vec<Vec2>,
    /// Sphero-radius in m.
    pub radius: f64,
    /// Largest distance of its surface from the centre of mass in m.
    pub extent: f64,
    /// The data for the ledger: position and loads at `t_n`, velocities before and after the kick.
    pub entry: Entry,
    motion: Motion,
    /// The outline at `t_n`.
    placed: Vec<Vec2>,
}

impl Body {
    /// Body `index` of a configuration without faults ([`DemConfig::faults`](interface::config::DemConfig::faults)).
    ///
    /// # Errors
    /// A [`Refusal`] of clusters and of outlines that are not convex.
    pub fn new(index: usize, config: &BodyConfig) -> Result<Self, Refusal> {
        if matches!(config.shape, BodyShape::Cluster { .. }) || !config.shape.is_convex() {
            let text = "only discs, segments and convex polygons here";
            return Err(Refusal::new(format!("dem.body.{index}.shape"), text));
        }
        let vertices = config.shape.counter_clockwise().into_iter();
        let mut outline: Vec<Vec2> = vertices.map(Vec2::from).collect();
        let radius = config.sphero_radius;
        let moments = swept(&outline, radius);
        let (mass, inertia) = moments.mass(config.inertia);
        for v in &mut outline {
            *v -= moments.centroid;
        }
        let center = Vec2::from(config.position) + turned(moments.centroid, config.angle);
        let mut body = Self {
            name: config.name.clone(),
            radius,
            extent: outline.iter().map(Vec2::norm).fold(0.0, f64::max) + radius,
            entry: Entry {
                body: BodyState {
                    mass,
                    inertia,
                    ..BodyState::default()
                },
                velocity: config.velocity,
                spin: config.spin,
                yielding: config.motion.yielding(),
            },
            motion: config.motion,
            placed: outline.clone(),
            outline,
        };
        body.place(center, config.angle);
        Ok(body)
    }

    /// Whether forces move it.
    pub fn yields(&self) -> bool {
        self.entry.yields()
    }

    /// Centre of mass in m.
    pub fn center(&self) -> Vec2 {
        self.entry.body.position.into()
    }

    /// 1/m along x and y, 1/I; 0 where forces do not move it.
    fn inverse(&self) -> [f64; 3] {
        let (mass, inertia) = (self.entry.body.mass, self.entry.body.inertia);
        let [x, y, angle] = self.entry.yielding;
        [x / mass, y / mass, angle / inertia]
    }

    /// Largest speed of a point of its surface after the kick in m/s.
    fn speed(&self) -> f64 {
        Vec2::from(self.entry.velocity).norm() + self.entry.spin.abs() * self.extent
    }

    /// Its records of the envelopes. `index` is the index of the body.
    pub fn envelope(&self, index: usize) -> impl Iterator<Item = EnvelopeVertex> {
        let reach = self.radius;
        self.placed.iter().map(move |&vertex| EnvelopeVertex {
            body: index as u64,
            position: vertex.into(),
            reach,
        })
    }

    /// Goes on in the place and with the velocities of a saved [`Self::state`].
    pub fn restore(&mut self, state: &BodyState) {
        self.place(state.position.into(), state.angle);
        (self.entry.velocity, self.entry.spin) = (state.velocity, state.spin);
    }

    /// As [`DemSolver::bodies`](interface::solver::DemSolver::bodies) has it.
    pub fn state(&self) -> BodyState {
        BodyState {
            velocity: self.entry.velocity,
            spin: self.entry.spin,
            ..self.entry.body
        }
    }

    /// The kick of T-1 by the points, a push and `gravity` (m/s^2) at `t_n`.
    ///
    /// # Errors
    /// [`Fault::NotFinite`].
    pub fn kick(&mut self, step: &Step, load: &Load, gravity: Vec2) -> Result<(), Fault> {
        let (push, torque) = self.push(step);
        self.entry.body = BodyState {
            point_force: load.force.into(),
            point_torque: load.torque,
            contacts: load.contacts,
            ..self.state()
        };
        let (b, inverse) = (&self.entry.body, self.inverse());
        for i in 0..2 {
            let force = b.point_force[i] + push[i];
            let weight = gravity[i] * self.entry.yielding[i];
            self.entry.velocity[i] = b.velocity[i] + (force * inverse[i] + weight) * step.kick();
        }
        let torque = b.point_torque + torque;
        self.entry.spin = b.spin + torque * inverse[2] * step.kick();
        if self.speed().is_finite() {
            return Ok(());
        }
        Err(Fault::NotFinite {
            what: "velocity".into(),
            item: format!("body `{}`", self.name),
        })
    }

    /// The external push in a kick (N/m and N), for the ledger.
    pub fn push(&self, step: &Step) -> (Vec2, f64) {
        self.motion.push(step.span())
    }

    /// The drift of T-1.
    pub fn drift(&mut self, dt: f64) {
        let shift = Vec2::from(self.entry.velocity) * dt;
        self.moved_to(self.center() + shift, self.entry.spin * dt);
    }

    /// Moves the body to this position (m), by this rotation (rad).
    pub fn moved_to(&mut self, position: Vec2, turn: f64) {
        self.place(position, self.entry.body.angle + turn);
    }

    fn place(&mut self, center: Vec2, angle: f64) {
        (self.entry.body.position, self.entry.body.angle) = (center.into(), angle);
        for (placed, &v) in self.placed.iter_mut().zip(&self.outline) {
            *placed = center + turned(v, angle);
        }
    }
}

/// What a point and a body have moved over the last step, in m and rad.
#[derive(Debug, Clone, Copy, Default)]
struct Ways {
    moved: Vec2,
    spun: f64,
    shift: Vec2,
    turn: f64,
}

fn turned(v: Vec2, angle: f64) -> Vec2 {
    let (sin, cos) = angle.sin_cos();
    Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

/// Contact between points and bodies by the law `linear`, without dashpots.
#[derive(Debug, Clone, Default)]
pub struct PointContact {
    /// k_n in N/m.
    pub normal: f64,
    /// k_t in N/m; 0 where there is no friction.
    tangential: f64,
    /// mu.
    friction: f64,
    past: History,
    /// What that is to be after the step that was last evaluated.
    next: History,
}

/// What contact remembers of the step before.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct History {
    /// Where each point was, and its tangential spring on each body, in m; by the point's id (I-10).
    points: BTreeMap<u64, ([f64; 2], Vec<f64>)>,
    /// Where each body was, in m and rad.
    bodies: Vec<([f64; 2], f64)>,
}

impl PointContact {
    /// By a law between points and bodies of a configuration without faults.
    ///
    /// # Errors
    /// A [`Refusal`] of other laws and of dashpots.
    pub fn new(law: &ContactLaw) -> Result<Self, Refusal> {
        let refuse = |key: &str, text: &str| Err(Refusal::new(format!("contact{key}"), text));
        let ContactLaw::Linear {
            normal_stiffness: normal,
            tangential_stiffness: tangential,
            friction,
            damping_ratio,
            damped_mass,
        } = *law
        else {
            return refuse("", "only `linear` is known here");
        };
        for (key, value) in [
            (".linear.damping_ratio", damping_ratio),
            (".linear.damped_mass", damped_mass),
        ] {
            if value != 0.0 {
                return refuse(key, "there are no dashpots here: 0 is accepted");
            }
        }
        Ok(Self {
            normal,
            tangential: if friction > 0.0 { tangential } else { 0.0 },
            friction,
            ..Self::default()
        })
    }

    /// Adds the contacts of all points with all bodies at `t_n` to `forces`. Nothing is remembered before
    /// [`Self::commit`].
    pub fn evaluate(
        &mut self,
        step: &Step,
        points: &Points<'_>,
        bodies: &[Body],
        forces: &mut Forces,
    ) {
        self.next.points.clear();
        let places = bodies
            .iter()
            .map(|b| (b.entry.body.position, b.entry.body.angle));
        self.next.bodies = places.collect();
        for (slot, (info, state)) in points.set.iter().zip(points.states).enumerate() {
            let at = Vec2::from(state.position);
            let known = self.past.points.get(&info.id).cloned();
            // What has no interval behind it has not moved, nor has a point that is new to the set.
            let has_moved = f64::from(u8::from(step.dt_before > 0.0 && known.is_some()));
            let new = || (state.position, vec![0.0; bodies.len()]);
            let (was, mut springs) = known.unwrap_or_else(new);
            let moved = (at - Vec2::from(was)) * has_moved;
            let spun = state.spin * step.dt_before * has_moved;
            for (i, (body, spring)) in bodies.iter().zip(&mut springs).enumerate() {
                let (center, angle) = self.past.bodies.get(i).unwrap_or(&self.next.bodies[i]);
                let shift = (body.center() - Vec2::from(*center)) * has_moved;
                let turn = (body.entry.body.angle - angle) * has_moved;
                let ways = Ways {
                    moved,
                    spun,
                    shift,
                    turn,
                };
                if let Some((contact, slid)) = self.press(body, info.radius, at, &ways, spring) {
                    forces.slid += slid;
                    forces.add(&Contact {
                        slot,
                        body: i,
                        ..contact
                    });
                }
            }
            self.next.points.insert(info.id, (state.position, springs));
        }
    }

    /// The step that was evaluated is done.
    pub fn commit(&mut self) {
        core::mem::swap(&mut self.past, &mut self.next);
    }

    /// What has to survive in a saved state.
    pub fn history(&self) -> &History {
        &self.past
    }

    /// Goes on with the history of a saved state, which is of so many bodies.
    ///
    /// # Errors
    /// A [`Refusal`]: it is of others.
    pub fn restore(&mut self, history: History, bodies: usize) -> Result<(), Refusal> {
        let springs = history.points.values().map(|(_, springs)| springs.len());
        let of_others = [0, bodies].iter().all(|&n| history.bodies.len() != n);
        if of_others || springs.into_iter().any(|n| n != bodies) {
            return Err(Refusal::new("restore", "springs of other bodies"));
        }
        self.past = history;
        Ok(())
    }

    /// Contact of a point of `radius` at `at`, with its tangential `spring` (all in m; section 7), and the energy that has
    /// slid away (J/m). `None` if the point is out of reach (F-6).
    fn press(
        &self,
        body: &Body,
        radius: f64,
        at: Vec2,
        ways: &Ways,
        spring: &mut f64,
    ) -> Option<(Contact, f64)> {
        let before = core::mem::take(spring);
        let seen = see(&body.placed, 0..body.placed.len(), at);
        let overlap = body.radius + radius - seen.distance;
        if overlap <= -0.5 * radius {
            return None;
        }
        let normal = seen.normal;
        let tangent = Vec2::new(-normal.y, normal.x);
        let p = contact_point(at, radius, overlap, normal);
        let arm = p - body.center();
        let of_body = ways.shift + arm - turned(arm, -ways.turn);
        // The surface of the point lies at `-(r_p - xi/2) N`, so its spin moves it against the tangent.
        let of_spin = (radius - 0.5 * overlap) * ways.spun;
        let slid = (ways.moved - of_body).dot(&tangent) - of_spin;
        // In a contact that has opened, the limit of friction shortens the spring to zero.
        let depth = overlap.max(0.0);
        let pressing = self.normal * depth;
        if self.tangential > 0.0 {
            let longest = self.friction * pressing / self.tangential;
            *spring = (before + slid).clamp(-longest, longest);
        }
        let contact = Contact {
            at: p,
            force: normal * pressing - tangent * (self.tangential * *spring),
            stiffness: self.normal,
            normal: Some(normal),
            tangential: self.tangential,
            stored: Some(0.5 * (pressing * depth + self.tangential * *spring * *spring)),
            ..Contact::default()
        };
        let loss = 0.5 * self.tangential * (*spring + before) * (slid - (*spring - before));
        Some((contact, loss))
    }
}

#[cfg(test)]
mod tests;
