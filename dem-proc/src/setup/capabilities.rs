//! The capabilities that the solver lists in Hello ([`interface::config::capability`]).

use interface::config::capability::{CONTACTS, Capabilities, PAIRS, SAVE, SEGMENTS, members_of};
use interface::config::laws::LAWS;
use interface::config::{BodyInertia, BodyShape, ContactLaw, Motion, OverlapMeasure};

/// The capabilities besides contact laws and the choices of a body.
const OTHERS: [&str; 8] = [
    SAVE,
    CONTACTS,
    PAIRS,
    SEGMENTS,
    "feature:body_contact",
    "feature:contact_resolution",
    "feature:contact_pairs",
    "feature:mixed_kinds",
];

/// All capabilities: every variant of every choice, and the features of the parameters of every contact law.
pub(crate) fn capabilities() -> Capabilities {
    let mut all = Capabilities::of(&OTHERS).0;
    all.extend(members_of::<ContactLaw>("law"));
    let parameters = LAWS.iter().flat_map(|law| law.parameters);
    for feature in parameters.filter_map(|parameter| parameter.feature) {
        if !all.iter().any(|known| known == feature) {
            all.push(feature.to_owned());
        }
    }
    all.extend(members_of::<BodyShape>("shape"));
    all.extend(members_of::<Motion>("motion"));
    all.extend(members_of::<OverlapMeasure>("overlap"));
    all.extend(members_of::<BodyInertia>("inertia"));
    Capabilities(all)
}
