//! Contacts as frames tell them: who presses on whom, where, and with which force.

use interface::Vec2;
use interface::message::wire::ContactState;

/// What [`ContactState::with`] is for a body, and for a point.
const BODY: u64 = 0;
pub(crate) const POINT: u64 = 1;

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
