//! Points to grid: mass and momentum (Jiang 2020 eqs. 18, 19, 30).

use crate::lanes::{LANES, Lanes, ZERO, splat};
use crate::points::{Cloud, LaneCopy, Motion};
use crate::shape::Shape;
use crate::threads::{PerTile, over_tiles};
use crate::tiles::{Place, pitch};
use crate::transfer::AffineState;
use crate::window::{add, nodal_stride};

/// Sums mass and momentum of a cloud's points into the windows of their tiles.
pub fn points_to_grid<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
    grain: usize,
    cloud: &mut Cloud<W, S, A>,
) {
    let (shape, x, motion, mass) = (cloud.shape, &cloud.x, &cloud.motion, cloud.mass);
    let share = PerTile {
        items: &mut cloud.mass_momentum[..],
        stride: nodal_stride(W),
    };
    over_tiles(grain, &cloud.tiles, share, &|tile, window| {
        window.items.fill(0.0);
        for b in 0..tile.blocks {
            let block = tile.first + b;
            let place = tile.frame.locate(&x[block], pitch(W));
            let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
            add_momentum(
                window.items,
                &place,
                &s,
                &motion[block],
                splat(mass) * tile.live(b),
            );
        }
    });
}

/// `m_I += m_p S_Ip`, `p_I += m_p S_Ip (v_p + B_p D_p^-1 (x_I - x_p))` for four points.
#[inline(always)]
fn add_momentum<const W: usize, A: AffineState>(
    nodes: &mut [f64],
    place: &Place,
    s: &[[Lanes; W]; 2],
    motion: &Motion<A>,
    mass: Lanes,
) {
    // Velocity of each point's affine field at the first node of a row, and its change by one node along x and y.
    let [along, across] = motion.affine.slopes();
    let mut first = motion.v;
    if A::PRESENT {
        for a in 0..2 {
            first[a] -= along[a] * place.d[0] + across[a] * place.d[1];
        }
    }
    for j in 0..W {
        let row_mass = s[1][j] * mass;
        let mut v = first;
        for i in 0..W {
            let m = s[0][i] * row_mass;
            let by_point = Lanes::transpose([m, m * v[0], m * v[1], ZERO]);
            for k in 0..LANES {
                add(nodes, 4 * (place.base[k] + j * pitch(W) + i), by_point[k]);
            }
            if A::PRESENT {
                v = [v[0] + along[0], v[1] + along[1]];
            }
        }
        if A::PRESENT {
            first = [first[0] + across[0], first[1] + across[1]];
        }
    }
}
