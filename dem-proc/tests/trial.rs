//! `contact` evaluates and commits nothing: whoever asks twice gets the same bits as who asks once.

use crate::mixtures::{Cloud, LINEAR, TestRun, all, crowd};
use crate::small_scenes::Random;
use interface::config::{DemConfig, OverlapMeasure};
use interface::message::wire::ImpForce;
use interface::solver::DemSolver;
use interface::step::Step;

/// Asks for forces on points that are elsewhere, in a step that is another.
fn try_out(run: &mut TestRun, random: &mut Random) -> bool {
    let step = Step {
        dt: 3.0 * run.next().dt * random.unit(),
        measure: random.unit() < 0.5,
        ..run.next()
    };
    // Beyond the skin in most steps, so that a list is built for it.
    let far = if random.unit() < 0.3 { 0.001 } else { 0.03 };
    let mut states = run.points.states();
    for state in &mut states {
        for k in 0..2 {
            state.position[k] += random.between(-far, far);
            state.velocity[k] += random.between(-1.0, 1.0);
        }
    }
    let mut forces = vec![ImpForce::default(); states.len()];
    let before = run.dem.save().unwrap();
    // A point may be put deep into a body, which is a fault and leaves no trace either.
    let is_fault = run.dem.contact(&step, &states, &mut forces).is_err();
    assert!(before == run.dem.save().unwrap(), "a trial left a trace");
    is_fault
}

/// Returns how many trials were faults.
fn compare(name: &str, config: &DemConfig, points: &Cloud, steps: u64) -> usize {
    let run = || TestRun::new(config, points.clone());
    let (mut once, mut often) = (run(), run());
    let mut random = Random::new(3);
    let (mut faults, mut pressing) = (0, 0);
    for i in 0..steps {
        once.choose();
        often.choose();
        for _ in 0..=i % 2 {
            faults += usize::from(try_out(&mut often, &mut random));
        }
        assert!(once.finish() == often.finish(), "{name}: step {i} differs");
        pressing += once.dem.contacts();
    }
    assert!(pressing > 0 || config.body_contact.is_none(), "{name}");
    let pushed = once.dem.measurement().ledger.contact_impulse;
    let alone = points.is_empty();
    assert!(alone || pushed != [0.0; 2], "{name}: points met no body");
    faults
}

#[test]
fn an_evaluation_leaves_no_trace() {
    let each = all().into_iter();
    let faults = each.map(|(name, config)| compare(name, &config, &Cloud::new(60), 201));
    let faults: Vec<usize> = faults.collect();
    // Under `area` points lie too far out.
    assert!(faults[..4].iter().all(|count| *count > 10), "{faults:?}");
}

#[test]
fn nor_does_one_without_points_or_on_two_threads() {
    let config = crate::mixtures::scene(LINEAR, Some(LINEAR), OverlapMeasure::EachEdge);
    compare("other steps alone", &config, &Cloud::default(), 201);
    let threads = 2;
    let many = DemConfig { threads, ..crowd() };
    compare("two threads", &many, &Cloud::in_gaps(), 40);
}
