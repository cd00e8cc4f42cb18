//! The grid of a configuration.

use interface::config::MpmConfig;

use crate::kernel::tiles::Geometry;

/// The grid of a configuration without faults.
pub fn geometry(config: &MpmConfig) -> Geometry {
    let [lower, upper] = config.domain;
    Geometry {
        lower,
        upper,
        // The quotient of two decimals of a scene is an integer only up to rounding.
        cells: [0, 1].map(|a| ((upper[a] - lower[a]) / config.cell).round() as i64),
        cell: config.cell,
        periodic: config.walls.periodic(),
    }
}
