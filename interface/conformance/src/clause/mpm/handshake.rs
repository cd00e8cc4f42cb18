//! Sections 2 and 3: from Hello to Ready.

use interface::config::{Fill, GroupConfig};
use interface::stage::{Message, Payload};
use interface::wire::StepHeader;

use super::scene::{DENSITY, MASS, MODULI, SPACING, block, group, material, points, scene, single};
use crate::bench::{Bench, Reply, configure};
use crate::clause::{Clause, session};
use crate::verdict::{Judgement, broken, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "S-2a",
        "says Hello first, as the party of its channels",
        session::hello,
    )
    .covers(&["C01"]),
    Clause::must("V-1a", "speaks this major version", session::version).covers(&["C01"]),
    Clause::must(
        "O-1a",
        "the process that was started is the one that says Hello",
        session::pid,
    )
    .of_processes(),
    Clause::must("S-6a", "Ready repeats the scene hash", hash).covers(&["C03"]),
    Clause::must(
        "S-7a",
        "has opened its line before Hello, all of its channels before Ready",
        opened,
    ),
    Clause::must(
        "S-2b",
        "Ready says how many points the configuration has",
        items,
    ),
    Clause::must(
        "S-2c",
        "Ready says the time in which a wave crosses a cell",
        courant,
    )
    .covers(&["C07"]),
    Clause::must(
        "S-2d",
        "Ready says the mass of the lightest point",
        lightest,
    )
    .covers(&["C07"]),
    Clause::must("S-8a", "refuses a cell of no size by its key", no_cell).covers(&["C36"]),
    Clause::must(
        "S-8b",
        "refuses a material that there is not by its key",
        no_material,
    )
    .covers(&["C36"]),
    Clause::should(
        "J-1a",
        "does not overlook a field that it does not know",
        unknown,
    )
    .covers(&["C02"]),
    Clause::must(
        "S-1a",
        "an order that does not decode ends the session",
        garbled,
    ),
    Clause::must(
        "S-4a",
        "the first order is Configure or nothing",
        session::no_configuration,
    ),
];

fn hash(bench: &Bench) -> Judgement {
    session::hash(bench, &single([0.0; 2]))
}

fn opened(bench: &Bench) -> Judgement {
    session::opened(bench, &single([0.0; 2]))
}

fn items(bench: &Bench) -> Judgement {
    let three = points(&[[0.1, 0.1], [0.2, 0.8], [0.7, 0.3]]);
    let config = scene(vec![three, block([0.4; 2], [0.0; 2])]);
    let items = bench.flow(&config)?.ready.readiness.items;
    require(items == 67, 67, items)?;
    Ok(format!("{items} points"))
}

/// Two materials, of which the lighter and softer one is the slower.
fn two_materials() -> interface::config::MpmConfig {
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
    let said = bench.flow(&config)?.ready.readiness.courant_time;
    let [k, g] = MODULI;
    // Of plane waves: c^2 = (K + 4 G/3) / rho.
    let c = ((k + 4.0 * g / 3.0) / DENSITY).sqrt();
    let expected = config.cell / c;
    near("courant_time in s", said, expected, 1e-12 * expected)?;
    Ok(format!("{said:.3e} s"))
}

fn lightest(bench: &Bench) -> Judgement {
    let said = bench.flow(&two_materials())?.ready.readiness.mass_min;
    near("mass_min in kg/m", said, 0.5 * MASS, 1e-12 * MASS)?;
    Ok(format!("{said} kg/m"))
}

fn refused(bench: &Bench, config: &impl serde::Serialize) -> Judgement {
    let mut session = bench.session()?;
    session.hello()?;
    match session.configure(&configure(config))? {
        Reply::Refused(refusal) if !refusal.key.is_empty() => Ok(refusal.to_string()),
        Reply::Refused(refusal) => Err(broken("a key", format_args!("`{refusal}`"))),
        Reply::Ready(_) => Err(broken("Refused", "Ready")),
    }
}

fn no_cell(bench: &Bench) -> Judgement {
    let mut config = single([0.0; 2]);
    config.cell = 0.0;
    refused(bench, &config)
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

fn unknown(bench: &Bench) -> Judgement {
    session::unknown_field(bench, &single([0.0; 2]))
}

fn garbled(bench: &Bench) -> Judgement {
    let mut session = bench.session()?;
    session.hello()?;
    let bytes = vec![0, 0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255];
    session.send(&Message::new(StepHeader::default(), Payload::Order(bytes)))?;
    Ok(session.failure()?.message)
}
