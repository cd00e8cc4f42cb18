//! Grid to points: velocities, affine part, and the move to `t_{n+1}` (Jiang 2020 eqs. 26 to 28 and 31).

use crate::kernel::point_tile::Which;
use crate::kernel::window::fill_window;
use crate::state::nodes::{MappedTile, NodeTile};
use interface::solver::Fault;

use super::check_points::check_points;
use super::contact::turn_points;
use super::drift::find_near_loads;
use super::holds::hold_mapped;
use super::markers::move_markers;
use super::points_to_grid::map_velocities;
use super::stress::Velocity;
use crate::kernel::lanes::{Lanes, ZERO, largest, smallest, splat, sum};
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerBlock, PerTile, over_tiles};
use crate::kernel::tiles::{Place, pitch};
use crate::kernel::transfer::{AffineState, NoSlopes, Transfer};
use crate::kernel::window::{NO_VECTORS, VectorWindow, gather_row};
use crate::state::continuum::Continuum;
use crate::state::damping::Damping;
use crate::state::points::{Cloud, Motion, TileReport};
use crate::state::settling::Settling;
use mechanics::threads::Threads;

/// Velocities and positions of all points after the kick, by the scheme's choice of the velocity with which points move.
///
/// # Errors
/// A [`Fault`] that names the point which is not finite or has left the domain.
pub fn grid_to_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) -> Result<(), Fault> {
    if continuum.maps_kicked() {
        // The velocities were gathered, and mapped to the field that strains the points.
        transfer_pass::<W, false, true, S, A>(continuum, Which::All, dt);
    } else if continuum.maps_near_loads() {
        find_near_loads(continuum);
        transfer_pass::<W, true, false, S, A>(continuum, Which::NearLoad, 0.0);
        map_velocities(continuum, Which::NearLoad);
        hold_mapped(continuum);
        continuum.grid.complete_mapped();
        transfer_pass::<W, false, true, S, A>(continuum, Which::NearLoad, dt);
        transfer_pass::<W, true, true, S, A>(continuum, Which::Elsewhere, dt);
    } else {
        transfer_pass::<W, true, true, S, A>(continuum, Which::All, dt);
    }
    if continuum.imps.markers.is_some() {
        move_markers(continuum, dt)?;
    }
    turn_points(continuum);
    check_points(continuum, dt)
}

/// Gives all points in `which` tiles their velocities if `KICK`, and moves them over `dt` (s) if `DRIFT`.
pub fn transfer_pass<
    const W: usize,
    const KICK: bool,
    const DRIFT: bool,
    S: Shape<W>,
    A: AffineState,
>(
    continuum: &mut Continuum<W, S, A>,
    which: Which,
    dt: f64,
) {
    let (damping, books) = (continuum.damping, continuum.books_kick());
    let way = Way {
        dt,
        settling: continuum.settling,
        by: if KICK || continuum.moves_by_kicked() {
            Velocity::After
        } else {
            Velocity::Before
        },
    };
    let threads = &continuum.threads;
    let (clouds, grid, transfer) = (&mut continuum.clouds, &continuum.grid, continuum.transfer);
    let nodes = (&grid.tiles[..], &grid.mapped[..]);
    Cloud::each(threads, clouds, |threads, cloud| {
        let transfer = (transfer, damping, books);
        if KICK && transfer.0.increment {
            transfer_cloud::<W, KICK, true, DRIFT, S, A>(
                threads, cloud, which, nodes, transfer, way,
            );
        } else {
            transfer_cloud::<W, KICK, false, DRIFT, S, A>(
                threads, cloud, which, nodes, transfer, way,
            );
        }
    });
}

/// How points move.
#[derive(Debug, Clone, Copy)]
struct Way {
    /// Length of the step in s.
    dt: f64,
    settling: Settling,
    /// The velocity of the nodes that moves them.
    by: Velocity,
}

/// [`transfer_pass`] of one cloud, with the velocities of the nodes; and with their increment if `INCREMENT`, when points damp
/// their own velocities.
#[allow(clippy::too_many_lines)] // one loop over points with its sums; its parts would have to pass their names to one another
fn transfer_cloud<
    const W: usize,
    const KICK: bool,
    const INCREMENT: bool,
    const DRIFT: bool,
    S: Shape<W>,
    A: AffineState,
