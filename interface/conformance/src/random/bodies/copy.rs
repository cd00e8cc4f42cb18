//! A copy of a run, in which a solver with friction of its own has to say the same.

use interface::Vec2;
use interface::config::{BodyShape, DemConfig, Motion};
use interface::message::wire::{ImpInfo, ImpState};
use serde::{Deserialize, Serialize};

/// An id above all others.
const LAST_ID: u64 = (1 << 20) - 1;

/// How a copy of a run differs from it: mirrored at the x axis, turned about the origin, and shifted.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Copied {
    pub mirrored: bool,
    /// In rad.
    pub turn: f64,
    /// In m.
    pub shift: [f64; 2],
    /// Whether bodies, points and their ids come in the opposite order.
    pub reversed: bool,
    /// Most steps of a window, which have one each in the run.
    pub window: usize,
}

impl Copied {
    pub fn vector(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ((sin, cos), y) = (self.turn.sin_cos(), self.axial(y));
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// An angle, a spin, a moment.
    pub fn axial(&self, x: f64) -> f64 {
        if self.mirrored { -x } else { x }
    }

    fn place(&self, x: [f64; 2]) -> [f64; 2] {
        (Vec2::from(self.vector(x)) + Vec2::from(self.shift)).into()
    }

    pub fn in_order<T>(&self, mut list: Vec<T>) -> Vec<T> {
        if self.reversed {
            list.reverse();
        }
        list
    }

    pub fn config(&self, config: &DemConfig) -> DemConfig {
        let mut bodies = config.bodies.clone();
        for body in &mut bodies {
            body.position = self.place(body.position);
            body.angle = self.axial(body.angle) + self.turn;
            body.velocity = self.vector(body.velocity);
            body.spin = self.axial(body.spin);
            let own = match &mut body.shape {
                BodyShape::Disc | BodyShape::Rectangle { .. } => &mut [][..],
                BodyShape::Segment { ends } => ends,
                BodyShape::Polygon { vertices } => vertices,
                BodyShape::Cluster { centers, .. } => centers,
            };
            for [_, y] in own {
                *y = self.axial(*y);
            }
            if let Motion::Pushed { force, torque, .. } = &mut body.motion {
                (*force, *torque) = (self.vector(*force), self.axial(*torque));
            }
        }
        DemConfig {
            gravity: self.vector(config.gravity),
            bodies: self.in_order(bodies),
            ..config.clone()
        }
    }

    pub fn set(&self, set: &[ImpInfo]) -> Vec<ImpInfo> {
        let mut set = set.to_vec();
        let ids = set.iter_mut().filter(|_| self.reversed);
        ids.for_each(|info| info.id = LAST_ID - info.id);
        self.in_order(set)
    }

    pub fn states(&self, states: &[ImpState]) -> Vec<ImpState> {
        let states = states.iter().map(|state| ImpState {
            position: self.place(state.position),
            velocity: self.vector(state.velocity),
            spin: self.axial(state.spin),
        });
        self.in_order(states.collect())
    }
}
