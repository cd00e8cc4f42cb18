//! Generated sets of bodies: random polygons, packings from a seed, stacks.
//!
//! Everything is a function of its parameters and a seed, the same on every machine. It makes configurations and knows
//! nothing of what is done with them, so scenes, tests and benches of any solver may use it.

use std::f64::consts::{PI, TAU};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use interface::config::{BodyConfig, BodyInertia, BodyShape, Motion};

/// A small generator (SplitMix64, Steele, Lea and Flood 2014): four lines, no state to share, good enough for sizes
/// and angles.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A generator that gives the same numbers for the same seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in 0 to 1, 1 excluded.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Sizes of bodies, as radius of the circle around the whole body in m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Sizes {
    /// All the same.
    Equal(f64),
    /// Uniform between two radii.
    Uniform {
        /// The smallest in m.
        from: f64,
        /// The largest in m.
        to: f64,
    },
}

impl Sizes {
    /// One size in m.
    pub fn draw(&self, random: &mut Random) -> f64 {
        match *self {
            Self::Equal(r) => r,
            Self::Uniform { from, to } => random.between(from, to),
        }
    }

    /// The smallest that can be drawn, in m.
    pub fn smallest(&self) -> f64 {
        match *self {
            Self::Equal(r) | Self::Uniform { from: r, .. } => r,
        }
    }

    /// The largest that can be drawn, in m.
    pub fn largest(&self) -> f64 {
        match *self {
            Self::Equal(r) | Self::Uniform { to: r, .. } => r,
        }
    }
}

/// What kind of grain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Grain {
    /// A disc.
    Disc,
    /// A square with level sides, rounded.
    Square {
        /// Sphero-radius as a fraction of the radius of the circle around the body, above 0 and below 1.
        roundness: f64,
    },
    /// A convex polygon with `corners` corners at irregular angles, rounded by `roundness` times its radius.
    Polygon {
        /// Corners, 3 or more.
        corners: u32,
        /// Sphero-radius as a fraction of the radius of the circle around the body, above 0 and below 1.
        roundness: f64,
        /// 0: regular; 1: the angle of each corner is drawn from nine tenths of its share of the circle.
        #[serde(default)]
        irregularity: f64,
    },
}

/// A set of bodies of one kind, as a scene asks for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyFill {
    /// Name of the set; its bodies are `NAME_0`, `NAME_1` and so on.
    pub name: String,
    /// How many.
    pub count: u32,
    /// Kind of body.
    pub grain: Grain,
    /// Sizes.
    pub size: Sizes,
    /// Density in kg/m^3.
    pub density: f64,
    /// Where they are.
    pub arrange: Arrangement,
    /// From which all chance comes; 0 by default.
    #[serde(default)]
    pub seed: u32,
    /// Initial velocity in m/s; at rest by default.
    #[serde(default)]
    pub velocity: [f64; 2],
    /// Name of the bodies' surface, by which `[[contact_pair]]` refers to it; none by default.
    #[serde(default)]
    pub surface: String,
}

/// Where the bodies of a set are at the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Arrangement {
    /// In rows from the bottom up, on a triangular lattice on which the largest size touches, so that none overlap; left to
    /// fall, a dense packing.
    Rows {
        /// Lower left corner in m.
        corner: [f64; 2],
        /// Width in m.
        width: f64,
    },
    /// One on another, each touching the one below.
    Stack {
        /// Where the lowest stands, in m.
        foot: [f64; 2],
    },
}

