//! Contacts as frames contain them: both bodies, position and force.

use interface::Vec2;
use interface::message::wire::ContactState;

/// The value of [`ContactState::with`] for two bodies.
pub(crate) const BODY: u64 = 0;
/// For a body and a point.
pub(crate) const POINT: u64 = 1;
/// For two points.
pub(crate) const POINTS: u64 = 2;

/// A contact of two at `at` (m), with this force (N/m) on the first of them.
pub(crate) fn between([body, other]: [u64; 2], with: u64, at: Vec2, force: Vec2) -> ContactState {
    ContactState {
        body,
        other,
        with,
        position: at.into(),
        force: force.into(),
    }
}
