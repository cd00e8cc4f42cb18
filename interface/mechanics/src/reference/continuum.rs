//! The oracle of a continuum: a plain transcription of Jiang 2020, in which every point looks at the nodes around it in a dense
//! grid. Only the configuration is shared with the solver.
#![expect(
    clippy::needless_range_loop,
    reason = "an axis is an index into several arrays of two"
)]

use std::collections::HashSet;
use std::sync::Arc;

use interface::config::{Drift, MpmConfig, Stage, StressUpdate, Transfer};
use interface::impulse::at;
use interface::message::wire::ImpForce;
use nalgebra::Vector2;

use super::material::RefPoint;
use super::nodes::{Image, Nodes, driven};
use super::walls::{Acting, Obeyed};
use crate::expression::Expression;

/// A shape function of the distance from a node in cells, and its derivative, as the paper prints them.
#[derive(Debug, Clone, Copy)]
pub enum Kernel {
    /// Linear hats.
    Linear,
    /// Quadratic B-spline.
    Quadratic,
    /// Cubic B-spline.
    Cubic,
    /// Half width of the box in cells.
    Ugimp(f64),
}

impl Kernel {
    /// At a distance in cells.
    pub fn value(self, x: f64) -> f64 {
        let r = x.abs();
        match self {
            Self::Linear => (1.0 - r).max(0.0),
            Self::Quadratic if r < 0.5 => 0.75 - r * r,
            Self::Quadratic if r < 1.5 => 0.5 * (1.5 - r).powi(2),
            Self::Cubic if r < 1.0 => 0.5 * r.powi(3) - r * r + 2.0 / 3.0,
            Self::Cubic if r < 2.0 => (2.0 - r).powi(3) / 6.0,
            Self::Ugimp(l) if r < l => 1.0 - (r * r + l * l) / (2.0 * l),
            Self::Ugimp(l) if r < 1.0 - l => 1.0 - r,
            Self::Ugimp(l) if r < 1.0 + l => (1.0 + l - r).powi(2) / (4.0 * l),
            _ => 0.0,
        }
    }

    /// Its derivative there.
    pub fn slope(self, x: f64) -> f64 {
        let r = x.abs();
        let slope = match self {
            Self::Linear if r < 1.0 => -1.0,
            Self::Quadratic if r < 0.5 => -2.0 * r,
            Self::Quadratic if r < 1.5 => r - 1.5,
            Self::Cubic if r < 1.0 => 1.5 * r * r - 2.0 * r,
            Self::Cubic if r < 2.0 => -0.5 * (2.0 - r).powi(2),
            Self::Ugimp(l) if r < l => -r / l,
            Self::Ugimp(l) if r < 1.0 - l => -1.0,
            Self::Ugimp(l) if r < 1.0 + l => -(1.0 + l - r) / (2.0 * l),
            _ => 0.0,
        };
        if x < 0.0 { -slope } else { slope }
    }
}

/// A speed is rounding of 0 below this share of the fastest one.
const AT_REST: f64 = 1e-11;

/// Points over a dense grid with a rim of three nodes.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The points.
    pub points: Vec<RefPoint>,
    /// Along x and y.
    pub kernels: [Kernel; 2],
    /// Through which contact forces reach the nodes, along x and y.
    pub spread: [Kernel; 2],
    /// The configuration.
    pub config: Arc<MpmConfig>,
    /// Along x and y.
    pub cells: [i64; 2],
    pub(super) nodes: Arc<Nodes>,
    /// The nodes of walls with friction, each with the axis across its wall, that the last kick has pressed into it, or nodes beyond
    /// them.
    pub pressed: Vec<(usize, [i64; 2])>,
    /// Acceleration in m/s^2 besides gravity: of the initial position and the time.
    pub body_force: Option<[Expression; 2]>,
    /// `t_n` of the next step in s.
    pub time: f64,
    /// Speed of the fastest node of the last step in m/s. With linear functions it is times the largest mass of a node over its own:
    /// rounding of a place changes a small weight, and so the velocity, by so much more.
    pub fastest_node: f64,
    /// Of the last step.
    pub totals: Totals,
}

/// Sums over the points and nodes of a step.
#[derive(Debug, Clone, Default)]
pub struct Totals {
    /// Impulse of walls, supports and loads on the points in N s/m.
    pub applied: [f64; 2],
    /// Impulse of the supports on the nodes as the points feel it, in N s/m.
    pub support: [f64; 2],
    /// Moment about the origin in N s of all that acts in the kick, at the nodes on which it acts; of damping as the points feel it.
    pub turned: f64,
    /// Elastic energy of the points at `t_n` in J/m.
    pub elastic: f64,
    /// Dissipated by plastic flow and by viscous stress, and worked by stress, up to then, in J/m.
    pub lost: [f64; 3],
    /// Work of the loads up to then, in J/m.
    pub driven: f64,
    /// Dissipated in the kick by walls with friction and by friction between layers, in J/m.
    pub rubbed: f64,
    /// Dissipated in the kick by impacts of layers, in J/m.
    pub pressed: f64,
    /// Dissipated in the kick by the damping of its stage, in J/m.
    pub damped: f64,
    /// Taken by the transfer in the kick, in J/m.
    pub smoothed: f64,
    /// Work of driven walls in the kick, in J/m. Not with walls, other than driven ones of the same speed, that act along them.
    pub pulled: f64,
    /// Whether rounding has decided which supports are independent, or how layers face one another.
    pub is_doubtful: bool,
}

