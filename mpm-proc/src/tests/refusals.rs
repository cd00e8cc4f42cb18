//! What is refused, and that it is told where and why; and what stops a run.

use interface::config::{
    Fill, GridContact, MaterialModel, MpmConfig, Plane, ShapeFunction, Spacing, Stage,
    StressUpdate, Traction, Transfer, Wall,
};
use interface::message::wire::ImpForce;
use interface::solver::{Fault, MpmSolver};

use super::against_reference::everywhere;
use super::{Stepper, block, configured};
use crate::Mpm;

/// The configuration itself knows what is wrong, so that a scene reader can say it, and the solver says the first of it.
fn refused(change: impl Fn(&mut MpmConfig), key: &str, says: &str) {
    let mut config = block();
    change(&mut config);
    let faults = config.faults();
    let fault = faults.iter().find(|f| f.key == key);
    let fault = fault.unwrap_or_else(|| panic!("{key} is not among {faults:?}"));
    assert!(fault.to_string().contains(says), "{fault:?}");
    match Mpm::new().configure(&config) {
        Ok(_) => panic!("{key}: not refused"),
        Err(refusal) => {
            assert_eq!(refusal.key, faults[0].key, "{refusal}");
            assert_eq!(refusal.message, faults[0].to_string());
        }
    }
}

/// What only filled regions show.
fn refused_by_the_solver(change: impl Fn(&mut MpmConfig), key: &str, says: &str) {
    let mut config = block();
    change(&mut config);
    assert_eq!(config.faults(), []);
    let refusal = Mpm::new().configure(&config).expect_err(key);
    assert_eq!(refusal.key, key, "{refusal}");
    assert!(refusal.message.contains(says), "{refusal}");
}

#[test]
#[allow(clippy::too_many_lines, reason = "a list of cases")]
fn bad_configurations_are_refused_with_key_and_reason() {
    refused(|c| c.cell = 0.0, "mpm.cell", "above 0");
    refused(|c| c.cell = f64::NAN, "mpm.cell", "above 0");
    refused(|c| c.cell = 0.03, "mpm.domain", "whole number of cells");
    refused(|c| c.cell = 1e-12, "mpm.cell", "cells along x");
    refused(
        |c| c.domain[1][0] = f64::INFINITY,
        "mpm.domain",
        "second corner",
    );
    refused(|c| c.domain[1][1] = 0.0, "mpm.domain", "second corner");
    refused(|c| c.gravity[1] = f64::NAN, "gravity", "finite");
    refused(
        |c| c.walls.left = Wall::Periodic,
        "mpm.walls.right",
        "only one of the walls left and right",
    );
    refused(
        |c| c.walls.top = Wall::Periodic,
        "mpm.walls.bottom",
        "make both periodic or neither",
    );
    let driven = Wall::Driven { speed: 1.0 };
    refused(
        |c| c.walls.top = Wall::Driven { speed: f64::NAN },
        "mpm.walls.top.driven.speed",
        "a velocity along the wall",
    );
    refused(
        |c| (c.walls.top, c.transfer) = (driven, Transfer::Xpic { order: 2 }),
        "mpm.transfer",
        "xpic does not support the moving wall top",
    );
    refused(
        |c| (c.walls.top, c.walls.left) = (driven, Wall::Slip),
        "mpm.walls.left",
        "would push material into the wall left",
    );
    refused(
        |c| (c.walls.right, c.walls.bottom) = (driven, driven),
        "mpm.walls.bottom",
        "the wall right moves along itself",
    );
    refused(
        |c| {
            c.walls.top = driven;
            c.domain[1][1] = 0.25;
        },
        "mpm.domain",
        "4 cells between it and the opposite wall",
    );
    refused(|c| c.skin = -1.0, "coupling.skin", "0 or more");
    refused(
        |c| {
            c.shape = ShapeFunction::Ugimp;
            c.grid_contact = Some(GridContact { friction: 0.0 });
            c.stress_update = StressUpdate::Usl;
        },
        "mpm.stress_update",
        "usl is unstable with grid_contact and shape = \"ugimp\"",
    );
    refused(
        |c| c.materials[0].density = -1.0,
        "mpm.material.0.density",
        "above 0",
    );
    refused(
        |c| {
            c.materials[0].model = MaterialModel::LinearElastic {
                bulk_modulus: f64::NAN,
                shear_modulus: 1.0,
            };
        },
        "mpm.material.0.model.linear_elastic.bulk_modulus",
        "above 0",
    );
    refused(
        |c| c.groups[0].material = 3,
        "mpm.points.0.material",
        "no material",
    );
    refused(
        |c| c.groups[0].velocity[0] = f64::NAN,
        "mpm.points.0.velocity",
        "finite",
    );
    refused(
        |c| c.groups[0].contact_radius = Some(0.0),
        "mpm.points.0.contact_radius",
        "above 0",
    );
    refused(
        |c| c.groups[0].rigid = true,
        "mpm.points.0.rigid",
        "only on the grid",
    );
    let touching = |c: &mut MpmConfig, friction| {
        c.grid_contact = Some(GridContact { friction });
    };
    refused(
        |c| touching(c, -0.1),
        "mpm.grid_contact.friction",
        "0 or more",
    );
    refused(
        |c| {
            touching(c, 0.0);
            (c.walls.left, c.walls.right) = (Wall::Periodic, Wall::Periodic);
            c.groups[0].rigid = true;
        },
        "mpm.points.0.rigid",
        "no centre of rotation",
    );
    refused(
        |c| {
            touching(c, 0.0);
            c.groups[0].rigid = true;
            c.groups[0].fields.velocity = Some(["x".into(), "0".into()]);
        },
        "mpm.points.0.velocity",
        "same for all",
    );
    refused(
        |c| c.groups[0].spacing = Spacing::PerCell(5),
        "mpm.points.0.spacing.per_cell",
        "use 4 or 9",
    );
    refused(
        |c| c.groups[0].spacing = Spacing::Distance(1e-9),
        "mpm.points.0.spacing",
        "points",
    );
    refused(
        |c| {
            c.groups[0].spacing = Spacing::Counts([3, 3]);
            c.groups[0].fill = Fill::Disc {
                center: [0.3, 0.4],
                radius: 0.1,
            };
        },
        "mpm.points.0.spacing.counts",
        "for rectangles",
    );
    refused(
        |c| {
            c.groups[0].fill = Fill::Disc {
                center: [0.7, 0.4],
                radius: 0.2,
            }
        },
        "mpm.points.0.fill",
        "outside of `mpm.domain`",
    );
    // Over a periodic wall a region may reach, but not onto itself.
    refused(
        |c| {
            (c.walls.left, c.walls.right) = (Wall::Periodic, Wall::Periodic);
            c.groups[0].fill = Fill::Rectangle {
                lower: [0.0, 0.3],
                upper: [1.1, 0.5],
            }
        },
        "mpm.points.0.fill",
        "outside of `mpm.domain`",
    );
    refused(
        |c| {
            c.groups[0].fill = Fill::Disc {
                center: [0.3, 0.4],
                radius: 0.01,
            }
        },
        "mpm.points.0.fill",
        "no points",
    );
    refused(
        |c| {
            c.groups[0].fill = Fill::Polygon {
                vertices: vec![[0.1, 0.3], [0.4, 0.5], [0.4, 0.3], [0.1, 0.5]],
            };
        },
        "mpm.points.0.fill.polygon.vertices",
        "from vertex 0 [0.1, 0.3] and the one from vertex 2",
    );
    refused_by_the_solver(
        |c| {
            let mut other = c.groups[0].clone();
            other.name = "second".into();
            other.fill = Fill::Disc {
                center: [0.4, 0.5],
                radius: 0.05,
            };
            c.groups.push(other);
        },
        "mpm.points.1.fill",
        "on top of group 'block'",
    );
    refused(
        |c| c.transfer = Transfer::Blend { pic_fraction: 1.5 },
        "mpm.transfer.blend.pic_fraction",
        "0 (FLIP) to 1 (PIC)",
    );
    refused(
        |c| c.shape = ShapeFunction::Ugimp,
        "mpm.transfer",
        "quadratic_bspline",
    );
    refused(
        |c| c.transfer = Transfer::FlipPic { pic_rate: -1.0 },
        "mpm.transfer.flip_pic.pic_rate",
        "a rate of 0 or more",
    );
    refused(
        |c| {
            c.shape = ShapeFunction::Linear;
            c.transfer = Transfer::Flip;
            c.stress_update = interface::config::StressUpdate::Usl;
        },
        "mpm.stress_update",
        "usavg",
    );
    refused(
        |c| {
            c.shape = ShapeFunction::Linear;
            c.transfer = Transfer::Aflip { pic_rate: 1.0 };
        },
        "mpm.transfer",
        "aflip needs",
    );
    refused(
        |c| {
            c.transfer = Transfer::FlipXpic {
                order: 0,
                pic_rate: 1.0,
            };
        },
        "mpm.transfer.flip_xpic.order",
        "1 (PIC) or more",
    );
}

