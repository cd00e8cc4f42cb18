//! The continuum solver: an explicit material point method in the plane.
//!
//! [`Mpm`] implements [`interface::solver::MpmSolver`]. `step.rs` is the algorithm of Jiang 2020 section 2.2, one call
//! a line. The passes that it calls are in `pass/`, their data in `state/`, the parts of the loops in `kernel/`, and
//! `setup/` builds a solver from a configuration. Files depend on others of the same folder or of a later one in this
//! list, without cycles: `setup`, `layers`, `grid_contact`, `step.rs`, `pass`, `state`, [`material`], [`kernel`].
//!
//! [`kernel`] and [`material`] are public so that the examples of [`material::Material`] and [`kernel::shape::Shape`]
//! run as tests; other crates have no use for them.
//!
//! # Notation
//!
//! Equation numbers are those of Jiang 2020, with the corrections of `docs/physics.md` section 1. Everything is per metre
//! of thickness.
//!
//! | symbol | name in the code | what it is | shape | unit | equation |
//! | --- | --- | --- | --- | --- | --- |
//! | `L` | `cell` | grid spacing | 1 | m | |
//! | `m_p` | `mass` | mass of a point | 1 a group | kg/m | (6) |
//! | `V_p` | `volume` | volume: initial, and the ratio to it | 1 a group, 1 a point | m^2, 1 | (5) |
//! | `x_p^n` | `x` | position | 2 a point | m | |
//! | `v_p^{n-1/2}` | `motion.v` | velocity | 2 a point | m/s | (26) ... (28) |
//! | `B_p D_p^-1 L` | `motion.affine` | affine velocity, per cell | 2 x 2 a point | m/s | (29) ... (31) |
//! | `S_Ip` | `weights` | shape function | W x W a point | 1 | (15), A1 ... A4 |
//! | `L S_Ip,j` | `gradients` | its gradient, per cell | W x W x 2 a point | 1 | (16) |
//! | `m_I`, `p_I` | `mass_momentum` | mass and momentum of a node | 3 a node | kg/m, N s/m | (18), (19), (30) |
//! | `v_I^{n-1/2}` | `before` | velocity of a node before the kick | 2 a node | m/s | (20) |
//! | `v_I^{n+1/2}` | `after` | velocity of a node after it | 2 a node | m/s | (17) |
//! | `D dt`, `W dt` | `Deformation` | strain and spin over the interval | 2 x 2 a point | 1 | (21), (22) |
//! | `sigma_p^n` | `stress` | Cauchy stress | 4 a point | Pa | (24), (25) |
//! | `f_I^int` | `force` | internal force | 2 a node | N/m | (13) |
//! | `f_p` | `Load` | force of a load on a point | 2 a point | N/m | |
//! | `f_p` | `ImpForce` | contact force on a point | 2 an IMP | N/m | (46) |
//! | `T_Ip` | `scatter` | how a contact force reaches the nodes | W x W an IMP | 1 | (47), 5.4 |
//! | `f_I^cont` | `ContactNodes` | contact force on a node | 2 a node | N/m | (47) |
//! | `r_p` | `radius` | contact radius of a point | 1 a group | m | (45) |
//! | `V_d` | `skin` | Verlet skin | 1 | m | section 4 |

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]
#![allow(
    clippy::inline_always,
    reason = "kernels are generic over small traits; a call that is not inlined would pass vectors through memory"
)]
#![allow(
    clippy::needless_range_loop,
    reason = "the index is the axis of the paper's formula, and often of several arrays at once"
)]
#![allow(
    clippy::cast_possible_wrap,
    reason = "tile and cell numbers are range-checked where the grid is made"
)]

mod grid_contact;
pub mod kernel;
mod layers;
mod level;
pub mod material;
mod pass;
mod scheme;
mod setup;
mod several;
mod solver;
mod state;
mod step;

pub use solver::Mpm;
