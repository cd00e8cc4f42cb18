//! The faults of the chains of a configuration with segments.

use super::fault::Faults;
use super::{Chain, ContactForceScheme, Fill, Interface, MpmConfig};

impl MpmConfig {
    /// Refuses chains without segments, and segments in a configuration in which bodies cannot meet them.
    pub(super) fn chain_faults(&self, found: &mut Faults<'_>) {
        if self.interface == Interface::Points {
            if !self.chains.is_empty() {
                let help = "chains are used only with `interface = \"segments\"`";
                found.add("mpm.chain.0", "a chain", "none with \"points\"", help);
            }
            return;
        }
        let mut refuse = |key: &str, help: &str| {
            let help = format!("{key}: {help}");
            found.add("mpm.interface", "\"segments\"", "\"points\"", help);
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
        if self.walls.periodic().contains(&true) {
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
        for (c, chain) in self.chains.iter().enumerate() {
            self.one_chain_faults(&mut found.at(format!("mpm.chain.{c}")), chain);
        }
    }

    fn one_chain_faults(&self, found: &mut Faults<'_>, chain: &Chain) {
        if chain.group >= self.groups.len() {
            let expected = format!("one of {} groups, counted from 0", self.groups.len());
            found.add("points", chain.group, expected, "");
        }
        let share = chain.floor > 0.0 && chain.floor <= 1.0;
        found.number("floor", chain.floor, share, "a share above 0, at most 1");
        let least = if chain.closed { 3 } else { 2 };
        let (markers, count) = ("markers", chain.markers.len());
        if count < least {
            found.add(markers, count, format!("{least} markers or more"), "");
            return;
        }
        let [lower, upper] = self.domain;
        let inside = |x: &[f64; 2]| (0..2).all(|a| x[a] >= lower[a] && x[a] <= upper[a]);
        if let Some(k) = chain.markers.iter().position(|x| !inside(x)) {
            let value = format!("marker {k} at {:?} m", chain.markers[k]);
            found.add(markers, value, "places within mpm.domain", "");
            return;
        }
        if let Some((x, _)) = chain.segments().find(|(a, b)| a == b) {
            let value = format!("two markers at {x:?} m, one after the other");
            found.add(markers, value, "a length of every segment", "");
            return;
        }
        let group = self.groups.get(chain.group);
        if let Some(group) = group.filter(|group| self.has_on_its_right(chain, &group.fill)) {
            let value = format!("the material of \"{}\" on its right", group.name);
            let help = "write the markers in the opposite order: bodies would fall through";
            found.add(markers, value, "the material on its left", help);
        }
    }

    /// Whether the outline of the material lies to the left of the chain: the depth in the material falls from the right
    /// side of the segments to the left one, on the average over their length.
    fn has_on_its_right(&self, chain: &Chain, fill: &Fill) -> bool {
        let near = 1e-3 * self.cell;
        let rise = |(a, b): ([f64; 2], [f64; 2])| {
            let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
            let (length, middle) = (dx.hypot(dy), [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]);
            let left = [-dy / length * near, dx / length * near];
            let beside = |side: f64| fill.depth([0, 1].map(|i| middle[i] + side * left[i]));
            Some((beside(1.0)? - beside(-1.0)?) * length)
        };
        let rises: Option<f64> = chain.segments().map(rise).sum();
        rises.is_some_and(|rises| rises < 0.0)
    }
}

impl Chain {
    /// Both ends of each segment in m.
    fn segments(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
        let from = self.markers.iter();
        let to = self.markers.iter().cycle().skip(1);
        let segments = self.markers.len() - usize::from(!self.closed);
        from.zip(to).take(segments).map(|(a, b)| (*a, *b))
    }
}
