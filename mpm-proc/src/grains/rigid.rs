//! Points that move as one rigid body: the rigid body of material points of Liu, Sun and Zhou (2018), which Jiang 2020
//! section 5.4 compares with.
//!
//! Its nodes have been kicked, held by walls and pushed by other grains; the body receives the momentum and angular
//! momentum that they have gained. Mass and moment of inertia are those of its points, so that its energy is the sum of
//! theirs.

use interface::message::wire::Limits;
use interface::solver::Fault;
use interface::step::Step;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::kernel::lanes::{LANES, Lanes, ZERO, splat};
use crate::kernel::shape::Shape;
use crate::kernel::tiles::Geometry;
use crate::kernel::tiles::{NODES, first_node, node};
use crate::kernel::transfer::AffineState;
use crate::pass::check_points::check_points;
use crate::pass::leaving::remove_left;
use crate::pass::limits::limits;
use crate::pass::measure::{close_ledger, count_damping_of_points, update_ledger};
use crate::state::contact::ContactLoad;
use crate::state::continuum::Continuum;
use crate::state::nodes::NodeTile;
use crate::state::points::{Cloud, NO_POINT, TileReport};

/// The motion of a rigid body of points.
#[derive(Debug, Clone)]
pub struct RigidMotion {
    mass: f64,
    /// Moment of inertia about the centre in kg m.
    inertia: f64,
    /// Where it is and how it moves.
    pub state: MotionState,
    /// Points at the start, from the centre, in m, by identity.
    arms: Vec<[f64; 2]>,
    /// Momentum and angular momentum that other grains have given it in this step, in N s/m and N s.
    given: Vector3<f64>,
}

/// The state of a rigid body's motion, all of which is saved.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct MotionState {
    /// Centre of mass at `t_n` in m.
    centre: [f64; 2],
    /// Its velocity at `t_{n-1/2}` in m/s.
    velocity: [f64; 2],
    /// Angular velocity at `t_{n-1/2}` in rad/s.
    spin: f64,
    /// Angle turned by since the start, in rad.
    angle: f64,
}

impl RigidMotion {
    /// The motion of a cloud whose points all have the same velocity.
    pub fn of<const W: usize, S: Shape<W>, A: AffineState>(cloud: &Cloud<W, S, A>) -> Self {
        let lanes = cloud.lane_of.iter().map(|&l| l as usize);
        let count = cloud.len() as f64;
        let (mut centre, mut velocity) = ([0.0; 2], [0.0; 2]);
        for lane in lanes.clone() {
            for a in 0..2 {
                centre[a] += cloud.position(lane)[a] / count;
                velocity[a] += cloud.velocity(lane)[a] / count;
            }
        }
        let arms: Vec<[f64; 2]> = lanes
            .map(|lane| [0, 1].map(|a| cloud.position(lane)[a] - centre[a]))
            .collect();
        Self {
            mass: cloud.total_mass(),
            inertia: arms
                .iter()
                .map(|r| cloud.mass * (r[0] * r[0] + r[1] * r[1]))
                .sum(),
            state: MotionState {
                centre,
                velocity,
                spin: 0.0,
                angle: 0.0,
            },
            arms,
            given: Vector3::zeros(),
        }
    }

    /// Centre of mass in m.
    pub fn centre(&self) -> [f64; 2] {
        self.state.centre
    }

    /// Mass twice, in kg/m, and moment of inertia in kg m.
    pub fn masses(&self) -> Vector3<f64> {
        Vector3::new(self.mass, self.mass, self.inertia)
    }

    /// Velocity of the centre in m/s and of rotation in rad/s, including what its nodes have gained in the kick.
    pub fn velocities_at_nodes(&self, nodes: &[NodeTile], geometry: &Geometry) -> Vector3<f64> {
        let before = Vector3::new(
            self.state.velocity[0],
            self.state.velocity[1],
            self.state.spin,
        );
        before + gained(nodes, geometry, self.state.centre).component_div(&self.masses())
    }

    /// Adds momentum and angular momentum from other grains, in N s/m and N s.
    pub fn take_up(&mut self, given: Vector3<f64>) {
        self.given += given;
    }
}

