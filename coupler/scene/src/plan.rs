//! The plan of a scene, before anything is started: what will run, and what is left out and why.

use interface::config::friction::FrictionTest;
use interface::config::{GroupConfig, MaterialConfig, Motion, MpmConfig, Wall};
use serde::Serialize;
use serde_json::Value;

use super::Scene;

/// Something that a scene does not need.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// What is not done or kept.
    pub what: String,
    /// Why not.
    pub why: &'static str,
}

impl Scene {
    /// What will run, what is left out and why, and what is allowed but probably not meant, in words.
    pub fn plan(&self) -> String {
        let mut lines = vec![self.name.clone()];
        lines.extend((!self.about.is_empty()).then(|| format!("  {}", self.about)));
        lines.push("runs".to_owned());
        lines.extend(runs(self).iter().map(|line| format!("  {line}")));
        lines.push("left out".to_owned());
        let left_out = left_out(self).into_iter();
        lines.extend(left_out.map(|LeftOut { what, why }| format!("  {what}: {why}")));
        let warnings = self.warnings.iter();
        lines.extend(warnings.map(|warning| format!("warning: {warning}")));
        lines.join("\n") + "\n"
    }

    /// Explanations of its numbers, one a line: for each material with friction, the angle at which it fails in each
    /// test.
    pub fn notes(&self) -> Vec<String> {
        let materials = self.mpm.iter().flat_map(|mpm| &mpm.materials);
        materials.filter_map(friction_in_words).collect()
    }

    /// Approximate number of material points.
    pub fn points_estimate(&self) -> f64 {
        self.mpm.as_ref().map_or(0.0, points)
    }

    /// Approximate number of cells with points: at most one for each point.
    pub fn cells_estimate(&self) -> f64 {
        let groups = self.mpm.iter().flat_map(|mpm| {
            mpm.groups.iter().map(|group: &GroupConfig| {
                let points = group.points_estimate(mpm.cell);
                match group.fill.area() / (mpm.cell * mpm.cell) {
                    cells if cells > 0.0 => cells.min(points),
                    _ => points,
                }
            })
        });
        groups.sum()
    }
}

fn points(mpm: &MpmConfig) -> f64 {
    mpm.groups.iter().map(|g| g.points_estimate(mpm.cell)).sum()
}

fn nodes(mpm: &MpmConfig) -> [f64; 2] {
    let [lower, upper] = mpm.domain;
    [0, 1].map(|axis| ((upper[axis] - lower[axis]) / mpm.cell).round() + 1.0)
}

/// Rows of the history: one at the start and one at the end, and between them one at each multiple of the interval. The term
/// 1e-9 allows for rounding.
fn rows(scene: &Scene) -> f64 {
    let goes_on = scene.start.as_ref().filter(|start| !start.from_zero);
    let begin = goes_on.and_then(|start| start.at).unwrap_or(0.0);
    let [begin, end] = [begin, scene.time.end].map(|time| time / scene.output.every);
    (end - 1e-9).ceil() - (begin + 1e-9).floor() + 1.0
}

