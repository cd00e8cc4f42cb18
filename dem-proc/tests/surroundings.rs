//! What bounds the motion of surfaces: widths, ways through an outline, accelerations, the way ahead.

use dem_proc::body::bodies::Bodies;
use dem_proc::contact::approach::outer_acceleration;
use dem_proc::lists::now::Ahead;
use interface::Vec2;
use interface::config::{BodyConfig, BodyShape, DemConfig, Motion};

use crate::opening::grain;

/// Gravity, a push of 5 N and a moment of 0.3 N that turns the surface of a disc of 0.1 m and 1 kg/m.
#[test]
fn what_pushes_and_turns_a_body_adds_up_at_its_surface() {
    let pushed = BodyConfig {
        motion: Motion::Pushed {
            force: [3.0, -4.0],
            torque: -0.3,
            ramp: 0.0,
            until: None,
        },
        ..grain(BodyShape::Disc, [0.0; 2])
    };
    let config = DemConfig {
        bodies: vec![pushed, grain(BodyShape::Disc, [1.0, 0.0])],
        ..DemConfig::default()
    };
    let bodies = Bodies::new(&config).expect("two bodies");
    let found = outer_acceleration(&bodies, Vec2::new(0.0, -9.81));
    let expected = 9.81 + 5.0 + 0.3 * 0.1 / (0.5 * 0.1 * 0.1);
    assert!((found - expected).abs() < 1e-12, "{found}");
}

#[test]
fn the_displacement_ahead_is_two_steps_of_free_fall() {
    // From rest: half a kick, a step, a kick, and a step that is a tenth longer.
    let (dt, g) = (1e-3, 10.0);
    let first = 0.5 * dt * g;
    let second = first + g * 0.5 * (dt + 1.1 * dt);
    let way = first * dt + second * 1.1 * dt;
    let ahead = Ahead::new(0.5 * dt, dt, g);
    assert!((ahead.way(0.0) / way - 1.0).abs() < 1e-12);
    assert!((ahead.way(3.0) - way - 3.0 * 2.1 * dt).abs() < 1e-15);
}