impl Totals {
    /// Adds those of another layer or step.
    pub fn add(&mut self, of: &Self) {
        let add = |sum: &mut [f64], of: &[f64]| sum.iter_mut().zip(of).for_each(|(s, x)| *s += x);
        add(&mut self.applied, &of.applied);
        add(&mut self.support, &of.support);
        add(&mut self.lost, &of.lost);
        self.turned += of.turned;
        self.elastic += of.elastic;
        self.driven += of.driven;
        self.rubbed += of.rubbed;
        self.pressed += of.pressed;
        self.damped += of.damped;
        self.smoothed += of.smoothed;
        self.pulled += of.pulled;
        self.is_doubtful |= of.is_doubtful;
    }
}

/// The nodes of a step that have taken their kick.
#[derive(Debug, Clone)]
pub struct Kicked {
    pub(super) mass: Vec<f64>,
    /// Velocities before the kick and after it in m/s.
    pub(super) before: Vec<[f64; 2]>,
    pub(super) after: Vec<[f64; 2]>,
    /// Impulses that damping has taken, and that walls with friction have, in N s/m.
    pub(super) damped: Vec<[f64; 2]>,
    pub(super) rubbed: Vec<[f64; 2]>,
    /// Work of driven walls on the velocities before the kick, as points feel it, in J/m.
    pub(super) pulled: f64,
    /// What contact on the nodes has taken of their energy, in J/m.
    pub(super) met: f64,
}

impl Kicked {
    /// Speed of the fastest node in m/s; with `hats` times the largest mass of a node over its own.
    fn fastest(&self, hats: bool) -> f64 {
        let most = self.mass.iter().copied().fold(0.0, f64::max);
        let speed = |v: &[f64; 2]| v[0].hypot(v[1]);
        let velocities = self.before.iter().zip(&self.after);
        let each = self.mass.iter().zip(velocities);
        each.map(|(m, (before, after))| {
            speed(before).max(speed(after)) * if hats { most / m } else { 1.0 }
        })
        .fold(0.0, f64::max)
    }

    /// Energy in J/m that impulses have taken of the nodes: times the means of the velocities before and after all that acts on
    /// them.
    fn lost(&self, taken: &[[f64; 2]]) -> f64 {
        let of_node = |((taken, before), after): ((&[f64; 2], &[f64; 2]), &[f64; 2])| {
            let mean = |a: usize| 0.5 * (before[a] + after[a]);
            taken[0] * mean(0) + taken[1] * mean(1)
        };
        let nodes = taken.iter().zip(&self.before).zip(&self.after);
        nodes.map(of_node).sum()
    }

    /// Energy in J/m that the nodes gain.
    fn gained(&self) -> f64 {
        let square = |v: &[f64; 2]| v[0] * v[0] + v[1] * v[1];
        let velocities = self.before.iter().zip(&self.after);
        let each = self.mass.iter().zip(velocities);
        each.map(|(m, (before, after))| 0.5 * m * (square(after) - square(before)))
            .sum()
    }
}

/// Rows made orthogonal, each to those before, without those that depend on these; and whether rounding decides that of one,
/// or changes one by more than is compared.
fn orthogonal(rows: impl Iterator<Item = Vec<f64>>) -> (Vec<Vec<f64>>, bool) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (mut found, mut is_doubtful): (Vec<(Vec<f64>, f64)>, bool) = (Vec::new(), false);
    for mut row in rows {
        let whole = dot(&row, &row).sqrt();
        let mut error = (f64::EPSILON * whole).powi(2);
        for (other, error_of_other) in found.iter().chain(&found) {
            let along = dot(&row, other);
            row.iter_mut().zip(other).for_each(|(x, y)| *x -= along * y);
            error += (along * error_of_other).powi(2);
        }
        let rest = dot(&row, &row).sqrt();
        if rest > 1e-7 * whole {
            let error = error.sqrt() / rest;
            is_doubtful |= error > 1e-13;
            found.push((row.iter().map(|x| x / rest).collect(), error));
        } else {
            is_doubtful |= rest > 1e-10 * whole;
        }
    }
    (found.into_iter().map(|(row, _)| row).collect(), is_doubtful)
}

impl Reference {
    /// The nodes that a point may see, each with a place at which it does.
    pub(super) fn seen(&self, p: &RefPoint) -> impl Iterator<Item = (usize, &Image<[i64; 2]>)> {
        self.nodes.around(self.distance(p, [0; 2]))
    }

    pub(super) fn distance(&self, p: &RefPoint, place: [i64; 2]) -> [f64; 2] {
        [0, 1].map(|a| (p.x[a] - self.config.domain[0][a]) / self.config.cell - place[a] as f64)
    }

    pub(super) fn weight(&self, p: &RefPoint, place: [i64; 2]) -> f64 {
        self.value(self.kernels, p, place)
    }

    fn value(&self, [x, y]: [Kernel; 2], p: &RefPoint, place: [i64; 2]) -> f64 {
        let d = self.distance(p, place);
        x.value(d[0]) * y.value(d[1])
    }

