//! The plan of a scene, before anything is started: what will run, what is left out and why, and the cost.
//!
//! The numbers are estimates from the scene alone: areas instead of placed points, bounds instead of the limits that
//! the solvers report at every step.

use std::fmt::{self, Write as _};

use interface::config::friction::FrictionTest;
use interface::config::{
    BodyConfig, BodyInertia, ContactLaw, DemConfig, MaterialConfig, Motion, MpmConfig,
    ShapeFunction, Wall, polygon,
};
use serde::Serialize;

use super::{Criterion, Scene};

/// Bytes of a point's state: position, velocity, deformation, stress, mass, volume, id, and the affine part.
const BYTES_PER_POINT: f64 = 240.0;
/// Bytes more for a point that flows plastically: strain history and work.
const BYTES_PER_PLASTIC_POINT: f64 = 32.0;
/// Bytes of a grid node: mass, momentum, force, velocity before and after.
const BYTES_PER_NODE: f64 = 72.0;
/// Bytes of a body and of each of its vertices.
const BYTES_PER_BODY: f64 = 512.0;
/// Stiffness of two bodies that meet corner on corner, in k_n (docs/physics.md section 5: eqs. 39 to 41 summed literally).
const CORNER_STIFFNESS: f64 = 8.0;

/// What a scene will run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Name of the scene.
    pub scene: String,
    /// What to look at in the results.
    pub about: String,
    /// What will run, a line each.
    pub runs: Vec<String>,
    /// What is left out, and why.
    pub left_out: Vec<LeftOut>,
    /// Approximate number of material points.
    pub points: f64,
    /// Approximate memory of the solvers' states in bytes.
    pub memory: f64,
    /// Upper limits of the step in s, smallest first; safety factors included.
    pub limits: Vec<StepLimit>,
    /// The step while bodies collide or separate, if they can.
    pub impacts: Option<Impacts>,
    /// Approximate number of steps, without those of impacts, whose number is not known.
    pub steps: f64,
    /// Rows of the history.
    pub rows: f64,
    /// Things that are allowed but probably not meant.
    pub warnings: Vec<String>,
}

/// Something that a scene does not need.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// What is not done or kept.
    pub what: String,
    /// Why not.
    pub why: String,
}

/// The cost of resolving impacts between bodies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Impacts {
    /// Step in s while one contact of the lightest body opens or closes.
    pub step: f64,
    /// Number of such steps in an impact.
    pub steps: f64,
}

/// An upper limit of the step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepLimit {
    /// Where it comes from.
    pub name: String,
    /// The step in s.
    pub step: f64,
}

impl Plan {
    pub(super) fn new(scene: &Scene) -> Self {
        let limits = limits(scene);
        let step = limits.first().map_or(scene.time.end, |limit| limit.step);
        Self {
            scene: scene.name.clone(),
            about: scene.about.clone(),
            runs: runs(scene),
            left_out: left_out(scene),
            points: scene.points_estimate(),
            memory: memory(scene),
            steps: (scene.time.end / step).ceil(),
            // One row at the start and one at the end, whether or not the interval divides the run. The term 1e-9
            // allows for rounding.
            rows: (scene.time.end / scene.output.every - 1e-9).ceil() + 1.0,
            impacts: impacts(scene),
            limits,
            warnings: scene.warnings.clone(),
        }
    }
}

impl Scene {
    /// Explanations of its numbers, one a line: for each material with friction, the angle at which it fails in each
    /// test.
    pub fn notes(&self) -> Vec<String> {
        let materials = self.mpm.iter().flat_map(|mpm| &mpm.materials);
        materials.filter_map(friction_in_words).collect()
    }

    /// Approximate number of material points.
    pub(crate) fn points_estimate(&self) -> f64 {
        self.mpm.as_ref().map_or(0.0, points)
    }
}

fn points(mpm: &MpmConfig) -> f64 {
    mpm.groups.iter().map(|g| g.points_estimate(mpm.cell)).sum()
}

fn nodes(mpm: &MpmConfig) -> [f64; 2] {
    let [lower, upper] = mpm.domain;
    [0, 1].map(|axis| ((upper[axis] - lower[axis]) / mpm.cell).round() + 1.0)
}

