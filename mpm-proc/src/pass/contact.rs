//! Contact forces of bodies on the nodes (Jiang 2020 eq. 47), and their contribution to the step limit.

use interface::message::wire::ImpForce;
use interface::solver::Fault;
use interface::text;

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
use crate::state::nodes::{ContactNodes, NodeAt};

/// Adds `f_I^cont = sum_p f_p T_Ip + c_p g_Ip` to the nodes, with the couple `c_p` of friction on the surface of a point and
/// `g_I = (-dS_I/dy, dS_I/dx)/2`: weights sum to one and reproduce `x`, so `sum g_I = 0` and `sum x_I x g_I = 1`. Its work is
/// that on the spin `w = sum g_I . v_I` of the field (docs/energy.md).
///
/// The frequency where `T = S`: a contact acts through rows `b_I`, `sqrt(k_n) S_I N` and `sqrt(k_t) (S_I T - r g_I)`, `r` the
/// radius of the surface of the point. With any weights `w_pI > 0` Cauchy-Schwarz at each node gives
///
/// ```text
/// |sum_p b_pI y_p|^2 <= s_I sum_p |b_pI y_p|^2 / w_pI,   s_I = sum_p w_pI
/// lambda_max(K^1/2 S M^-1 S^T K^1/2) <= G(S) = max_p lambda_max( sum_I s_I / (m_I w_pI) b_pI^T b_pI )
/// ```
///
/// so what cancels in the products of `S` and `g` of a point does so before sizes are taken, and a point alone has its own
/// frequency. Without friction `w = k S` gives Gershgorin's bound, `max_p sum_I S_Ip s_I / m_I` (docs/physics.md section 4).
/// With friction `w = max(k S, k_t r |g| / 2)`: a point may turn a node that it hardly sees. With `u_I = s_I / (m_I w_I)`
///
/// ```text
/// lambda_max <= k sum u S^2 + k_t (r^2 sum u |g|^2 + 2 r |q|),   q = sum u S g
/// ```
///
/// for several bodies at once and any normals: a contact is `k_n - k_t` along N, which adds that times `sum u S^2`, and `k_t`
/// along N and on the surface along T, which adds `k_t` times `sum u S^2 + [[0, r q.N], [r q.N, r^2 sum u |g|^2 - 2 r q.T]]`.
/// `y = r^2 sum u |g|^2 + 2 r |q|` bounds the latter, as `y (y - x) >= (r q.N)^2` for its entry `x`. A larger `k_t` stands for `k`.
///
/// Where `T` is not `S` contact adds `M^-1 T K S^T` to the operator of the grid's motion, which is not symmetric, so that
/// bounding its own eigenvalues would not bound those of its sum with elasticity. Its norm in the inner product of
/// the masses does, since norms add:
///
/// ```text
/// |M^-1/2 T K S^T M^-1/2| <= |M^-1/2 T K^1/2| |K^1/2 S^T M^-1/2| = sqrt(lambda_max(T) lambda_max(S))
/// lambda_max(X) = lambda_max(K^1/2 X^T M^-1 X K^1/2) <= G(X)
/// ```
///
/// So the bound is `sqrt(G(T) G(S))`. It bounds the frequency; a scheme that is not symmetric may still feed or drain
/// energy slowly below it.
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
    for slot in 0..forces.len() {
        touch(continuum, slot)?;
    }
    let mut load = ContactLoad::default();
    let spreads = !continuum.spread.is_shape();
    let (mut gathers, mut scatters) = (0.0_f64, 0.0_f64);
    let grid = &continuum.grid;
    let all = continuum.touches.chunks_exact(W * W);
    for (loaded, touches) in continuum.loaded.iter().zip(all) {
        if loaded.stiffness > 0.0 || loaded.tangential > 0.0 {
            let s = most(grid, loaded, touches, |t, n, i| {
                [t.gather, t.weights[0], n.stiffness[i]]
            });
            gathers = gathers.max(s);
            if spreads {
                let t = most(grid, loaded, touches, |t, n, i| {
                    [t.scatter, t.weights[1], n.scattered[i]]
                });
                scatters = scatters.max(t);
            }
            load.stiffness = load.stiffness.max(loaded.stiffness);
        }
    }
    load.omega_sq = if spreads {
        (gathers * scatters).sqrt()
    } else {
        gathers
    };
    Ok(load)
}

