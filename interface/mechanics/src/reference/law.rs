//! The contact laws of a configuration, as docs/physics.md ("The laws") defines them: what one contact exerts.

use std::collections::BTreeMap;

use interface::config::{ContactLaw, ratio_of_restitution};

/// What a law takes of the two that touch.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pair {
    /// Reduced mass in kg/m.
    pub mass: f64,
    /// R* in m.
    pub radius: f64,
}

/// A contact at `t_n`, along N and T.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motion {
    /// xi in m.
    pub overlap: f64,
    /// `u dt_before` in m.
    pub moved: [f64; 2],
    /// u in m/s.
    pub velocity: [f64; 2],
    /// Rotation of the first relative to the second over the last step in rad.
    pub rolled: f64,
}

/// What is remembered of a contact.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct History {
    /// Force of the tangential spring along T in N/m.
    pub spring: f64,
    /// `k_t` at which it had that force, in N/m.
    stiffness: f64,
    /// Moment of the rolling spring on the first in N, and the `k_r` at which it had that moment, in N.
    rolling: [f64; 2],
    /// Forces of the dashpots along N and T in N/m.
    pub dashpots: [f64; 2],
}

impl History {
    /// In the tangential and the rolling spring, in J/m.
    pub fn energy(&self) -> f64 {
        let [moment, rolling] = self.rolling;
        let springs = [(self.spring, self.stiffness), (moment, rolling)];
        let stiff = springs.into_iter().filter(|(_, k)| *k > 0.0);
        stiff.map(|(force, k)| 0.5 * force * force / k).sum()
    }

    /// Takes a part of another one, which belongs to a contact of the same constant stiffness.
    pub fn add(&mut self, part: f64, other: &Self) {
        self.spring += part * other.spring;
        self.stiffness = other.stiffness;
        for (own, others) in self.dashpots.iter_mut().zip(other.dashpots) {
            *own += part * others;
        }
    }
}

/// What a contact exerts, on the side that N points to, and what it has dissipated over the last step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Exerted {
    /// Along N and T in N/m.
    pub force: [f64; 2],
    /// Most that friction may be along T, in N/m.
    pub limit: f64,
    /// Against rolling, in N.
    pub moment: f64,
    /// For the next step.
    pub history: History,
    /// In the springs, in J/m.
    pub stored: f64,
    /// By sliding, in J/m.
    pub friction: f64,
    /// By dashpots in J/m: least and most of what quadratures of the step give.
    pub viscous: [f64; 2],
    /// How much the force (N/m) changes for a change of all positions by a metre, and of all velocities by 1 m/s.
    pub sensitivity: [f64; 2],
}

/// A law for one pair. A number that a law has not is 0.
#[derive(Debug, Clone, Copy, Default)]
pub struct Law {
    pair: Pair,
    /// Stiffness of the springs along N and T in N/m.
    linear: [f64; 2],
    /// `k_H` in N/m^1.5, and `k_t` over `k_n`.
    hertz: [f64; 2],
    /// `k_A` in N/m^2.
    area: f64,
    friction: f64,
    /// Damping ratio of the mass that the dashpots damp.
    damping_ratio: f64,
    /// Mass in kg/m that the dashpots damp.
    damped: f64,
    /// In Pa.
    adhesion: f64,
    /// `mu_r R*` in m.
    rolling: f64,
}

impl Law {
    /// Of a configuration, for two that touch.
    pub fn of(law: &ContactLaw, pair: Pair) -> Self {
        let numbers: BTreeMap<&str, f64> = law.numbers().map(|(p, x)| (p.name, x)).collect();
        let number = |name: &str| numbers.get(name).copied().unwrap_or(0.0);
        let (nu, other) = (number("poisson_ratio"), number("damped_mass"));
        let hertz = number("hertz_constant");
        Self {
            pair,
            linear: [number("normal_stiffness"), number("tangential_stiffness")],
            hertz: [hertz, 2.0 * (1.0 - nu) / (2.0 - nu)],
            area: number("area_stiffness"),
            friction: number("friction"),
            damping_ratio: if hertz > 0.0 {
                ratio_of_restitution(number("restitution"))
            } else {
                number("damping_ratio")
            },
            damped: if other > 0.0 { other } else { pair.mass },
            adhesion: number("adhesion"),
            rolling: number("rolling_friction") * pair.radius,
        }
    }

    /// Damping ratio of the contact on springs as stiff as at its overlap.
    pub fn ratio(&self) -> f64 {
        let [c, _] = self.dashpots([1.0; 2]);
        0.5 * c / self.pair.mass.sqrt()
    }

    /// `k_n` in N/m at an overlap (m).
    pub fn normal_stiffness(&self, overlap: f64) -> f64 {
        let xi = overlap.max(0.0);
        let (r, within) = (self.pair.radius, xi.min(self.pair.radius));
        let chord = 2.0 * (within * (2.0 * r - within)).sqrt();
        self.linear[0] + 1.5 * self.hertz[0] * xi.sqrt() + self.area * chord
    }

    /// Whether the stiffness is the same at every overlap.
    pub fn is_linear(&self) -> bool {
        self.hertz[0] == 0.0 && self.area == 0.0
    }

    /// `k_t` in N/m where `k_n` is this (N/m).
    pub fn tangential_stiffness(&self, k_n: f64) -> f64 {
        match self.hertz {
            _ if self.friction == 0.0 => 0.0,
            [0.0, _] => self.linear[1],
            [_, share] => k_n * share,
        }
    }

