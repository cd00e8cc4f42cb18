//! The capabilities that a configuration needs from a solver.

use interface::config::capability::Capabilities;
use interface::config::needs::{Need, missing};
use interface::config::surfaces::ContactPair;
use interface::config::{
    BodyShape, ContactLaw, CriticalState, Frictional, GridContact, Hold, Interface, Lattice,
    MaterialModel, Motion, Probe, Transfer, Wall,
};

use crate::plain::{body, plain_bodies, plain_continuum};

/// Capability, first key and number of keys of each need.
fn said(needs: &[Need]) -> Vec<(&str, &str, usize)> {
    needs
        .iter()
        .map(|need| (need.capability.as_str(), need.key.as_str(), need.places))
        .collect()
}

#[test]
fn a_plain_continuum_needs_its_scheme_and_its_walls() {
    let needs = plain_continuum().needs();
    assert_eq!(
        said(&needs),
        [
            ("shape:ugimp", "mpm.shape", 1),
            ("transfer:flip", "mpm.transfer", 1),
            ("stress_update:usf", "mpm.stress_update", 1),
            ("plane:strain", "mpm.plane", 1),
            ("wall:open", "mpm.walls.left", 4),
            ("material:linear_elastic", "mpm.material.0.model", 1),
            ("fill:disc", "mpm.points.0.fill", 1),
            ("contact_force:point", "mpm.contact_force", 1),
        ]
    );
}

#[test]
fn what_a_continuum_is_asked_for_besides_is_told_by_its_key() {
    let mut config = plain_continuum();
    config.layers = true;
    config.group_pairs = vec![[0, 1]];
    config.groups[0].lattice = Lattice::Outline;
    config.interface = Interface::Segments;
    config.walls.bottom = Wall::Friction { coefficient: 0.5 };
    config.transfer = Transfer::Blend { pic_fraction: 0.01 };
    let within = [[0.0; 2]; 2];
    config.probes = vec![
        Probe {
            name: "middle".into(),
            points: "disc".into(),
            within,
        };
        2
    ];
    config.forcing.holds = vec![Hold {
        name: "left".into(),
        points: "disc".into(),
        within,
        hold_x: true,
        hold_y: false,
    }];
    config.materials[0].model = MaterialModel::DruckerPrager(Frictional {
        bulk_modulus: 1.0,
        shear_modulus: 1.0,
        friction_angle: 30.0,
        dilation_angle: 0.0,
        cohesion: 0.0,
        tensile_strength: 0.0,
        critical_state: Some(CriticalState::Volume(1.1)),
        separates: true,
    });
    config.materials.push(interface::config::MaterialConfig {
        name: "beads".into(),
        density: 1.0,
        model: MaterialModel::MuI(interface::config::material::Inertial {
            bulk_modulus: 1.0,
            shear_modulus: 1.0,
            static_friction: 0.4,
            limit_friction: 0.6,
            inertial_number: 0.3,
            grain_diameter: 1.0,
            grain_density: 1.0,
            volume_rate: 1.0,
        }),
    });
    config.grid_contact = Some(GridContact { friction: 0.0 });
    config.groups[0].keeps_spin = true;
    let needs = config.needs();
    let told = said(&needs);
    for need in [
        ("feature:volume_rate", "mpm.material.1.model", 1),
        ("feature:critical_state", "mpm.material.0.model", 1),
        ("feature:separates", "mpm.material.0.model", 1),
        ("layers", "mpm.layers", 1),
        ("pairs", "group_pair.0", 1),
        ("lattice:outline", "mpm.points.0.lattice", 1),
        ("segments", "mpm.interface", 1),
        ("wall:friction", "mpm.walls.bottom", 1),
        ("wall:open", "mpm.walls.left", 3),
        ("transfer:blend", "mpm.transfer", 1),
        ("feature:probes", "mpm.probe.0", 2),
        ("feature:holds", "mpm.hold.0", 1),
        ("feature:grid_contact", "mpm.grid_contact", 1),
        ("feature:keeps_spin", "mpm.points.0.keeps_spin", 1),
    ] {
        assert!(told.contains(&need), "{need:?} in {told:?}");
    }
}

#[test]
fn laws_of_different_kinds_are_asked_for() {
    let hertz = ContactLaw::HertzMindlin {
        hertz_constant: 1e6,
        poisson_ratio: 0.0,
        friction: 0.0,
        restitution: 1.0,
        adhesion: 0.0,
    };
    let mut config = plain_bodies();
    config.bodies = ["ball", "floor"]
        .map(|surface| {
            let mut body = body(BodyShape::Disc, Motion::Free);
            body.surface = surface.into();
            body
        })
        .into();
    config.point_surfaces = vec!["sand".into()];
    let pair = |a: &str, b: &str, law| ContactPair {
        between: [a.into(), b.into()],
        law,
    };
    let asks = |config: &interface::config::DemConfig| {
        let needs = config.needs();
        let need = |n: &&Need| n.capability == "feature:mixed_kinds";
        needs.iter().find(need).map(|n| (n.key.clone(), n.places))
    };
    config.contact_pairs = vec![
        pair("sand", "floor", ContactLaw::default()),
        pair("sand", "ball", hertz),
    ];
    assert_eq!(asks(&config), Some(("contact_pair.1.law".into(), 1)));
    config.contact_pairs.pop();
    assert_eq!(asks(&config), None);
    // Between bodies, the law of bodies is used.
    config.body_contact = Some(hertz);
    config.contact_pairs.push(pair("ball", "floor", hertz));
    assert_eq!(asks(&config), None);
}

#[test]
fn what_is_missing_is_what_a_named_family_has_not_and_every_verb_that_is_not_said() {
    let square = BodyShape::Rectangle {
        width: 1.0,
        height: 1.0,
    };
    let mut config = plain_bodies();
    config.bodies.push(body(square, Motion::Driven));
    config.interface = Interface::Segments;
    let needs = config.needs();
    let found = |names: &[&str]| {
        let capabilities = Capabilities::of(names);
        let missing = missing(&needs, &capabilities);
        missing
            .iter()
            .map(|need| need.capability.clone())
            .collect::<Vec<_>>()
    };
    // A family that a solver does not list is not checked before Configure, but single words have to be listed.
    assert_eq!(found(&[]), ["segments"]);
    assert_eq!(found(&["segments", "shape:disc"]), ["shape:rectangle"]);
    assert_eq!(
        found(&["shape:disc", "shape:rectangle", "motion:free"]),
        ["segments", "motion:driven"]
    );
    assert!(found(&["segments", "shape:disc", "shape:rectangle"]).is_empty());
}
