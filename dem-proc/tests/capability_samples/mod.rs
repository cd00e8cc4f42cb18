//! A scene for each feature that a configuration can need from a bodies' side, and the comparison of what a solver
//! accepts with its list of capabilities. The names are those of the configuration's own schema, so a new variant needs
//! a scene here.

use interface::config::surfaces::ContactPair;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion, OverlapMeasure,
};
use interface::solver::DemSolver;
use schemars::JsonSchema;

/// The names of an enum's variants, as a scene writes them.
fn variants<T: JsonSchema>() -> Vec<String> {
    let schema = serde_json::to_value(schemars::schema_for!(T)).unwrap();
    let mut names = Vec::new();
    for variant in schema["oneOf"].as_array().expect("an enum") {
        if let Some(name) = variant["const"].as_str() {
            names.push(name.to_owned());
        }
        for name in variant["enum"].as_array().into_iter().flatten() {
            names.push(name.as_str().unwrap().to_owned());
        }
        for name in variant["required"].as_array().into_iter().flatten() {
            names.push(name.as_str().unwrap().to_owned());
        }
    }
    assert!(names.len() > 1, "{schema}");
    names
}

fn linear() -> ContactLaw {
    law("linear")
}

fn law(name: &str) -> ContactLaw {
    match name {
        "linear" => linear_with(0.0, 0.0, 0.0),
        "granular" => granular(0.0, 0.0),
        "hertz_mindlin" => ContactLaw::HertzMindlin {
            hertz_constant: 1e6,
            poisson_ratio: 0.0,
            friction: 0.0,
            restitution: 1.0,
            adhesion: 0.0,
        },
        "area" => ContactLaw::Area {
            area_stiffness: 1e6,
            tangential_stiffness: 0.0,
            friction: 0.0,
        },
        other => panic!("write a sample of law:{other}"),
    }
}

fn linear_with(friction: f64, damping_ratio: f64, damped_mass: f64) -> ContactLaw {
    ContactLaw::Linear {
        normal_stiffness: 1e4,
        tangential_stiffness: 1e4 * friction,
        friction,
        damping_ratio,
        damped_mass,
    }
}

fn granular(adhesion: f64, rolling_friction: f64) -> ContactLaw {
    ContactLaw::Granular {
        normal_stiffness: 1e4,
        tangential_stiffness: 0.0,
        friction: 0.0,
        damping_ratio: 0.0,
        damped_mass: 0.0,
        adhesion,
        rolling_friction,
    }
}

fn shape(name: &str) -> BodyShape {
    match name {
        "disc" => BodyShape::Disc,
        "segment" => BodyShape::Segment {
            ends: [[-0.1, 0.0], [0.1, 0.0]],
        },
        "polygon" => BodyShape::Polygon {
            vertices: vec![[0.0, 0.0], [0.2, 0.0], [0.0, 0.2]],
        },
        "rectangle" => BodyShape::Rectangle {
            width: 0.2,
            height: 0.1,
        },
        "cluster" => BodyShape::Cluster {
            centers: vec![[0.0, 0.0], [0.1, 0.0]],
            radii: Vec::new(),
        },
        other => panic!("write a sample of shape:{other}"),
    }
}

fn motion(name: &str) -> Motion {
    match name {
        "free" => Motion::Free,
        "fixed" => Motion::Fixed,
        "driven" => Motion::Driven,
        "guided" => Motion::Guided {
            hold_x: true,
            hold_y: false,
            hold_angle: false,
        },
        "pushed" => Motion::Pushed {
            force: [1.0, 0.0],
            torque: 0.0,
            ramp: 0.0,
            until: None,
        },
        other => panic!("write a sample of motion:{other}"),
    }
}

fn two(change: impl Fn(&mut BodyConfig)) -> DemConfig {
    let body = |x: f64| {
        let mut body = BodyConfig {
            name: "b".into(),
            shape: BodyShape::Disc,
            sphero_radius: 0.1,
            inertia: BodyInertia::Density(1e3),
            position: [x, 0.0],
            ..BodyConfig::default()
        };
        change(&mut body);
        body
    };
    DemConfig {
        bodies: vec![body(0.0), body(1.0)],
        point_contact: linear(),
        skin: 0.01,
        threads: 1,
        ..DemConfig::default()
    }
}

