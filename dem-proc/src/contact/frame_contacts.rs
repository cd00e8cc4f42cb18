//! Contacts as frames contain them: both bodies, position and force.

use interface::Vec2;
use interface::message::wire::ContactState;

/// The values of [`ContactState::with`] for two bodies, for a body and a point, and for two points.
const BODY: u64 = 0;
pub(crate) const POINT: u64 = 1;
pub(crate) const POINTS: u64 = 2;

/// A contact of the two `bodies` at `at` (m), with this force (N/m) on the first of them.
pub(crate) fn between_bodies(bodies: [u32; 2], at: Vec2, force: Vec2) -> ContactState {
    let [body, other] = bodies.map(u64::from);
    ContactState {
        body,
        other,
        with: BODY,
        position: at.into(),
        force: force.into(),
    }
}

/// A contact of two points with these identities at `at` (m), with this force (N/m) on the first of them.
pub(crate) fn between_points(ids: [u64; 2], at: Vec2, force: Vec2) -> ContactState {
    let [body, other] = ids;
    ContactState {
        body,
        other,
        with: POINTS,
        position: at.into(),
        force: force.into(),
    }
}
