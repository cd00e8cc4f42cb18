//! The continuum solver's part of a scene.

use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Interface, MaterialConfig};

/// Grid and scheme: the keys of `[mpm]` that the solver receives as they stand in the scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Scheme {
    /// Grid spacing L in m.
    pub cell: f64,
    /// Lower left and upper right corner of the grid in m, a whole number of cells apart. Points may leave it only
    /// through periodic walls.
    pub domain: [[f64; 2]; 2],
    /// Shape function.
    pub shape: ShapeFunction,
    /// Transfer of velocities between grid and points.
    pub transfer: Transfer,
    /// When stresses are updated within the step; first by default.
    #[serde(default)]
    pub stress_update: StressUpdate,
    /// Plane strain (default) or plane stress.
    #[serde(default)]
    pub plane: Plane,
    /// Conditions on the four walls of the domain; open by default.
    #[serde(default)]
    pub walls: Walls,
    /// How a contact force reaches the grid; through the shape function at the point by default.
    #[serde(default)]
    pub contact_force: ContactForceScheme,
    /// Contact between the groups of points on the grid (Bardenhagen 2000): each group is a body with its own nodal
    /// velocities. Without it all groups are one continuum.
    pub grid_contact: Option<GridContact>,
    /// Whether each group of points has its own grid layer, so that groups never exchange momentum through the grid
    /// (Chen 2023; capability `layers`); false by default. Groups of `[[group_pair]]` need it. Not with `grid_contact`.
    #[serde(default)]
    pub layers: bool,
    /// What happens to a point that leaves the domain; the run stops by default.
    #[serde(default)]
    pub leaving: Leaving,
    /// What bodies are in contact with: the points, or the segments between the markers of `[[mpm.chain]]`, for discs
    /// and clusters of discs only. With points, chains are ignored.
    #[serde(default)]
    pub interface: Interface,
}

/// The configuration of the continuum's solver. SI units, per metre of thickness. Every field is present.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MpmConfig {
    /// Grid and scheme, whose fields are fields of the configuration.
    #[serde(flatten)]
    pub scheme: Scheme,
    /// Acceleration of gravity in m/s^2.
    pub gravity: [f64; 2],
    /// Materials.
    #[serde(rename = "material")]
    pub materials: Vec<MaterialConfig>,
    /// Groups of points.
    #[serde(rename = "points")]
    pub groups: Vec<GroupConfig>,
    /// Loads on the continuum other than gravity, walls and bodies.
    pub forcing: Forcing,
    /// Named numbers that formulas may use.
    pub constants: BTreeMap<String, f64>,
    /// Pairs of groups, by their indices, whose points touch by a law of the bodies' side: those of its `group_pair`.
    /// Points of such groups that are near one another are IMPs (capability `pairs`). Needs `layers`.
    #[serde(rename = "group_pair")]
    pub group_pairs: Vec<[usize; 2]>,
    /// The chains of markers, one or more for each group, if `interface` is `segments`; empty otherwise.
    #[serde(rename = "chain")]
    pub chains: Vec<Chain>,
    /// Verlet skin `V_d` in m: a point within `reach + r_p + V_d` of a body is an IMP.
    pub skin: f64,
    /// Sets of points whose mean motion is recorded; measured after the groups (capability `feature:probes`).
    #[serde(rename = "probe")]
    pub probes: Vec<Probe>,
    /// Most threads to use, 1 or more; fewer are allowed.
    pub threads: usize,
}

impl Deref for MpmConfig {
    type Target = Scheme;

    fn deref(&self) -> &Scheme {
        &self.scheme
    }
}

impl DerefMut for MpmConfig {
    fn deref_mut(&mut self) -> &mut Scheme {
        &mut self.scheme
    }
}

/// Points of a group whose mean motion is recorded: those that are in a region at the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Name, by which quantities refer to the points.
    pub name: String,
    /// Name of the group of points.
    pub points: String,
    /// Lower left and upper right corner of the region in m.
    pub within: [[f64; 2]; 2],
}

