//! The largest displacement of bodies within two steps, and the rule for rebuilding a list of their pairs.

use interface::step::GROWTH;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::body::displacement::Displacement;

/// The largest displacement of surfaces in the next two steps, as a function of their speed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ahead {
    /// The two steps together in s.
    time: f64,
    /// Additional displacement by gravity and external forces in m.
    gained: f64,
}

impl Ahead {
    /// A step of `dt` (s) and the next one, after a kick of `kick` (s), if all surfaces are accelerated by at most
    /// `acceleration` (m/s^2). Contact forces are not part of the acceleration: a new contact has been counted, and an
    /// old one has acted before.
    pub fn new(kick: f64, dt: f64, acceleration: f64) -> Self {
        let next = GROWTH * dt;
        let time = dt + next;
        Self {
            time,
            gained: acceleration * (kick * time + 0.5 * (dt + next) * next),
        }
    }

    /// The two steps together in s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Largest displacement of a surface with this speed (m/s), in m.
    pub fn way(&self, speed: f64) -> f64 {
        speed * self.time + self.gained
    }
}

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

/// The rule for rebuilding a list of pairs, and the margins of the list.
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
    /// No list yet; with a skin in m.
    pub fn new(skin: f64) -> Self {
        Self {
            skin,
            ..Self::default()
        }
    }

    /// Whether the list still holds all pairs that may meet within two steps, with surfaces up to `speed` (m/s).
    pub fn holds(&mut self, bodies: &Bodies, ahead: &Ahead, speed: f64) -> bool {
        let left = self.limit - ahead.way(speed);
        let holds = left > 0.0 && self.displacement.stays_below(left, bodies);
        if !holds {
            self.slack = None; // the next evaluation looks at the pairs of another list
        }
        holds
    }

    /// Makes the present poses the reference of a new list.
    pub fn begin(&mut self, bodies: &Bodies, ahead: &Ahead, speed: f64) {
        let (half, way) = (0.5 * self.skin, ahead.way(speed));
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

    /// Which pairs the next evaluation looks at, if pairs within `closing` (m) count. A list has several times as many
    /// pairs as there are in reach, and most come no nearer than some distance for many steps.
    pub fn look(&mut self, closing: f64) -> Look {
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

    /// Whether there may be a history of a pair that is not looked at.
    pub fn is_stale(&self) -> bool {
        self.stale > 0
    }

    /// The evaluation became the history.
    pub fn commit(&mut self) {
        self.stale = self.stale.saturating_sub(1);
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

    /// The bodies move with surface speeds up to `speed` (m/s) for `dt` (s).
    pub fn advance(&mut self, speed: f64, dt: f64) {
        self.displacement.advance(speed, dt);
        self.slack = self.slack.map(|slack| slack - 2.0 * speed * dt);
    }

    /// The bodies in the poses at which the list was built; `None` if there is no list yet.
    pub fn bodies_then(&self, bodies: &Bodies) -> Option<Bodies> {
        let poses = self.displacement.start();
        (!poses.is_empty()).then(|| bodies.placed(poses.iter().copied()))
    }
}
