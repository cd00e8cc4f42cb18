//! Bodies: their constants (checked configuration) and their state in the leapfrog.

use interface::Vec2;
use interface::config::{BodyConfig, DemConfig, Motion};
use interface::solver::Refusal;
use wide::f64x4;

use crate::body::frame::{Frame, LastMove};
use crate::body::shape::Shape;
use crate::body::surfaces::Surfaces;
use crate::threads::part;
use mechanics::threads::Threads;

/// The constants of a body.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name in the scene.
    pub name: String,
    /// Outline and area moments.
    pub shape: Shape,
    /// Mass in kg/m.
    pub mass: f64,
    /// Moment of inertia about the centre of mass in kg m.
    pub inertia: f64,
    /// How it moves.
    pub motion: Motion,
    /// 1 along x, along y and for the angle where forces move the body, 0 where they do not.
    pub yielding: [f64; 3],
    /// Number of its surface ([`Surfaces`]).
    pub surface: u32,
}

impl Body {
    /// Whether forces move the body in any direction.
    pub fn yields(&self) -> bool {
        self.yielding != [0.0; 3]
    }
}

/// What is saved of a body with its [`LastMove`]: centre, velocity, angle and spin.
pub type Pose = (Vec2, Vec2, f64, f64);

/// A body for contacts and steps: its state, with the position at `t_n` and the velocity at `t_{n-1/2}`, and the constants that
/// every contact needs.
#[derive(Debug, Clone, Copy)]
pub struct Rigid {
    /// Centre of mass `c` in m.
    pub center: Vec2,
    /// Velocity of the centre of mass in m/s.
    pub velocity: Vec2,
    /// Angle in rad, a plain sum: vertices are rebuilt from it, so no rotation matrix drifts.
    pub angle: f64,
    /// Angular velocity in rad/s.
    pub spin: f64,
    /// `1/m`, 0 for a body that forces do not move.
    pub inverse_mass: f64,
    /// `1/I`, 0 for a body that forces do not rotate.
    pub inverse_inertia: f64,
    /// Sphero-radius `a` in m; of a cluster, the largest of its discs.
    pub radius: f64,
    /// Largest distance of the surface from the centre of mass in m.
    pub extent: f64,
    /// 1 for a body that gravity or other forces move in any direction, 0 for a fixed or driven one.
    pub falls: f64,
    /// Index of its first vertex in [`Bodies::outline`], and number of its vertices.
    vertices: [u32; 2],
}

impl Rigid {
    /// Upper bound of the speed of any point of the surface at a given velocity and spin, in m/s.
    #[inline]
    pub fn surface_speed(&self, velocity: Vec2, spin: f64) -> f64 {
        velocity.norm() + spin.abs() * self.extent
    }

    /// Upper bound of the acceleration of any point of the surface by a push (N/m and N), in m/s^2.
    pub fn surface_acceleration(&self, (force, torque): (Vec2, f64)) -> f64 {
        force.norm() * self.inverse_mass + torque.abs() * self.inverse_inertia * self.extent
    }

    /// Whether it is a disc: not a cluster of several.
    #[inline]
    pub fn is_disc(&self) -> bool {
        self.vertices[1] == 1
    }

    /// Index of its first vertex in [`Bodies::outline`].
    #[inline]
    pub fn first_vertex(&self) -> u32 {
        self.vertices[0]
    }

    /// Upper bound of the lever arm of a normal force on the surface in m. The normals of a disc meet in its centre.
    #[inline]
    pub fn lever(&self) -> f64 {
        if self.is_disc() { 0.0 } else { self.extent }
    }

    /// Whether it stays where it is with these kicked velocity and spin: it is held, and is not driven.
    #[inline]
    fn rests(&self, (velocity, spin): (Vec2, f64)) -> bool {
        self.falls == 0.0 && velocity == Vec2::zeros() && spin == 0.0
    }

