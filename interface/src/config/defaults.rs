//! Which fields of a configuration are not sent: those that have their default (PROTOCOL.md clause J-2).
//!
//! Numbers are compared by their bits: -0.0 is not the default 0.0, so a configuration reads back as it was, to the bit.
#![allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes every field by reference"
)]

/// Whether a value is its type's default.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Whether a number is 0.0.
pub(crate) fn is_zero(value: &f64) -> bool {
    value.to_bits() == 0
}

/// Whether both components are 0.0.
pub(crate) fn are_zero(value: &[f64; 2]) -> bool {
    value.iter().all(is_zero)
}

/// 1.0, the default of restitution.
pub(crate) fn one() -> f64 {
    1.0
}

/// Whether a number is 1.0.
pub(crate) fn is_one(value: &f64) -> bool {
    *value == one()
}

/// 0.1, the default of `eta` of a chain.
pub(crate) fn marker_floor() -> f64 {
    0.1
}

/// Whether a number is the default of `eta`.
pub(crate) fn is_marker_floor(value: &f64) -> bool {
    *value == marker_floor()
}

/// One thread, the default.
pub(crate) fn one_thread() -> usize {
    1
}

/// Whether a solver has one thread.
pub(crate) fn is_one_thread(threads: &usize) -> bool {
    *threads == one_thread()
}

/// Replaces the above for the schema of scenes, which lists every default.
pub(crate) fn never<T>(_: &T) -> bool {
    false
}