/// A chain of markers along the boundary of a group (Singer 2022). Markers have no mass and move with the nodes. Bodies
/// are in contact with the segments between them: a segment goes from each marker to the next and has the material on
/// its left.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Chain {
    /// Index of the group whose contact radius and density are those of the markers.
    #[serde(rename = "points")]
    pub group: usize,
    /// Initial positions of the markers in m; at least two, or three for a closed chain.
    pub markers: Vec<[f64; 2]>,
    /// Whether a segment goes from the last marker to the first.
    pub closed: bool,
    /// `eta`: a node with less than this share of the mass of a full cell has a smaller weight for markers, in
    /// proportion to its mass. Above 0, at most 1.
    pub floor: f64,
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

/// Contact between groups of points on the grid (Bardenhagen 2000): each group is a body with its own nodal velocities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridContact {
    /// Coefficient of Coulomb friction between groups.
    pub friction: f64,
}

/// Loads on the continuum other than gravity, walls and bodies.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Forcing {
    /// Acceleration in m/s^2 besides gravity: formulas in a point's initial position `x`, `y` (m) and the time `t` (s).
    pub body_force: Option<[String; 2]>,
    /// Dead loads.
    #[serde(rename = "traction")]
    pub tractions: Vec<Traction>,
    /// Points that are held (capability `feature:holds`).
    #[serde(rename = "hold")]
    pub holds: Vec<Hold>,
    /// Stages with their own damping and transfer, in order of their start.
    #[serde(rename = "stage")]
    pub stages: Vec<Stage>,
}

/// A dead load on the points of a group that are in a region at the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Traction {
    /// Name of the group of points.
    pub points: String,
    /// Lower left and upper right corner of the region in m.
    pub within: [[f64; 2]; 2],
    /// Total force in N/m, spread evenly over the points in the region.
    pub force: [f64; 2],
}

/// Held points of a group: those that are in a region at the start. They start at rest in the held directions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hold {
    /// Name, by which quantities refer to the support.
    pub name: String,
    /// Name of the group of points.
    pub points: String,
    /// Lower left and upper right corner of the region in m.
    pub within: [[f64; 2]; 2],
    /// Whether the points keep their x.
    #[serde(default)]
    pub hold_x: bool,
    /// Whether the points keep their y.
    #[serde(default)]
    pub hold_y: bool,
}

/// A stage of loading, until the next one begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Start of the stage in s.
    pub from: f64,
    /// Mass-proportional damping of the nodal velocities in 1/s.
    #[serde(default)]
    pub damping: f64,
    /// Share of PIC in the transfer; needs `transfer = flip` or `blend`.
    #[serde(default)]
    pub pic_fraction: Option<f64>,
}

/// What happens to a point that leaves the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Leaving {
    /// The run stops and names the point.
    #[default]
    Stop,
    /// The point is removed and counted. Its momentum is booked as applied impulse, its energy as driven work.
    Remove,
}

/// Shape function of the grid (Jiang 2020 appendix; docs/physics.md section 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeFunction {
    /// Linear hat functions (the original MPM).
    #[default]
    Linear,
    /// Uniform generalised interpolation: linear hats averaged over a box of half width `l_p` that does not deform.
    Ugimp,
    /// Quadratic B-spline.
    QuadraticBspline,
    /// Cubic B-spline.
    CubicBspline,
}

/// Transfer of velocities between grid and points.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Transfer {
    /// Particle in cell (Jiang 2020 eq. 26).
    Pic,
    /// Fluid implicit particle (eq. 27).
    #[default]
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
    /// FLIP whose velocities are smoothed by PIC at a rate: the share of PIC in a step of length dt is 1 - exp(-rate
    /// dt), so that the smoothing does not depend on the step.
    FlipPic {
        /// The rate in 1/s; 0 is FLIP.
        pic_rate: f64,
    },
    /// FLIP with the affine field of APIC, smoothed by APIC at a rate, as `flip_pic` is by PIC.
    Aflip {
        /// The rate in 1/s; 0 smooths nothing.
        pic_rate: f64,
    },
    /// FLIP filtered by XPIC of order m at a rate, as `flip_pic` is by PIC.
    FlipXpic {
        /// m, at least 1 (which is PIC).
        order: u32,
        /// The rate in 1/s; 0 is FLIP.
        pic_rate: f64,
    },
}

