//! Contact of deformable grains with rigid ones (the MPM-DEM scheme that Jiang 2020 section 5.4 compares with).
//!
//! A rigid grain takes up impulses with its whole mass. If each node used only its own part of that mass against the
//! other grain, the node would yield in every step like a dashpot of `m_I / dt`, and the force of an impact would be
//! too small by a share that no refinement removes.
//!
//! So all nodes where deformable grains press on one rigid grain are solved at once: after contact none of them
//! approaches it. With `u` the three velocities of the rigid grain (two of its centre, and its rotation), `U` their
//! change, `G` its masses, `J_I` the row that gives the velocity of its material at node I along the normal `n`,
//!
//! ```text
//! (G + sum_I m_I J_I^T J_I) U = sum_I m_I J_I^T (v_I . n - J_I u),     v_I' . n = J_I (u + U)
//! ```
//!
//! where `I` runs over the nodes of deformable grains that approach. Nodes where the result would be tension are
//! dropped, and the system is solved again. Friction then reduces each node's velocity along the surface up to the
//! limit of its normal impulse, but not beyond sticking, which is the same system along the surface. Impulses are equal
//! and opposite, so that momentum and angular momentum are conserved.

use nalgebra::{Matrix3, Vector3};

use super::contact::{SharedNodes, way_out};
use super::rigid::RigidMotion;
use crate::kernel::tiles::Geometry;
use crate::kernel::tiles::{NODES, first_node, node};
use crate::state::nodes::NodeTile;

/// A node of a deformable grain at which a rigid grain has mass.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    grain: usize,
    tile: usize,
    node: usize,
    mass: f64,
    velocity: [f64; 2],
    normal: [f64; 2],
    /// From the rigid grain's centre to the node in m.
    arm: [f64; 2],
    /// Velocity along the normal that has been removed, in m/s.
    pressed: f64,
}

impl Meeting {
    /// `J_I` along `n`.
    fn row(&self, n: [f64; 2]) -> Vector3<f64> {
        Vector3::new(n[0], n[1], self.arm[0] * n[1] - self.arm[1] * n[0])
    }

    fn along(&self) -> [f64; 2] {
        [-self.normal[1], self.normal[0]]
    }

    /// Speed along `n` against a rigid grain of velocities `u`.
    fn against(&self, n: [f64; 2], u: &Vector3<f64>) -> f64 {
        self.velocity[0] * n[0] + self.velocity[1] * n[1] - self.row(n).dot(u)
    }

    /// Removes `speed` along `n` from the node; returns what the rigid grain gains, in N s/m and N s.
    fn take(&mut self, n: [f64; 2], speed: f64) -> Vector3<f64> {
        for a in 0..2 {
            self.velocity[a] -= speed * n[a];
        }
        self.mass * speed * self.row(n)
    }
}

impl SharedNodes {
    /// Contact of deformable grains with the rigid grain `number`, which moves as `motion`; returns the energy in J/m
    /// that friction dissipates.
    pub fn press_on(
        &self,
        number: usize,
        motion: &mut RigidMotion,
        nodes: &mut [&mut [NodeTile]],
        rigid: &[bool],
        geometry: &Geometry,
        friction: f64,
    ) -> f64 {
        let u = motion.velocities_at_nodes(nodes[number], geometry);
        let mut meetings = self.meetings(number, motion.centre(), nodes, rigid, geometry);
        meetings.retain(|m| m.against(m.normal, &u) > 0.0);
        let masses = motion.masses();
        let Some(after) = solve(&mut meetings, &masses, u) else {
            return 0.0;
        };
        let mut gained = Vector3::zeros();
        for m in &mut meetings {
            m.pressed = m.against(m.normal, &after);
            gained += m.take(m.normal, m.pressed);
        }
        let after = u + gained.component_div(&masses);
        let mut work = 0.0;
        if friction > 0.0 {
            let system = system(&meetings, &masses, &|m| m.along());
            let sought = right_side(&meetings, &|m| m.along(), &after);
            let stuck = system
                .lu()
                .solve(&sought)
                .map_or(after, |change| after + change);
            let before = kinetic(&meetings, &masses, &after);
            let mut along = Vector3::zeros();
            for m in &mut meetings {
                let most = friction * m.pressed.max(0.0);
                let held = m.against(m.along(), &stuck).clamp(-most, most);
                along += m.take(m.along(), held);
            }
            work = before - kinetic(&meetings, &masses, &(after + along.component_div(&masses)));
            gained += along;
        }
        motion.take_up(gained);
        for m in meetings {
            nodes[m.grain][m.tile].after[m.node] = m.velocity;
        }
        work
    }

