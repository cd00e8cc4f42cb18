//! What the coupler hands each solver in the configure phase: its part of the scene, checked and in SI units.
//!
//! The leaf types (shapes, transfers, material models, outlines, contact laws) are written in scene files exactly as
//! they are here, so they carry the schema too. Travels as JSON inside the configure message, so that a solver in any
//! language can read it.
//!
//! A field with a natural default is left out of the JSON where it has it, and filled in where it is read (PROTOCOL.md
//! clause J-2, [`crate::defaults`]): a field that a later version adds reaches an older solver in those scenes alone
//! that use it, and the solver refuses it by its name.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Vec2;
use crate::defaults::{
    are_zero, is_default, is_one, is_one_thread, is_zero, never, one, one_thread,
};
pub use crate::material::{Frictional, MaterialConfig, MaterialModel};
use crate::surfaces::ContactPair;

/// The continuum solver's part of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MpmConfig {
    /// Lower left and upper right corner of the grid's domain in m. Points may not leave it.
    pub domain: [[f64; 2]; 2],
    /// Grid spacing `L` in m.
    pub cell: f64,
    /// Acceleration of gravity in m/s^2.
    #[serde(default, skip_serializing_if = "are_zero")]
    pub gravity: [f64; 2],
    /// Shape function `S_Ip`.
    pub shape: ShapeFunction,
    /// Transfer of velocities between grid and points.
    pub transfer: Transfer,
    /// When stresses are updated within the step.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stress_update: StressUpdate,
    /// With which velocity points move.
    ///
    /// The default is one constant, that of most schemes, since what a missing field means may not hang on other fields.
    /// With `usl` or contact on the grid `mapped` is refused: a configuration of these says `nodal`, as the coupler does
    /// where the scene leaves the choice to it.
    #[serde(default, skip_serializing_if = "is_default")]
    pub drift: Drift,
    /// Plane strain or plane stress.
    #[serde(default, skip_serializing_if = "is_default")]
    pub plane: Plane,
    /// Conditions on the four walls of the domain.
    #[serde(default, skip_serializing_if = "is_default")]
    pub walls: Walls,
    /// Materials, referred to by index.
    pub materials: Vec<MaterialConfig>,
    /// Groups of points.
    pub groups: Vec<GroupConfig>,
    /// How a contact force reaches the grid.
    #[serde(default, skip_serializing_if = "is_default")]
    pub contact_force: ContactForceScheme,
    /// What acts on the continuum besides gravity, walls and bodies.
    #[serde(default, skip_serializing_if = "is_default")]
    pub forcing: Forcing,
    /// Names that expressions may use besides their variables.
    #[serde(default, skip_serializing_if = "is_default")]
    pub constants: std::collections::BTreeMap<String, f64>,
    /// What happens to a point that leaves the domain.
    #[serde(default, skip_serializing_if = "is_default")]
    pub leaving: Leaving,
    /// Contact between the groups of points on the grid; without it all groups are one continuum.
    #[serde(default, skip_serializing_if = "is_default")]
    pub grid_contact: Option<GridContact>,
    /// Whether each group has a grid layer of its own (Chen 2023; capability `layers`).
    #[serde(default, skip_serializing_if = "is_default")]
    pub layers: bool,
    /// What the bodies meet of the groups.
    #[serde(default, skip_serializing_if = "is_default")]
    pub interface: Interface,
    /// Verlet skin `V_d` in m: a point within `reach + r_p + V_d` of a body is an IMP.
    pub skin: f64,
    /// Threads of the solver.
    #[serde(default = "one_thread", skip_serializing_if = "is_one_thread")]
    pub threads: usize,
}

/// What the bodies meet of the continuum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interface {
    /// Its points, each a disc of its contact radius (Jiang 2020).
    #[default]
    Points,
    /// The segments between the markers of its boundary (Singer 2022; capability `segments`).
    Segments,
}

/// How a contact force reaches the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactForceScheme {
    /// Through the shape function at the point: `f_I = sum_p S_Ip f_p` (Jiang 2020 eq. 47).
    #[default]
    Point,
    /// On the nodes of the cell that the point is in, by linear weights (the MPM-GRID scheme of Jiang 2020
    /// section 5.4).
    NearestNodes,
    /// As a traction spread over the point's own box (Chen 2023).
    Traction,
}

