//! The table of contact laws: one row for each law, with its parameters. Names, checks, capabilities and the reference in
//! docs/scene-format.md follow from the rows.
//!
//! A new law is a variant of [`ContactLaw`], whose doc comments explain its parameters, a row here, and a type in the
//! solver.

use super::fault::Faults;
use super::law::{ContactLaw, ratio_of_restitution};

/// One parameter of a contact law.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its key.
    pub name: &'static str,
    /// Its unit; empty for a ratio.
    pub unit: &'static str,
    /// The value that it has where it is left out; `None`: it must be written.
    pub default: Option<f64>,
    /// Whether a finite value is allowed.
    pub allows: fn(f64) -> bool,
    /// What is allowed, such as "a stiffness above 0".
    pub expected: &'static str,
    /// The capability that any value but the default asks for.
    pub feature: Option<&'static str>,
    /// The only kind of contact for which it may differ from 0; `None` if it may for both.
    pub only: Option<Between>,
}

impl Parameter {
    /// Whether it is in proportion to the thickness. Stresses, ratios and coefficients are not.
    pub fn is_per_metre(&self) -> bool {
        !["", "Pa"].contains(&self.unit)
    }
}

/// One contact law.
#[derive(Debug)]
pub struct LawRow {
    /// Its key.
    pub name: &'static str,
    /// Its parameters; the first is the normal stiffness.
    pub parameters: &'static [Parameter],
}

const STIFFNESS: Parameter = Parameter {
    name: "normal_stiffness",
    unit: "N/m",
    default: None,
    allows: |k| k > 0.0,
    expected: "a stiffness above 0",
    feature: None,
    only: None,
};
const TANGENTIAL: Parameter = Parameter {
    name: "tangential_stiffness",
    default: Some(0.0),
    allows: |k| k >= 0.0,
    expected: "a stiffness of 0 or more",
    ..STIFFNESS
};
const FRICTION: Parameter = Parameter {
    name: "friction",
    unit: "",
    expected: "a coefficient of 0 or more",
    feature: Some("feature:friction"),
    ..TANGENTIAL
};
const DAMPING: Parameter = Parameter {
    name: "damping_ratio",
    unit: "",
    default: Some(0.0),
    allows: |zeta| zeta >= 0.0,
    // A restitution below exp(-2) needs more than critical damping, since the contact never pulls.
    expected: "0 (elastic) or more, where 1 is critical",
    feature: Some("feature:damping"),
    only: None,
};
const DAMPED_MASS: Parameter = Parameter {
    name: "damped_mass",
    unit: "kg/m",
    default: Some(0.0),
    allows: |mass| mass >= 0.0,
    expected: "a mass of 0 or more",
    feature: Some("feature:damped_mass"),
    // Not between bodies: a body is rigid, so the mass of a pair of bodies is the mass that has to be damped.
    only: Some(Between::PointsAndBodies),
};
const ADHESION: Parameter = Parameter {
    name: "adhesion",
    unit: "Pa",
    expected: "a stress of 0 or more",
    feature: Some("feature:adhesion"),
    ..TANGENTIAL
};
const ROLLING: Parameter = Parameter {
    name: "rolling_friction",
    feature: Some("feature:rolling_friction"),
    only: Some(Between::Bodies),
    ..FRICTION
};
const HERTZ: Parameter = Parameter {
    name: "hertz_constant",
    unit: "N/m^1.5",
    ..STIFFNESS
};
const POISSON: Parameter = Parameter {
    name: "poisson_ratio",
    unit: "",
    allows: |nu| (0.0..=0.5).contains(&nu),
    expected: "0 to 0.5",
    ..TANGENTIAL
};
const RESTITUTION: Parameter = Parameter {
    name: "restitution",
    unit: "",
    default: Some(1.0),
    allows: |e| e > 0.0 && e <= 1.0,
    expected: "above 0, at most 1 (elastic)",
    feature: Some("feature:damping"),
    only: None,
};
const AREA: Parameter = Parameter {
    name: "area_stiffness",
    unit: "N/m^2",
    ..STIFFNESS
};

/// All contact laws.
pub const LAWS: [LawRow; 4] = [
    LawRow {
        name: "linear",
        parameters: &[STIFFNESS, TANGENTIAL, FRICTION, DAMPING, DAMPED_MASS],
    },
    LawRow {
        name: "granular",
        parameters: &[
            STIFFNESS,
            TANGENTIAL,
            FRICTION,
            DAMPING,
            DAMPED_MASS,
            ADHESION,
            ROLLING,
        ],
    },
    LawRow {
        name: "hertz_mindlin",
        parameters: &[HERTZ, POISSON, FRICTION, RESTITUTION, ADHESION],
    },
    LawRow {
        name: "area",
        parameters: &[AREA, TANGENTIAL, FRICTION],
    },
];

