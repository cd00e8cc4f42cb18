//! The continuum's part of a scene: grid, walls, materials, groups of points.

use std::collections::BTreeMap;

use interface::config::{
    Drift, Fill, GroupConfig, InitialFields, Interface, MaterialConfig, MpmConfig, Spacing,
    StressUpdate, Transfer, Wall,
};

use super::forcing;
use super::geometry;
use super::outline::simple_polygon;
use super::problems::Problems;
use super::written::{MpmWritten, PointsWritten};
use crate::scene::diagnostic::suggestion;

/// Most grid nodes: indices of nodes are 31-bit numbers in solvers and in their graphics.
const NODES_LIMIT: f64 = 2_147_483_648.0;
/// Most points, for the same reason.
const POINTS_LIMIT: f64 = 2_147_483_648.0;

/// The continuum's configuration, unless something was refused. The skin is set later.
pub(super) fn continuum(
    problems: &mut Problems,
    written: &MpmWritten,
    gravity: [f64; 2],
    constants: &BTreeMap<String, f64>,
) -> Option<MpmConfig> {
    grid(problems, written);
    transfer(problems, &written.transfer);
    walls(problems, written);
    if let Some(contact) = &written.grid_contact {
        let key = "mpm.grid_contact.friction";
        problems.not_negative(key, contact.friction, "a coefficient");
    }
    if written.points.is_empty() || written.material.is_empty() {
        let help =
            "a continuum needs a material and a group of points; without one leave `[mpm]` out";
        problems.refuse_key("mpm", "`[mpm]` has no points or no material", help);
    }
    for (i, material) in written.material.iter().enumerate() {
        self::material(problems, &format!("mpm.material.{i}"), material);
    }
    let name_of = |list: &str, i: usize| format!("mpm.{list}.{i}.name");
    let materials = written.material.iter().enumerate();
    problems.distinct(
        "materials",
        materials.map(|(i, m)| (name_of("material", i), m.name.as_str())),
    );
    let groups = written.points.iter().enumerate();
    problems.distinct(
        "groups of points",
        groups.map(|(i, g)| (name_of("points", i), g.name.as_str())),
    );
    let groups = written
        .points
        .iter()
        .enumerate()
        .map(|(i, points)| {
            let path = format!("mpm.points.{i}");
            let (velocity, fields) = forcing::initial(problems, &path, points, constants);
            GroupConfig {
                velocity,
                fields,
                ..group(problems, &path, points, written)
            }
        })
        .collect();
    let forcing = forcing::forcing(problems, written, constants);
    if problems.any() {
        return None;
    }
    Some(MpmConfig {
        domain: written.domain,
        cell: written.cell,
        gravity,
        shape: written.shape,
        transfer: written.transfer,
        stress_update: written.stress_update,
        drift: written.drift.unwrap_or_else(|| drift(written)),
        plane: written.plane,
        walls: written.walls,
        materials: written.material.clone(),
        groups,
        contact_force: written.contact_force,
        forcing,
        constants: constants.clone(),
        leaving: written.leaving,
        grid_contact: written.grid_contact,
        layers: false,
        interface: Interface::Points,
        skin: 0.0,
        threads: 1,
    })
}

/// What goes with the rest of the scheme: strains by the nodes' velocities after the kick want points to move with the
/// same, and contact on the grid does nothing to single points.
fn drift(written: &MpmWritten) -> Drift {
    if written.stress_update == StressUpdate::Usl || written.grid_contact.is_some() {
        Drift::Nodal
    } else {
        Drift::Mapped
    }
}

fn grid(problems: &mut Problems, written: &MpmWritten) {
    let cell = written.cell;
    problems.above_zero("mpm.cell", cell, "a length");
    let [lower, upper] = written.domain;
    if upper[0] <= lower[0] || upper[1] <= lower[1] {
        let message =
            "`mpm.domain` is empty: the second corner must be above and right of the first";
        problems.refuse(
            "mpm.domain",
            message,
            "write [[x_min, y_min], [x_max, y_max]]",
        );
        return;
    }
    if cell <= 0.0 {
        return;
    }
    let cells = [0, 1].map(|axis| (upper[axis] - lower[axis]) / cell);
    let nodes = (cells[0] + 1.0) * (cells[1] + 1.0);
    if nodes > NODES_LIMIT {
        problems.refuse(
            "mpm.cell",
            format!(
                "`mpm.cell` = {cell} m cuts `mpm.domain` of {} m x {} m into {:.3e} cells, expected \
                 at most {NODES_LIMIT:.3e}",
                upper[0] - lower[0],
                upper[1] - lower[1],
                cells[0] * cells[1]
            ),
            "make the cell larger or the domain smaller",
        );
        return;
    }
    for (axis, direction) in ["x", "y"].iter().enumerate() {
        let whole = cells[axis].round();
        // Decimal lengths are not exact in binary: a millionth of a cell is rounding, more is a mistake.
        if (cells[axis] - whole).abs() > 1e-6 || whole < 1.0 {
            let whole = whole.max(1.0);
            problems.refuse(
                "mpm.domain",
                format!(
                    "`mpm.domain` is {} cells long in {direction}, expected a whole number",
                    cells[axis]
                ),
                format!(
                    "end it at {direction} = {} ({whole} cells of {cell} m)",
                    lower[axis] + whole * cell
                ),
            );
        }
    }
}