/// Checks that the solver had and the scene reader did not, or the other way round, or with other limits.
#[test]
fn scene_reader_and_solver_refuse_the_same() {
    refused(
        |c| c.transfer = Transfer::Xpic { order: 0 },
        "mpm.transfer.xpic.order",
        "1 (PIC) or more",
    );
    refused(
        |c| {
            c.plane = Plane::Stress;
            c.materials[0].model = MaterialModel::NeoHookean {
                bulk_modulus: 1e5,
                shear_modulus: 1e5,
            };
        },
        "mpm.plane",
        "out of plane",
    );
    refused(
        |c| {
            c.forcing.stages = vec![Stage {
                from: -1.0,
                damping: 0.0,
                pic_fraction: None,
            }];
        },
        "mpm.stage.0.from",
        "0 or more",
    );
    // A disc in place of a rectangle: its boxes were not counted.
    refused(
        |c| {
            c.groups[0].spacing = Spacing::Distance(1e-6);
            c.groups[0].fill = Fill::Disc {
                center: [0.3, 0.4],
                radius: 0.1,
            };
        },
        "mpm.points.0.spacing",
        "at most 2e9",
    );
    refused(
        |c| {
            c.forcing.tractions = vec![Traction {
                points: "block".into(),
                within: [[0.5, 0.0], [0.0, 1.0]],
                force: [0.0; 2],
            }];
        },
        "mpm.traction.0.within",
        "second corner",
    );
}

/// Eq. 45 of Jiang 2020 is for a radius that a scene chooses. The one that the coupler fills in used to be noted as outside.
#[test]
fn a_radius_that_was_filled_in_is_not_noted_as_out_of_range() {
    let noted = |radius: Option<f64>| {
        let mut config = block();
        config.groups[0].contact_radius = radius;
        let ready = Mpm::new().configure(&config).expect("a good configuration");
        ready.notes.iter().any(|n| n.contains("eq. 45"))
    };
    let config = block();
    let default = config.groups[0].default_contact_radius(config.cell);
    assert!(!noted(None) && !noted(Some(default)));
    assert!(noted(Some(0.9 * default)) && !noted(Some(2.0 * default)));
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