    /// The nodes of deformable grains at which the rigid grain has mass.
    fn meetings(
        &self,
        number: usize,
        centre: [f64; 2],
        nodes: &[&mut [NodeTile]],
        rigid: &[bool],
        geometry: &Geometry,
    ) -> Vec<Meeting> {
        let mut meetings = Vec::new();
        for together in self.places() {
            let Some(own) = together.iter().find(|s| s.grain as usize == number) else {
                continue;
            };
            for soft in together.iter().filter(|s| !rigid[s.grain as usize]) {
                let body = &nodes[number][own.tile as usize];
                let tile = &nodes[soft.grain as usize][soft.tile as usize];
                let origin = first_node(tile.at);
                for i in 0..NODES {
                    if body.per_mass[i] == 0.0 || tile.per_mass[i] == 0.0 {
                        continue;
                    }
                    let Some(normal) = way_out(soft.gradient[i], own.gradient[i]) else {
                        continue;
                    };
                    let at = node(origin, i);
                    meetings.push(Meeting {
                        grain: soft.grain as usize,
                        tile: soft.tile as usize,
                        node: i,
                        mass: tile.mass[i],
                        velocity: tile.after[i],
                        normal,
                        arm: [0, 1]
                            .map(|a| geometry.lower[a] + at[a] as f64 * geometry.cell - centre[a]),
                        pressed: 0.0,
                    });
                }
            }
        }
        meetings
    }
}

/// The velocities of the rigid grain after which no node approaches it. Nodes that would be pulled are removed from
/// `meetings`. `None` if no node approaches.
fn solve(
    meetings: &mut Vec<Meeting>,
    masses: &Vector3<f64>,
    u: Vector3<f64>,
) -> Option<Vector3<f64>> {
    while !meetings.is_empty() {
        let system = system(meetings, masses, &|m| m.normal);
        let change = system
            .lu()
            .solve(&right_side(meetings, &|m| m.normal, &u))?;
        let after = u + change;
        let count = meetings.len();
        meetings.retain(|m| m.against(m.normal, &after) >= 0.0);
        if meetings.len() == count {
            return Some(after);
        }
    }
    None
}

/// `G + sum m J^T J`.
fn system(
    meetings: &[Meeting],
    masses: &Vector3<f64>,
    way: &dyn Fn(&Meeting) -> [f64; 2],
) -> Matrix3<f64> {
    meetings
        .iter()
        .fold(Matrix3::from_diagonal(masses), |sum, m| {
            let row = m.row(way(m));
            sum + m.mass * row * row.transpose()
        })
}

/// `sum m J^T (v . n - J u)`.
fn right_side(
    meetings: &[Meeting],
    way: &dyn Fn(&Meeting) -> [f64; 2],
    u: &Vector3<f64>,
) -> Vector3<f64> {
    meetings.iter().fold(Vector3::zeros(), |sum, m| {
        sum + m.mass * m.against(way(m), u) * m.row(way(m))
    })
}

/// Kinetic energy of the nodes and the rigid grain in J/m.
fn kinetic(meetings: &[Meeting], masses: &Vector3<f64>, u: &Vector3<f64>) -> f64 {
    let nodes: f64 = meetings
        .iter()
        .map(|m| m.mass * (m.velocity[0] * m.velocity[0] + m.velocity[1] * m.velocity[1]))
        .sum();
    0.5 * (nodes + masses.dot(&u.component_mul(u)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meeting(mass: f64, velocity: [f64; 2], arm: [f64; 2]) -> Meeting {
        Meeting {
            grain: 0,
            tile: 0,
            node: 0,
            mass,
            velocity,
            normal: [1.0, 0.0],
            arm,
            pressed: 0.0,
        }
    }

    /// Two nodes in line with the centre: a plastic collision of three masses.
    #[test]
    fn a_central_push_is_a_plastic_collision() {
        let mut meetings = vec![
            meeting(1.0, [3.0, 0.0], [-1.0, 0.0]),
            meeting(2.0, [6.0, 0.0], [-2.0, 0.0]),
        ];
        let masses = Vector3::new(5.0, 5.0, 4.0);
        let after = solve(&mut meetings, &masses, Vector3::new(1.0, 0.0, 0.0)).unwrap();
        // The first would be overtaken by the common speed of 2.5 only if it were slower than that.
        assert!(
            (after - Vector3::new(2.5, 0.0, 0.0)).norm() < 1e-14,
            "{after}"
        );
        assert_eq!(meetings.len(), 2);
    }

    /// A slow node is not pulled along by a rigid grain that a fast node pushes away.
    #[test]
    fn no_node_is_under_tension() {
        let mut meetings = vec![
            meeting(1.0, [1.1, 0.0], [-1.0, 0.0]),
            meeting(4.0, [6.0, 0.0], [-2.0, 0.0]),
        ];
        let masses = Vector3::new(1.0, 1.0, 1.0);
        let after = solve(&mut meetings, &masses, Vector3::new(1.0, 0.0, 0.0)).unwrap();
        assert_eq!(meetings.len(), 1);
        assert!((after[0] - 5.0).abs() < 1e-14);
    }

    /// `J = v / (1/m + 1/M + r^2/I)` for a perfectly plastic hit off the centre.
    #[test]
    fn off_centre_the_effective_mass_is_that_of_the_textbook() {
        let (m, big, inertia, r) = (0.7, 3.0, 0.4, 0.5);
        let mut meetings = vec![meeting(m, [2.0, 0.0], [-1.0, r])];
        let masses = Vector3::new(big, big, inertia);
        let after = solve(&mut meetings, &masses, Vector3::zeros()).unwrap();
        let impulse = 2.0 / (1.0 / m + 1.0 / big + r * r / inertia);
        assert!((after[0] - impulse / big).abs() < 1e-14);
        assert!((after[2] + r * impulse / inertia).abs() < 1e-14);
    }
}
