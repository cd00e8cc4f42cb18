//! A saved state is the whole state: a fresh solver that takes it over goes on to the same bits. Bytes that are no state of
//! its configuration are refused by name.

use crate::mixtures::{Cloud, HERTZ, LINEAR, TestRun, all, crowd, scene};
use dem_proc::Sdem;
use interface::config::{DemConfig, Motion, OverlapMeasure};
use interface::solver::{DemSolver, Refusal};

/// A run that is saved before each of `steps` steps, right after a new set where there is one, and is then resumed from
/// each of these states and compared with the one that went on, over `after` steps.
fn compare(name: &str, config: &DemConfig, points: Cloud, steps: u64, after: u64) {
    let mut straight = TestRun::new(config, points);
    let mut saved = Vec::new();
    let mut trace = Vec::new();
    let mut pressing = 0;
    for i in 0..steps + after {
        straight.choose();
        if i < steps {
            saved.push((straight.dem.save().unwrap(), straight.points.clone()));
        }
        trace.push(straight.finish());
        pressing += straight.dem.contacts();
    }
    assert!(pressing > 0 || config.body_contact.is_none(), "{name}");
    let pushed = straight.dem.measurement().ledger.contact_impulse;
    assert!(pushed != [0.0; 2], "{name}: points met no body");
    for (from, (bytes, points)) in (0..).zip(saved) {
        let mut dem = Sdem::default();
        dem.configure(config).unwrap();
        dem.restore(&bytes).unwrap();
        assert!(
            dem.save().unwrap() == bytes,
            "{name}: saved again at {from}"
        );
        let mut resumed = TestRun {
            dem,
            points,
            done: from,
        };
        for i in from..from + after {
            if i > from {
                resumed.choose();
            }
            let same = resumed.finish() == trace[i as usize];
            assert!(same, "{name}: saved before step {from}, step {i} differs");
        }
    }
}

#[test]
fn a_run_that_is_resumed_goes_on_to_the_same_bits() {
    for (name, config) in all() {
        compare(name, &config, Cloud::new(60), 61, 100);
    }
}

#[test]
fn so_does_one_without_points_and_one_on_more_threads() {
    let config = scene(LINEAR, Some(LINEAR), OverlapMeasure::EachEdge);
    compare_without_points(&config);
    for threads in [1, 2] {
        let many = DemConfig { threads, ..crowd() };
        compare("many", &many, Cloud::in_gaps(), 9, 25);
    }
}

fn compare_without_points(config: &DemConfig) {
    let mut straight = TestRun::new(config, Cloud::default());
    for _ in 0..120 {
        straight.step();
    }
    let bytes = straight.dem.save().unwrap();
    let mut resumed = TestRun::new(config, Cloud::default());
    resumed.dem.restore(&bytes).unwrap();
    resumed.done = straight.done;
    for i in 0..100 {
        assert!(resumed.step() == straight.step(), "step {i} differs");
    }
}

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
    run.finish();
    refusal
}

#[test]
fn the_state_of_another_configuration_is_refused_by_what_differs() {
    let config = scene(LINEAR, Some(LINEAR), OverlapMeasure::EachEdge);
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
    let config = scene(LINEAR, Some(LINEAR), OverlapMeasure::EachEdge);
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
    for (_, config) in all() {
        let (bytes, _) = state(&config);
        for share in 0..20 {
            let part = &bytes[..bytes.len() * share / 20];
            refused(&config, part);
        }
    }
}