fn transfer(problems: &mut Problems, transfer: &Transfer) {
    match *transfer {
        Transfer::Blend { pic_fraction: a } => {
            let sound = (0.0..=1.0).contains(&a);
            problems.number(
                "mpm.transfer.blend.pic_fraction",
                a,
                sound,
                "0 (FLIP) to 1 (PIC)",
            );
        }
        Transfer::Xpic { order } => {
            let sound = order >= 1;
            problems.number(
                "mpm.transfer.xpic.order",
                f64::from(order),
                sound,
                "1 (PIC) or more",
            );
        }
        Transfer::Pic | Transfer::Flip | Transfer::Apic => {}
    }
}

fn walls(problems: &mut Problems, written: &MpmWritten) {
    let w = &written.walls;
    for (name, wall) in [
        ("left", w.left),
        ("right", w.right),
        ("bottom", w.bottom),
        ("top", w.top),
    ] {
        if let Wall::Friction { coefficient } = wall {
            let path = format!("mpm.walls.{name}.friction.coefficient");
            problems.not_negative(&path, coefficient, "a coefficient");
        }
    }
    for (a, b, names) in [
        (w.left, w.right, "left and right"),
        (w.bottom, w.top, "bottom and top"),
    ] {
        if (a == Wall::Periodic) != (b == Wall::Periodic) {
            let message = format!("only one of the walls {names} is periodic");
            problems.refuse("mpm.walls", message, "make both periodic or neither");
        }
    }
}

fn material(problems: &mut Problems, path: &str, material: &MaterialConfig) {
    problems.name(&format!("{path}.name"), &material.name);
    problems.above_zero(&format!("{path}.density"), material.density, "a density");
    let model = format!("{path}.model.{}", material.model.key());
    for number in material.model.impossible() {
        let path = format!("{model}.{}", number.key);
        problems.number(&path, number.value, false, number.expected);
    }
    // With both above 0 Poisson's ratio lies within its limits, -1 and 1/2.
    let (bulk, shear) = material.model.moduli();
    let poisson = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear));
    // Rounding of K = E/3, G = E/2 is far below this.
    if bulk > 0.0 && shear > 0.0 && poisson < -1e-6 {
        problems.warn(format!(
            "`{model}` has a negative Poisson's ratio ({poisson:.4}): are K and G exchanged?"
        ));
    }
}

fn group(
    problems: &mut Problems,
    path: &str,
    written: &PointsWritten,
    mpm: &MpmWritten,
) -> GroupConfig {
    problems.name(&format!("{path}.name"), &written.name);
    let known = mpm.material.iter().map(|m| m.name.as_str());
    let material = known.clone().position(|name| name == written.material);
    if material.is_none() {
        problems.refuse(
            &format!("{path}.material"),
            format!("no material \"{}\"", written.material),
            suggestion(&written.material, "materials of this scene", known),
        );
    }
    if written.rigid && mpm.grid_contact.is_none() {
        problems.refuse_key(
            &format!("{path}.rigid"),
            "rigid points touch others on the grid alone, and the scene has no `mpm.grid_contact`",
            "add `[mpm.grid_contact]`, or make it a body of `[dem]`",
        );
    }
    let mut contact_radius = written.contact_radius;
    if fill(problems, path, written, mpm) && spacing(problems, path, written, mpm.cell) {
        let [dx, dy] = geometry::distances(&written.spacing, &written.fill, mpm.cell);
        let distance = (dx * dy).sqrt();
        contact_radius_warning(problems, path, written, mpm.cell, distance);
        contact_radius = contact_radius.or(Some(0.5 * distance));
    }
    if let Some(radius) = written.contact_radius {
        problems.above_zero(&format!("{path}.contact_radius"), radius, "a length");
    }
    GroupConfig {
        name: written.name.clone(),
        material: material.unwrap_or(0),
        fill: written.fill.clone(),
        spacing: written.spacing,
        velocity: [0.0; 2],
        fields: InitialFields::default(),
        contact_radius,
        rigid: written.rigid,
    }
}