/// Contact between groups of points on the grid (Bardenhagen 2000): each group is a body with nodes of its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridContact {
    /// Coefficient of Coulomb friction between groups.
    pub friction: f64,
}

/// What acts on the continuum besides gravity, walls and bodies. Expressions are those of [`crate::expression`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Forcing {
    /// Acceleration in m/s^2 as expressions in a point's initial position `x`, `y` (m) and the time `t` (s).
    #[serde(default, skip_serializing_if = "is_default")]
    pub body_force: Option<[String; 2]>,
    /// Loads on surfaces.
    #[serde(default, skip_serializing_if = "is_default")]
    pub tractions: Vec<Traction>,
    /// Damping and transfer that change with time, in order of their beginning.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stages: Vec<Stage>,
}

/// A dead load on the points that are in a region at the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Traction {
    /// Index into [`MpmConfig::groups`].
    pub group: usize,
    /// Lower left and upper right corner of the region in m.
    pub within: [[f64; 2]; 2],
    /// Total force in N/m, spread evenly over the points in the region.
    pub force: [f64; 2],
}

/// A stage of loading, until the next one begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// When it begins, in s.
    pub from: f64,
    /// Mass-proportional damping of the nodal velocities in 1/s.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(skip_serializing_if = "never")]
    pub damping: f64,
    /// Share of PIC in the transfer; needs `transfer = flip` or `blend`.
    #[serde(default, skip_serializing_if = "is_default")]
    #[schemars(skip_serializing_if = "never")]
    pub pic_fraction: Option<f64>,
}

/// What happens to a point that leaves the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Leaving {
    /// The run stops with the point's name.
    #[default]
    Stop,
    /// The point is removed and counted; its momentum leaves as an applied impulse, its energy as driven work.
    Remove,
}

/// Shape function of the grid (Jiang 2020 appendix; PHYSICS.md section 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeFunction {
    /// Linear hat functions (the original MPM).
    Linear,
    /// Uniform generalised interpolation: linear hats averaged over a box of half width `l_p` that does not deform.
    Ugimp,
    /// Quadratic B-spline.
    QuadraticBspline,
    /// Cubic B-spline.
    CubicBspline,
}

/// Transfer of velocities between grid and points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Transfer {
    /// Particle in cell (Jiang 2020 eq. 26).
    Pic,
    /// Fluid implicit particle (eq. 27).
    Flip,
    /// `pic_fraction` of PIC and the rest FLIP (eq. 28).
    Blend {
        /// alpha of eq. 28, between 0 (FLIP) and 1 (PIC).
        pic_fraction: f64,
    },
    /// Affine particle in cell (eqs. 29 to 31).
    Apic,
    /// Extended particle in cell of order m (Hammerquist and Nairn 2017).
    Xpic {
        /// m, at least 1 (which is PIC).
        order: u32,
    },
}

/// When stresses are updated within the step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StressUpdate {
    /// Update stress first, from the velocities before the kick.
    #[default]
    Usf,
    /// Update stress last, from the velocities after the kick.
    Usl,
    /// Modified update stress last: velocities are mapped to the grid once more after the kick.
    Musl,
}

/// With which velocity points move to their new places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Drift {
    /// With that of the nodes right after the kick, `sum_I S_Ip v_I^{n+1/2}`, as is usual.
    Nodal,
    /// The same, but points that bodies press on with what the nodes will have of the points' new velocities: contact
    /// then neither creates nor loses energy in first order of the step (docs/energy.md).
    #[default]
    Mapped,
}

/// Plane strain or plane stress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Plane {
    /// No strain out of plane.
    #[default]
    Strain,
    /// No stress out of plane.
    Stress,
}

/// Conditions on the walls of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Walls {
    /// At the smallest x.
    #[serde(skip_serializing_if = "is_default")]
    #[schemars(skip_serializing_if = "never")]
    pub left: Wall,
    /// At the largest x.
    #[serde(skip_serializing_if = "is_default")]
    #[schemars(skip_serializing_if = "never")]
    pub right: Wall,
    /// At the smallest y.
    #[serde(skip_serializing_if = "is_default")]
    #[schemars(skip_serializing_if = "never")]
    pub bottom: Wall,
    /// At the largest y.
    #[serde(skip_serializing_if = "is_default")]
    #[schemars(skip_serializing_if = "never")]
    pub top: Wall,
}