    fn gradient(&self, p: &RefPoint, place: [i64; 2]) -> [f64; 2] {
        let d = self.distance(p, place);
        let [kx, ky] = self.kernels;
        [
            kx.slope(d[0]) * ky.value(d[1]) / self.config.cell,
            kx.value(d[0]) * ky.slope(d[1]) / self.config.cell,
        ]
    }

    /// Lets held points stand still, by the smallest change of the velocities of the nodes in the norm of kinetic energy. Its
    /// impulse in N s/m.
    fn support(&mut self, mass: &[f64], velocity: &mut [[f64; 2]]) -> [f64; 2] {
        let mut impulse = [0.0; 2];
        for a in 0..2 {
            let row = |p: &RefPoint, scale: fn(f64) -> f64| -> Vec<f64> {
                let mut row = vec![0.0; mass.len()];
                for (n, image) in self.seen(p).filter(|(n, _)| mass[*n] > 0.0) {
                    let free = self.free(self.nodes.list[n].at)[a];
                    row[n] += free * image.sign[a] * self.weight(p, image.at) * scale(mass[n]);
                }
                row
            };
            let held = || self.points.iter().filter(|p| p.held[a]);
            // Of velocities, and of velocities times the roots of the masses.
            let (_, by_weights) = orthogonal(held().map(|p| row(p, |_| 1.0)));
            let (rows, by_masses) = orthogonal(held().map(|p| row(p, |m| m.sqrt().recip())));
            self.totals.is_doubtful |= by_weights || by_masses;
            for row in rows {
                let along: f64 = (0..mass.len())
                    .map(|n| row[n] * mass[n].sqrt() * velocity[n][a])
                    .sum();
                for n in (0..mass.len()).filter(|n| row[*n] != 0.0) {
                    let change = -along * row[n] / mass[n].sqrt();
                    velocity[n][a] += change;
                    impulse[a] += mass[n] * change;
                }
            }
        }
        impulse
    }

    /// The loads of `t_n`, and their work since the step before: by the trapezoidal rule, that of dead loads on the way of the nodes
    /// that `velocity` says they have had, that of a body force, or where these do not strain the points, on that of the points.
    fn load(&mut self, velocity: &[[f64; 2]], dt_before: f64) {
        if self.body_force.is_none() && self.points.iter().all(|p| p.dead == [0.0; 2]) {
            return;
        }
        for i in 0..self.points.len() {
            let field = self.interpolate(i, |n, _| velocity[n]);
            let p = &mut self.points[i];
            let [x, y] = p.start;
            let mut load = p.dead;
            if let Some(formulas) = &self.body_force {
                load = [0, 1].map(|a| load[a] + p.mass * formulas[a].evaluate(&[x, y, self.time]));
            }
            for a in 0..2 {
                let way = p.x[a] - p.was[a];
                let of_dead = match self.config.stress_update {
                    StressUpdate::Usl => way,
                    _ => dt_before * field[a],
                };
                let mean = 0.5 * (p.load[a] + load[a]);
                self.totals.driven += p.dead[a] * of_dead + (mean - p.dead[a]) * way;
            }
            (p.load, p.was) = (load, p.x);
        }
    }

    fn momentum(&self) -> [f64; 2] {
        [0, 1].map(|a| self.points.iter().map(|p| p.mass * p.v[a]).sum())
    }

    /// `(-dS/dy, dS/dx) / 2` at a place.
    fn curl(&self, p: &RefPoint, place: [i64; 2]) -> [f64; 2] {
        let [x, y] = self.gradient(p, place);
        [-0.5 * y, 0.5 * x]
    }