impl Transfer {
    /// Whether points carry an affine field of velocity, which needs a B-spline.
    pub fn is_affine(&self) -> bool {
        matches!(self, Self::Apic | Self::Aflip { .. })
    }

    /// Whether it filters velocities by several mappings (XPIC).
    pub fn filters(&self) -> bool {
        matches!(self, Self::Xpic { .. } | Self::FlipXpic { .. })
    }
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
    /// Both, each for half of the step (Nairn 2003). The strain before and after `t_n` is computed from velocities of
    /// the same grid, so that the energy of points and nodes balances to second order in the step.
    Usavg,
}

/// The velocity with which points move to their new positions ([`MpmConfig::drift`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drift {
    /// That of the nodes after the kick, `sum_I S_Ip v_I^{n+1/2}`: with `usl`, and with contact on the grid.
    Nodal,
    /// The field that strains the points: the nodal velocities that follow from the points' new velocities. Positions are
    /// then of second order in the step, and contact neither creates nor loses energy in first order (docs/energy.md).
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
    pub left: Wall,
    /// At the largest x.
    pub right: Wall,
    /// At the smallest y.
    pub bottom: Wall,
    /// At the largest y.
    pub top: Wall,
}

impl Walls {
    /// The walls across x and those across y, with their names.
    pub fn by_axis(&self) -> [[(&'static str, Wall); 2]; 2] {
        [
            [("left", self.left), ("right", self.right)],
            [("bottom", self.bottom), ("top", self.top)],
        ]
    }

    /// Whether points go round along x and along y.
    pub fn periodic(&self) -> [bool; 2] {
        [self.left, self.bottom].map(|wall| wall == Wall::Periodic)
    }
}

/// Condition on one wall.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Wall {
    /// No condition; a point that reaches the wall leaves the domain, which stops the run.
    #[default]
    Open,
    /// No velocity.
    Fixed,
    /// No velocity through the wall.
    Slip,
    /// No velocity along the wall, free motion through it: a simple support of a face at the wall.
    Tangential,
    /// No velocity into the wall, Coulomb friction along it.
    Friction {
        /// Coefficient of friction.
        coefficient: f64,
    },
    /// Material that leaves here enters at the opposite wall, which must be periodic too. The change of a point's
    /// potential energy is booked as driven work.
    Periodic,
    /// The velocity of the wall, which moves along itself; its work is booked as driven. The walls across it are
    /// periodic or open.
    Driven {
        /// Velocity of the wall in m/s: along +x at the bottom and at the top, along +y at the left and at the right.
        speed: f64,
    },
}

/// A group of material points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroupConfig {
    /// Name, by which quantities refer to it.
    pub name: String,
    /// Index of its material.
    pub material: usize,
    /// Region filled with points.
    pub fill: Fill,
    /// Spacing of the points.
    pub spacing: Spacing,
    /// Orientation of the lattice of points.
    pub lattice: Lattice,
    /// Initial velocity in m/s.
    pub velocity: [f64; 2],
    /// Initial fields that are not uniform.
    pub fields: InitialFields,
    /// Contact radius `r_p` in m; null: half the point spacing.
    pub contact_radius: Option<f64>,
    /// Whether the nodes get the spin w of the group as a linear field, `v_p + w x (x_I - x_p)` in place of `v_p`, so
    /// that rigid rotation causes no strain; with `pic`, `flip` and `blend`, and without periodic walls.
    pub keeps_spin: bool,
}

/// Initial fields as formulas in the position `x`, `y` (m); null: none.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InitialFields {
    /// Velocity in m/s, added to the uniform one.
    pub velocity: Option<[String; 2]>,
    /// Stress `xx`, `yy`, `zz`, `xy` in Pa.
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
    /// A ring: a disc with a round hole.
    Ring {
        /// Centre in m.
        center: [f64; 2],
        /// Outer radius in m.
        radius: f64,
        /// Radius of the hole in m, above 0 and below the outer one.
        inner: f64,
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

/// Orientation of the lattice of a group's points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Lattice {
    /// Along the axes of the grid, for any outline.
    #[default]
    Grid,
    /// Along the outline: rings in a disc, rows along the longest edge of a polygon. The outermost points are then half
    /// a distance inside the outline.
    Outline,
}