/// Condition on one wall.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Wall {
    /// Nothing is held; a point that comes to the wall leaves the domain, which stops the run.
    #[default]
    Open,
    /// No velocity.
    Fixed,
    /// No velocity through the wall.
    Slip,
    /// No velocity into the wall, Coulomb friction along it.
    Friction {
        /// Coefficient of friction.
        coefficient: f64,
    },
    /// What leaves here enters at the opposite wall, which must be periodic too.
    Periodic,
}

/// A group of material points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroupConfig {
    /// Name, by which quantities refer to it.
    pub name: String,
    /// Index into [`MpmConfig::materials`].
    pub material: usize,
    /// Region filled with points.
    pub fill: Fill,
    /// How densely.
    pub spacing: Spacing,
    /// Initial velocity in m/s.
    #[serde(default, skip_serializing_if = "are_zero")]
    pub velocity: [f64; 2],
    /// Initial fields that are not uniform.
    #[serde(default, skip_serializing_if = "is_default")]
    pub fields: InitialFields,
    /// Contact radius `r_p` in m; half the point spacing where the scene does not say.
    #[serde(default, skip_serializing_if = "is_default")]
    pub contact_radius: Option<f64>,
    /// Whether the points move as one; goes with [`MpmConfig::grid_contact`] alone.
    #[serde(default, skip_serializing_if = "is_default")]
    pub rigid: bool,
}

/// Initial fields as expressions ([`crate::expression`]) in the position `x`, `y` (m).
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InitialFields {
    /// Velocity in m/s, added to the uniform one.
    #[serde(default, skip_serializing_if = "is_default")]
    pub velocity: Option<[String; 2]>,
    /// Stress `xx`, `yy`, `zz`, `xy` in Pa.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stress: Option<[String; 4]>,
}

/// Region filled with points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Fill {
    /// A disc.
    Disc {
        /// Centre in m.
        center: [f64; 2],
        /// Radius in m.
        radius: f64,
    },
    /// An axis-aligned rectangle.
    Rectangle {
        /// Lower left corner in m.
        lower: [f64; 2],
        /// Upper right corner in m.
        upper: [f64; 2],
    },
    /// A simple polygon, convex or not.
    Polygon {
        /// Vertices in m, in either sense.
        vertices: Vec<[f64; 2]>,
    },
    /// Single points, each of the area that `spacing` gives.
    Points {
        /// Positions in m.
        positions: Vec<[f64; 2]>,
    },
}

/// How densely a region is filled. Points lie at the centres of square (or, for `counts`, rectangular) boxes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Spacing {
    /// Points per grid cell: the square of a whole number.
    PerCell(u32),
    /// Distance of neighbouring points in m.
    Distance(f64),
    /// Points along x and y of a rectangle.
    Counts([u32; 2]),
}

/// The rigid-body solver's part of a scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DemConfig {
    /// Acceleration of gravity in m/s^2.
    #[serde(default, skip_serializing_if = "are_zero")]
    pub gravity: [f64; 2],
    /// Bodies; their index is their identity on the wire.
    pub bodies: Vec<BodyConfig>,
    /// Law between points and bodies.
    #[serde(default, skip_serializing_if = "is_default")]
    pub point_contact: ContactLaw,
    /// Law between bodies; `None`: bodies do not touch one another.
    #[serde(default, skip_serializing_if = "is_default")]
    pub body_contact: Option<ContactLaw>,
    /// What the overlap of two bodies is.
    #[serde(default, skip_serializing_if = "is_default")]
    pub overlap: OverlapMeasure,
    /// Laws between surfaces, instead of these two.
    #[serde(default, skip_serializing_if = "is_default")]
    pub contact_pairs: Vec<ContactPair>,
    /// Surface of each point group, in the order of the groups: the name of its material.
    #[serde(default, skip_serializing_if = "is_default")]
    pub point_surfaces: Vec<String>,
    /// Laws between the points of two groups, by their indices (Chen 2023; capability `pairs`).
    #[serde(default, skip_serializing_if = "is_default")]
    pub group_pairs: Vec<GroupPair>,
    /// What the bodies meet of the groups of points.
    #[serde(default, skip_serializing_if = "is_default")]
    pub interface: Interface,
    /// Verlet skin `V_d` in m beyond contact distance.
    pub skin: f64,
    /// Threads of the solver.
    #[serde(default = "one_thread", skip_serializing_if = "is_one_thread")]
    pub threads: usize,
}

