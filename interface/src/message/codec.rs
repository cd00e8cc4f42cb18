//! Control messages and saved states to bytes and back. The only file that names bincode (docs/decisions/0001-bincode.md).
//!
//! The layout is that of bincode 1 ("legacy"): little-endian, fixed-size integers, `u64` lengths, `u32` variant
//! numbers, no padding; simple enough to be written by hand in any language. PROTOCOL.md section 3 spells it out.

use serde::{Serialize, de::DeserializeOwned};
use thiserror::Error;

/// Bytes that are not a valid message.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("not a control message of this protocol: {0}")]
pub struct DecodeError(String);

impl DecodeError {
    /// There are bytes after the message.
    pub(crate) fn left_over(bytes: usize) -> Self {
        Self(format!("{bytes} bytes left over"))
    }

    /// The message is longer than any may be.
    pub(crate) fn too_long(bytes: usize) -> Self {
        Self(format!("{bytes} bytes"))
    }
}

/// The bytes of `value`: a control message, or a saved state.
///
/// # Panics
/// If serde cannot serialise a part of `value`. This is an assertion: every message and state can be serialised.
pub fn encode<T: Serialize>(value: &T) -> Vec<u8> {
    bincode::serde::encode_to_vec(value, bincode::config::legacy()).expect("it serialises")
}

/// The value in `bytes`, all of which must be used.
///
/// # Errors
/// [`DecodeError`] when bytes are missing, left over or out of range.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, DecodeError> {
    match decode_first(bytes)? {
        (value, used) if used == bytes.len() => Ok(value),
        (_, used) => Err(DecodeError::left_over(bytes.len() - used)),
    }
}

/// The value at the beginning of `bytes`, and how many bytes it takes. For a text, bincode allocates the length that
/// the bytes announce before it checks that so many are there, unless that exceeds a limit. The limit must be known at
/// compile time, so there is one for each size of message, at most 256 times as large. They are few, because each is
/// another copy of the code for every type.
///
/// # Errors
/// [`DecodeError`] when bytes are missing or out of range.
pub fn decode_first<T: DeserializeOwned>(bytes: &[u8]) -> Result<(T, usize), DecodeError> {
    macro_rules! bounded {
        ($($bits:literal)*) => {
            match bytes.len() {
                $(length if length <= 1 << $bits => {
                    let layout = bincode::config::legacy().with_limit::<{ 1 << ($bits + 2) }>();
                    bincode::serde::decode_from_slice(bytes, layout)
                })*
                length => return Err(DecodeError::too_long(length)),
            }
        };
    }
    bounded!(12 18 24 30 40).map_err(|e| DecodeError(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_the_documented_one() {
        // u32 variant, u64 length, bytes, as in PROTOCOL.md section 3.
        #[derive(Serialize)]
        enum Two {
            #[expect(dead_code, reason = "only its number matters")]
            First,
            Second(String),
        }
        assert_eq!(
            encode(&Two::Second("ab".into())),
            [1, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, b'a', b'b']
        );
    }

    #[test]
    fn truncated_and_overlong_messages_are_refused() {
        let bytes = encode(&(1u64, "text".to_string()));
        assert!(decode::<(u64, String)>(&bytes[..bytes.len() - 1]).is_err());
        let mut longer = bytes.clone();
        longer.push(0);
        assert_eq!(
            decode::<(u64, String)>(&longer).unwrap_err(),
            DecodeError("1 bytes left over".into())
        );
        // A length above the limit must be refused before it is allocated.
        let mut lying = bytes;
        lying[8..16].copy_from_slice(&u64::MAX.to_le_bytes());
        assert!(decode::<(u64, String)>(&lying).is_err());
        // This length once ended the process for lack of memory.
        lying[8..16].copy_from_slice(&(1_u64 << 46).to_le_bytes());
        assert!(decode::<(u64, String)>(&lying).is_err());
    }
}
