//! A saved state as bytes: the result of [`save`](crate::solver::MpmSolver::save), which `restore` takes back.
//!
//! The bytes begin with the name of their format, so that the state of another solver, or of another version of the same
//! one, is refused by name.

use serde::{Serialize, de::DeserializeOwned};

use crate::message::codec::{decode_state, encode_state};
use crate::solver::Refusal;

/// The bytes of `state`, marked as `format`, such as `tandem-dem 1`.
pub fn pack<T: Serialize>(format: &str, state: &T) -> Vec<u8> {
    let mut bytes = encode_state(&format);
    bytes.extend(encode_state(state));
    bytes
}

/// The state in `bytes`, which must be marked as `format`.
///
/// # Errors
/// A [`Refusal`] of the key `restore` that says what the bytes are.
pub fn unpack<T: DeserializeOwned>(format: &str, bytes: &[u8]) -> Result<T, Refusal> {
    let mark = encode_state(&format);
    let Some(state) = bytes.strip_prefix(&mark[..]) else {
        let found = bytes.get(8..64.min(bytes.len())).unwrap_or_default();
        let found: String = String::from_utf8_lossy(found)
            .chars()
            .take_while(|c| c.is_ascii_graphic() || *c == ' ')
            .collect();
        let text = format!("the saved state begins with `{found}`, expected `{format}`");
        return Err(Refusal::new("restore", text));
    };
    decode_state(state).map_err(|e| Refusal::new("restore", format!("damaged `{format}`: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_comes_back_and_another_one_is_refused_by_name() {
        let bytes = pack("tandem-dem 1", &vec![0.1_f64, -0.0]);
        let back: Vec<f64> = unpack("tandem-dem 1", &bytes).unwrap();
        assert_eq!(back[1].to_bits(), (-0.0_f64).to_bits());
        let other = unpack::<Vec<f64>>("tandem-dem 2", &bytes).unwrap_err();
        assert!(other.message.contains("`tandem-dem 1"), "{other}");
        let torn = unpack::<Vec<f64>>("tandem-dem 1", &bytes[..bytes.len() - 1]);
        assert!(torn.unwrap_err().message.contains("damaged"));
        assert!(unpack::<Vec<f64>>("tandem-dem 1", &[]).is_err());
    }
}