/// Who is in contact by a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// Points and bodies.
    PointsAndBodies,
    /// Bodies.
    Bodies,
}

impl ContactLaw {
    /// The law's row in [`LAWS`], and its numbers in the order of the row's parameters.
    fn entry(&mut self) -> (&'static LawRow, Vec<&mut f64>) {
        let (row, numbers) = match self {
            Self::Linear {
                normal_stiffness: k_n,
                tangential_stiffness: k_t,
                friction: mu,
                damping_ratio: zeta,
                damped_mass: m,
            } => (0, vec![k_n, k_t, mu, zeta, m]),
            Self::Granular {
                normal_stiffness: k_n,
                tangential_stiffness: k_t,
                friction: mu,
                damping_ratio: zeta,
                damped_mass: m,
                adhesion,
                rolling_friction: mu_r,
            } => (1, vec![k_n, k_t, mu, zeta, m, adhesion, mu_r]),
            Self::HertzMindlin {
                hertz_constant: k,
                poisson_ratio: nu,
                friction: mu,
                restitution: e,
                adhesion,
            } => (2, vec![k, nu, mu, e, adhesion]),
            Self::Area {
                area_stiffness: k_a,
                tangential_stiffness: k_t,
                friction: mu,
            } => (3, vec![k_a, k_t, mu]),
        };
        (&LAWS[row], numbers)
    }

