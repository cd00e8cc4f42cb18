//! The parts of the loops: lanes, blocks and tiles of points, windows of nodes, threads, and the shape functions and
//! transfers that are their type parameters.

pub mod blocks;
pub mod lanes;
pub mod point_tile;
pub mod shape;
pub mod spread;
pub mod threads;
pub mod tiles;
pub mod transfer;
pub mod window;
