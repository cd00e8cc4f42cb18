//! Loads on the continuum other than gravity, walls and bodies, and its initial state: loads, stages, and fields given
//! by expressions. The solver compiles the expressions again; here it is checked that they compile.

use std::collections::BTreeMap;

use interface::config::{Forcing, Hold, InitialFields, Probe, Traction};
use mechanics::expression::{Expression, Meaning};

use super::output::suggestion_for;
use super::problems::Problems;
use super::written::{MpmWritten, NumberOrExpression, PointsWritten};
use crate::scene::diagnostic::suggestion;

/// Loads, stages and body force of the continuum.
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
    let tractions = (0..).zip(&written.traction).map(|(i, traction)| Traction {
        group: group_named(
            problems,
            written,
            &format!("mpm.traction.{i}"),
            &traction.points,
        ),
        within: traction.within,
        force: traction.force,
    });
    let tractions = tractions.collect();
    let holds = written.hold.iter().map(|hold| hold.name.as_str());
    names(problems, "hold", "holds", holds);
    let holds = (0..).zip(&written.hold).map(|(i, hold)| Hold {
        name: hold.name.clone(),
        group: group_named(problems, written, &format!("mpm.hold.{i}"), &hold.points),
        within: hold.within,
        hold_x: hold.hold_x,
        hold_y: hold.hold_y,
    });
    let holds = holds.collect();
    Forcing {
        body_force,
        tractions,
        holds,
        stages: written.stage.clone(),
    }
}

/// The probes of a scene.
pub(super) fn probes(problems: &mut Problems, written: &MpmWritten) -> Vec<Probe> {
    let probes = written.probe.iter().map(|probe| probe.name.as_str());
    names(problems, "probe", "probes", probes);
    let probes = (0..).zip(&written.probe).map(|(i, probe)| Probe {
        name: probe.name.clone(),
        group: group_named(problems, written, &format!("mpm.probe.{i}"), &probe.points),
        within: probe.within,
    });
    probes.collect()
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
