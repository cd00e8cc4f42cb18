//! What a configuration is refused for: each check names the key, the value and what would do.

use interface::config::{
    Drift, MaterialModel, MpmConfig, Plane, ShapeFunction, StressUpdate,
    Transfer as TransferConfig, Wall,
};
use interface::solver::Refusal;

use crate::kernel::tiles::Geometry;
use crate::setup::fill::Points;

/// Cells along an axis beyond which tile numbers would no longer fit ([`crate::state::points`]).
const CELLS_MAX: f64 = 1.0e9;

/// The grid of a configuration.
///
/// # Errors
/// A [`Refusal`] that names the key.
pub fn geometry(config: &MpmConfig) -> Result<Geometry, Refusal> {
    let [lower, upper] = config.domain;
    let refuse = |key: &str, message: String| Err(Refusal::new(key, message));
    if !(config.cell.is_finite() && config.cell > 0.0) {
        return refuse("mpm.cell", format!("{} m must be above 0", config.cell));
    }
    let mut cells = [0_i64; 2];
    for a in 0..2 {
        let axis = ["x", "y"][a];
        let size = upper[a] - lower[a];
        if !(size.is_finite() && size > 0.0) {
            return refuse(
                "mpm.domain",
                format!(
                    "from {} to {} m along {axis} is not an interval",
                    lower[a], upper[a]
                ),
            );
        }
        let exact = size / config.cell;
        let count = exact.round();
        if count > CELLS_MAX {
            return refuse(
                "mpm.domain",
                format!("{exact:.3e} cells along {axis}; at most {CELLS_MAX:.0e} can be numbered"),
            );
        }
        // The scene writes decimals, whose quotient is whole only up to rounding.
        if count < 1.0 || (exact - count).abs() > 1e-6 {
            let cell = size / count.max(1.0);
            return refuse(
                "mpm.domain",
                format!(
                    "{size} m along {axis} is not a whole number of cells of {} m ({exact:.6}); make it {} m, or the cell {cell} m",
                    config.cell,
                    count.max(1.0) * config.cell
                ),
            );
        }
        cells[a] = count as i64;
    }
    Ok(Geometry {
        lower,
        upper,
        cells,
        cell: config.cell,
        periodic: [config.walls.left, config.walls.bottom].map(|w| w == Wall::Periodic),
    })
}

/// Numbers that must be finite, or above zero.
///
/// # Errors
/// A [`Refusal`] that names the key.
pub fn check_scalars(config: &MpmConfig) -> Result<(), Refusal> {
    if !config.gravity.iter().all(|g| g.is_finite()) {
        return Err(Refusal::new(
            "mpm.gravity",
            format!("{:?} m/s^2 is not finite", config.gravity),
        ));
    }
    if !(config.skin.is_finite() && config.skin >= 0.0) {
        return Err(Refusal::new(
            "mpm.skin",
            format!("{} m must be 0 or more", config.skin),
        ));
    }
    if let TransferConfig::Blend { pic_fraction } = config.transfer
        && !(0.0..=1.0).contains(&pic_fraction)
    {
        return Err(Refusal::new(
            "mpm.transfer.blend.pic_fraction",
            format!("{pic_fraction} must lie between 0 (FLIP) and 1 (PIC)"),
        ));
    }
    for (i, material) in config.materials.iter().enumerate() {
        if !(material.density.is_finite() && material.density > 0.0) {
            return Err(Refusal::new(
                format!("mpm.material.{i}.density"),
                format!("{} kg/m^3 must be above 0", material.density),
            ));
        }
        if let Some(number) = material.model.impossible().first() {
            let model = material.model.key();
            return Err(Refusal::new(
                format!("mpm.material.{i}.model.{model}.{}", number.key),
                format!("{} must be {}", number.value, number.expected),
            ));
        }
    }
    if let Some(contact) = &config.grid_contact
        && !(contact.friction.is_finite() && contact.friction >= 0.0)
    {
        return Err(Refusal::new(
            "mpm.grid_contact.friction",
            format!("{} must be 0 or more", contact.friction),
        ));
    }
    // Measured: with uGIMP it gains energy within tens of steps, the more quickly the shorter they are; with hats and
    // B-splines it does not (docs/results/verification.md).
    if config.grid_contact.is_some()
        && config.stress_update == StressUpdate::Usl
        && config.shape == ShapeFunction::Ugimp
    {
        return Err(Refusal::new(
            "mpm.stress_update",
            "usl is unstable with grid_contact and shape = \"ugimp\"; write \"usf\", or a B-spline for the shape",
        ));
    }
    let walls = &config.walls;
    let all = [walls.left, walls.right, walls.bottom, walls.top];
    if config.grid_contact.is_some() && all.contains(&Wall::Periodic) {
        return Err(Refusal::new(
            "mpm.walls",
            "periodic walls do not go with grid_contact: grains would not feel each other across them",
        ));
    }
    if config.drift == Drift::Mapped {
        let instead = if config.stress_update == StressUpdate::Usl {
            Some("usl, which strains by the velocities of the nodes after the kick")
        } else if config.grid_contact.is_some() {
            Some("grid_contact, which presses on nodes and not on points")
        } else {
            None
        };
        if let Some(what) = instead {
            return Err(Refusal::new(
                "mpm.drift",
                format!("mapped does not go with {what}; write \"nodal\", or leave it out"),
            ));
        }
    }
    for (g, group) in config.groups.iter().enumerate() {
        check_rigid(config, g)?;
        if let Some(radius) = group.contact_radius
            && !(radius.is_finite() && radius > 0.0)
        {
            return Err(Refusal::new(
                format!("mpm.points.{g}.contact_radius"),
                format!("{radius} m must be above 0"),
            ));
        }
    }
    Ok(())
}

