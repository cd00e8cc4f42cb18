//! The whole step between periodic walls against the oracle, on random clouds under random contact forces. The kit's random
//! cases (`kit.rs`) have all other walls.

use interface::config::{ShapeFunction, Spacing, StressUpdate, Transfer, Wall, Walls};
use interface::message::wire::{EnvelopeVertex, ImpForce};
use interface::solver::MpmSolver;

use mechanics::reference::Reference;

use crate::blocks::{Random, Stepper, block, configured, points_fill, walls};

/// An outline so large that every point is an IMP.
pub fn everywhere() -> Vec<EnvelopeVertex> {
    [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]
        .map(|position| EnvelopeVertex {
            body: 0,
            position,
            reach: 0.0,
        })
        .to_vec()
}

/// A force with a couple on a point at `x` (m), if it is far from periodic walls.
fn pressed(x: [f64; 2], walls: &Walls, random: &mut Random) -> ImpForce {
    let force = [random.between(-900.0, 900.0), random.between(-900.0, 900.0)];
    let free = (walls.left != Wall::Periodic || (0.0..0.45).contains(&x[0]))
        && (walls.bottom != Wall::Periodic || x[1] > 0.3);
    let pressed = ImpForce {
        force,
        couple: random.between(-9.0, 9.0),
        tangential: 1e-3,
        ..ImpForce::default()
    };
    if free { pressed } else { ImpForce::default() }
}

/// Compares a random cloud that fills `within`, at `velocity`. Points near the side walls have no contact forces.
fn compare_at(
    scheme: (ShapeFunction, Transfer, StressUpdate),
    walls: Walls,
    within: [[f64; 2]; 2],
    velocity: [f64; 2],
    seed: u64,
) {
    let (shape, transfer, stress_update) = scheme;
    let mut random = Random::new(seed);
    let mut config = block();
    config.shape = shape;
    config.transfer = transfer;
    config.stress_update = stress_update;
    config.gravity = [1.0, -9.81];
    config.walls = walls;
    let [low, high] = within;
    let positions: Vec<[f64; 2]> = (0..150)
        .map(|_| [0, 1].map(|a| random.between(low[a], high[a])))
        .collect();
    let side = 0.04;
    config.groups[0].fill = points_fill(positions.clone());
    config.groups[0].spacing = Spacing::Distance(side);
    config.groups[0].velocity = velocity;
    let mut mpm = configured(&config);
    assert_eq!(mpm.select_imps(&everywhere()).len(), positions.len());

    let mut reference = Reference::layers(&config)
        .expect("a known configuration")
        .remove(0);
    let mut stepper = Stepper::new();
    let mut impulse = [0.0; 2];
    let mass: f64 = reference.points.iter().map(|p| p.mass).sum();
    for n in 0..12 {
        let dt = random.between(2e-4, 5e-4);
        let press = |x: &[f64; 2]| pressed(*x, &walls, &mut random);
        let forces: Vec<ImpForce> = positions.iter().map(press).collect();
        let before = stepper.before;
        stepper
            .step(&mut mpm, dt, true, &forces)
            .expect("a sound step");
        reference.step(before, dt, &forces);
        for a in 0..2 {
            impulse[a] +=
                reference.told.applied[a] + 0.5 * (before + dt) * mass * config.gravity[a];
        }
        let states = mpm.imp_states().iter().zip(&forces);
        for ((p, f), r) in states.zip(&reference.points) {
            assert!(
                (p.spin - r.spin).abs() < 1e-9 && (f.tangential > 0.0 || p.spin == 0.0),
                "{shape:?} {transfer:?}: spin {} rad/s, expected {}",
                p.spin,
                r.spin
            );
        }
        for (p, r) in mpm.points().iter().zip(&reference.points) {
            for a in 0..2 {
                let (mut dx, dv) = (p.position[a] - r.x[a], p.velocity[a] - r.v[a]);
                if [walls.left, walls.bottom][a] == Wall::Periodic {
                    let size = config.domain[1][a] - config.domain[0][a];
                    dx -= size * (dx / size).round();
                }
                assert!(
                    dx.abs() < 1e-13 && dv.abs() < 1e-11,
                    "{shape:?} {transfer:?}: point {} in step {n}: {dx:e} m, {dv:e} m/s",
                    p.id
                );
            }
        }
        let applied = mpm.measurement().ledger.applied_impulse;
        for a in 0..2 {
            assert!(
                (applied[a] - impulse[a]).abs() < 1e-10 * mass,
                "impulse of gravity and walls"
            );
        }
    }
    // The test must have tested something: the forces have stirred the points.
    let speeds = || mpm.points().into_iter().map(|p| p.velocity[0]);
    let spread = speeds().fold(f64::MIN, f64::max) - speeds().fold(f64::MAX, f64::min);
    assert!(spread > 0.1, "{spread}");
}

#[test]
fn periodic_walls_agree_with_the_oracle() {
    use ShapeFunction::{CubicBspline, Linear, QuadraticBspline, Ugimp};
    let update = StressUpdate::Usf;
    let sides = walls(Wall::Periodic, Wall::Periodic, Wall::Slip, Wall::Open);
    let all = Walls {
        bottom: Wall::Periodic,
        top: Wall::Periodic,
        ..sides
    };
    // Two to three cells: points are sorted again twice, and cross.
    for (seed, scheme) in [
        (Linear, Transfer::Flip, update),
        (Ugimp, Transfer::Blend { pic_fraction: 0.3 }, update),
        (QuadraticBspline, Transfer::Apic, update),
        (QuadraticBspline, Transfer::Apic, StressUpdate::Musl),
        (QuadraticBspline, Transfer::Xpic { order: 2 }, update),
        (QuadraticBspline, Transfer::Aflip { pic_rate: 50.0 }, update),
        (CubicBspline, Transfer::Apic, update),
        (CubicBspline, Transfer::Flip, StressUpdate::Usl),
    ]
    .into_iter()
    .enumerate()
    {
        let within = [[-0.2, 0.11], [0.8, 0.5]];
        compare_at(scheme, sides, within, [30.0, 0.0], seed as u64);
        compare_at(scheme, all, within, [-30.0, -20.0], seed as u64);
    }
}
