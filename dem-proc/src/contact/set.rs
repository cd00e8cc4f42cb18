//! A set of points in a saved state: the bytes of its records on the wire.

use interface::message::wire::{ImpInfo, Record, bytes_of, records_of};
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::law::history::SavedHistories;
use crate::saved::refusal;

/// The history of a chain in a saved state, without the set.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SavedChain {
    /// Positions one step before in m, slot by slot.
    pub previous: Vec<Option<[f64; 2]>>,
    /// Body, part, markers, share, normal force in N/m, and spring of each minimum that presses.
    pub held: Vec<(u32, u32, [u64; 2], f64, f64, u32)>,
    /// The histories of the springs.
    pub histories: SavedHistories,
}

/// A set of points as bytes.
pub fn save_set(set: &[ImpInfo]) -> Vec<u8> {
    bytes_of(set).to_vec()
}

/// The set that these bytes encode.
///
/// # Errors
/// A refusal if they are not a set.
pub fn restored_set(bytes: &[u8]) -> Result<Vec<ImpInfo>, Refusal> {
    let Some(set) = records_of::<ImpInfo>(bytes) else {
        return Err(refusal(format!("{} bytes are no set", bytes.len())));
    };
    for info in &set {
        let named = |field| refusal(format!("point {}: {field} is not allowed", info.id));
        info.check().map_err(named)?;
    }
    Ok(set)
}
