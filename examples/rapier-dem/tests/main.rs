//! The example solver beside the built-in ones, and judged by the kit.

mod kit;
mod rapier;
