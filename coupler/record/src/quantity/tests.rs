//! Tests of the quantities.

use super::*;
use crate::ledger::Moving;

/// Values of some quantities of the measurement below.
const EXPECTED: [(&str, f64); 43] = [
    ("time", 0.25),
    ("t", 0.25),
    ("energy.kinetic", 11.0),
    ("energy.rotation", 20.0),
    ("energy.transfer", 1.5),
    ("energy.transfer_relative", 1.5 / 75.0),
    ("energy.total", 74.0),
    ("energy.residual", 74.0),
    ("energy.residual_relative", 74.0 / 75.0),
    ("energy.stress_work", 2.25),
    ("energy.work_gap", 0.25),
    ("energy.work_gap_relative", 0.25 / 75.0),
    ("momentum.y", 4.0),
    ("momentum_error", 0.5),
    ("angular_momentum", 5.0),
    ("angular_momentum_error", 0.5),
    ("contact.force.x", 3.0),
    ("points.disc.vx", 7.0),
    ("points.disc.xmax", 9.0),
    ("points.disc.ymax", 11.0),
    ("points.disc.contacts", 12.0),
    ("probe.middle.x", 5.0),
    ("probe.middle.uy", -1.5),
    ("probe.middle.vy", 2.5),
    ("probe.middle.fx", 21.0),
    ("probe.edge.ux", 0.25),
    ("hold.left.y", 9.0),
    ("hold.left.fx", 22.0),
    ("hold.left.fy", 23.0),
    ("body.target.kinetic", 31.0),
    ("body.target.torque", 13.0),
    ("body.target.contact_fx", 17.0),
    ("body.target.contact_fy", 18.0),
    ("body.target.contact_torque", 19.0),
    ("body.floor.mass", 0.0),
    ("fill.grains.x", 2.0),
    ("fill.grains.y", 4.0),
    ("fill.grains.vy", 1.0),
    ("fill.grains.mass", 4.0),
    ("fill.grains.kinetic", 2.0),
    ("fill.grains.spread", 1.5),
    ("fill.grains.xmax", 5.0),
    ("fill.grains.ymin", 2.0),
];

/// The quantities of a scene, and what makes a sample of such quantities, after a first one or as the first.
#[expect(clippy::too_many_lines, reason = "a table")]
fn measured() -> (Quantities, impl Fn(&Quantities, bool) -> Vec<f64>) {
    let quantities = Quantities::new(
        ["disc"],
        [&["edge", "middle"], &["left"], &[]],
        ["floor", "target"],
        [("grains", 2)],
    );
    let mpm = Ledger {
        kinetic: 1.0,
        elastic: 2.0,
        contact_force: [3.0, 4.0],
        momentum: [3.0, 4.0],
        angular_momentum: 5.0,
        driven_work: 0.5,
        stress_work: 2.25,
        transfer_work: 1.5,
        ..Ledger::default()
    };
    let dem = Ledger {
        kinetic: 10.0,
        kinetic_rotation: 20.0,
        friction_work: 40.0,
        ..Ledger::default()
    };
    let group = GroupState {
        mass: 1.0,
        velocity: [7.0, 8.0],
        upper: [9.0, 11.0],
        contacts: 12,
        ..GroupState::default()
    };
    let edge = GroupState {
        mass: 1.0,
        position: [1.25, 2.0],
        ..GroupState::default()
    };
    let middle = GroupState {
        mass: 1.0,
        position: [5.0, 6.5],
        velocity: [1.5, 2.5],
        contact_force: [21.0, 0.0],
        ..GroupState::default()
    };
    let left = GroupState {
        mass: 1.0,
        position: [0.0, 9.0],
        contact_force: [22.0, 23.0],
        ..GroupState::default()
    };
    let target = BodyState {
        velocity: [3.0, 4.0],
        mass: 2.0,
        spin: 2.0,
        inertia: 3.0,
        point_torque: 13.0,
        body_force: [17.0, 18.0],
        body_torque: 19.0,
        ..BodyState::default()
    };
    let grain = |x: f64, mass: f64| BodyState {
        position: [x, 2.0 * x],
        velocity: [0.0, 1.0],
        mass,
        ..BodyState::default()
    };
    let mut balance = Balance::default();
    balance.keeps_stress_work = true;
    let moving = Moving {
        momentum: 10.0,
        angular_momentum: 10.0,
        ..Moving::default()
    };
    balance.take(&Ledger::default(), &Ledger::default(), &Moving::default());
    balance.take(&mpm, &dem, &moving);
    let ledgers = Ledgers {
        time: 0.25,
        mpm,
        dem,
        balance,
    };
    let groups = [group, edge, middle, left];
    let bodies = [
        BodyState::default(),
        target,
        grain(1.0, 3.0),
        grain(5.0, 1.0),
    ];
    let mut first = vec![0.0; quantities.names.len()];
    for (name, value) in [
        ("probe.edge.x", 1.0),
        ("probe.edge.y", 2.0),
        ("probe.middle.x", 5.0),
        ("probe.middle.y", 8.0),
    ] {
        first[quantities.index(name).expect("a quantity")] = value;
    }
    let sample = move |quantities: &Quantities, is_first: bool| {
        let first = if is_first { &[][..] } else { &first };
        quantities.sample(&ledgers, &groups, &bodies, first)
    };
    (quantities, sample)
}

