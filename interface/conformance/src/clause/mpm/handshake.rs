//! Sections 2 and 3: from Hello to Ready.

use interface::config::{Fill, GroupConfig, MpmConfig};

use super::scene::{DENSITY, MASS, MODULI, SPACING, block, group, material, points, scene};
use crate::bench::{Bench, Reply, configure};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, broken, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must("S-2c", "Ready has the number of points", items)
        .mutant("counts one point too many", || {
            change::ready(|ready| ready.items += 1)
        }),
    Clause::must(
        "S-2d",
        "Ready has the time in which a wave crosses a cell",
        courant,
    )
    .mutant("reports another time", || {
        change::ready(|ready| ready.courant_time *= 1.01)
    }),
    Clause::must("S-2e", "Ready has the mass of the lightest point", lightest)
        .mutant("reports the mass of two points", || {
            change::ready(|ready| ready.mass_min *= 2.0)
        }),
    Clause::must(
        "S-8b",
        "refuses an unknown material and names its key",
        no_material,
    )
    .mutant("uses the first material instead of an unknown one", || {
        Flaw::config(|config: &mut MpmConfig| {
            let materials = config.materials.len();
            for group in config.groups.iter_mut().filter(|g| g.material >= materials) {
                group.material = 0;
            }
        })
    }),
];

fn items(bench: &Bench) -> Judgement {
    let three = points(&[[0.1, 0.1], [0.2, 0.8], [0.7, 0.3]]);
    let config = scene(vec![three, block([0.4; 2], [0.0; 2])]);
    let items = bench.run_continuum(&config)?.ready.readiness.items;
    require(items == 67, 67, items)?;
    Ok(format!("{items} points"))
}

/// Two materials, of which the lighter and softer one is the slower.
fn two_materials() -> MpmConfig {
    let mut config = scene(vec![block([0.2; 2], [0.0; 2]), block([0.6; 2], [0.0; 2])]);
    let [k, g] = MODULI;
    config
        .materials
        .push(material(0.5 * DENSITY, [0.1 * k, 0.1 * g]));
    config.groups[1].material = 1;
    config
}

fn courant(bench: &Bench) -> Judgement {
    let config = two_materials();
    let said = bench.run_continuum(&config)?.ready.readiness.courant_time;
    let [k, g] = MODULI;
    // Of plane waves: c^2 = (K + 4 G/3) / rho.
    let c = ((k + 4.0 * g / 3.0) / DENSITY).sqrt();
    let expected = config.cell / c;
    near("courant_time in s", said, expected, 1e-12 * expected)?;
    Ok(format!("{said:.3e} s"))
}

fn lightest(bench: &Bench) -> Judgement {
    let said = bench
        .run_continuum(&two_materials())?
        .ready
        .readiness
        .mass_min;
    near("mass_min in kg/m", said, 0.5 * MASS, 1e-12 * MASS)?;
    Ok(format!("{said} kg/m"))
}

fn refused(bench: &Bench, config: &impl serde::Serialize) -> Judgement {
    let mut session = bench.greeted()?;
    match session.configure(&configure(config))? {
        Reply::Refused(refusal) if !refusal.key.is_empty() => Ok(refusal.to_string()),
        Reply::Refused(refusal) => Err(broken("a key", format_args!("`{refusal}`"))),
        Reply::Ready(_) => Err(broken("Refused", "Ready")),
    }
}

fn no_material(bench: &Bench) -> Judgement {
    let group = GroupConfig {
        material: 7,
        ..group(Fill::Disc {
            center: [0.5; 2],
            radius: 2.0 * SPACING,
        })
    };
    refused(bench, &scene(vec![group]))
}
