//! The bodies that clauses are judged with. Lengths are around a centimetre, stiffness and mass such that a contact
//! lasts around ten milliseconds.

use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion};

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

/// A linear law of [`STIFFNESS`] with these k_t (N/m), mu and zeta.
pub fn law(tangential_stiffness: f64, friction: f64, damping_ratio: f64) -> ContactLaw {
    ContactLaw::linear(STIFFNESS, tangential_stiffness, friction, damping_ratio)
}

/// The same without friction or damping.
pub fn elastic() -> ContactLaw {
    law(0.0, 0.0, 0.0)
}

/// Bodies that touch points by `law`, and not one another; no gravity.
pub fn scene(bodies: Vec<BodyConfig>, law: ContactLaw) -> DemConfig {
    DemConfig {
        bodies,
        point_contact: law,
        skin: 1e-3,
        threads: 1,
        ..DemConfig::default()
    }
}

/// A body at rest, of [`MASS`].
pub fn body(shape: BodyShape, position: [f64; 2], motion: Motion) -> BodyConfig {
    BodyConfig {
        name: "body".into(),
        shape,
        sphero_radius: SPHERO,
        inertia: BodyInertia::Mass(MASS),
        position,
        motion,
        ..BodyConfig::default()
    }
}

/// A disc that forces move.
pub fn disc(position: [f64; 2]) -> BodyConfig {
    body(BodyShape::Disc, position, Motion::Free)
}

/// A disc at the origin that nothing moves, without friction.
pub fn held_disc() -> DemConfig {
    let disc = body(BodyShape::Disc, [0.0; 2], Motion::Fixed);
    scene(vec![disc], elastic())
}

/// One disc at the origin, without friction, that forces move where the solver takes such bodies: enough where physics
/// does not matter.
pub fn one_disc(bench: &Bench) -> DemConfig {
    let mut config = held_disc();
    if bench.takes("motion:free") {
        config.bodies[0].motion = Motion::Free;
    }
    config
}

/// What presses a disc at the origin: two points, from the right and from the left.
pub fn pressed() -> Points {
    let x = SPHERO + 0.9 * RADIUS;
    Points::new()
        .with([x, 0.0], [0.0; 2], RADIUS, 0.5)
        .with([-x, 0.0], [0.0; 2], RADIUS, 0.5)
}