    /// Vertices in world coordinates (m), from those in the body's frame and its angle.
    #[inline]
    fn place_outline(&self, world: &mut [Vec2], local: &[Vec2]) {
        self.place_turned(world, local, || sines([self.angle; 4])[0]);
    }

    /// The same, if sine and cosine of the angle are known.
    #[inline]
    fn place_turned(&self, world: &mut [Vec2], local: &[Vec2], turn: impl FnOnce() -> [f64; 2]) {
        if let [only] = world {
            *only = self.center; // a disc looks the same at every angle
            return;
        }
        let [sin, cos] = turn();
        for (world, v) in world.iter_mut().zip(local) {
            *world = self.center + Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y);
        }
    }

    /// Velocity of the body's material at `r` from its centre of mass, in m/s.
    #[inline]
    pub fn velocity_at(&self, r: Vec2) -> Vec2 {
        self.velocity + Vec2::new(-r.y, r.x) * self.spin
    }
}

/// Sine and cosine of four angles in rad. What one angle has does not depend on the others.
#[inline]
fn sines(angles: [f64; 4]) -> [[f64; 2]; 4] {
    let (sin, cos) = f64x4::new(angles).sin_cos();
    let (sin, cos) = (sin.to_array(), cos.to_array());
    [0, 1, 2, 3].map(|k| [sin[k], cos[k]])
}

/// All bodies.
#[derive(Debug, Clone, Default)]
pub struct Bodies {
    /// Their constants.
    pub properties: Vec<Body>,
    /// Their states.
    pub state: Vec<Rigid>,
    /// The data of the bodies that the contact loops read.
    pub frames: Vec<Frame>,
    /// Vertices of all bodies in world coordinates at `t_n`, body after body, in m.
    pub outline: Vec<Vec2>,
    /// Radius around each vertex in m: the sphero-radius of its body, or of its disc in a cluster.
    pub radii: Vec<f64>,
    /// The same vertices relative to the centre of mass, in the body's frame.
    local: Vec<Vec2>,
    /// Fixed and driven bodies, in ascending order.
    pub held: Vec<u32>,
    /// Guided and pushed bodies, in ascending order.
    pub special: Vec<u32>,
    /// Mass in kg/m of each free body, and 0 of the others, in their order; the sum.
    pub free: (Vec<f64>, f64),
    /// One over the squared length of the edge that begins at each vertex, in 1/m^2; 0 for a disc.
    pub inverse_length_sq: Vec<f64>,
}

impl Bodies {
    /// Checks and places the bodies of a scene.
    ///
    /// # Errors
    /// A refusal with a key such as `dem.body.2.shape.polygon.vertices`.
    pub fn new(config: &DemConfig) -> Result<Self, Refusal> {
        let mut bodies = Self::default();
        let surfaces = Surfaces::new(config);
        for (i, body) in config.bodies.iter().enumerate() {
            let refuse = |(key, message): (&str, String)| {
                let message = format!("body \"{}\": {message}", body.name);
                Refusal::new(format!("dem.body.{i}.{key}"), message)
            };
            let surface = surfaces.number(&body.surface);
            let (what, state) = place(body, bodies.outline.len(), surface).map_err(refuse)?;
            let vertices = &what.shape.vertices;
            bodies.outline.extend_from_slice(vertices);
            bodies.local.extend_from_slice(vertices);
            let shape = &what.shape;
            let radius = |k: usize| shape.radii.get(k).copied().unwrap_or(shape.radius);
            bodies.radii.extend((0..vertices.len()).map(radius));
            let inverse = |k: usize| {
                let edge = vertices[shape.edge_end(k)] - vertices[k];
                if k < shape.edge_count() && edge != Vec2::zeros() {
                    1.0 / edge.norm_squared()
                } else {
                    0.0
                }
            };
            (bodies.inverse_length_sq).extend((0..vertices.len()).map(inverse));
            bodies.properties.push(what);
            let mut free = 0.0;
            match body.motion {
                Motion::Free => free = bodies.properties[i].mass,
                Motion::Fixed | Motion::Driven => bodies.held.push(i as u32),
                Motion::Guided { .. } | Motion::Pushed { .. } => bodies.special.push(i as u32),
            }
            bodies.free.0.push(free);
            bodies.free.1 += free;
            bodies.frames.push(Frame {
                center: state.center,
                last: LastMove::default(),
                inverse_mass: state.inverse_mass,
                inverse_inertia: state.inverse_inertia,
            });
            let first = state.vertices[0] as usize;
            state.place_outline(&mut bodies.outline[first..], &bodies.local[first..]);
            bodies.state.push(state);
        }
        Ok(bodies)
    }

