//! The start of the oracle of a continuum: layers, and points with what is prescribed for them.

use std::sync::Arc;

use interface::config::{ContactForceScheme, MpmConfig, Plane, ShapeFunction};
use nalgebra::Matrix2;

use super::continuum::{Kernel, Reference, Totals};
use super::material::RefPoint;
use crate::expression::{Expression, Meaning};
use crate::fill::{FilledRegion, fill, refuse_overlap};

fn kernel(shape: ShapeFunction, box_in_cells: f64) -> Kernel {
    match shape {
        ShapeFunction::Linear => Kernel::Linear,
        ShapeFunction::Ugimp => Kernel::Ugimp((0.5 * box_in_cells).min(0.5)),
        ShapeFunction::QuadraticBspline => Kernel::Quadratic,
        ShapeFunction::CubicBspline => Kernel::Cubic,
    }
}

/// Formulas in these variables.
fn compiled<const N: usize>(sources: &[String; N], names: &[&str]) -> Option<[Expression; N]> {
    let slot = |name: &str| names.iter().position(|n| *n == name).map(Meaning::Slot);
    let each = sources
        .iter()
        .map(|source| Expression::compile(source, &slot).ok());
    each.collect::<Option<Vec<_>>>()?.try_into().ok()
}

/// Values of formulas in x and y.
fn field<const N: usize>(sources: Option<&[String; N]>, x: [f64; 2]) -> Option<[f64; N]> {
    let Some(sources) = sources else {
        return Some([0.0; N]);
    };
    Some(compiled(sources, &["x", "y"])?.map(|formula| formula.evaluate(&x)))
}

/// Mean distance from a wall in cells of the mass at its nodes, if points `spacing` cells apart fill the half space beside it.
fn touching(kernel: Kernel, spacing: f64) -> f64 {
    let (mut mass, mut moment) = (0.0, 0.0);
    for row in 0..(4.0 / spacing) as usize {
        let y = (row as f64 + 0.5) * spacing;
        mass += kernel.value(y);
        moment += kernel.value(y) * y;
    }
    moment / mass
}

/// The points of a group, with what is prescribed for them.
fn points(
    c: &MpmConfig,
    g: usize,
    of: &FilledRegion,
    kernels: [Kernel; 2],
) -> Option<Vec<RefPoint>> {
    let group = &c.groups[g];
    let material = c.materials.get(group.material)?;
    let (bulk, shear) = material.model.moduli();
    let mut points = Vec::new();
    for &x in &of.positions {
        let more = field(group.fields.velocity.as_ref(), x)?;
        let point = RefPoint {
            group: g,
            x,
            v: [0, 1].map(|a| group.velocity[a] + more[a]),
            start: x,
            was: x,
            touching: [0, 1].map(|a| touching(kernels[a], of.sides[a] / c.cell)),
            mass: material.density * of.box_area(),
            volume: of.box_area(),
            bulk,
            shear,
            model: material.model,
            gradient: Matrix2::identity(),
            thins: c.plane == Plane::Stress,
            turns: group.keeps_spin,
            ..RefPoint::default()
        };
        points.push(point.under(field(group.fields.stress.as_ref(), x)?));
    }
    let tractions = c.forcing.tractions.iter();
    for traction in tractions.filter(|t| t.points == group.name) {
        let is_loaded = |p: &&mut RefPoint| c.is_within(p.start, traction.within);
        let count = points.iter_mut().filter(is_loaded).count() as f64;
        for p in points.iter_mut().filter(is_loaded) {
            p.dead = [0, 1].map(|a| p.dead[a] + traction.force[a] / count);
        }
    }
    for hold in c.forcing.holds.iter().filter(|h| h.points == group.name) {
        let is_held = |p: &&mut RefPoint| c.is_within(p.start, hold.within);
        for p in points.iter_mut().filter(is_held) {
            for a in (0..2).filter(|a| [hold.hold_x, hold.hold_y][*a]) {
                (p.held[a], p.v[a]) = (true, 0.0);
            }
        }
    }
    Some(points)
}

impl Reference {
    /// The layers of a configuration, each with its points in the order of the configuration; `None` where it has something
    /// that is not known here.
    pub fn layers(config: &MpmConfig) -> Option<Vec<Self>> {
        let c = config;
        let cells = [0, 1].map(|a| ((c.domain[1][a] - c.domain[0][a]) / c.cell).round() as i64);
        let empty = Self {
            points: Vec::new(),
            kernels: [Kernel::Linear; 2],
            spread: [Kernel::Linear; 2],
            config: Arc::new(c.clone()),
            cells,
            nodes: Arc::default(),
            pressed: Vec::new(),
            body_force: match &c.forcing.body_force {
                None => None,
                Some(of) => Some(compiled(of, &["x", "y", "t"])?),
            },
            time: 0.0,
            fastest_node: 0.0,
            totals: Totals::default(),
        };
        let (mut layers, mut filled) = (Vec::new(), Vec::new());
        for (g, group) in c.groups.iter().enumerate() {
            let region = fill(group, c.cell, "").ok()?;
            if g == 0 || c.layers || c.grid_contact.is_some() {
                layers.push(empty.clone());
            }
            let layer = layers.last_mut()?;
            layer.kernels = region.sides.map(|side| kernel(c.shape, side / c.cell));
            layer.spread = match c.contact_force {
                ContactForceScheme::Point => layer.kernels,
                ContactForceScheme::NearestNodes => [Kernel::Linear; 2],
                ContactForceScheme::Traction => region
                    .sides
                    .map(|side| kernel(ShapeFunction::Ugimp, side / c.cell)),
            };
            layer.points.extend(points(c, g, &region, layer.kernels)?);
            filled.push(region);
        }
        for layer in &mut layers {
            layer.nodes = Arc::new(layer.between_walls());
        }
        refuse_overlap(c, &filled).ok()?;
        Some(layers)
    }
}
