//! Configurations in which all that has a usual value has it.

use std::collections::BTreeMap;

use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactForceScheme, DemConfig, Fill, Forcing, GroupConfig,
    InitialFields, Interface, Lattice, Leaving, MaterialConfig, MaterialModel, Motion, MpmConfig,
    Plane, ShapeFunction, Spacing, StressUpdate, Transfer, Walls,
};

/// A disc at rest.
pub fn plain_continuum() -> MpmConfig {
    MpmConfig {
        domain: [[0.0, 0.0], [1.0, 0.5]],
        cell: 0.25,
        gravity: [0.0; 2],
        shape: ShapeFunction::Ugimp,
        transfer: Transfer::Flip,
        stress_update: StressUpdate::Usf,
        plane: Plane::Strain,
        walls: Walls::default(),
        materials: vec![MaterialConfig {
            name: "rubber".into(),
            density: 1000.0,
            model: MaterialModel::LinearElastic {
                bulk_modulus: 5e6,
                shear_modulus: 3e6,
            },
        }],
        groups: vec![GroupConfig {
            name: "disc".into(),
            material: 0,
            fill: Fill::Disc {
                center: [0.5, 0.25],
                radius: 0.125,
            },
            spacing: Spacing::PerCell(4),
            lattice: Lattice::Grid,
            velocity: [0.0; 2],
            fields: InitialFields::default(),
            contact_radius: None,
            rigid: false,
            keeps_spin: false,
        }],
        contact_force: ContactForceScheme::Point,
        forcing: Forcing::default(),
        constants: BTreeMap::new(),
        leaving: Leaving::Stop,
        grid_contact: None,
        layers: false,
        group_pairs: Vec::new(),
        interface: Interface::Points,
        chains: Vec::new(),
        skin: 0.01,
        probes: Vec::new(),
        threads: 1,
    }
}

pub fn body(shape: BodyShape, motion: Motion) -> BodyConfig {
    BodyConfig {
        name: "ball".into(),
        shape,
        sphero_radius: 0.0,
        inertia: BodyInertia::Density(2000.0),
        position: [0.0, 0.0],
        angle: 0.0,
        velocity: [0.0; 2],
        spin: 0.0,
        motion,
        surface: String::new(),
    }
}

/// A ball at rest.
pub fn plain_bodies() -> DemConfig {
    DemConfig {
        bodies: vec![body(BodyShape::Disc, Motion::Free)],
        skin: 0.01,
        threads: 1,
        ..DemConfig::default()
    }
}
