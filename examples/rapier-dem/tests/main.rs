//! The example solver beside the built-in ones.

#[path = "../../../dem-proc/tests/capability_samples/mod.rs"]
mod capability_samples;
mod rapier;
mod trial;
