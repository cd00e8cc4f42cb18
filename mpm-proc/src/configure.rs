//! From a configuration to a solver that is ready: checks, filling, and the one choice of shape function, transfer and
//! materials.

use interface::config::{
    Leaving, MaterialModel, MpmConfig, Plane, ShapeFunction, Spacing, Transfer as TransferConfig,
    Wall,
};
use interface::solver::{Readiness, Refusal};

use crate::continuum::{Continuum, Scheme};
use crate::fields::Fields;
use crate::fill::{Points, fill, refuse_overlap};
use crate::grid::Grid;
use crate::imps::Imps;
use crate::lanes::LANES;
use crate::limits::stiffest_place;
use crate::material::{
    Constitutive, DruckerPrager, Fluid, LinearElastic, Material, MaterialPoints, Moduli,
    MohrCoulomb, NeoHookean, PlaneStressElastic, VonMises,
};
use crate::measure::Books;
use crate::points::{Cloud, Kind, LaneCopy};
use crate::shape::{CubicBspline, Linear, QuadraticBspline, Shape, Ugimp};
use crate::threads::Threads;
use crate::tiles::Geometry;
use crate::transfer::{Apic, Blend, Flip, Pic, Transfer, Xpic};
use crate::walls::WallNodes;

/// Cells along an axis beyond which tile numbers would no longer fit ([`crate::points`]).
const CELLS_MAX: f64 = 1.0e9;

/// Builds the solver.
///
/// # Errors
/// A [`Refusal`] that names the key.
pub fn build(config: &MpmConfig) -> Result<(Box<dyn Scheme>, Readiness), Refusal> {
    let parts = Parts::new(config)?;
    match (config.shape, config.transfer) {
        (ShapeFunction::QuadraticBspline, t) => match t {
            TransferConfig::Apic => parts.build(|_| QuadraticBspline, Apic),
            _ => parts.with_plain_transfer(|_| QuadraticBspline),
        },
        (ShapeFunction::CubicBspline, t) => match t {
            TransferConfig::Apic => parts.build(|_| CubicBspline, Apic),
            _ => parts.with_plain_transfer(|_| CubicBspline),
        },
        (ShapeFunction::Ugimp, TransferConfig::Apic) => Err(Refusal::new(
            "mpm.transfer",
            "apic needs shape = \"quadratic_bspline\" or \"cubic_bspline\": with ugimp the inertia D_p of eq. 29 \
             changes with the position and has no inverse where a box lies within one cell; use flip, pic or blend",
        )),
        (ShapeFunction::Ugimp, _) => {
            let cell = config.cell;
            parts.with_plain_transfer(move |p: &Points| {
                Ugimp::new(p.sides.map(|s| (0.5 * s / cell).min(0.5)))
            })
        }
        (ShapeFunction::Linear, TransferConfig::Apic) => Err(Refusal::new(
            "mpm.transfer",
            "apic needs shape = \"quadratic_bspline\" or \"cubic_bspline\": with linear hats the inertia D_p of eq. 29 \
             has no inverse at a node; use flip, pic or blend",
        )),
        (ShapeFunction::Linear, _) => parts.with_plain_transfer(|_| Linear),
    }
}

/// Refuses what this solver does not do yet: ignoring it would give a wrong answer without a word.
fn check_leaving(config: &MpmConfig) -> Result<(), Refusal> {
    match config.leaving {
        Leaving::Stop => Ok(()),
        Leaving::Remove => Err(Refusal::new(
            "mpm.leaving",
            "remove is not available; use stop",
        )),
    }
}

/// What does not depend on shape function and transfer.
struct Parts<'a> {
    config: &'a MpmConfig,
    geometry: Geometry,
    points: Vec<Points>,
    threads: Threads,
    notes: Vec<String>,
}

impl<'a> Parts<'a> {
    fn new(config: &'a MpmConfig) -> Result<Self, Refusal> {
        let geometry = geometry(config)?;
        check_scalars(config)?;
        check_choices(config)?;
        check_leaving(config)?;
        let mut notes = Vec::new();
        let mut points = Vec::new();
        for (g, group) in config.groups.iter().enumerate() {
            let key = format!("mpm.groups[{g}]");
            if group.material >= config.materials.len() {
                return Err(Refusal::new(
                    format!("{key}.material"),
                    format!("there is no material number {}", group.material),
                ));
            }
            if !group.velocity.iter().all(|v| v.is_finite()) {
                return Err(Refusal::new(
                    format!("{key}.velocity"),
                    format!("{:?} m/s is not finite", group.velocity),
                ));
            }
            let filled = fill(group, &geometry, &key)?;
            check_box(config, &filled, &key)?;
            note_area(&mut notes, &group.name, &filled);
            note_radius(&mut notes, config, g, &filled);
            points.push(filled);
        }
        refuse_overlap(&config.groups, &points)?;
        let threads = Threads::new(config.threads)
            .map_err(|e| Refusal::new("mpm.threads", format!("{} threads: {e}", config.threads)))?;
        Ok(Self {
            config,
            geometry,
            points,
            threads,
            notes,
        })
    }

