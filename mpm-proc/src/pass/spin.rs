//! The spin of a group, which its nodes get as a linear field.
//!
//! FLIP and PIC map `v_I = sum_p m_p S_Ip v_p / m_I`. For points that rotate with `w` about their centre of mass this
//! is the velocity at `x~_I = sum_p m_p S_Ip x_p / m_I`, the centre of mass of the points around the node, and not at
//! the node itself. The two differ where the points do not lie evenly around a node: at every boundary. So rigid
//! rotation causes strain at the boundary, at a rate proportional to the spin and for any step, and the kick has the
//! moment `sum_I (x~_I - x_I) x f_I`: spin becomes vibration (docs/energy.md).
//!
//! So the velocities are mapped without the spin, and the nodes get the spin at their own positions: `v_I = sum_p m_p
//! S_Ip (v_p + w x (x_I - x_p)) / m_I`, which has the form of eq. 30. Rigid motion is exact, momentum is conserved to
//! rounding (shape functions reproduce linear fields), and no vibration is filtered, as affine parts of single points
//! would do.

use crate::kernel::lanes::{ZERO, splat, sum};
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::points::Cloud;

/// Spin of a cloud in rad/s: angular momentum over moment of inertia about its centre of mass, of points without size;
/// 0 of a single point.
pub fn spin<const W: usize, S: Shape<W>, A: AffineState>(cloud: &Cloud<W, S, A>) -> f64 {
    let blocks = || {
        let tiles = cloud.tiles.iter();
        tiles.flat_map(|tile| (0..tile.blocks).map(move |b| (tile.first + b, tile.live(b))))
    };
    let mut mean = [[ZERO; 2]; 2];
    for (block, live) in blocks() {
        for a in 0..2 {
            mean[0][a] += live * cloud.state.x[block][a];
            mean[1][a] += live * cloud.state.motion[block].v[a];
        }
    }
    let n = cloud.len().max(1) as f64;
    let [center, velocity] = mean.map(|of| of.map(|total| splat(sum(total) / n)));
    let (mut angular, mut inertia) = (ZERO, ZERO);
    for (block, live) in blocks() {
        let (x, v) = (&cloud.state.x[block], &cloud.state.motion[block].v);
        let arm = [0, 1].map(|a| live * (x[a] - center[a]));
        angular += arm[0] * (v[1] - velocity[1]) - arm[1] * (v[0] - velocity[0]);
        inertia += arm[0] * arm[0] + arm[1] * arm[1];
    }
    let inertia = sum(inertia);
    if inertia > 0.0 {
        sum(angular) / inertia
    } else {
        0.0
    }
}