    /// The first part of a step, up to the new velocities of the nodes; `forces` holds a contact force for each point.
    pub fn kick(&mut self, dt_before: f64, dt: f64, forces: &[ImpForce]) -> Kicked {
        let kick = 0.5 * (dt_before + dt);
        let alpha = self.pic_fraction(kick);
        let [kept, gained] = self.damping(kick);
        let inertia = self.inertia();
        let (mass, mut before, stopped) = self.map(inertia);
        let felt = self.support(&mass, &mut before).map(|p| alpha * p);
        self.totals.turned = alpha * self.turned_by_map(&before, inertia);
        let pulled = self.pulled_by_map(&before, (alpha, felt));
        self.load(&before, dt_before);
        let [first, _] = self.shares();
        let past = first * dt_before;
        if self.config.drift() == Drift::Mapped && dt > 0.0 && first > 0.0 {
            for i in 0..self.points.len() {
                let field = self.interpolate(i, |n, _| before[n]);
                let p = &mut self.points[i];
                p.unsettled = [0, 1].map(|a| {
                    if past > 0.0 {
                        past * field[a] - p.unsettled[a]
                    } else {
                        0.0
                    }
                });
            }
        }
        self.strain(&before, past, 0.5);
        self.totals.elastic = self.points.iter().map(RefPoint::stored).sum();
        self.totals.lost = self.lost();
        let mut force = vec![[0.0; 2]; mass.len()];
        for (p, contact) in self.points.iter().zip(forces) {
            let [xx, yy, _, xy] = p.stress;
            let v = p.volume * p.ratio;
            for (n, Image { at, sign, .. }) in self.seen(p) {
                let g = self.gradient(p, *at);
                let s = self.weight(p, *at);
                let spread = self.value(self.spread, p, *at);
                let internal = [xx * g[0] + xy * g[1], xy * g[0] + yy * g[1]];
                let curl = self.curl(p, *at);
                for a in 0..2 {
                    let outer = p.load[a] + p.mass * self.config.gravity[a];
                    let of_contact = contact.force[a] * spread + contact.couple * curl[a];
                    force[n][a] += sign[a] * (outer * s + of_contact - v * internal[a]); // (13), (47)
                }
            }
        }
        let [mut after, mut lost] = [(); 2].map(|()| vec![[0.0; 2]; mass.len()]);
        let speeds = self.points.iter().flat_map(|p| p.v);
        let mut fastest = speeds.fold(0.0, |most: f64, v| most.max(v.abs()));
        for n in 0..mass.len() {
            if mass[n] > 0.0 {
                let gain = force[n].map(|f| kick * f / mass[n]);
                let damped = [0, 1].map(|a| kept * before[n][a] + gained * gain[a]); // (17), (48)
                fastest = gain.iter().fold(fastest, |most, v| most.max(v.abs()));
                after[n] = damped;
                lost[n] = [0, 1].map(|a| mass[n] * (before[n][a] + gain[a] - damped[a]));
            }
        }
        let kicked = |n: usize| Acting::Kicked(stopped[n].map(|v| alpha * v));
        let obeyed = self.obey(&mass, &mut after, kicked);
        let rubbed = obeyed.iter().map(|o| o.rubbed).collect();
        let nodes = self.nodes.list.iter().zip(&obeyed);
        let pressed = nodes.flat_map(|(node, obeyed)| {
            let axes = (0..2).filter(|&axis| obeyed.pressed[axis]);
            axes.map(|axis| (axis, self.on_wall(node.at, axis)))
        });
        self.pressed = pressed.collect();
        // Rounding decides whether a node that is at rest presses on a wall with friction.
        let rests = |o: &Obeyed| o.across.is_some_and(|v| v <= AT_REST * fastest);
        self.totals.is_doubtful |= fastest > 0.0 && obeyed.iter().any(rests);
        let kicked = self.support(&mass, &mut after);
        self.totals.support = [0, 1].map(|a| felt[a] + kicked[a]);
        Kicked {
            mass,
            before,
            after,
            damped: lost,
            rubbed,
            pulled,
            met: 0.0,
        }
    }

    /// The second part: the points take the velocities of the nodes and move.
    pub fn advance(&mut self, dt_before: f64, dt: f64, forces: &[ImpForce], kicked: &Kicked) {
        let Kicked { mass, after, .. } = kicked;
        self.fastest_node = kicked.fastest(matches!(self.kernels[0], Kernel::Linear));
        let kick = 0.5 * (dt_before + dt);
        let start = self.momentum();
        let own = self.points.clone();
        let inertia = self.inertia();
        let [first, last] = self.shares();
        let settles = self.config.drift() == Drift::Mapped && dt > 0.0;
        self.filter_by_order(kick, inertia);
        let [from, to] = [&kicked.before, after].map(|v| self.turning_of(v));
        let damped = (1.0 - self.pic_fraction(kick)) * (self.kept_by_points(kick) - 1.0);
        let of_points: f64 = self.points.iter().map(RefPoint::turning).sum();
        self.totals.turned += to - from + damped * (of_points - from);
        if self.config.stress_update == StressUpdate::Usl {
            self.strain(after, dt, -0.5);
        }
        self.totals.smoothed = kicked.pulled; // no loss of the points
        let mut drift: Vec<[f64; 2]> = self.gather(kicked, &own, kick);
        self.totals.rubbed = kicked.lost(&kicked.rubbed);
        self.count_walls(start, kick, forces);
        // Walls with friction, and contact on the nodes, have taken a part of what forces seem to have added to points; if all that
        // points do not get of the nodes' gain counts, the part of contact is in that.
        let [_, gained] = self.damping(kick);
        let met = if self.books_impacts() {
            0.0
        } else {
            kicked.met
        };
        self.totals.damped += (1.0 / gained - 1.0) * (self.totals.rubbed + met);
        if self.books_impacts() {
            let damped = kicked.lost(&kicked.damped) - self.totals.damped;
            let kinetic = |points: &[RefPoint]| points.iter().map(|p| self.kinetic(p)).sum::<f64>();
            let gained = kinetic(&self.points) - kinetic(&own);
            self.totals.smoothed = kicked.pulled + kicked.gained() + damped - gained;
        }
        let again = if self.config.grid_contact.is_some()
            && self.config.stress_update == StressUpdate::Usavg
        {
            after.clone() // Velocities that are mapped once more approach again.
        } else {
            let (_, mut again, _) = self.map(inertia);
            self.support(mass, &mut again);
            again
        };
        self.strain(&again, last * dt, -0.5);
        let mapped = self.places_near_loads(forces);
        let moving = |n: usize, place: [i64; 2]| {
            let is_mapped = last > 0.0 || mapped.contains(&place);
            if self.config.drift() == Drift::Mapped && is_mapped {
                again[n]
            } else {
                after[n]
            }
        };
        let spins: Vec<f64> = (0..self.points.len())
            .map(|i| match forces[i].tangential {
                0.0 => 0.0,
                _ => self.spin(i, moving),
            })
            .collect();
        if self.config.drift() == Drift::Mapped {
            for (i, drift) in drift.iter_mut().enumerate() {
                *drift = self.interpolate(i, moving);
            }
        }
        for ((p, v), spin) in self.points.iter_mut().zip(drift).zip(spins) {
            p.spin = spin;
            for a in 0..2 {
                p.x[a] += dt * v[a];
                if settles {
                    p.x[a] += p.unsettled[a];
                    p.unsettled[a] = first * dt * v[a];
                }
            }
        }
    }

