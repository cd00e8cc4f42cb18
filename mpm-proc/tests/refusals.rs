//! What is refused, with the place and the reason; and what stops a run.

use interface::config::material::{CriticalState, Frictional};
use interface::config::{GroupConfig, Hold, MaterialModel, MpmConfig, Plane, Probe, Traction};
use interface::message::wire::ImpForce;
use interface::solver::{Fault, MpmSolver};

use crate::blocks::{
    BULK, GRAINS, SHEAR, Stepper, block, configured, disc_fill, elastic_model, everywhere,
};
use mpm_proc::Mpm;

fn refused(change: impl Fn(&mut MpmConfig), key: &str, says: &str) {
    let mut config = block();
    change(&mut config);
    let refusal = Mpm::new().configure(&config).expect_err(key);
    assert_eq!(refusal.key, key, "{refusal}");
    assert!(refusal.message.contains(says), "{refusal}");
}

/// A configuration finds its own faults, so that a scene reader can report them: coupler/tests has
/// a row for each. The solver says the first of it.
#[test]
fn the_first_fault_of_a_configuration_is_refused() {
    let mut config = block();
    (config.cell, config.gravity[1]) = (0.03, f64::NAN);
    let fault = &config.faults()[0];
    refused(|c| *c = config.clone(), &fault.key, &fault.to_string());
}

/// What only filled regions show, and what no scene reader makes.
#[test]
fn what_the_solver_alone_can_see_is_refused_with_key_and_reason() {
    let nowhere = [[0.0, 0.0], [0.05, 0.05]];
    let [points, name] = ["block", "nowhere"].map(|text| move || text.to_owned());
    let none = "holds no points of group 'block'";
    refused(
        |c| {
            let fill = disc_fill([0.4, 0.5], 0.05);
            let name = "second".into();
            let second = GroupConfig {
                name,
                fill,
                ..c.groups[0].clone()
            };
            c.groups.push(second);
        },
        "mpm.points.1.fill",
        "on top of group 'block'",
    );
    refused(
        |c| c.groups[0].fields.velocity = Some(["1/(x-x)", "0"].map(String::from)),
        "mpm.points.0.velocity",
        "inf",
    );
    refused(
        |c| {
            c.forcing.tractions = vec![Traction {
                points: points(),
                within: nowhere,
                force: [1.0, 0.0],
            }];
        },
        "mpm.traction.0.within",
        none,
    );
    refused(
        |c| {
            c.probes = vec![Probe {
                name: name(),
                points: points(),
                within: nowhere,
            }];
        },
        "mpm.probe.0.within",
        none,
    );
    refused(
        |c| {
            let (hold_x, hold_y) = (true, false);
            c.forcing.holds = vec![Hold {
                name: name(),
                points: points(),
                within: nowhere,
                hold_x,
                hold_y,
            }];
        },
        "mpm.hold.0.within",
        none,
    );
    refused(
        |c| c.groups[0].material = 3,
        "mpm.points.0.material",
        "no material",
    );
    refused(|c| c.threads = 0, "mpm.threads", "1 or more");
}

