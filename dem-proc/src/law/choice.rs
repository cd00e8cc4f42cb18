//! Turns a configured law into a value of its type: the one `match` over laws.

use interface::config::surfaces::ContactPair;
use interface::config::{ContactLaw, ratio_of_restitution};

use super::Law;
use super::contact::Contact;
use super::dashpot::{Tsuji, Viscous};
use super::mixed::{AnyLaw, OfAreas, OfGrains, OfSpheres};
use super::normal::{Adhesive, Area, Hertz, Linear};
use super::rolling::Rolling;
use super::table::Table;
use super::tangent::{Coulomb, Mindlin};
use crate::body::surfaces::Surfaces;

/// Something that is built from a law of any type.
pub trait ForLaw: Sized {
    /// The result.
    type Output;
    /// Builds it.
    fn build<L: Law>(self, law: L) -> Self::Output;
}

/// Builds something from `for_all`, and from the laws of `pairs` for their surfaces; all have been checked. Every law is
/// a value of one of few types, in a table by pairs of surfaces, with zeros for the parts that it does not use. A type
/// for every combination of parts would be faster by a few per cent where parts are missing, and would double the
/// compile time. Only [`Fast`] has no table: where one law without adhesion and rolling holds for all pairs, no contact
/// stores it.
pub fn with_laws<F: ForLaw>(
    surfaces: &Surfaces,
    for_all: &ContactLaw,
    pairs: &[&ContactPair],
    build: F,
) -> F::Output {
    match *for_all {
        ContactLaw::Linear { .. }
        | ContactLaw::Granular {
            adhesion: 0.0,
            rolling_friction: 0.0,
            ..
        } if pairs.is_empty() => build.build(fast(for_all)),
        _ => with_table(surfaces, for_all, pairs, build),
    }
}

/// The same without [`Fast`], for code that need not be fast. If all laws are of one kind, no loop branches on the
/// kind.
pub fn with_table<F: ForLaw>(
    surfaces: &Surfaces,
    for_all: &ContactLaw,
    pairs: &[&ContactPair],
    build: F,
) -> F::Output {
    if pairs.iter().any(|pair| !pair.law.is_like(for_all)) {
        return build.build(Table::new(surfaces, for_all, pairs, of_any_kind));
    }
    match for_all {
        ContactLaw::Linear { .. } | ContactLaw::Granular { .. } => {
            let rolls = |law: &ContactLaw| grains(law).friction > 0.0;
            if rolls(for_all) || pairs.iter().any(|pair| rolls(&pair.law)) {
                build.build(Table::new(surfaces, for_all, pairs, grains))
            } else {
                let law = |law: &ContactLaw| grains(law).law;
                build.build(Table::new(surfaces, for_all, pairs, law))
            }
        }
        ContactLaw::HertzMindlin { .. } => {
            build.build(Table::new(surfaces, for_all, pairs, spheres))
        }
        ContactLaw::Area { .. } => build.build(Table::new(surfaces, for_all, pairs, areas)),
    }
}

/// A linear spring with friction and damping, without adhesion and rolling.
type Fast = Contact<Linear, Coulomb, Viscous>;

/// Message of an assertion that laws were matched by kind before.
const KIND: &str = "a table's laws are of one kind";

/// The spring, friction and damping of a law `linear` or `granular`.
fn fast(law: &ContactLaw) -> Fast {
    let (ContactLaw::Linear {
        normal_stiffness,
        tangential_stiffness,
        friction,
        damping_ratio,
        damped_mass,
    }
    | ContactLaw::Granular {
        normal_stiffness,
        tangential_stiffness,
        friction,
        damping_ratio,
        damped_mass,
        ..
    }) = *law
    else {
        unreachable!("{KIND}")
    };
    Contact {
        normal: Linear {
            stiffness: normal_stiffness,
        },
        tangent: coulomb(tangential_stiffness, friction),
        dashpot: Viscous {
            ratio: damping_ratio,
            mass: damped_mass,
        },
    }
}

fn of_any_kind(law: &ContactLaw) -> AnyLaw {
    match law {
        ContactLaw::Linear { .. } | ContactLaw::Granular { .. } => AnyLaw::Grains(grains(law)),
        ContactLaw::HertzMindlin { .. } => AnyLaw::Spheres(spheres(law)),
        ContactLaw::Area { .. } => AnyLaw::Areas(areas(law)),
    }
}

/// `linear` has neither adhesion nor rolling friction.
fn grains(law: &ContactLaw) -> OfGrains {
    let (stress, rolling) = match *law {
        ContactLaw::Granular {
            adhesion,
            rolling_friction,
            ..
        } => (adhesion, rolling_friction),
        _ => (0.0, 0.0),
    };
    let Contact {
        normal: spring,
        tangent,
        dashpot,
    } = fast(law);
    Rolling {
        law: Contact {
            normal: Adhesive { spring, stress },
            tangent,
            dashpot,
        },
        friction: rolling,
    }
}

fn spheres(law: &ContactLaw) -> OfSpheres {
    let ContactLaw::HertzMindlin {
        hertz_constant,
        poisson_ratio,
        friction,
        restitution,
        adhesion,
    } = *law
    else {
        unreachable!("{KIND}")
    };
    let tangent = Mindlin {
        ratio: 2.0 * (1.0 - poisson_ratio) / (2.0 - poisson_ratio),
        friction,
    };
    Contact {
        normal: Adhesive {
            spring: Hertz {
                constant: hertz_constant,
            },
            stress: adhesion,
        },
        tangent: if friction > 0.0 {
            tangent
        } else {
            Mindlin::SMOOTH
        },
        dashpot: Tsuji {
            ratio: ratio_of_restitution(restitution),
        },
    }
}

fn areas(law: &ContactLaw) -> OfAreas {
    let ContactLaw::Area {
        area_stiffness,
        tangential_stiffness,
        friction,
    } = *law
    else {
        unreachable!("{KIND}")
    };
    Contact {
        normal: Area {
            stiffness: area_stiffness,
        },
        tangent: coulomb(tangential_stiffness, friction),
        dashpot: Viscous {
            ratio: 0.0,
            mass: 0.0,
        },
    }
}

/// Without friction there is no spring.
fn coulomb(stiffness: f64, friction: f64) -> Coulomb {
    if friction > 0.0 {
        Coulomb::new(stiffness, friction)
    } else {
        Coulomb::SMOOTH
    }
}

/// Normal stiffness of a law in N/m at an overlap of `overlap` (m).
pub fn normal_stiffness(law: &ContactLaw, overlap: f64) -> f64 {
    match *law {
        ContactLaw::Linear {
            normal_stiffness, ..
        }
        | ContactLaw::Granular {
            normal_stiffness, ..
        } => normal_stiffness,
        ContactLaw::HertzMindlin { hertz_constant, .. } => 1.5 * hertz_constant * overlap.sqrt(),
        ContactLaw::Area { area_stiffness, .. } => {
            area_stiffness * 2.0 * (2.0 * overlap * overlap).sqrt()
        }
    }
}
