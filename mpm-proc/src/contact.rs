//! Contact forces of bodies on the nodes (Jiang 2020 eq. 47), and what they cost of the step.

use interface::config::ContactForceScheme;
use interface::solver::Fault;
use interface::wire::ImpForce;

use crate::continuum::Continuum;
use crate::grid::owner;
use crate::lanes::splat;
use crate::points::{LaneCopy, Tile};
use crate::shape::Shape;
use crate::tiles::pitch;
use crate::transfer::Transfer;

/// A node that a loaded point touches.
#[derive(Debug, Clone, Copy)]
pub struct Touch {
    tile: u32,
    node: u32,
    /// `S_Ip`.
    weight: f64,
}

/// What contact adds to the largest squared frequency.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactLoad {
    /// Bound of `lambda_max(S k S^T M^-1)` in 1/s^2.
    pub omega_sq: f64,
    /// Largest stiffness on a point in N/m.
    pub stiffness: f64,
}

impl<const W: usize, S: Shape<W>, T: Transfer> Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    /// Adds `f_I^cont = sum_p f_p S_Ip` to the nodes.
    ///
    /// The scheme of the scene decides which nodes take the force of a point, `T_Ip` in place of `S_Ip`. The frequency is
    /// Gershgorin's bound, `max_p sum_I S_Ip s_I / m_I` with `s_I = sum_q k_q T_Iq` over the points
    /// with stiffness (PHYSICS.md section 4).
    pub fn apply_contact(&mut self, forces: &[ImpForce]) -> Result<ContactLoad, Fault> {
        self.clear_contact();
        self.imps.forces.clear();
        self.imps.forces.extend_from_slice(forces);
        if forces.is_empty() {
            return Ok(ContactLoad::default());
        }
        if forces.len() != self.imps.members.len() {
            return Err(Fault::Other(format!(
                "{} contact forces came for {} identified material points",
                forces.len(),
                self.imps.members.len()
            )));
        }
        for slot in 0..forces.len() {
            self.touch(slot)?;
        }
        let mut load = ContactLoad::default();
        for (slot, asks) in self.asks.chunks_exact(W * W).enumerate() {
            let stiffness = self.loaded[slot];
            if stiffness > 0.0 {
                let sum: f64 = asks
                    .iter()
                    .map(|t| {
                        let mass = self.grid.tiles[t.tile as usize].mass[t.node as usize];
                        let shared = self.grid.contact[t.tile as usize].stiffness[t.node as usize];
                        // A weight so small that the mass underflowed carries nothing.
                        if mass > 0.0 {
                            t.weight * shared / mass
                        } else {
                            0.0
                        }
                    })
                    .sum();
                load.omega_sq = load.omega_sq.max(sum);
                load.stiffness = load.stiffness.max(stiffness);
            }
        }
        Ok(load)
    }

    /// Spreads the force on one slot, if there is any, or a body near enough to press.
    fn touch(&mut self, slot: usize) -> Result<(), Fault> {
        let ImpForce { force, stiffness } = self.imps.forces[slot];
        if force == [0.0; 2] && stiffness == 0.0 {
            return Ok(());
        }
        let member = self.imps.members[slot];
        let cloud = &self.clouds[member.cloud as usize];
        if !(force[0].is_finite() && force[1].is_finite() && stiffness.is_finite()) {
            return Err(Fault::NotFinite {
                what: "contact force".into(),
                item: format!("point {}", cloud.first_id + u64::from(member.local)),
            });
        }
        let lane = cloud.lane_of[member.local as usize] as usize;
        let tile = cloud.tile_of_lane(lane);
        let at = |x: [f64; 2]| Spot::<W>::new(&cloud.shape, tile, x);
        let x = cloud.position(lane);
        let here = at(x);
        here.nodes(&mut self.asks);
        let first = self.touches.len();
        match self.contact_scheme {
            ContactForceScheme::Point => here.nodes(&mut self.touches),
            ContactForceScheme::NearestNodes => here.corners(&mut self.touches),
            ContactForceScheme::Traction => {
                // The mean of S over the box by Gauss points, two along each axis.
                let reach = cloud.sides.map(|s| 0.5 * s / 3.0_f64.sqrt());
                for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                    let from = self.touches.len();
                    at([x[0] + sx * reach[0], x[1] + sy * reach[1]]).nodes(&mut self.touches);
                    for touch in &mut self.touches[from..] {
                        touch.weight *= 0.25;
                    }
                }
            }
        }
        for touch in &self.touches[first..] {
            let nodes = &mut self.grid.contact[touch.tile as usize];
            let node = touch.node as usize;
            for a in 0..2 {
                nodes.force[node][a] += touch.weight * force[a];
            }
            nodes.stiffness[node] += touch.weight * stiffness;
        }
        self.loaded.push(stiffness);
        Ok(())
    }

    /// Forgets the forces of the step before. Sorting has already forgotten those of nodes that are no more.
    fn clear_contact(&mut self) {
        for t in self.touches.drain(..) {
            if let Some(nodes) = self.grid.contact.get_mut(t.tile as usize) {
                nodes.force[t.node as usize] = [0.0; 2];
                nodes.stiffness[t.node as usize] = 0.0;
            }
        }
        self.loaded.clear();
        self.asks.clear();
    }
}

/// A place in the window of a tile.
struct Spot<'a, const W: usize> {
    tile: &'a Tile,
    base: usize,
    d: [f64; 2],
    s: [[f64; W]; 2],
}

impl<'a, const W: usize> Spot<'a, W> {
    fn new<S: Shape<W>>(shape: &S, tile: &'a Tile, x: [f64; 2]) -> Self {
        let place = tile.frame.locate(&x.map(splat), pitch(W));
        Self {
            tile,
            base: place.base[0],
            d: place.d.map(|d| d.as_array()[0]),
            s: [0, 1].map(|a| shape.weights(a, place.d[a]).map(|w| w.as_array()[0])),
        }
    }

    fn touch(&self, i: usize, j: usize, weight: f64) -> Touch {
        let (tile, node) = owner::<W>(self.tile, self.base + j * pitch(W) + i);
        Touch {
            tile: tile as u32,
            node: node as u32,
            weight,
        }
    }

    /// The nodes that the shape function touches.
    fn nodes(&self, touches: &mut Vec<Touch>) {
        for j in 0..W {
            for i in 0..W {
                touches.push(self.touch(i, j, self.s[0][i] * self.s[1][j]));
            }
        }
    }

    /// The nodes of the cell that the place is in, by linear weights.
    fn corners(&self, touches: &mut Vec<Touch>) {
        let first = self.d.map(|d| d.floor().clamp(0.0, (W - 2) as f64));
        let along = [self.d[0] - first[0], self.d[1] - first[1]];
        for (j, wy) in [1.0 - along[1], along[1]].into_iter().enumerate() {
            for (i, wx) in [1.0 - along[0], along[0]].into_iter().enumerate() {
                touches.push(self.touch(first[0] as usize + i, first[1] as usize + j, wx * wy));
            }
        }
    }
}