    fn with_plain_transfer<const W: usize, S: Shape<W>>(
        self,
        shape: impl Fn(&Points) -> S,
    ) -> Result<(Box<dyn Scheme>, Readiness), Refusal> {
        match self.config.transfer {
            TransferConfig::Pic => self.build(shape, Pic),
            // Stages may change the share of PIC.
            TransferConfig::Flip if !self.config.forcing.stages.is_empty() => {
                self.build(shape, Blend { pic_fraction: 0.0 })
            }
            TransferConfig::Flip => self.build(shape, Flip),
            TransferConfig::Blend { pic_fraction } => self.build(shape, Blend { pic_fraction }),
            TransferConfig::Xpic { order } if order > 0 => self.build(shape, Xpic { order }),
            TransferConfig::Xpic { .. } => Err(Refusal::new(
                "mpm.transfer.xpic.order",
                "0 must be 1 (which is PIC) or more",
            )),
            TransferConfig::Apic => unreachable!("built for the shapes that it goes with"),
        }
    }

    fn build<const W: usize, S: Shape<W>, T: Transfer>(
        self,
        shape: impl Fn(&Points) -> S,
        transfer: T,
    ) -> Result<(Box<dyn Scheme>, Readiness), Refusal>
    where
        T::Affine: LaneCopy,
    {
        let mut clouds = Vec::new();
        let mut first_id = 0;
        for (g, (group, points)) in self.config.groups.iter().zip(&self.points).enumerate() {
            let fields = Fields::new(self.config, g)?;
            let material = &self.config.materials[group.material];
            let blocks = points.positions.len().div_ceil(LANES);
            let mut state =
                constitutive::<W, S>(&material.model, material.density, self.config.plane, blocks);
            fields.prestress(&mut *state, &points.positions)?;
            clouds.push(Cloud::new(
                shape(points),
                state,
                &Kind {
                    mass: material.density * points.box_area(),
                    radius: group.contact_radius.unwrap_or_else(|| half_spacing(points)),
                    sides: points.sides,
                },
                first_id,
                &points.positions,
                &fields.velocities(&points.positions)?,
                fields.loads(&points.positions)?,
            ));
            first_id += points.positions.len() as u64;
        }
        let walls = WallNodes::new(&self.config.walls, self.geometry.cells);
        let mut continuum = Continuum {
            grid: Grid::new(self.geometry, self.config.gravity, walls),
            transfer,
            imps: Imps {
                skin: self.config.skin,
                ..Imps::default()
            },
            touches: Vec::new(),
            loaded: Vec::new(),
            books: Books::default(),
            contact_scheme: self.config.contact_force,
            asks: Vec::new(),
            stress_update: self.config.stress_update,
            loads_of_nodes: Vec::new(),
            stages: self.config.forcing.stages.clone(),
            threads: self.threads,
            drift: 0.0,
            clouds,
        };
        continuum.sort();
        let courant_time = continuum
            .clouds
            .iter()
            .map(|c| self.geometry.cell / c.material.sound_speed())
            .fold(f64::INFINITY, f64::min);
        let omega_sq = continuum
            .clouds
            .iter()
            .map(|c| stiffest_place(&c.shape) * c.material.initial_stiffness())
            .fold(0.0, f64::max)
            / (self.geometry.cell * self.geometry.cell);
        let mut notes = self.notes;
        if omega_sq > 0.0 {
            notes.push(format!(
                "stable without contact up to dt = {:.3e} s at the initial density",
                2.0 / omega_sq.sqrt()
            ));
        }
        let readiness = Readiness {
            items: first_id,
            bytes: continuum.bytes() as u64,
            courant_time: if courant_time.is_finite() {
                courant_time
            } else {
                0.0
            },
            mass_min: continuum
                .clouds
                .iter()
                .map(|c| c.mass)
                .reduce(f64::min)
                .unwrap_or(0.0),
            stiffness_max: 0.0,
            notes,
        };
        Ok((Box::new(continuum), readiness))
    }
}

