//! What is refused, with which key.

use crate::small_scenes::{body, fixed, scene, spring};
use dem_proc::Sdem;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion, OverlapMeasure,
};
use interface::solver::DemSolver;

fn refusal(config: &DemConfig) -> (String, String) {
    let refusal = Sdem::default().configure(config).unwrap_err();
    (refusal.key, refusal.message)
}

fn refused_body(change: impl FnOnce(&mut BodyConfig)) -> (String, String) {
    let mut target = body(BodyShape::Disc, 0.1);
    target.name = "target".into();
    change(&mut target);
    refusal(&scene(
        vec![
            fixed(BodyShape::Disc, 0.1),
            fixed(BodyShape::Disc, 0.1),
            target,
        ],
        spring(1.0),
    ))
}

type Change = Box<dyn FnOnce(&mut BodyConfig)>;

#[test]
#[expect(clippy::too_many_lines, reason = "a table")]
fn every_bad_body_is_named() {
    let polygon = |vertices: &[[f64; 2]]| BodyShape::Polygon {
        vertices: vertices.to_vec(),
    };
    let bow_tie = polygon(&[[0., 0.], [1., 1.], [1., 0.], [0., 1.]]);
    let rows: Vec<(&str, &str, Change)> = vec![
        (
            "shape.polygon.vertices",
            "cross",
            Box::new(move |b| b.shape = bow_tie),
        ),
        (
            "shape.polygon.vertices",
            "coincide",
            Box::new(move |b| b.shape = polygon(&[[0., 0.], [0., 0.], [1., 0.], [0., 1.]])),
        ),
        (
            "shape.polygon.vertices",
            "one line",
            Box::new(move |b| b.shape = polygon(&[[0., 0.], [1., 1.], [2., 2.]])),
        ),
        (
            "shape.polygon.vertices",
            "cross",
            Box::new(move |b| b.shape = polygon(&[[0., 0.], [2., 0.], [1., 0.], [1., 1.]])),
        ),
        (
            "shape.polygon.vertices",
            "2 vertices",
            Box::new(move |b| b.shape = polygon(&[[0., 0.], [2., 0.]])),
        ),
        (
            "shape.polygon.vertices",
            "finite numbers",
            Box::new(move |b| b.shape = polygon(&[[0., 0.], [f64::NAN, 0.], [1., 1.]])),
        ),
        (
            "shape.segment.ends",
            "two different ends",
            Box::new(|b| {
                b.shape = BodyShape::Segment {
                    ends: [[1., 1.]; 2],
                }
            }),
        ),
        (
            "shape.rectangle.width",
            "above 0",
            Box::new(|b| {
                b.shape = BodyShape::Rectangle {
                    width: 0.0,
                    height: 1.0,
                }
            }),
        ),
        (
            "sphero_radius",
            "above 0",
            Box::new(|b| b.sphero_radius = 0.0),
        ),
        (
            "sphero_radius",
            "above 0",
            Box::new(|b| b.sphero_radius = -0.1),
        ),
        (
            "sphero_radius",
            "above 0",
            Box::new(|b| b.sphero_radius = f64::NAN),
        ),
        (
            "mass",
            "above 0",
            Box::new(|b| b.inertia = BodyInertia::Mass(0.0)),
        ),
        (
            "density",
            "above 0",
            Box::new(|b| b.inertia = BodyInertia::Density(-3.0)),
        ),
        (
            "mass",
            "above 0",
            Box::new(|b| b.inertia = BodyInertia::Mass(f64::INFINITY)),
        ),
        ("position", "finite", Box::new(|b| b.position[1] = f64::NAN)),
        (
            "velocity",
            "finite",
            Box::new(|b| b.velocity[0] = f64::INFINITY),
        ),
        ("spin", "finite", Box::new(|b| b.spin = f64::NAN)),
        ("angle", "finite", Box::new(|b| b.angle = f64::NAN)),
        (
            "motion",
            "driven",
            Box::new(|b| {
                b.motion = Motion::Fixed;
                b.spin = 1.0;
            }),
        ),
    ];
    for (key, text, change) in rows {
        let (got, message) = refused_body(change);
        assert_eq!(got, format!("dem.body.2.{key}"), "{message}");
        assert!(message.contains(text), "{message}");
    }
}

