//! Contact forces of bodies on the nodes (Jiang 2020 eq. 47), and their contribution to the step limit.

use interface::message::wire::ImpForce;
use interface::solver::Fault;
use interface::text;

use super::drift::FieldOfMotion;
use super::markers::touch_marker;
use crate::kernel::lanes::{LANES, Lanes, ZERO, splat};
use crate::kernel::point_tile::{Tile, owner};
use crate::kernel::shape::Shape;
use crate::kernel::spread;
use crate::kernel::tiles::{NODES, pitch};
use crate::kernel::transfer::AffineState;
use crate::state::contact::{ContactLoad, Loaded, TouchRow, Weighted, turns};
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
    // First all rows of nodes, then all sums: the processor computes the rows of several points at once, while sums wait for
    // one another.
    for slot in 0..forces.len() {
        touch(continuum, slot)?;
    }
    let touches = &continuum.touches;
    touches.give::<W>(&mut continuum.grid, &continuum.loaded, forces);
    let mut load = ContactLoad::default();
    let (mut gathers, mut scatters) = (0.0_f64, 0.0_f64);
    let grid = &continuum.grid;
    for (p, loaded) in continuum.loaded.iter().enumerate() {
        if loaded.stiffness > 0.0 || loaded.tangential > 0.0 {
            let own = p * W..(p + 1) * W;
            let rows = &continuum.touches.rows[own.clone()];
            let s = rows.iter().map(|row| (row, row.gather));
            gathers = gathers.max(most::<W>(grid, loaded, |n| &n.stiffness, s));
            if let Some(of_rows) = continuum.touches.scatters.get(own) {
                let t = rows.iter().zip(of_rows.iter().copied());
                scatters = scatters.max(most::<W>(grid, loaded, |n| &n.scattered, t));
            }
            load.stiffness = load.stiffness.max(loaded.stiffness);
        }
    }
    load.omega_sq = if continuum.touches.scatters.is_empty() {
        gathers
    } else {
        (gathers * scatters).sqrt()
    };
    Ok(load)
}

/// What one point has of `G(S)` or `G(T)`: `rows` have `S_I` or `T_I` and `w_I`, `sum` of a tile `s_I`.
#[inline(always)]
fn most<'a, const W: usize>(
    grid: &Grid,
    loaded: &Loaded,
    sum: impl Fn(&ContactNodes) -> &[f64; NODES],
    rows: impl Iterator<Item = (&'a TouchRow, Weighted)>,
) -> f64 {
    let rubs = loaded.tangential != 0.0;
    // sum u S^2, sum u |g|^2 and q, node by node.
    let mut sums = ZERO;
    for (row, Weighted { share: s, weight }) in rows {
        let (mut masses, mut stiffnesses) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..W {
            let (tile, node) = row.of[i].split();
            masses[i] = grid.tiles[tile].mass[node];
            stiffnesses[i] = sum(&grid.contact[tile])[node];
        }
        let (mass, stiffness) = (Lanes::new(masses), Lanes::new(stiffnesses));
        // A weight so small that the mass underflowed carries nothing.
        let carries = mass.simd_gt(ZERO);
        let parts = if rubs {
            let u = stiffness / mass;
            let [x, y] = row.curl.map(|g| u * (g / weight));
            let moves = u * (s / weight) * s;
            let turns = row.curl[0] * x + row.curl[1] * y;
            let carries = carries & weight.simd_gt(ZERO);
            [moves, turns, s * x, s * y].map(|part| carries.select(part, ZERO))
        } else {
            let moves = carries.select(s * stiffness / mass, ZERO);
            [moves, ZERO, ZERO, ZERO]
        };
        for of_node in &Lanes::transpose(parts)[..W] {
            sums += *of_node;
        }
    }
    let [moves, turns, x, y] = sums.to_array();
    if !rubs {
        return moves;
    }
    let (r, q) = (loaded.radius, (x * x + y * y).sqrt());
    loaded.stiffness.max(loaded.tangential) * moves + loaded.tangential * r * (r * turns + 2.0 * q)
}

