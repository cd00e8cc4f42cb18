//! What is left out of a configuration is missed, and what is no number in it is a fault of its key; how bodies are pushed and guided.

use interface::config::{
    BodyConfig, BodyInertia, BodyShape, DemConfig, Elasticity, Fill, GroupConfig, MaterialConfig,
    MaterialModel, Motion, MpmConfig, Scheme, ShapeFunction, Spacing, Wall, from_json,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::toys::{dem_config, mpm_config};

/// A disc at rest.
fn plain_continuum() -> MpmConfig {
    MpmConfig {
        scheme: Scheme {
            domain: [[0.0, 0.0], [1.0, 0.5]],
            cell: 0.25,
            shape: ShapeFunction::Ugimp,
            ..mpm_config().scheme
        },
        materials: vec![MaterialConfig {
            name: "rubber".into(),
            density: 1000.0,
            model: MaterialModel::LinearElastic(Elasticity {
                bulk_modulus: 5e6,
                shear_modulus: 3e6,
            }),
        }],
        groups: vec![GroupConfig::at_rest(
            "disc",
            Fill::Disc {
                center: [0.5, 0.25],
                radius: 0.125,
            },
            Spacing::PerCell(4),
        )],
        skin: 0.01,
        ..mpm_config()
    }
}

/// A ball at rest.
fn plain_bodies() -> DemConfig {
    DemConfig {
        bodies: vec![BodyConfig {
            name: "ball".into(),
            inertia: BodyInertia::Density(2000.0),
            ..BodyConfig::default()
        }],
        skin: 0.01,
        threads: 1,
        ..DemConfig::default()
    }
}

/// A scene can say no NaN, but a configuration may arrive with one from a coupler of somebody else.
#[test]
fn what_is_no_finite_number_is_a_fault_of_its_key() {
    type Bodies = fn(&mut DemConfig, f64);
    type Continuum = fn(&mut MpmConfig, f64);
    let bodies: [(&str, Bodies); 10] = [
        ("gravity", |c, x| c.gravity[1] = x),
        ("dem.body.0.position", |c, x| c.bodies[0].position[0] = x),
        ("dem.body.0.velocity", |c, x| c.bodies[0].velocity[1] = x),
        ("dem.body.0.spin", |c, x| c.bodies[0].spin = x),
        ("dem.body.0.angle", |c, x| c.bodies[0].angle = x),
        ("dem.body.0.sphero_radius", |c, x| {
            c.bodies[0].sphero_radius = x;
        }),
        ("dem.body.0.mass", |c, x| {
            c.bodies[0].inertia = BodyInertia::Mass(x);
        }),
        ("dem.body.0.shape.polygon.vertices", |c, x| {
            let vertices = vec![[0.0, 0.0], [1.0, 0.0], [0.0, x]];
            c.bodies[0].shape = BodyShape::Polygon { vertices };
        }),
        ("dem.body.0.motion.pushed", |c, x| {
            c.bodies[0].motion = Motion::Pushed {
                force: [x, 0.0],
                torque: 0.0,
                ramp: 0.0,
                until: None,
            };
        }),
        ("dem.contact_resolution", |c, x| {
            c.contact_resolution = Some(x);
        }),
    ];
    let continuum: [(&str, Continuum); 6] = [
        ("gravity", |c, x| c.gravity[0] = x),
        ("mpm.cell", |c, x| c.cell = x),
        ("mpm.domain", |c, x| c.domain[1][1] = x),
        ("mpm.points.0.velocity", |c, x| c.groups[0].velocity[1] = x),
        ("mpm.material.0.density", |c, x| c.materials[0].density = x),
        ("mpm.walls.left.friction.coefficient", |c, x| {
            c.walls.left = Wall::Friction { coefficient: x };
        }),
    ];
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for (key, spoil) in bodies {
            let mut config = plain_bodies();
            spoil(&mut config, x);
            let keys: Vec<String> = config.faults().into_iter().map(|f| f.key).collect();
            assert!(keys.iter().any(|k| k == key), "{key} of {x}: {keys:?}");
        }
        for (key, spoil) in continuum {
            let mut config = plain_continuum();
            spoil(&mut config, x);
            let keys: Vec<String> = config.faults().into_iter().map(|f| f.key).collect();
            assert!(keys.iter().any(|k| k == key), "{key} of {x}: {keys:?}");
        }
    }
}

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
    let push = |ramp, until, time| {
        let motion = Motion::Pushed {
            force: [0.0, 6.0],
            torque: -3.0,
            ramp,
            until,
        };
        let (force, torque) = motion.push(time);
        [force.x, force.y, torque]
    };
    assert_eq!(push(2.0, None, 0.0), [0.0; 3]);
    assert_eq!(push(2.0, None, 0.5), [0.0, 1.5, -0.75]);
    assert_eq!(push(2.0, Some(4.0), 3.0), [0.0, 6.0, -3.0]);
    assert_eq!(push(0.0, Some(4.0), 0.0), [0.0, 6.0, -3.0]);
    assert_eq!(push(0.0, Some(4.0), 4.0), [0.0; 3]);
    let guided = Motion::Guided {
        hold_x: true,
        hold_y: false,
        hold_angle: true,
    };
    assert_eq!(guided.yielding(), [0.0, 1.0, 0.0]);
    assert_eq!(guided.push(1.0).1, 0.0);
}
