//! What the kit's random cases do not show of a saved state (`kit.rs`): another number of threads goes on from it to the same bits, and
//! a branch with other laws and motions; the state of another configuration is refused by name.

use dem_proc::Sdem;
use interface::config::{BodyConfig, BodyShape, ContactLaw, DemConfig, GroupPair, Motion};
use interface::solver::DemSolver;

use crate::small_scenes::*;

/// Step in s.
const DT: f64 = 1e-4;
const LINEAR: ContactLaw = ContactLaw::linear(1e5, 5e4, 0.3, 0.2);
const HERTZ: ContactLaw = hertz_law(2e6, 0.3, 0.3, 0.7, 0.0);
/// Distance of neighbours in m, and discs along each side.
const APART: f64 = 0.0215;
const SIDE: usize = 76;

/// Discs that fly at one another: more contacts than one thread does alone. Many are as far apart as the list reaches, so that no
/// two lists are alike. The first one is fixed.
fn crowd(side: usize) -> DemConfig {
    let mut random = Random::new(17);
    let disc = |i: usize| BodyConfig {
        name: format!("disc {i}"),
        position: [i % side, i / side].map(|x| APART * x as f64 + random.between(-7e-4, 7e-4)),
        velocity: [random.between(-1.0, 1.0), random.between(-1.0, 1.0)],
        spin: random.between(-5.0, 5.0),
        ..body(BodyShape::Disc, 0.01)
    };
    let mut config = scene((0..side * side).map(disc).collect(), LINEAR);
    (config.bodies[0].motion, config.bodies[0].velocity) = (Motion::Fixed, [0.0; 2]);
    config.bodies[0].spin = 0.0;
    config.gravity = [0.0, -9.81];
    config.skin = 0.002;
    config
}

/// A point in each gap, near all four discs around it.
fn in_gaps(side: usize) -> Points {
    let point = |i: usize| {
        let [x, y] = [i % (side - 1), i / (side - 1)].map(|k| APART * (k as f64 + 0.5));
        (info(i as u64, 0.0055, 0.01), at(x, y))
    };
    let gaps = (side - 1) * (side - 1);
    Points::new(&(0..gaps).map(point).collect::<Vec<_>>())
}

/// A solver and points that have done so many steps.
fn under_way(side: usize, steps: usize) -> (Sdem, Points) {
    let (mut dem, mut points) = (configured(&crowd(side)), in_gaps(side));
    dem.imp_set(&points.set);
    points.step(&mut dem, &OPENING);
    for _ in 0..steps {
        points.step(&mut dem, &step(DT, DT));
    }
    (dem, points)
}

/// A solver of another configuration that has taken over the state of this one.
fn taken_over(config: &DemConfig, from: &Sdem) -> Sdem {
    let mut dem = Sdem::default();
    dem.configure(config).unwrap();
    dem.restore(&from.save().unwrap()).unwrap();
    dem
}

#[test]
fn a_state_goes_from_one_thread_to_others() {
    let (mut straight, mut points) = under_way(SIDE, 20);
    let mut others = [2, 3].map(|threads| {
        let config = DemConfig {
            threads,
            ..crowd(SIDE)
        };
        (taken_over(&config, &straight), points.clone())
    });
    for i in 0..20 {
        let taken = |dem: &mut Sdem, points: &mut Points| {
            let answer = points.step(dem, &step(DT, DT));
            (answer, points.forces.clone(), dem.measurement().clone())
        };
        let expected = taken(&mut straight, &mut points);
        for (dem, points) in &mut others {
            assert!(taken(dem, points) == expected, "step {i} differs");
        }
    }
}

/// What another configuration has otherwise.
type Change = fn(&mut DemConfig);

#[test]
fn the_state_of_another_configuration_is_refused_by_what_differs() {
    let bytes = under_way(4, 5).0.save().unwrap();
    let refused = |config: &DemConfig, bytes: &[u8]| {
        let mut dem = configured(config);
        let refusal = dem.restore(bytes).unwrap_err();
        assert_eq!(refusal.key, "restore");
        // As it was: no points are expected, and a step can be done.
        go(&mut dem, true, DT);
        refusal.message
    };
    let rows: [(Change, &str); 5] = [
        (|c| c.body_contact = None, "`body_contact = true`"),
        (|c| c.skin = 0.005, "`coupling.skin ="),
        (
            |c| {
                c.group_pairs.push(GroupPair {
                    between: [0, 1],
                    law: LINEAR,
                });
            },
            "`group_pair =",
        ),
        (|c| c.bodies[4].sphero_radius *= 1.1, "`dem.body.4 ="),
        (
            |c| c.bodies.truncate(14),
            "has `dem.body.14`, this configuration has none",
        ),
    ];
    for (change, what) in rows {
        let mut other = crowd(4);
        change(&mut other);
        let message = refused(&other, &bytes);
        assert!(message.contains(what), "{message}");
    }
    let unconfigured = Sdem::default().restore(&bytes).unwrap_err();
    assert!(unconfigured.message.contains("has `body_contact`"));
    let of_nobody = refused(&crowd(4), &Sdem::default().save().unwrap());
    assert!(of_nobody.contains("no `body_contact`"), "{of_nobody}");
    let of_another = interface::saved::pack("tandem-mpm 1", &0);
    let message = refused(&crowd(4), &of_another);
    assert!(message.contains("tandem-mpm 1"), "{message}");
}

/// A branch: bodies and points as they were, other laws, gravity and motions from here on.
#[test]
fn a_configuration_with_other_laws_and_motions_goes_on_from_the_state() {
    let (before, mut points) = under_way(4, 30);
    let mut other = crowd(4);
    other.gravity = [0.0, -1.0];
    (other.point_contact, other.body_contact) = (HERTZ, Some(HERTZ));
    (other.bodies[0].motion, other.bodies[0].velocity) = (Motion::Driven, [3.0, 0.5]);
    let mut dem = taken_over(&other, &before);
    for (b, (is, was)) in dem
        .bodies()
        .state
        .iter()
        .zip(&before.bodies().state)
        .enumerate()
    {
        let velocity = if b == 0 {
            [3.0, 0.5].into()
        } else {
            was.velocity
        };
        assert_eq!((is.velocity, is.center), (velocity, was.center), "{b}");
    }
    for _ in 0..20 {
        points.step(&mut dem, &step(DT, DT));
    }
}

/// Whose contacts would else see it move on for ever.
#[test]
fn a_belt_that_a_branch_stops_stands_still() {
    let belt = |motion: Motion, speed: f64| BodyConfig {
        motion,
        position: [0.0, -0.1],
        velocity: [speed, 0.0],
        ..body(rectangle_shape(20.0, 0.2), 0.01)
    };
    let block = BodyConfig {
        position: [0.0, 0.0499],
        velocity: [1.0, 0.0],
        ..body(rectangle_shape(0.1, 0.06), 0.01)
    };
    let of = |belt: BodyConfig| {
        let mut config = scene(vec![belt, block.clone()], LINEAR);
        config.gravity = [0.0, -9.81];
        config
    };
    let mut moving = configured(&of(belt(Motion::Driven, 1.0)));
    go(&mut moving, true, DT);
    go(&mut moving, false, DT);
    let mut stopped = taken_over(&of(belt(Motion::Fixed, 0.0)), &moving);
    (0..3000).for_each(|_| go(&mut stopped, false, DT));
    let slowed = 1.0 - stopped.bodies().state[1].velocity.x;
    assert!((slowed / (0.3 * 9.81 * 0.3) - 1.0).abs() < 0.02, "{slowed}");
}
