//! The bodies' part of a scene: outlines, masses, motion, contact laws.

use interface::config::{BodyConfig, BodyInertia, DemConfig, GroupPair, MpmConfig, polygon};
use mechanics::generate::{Arrangement, BodyFill, Grain};

use super::problems::Problems;
use super::written::{BodyWritten, DemWritten, SceneWritten};

/// Density in kg/m^3 of a fixed or driven body if the scene has none. Its mass has no effect on any motion.
const DENSITY_OF_UNMOVED: f64 = 1000.0;

/// The bodies' configuration, unless something was refused. The skin is set later.
pub(super) fn bodies(
    problems: &mut Problems,
    written: &DemWritten,
    scene: &SceneWritten,
    group_pairs: &[GroupPair],
) -> Option<DemConfig> {
    for (i, body) in written.body.iter().enumerate() {
        self::body(problems, &format!("dem.body.{i}"), body);
    }
    names(problems, written);
    let before = problems.count();
    for (i, fill) in written.fill.iter().enumerate() {
        self::fill(problems, &format!("dem.fill.{i}"), fill);
    }
    let in_sets = written.fill.iter().map(|fill| u64::from(fill.count));
    let all = written.body.len() as u64 + in_sets.sum::<u64>();
    if all > u64::from(BODIES_LIMIT) {
        let message = format!("the scene has {all} bodies, expected at most {BODIES_LIMIT}");
        problems.refuse("dem.fill", message, "let the sets have smaller counts");
    }
    let all: f64 = written.fill.iter().map(corners).sum();
    if all > CORNERS_LIMIT {
        let message = format!("the sets have {all} corners, expected at most {CORNERS_LIMIT}");
        problems.refuse("dem.fill", message, "let their polygons have fewer");
    }
    let sets_are_sound = problems.count() == before;
    contact(problems, written, scene);
    // Bodies of a set cannot be made from impossible numbers.
    if !sets_are_sound {
        return None;
    }
    let config = DemConfig {
        group_pairs: group_pairs.to_vec(),
        ..config(written, scene)
    };
    let mut faults = config.faults();
    // A section that is missing has been refused, so its default has no fault of its own.
    faults.retain(|fault| scene.contact.is_some() || !fault.key.starts_with("contact."));
    problems.config_faults(faults);
    (!problems.any()).then_some(config)
}

/// The configuration as written, whether possible or not.
fn config(written: &DemWritten, scene: &SceneWritten) -> DemConfig {
    let points = scene.mpm.iter().flat_map(|mpm| &mpm.points);
    let law_for_points = scene.contact.or(scene.body_contact);
    DemConfig {
        gravity: scene.gravity,
        bodies: all_bodies(written),
        point_contact: law_for_points.unwrap_or_default(),
        body_contact: scene.body_contact,
        overlap: written.overlap,
        contact_resolution: written.contact_resolution,
        contact_pairs: scene.contact_pair.clone(),
        point_surfaces: points.map(|group| group.material.clone()).collect(),
        interface: scene
            .mpm
            .as_ref()
            .map(|mpm| mpm.scheme.interface)
            .unwrap_or_default(),
        skin: 0.0,
        threads: 1,
        ..DemConfig::default()
    }
}

/// Refuses names that cannot be part of a quantity, and those that two bodies or two sets have.
fn names(problems: &mut Problems, written: &DemWritten) {
    let bodies = written.body.iter().map(|body| body.body.name.as_str());
    problems.names("dem.body", "bodies", bodies);
    for (i, fill) in written.fill.iter().enumerate() {
        for (k, BodyWritten { body, .. }) in written.body.iter().enumerate() {
            let number = body
                .name
                .strip_prefix(&fill.name)
                .and_then(|rest| rest.strip_prefix('_'));
            if number
                .and_then(|n| n.parse().ok())
                .is_some_and(|n: u32| n < fill.count)
            {
                let message = format!("two of bodies are named \"{}\"", body.name);
                let help = format!("the set `dem.fill.{i}` has a body of that name");
                problems.refuse(&format!("dem.body.{k}.name"), message, help);
            }
        }
    }
    let sets = written.fill.iter().map(|fill| fill.name.as_str());
    problems.names("dem.fill", "sets of bodies", sets);
}

