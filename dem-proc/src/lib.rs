//! The spheropolygon rigid-body solver of Tandem.
//!
//! Bodies are spheropolygons: polygons (or a point, or a segment) swept by a disc (Jiang, Chen, Zhang, Ji, Liu 2020,
//! "MPM-SDEM", section 3). They are in contact with one another and with the identified material points (IMPs) that the
//! continuum sends. [`Sdem`] implements [`interface::solver::DemSolver`]; `step` reads as the paper's section 4.2,
//! `contact` has the geometry, `law` the forces.
//!
//! # Notation
//!
//! | symbol | name | shape | unit | where |
//! | --- | --- | --- | --- | --- |
//! | `a` | sphero-radius | scalar | m | eq. 38 |
//! | `r_p` | contact radius of an IMP | scalar | m | eq. 44 |
//! | `X`, `Y` | vertex or point, nearest point of the outline | 2 | m | eq. 41 |
//! | `d` | distance of `X` from the outline, negative inside | scalar | m | eq. 38 |
//! | `xi` | overlap `<a_i + a_j - d>` | scalar | m | eqs. 38, 44 |
//! | `N`, `T` | normal (away from the outline), `N` turned by +90 degrees | 2 | 1 | eq. 43 |
//! | `p` | contact point `X - (a_V - xi/2) N` | 2 | m | eq. 41, sign corrected |
//! | `k_n`, `k_t` | stiffness | scalar | N/m per m | eq. 43 |
//! | `mu` | friction | scalar | 1 | below eq. 43 |
//! | `zeta` | damping as a fraction of critical | scalar | 1 | docs/physics.md 5 |
//! | `c`, `theta` | centre of mass, angle | 2, scalar | m, rad | eq. 42 |
//! | `v`, `omega` | velocity, spin, at half steps | 2, scalar | m/s, rad/s | eq. 42 |
//! | `m`, `I` | mass, moment of inertia about `c` | scalar | kg/m, kg m | eq. 42 |
//! | `V_d` | Verlet skin beyond contact distance | scalar | m | fig. 4 |
//!
//! # Choices that the paper leaves open
//!
//! - A disc has no edges: two discs have one contact, and a disc has one with each near edge of a polygon. The literal
//!   sum of eq. 39 over degenerate edges would count a pair of discs twice.
//! - A dashpot never pulls. Coulomb's limit is `mu` times the whole normal force, dashpot included, and limits the sum
//!   of tangential spring and dashpot.
//! - Sliding is the relative displacement of the two surfaces at the contact point; a material point is a disc without
//!   spin. So the friction force, its torque (eq. 50) and the energy that it dissipates are consistent, and a wheel
//!   rolls on its own radius.
//! - The mass properties of a free body are exact, or the body is refused (a sphero-radius too large for a notch).
//! - The distance of a vertex from an edge has no sign, as in the paper; a point inside an outline is pushed back out.
//!   If a point or a body has passed through a body, or nearly so, the run ends ([`contact::passage`]).
#![forbid(unsafe_code)]
#![warn(clippy::disallowed_methods)]

pub mod body;
pub mod contact;
pub mod law;
mod ledger;
pub mod lists;
pub mod parry;
mod setup;
mod solver;
mod step;
mod system;
pub mod threads;

pub use system::Sdem;
