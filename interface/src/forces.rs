//! What passes between a bodies' side and its driver in a step: the points come in, forces go out.

use crate::Vec2;
use crate::message::wire::{BodyState, ImpForce, ImpInfo, ImpState};

/// The identified points (IMPs) of a step, slot by slot.
#[derive(Debug, Clone, Copy, Default)]
pub struct Points<'a> {
    /// What stays until the next set: id, contact radius, mass, group.
    pub set: &'a [ImpInfo],
    /// Positions at `t_n`, velocities at `t_{n-1/2}`.
    pub states: &'a [ImpState],
}

/// A contact of a point with a body, at `t_n`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Contact {
    /// The point's slot.
    pub slot: usize,
    /// The body's index in the configuration.
    pub body: usize,
    /// Where it is, in m.
    pub at: Vec2,
    /// Force on the point in N/m; the body gets the negative (F-7).
    pub force: Vec2,
    /// Normal stiffness in N/m. It counts from an overlap of `-r_p/2` on, where there is no force yet (F-6).
    pub stiffness: f64,
    /// Unit normal. With it the bound of L-2 is exact; without it, one for any normal.
    pub normal: Option<Vec2>,
    /// Tangential stiffness in N/m; needs the normal. Its spring goes the way of the surface of the point, which turns with
    /// [`ImpState::spin`].
    pub tangential: f64,
    /// Energy in its springs in J/m; `None`: that of a linear spring with this force.
    pub stored: Option<f64>,
}

/// What the points do to a body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// In N/m.
    pub force: Vec2,
    /// About the centre of mass, in N.
    pub torque: f64,
    /// Points that press.
    pub contacts: u64,
    /// `sum k (1/m + (r x n)^2/I)` of the contacts in reach in 1/s^2 (L-2), and without `k` in 1/kg.
    pub rate: f64,
    /// See `rate`.
    pub mobility: f64,
    /// Centre of mass in m.
    center: Vec2,
    /// 1/m and 1/I; 0 where forces do not move the body.
    inverse: [f64; 2],
}

impl Load {
    /// No load on a body that forces move as `yielding` says ([`Motion::yielding`](crate::config::Motion::yielding)).
    pub fn none(body: &BodyState, [x, y, angle]: [f64; 3]) -> Self {
        Self {
            center: body.position.into(),
            inverse: [x.max(y) / body.mass, angle / body.inertia],
            ..Self::default()
        }
    }
}

/// The forces of a step, zero when the solver gets them.
#[derive(Debug, Clone, Default)]
pub struct Forces {
    /// Where the points are, in m.
    places: Vec<Vec2>,
    on_points: Vec<ImpForce>,
    on_bodies: Vec<Load>,
    /// Energy in springs at `t_n` in J/m.
    pub stored: f64,
    /// Dissipated by friction over the last step in J/m.
    pub slid: f64,
    /// Dissipated by dashpots over the last step in J/m.
    pub damped: f64,
}

impl Forces {
    /// None yet, on points in these states and on bodies with these loads.
    pub fn clear(&mut self, points: &[ImpState], loads: impl IntoIterator<Item = Load>) {
        self.places.clear();
        self.places
            .extend(points.iter().map(|point| Vec2::from(point.position)));
        // Forces must not accumulate from one step to the next (F-8).
        self.on_points.clear();
        self.on_points.resize(points.len(), ImpForce::default());
        self.on_bodies.clear();
        self.on_bodies.extend(loads);
        (self.stored, self.slid, self.damped) = (0.0, 0.0, 0.0);
    }

    /// Adds a contact to the force on its point and to the load on its body.
    ///
    /// # Panics
    /// If there is no such slot or body.
    pub fn add(&mut self, contact: &Contact) {
        let Contact {
            force, stiffness, ..
        } = *contact;
        let point = &mut self.on_points[contact.slot];
        point.force[0] += force.x;
        point.force[1] += force.y;
        point.stiffness += stiffness;
        point.tangential += contact.tangential;
        if point.tangential > 0.0 {
            point.couple += (contact.at - self.places[contact.slot]).perp(&force);
        }
        let load = &mut self.on_bodies[contact.body];
        let arm = contact.at - load.center;
        let pushes = force != Vec2::zeros();
        let of_a_spring = || {
            if pushes {
                force.norm_squared() / (2.0 * stiffness)
            } else {
                0.0
            }
        };
        let stored = contact.stored.unwrap_or_else(of_a_spring);
        load.force -= force;
        load.torque -= arm.perp(&force);
        // A dashpot may hold a spring without a force.
        load.contacts += u64::from(pushes || stored > 0.0);
        self.stored += stored;
        let [inverse_mass, inverse_inertia] = load.inverse;
        let across = |n: Vec2| arm.perp(&n).powi(2);
        let lever = contact.normal.map_or(arm.norm_squared(), across);
        let mobility = inverse_mass + inverse_inertia * lever;
        load.rate += stiffness * mobility;
        load.mobility += if stiffness > 0.0 { mobility } else { 0.0 };
        if let Some(n) = contact.normal {
            let tangent = Vec2::new(-n.y, n.x);
            load.rate += contact.tangential * (inverse_mass + inverse_inertia * across(tangent));
        }
    }

    /// On the points, slot by slot.
    pub fn on_points(&self) -> &[ImpForce] {
        &self.on_points
    }

    /// The same, for a solver that sums them itself.
    pub fn on_points_mut(&mut self) -> &mut [ImpForce] {
        &mut self.on_points
    }

    /// On the bodies that [`DemSolver::bodies`](crate::solver::DemSolver::bodies) gives, in their order.
    pub fn on_bodies(&self) -> &[Load] {
        &self.on_bodies
    }
}