    /// Velocities of all points after the kick (26) ... (28); with those of the nodes at the points. `own` is from before a filter.
    fn gather(&mut self, kicked: &Kicked, own: &[RefPoint], kick: f64) -> Vec<[f64; 2]> {
        let (mut at_points, inertia) = (Vec::new(), self.inertia());
        let alpha = self.pic_fraction(kick);
        let kept = self.kept_by_points(kick);
        // Of what it acts on, nodes or points, and of the gain by forces damping leaves a share.
        let [left, gained] = self.damping(kick);
        let of_points = 1.0 - kept;
        let of_nodes = 1.0 - left - of_points;
        self.totals.damped = 0.0;
        let affine = self.config.transfer.is_affine();
        let smooths = alpha > 0.0 || self.config.transfer.filters() || affine;
        for i in 0..self.points.len() {
            let p = self.points[i];
            let (mut v, mut dv) = ([0.0; 2], [0.0; 2]);
            let [mut b, mut db] = [[[0.0; 2]; 2]; 2];
            let (mut damped, mut b_damped) = (own[i].v.map(|v| of_points * v), own[i].b);
            b_damped
                .as_flattened_mut()
                .iter_mut()
                .for_each(|b| *b *= of_points);
            for (n, image) in self.seen(&p) {
                let s = self.weight(&p, image.at);
                let d = self.distance(&p, image.at).map(|d| -d * self.config.cell);
                let both = [&kicked.after, &kicked.before];
                let [after, before] = both.map(|v| image.velocity(v[n]));
                for a in 0..2 {
                    v[a] += s * after[a];
                    dv[a] += s * (after[a] - kept * before[a]);
                    let by_forces = after[a] - left * before[a];
                    let lost = of_nodes * before[a] + (1.0 / gained - 1.0) * by_forces;
                    damped[a] += s * lost;
                    for c in 0..2 {
                        b_damped[a][c] += s * lost * d[c];
                        b[a][c] += s * after[a] * d[c]; // (31)
                        db[a][c] += s * (after[a] - kept * before[a]) * d[c];
                    }
                }
            }
            let p = &mut self.points[i];
            for a in 0..2 {
                p.v[a] = alpha * v[a] + (1.0 - alpha) * (kept * p.v[a] + dv[a]);
            }
            if affine {
                p.b = b;
            }
            at_points.push(v);
            // What a point lacks of the gain of the nodes acts as a force does.
            let lost = |old: f64, gain: f64, new: f64| {
                0.5 * p.mass * (kept * old + gain - new) * (old + new)
            };
            if !smooths && gained == 1.0 {
                continue; // FLIP alone takes nothing.
            }
            for a in 0..2 {
                let work = |lost: f64, old: f64, new: f64| 0.5 * p.mass * lost * (old + new);
                self.totals.damped += work(damped[a], own[i].v[a], p.v[a]);
                if affine {
                    let of_axis = |c: usize| work(b_damped[a][c], own[i].b[a][c], b[a][c]);
                    self.totals.damped += (of_axis(0) + of_axis(1)) / inertia;
                }
                if !smooths {
                    continue;
                }
                self.totals.smoothed += lost(own[i].v[a], dv[a], p.v[a]);
                if affine {
                    let of_axis = |c: usize| lost(own[i].b[a][c], db[a][c], b[a][c]);
                    self.totals.smoothed += (of_axis(0) + of_axis(1)) / inertia;
                }
            }
        }
        at_points
    }

    /// Velocity in m/s of the driven walls, if there are any.
    fn driven(&self) -> Option<[f64; 2]> {
        let ends = self.config.walls.by_axis().into_iter().zip(0..);
        let mut walls = ends.flat_map(|(ends, axis)| ends.map(|(_, wall)| (wall, axis)));
        walls.find_map(|(wall, axis)| driven(wall, axis))
    }

    /// Work of driven walls in J/m on mapped velocities, of whose change points feel a share; supports take the impulse `felt` of it
    /// (N s/m).
    fn pulled_by_map(&self, mapped: &[[f64; 2]], (share, felt): (f64, [f64; 2])) -> f64 {
        let Some(wall) = self.driven() else {
            return 0.0;
        };
        let mut pulled = -(wall[0] * felt[0] + wall[1] * felt[1]);
        for (i, p) in self.points.iter().enumerate() {
            let v = self.interpolate(i, |n, _| mapped[n]);
            let gained = |a: usize| share * p.mass * (v[a] - p.v[a]);
            pulled += wall[0] * gained(0) + wall[1] * gained(1);
        }
        pulled
    }

