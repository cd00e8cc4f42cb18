//! What the generators of both sides draw.

use fastrand::Rng;
use interface::config::capability::{Capabilities, word};
use serde::Serialize;

use super::plan::Epoch;

/// A source of numbers, for a solver that takes something.
pub struct Dice<'a, S> {
    /// The source.
    pub rng: Rng,
    /// What the solver takes.
    pub takes: &'a Capabilities,
    /// Longest step in s.
    pub dt: f64,
    /// What else the numbers of a case have in common.
    pub scale: S,
}

/// A number from decades: 10 to a power between two.
pub fn decades(rng: &mut Rng, from: f64, to: f64) -> f64 {
    10f64.powf(from + (to - from) * rng.f64())
}

impl<'a, S> Dice<'a, S> {
    /// A source for a solver that takes something.
    pub fn new(rng: Rng, takes: &'a Capabilities, dt: f64, scale: S) -> Self {
        Self {
            rng,
            takes,
            dt,
            scale,
        }
    }

    /// Others, which leave these as they are, so that known seeds stay those of their cases. Two calls in a row give the same numbers.
    pub fn aside(&self) -> Dice<'a, ()> {
        let rng = Rng::with_seed(self.rng.clone().u64(..));
        Dice::new(rng, self.takes, self.dt, ())
    }

    /// One in four.
    pub fn rarely(&mut self) -> bool {
        self.rng.u32(0..4) == 0
    }

    /// One in two.
    pub fn often(&mut self) -> bool {
        self.rng.bool()
    }

    /// Between two numbers.
    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.rng.f64()
    }

    /// From minus `most` to `most`.
    pub fn way(&mut self, most: f64) -> f64 {
        self.between(-most, most)
    }

    /// Two of these.
    pub fn vector(&mut self, most: f64) -> [f64; 2] {
        [self.way(most), self.way(most)]
    }

    /// What is drawn if this is so; otherwise nothing is, and it is 0.
    pub fn when<T: Default>(&mut self, so: bool, draw: impl FnOnce(&mut Self) -> T) -> T {
        if so { draw(self) } else { T::default() }
    }

    /// The same in one of two.
    pub fn perhaps<T: Default>(&mut self, draw: impl FnOnce(&mut Self) -> T) -> T {
        let so = self.often();
        self.when(so, draw)
    }

    /// About this large, within a factor of 3 either way.
    pub fn about(&mut self, typical: f64) -> f64 {
        typical * 3f64.powf(self.way(1.0))
    }

    /// One of those members of a family that the solver takes.
    pub fn one_of<T: Clone + Serialize>(&mut self, family: &str, of: &[T]) -> Option<T> {
        let names: Vec<String> = of
            .iter()
            .map(|member| format!("{family}:{}", word(member)))
            .collect();
        let named: Vec<_> = names
            .iter()
            .map(String::as_str)
            .zip(of.iter().cloned())
            .collect();
        self.member(&named)
    }

    /// One of those that the solver takes.
    pub fn member<T: Clone>(&mut self, of: &[(&str, T)]) -> Option<T> {
        let taken: Vec<_> = of
            .iter()
            .filter(|(name, _)| self.takes.meets(name))
            .collect();
        let drawn = (!taken.is_empty()).then(|| self.rng.usize(0..taken.len()))?;
        Some(taken[drawn].1.clone())
    }

    /// A star around a middle (m) with corners as far from it as `reach` says, which is simple.
    pub fn star(
        &mut self,
        corners: u32,
        [x, y]: [f64; 2],
        mut reach: impl FnMut(&mut Self) -> f64,
    ) -> Vec<[f64; 2]> {
        let mut vertices = Vec::new();
        for k in 0..corners {
            let turn = f64::from(k) + self.between(0.0, 0.4);
            let angle = turn * std::f64::consts::TAU / f64::from(corners);
            let r = reach(self);
            vertices.push([x + r * angle.cos(), y + r * angle.sin()]);
        }
        vertices
    }

    /// Steps, with opening and closing ones, and with frames if a solver of this side sends them.
    pub fn epochs(&mut self, frames: bool) -> Vec<Epoch> {
        let saves = self.takes.has("save") && self.rarely();
        let count = self.rng.u32(1..7);
        let mut epochs = Vec::new();
        let mut dt = self.dt * self.between(0.3, 1.0);
        for k in 0..count {
            let windows = (0..self.rng.u32(1..4))
                .map(|_| self.rng.u32(1..9))
                .collect();
            epochs.push(Epoch {
                dt,
                windows,
                outlines: k == 0 || self.often(),
                frame: self.often() && frames,
                resumed: saves && k > 0 && self.often(),
            });
            // L-6: longer by a tenth at most; shorter at once.
            dt = if self.often() {
                dt
            } else {
                self.dt.min(dt * self.between(0.4, 1.1))
            };
        }
        let still = |epoch: &Epoch| Epoch {
            dt: 0.0,
            windows: vec![1],
            outlines: true,
            resumed: false,
            ..epoch.clone()
        };
        if self.often() {
            epochs.insert(0, still(&epochs[0]));
        }
        if self.often() {
            epochs.push(still(&epochs[0]));
        }
        epochs
    }
}
