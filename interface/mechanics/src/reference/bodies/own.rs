//! A solver with friction of its own: what PROTOCOL.md admits of its answers to a step, and the step that it takes by them.

use std::collections::BTreeMap;

use interface::Vec2;
use interface::message::wire::{BodyState, ImpForce, ImpInfo, ImpState, Ledger};
use interface::step::Step;

use super::{Expected, Oracle, Touch, Who};
use crate::mass::cross;

/// Most that friction can be, and what it is, if that is known, in N/m.
type Rub = (f64, Option<Vec2>);

/// What friction has done so far.
#[derive(Debug, Clone, Default)]
pub struct Rubbed {
    /// In the last step.
    last: BTreeMap<Who, Rub>,
    /// Most work that it can have done in J/m, and how much that work is off by the rule of section 9, which takes the mean of
    /// the forces of two steps.
    most: f64,
    off: f64,
}

impl Rubbed {
    /// Contacts slide by ways (m).
    fn slide(&mut self, now: &[(Who, f64, Rub)]) {
        let last = std::mem::take(&mut self.last);
        for (who, way, (limit, force)) in now {
            let (was, before) = last.get(who).copied().unwrap_or((0.0, Some(Vec2::zeros())));
            let most = 0.5 * (limit + was) * way;
            let change = force.zip(before).map(|(now, before)| (now - before).norm());
            self.most += most;
            self.off += change.map_or(most, |change| 0.5 * change * way);
            self.last.insert(*who, (*limit, *force));
        }
    }
}

/// What a solver has reported of a step: of its points and bodies, and of the energies.
#[derive(Debug, Clone, Copy)]
pub struct Reported<'a> {
    /// Point by point.
    pub forces: &'a [ImpForce],
    /// Body by body.
    pub bodies: &'a [BodyState],
    /// As measured.
    pub ledger: &'a Ledger,
}

impl Oracle {
    /// Takes a measured step, of which `law` is what the law asks for, with what was `reported` of it where that is admitted, else
    /// with what is and is nearest: of a point on one body what is not the law's normal force is at most Coulomb's friction;
    /// forces on bodies and points are opposite; friction stores and takes no more than it works, and gives nothing.
    pub fn admit(
        &mut self,
        step: &Step,
        (set, states): (&[ImpInfo], &[ImpState]),
        (law, reported): (&Expected, Reported),
        rubbed: &mut Rubbed,
    ) -> Expected {
        let mut points = law.points.clone();
        let of_point = |touch: &'_ Touch| match touch.who {
            Who::Point(id, b, _) => Some((*touch, b, set.iter().position(|info| info.id == id)?)),
            _ => None,
        };
        let of_points: Vec<(Touch, usize, usize)> =
            law.touches.iter().filter_map(of_point).collect();
        let is_alone = |slot: usize| of_points.iter().filter(|(.., s)| *s == slot).count() == 1;
        let on_body = |body: &BodyState| Vec2::from(body.point_force).push(body.point_torque);
        let mut loads: Vec<_> = reported.bodies.iter().map(on_body).collect();
        let is_shared = |b: usize| of_points.iter().any(|(_, c, s)| *c == b && !is_alone(*s));
        let own: Vec<usize> = (0..loads.len()).filter(|b| !is_shared(*b)).collect();
        for b in &own {
            loads[*b] *= 0.0;
        }
        let mut slides = Vec::new();
        for (touch, b, slot) in &of_points {
            let (point, x) = (&mut points[*slot], Vec2::from(states[*slot].position));
            let (got, normal) = (reported.forces[*slot], touch.normal);
            let mut friction = None;
            (point.force, point.couple) = (got.force.into(), got.couple);
            if is_alone(*slot) {
                let pressing = normal * touch.force.dot(&normal);
                let rubs = (point.force - pressing).cap_magnitude(touch.limit);
                point.force = pressing + rubs;
                point.couple = cross(touch.at - x, point.force);
                friction = Some(rubs);
            }
            let arm = x - self.bodies[*b].pose.xy();
            if own.contains(b) {
                loads[*b] -= point.force.push(cross(arm, point.force) + point.couple);
            }
            slides.push((touch.who, touch.moved, (touch.limit, friction)));
        }
        self.given = Some(loads);
        let parted = law.parted.iter();
        slides.extend(parted.map(|(who, way)| (*who, *way, (0.0, Some(Vec2::zeros())))));
        rubbed.slide(&slides);
        let mut expected = self.step(step, set, states);
        let held: f64 = expected.touches.iter().map(|touch| touch.held).sum();
        let (want, Rubbed { most, off, .. }) = (&mut expected.ledger, rubbed);
        let stored = (reported.ledger.contact - (want.contact - held)).clamp(0.0, *most);
        want.contact += stored - held;
        want.friction_work = reported
            .ledger
            .friction_work
            .clamp(-*off, *most + *off - stored);
        expected.points = points;
        expected
    }
}