fn runs(scene: &Scene) -> Vec<String> {
    let mut runs = Vec::new();
    if let Some(mpm) = &scene.mpm {
        let [nx, ny] = nodes(mpm);
        runs.push(format!(
            "MPM process{}: about {} points in groups: {}, grid of {} x {} cells of {} m, shape {}, transfer {}",
            other(scene.solvers.mpm.as_ref()),
            points(mpm),
            mpm.groups.iter().map(|g| g.name.as_str()).collect::<Vec<_>>().join(", "),
            nx - 1.0,
            ny - 1.0,
            mpm.cell,
            spelling(&mpm.shape),
            spelling(&mpm.transfer)
        ));
        runs.extend(scene.notes());
    }
    if let Some(dem) = &scene.dem {
        let count = |motion| dem.bodies.iter().filter(|b| b.motion == motion).count();
        runs.push(format!(
            "DEM process{}: bodies: {} free, {} driven, {} fixed",
            other(scene.solvers.dem.as_ref()),
            count(Motion::Free),
            count(Motion::Driven),
            count(Motion::Fixed)
        ));
        if scene.mpm.is_some() && !dem.bodies.is_empty() {
            let law = law_in_words(dem.point_contact);
            runs.push(format!(
                "contact of points and bodies: {law}; skin {} m",
                dem.skin
            ));
        }
        if let Some(law) = dem.body_contact {
            runs.push(format!("contact among bodies: {}", law_in_words(law)));
        }
        for pair in &dem.group_pairs {
            let groups = scene.mpm.as_ref().map_or(&[][..], |mpm| &mpm.groups);
            let [a, b] = pair.between.map(|group| &groups[group].name);
            let law = law_in_words(pair.law);
            runs.push(format!(
                "contact of the points of {a} and {b}: {law}; skin {} m",
                dem.skin
            ));
        }
        for pair in &dem.contact_pairs {
            let [a, b] = &pair.between;
            let law = law_in_words(pair.law);
            runs.push(format!("contact of {a} and {b}: {law}"));
        }
    }
    runs.push(match scene.time.criterion {
        Criterion::Composed => format!(
            "step: composed of both sides' limits, safety {}, in windows of up to {} steps",
            scene.time.safety, scene.coupling.window
        ),
        Criterion::Jiang2020 { kappa_1, kappa_2 } => format!(
            "step: Jiang 2020 eq. 51 with kappa_1 {kappa_1}, kappa_2 {kappa_2}: NOT SAFE in general"
        ),
    });
    if let Some(start) = &scene.start {
        runs.push(format!("begins with the state of {}", start.from()));
    }
    runs.push(format!(
        "history: {} columns every {} s; {} checks",
        scene.output.columns.len(),
        scene.output.every,
        scene.checks.len()
    ));
    if let Some(rows) = scene.output.frames {
        runs.push(format!(
            "frames: all points and bodies every {} s",
            rows as f64 * scene.output.every
        ));
    }
    runs.extend(checkpoints(scene));
    runs
}

/// The angles at which a material fails, if it has friction.
fn friction_in_words(material: &MaterialConfig) -> Option<String> {
    let angles = FrictionTest::ALL.map(|test| {
        let angle = material.model.fails_at(test);
        angle.map(|angle| format!("{angle:.1} degrees in {}", test.words()))
    });
    let angles: Vec<String> = angles.into_iter().flatten().collect();
    let name = &material.name;
    (!angles.is_empty()).then(|| format!("material {name} fails at {}", angles.join(", ")))
}

/// When the run saves its state.
fn checkpoints(scene: &Scene) -> Option<String> {
    let plan = scene.output.checkpoint.as_ref()?;
    let wall = plan.wall.map(|wall| format!("every {wall:?} of wall time"));
    let time = plan.time.map(|time| format!("every {time} s"));
    let every = scene.output.every;
    let at = plan.at.iter();
    let kept = at.map(|&outputs| format!("at {} s", outputs as f64 * every));
    let end = plan.end.then(|| "at the end".to_owned());
    let all: Vec<String> = time
        .into_iter()
        .chain(wall)
        .chain(kept)
        .chain(end)
        .collect();
    Some(format!("checkpoints: {}", all.join(", and ")))
}

/// The command of a solver that is not the built-in one.
fn other(command: Option<&Vec<String>>) -> String {
    command.map_or_else(String::new, |words| format!(" `{}`", words.join(" ")))
}

/// A value as in a scene file; as JSON if it is a table.
fn spelling(value: &impl Serialize) -> String {
    let json = serde_json::to_string(value).unwrap_or_default();
    json.trim_matches('"').to_owned()
}

