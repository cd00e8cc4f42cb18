//! The rigid-body solver's part of a scene.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactLaw, Interface, polygon};
use crate::surfaces::ContactPair;
use nalgebra::Vector2;

/// The configuration of the bodies' solver. SI units, per metre of thickness. Every field is present.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DemConfig {
    /// Acceleration of gravity in m/s^2.
    pub gravity: [f64; 2],
    /// Bodies; their index identifies them in messages.
    #[serde(rename = "body")]
    pub bodies: Vec<BodyConfig>,
    /// Law between points and bodies; `linear` without stiffness if there are no points.
    #[serde(rename = "contact")]
    pub point_contact: ContactLaw,
    /// Law between bodies; null: bodies do not touch one another.
    pub body_contact: Option<ContactLaw>,
    /// How the overlap of two bodies is measured.
    pub overlap: OverlapMeasure,
    /// Laws between two surfaces, in place of `contact` and `body_contact`.
    #[serde(rename = "contact_pair")]
    pub contact_pairs: Vec<ContactPair>,
    /// Surface of each point group, in the order of the groups: the name of its material.
    pub point_surfaces: Vec<String>,
    /// Laws between the points of two groups (Chen 2023; capability `pairs`). There may be no bodies then.
    #[serde(rename = "group_pair")]
    pub group_pairs: Vec<GroupPair>,
    /// How finely impacts are resolved: `omega dt` of a contact between bodies that opens or closes is at most this
    /// times the coupler's safety factor, and that of a contact of points [`RESOLUTION_OF_POINTS`] times as much. Above 0
    /// and at most 2, which is the limit of stability (capability `feature:contact_resolution`). Null: as the solver
    /// chooses; the built-in one takes 0.04, and 0.2 where every contact has a damping ratio of 0.01 or more.
    pub contact_resolution: Option<f64>,
    /// What the bodies are in contact with.
    pub interface: Interface,
    /// Verlet skin `V_d` in m beyond contact distance, for lists of the solver's own.
    pub skin: f64,
    /// Most threads to use, 1 or more; fewer are allowed.
    pub threads: usize,
}

/// [`DemConfig::resolutions`] if a contact between bodies is elastic: a thousand impacts conserve the energy within 1 %.
pub const ELASTIC_RESOLUTION: f64 = 0.04;

/// [`DemConfig::resolutions`] if all contacts are damped: the energy of an impact is dissipated within a few bounces,
/// and the errors of these few stay within 1 %.
pub const DAMPED_RESOLUTION: f64 = 0.2;

/// Fraction of critical damping from which a contact counts as damped: it loses 6 % of the energy in an impact.
const DAMPED: f64 = 0.01;

/// How much coarser contacts of points are resolved: an impact of a point has less than a 300th of the energy in play, an
/// impact of a body may have all of it (docs/stability.md).
pub const RESOLUTION_OF_POINTS: f64 = 25.0;

impl DemConfig {
    /// The largest `omega dt` of an impact between bodies and of one of points, without the safety factor: from the value
    /// of the scene, else from one that depends on the damping of the contacts (docs/stability.md).
    pub fn resolutions(&self) -> [f64; 2] {
        let damped = |law: ContactLaw| law.damping_ratio() >= DAMPED;
        let of = |damped: bool| {
            let default = if damped {
                DAMPED_RESOLUTION
            } else {
                ELASTIC_RESOLUTION
            };
            self.contact_resolution.unwrap_or(default)
        };
        let of_pairs = self.group_pairs.iter().map(|pair| pair.law);
        let of_points = of(self.point_laws().chain(of_pairs).all(damped));
        [
            of(self.body_laws().all(damped)),
            (RESOLUTION_OF_POINTS * of_points).min(2.0),
        ]
    }
}

/// Contact between the points of two groups, which are circles of their contact radius.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroupPair<Group = usize> {
    /// The two groups, in either order: their indices, in a scene their names.
    pub between: [Group; 2],
    /// Law between their points.
    pub law: ContactLaw,
}

/// How the overlap of two bodies is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OverlapMeasure {
    /// The sum of the depths of every vertex at every edge, both ways (Jiang 2020 eq. 39).
    #[default]
    EachEdge,
    /// The depth of every vertex at the nearest edge of the other body, both ways; for convex bodies.
    NearestEdge,
    /// The common area of two convex polygons without sphero-radius, divided by a length (Chen 2023; Feng and Owen
    /// 2004).
    Area,
}

/// A spheropolygon body.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyConfig {
    /// Name, by which quantities refer to the body.
    pub name: String,
    /// The polygon, in the body's own coordinates.
    pub shape: BodyShape,
    /// Radius `a` of the disc swept along the polygon in m; 0 by default: a polygon with sharp corners.
    #[serde(default)]
    pub sphero_radius: f64,
    /// Mass or density; also of a fixed or driven body, on whose motion it has no effect. Of a convex outline the swept
    /// area is the polygon, a strip of the sphero-radius along each edge and a sector at each corner.
    #[serde(default)]
    pub inertia: BodyInertia,
    /// Where the origin of the body's coordinates is placed, in m. It need not be the centre of mass.
    #[serde(default)]
    pub position: [f64; 2],
    /// Initial angle in rad, about that origin.
    #[serde(default)]
    pub angle: f64,
    /// Initial velocity of the centre of mass in m/s; at rest by default.
    #[serde(default)]
    pub velocity: [f64; 2],
    /// Initial angular velocity in rad/s.
    #[serde(default)]
    pub spin: f64,
    /// How it moves; free by default.
    #[serde(default)]
    pub motion: Motion,
    /// Name of its surface, by which `[[contact_pair]]` refers to it; none by default.
    #[serde(default)]
    pub surface: String,
}

