//! Laws by pairs of surfaces: each pair has its own numbers, everything else the law for all.

use crate::small_scenes::walls::wall;
use crate::small_scenes::*;
use interface::config::surfaces::ContactPair;
use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig};
use interface::solver::DemSolver;

fn pair(a: &str, b: &str, law: ContactLaw) -> ContactPair {
    ContactPair {
        between: [a.to_owned(), b.to_owned()],
        law,
    }
}

/// A rounded square of side 0.1 m that slides on the floor at 1 m/s around `x`.
fn block(x: f64, surface: &str) -> BodyConfig {
    BodyConfig {
        surface: surface.to_owned(),
        position: [x, 0.05],
        velocity: [1.0, 0.0],
        inertia: BodyInertia::Mass(2.0),
        ..body(rectangle_shape(0.08, 0.08), 0.01)
    }
}

fn law(friction: f64) -> ContactLaw {
    granular_law(1e5, 5e4, friction, 0.3, 0.0, 0.0)
}

fn two_blocks_on_a_floor(contact_pairs: Vec<ContactPair>) -> DemConfig {
    let floor = BodyConfig {
        surface: "floor".into(),
        ..wall("floor", [-1.0, -0.01], [5.0, -0.01], 0.01)
    };
    DemConfig {
        gravity: [0.0, -9.81],
        contact_pairs,
        skin: 0.002,
        ..scene(
            vec![floor, block(0.0, "wood"), block(2.0, "steel")],
            law(0.6),
        )
    }
}

/// Positions and velocities of all bodies after `steps` of 1e-4 s.
fn run(config: &DemConfig, steps: usize) -> Vec<[f64; 6]> {
    let mut dem = configured(config);
    let dt = 1e-4;
    for i in 0..steps {
        let mut step = step(if i == 0 { 0.0 } else { dt }, dt);
        step.measure = false;
        dem.contact(&step, &[], &mut []).unwrap();
        dem.advance(&step).unwrap();
    }
    let states = dem.bodies().state.iter();
    let numbers = states.map(|s| {
        let (c, v) = (s.center, s.velocity);
        [c.x, c.y, s.angle, v.x, v.y, s.spin]
    });
    numbers.collect()
}

/// Wood slides on the floor with 0.3, the rest with 0.6: each slows down by its own `mu g`.
#[test]
fn two_blocks_slide_with_their_own_friction() {
    let table = vec![pair("floor", "wood", law(0.3))];
    let config = two_blocks_on_a_floor(table);
    let steps = 1200;
    let after = run(&config, steps);
    let t = steps as f64 * 1e-4;
    for (b, mu) in [(1, 0.3), (2, 0.6)] {
        let expected = 1.0 - mu * 9.81 * t;
        assert!(
            (after[b][3] - expected).abs() < 0.01,
            "body {b}: {:?}, expected vx {expected}",
            after[b]
        );
    }
}

/// The table's type of law carries parts that the plain one does not have; with the same numbers it is the same law.
#[test]
fn a_table_of_one_law_is_that_law_to_the_bit() {
    let hertz = |restitution, friction| hertz_law(1e6, 0.3, friction, restitution, 0.0);
    let area = area_law(1e8, 0.0, 0.0);
    let laws = [
        law(0.6),
        spring(1e5),
        frictional(1e5, 5e4, 0.2),
        hertz(0.5, 0.4),
        hertz(1.0, 0.0),
        area,
    ];
    for law in laws {
        let plain = DemConfig {
            body_contact: Some(law),
            point_contact: law,
            ..two_blocks_on_a_floor(Vec::new())
        };
        let tabled = DemConfig {
            contact_pairs: vec![pair("wood", "floor", law), pair("steel", "steel", law)],
            ..plain.clone()
        };
        assert_eq!(run(&plain, 300), run(&tabled, 300), "{law:?}");
    }
}

/// A contact of a table whose laws are of different kinds is that of its own law to the bit, whatever the others are: what it
/// remembers of friction, dashpots and rolling too.
#[test]
fn kinds_may_differ_from_pair_to_pair() {
    let hertz = hertz_law(1e6, 0.3, 0.4, 0.5, 5.0);
    let area = area_law(1e8, 1e4, 0.3);
    let rolling = granular_law(1e5, 5e4, 0.5, 0.2, 2.0, 0.1);
    let alone = |law| {
        let config = DemConfig {
            body_contact: Some(law),
            ..two_blocks_on_a_floor(Vec::new())
        };
        run(&config, 600)
    };
    for [for_all, of_wood] in [
        [rolling, hertz],
        [hertz, rolling],
        [area, hertz],
        [law(0.6), area],
    ] {
        let mixed = DemConfig {
            body_contact: Some(for_all),
            ..two_blocks_on_a_floor(vec![pair("floor", "wood", of_wood)])
        };
        let both = run(&mixed, 600);
        assert_eq!(both[1], alone(of_wood)[1], "{of_wood:?}");
        assert_eq!(both[2], alone(for_all)[2], "{for_all:?}");
        assert_ne!(both[1][3], both[2][3]);
    }
}

/// Linear springs with `zeta` and Hertz springs with a restitution in one table: the larger ratio is declared. A restitution
/// of 0.6 is a ratio of 0.18086 (Schwager and Poeschel 2007).
#[test]
fn a_table_of_different_kinds_declares_its_largest_damping() {
    for (damping_ratio, restitution, largest) in [(0.1, 0.6, 0.18086), (0.25, 0.6, 0.25)] {
        let hertz = hertz_law(1e6, 0.0, 0.0, restitution, 0.0);
        let linear = linear_law(1e4, 0.0, 0.0, damping_ratio);
        let ball = BodyConfig {
            surface: "ball".into(),
            ..fixed(BodyShape::Disc, 0.1)
        };
        let config = DemConfig {
            point_surfaces: vec!["beam".into()],
            contact_pairs: vec![pair("beam", "ball", hertz)],
            ..scene(vec![ball], linear)
        };
        let declared = forces(&config, 0.01, &[at(0.0, 0.105)]).2.limits.damping;
        assert!((declared - largest).abs() < 1e-5, "{declared} {largest}");
    }
}

/// Adhesion of its own pair holds a block that hangs from a ceiling; with the law for all it falls.
#[test]
fn adhesion_belongs_to_a_pair() {
    let sticky = |adhesion| granular_law(1e5, 0.0, 0.0, 0.0, adhesion, 0.0);
    let ceiling = BodyConfig {
        surface: "ceiling".into(),
        ..wall("ceiling", [-1.0, 0.11], [5.0, 0.11], 0.01)
    };
    let hanging = |x: f64, surface: &str| BodyConfig {
        velocity: [0.0, 0.0],
        // Where the pull of 600 sqrt(xi) N at either corner and the spring balance: xi = (600/1e5)^2 m.
        position: [x, 0.05 + 3.6e-5],
        inertia: BodyInertia::Mass(0.01),
        ..block(x, surface)
    };
    let config = DemConfig {
        contact_pairs: vec![pair("ceiling", "wood", sticky(3e3))],
        gravity: [0.0, -9.81],
        skin: 0.002,
        ..scene(
            vec![ceiling, hanging(0.0, "wood"), hanging(2.0, "steel")],
            sticky(0.0),
        )
    };
    let after = run(&config, 2000);
    assert!(after[1][1] > 0.05, "{:?}", after[1]);
    assert!(after[2][1] < 0.0, "{:?}", after[2]);
}