>(
    threads: &Threads,
    cloud: &mut Cloud<W, S, A>,
    which: Which,
    (nodes, mapped): (&[NodeTile], &[MappedTile]),
    (transfer, damping, books): (Transfer, Option<Damping>, bool),
    way: Way,
) {
    let (shape, aside) = (cloud.shape, &cloud.aside);
    let filtered = transfer.filter.is_some();
    // FLIP alone takes nothing that the nodes' gain has not.
    let smooths = !INCREMENT || A::PRESENT || filtered || transfer.pic_fraction > 0.0;
    let takes = KICK && !books && smooths;
    let compares = takes || KICK && damping.is_some();
    let dt = splat(way.dt);
    let per_dt = splat(if way.dt > 0.0 { 1.0 / way.dt } else { 0.0 });
    let settles = way.settling.settles();
    let [past, ahead] = [way.settling.past, way.settling.ahead].map(splat);
    let pic = splat(transfer.pic_fraction);
    let flip = splat(1.0 - transfer.pic_fraction);
    let kept = damping.filter(|_| INCREMENT);
    let own = splat(kept.map_or(1.0, |damping| damping.kept));
    let share = (
        PerBlock(&mut cloud.state.x[..]),
        PerBlock(&mut cloud.state.motion[..]),
        (
            PerBlock(&mut cloud.state.unsettled[..]),
            PerTile(&mut cloud.reports[..]),
        ),
    );
    over_tiles(
        threads,
        &cloud.tiles,
        share,
        || [NO_VECTORS; 2],
        &|tile, part, windows: &mut [VectorWindow; 2]| {
            if !which.has(tile) {
                return;
            }
            let (x, motion, (unsettled, report)) = part;
            let [velocity, increment] = windows;
            fill_window::<W, _>(velocity, nodes, tile, |t| match way.by {
                _ if !KICK && tile.near_load && mapped[t.index].moves != 0 => {
                    &mapped[t.index].velocity
                }
                Velocity::Before => &t.before,
                Velocity::After => &t.after,
            });
            if INCREMENT || compares {
                fill_window::<W, _>(increment, nodes, tile, |t| &t.before);
            }
            if (INCREMENT || compares) && damping.is_none() {
                let reached = tile.reached::<W, 2>();
                let velocities = &velocity.0[reached.clone()];
                for (b, a) in increment.0[reached].iter_mut().zip(velocities) {
                    *b = a - *b;
                }
            }
            let mut speed_sq = ZERO;
            let mut total = ZERO;
            let [mut taken, mut lost] = [ZERO; 2];
            let mut lower = x.0[0];
            let mut upper = x.0[0];
            let blocks = x.0.iter_mut().zip(motion.0.iter_mut());
            for (b, (x, motion)) in blocks.enumerate() {
                let place = tile.frame.locate(x, pitch(W));
                let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
                let (v, affine) = interpolate::<W, S, A>(velocity, &place, &s);
                let old = *motion;
                let mut gain = Motion {
                    v: [ZERO; 2],
                    affine: A::default(),
                };
                if compares {
                    (gain.v, gain.affine) = interpolate::<W, S, A>(increment, &place, &s);
                } else if INCREMENT {
                    (gain.v, []) = interpolate::<W, S, NoSlopes>(increment, &place, &s);
                }
                // Of strong damping nothing is left in the increment from which the velocity before it could be had again.
                let on_nodes = gain;
                let before = if damping.is_some() {
                    gain = less(Motion { v, affine }, own, &on_nodes);
                    on_nodes.v
                } else {
                    [v[0] - gain.v[0], v[1] - gain.v[1]]
                };
                if !KICK {
                } else if INCREMENT {
                    for a in 0..2 {
                        motion.v[a] = pic * v[a] + flip * own.mul_add(motion.v[a], gain.v[a]);
                    }
                } else {
                    motion.v = v;
                }
                if KICK {
                    motion.affine = affine;
                }
                let mut old = old;
                if filtered {
                    old.v = aside[tile.first + b];
                }
                if takes {
                    let lacks = less(less(gain, -own, &old), splat(1.0), motion);
                    let of_block = work::<W, S, A>(&lacks, &old, motion);
                    taken = tile.live(b).mul_add(of_block, taken);
                }
                if let Some(damping) = &damping {
                    let acts_on = if INCREMENT { &old } else { &on_nodes };
                    let all = Motion { v, affine };
                    let velocities = [acts_on, &on_nodes, &all, &old, motion];
                    let of_block = loss::<W, S, A>(damping, velocities);
                    lost = tile.live(b).mul_add(of_block, lost);
                }
                let mut moves = v;
                if settles {
                    let unsettled = &mut unsettled.0[b];
                    for a in 0..2 {
                        if KICK {
                            unsettled[a] = way.settling.correction(past * before[a], unsettled[a]);
                        }
                        if DRIFT {
                            moves[a] = unsettled[a].mul_add(per_dt, v[a]);
                            unsettled[a] = ahead * v[a];
                        }
                    }
                }
                for a in 0..2 {
                    if DRIFT {
                        x[a] = moves[a].mul_add(dt, x[a]);
                    }
                    lower[a] = lower[a].fast_min(x[a]);
                    upper[a] = upper[a].fast_max(x[a]);
                    total = motion.v[a].mul_add(motion.v[a], total);
                }
                speed_sq = speed_sq.fast_max(moves[0] * moves[0] + moves[1] * moves[1]);
            }
            let report = &mut report.0[0];
            *report = TileReport {
                speed_sq: largest(speed_sq),
                sum: sum(total),
                lower: lower.map(smallest),
                upper: upper.map(largest),
                omega_sq: 0.0,
                taken: if KICK { sum(taken) } else { report.taken },
                damped: if KICK { sum(lost) } else { report.damped },
            };
        },
    );
}