/// The polygon of a spheropolygon, in the body's own coordinates (m).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum BodyShape {
    /// The origin alone: with the sphero-radius a disc.
    #[default]
    Disc,
    /// A rounded segment.
    Segment {
        /// Its two ends in m.
        ends: [[f64; 2]; 2],
    },
    /// A simple polygon, convex or not.
    Polygon {
        /// Vertices in m, in either sense.
        vertices: Vec<[f64; 2]>,
    },
    /// A rectangle about the origin; the swept shape is larger by the sphero-radius on every side.
    Rectangle {
        /// Width in m.
        width: f64,
        /// Height in m.
        height: f64,
    },
    /// A rigid cluster of discs (Singer 2022).
    Cluster {
        /// Their centres in m, all different.
        centers: Vec<[f64; 2]>,
        /// Their radii in m, one for each; where it is left out, all have the sphero-radius.
        #[serde(default)]
        radii: Vec<f64>,
    },
}

impl BodyShape {
    /// Vertices in body coordinates in m: one for a disc, two for a segment, the centres of a cluster, else the polygon
    /// as written.
    pub fn vertices(&self) -> Vec<[f64; 2]> {
        match self {
            Self::Disc => vec![[0.0, 0.0]],
            Self::Segment { ends } => ends.to_vec(),
            Self::Polygon { vertices } => vertices.clone(),
            Self::Cluster { centers, .. } => centers.clone(),
            Self::Rectangle { width, height } => {
                let (x, y) = (0.5 * width, 0.5 * height);
                vec![[-x, -y], [x, -y], [x, y], [-x, y]]
            }
        }
    }

    /// The same, of an outline counter-clockwise; the discs of a cluster keep their order, which is that of their radii.
    pub fn counter_clockwise(&self) -> Vec<[f64; 2]> {
        match self {
            Self::Cluster { .. } => self.vertices(),
            _ => polygon::counter_clockwise(self.vertices()),
        }
    }
}

impl BodyConfig {
    /// Radius in m of the disc around vertex `k` of its shape.
    pub fn radius_at(&self, k: usize) -> f64 {
        match &self.shape {
            BodyShape::Cluster { radii, .. } => radii.get(k).copied(),
            _ => None,
        }
        .unwrap_or(self.sphero_radius)
    }

    /// The vertices of its shape where it is placed, in m.
    pub fn placed(&self) -> Vec<[f64; 2]> {
        let ((sin, cos), [px, py]) = (self.angle.sin_cos(), self.position);
        let place = |[x, y]: [f64; 2]| [px + cos * x - sin * y, py + sin * x + cos * y];
        self.shape.vertices().into_iter().map(place).collect()
    }
}

/// Mass or density of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum BodyInertia {
    /// Density in kg/m^3 over the swept area.
    Density(f64),
    /// Mass in kg/m, spread evenly over the swept area.
    Mass(f64),
}

impl Default for BodyInertia {
    /// 1 kg/m.
    fn default() -> Self {
        Self::Mass(1.0)
    }
}

/// How a body moves.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Motion {
    /// Free: forces move it.
    #[default]
    Free,
    /// It does not move.
    Fixed,
    /// It keeps its initial velocity and spin, under any load.
    Driven,
    /// Forces move it, except in the held directions.
    Guided {
        /// Held along x.
        #[serde(default)]
        hold_x: bool,
        /// Held along y.
        #[serde(default)]
        hold_y: bool,
        /// Held against rotation.
        #[serde(default)]
        hold_angle: bool,
    },
    /// Forces move it, and so does an external force at the centre of mass.
    Pushed {
        /// In N/m.
        force: [f64; 2],
        /// In N.
        #[serde(default)]
        torque: f64,
        /// Time in s over which the force grows evenly from zero to its full value; 0: full from the start.
        #[serde(default)]
        ramp: f64,
        /// Time in s at which the force ends; by default it does not end.
        #[serde(default)]
        until: Option<f64>,
    },
}

impl Motion {
    /// 1 along x, along y and for the angle where forces move the body, 0 where they do not.
    #[inline] // as `push`
    pub fn yielding(&self) -> [f64; 3] {
        match *self {
            Self::Free | Self::Pushed { .. } => [1.0; 3],
            Self::Fixed | Self::Driven => [0.0; 3],
            Self::Guided {
                hold_x,
                hold_y,
                hold_angle,
            } => [hold_x, hold_y, hold_angle].map(|held| if held { 0.0 } else { 1.0 }),
        }
    }

    /// External force (N/m) and torque (N), as their means over the `span` of a kick in s.
    // Called in every step: so it is compiled where it is called, with optimisation.
    #[inline]
    pub fn push(&self, span: [f64; 2]) -> (Vector2<f64>, f64) {
        let (force, torque, ramp, until) = match *self {
            Self::Pushed {
                force,
                torque,
                ramp,
                until,
            } => (force, torque, ramp, until.unwrap_or(f64::INFINITY)),
            _ => return (Vector2::zeros(), 0.0),
        };
        let (from, to) = (span[0].max(0.0), span[1]);
        let share = if from >= ramp && to <= until {
            1.0
        } else if from >= until || to <= from {
            0.0
        } else {
            // It grows up to the knee, then it is full up to the end.
            let end = to.min(until);
            let knee = end.min(ramp).max(from);
            let grown = if knee > from {
                (knee - from) * 0.5 * (from + knee) / ramp
            } else {
                0.0
            };
            (grown + (end - knee)) / (to - from)
        };
        (Vector2::from(force) * share, torque * share)
    }
}