fn constitutive<const W: usize, S: Shape<W>>(
    model: &MaterialModel,
    density: f64,
    plane: Plane,
    blocks: usize,
) -> Box<dyn Constitutive<W, S>> {
    let moduli = |bulk, shear| Moduli {
        bulk,
        shear,
        density,
    };
    match *model {
        MaterialModel::LinearElastic {
            bulk_modulus,
            shear_modulus,
        } => {
            let moduli = moduli(bulk_modulus, shear_modulus);
            match plane {
                Plane::Strain => points(LinearElastic(moduli), blocks),
                Plane::Stress => points(PlaneStressElastic(moduli), blocks),
            }
        }
        MaterialModel::DruckerPrager {
            bulk_modulus,
            shear_modulus,
            friction_angle,
            dilation_angle,
            cohesion,
            tensile_strength,
        } => points(
            DruckerPrager::new(
                moduli(bulk_modulus, shear_modulus),
                friction_angle.to_radians(),
                dilation_angle.to_radians(),
                cohesion,
                tensile_strength,
            ),
            blocks,
        ),
        MaterialModel::MohrCoulomb {
            bulk_modulus,
            shear_modulus,
            friction_angle,
            dilation_angle,
            cohesion,
            tensile_strength,
        } => points(
            MohrCoulomb::new(
                moduli(bulk_modulus, shear_modulus),
                friction_angle.to_radians(),
                dilation_angle.to_radians(),
                cohesion,
                tensile_strength,
            ),
            blocks,
        ),
        MaterialModel::NeoHookean {
            bulk_modulus,
            shear_modulus,
        } => points(NeoHookean(moduli(bulk_modulus, shear_modulus)), blocks),
        MaterialModel::Fluid {
            bulk_modulus,
            exponent,
            viscosity,
        } => points(
            Fluid {
                bulk: bulk_modulus,
                exponent,
                viscosity,
                density,
            },
            blocks,
        ),
        MaterialModel::VonMises {
            bulk_modulus,
            shear_modulus,
            yield_stress,
            hardening_modulus,
        } => points(
            VonMises {
                moduli: moduli(bulk_modulus, shear_modulus),
                yield_stress,
                hardening: hardening_modulus,
            },
            blocks,
        ),
    }
}

fn points<const W: usize, S: Shape<W>, M: Material>(
    model: M,
    blocks: usize,
) -> Box<dyn Constitutive<W, S>> {
    Box::new(MaterialPoints::new(model, blocks))
}

fn half_spacing(points: &Points) -> f64 {
    0.5 * points.sides[0].min(points.sides[1])
}

fn geometry(config: &MpmConfig) -> Result<Geometry, Refusal> {
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
    })
}

fn check_scalars(config: &MpmConfig) -> Result<(), Refusal> {
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
                format!("mpm.materials[{i}].density"),
                format!("{} kg/m^3 must be above 0", material.density),
            ));
        }
        check_model(&material.model, &format!("mpm.materials[{i}].model"))?;
    }
    for (g, group) in config.groups.iter().enumerate() {
        if let Some(radius) = group.contact_radius
            && !(radius.is_finite() && radius > 0.0)
        {
            return Err(Refusal::new(
                format!("mpm.groups[{g}].contact_radius"),
                format!("{radius} m must be above 0"),
            ));
        }
    }
    Ok(())
}

/// Moduli above zero, angles below 90 degrees, strengths not negative.
fn check_model(model: &MaterialModel, key: &str) -> Result<(), Refusal> {
    let refuse = |name: &str, value: f64, expected: &str| {
        let message = format!("{value} must be {expected}");
        Err(Refusal::new(format!("{key}.{name}"), message))
    };
    let positive = |name: &str, value: f64| match value {
        v if v.is_finite() && v > 0.0 => Ok(()),
        v => refuse(name, v, "above 0"),
    };
    let not_negative = |name: &str, value: f64| match value {
        v if v.is_finite() && v >= 0.0 => Ok(()),
        v => refuse(name, v, "0 or more"),
    };
    match *model {
        MaterialModel::LinearElastic {
            bulk_modulus,
            shear_modulus,
        }
        | MaterialModel::NeoHookean {
            bulk_modulus,
            shear_modulus,
        } => {
            positive("bulk_modulus", bulk_modulus)?;
            positive("shear_modulus", shear_modulus)
        }
        MaterialModel::DruckerPrager {
            bulk_modulus,
            shear_modulus,
            friction_angle,
            dilation_angle,
            cohesion,
            tensile_strength,
        }
        | MaterialModel::MohrCoulomb {
            bulk_modulus,
            shear_modulus,
            friction_angle,
            dilation_angle,
            cohesion,
            tensile_strength,
        } => {
            positive("bulk_modulus", bulk_modulus)?;
            positive("shear_modulus", shear_modulus)?;
            if !(0.0..90.0).contains(&friction_angle) {
                return refuse(
                    "friction_angle",
                    friction_angle,
                    "0 or more and below 90 degrees",
                );
            }
            if !(0.0..=friction_angle).contains(&dilation_angle) {
                // More dilation than friction would create energy.
                return refuse(
                    "dilation_angle",
                    dilation_angle,
                    "between 0 and the friction angle",
                );
            }
            not_negative("cohesion", cohesion)?;
            not_negative("tensile_strength", tensile_strength)
        }
        MaterialModel::Fluid {
            bulk_modulus,
            exponent,
            viscosity,
        } => {
            positive("bulk_modulus", bulk_modulus)?;
            if !(exponent.is_finite() && exponent >= 1.0) {
                return refuse("exponent", exponent, "1 or more");
            }
            not_negative("viscosity", viscosity)
        }
        MaterialModel::VonMises {
            bulk_modulus,
            shear_modulus,
            yield_stress,
            hardening_modulus,
        } => {
            positive("bulk_modulus", bulk_modulus)?;
            positive("shear_modulus", shear_modulus)?;
            positive("yield_stress", yield_stress)?;
            not_negative("hardening_modulus", hardening_modulus)
        }
    }
}

