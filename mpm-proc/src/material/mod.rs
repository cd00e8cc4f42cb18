//! Constitutive models (docs/physics.md section 6).
//!
//! A model is a type that implements [`Material`]; a loop over a batch of points is compiled for it, which the passes call
//! as [`Constitutive`]. The state of a point besides stress and volume is its [`Material::State`]. An elastic solid has
//! none.

mod constitutive;
mod drucker_prager;
mod elastic;
mod fluid;
mod granular;
mod hencky;
mod hypoelastic;
mod model;
mod mohr_coulomb;
mod mu_i;
mod neo_hookean;
mod perfect_plasticity;
mod point;
#[cfg(test)]
mod properties;
#[cfg(test)]
mod single_point;
mod von_mises;

pub use constitutive::{Constitutive, Straining, Stressed, Stresses, Sums};
pub use drucker_prager::DruckerPrager;
pub use elastic::{Moduli, PlaneStrain, PlaneStress};
pub use fluid::Fluid;
pub use granular::Granular;
pub use hypoelastic::Jaumann;
pub use model::Material;
pub use mohr_coulomb::MohrCoulomb;
pub use mu_i::MuI;
pub use neo_hookean::NeoHookean;
pub use perfect_plasticity::YieldSurface;
pub use point::{Deformation, Dissipated, Point, Stress};
pub use von_mises::VonMises;
