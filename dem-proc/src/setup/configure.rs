//! Turns the configuration into a solver: all checks, and the choice of contact laws.

use interface::Vec2;
use interface::config::surfaces::ContactPair;
use interface::config::{BodyConfig, BodyShape, ContactLaw, DemConfig, Interface, OverlapMeasure};
use interface::solver::{DemMeasurement, Readiness, Refusal};

use crate::body::bodies::{Bodies, Body};
use crate::body::surfaces::Surfaces;
use crate::contact::approach::{first_contact, outer_accelerations};
use crate::contact::convex::Convex;
use crate::contact::impact::SurfaceMotion;
use crate::contact::nearest::NearestEdge;
use crate::contact::overlap::OverlapArea;
use crate::contact::pairs::VertexEdges;
use crate::contact::point_body::PointBody;
use crate::contact::point_pairs::PointPairs;
use crate::contact::segments::Segments;
use crate::contact::side::Side;
use crate::setup::laws::{normal_stiffness, with_laws, with_table};
use crate::setup::saved::mark;
use crate::system::{Kicked, LimitConstants, Loads, Sdem, State};
use mechanics::threads::Threads;

/// Contact between the points of two groups, if there is a law for it.
fn pair_side(config: &DemConfig) -> Option<Box<dyn Side>> {
    let pairs = &config.group_pairs;
    let law = &pairs.first()?.law;
    // Each group is a surface of its own, named after its number.
    let table: Vec<ContactPair> = (pairs.iter())
        .map(|pair| ContactPair {
            between: pair.between.map(|group| group.to_string()),
            law: pair.law,
        })
        .collect();
    let surfaces = Surfaces::of(&table);
    let groups = pairs.iter().map(|pair| pair.between);
    let geometry = PointPairs::new(groups, |group| surfaces.number(&group.to_string()));
    let others = table.iter().filter(|pair| pair.law != *law);
    let others: Vec<&ContactPair> = others.collect();
    let kind = (geometry, config.skin);
    Some(with_laws(&surfaces, (law, &others), kind))
}

/// Contact between points and bodies.
fn point_side(config: &DemConfig, surfaces_of: &Surfaces) -> Box<dyn Side> {
    let groups = config.point_surfaces.iter();
    let surfaces = groups.map(|name| surfaces_of.number(name)).collect();
    let (law, skin) = (&config.point_contact, config.skin);
    let table: Vec<&ContactPair> = config.point_pairs().map(|(_, pair)| pair).collect();
    let kind = PointBody { surfaces };
    if config.interface == Interface::Segments {
        let kind = Segments(kind);
        return with_table(surfaces_of, (law, &table), (kind, skin));
    }
    with_laws(surfaces_of, (law, &table), (kind, skin))
}

/// Contact between bodies by `law` and the pairs of the table, with the measure of overlap that the scene chooses.
fn body_side(config: &DemConfig, surfaces: &Surfaces, law: &ContactLaw) -> Box<dyn Side> {
    let table: Vec<&ContactPair> = config.body_pairs().map(|(_, pair)| pair).collect();
    let skin = config.skin;
    let laws = (law, &table[..]);
    match config.overlap {
        OverlapMeasure::EachEdge => with_laws(surfaces, laws, (VertexEdges, skin)),
        // The other measures need not be fast.
        OverlapMeasure::NearestEdge => {
            with_table(surfaces, laws, (Convex::<NearestEdge>::default(), skin))
        }
        OverlapMeasure::Area => {
            with_table(surfaces, laws, (Convex::<OverlapArea>::default(), skin))
        }
    }
}

