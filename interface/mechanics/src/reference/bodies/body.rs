//! A body of the oracle: its outline, its pose, and how its material moves.

use interface::Vec2;
use interface::config::{BodyConfig, BodyShape, Motion as Drive};
use nalgebra::Vector3;

use crate::mass::{cross, swept, union_of_discs};

/// Along x and y, and about the centre of mass.
pub type Vec3 = Vector3<f64>;

/// One of two that may touch: 1/m in m/kg, and where they touch the displacement (m) and the rotation (rad) over the last step,
/// if they are known, and the velocity in m/s.
pub(super) type Side = (f64, Option<Vec3>, Vec2);

/// A body at `t_n`, with the velocities of `t_{n-1/2}`.
#[derive(Debug, Clone)]
pub struct Body {
    /// Mass twice in kg/m, and moment of inertia in kg m.
    pub(super) inertia: Vec3,
    /// 1 where forces move it, 0 where they do not.
    pub(super) yields: Vec3,
    pub(super) drive: Drive,
    pub(super) surface: String,
    /// Vertices from the centre of mass at an angle of 0 in m, and the sphero-radius of each in m.
    pub(super) vertices: Vec<(Vec2, f64)>,
    /// Distance of its farthest place from its centre of mass in m.
    pub(super) reach: f64,
    /// A cluster: every vertex is a disc of its own.
    cluster: bool,
    /// Centre of mass in m, and angle.
    pub pose: Vec3,
    /// In m/s and rad/s.
    pub(super) velocity: Vec3,
    /// Translation (m) and rotation (rad) of the last drift.
    pub(super) last: Vec3,
}

fn turned(v: Vec2, angle: f64) -> Vec2 {
    let (s, c) = angle.sin_cos();
    Vec2::new(c * v.x - s * v.y, s * v.x + c * v.y)
}

pub(super) fn left(v: Vec2) -> Vec2 {
    Vec2::new(-v.y, v.x)
}

/// The edges of an outline.
pub(super) fn edges(outline: &[Vec2]) -> impl Iterator<Item = [Vec2; 2]> {
    let n = outline.len();
    (0..n - usize::from(n == 2)).map(move |e| [outline[e], outline[(e + 1) % n]])
}

impl Body {
    pub(super) fn new(config: &BodyConfig) -> Self {
        let vertices = config.shape.counter_clockwise().into_iter();
        let vertices: Vec<Vec2> = vertices.map(Vec2::from).collect();
        let mut radii = vec![config.sphero_radius; vertices.len()];
        let own = match &config.shape {
            BodyShape::Cluster { radii, .. } => Some(radii),
            _ => None,
        };
        let moments = if let Some(own) = own {
            radii[..own.len()].copy_from_slice(own);
            union_of_discs(&vertices, &radii)
        } else {
            swept(&vertices, config.sphero_radius)
        };
        let (mass, inertia) = moments.mass(config.inertia);
        let place = Vec2::from(config.position) + turned(moments.centroid, config.angle);
        let vertices = vertices.iter().map(|v| v - moments.centroid).zip(radii);
        let vertices: Vec<_> = vertices.collect();
        let reach = vertices.iter().map(|(v, a)| v.norm() + a);
        Self {
            reach: reach.fold(0.0, f64::max),
            inertia: Vec3::new(mass, mass, inertia),
            yields: config.motion.yielding().into(),
            drive: config.motion,
            surface: config.surface.clone(),
            vertices,
            cluster: own.is_some(),
            pose: place.push(config.angle),
            velocity: Vec2::from(config.velocity).push(config.spin),
            last: Vec3::zeros(),
        }
    }

    /// Where a place of its frame (m) is.
    fn at(&self, place: Vec2) -> Vec2 {
        self.pose.xy() + turned(place, self.pose.z)
    }

    /// The outline in m, with sphero-radii.
    pub fn outline(&self) -> impl Iterator<Item = (Vec2, f64)> {
        self.vertices.iter().map(|(v, a)| (self.at(*v), *a))
    }

