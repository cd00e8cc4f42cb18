//! A set of points in a saved state: the bytes of its records on the wire.

use interface::message::wire::{ImpInfo, Record};
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::law::history::SavedHistories;
use crate::saved::{count, refusal};

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
    let mut bytes = vec![0; size_of_val(set)];
    for (info, bytes) in set.iter().zip(bytes.chunks_mut(size_of::<ImpInfo>())) {
        info.write(bytes);
    }
    bytes
}

/// The set that these bytes encode.
///
/// # Errors
/// A refusal if they are not a set.
pub fn restored_set(bytes: &[u8]) -> Result<Vec<ImpInfo>, Refusal> {
    let (records, rest) = bytes.as_chunks::<{ size_of::<ImpInfo>() }>();
    count("bytes beyond the set", rest.len(), 0)?;
    let read = |bytes: &[u8; size_of::<ImpInfo>()]| {
        let info = ImpInfo::read(bytes);
        let named = |field| refusal(format!("point {}: {field} is not allowed", info.id));
        info.check().map_err(named)?;
        Ok(info)
    };
    records.iter().map(read).collect()
}
