//! Control messages to bytes and back. The only file that names bincode (docs/decisions/0001-bincode.md).
//!
//! The layout is that of bincode 1 ("legacy"): little-endian, fixed-size integers, `u64` lengths, `u32` variant
//! numbers, no padding; simple enough to be written by hand in any language. PROTOCOL.md section 3 spells it out.

use serde::{Serialize, de::DeserializeOwned};
use thiserror::Error;

/// Largest control message in bytes: a scene's part with ten thousand bodies takes a few MB.
pub const MAX_BYTES: usize = 256 << 20;

/// Bytes that are not the message they should be.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("not a control message of this protocol: {0}")]
pub struct DecodeError(String);

impl DecodeError {
    /// Bytes after the message.
    pub(crate) fn left_over(bytes: usize) -> Self {
        Self(format!("{bytes} bytes left over"))
    }
}

/// The bytes of a saved state, which may be larger than a control message.
///
/// # Panics
/// If `state` has a part that serde cannot serialise: an assertion, no state has.
pub fn encode_state<T: Serialize>(state: &T) -> Vec<u8> {
    bincode::serde::encode_to_vec(state, bincode::config::legacy()).expect("states serialise")
}

/// The state in `bytes`, all of which must be used.
///
/// # Errors
/// [`DecodeError`] when bytes are missing, left over or out of range.
pub fn decode_state<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, DecodeError> {
    match decode_bounded(bytes)? {
        (state, used) if used == bytes.len() => Ok(state),
        (_, used) => Err(DecodeError::left_over(bytes.len() - used)),
    }
}

/// What is at the beginning of `bytes`, and how many of them it takes. bincode makes room for as many bytes as the length of
/// a text announces before it looks whether they are there, unless they are beyond a limit, which has to be known when this
/// is compiled: so there is one for each size of message, at most 64 times as large.
fn decode_bounded<T: DeserializeOwned>(bytes: &[u8]) -> Result<(T, usize), DecodeError> {
    macro_rules! bounded {
        ($($bits:literal)*) => {
            match bytes.len() {
                $(length if length <= 1 << $bits => {
                    let layout = bincode::config::legacy().with_limit::<{ 1 << ($bits + 2) }>();
                    bincode::serde::decode_from_slice(bytes, layout)
                })*
                length => return Err(DecodeError(format!("{length} bytes"))),
            }
        };
    }
    bounded!(12 16 20 24 28 32 36 40).map_err(|e| DecodeError(e.to_string()))
}

fn layout() -> impl bincode::config::Config {
    bincode::config::legacy().with_limit::<MAX_BYTES>()
}

/// The bytes of `message`.
///
/// # Panics
/// If `message` has a part that serde cannot serialise or exceeds [`MAX_BYTES`]: an assertion, no message type does.
pub fn encode<T: Serialize>(message: &T) -> Vec<u8> {
    bincode::serde::encode_to_vec(message, layout()).expect("control messages serialise")
}

/// The message in `bytes`, all of which must be used.
///
/// # Errors
/// [`DecodeError`] when bytes are missing, left over or out of range.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, DecodeError> {
    match decode_beginning(bytes)? {
        (message, used) if used == bytes.len() => Ok(message),
        (_, used) => Err(DecodeError::left_over(bytes.len() - used)),
    }
}

/// The message at the beginning of `bytes`, and how many of them it takes.
///
/// # Errors
/// [`DecodeError`] when bytes are missing or out of range.
pub fn decode_beginning<T: DeserializeOwned>(bytes: &[u8]) -> Result<(T, usize), DecodeError> {
    if bytes.len() > MAX_BYTES {
        return Err(DecodeError(format!("{} bytes", bytes.len())));
    }
    decode_bounded(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_the_documented_one() {
        // u32 variant, u64 length, bytes: as PROTOCOL.md section 3 writes it.
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
        // A length that claims more than the limit must not be believed.
        let mut lying = bytes;
        lying[8..16].copy_from_slice(&u64::MAX.to_le_bytes());
        assert!(decode::<(u64, String)>(&lying).is_err());
        // Of a state there is no limit but its own length: this ended the process for want of memory.
        lying[8..16].copy_from_slice(&(1_u64 << 46).to_le_bytes());
        assert!(decode_state::<(u64, String)>(&lying).is_err());
    }
}
