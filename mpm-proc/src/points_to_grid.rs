//! Points to grid: mass and momentum (Jiang 2020 eqs. 18, 19, 30).

use crate::lanes::{LANES, Lanes, ZERO, splat};
use crate::points::{Cloud, LaneCopy, Motion};
use crate::shape::Shape;
use crate::threads::{PerTile, over_tiles};
use crate::tiles::{Place, pitch};
use crate::transfer::AffineState;

/// Sums mass and momentum of a cloud's points into the windows of their tiles.
pub fn points_to_grid<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
    grain: usize,
    cloud: &mut Cloud<W, S, A>,
) {
    let (shape, x, motion, mass) = (cloud.shape, &cloud.x, &cloud.motion, cloud.mass);
    let share = PerTile {
        items: &mut cloud.mass_momentum[..],
        stride: pitch(W) * pitch(W),
    };
    over_tiles(grain, &cloud.tiles, share, &|tile, window| {
        window.items.fill(ZERO);
        for b in 0..tile.blocks {
            let block = tile.first + b;
            let place = tile.frame.locate(&x[block], pitch(W));
            let s = [0, 1].map(|a| shape.weights(a, place.d[a]));
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
    nodes: &mut [Lanes],
    place: &Place,
    s: &[[Lanes; W]; 2],
    motion: &Motion<A>,
    mass: Lanes,
) {
    // (m, p_x, p_y, 0) of each point at its base node, and how it changes by one node along x and along y.
    let slopes = motion.affine.slopes().map(|c| c.map(|c| c * mass));
    let at_base = [0, 1].map(|a| {
        let p = motion.v[a] * mass;
        if A::PRESENT {
            p - slopes[0][a] * place.d[0] - slopes[1][a] * place.d[1]
        } else {
            p
        }
    });
    let at_base = Lanes::transpose([mass, at_base[0], at_base[1], ZERO]);
    let along = [0, 1].map(|axis| {
        if A::PRESENT {
            Lanes::transpose([ZERO, slopes[axis][0], slopes[axis][1], ZERO])
        } else {
            [ZERO; LANES]
        }
    });
    let s = s.map(|nodes| nodes.map(|w| w.to_array()));
    for k in 0..LANES {
        let mut row_value = at_base[k];
        for j in 0..W {
            let weight = splat(s[1][j][k]);
            let mut value = row_value * weight;
            let step = along[0][k] * weight;
            let first = place.base[k] + j * pitch(W);
            let row: &mut [Lanes; W] = (&mut nodes[first..first + W])
                .try_into()
                .expect("a slice of W nodes");
            for (i, node) in row.iter_mut().enumerate() {
                *node = splat(s[0][i][k]).mul_add(value, *node);
                if A::PRESENT {
                    value += step;
                }
            }
            if A::PRESENT {
                row_value += along[1][k];
            }
        }
    }
}