fn check_choices(config: &MpmConfig) -> Result<(), Refusal> {
    if config.plane == Plane::Stress {
        for (i, material) in config.materials.iter().enumerate() {
            if !matches!(material.model, MaterialModel::LinearElastic { .. }) {
                return Err(Refusal::new(
                    "mpm.plane",
                    format!(
                        "stress goes with linear_elastic only: material {i}, '{}', needs the stress out of plane; use strain",
                        material.name
                    ),
                ));
            }
        }
    }
    check_stages(config)?;
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
        if wall == Wall::Periodic {
            return Err(Refusal::new(
                format!("mpm.walls.{name}"),
                "periodic is not available; use open, fixed, slip or friction",
            ));
        }
    }
    Ok(())
}

fn check_stages(config: &MpmConfig) -> Result<(), Refusal> {
    let blends = matches!(
        config.transfer,
        TransferConfig::Flip | TransferConfig::Blend { .. }
    );
    let mut last = f64::NEG_INFINITY;
    for (i, stage) in config.forcing.stages.iter().enumerate() {
        let key = format!("mpm.forcing.stages[{i}]");
        if !(stage.from.is_finite() && stage.from >= last) {
            return Err(Refusal::new(
                format!("{key}.from"),
                format!(
                    "{} s must be finite and not before the stage before it",
                    stage.from
                ),
            ));
        }
        last = stage.from;
        if !(stage.damping.is_finite() && stage.damping >= 0.0) {
            return Err(Refusal::new(
                format!("{key}.damping"),
                format!("{} 1/s must be 0 or more", stage.damping),
            ));
        }
        if let Some(fraction) = stage.pic_fraction
            && !(blends && (0.0..=1.0).contains(&fraction))
        {
            return Err(Refusal::new(
                format!("{key}.pic_fraction"),
                format!("{fraction} must lie between 0 and 1, and needs transfer flip or blend"),
            ));
        }
    }
    Ok(())
}

/// Boxes of uGIMP wider than a cell would reach four nodes.
fn check_box(config: &MpmConfig, points: &Points, key: &str) -> Result<(), Refusal> {
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

fn note_area(notes: &mut Vec<String>, name: &str, points: &Points) {
    if let Some(area) = points.area {
        let filled = points.positions.len() as f64 * points.box_area();
        let error = filled / area - 1.0;
        if error.abs() > 1e-12 {
            notes.push(format!(
                "group '{name}': {} points, area off by {:+.3} %",
                points.positions.len(),
                100.0 * error
            ));
        }
    }
}

/// Jiang 2020 eq. 45, as a check that warns.
fn note_radius(notes: &mut Vec<String>, config: &MpmConfig, group: usize, points: &Points) {
    let Some(radius) = config.groups[group].contact_radius else {
        return;
    };
    let per_cell = match config.groups[group].spacing {
        Spacing::PerCell(n) => f64::from(n),
        _ => config.cell * config.cell / points.box_area(),
    };
    let low = config.cell / per_cell.sqrt();
    if radius < low || radius > config.cell {
        notes.push(format!(
            "group '{}': contact radius {radius} m lies outside {low:.3e} ... {:.3e} m (Jiang 2020 eq. 45)",
            config.groups[group].name, config.cell
        ));
    }
}