    /// Number of bodies.
    pub fn len(&self) -> usize {
        self.properties.len()
    }

    /// Whether there is no body.
    pub fn is_empty(&self) -> bool {
        self.properties.is_empty()
    }

    /// Outline of body `b` in world coordinates in m.
    #[inline]
    pub fn outline_of(&self, b: usize) -> &[Vec2] {
        let [first, count] = self.state[b].vertices.map(|i| i as usize);
        &self.outline[first..first + count]
    }

    /// Radius of body `b` around its vertex `part` in m.
    #[inline]
    pub fn radius_at(&self, b: usize, part: u32) -> f64 {
        self.radii[(self.state[b].vertices[0] + part) as usize]
    }

    /// `p` (m) in the frame of body `b`.
    pub fn into_frame(&self, b: usize, p: Vec2) -> Vec2 {
        let state = &self.state[b];
        let (sin, cos) = state.angle.sin_cos();
        let d = p - state.center;
        Vec2::new(cos * d.x + sin * d.y, cos * d.y - sin * d.x)
    }

    /// Drift of the leapfrog: velocities and spins become `kicked`, those of `t_{n+1/2}`, and positions move with them
    /// to `t_{n+1}`. The rotation is exact.
    pub fn drift(&mut self, dt: f64, kicked: &[(Vec2, f64)], threads: &Threads) {
        let part = part(threads, self.len());
        let (mut outline, mut local) = (&mut self.outline[..], &self.local[..]);
        let states = self.state.chunks_mut(part);
        let frames = self.frames.chunks_mut(part).zip(kicked.chunks(part));
        let parts = states.zip(frames).map(|(state, (frames, kicked))| {
            let (first, last) = (state[0].vertices, state[state.len() - 1].vertices);
            let count = (last[0] + last[1] - first[0]) as usize;
            let (world, others) = std::mem::take(&mut outline).split_at_mut(count);
            let (local_here, local_others) = local.split_at(count);
            (outline, local) = (others, local_others);
            (state, frames, kicked, world, local_here)
        });
        threads.each(parts, |(state, frames, kicked, mut world, mut local)| {
            let four = state.chunks_mut(4).zip(frames.chunks_mut(4));
            for ((four, frames), kicked) in four.zip(kicked.chunks(4)) {
                let mut angles = [0.0; 4];
                let mut turns = false;
                for (angle, (state, kicked)) in angles.iter_mut().zip(four.iter().zip(kicked)) {
                    *angle = state.angle + kicked.1 * dt;
                    turns |= !state.is_disc() && !state.rests(*kicked);
                }
                // Discs need none, and `angles` would go through memory on its way into a vector.
                let turns = if turns { sines(angles) } else { [[0.0; 2]; 4] };
                for (k, (state, frame)) in four.iter_mut().zip(frames).enumerate() {
                    let (own, shape);
                    let count = state.vertices[1] as usize;
                    (own, world) = std::mem::take(&mut world).split_at_mut(count);
                    (shape, local) = local.split_at(count);
                    if state.rests(kicked[k]) {
                        // In the run that a branch begins with it may have moved.
                        frame.last = LastMove::default();
                        continue;
                    }
                    let (velocity, spin) = kicked[k];
                    (state.velocity, state.spin) = (velocity, spin);
                    frame.advance(velocity * dt, spin * dt);
                    state.center = frame.center;
                    state.angle += spin * dt;
                    state.place_turned(own, shape, || turns[k]);
                }
            }
        });
    }