impl BodyFill {
    /// The bodies.
    pub fn bodies(&self) -> Vec<BodyConfig> {
        let mut bodies = match self.arrange {
            Arrangement::Rows { corner, width } => {
                let mut random = Random::new(u64::from(self.seed));
                let count = self.count as usize;
                let pitch = 2.0 * self.size.largest();
                let rise = pitch * (PI / 3.0).sin();
                let full = (width / pitch).floor().max(1.0) as usize;
                let mut bodies = Vec::with_capacity(count);
                let mut row = 0;
                while bodies.len() < count {
                    let shifted = row % 2 == 1 && (full as f64 + 0.5) * pitch > width;
                    let in_row = if shifted { full - 1 } else { full }.max(1);
                    let offset = if row % 2 == 1 { pitch } else { 0.5 * pitch };
                    for i in 0..in_row.min(count - bodies.len()) {
                        let x = offset + pitch * i as f64;
                        let y = 0.5 * pitch + rise * f64::from(row);
                        let at = [x + corner[0], y + corner[1]];
                        bodies.push(self.body(at, &mut random));
                    }
                    row += 1;
                }
                bodies
            }
            Arrangement::Stack { foot } => {
                let mut random = Random::new(u64::from(self.seed));
                let mut top = foot[1];
                let grain = |_| {
                    let mut body = self.body([foot[0], 0.0], &mut random);
                    let heights = body.shape.vertices().into_iter().map(|v| v[1]);
                    let [low, high] = heights
                        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], y| {
                            [l.min(y), h.max(y)]
                        });
                    body.position[1] = top + body.sphero_radius - low;
                    top = body.position[1] + high + body.sphero_radius;
                    body
                };
                (0..self.count).map(grain).collect()
            }
        };
        for (i, body) in bodies.iter_mut().enumerate() {
            body.name = format!("{}_{i}", self.name);
        }
        bodies
    }

    /// The next of its bodies, whose circle is about `position` (m); it has no name yet.
    fn body(&self, position: [f64; 2], random: &mut Random) -> BodyConfig {
        let radius = self.size.draw(random);
        let (shape, sphero_radius) = match self.grain {
            Grain::Disc => (BodyShape::Disc, radius),
            Grain::Square { roundness } => {
                let a = roundness * radius;
                let side = (radius - a) * 2.0_f64.sqrt();
                (
                    BodyShape::Rectangle {
                        width: side,
                        height: side,
                    },
                    a,
                )
            }
            Grain::Polygon {
                corners,
                roundness,
                irregularity,
            } => {
                let a = roundness * radius;
                let phase = random.between(0.0, TAU);
                let share = TAU / f64::from(corners);
                let vertex = |i: u32| {
                    let jitter = 0.45 * irregularity * random.between(-1.0, 1.0);
                    let (sin, cos) = (phase + share * (f64::from(i) + jitter)).sin_cos();
                    [(radius - a) * cos, (radius - a) * sin]
                };
                (
                    BodyShape::Polygon {
                        vertices: (0..corners).map(vertex).collect(),
                    },
                    a,
                )
            }
        };
        BodyConfig {
            name: String::new(),
            shape,
            sphero_radius,
            inertia: BodyInertia::Density(self.density),
            position,
            angle: 0.0,
            velocity: self.velocity,
            spin: 0.0,
            motion: Motion::Free,
            surface: self.surface.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_packing_and_nothing_overlaps() {
        for sizes in [
            Sizes::Equal(0.01),
            Sizes::Uniform {
                from: 0.005,
                to: 0.01,
            },
        ] {
            let packing = BodyFill {
                name: "grain".into(),
                count: 200,
                grain: Grain::Polygon {
                    corners: 5,
                    roundness: 0.1,
                    irregularity: 0.5,
                },
                size: sizes,
                density: 2000.0,
                arrange: Arrangement::Rows {
                    corner: [0.0; 2],
                    width: 0.3,
                },
                seed: 3,
                velocity: [0.0; 2],
                surface: String::new(),
            };
            let bodies = packing.bodies();
            assert_eq!(bodies, packing.bodies());
            assert_ne!(bodies, BodyFill { seed: 4, ..packing }.bodies());
            let largest = sizes.largest();
            for (i, a) in bodies.iter().enumerate() {
                assert!(a.position[0] >= largest * 0.999 && a.position[0] <= 0.3 - largest * 0.999);
                for b in &bodies[..i] {
                    let d = (a.position[0] - b.position[0]).hypot(a.position[1] - b.position[1]);
                    assert!(d >= 2.0 * largest * (1.0 - 1e-12));
                }
            }
        }
    }

    #[test]
    fn a_stack_touches_and_a_filled_box_is_in_its_place() {
        let stack = BodyFill {
            name: "block".into(),
            count: 4,
            grain: Grain::Square { roundness: 0.2 },
            size: Sizes::Uniform {
                from: 0.05,
                to: 0.1,
            },
            density: 1000.0,
            arrange: Arrangement::Stack { foot: [1.0, 2.0] },
            seed: 7,
            velocity: [0.0, -1.0],
            surface: "wood".into(),
        };
        let bodies = stack.bodies();
        let half = |b: &BodyConfig| {
            let BodyShape::Rectangle { height, .. } = b.shape else {
                panic!("{:?}", b.shape)
            };
            0.5 * height + b.sphero_radius
        };
        let mut top = 2.0;
        for (i, b) in bodies.iter().enumerate() {
            assert!((b.position[1] - half(b) - top).abs() < 1e-12 && b.position[0] == 1.0);
            top = b.position[1] + half(b);
            assert_eq!(
                (b.name.clone(), &*b.surface),
                (format!("block_{i}"), "wood")
            );
        }
        let rows = BodyFill {
            arrange: Arrangement::Rows {
                corner: [3.0, 4.0],
                width: 0.5,
            },
            ..stack
        };
        for b in rows.bodies() {
            assert!(
                b.position[0] >= 3.1 - 1e-9 && b.position[0] < 3.4 + 1e-9 && b.position[1] >= 4.1
            );
            assert_eq!(b.velocity, [0.0, -1.0]);
        }
    }
}