fn law_in_words(law: ContactLaw) -> String {
    let ContactLaw::Linear {
        normal_stiffness,
        tangential_stiffness,
        friction,
        damping_ratio,
        damped_mass,
    } = law
    else {
        return spelling(&law);
    };
    let mut words = format!("linear spring, k_n {normal_stiffness:e} N/m");
    if friction > 0.0 {
        let _ = write!(
            words,
            ", friction {friction} through k_t {tangential_stiffness:e} N/m"
        );
    }
    if damping_ratio > 0.0 {
        let _ = write!(words, ", damping ratio {damping_ratio}");
        if damped_mass > 0.0 {
            let _ = write!(words, " of {damped_mass} kg/m for each point");
        }
    }
    words
}

fn left_out(scene: &Scene) -> Vec<LeftOut> {
    let mut list = List::default();
    let (mpm, dem) = (scene.mpm.as_ref(), scene.dem.as_ref());
    list.add(mpm.is_none(), "MPM process", "the scene has no `[mpm]`");
    list.add(dem.is_none(), "DEM process", "the scene has no `[dem]`");
    if let Some(mpm) = mpm {
        list.of_points(mpm, dem.is_some());
    }
    if let Some(dem) = dem {
        list.of_bodies(dem, mpm.is_some());
    }
    let output = &scene.output;
    list.add(
        output.columns.is_empty(),
        "columns of the history except the time",
        "the scene has no `[[output.column]]`",
    );
    list.add(
        output.frames.is_none(),
        "frames",
        "the scene has no `output.frames`",
    );
    list.add(
        output.checkpoint.is_none(),
        "checkpoints",
        "the scene has no `output.checkpoint`",
    );
    list.0
}

/// What is left out, as found so far.
#[derive(Default)]
struct List(Vec<LeftOut>);

impl List {
    fn add(&mut self, applies: bool, what: &str, why: &str) {
        if applies {
            self.0.push(LeftOut {
                what: what.to_owned(),
                why: why.to_owned(),
            });
        }
    }

    fn of_points(&mut self, mpm: &MpmConfig, coupled: bool) {
        let plastic = mpm.materials.iter().any(|m| m.model.is_plastic());
        self.add(
            !plastic,
            "plastic state of points",
            "no material flows plastically",
        );
        let w = mpm.walls;
        let walls = [w.left, w.right, w.bottom, w.top];
        self.add(
            walls.iter().all(|w| *w == Wall::Open),
            "conditions on the domain's walls",
            "all four are open",
        );
        self.add(mpm.gravity == [0.0; 2], "body force", "gravity is zero");
        self.add(
            !coupled,
            "exchange of points and forces",
            "there is nothing to exchange with",
        );
    }

    fn of_bodies(&mut self, dem: &DemConfig, coupled: bool) {
        let fixed = dem.bodies.iter().filter(|b| b.motion == Motion::Fixed);
        let fixed = fixed.count();
        self.add(
            fixed > 0,
            &format!("motion of {fixed} of {} bodies", dem.bodies.len()),
            "fixed bodies are not integrated",
        );
        if coupled {
            self.add(
                dem.point_laws().all(|law| law.friction() == 0.0),
                "tangential history of points on bodies",
                "their contact has no friction",
            );
            self.add(
                dem.point_laws().all(|law| law.damping_ratio() == 0.0),
                "viscous force of points on bodies",
                "their contact has no damping",
            );
        }
        let alone = dem.bodies.len() == 1;
        self.add(
            dem.body_contact.is_none() || alone,
            "search and contact among bodies",
            if alone {
                "there is one body"
            } else {
                "the scene has no `[body_contact]`"
            },
        );
    }
}

fn memory(scene: &Scene) -> f64 {
    let mut bytes = 0.0;
    if let Some(mpm) = &scene.mpm {
        let [nx, ny] = nodes(mpm);
        bytes += nx * ny * BYTES_PER_NODE;
        for group in &mpm.groups {
            let count = group.points_estimate(mpm.cell);
            let plastic = mpm.materials[group.material].model.is_plastic();
            let more = if plastic {
                BYTES_PER_PLASTIC_POINT
            } else {
                0.0
            };
            bytes += count * (BYTES_PER_POINT + more);
        }
    }
    for body in scene.dem.iter().flat_map(|dem| &dem.bodies) {
        bytes += BYTES_PER_BODY * (1.0 + 0.1 * body.shape.vertices().len() as f64);
    }
    bytes
}