/// `all` less `share` of `part`.
#[inline(always)]
fn less<A: AffineState>(all: Motion<A>, share: Lanes, part: &Motion<A>) -> Motion<A> {
    let less = |a: [Lanes; 2], b: [Lanes; 2]| [a[0] - share * b[0], a[1] - share * b[1]];
    let [a, b] = [all.affine.slopes(), part.affine.slopes()];
    Motion {
        v: less(all.v, part.v),
        affine: A::from_slopes([less(a[0], b[0]), less(a[1], b[1])]),
    }
}

/// The [`work`] against damping. Of the velocity that it acts on it leaves `E v + g w` in a kick, with `w` what forces and walls alone
/// would add; the nodes get `g w` from before the kick to after it.
#[cold]
#[inline(never)]
fn loss<const W: usize, S: Shape<W>, A: AffineState>(
    damping: &Damping,
    [acts_on, before, after, old, new]: [&Motion<A>; 5],
) -> Lanes {
    let none = Motion {
        v: [ZERO; 2],
        affine: A::default(),
    };
    let by_forces = less(*after, splat(damping.kept), before);
    let of_own = less(none, splat(damping.kept - 1.0), acts_on);
    let damped = less(of_own, splat(1.0 - 1.0 / damping.gained), &by_forces);
    work::<W, S, A>(&damped, old, new)
}

/// The work against a loss of velocity of four points in a kick, twice and per mass, in m^2/s^2. What a point `lacks` acts as a
/// force would, so its work is that of a force in leapfrog: its impulse times the mean of the velocities before and after the
/// kick. Those before are from before XPIC's filter.
///
/// A transfer that smooths takes what a point would have gained with the grid and has not.
#[inline(always)]
fn work<const W: usize, S: Shape<W>, A: AffineState>(
    lacks: &Motion<A>,
    old: &Motion<A>,
    new: &Motion<A>,
) -> Lanes {
    let mut taken = ZERO;
    for a in 0..2 {
        taken = lacks.v[a].mul_add(old.v[a] + new.v[a], taken);
    }
    if A::PRESENT {
        let mut of_affine = ZERO;
        let [lacks, old, new] = [lacks, old, new].map(|motion| motion.affine.slopes());
        for i in 0..2 {
            for a in 0..2 {
                of_affine = lacks[i][a].mul_add(old[i][a] + new[i][a], of_affine);
            }
        }
        // The slopes are C L, and D = L^2 / S::INVERSE_INERTIA.
        let inertia = splat(1.0 / S::INVERSE_INERTIA.unwrap_or(1.0));
        taken = of_affine.mul_add(inertia, taken);
    }
    taken
}

/// `sum_I S_Ip v_I` of four points and, if wanted, `B_p D_p^-1 L = L D_p^-1 sum_I S_Ip v_I (x_I - x_p)`.
#[inline(always)]
fn interpolate<const W: usize, S: Shape<W>, A: AffineState>(
    velocity: &VectorWindow,
    place: &Place,
    s: &[[Lanes; W]; 2],
) -> ([Lanes; 2], A) {
    // S_Ip (x_I - x_p) L D^-1 along each axis.
    let inverse_inertia = splat(S::INVERSE_INERTIA.unwrap_or(0.0));
    let mut moment = [[ZERO; W]; 2];
    if A::PRESENT {
        for a in 0..2 {
            for i in 0..W {
                moment[a][i] = s[a][i] * ((splat(i as f64) - place.d[a]) * inverse_inertia);
            }
        }
    }
    let (mut v, mut slopes) = ([ZERO; 2], [[ZERO; 2]; 2]);
    for j in 0..W {
        let nodes = gather_row::<W>(velocity, place, j);
        let (mut row, mut row_moment) = ([ZERO; 2], [ZERO; 2]);
        for i in 0..W {
            for a in 0..2 {
                row[a] = s[0][i].mul_add(nodes[i][a], row[a]);
                if A::PRESENT {
                    row_moment[a] = moment[0][i].mul_add(nodes[i][a], row_moment[a]);
                }
            }
        }
        for a in 0..2 {
            v[a] = s[1][j].mul_add(row[a], v[a]);
            if A::PRESENT {
                slopes[0][a] = s[1][j].mul_add(row_moment[a], slopes[0][a]);
                slopes[1][a] = moment[1][j].mul_add(row[a], slopes[1][a]);
            }
        }
    }
    (v, A::from_slopes(slopes))
}
