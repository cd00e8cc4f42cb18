//! Turns the scene as written into checked values.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use interface::config::Interface;
use serde::Deserialize;
use toml::Value;

use super::document::{Document, Part};
use super::doubts::doubts;
use super::output::{self, Context};
use super::problems::Problems;
use super::schema::schema;
use super::written::{DemWritten, OutputWritten, SceneWritten, VERSION};
use super::{
    Coupling, Output, Scene, TimePlan, bodies, continuum, group_pairs, moduli, slice, solvers,
    start, structure, study,
};
use crate::diagnostic::SceneErrors;
use record::check::{Check, Reference};
use record::frames::Content;
use record::quantity::Quantities;

/// Largest number of rows of a history: a longer file is of no use.
const ROWS_LIMIT: f64 = 1e7;
/// Shortest run in s: the squares of times far below are no numbers any more.
const SHORTEST: f64 = 1e-100;
/// Number of frames of a run whose page needs some, if the scene asks for none.
const FRAMES_OF_REPORT: f64 = 100.0;

/// The scene of a document. Paths of CSV files and of solvers are relative to `directory`.
pub(super) fn scene(mut document: Document, directory: &Path) -> Result<Scene, SceneErrors> {
    static SCHEMA: LazyLock<serde_json::Value> = LazyLock::new(schema);
    let mut faults = structure::faults(&document, &SCHEMA);
    if faults.is_empty() {
        faults = moduli::replace(&mut document);
    }
    if !faults.is_empty() {
        faults.sort_by_key(|fault| fault.place.line());
        return Err(SceneErrors(faults));
    }
    let mut written = typed(&document)?;
    let mut problems = Problems::new(&document);
    slice::per_metre(&mut problems, &mut written);
    let scene = checked(&mut problems, &written, directory);
    let mut warnings = problems.finish()?;
    let mut scene = scene.expect("where nothing was refused everything was made");
    inline_tables(&mut document, &scene.checks);
    let commands = solvers::commands(&scene.solvers);
    let commands = commands.map(|(path, command)| (path, Value::String(command)));
    for (path, value) in commands.chain(start::resolved(scene.start.as_ref())) {
        document.replace(path, value);
    }
    document.root.remove("study");
    scene.resolved_toml = toml::to_string(&document.root).expect("the tree came from TOML");
    scene.hash = hash(&scene.resolved_toml);
    scene.variants.clone_from(&document.variants);
    scene.warnings.append(&mut warnings);
    scene.warnings.extend(doubts(&scene, &document));
    scene.document = Arc::new(document);
    Ok(scene)
}

/// The hash of a resolved scene.
pub(super) fn hash(resolved: &str) -> String {
    blake3::hash(resolved.as_bytes()).to_hex().to_string()
}

/// The document as a typed value. The schema has judged its structure, so a fault here is one that the schema has missed; the
/// message names the keys.
fn typed(document: &Document) -> Result<SceneWritten, SceneErrors> {
    SceneWritten::deserialize(Value::Table(document.root.clone())).map_err(|error| {
        let message = error.to_string();
        let fault = document.diagnostic("", Part::Value, message.trim(), None);
        SceneErrors(vec![fault])
    })
}

/// The bodies' side of the scene, if it has one: if there are bodies, which a variant can remove, or groups of points
/// that touch.
fn bodies_written<'a>(
    written: &'a SceneWritten,
    no_bodies: &'a DemWritten,
) -> Option<&'a DemWritten> {
    if !written.group_pair.is_empty() {
        return Some(written.dem.as_ref().unwrap_or(no_bodies));
    }
    let some = |dem: &&DemWritten| !dem.body.is_empty() || !dem.fill.is_empty();
    written.dem.as_ref().filter(some)
}

