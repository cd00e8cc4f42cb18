//! The scene as written: what TOML may say, key by key. The doc comments are the descriptions in the JSON Schema.

use std::collections::BTreeMap;

use interface::config::friction::FrictionTest;
use interface::config::surfaces::ContactPair;
use interface::config::{
    BodyConfig, ContactLaw, Fill, GroupPair, Hold, Lattice, MaterialConfig, OverlapMeasure, Probe,
    Scheme, Spacing, Stage, Traction,
};
use mechanics::generate::BodyFill;
use schemars::JsonSchema;
use serde::Deserialize;

use super::expectation::Expectation;
use super::{CheckpointPlan, Coupling, TimePlan};
use record::check::{Expected, When};
use record::frames::Field;
use record::frames::vtu::Precision;

/// Version of the scene format that is understood.
pub const VERSION: u32 = 1;

/// A scene of Tandem. SI units throughout, per metre of thickness unless `thickness` says otherwise.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneWritten {
    /// Version of the scene format: 1.
    pub version: u32,
    /// Name of the scene: letters, digits, `_` and `-`.
    pub name: String,
    /// What to look for, in a line or two.
    #[serde(default)]
    pub about: String,
    /// How its run ends: `passes` by default, `fails: WHY` or `stops: WHY`.
    #[serde(default)]
    pub expect: Expectation,
    /// Acceleration of gravity in m/s^2; none by default.
    #[serde(default)]
    pub gravity: [f64; 2],
    /// Thickness of the slice in m: masses, forces, stiffnesses and quantities are those of the slice. Absent: they are
    /// per metre.
    pub thickness: Option<f64>,
    /// Named numbers, or expressions of other constants, for columns, checks and references.
    #[serde(default)]
    pub constants: BTreeMap<String, NumberOrExpression>,
    /// Another run whose state the scene begins with; by default the scene describes its own initial state.
    pub start: Option<StartWritten>,
    /// Duration and step.
    pub time: TimePlan,
    /// The continuum; absent: no MPM process.
    pub mpm: Option<MpmWritten>,
    /// The bodies; absent: no DEM process.
    pub dem: Option<DemWritten>,
    /// Law between points and bodies; required if there are both.
    pub contact: Option<ContactLaw>,
    /// Law between bodies; absent: bodies do not touch one another.
    pub body_contact: Option<ContactLaw>,
    /// Laws between two surfaces, in place of `contact` and `body_contact`.
    #[serde(default)]
    pub contact_pair: Vec<ContactPair>,
    /// Laws between the points of two groups, each on its own grid layer (Chen 2023). The process of the bodies
    /// computes them, even if there is no body.
    #[serde(default)]
    pub group_pair: Vec<GroupPair<String>>,
    /// Programs that replace the built-in solvers.
    #[serde(default)]
    pub solvers: SolversWritten,
    /// The exchange between the processes.
    #[serde(default)]
    pub coupling: Coupling,
    /// What is recorded.
    pub output: OutputWritten,
    /// Conditions that the run must meet.
    #[serde(default)]
    pub check: Vec<CheckWritten>,
    /// Settings of `tandem study`; they do not affect a run.
    pub study: Option<StudyWritten>,
    /// Named sets of overrides: quoted dotted scene keys and their values.
    #[serde(default)]
    #[allow(
        dead_code,
        reason = "removed before parsing; it is here for the schema"
    )]
    pub variant: BTreeMap<String, BTreeMap<String, serde_json::Value>>,
}

/// A number, or an expression in the scene's constants.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum NumberOrExpression {
    /// A number.
    Number(f64),
    /// An expression.
    Expression(String),
}

/// Another run whose state the scene begins with.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct StartWritten {
    /// `RUN`, the directory of that run, relative to the scene file: its newest checkpoint. Or `RUN@TIME`: its last
    /// checkpoint that is not after this simulated time in s.
    pub from: String,
    /// Time of the clock at the start: 0, or by default the time of that run.
    pub time: Option<f64>,
    /// Hash of that state; a run writes it into its own scene.toml.
    pub state: Option<String>,
}

