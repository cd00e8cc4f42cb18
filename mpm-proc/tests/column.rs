//! The case that speed is measured on: a column of sand or rubber that collapses.

use interface::config::{
    Elasticity, Fill, Frictional, GroupConfig, MaterialConfig, MaterialModel, MpmConfig, Scheme,
    ShapeFunction, Spacing, Transfer, Wall, Walls,
};

/// Rubber.
pub const ELASTIC: MaterialModel = MaterialModel::LinearElastic(Elasticity {
    bulk_modulus: 5.0e5,
    shear_modulus: 3.2e5,
});

/// The same in rate form.
#[allow(dead_code)] // not by all that measure this column
pub const HYPOELASTIC: MaterialModel = MaterialModel::Hypoelastic(Elasticity {
    bulk_modulus: 5.0e5,
    shear_modulus: 3.2e5,
});

/// Dry sand.
pub const SAND: MaterialModel = MaterialModel::DruckerPrager(Frictional {
    bulk_modulus: 5.0e5,
    shear_modulus: 3.2e5,
    friction_angle: 35.0,
    dilation_angle: 0.0,
    cohesion: 0.0,
    tensile_strength: 0.0,
    critical_state: None,
    separates: false,
});

/// A column as wide as high, on a fixed floor against a slip wall, collapsing to the right.
pub fn column(points: usize, threads: usize, model: MaterialModel) -> MpmConfig {
    let cells = ((points as f64 / 4.0).sqrt().round()) as u32;
    let cell = 1.0 / f64::from(cells);
    MpmConfig {
        scheme: Scheme {
            domain: [[0.0, 0.0], [4.0, 2.0]],
            cell,
            shape: ShapeFunction::QuadraticBspline,
            transfer: Transfer::Apic,
            walls: Walls {
                left: Wall::Slip,
                bottom: Wall::Fixed,
                ..Walls::default()
            },
            ..Scheme::default()
        },
        gravity: [0.0, -9.81],
        materials: vec![MaterialConfig {
            name: "sand".into(),
            density: 1500.0,
            model,
        }],
        groups: vec![GroupConfig::at_rest(
            "column",
            Fill::Rectangle {
                lower: [0.0, 0.0],
                upper: [1.0, 1.0],
            },
            Spacing::PerCell(4),
        )],
        threads,
        ..MpmConfig::default()
    }
}
