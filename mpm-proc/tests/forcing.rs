//! Initial fields, body forces, dead loads and stages.

use interface::config::{
    InitialFields, MpmConfig, ShapeFunction, Spacing, Stage, Traction, Transfer, Wall,
};
use interface::solver::{Fault, MpmSolver};

use crate::blocks::{
    BULK, SHEAR, Stepper, bits, block, configured, elastic_model, points_fill, rectangle_fill,
    stand, walls,
};
use mpm_proc::Mpm;

fn texts<const N: usize>(sources: [&str; N]) -> [String; N] {
    sources.map(Into::into)
}

fn velocity(config: &mut MpmConfig, field: [&str; 2]) {
    config.groups[0].fields = InitialFields {
        velocity: Some(texts(field)),
        stress: None,
    };
}

fn stress(config: &mut MpmConfig, field: [&str; 4]) {
    config.groups[0].fields = InitialFields {
        velocity: None,
        stress: Some(texts(field)),
    };
}

fn stage(from: f64, damping: f64, pic_fraction: Option<f64>) -> Stage {
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
fn a_velocity_field_is_added_to_the_uniform_velocity() {
    let mut config = block();
    config.groups[0].velocity = [1.0, -2.0];
    config.constants.insert("k".into(), 3.0);
    velocity(&mut config, ["k*x*y", "sin(x)"]);
    for p in configured(&config).points() {
        let [x, y] = p.position;
        assert_eq!(p.velocity, [1.0 + 3.0 * x * y, -2.0 + x.sin()]);
    }
}

/// Without its affine part from the field a spinning body would lose angular momentum in the first step.
#[test]
fn a_spin_given_as_a_field_stays_under_affine_transfer() {
    for shape in [ShapeFunction::QuadraticBspline, ShapeFunction::CubicBspline] {
        let mut config = block();
        config.shape = shape;
        velocity(&mut config, ["-2*(y-0.4)", "2*(x-0.25)"]);
        let mut mpm = configured(&config);
        let start = mpm.points();
        let mut stepper = Stepper::new();
        stepper.run(&mut mpm, 1e-9, 3);
        for (a, b) in start.iter().zip(mpm.points()) {
            for i in 0..2 {
                assert!((a.velocity[i] - b.velocity[i]).abs() < 1e-8, "{shape:?}");
            }
        }
    }
}

#[test]
fn an_initial_stress_has_its_energy_and_releases_it() {
    let mut config = block();
    (config.shape, config.transfer) = (ShapeFunction::Ugimp, Transfer::Flip);
    stress(&mut config, ["-200", "-200", "-200", "50"]);
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    let start = measured(&mut stepper, &mut mpm, 1e-4);
    // p^2/2K + s:s/4G, over 0.3 x 0.2 m.
    let expected = 0.06 * (200.0 * 200.0 / (2.0 * BULK) + 2.0 * 50.0 * 50.0 / (4.0 * SHEAR));
    assert!((start.elastic / expected - 1.0).abs() < 1e-12);
    stepper.run(&mut mpm, 1e-4, 40);
    let later = measured(&mut stepper, &mut mpm, 1e-4);
    assert!(later.kinetic > 0.1 * expected && later.elastic < 0.9 * expected);
    assert!(later.kinetic + later.elastic < 1.01 * expected);
}

/// A column that begins with the stress of its weight stays where it is; without, it bounces.
#[test]
fn a_geostatic_state_is_at_rest() {
    let run = |with: bool| {
        let mut config = block();
        (config.shape, config.transfer) = (ShapeFunction::Ugimp, Transfer::Flip);
        config.gravity = [0.0, -10.0];
        stand(&mut config, 1.0, 1.2);
        if with {
            // At rest sideways: sigma_xx/sigma_yy = (K - 2G/3)/(K + 4G/3) = 1/3.
            let depth = "-1000*10*(1-y)";
            let across = "-1000*10*(1-y)/3";
            stress(&mut config, [across, depth, across, "0"]);
        }
        let mut mpm = configured(&config);
        let mut stepper = Stepper::new();
        let mut largest: f64 = 0.0;
        for _ in 0..400 {
            stepper.run(&mut mpm, 4e-4, 1);
            for p in mpm.points() {
                largest = largest.max(p.velocity[1].abs());
            }
        }
        largest
    };
    let (with, without) = (run(true), run(false));
    // What is left is the half cell at the surface and the floor, which the grid does not load as the continuum is.
    assert!(with < 0.05 * without, "{with} {without}");
}

#[test]
fn a_body_force_that_is_constant_is_gravity() {
    let run = |force: bool| {
        let mut config = block();
        (config.shape, config.transfer) = (ShapeFunction::Ugimp, Transfer::Flip);
        config.walls.bottom = Wall::Fixed;
        config.groups[0].fill = rectangle_fill([0.1, 0.1], [0.4, 0.3]);
        if force {
            config.forcing.body_force = Some(texts(["1", "-9.81"]));
        } else {
            config.gravity = [1.0, -9.81];
        }
        let mut mpm = configured(&config);
        let mut stepper = Stepper::new();
        let start = measured(&mut stepper, &mut mpm, 2e-4);
        stepper.run(&mut mpm, 2e-4, 200);
        let end = measured(&mut stepper, &mut mpm, 2e-4);
        (mpm.points(), start, end)
    };
    let ((a, start, end), (b, start_b, end_b)) = (run(false), run(true));
    for (a, b) in a.iter().zip(&b) {
        for i in 0..2 {
            assert!((a.position[i] - b.position[i]).abs() < 1e-12);
        }
    }
    let work = end_b.driven_work - start_b.driven_work;
    let fall = start.gravity - end.gravity;
    assert!((work / fall - 1.0).abs() < 1e-9, "{work} {fall}");
    for i in 0..2 {
        let change = end.applied_impulse[i] - end_b.applied_impulse[i];
        assert!(change.abs() < 1e-10, "{change}");
    }
}

/// Isolated points feel nothing but the formula: `x = X + a(X) t^2/2` whatever way they go, since `a` is asked for at
/// the place where a point began.
#[test]
fn a_body_force_belongs_to_the_initial_position() {
    let mut config = block();
    (config.shape, config.transfer) = (ShapeFunction::Ugimp, Transfer::Flip);
    config.domain = [[0.0, 0.0], [2.0, 2.0]];
    let starts = vec![[0.3, 0.4], [0.9, 0.9], [1.5, 1.6], [0.4, 1.5], [1.6, 0.3]];
    config.groups[0].fill = points_fill(starts.clone());
    config.groups[0].spacing = Spacing::Distance(0.02);
    config.constants.insert("k".into(), 5.0);
    config.forcing.body_force = Some(texts(["k*(y-1)", "x*y"]));
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    stepper.run(&mut mpm, 1e-3, 300);
    let t = stepper.time;
    for (start, p) in starts.iter().zip(mpm.points()) {
        let a = [5.0 * (start[1] - 1.0), start[0] * start[1]];
        for i in 0..2 {
            let expected = start[i] + 0.5 * a[i] * t * t;
            assert!((p.position[i] - expected).abs() < 1e-11);
        }
    }
}

#[test]
fn work_and_impulse_of_a_swinging_body_force_are_booked() {
    let mut config = block();
    config.constants.insert("w".into(), 300.0);
    config.forcing.body_force = Some(texts(["40*cos(w*t)", "-20*sin(w*t)"]));
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    let mass = 60.0;
    for n in 0..60 {
        let ledger = measured(&mut stepper, &mut mpm, 1e-4);
        let t = f64::from(n) * 1e-4;
        let speed = [40.0 * (300.0 * t).sin(), 20.0 * ((300.0 * t).cos() - 1.0)].map(|v| v / 300.0);
        let kinetic = 0.5 * mass * (speed[0] * speed[0] + speed[1] * speed[1]);
        // (w dt)^2 = 1e-3 of the largest kinetic energy, 0.9 J.
        assert!((ledger.kinetic - kinetic).abs() < 1e-3, "{n}");
        assert!(balance(&mpm).abs() < 1e-3, "{n}: {}", balance(&mpm));
        for i in 0..2 {
            assert!((ledger.momentum[i] - ledger.applied_impulse[i]).abs() < 1e-12 * mass);
        }
    }
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

/// Every point slows as `exp(-c t)`, also by the part of its velocity that the nodes average away, and all that the points
/// lose is booked.
#[test]
fn damping_reaches_what_the_grid_does_not_see() {
    for shape in [ShapeFunction::Ugimp, ShapeFunction::QuadraticBspline] {
        let mut config = block();
        (config.shape, config.transfer) = (shape, Transfer::Flip);
        config.materials[0].model = elastic_model(1e-9, 1e-9);
        velocity(&mut config, ["sin(123*x)", "cos(77*y)"]);
        config.forcing.stages = vec![stage(0.0, 30.0, None)];
        let mut mpm = configured(&config);
        let velocities =
            |mpm: &Mpm| -> Vec<[f64; 2]> { mpm.points().iter().map(|p| p.velocity).collect() };
        let before = velocities(&mpm);
        let mut stepper = Stepper::new();
        let mut energy = None;
        for n in 0..=100 {
            let dt = if n == 100 { 0.0 } else { 1e-3 };
            let ledger = measured(&mut stepper, &mut mpm, dt);
            let now = ledger.kinetic + ledger.viscous_work;
            let all = *energy.get_or_insert(now);
            assert!((now / all - 1.0).abs() < 1e-12, "{n} {now} {all}");
        }
        // Kicks of 0.5, 1, 1, ... 1, 0.5 ms.
        let expected = (-30.0_f64 * 0.1).exp();
        for (b, a) in before.iter().zip(velocities(&mpm)) {
            for i in 0..2 {
                assert!((a[i] - expected * b[i]).abs() < 1e-12, "{b:?} {a:?}");
            }
        }
    }
}

#[test]
fn a_stage_of_pic_is_a_blend_from_then_on() {
    let run = |transfer: Transfer, stages: Vec<Stage>| {
        let mut config = block();
        config.shape = ShapeFunction::Ugimp;
        config.transfer = transfer;
        velocity(&mut config, ["sin(20*x)", "cos(15*y)"]);
        config.forcing.stages = stages;
        let mut mpm = configured(&config);
        Stepper::new().run(&mut mpm, 2e-4, 50);
        bits(&mpm)
    };
    let blend = Transfer::Blend { pic_fraction: 0.25 };
    let whole = run(blend, vec![]);
    assert_eq!(
        run(Transfer::Flip, vec![stage(0.0, 0.0, Some(0.25))]),
        whole
    );
    assert_eq!(
        run(
            blend,
            vec![stage(0.0, 0.0, None), stage(9.0, 0.0, Some(1.0))]
        ),
        whole
    );
    let flip = run(Transfer::Flip, vec![]);
    assert_eq!(run(Transfer::Flip, vec![stage(9.0, 5.0, None)]), flip);
    let half = run(Transfer::Flip, vec![stage(0.005, 0.0, Some(0.25))]);
    assert!(half != whole && half != flip);
}
