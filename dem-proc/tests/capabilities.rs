//! The solver lists all that a configuration of bodies can have; the kit (`kit.rs`) shows that it takes what it lists.

use std::collections::BTreeSet;

use dem_proc::Sdem;
use interface::config::capability::SAVE;
use interface::config::{BodyInertia, BodyShape, ContactLaw, Motion, OverlapMeasure};
use interface::solver::DemSolver;
use schemars::{JsonSchema, schema_for};

/// The names of an enum's variants, as a scene writes them.
fn variants<T: JsonSchema>() -> BTreeSet<String> {
    let schema = schema_for!(T).to_value();
    let mut names = BTreeSet::new();
    for variant in schema["oneOf"].as_array().expect("an enum") {
        let lists = ["enum", "required"].into_iter();
        let lists = lists.filter_map(|list| variant[list].as_array()).flatten();
        let texts = lists.chain(variant.get("const"));
        names.extend(texts.filter_map(|name| name.as_str().map(str::to_owned)));
    }
    assert!(names.len() > 1, "{schema}");
    names
}

#[test]
fn every_variant_of_the_configuration_is_listed() {
    let capabilities = Sdem::default().capabilities();
    assert!(capabilities.has(SAVE));
    for (family, known) in [
        ("shape", variants::<BodyShape>()),
        ("law", variants::<ContactLaw>()),
        ("motion", variants::<Motion>()),
        ("overlap", variants::<OverlapMeasure>()),
        ("inertia", variants::<BodyInertia>()),
    ] {
        let listed: BTreeSet<String> = capabilities.members(family).map(str::to_owned).collect();
        assert_eq!(listed, known, "{family}");
    }
}