/// Contact between the points of two groups.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroupPair {
    /// Indices of the two groups.
    pub between: [usize; 2],
    /// Law between their points.
    pub law: ContactLaw,
}

/// What the overlap of two bodies is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OverlapMeasure {
    /// The depth of every vertex on every edge, both ways, summed (Jiang 2020 eq. 39).
    #[default]
    EachEdge,
    /// The depth of every vertex on the nearest edge of the other body, both ways; for convex bodies.
    NearestEdge,
    /// The area that two convex polygons without sphero-radius have in common, over a length (Chen 2023; Feng and Owen
    /// 2004).
    Area,
}

impl OverlapMeasure {
    /// Its name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::EachEdge => "each_edge",
            Self::NearestEdge => "nearest_edge",
            Self::Area => "area",
        }
    }
}

/// A spheropolygon body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyConfig {
    /// Name, by which quantities refer to it.
    pub name: String,
    /// The polygon, in the body's own coordinates.
    pub shape: BodyShape,
    /// Radius `a` of the disc swept along the polygon in m.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub sphero_radius: f64,
    /// Mass or density.
    pub inertia: BodyInertia,
    /// Where the origin of the body's coordinates is placed, in m.
    pub position: [f64; 2],
    /// Initial angle in rad, about that origin.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub angle: f64,
    /// Initial velocity of the centre of mass in m/s.
    #[serde(default, skip_serializing_if = "are_zero")]
    pub velocity: [f64; 2],
    /// Initial angular velocity in rad/s.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub spin: f64,
    /// How it moves.
    #[serde(default, skip_serializing_if = "is_default")]
    pub motion: Motion,
    /// Name of its surface, by which the table of laws refers to it; empty: none.
    #[serde(default, skip_serializing_if = "is_default")]
    pub surface: String,
}

/// The polygon of a spheropolygon, in the body's own coordinates (m).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum BodyShape {
    /// The origin alone: with the sphero-radius a disc.
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
        #[serde(default, skip_serializing_if = "is_default")]
        #[schemars(skip_serializing_if = "never")]
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

/// How a body moves.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Motion {
    /// By the forces on it.
    #[default]
    Free,
    /// Not at all.
    Fixed,
    /// With its initial velocity and spin, whatever acts on it.
    Driven,
    /// By the forces on it, except in the directions that are held.
    Guided {
        /// Held along x.
        #[serde(default, skip_serializing_if = "is_default")]
        #[schemars(skip_serializing_if = "never")]
        hold_x: bool,
        /// Held along y.
        #[serde(default, skip_serializing_if = "is_default")]
        #[schemars(skip_serializing_if = "never")]
        hold_y: bool,
        /// Held against turning.
        #[serde(default, skip_serializing_if = "is_default")]
        #[schemars(skip_serializing_if = "never")]
        hold_angle: bool,
    },
    /// By the forces on it and one from outside, which acts at the centre of mass.
    Pushed {
        /// In N/m.
        force: [f64; 2],
        /// In N.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        torque: f64,
        /// Time in s over which it grows evenly from zero to its full size; 0: full from the start.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        ramp: f64,
        /// Time in s after which it is gone; it stays for good where there is none.
        #[serde(default, skip_serializing_if = "is_default")]
        until: Option<f64>,
    },
}

impl Motion {
    /// 1 along x, along y and for the angle where forces move the body, 0 where they do not.
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

    /// Force (N/m) and torque (N) from outside at a time (s).
    pub fn push(&self, time: f64) -> (Vec2, f64) {
        match *self {
            Self::Pushed {
                force,
                torque,
                ramp,
                until,
            } if until.is_none_or(|end| time < end) => {
                let share = if time < ramp {
                    (time / ramp).max(0.0)
                } else {
                    1.0
                };
                (Vec2::from(force) * share, torque * share)
            }
            _ => (Vec2::zeros(), 0.0),
        }
    }
}