/// Upper limits of the step, smallest first.
fn limits(scene: &Scene) -> Vec<StepLimit> {
    let mut limits = Vec::new();
    let mut limit = |name: &str, step: f64| {
        if step.is_finite() && step > 0.0 {
            limits.push(StepLimit {
                name: name.to_owned(),
                step,
            });
        }
    };
    let waves = scene.mpm.as_ref().map_or(f64::INFINITY, courant_time);
    let stiffness = scene
        .dem
        .as_ref()
        .map_or(0.0, |dem| stiffest(dem.point_laws()));
    let point = scene.mpm.as_ref().map_or(f64::INFINITY, lightest_point);
    match scene.time.criterion {
        Criterion::Composed => {
            let kappa = scene.time.safety * scene.time.step_factor;
            // A dashpot shortens the step (docs/physics.md section 4).
            let damping = scene
                .dem
                .as_ref()
                .map_or(0.0, |dem| most_damped(dem.point_laws()));
            let kappa_contact = kappa * (damping.hypot(1.0) - damping);
            // Contact adds k_n over the lightest mass to the squared frequency of waves (docs/physics.md section 4).
            let elastic = scene.mpm.as_ref().map_or(0.0, elastic_omega_sq);
            let contact = if scene.mpm.is_some() {
                stiffness / point
            } else {
                0.0
            };
            limit("elastic waves alone", kappa * 2.0 / elastic.sqrt());
            limit(
                "contact of points and bodies alone (2/sqrt(k_n/m_p))",
                kappa_contact * 2.0 / contact.sqrt(),
            );
            limit(
                "composed: elastic waves and contact",
                kappa_contact * 2.0 / (elastic + contact).sqrt(),
            );
            if let Some(dem) = &scene.dem
                && dem.body_contact.is_some()
            {
                let stiffness = stiffest(dem.body_laws());
                let omega = (CORNER_STIFFNESS * stiffness / lightest_body(dem)).sqrt();
                limit(
                    "contact among bodies, corner on corner",
                    kappa * 2.0 / omega,
                );
            }
        }
        Criterion::Jiang2020 { kappa_1, kappa_2 } => {
            let body = scene.dem.as_ref().map_or(f64::INFINITY, lightest_body);
            let factor = scene.time.step_factor;
            limit("Jiang 2020 eq. 51, waves", factor * kappa_1 * waves);
            let period = factor * std::f64::consts::TAU * (body / stiffness).sqrt();
            limit("Jiang 2020 eq. 51, contact", kappa_2 * period);
        }
    }
    limit(
        "the scene's own limit (time.max_step)",
        scene.time.max_step.unwrap_or(f64::INFINITY),
    );
    limit("history interval (output.every)", scene.output.every);
    limits.sort_by(|a, b| a.step.total_cmp(&b.step));
    limits
}

/// The step of impacts, if the criterion resolves them.
fn impacts(scene: &Scene) -> Option<Impacts> {
    let dem = scene.dem.as_ref()?;
    dem.body_contact?;
    let Criterion::Composed = scene.time.criterion else {
        return None;
    };
    let omega = (stiffest(dem.body_laws()) / lightest_body(dem)).sqrt();
    let angle = scene.time.safety * scene.time.step_factor * dem.resolution();
    let cap = scene.time.max_step.unwrap_or(f64::INFINITY);
    let step = (angle / omega).min(cap);
    // Number of steps in half a period of an elastic contact.
    let steps = (std::f64::consts::PI / (omega * step)).ceil();
    (step.is_finite() && step > 0.0).then_some(Impacts { step, steps })
}

fn stiffest(laws: impl Iterator<Item = ContactLaw>) -> f64 {
    // A stiffness that grows with the overlap is not known in advance.
    let stiffness = laws.filter_map(|law| law.constant_stiffness());
    stiffness.fold(0.0, f64::max)
}

fn most_damped(laws: impl Iterator<Item = ContactLaw>) -> f64 {
    laws.map(|law| law.damping_ratio()).fold(0.0, f64::max)
}

/// `L/c` of the fastest material in s.
fn courant_time(mpm: &MpmConfig) -> f64 {
    mpm.cell / largest_over_density(mpm, |k, g| k + 4.0 / 3.0 * g).sqrt()
}

