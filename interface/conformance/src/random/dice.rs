//! What the generators of both sides draw.

use fastrand::Rng;
use interface::config::capability::Capabilities;

use super::plan::Epoch;

/// A source of numbers, for a solver that takes something.
pub trait Dice {
    /// The source.
    fn rng(&mut self) -> &mut Rng;
    /// What the solver takes.
    fn takes(&self) -> &Capabilities;
    /// Longest step in s.
    fn dt(&self) -> f64;

    /// One in four.
    fn rarely(&mut self) -> bool {
        self.rng().u32(0..4) == 0
    }

    /// One in two.
    fn often(&mut self) -> bool {
        self.rng().bool()
    }

    /// Between two numbers.
    fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.rng().f64()
    }

    /// From minus `most` to `most`.
    fn way(&mut self, most: f64) -> f64 {
        self.between(-most, most)
    }

    /// About this large, within a factor of 3 either way.
    fn about(&mut self, typical: f64) -> f64 {
        typical * 3f64.powf(self.way(1.0))
    }

    /// One of those that the solver takes.
    fn member(&mut self, of: &[&'static str]) -> Option<&'static str> {
        let count = of.iter().filter(|name| self.takes().meets(name)).count();
        let drawn = (count > 0).then(|| self.rng().usize(0..count))?;
        Some(
            of.iter()
                .filter(|name| self.takes().meets(name))
                .nth(drawn)?,
        )
    }

    /// Steps, with opening and closing ones, and with frames if a solver of this side sends them.
    fn epochs(&mut self, frames: bool) -> Vec<Epoch> {
        let saves = self.takes().has("save") && self.rarely();
        let count = self.rng().u32(1..7);
        let mut epochs = Vec::new();
        let mut dt = self.dt() * self.between(0.3, 1.0);
        for k in 0..count {
            let windows = (0..self.rng().u32(1..4))
                .map(|_| self.rng().u32(1..9))
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
                self.dt().min(dt * self.between(0.4, 1.1))
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
