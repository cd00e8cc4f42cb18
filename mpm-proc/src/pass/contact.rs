//! Contact forces of bodies on the nodes (Jiang 2020 eq. 47), and their contribution to the step limit.

use interface::message::wire::ImpForce;
use interface::solver::Fault;

use super::drift::FieldOfMotion;
use super::markers::touch_marker;
use crate::kernel::lanes::LANES;
use crate::kernel::point_tile::owner;
use crate::kernel::shape::Shape;
use crate::kernel::tiles::pitch;
use crate::kernel::transfer::AffineState;
use crate::state::contact::{ContactLoad, Loaded, Touch};
use crate::state::continuum::Continuum;
use crate::state::grid::Grid;
use crate::state::nodes::NodeAt;

/// Adds `f_I^cont = sum_p f_p T_Ip + c_p g_Ip` to the nodes, with the couple `c_p` of friction on the surface of a point and
/// `g_I = (-dS_I/dy, dS_I/dx)/2`: weights sum to one and reproduce `x`, so `sum g_I = 0` and `sum x_I x g_I = 1`. Its work is
/// that on the spin `w = sum g_I . v_I` of the field (docs/energy.md).
///
/// The frequency where `T = S` and there is no friction is Gershgorin's bound, `G(S) = max_p sum_I S_Ip s_I / m_I` with
/// `s_I = sum_q k_q S_Iq` over the points with stiffness (docs/physics.md section 4).
///
/// With friction a point has the rows `S_I N` with `k_n` and `S_I T + r g_I` with `k_t`, `r` the radius of its surface. The norm
/// of the block of two nodes in the sum of their products is at most
/// `(k - k_t) S_I S_J + k_t A_I A_J`, `A_I = S_I + r |g_I|`, `k` the larger of both stiffnesses: positive rows `S` and `A`.
/// Of these Gershgorin's bound, weighted by 1 and by `a = sum A_I`, is
///
/// ```text
/// G = max_p max( sum_I S_Ip s_I / m_I, sum_I A_Ip s_I / (a_p m_I) ),   s_I = sum_q (k - k_t)_q S_Iq + k_tq a_q A_Iq
/// ```
///
/// Where `T` is not `S` contact adds `M^-1 T K S^T` to the operator of the grid's motion, which is not symmetric, so that
/// bounding its own eigenvalues would not bound those of its sum with elasticity. Its norm in the inner product of
/// the masses does, since norms add:
///
/// ```text
/// |M^-1/2 T K S^T M^-1/2| <= |M^-1/2 T K^1/2| |K^1/2 S^T M^-1/2| = sqrt(lambda_max(T) lambda_max(S))
/// lambda_max(X) = lambda_max(K^1/2 X^T M^-1 X K^1/2) = lambda_max(X^T M^-1 X K) <= G(X)
/// ```
///
/// (the last step: all entries of `X^T M^-1 X K` are 0 or more, so its largest row sum bounds its spectral radius;
/// rows of points without stiffness have columns of zeros and drop out). So the bound is `sqrt(G(T) G(S))`. It
/// bounds the frequency; a scheme that is not symmetric may still feed or drain energy slowly below it.
pub fn apply_contact<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    forces: &[ImpForce],
) -> Result<ContactLoad, Fault> {
    clear_contact(continuum);
    continuum.imps.forces.clear();
    continuum.imps.forces.extend_from_slice(forces);
    if forces.is_empty() {
        return Ok(ContactLoad::default());
    }
    if forces.len() != continuum.imps.state.members.len() {
        return Err(Fault::Other(format!(
            "{} contact forces arrived for {} identified material points",
            forces.len(),
            continuum.imps.state.members.len()
        )));
    }
    for slot in 0..forces.len() {
        touch(continuum, slot)?;
    }
    let mut load = ContactLoad::default();
    let mut rows: [f64; 2] = [0.0; 2];
    for (loaded, touches) in continuum
        .loaded
        .iter()
        .zip(continuum.touches.chunks_exact(W * W))
    {
        if loaded.stiffness > 0.0 || loaded.tangential > 0.0 {
            let sums = row_sums(&continuum.grid, loaded, touches);
            rows = [0, 1].map(|k| rows[k].max(sums[k]));
            load.stiffness = load.stiffness.max(loaded.stiffness);
        }
    }
    load.omega_sq = if continuum.spread.is_shape() {
        rows[0]
    } else {
        (rows[0] * rows[1]).sqrt()
    };
    Ok(load)
}

/// `sum_I S_Ip s_I / m_I` of a point, and the same with `T`; in place of `S` the larger of `S` and `A / a` where it turns.
fn row_sums(grid: &Grid, loaded: &Loaded, touches: &[Touch]) -> [f64; 2] {
    let per_row = 1.0 / turned_sum(touches);
    let mut sums = [0.0; 2];
    for t in touches {
        let (tile, node) = t.of.split();
        let mass = grid.tiles[tile].mass[node];
        let nodes = &grid.contact[tile];
        // A weight so small that the mass underflowed carries nothing.
        if mass > 0.0 {
            let (mut gather, mut scatter) = (t.gather, t.scatter);
            if loaded.tangential > 0.0 {
                gather = gather.max((gather + t.turned) * per_row);
                scatter = scatter.max((scatter + t.turned) * per_row);
            }
            sums[0] += gather * nodes.stiffness[node] / mass;
            sums[1] += scatter * nodes.scattered[node] / mass;
        }
    }
    sums
}

/// `a = sum_I A_I` of a point; the weights `S` and `T` sum to one.
fn turned_sum(touches: &[Touch]) -> f64 {
    1.0 + touches.iter().map(|t| t.turned).sum::<f64>()
}

