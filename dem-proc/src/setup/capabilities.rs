//! The capabilities that the solver lists in Hello ([`interface::config::capability`]).

use interface::config::capability::{CONTACTS, Capabilities, PAIRS, SAVE, SEGMENTS};
use interface::config::laws::LAWS;

/// The capabilities besides contact laws.
const OTHERS: [&str; 23] = [
    SAVE,
    CONTACTS,
    PAIRS,
    SEGMENTS,
    "shape:disc",
    "shape:segment",
    "shape:polygon",
    "shape:rectangle",
    "shape:cluster",
    "motion:free",
    "motion:fixed",
    "motion:driven",
    "motion:guided",
    "motion:pushed",
    "overlap:each_edge",
    "overlap:nearest_edge",
    "overlap:area",
    "inertia:density",
    "inertia:mass",
    "feature:body_contact",
    "feature:contact_resolution",
    "feature:contact_pairs",
    "feature:mixed_kinds",
];

/// All capabilities, with every contact law of the table and the features of its parameters.
pub(crate) fn capabilities() -> Capabilities {
    let mut names = OTHERS.to_vec();
    names.extend(LAWS.iter().map(|law| law.capability));
    let parameters = LAWS.iter().flat_map(|law| law.parameters);
    for feature in parameters.filter_map(|parameter| parameter.feature) {
        if !names.contains(&feature) {
            names.push(feature);
        }
    }
    Capabilities::of(&names)
}