#[test]
#[expect(clippy::too_many_lines, reason = "a table")]
fn every_bad_setting_is_named() {
    let law = |n, t, mu, zeta| ContactLaw::Linear {
        normal_stiffness: n,
        tangential_stiffness: t,
        friction: mu,
        damping_ratio: zeta,
        damped_mass: 0.0,
    };
    let with = |change: &dyn Fn(&mut DemConfig)| {
        let mut config = scene(vec![body(BodyShape::Disc, 0.1)], spring(1.0));
        change(&mut config);
        refusal(&config).0
    };
    assert_eq!(
        with(&|c| c.point_contact = law(-1.0, 0.0, 0.0, 0.0)),
        "contact.linear.normal_stiffness"
    );
    assert_eq!(
        with(&|c| c.point_contact = law(1.0, 0.0, 0.3, 0.0)),
        "contact.linear.tangential_stiffness"
    );
    assert_eq!(
        with(&|c| c.body_contact = Some(law(1.0, 0.0, -0.3, 0.0))),
        "body_contact.linear.friction"
    );
    for resolution in [0.0, -1.0, 2.1, f64::NAN] {
        assert_eq!(
            with(&|c| c.contact_resolution = Some(resolution)),
            "dem.contact_resolution"
        );
    }
    assert_eq!(
        with(&|c| c.body_contact = Some(law(1.0, f64::NAN, 0.0, 0.0))),
        "body_contact.linear.tangential_stiffness"
    );
    assert_eq!(
        with(&|c| c.point_contact = law(1.0, 0.0, 0.0, -1.0)),
        "contact.linear.damping_ratio"
    );
    let hertz = |k, nu, e| ContactLaw::HertzMindlin {
        hertz_constant: k,
        poisson_ratio: nu,
        friction: 0.0,
        restitution: e,
        adhesion: 0.0,
    };
    assert_eq!(
        with(&|c| c.body_contact = Some(hertz(0.0, 0.3, 1.0))),
        "body_contact.hertz_mindlin.hertz_constant"
    );
    assert_eq!(
        with(&|c| c.point_contact = hertz(1.0, 0.3, 0.0)),
        "contact.hertz_mindlin.restitution"
    );
    // What a foreign coupler may send and ours did not check.
    assert_eq!(
        with(&|c| c.body_contact = Some(hertz(1.0, 0.3, -3.0))),
        "body_contact.hertz_mindlin.restitution"
    );
    assert_eq!(
        with(&|c| c.body_contact = Some(law(1.0, 2.0, 0.1, 0.0))),
        "body_contact.linear.tangential_stiffness"
    );
    assert_eq!(
        with(&|c| c.body_contact = Some(law(1.0, 0.0, 0.0, -1.1))),
        "body_contact.linear.damping_ratio"
    );
    assert_eq!(
        with(&|c| c.point_contact = hertz(1.0, 0.7, 1.0)),
        "contact.hertz_mindlin.poisson_ratio"
    );
    let rolling = ContactLaw::Granular {
        normal_stiffness: 1.0,
        tangential_stiffness: 0.0,
        friction: 0.0,
        damping_ratio: 0.0,
        damped_mass: 0.0,
        adhesion: 0.0,
        rolling_friction: 0.1,
    };
    assert_eq!(
        with(&|c| c.point_contact = rolling),
        "contact.granular.rolling_friction"
    );
    assert_eq!(with(&|c| c.skin = -1.0), "coupling.skin");
    assert_eq!(with(&|c| c.threads = 0), "dem.threads");
    assert_eq!(with(&|c| c.gravity[0] = f64::NAN), "gravity");
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
    let square = || BodyShape::Rectangle {
        width: 1.0,
        height: 1.0,
    };
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
