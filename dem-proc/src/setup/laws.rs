//! Turns a configured law into a value of its type, and contacts by it: the one `match` over laws.

use interface::config::surfaces::ContactPair;
use interface::config::{ContactLaw, ratio_of_restitution};

use crate::body::surfaces::Surfaces;
use crate::contact::engine::{Contacts, PairKind};
use crate::contact::side::Side;
use crate::law::contact::Contact;
use crate::law::dashpot::{Tsuji, Viscous};
use crate::law::mixed::AnyLaw;
use crate::law::normal::{Adhesive, Area, Hertz, Linear};
use crate::law::rolling::Rolling;
use crate::law::table::Table;
use crate::law::tangent::{Coulomb, Mindlin};

/// Contacts in pairs of a kind, with a skin in m, by `for_all` and by the laws of `pairs` for their surfaces; all have been checked.
/// Every law is a value of one of few types, in a table by pairs of surfaces, with zeros for the parts that it does not use. A
/// type for every combination of parts would be faster by a few per cent where parts are missing, and would double the
/// compile time. Only a linear spring without adhesion and rolling has no table, where it holds for all pairs: no
/// contact stores it.
pub fn with_laws<K: PairKind>(
    surfaces: &Surfaces,
    (for_all, pairs): (&ContactLaw, &[&ContactPair]),
    (kind, skin): (K, f64),
) -> Box<dyn Side> {
    match value(for_all) {
        AnyLaw::Grains(Rolling { law, friction: 0.0 })
            if pairs.is_empty() && law.normal.stress == 0.0 =>
        {
            let law = Contact {
                normal: law.normal.spring,
                tangent: law.tangent,
                dashpot: law.dashpot,
            };
            Box::new(Contacts::new(law, kind, skin))
        }
        _ => with_table(surfaces, (for_all, pairs), (kind, skin)),
    }
}

/// The same with a table in any case, for code that need not be fast. If all laws are of one kind, no loop branches on
/// the kind.
pub fn with_table<K: PairKind>(
    surfaces: &Surfaces,
    (for_all, pairs): (&ContactLaw, &[&ContactPair]),
    (kind, skin): (K, f64),
) -> Box<dyn Side> {
    let table = Table::new(surfaces, for_all, pairs, value);
    let grains = table.of(|law| match law {
        AnyLaw::Grains(law) => Some(law),
        _ => None,
    });
    let spheres = table.of(|law| match law {
        AnyLaw::Spheres(law) => Some(law),
        _ => None,
    });
    let areas = table.of(|law| match law {
        AnyLaw::Areas(law) => Some(law),
        _ => None,
    });
    match (grains, spheres, areas) {
        (Some(grains), _, _) => {
            match grains.of(|Rolling { law, friction }| (friction == 0.0).then_some(law)) {
                Some(forces) => Box::new(Contacts::new(forces, kind, skin)),
                None => Box::new(Contacts::new(grains, kind, skin)),
            }
        }
        (_, Some(spheres), _) => Box::new(Contacts::new(spheres, kind, skin)),
        (_, _, Some(areas)) => Box::new(Contacts::new(areas, kind, skin)),
        _ => Box::new(Contacts::new(table, kind, skin)),
    }
}

/// A configured law as a value of its type. `linear` has neither adhesion nor rolling friction.
fn value(law: &ContactLaw) -> AnyLaw {
    match *law {
        ContactLaw::Linear {
            normal_stiffness,
            tangential_stiffness,
            friction,
            damping_ratio,
            damped_mass,
        } => value(&ContactLaw::Granular {
            normal_stiffness,
            tangential_stiffness,
            friction,
            damping_ratio,
            damped_mass,
            adhesion: 0.0,
            rolling_friction: 0.0,
        }),
        ContactLaw::Granular {
            normal_stiffness,
            tangential_stiffness,
            friction,
            damping_ratio,
            damped_mass,
            adhesion,
            rolling_friction,
        } => AnyLaw::Grains(Rolling {
            law: Contact {
                normal: Adhesive {
                    spring: Linear {
                        stiffness: normal_stiffness,
                    },
                    stress: adhesion,
                },
                tangent: Coulomb::new(tangential_stiffness, friction),
                dashpot: Viscous {
                    ratio: damping_ratio,
                    mass: damped_mass,
                },
            },
            friction: rolling_friction,
        }),
        ContactLaw::HertzMindlin {
            hertz_constant,
            poisson_ratio,
            friction,
            restitution,
            adhesion,
        } => AnyLaw::Spheres(Contact {
            normal: Adhesive {
                spring: Hertz {
                    constant: hertz_constant,
                },
                stress: adhesion,
            },
            tangent: Mindlin {
                ratio: if friction > 0.0 {
                    2.0 * (1.0 - poisson_ratio) / (2.0 - poisson_ratio)
                } else {
                    0.0 // without friction there is no spring
                },
                friction,
            },
            dashpot: Tsuji {
                ratio: ratio_of_restitution(restitution),
            },
        }),
        ContactLaw::Area {
            area_stiffness,
            tangential_stiffness,
            friction,
        } => AnyLaw::Areas(Contact {
            normal: Area {
                stiffness: area_stiffness,
            },
            tangent: Coulomb::new(tangential_stiffness, friction),
            dashpot: Viscous {
                ratio: 0.0,
                mass: 0.0,
            },
        }),
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
