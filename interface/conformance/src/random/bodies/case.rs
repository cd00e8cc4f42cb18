//! A case: bodies, laws, points that move along them, and the steps in which that is looked at. A case is data, so it can
//! be made smaller, kept in a file and run again.

use interface::Vec2;
use interface::config::DemConfig;
use interface::message::wire::{ImpInfo, ImpState};
use mechanics::reference::bodies::Oracle;
use serde::{Deserialize, Serialize};

use super::super::plan::{self, Course, Epoch};
use super::copy::Copied;

/// What a point moves along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Along {
    /// The surface of a body, with it. Of a cluster it is that of one of the discs, which follows from its id.
    Body(usize),
    /// Another point, which comes before it.
    Point(usize),
    /// The x axis.
    Axis,
}

/// A point that moves along a surface as the kit says, whatever the forces are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Walker {
    /// Who it is.
    #[serde(flatten)]
    pub info: ImpInfo,
    /// What it moves along.
    pub along: Along,
    /// Way along the outline in m.
    pub way: Course,
    /// Overlap in m.
    pub overlap: Course,
    /// What the velocity that it reports has beyond its displacement over the step, in m/s.
    pub noise: [f64; 2],
    /// Spin that it reports in rad/s.
    pub spin: f64,
    /// Steps in which it is in the set: from, and up to but without.
    pub present: Vec<[u32; 2]>,
    /// A segment of a chain between it and the next one of its group: 1 from it to that, -1 from that to it, 0 none.
    #[serde(default)]
    pub segment: i32,
}

impl Walker {
    /// Whether it is in the set.
    pub fn is_present(&self, step: u32) -> bool {
        let mut ranges = self.present.iter();
        ranges.any(|[from, to]| (*from..*to).contains(&step))
    }
}

/// A case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// What the solver gets.
    pub config: DemConfig,
    /// The points, by their ids.
    pub points: Vec<Walker>,
    /// The steps.
    pub epochs: Vec<Epoch>,
    /// A copy in which a solver with friction of its own has to give the same forces. Every step is measured, in a window of its own.
    #[serde(default)]
    pub copied: Option<Copied>,
}

impl Case {
    /// The same from a later step on, as if it were the first.
    pub fn begun_in(&self, first: u32) -> Self {
        let mut case = self.clone();
        [_, case.epochs] = plan::parts(&self.epochs, first);
        for point in &mut case.points {
            for course in [&mut point.way, &mut point.overlap] {
                let start = (0, course.at(first));
                course.0.retain(|(step, _)| *step > first);
                course.0.iter_mut().for_each(|(step, _)| *step -= first);
                course.0.insert(0, start);
            }
            for range in &mut point.present {
                *range = range.map(|step| step.saturating_sub(first));
            }
        }
        case
    }

    /// The segments of chains: the points where each begins and ends. From the last one of a group it leads to the first one.
    pub fn segments(&self) -> impl Iterator<Item = [usize; 2]> {
        let group = |k: usize| self.points[k].info.group;
        let own = (0..self.points.len()).filter(|&k| self.points[k].segment != 0);
        own.map(move |k| {
            let next = Some(k + 1).filter(|&n| n < self.points.len() && group(n) == group(k));
            let next = next.or_else(|| (0..k).find(|&first| group(first) == group(k)));
            let next = next.unwrap_or(k);
            if self.points[k].segment > 0 {
                [k, next]
            } else {
                [next, k]
            }
        })
    }

    /// The set in a step.
    pub fn set(&self, step: u32) -> Vec<ImpInfo> {
        let present =
            |points: &[Walker]| points.iter().filter(|point| point.is_present(step)).count();
        let here = self.points.iter().filter(|point| point.is_present(step));
        let mut set: Vec<ImpInfo> = here.map(|point| point.info).collect();
        for ends in self.segments().filter(|[a, b]| a != b) {
            if ends.iter().all(|&k| self.points[k].is_present(step)) {
                let [from, to] = ends.map(|k| present(&self.points[..k]));
                set[from].next = to as u32 + 1;
            }
        }
        set
    }

    /// Positions of all points in a step, those included that are not in the set.
    pub fn positions(&self, step: u32, oracle: &Oracle) -> Vec<Vec2> {
        let mut positions: Vec<Vec2> = Vec::new();
        for point in &self.points {
            let (way, overlap) = (point.way.at(step), point.overlap.at(step));
            positions.push(match point.along {
                Along::Body(b) => {
                    let body = &oracle.bodies[b];
                    let mut parts = body.parts();
                    let part = point.info.id as usize % parts.len();
                    let (outline, a) = parts.swap_remove(part);
                    let (reach, angle) = (a + point.info.radius, body.pose.z);
                    let away = reach - overlap;
                    let (place, normal) = around(&outline, reach.copysign(away), way, angle);
                    place + normal * away
                }
                Along::Axis => Vec2::new(way, 0.0),
                Along::Point(k) => {
                    let reach = self.points[k].info.radius + point.info.radius;
                    let angle = way / reach;
                    positions[k] + Vec2::new(angle.cos(), angle.sin()) * (reach - overlap)
                }
            });
        }
        positions
    }

    /// States of the points that are in the set, given the positions of all now and one step before.
    pub fn states(&self, step: u32, now: &[Vec2], before: Option<(&[Vec2], f64)>) -> Vec<ImpState> {
        let mut states = Vec::new();
        for (k, point) in self.points.iter().enumerate() {
            if point.is_present(step) {
                let moved = match before {
                    Some((before, dt)) if dt > 0.0 => (now[k] - before[k]) / dt,
                    _ => Vec2::zeros(),
                };
                states.push(ImpState {
                    position: now[k].into(),
                    velocity: (moved + Vec2::from(point.noise)).into(),
                    spin: point.spin,
                });
            }
        }
        states
    }
}

/// Where a way (m) along an outline rounded by `radius` (m; negative: inside of it, where reflex corners are round) leads: the
/// nearest place of the outline, and the unit normal. It begins at the first vertex, in the body's own direction of `angle` (rad).
fn around(outline: &[Vec2], radius: f64, way: f64, angle: f64) -> (Vec2, Vec2) {
    let n = outline.len();
    let direction = |angle: f64| Vec2::new(angle.cos(), angle.sin());
    if n == 1 {
        return (outline[0], direction(angle + way / radius));
    }
    let edge = |i: usize| outline[(i + 1) % n] - outline[i % n];
    let outwards = |i: usize| {
        let e = edge(i).normalize();
        Vec2::new(e.y, -e.x)
    };
    let turn = |i: usize| {
        // At the end of edge i.
        let (a, b) = (outwards(i), outwards(i + 1));
        if n == 2 {
            std::f64::consts::PI
        } else {
            (a.x * b.y - a.y * b.x).atan2(a.dot(&b))
        }
    };
    let lengths: Vec<f64> = (0..n)
        .flat_map(|i| [edge(i).norm(), (radius * turn(i)).max(0.0)])
        .collect();
    let mut left = way.rem_euclid(lengths.iter().sum());
    for (k, length) in lengths.iter().enumerate() {
        if left < *length || k + 1 == lengths.len() {
            let i = k / 2;
            if k % 2 == 0 {
                return (outline[i] + edge(i).normalize() * left, outwards(i));
            }
            let normal = outwards(i);
            let from = normal.y.atan2(normal.x);
            return (outline[(i + 1) % n], direction(from + left / radius));
        }
        left -= length;
    }
    unreachable!("the last length ends the loop")
}
