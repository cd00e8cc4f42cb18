//! A case: a configuration, outlines of bodies, forces on points, and the steps in which that is looked at.

use interface::Vec2;
use interface::config::{MaterialModel, MpmConfig};
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

impl Outline {
    /// Its vertices and its reach in m.
    pub fn placed(&self) -> (Vec<Vec2>, f64) {
        let vertices = self.vertices.iter();
        (vertices.map(|&v| v.into()).collect(), self.reach)
    }
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

    /// Whether no group begins with a stress that its material may not have, as drawn cases do not.
    pub fn begins_elastic(&self) -> bool {
        self.config.groups.iter().all(|group| {
            let material = self.config.materials.get(group.material);
            match (&group.fields.stress, material.map(|m| m.model)) {
                (Some(_), Some(MaterialModel::NeoHookean(_) | MaterialModel::VonMises { .. })) => {
                    false
                }
                (Some([xx, yy, zz, xy]), Some(model)) if !model.takes_plane_stress() => {
                    xx == yy && yy == zz && xy == "0"
                }
                _ => true,
            }
        })
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
}
