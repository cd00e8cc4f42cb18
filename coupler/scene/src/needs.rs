//! Errors for a solver that lacks a capability which the scene needs, or that refuses its configuration, with the lines
//! and keys of the scene.

use interface::config::capability::Capabilities;
use interface::config::needs::{Need, missing};
use interface::message::control::Party;
use interface::solver::Refusal;

use super::Scene;
use super::document::{Document, Part};
use crate::diagnostic::SceneErrors;

/// The refusal of the solver `identity` of `party`, because it lacks a capability that `scene` needs. `None` if it has
/// all capabilities of the families that it lists.
pub fn unmet(
    scene: &Scene,
    party: Party,
    identity: &str,
    capabilities: &Capabilities,
) -> Option<SceneErrors> {
    let (needs, side) = match party {
        Party::Mpm => (scene.mpm.as_ref()?.needs(), "continuum"),
        Party::Dem => (scene.dem.as_ref()?.needs(), "bodies"),
        Party::Coupler => return None,
    };
    let solver = format!("the solver of the {side}, `{identity}`,");
    let diagnostics = missing(&needs, capabilities).into_iter().map(|need| {
        let path = body_or_set(&need.key, &scene.document);
        let message = sentence(need, &path, &scene.document, &solver, capabilities);
        let help = help(need, party);
        scene
            .document
            .diagnostic(&path, Part::Value, &message, Some(help))
    });
    let mut diagnostics: Vec<_> = diagnostics.collect();
    diagnostics.sort_by_key(|diagnostic| diagnostic.place.line());
    (!diagnostics.is_empty()).then_some(SceneErrors(diagnostics))
}

/// The refusal of a solver, reported at the line of the scene.
pub fn refused(scene: &Scene, who: Party, refusal: &Refusal) -> SceneErrors {
    let path = body_or_set(&refusal.key, &scene.document);
    let message = format!("the {who} refuses `{path}`: {}", refusal.message);
    scene.complaint(&path, &message, "")
}

/// "`dem.body.3.shape` asks for polygon, and the solver of the bodies, `disc 0.1`, takes disc, segment only".
fn sentence(
    need: &Need,
    path: &str,
    document: &Document,
    solver: &str,
    capabilities: &Capabilities,
) -> String {
    let unsaid = if document.has(path) {
        ""
    } else {
        ", which is not in the scene and has this value by default,"
    };
    if let Some((family, member)) = need.capability.split_once(':') {
        let taken: Vec<&str> = capabilities.members(family).collect();
        let taken = taken.join(", ");
        format!("`{path}`{unsaid} needs {member}, and {solver} takes only {taken}")
    } else {
        let verb = &need.capability;
        format!("`{path}`{unsaid} needs `{verb}`, which {solver} lacks")
    }
}

fn help(need: &Need, party: Party) -> String {
    let more = match need.places - 1 {
        0 => String::new(),
        1 => "one more key needs the same; ".to_owned(),
        n => format!("{n} more keys need the same; "),
    };
    format!("{more}change the scene, or use another solver (`--{party}`, `solvers.{party}`)")
}

/// The key of a body as the scene has it: a body of a set has none of its own, and the set stands for it.
pub(super) fn body_or_set(key: &str, document: &Document) -> String {
    let Some((index, field)) = key
        .strip_prefix("dem.body.")
        .map(|rest| rest.split_once('.').unwrap_or((rest, "")))
    else {
        return key.to_owned();
    };
    let mut index: usize = index.parse().unwrap_or(0);
    let [bodies, sets] = ["body", "fill"].map(|list| document.list(&["dem", list]));
    if index < bodies.len() {
        return key.to_owned();
    }
    index -= bodies.len();
    for (k, set) in sets.iter().enumerate() {
        let count = set.get("count").and_then(toml::Value::as_integer);
        let count = usize::try_from(count.unwrap_or(0)).unwrap_or(0);
        if index < count {
            let what = if field == "shape" { ".grain" } else { "" };
            return format!("dem.fill.{k}{what}");
        }
        index -= count;
    }
    "dem".to_owned()
}
