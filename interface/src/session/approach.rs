//! Rules of the continuum's side for points that do not touch yet: when the IMP set is too old (I-6), and the largest
//! speed of a point that is not an IMP yet (L-2).

use crate::config::MpmConfig;
use crate::message::wire::{Limits, PointState};

/// The skin rule and the kinematic limit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Approach {
    /// Travel of points and surfaces together at which a new set is chosen, in m. It is the skin less half the largest
    /// radius, so that whatever may begin to touch within a step is in the set, and in the step limit, before it does.
    allowed_travel: f64,
    /// Whether points touch points. Both points of a pair may then approach, so the fastest speed counts twice.
    among_points: bool,
    /// Smallest contact radius of any group in m; 0 without groups.
    radius_min: f64,
    /// Speed of the fastest point of all in m/s.
    pub(crate) fastest: f64,
    /// Travel of the points since the last selection in m.
    pub(crate) points: f64,
    /// Travel of the bodies' surfaces since their envelopes were published, in m.
    pub(crate) bodies: f64,
}

impl Approach {
    /// By a configuration.
    pub(crate) fn new(config: &MpmConfig) -> Self {
        let radii = config.groups.iter().map(|group| group.radius(config.cell));
        Self {
            among_points: !config.group_pairs.is_empty(),
            allowed_travel: config.skin - 0.5 * radii.clone().fold(0.0, f64::max),
            radius_min: radii.reduce(f64::min).unwrap_or(0.0),
            ..Self::default()
        }
    }

    /// I-6: whether the set may lack a point that could touch within the step.
    pub(crate) fn set_is_old(&self) -> bool {
        let others = if self.among_points {
            self.bodies.max(self.points)
        } else {
            self.bodies
        };
        self.points + others > self.allowed_travel
    }

    /// A new set has been chosen, so travels count from now.
    pub(crate) fn selected(&mut self) {
        self.points = 0.0;
        self.bodies = 0.0;
    }

    /// Takes the travel (m) of the points after a step. Returns the solver's limits with what the kinematic limit needs
    /// before there is an IMP. Since any point may become one, it needs the speed of the fastest point, bounded by the
    /// travel, and the smallest radius. An infinite travel asks for a new set and bounds no speed.
    pub(crate) fn moved(&mut self, limits: Limits, travel: f64, dt: f64) -> Limits {
        let travelled = travel - self.points;
        self.points = travel;
        if dt > 0.0 && travelled.is_finite() {
            self.fastest = travelled / dt;
        }
        let approaching = if self.among_points { 2.0 } else { 1.0 };
        Limits {
            speed: approaching * limits.speed.max(self.fastest),
            radius_min: self.radius_min,
            ..limits
        }
    }
}

/// Speed of the fastest of `points` in m/s.
pub(crate) fn fastest(points: &[PointState]) -> f64 {
    let speeds = points.iter().map(|p| p.velocity[0].hypot(p.velocity[1]));
    speeds.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Fill, GroupConfig, MpmConfig, Scheme, Spacing};

    fn approach(contact_radius: Option<f64>, group_pairs: &[[usize; 2]]) -> Approach {
        let nowhere = Fill::Points { positions: vec![] };
        let group = GroupConfig {
            contact_radius,
            ..GroupConfig::at_rest("a", nowhere, Spacing::PerCell(4))
        };
        Approach::new(&MpmConfig {
            scheme: Scheme {
                cell: 0.1,
                ..Scheme::default()
            },
            groups: vec![group.clone(), group],
            group_pairs: group_pairs.to_vec(),
            skin: 0.5,
            ..MpmConfig::default()
        })
    }

    /// Both points of a pair may approach. So the set is old after half the travel, and contact closes at twice the
    /// speed of the fastest point.
    #[test]
    fn two_points_come_nearer_twice_as_fast_as_one() {
        for (pairs, factor) in [(&[][..], 1.0), (&[[0, 1]], 2.0)] {
            let mut approach = approach(Some(0.2), pairs);
            let limits = approach.moved(Limits::default(), 0.19, 0.1);
            assert!((limits.speed - factor * 1.9).abs() < 1e-12);
            assert!(!approach.set_is_old()); // 0.19 or 0.38 of 0.5 - 0.1
            approach.moved(Limits::default(), 0.21, 0.1);
            assert_eq!(approach.set_is_old(), factor > 1.0);
            approach.bodies = 0.2;
            assert!(approach.set_is_old());
        }
    }

    /// Points are 0.05 m apart.
    #[test]
    fn a_radius_that_is_left_to_the_solver_is_half_the_distance_of_points() {
        let mut approach = approach(None, &[]);
        assert_eq!(
            approach.moved(Limits::default(), 0.48, 0.1).radius_min,
            0.025
        );
        assert!(!approach.set_is_old()); // 0.48 of 0.5 - 0.0125
        approach.moved(Limits::default(), 0.49, 0.1);
        assert!(approach.set_is_old());
    }
}
