//! From the configuration to a solver: every check, and the one `match` that chooses the contact laws.

use interface::Vec2;
use interface::config::surfaces::ContactPair;
use interface::config::{ContactLaw, DemConfig, Interface, OverlapMeasure};
use interface::solver::{Readiness, Refusal};

use crate::body::bodies::Bodies;
use crate::body::load::{Load, PairLoad};
use crate::body::surfaces::Surfaces;
use crate::contact::approach::{first_contact, outer_acceleration};
use crate::contact::convex::{ConvexContacts, Measure};
use crate::contact::nearest::NearestEdge;
use crate::contact::overlap::OverlapArea;
use crate::contact::pairs::{BodyContacts, BodySide};
use crate::contact::points::{PointContacts, PointSide};
use crate::law::Law;
use crate::law::choice::{Between, ForLaw, check_law, with_law, with_table};
use crate::system::System;
use crate::threads::Threads;

struct PointsWith {
    /// Surface of each point group.
    surfaces: Vec<u32>,
    skin: f64,
}

impl ForLaw for PointsWith {
    type Output = Box<dyn PointSide>;
    fn build<L: Law>(self, law: L) -> Self::Output {
        Box::new(PointContacts::new(law, self.surfaces, self.skin))
    }
}

struct EdgesWith {
    skin: f64,
}

impl ForLaw for EdgesWith {
    type Output = Box<dyn BodySide>;
    fn build<L: Law>(self, law: L) -> Self::Output {
        Box::new(BodyContacts::new(law, self.skin))
    }
}

struct ConvexWith<M> {
    measure: M,
    skin: f64,
}

impl<M: Measure + 'static> ForLaw for ConvexWith<M> {
    type Output = Box<dyn BodySide>;
    fn build<L: Law>(self, law: L) -> Self::Output {
        Box::new(ConvexContacts::new(law, self.measure, self.skin))
    }
}

/// Contact between bodies by `law` and the pairs of the table, as the scene measures it.
fn body_side(config: &DemConfig, surfaces: &Surfaces, law: &ContactLaw) -> Box<dyn BodySide> {
    let table: Vec<&ContactPair> = config.body_pairs().map(|(_, pair)| pair).collect();
    let skin = config.skin;
    match config.overlap {
        // Without a pair of its own, contact pays nothing for the table.
        OverlapMeasure::EachEdge if table.is_empty() => with_law(law, EdgesWith { skin }),
        OverlapMeasure::EachEdge => with_table(surfaces, law, &table, EdgesWith { skin }),
        // The other measures take the table's few types of law, whose unused parts are zero, always: a type for every
        // combination would double what is compiled, for what is not made for speed.
        OverlapMeasure::NearestEdge => {
            let measure = NearestEdge;
            with_table(surfaces, law, &table, ConvexWith { measure, skin })
        }
        OverlapMeasure::Area => {
            let measure = OverlapArea::default();
            with_table(surfaces, law, &table, ConvexWith { measure, skin })
        }
    }
}

/// Checks a configuration and builds the solver.
///
/// # Errors
/// A refusal that names the key.
pub fn configure(config: &DemConfig) -> Result<(System, Readiness), Refusal> {
    check_numbers(config)?;
    let bodies = Bodies::new(config)?;
    // Where the stiffness depends on the overlap: at a hundredth of the smallest sphero-radius.
    let radii = bodies.state.iter().map(|s| s.radius);
    let radius = radii.reduce(f64::min).unwrap_or(0.0);
    let overlap = 0.01 * radius;
    let between = Between::PointsAndBodies;
    let mut point_stiffness =
        check_law("dem.point_contact", &config.point_contact, between, overlap)?;
    // Of a first touch nobody knows how deep it will be: not deeper than the smallest sphero-radius.
    let mut body_stiffness: f64 = 0.0;
    if let Some(law) = &config.body_contact {
        body_stiffness = check_law("dem.body_contact", law, Between::Bodies, radius)?;
    }
    if let Some(fault) = config.table_faults().first() {
        let key = format!("dem.contact_pairs[{}].{}", fault.pair, fault.key);
        return Err(Refusal::new(
            key,
            format!("{}; {}", fault.message, fault.help),
        ));
    }
    let key = |i: usize| format!("dem.contact_pairs[{i}].law");
    for (i, pair) in config.point_pairs() {
        let stiffness = check_law(&key(i), &pair.law, between, overlap)?;
        point_stiffness = point_stiffness.max(stiffness);
    }
    for (i, pair) in config.body_pairs() {
        let stiffness = check_law(&key(i), &pair.law, Between::Bodies, radius)?;
        body_stiffness = body_stiffness.max(stiffness);
    }
    check_overlap(config, &bodies)?;
    let threads = Threads::new(config.threads)
        .map_err(|e| Refusal::new("dem.threads", format!("{}: {e}", config.threads)))?;

    let free = || bodies.fixed.iter().filter(|b| b.yields());
    let mut notes = Vec::new();
    let law = config.body_contact.as_ref();
    let pairs = law.filter(|_| free().next().is_some() && bodies.len() > 1);
    if law.is_some() && pairs.is_none() {
        notes.push(
            "left out: contact between bodies (no two bodies of which forces move one)".to_owned(),
        );
    }
    let surfaces = Surfaces::new(config);
    let pairs = pairs.map(|law| body_side(config, &surfaces, law));
    let groups = config.point_surfaces.iter();
    let build = PointsWith {
        surfaces: groups.map(|name| surfaces.number(name)).collect(),
        skin: config.skin,
    };
    let (law, table) = (&config.point_contact, config.point_pairs());
    let table: Vec<&ContactPair> = table.map(|(_, pair)| pair).collect();
    let points = if table.is_empty() {
        with_law(law, build)
    } else {
        with_table(&surfaces, law, &table, build)
    };
    let n = bodies.len();
    let system = System {
        gravity: config.gravity.into(),
        points,
        pairs,
        threads,
        point_loads: vec![Load::default(); n],
        body_loads: vec![PairLoad::default(); n],
        kicked: vec![(Vec2::zeros(), 0.0); n],
        speed: bodies.initial_speed(),
        outer_acceleration: outer_acceleration(&bodies, config.gravity.into()),
        first_contact: first_contact(&bodies, body_stiffness),
        per_resolution_sq: (2.0 / config.resolution()).powi(2),
        skin: config.skin,
        bodies,
        ..System::default()
    };
    let free = || system.bodies.fixed.iter().filter(|b| b.yields());
    let lightest = free().map(|b| b.mass).fold(f64::INFINITY, f64::min);
    let readiness = Readiness {
        items: n as u64,
        bytes: system.bytes() as u64,
        courant_time: 0.0,
        mass_min: if lightest.is_finite() { lightest } else { 0.0 },
        stiffness_max: if n > 0 { point_stiffness } else { 0.0 },
        notes,
    };
    Ok((system, readiness))
}

