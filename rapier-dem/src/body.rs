//! A body of the scene as rapier has it.

use interface::config::{BodyConfig, BodyInertia, BodyShape, Motion};
use interface::solver::Refusal;
use rapier2d_f64::prelude::*;

/// A body. Its frame in rapier lies at its centre of mass; velocities in rapier are those of `t_{n-1/2}`.
#[derive(Clone)]
pub struct Body {
    /// Name in the scene.
    pub name: String,
    /// In rapier's set.
    pub handle: RigidBodyHandle,
    /// What rapier measures distances of points from, in the body's frame: the disc, or the unswept polygon.
    pub shape: SharedShape,
    /// What is left of the sphero-radius beyond that shape, in m.
    pub margin: f64,
    /// Vertices of the unswept outline in the body's frame, in m, and its sphero-radius in m.
    pub outline: (Vec<Vector>, f64),
    /// Distance of the farthest surface point from the centre of mass in m.
    pub extent: f64,
    /// kg/m and kg m.
    pub mass: f64,
    /// See `mass`.
    pub inertia: f64,
    /// Inverse mass and inertia; 0 for a body that forces do not move.
    pub inverse: [f64; 2],
    /// In rad, not wrapped.
    pub angle: f64,
    /// Shift (m) and turn (rad) over the last step.
    pub moved: (Vector, f64),
    /// Velocity and spin after the kick, at `t_{n+1/2}`.
    pub kicked: (Vector, f64),
    /// Position and angle when the envelopes were last asked for.
    pub published: (Vector, f64),
    /// Force (N/m) and torque (N) of the points.
    pub load: (Vector, f64),
    /// Sums of the contacts in reach: L-2 of PROTOCOL.md in 1/s^2, mobility in 1/kg; points that press.
    pub reach: (f64, f64, u64),
}

impl Body {
    /// Puts the body `index` into `world`; a collider too if `solid`, with `friction`.
    ///
    /// # Errors
    /// A [`Refusal`] of what rapier has no shape for.
    pub fn insert(
        world: &mut PhysicsWorld,
        index: usize,
        config: &BodyConfig,
        friction: Option<f64>,
    ) -> Result<Self, Refusal> {
        let refusal = |field: &str, message: &str| {
            Refusal::new(format!("dem.bodies[{index}].{field}"), message)
        };
        let free = match config.motion {
            Motion::Free => true,
            Motion::Fixed => false,
            _ => return Err(refusal("motion", "only `free` and `fixed` are known here")),
        };
        let vertices = outline(&config.shape).map_err(|message| refusal("shape", message))?;
        let a = config.sphero_radius;
        let swept = dem_proc::mass::swept(&vertices, a);
        let mass = match config.inertia {
            BodyInertia::Mass(mass) => mass,
            BodyInertia::Density(density) => density * swept.area,
        };
        let inertia = mass * swept.polar / swept.area;
        if !(mass > 0.0 && inertia > 0.0 && inertia.is_finite()) {
            return Err(refusal(
                "inertia",
                "mass and moment of inertia must be positive and finite",
            ));
        }
        let arms: Vec<Vector> = vertices
            .iter()
            .map(|v| Vector::new(v.x - swept.centroid.x, v.y - swept.centroid.y))
            .collect();
        let (shape, margin, solid) =
            shapes(&arms, a).ok_or_else(|| refusal("shape", "rapier takes it for degenerate"))?;
        let rotation = Rotation::new(config.angle);
        let centroid = Vector::new(swept.centroid.x, swept.centroid.y);
        let centre = Vector::from(config.position) + rotation * centroid;
        let builder = if free {
            RigidBodyBuilder::dynamic()
        } else {
            RigidBodyBuilder::fixed()
        };
        let (velocity, spin) = if free {
            (config.velocity.into(), config.spin)
        } else {
            (Vector::ZERO, 0.0)
        };
        let body = builder
            .pose(Pose::new(centre, config.angle))
            .linvel(velocity)
            .angvel(spin)
            .can_sleep(false)
            .additional_mass_properties(MassProperties::new(Vector::ZERO, mass, inertia));
        let handle = world.insert_body(body);
        if let Some(friction) = friction {
            let collider = ColliderBuilder::new(solid)
                .density(0.0)
                .friction(friction)
                .restitution(0.0);
            world.insert_collider(collider, Some(handle));
        }
        let extent = arms.iter().map(|arm| arm.length()).fold(0.0, f64::max) + a;
        Ok(Self {
            name: config.name.clone(),
            handle,
            shape,
            margin,
            outline: (arms, a),
            extent,
            mass,
            inertia,
            inverse: if free {
                [1.0 / mass, 1.0 / inertia]
            } else {
                [0.0; 2]
            },
            angle: config.angle,
            moved: (Vector::ZERO, 0.0),
            kicked: (velocity, spin),
            published: (centre, config.angle),
            load: (Vector::ZERO, 0.0),
            reach: (0.0, 0.0, 0),
        })
    }

    /// Whether forces move it.
    pub fn is_free(&self) -> bool {
        self.inverse[0] > 0.0
    }

    /// Largest speed of a surface point after the kick in m/s.
    pub fn speed(&self) -> f64 {
        self.kicked.0.length() + self.kicked.1.abs() * self.extent
    }

    /// Kinetic energy of translation and of rotation in J/m.
    pub fn kinetic(&self, (velocity, spin): (Vector, f64)) -> [f64; 2] {
        [
            0.5 * self.mass * velocity.length_squared(),
            0.5 * self.inertia * spin * spin,
        ]
    }
}

/// Vertices of a convex outline, counter-clockwise, or why it is not taken.
fn outline(shape: &BodyShape) -> Result<Vec<interface::Vec2>, &'static str> {
    if matches!(shape, BodyShape::Cluster { .. }) {
        return Err("no clusters here: discs, segments and convex polygons");
    }
    let mut vertices: Vec<interface::Vec2> = shape.vertices().into_iter().map(Into::into).collect();
    let n = vertices.len();
    if n > 2 {
        let turn = |i: usize| {
            let [a, b, c] = [0, 1, 2].map(|k| vertices[(i + k) % n]);
            (b - a).perp(&(c - b))
        };
        let turns: Vec<f64> = (0..n).map(turn).collect();
        if turns.iter().any(|&t| t <= 0.0) && turns.iter().any(|&t| t >= 0.0) {
            return Err(
                "a polygon with a notch or a straight corner: only convex ones are known here",
            );
        }
        if turns[0] < 0.0 {
            vertices.reverse();
        }
    }
    Ok(vertices)
}

/// What distances are measured from, what of the sphero-radius `a` (m) is left beyond it in m, and the swept shape; `None`
/// where rapier finds no area.
fn shapes(arms: &[Vector], a: f64) -> Option<(SharedShape, f64, SharedShape)> {
    Some(match *arms {
        [_] => (SharedShape::ball(a), 0.0, SharedShape::ball(a)),
        [p, q] => (SharedShape::segment(p, q), a, SharedShape::capsule(p, q, a)),
        _ => {
            let polygon = SharedShape::convex_polyline(arms.to_vec())?;
            let solid = if a > 0.0 {
                SharedShape::round_convex_polyline(arms.to_vec(), a)?
            } else {
                polygon.clone()
            };
            (polygon, a, solid)
        }
    })
}
