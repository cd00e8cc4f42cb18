//! Turns a configured law into a type: the one `match` over laws.

use interface::config::surfaces::ContactPair;
use interface::config::{ContactLaw, ratio_of_restitution};

use super::Law;
use super::contact::Contact;
use super::dashpot::{Dashpot, Elastic, Tsuji, Viscous};
use super::mixed::{AnyLaw, Mixed, OfGrains};
use super::normal::{Adhesive, Area, Hertz, Linear, Normal};
use super::rolling::Rolling;
use super::table::Table;
use super::tangent::{Coulomb, Mindlin, Smooth};
use crate::body::surfaces::Surfaces;

/// Something that is built from a law of any type.
pub trait ForLaw: Sized {
    /// The result.
    type Output;
    /// Builds it.
    fn build<L: Law>(self, law: L) -> Self::Output;
}

/// Builds something from `law`, which has been checked.
pub fn with_law<F: ForLaw>(law: &ContactLaw, build: F) -> F::Output {
    match *law {
        ContactLaw::Linear { .. } | ContactLaw::Granular { .. } => {
            let law = Granular::of(law);
            let (sticky, k_t, mu) = (law.normal(), law.tangential, law.friction);
            let zeta = law.dashpot();
            if law.rolling > 0.0 {
                let friction = law.rolling;
                with_damping(sticky, k_t, mu, zeta, WithRolling { friction, build })
            } else if law.adhesion > 0.0 {
                with_damping(sticky, k_t, mu, zeta, build)
            } else {
                with_damping(sticky.spring, k_t, mu, zeta, build)
            }
        }
        ContactLaw::HertzMindlin {
            hertz_constant,
            poisson_ratio,
            friction,
            restitution,
            adhesion,
        } => {
            let spring = Hertz {
                constant: hertz_constant,
            };
            let tangent = mindlin(poisson_ratio, friction);
            let ratio = ratio_of_restitution(restitution);
            if adhesion > 0.0 {
                let stress = adhesion;
                with_mindlin(Adhesive { spring, stress }, tangent, ratio, build)
            } else {
                with_mindlin(spring, tangent, ratio, build)
            }
        }
        ContactLaw::Area {
            area_stiffness,
            tangential_stiffness,
            friction,
        } => {
            let normal = Area {
                stiffness: area_stiffness,
            };
            with_coulomb(normal, tangential_stiffness, friction, Elastic, build)
        }
    }
}

/// Builds something from a table of laws, which have been checked: `for_all`, and others for `pairs`. If all laws are
/// of one kind, no loop branches on the kind. Every part that a kind of law can have is present. Its number is zero for
/// pairs that do not use it.
pub fn with_table<F: ForLaw>(
    surfaces: &Surfaces,
    for_all: &ContactLaw,
    pairs: &[&ContactPair],
    build: F,
) -> F::Output {
    if pairs.iter().any(|pair| !pair.law.is_like(for_all)) {
        return build.build(Mixed(Table::new(surfaces, for_all, pairs, of_any_kind)));
    }
    match for_all {
        ContactLaw::Linear { .. } | ContactLaw::Granular { .. } => {
            let rolls = |law: &ContactLaw| Granular::of(law).rolling > 0.0;
            if rolls(for_all) || pairs.iter().any(|pair| rolls(&pair.law)) {
                build.build(Table::new(surfaces, for_all, pairs, rolling))
            } else {
                let law = |law: &ContactLaw| Granular::of(law).contact();
                build.build(Table::new(surfaces, for_all, pairs, law))
            }
        }
        ContactLaw::HertzMindlin { .. } => {
            build.build(Table::new(surfaces, for_all, pairs, hertz_mindlin))
        }
        ContactLaw::Area { .. } => build.build(Table::new(surfaces, for_all, pairs, area)),
    }
}

/// The numbers of a law `linear` or `granular`; `linear` has neither adhesion nor rolling friction.
struct Granular {
    stiffness: f64,
    tangential: f64,
    friction: f64,
    damping: f64,
    damped_mass: f64,
    adhesion: f64,
    rolling: f64,
}

/// Message of an assertion that laws were matched by kind before.
const KIND: &str = "a table's laws are of one kind";

fn rolling(law: &ContactLaw) -> OfGrains {
    Rolling {
        law: Granular::of(law).contact(),
        friction: Granular::of(law).rolling,
    }
}