/// The scene, unless something was refused.
fn checked(problems: &mut Problems, written: &SceneWritten, directory: &Path) -> Option<Scene> {
    if written.version != VERSION {
        let message = format!("`version` is {}, expected {VERSION}", written.version);
        problems.refuse(
            "version",
            message,
            "this Tandem reads scenes of version 1 only",
        );
    }
    scene_name(problems, &written.name);
    let start = start::start(problems, written.start.as_ref(), directory);
    time(problems, &written.time);
    let constants = output::constants(problems, &written.constants);
    let group_pairs = group_pairs::group_pairs(problems, written);
    let no_bodies = DemWritten::default();
    let bodies_written = bodies_written(written, &no_bodies);
    let quantities = quantities(written, bodies_written);
    let mut mpm = written.mpm.as_ref().and_then(|mpm| {
        continuum::continuum(problems, mpm, written.gravity, &constants, &group_pairs)
    });
    let mut dem =
        bodies_written.and_then(|dem| bodies::bodies(problems, dem, written, &group_pairs));
    sides(problems, written, bodies_written.is_some());
    let present = [written.mpm.is_some(), bodies_written.is_some()];
    let solvers = solvers::solvers(problems, &written.solvers, present, directory);
    coupling(problems, &written.coupling);
    let skin = || bodies::default_skin(mpm.as_ref(), dem.as_ref());
    let skin = written.coupling.skin.unwrap_or_else(skin);
    if let Some(mpm) = &mut mpm {
        // A point moves by half its radius in a step, and shall be in the set before it touches.
        let radii = mpm.groups.iter().filter_map(|group| group.contact_radius);
        let least = 0.5 * radii.fold(0.0, f64::max);
        let is_enough = skin >= least || written.contact.is_none() && group_pairs.is_empty();
        let expected = format!("at least half the largest contact radius, {least} m");
        problems.number("coupling.skin", skin, is_enough || skin <= 0.0, &expected);
        mpm.skin = skin;
    }
    if let Some(dem) = &mut dem {
        dem.skin = skin;
    }
    let mut context = Context {
        problems: &mut *problems,
        constants: &constants,
        quantities: &quantities,
        end: written.time.end,
        directory,
    };
    let output = output(&mut context, &written.output);
    let checks = checks(&mut context, written);
    let models = mpm.iter().flat_map(|mpm| &mpm.materials);
    output::plastic_strain(
        problems,
        &written.output,
        models.map(|material| &material.model),
    );
    let study = study::study(problems, written.study.as_ref(), &checks, &output.columns);
    (!problems.any()).then(|| Scene {
        name: written.name.clone(),
        about: written.about.clone(),
        expect: written.expect.clone(),
        start,
        time: written.time,
        mpm,
        dem,
        solvers,
        coupling: written.coupling,
        output,
        checks,
        constants,
        quantities,
        resolved_toml: String::new(),
        hash: String::new(),
        variants: Arc::default(),
        study,
        warnings: Vec::new(),
        document: Arc::default(),
    })
}

/// The quantities that columns and checks of the scene may use.
fn quantities(written: &SceneWritten, bodies_written: Option<&DemWritten>) -> Quantities {
    let mpm = || written.mpm.iter();
    let segments = mpm().filter(|mpm| mpm.scheme.interface == Interface::Segments);
    let probes = mpm().flat_map(|mpm| &mpm.probe);
    let holds = mpm().flat_map(|mpm| &mpm.hold);
    let chains = segments.flat_map(|mpm| &mpm.chain);
    let probes: Vec<&str> = probes.map(|probe| probe.name.as_str()).collect();
    let holds: Vec<&str> = holds.map(|hold| hold.name.as_str()).collect();
    let chains: Vec<&str> = chains.map(|chain| chain.name.as_str()).collect();
    let dem = || bodies_written.into_iter();
    Quantities::new(
        mpm()
            .flat_map(|mpm| &mpm.points)
            .map(|group| group.name.as_str()),
        [&probes, &holds, &chains],
        dem()
            .flat_map(|dem| &dem.body)
            .map(|body| body.body.name.as_str()),
        dem()
            .flat_map(|dem| &dem.fill)
            .map(|fill| (fill.name.as_str(), fill.count)),
    )
    .of_slice(written.thickness)
}

/// The outputs of the run.
fn output(context: &mut Context, written: &OutputWritten) -> Output {
    let end = context.end;
    let every = written.every;
    history_interval(context.problems, every, end);
    let frames = frame_interval(context.problems, written.frames, every).or_else(|| {
        // Only the page needs them.
        let between = end / every / FRAMES_OF_REPORT;
        written.report.then(|| between.round().max(1.0) as u64)
    });
    let plan = written.checkpoint.as_ref();
    let checkpoint = start::checkpoint(context.problems, plan, [every, end]);
    let mut columns = Vec::new();
    for (i, column) in written.column.iter().enumerate() {
        columns.extend(context.column(&format!("output.column.{i}"), column));
    }
    let names = written.column.iter().map(|column| column.name.as_str());
    let problems = &mut *context.problems;
    problems.distinct("output.column", "columns", names);
    Output {
        every,
        frames,
        content: Content {
            fields: written.fields.clone(),
            precision: written.precision,
        },
        report: written.report,
        checkpoint,
        columns,
    }
}

/// The checks of the run.
fn checks(context: &mut Context, written: &SceneWritten) -> Vec<Check> {
    let mut checks = Vec::new();
    for (i, check) in written.check.iter().enumerate() {
        checks.extend(context.check(&format!("check.{i}"), check));
    }
    let problems = &mut *context.problems;
    let names = written.check.iter().map(|check| check.name.as_str());
    problems.distinct("check", "checks", names);
    if written.check.is_empty() {
        problems.warn("the scene has no checks, so its run cannot fail");
    }
    checks
}

