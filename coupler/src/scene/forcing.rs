//! What acts on the continuum besides gravity, walls and bodies, and how it begins: loads, stages, and fields given by
//! expressions. The solver compiles the expressions again; here they are proven to compile.

use std::collections::BTreeMap;

use interface::config::{Forcing, InitialFields, Traction};
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
    let tractions = (0..).zip(&written.traction).map(|(i, traction)| {
        let path = format!("mpm.traction.{i}");
        let names = written.points.iter().map(|group| group.name.as_str());
        let group = names.clone().position(|name| name == traction.points);
        if group.is_none() {
            let message = format!("no group of points \"{}\"", traction.points);
            let help = suggestion(&traction.points, "groups of this scene", names);
            problems.refuse(&format!("{path}.points"), message, help);
        }
        Traction {
            group: group.unwrap_or(0),
            within: traction.within,
            force: traction.force,
        }
    });
    let tractions = tractions.collect();
    Forcing {
        body_force,
        tractions,
        stages: written.stage.clone(),
    }
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

/// Components as the solver compiles them, refused unless they do compile.
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
