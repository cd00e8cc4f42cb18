//! The faults of grid layers and of contact between groups of points (Chen 2023).

use super::fault::Faults;
use super::laws::Between;
use super::{DemConfig, Interface, MpmConfig};

impl MpmConfig {
    /// Checks layers, and the groups that touch.
    pub(super) fn layer_faults(&self, found: &mut Faults<'_>) {
        if self.layers && self.grid_contact.is_some() {
            let help =
                "groups on separate layers have no contact on the grid: leave out one of the two";
            let expected = "false with mpm.grid_contact";
            found.add("mpm.layers", "true", expected, help);
        }
        if !self.group_pairs.is_empty() && !self.layers {
            let help = "groups on one grid stick together: write `mpm.layers = true`";
            let expected = "true if groups have a contact law";
            found.add("mpm.layers", "false", expected, help);
        }
        let pairs = self.group_pairs.iter();
        let number = self.groups.len();
        between_faults(found, pairs, Some(number));
    }
}

impl DemConfig {
    /// Checks the laws between groups of points.
    pub(super) fn group_pair_faults(&self, found: &mut Faults<'_>) {
        let pairs = self.group_pairs.iter().map(|pair| &pair.between);
        between_faults(found, pairs, None);
        for (i, pair) in self.group_pairs.iter().enumerate() {
            let mut found = found.at(format!("group_pair.{i}.law"));
            pair.law.look(&mut found, Between::PointsAndBodies);
        }
        if !self.group_pairs.is_empty() && self.interface == Interface::Segments {
            let help = "markers of a boundary have no mass: use `points`";
            found.add("mpm.interface", "\"segments\"", "\"points\"", help);
        }
    }
}

/// Refuses a pair of a group with itself, a pair of groups that do not exist (`groups` is their number, where it is
/// known), and a repeated pair.
fn between_faults<'a>(
    found: &mut Faults<'_>,
    pairs: impl Iterator<Item = &'a [usize; 2]>,
    groups: Option<usize>,
) {
    let mut before: Vec<[usize; 2]> = Vec::new();
    for (i, &[a, b]) in pairs.enumerate() {
        let mut add = |expected: &str, help: &str| {
            let key = format!("group_pair.{i}.between");
            found.add(key, format!("[{a}, {b}]"), expected, help);
        };
        if groups.is_some_and(|count| a.max(b) >= count) {
            add("two existing groups, counted from 0", "");
        } else if a == b {
            let help = "a group has no contact with itself: its points are one continuum";
            add("two groups", help);
        } else if before.contains(&[a, b]) || before.contains(&[b, a]) {
            add("each pair once", "it is listed already, in either order");
        }
        before.push([a, b]);
    }
}