/// The continuum's bound of its largest squared frequency in 1/s^2, as the built-in solver declares it for the material
/// at rest (derived in its file `limits`): the bound of the shape function times the plane stiffness. Linear hats have
/// no such bound; for them it is the value of a filled grid.
fn elastic_omega_sq(mpm: &MpmConfig) -> f64 {
    let boxes = mpm.groups.iter().map(|g| {
        let [dx, dy] = g.distances(mpm.cell);
        (0.5 * dx.min(dy) / mpm.cell).min(0.5)
    });
    let place = match mpm.shape {
        ShapeFunction::Linear => 4.0,
        ShapeFunction::Ugimp => {
            let l = boxes.fold(0.5, f64::min);
            2.0 / l + 1.0 / (1.0 - l)
        }
        ShapeFunction::QuadraticBspline => 6.0,
        ShapeFunction::CubicBspline => 3.13683,
    };
    place * largest_over_density(mpm, |k, g| 2.0 * k + 2.0 / 3.0 * g) / (mpm.cell * mpm.cell)
}

/// Largest `modulus(K, G) / rho` of any material in m^2/s^2.
fn largest_over_density(mpm: &MpmConfig, modulus: fn(f64, f64) -> f64) -> f64 {
    let over_density = |m: &interface::config::MaterialConfig| {
        let (k, g) = m.model.moduli();
        modulus(k, g) / m.density
    };
    mpm.materials.iter().map(over_density).fold(0.0, f64::max)
}

/// Mass of the lightest point in kg/m.
fn lightest_point(mpm: &MpmConfig) -> f64 {
    let mass = |g: &interface::config::GroupConfig| {
        let [dx, dy] = g.distances(mpm.cell);
        mpm.materials[g.material].density * dx * dy
    };
    mpm.groups.iter().map(mass).fold(f64::INFINITY, f64::min)
}

/// Mass of the lightest free body in kg/m.
fn lightest_body(dem: &DemConfig) -> f64 {
    let free = dem.bodies.iter().filter(|b| b.motion == Motion::Free);
    free.map(mass).fold(f64::INFINITY, f64::min)
}

/// Mass of a body in kg/m; exact for convex outlines, an estimate for others.
fn mass(body: &BodyConfig) -> f64 {
    let vertices = body.shape.vertices();
    let a = body.sphero_radius;
    let area = polygon::area(&vertices).abs()
        + polygon::perimeter(&vertices) * a
        + std::f64::consts::PI * a * a;
    match body.inertia {
        BodyInertia::Mass(mass) => mass,
        BodyInertia::Density(density) => density * area,
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.scene)?;
        if !self.about.is_empty() {
            writeln!(f, "  {}", self.about)?;
        }
        writeln!(f, "runs")?;
        for line in &self.runs {
            writeln!(f, "  {line}")?;
        }
        writeln!(f, "left out")?;
        for LeftOut { what, why } in &self.left_out {
            writeln!(f, "  {what}: {why}")?;
        }
        writeln!(
            f,
            "estimates, before the run (the solvers report the true limits at every step)"
        )?;
        writeln!(f, "  points   about {}", self.points)?;
        writeln!(f, "  memory   about {}", in_bytes(self.memory))?;
        for (i, limit) in self.limits.iter().enumerate() {
            let name = if i == 0 { "step" } else { "" };
            let binds = if i == 0 { "  <- binds" } else { "" };
            writeln!(f, "  {name:<8} {:.3e} s  {}{binds}", limit.step, limit.name)?;
        }
        if let Some(Impacts { step, steps }) = self.impacts {
            writeln!(
                f,
                "  impacts  {step:.3e} s  while bodies come into contact or separate: about {steps} steps each (dem.contact_resolution)"
            )?;
            writeln!(f, "  steps    about {}, and more for impacts", self.steps)?;
        } else {
            writeln!(f, "  steps    about {}", self.steps)?;
        }
        writeln!(f, "  history  {} rows", self.rows)?;
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        Ok(())
    }
}

fn in_bytes(bytes: f64) -> String {
    for (unit, size) in [
        ("GiB", 1_073_741_824.0),
        ("MiB", 1_048_576.0),
        ("KiB", 1024.0),
    ] {
        if bytes >= size {
            return format!("{:.1} {unit}", bytes / size);
        }
    }
    format!("{bytes} B")
}
