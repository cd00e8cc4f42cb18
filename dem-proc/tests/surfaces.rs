//! Laws by pairs of surfaces of different kinds.

use crate::small_scenes::walls::wall;
use crate::small_scenes::*;
use interface::config::surfaces::ContactPair;
use interface::config::{BodyConfig, BodyInertia, ContactLaw, DemConfig};
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
