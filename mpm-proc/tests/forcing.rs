//! Initial fields, body forces, dead loads and stages.

use interface::config::material::Inertial;
use interface::config::{MaterialModel, ShapeFunction, Stage, Traction, Transfer, Wall};
use interface::solver::{Fault, MpmSolver};

use crate::blocks::{BULK, GRAINS, SHEAR, Stepper, block, configured, rectangle_fill, walls};
use mpm_proc::Mpm;

fn texts<const N: usize>(sources: [&str; N]) -> [String; N] {
    sources.map(Into::into)
}

pub fn stage(from: f64, damping: f64, pic_fraction: Option<f64>) -> Stage {
    Stage {
        from,
        damping,
        pic_fraction,
    }
}

/// Kinetic and elastic energy plus what was dissipated, less the work put in: what must not change.
fn balance(mpm: &Mpm) -> f64 {
    let l = mpm.measurement().ledger;
    l.kinetic + l.elastic + l.gravity + l.viscous_work - l.driven_work
}

fn measured(stepper: &mut Stepper, mpm: &mut Mpm, dt: f64) -> interface::message::wire::Ledger {
    stepper.step(mpm, dt, true, &[]).expect("a sound step");
    mpm.measurement().ledger
}

#[test]
fn a_formula_without_a_number_names_its_point() {
    let mut config = block();
    config.forcing.body_force = Some(texts(["sqrt(0.01-t)*0", "0"]));
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    let fault = (0..300).find_map(|_| stepper.step(&mut mpm, 1e-4, false, &[]).err());
    let expected = Fault::NotFinite {
        what: "body force".into(),
        item: "point 0".into(),
    };
    assert_eq!(fault, Some(expected));
    assert!((stepper.time - 0.01).abs() < 3e-4);
}

/// What a traction does is booked on the way of the nodes, whatever other load the points have.
#[test]
fn a_body_force_of_zero_changes_no_work_of_tractions() {
    let work = [None, Some(texts(["0", "0"]))].map(|body_force| {
        let mut config = block();
        config.transfer = Transfer::Pic;
        config.forcing.body_force = body_force;
        config.forcing.tractions = vec![Traction {
            points: "block".into(),
            within: [[0.35, 0.3], [0.4, 0.5]],
            force: [900.0, 0.0],
        }];
        let mut mpm = configured(&config);
        let mut stepper = Stepper::new();
        stepper.run(&mut mpm, 1e-4, 50);
        measured(&mut stepper, &mut mpm, 1e-4).driven_work
    });
    assert_eq!(work[0], work[1]);
}

/// A bar held at one end and pulled at the other by a dead load comes to rest, damped, `F L/(M H)` longer (slip walls
/// above and below: no lateral strain, so that M = K + 4G/3 counts), and the load has done twice the elastic work.
///
/// The stretch is small and the time long: at 1e-3 m of stretch FLIP still swung after 2 s with 1 % of the work (the boxes of
/// uGIMP begin with their edges on nodes, and cross them), and damping of the nodes takes longer for what they hardly see.
#[test]
fn a_dead_load_stretches_a_damped_bar() {
    for dt in [4e-4, 2e-4] {
        stretch_a_damped_bar(dt);
    }
}

fn stretch_a_damped_bar(dt: f64) {
    let mut config = block();
    (config.shape, config.transfer) = (ShapeFunction::Ugimp, Transfer::Flip);
    config.domain = [[0.0, 0.0], [1.2, 0.1]];
    config.walls = walls(Wall::Fixed, Wall::Open, Wall::Slip, Wall::Slip);
    config.groups[0].fill = rectangle_fill([0.0, 0.0], [0.975, 0.1]);
    let force = 0.9;
    config.forcing.tractions = vec![Traction {
        points: "block".into(),
        within: [[0.95, 0.0], [0.975, 0.1]],
        force: [force, 0.0],
    }];
    config.forcing.stages = vec![stage(0.0, 40.0, None)];
    let mut mpm = configured(&config);
    let start = mpm.points();
    let mut stepper = Stepper::new();
    stepper.run(&mut mpm, dt, (3.2 / dt) as usize);
    let ledger = measured(&mut stepper, &mut mpm, dt);
    let moved: Vec<f64> = mpm
        .points()
        .iter()
        .zip(&start)
        .map(|(b, a)| b.position[0] - a.position[0])
        .collect();
    let modulus = BULK + 4.0 / 3.0 * SHEAR;
    let stretch = 0.975 * force / (modulus * 0.1);
    // The load acts on the last column of points: they are half a spacing inside, and half a cell is loaded otherwise.
    let end = moved.iter().copied().fold(0.0, f64::max);
    assert!((end / stretch - 1.0).abs() < 0.05, "{end} {stretch}");
    let loaded: Vec<f64> = start
        .iter()
        .zip(&moved)
        .filter(|(p, _)| p.position[0] > 0.95)
        .map(|(_, u)| *u)
        .collect();
    let mean = loaded.iter().sum::<f64>() / loaded.len() as f64;
    let work = ledger.driven_work / (force * mean);
    // Counted on the way of the field. It is not that of the points, in proportion to what damping takes in a step of the part
    // of their velocity that nodes average away.
    assert!(
        (work - 1.0).abs() < 0.025 * 40.0 * dt,
        "{work} {}",
        ledger.kinetic / ledger.elastic
    );
    assert!((ledger.driven_work / (2.0 * ledger.elastic) - 1.0).abs() < 0.02);
    assert!((balance(&mpm) / ledger.driven_work).abs() < 0.01);
    assert!(ledger.kinetic < 1e-6 * ledger.elastic);
    let unbalanced = ledger.momentum[0] - ledger.applied_impulse[0];
    assert!(unbalanced.abs() < 1e-9, "{unbalanced:e}");
}

