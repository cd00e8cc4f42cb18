//! Section 7: what other laws than `linear` make of the radii, on an outline without sphero-radius.

use interface::config::{BodyConfig, BodyShape, ContactLaw, Motion};

use super::scene::{RADIUS, STIFFNESS, body, scene};
use crate::bench::{Bench, Points};
use crate::clause::Clause;
use crate::mutant::Flaw;
use crate::verdict::{Judgement, Largest, near};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "F-7t",
        "`area` uses the point's radius on an outline without sphero-radius",
        area_on_bare,
    )
    .needs(&["law:area", "shape:rectangle"])
    .after(&["F-7d"])
    .mutant("has no area on an outline without sphero-radius", || {
        on_bare(|law| {
            if let ContactLaw::Area { area_stiffness, .. } = law {
                *area_stiffness = f64::MIN_POSITIVE;
            }
        })
    }),
    Clause::must(
        "F-7u",
        "adhesion uses the point's radius on an outline without sphero-radius",
        adhesion_on_bare,
    )
    .needs(&["law:granular", "feature:adhesion", "shape:rectangle"])
    .after(&["F-7d"])
    .mutant(
        "has no adhesion on an outline without sphero-radius",
        || {
            on_bare(|law| {
                if let ContactLaw::Granular { adhesion, .. } = law {
                    *adhesion = 0.0;
                }
            })
        },
    ),
];

/// Overlaps in m, up to a point whose centre is on the outline.
const OVERLAPS: [f64; 4] = [1e-6 * RADIUS, 0.01 * RADIUS, 0.3 * RADIUS, RADIUS];

/// k_A in N/m^2.
const AREA_STIFFNESS: f64 = 1e8;
/// Adhesion in Pa.
const ADHESION: f64 = 1e4;

/// Changes the law where the first body is bare.
fn on_bare(change: fn(&mut ContactLaw)) -> Flaw {
    Flaw::bodies_config(move |config| {
        if config
            .bodies
            .first()
            .is_some_and(|b| b.sphero_radius == 0.0)
        {
            change(&mut config.point_contact);
        }
    })
}

/// A row of points on the upper edge of a bare rectangle, one for each overlap.
fn on_the_edge() -> (BodyConfig, Points) {
    let rectangle = BodyShape::Rectangle {
        width: 1.0,
        height: 0.1,
    };
    let block = BodyConfig {
        sphero_radius: 0.0,
        ..body(rectangle, [0.0, -0.05], Motion::Fixed)
    };
    let mut points = Points::new();
    for (k, overlap) in OVERLAPS.into_iter().enumerate() {
        points = points.with([0.1 * k as f64, RADIUS - overlap], [0.0; 2], RADIUS, 0.5);
    }
    (block, points)
}

/// Judges the forces of that row against `want` (N/m along y), a function of the overlap, to a fraction of `scale` (N/m).
fn judge(bench: &Bench, law: ContactLaw, scale: f64, want: fn(f64) -> f64) -> Judgement {
    let (block, points) = on_the_edge();
    let mut play = bench.run_bodies(&scene(vec![block], law))?;
    play.set(&points.set);
    let (answer, _) = play.step(0.0, &points.states)?;
    let mut largest = Largest::default();
    for (overlap, got) in OVERLAPS.into_iter().zip(&answer.forces) {
        let what = format!("force along y at an overlap of {overlap:.1e} m");
        // Coordinates carry the overlap to a few ulp of 0.1 m, and a root of a small one carries half of its digits.
        let tolerance = 1e-9 * scale;
        largest.near(&what, got.force[1], want(overlap), tolerance, scale)?;
        near("force along x", got.force[0], 0.0, tolerance)?;
    }
    Ok(format!(
        "{} overlaps, within {largest} of the largest",
        OVERLAPS.len()
    ))
}

fn area_on_bare(bench: &Bench) -> Judgement {
    let law = ContactLaw::Area {
        area_stiffness: AREA_STIFFNESS,
        tangential_stiffness: 0.0,
        friction: 0.0,
    };
    // The segment of height h of a disc of the point's radius; half of the disc at the last overlap.
    let segment = |h: f64| {
        let r = RADIUS;
        AREA_STIFFNESS * (r * r * (1.0 - h / r).acos() - (r - h) * (h * (2.0 * r - h)).sqrt())
    };
    judge(bench, law, segment(RADIUS), segment)
}

fn adhesion_on_bare(bench: &Bench) -> Judgement {
    let law = ContactLaw::Granular {
        normal_stiffness: STIFFNESS,
        tangential_stiffness: 0.0,
        friction: 0.0,
        damping_ratio: 0.0,
        damped_mass: 0.0,
        adhesion: ADHESION,
        rolling_friction: 0.0,
    };
    let pulled = |h: f64| STIFFNESS * h - ADHESION * 2.0 * (2.0 * RADIUS * h).sqrt();
    judge(bench, law, STIFFNESS * RADIUS, pulled)
}
