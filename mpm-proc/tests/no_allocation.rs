//! After it has warmed up, a step allocates nothing.

use interface::config::{MpmConfig, Transfer, Wall};
use interface::message::wire::{EnvelopeVertex, ImpForce};
use interface::solver::MpmSolver;
use interface::step::Step;
use mpm_proc::Mpm;

#[path = "column.rs"]
mod column;

fn allocates_nothing(what: &str, config: &MpmConfig) {
    let mut mpm = Mpm::new();
    let ready = mpm.configure(config).expect("a good configuration");
    // A body over the upper right corner of the column.
    let corner = [[0.9, 0.9], [2.0, 0.9], [2.0, 2.0], [0.9, 2.0]];
    let envelope = corner.map(|position| EnvelopeVertex {
        body: 0,
        position,
        reach: 0.0,
    });
    let count = mpm.select_imps(&envelope).len();
    assert!(count > 10);
    let press = ImpForce {
        force: [-1e-3, -1e-3],
        stiffness: 1e3,
        ..ImpForce::default()
    };
    let forces = vec![press; count];
    let dt = 0.2 * ready.courant_time;
    let mut step = Step {
        index: 0,
        time: 0.0,
        dt_before: dt,
        dt,
        measure: false,
    };
    let mut run = |steps: usize, measure: bool| {
        step.measure = measure;
        for _ in 0..steps {
            mpm.imp_states();
            mpm.step(&step, &forces).expect("a sound step");
            step.index += 1;
            step.time += dt;
        }
    };
    run(20, true);
    let counted = allocation_counter::measure(|| run(50, true));
    assert_eq!(counted.count_total, 0, "{what}: {counted:?}");
}

#[test]
fn a_step_allocates_nothing_after_warm_up() {
    for model in [column::ELASTIC, column::SAND] {
        allocates_nothing("column", &column::column(10_000, 1, model));
    }
    let mut config = column::column(10_000, 1, column::ELASTIC);
    config.transfer = Transfer::Xpic { order: 2 };
    allocates_nothing("xpic", &config);
    let wave = ["1e-3*sin(x)*cos(50*t)".into(), "1e-3*y*t".into()];
    config.forcing.body_force = Some(wave);
    config.transfer = Transfer::Flip;
    allocates_nothing("body force", &config);
    config.walls.left = Wall::Periodic;
    config.walls.right = Wall::Periodic;
    allocates_nothing("periodic walls", &config);
}
