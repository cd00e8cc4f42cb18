//! From the chains of a configuration to markers.

use interface::config::{Interface, MpmConfig};
use interface::solver::Refusal;

use super::fields::Fields;
use crate::state::markers::{Chain, Markers};

/// The markers of the configuration, whose identities begin with `first_id`, on clouds of these contact radii (m); none
/// where bodies meet points.
///
/// # Errors
/// A [`Refusal`] of a velocity that is not finite at a marker.
pub fn markers(
    config: &MpmConfig,
    first_id: u64,
    radii: &[f64],
) -> Result<Option<Markers>, Refusal> {
    if config.interface == Interface::Points {
        return Ok(None);
    }
    let (mut chains, mut x, mut v) = (Vec::new(), Vec::new(), Vec::new());
    let mut sorted: Vec<_> = config.chains.iter().collect();
    sorted.sort_by_key(|chain| chain.group); // ids rise with the group
    for chain in sorted {
        let group = &config.groups[chain.group];
        let mass = config.materials[group.material].density * config.cell * config.cell;
        chains.push(Chain {
            cloud: chain.group as u32,
            first: x.len(),
            count: chain.markers.len(),
            closed: chain.closed,
            full: chain.floor * mass,
            mass,
            radius: radii[chain.group],
        });
        x.extend_from_slice(&chain.markers);
        v.extend(Fields::new(config, chain.group)?.velocities(&chain.markers)?);
    }
    Ok(Some(Markers::new(chains, first_id, x, v)))
}