/// Jiang 2020 eq. 45, where the scene chooses the radius itself.
fn contact_radius_warning(
    problems: &mut Problems,
    path: &str,
    written: &PointsWritten,
    cell: f64,
    distance: f64,
) {
    let Some(radius) = written.contact_radius else {
        return;
    };
    let slack = 1.0 + 1e-9;
    if radius * slack < distance || radius > cell * slack {
        problems.warn(format!(
            "`{path}.contact_radius` = {radius} m lies outside {distance:.4e} to {cell} m (point distance \
             to cell, Jiang 2020 eq. 45)"
        ));
    }
}

/// Whether the region can be filled.
fn fill(problems: &mut Problems, path: &str, written: &PointsWritten, mpm: &MpmWritten) -> bool {
    let sound = match &written.fill {
        Fill::Disc { radius, .. } => {
            problems.above_zero(&format!("{path}.fill.disc.radius"), *radius, "a length");
            *radius > 0.0
        }
        Fill::Rectangle { lower, upper } => {
            let sound = lower[0] < upper[0] && lower[1] < upper[1];
            if !sound {
                problems.refuse(
                    &format!("{path}.fill.rectangle"),
                    "the rectangle is empty",
                    "`upper` must be above and right of `lower`",
                );
            }
            sound
        }
        Fill::Polygon { vertices } => {
            simple_polygon(problems, &format!("{path}.fill.polygon.vertices"), vertices)
        }
        Fill::Points { positions } => {
            if positions.is_empty() {
                let path = format!("{path}.fill.points.positions");
                problems.refuse(&path, "no positions", "list at least one point");
            }
            !positions.is_empty()
        }
    };
    if sound {
        inside(problems, path, &written.fill, mpm.domain);
    }
    sound
}

fn inside(problems: &mut Problems, path: &str, fill: &Fill, domain: [[f64; 2]; 2]) {
    let [lower, upper] = geometry::fill_bounds(fill);
    let out = (0..2).any(|axis| lower[axis] < domain[0][axis] || upper[axis] > domain[1][axis]);
    if out {
        problems.refuse(
            &format!("{path}.fill"),
            format!(
                "`{path}.fill` reaches from {lower:?} to {upper:?}, outside of `mpm.domain` {:?} to {:?}",
                domain[0], domain[1]
            ),
            "enlarge the domain or move the points",
        );
    }
}

/// Whether the spacing makes sense for the region.
fn spacing(problems: &mut Problems, path: &str, written: &PointsWritten, cell: f64) -> bool {
    let below = |key: &str| format!("{path}.spacing.{key}");
    let before = problems.any();
    match written.spacing {
        Spacing::PerCell(n) => {
            let root = f64::from(n).sqrt().round();
            let square = n > 0 && root * root == f64::from(n);
            let expected = "the square of a whole number: 1, 4, 9, 16, ...";
            problems.number(&below("per_cell"), f64::from(n), square, expected);
        }
        Spacing::Distance(distance) => {
            problems.above_zero(&below("distance"), distance, "a length");
        }
        Spacing::Counts([nx, ny]) => {
            let least = f64::from(nx.min(ny));
            problems.number(
                &below("counts"),
                least,
                nx > 0 && ny > 0,
                "two numbers of 1 or more",
            );
            if !matches!(written.fill, Fill::Rectangle { .. }) {
                let help = "use `spacing.per_cell` or `spacing.distance`";
                problems.refuse(&below("counts"), "`counts` is for rectangles", help);
            }
        }
    }
    // A fault elsewhere only costs the estimate below, which the next run of `check` makes up for.
    if problems.any() || before || cell <= 0.0 {
        return false;
    }
    let points = geometry::points_estimate(&written.fill, &written.spacing, cell);
    if points > POINTS_LIMIT {
        problems.refuse(
            &format!("{path}.spacing"),
            format!("about {points:.3e} points, expected at most {POINTS_LIMIT:.3e}"),
            "space them more widely",
        );
    } else if points < 1.0 {
        problems.refuse(
            &format!("{path}.spacing"),
            format!("`{path}.fill` is smaller than one point's share of area"),
            "space the points more closely",
        );
    }
    true
}
