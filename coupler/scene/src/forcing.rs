//! Loads on the continuum other than gravity, walls and bodies, and its initial state: loads, stages, and fields given
//! by expressions. The solver compiles the expressions again; here it is checked that they compile.

use std::collections::BTreeMap;

use interface::config::{Forcing, InitialFields};
use mechanics::expression::{Expression, Meaning};

use super::output::suggestion_for;
use super::problems::Problems;
use super::written::{MpmWritten, NumberOrExpression, PointsWritten};

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
    let holds = written.hold.iter().map(|hold| hold.name.as_str());
    problems.names("mpm.hold", "holds", holds);
    let probes = written.probe.iter().map(|probe| probe.name.as_str());
    problems.names("mpm.probe", "probes", probes);
    Forcing {
        body_force,
        tractions: written.traction.clone(),
        holds: written.hold.clone(),
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