/// The continuum.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MpmWritten {
    #[serde(flatten)]
    pub scheme: Scheme,
    /// Acceleration in m/s^2 besides gravity: two expressions in a point's initial position x, y (m), time t (s) and
    /// the constants.
    pub body_force: Option<[NumberOrExpression; 2]>,
    /// Dead loads on points that are in a region at the start.
    #[serde(default)]
    pub traction: Vec<Traction>,
    /// Damping and transfer that change with time.
    #[serde(default)]
    pub stage: Vec<Stage>,
    /// Points that keep their initial x, y or both.
    #[serde(default)]
    pub hold: Vec<Hold>,
    /// Sets of points whose mean motion is recorded.
    #[serde(default)]
    pub probe: Vec<Probe>,
    /// Chains of markers along the boundaries of groups.
    #[serde(default)]
    pub chain: Vec<ChainWritten>,
    /// Materials.
    pub material: Vec<MaterialWritten>,
    /// Groups of material points.
    pub points: Vec<PointsWritten>,
}

/// A material of the continuum.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MaterialWritten {
    #[serde(flatten)]
    pub material: MaterialConfig,
    /// The test in which the friction angle was measured; by default the angle is the parameter of the model: that of
    /// Jiang 2020 eq. 35, or Mohr-Coulomb's.
    pub friction_test: Option<FrictionTest>,
}

/// A group of material points.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointsWritten {
    /// Name, by which quantities refer to the group.
    pub name: String,
    /// Name of its material.
    pub material: String,
    /// Region filled with points.
    pub fill: Fill,
    /// Spacing of the points.
    pub spacing: Spacing,
    /// Orientation of the lattice of points; use `"outline"` for discs and for polygons at an angle to the grid.
    #[serde(default)]
    pub lattice: Lattice,
    /// Initial velocity in m/s, each component a number or an expression in x, y (m) and the constants; at rest by
    /// default.
    pub velocity: Option<[NumberOrExpression; 2]>,
    /// Initial stress xx, yy, zz, xy in Pa, each a number or an expression as above; none by default.
    pub stress: Option<[NumberOrExpression; 4]>,
    /// Contact radius r_p in m; half the point spacing by default.
    pub contact_radius: Option<f64>,
    /// Whether the nodes get the group's spin as a linear field, so that rigid rotation causes no strain: for a solid
    /// that flies and rotates, with `flip`, `pic` or a blend. Not with periodic walls.
    #[serde(default)]
    pub keeps_spin: bool,
}

/// A chain of markers along the boundary of a group (Singer 2022). Markers have no mass and move with the grid; bodies
/// are in contact with the segments between them.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChainWritten {
    /// Name, by which quantities refer to the chain.
    pub name: String,
    /// Name of the group of points.
    pub points: String,
    /// Greatest distance of neighbouring markers in m along the outline of the group's fill, whose edges are divided
    /// evenly; this or `through`.
    pub spacing: Option<f64>,
    /// Distance of the chain inside the outline, in m; by default the contact radius of the group, so that the contact
    /// surface is the outline.
    pub shift: Option<f64>,
    /// The markers themselves in m, with the material on the left.
    pub through: Option<Vec<[f64; 2]>>,
    /// Whether a segment goes from the last marker of `through` to the first; the outline of a fill is always closed.
    #[serde(default)]
    pub closed: bool,
    /// eta: a node with less than this share of the mass of a full cell has a smaller weight for markers, in proportion
    /// to its mass.
    #[serde(default = "marker_floor")]
    pub floor: f64,
}

/// 0.1, the default of eta.
fn marker_floor() -> f64 {
    0.1
}

/// The bodies.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DemWritten {
    /// Spheropolygon bodies, one by one. A `[dem]` without bodies, without sets of bodies and without `[[group_pair]]`
    /// has no effect.
    #[serde(default)]
    pub body: Vec<BodyWritten>,
    /// Sets of bodies that are generated from a seed.
    #[serde(default)]
    pub fill: Vec<BodyFill>,
    /// How the overlap of two bodies is measured; each vertex with each edge by default.
    #[serde(default)]
    pub overlap: OverlapMeasure,
    /// How finely impacts are resolved: `omega dt` of a contact between bodies that opens or closes is at most this
    /// number times `time.safety`, and 25 times as much in a contact of points. At most 2, the limit of stability. By
    /// default 0.04, and 0.2 if all these contacts are damped.
    pub contact_resolution: Option<f64>,
}