/// Points that move as one have others to touch, one velocity and no stress.
fn check_rigid(config: &MpmConfig, g: usize) -> Result<(), Refusal> {
    let group = &config.groups[g];
    let refuse = |name: &str, message: &str| {
        let key = format!("mpm.points.{g}.{name}");
        Err(Refusal::new(key, message))
    };
    match group {
        group if !group.rigid => Ok(()),
        _ if config.grid_contact.is_none() => refuse("rigid", "needs mpm.grid_contact"),
        group if group.fields.velocity.is_some() => refuse(
            "velocity",
            "must be the same for all points of a rigid group",
        ),
        group if group.fields.stress.is_some() => refuse("stress", "a rigid group has none"),
        _ => Ok(()),
    }
}

/// Choices that do not go together.
///
/// # Errors
/// A [`Refusal`] that names the key.
pub fn check_choices(config: &MpmConfig) -> Result<(), Refusal> {
    if config.plane == Plane::Stress {
        for (i, material) in config.materials.iter().enumerate() {
            if !matches!(
                material.model,
                MaterialModel::LinearElastic { .. } | MaterialModel::Hypoelastic { .. }
            ) {
                return Err(Refusal::new(
                    "mpm.plane",
                    format!(
                        "stress goes with linear_elastic and hypoelastic only: material {i}, '{}', needs the stress out of plane; use strain",
                        material.name
                    ),
                ));
            }
        }
    }
    let walls = &config.walls;
    for (name, wall) in [
        ("left", walls.left),
        ("right", walls.right),
        ("bottom", walls.bottom),
        ("top", walls.top),
    ] {
        if let Wall::Friction { coefficient } = wall
            && !(coefficient.is_finite() && coefficient >= 0.0)
        {
            return Err(Refusal::new(
                format!("mpm.walls.{name}.friction.coefficient"),
                format!("{coefficient} must be 0 or more"),
            ));
        }
    }
    for (names, a, b) in [
        (["left", "right"], walls.left, walls.right),
        (["bottom", "top"], walls.bottom, walls.top),
    ] {
        if (a == Wall::Periodic) != (b == Wall::Periodic) {
            let other = names[usize::from(a == Wall::Periodic)];
            return Err(Refusal::new(
                format!("mpm.walls.{other}"),
                format!(
                    "only one of {} and {} is periodic; make both so or neither",
                    names[0], names[1]
                ),
            ));
        }
    }
    Ok(())
}

/// Boxes of uGIMP wider than a cell would reach four nodes.
///
/// # Errors
/// A [`Refusal`] that names the key.
pub fn check_box(config: &MpmConfig, points: &Points, key: &str) -> Result<(), Refusal> {
    let widest = points.sides[0].max(points.sides[1]);
    if config.shape == ShapeFunction::Ugimp && widest > config.cell * (1.0 + 1e-9) {
        return Err(Refusal::new(
            format!("{key}.spacing"),
            format!(
                "ugimp needs boxes no wider than a cell: a spacing of {widest} m exceeds the cell of {} m",
                config.cell
            ),
        ));
    }
    Ok(())
}
