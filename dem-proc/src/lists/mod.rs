//! Verlet lists: which pairs may touch before the list is built again.

pub mod cells;
pub mod neighbours;
pub mod watch;