fn met(point_contact: ContactLaw, body_contact: ContactLaw) -> DemConfig {
    DemConfig {
        point_contact,
        body_contact: Some(body_contact),
        ..two(|_| {})
    }
}

fn feature(name: &str) -> DemConfig {
    match name {
        "friction" => met(linear_with(0.5, 0.0, 0.0), linear_with(0.5, 0.0, 0.0)),
        "damping" => met(linear_with(0.0, 0.2, 0.0), linear_with(0.0, 0.2, 0.0)),
        "rolling_friction" => met(linear(), granular(0.0, 0.1)),
        // Without damping, so that it needs no other capability.
        "damped_mass" => DemConfig {
            point_contact: linear_with(0.0, 0.0, 2.0),
            ..two(|_| {})
        },
        "adhesion" => met(granular(10.0, 0.0), granular(10.0, 0.0)),
        "body_contact" => met(linear(), linear()),
        "contact_resolution" => DemConfig {
            contact_resolution: Some(0.5),
            ..met(linear(), linear())
        },
        "contact_pairs" | "mixed_kinds" => {
            let mut config = met(linear(), linear());
            for body in &mut config.bodies {
                body.surface = "steel".into();
            }
            config.contact_pairs = vec![ContactPair {
                between: ["steel".into(), "steel".into()],
                law: if name == "mixed_kinds" {
                    law("hertz_mindlin")
                } else {
                    linear()
                },
            }];
            config
        }
        other => panic!("write a sample of feature:{other}"),
    }
}

fn overlap(measure: OverlapMeasure) -> DemConfig {
    let mut config = two(|body| {
        body.shape = shape("rectangle");
        body.sphero_radius = if measure == OverlapMeasure::Area {
            0.0
        } else {
            0.01
        };
    });
    config.body_contact = Some(linear());
    config.overlap = measure;
    config
}

/// Every feature by family and member, with a scene that needs it and few others.
fn samples() -> Vec<(&'static str, String, DemConfig)> {
    let mut samples = Vec::new();
    for name in variants::<BodyShape>() {
        let config = two(|body| body.shape = shape(&name));
        samples.push(("shape", name, config));
    }
    for name in variants::<ContactLaw>() {
        let config = met(law(&name), law(&name));
        samples.push(("law", name, config));
    }
    for name in variants::<Motion>() {
        let config = two(|body| body.motion = motion(&name));
        samples.push(("motion", name, config));
    }
    for name in variants::<OverlapMeasure>() {
        let measure = serde_json::from_value(name.clone().into()).unwrap();
        samples.push(("overlap", name, overlap(measure)));
    }
    for name in variants::<BodyInertia>() {
        let inertia = serde_json::from_value(serde_json::json!({ &name: 2.0 })).unwrap();
        samples.push(("inertia", name, two(|body| body.inertia = inertia)));
    }
    let features = [
        "friction",
        "damping",
        "damped_mass",
        "rolling_friction",
        "adhesion",
        "body_contact",
        "contact_resolution",
        "contact_pairs",
        "mixed_kinds",
    ];
    for name in features {
        samples.push(("feature", name.to_owned(), feature(name)));
    }
    samples
}

/// Every variant is listed and taken, or not listed and refused; and nothing is listed that does not exist.
pub fn check<D: DemSolver + Default>() {
    let capabilities = D::default().capabilities();
    let samples = samples();
    for (family, member, config) in &samples {
        let taken = D::default().configure(config);
        let says = capabilities.takes(family, member);
        assert_eq!(taken.is_ok(), says, "{family}:{member}: {taken:?}");
    }
    // How bodies meet, which is no part of a configuration.
    let how = "feature:impulses";
    for name in capabilities.0.iter().filter(|name| *name != how) {
        if let Some((family, member)) = name.split_once(':') {
            let known = samples.iter().any(|(f, m, _)| f == &family && m == member);
            assert!(known, "{name} is no part of a configuration");
        }
    }
}
