//! The solvers' parts of a scene: continuum, bodies, contact laws.

use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Fill, GroupConfig, MaterialConfig,
    MaterialModel, Motion, MpmConfig, Spacing, Transfer, Wall,
};

use super::geometry::{self, NotSimple};
use super::problems::Problems;
use super::written::{BodyWritten, DemWritten, MpmWritten, PointsWritten, SceneWritten};
use crate::diagnostic::suggestion;

/// Most grid nodes: indices of nodes are 31-bit numbers in solvers and in their graphics.
const NODES_LIMIT: f64 = 2_147_483_648.0;
/// Most points, for the same reason.
const POINTS_LIMIT: f64 = 2_147_483_648.0;
/// A fixed or driven body's mass moves nothing; its density where the scene does not say, in kg/m^3.
const DENSITY_OF_UNMOVED: f64 = 1000.0;

/// The continuum's configuration, unless something was refused. The skin is set later.
pub(super) fn continuum(
    problems: &mut Problems,
    written: &MpmWritten,
    gravity: [f64; 2],
) -> Option<MpmConfig> {
    grid(problems, written);
    transfer(problems, &written.transfer);
    walls(problems, written);
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
        .map(|(i, points)| group(problems, &format!("mpm.points.{i}"), points, written))
        .collect();
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
        plane: written.plane,
        walls: written.walls,
        materials: written.material.clone(),
        groups,
        skin: 0.0,
        threads: 1,
    })
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
    let below = |model: &str, key: &str| format!("{path}.model.{model}.{key}");
    match material.model {
        MaterialModel::LinearElastic {
            bulk_modulus,
            shear_modulus,
        } => moduli(
            problems,
            path,
            "linear_elastic",
            bulk_modulus,
            shear_modulus,
        ),
        MaterialModel::NeoHookean {
            bulk_modulus,
            shear_modulus,
        } => moduli(problems, path, "neo_hookean", bulk_modulus, shear_modulus),
        MaterialModel::DruckerPrager {
            bulk_modulus,
            shear_modulus,
            friction_angle,
            dilation_angle,
            cohesion,
            tensile_strength,
        } => {
            moduli(
                problems,
                path,
                "drucker_prager",
                bulk_modulus,
                shear_modulus,
            );
            let strength = [friction_angle, dilation_angle, cohesion, tensile_strength];
            frictional(problems, path, "drucker_prager", strength);
        }
        MaterialModel::MohrCoulomb {
            bulk_modulus,
            shear_modulus,
            friction_angle,
            dilation_angle,
            cohesion,
            tensile_strength,
        } => {
            moduli(problems, path, "mohr_coulomb", bulk_modulus, shear_modulus);
            let strength = [friction_angle, dilation_angle, cohesion, tensile_strength];
            frictional(problems, path, "mohr_coulomb", strength);
        }
        MaterialModel::Fluid {
            bulk_modulus,
            exponent,
            viscosity,
        } => {
            problems.above_zero(&below("fluid", "bulk_modulus"), bulk_modulus, "a modulus");
            problems.above_zero(&below("fluid", "exponent"), exponent, "an exponent");
            problems.not_negative(&below("fluid", "viscosity"), viscosity, "a viscosity");
        }
        MaterialModel::VonMises {
            bulk_modulus,
            shear_modulus,
            yield_stress,
            hardening_modulus,
        } => {
            moduli(problems, path, "von_mises", bulk_modulus, shear_modulus);
            problems.above_zero(
                &below("von_mises", "yield_stress"),
                yield_stress,
                "a stress",
            );
            let path = below("von_mises", "hardening_modulus");
            problems.not_negative(&path, hardening_modulus, "a modulus");
        }
    }
}

fn moduli(problems: &mut Problems, path: &str, model: &str, bulk: f64, shear: f64) {
    let below = |key: &str| format!("{path}.model.{model}.{key}");
    problems.above_zero(&below("bulk_modulus"), bulk, "a modulus");
    problems.above_zero(&below("shear_modulus"), shear, "a modulus");
    // With both above 0 Poisson's ratio lies within its limits, -1 and 1/2.
    let poisson = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear));
    // Rounding of K = E/3, G = E/2 is far below this.
    if bulk > 0.0 && shear > 0.0 && poisson < -1e-6 {
        problems.warn(format!(
            "`{path}.model.{model}` has a negative Poisson's ratio ({poisson:.4}): are K and G exchanged?"
        ));
    }
}