    /// Positions of its vertices in m.
    pub fn corners(&self) -> Vec<Vec2> {
        self.outline().map(|(v, _)| v).collect()
    }

    /// The outlines that a point touches one by one, each with its sphero-radius: one, or the discs of a cluster.
    pub fn parts(&self) -> Vec<(Vec<Vec2>, f64)> {
        if self.cluster {
            return self.outline().map(|(v, a)| (vec![v], a)).collect();
        }
        vec![(self.corners(), self.vertices[0].1)]
    }

    /// Whether it is a disc, or several.
    pub(super) fn is_round(&self) -> bool {
        self.cluster || self.vertices.len() == 1
    }

    pub(super) fn is_moved_by_forces(&self) -> bool {
        self.yields != Vec3::zeros()
    }

    /// `1/m` along x and y, and `1/I`; 0 in directions in which forces do not move it.
    pub(super) fn mobility(&self) -> Vec3 {
        self.yields.component_div(&self.inertia)
    }

    /// What a contact at `r` (m) from the centre of mass takes of it.
    pub(super) fn side(&self, r: Vec2) -> Side {
        let light = self.mobility().xy().max();
        let fast = self.velocity.xy() + left(r) * self.velocity.z;
        (light, Some(self.moved(r).push(self.last.z)), fast)
    }

    /// What a contact at `r` (m) from the centre of mass adds to its squared frequency (L-2), with stiffnesses along N and T.
    pub(super) fn rate(&self, r: Vec2, normal: Vec2, [k_n, k_t]: [f64; 2]) -> f64 {
        let (light, turns) = (self.mobility().xy().max(), self.mobility().z);
        let (n, t) = (cross(r, normal), cross(r, left(normal)));
        k_n * (light + n * n * turns) + k_t * (light + t * t * turns)
    }

    /// Displacement in m, in the last drift, of the material that is now at `r` (m) from the centre of mass.
    pub(super) fn moved(&self, r: Vec2) -> Vec2 {
        self.last.xy() + r - turned(r, -self.last.z)
    }

    /// Where the material that is now at a place `x` (m) was before the last drift.
    pub(super) fn was(&self, x: Vec2) -> Vec2 {
        x - self.moved(x - self.pose.xy())
    }

    /// Where a place `x` (m) is now if it has moved with the body in the last drift.
    pub fn carried(&self, x: Vec2) -> Vec2 {
        let center = self.pose.xy();
        center + turned(x - (center - self.last.xy()), self.last.z)
    }

    /// The fastest point of the surface in m/s at this velocity.
    pub(super) fn speed(&self, velocity: Vec3) -> f64 {
        let speed = |(v, a): &(Vec2, f64)| {
            let around = left(turned(*v, self.pose.z)) * velocity.z;
            (velocity.xy() + around).norm() + a * velocity.z.abs()
        };
        self.vertices.iter().map(speed).fold(0.0, f64::max)
    }

    /// Largest sphero-radius in m.
    pub(super) fn largest_radius(&self) -> f64 {
        self.vertices.iter().map(|(_, a)| *a).fold(0.0, f64::max)
    }

    /// The most that a force of 1 N/m on its surface accelerates a place of it, in m/kg.
    pub(super) fn surface_mobility(&self) -> f64 {
        let (reach, each) = (self.reach, self.mobility());
        each.x.max(each.y) + reach * reach * each.z
    }

    /// Displacement in m of the point of the surface that has gone farthest since the pose `then`, as far as 16 directions
    /// around every vertex show it.
    pub(super) fn gone_since(&self, then: &Vec3) -> f64 {
        let surface = self.vertices.iter().flat_map(|(v, a)| {
            let around = (0..16).map(|k| f64::from(k) * std::f64::consts::TAU / 16.0);
            around.map(move |way| v + Vec2::new(way.cos(), way.sin()) * *a)
        });
        let gone = surface.map(|at| {
            let (now, before) = (self.at(at), then.xy() + turned(at, then.z));
            // Less what rounding makes of a body that does not move.
            (now - before).norm() - 1e-14 * (now.norm() + at.norm())
        });
        gone.fold(0.0, f64::max)
    }
}
