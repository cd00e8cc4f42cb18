//! The step, as the paper has it (Jiang 2020 section 2.2 and eqs. 46 to 48; docs/physics.md section 3).

use interface::message::wire::{ImpForce, Limits};
use interface::solver::Fault;
use interface::step::Step;

use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::pass::contact::apply_contact;
use crate::pass::damping::begin_stage;
use crate::pass::grid_to_points::grid_to_points;
use crate::pass::leaving::remove_left;
use crate::pass::limits::limits;
use crate::pass::loads::apply_loads;
use crate::pass::markers::place_markers;
use crate::pass::measure::{close_ledger, count_damping_of_points, update_ledger};
use crate::pass::points_to_grid::points_to_grid;
use crate::pass::sort::keep_sorted;
use crate::pass::stress_schemes::{update_stress_first, update_stress_last};
use crate::pass::update_grid::update_grid;
use crate::pass::xpic::filter_velocities;
use crate::state::contact::ContactLoad;
use crate::state::continuum::Continuum;
use crate::state::settling::Settling;

/// The first part of a step from `t_n` to `t_{n+1}`: all that needs no contact force. The bodies' side computes the forces
/// meanwhile.
///
/// # Errors
/// A [`Fault`] that names the point.
pub fn predict<const W: usize, S: Shape<W>, A: AffineState>(
    c: &mut Continuum<W, S, A>,
    step: &Step,
) -> Result<(), Fault> {
    begin_stage(c, step);
    c.settling = Settling::of(c.stress_update, c.drift, step);
    points_to_grid(c); //                       m_I, p_I^{n-1/2}, v_I^{n-1/2}        (18) (19) (20) (30)
    update_stress_first(c, step.dt_before); //  D, W, sigma^n, f_I^int               (21) ... (25), (13)
    apply_loads(c, step)?; //                   f_I^ext                              (14)
    Ok(())
}

/// The second part, with the forces `f_p^n` of the bodies (46) on the IMPs, empty where there are none: the nodes move. Layers
/// may touch on them after it ([`crate::layers`]).
///
/// # Errors
/// A [`Fault`] that names the point.
pub fn move_nodes<const W: usize, S: Shape<W>, A: AffineState>(
    c: &mut Continuum<W, S, A>,
    step: &Step,
    forces: &[ImpForce],
) -> Result<ContactLoad, Fault> {
    place_markers(c)?; //                       weights of a boundary's markers, where there are any
    let load = apply_contact(c, forces)?; //    f_I^cont                             (47)
    update_grid(c, step.kick()); //             v_I^{n+1/2}                          (17) (48)
    Ok(load)
}

/// The third part: the points take the velocities of the nodes and move.
///
/// # Errors
/// A [`Fault`] that names the point.
pub fn move_points<const W: usize, S: Shape<W>, A: AffineState>(
    c: &mut Continuum<W, S, A>,
    step: &Step,
    load: ContactLoad,
) -> Result<Limits, Fault> {
    update_ledger(c, step); //                     impulses; energies if the step is measured
    if step.dt_before + step.dt > 0.0 {
        filter_velocities(c); //                with XPIC only
        count_damping_of_points(c); //          in a stage with damping, with FLIP
        update_stress_last(c, step.dt); //      with USL, MUSL and USAVG only
        grid_to_points(c, step.dt)?; //         v_p^{n+1/2}, B_p, x_p^{n+1}          (26) ... (28), (31)
    } // The opening step moves no points: a transfer without a kick would still smooth the velocities.
    close_ledger(c, step);
    let limits = limits(c, load);
    remove_left(c, step.dt);
    keep_sorted(c);
    Ok(limits)
}