/// Contact law. Stiffness in N/m per metre of thickness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ContactLaw {
    /// Linear spring (Jiang 2020 eq. 43), Coulomb friction with a tangential spring, optional viscous damping.
    Linear {
        /// k_n in N/m.
        normal_stiffness: f64,
        /// k_t in N/m; needed where there is friction.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        tangential_stiffness: f64,
        /// mu.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        friction: f64,
        /// zeta of the contact, a fraction of critical damping of the pair: 0 elastic. Restitution e is
        /// `zeta = -ln e / sqrt(pi^2 + ln^2 e)`.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        damping_ratio: f64,
    },
    /// Linear spring with adhesion and rolling resistance, both optional.
    Granular {
        /// k_n in N/m.
        normal_stiffness: f64,
        /// k_t in N/m; needed where there is friction.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        tangential_stiffness: f64,
        /// mu.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        friction: f64,
        /// zeta of the contact, as for `linear`.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        damping_ratio: f64,
        /// Pulling stress in Pa over the width `2 sqrt(2 R* xi)` of the contact.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        adhesion: f64,
        /// mu_r: the moment that resists rolling is at most `mu_r R* F_n`. Between bodies only.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        rolling_friction: f64,
    },
    /// Hertz-Mindlin with dashpot (Singer 2022): `F_n = K xi^1.5`, `k_t = k_n 2 (1 - nu) / (2 - nu)`.
    HertzMindlin {
        /// K in N/m^1.5 (per m); for spheres `4/3 E* sqrt(R*)`.
        hertz_constant: f64,
        /// nu, for the tangential stiffness.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        poisson_ratio: f64,
        /// mu.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        friction: f64,
        /// Coefficient of restitution e; 1: elastic.
        #[serde(default = "one", skip_serializing_if = "is_one")]
        #[schemars(skip_serializing_if = "never")]
        restitution: f64,
        /// Pulling stress in Pa over the width `2 sqrt(2 R* xi)` of the contact.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        adhesion: f64,
    },
    /// Force in proportion to the area of the overlap (Chen 2023 eq. 18): `F_n = k_A A`, A the circular segment of
    /// height xi of a disc of the reduced radius.
    Area {
        /// k_A in N/m^2 (per m).
        area_stiffness: f64,
        /// k_t in N/m; needed where there is friction.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        tangential_stiffness: f64,
        /// mu.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        friction: f64,
    },
}

impl Default for ContactLaw {
    /// No stiffness: things pass through one another.
    fn default() -> Self {
        Self::Linear {
            normal_stiffness: 0.0,
            tangential_stiffness: 0.0,
            friction: 0.0,
            damping_ratio: 0.0,
        }
    }
}

impl ContactLaw {
    /// mu.
    pub fn friction(&self) -> f64 {
        match *self {
            Self::Linear { friction, .. }
            | Self::Granular { friction, .. }
            | Self::HertzMindlin { friction, .. }
            | Self::Area { friction, .. } => friction,
        }
    }

    /// Damping as a fraction of critical.
    pub fn damping_ratio(&self) -> f64 {
        match *self {
            Self::Linear { damping_ratio, .. } | Self::Granular { damping_ratio, .. } => {
                damping_ratio
            }
            Self::HertzMindlin { restitution, .. } => ratio_of_restitution(restitution),
            Self::Area { .. } => 0.0,
        }
    }

    /// The larger of normal and tangential stiffness in N/m, where the law has a constant one.
    pub fn constant_stiffness(&self) -> Option<f64> {
        match *self {
            Self::Linear {
                normal_stiffness,
                tangential_stiffness,
                ..
            }
            | Self::Granular {
                normal_stiffness,
                tangential_stiffness,
                ..
            } => Some(normal_stiffness.max(tangential_stiffness)),
            Self::HertzMindlin { .. } | Self::Area { .. } => None,
        }
    }
}

/// Fraction of critical damping of a linear contact with restitution `e`: `-ln e / sqrt(pi^2 + ln^2 e)` (Schwager and
/// Poeschel 2007).
pub fn ratio_of_restitution(e: f64) -> f64 {
    let log = e.ln();
    -log / (PI * PI + log * log).sqrt()
}
