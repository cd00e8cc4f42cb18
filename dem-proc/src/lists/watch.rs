//! When a list of pairs is built again: the places of the two when it was built, and for bodies the rule.

use std::fmt::Debug;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::body::displacement::Displacement;
use crate::lists::now::{Now, Slots};

/// Which pairs of a list an evaluation looks at.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Look {
    /// At all.
    #[default]
    All,
    /// At those whose surfaces are within this distance in m.
    Within(f64),
    /// At the same pairs as the evaluation before.
    Same,
}

/// Where pairs were when their list was built.
pub trait Watching: Debug + Send + Sync + Serialize + DeserializeOwned {
    /// No list yet; with a skin in m.
    fn new(skin: f64) -> Self;
    /// Whether a list of pairs, of which so many of the two are `points`, still holds all that may touch.
    fn holds(&mut self, now: &Now, points: u32) -> bool;
    /// Makes the present places the reference of a new list that replaces the one of `old`.
    fn begin(&mut self, old: &Self, now: &Now, slots: &Slots);
    /// Which pairs the next evaluation looks at, if pairs within `closing` (m) count.
    fn look(&mut self, _closing: f64) -> Look {
        Look::default()
    }
    /// The evaluation became the history.
    fn commit(&mut self) {}
    /// The bodies move with surface speeds up to `speed` (m/s) for `dt` (s).
    fn advance(&mut self, speed: f64, dt: f64);
    /// The bodies in the poses at which the list was built; `None` if there is no list yet.
    fn bodies_then(&self, bodies: &Bodies) -> Option<Bodies>;
}

/// The rule for rebuilding a list of pairs of bodies, and the margins of the list.
///
/// Each body may use up half of the skin, less its displacement in the next two steps. If the fastest body moves
/// farther in two steps than half the skin, the list is built in every step, with a different margin for each body.
/// Otherwise one fast body far away would fill the lists of all others.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Watch {
    skin: f64,
    /// Largest allowed sum of a surface's displacement so far and in the next two steps, in m.
    limit: f64,
    /// Margin of each body in m; empty if all margins are `limit`.
    margins: Vec<f64>,
    displacement: Displacement,
    /// How far two surfaces may approach one another before a pair that the last evaluation did not look at may come
    /// into reach, in m; `None` if it looked at all.
    #[serde(skip)]
    slack: Option<f64>,
    /// How many of the two versions of the histories may have one of a pair that is not looked at.
    #[serde(skip)]
    stale: u32,
}

impl Watch {
    /// Whether there may be a history of a pair that is not looked at.
    pub fn is_stale(&self) -> bool {
        self.stale > 0
    }

    /// Margin of a body beyond contact in m: a pair is listed if its distance is below the sum of both margins.
    #[inline]
    pub fn margin(&self, body: usize) -> f64 {
        self.margins.get(body).copied().unwrap_or(self.limit)
    }

    /// Largest distance in m at which two bodies can meet within two steps; `closing` (m) unless each body has its own
    /// margin.
    #[inline]
    pub fn closing(&self, [a, b]: [u32; 2], closing: f64) -> f64 {
        let own = |b: u32| self.margins.get(b as usize);
        match (own(a), own(b)) {
            (Some(a), Some(b)) => a + b - self.skin,
            _ => closing,
        }
    }

    /// Whether each body has its own margin.
    pub fn is_by_body(&self) -> bool {
        !self.margins.is_empty()
    }
}

impl Watching for Watch {
    fn new(skin: f64) -> Self {
        Self {
            skin,
            ..Self::default()
        }
    }

    /// Within two steps.
    fn holds(&mut self, now: &Now, _: u32) -> bool {
        let left = self.limit - now.ahead.way(now.speed);
        let holds = left > 0.0 && self.displacement.stays_below(left, now.bodies);
        if !holds {
            self.slack = None; // the next evaluation looks at the pairs of another list
        }
        holds
    }

    fn begin(&mut self, _: &Self, now: &Now, _: &Slots) {
        let (bodies, ahead) = (now.bodies, &now.ahead);
        let (half, way) = (0.5 * self.skin, ahead.way(now.speed));
        self.margins.clear();
        if way <= half {
            self.limit = half + way;
        } else {
            self.limit = 0.0;
            let speed = bodies
                .state
                .iter()
                .map(|s| s.surface_speed(s.velocity, s.spin));
            self.margins.extend(speed.map(|v| half + ahead.way(v)));
        }
        self.displacement.reset(bodies);
        self.slack = None;
    }

    /// A list has several times as many pairs as there are in reach, and most come no nearer than some distance for many
    /// steps.
    fn look(&mut self, closing: f64) -> Look {
        if self.slack.is_some_and(|slack| slack > closing) {
            return Look::Same;
        }
        self.stale = 2;
        // Surfaces approach by half of `closing` in a step, or less.
        let more = (20.0 * closing).min(0.25 * self.skin);
        let margin = closing + more;
        let (look, slack) = if more > 2.0 * closing {
            (Look::Within(margin), Some(0.999 * margin)) // a little less, for rounding
        } else {
            (Look::All, None)
        };
        self.slack = slack;
        look
    }

    fn commit(&mut self) {
        self.stale = self.stale.saturating_sub(1);
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.displacement.advance(speed, dt);
        self.slack = self.slack.map(|slack| slack - 2.0 * speed * dt);
    }

    fn bodies_then(&self, bodies: &Bodies) -> Option<Bodies> {
        let poses = self.displacement.start();
        (!poses.is_empty()).then(|| bodies.placed(poses.iter().copied()))
    }
}