/// Finds the nodes to which the force on one slot goes, if there is one or a body is near enough to press. The stiffness is
/// counted at nodes that are free: with `v_image = sigma v` ([`crate::state::images`]) the weights of the original are at
/// most the sum of both.
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
    let turns = turns(&continuum.imps.forces[slot]);
    let half = turns.then(|| 0.5 / continuum.grid.geometry.cell);
    let x = cloud.position(lane);
    let (base, s, g, t) = weights_of(&cloud.shape, tile, x, half, cloud.spread);
    let loaded = Loaded {
        slot,
        stiffness,
        tangential,
        radius: cloud.radius,
    };
    for j in 0..W {
        let curl = [-s.x * g.y[j], g.x * s.y[j]];
        let gather = loaded.weighted(s.x * s.y[j], curl);
        let scatter = t.map(|t| loaded.weighted(t.x * t.y[j], curl));
        let (mut at, mut of) = ([NodeAt::default(); LANES], [NodeAt::default(); LANES]);
        for i in 0..W {
            let (tile, node) = owner::<W>(tile, [base[0] + i, base[1] + j]);
            at[i] = NodeAt { tile, node };
            let image = continuum.grid.image(at[i]);
            if image.is_some_and(|i| i.periodic) {
                let id = cloud.first_id + u64::from(member.local);
                return Err(at_periodic_wall(id, cloud.position(lane)));
            }
            of[i] = image.map_or(at[i], |i| i.of);
        }
        let row = TouchRow {
            at,
            of,
            gather,
            curl,
        };
        continuum.touches.push(row, scatter);
    }
    continuum.loaded.push(loaded);
    Ok(())
}

/// A function of each coordinate at the nodes that a point touches: along x side by side, along y each in all lanes.
#[derive(Clone, Copy)]
struct Along<const W: usize> {
    x: Lanes,
    y: [Lanes; W],
}

impl<const W: usize> Along<W> {
    /// From values in all lanes.
    #[inline(always)]
    fn of([along_x, y]: [[Lanes; W]; 2]) -> Self {
        let mut x = [0.0; LANES];
        for i in 0..W {
            x[i] = along_x[i].as_array()[0];
        }
        let x = Lanes::new(x);
        Self { x, y }
    }
}

/// Column and row of the base node of a point at `x` (m) in the window of its tile; `S` there, `half L dS/dx` or zero, and `T`
/// where it is not `S`. All is computed in all four lanes, so that no number has to be taken out of a vector.
#[inline(always)]
fn weights_of<const W: usize, S: Shape<W>>(
    shape: &S,
    tile: &Tile,
    x: [f64; 2],
    half: Option<f64>,
    spread: Option<[f64; 2]>,
) -> ([usize; 2], Along<W>, Along<W>, Option<Along<W>>) {
    let place = tile.frame.locate(&x.map(splat), pitch(W));
    let [x, y] = place.d;
    let s = [shape.weights(0, x), shape.weights(1, y)];
    let mut g = [[ZERO; W]; 2];
    if let Some(half) = half {
        g = [shape.gradients(0, x), shape.gradients(1, y)];
        for g in g.as_flattened_mut() {
            *g = splat(half) * *g;
        }
    }
    let t = spread.map(|half_width| {
        let t = |a: usize| spread::weights(place.d[a].as_array()[0], half_width[a]).map(splat);
        Along::of([0, 1].map(t))
    });
    (place.column_row(0, W), Along::of(s), Along::of(g), t)
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
    for (loaded, rows) in loaded.iter().zip(touches.rows.chunks_exact(W)) {
        if loaded.tangential > 0.0 {
            let mut along = 0.0;
            for row in rows {
                let [x, y] = row.curl.map(Lanes::to_array);
                for i in 0..W {
                    let v = by.at(grid, row.at[i]);
                    along += x[i] * v[0] + y[i] * v[1];
                }
            }
            let member = imps.state.members[loaded.slot];
            imps.state.spins.push((member, along));
        }
    }
}