/// A free body slows as `exp(-c t)`, to rounding at any step; energy and momentum are booked.
#[test]
fn damping_of_a_free_body_is_exponential() {
    for dt in [1e-4, 1e-3] {
        let mut config = block();
        config.groups[0].velocity = [0.5, -0.25];
        config.forcing.stages = vec![stage(0.01995, 30.0, None), stage(0.04995, 0.0, None)];
        let mut mpm = configured(&config);
        let mut stepper = Stepper::new();
        let steps = (0.08_f64 / dt).round() as usize;
        for n in 0..=steps {
            let last = n == steps;
            let ledger = measured(&mut stepper, &mut mpm, if last { 0.0 } else { dt });
            let energy = 30.0 * (0.25 + 0.0625);
            // At t_n the mean of two half steps stands for the velocity between them: (c dt)^2.
            let tolerance = energy * (30.0 * dt) * (30.0 * dt);
            assert!((balance(&mpm) - energy).abs() < tolerance, "{n}");
            for (i, v) in [0.5, -0.25].into_iter().enumerate() {
                let p = ledger.momentum[i] - ledger.applied_impulse[i];
                assert!((p - 60.0 * v).abs() < 1e-10);
            }
        }
        // Kicks at 0.02 ... 0.05 - dt are damped, whatever way their times are rounded: 0.03 s.
        let expected = (-30.0_f64 * 0.03).exp();
        for p in mpm.points() {
            assert!((p.velocity[0] / 0.5 - expected).abs() < 1e-10, "{dt}");
        }
    }
}

/// Grains that share their volumes keep the pressure of the box that they fill, whichever walls close it: what nodes beyond a wall
/// have of them has its room within.
#[test]
fn grains_in_a_closed_box_keep_their_pressure() {
    use ShapeFunction::{CubicBspline, Linear, QuadraticBspline, Ugimp};
    let rough = Wall::Friction { coefficient: 0.3 };
    for shape in [QuadraticBspline, CubicBspline, Ugimp, Linear] {
        for (across, along) in [
            (rough, rough),
            (rough, Wall::Slip),
            (Wall::Slip, Wall::Slip),
        ] {
            let mut config = block();
            (config.shape, config.transfer) = (shape, Transfer::Flip);
            config.domain = [[0.0, 0.0], [0.5, 0.5]];
            config.walls = walls(along, along, across, across);
            config.groups[0].fill = rectangle_fill([0.0, 0.0], [0.5, 0.5]);
            config.groups[0].fields.stress = Some(texts(["-1e3", "-1e3", "-1e3", "0"]));
            config.materials[0].model = MaterialModel::MuI(Inertial {
                volume_rate: 1e4,
                ..GRAINS
            });
            config.forcing.stages = vec![stage(0.0, 50.0, None)];
            let mut mpm = configured(&config);
            Stepper::new().run(&mut mpm, 2e-4, 1000);
            let points = mpm.points();
            let pressure = |s: [f64; 4]| -(s[0] + s[1] + s[2]) / 3.0;
            let mean = points.iter().map(|p| pressure(p.stress)).sum::<f64>() / points.len() as f64;
            assert!(
                (mean - 1e3).abs() < 0.1,
                "{shape:?} {across:?} {along:?}: {mean}"
            );
        }
    }
}
