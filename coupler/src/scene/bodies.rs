//! The bodies' part of a scene: outlines, masses, motion, contact laws.

use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion, MpmConfig, OverlapMeasure,
};
use mechanics::generate::{Arrangement, BodyFill, Grain};

use super::geometry;
use super::outline::simple_polygon;
use super::problems::Problems;
use super::written::{BodyWritten, DemWritten, SceneWritten};

/// A fixed or driven body's mass moves nothing; its density where the scene does not say, in kg/m^3.
const DENSITY_OF_UNMOVED: f64 = 1000.0;

/// The bodies' configuration, unless something was refused. The skin is set later.
pub(super) fn bodies(
    problems: &mut Problems,
    written: &DemWritten,
    scene: &SceneWritten,
) -> Option<DemConfig> {
    for (i, body) in written.body.iter().enumerate() {
        self::body(problems, &format!("dem.body.{i}"), body);
    }
    let named = written.body.iter().enumerate();
    problems.distinct(
        "bodies",
        named.map(|(i, b)| (format!("dem.body.{i}.name"), b.name.as_str())),
    );
    for (i, fill) in written.fill.iter().enumerate() {
        self::fill(problems, &format!("dem.fill.{i}"), fill);
        for (k, body) in written.body.iter().enumerate() {
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
    let sets = written.fill.iter().enumerate();
    problems.distinct(
        "sets of bodies",
        sets.map(|(i, f)| (format!("dem.fill.{i}.name"), f.name.as_str())),
    );
    overlap_measure(problems, written, scene);
    contact_resolution(problems, written, scene);
    for (path, law) in [
        ("contact", scene.contact),
        ("body_contact", scene.body_contact),
    ] {
        if let Some(law) = law {
            contact_law(problems, path, law);
        }
    }
    for (i, pair) in scene.contact_pair.iter().enumerate() {
        contact_law(problems, &format!("contact_pair.{i}.law"), pair.law);
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
    let filled: usize = written.fill.iter().map(|fill| fill.count as usize).sum();
    if scene.body_contact.is_none() && movable + filled > 0 && written.body.len() + filled > 1 {
        problems.warn(
            "there is no `[body_contact]`: the bodies pass through one another without touching",
        );
    }
    if problems.any() {
        return None;
    }
    let points = scene.mpm.iter().flat_map(|mpm| &mpm.points);
    let law_for_points = scene.contact.or(scene.body_contact);
    let config = DemConfig {
        gravity: scene.gravity,
        bodies: all_bodies(written),
        point_contact: law_for_points.unwrap_or_default(),
        body_contact: scene.body_contact,
        overlap: written.overlap,
        contact_resolution: written.contact_resolution,
        contact_pairs: scene.contact_pair.clone(),
        point_surfaces: points.map(|group| group.material.clone()).collect(),
        skin: 0.0,
        threads: 1,
        ..DemConfig::default()
    };
    for fault in config.table_faults() {
        let path = format!("contact_pair.{}.{}", fault.pair, fault.key);
        problems.refuse(&path, fault.message, fault.help);
    }
    (!problems.any()).then_some(config)
}

/// The bodies of a scene that has been checked: those written one by one, then the sets, in the order of the file.
fn all_bodies(written: &DemWritten) -> Vec<BodyConfig> {
    let mut bodies: Vec<BodyConfig> = written.body.iter().map(body_config).collect();
    bodies.extend(written.fill.iter().flat_map(BodyFill::bodies));
    bodies
}

/// Most bodies of a set: a hundred times what runs in an hour.
const BODIES_LIMIT: u32 = 1_000_000;

fn fill(problems: &mut Problems, path: &str, fill: &BodyFill) {
    problems.name(&format!("{path}.name"), &fill.name);
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
        let help = "sizes are above 0, `from` at most `to`, two deviations below the mean";
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
    if let Arrangement::Rows {
        width, looseness, ..
    } = fill.arrange
    {
        problems.not_negative(&below("arrange.rows.looseness"), looseness, "a fraction");
        if width < 2.0 * fill.size.largest() {
            let message = format!(
                "{width} m is less than the largest diameter of \"{}\"",
                fill.name
            );
            problems.refuse(&below("arrange.rows.width"), message, "make the rows wider");
        }
    }
}

/// Refuses a resolution that is none.
fn contact_resolution(problems: &mut Problems, written: &DemWritten, scene: &SceneWritten) {
    let Some(resolution) = written.contact_resolution else {
        return;
    };
    if !(resolution > 0.0 && resolution <= 2.0) {
        let message = format!("`dem.contact_resolution` is {resolution}");
        let help = "write a number above 0, at most 2: 2 is the limit of stability, 0.04 the default of elastic contacts, 0.2 that of damped ones";
        problems.refuse("dem.contact_resolution", message, help);
    }
    if scene.body_contact.is_none() {
        problems.warn("`dem.contact_resolution` has no effect: there is no `[body_contact]`");
    }
}

/// Refuses bodies and a law that the overlap measure is not made for.
fn overlap_measure(problems: &mut Problems, written: &DemWritten, scene: &SceneWritten) {
    let measure = written.overlap;
    if measure == OverlapMeasure::EachEdge {
        return;
    }
    let name = measure.name();
    let area = measure == OverlapMeasure::Area;
    if let Some(fill) = written.fill.first().filter(|_| area) {
        let message = format!("the bodies of \"{}\" are rounded", fill.name);
        let help = "`dem.overlap = \"area\"` is of bare polygons, written one by one";
        problems.refuse_key("dem.fill.0.grain", message, help);
    }
    for (i, body) in written.body.iter().enumerate() {
        let path = format!("dem.body.{i}");
        if !geometry::convex(&body.shape) {
            let message = format!("body \"{}\" is not convex", body.name);
            let help =
                format!("`dem.overlap = \"{name}\"` is for convex bodies: take \"each_edge\"");
            problems.refuse_key(&format!("{path}.shape"), message, help);
        } else if area && body.sphero_radius > 0.0 {
            let message = format!("body \"{}\" is rounded", body.name);
            let help = "`dem.overlap = \"area\"` is of bare polygons: `sphero_radius = 0`";
            problems.refuse(&format!("{path}.sphero_radius"), message, help);
        }
    }
    let law = scene.body_contact;
    if area && !matches!(law, None | Some(ContactLaw::Linear { .. })) {
        let message = "`[body_contact]` is not `linear`, which `dem.overlap = \"area\"` asks for";
        let help = "bare corners have no radius, which other laws need";
        problems.refuse_key("body_contact", message, help);
    }
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
        BodyShape::Cluster { centers, radii } if !radii.is_empty() => {
            let path = format!("{path}.shape.cluster.radii");
            if radii.len() != centers.len() {
                let message = format!("{} radii for {} discs", radii.len(), centers.len());
                problems.refuse(&path, message, "give one for each of `centers`");
            }
            for (k, r) in radii.iter().enumerate() {
                problems.above_zero(&format!("{path}.{k}"), *r, "a disc's radius");
            }
            if body.sphero_radius != 0.0 {
                let message = format!("body \"{}\" has `radii` and a sphero-radius", body.name);
                problems.refuse(&radius, message, "leave one of them out");
            }
        }
        BodyShape::Cluster { .. } => {
            problems.above_zero(&radius, body.sphero_radius, "a disc's radius");
        }
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
        surface: body.surface.clone(),
    }
}

fn contact_law(problems: &mut Problems, path: &str, law: ContactLaw) {
    let (
        name,
        [
            normal_stiffness,
            tangential_stiffness,
            friction,
            damping_ratio,
        ],
    ) = match law {
        ContactLaw::Linear {
            normal_stiffness: k_n,
            tangential_stiffness: k_t,
            friction,
            damping_ratio,
        } => ("linear", [k_n, k_t, friction, damping_ratio]),
        ContactLaw::Granular {
            normal_stiffness: k_n,
            tangential_stiffness: k_t,
            friction,
            damping_ratio,
            ..
        } => ("granular", [k_n, k_t, friction, damping_ratio]),
        // The bodies' side checks the others, and refuses with the key.
        ContactLaw::HertzMindlin { .. } | ContactLaw::Area { .. } => return,
    };
    let below = |key: &str| format!("{path}.{name}.{key}");
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
    // The force message carries one stiffness a point, and the step limit is made of it (PROTOCOL.md F-6).
    if tangential_stiffness > normal_stiffness {
        let key = below("tangential_stiffness");
        let message = format!(
            "`{key}` = {tangential_stiffness} N/m is above the normal stiffness, {normal_stiffness} N/m"
        );
        problems.refuse(
            &key,
            message,
            "elastic bodies are softer along a contact than across it: take at most k_n",
        );
    }
    if friction > 0.0 && tangential_stiffness == 0.0 {
        problems.refuse(
            &below("friction"),
            format!("`{path}.{name}` has friction and no tangential stiffness"),
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
        let radius = match &body.shape {
            BodyShape::Cluster { radii, .. } if !radii.is_empty() => {
                radii.iter().copied().fold(f64::INFINITY, f64::min)
            }
            _ => body.sphero_radius,
        };
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
