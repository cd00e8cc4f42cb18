//! What the loops are made of: lanes, blocks and tiles of points, windows of nodes, threads, and the shape functions and
//! transfers that the loops are compiled for.

pub mod blocks;
pub mod lanes;
pub mod point_tile;
pub mod shape;
pub mod spread;
pub mod threads;
pub mod tiles;
pub mod transfer;
pub mod window;
