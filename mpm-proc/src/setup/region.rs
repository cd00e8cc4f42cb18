//! The points that are in a region of the scene at the start.

use interface::config::MpmConfig;
use interface::solver::Refusal;

/// Identities, less the group's first, of the points of a group at `positions` (m) that are in a region, its edge included.
///
/// # Errors
/// A [`Refusal`] of `KEY.within` if there is none.
pub fn points_within(
    config: &MpmConfig,
    group: usize,
    positions: &[[f64; 2]],
    within: [[f64; 2]; 2],
    key: &str,
) -> Result<Vec<u32>, Refusal> {
    let all = (0..).zip(positions);
    let all = all.filter(|(_, x)| config.is_within(**x, within));
    let locals: Vec<u32> = all.map(|(local, _)| local).collect();
    if locals.is_empty() {
        let [low, high] = within;
        return Err(Refusal::new(
            format!("{key}.within"),
            format!(
                "the region {low:?} to {high:?} m holds no points of group '{}'; make it larger or move it",
                config.groups[group].name
            ),
        ));
    }
    Ok(locals)
}