fn runs(scene: &Scene) -> Vec<String> {
    let mut runs = Vec::new();
    if let Some(mpm) = &scene.mpm {
        let [nx, ny] = nodes(mpm);
        runs.push(format!(
            "MPM process{}: about {} points in groups: {}, grid of {} x {} cells of {} m, shape {}, transfer {}",
            other(scene.solvers.mpm.as_ref()),
            points(mpm),
            some_names(mpm.groups.iter().map(|g| g.name.as_str())),
            nx - 1.0,
            ny - 1.0,
            mpm.cell,
            spelling(&mpm.shape),
            spelling(&mpm.transfer)
        ));
        runs.extend(scene.notes());
    }
    if let Some(dem) = &scene.dem {
        let count = |of: fn(&Motion) -> bool| dem.bodies.iter().filter(|b| of(&b.motion)).count();
        let free = count(|motion| motion.yielding() != [0.0; 3]);
        let fixed = count(|motion| *motion == Motion::Fixed);
        runs.push(format!(
            "DEM process{}: bodies: {free} free, {} driven, {fixed} fixed",
            other(scene.solvers.dem.as_ref()),
            dem.bodies.len() - free - fixed
        ));
        if scene.mpm.is_some() && !dem.bodies.is_empty() {
            let law = spelling(&dem.point_contact);
            runs.push(format!(
                "contact of points and bodies: {law}; skin {} m",
                dem.skin
            ));
        }
        if let Some(law) = dem.body_contact {
            runs.push(format!("contact among bodies: {}", spelling(&law)));
        }
        for pair in &dem.group_pairs {
            let groups = scene.mpm.as_ref().map_or(&[][..], |mpm| &mpm.groups);
            let [a, b] = pair.between.map(|group| &groups[group].name);
            let law = spelling(&pair.law);
            runs.push(format!(
                "contact of the points of {a} and {b}: {law}; skin {} m",
                dem.skin
            ));
        }
        for pair in &dem.contact_pairs {
            let [a, b] = &pair.between;
            let law = spelling(&pair.law);
            runs.push(format!("contact of {a} and {b}: {law}"));
        }
    }
    runs.push(format!(
        "step: composed of both sides' limits, safety {}, in windows of up to {} steps",
        scene.time.safety, scene.coupling.window
    ));
    if let Some(start) = &scene.start {
        runs.push(format!("begins with the state of {}", start.from()));
    }
    runs.push(format!(
        "history: {} columns every {} s, {} rows; {} checks",
        scene.output.columns.len(),
        scene.output.every,
        rows(scene),
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
    let wall = plan.wall.map(|wall| format!("every {wall} s of wall time"));
    let time = plan.time.map(|time| format!("every {time} s"));
    let kept = plan.at.iter().map(|at| format!("at {at} s"));
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

/// A value as in a scene file; a table as its keys and values, without zeros.
fn spelling(value: &impl Serialize) -> String {
    in_words(&serde_json::to_value(value).unwrap_or_default())
}

fn in_words(value: &Value) -> String {
    let field = |(key, value): (&String, &Value)| match value {
        Value::Object(_) => format!("{key}: {}", in_words(value)),
        _ => format!("{key} {}", in_words(value)),
    };
    match value {
        Value::Object(fields) => {
            let all = fields
                .iter()
                .filter(|(_, value)| value.as_f64() != Some(0.0));
            all.map(field).collect::<Vec<_>>().join(", ")
        }
        Value::Number(number) => match number.as_f64() {
            Some(x) if (1e-3..1e4).contains(&x.abs()) => x.to_string(),
            Some(x) => format!("{x:e}"),
            None => number.to_string(),
        },
        Value::String(word) => word.clone(),
        other => other.to_string(),
    }
}

/// The first and the last of many names.
fn some_names<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    const MOST: usize = 8;
    let all: Vec<&str> = names.collect();
    match &all[..] {
        [first, second, .., last] if all.len() > MOST => {
            format!("{first}, {second}, ..., {last} ({} groups)", all.len())
        }
        all => all.join(", "),
    }
}

/// What a scene does not need.
pub fn left_out(scene: &Scene) -> Vec<LeftOut> {
    let mut list = Vec::new();
    let mut add = |applies: bool, what: &str, why: &'static str| {
        let what = what.to_owned();
        list.extend(applies.then_some(LeftOut { what, why }));
    };
    let (mpm, dem) = (scene.mpm.as_ref(), scene.dem.as_ref());
    add(mpm.is_none(), "MPM process", "the scene has no `[mpm]`");
    add(dem.is_none(), "DEM process", "the scene has no `[dem]`");
    if let Some(mpm) = mpm {
        let plastic = mpm.materials.iter().any(|m| m.model.is_plastic());
        add(
            !plastic,
            "plastic state of points",
            "no material flows plastically",
        );
        let walls = mpm.walls.by_axis();
        let is_open = |(_, wall): &(_, Wall)| *wall == Wall::Open;
        add(
            walls.as_flattened().iter().all(is_open),
            "conditions on the domain's walls",
            "all four are open",
        );
        add(mpm.gravity == [0.0; 2], "body force", "gravity is zero");
        add(
            dem.is_none(),
            "exchange of points and forces",
            "there is nothing to exchange with",
        );
    }
    if let Some(dem) = dem {
        let fixed = dem.bodies.iter().filter(|b| b.motion == Motion::Fixed);
        let fixed = fixed.count();
        add(
            fixed > 0,
            &format!("motion of {fixed} of {} bodies", dem.bodies.len()),
            "fixed bodies are not integrated",
        );
        let coupled = mpm.is_some();
        add(
            coupled && dem.point_laws().all(|law| law.friction() == 0.0),
            "tangential history of points on bodies",
            "their contact has no friction",
        );
        add(
            coupled && dem.point_laws().all(|law| law.damping_ratio() == 0.0),
            "viscous force of points on bodies",
            "their contact has no damping",
        );
        let alone = dem.bodies.len() == 1;
        add(
            dem.body_contact.is_none() || alone,
            "search and contact among bodies",
            if alone {
                "there is one body"
            } else {
                "the scene has no `[body_contact]`"
            },
        );
    }
    let output = &scene.output;
    add(
        output.columns.is_empty(),
        "columns of the history except the time",
        "the scene has no `[[output.column]]`",
    );
    add(
        output.frames.is_none(),
        "frames",
        "the scene has no `output.frames`",
    );
    add(
        output.checkpoint.is_none(),
        "checkpoints",
        "the scene has no `output.checkpoint`",
    );
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface::config::{ContactLaw, Transfer};

    #[test]
    fn values_are_words_and_many_names_are_few() {
        let law = ContactLaw::linear(6e6, 3e5, 0.2, 0.0);
        let words = "linear: friction 0.2, normal_stiffness 6e6, tangential_stiffness 3e5";
        assert_eq!(spelling(&law), words);
        assert_eq!(spelling(&Transfer::Apic), "apic");
        let names: Vec<String> = (0..369).map(|i| format!("g{i}")).collect();
        let named = |n: usize| some_names(names[..n].iter().map(String::as_str));
        assert_eq!(named(3), "g0, g1, g2");
        assert_eq!(named(369), "g0, g1, ..., g368 (369 groups)");
    }
}
