//! Verlet lists: the pairs that may touch before the list is rebuilt.

pub mod cells;
pub mod neighbours;
pub mod now;
pub mod watch;
