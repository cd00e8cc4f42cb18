//! What is refused, with which key.

use crate::small_scenes::{body, fixed, rectangle_shape, scene, spring};
use dem_proc::Sdem;
use interface::config::{BodyInertia, BodyShape, DemConfig, Motion, OverlapMeasure};
use interface::solver::DemSolver;

fn refusal(config: &DemConfig) -> (String, String) {
    let refusal = Sdem::default().configure(config).unwrap_err();
    (refusal.key, refusal.message)
}

/// The configuration finds its own faults: coupler/tests has a row for each fault.
#[test]
fn the_first_fault_of_a_configuration_is_refused() {
    let mut config = scene(vec![body(BodyShape::Disc, 0.1)], spring(1.0));
    (config.threads, config.bodies[0].inertia) = (0, BodyInertia::Mass(0.0));
    let fault = &config.faults()[0];
    assert_eq!(refusal(&config), (fault.key.clone(), fault.to_string()));
}

#[test]
fn no_body_at_all_is_fine() {
    let mut dem = Sdem::default();
    let ready = dem.configure(&scene(vec![], spring(1.0))).unwrap();
    assert_eq!(
        (ready.items, ready.mass_min, ready.stiffness_max),
        (0, 0.0, 0.0)
    );
    assert!(dem.envelopes().is_empty());
}

/// The distance of a vertex from an edge is not below 0: without a sphero-radius nothing ever touches.
#[test]
fn two_bare_bodies_that_would_never_touch_are_refused() {
    let square = || rectangle_shape(1.0, 1.0);
    let mut bare = scene(vec![fixed(square(), 0.0), body(square(), 0.0)], spring(1.0));
    bare.bodies[1].position = [3.0, 0.0];
    let (key, message) = refusal(&bare);
    assert_eq!(key, "dem.body.1.sphero_radius");
    assert!(
        message.contains("never touch") && message.contains("nearest_edge"),
        "{message}"
    );
    // They may be points' alone, or rounded on one side, or held, or measured otherwise.
    let mut dem = Sdem::default();
    let mut taken = |change: &dyn Fn(&mut DemConfig)| {
        let mut config = bare.clone();
        change(&mut config);
        dem.configure(&config).unwrap();
    };
    taken(&|c| c.body_contact = None);
    taken(&|c| c.bodies[0].sphero_radius = 0.1);
    taken(&|c| c.bodies[1].motion = Motion::Fixed);
    taken(&|c| c.overlap = OverlapMeasure::NearestEdge);
}

/// A run began with it, and ended in its first step with the advice to shorten the step.
#[test]
fn bodies_that_lie_deep_in_one_another_are_refused_with_their_overlap() {
    let disc = || body(BodyShape::Disc, 1.0);
    let mut deep = scene(vec![disc(), disc()], spring(1.0));
    deep.bodies[1].position = [0.25, 0.0];
    let (key, message) = refusal(&deep);
    assert_eq!(key, "dem.body.1.position");
    assert!(message.contains("by 1.750e0 m"), "{message}");
    deep.bodies[1].position = [1.5, 0.0];
    Sdem::default().configure(&deep).unwrap();
}
