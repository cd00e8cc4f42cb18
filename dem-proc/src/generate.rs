//! Generated sets of bodies: random polygons, packings from a seed, stacks, boxes to hold them.
//!
//! Everything is a function of its parameters and a seed, the same on every machine.

use std::f64::consts::{PI, TAU};

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
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sizes {
    /// All the same.
    Equal(f64),
    /// Uniform between two radii.
    Uniform(f64, f64),
    /// Normal with a mean and a standard deviation, cut off at two deviations (Box and Muller 1958).
    Normal(f64, f64),
}

impl Sizes {
    /// One size in m.
    pub fn draw(&self, random: &mut Random) -> f64 {
        match *self {
            Self::Equal(r) => r,
            Self::Uniform(low, high) => random.between(low, high),
            Self::Normal(mean, deviation) => loop {
                let radius = (-2.0 * (1.0 - random.unit()).ln()).sqrt();
                let z = radius * (TAU * random.unit()).cos();
                if z.abs() <= 2.0 {
                    return mean + deviation * z;
                }
            },
        }
    }

    /// The largest that can be drawn, in m.
    pub fn largest(&self) -> f64 {
        match *self {
            Self::Equal(r) | Self::Uniform(_, r) => r,
            Self::Normal(mean, deviation) => mean + 2.0 * deviation,
        }
    }
}

/// What kind of grain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grain {
    /// A disc.
    Disc,
    /// A convex polygon with `corners` corners at irregular angles, rounded by `roundness` times its radius.
    Polygon {
        /// Corners, 3 or more.
        corners: usize,
        /// Sphero-radius as a fraction of the radius of the circle around the body, between 0 and 1.
        roundness: f64,
        /// 0: regular; 1: the angle of each corner is drawn from its whole share of the circle.
        irregularity: f64,
    },
}

impl Grain {
    /// Spheropentagons, a tenth rounded, moderately irregular.
    pub const PENTAGON: Self = Self::Polygon {
        corners: 5,
        roundness: 0.1,
        irregularity: 0.5,
    };

    /// A free body of this kind: its circle has radius `radius` (m) about `position` (m).
    pub fn body(
        &self,
        name: String,
        radius: f64,
        density: f64,
        position: [f64; 2],
        random: &mut Random,
    ) -> BodyConfig {
        let (shape, sphero_radius) = match *self {
            Self::Disc => (BodyShape::Disc, radius),
            Self::Polygon {
                corners,
                roundness,
                irregularity,
            } => {
                let a = roundness * radius;
                let phase = random.between(0.0, TAU);
                let share = TAU / corners as f64;
                let vertex = |i: usize| {
                    let jitter = 0.45 * irregularity * random.between(-1.0, 1.0);
                    let (sin, cos) = (phase + share * (i as f64 + jitter)).sin_cos();
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
            name,
            shape,
            sphero_radius,
            inertia: BodyInertia::Density(density),
            position,
            angle: 0.0,
            velocity: [0.0, 0.0],
            spin: 0.0,
            motion: Motion::Free,
            surface: String::new(),
        }
    }
}

/// A fixed rounded segment from `from` to `to` (m).
pub fn wall(name: &str, from: [f64; 2], to: [f64; 2], sphero_radius: f64) -> BodyConfig {
    BodyConfig {
        name: name.to_owned(),
        shape: BodyShape::Segment { ends: [from, to] },
        sphero_radius,
        inertia: BodyInertia::Density(1000.0),
        position: [0.0, 0.0],
        angle: 0.0,
        velocity: [0.0, 0.0],
        spin: 0.0,
        motion: Motion::Fixed,
        surface: String::new(),
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

/// What a packing is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Packing {
    /// Kind of grain.
    pub grain: Grain,
    /// Sizes.
    pub sizes: Sizes,
    /// Density in kg/m^3.
    pub density: f64,
    /// Distance of neighbouring cells' edges over the largest diameter; 0: largest grains touch.
    pub looseness: f64,
    /// Seed.
    pub seed: u64,
}

impl Packing {
    /// `count` grains in rows from the floor up, on a triangular lattice between x = 0 and `width` (m) that holds the
    /// largest size, so that none overlap. Let it settle under gravity for a dense packing.
    pub fn rows(&self, count: usize, width: f64) -> Vec<BodyConfig> {
        let mut random = Random::new(self.seed);
        let pitch = 2.0 * self.sizes.largest() * (1.0 + self.looseness);
        let rise = pitch * (PI / 3.0).sin();
        let full = (width / pitch).floor().max(1.0) as usize;
        let mut bodies = Vec::with_capacity(count);
        let mut row = 0;
        while bodies.len() < count {
            let shifted = row % 2 == 1 && (full as f64 + 0.5) * pitch > width;
            let in_row = if shifted { full - 1 } else { full }.max(1);
            let offset = if row % 2 == 1 { pitch } else { 0.5 * pitch };
            for i in 0..in_row.min(count - bodies.len()) {
                let radius = self.sizes.draw(&mut random);
                let position = [
                    offset + pitch * i as f64,
                    0.5 * pitch + rise * f64::from(row),
                ];
                let name = format!("grain {}", bodies.len());
                bodies.push(
                    self.grain
                        .body(name, radius, self.density, position, &mut random),
                );
            }
            row += 1;
        }
        bodies
    }
}

/// `count` rounded squares of outer side `side` (m) one on another, the lowest resting on y = 0 at x = 0, sharing
/// their left and right faces. They touch without overlap.
pub fn stack(count: usize, side: f64, sphero_radius: f64, density: f64) -> Vec<BodyConfig> {
    let core = side - 2.0 * sphero_radius;
    (0..count)
        .map(|i| BodyConfig {
            name: format!("block {i}"),
            shape: BodyShape::Rectangle {
                width: core,
                height: core,
            },
            sphero_radius,
            inertia: BodyInertia::Density(density),
            position: [0.0, (i as f64 + 0.5) * side],
            angle: 0.0,
            velocity: [0.0, 0.0],
            spin: 0.0,
            motion: Motion::Free,
            surface: String::new(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_packing_and_nothing_overlaps() {
        for sizes in [
            Sizes::Equal(0.01),
            Sizes::Uniform(0.005, 0.01),
            Sizes::Normal(0.008, 0.001),
        ] {
            let packing = Packing {
                grain: Grain::PENTAGON,
                sizes,
                density: 2000.0,
                looseness: 0.0,
                seed: 3,
            };
            let bodies = packing.rows(200, 0.3);
            assert_eq!(bodies, packing.rows(200, 0.3));
            assert_ne!(bodies, Packing { seed: 4, ..packing }.rows(200, 0.3));
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
}
