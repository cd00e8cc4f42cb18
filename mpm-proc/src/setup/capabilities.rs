//! The capabilities that the solver lists in Hello.

use interface::config::capability::{
    Capabilities, LAYERS, PAIRS, PLASTIC_STRAIN, SAVE, SEGMENTS, STRESS_WORK,
};

/// Families of a configuration with the members that the solver accepts, by their names there.
/// [`crate::setup::configure`] decides which of them can be combined.
const TAKES: [(&str, &[&str]); 10] = [
    (
        "shape",
        &["linear", "ugimp", "quadratic_bspline", "cubic_bspline"],
    ),
    (
        "transfer",
        &[
            "pic",
            "flip",
            "blend",
            "apic",
            "xpic",
            "flip_pic",
            "aflip",
            "flip_xpic",
        ],
    ),
    ("stress_update", &["usf", "usl", "musl", "usavg"]),
    ("plane", &["strain", "stress"]),
    (
        "wall",
        &[
            "open",
            "fixed",
            "slip",
            "tangential",
            "friction",
            "periodic",
            "driven",
        ],
    ),
    (
        "material",
        &[
            "linear_elastic",
            "hypoelastic",
            "drucker_prager",
            "mohr_coulomb",
            "neo_hookean",
            "fluid",
            "von_mises",
            "mu_i",
        ],
    ),
    ("contact_force", &["point", "nearest_nodes", "traction"]),
    ("fill", &["disc", "ring", "rectangle", "polygon", "points"]),
    ("lattice", &["grid", "outline"]),
    (
        "feature",
        &[
            "fields",
            "probes",
            "holds",
            "critical_state",
            "separates",
            "volume_rate",
            "grid_contact",
            "keeps_spin",
        ],
    ),
];

/// The capabilities of the solver.
pub fn capabilities() -> Capabilities {
    let member = |(family, members): &(&str, &'static [&str])| {
        let family = (*family).to_owned();
        members
            .iter()
            .map(move |member| format!("{family}:{member}"))
    };
    let verbs = [SAVE, LAYERS, PAIRS, PLASTIC_STRAIN, SEGMENTS, STRESS_WORK].map(ToOwned::to_owned);
    Capabilities(
        verbs
            .into_iter()
            .chain(TAKES.iter().flat_map(member))
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use interface::config::{
        ContactForceScheme, Fill, Lattice, MaterialModel, Plane, ShapeFunction, StressUpdate,
        Transfer, Wall,
    };
    use schemars::{JsonSchema, schema_for};
    use serde_json::Value;

    use super::*;

    /// Names of the variants of an enum, from the schema of scenes.
    fn variants<T: JsonSchema>() -> Vec<String> {
        let schema = schema_for!(T);
        let schema = schema.as_value();
        let lists = ["oneOf", "anyOf"].iter().filter_map(|k| schema.get(k));
        let alternatives = lists.flat_map(|list| list.as_array().expect("a list"));
        let mut names = Vec::new();
        for schema in alternatives.chain([schema]) {
            let text = |v: &Value| Some(v.as_str()?.to_owned());
            names.extend(schema.get("const").and_then(text));
            for list in ["enum", "required"] {
                let list = schema.get(list).and_then(|l| l.as_array());
                names.extend(list.into_iter().flatten().filter_map(text));
            }
        }
        names
    }

    /// No variant of a configuration is forgotten, and none is made up. A variant that the solver refuses whatever else a
    /// configuration says would have to be named here; there is none.
    #[test]
    fn every_variant_of_the_configuration_is_named() {
        let known = [
            ("shape", variants::<ShapeFunction>()),
            ("transfer", variants::<Transfer>()),
            ("stress_update", variants::<StressUpdate>()),
            ("plane", variants::<Plane>()),
            ("wall", variants::<Wall>()),
            ("material", variants::<MaterialModel>()),
            ("contact_force", variants::<ContactForceScheme>()),
            ("fill", variants::<Fill>()),
            ("lattice", variants::<Lattice>()),
            (
                "feature",
                [
                    "fields",
                    "probes",
                    "holds",
                    "critical_state",
                    "separates",
                    "volume_rate",
                    "grid_contact",
                    "keeps_spin",
                ]
                .map(ToOwned::to_owned)
                .into(),
            ),
        ];
        assert_eq!(known.len(), TAKES.len());
        let capabilities = capabilities();
        for (family, variants) in known {
            let named: BTreeSet<&str> = capabilities.members(family).collect();
            assert_eq!(named.len(), capabilities.members(family).count());
            assert!(variants.len() > 1, "{family}: {variants:?}");
            let variants = variants.iter().map(String::as_str).collect();
            assert_eq!(named, variants, "{family}");
        }
        assert!(capabilities.has(SAVE) && capabilities.has(STRESS_WORK));
        assert!(capabilities.has(PLASTIC_STRAIN));
    }
}