#[test]
fn every_value_stands_at_the_index_of_its_name() {
    let (quantities, sample) = measured();
    let later = sample(&quantities, false);
    for (name, expected) in EXPECTED {
        let index = quantities.index(name).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(later[index], expected, "{name}");
    }
    assert_eq!(later.len(), quantities.names.len());
    // In the first sample nothing has moved.
    let moved = quantities.index("probe.middle.uy").expect("a quantity");
    assert_eq!(sample(&quantities, true)[moved], 0.0);
    assert_eq!(quantities.index("body.targt.vx"), None);
}

#[test]
fn a_slice_has_its_share_of_what_is_counted() {
    let (quantities, sample) = measured();
    // A slice of half a metre has half of every extensive quantity, and the same positions, speeds and ratios.
    let whole = sample(&quantities, false);
    let half = sample(&quantities.clone().of_slice(Some(0.5)), false);
    for name in [
        "energy.total",
        "momentum.y",
        "contact.force.x",
        "probe.middle.fx",
        "body.target.inertia",
        "body.target.torque",
        "fill.grains.mass",
    ] {
        let index = quantities.index(name).expect("a quantity");
        assert_eq!(half[index], 0.5 * whole[index], "{name}");
    }
    for name in [
        "time",
        "energy.residual_relative",
        "probe.middle.uy",
        "body.target.spin",
    ] {
        let index = quantities.index(name).expect("a quantity");
        assert_eq!(half[index], whole[index], "{name}");
    }
}

/// Of a scene in which nothing moves.
fn nothing() -> Ledgers {
    Ledgers {
        time: 0.0,
        mpm: Ledger::default(),
        dem: Ledger::default(),
        balance: Balance::default(),
    }
}

/// Points that are gone were at 0, and a displacement was between the means of different points.
#[test]
fn what_has_left_has_no_place() {
    let one = [&["p"][..], &["h"], &["c"]];
    let quantities = Quantities::new(["a"], one, [], []).of_slice(Some(0.5));
    let sample = |mass: f64, x: f64, first: &[f64]| {
        let state = GroupState {
            mass,
            position: [x; 2],
            ..GroupState::default()
        };
        quantities.sample(&nothing(), &[state; 4], &[], first)
    };
    let names = "points.a.x points.a.vy points.a.xmin points.a.ymax points.a.mass probe.p.x \
                 probe.p.ux probe.p.vy hold.h.y chain.c.x";
    let first = sample(2.0, 1.0, &[]);
    for (mass, expected) in [
        (2.0, "4 0 0 0 1 4 3 0 4 4"),
        (1.0, "4 0 0 0 0.5 4 NaN 0 4 4"),
        (0.0, "NaN NaN NaN NaN 0 NaN NaN NaN NaN 4"),
    ] {
        let later = sample(mass, 4.0, &first);
        let value = |name| later[quantities.index(name).expect("a quantity")].to_string();
        let values: Vec<String> = names.split(' ').map(value).collect();
        assert_eq!(values.join(" "), expected);
    }
}

/// A check of a quantity that the continuum does not report must not pass.
#[test]
fn a_work_gap_without_the_capability_is_nan() {
    let quantities = Quantities::new([], [&[], &[], &[]], [], []);
    let sample = quantities.sample(&nothing(), &[], &[], &[]);
    for name in ["energy.work_gap", "energy.stress_work"] {
        let index = quantities.index(name).expect("a quantity");
        assert!(sample[index].is_nan(), "{name}");
    }
}

/// `UPDATE_QUANTITIES=1` writes it.
#[test]
fn the_table_of_the_manual_lists_the_rows() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/quantities.csv");
    let made = Quantities::reference();
    if std::env::var_os("UPDATE_QUANTITIES").is_some() {
        std::fs::write(path, &made).expect("a table that can be written");
    }
    let there = std::fs::read_to_string(path).expect("the table");
    let help = "docs/quantities.csv does not list the quantities: UPDATE_QUANTITIES=1 writes it";
    assert!(there == made, "{help}");
}