/// Up to its yield surface, and in its plane, a material has the stress that it is given.
#[test]
fn a_stress_that_the_material_would_change_at_once_is_refused() {
    let sand = Frictional {
        bulk_modulus: BULK,
        shear_modulus: SHEAR,
        friction_angle: 30.0,
        dilation_angle: 0.0,
        cohesion: 0.0,
        tensile_strength: 0.0,
        critical_state: None,
        separates: false,
    };
    let grains = MaterialModel::MuI(GRAINS);
    let metal = MaterialModel::VonMises {
        bulk_modulus: BULK,
        shear_modulus: SHEAR,
        yield_stress: 1e4,
        hardening_modulus: 0.0,
    };
    let [drucker, mohr] =
        [MaterialModel::DruckerPrager, MaterialModel::MohrCoulomb].map(|law| law(sand));
    let apart = MaterialModel::DruckerPrager(Frictional {
        separates: true,
        ..sand
    });
    let critical = MaterialModel::DruckerPrager(Frictional {
        critical_state: Some(CriticalState::Volume(1.1)),
        ..sand
    });
    // sin(phi) is 1/2, so the least pressure beside one is a third of it.
    let rests = ["-5e4*(1-y)/3", "-5e4*(1-y)", "-5e4*(1-y)/3", "0"];
    let falls = ["-5e4*(1-y)/4", "-5e4*(1-y)", "-5e4*(1-y)/4", "0"];
    let [none, even, pulled] = [["0"; 4], ["-1", "-1", "-1", "0"], ["1", "1", "1", "0"]];
    let [slow, fast] = ["0.63", "0.65"].map(|xy| ["-1", "-1", "-1", xy]);
    let [turns, breaks] = ["1e4/sqrt(3)", "1e4"].map(|xy| ["0", "0", "0", xy]);
    for (model, has, has_not) in [
        (metal, turns, breaks),
        (drucker, even, fast),
        (critical, even, pulled),
        (mohr, rests, falls),
        (apart, none, pulled),
        (grains, none, pulled),
        (grains, slow, fast),
        (elastic_model(BULK, SHEAR), breaks, pulled),
    ] {
        let with = |stress: [&str; 4]| {
            let mut config = block();
            config.materials[0].model = model;
            if model.takes_plane_stress() {
                config.plane = Plane::Stress;
            }
            config.groups[0].fields.stress = Some(stress.map(String::from));
            config
        };
        configured(&with(has));
        let says = "without any strain it makes [";
        refused(|c| *c = with(has_not), "mpm.points.0.stress", says);
    }
    let fluid = MaterialModel::Fluid {
        bulk_modulus: BULK,
        exponent: 7.0,
        viscosity: 0.0,
    };
    refused(
        |c| {
            c.materials[0].model = fluid;
            c.groups[0].fields.stress = Some(["0", "0", "0", "x"].map(String::from));
        },
        "mpm.points.0.stress",
        "of group 'block' at (0.1125, 0.3125) m; a fluid at rest",
    );
}

#[test]
fn a_huge_empty_domain_costs_nothing() {
    let mut config = block();
    config.domain = [[0.0, 0.0], [5.0e4, 5.0e4]]; // 1e12 cells
    let mut mpm = Mpm::new();
    let ready = mpm.configure(&config).expect("sparse");
    assert!(ready.bytes < 1_000_000, "{} bytes", ready.bytes);
    Stepper::new().run(&mut mpm, 1e-4, 3);
}

#[test]
fn a_run_that_blows_up_is_stopped_before_anything_is_returned() {
    let mut config = block();
    config.domain = [[-100.0, -100.0], [100.0, 100.0]];
    let mut mpm = configured(&config);
    let count = mpm.select_imps(&everywhere()).len();
    let mut forces = vec![ImpForce::default(); count];
    forces[5].force = [1e6, 2e5];
    let mut stepper = Stepper::new();
    let fault = (0..1000).find_map(|_| {
        let result = stepper.step(&mut mpm, 0.02, true, &forces);
        forces[5].force = [0.0; 2];
        if result.is_ok() {
            let sound = |x: [f64; 2]| x.iter().all(|x| x.is_finite());
            assert!(
                mpm.points()
                    .iter()
                    .all(|p| sound(p.position) && sound(p.velocity))
            );
        }
        result.err()
    });
    assert!(matches!(
        fault,
        Some(Fault::LeftDomain { .. } | Fault::NotFinite { .. })
    ));
}

#[test]
fn a_point_that_leaves_is_named() {
    let mut config = block();
    config.groups[0].velocity = [-10.0, 0.0];
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    let fault = (0..1000).find_map(|_| stepper.step(&mut mpm, 1e-3, false, &[]).err());
    let Some(Fault::LeftDomain { id, x, .. }) = fault else {
        panic!("{fault:?}");
    };
    assert!(id % 12 == 0 && x < -0.2, "{id} at {x}");
}

#[test]
fn forces_for_another_set_are_an_error() {
    let mut mpm = configured(&block());
    mpm.select_imps(&everywhere());
    let fault = Stepper::new().step(&mut mpm, 1e-4, false, &[ImpForce::default(); 3]);
    assert!(matches!(fault, Err(Fault::Other(m)) if m.contains("3 contact forces")));
}