    /// The law's row in [`LAWS`].
    pub fn row(mut self) -> &'static LawRow {
        self.entry().0
    }

    /// Its parameters with their values.
    pub fn numbers(mut self) -> impl Iterator<Item = (&'static Parameter, f64)> {
        let (row, values) = self.entry();
        let values: Vec<f64> = values.into_iter().map(|value| *value).collect();
        row.parameters.iter().zip(values)
    }

    /// The law of a metre of thickness whose law this is of `thickness` (m).
    #[must_use]
    pub fn per_metre(mut self, thickness: f64) -> Self {
        let (row, values) = self.entry();
        for (parameter, value) in row.parameters.iter().zip(values) {
            if parameter.is_per_metre() {
                *value /= thickness;
            }
        }
        self
    }

    /// Its name in a scene.
    pub fn name(&self) -> &'static str {
        self.row().name
    }

    /// Whether two laws differ in numbers only; `linear` is `granular` without adhesion and rolling friction. A table of laws
    /// by surfaces that are all like one another needs a single contact loop.
    pub fn is_like(&self, other: &Self) -> bool {
        let [one, two] = [self, other].map(|law| law.name().replace("granular", "linear"));
        one == two
    }

    /// The capabilities that its values need, each with the parameter that needs it.
    pub fn features(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let used = self
            .numbers()
            .filter(|(p, value)| p.default != Some(*value));
        used.filter_map(|(p, _)| Some((p.feature?, p.name)))
    }

    /// The number of a parameter, if the law has it.
    fn number(self, name: &str) -> Option<f64> {
        let found = self.numbers().find(|(parameter, _)| parameter.name == name);
        found.map(|(_, value)| value)
    }

    /// mu.
    pub fn friction(self) -> f64 {
        self.number(FRICTION.name).unwrap_or(0.0)
    }

    /// Damping as a fraction of critical.
    pub fn damping_ratio(self) -> f64 {
        let restitution = self.number(RESTITUTION.name);
        let ratio = restitution.map(ratio_of_restitution);
        ratio.or(self.number(DAMPING.name)).unwrap_or(0.0)
    }

    /// Normal and tangential stiffness in N/m, where the law has constant ones.
    fn stiffnesses(self) -> Option<[f64; 2]> {
        Some([self.number(STIFFNESS.name)?, self.number(TANGENTIAL.name)?])
    }

    /// The larger of normal and tangential stiffness in N/m, where the law has a constant one.
    pub fn constant_stiffness(&self) -> Option<f64> {
        self.stiffnesses()
            .map(|[normal, tangential]| normal.max(tangential))
    }

    /// Finds the impossible values, in the order of the row.
    pub(super) fn look(&self, found: &mut Faults<'_>, between: Between) {
        let mut found = found.at(self.name());
        for (p, value) in self.numbers() {
            let mut refuse = |expected: &str, help| {
                let value = format!("{value} {}", p.unit).trim_end().to_owned();
                found.add(p.name, value, expected, help);
            };
            if !(value.is_finite() && (p.allows)(value)) {
                refuse(p.expected, "");
            } else if value != 0.0 && p.only.is_some_and(|only| only != between) {
                match between {
                    Between::PointsAndBodies => refuse(
                        "0 between points and bodies",
                        "a material point does not rotate: leave it out",
                    ),
                    Between::Bodies => refuse(
                        "0 between bodies",
                        "between bodies the dashpots damp the mass of the pair: leave it out",
                    ),
                }
            } else if p.name == TANGENTIAL.name {
                if value == 0.0 && self.friction() > 0.0 {
                    let help = "friction acts through a tangential spring: set it; usual values are 0.05 to 0.5 times `normal_stiffness`";
                    refuse("a stiffness above 0, since `friction` is above 0", help);
                }
                // The force message has one stiffness for each point, from which the step limit follows (PROTOCOL.md
                // F-6).
                if let Some([normal, _]) = self.stiffnesses()
                    && value > normal
                {
                    let help = "elastic bodies are softer along a contact than across it";
                    refuse(&format!("at most the normal stiffness, {normal} N/m"), help);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names of the rows are those that serde writes, and every parameter is where its name says.
    #[test]
    fn rows_are_the_laws_as_they_are_written() {
        let schema = schemars::schema_for!(ContactLaw).to_value();
        let laws = schema["oneOf"].as_array().unwrap();
        assert_eq!(laws.len(), LAWS.len());
        for (row, law) in LAWS.iter().zip(laws) {
            let numbers: serde_json::Map<String, serde_json::Value> = (2..)
                .zip(row.parameters)
                .map(|(i, p)| (p.name.to_owned(), f64::from(i).into()))
                .collect();
            let known = law["properties"][row.name]["properties"]
                .as_object()
                .unwrap();
            assert!(
                known.keys().all(|key| numbers.contains_key(key)),
                "{}",
                row.name
            );
            let text = serde_json::json!({ row.name: numbers });
            let law: ContactLaw = serde_json::from_value(text).unwrap();
            assert_eq!(law.name(), row.name);
            let values: Vec<f64> = law.numbers().map(|(_, value)| value).collect();
            let expected: Vec<f64> = (2..).map(f64::from).take(values.len()).collect();
            assert_eq!(values, expected, "{}", row.name);
            for ((p, after), before) in law.per_metre(0.5).numbers().zip(values) {
                let of_thickness = p.unit.contains("N/m") || p.unit.contains("kg/m");
                let factor = if of_thickness { 2.0 } else { 1.0 };
                assert_eq!(after, factor * before, "{}", p.name);
            }
            for p in row.parameters {
                assert!(
                    p.default.is_none_or(|value| (p.allows)(value)),
                    "{}",
                    p.name
                );
            }
        }
    }

    /// The table of docs/scene-format.md: the rows, with the doc comments of [`ContactLaw`]. `granular` has all
    /// parameters of `linear`, the first row, which are in the table once.
    fn reference() -> String {
        let schema = schemars::schema_for!(ContactLaw).to_value();
        let mut lines = vec![
            "| law | parameter | unit | default | allowed | meaning |".to_owned(),
            "| --- | --- | --- | --- | --- | --- |".to_owned(),
        ];
        for (row, law) in LAWS.iter().zip(schema["oneOf"].as_array().unwrap()) {
            let keys = &law["properties"][row.name]["properties"];
            let linear = |name| LAWS[0].parameters.iter().any(|p| p.name == name);
            for p in row.parameters {
                if row.name == "granular" && linear(p.name) {
                    continue;
                }
                let default = p.default.map_or("required".to_owned(), |d| d.to_string());
                let meaning = keys[p.name]["description"].as_str().unwrap();
                let meaning: Vec<&str> = meaning.split_whitespace().collect();
                lines.push(format!(
                    "| `{}` | `{}` | {} | {default} | {} | {} |",
                    row.name,
                    p.name,
                    p.unit,
                    p.expected,
                    meaning.join(" ")
                ));
            }
        }
        lines.join("\n")
    }

    #[test]
    fn the_reference_page_has_every_row() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scene-format.md");
        let page = std::fs::read_to_string(page).unwrap();
        let reference = reference();
        assert!(
            page.contains(&reference),
            "docs/scene-format.md lacks:\n{reference}"
        );
    }
}