/// Checks a configuration and builds the solver.
///
/// # Errors
/// A refusal that names the key.
pub fn configure(config: &DemConfig) -> Result<(Sdem, Readiness), Refusal> {
    if let Some(fault) = config.faults().first() {
        return Err(fault.into());
    }
    refuse_unbuilt(config)?;
    let bodies = Bodies::new(config)?;
    let threads = Threads::new(config.threads, "dem")
        .map_err(|e| Refusal::new("dem.threads", format!("{}: {e}", config.threads)))?;
    let [point_stiffness, body_stiffness] = stiffest(config, &bodies);
    let of_pairs = config.group_pairs.iter();
    let of_pairs = of_pairs.map(|pair| normal_stiffness(&pair.law, 0.0));
    let pair_stiffness = of_pairs.fold(0.0, f64::max);
    let yields = |b: &Body| b.yields();
    let law = config.body_contact.as_ref();
    let pairs = law.filter(|_| bodies.properties.iter().any(yields) && bodies.len() > 1);
    let mut notes = Vec::new();
    if law.is_some() && pairs.is_none() {
        notes.push(
            "left out: contact between bodies (there are no two bodies of which at least one can move)".to_owned(),
        );
    }
    let surfaces = Surfaces::new(config);
    let n = bodies.len();
    let free = bodies.properties.iter().filter(|b| b.yields());
    let lightest = free.map(|b| b.mass).fold(f64::INFINITY, f64::min);
    let solver = Sdem {
        mark: mark(config),
        gravity: config.gravity.into(),
        sides: [
            pairs.map(|law| body_side(config, &surfaces, law)),
            Some(point_side(config, &surfaces)),
            pair_side(config),
        ],
        threads,
        loads: Loads::of(n),
        kicked: Kicked {
            velocities: vec![(Vec2::zeros(), 0.0); n],
            motions: vec![SurfaceMotion::default(); n],
            ..Kicked::default()
        },
        state: State {
            speed: bodies.initial_speed(),
            ..State::default()
        },
        constants: LimitConstants {
            outer_accelerations: outer_accelerations(&bodies, config.gravity.into()),
            first_contact: first_contact(&bodies, body_stiffness),
            per_resolution_sq: config.resolutions().map(|r| (2.0 / r).powi(2)),
        },
        skin: config.skin,
        bodies,
        envelopes: Vec::new(),
        contacts: Vec::new(),
        measurement: DemMeasurement::default(),
    };
    let readiness = Readiness {
        items: n as u64,
        bytes: solver.bytes() as u64,
        courant_time: 0.0,
        mass_min: if lightest.is_finite() { lightest } else { 0.0 },
        stiffness_max: if n > 0 { point_stiffness } else { 0.0 }.max(pair_stiffness),
        notes,
    };
    Ok((solver, readiness))
}

/// The largest normal stiffness in N/m between points and bodies, and between bodies.
fn stiffest(config: &DemConfig, bodies: &Bodies) -> [f64; 2] {
    let radii = bodies.state.iter().map(|s| s.radius);
    let smallest = radii.reduce(f64::min).unwrap_or(0.0);
    let moved = bodies.state.iter().filter(|s| s.falls > 0.0);
    let sizes = moved.map(|s| if s.radius > 0.0 { s.radius } else { s.extent });
    let largest = |laws: &mut dyn Iterator<Item = ContactLaw>, overlap: f64| {
        let stiffness = laws.map(|law| normal_stiffness(&law, overlap));
        stiffness.fold(0.0, f64::max)
    };
    [
        // If the stiffness depends on the overlap, it is taken at a hundredth of the smallest sphero-radius.
        largest(&mut config.point_laws(), 0.01 * smallest),
        // The overlap in a first contact is not known. Of two, one is moved by forces, and it is at most the size of that one.
        largest(&mut config.body_laws(), sizes.fold(0.0, f64::max)),
    ]
}

/// Refuses what this solver cannot do.
fn refuse_unbuilt(config: &DemConfig) -> Result<(), Refusal> {
    let disc = |b: &BodyConfig| matches!(b.shape, BodyShape::Disc | BodyShape::Cluster { .. });
    if config.interface == Interface::Segments
        && let Some(b) = config.bodies.iter().position(|body| !disc(body))
    {
        let text = "only discs and clusters of discs meet the segments of a boundary; write one of these, or \
                    mpm.interface = \"points\"";
        return Err(Refusal::new(format!("dem.body.{b}.shape"), text));
    }
    Ok(())
}