    /// Counts what walls have done to the momentum, which was `start` before the kick.
    fn count_walls(&mut self, start: [f64; 2], kick: f64, forces: &[ImpForce]) {
        // Gravity and contact are known; the rest of the change of momentum is due to walls, supports and loads, or damping.
        let end = self.momentum();
        for a in 0..2 {
            let outer = self.points.iter().zip(forces);
            let outer: f64 = outer
                .map(|(p, f)| f.force[a] + p.mass * self.config.gravity[a])
                .sum();
            self.totals.applied[a] = end[a] - start[a] - kick * outer;
        }
        self.totals.pulled = 0.0;
        if let Some(v) = self.driven() {
            for a in 0..2 {
                let loads: f64 = self.points.iter().map(|p| kick * p.load[a]).sum();
                let of_walls = self.totals.applied[a] - loads - self.totals.support[a];
                self.totals.pulled += v[a] * of_walls;
            }
        }
    }

    /// `D_p` in m^2 (31).
    fn inertia(&self) -> f64 {
        let of_unit = match self.kernels[0] {
            Kernel::Cubic => 1.0 / 3.0,
            _ => 0.25,
        };
        self.config.cell.powi(2) * of_unit
    }

    /// Kinetic energy of a point in J/m, with that of its affine field (29).
    pub fn kinetic(&self, p: &RefPoint) -> f64 {
        let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
        0.5 * p.mass * (square(p.v) + (square(p.b[0]) + square(p.b[1])) / self.inertia())
    }

    /// What plastic flow and viscous stress have dissipated, and stress has worked, so far in J/m.
    pub fn lost(&self) -> [f64; 3] {
        let of = |lost: fn(&RefPoint) -> f64| self.points.iter().map(lost).sum();
        [of(|p| p.lost), of(|p| p.viscous), of(|p| p.worked)]
    }

