//! Loads on the continuum other than gravity, walls and bodies, and its initial state: loads, stages, and fields given
//! by expressions. The solver compiles the expressions again; here it is checked that they compile.

use std::collections::BTreeMap;

use interface::config::{Forcing, InitialFields};
use mechanics::expression::{Expression, Meaning};

use super::output::suggestion_for;
use super::problems::Problems;
use super::written::{MpmWritten, NumberOrExpression, PointsWritten};
use crate::scene::diagnostic::suggestion;

/// Loads, stages and body force of the continuum. Probes are checked likewise.
pub(super) fn forcing(
    problems: &mut Problems,
    written: &MpmWritten,
    constants: &BTreeMap<String, f64>,
) -> Forcing {
    let body_force = written.body_force.as_ref().map(|components| {
        field(
            problems,
            "mpm.body_force",
            components,
            constants,
            &["x", "y", "t"],
        )
    });
    for (i, traction) in written.traction.iter().enumerate() {
        let path = format!("mpm.traction.{i}");
        group_named(problems, written, &path, &traction.points);
    }
    let holds = written.hold.iter();
    let holds = holds.map(|hold| (hold.name.as_str(), hold.points.as_str()));
    sets(problems, written, ["hold", "holds"], holds);
    let probes = written.probe.iter();
    let probes = probes.map(|probe| (probe.name.as_str(), probe.points.as_str()));
    sets(problems, written, ["probe", "probes"], probes);
    Forcing {
        body_force,
        tractions: written.traction.clone(),
        holds: written.hold.clone(),
        stages: written.stage.clone(),
    }
}

/// Refuses sets of points, of the given names and groups, that have no good name or no group.
fn sets<'a>(
    problems: &mut Problems,
    written: &MpmWritten,
    [list, what]: [&str; 2],
    sets: impl Iterator<Item = (&'a str, &'a str)> + Clone,
) {
    names(problems, list, what, sets.clone().map(|(name, _)| name));
    for (i, (_, points)) in sets.enumerate() {
        group_named(problems, written, &format!("mpm.{list}.{i}"), points);
    }
}

/// Refuses names of `[[mpm.LIST]]` that cannot be part of a quantity, or that occur twice.
pub(super) fn names<'a>(
    problems: &mut Problems,
    list: &str,
    what: &str,
    names: impl Iterator<Item = &'a str> + Clone,
) {
    let paths = |i: usize| format!("mpm.{list}.{i}.name");
    for (i, name) in names.clone().enumerate() {
        problems.name(&paths(i), name);
    }
    problems.distinct(what, names.enumerate().map(|(i, name)| (paths(i), name)));
}

/// Index of the group of points called `name`, to which `path.points` refers.
pub(super) fn group_named(
    problems: &mut Problems,
    written: &MpmWritten,
    path: &str,
    name: &str,
) -> usize {
    let names = written.points.iter().map(|group| group.name.as_str());
    let found = names.clone().position(|known| known == name);
    if found.is_none() {
        let message = format!("no group of points \"{name}\"");
        let help = suggestion(name, "groups of this scene", names);
        problems.refuse(&format!("{path}.points"), message, help);
    }
    found.unwrap_or(0)
}

/// The uniform part of a group's velocity, and its fields.
pub(super) fn initial(
    problems: &mut Problems,
    path: &str,
    written: &PointsWritten,
    constants: &BTreeMap<String, f64>,
) -> ([f64; 2], InitialFields) {
    let mut fields = InitialFields::default();
    let mut velocity = [0.0; 2];
    match &written.velocity {
        Some([NumberOrExpression::Number(x), NumberOrExpression::Number(y)]) => velocity = [*x, *y],
        Some(components) => {
            let path = format!("{path}.velocity");
            fields.velocity = Some(field(problems, &path, components, constants, &["x", "y"]));
        }
        None => {}
    }
    if let Some(components) = &written.stress {
        let path = format!("{path}.stress");
        fields.stress = Some(field(problems, &path, components, constants, &["x", "y"]));
    }
    (velocity, fields)
}

/// The components as texts that the solver compiles again; refused if they do not compile.
fn field<const N: usize>(
    problems: &mut Problems,
    path: &str,
    components: &[NumberOrExpression; N],
    constants: &BTreeMap<String, f64>,
    variables: &[&str],
) -> [String; N] {
    std::array::from_fn(|i| match &components[i] {
        NumberOrExpression::Number(number) => number.to_string(),
        NumberOrExpression::Expression(source) => {
            let meaning = |name: &str| {
                let slot = variables.iter().position(|variable| *variable == name);
                slot.map(Meaning::Slot)
                    .or_else(|| constants.get(name).copied().map(Meaning::Number))
            };
            if let Err(error) = Expression::compile(source, &meaning) {
                let names = variables
                    .iter()
                    .copied()
                    .chain(constants.keys().map(String::as_str));
                let help = suggestion_for(&error, names);
                problems.refuse_within(
                    &format!("{path}.{i}"),
                    &error.at,
                    &error.message,
                    Some(help),
                );
            }
            source.clone()
        }
    })
}
