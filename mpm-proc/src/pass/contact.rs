//! Contact forces of bodies on the nodes (Jiang 2020 eq. 47), and their contribution to the step limit.

use interface::message::wire::ImpForce;
use interface::solver::Fault;

use super::markers::touch_marker;
use crate::kernel::lanes::LANES;
use crate::kernel::point_tile::owner;
use crate::kernel::shape::Shape;
use crate::kernel::tiles::pitch;
use crate::kernel::transfer::AffineState;
use crate::state::contact::{ContactLoad, Touch};
use crate::state::continuum::Continuum;
use crate::state::nodes::NodeAt;

/// Adds `f_I^cont = sum_p f_p T_Ip` to the nodes.
///
/// The frequency where `T = S` is Gershgorin's bound, `G(S) = max_p sum_I S_Ip s_I / m_I` with
/// `s_I = sum_q k_q S_Iq` over the points with stiffness (docs/physics.md section 4).
///
/// Otherwise contact adds `M^-1 T K S^T` to the operator of the grid's motion, which is not symmetric, so that
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
    let (mut gather, mut scatter): (f64, f64) = (0.0, 0.0);
    for (&stiffness, touches) in continuum
        .loaded
        .iter()
        .zip(continuum.touches.chunks_exact(W * W))
    {
        if stiffness > 0.0 {
            let mut sums = [0.0; 2];
            for t in touches {
                let (tile, node) = t.of.split();
                let mass = continuum.grid.tiles[tile].mass[node];
                let nodes = &continuum.grid.contact[tile];
                // A weight so small that the mass underflowed carries nothing.
                if mass > 0.0 {
                    sums[0] += t.gather * nodes.stiffness[node] / mass;
                    sums[1] += t.scatter * nodes.scattered[node] / mass;
                }
            }
            gather = gather.max(sums[0]);
            scatter = scatter.max(sums[1]);
            load.stiffness = load.stiffness.max(stiffness);
        }
    }
    load.omega_sq = if continuum.spread.is_shape() {
        gather
    } else {
        (gather * scatter).sqrt()
    };
    Ok(load)
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
    let ImpForce { force, stiffness } = continuum.imps.forces[slot];
    if force == [0.0; 2] && stiffness == 0.0 {
        return Ok(());
    }
    let member = continuum.imps.state.members[slot];
    if continuum.imps.markers.is_some() {
        touch_marker(continuum, member, &ImpForce { force, stiffness });
        return Ok(());
    }
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
    for j in 0..W {
        for i in 0..W {
            let gather = s[0][i] * s[1][j];
            let scatter = t[0][i] * t[1][j];
            let (tile, node) = owner::<W>(tile, place.base(k) + j * pitch(W) + i);
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
            for a in 0..2 {
                continuum.grid.contact[tile].force[node][a] += scatter * force[a];
            }
            let (tile, node) = of.split();
            continuum.grid.contact[tile].stiffness[node] += gather * stiffness;
            continuum.grid.contact[tile].scattered[node] += scatter * stiffness;
            continuum.touches.push(Touch {
                at,
                of,
                gather,
                scatter,
            });
        }
    }
    continuum.loaded.push(stiffness);
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
