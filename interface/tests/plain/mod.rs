//! Configurations in which all that has a usual value has it.

use interface::config::{
    BodyConfig, BodyInertia, BodyShape, DemConfig, Fill, GroupConfig, InitialFields, Lattice,
    MaterialConfig, MaterialModel, Motion, MpmConfig, Scheme, ShapeFunction, Spacing,
};

use crate::toys::mpm_config;

/// A disc at rest.
pub fn plain_continuum() -> MpmConfig {
    MpmConfig {
        scheme: Scheme {
            domain: [[0.0, 0.0], [1.0, 0.5]],
            cell: 0.25,
            shape: ShapeFunction::Ugimp,
            ..mpm_config().scheme
        },
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
            keeps_spin: false,
        }],
        skin: 0.01,
        ..mpm_config()
    }
}

pub fn body(shape: BodyShape, motion: Motion) -> BodyConfig {
    BodyConfig {
        name: "ball".into(),
        shape,
        sphero_radius: 0.0,
        inertia: BodyInertia::Density(2000.0),
        motion,
        ..BodyConfig::default()
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
