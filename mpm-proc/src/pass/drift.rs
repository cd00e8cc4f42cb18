//! The drift: points move with the field that strains them.
//!
//! A kick `a dt` changes the nodes at once, and points move with the nodes. But the points get the kick through the
//! shape functions and give it back to the nodes through them, so in the next step the nodes have only `P S a dt` of
//! it, with `P = M^-1 S^T m`. So in every step a point moves by `S (1 - P S) a dt^2` more than the grid will have
//! moved, and than USF, MUSL and USAVG strain it, whose velocities have been mapped. If positions kept this, they would be
//! of first order in the step, and a solid that is bent far would tear: places and strains of its points part.
//!
//! So MUSL and USAVG, which map the velocities after the kick anyway, move all points with them. USF moves a point with
//! the nodes, and by what is missing in the next step, when the field is known ([`crate::state::settling`]). The sum of all
//! corrections times the masses is zero, since both velocities carry the momentum of the points.
//!
//! For contact this is a step too late. Its overlap depends on the position of a point now, and in a stiff contact the kick
//! that the next step takes back moves a point by as much as its overlap: the loaded points, and those beside them that
//! will be loaded next. What they are taken back by under load is work that no balance has (`docs/energy.md`). So with USF
//! the nodes that such points see, those on which bodies press and those within the reach of a point of them, move points
//! with the mapped velocities at once. This needs one more mapping, only of the points that reach these nodes.

use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::grid::Grid;
use crate::state::nodes::{ALL_NODES, NodeAt};

/// The velocity of the nodes with which loaded points move.
#[derive(Debug, Clone, Copy)]
pub struct FieldOfMotion {
    kicked: bool,
    mapped: bool,
}

impl FieldOfMotion {
    /// Of this step, once it is known which points are loaded.
    pub fn of<const W: usize, S: Shape<W>, A: AffineState>(c: &Continuum<W, S, A>) -> Self {
        Self {
            kicked: c.moves_by_kicked(),
            mapped: c.maps_near_loads(),
        }
    }

    /// At a node, in m/s.
    pub fn at(self, grid: &Grid, at: NodeAt) -> [f64; 2] {
        let (tile, node) = at.split();
        if !self.kicked {
            grid.tiles[tile].before[node]
        } else if self.mapped && grid.mapped[tile].moves != 0 {
            grid.mapped[tile].velocity[node]
        } else {
            grid.tiles[tile].after[node]
        }
    }
}

/// Finds the nodes near loads, and the points that see them.
pub fn find_near_loads<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    // A spin belongs to all points at one time, a support to all points that it holds, and a node at a periodic wall is near
    // loads at the other end too.
    let spins = continuum.clouds.iter().any(|cloud| cloud.spin.is_some());
    let closed = continuum.grid.geometry.periodic.contains(&true);
    let everywhere = spins || closed || !continuum.holds.is_empty();
    let (clouds, grid) = (&mut continuum.clouds, &mut continuum.grid);
    if grid.mapped.is_empty() {
        grid.make_room_for_mapped();
    }
    for (mapped, contact) in grid.mapped.iter_mut().zip(&grid.contact) {
        mapped.wanted = if everywhere {
            ALL_NODES
        } else {
            contact.reached
        };
        mapped.moves = mapped.wanted;
    }
    for tile in clouds.iter_mut().flat_map(|cloud| &mut cloud.tiles) {
        tile.near_load = everywhere;
    }
    if everywhere {
        return;
    }
    grid.widen_wanted(W - 1);
    grid.points_behind::<W>(|cloud, tile| clouds[cloud].tiles[tile].near_load = true);
}