/// Refuses numbers out of range, and what is not built.
fn check_numbers(config: &DemConfig) -> Result<(), Refusal> {
    if !config.gravity.iter().all(|g| g.is_finite()) {
        let text = format!("{:?}: expected finite numbers in m/s^2", config.gravity);
        return Err(Refusal::new("dem.gravity", text));
    }
    if !(config.skin.is_finite() && config.skin >= 0.0) {
        let text = format!(
            "{} m: expected a finite distance that is not negative",
            config.skin
        );
        return Err(Refusal::new("dem.skin", text));
    }
    let resolution = config.resolution();
    if !(resolution > 0.0 && resolution <= 2.0) {
        let text = format!("{resolution}: expected above 0, at most 2 (the limit of stability)");
        return Err(Refusal::new("dem.contact_resolution", text));
    }
    if config.threads == 0 {
        return Err(Refusal::new("dem.threads", "0: expected 1 or more"));
    }
    if !config.group_pairs.is_empty() {
        let text = "contact between groups of points is not built (capability `pairs`)";
        return Err(Refusal::new("dem.group_pairs", text));
    }
    if config.interface == Interface::Segments {
        let text = "contact with segments is not built (capability `segments`); use \"points\"";
        return Err(Refusal::new("dem.interface", text));
    }
    Ok(())
}

/// Refuses bodies and laws that a measure of overlap is not made for.
fn check_overlap(config: &DemConfig, bodies: &Bodies) -> Result<(), Refusal> {
    let name = config.overlap.name();
    for (i, body) in bodies.fixed.iter().enumerate() {
        let key = |key: &str| format!("dem.body[{i}] ({}).{key}", body.name);
        if config.overlap != OverlapMeasure::EachEdge && !body.shape.convex {
            let text = format!("not convex, which the overlap measure `{name}` asks for");
            return Err(Refusal::new(key("shape"), text));
        }
        if config.overlap == OverlapMeasure::Area && body.shape.radius > 0.0 {
            let text = format!(
                "{} m: the overlap measure `{name}` is of bare polygons; expected 0",
                body.shape.radius
            );
            return Err(Refusal::new(key("sphero_radius"), text));
        }
    }
    let bare = |b: &crate::body::bodies::Body| b.shape.radius == 0.0;
    let mut all_bare = bodies.fixed.iter().filter(|b| bare(b));
    let free_and_bare = bodies.fixed.iter().position(|b| bare(b) && b.yields());
    if config.overlap == OverlapMeasure::EachEdge
        && config.body_contact.is_some()
        && let (Some(i), Some(_)) = (free_and_bare, all_bare.nth(1))
    {
        let text = format!(
            "0: with the overlap measure `{name}` two bodies without one never touch; write a radius, or the measure \
             `{}`",
            OverlapMeasure::NearestEdge.name()
        );
        let key = format!("dem.body[{i}] ({}).sphero_radius", bodies.fixed[i].name);
        return Err(Refusal::new(key, text));
    }
    let other = |law: &ContactLaw| !matches!(law, ContactLaw::Linear { .. });
    if config.overlap == OverlapMeasure::Area
        && let Some(law) = config.body_laws().find(other)
    {
        let text = format!(
            "`{}` with the overlap measure `{name}`: bare corners have no radius, which that law needs; write `linear`",
            law.name()
        );
        return Err(Refusal::new("dem.body_contact", text));
    }
    Ok(())
}
