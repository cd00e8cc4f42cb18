//! Periodic walls, and walls that are mirrors to B-splines.

use interface::config::{MpmConfig, ShapeFunction, Spacing, Transfer, Wall, Walls};
use interface::message::wire::ImpForce;
use interface::solver::{Fault, MpmSolver};

use crate::blocks::{Stepper, block, configured, disc_fill, everywhere, walls};

const AROUND: Walls = walls(
    Wall::Periodic,
    Wall::Periodic,
    Wall::Periodic,
    Wall::Periodic,
);

/// A disc about (`x`, 0.4) that spins, swells and flies, in a domain that closes on itself after 20 by 16 cells.
fn disc(shape: ShapeFunction, transfer: Transfer, x: f64, threads: usize) -> MpmConfig {
    let mut config = block();
    (config.shape, config.transfer) = (shape, transfer);
    config.threads = threads;
    config.walls = AROUND;
    config.groups[0].fill = disc_fill([x, 0.4], 0.15);
    config.groups[0].spacing = Spacing::PerCell(9);
    config.groups[0].velocity = [5.0, -4.0];
    config.constants.insert("a".into(), x);
    config.groups[0].fields.velocity =
        Some(["2*(x-a) - 5*(y-0.4)".into(), "2*(y-0.4) + 5*(x-a)".into()]);
    config
}

/// A fall that never ends: each round gravity does the same work again, and the ledger shows it.
#[test]
fn energy_of_a_fall_through_periodic_walls_is_booked() {
    let mut config = disc(ShapeFunction::QuadraticBspline, Transfer::Apic, 0.3, 1);
    config.gravity = [3.0, -9.81];
    config.groups[0].fields.velocity = None;
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    let mut energies = Vec::new();
    for _ in 0..40 {
        stepper.run(&mut mpm, 1e-3, 9);
        stepper
            .step(&mut mpm, 1e-3, true, &[])
            .expect("a sound step");
        let l = mpm.measurement().ledger;
        energies.push(l.kinetic + l.elastic + l.gravity - l.driven_work);
    }
    let l = mpm.measurement().ledger;
    // 4 m/s 0.4 s + g t^2/2 = 2.4 m: three times round.
    assert!(l.driven_work > 0.0 && l.kinetic > 60.0 * 20.0);
    for e in &energies {
        assert!((e - energies[0]).abs() < 1e-9 * l.kinetic, "{energies:?}");
    }
}

#[test]
fn a_body_at_a_periodic_wall_stops_the_run() {
    let mut mpm = configured(&disc(
        ShapeFunction::QuadraticBspline,
        Transfer::Apic,
        0.64,
        1,
    ));
    let count = mpm.select_imps(&everywhere()).len();
    let mut forces = vec![ImpForce::default(); count];
    let near_wall = |p: &interface::message::wire::PointState| p.position[0] > 0.77;
    let (id, far) = (
        mpm.points().iter().position(near_wall).expect("one"),
        mpm.points()
            .iter()
            .position(|p| p.position[0] < 0.7)
            .expect("one"),
    );
    forces[far].force = [1.0, 0.0];
    let mut stepper = Stepper::new();
    stepper
        .step(&mut mpm, 1e-4, false, &forces)
        .expect("far from the wall");
    forces[id].stiffness = 1.0;
    match stepper.step(&mut mpm, 1e-4, false, &forces) {
        Err(Fault::Other(message)) => assert!(message.contains("periodic wall"), "{message}"),
        other => panic!("{other:?}"),
    }
}

/// Points that have crossed are elsewhere, so the identified points must be chosen anew.
#[test]
fn crossing_makes_the_set_of_identified_points_stale() {
    let mut mpm = configured(&disc(
        ShapeFunction::QuadraticBspline,
        Transfer::Apic,
        0.6,
        1,
    ));
    mpm.select_imps(&[]);
    let mut stepper = Stepper::new();
    stepper.run(&mut mpm, 2e-4, 20);
    assert!(mpm.travel() < 0.05);
    stepper.run(&mut mpm, 2e-4, 60);
    assert_eq!(mpm.travel(), f64::INFINITY);
    mpm.select_imps(&[]);
    assert_eq!(mpm.travel(), 0.0);
}

/// A region may reach over a periodic wall: the rest of it begins at the other end.
#[test]
fn a_region_over_a_periodic_wall_enters_at_the_other_end() {
    let config = |x| disc(ShapeFunction::QuadraticBspline, Transfer::Apic, x, 1);
    let (mut within, mut over) = (config(0.3), config(0.8));
    for config in [&mut within, &mut over] {
        config.groups[0].fields.velocity = None;
    }
    let (a, b) = (configured(&within).points(), configured(&over).points());
    assert_eq!(a.len(), b.len());
    let mut entered = 0;
    for (a, b) in a.iter().zip(&b) {
        let way = b.position[0] - a.position[0] - 0.5;
        assert!(way.abs() < 1e-14 || (way + 1.0).abs() < 1e-14, "{way}");
        assert!((-0.2..=0.8).contains(&b.position[0]));
        entered += usize::from(way < -0.5);
    }
    assert_eq!(entered, a.len() / 2);
    // A probe of the same region has all of them.
    let ends = [[0.3, -1.0], [1.3, 1.0]];
    let all = |p: &&interface::message::wire::PointState| over.is_within(p.position, ends);
    assert_eq!(b.iter().filter(all).count(), b.len());
    let outside = [[0.55, -1.0], [1.05, 1.0]];
    assert!(!over.is_within([0.3, 0.4], outside) && over.is_within([0.0, 0.4], outside));
}
