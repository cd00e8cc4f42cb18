//! Bodies: their constants, their state, and the loads of contact on them.

pub mod bodies;
pub mod displacement;
pub mod edge;
pub mod frame;
pub mod load;
pub mod shape;
pub mod surfaces;
