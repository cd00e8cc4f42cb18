//! Walls, and boxes of them.

use interface::config::{BodyConfig, BodyInertia, BodyShape, Motion};

/// A fixed rounded segment from `from` to `to` (m).
pub fn wall(name: &str, from: [f64; 2], to: [f64; 2], sphero_radius: f64) -> BodyConfig {
    BodyConfig {
        name: name.to_owned(),
        shape: BodyShape::Segment { ends: [from, to] },
        sphero_radius,
        inertia: BodyInertia::Density(1000.0),
        motion: Motion::Fixed,
        ..BodyConfig::default()
    }
}

/// Floor and two side walls around `0..width` x `0..height` (m), open above.
pub fn open_box(width: f64, height: f64, sphero_radius: f64) -> Vec<BodyConfig> {
    let a = sphero_radius;
    vec![
        wall("floor", [-a, -a], [width + a, -a], a),
        wall("left wall", [-a, -a], [-a, height], a),
        wall("right wall", [width + a, -a], [width + a, height], a),
    ]
}
