//! The faults of the chains of a configuration with segments.

use super::fault::Faults;
use super::{ContactForceScheme, Interface, MpmConfig, Wall};

impl MpmConfig {
    /// Refuses chains without segments, and segments in a configuration in which bodies cannot meet them.
    pub(super) fn chain_faults(&self, found: &mut Faults) {
        if self.interface == Interface::Points {
            if !self.chains.is_empty() {
                let help = "chains are used only with `interface = \"segments\"`";
                found.add("mpm.chain.0", "a chain", "none with \"points\"", help);
            }
            return;
        }
        let mut refuse = |key: &str, help: &str| {
            found.add(
                "mpm.interface",
                "\"segments\"",
                "\"points\"",
                format!("{key}: {help}"),
            );
        };
        if self.grid_contact.is_some() {
            refuse(
                "mpm.grid_contact",
                "segments cannot be combined with contact on the grid",
            );
        }
        if self.layers {
            refuse(
                "mpm.layers",
                "segments cannot be combined with grid layers of groups",
            );
        }
        let walls = [self.walls.left, self.walls.bottom];
        if walls.contains(&Wall::Periodic) {
            refuse("mpm.walls", "a chain cannot cross a periodic wall");
        }
        if self.contact_force != ContactForceScheme::Point {
            refuse(
                "mpm.contact_force",
                "a marker distributes forces to the nodes with the weights that move it",
            );
        }
        for (g, group) in self.groups.iter().enumerate() {
            if !self.chains.iter().any(|chain| chain.group == g) {
                found.add(
                    "mpm.chain",
                    format!("no chain of the points \"{}\"", group.name),
                    "one or more of each group",
                    "bodies would have no contact with the group: write `[[mpm.chain]]` with `points` and `spacing`",
                );
            }
        }
        for c in 0..self.chains.len() {
            self.one_chain_faults(found, c);
        }
    }

    fn one_chain_faults(&self, found: &mut Faults, c: usize) {
        let (chain, path) = (&self.chains[c], format!("mpm.chain.{c}"));
        if chain.group >= self.groups.len() {
            let expected = format!("one of {} groups, counted from 0", self.groups.len());
            found.add(
                format!("{path}.points"),
                chain.group.to_string(),
                expected,
                "",
            );
        }
        let key = format!("{path}.floor");
        let share = chain.floor > 0.0 && chain.floor <= 1.0;
        found.number(key, chain.floor, share, "a share above 0, at most 1");
        let least = if chain.closed { 3 } else { 2 };
        let markers = format!("{path}.markers");
        if chain.markers.len() < least {
            let value = chain.markers.len().to_string();
            found.add(markers, value, format!("{least} markers or more"), "");
            return;
        }
        let [lower, upper] = self.domain;
        let inside = |x: &[f64; 2]| (0..2).all(|a| x[a] >= lower[a] && x[a] <= upper[a]);
        if let Some(k) = chain.markers.iter().position(|x| !inside(x)) {
            let value = format!("marker {k} at {:?} m", chain.markers[k]);
            found.add(markers, value, "places within mpm.domain", "");
            return;
        }
        let pairs = chain.markers.windows(2).map(|w| (w[0], w[1]));
        let last = chain
            .closed
            .then(|| (chain.markers[chain.markers.len() - 1], chain.markers[0]));
        if let Some((x, _)) = pairs.chain(last).find(|(a, b)| a == b) {
            let value = format!("two markers at {x:?} m, one after the other");
            found.add(markers, value, "a length of every segment", "");
        }
    }
}
