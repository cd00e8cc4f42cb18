//! A case: a configuration, outlines of bodies, forces on points, and the steps in which that is looked at.

use interface::config::{
    Fill, InitialFields, MpmConfig, ShapeFunction, StressUpdate, Transfer, Walls,
};
use interface::message::wire::{EnvelopeVertex, ImpForce};
use serde::{Deserialize, Serialize};

use super::super::plan::{Course, Epoch};
use crate::bench::outline;

/// A force on a point in some steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Push {
    /// Number of the point, in the order of the configuration.
    pub point: usize,
    /// From this step up to but without that one.
    pub steps: [u32; 2],
    /// In N/m.
    pub force: [f64; 2],
    /// In N.
    pub couple: f64,
    /// In N/m.
    pub stiffness: f64,
    /// In N/m.
    pub tangential: f64,
}

/// The outline of a body: vertices in m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outline {
    /// In m.
    pub vertices: Vec<[f64; 2]>,
    /// In m.
    pub reach: f64,
}

/// A case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// What the solver gets.
    pub config: MpmConfig,
    /// The outlines that it is answered when it asks for them.
    pub bodies: Vec<Outline>,
    /// How far the bodies say that they have moved, in m.
    pub travel: Course,
    /// The forces.
    pub pushes: Vec<Push>,
    /// The steps.
    pub epochs: Vec<Epoch>,
}

impl Case {
    /// The outlines as they are sent.
    pub fn outlines(&self) -> Vec<EnvelopeVertex> {
        let each = (0..).zip(&self.bodies);
        each.flat_map(|(b, body)| outline(b, body.reach, &body.vertices))
            .collect()
    }

    /// The force on a point in a step.
    pub fn push(&self, step: u32, point: usize) -> ImpForce {
        let acts =
            |push: &&Push| push.point == point && (push.steps[0]..push.steps[1]).contains(&step);
        let mut sum = ImpForce::default();
        for push in self.pushes.iter().filter(acts) {
            sum.force = [0, 1].map(|a| sum.force[a] + push.force[a]);
            sum.couple += push.couple;
            sum.stiffness += push.stiffness;
            sum.tangential += push.tangential;
        }
        sum
    }

    /// Leaves out a point of a group that lists its points.
    fn without_point(&mut self, gone: usize) {
        let mut first = 0;
        for (g, group) in self.config.groups.iter_mut().enumerate() {
            let Fill::Points { positions } = &mut group.fill else {
                return;
            };
            if (first..first + positions.len()).contains(&gone) {
                positions.remove(gone - first);
                if positions.is_empty() {
                    self.config.groups.remove(g);
                    self.config.group_pairs.clear();
                }
                break;
            }
            first += positions.len();
        }
        self.pushes.retain(|push| push.point != gone);
        for push in self.pushes.iter_mut().filter(|push| push.point > gone) {
            push.point -= 1;
        }
    }
}

/// Simpler configurations.
const SIMPLER: [fn(&mut Case); 14] = [
    |c| c.travel = Course(Vec::new()),
    |c| c.config.gravity = [0.0; 2],
    |c| c.config.walls = Walls::default(),
    |c| c.config.group_pairs.clear(),
    |c| c.config.layers = false,
    |c| c.config.transfer = Transfer::Flip,
    |c| c.config.shape = ShapeFunction::Linear,
    |c| c.config.stress_update = StressUpdate::Usf,
    |c| c.config.materials.truncate(1),
    |c| c.config.groups.iter_mut().for_each(|g| g.material = 0),
    |c| {
        for group in &mut c.config.groups {
            group.velocity = [0.0; 2];
        }
    },
    |c| {
        for group in &mut c.config.groups {
            group.fields = InitialFields::default();
        }
    },
    |c| {
        for push in &mut c.pushes {
            push.steps = [0, u32::MAX];
        }
    },
    |c| {
        for push in &mut c.pushes {
            (push.couple, push.tangential) = (0.0, 0.0);
        }
    },
];

/// The smaller cases to try for a case, the boldest first.
pub fn smaller(case: &Case) -> Vec<Case> {
    let with = |change: &dyn Fn(&mut Case)| {
        let mut other = case.clone();
        change(&mut other);
        other
    };
    let points = case.config.groups.iter().map(|group| match &group.fill {
        Fill::Points { positions } => positions.len(),
        _ => 0,
    });
    let mut smaller = vec![with(&|c| c.pushes.clear()), with(&|c| c.bodies.clear())];
    smaller.extend((0..case.pushes.len()).map(|k| {
        with(&|c| {
            c.pushes.remove(k);
        })
    }));
    smaller.extend((0..case.bodies.len()).map(|k| {
        with(&|c| {
            c.bodies.remove(k);
        })
    }));
    smaller.extend((0..points.sum()).map(|k| with(&|c| c.without_point(k))));
    smaller.extend(SIMPLER.iter().map(|change| with(change)));
    smaller
}
