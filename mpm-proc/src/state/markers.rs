//! Markers: massless positions on the boundary of a group, which move with the nodes (Singer 2022). Bodies are in
//! contact with the segments between them instead of points.
//!
//! A marker takes velocities from the nodes and distributes forces to them with the same weights,
//!
//! ```text
//! N_I = N*_I / sum N*,   N*_I = S_I min(1, m_I / (eta rho L^2))
//! ```
//!
//! An identified point has `S_Ip / m_I <= 1 / m_p` at every node. A marker without the floor `eta` would have no such
//! bound: its share of a nearly empty node would give the contact any frequency. The weights sum to one, so momentum is
//! exact. They shift the point of action from `x_b` to `x~ = sum N_I x_I`, and with it the angular momentum, which is
//! measured.
//!
//! A marker turns as its nodes do about `x~`, and gives them the couple of friction through the same numbers,
//!
//! ```text
//! w = sum g_I . v_I,   g_I = N_I (-(y_I - y~), x_I - x~) / J,   J = sum N_I |x_I - x~|^2
//! ```
//!
//! so that `sum g_I = 0` and `sum x_I x g_I = 1`. Unlike half the curl of `N_I` these vanish with the mass of a node. If
//! nearly all of the weight is on one node, nothing there can take a couple: `J` is at least `L^2/10`
//! ([`LEAST_SPREAD`]), and what is missing is measured with the shift.

use interface::message::wire::ImpInfo;
use serde::{Deserialize, Serialize};

use super::nodes::NodeAt;

/// Least `J` over `L^2`; of whole weights it is 1/4 to 1/2.
pub const LEAST_SPREAD: f64 = 0.1;

/// A chain of markers along the boundary of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Number of the cloud.
    pub cloud: u32,
    /// First of its markers.
    pub first: usize,
    /// How many they are.
    pub count: usize,
    /// Whether a segment goes from the last to the first.
    pub closed: bool,
    /// `eta rho L^2` in kg/m: a node with at least this mass has its whole weight.
    pub full: f64,
    /// `rho L^2` in kg/m, as sent to the bodies' side: the mass of a full cell, because a marker has none.
    pub mass: f64,
    /// Contact radius `r_b` in m.
    pub radius: f64,
}

/// A node that a marker reaches.
#[derive(Debug, Clone, Copy)]
pub struct Weight {
    /// Position of the node.
    pub at: NodeAt,
    /// The node that moves: the same, or the original if it is an image.
    pub of: NodeAt,
    /// `N_I`.
    pub share: f64,
    /// From the marker to the node in m.
    pub arm: [f64; 2],
}

/// All markers.
#[derive(Debug, Clone, Default)]
pub struct Markers {
    /// The chains, ordered by cloud.
    pub chains: Vec<Chain>,
    /// Identity of the first marker.
    pub first_id: u64,
    /// Number of the chain of each marker.
    pub chain_of: Vec<u32>,
    /// How they move.
    pub state: MarkersState,
    /// Nodes of each marker at the present positions, `W^2` each.
    pub weights: Vec<Weight>,
    /// `sum N_I x_I - x_b` of each marker in m.
    pub shift: Vec<[f64; 2]>,
    /// Torque in N that the weights add in the present step, for each chain.
    pub torque: Vec<f64>,
}

/// The state of markers, all of which is saved.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct MarkersState {
    /// Positions in m.
    pub x: Vec<[f64; 2]>,
    /// Velocities in m/s by which they have moved in the last step.
    pub v: Vec<[f64; 2]>,
    /// How far they have moved by a velocity that is still to be compared with the field of the strains, in m.
    pub unsettled: Vec<[f64; 2]>,
    /// Angular momentum in N s that the weights have added so far, for each chain.
    pub spun: Vec<f64>,
}

impl Markers {
    /// The markers of `chains`, which are ordered by cloud, at `x` (m) with velocities `v` (m/s).
    pub fn new(chains: Vec<Chain>, first_id: u64, x: Vec<[f64; 2]>, v: Vec<[f64; 2]>) -> Self {
        let numbered = (0..).zip(&chains);
        let chain_of = numbered.flat_map(|(c, chain)| core::iter::repeat_n(c, chain.count));
        Self {
            chain_of: chain_of.collect(),
            shift: vec![[0.0; 2]; x.len()],
            torque: vec![0.0; chains.len()],
            weights: Vec::new(),
            state: MarkersState {
                spun: vec![0.0; chains.len()],
                unsettled: vec![[0.0; 2]; x.len()],
                x,
                v,
            },
            chains,
            first_id,
        }
    }

    /// Position in m and velocity in m/s of a marker.
    pub fn motion(&self, marker: u32) -> [[f64; 2]; 2] {
        let marker = marker as usize;
        [self.state.x[marker], self.state.v[marker]]
    }

    /// The chain of a marker.
    pub fn chain(&self, marker: usize) -> &Chain {
        &self.chains[self.chain_of[marker] as usize]
    }

    /// The marker to which a segment goes from this one.
    pub fn next(&self, marker: usize) -> Option<usize> {
        let Chain {
            first,
            count,
            closed,
            ..
        } = *self.chain(marker);
        if marker + 1 < first + count {
            Some(marker + 1)
        } else {
            closed.then_some(first)
        }
    }

    /// The records of the markers `members`, ascending, for the bodies' side: with a segment wherever both its ends are there.
    pub fn infos(&self, members: &[usize]) -> impl Iterator<Item = ImpInfo> {
        members.iter().map(|&marker| {
            let chain = self.chain(marker);
            let next = self
                .next(marker)
                .and_then(|n| members.binary_search(&n).ok());
            ImpInfo {
                id: self.first_id + marker as u64,
                radius: chain.radius,
                mass: chain.mass,
                group: chain.cloud,
                next: next.map_or(0, |slot| slot as u32 + 1),
            }
        })
    }
}