/// Refuses points and bodies without a law, and warns of what has no effect.
fn contact(problems: &mut Problems, written: &DemWritten, scene: &SceneWritten) {
    if written.contact_resolution.is_some() && scene.body_contact.is_none() && scene.mpm.is_none() {
        problems.warn("`dem.contact_resolution` has no effect: there is no `[body_contact]`");
    }
    let some = !written.body.is_empty() || !written.fill.is_empty();
    if some && scene.mpm.is_some() && scene.contact.is_none() {
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
        .filter(|b| b.body.motion.yielding() != [0.0; 3])
        .count();
    let filled: usize = written.fill.iter().map(|fill| fill.count as usize).sum();
    if scene.body_contact.is_none() && movable + filled > 0 && written.body.len() + filled > 1 {
        problems.warn(
            "there is no `[body_contact]`: the bodies pass through one another without touching",
        );
    }
}

/// The bodies of a scene that has been checked: those written one by one, then the sets, in the order of the file.
fn all_bodies(written: &DemWritten) -> Vec<BodyConfig> {
    let mut bodies: Vec<BodyConfig> = written.body.iter().map(body_config).collect();
    bodies.extend(written.fill.iter().flat_map(BodyFill::bodies));
    bodies
}

/// Largest number of bodies: a hundred times what can be computed in an hour.
const BODIES_LIMIT: u32 = 1_000_000;
/// Largest number of corners that polygons of sets have together: ten for each of as many bodies.
const CORNERS_LIMIT: f64 = 1e7;

/// How many corners the polygons of a set have together.
fn corners(fill: &BodyFill) -> f64 {
    match fill.grain {
        Grain::Polygon { corners, .. } => f64::from(fill.count) * f64::from(corners),
        Grain::Disc | Grain::Square { .. } => 0.0,
    }
}

fn fill(problems: &mut Problems, path: &str, fill: &BodyFill) {
    let below = |key: &str| format!("{path}.{key}");
    let sound = (1..=BODIES_LIMIT).contains(&fill.count);
    let count = f64::from(fill.count);
    problems.number(
        &below("count"),
        count,
        sound,
        &format!("1 to {BODIES_LIMIT} bodies"),
    );
    problems.above_zero(&below("density"), fill.density, "a density");
    let smallest = fill.size.smallest();
    if !(smallest > 0.0 && smallest <= fill.size.largest()) {
        let message = format!("the smallest size of \"{}\" is {smallest} m", fill.name);
        let help = "sizes are above 0, and `from` is at most `to`";
        problems.refuse(&below("size"), message, help);
    }
    let roundness = |problems: &mut Problems, kind: &str, roundness: f64| {
        let sound = roundness > 0.0 && roundness < 1.0;
        let expected = "a fraction above 0 and below 1";
        problems.number(
            &below(&format!("grain.{kind}.roundness")),
            roundness,
            sound,
            expected,
        );
    };
    match fill.grain {
        Grain::Disc => {}
        Grain::Square { roundness: r } => roundness(problems, "square", r),
        Grain::Polygon {
            corners,
            roundness: r,
            irregularity,
        } => {
            roundness(problems, "polygon", r);
            let path = below("grain.polygon.corners");
            problems.number(&path, f64::from(corners), corners >= 3, "3 corners or more");
            let sound = (0.0..=1.0).contains(&irregularity);
            let path = below("grain.polygon.irregularity");
            problems.number(&path, irregularity, sound, "0 to 1");
        }
    }
    if let Arrangement::Rows { width, .. } = fill.arrange
        && width < 2.0 * fill.size.largest()
    {
        let message = format!(
            "{width} m is less than the largest diameter of \"{}\"",
            fill.name
        );
        problems.refuse(&below("arrange.rows.width"), message, "make the rows wider");
    }
}

fn body(problems: &mut Problems, path: &str, written: &BodyWritten) {
    let name = &written.body.name;
    match (written.density, written.mass, written.body.motion) {
        (Some(_), Some(_), _) => problems.refuse_key(
            &format!("{path}.mass"),
            format!("body \"{name}\" has both `density` and `mass`, expected one"),
            "drop one of them",
        ),
        (None, None, motion) if motion.yielding() != [0.0; 3] => problems.refuse_key(
            path,
            format!("body \"{name}\" is moved by forces and has neither `density` nor `mass`"),
            "give it one of them, or `motion = \"fixed\"`",
        ),
        _ => {}
    }
}

fn body_config(written: &BodyWritten) -> BodyConfig {
    BodyConfig {
        inertia: match (written.mass, written.density) {
            (Some(mass), _) => BodyInertia::Mass(mass),
            (None, density) => BodyInertia::Density(density.unwrap_or(DENSITY_OF_UNMOVED)),
        },
        ..written.body.clone()
    }
}

/// The skin if the scene has none. It is twice the largest contact radius. Without points it is a tenth of the smallest
/// body's size, so that lists stay short and are rebuilt rarely.
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
        let [lower, upper] = polygon::bounds(&body.shape.vertices());
        let radii = (0..body.shape.vertices().len()).map(|k| body.radius_at(k));
        let radius = radii.fold(f64::INFINITY, f64::min);
        (upper[0] - lower[0]).hypot(upper[1] - lower[1]) + 2.0 * radius
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