fn of_any_kind(law: &ContactLaw) -> AnyLaw {
    match law {
        ContactLaw::Linear { .. } | ContactLaw::Granular { .. } => AnyLaw::Grains(rolling(law)),
        ContactLaw::HertzMindlin { .. } => AnyLaw::Spheres(hertz_mindlin(law)),
        ContactLaw::Area { .. } => AnyLaw::Areas(area(law)),
    }
}

impl Granular {
    fn of(law: &ContactLaw) -> Self {
        let number = |name: &str| law.number(name).unwrap_or(0.0);
        Self {
            stiffness: number("normal_stiffness"),
            tangential: number("tangential_stiffness"),
            friction: number("friction"),
            damping: number("damping_ratio"),
            damped_mass: number("damped_mass"),
            adhesion: number("adhesion"),
            rolling: number("rolling_friction"),
        }
    }

    fn normal(&self) -> Adhesive<Linear> {
        Adhesive {
            spring: Linear {
                stiffness: self.stiffness,
            },
            stress: self.adhesion,
        }
    }

    fn contact(&self) -> Contact<Adhesive<Linear>, Coulomb, Viscous> {
        Contact {
            normal: self.normal(),
            tangent: coulomb(self.tangential, self.friction),
            dashpot: self.dashpot(),
        }
    }

    fn dashpot(&self) -> Viscous {
        Viscous {
            ratio: self.damping,
            mass: self.damped_mass,
        }
    }
}

/// Without friction there is no spring, as for a law without a table.
fn coulomb(stiffness: f64, friction: f64) -> Coulomb {
    if friction > 0.0 {
        Coulomb::new(stiffness, friction)
    } else {
        Coulomb::SMOOTH
    }
}

fn hertz_mindlin(law: &ContactLaw) -> Contact<Adhesive<Hertz>, Mindlin, Tsuji> {
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
    Contact {
        normal: Adhesive {
            spring: Hertz {
                constant: hertz_constant,
            },
            stress: adhesion,
        },
        tangent: if friction > 0.0 {
            mindlin(poisson_ratio, friction)
        } else {
            Mindlin::SMOOTH
        },
        dashpot: Tsuji {
            ratio: ratio_of_restitution(restitution),
        },
    }
}

fn mindlin(poisson_ratio: f64, friction: f64) -> Mindlin {
    Mindlin {
        ratio: 2.0 * (1.0 - poisson_ratio) / (2.0 - poisson_ratio),
        friction,
    }
}

fn area(law: &ContactLaw) -> Contact<Area, Coulomb, Elastic> {
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
        dashpot: Elastic,
    }
}

fn with_damping<N: Normal, F: ForLaw>(
    normal: N,
    k_t: f64,
    friction: f64,
    dashpot: Viscous,
    build: F,
) -> F::Output {
    if dashpot.ratio > 0.0 {
        with_coulomb(normal, k_t, friction, dashpot, build)
    } else {
        with_coulomb(normal, k_t, friction, Elastic, build)
    }
}

fn with_coulomb<N: Normal, D: Dashpot, F: ForLaw>(
    normal: N,
    k_t: f64,
    friction: f64,
    dashpot: D,
    build: F,
) -> F::Output {
    if friction > 0.0 {
        let tangent = Coulomb::new(k_t, friction);
        build.build(Contact {
            normal,
            tangent,
            dashpot,
        })
    } else {
        let tangent = Smooth;
        build.build(Contact {
            normal,
            tangent,
            dashpot,
        })
    }
}

fn with_mindlin<N: Normal, F: ForLaw>(
    normal: N,
    tangent: Mindlin,
    ratio: f64,
    build: F,
) -> F::Output {
    let smooth = Smooth;
    match (tangent.friction > 0.0, ratio > 0.0) {
        (true, true) => build.build(Contact {
            normal,
            tangent,
            dashpot: Tsuji { ratio },
        }),
        (true, false) => build.build(Contact {
            normal,
            tangent,
            dashpot: Elastic,
        }),
        (false, true) => build.build(Contact {
            normal,
            tangent: smooth,
            dashpot: Tsuji { ratio },
        }),
        (false, false) => build.build(Contact {
            normal,
            tangent: smooth,
            dashpot: Elastic,
        }),
    }
}

/// Adds rolling resistance to a law of any type.
struct WithRolling<F> {
    friction: f64,
    build: F,
}

impl<F: ForLaw> ForLaw for WithRolling<F> {
    type Output = F::Output;
    fn build<L: Law>(self, law: L) -> F::Output {
        let friction = self.friction;
        self.build.build(Rolling { law, friction })
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