/// A spheropolygon body.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct BodyWritten {
    /// Its inertia is written as `density` or `mass`.
    #[serde(flatten)]
    pub body: BodyConfig,
    /// Density in kg/m^3 over the swept area; this or `mass`. A fixed or driven body needs neither.
    pub density: Option<f64>,
    /// Mass in kg/m; this or `density`.
    pub mass: Option<f64>,
}

/// Programs that replace the built-in solvers: command lines, to which `--join RUN` is added. Words that begin with
/// `./` or `../` are paths relative to the scene file.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SolversWritten {
    /// The continuum's solver; `built-in` by default.
    pub mpm: Option<String>,
    /// The bodies' solver; `built-in` by default.
    pub dem: Option<String>,
}

/// What is recorded.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OutputWritten {
    /// Simulated time between rows of the history in s.
    pub every: f64,
    /// Simulated time between frames in s: all points and bodies, as VTK files. A whole multiple of `every`; no frames by
    /// default.
    pub frames: Option<f64>,
    /// Fields of points and bodies in frames, besides positions and ids; all fields by default.
    pub fields: Option<Vec<Field>>,
    /// Precision of the fields in frames; positions are always in double precision.
    #[serde(default)]
    pub precision: Precision,
    /// When the run saves its state, so that `tandem resume` can continue from there; never by default.
    pub checkpoint: Option<CheckpointPlan>,
    /// Whether the run writes report.html at its end, a page with its results; false by default. A scene without
    /// `frames` then takes about a hundred.
    #[serde(default)]
    pub report: bool,
    /// Columns of history.csv after the time.
    #[serde(default)]
    pub column: Vec<ColumnWritten>,
}

/// A column of history.csv.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ColumnWritten {
    /// Name in the header.
    pub name: String,
    /// Unit in the header, such as `m/s`; `1` for a pure number.
    pub unit: String,
    /// Expression over quantities and constants.
    pub value: String,
}

/// A condition that the run must meet.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CheckWritten {
    /// What is checked.
    pub name: String,
    /// Expression over quantities and constants.
    pub value: String,
    /// How the value's history becomes one number; at the end by default.
    #[serde(default)]
    pub when: When<NumberOrExpression>,
    /// Start of the time interval in s; 0 by default.
    pub from: Option<NumberOrExpression>,
    /// End of the time interval in s; the end of the run by default.
    pub to: Option<NumberOrExpression>,
    /// What the number must be.
    #[serde(flatten)]
    pub expected: Expected<NumberOrExpression, ReferenceWritten>,
    /// Where the expected figure comes from.
    pub source: String,
}

/// Settings of `tandem study`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct StudyWritten {
    /// Name of the check whose error is used; the first with a `reference` by default. This or `finer`.
    pub error: Option<String>,
    /// Columns of the history, or checks, that are compared with the finest run of the same curve.
    #[serde(default)]
    pub finer: Vec<String>,
    /// Scene key whose number is the resolution of a run; `mpm.cell` by default.
    pub resolution: Option<String>,
    /// Varied keys that change along a curve; each combination of the others is a curve of its own. By default
    /// `variant` and the resolution.
    pub along: Option<Vec<String>>,
    /// Scene keys, or `variant`, and the values that they take, in every combination.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, Vec<serde_json::Value>>")]
    pub vary: BTreeMap<String, Vec<toml::Value>>,
}

/// What a value must be.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum ReferenceWritten {
    /// A number, or an expression in `t`, other quantities and constants.
    Plain(NumberOrExpression),
    /// A table over time.
    Table(TableWritten),
}

/// A table over time, interpolated linearly: columns of a CSV file, or points.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TableWritten {
    /// CSV file with a header, relative to the scene file.
    pub csv: Option<String>,
    /// Header of the column of times in s; `t` by default.
    pub t: Option<String>,
    /// Header of the column of values; `value` by default.
    pub value: Option<String>,
    /// The table itself instead of a file: times in s and values.
    pub points: Option<Vec<[f64; 2]>>,
}
