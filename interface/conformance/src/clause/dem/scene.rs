//! The bodies that clauses are judged with. Lengths are around a centimetre, stiffness and mass such that a contact
//! lasts around ten milliseconds.

use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion};
use interface::message::wire::{ImpInfo, ImpState};

use crate::bench::{Bench, Points};

/// Normal stiffness in N/m.
pub const STIFFNESS: f64 = 6e4;
/// Sphero-radius of bodies in m.
pub const SPHERO: f64 = 0.02;
/// Contact radius of points in m.
pub const RADIUS: f64 = 0.01;
/// Overlap of points that slide, in m.
pub const OVERLAP: f64 = 1e-3;
/// Mass of bodies in kg/m.
pub const MASS: f64 = 1.5;

/// One disc at the origin, at rest, without friction or damping, and no gravity.
pub fn disc(motion: Motion) -> DemConfig {
    let disc = BodyConfig {
        name: "body".into(),
        shape: BodyShape::Disc,
        sphero_radius: SPHERO,
        inertia: BodyInertia::Mass(MASS),
        motion,
        ..BodyConfig::default()
    };
    DemConfig {
        bodies: vec![disc],
        point_contact: ContactLaw::linear(STIFFNESS, 0.0, 0.0, 0.0),
        skin: 1e-3,
        threads: 1,
        ..DemConfig::default()
    }
}

/// The same, which forces move where the solver takes such bodies: enough where physics does not matter.
pub fn one_disc(bench: &Bench) -> DemConfig {
    disc(if bench.takes("motion:free") {
        Motion::Free
    } else {
        Motion::Fixed
    })
}

/// Points at rest at these places (m), with the ids 0, 1, 2 and so on.
pub fn points(places: impl IntoIterator<Item = [f64; 2]>) -> Points {
    let mut points = Points::default();
    for (id, position) in (0..).zip(places) {
        points.set.push(ImpInfo {
            id,
            radius: RADIUS,
            mass: 0.5,
            ..ImpInfo::default()
        });
        points.states.push(ImpState {
            position,
            ..ImpState::default()
        });
    }
    points
}

/// What presses a disc at the origin: two points, from the right and from the left.
pub fn pressed() -> Points {
    let x = SPHERO + 0.9 * RADIUS;
    points([[x, 0.0], [-x, 0.0]])
}
