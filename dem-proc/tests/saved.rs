//! A saved state is the whole state: a fresh solver that takes it over goes on to the same bits. Bytes that are no state of
//! its configuration are refused by name.

use crate::mixtures::{Cloud, HERTZ, LINEAR, TestRun, crowd, scene};
use dem_proc::Sdem;
use interface::config::{DemConfig, GroupPair, Motion};
use interface::solver::{DemSolver, Refusal};

#[test]
fn a_state_goes_from_one_thread_to_others() {
    let mut straight = TestRun::new(&crowd(), Cloud::in_gaps());
    for _ in 0..20 {
        straight.step();
    }
    let mut others = [2, 3].map(|threads| {
        let config = DemConfig { threads, ..crowd() };
        let mut other = TestRun::new(&config, Cloud::in_gaps());
        other.dem.restore(&straight.dem.save().unwrap()).unwrap();
        (other.points, other.done) = (straight.points.clone(), straight.done);
        other
    });
    for i in 0..20 {
        let expected = straight.step();
        for other in &mut others {
            assert!(other.step() == expected, "step {i} differs");
        }
    }
}

/// A state in the middle of a scene, with 60 points.
fn state(config: &DemConfig) -> (Vec<u8>, TestRun) {
    let mut run = TestRun::new(config, Cloud::new(60));
    for _ in 0..30 {
        run.step();
    }
    (run.dem.save().unwrap(), run)
}

fn refused(config: &DemConfig, bytes: &[u8]) -> Refusal {
    let mut dem = Sdem::default();
    dem.configure(config).unwrap();
    let refusal = dem.restore(bytes).unwrap_err();
    assert_eq!(refusal.key, "restore");
    // As it was: no points are expected, and a step can be done.
    let mut run = TestRun::new(config, Cloud::default());
    run.dem = dem;
    run.done = 1;
    run.step();
    refusal
}

#[test]
fn the_state_of_another_configuration_is_refused_by_what_differs() {
    let config = scene();
    let (bytes, _) = state(&config);
    let other = |change: &dyn Fn(&mut DemConfig)| {
        let mut other = config.clone();
        change(&mut other);
        refused(&other, &bytes).message
    };
    let named = [
        (other(&|c| c.body_contact = None), "`body_contact = true`"),
        (other(&|c| c.skin = 0.005), "`coupling.skin ="),
        (
            other(&|c| {
                c.group_pairs.push(GroupPair {
                    between: [0, 1],
                    law: LINEAR,
                });
            }),
            "`group_pair =",
        ),
        (
            other(&|c| c.bodies[4].sphero_radius *= 1.1),
            "`dem.body.4 =",
        ),
        (
            other(&|c| c.bodies.truncate(14)),
            "has `dem.body.14`, this configuration has none",
        ),
    ];
    for (message, what) in named {
        assert!(message.contains(what), "{message}");
    }
    let unconfigured = Sdem::default().restore(&bytes).unwrap_err();
    assert!(
        unconfigured.message.contains("has `body_contact`"),
        "{unconfigured}"
    );
    let of_nobody = refused(&config, &Sdem::default().save().unwrap());
    assert!(
        of_nobody.message.contains("no `body_contact`"),
        "{of_nobody}"
    );
    let of_another = interface::saved::pack("tandem-mpm 1", &0);
    let message = refused(&config, &of_another).message;
    assert!(message.contains("tandem-mpm 1"), "{message}");
}

/// A branch: bodies and points as they were, other laws, gravity and motions from here on.
#[test]
fn a_configuration_with_other_laws_and_motions_goes_on_from_the_state() {
    let config = scene();
    let (bytes, run) = state(&config);
    let mut other = config.clone();
    other.gravity = [0.0, -1.0];
    other.point_contact = HERTZ;
    other.body_contact = Some(HERTZ);
    let held = |b: &&mut interface::config::BodyConfig| b.motion.yielding() == [0.0; 3];
    let gate = other.bodies.iter_mut().find(held).expect("a held body");
    (gate.motion, gate.velocity) = (Motion::Driven, [3.0, 0.5]);
    let (name, mut dem) = (gate.name.clone(), Sdem::default());
    dem.configure(&other).unwrap();
    dem.restore(&bytes).unwrap();
    let (was, is) = (run.dem.bodies(), dem.bodies());
    for (b, body) in is.properties.iter().enumerate() {
        let velocity = if body.name == name {
            [3.0, 0.5].into()
        } else {
            was.state[b].velocity
        };
        assert_eq!(is.state[b].velocity, velocity, "{}", body.name);
        assert_eq!(is.state[b].center, was.state[b].center);
    }
    let mut branch = TestRun::new(&other, Cloud::default());
    (branch.dem, branch.points, branch.done) = (dem, run.points.clone(), run.done);
    for _ in 0..20 {
        branch.step();
    }
}

/// The hash of a checkpoint decides about bytes that were changed; what ends too early is told here too.
#[test]
fn a_part_of_a_state_is_refused() {
    let config = scene();
    let (bytes, _) = state(&config);
    for share in 0..20 {
        let part = &bytes[..bytes.len() * share / 20];
        refused(&config, part);
    }
}
