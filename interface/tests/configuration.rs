//! What is left out of a configuration is missed; how bodies are pushed and guided.

use interface::config::{BodyConfig, Motion, from_json};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::toys::{dem_config, mpm_config};

/// S-5: a default would hide what the coupler has not said.
#[test]
fn a_field_that_is_left_out_is_missing_at_any_depth() {
    fn without<T: Serialize + DeserializeOwned>(config: &T, of: &str, field: &str) -> String {
        let mut json = serde_json::to_value(config).unwrap();
        let fields = json.pointer_mut(of).and_then(Value::as_object_mut);
        fields.and_then(|all| all.remove(field)).expect(field);
        let read = from_json::<T>(&json.to_string());
        read.map_or_else(|error| error.to_string(), |_| String::new())
    }
    let (mpm, mut dem) = (mpm_config(), dem_config());
    dem.bodies.push(BodyConfig::default());
    for (found, field) in [
        (without(&mpm, "", "plane"), "plane"),
        (without(&mpm, "/walls", "left"), "left"),
        (without(&mpm, "/forcing", "body_force"), "body_force"),
        (without(&dem, "/contact/linear", "friction"), "friction"),
        (without(&dem, "/body/0", "surface"), "surface"),
    ] {
        assert_eq!(found, format!("missing field `{field}`"));
    }
}

/// The oracle of the kit pushes and guides bodies by these methods too, so it cannot see an error in them.
#[test]
fn a_push_follows_its_ramp_until_it_ends_and_a_guide_holds_what_it_names() {
    let push = |ramp, until, span| {
        let motion = Motion::Pushed {
            force: [0.0, 6.0],
            torque: -3.0,
            ramp,
            until,
        };
        let (force, torque) = motion.push(span);
        [force.x, force.y, torque]
    };
    for (ramp, until, span, share) in [
        (2.0, None, [0.0, 0.0], 0.0),
        (2.0, None, [0.0, 1.0], 0.25),
        (2.0, None, [1.0, 4.0], 11.0 / 12.0),
        (2.0, Some(4.0), [2.0, 4.0], 1.0),
        (2.0, Some(4.0), [0.0, 8.0], 0.375),
        (2.0, Some(1.0), [0.0, 2.0], 0.125),
        (0.0, Some(4.0), [-0.5, 0.5], 1.0),
        (0.0, Some(4.0), [3.0, 5.0], 0.5),
        (0.0, Some(4.0), [4.0, 5.0], 0.0),
    ] {
        let expected = [0.0, 6.0 * share, -3.0 * share];
        assert_eq!(push(ramp, until, span), expected, "{ramp} {until:?}");
    }
    let guided = Motion::Guided {
        hold_x: true,
        hold_y: false,
        hold_angle: true,
    };
    assert_eq!(guided.yielding(), [0.0, 1.0, 0.0]);
    assert_eq!(guided.push([1.0, 2.0]).1, 0.0);
}
