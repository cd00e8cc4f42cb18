//! A saved state as bytes: the result of [`save`](crate::solver::MpmSolver::save), which `restore` takes back.
//!
//! The bytes begin with the name of their format, so that the state of another solver, or of another version of the same
//! one, is refused by name. The [`ConfigurationMark`] of the solver's configuration follows, so that the state of another
//! configuration is refused by the key that differs. The state itself is one value: what a solver saves is what
//! `#[derive(Serialize, Deserialize)]` finds in it.

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::message::codec::{decode, decode_first, encode};
use crate::solver::Refusal;

/// A refusal to restore.
pub fn refusal(message: impl Into<String>) -> Refusal {
    Refusal::new("restore", message)
}

/// The parts of a configuration that a saved state depends on, by the scene's keys. A state of a configuration with
/// another part is refused; all other parts may change from the saved step on.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConfigurationMark(Vec<(String, String)>);

impl ConfigurationMark {
    /// Adds a part: its value as JSON, or the hash of that where it is long.
    pub fn add(&mut self, key: impl Into<String>, value: &impl Serialize) {
        let text = serde_json::to_string(value).expect("configurations serialise");
        let short = if text.len() <= 100 {
            text
        } else {
            format!("{}...", &blake3::hash(text.as_bytes()).to_hex()[..16])
        };
        self.0.push((key.into(), short));
    }

    /// The bytes of `state`, named `format` and marked with this configuration.
    pub fn seal<T: Serialize>(&self, format: &str, state: &T) -> Vec<u8> {
        pack(format, &(self, state))
    }

    /// The state in `bytes`, which must be of this format and configuration.
    ///
    /// # Errors
    /// A [`Refusal`] of the key `restore` that says what differs.
    pub fn open<T: DeserializeOwned>(&self, format: &str, bytes: &[u8]) -> Result<T, Refusal> {
        let damaged = |e| refusal(format!("damaged `{format}`: {e}"));
        let bytes = without_name(format, bytes)?;
        let (mark, used): (Self, usize) = decode_first(bytes).map_err(damaged)?;
        self.check(&mark)?;
        decode(&bytes[used..]).map_err(damaged)
    }

    fn check(&self, saved: &Self) -> Result<(), Refusal> {
        let [mut here, mut there] = [self.0.iter(), saved.0.iter()];
        loop {
            let difference = match (here.next(), there.next()) {
                (None, None) => return Ok(()),
                (Some(own), Some(other)) if own == other => continue,
                (Some((key, own)), Some((other, value))) if key == other => {
                    format!("was saved with `{key} = {value}`, this configuration has `{own}`")
                }
                (Some((key, _)), _) => format!("has no `{key}` where this configuration has one"),
                (None, Some((key, _))) => format!("has `{key}`, this configuration has none"),
            };
            return Err(refusal(format!("the state {difference}")));
        }
    }
}

/// The bytes of `state`, marked as `format`, such as `tandem-dem 1`.
pub fn pack<T: Serialize>(format: &str, state: &T) -> Vec<u8> {
    let mut bytes = encode(&format);
    bytes.extend(encode(state));
    bytes
}

/// The state in `bytes`, which must be marked as `format`.
///
/// # Errors
/// A [`Refusal`] of the key `restore` that says what the bytes are.
pub fn unpack<T: DeserializeOwned>(format: &str, bytes: &[u8]) -> Result<T, Refusal> {
    decode(without_name(format, bytes)?).map_err(|e| refusal(format!("damaged `{format}`: {e}")))
}

/// What follows the name of the format in `bytes`.
fn without_name<'a>(format: &str, bytes: &'a [u8]) -> Result<&'a [u8], Refusal> {
    bytes.strip_prefix(&encode(&format)[..]).ok_or_else(|| {
        let found = bytes.get(8..64.min(bytes.len())).unwrap_or_default();
        let found: String = String::from_utf8_lossy(found)
            .chars()
            .take_while(|c| c.is_ascii_graphic() || *c == ' ')
            .collect();
        let text = format!("the saved state begins with `{found}`, expected `{format}`");
        refusal(text)
    })
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

    #[test]
    fn the_state_of_another_configuration_is_refused_by_its_key() {
        let mark = |parts: &[(&str, &[f64])]| {
            let mut mark = ConfigurationMark::default();
            for (key, value) in parts {
                mark.add(*key, value);
            }
            mark
        };
        let long = [0.1; 50];
        let own = mark(&[("mpm.cell", &[0.5]), ("mpm.domain", &long)]);
        let bytes = own.seal("a 1", &7_u32);
        assert_eq!(own.open::<u32>("a 1", &bytes).unwrap(), 7);
        let refused =
            |other: &ConfigurationMark| other.open::<u32>("a 1", &bytes).unwrap_err().message;
        let cell = refused(&mark(&[("mpm.cell", &[0.25]), ("mpm.domain", &long)]));
        assert!(
            cell.contains("`mpm.cell = [0.5]`") && cell.contains("`[0.25]`"),
            "{cell}"
        );
        let domain = refused(&mark(&[("mpm.cell", &[0.5]), ("mpm.domain", &long[1..])]));
        assert!(domain.contains("mpm.domain"), "{domain}");
        assert!(refused(&mark(&[("mpm.cell", &[0.5])])).contains("has `mpm.domain`"));
        let more = mark(&[
            ("mpm.cell", &[0.5]),
            ("mpm.domain", &long),
            ("mpm.skin", &[]),
        ]);
        assert!(refused(&more).contains("has no `mpm.skin`"));
    }
}