/// Checks that there is a side. `bodies`: whether there is a bodies' side.
fn sides(problems: &mut Problems, written: &SceneWritten, bodies: bool) {
    if written.mpm.is_none() && !bodies {
        problems.refuse_key(
            "",
            "the scene has neither a continuum nor bodies",
            "add an `[mpm]` section, a `[dem]` section, or both",
        );
    }
}

fn scene_name(problems: &mut Problems, name: &str) {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.is_empty() || !name.chars().all(allowed) {
        let message = format!("`name` is \"{name}\", expected letters, digits, `_` and `-`");
        problems.refuse("name", message, "run directories are named after it");
    }
}

fn time(problems: &mut Problems, time: &TimePlan) {
    problems.above_zero("time.end", time.end, "a time");
    let expected = format!("a time of at least {SHORTEST:e} s");
    problems.number("time.end", time.end, time.end >= SHORTEST, &expected);
    if let Some(step) = time.max_step {
        problems.above_zero("time.max_step", step, "a time");
    }
    problems.not_negative("time.min_step", time.min_step.unwrap_or(0.0), "a time");
    let shortest = time.shortest();
    if time.max_step.is_some_and(|most| most < shortest) {
        problems.refuse(
            "time.max_step",
            format!("`time.max_step` is below `time.min_step` ({shortest} s)"),
            "no step would be allowed; `time.min_step` is 1e-9 of `time.end` by default",
        );
    }
    let sound = time.safety > 0.0 && time.safety <= 1.0;
    let expected = "a factor above 0 and at most 1";
    problems.number("time.safety", time.safety, sound, expected);
    problems.above_zero("time.step_factor", time.step_factor, "a factor");
    if time.step_factor > 1.0 {
        let factor = time.step_factor;
        problems.warn(format!(
            "`time.step_factor` forces the step to {factor} times what the limits allow"
        ));
    }
    problems.above_zero("time.created_energy", time.created_energy, "a share");
}

fn history_interval(problems: &mut Problems, every: f64, end: f64) {
    problems.above_zero("output.every", every, "a time");
    let rows = end / every;
    if every > 0.0 && rows > ROWS_LIMIT {
        problems.refuse(
            "output.every",
            format!(
                "`output.every` gives {rows:.3e} rows of history, expected at most {ROWS_LIMIT:e}"
            ),
            "make it longer",
        );
    }
}

/// Intervals of the history between frames.
fn frame_interval(problems: &mut Problems, written: Option<f64>, every: f64) -> Option<u64> {
    let between = written?;
    problems.above_zero("output.frames", between, "a time");
    let rows = (between / every).round();
    // The quotient of the two rounded numbers differs from a whole number by at most this.
    if between > 0.0 && every > 0.0 && (rows < 1.0 || (between / every - rows).abs() > 1e-9 * rows)
    {
        problems.refuse(
            "output.frames",
            format!("frames every {between} s do not fall on rows of the history, every {every} s"),
            format!(
                "give a whole multiple of `output.every`, such as {}",
                rows.max(1.0) * every
            ),
        );
    }
    Some(rows as u64)
}

fn coupling(problems: &mut Problems, coupling: &Coupling) {
    let window = f64::from(coupling.window);
    problems.number("coupling.window", window, window >= 1.0, "1 step or more");
    for (key, seconds) in [
        ("deadline", coupling.deadline),
        ("start_deadline", coupling.start_deadline),
    ] {
        // At most a day: longer waits are not useful, and Duration overflows for much longer ones.
        let sound = seconds > 0.0 && seconds <= 86_400.0;
        let expected = "a time above 0 and at most 86400 s";
        problems.number(&format!("coupling.{key}"), seconds, sound, expected);
    }
    if let Some(skin) = coupling.skin {
        problems.above_zero("coupling.skin", skin, "a length");
    }
}

/// Writes the numbers of CSV references into the document, so that the resolved scene needs no other file.
fn inline_tables(document: &mut Document, checks: &[Check]) {
    let numbers = |row: &[f64; 2]| Value::Array(row.iter().map(|x| Value::Float(*x)).collect());
    for (i, check) in checks.iter().enumerate() {
        let Some(Reference::Table(rows)) = &check.expected.reference else {
            continue;
        };
        let points = Value::Array(rows.iter().map(numbers).collect());
        let table = toml::Table::from_iter(BTreeMap::from([("points".to_owned(), points)]));
        document.replace(&format!("check.{i}.reference"), Value::Table(table));
    }
}