/// What one point has of `G(S)` or `G(T)`: `of` gives `S_I` or `T_I`, `w_I` and `s_I`.
fn most(
    grid: &Grid,
    loaded: &Loaded,
    touches: &[Touch],
    of: impl Fn(&Touch, &ContactNodes, usize) -> [f64; 3],
) -> f64 {
    let (mut moves, mut turns, mut both) = (0.0, 0.0, [0.0_f64; 2]);
    for t in touches {
        let (tile, node) = t.of.split();
        let mass = grid.tiles[tile].mass[node];
        // A weight so small that the mass underflowed carries nothing.
        if mass <= 0.0 {
            continue;
        }
        let [s, weight, sum] = of(t, &grid.contact[tile], node);
        if loaded.tangential == 0.0 {
            moves += s * sum / mass;
            continue;
        }
        if weight > 0.0 {
            let u = sum / mass;
            let [x, y] = t.curl.map(|g| u * (g / weight));
            moves += u * (s / weight) * s;
            turns += t.curl[0] * x + t.curl[1] * y;
            both = [both[0] + s * x, both[1] + s * y];
        }
    }
    if loaded.tangential == 0.0 {
        return moves;
    }
    let (r, q) = (
        loaded.radius,
        (both[0] * both[0] + both[1] * both[1]).sqrt(),
    );
    loaded.stiffness.max(loaded.tangential) * moves + loaded.tangential * r * (r * turns + 2.0 * q)
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
    let spreads = !continuum.spread.is_shape();
    let turns = couple != 0.0 || tangential > 0.0;
    let half = 0.5 / continuum.grid.geometry.cell;
    let g = [0, 1].map(|a| {
        let gradients = turns.then(|| cloud.shape.gradients(a, place.d[a]));
        gradients.map_or([0.0; W], |g| g.map(|g| half * g.as_array()[k]))
    });
    let loaded = Loaded {
        slot,
        stiffness,
        tangential,
        radius: cloud.radius,
    };
    let base = place.column_row(k, W);
    for j in 0..W {
        for i in 0..W {
            let gather = s[0][i] * s[1][j];
            let scatter = t[0][i] * t[1][j];
            let curl = [-s[0][i] * g[1][j], g[0][i] * s[1][j]];
            let (tile, node) = owner::<W>(tile, [base[0] + i, base[1] + j]);
            let at = NodeAt { tile, node };
            let image = continuum.grid.images.at(at);
            if image.is_some_and(|i| i.periodic) {
                let id = cloud.first_id + u64::from(member.local);
                return Err(at_periodic_wall(id, cloud.position(lane)));
            }
            let of = image.map_or(at, |i| i.of);
            let (nodes, node) = continuum.grid.touch(at);
            let of_node = &mut nodes.force[node];
            for a in 0..2 {
                of_node[a] += scatter * force[a];
                if turns {
                    of_node[a] += couple * curl[a];
                }
            }
            let (nodes, node) = continuum.grid.touch(of);
            let mut weights = [loaded.weight(gather, curl), 0.0];
            nodes.stiffness[node] += weights[0];
            if spreads {
                weights[1] = loaded.weight(scatter, curl);
                nodes.scattered[node] += weights[1];
            }
            continuum.touches.push(Touch {
                at,
                of,
                gather,
                scatter,
                curl,
                weights,
            });
        }
    }
    continuum.loaded.push(loaded);
    Ok(())
}

fn at_periodic_wall(id: u64, at: [f64; 2]) -> Fault {
    Fault::Other(format!(
        "a body presses on point {id} at {}, at a periodic wall: bodies do not see points across it; keep them further \
         from it, or make it open",
        text::place(at)
    ))
}

/// Clears what contact gave to nodes in the step before.
fn clear_contact<const W: usize, S: Shape<W>, A: AffineState>(continuum: &mut Continuum<W, S, A>) {
    for nodes in &mut continuum.grid.contact {
        if nodes.touched {
            *nodes = ContactNodes::NONE;
        }
    }
    continuum.loaded.clear();
    continuum.touches.clear();
}

/// Sets the spins of points and markers with friction to that of the field that moves them in this step: `w = sum_I g_I . v_I`.
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