/// Counts the stiffness on a point at the nodes that it touches.
fn add_stiffness(grid: &mut Grid, loaded: &Loaded, touches: &[Touch]) {
    let Loaded {
        stiffness,
        tangential,
        ..
    } = *loaded;
    let per_row = tangential * turned_sum(touches);
    let plain = (stiffness - tangential).max(0.0);
    for t in touches {
        let (tile, node) = t.of.split();
        let nodes = &mut grid.contact[tile];
        if tangential > 0.0 {
            nodes.stiffness[node] += plain * t.gather + per_row * (t.gather + t.turned);
            nodes.scattered[node] += plain * t.scatter + per_row * (t.scatter + t.turned);
        } else {
            nodes.stiffness[node] += t.gather * stiffness;
            nodes.scattered[node] += t.scatter * stiffness;
        }
    }
}

/// Distributes the force on one slot, if there is one or a body is near enough to press. The stiffness is counted at
/// nodes that are free: with `v_image = sigma v` ([`crate::state::images`]) the weights of the original are at most the
/// sum of both.
///
/// # Errors
/// [`Fault::Other`] at a periodic wall, across which bodies do not see.
fn touch<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    slot: usize,
) -> Result<(), Fault> {
    let ImpForce {
        force,
        couple,
        stiffness,
        tangential,
    } = continuum.imps.forces[slot];
    if force == [0.0; 2] && couple == 0.0 && stiffness == 0.0 && tangential == 0.0 {
        return Ok(());
    }
    if continuum.imps.markers.is_some() {
        touch_marker(continuum, slot);
        return Ok(());
    }
    let member = continuum.imps.state.members[slot];
    let cloud = &continuum.clouds[member.cloud as usize];
    let lane = cloud.lane_of[member.local as usize] as usize;
    let tile = cloud.tile_of_lane(lane);
    let place = tile.frame.locate(&cloud.state.x[lane / LANES], pitch(W));
    let k = lane % LANES;
    let s = [0, 1].map(|a| cloud.shape.weights(a, place.d[a]).map(|w| w.as_array()[k]));
    let number = member.cloud as usize;
    let t = [0, 1].map(|a| {
        let d = place.d[a].as_array()[k];
        continuum.spread.weights(number, a, d, s[a])
    });
    let turns = couple != 0.0 || tangential > 0.0;
    let half = 0.5 / continuum.grid.geometry.cell;
    let g = [0, 1].map(|a| {
        let gradients = turns.then(|| cloud.shape.gradients(a, place.d[a]));
        gradients.map_or([0.0; W], |g| g.map(|g| half * g.as_array()[k]))
    });
    let first = continuum.touches.len();
    let loaded = Loaded {
        slot,
        stiffness,
        tangential,
    };
    for j in 0..W {
        for i in 0..W {
            let gather = s[0][i] * s[1][j];
            let scatter = t[0][i] * t[1][j];
            let curl = [-s[0][i] * g[1][j], g[0][i] * s[1][j]];
            let (tile, node) = owner::<W>(tile, place.base[k] + j * pitch(W) + i);
            let at = NodeAt {
                tile: tile as u32,
                node: node as u32,
            };
            let image = continuum.grid.images.at(at);
            if image.is_some_and(|i| i.periodic) {
                let [x, y] = cloud.position(lane);
                return Err(Fault::Other(format!(
                    "a body presses on point {} at ({x}, {y}) m, at a periodic wall: bodies do not see points \
                     across it; keep them further from it, or make it open",
                    cloud.first_id + u64::from(member.local)
                )));
            }
            let of = image.map_or(at, |i| i.of);
            let of_node = &mut continuum.grid.contact[tile].force[node];
            for a in 0..2 {
                of_node[a] += scatter * force[a];
                if turns {
                    of_node[a] += couple * curl[a];
                }
            }
            continuum.touches.push(Touch {
                at,
                of,
                gather,
                scatter,
                curl,
                turned: Touch::turned_by(curl, cloud.radius),
            });
        }
    }
    add_stiffness(&mut continuum.grid, &loaded, &continuum.touches[first..]);
    continuum.loaded.push(loaded);
    Ok(())
}

/// Clears the forces of the step before. Sorting has already removed those of nodes that no longer exist.
fn clear_contact<const W: usize, S: Shape<W>, A: AffineState>(continuum: &mut Continuum<W, S, A>) {
    for t in continuum.touches.drain(..) {
        for (tile, node) in [t.at.split(), t.of.split()] {
            if let Some(nodes) = continuum.grid.contact.get_mut(tile) {
                nodes.force[node] = [0.0; 2];
                nodes.stiffness[node] = 0.0;
                nodes.scattered[node] = 0.0;
            }
        }
    }
    continuum.loaded.clear();
}

/// Sets the spins of points with friction to that of the field that moves points in this step: `w = sum_I g_I . v_I`.
pub fn turn_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    let by = FieldOfMotion::of(continuum);
    let Continuum {
        imps,
        grid,
        touches,
        loaded,
        ..
    } = continuum;
    imps.state.spins.clear();
    if imps.markers.is_some() {
        return;
    }
    for (loaded, touches) in loaded.iter().zip(touches.chunks_exact(W * W)) {
        if loaded.tangential > 0.0 {
            let along = touches.iter().map(|t| {
                let v = by.at(grid, t.at);
                t.curl[0] * v[0] + t.curl[1] * v[1]
            });
            let member = imps.state.members[loaded.slot];
            imps.state.spins.push((member, along.sum()));
        }
    }
}
