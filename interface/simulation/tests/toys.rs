//! The toys of the tests of `interface`, as a scenario has them.

#[path = "../../tests/toys/mod.rs"]
mod both;

use crate::session::SolverPair;

use both::{HalfPlane, Points, dem_config, mpm_config};

/// Most points of a toy.
pub const MOST: usize = 4;

/// The toys.
pub const TOYS: SolverPair = SolverPair {
    name: "toys",
    configs: || {
        [
            serde_json::to_string(&mpm_config()).unwrap(),
            serde_json::to_string(&dem_config()).unwrap(),
        ]
    },
    measured: [1, 1],
    build: |plan| {
        let points = Points {
            start: |i| [0.02 + 0.004 * i as f64, -1.0 - 0.5 * i as f64],
            skin: 0.02,
            limit_at: Some((plan.stiffens_at, 2e6)),
            ..Points::new(plan.points)
        };
        let wall = HalfPlane {
            speed: 0.25,
            stiffening: 1e-3,
            damps_at: Some(plan.damps_at),
            ..HalfPlane::default()
        };
        (Box::new(points), Box::new(wall))
    },
};
