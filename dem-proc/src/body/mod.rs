//! Bodies: what they are, where they are, what contact does to them.

pub mod bodies;
pub mod edge;
pub mod frame;
pub mod load;
pub mod odometer;
pub mod shape;
pub mod surfaces;
