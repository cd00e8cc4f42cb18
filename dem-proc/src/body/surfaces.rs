//! The surfaces that a scene's table of laws names, as numbers.

use interface::config::DemConfig;
use interface::config::surfaces::ContactPair;

/// The names that a scene's table of laws uses, as numbers: 0 is every surface that the table does not name.
#[derive(Debug, Clone, Default)]
pub struct Surfaces(Vec<String>);

impl Surfaces {
    /// The names of a configuration.
    pub fn new(config: &DemConfig) -> Self {
        Self::of(&config.contact_pairs)
    }

    /// The names of a table.
    pub fn of(table: &[ContactPair]) -> Self {
        let pairs = table.iter();
        let mut names: Vec<String> = pairs.flat_map(|pair| pair.between.clone()).collect();
        names.sort_unstable();
        names.dedup();
        Self(names)
    }

    /// The number of a name.
    pub fn number(&self, name: &str) -> u32 {
        let found = self.0.binary_search_by(|known| known.as_str().cmp(name));
        found.map_or(0, |i| i as u32 + 1)
    }

    /// Their count, including the number for all other surfaces.
    pub fn count(&self) -> usize {
        self.0.len() + 1
    }
}
