//! The continua that clauses are judged with: linear hats, FLIP and linear elasticity, which every continuum has.
//! Lengths are around a metre, a wave crosses a cell in a millisecond.

use interface::config::{
    Elasticity, Fill, GroupConfig, MaterialConfig, MaterialModel, MpmConfig, Scheme, ShapeFunction,
    Spacing, Transfer,
};
use interface::message::wire::ImpForce;

/// Grid spacing in m.
pub const CELL: f64 = 0.05;
/// Verlet skin in m.
pub const SKIN: f64 = 0.02;
/// Contact radius of points in m.
pub const RADIUS: f64 = 0.0125;
/// Density in kg/m^3.
pub const DENSITY: f64 = 1000.0;
/// Bulk and shear modulus in Pa.
pub const MODULI: Elasticity = Elasticity {
    bulk_modulus: 1e6,
    shear_modulus: 6e5,
};
/// Distance of neighbouring points in m.
pub const SPACING: f64 = 0.025;
/// Mass of a point in kg/m.
pub const MASS: f64 = DENSITY * SPACING * SPACING;
/// A step in s, a tenth of what is stable.
pub const DT: f64 = 1e-4;

/// A material.
pub fn material(density: f64, moduli: Elasticity) -> MaterialConfig {
    MaterialConfig {
        name: "elastic".into(),
        density,
        model: MaterialModel::LinearElastic(moduli),
    }
}

/// Groups in a domain of 1 m by 1 m; no gravity, nothing at the walls.
pub fn scene(groups: Vec<GroupConfig>) -> MpmConfig {
    MpmConfig {
        scheme: Scheme {
            domain: [[0.0; 2], [1.0; 2]],
            cell: CELL,
            shape: ShapeFunction::Linear,
            transfer: Transfer::Flip,
            ..Scheme::default()
        },
        materials: vec![material(DENSITY, MODULI)],
        groups,
        skin: SKIN,
        threads: 1,
        ..MpmConfig::default()
    }
}

/// Points at rest in a region.
pub fn group(fill: Fill) -> GroupConfig {
    GroupConfig {
        contact_radius: Some(RADIUS),
        ..GroupConfig::at_rest("points", fill, Spacing::Distance(SPACING))
    }
}

/// Points at these places.
pub fn points(positions: &[[f64; 2]]) -> GroupConfig {
    group(Fill::Points {
        positions: positions.to_vec(),
    })
}

/// One point, moving.
pub fn single(velocity: [f64; 2]) -> MpmConfig {
    scene(vec![GroupConfig {
        velocity,
        ..points(&[[0.512, 0.487]])
    }])
}

/// A square of 8 by 8 points with its lower left corner at `lower`, moving.
pub fn block(lower: [f64; 2], velocity: [f64; 2]) -> GroupConfig {
    let upper = lower.map(|x| x + 8.0 * SPACING);
    GroupConfig {
        velocity,
        spacing: Spacing::Counts([8, 8]),
        ..group(Fill::Rectangle { lower, upper })
    }
}

/// One force, and the stiffness behind it.
pub fn push(force: [f64; 2], stiffness: f64) -> ImpForce {
    ImpForce {
        force,
        stiffness,
        ..ImpForce::default()
    }
}