    /// The largest squared frequency in 1/s^2 that contact with these forces may have. Each point has a stiffness along two
    /// directions, the first of which is that of its force; along the second acts its tangential stiffness on a surface of these
    /// radii (m), and what else there is of the stiffness at its centre. Springs reach the nodes through the spread of forces, and
    /// feel them through the shape function.
    pub fn contact_omega_sq(&self, forces: &[ImpForce], radii: &[f64]) -> f64 {
        let (mass, ..) = self.map(self.inertia());
        let mut springs = Vec::new();
        for ((p, f), radius) in self.points.iter().zip(forces).zip(radii) {
            let size = f.force[0].hypot(f.force[1]);
            let normal = match size {
                0.0 => [1.0, 0.0],
                _ => f.force.map(|f| f / size),
            };
            let tangent = [-normal[1], normal[0]];
            for (k, along, radius) in [
                (f.stiffness, normal, 0.0),
                (f.stiffness - f.tangential, tangent, 0.0),
                (f.tangential, tangent, *radius),
            ] {
                let through = |kernels: [Kernel; 2]| -> Vec<f64> {
                    let mut row = vec![[0.0; 2]; mass.len()];
                    for (n, Image { at, sign, .. }) in self.seen(p) {
                        let free = self.free(self.nodes.list[n].at);
                        let (s, curl) = (self.value(kernels, p, *at), self.curl(p, *at));
                        for a in 0..2 {
                            row[n][a] += free[a] * sign[a] * (s * along[a] - radius * curl[a]);
                        }
                    }
                    let each = row.iter().zip(&mass);
                    let per_root = |(row, mass): (&[f64; 2], &f64)| {
                        row.map(|x| if *mass > 0.0 { x / mass.sqrt() } else { 0.0 })
                    };
                    each.flat_map(per_root).collect()
                };
                if k > 0.0 {
                    springs.push((k, through(self.spread), through(self.kernels)));
                }
            }
        }
        if springs.is_empty() {
            return 0.0;
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let all = nalgebra::DMatrix::from_fn(springs.len(), springs.len(), |i, j| {
            let ((_, _, felt), (k, given, _)) = (&springs[i], &springs[j]);
            k * dot(felt, given)
        });
        let values = all.complex_eigenvalues();
        values.iter().map(|value| value.re).fold(0.0, f64::max)
    }

    /// Where nodes are that see forces, or that a point sees which sees one of these.
    fn places_near_loads(&self, forces: &[ImpForce]) -> HashSet<[i64; 2]> {
        let presses = |f: &ImpForce| f.force != [0.0; 2] || f.couple != 0.0;
        let pressed = self.points.iter().zip(forces).filter(|p| presses(p.1));
        let seen = pressed.flat_map(|(p, _)| self.seen(p).map(move |(_, image)| (p, image.at)));
        let loaded: HashSet<[i64; 2]> = seen
            .filter(|(p, place)| self.weight(p, *place) != 0.0)
            .map(|(_, place)| place)
            .collect();
        // As many nodes as a point sees along an axis, less one.
        let reach = match self.kernels[0] {
            Kernel::Linear => 1,
            Kernel::Quadratic | Kernel::Ugimp(_) => 2,
            Kernel::Cubic => 3,
        };
        // Near loads at the other end too, a support acts on all points that it holds, and a spin is that of a group.
        let closed = self.config.walls.periodic().contains(&true)
            || self.points.iter().any(|p| p.turns || p.held != [false; 2]);
        if closed && !loaded.is_empty() {
            let places = self.nodes.list.iter().flat_map(|node| &node.places);
            return places.map(|place| place.at).collect();
        }
        let around = |[x, y]: [i64; 2]| {
            (-reach..=reach).flat_map(move |j| (-reach..=reach).map(move |i| [x + i, y + j]))
        };
        loaded.into_iter().flat_map(around).collect()
    }

    /// A velocity of the nodes at a point, of which `velocity` says what it is at each place.
    fn interpolate(
        &self,
        point: usize,
        velocity: impl Fn(usize, [i64; 2]) -> [f64; 2],
    ) -> [f64; 2] {
        let (p, mut v) = (&self.points[point], [0.0_f64; 2]);
        for (n, image) in self.seen(p) {
            let s = self.weight(p, image.at);
            if s != 0.0 {
                let there = image.velocity(velocity(n, image.at));
                v = [0, 1].map(|a| v[a] + s * there[a]);
            }
        }
        v
    }

    /// Half the curl of such a velocity at a point.
    fn spin(&self, point: usize, velocity: impl Fn(usize, [i64; 2]) -> [f64; 2]) -> f64 {
        let (p, mut spin) = (&self.points[point], 0.0);
        for (n, image) in self.seen(p) {
            let curl = self.curl(p, image.at);
            let there = image.velocity(velocity(n, image.at));
            spin += curl[0] * there[0] + curl[1] * there[1];
        }
        spin
    }

    /// The stage of the step.
    fn stage(&self) -> Option<&Stage> {
        self.config
            .forcing
            .stages
            .iter()
            .rev()
            .find(|s| s.from <= self.time)
    }

    /// The shares of a velocity and of what forces add to it that a kick leaves: those of `dv/dt = a - c v`.
    fn damping(&self, kick: f64) -> [f64; 2] {
        match kick * self.stage().map_or(0.0, |stage| stage.damping) {
            0.0 => [1.0; 2],
            lost => [(-lost).exp(), -(-lost).exp_m1() / lost],
        }
    }

    /// The share of its own velocity that a kick leaves to a point.
    fn kept_by_points(&self, kick: f64) -> f64 {
        if self.damps_nodes() {
            1.0
        } else {
            self.damping(kick)[0]
        }
    }

    /// Whether damping acts on the velocities of the nodes alone.
    fn damps_nodes(&self) -> bool {
        matches!(self.config.transfer, Transfer::Pic | Transfer::Apic)
    }

    /// alpha of eq. 28 over a kick.
    fn pic_fraction(&self, kick: f64) -> f64 {
        if let Some(of_stage) = self.stage().and_then(|stage| stage.pic_fraction) {
            return of_stage;
        }
        match self.config.transfer {
            Transfer::Flip | Transfer::Xpic { .. } | Transfer::FlipXpic { .. } => 0.0,
            Transfer::Blend { pic_fraction } => pic_fraction,
            Transfer::FlipPic { pic_rate } | Transfer::Aflip { pic_rate } => {
                1.0 - (-pic_rate * kick).exp()
            }
            _ => 1.0,
        }
    }

    /// Whether what nodes lose in a kick counts: with velocities that are not mapped again.
    pub fn books_impacts(&self) -> bool {
        self.config.stress_update == StressUpdate::Usavg && self.config.drift() == Drift::Nodal
    }

    /// The filter of XPIC, where the transfer has one.
    fn filter_by_order(&mut self, kick: f64, inertia: f64) {
        match self.config.transfer {
            Transfer::Xpic { order } => self.filter(order, 1.0, inertia),
            Transfer::FlipXpic { order, pic_rate } => {
                self.filter(order, 1.0 - (-pic_rate * kick).exp(), inertia);
            }
            _ => {}
        }
    }

    /// The share of an interval that mapped velocities strain from its end, and the share from its start.
    fn shares(&self) -> [f64; 2] {
        match self.config.stress_update {
            StressUpdate::Usf => [1.0, 0.0],
            StressUpdate::Usl => [0.0, 0.0],
            StressUpdate::Musl => [0.0, 1.0],
            StressUpdate::Usavg => [0.5, 0.5],
        }
    }

    /// `v_p -= share (1 - S S+)^m v_p`.
    fn filter(&mut self, order: u32, share: f64, inertia: f64) {
        let aside: Vec<[f64; 2]> = self.points.iter().map(|p| p.v).collect();
        for round in 1..=order {
            let (_, held, _) = self.map(inertia);
            if round == order {
                self.totals.turned += share * self.turned_by_map(&held, inertia);
            }
            for i in 0..self.points.len() {
                let there = self.interpolate(i, |n, _| held[n]);
                let v = &mut self.points[i].v;
                *v = [0, 1].map(|a| v[a] - there[a]);
            }
        }
        for (p, v) in self.points.iter_mut().zip(aside) {
            p.v = [0, 1].map(|a| v[a] - share * p.v[a]);
        }
    }

    /// Spin in rad/s of a group, whose points have the same mass, about its centre, as nodes get it; 0 where they do not.
    fn turn(&self, group: usize) -> f64 {
        let own = || self.points.iter().filter(|p| p.turns && p.group == group);
        let count = own().count() as f64;
        let mean = |of: fn(&RefPoint) -> [f64; 2]| {
            own().map(|p| Vector2::from(of(p))).sum::<Vector2<f64>>() / count
        };
        let (x, v) = (mean(|p| p.x), mean(|p| p.v));
        let (mut turning, mut inertia) = (0.0, 0.0);
        for p in own() {
            let arm = Vector2::from(p.x) - x;
            turning += arm.perp(&(Vector2::from(p.v) - v));
            inertia += arm.norm_squared();
        }
        if inertia > 0.0 {
            turning / inertia
        } else {
            0.0
        }
    }

    /// Of each group.
    fn turns(&self) -> Vec<f64> {
        let groups = self.points.iter().map(|p| p.group + 1).max().unwrap_or(0);
        (0..groups).map(|group| self.turn(group)).collect()
    }

    /// The velocity that a point gives to a node at this place; `turn` is that of its group.
    fn given(&self, p: &RefPoint, place: [i64; 2], turn: f64, inertia: f64) -> [f64; 2] {
        let d = self.distance(p, place).map(|d| -d * self.config.cell); // x_I - x_p
        let affine = p.b.map(|b| (b[0] * d[0] + b[1] * d[1]) / inertia);
        let around = [-turn * d[1], turn * d[0]];
        [0, 1].map(|a| p.v[a] + affine[a] + around[a])
    }

    /// Angular momentum about the origin in N s of what has these velocities at the places of nodes.
    fn turning_of(&self, velocity: &[[f64; 2]]) -> f64 {
        self.turning_at(|_, n, image| image.velocity(velocity[n]))
    }

    /// By how much (N s) that exceeds what the points give, by what walls and supports have done to `mapped` velocities.
    fn turned_by_map(&self, mapped: &[[f64; 2]], inertia: f64) -> f64 {
        let turns = self.turns();
        let given =
            |p: &RefPoint, _, image: &Image<_>| self.given(p, image.at, turns[p.group], inertia);
        self.turning_of(mapped) - self.turning_at(given)
    }

    fn turning_at(&self, velocity: impl Fn(&RefPoint, usize, &Image<[i64; 2]>) -> [f64; 2]) -> f64 {
        let [corner, cell] = [self.config.domain[0], [self.config.cell; 2]];
        let mut sum = 0.0;
        for p in &self.points {
            for (n, image) in self.seen(p) {
                let place = [0, 1].map(|a| corner[a] + cell[a] * image.at[a] as f64);
                let momentum = self.weight(p, image.at) * p.mass;
                sum += momentum * at(place, velocity(p, n, image))[2];
            }
        }
        sum
    }

    /// Mass and velocity of the nodes (18) ... (20), (30), walls obeyed; with the velocity that walls have taken.
    fn map(&self, inertia: f64) -> (Vec<f64>, Vec<[f64; 2]>, Vec<[f64; 2]>) {
        let (turns, nodes) = (self.turns(), &self.nodes.list);
        let mut mass = vec![0.0; nodes.len()];
        let mut momentum = vec![[0.0; 2]; nodes.len()];
        for p in &self.points {
            for (n, image) in self.seen(p) {
                let s = self.weight(p, image.at);
                // A velocity and its image are images of one another.
                let v = image.velocity(self.given(p, image.at, turns[p.group], inertia));
                mass[n] += p.mass * s;
                momentum[n] = [0, 1].map(|a| momentum[n][a] + p.mass * s * v[a]);
            }
        }
        let nodes = momentum.iter().zip(&mass);
        let per_mass =
            |(p, &m): (&[f64; 2], &f64)| if m > 0.0 { p.map(|p| p / m) } else { [0.0; 2] };
        let mut velocity: Vec<[f64; 2]> = nodes.map(per_mass).collect();
        let obeyed = self.obey(&mass, &mut velocity, |_| Acting::Mapped);
        let stopped = obeyed.into_iter().map(|o| o.stopped).collect();
        (mass, velocity, stopped)
    }

    /// Strains every point by the velocities of the nodes over `dt` (21) ... (24), with gradients of the middle of the
    /// interval; `half` is how much of it is past where the points stand.
    fn strain(&mut self, velocity: &[[f64; 2]], dt: f64, half: f64) {
        let swellings = self.swellings(dt);
        for (i, swelling) in swellings.into_iter().enumerate() {
            let p = self.points[i];
            let mut l = [[0.0; 2]; 2];
            for (n, image) in self.seen(&p) {
                let (g, there) = (self.gradient(&p, image.at), image.velocity(velocity[n]));
                for a in 0..2 {
                    for b in 0..2 {
                        l[a][b] += there[a] * g[b] * dt;
                    }
                }
            }
            let [[xx, xy], [yx, yy]] = l;
            let at = nalgebra::Matrix2::new(xx, xy, yx, yy);
            let middle = at
                * (nalgebra::Matrix2::identity() - at * half)
                    .try_inverse()
                    .expect("regular");
            self.points[i].strain(middle, dt, swelling);
        }
    }
}