    /// Force of the normal spring in N/m, and its energy in J/m.
    pub fn spring(&self, xi: f64) -> (f64, f64) {
        let ([k, _], [hertz, _]) = (self.linear, self.hertz);
        let (mut force, mut energy) = (k * xi, 0.5 * k * xi * xi);
        force += hertz * xi.powf(1.5);
        energy += 0.4 * hertz * xi.powf(2.5);
        if self.area > 0.0 {
            // The segment of height xi of a disc of radius R*, at most all of it, and its integral over xi.
            let r = self.pair.radius;
            let height = xi.min(2.0 * r);
            let chord = (height * (2.0 * r - height)).sqrt();
            let area = r * r * chord.atan2(r - height) - (r - height) * chord;
            let within = 2.0 / 3.0 * chord.powi(3) + (height - r) * area;
            force += self.area * area;
            energy += self.area * (within + area * (xi - height));
        }
        (force, energy)
    }

    /// Adhesion in N/m at an overlap (m), and its energy in J/m.
    pub fn pull(&self, xi: f64) -> (f64, f64) {
        let force = self.adhesion * 2.0 * (2.0 * self.pair.radius * xi).sqrt();
        (force, 2.0 / 3.0 * force * xi)
    }

    /// c along N and T in N s/m, where the stiffnesses (N/m) are these.
    pub fn dashpots(&self, stiffness: [f64; 2]) -> [f64; 2] {
        let share = if self.hertz[0] > 0.0 {
            5.0_f64 / 6.0
        } else {
            1.0
        };
        stiffness.map(|k| 2.0 * share.sqrt() * self.damping_ratio * (k * self.damped).sqrt())
    }

    /// The contact at `t_n`, given its history.
    pub fn exert(&self, motion: &Motion, before: &History) -> Exerted {
        let xi = motion.overlap.max(0.0);
        let ((spring, stored), (pull, pulled)) = (self.spring(xi), self.pull(xi));
        let mut exerted = self.exert_spring(motion, spring, before);
        exerted.force[0] -= pull;
        exerted.stored += stored - pulled;
        if xi > 0.0 {
            // The pull grows with the root of the overlap.
            exerted.sensitivity[0] += 0.5 * pull / xi;
        }
        exerted
    }

    /// The same of normal springs that press with `spring` (N/m), of whose energy and adhesion it knows nothing.
    pub fn exert_spring(&self, motion: &Motion, spring: f64, before: &History) -> Exerted {
        if motion.overlap <= 0.0 {
            return opened(motion, before);
        }
        let k_n = self.normal_stiffness(motion.overlap);
        let k_t = self.tangential_stiffness(k_n);
        let c = self.dashpots([k_n, k_t]);
        // F_n = max(0, spring - c_n u_N).
        let pressing = (spring - c[0] * motion.velocity[0]).max(0.0);
        // The tangential spring, which gives way where the contact unloads, then Coulomb's limit.
        let limit = self.friction * pressing;
        let kept = share(k_t, before.stiffness);
        let tangential = (before.spring * kept - k_t * motion.moved[1]).clamp(-limit, limit);
        let dragged = (tangential - c[1] * motion.velocity[1]).clamp(-limit, limit);
        // The rolling spring likewise.
        let k_r = 2.25 * k_n * self.rolling * self.rolling;
        let kept = share(k_r, before.rolling[1]);
        let cap = self.rolling * pressing;
        let moment = (before.rolling[0] * kept - k_r * motion.rolled).clamp(-cap, cap);
        let history = History {
            spring: tangential,
            stiffness: k_t,
            rolling: [moment, k_r],
            dashpots: [pressing - spring, dragged - tangential],
        };
        let work = -0.5 * (before.spring + tangential) * motion.moved[1]
            - 0.5 * (before.rolling[0] + moment) * motion.rolled;
        // A dashpot that follows the stiffness grows with the fourth root of the overlap.
        let drag = (c[0] * motion.velocity[0]).abs() + (c[1] * motion.velocity[1]).abs();
        let growing = if self.is_linear() { 0.0 } else { 0.25 * drag };
        Exerted {
            force: [pressing, dragged],
            limit,
            moment,
            history,
            stored: history.energy(),
            friction: work - (history.energy() - before.energy()),
            viscous: viscous(before.dashpots, history.dashpots, motion.moved),
            sensitivity: [k_n + k_t + growing / motion.overlap, c[0] + c[1]],
        }
    }
}

/// What a spring keeps of its force where its stiffness is this, and was that at the last step.
fn share(stiffness: f64, before: f64) -> f64 {
    if stiffness < before {
        stiffness / before
    } else {
        1.0
    }
}

/// A contact that is not, or no more: its springs are forgotten.
fn opened(motion: &Motion, before: &History) -> Exerted {
    let [moment, _] = before.rolling;
    let sliding = -0.5 * (before.spring * motion.moved[1] + moment * motion.rolled);
    let [least, most] = viscous(before.dashpots, [0.0; 2], motion.moved);
    Exerted {
        friction: sliding + before.energy(),
        viscous: [least.min(0.0), most.max(0.0)],
        ..Exerted::default()
    }
}

/// Least and most work of dashpots, whose forces (N/m) were and are these, on the way `moved` (m).
fn viscous(before: [f64; 2], now: [f64; 2], moved: [f64; 2]) -> [f64; 2] {
    let work = |i: usize| [-before[i] * moved[i], -now[i] * moved[i]];
    let (n, t) = (work(0), work(1));
    [
        n[0].min(n[1]) + t[0].min(t[1]),
        n[0].max(n[1]) + t[0].max(t[1]),
    ]
}
