//! Contact between the points of two groups: names to indices.

use std::collections::BTreeMap;

use interface::config::GroupPair;

use super::problems::Problems;
use super::written::SceneWritten;

/// The pairs by the indices of their groups. Pairs with the name of a group that does not exist are refused and left
/// out.
pub(super) fn group_pairs(problems: &mut Problems, written: &SceneWritten) -> Vec<GroupPair> {
    let groups = written.mpm.as_ref().map_or(&[][..], |mpm| &mpm.points);
    let names = groups.iter().map(|group| group.name.as_str());
    let known: BTreeMap<&str, usize> = names.clone().zip(0..).collect();
    let mut pairs = Vec::new();
    for (i, pair) in written.group_pair.iter().enumerate() {
        let index = |name: &String| known.get(name.as_str()).copied();
        if let [Some(a), Some(b)] = [0, 1].map(|k| index(&pair.between[k])) {
            pairs.push(GroupPair {
                between: [a, b],
                law: pair.law,
            });
            continue;
        }
        let strange = pair.between.iter().find(|name| index(name).is_none());
        let name = strange.map_or("", String::as_str);
        let path = format!("group_pair.{i}.between");
        let message = format!("`{path}` has \"{name}\", expected two groups of points");
        problems.refuse_unknown(&path, &message, [name, "groups of points"], names.clone());
    }
    pairs
}