fn frictional(problems: &mut Problems, path: &str, model: &str, strength: [f64; 4]) {
    let [friction, dilation, cohesion, tension] = strength;
    let below = |key: &str| format!("{path}.model.{model}.{key}");
    let sound = (0.0..90.0).contains(&friction);
    problems.number(
        &below("friction_angle"),
        friction,
        sound,
        "0 to below 90 degrees",
    );
    let sound = (0.0..=friction.max(0.0)).contains(&dilation);
    problems.number(
        &below("dilation_angle"),
        dilation,
        sound,
        "0 to the friction angle",
    );
    problems.not_negative(&below("cohesion"), cohesion, "a stress");
    problems.not_negative(&below("tensile_strength"), tension, "a stress");
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
        velocity: written.velocity,
        contact_radius,
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

fn simple_polygon(problems: &mut Problems, path: &str, vertices: &[[f64; 2]]) -> bool {
    let Err(reason) = geometry::simple(vertices) else {
        return true;
    };
    let (message, help) = match reason {
        NotSimple::TooFew => (
            format!(
                "a polygon of {} vertices, expected 3 or more",
                vertices.len()
            ),
            "a segment or a disc has a shape of its own",
        ),
        NotSimple::Repeated(i, j) => (
            format!("vertices {i} and {j} of the polygon coincide"),
            "drop one of them; the outline closes by itself",
        ),
        NotSimple::Crossing(i, j) => (
            format!(
                "edges of the polygon cross: the one from vertex {i} {:?} and the one from vertex {j} {:?}",
                vertices[i], vertices[j]
            ),
            "list the vertices in the order of the outline, in either sense, counted from 0",
        ),
        NotSimple::Flat => (
            "all vertices of the polygon lie on one line".to_owned(),
            "use `shape.segment`",
        ),
    };
    problems.refuse(path, message, help);
    false
}

/// The bodies' configuration, unless something was refused. The skin is set later.
pub(super) fn bodies(
    problems: &mut Problems,
    written: &DemWritten,
    scene: &SceneWritten,
) -> Option<DemConfig> {
    if written.body.is_empty() {
        problems.refuse_key(
            "dem",
            "`[dem]` has no body",
            "without bodies leave `[dem]` out",
        );
    }
    for (i, body) in written.body.iter().enumerate() {
        self::body(problems, &format!("dem.body.{i}"), body);
    }
    let named = written.body.iter().enumerate();
    problems.distinct(
        "bodies",
        named.map(|(i, b)| (format!("dem.body.{i}.name"), b.name.as_str())),
    );
    for (path, law) in [
        ("contact", scene.contact),
        ("body_contact", scene.body_contact),
    ] {
        if let Some(law) = law {
            contact_law(problems, path, law);
        }
    }
    if scene.mpm.is_some() && scene.contact.is_none() {
        problems.refuse_key(
            "contact",
            "missing section `[contact]`: the scene has points and bodies",
            "write `contact.linear = { normal_stiffness = ... }`",
        );
    }
    if scene.mpm.is_none() && scene.contact.is_some() {
        problems.warn("`[contact]` has no effect: the scene has no points");
    }
    let movable = written
        .body
        .iter()
        .filter(|b| b.motion != Motion::Fixed)
        .count();
    if scene.body_contact.is_none() && movable > 0 && written.body.len() > 1 {
        problems.warn(
            "there is no `[body_contact]`: the bodies pass through one another without touching",
        );
    }
    if problems.any() {
        return None;
    }
    let nothing = ContactLaw::Linear {
        normal_stiffness: 0.0,
        tangential_stiffness: 0.0,
        friction: 0.0,
        damping_ratio: 0.0,
    };
    Some(DemConfig {
        gravity: scene.gravity,
        bodies: written.body.iter().map(body_config).collect(),
        point_contact: scene.contact.or(scene.body_contact).unwrap_or(nothing),
        body_contact: scene.body_contact,
        skin: 0.0,
        threads: 1,
    })
}

fn body(problems: &mut Problems, path: &str, body: &BodyWritten) {
    problems.name(&format!("{path}.name"), &body.name);
    outline(problems, path, body);
    let inertia = [("density", body.density), ("mass", body.mass)];
    for (key, value) in inertia {
        if let Some(value) = value {
            let path = format!("{path}.{key}");
            problems.above_zero(&path, value, &format!("a {key}"));
        }
    }
    match (body.density, body.mass, body.motion) {
        (Some(_), Some(_), _) => problems.refuse_key(
            &format!("{path}.mass"),
            format!(
                "body \"{}\" has both `density` and `mass`, expected one",
                body.name
            ),
            "drop one of them",
        ),
        (None, None, Motion::Free) => problems.refuse_key(
            path,
            format!(
                "body \"{}\" is free and has neither `density` nor `mass`",
                body.name
            ),
            "give it one of them, or `motion = \"fixed\"`",
        ),
        _ => {}
    }
    let moves = body.velocity != [0.0; 2] || body.spin != 0.0;
    if body.motion == Motion::Fixed && moves {
        problems.refuse_key(
            &format!("{path}.motion"),
            format!("body \"{}\" is fixed and has a velocity or spin", body.name),
            "`motion = \"driven\"` moves it with them, whatever acts on it",
        );
    }
}

fn outline(problems: &mut Problems, path: &str, body: &BodyWritten) {
    let radius = format!("{path}.sphero_radius");
    match &body.shape {
        BodyShape::Disc => problems.above_zero(&radius, body.sphero_radius, "a disc's radius"),
        BodyShape::Segment { ends } => {
            problems.above_zero(&radius, body.sphero_radius, "a segment's radius");
            if ends[0] == ends[1] {
                let path = format!("{path}.shape.segment.ends");
                problems.refuse(
                    &path,
                    "the ends of the segment coincide",
                    "use `shape = \"disc\"`",
                );
            }
        }
        BodyShape::Polygon { vertices } => {
            problems.not_negative(&radius, body.sphero_radius, "a radius");
            simple_polygon(
                problems,
                &format!("{path}.shape.polygon.vertices"),
                vertices,
            );
        }
        BodyShape::Rectangle { width, height } => {
            problems.not_negative(&radius, body.sphero_radius, "a radius");
            let path = format!("{path}.shape.rectangle");
            problems.above_zero(&format!("{path}.width"), *width, "a length");
            problems.above_zero(&format!("{path}.height"), *height, "a length");
        }
    }
}

fn body_config(body: &BodyWritten) -> BodyConfig {
    BodyConfig {
        name: body.name.clone(),
        shape: body.shape.clone(),
        sphero_radius: body.sphero_radius,
        inertia: match (body.mass, body.density) {
            (Some(mass), _) => BodyInertia::Mass(mass),
            (None, density) => BodyInertia::Density(density.unwrap_or(DENSITY_OF_UNMOVED)),
        },
        position: body.position,
        angle: body.angle,
        velocity: body.velocity,
        spin: body.spin,
        motion: body.motion,
    }
}

fn contact_law(problems: &mut Problems, path: &str, law: ContactLaw) {
    let ContactLaw::Linear {
        normal_stiffness,
        tangential_stiffness,
        friction,
        damping_ratio,
    } = law;
    let below = |key: &str| format!("{path}.linear.{key}");
    problems.above_zero(&below("normal_stiffness"), normal_stiffness, "a stiffness");
    problems.not_negative(
        &below("tangential_stiffness"),
        tangential_stiffness,
        "a stiffness",
    );
    problems.not_negative(&below("friction"), friction, "a coefficient");
    let sound = (0.0..=1.0).contains(&damping_ratio);
    let expected = "0 (elastic) to 1 (critical)";
    problems.number(&below("damping_ratio"), damping_ratio, sound, expected);
    if friction > 0.0 && tangential_stiffness == 0.0 {
        problems.refuse(
            &below("friction"),
            format!("`{path}.linear` has friction and no tangential stiffness"),
            "friction acts through a tangential spring: set `tangential_stiffness`, often \
             `normal_stiffness` / 20 to / 2",
        );
    }
}

/// The skin where the scene does not say: twice the largest contact radius; without points, a tenth of the smallest
/// body's size, so that lists live long and stay short.
pub(super) fn default_skin(mpm: Option<&MpmConfig>, dem: Option<&DemConfig>) -> f64 {
    let radius = mpm
        .iter()
        .flat_map(|mpm| &mpm.groups)
        .filter_map(|group| group.contact_radius)
        .fold(0.0, f64::max);
    if radius > 0.0 {
        return 2.0 * radius;
    }
    let size = |body: &BodyConfig| {
        let [lower, upper] = geometry::bounds(&body.shape.vertices());
        (upper[0] - lower[0]).hypot(upper[1] - lower[1]) + 2.0 * body.sphero_radius
    };
    let smallest = dem
        .iter()
        .flat_map(|dem| dem.bodies.iter().map(size))
        .fold(f64::INFINITY, f64::min);
    if smallest.is_finite() {
        0.1 * smallest
    } else {
        0.0
    }
}
