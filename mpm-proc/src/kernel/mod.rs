//! What the loops are made of: lanes, windows of nodes, threads, and the shape functions and transfers that they are
//! compiled for.

pub mod lanes;
pub mod shape;
pub mod spread;
pub mod threads;
pub mod tiles;
pub mod transfer;
pub mod window;