/// The second half of a step of a rigid body: takes up what its nodes have gained, and moves its points.
///
/// # Errors
/// A [`Fault`] that names the point which left the domain or is not finite.
pub fn move_rigidly<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    step: &Step,
    motion: &mut RigidMotion,
) -> Result<Limits, Fault> {
    update_ledger(continuum, step);
    if step.dt_before + step.dt > 0.0 {
        count_damping_of_points(continuum);
        let kicked = motion.velocities_at_nodes(&continuum.grid.tiles, &continuum.grid.geometry);
        let given = core::mem::take(&mut motion.given).component_div(&motion.masses());
        let [vx, vy, spin] = (kicked + given).into();
        motion.state.velocity = [vx, vy];
        motion.state.spin = spin;
        for a in 0..2 {
            motion.state.centre[a] += step.dt * motion.state.velocity[a];
        }
        motion.state.angle += step.dt * motion.state.spin;
        let cell = continuum.grid.geometry.cell;
        for cloud in &mut continuum.clouds {
            place(cloud, motion, cell);
        }
        check_points(continuum, step.dt)?;
    }
    close_ledger(continuum, step);
    let limits = limits(continuum, ContactLoad::default());
    remove_left(continuum);
    Ok(limits)
}

/// Momentum (N s/m) and angular momentum about `centre` (N s) that nodes have gained in the kick.
fn gained(nodes: &[NodeTile], geometry: &Geometry, centre: [f64; 2]) -> Vector3<f64> {
    let mut gained = Vector3::zeros();
    for tile in nodes {
        let origin = first_node(tile.at);
        for i in 0..NODES {
            let gain = [0, 1].map(|a| tile.mass[i] * (tile.after[i][a] - tile.before[i][a]));
            let at = node(origin, i);
            let arm = [0, 1].map(|a| geometry.lower[a] + at[a] as f64 * geometry.cell - centre[a]);
            gained += Vector3::new(gain[0], gain[1], arm[0] * gain[1] - arm[1] * gain[0]);
        }
    }
    gained
}

/// Moves the points of a cloud to the place of the body, with its velocities.
fn place<const W: usize, S: Shape<W>, A: AffineState>(
    cloud: &mut Cloud<W, S, A>,
    motion: &RigidMotion,
    cell: f64,
) {
    let (sin, cos) = motion.state.angle.sin_cos();
    let turn = splat(motion.state.spin * cell);
    let slopes = [[ZERO, turn], [ZERO - turn, ZERO]];
    for (tile, report) in cloud.tiles.iter().zip(&mut cloud.reports) {
        *report = TileReport {
            lower: [f64::INFINITY; 2],
            upper: [f64::NEG_INFINITY; 2],
            ..TileReport::default()
        };
        for block in tile.first..tile.first + tile.blocks {
            let (x, points) = (&mut cloud.state.x[block], &mut cloud.state.motion[block]);
            for k in 0..LANES {
                // A lane without a point follows the first of its tile.
                let id = match cloud.state.ids[block][k] {
                    NO_POINT => cloud.state.ids[tile.first][0],
                    id => id,
                };
                let r = motion.arms[id as usize];
                let arm = [cos * r[0] - sin * r[1], sin * r[0] + cos * r[1]];
                let v = [
                    motion.state.velocity[0] - motion.state.spin * arm[1],
                    motion.state.velocity[1] + motion.state.spin * arm[0],
                ];
                let set = |lanes: &mut Lanes, value: f64| lanes.as_mut_array()[k] = value;
                for a in 0..2 {
                    let to = motion.state.centre[a] + arm[a];
                    set(&mut x[a], to);
                    set(&mut points.v[a], v[a]);
                    report.lower[a] = report.lower[a].min(to);
                    report.upper[a] = report.upper[a].max(to);
                }
                let square = v[0] * v[0] + v[1] * v[1];
                report.speed_sq = report.speed_sq.max(square);
                report.sum += square;
            }
            points.affine = A::from_slopes(slopes);
        }
    }
}