    /// The saved state of the bodies.
    pub fn save(&self) -> Vec<(Pose, LastMove)> {
        let both = self.state.iter().zip(&self.frames);
        let pose = |body: &Rigid| (body.center, body.velocity, body.angle, body.spin);
        both.map(|(body, frame)| (pose(body), frame.last)).collect()
    }

    /// Takes the bodies to a saved state. In directions in which forces do not move a body, its velocity is that of the
    /// configuration, which may differ from that of the saved run.
    pub fn restore(&mut self, saved: &[(Pose, LastMove)]) {
        *self = self.placed(
            saved
                .iter()
                .map(|((center, _, angle, _), _)| (*center, *angle)),
        );
        let all = self.state.iter_mut().zip(&mut self.frames);
        let of_all = self.properties.iter().zip(all).zip(saved);
        for ((body, (state, frame)), ((_, velocity, _, spin), last)) in of_all {
            let [x, y, angle] = body.yielding.map(|yields| yields != 0.0);
            for (i, yields) in [x, y].into_iter().enumerate() {
                if yields {
                    state.velocity[i] = velocity[i];
                }
            }
            if angle {
                state.spin = *spin;
            }
            (frame.center, frame.last) = (state.center, *last);
        }
    }

    /// These bodies in other poses: centres in m, angles in rad. Their frames are not updated.
    #[must_use]
    pub fn placed(&self, poses: impl IntoIterator<Item = (Vec2, f64)>) -> Self {
        let mut placed = self.clone();
        for (state, (center, angle)) in placed.state.iter_mut().zip(poses) {
            (state.center, state.angle) = (center, angle);
            let [first, count] = state.vertices.map(|i| i as usize);
            let here = first..first + count;
            state.place_outline(&mut placed.outline[here.clone()], &placed.local[here]);
        }
        placed
    }

    /// The largest surface speed at present, in m/s.
    pub fn initial_speed(&self) -> f64 {
        let speeds = self
            .state
            .iter()
            .map(|s| s.surface_speed(s.velocity, s.spin));
        speeds.fold(0.0, f64::max)
    }
}

/// Checks the shape of one body, whose numbers have been checked ([`DemConfig::faults`]), and places it.
fn place(
    body: &BodyConfig,
    first_vertex: usize,
    surface: u32,
) -> Result<(Body, Rigid), (&'static str, String)> {
    let yielding = body.motion.yielding();
    let free = yielding != [0.0; 3];
    let shape = Shape::new(&body.shape, body.sphero_radius, free)?;
    let (mass, inertia) = shape.moments.mass(body.inertia);
    if !(inertia.is_finite() && inertia > 0.0) {
        let text =
            format!("the computed moment of inertia is {inertia} kg m; check sizes and density");
        return Err(("inertia", text));
    }
    let (sin, cos) = body.angle.sin_cos();
    let c = shape.moments.centroid;
    let center =
        Vec2::from(body.position) + Vec2::new(cos * c.x - sin * c.y, sin * c.x + cos * c.y);
    let state = Rigid {
        center,
        velocity: body.velocity.into(),
        angle: body.angle,
        spin: body.spin,
        inverse_mass: if yielding[0] + yielding[1] > 0.0 {
            1.0 / mass
        } else {
            0.0
        },
        inverse_inertia: yielding[2] / inertia,
        radius: shape.radius,
        extent: shape.extent,
        falls: if free { 1.0 } else { 0.0 },
        vertices: [first_vertex as u32, shape.vertices.len() as u32],
    };
    let what = Body {
        name: body.name.clone(),
        shape,
        mass,
        inertia,
        motion: body.motion,
        yielding,
        surface,
    };
    Ok((what, state))
}
