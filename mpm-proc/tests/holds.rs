//! Held points and probes.

use core::f64::consts::PI;

use interface::config::{
    GridContact, Hold, MpmConfig, Probe, ShapeFunction, Spacing, StressUpdate, Transfer, Wall,
};
use interface::message::wire::{EnvelopeVertex, ImpForce};
use interface::solver::MpmSolver;

use crate::blocks::{Stepper, block, configured, elastic_model, rectangle_fill, walls};
use crate::saved::flying;
use mpm_proc::Mpm;

fn hold(within: [[f64; 2]; 2], [hold_x, hold_y]: [bool; 2]) -> Hold {
    Hold {
        name: "support".into(),
        points: "block".into(),
        within,
        hold_x,
        hold_y,
    }
}

/// A block that flies and turns beside a slip wall, with a few points held in both directions, a region of more points than
/// it has nodes in one, and a point at the wall, some of whose nodes are images.
fn supported(shape: ShapeFunction, transfer: Transfer) -> MpmConfig {
    let mut config = flying();
    (config.shape, config.transfer) = (shape, transfer);
    config.walls.right = Wall::Slip;
    config.groups[0].fill = rectangle_fill([0.5, 0.3], [0.8, 0.5]);
    config.groups[0].spacing = Spacing::PerCell(16);
    config.forcing.holds = vec![
        hold([[0.5, 0.3], [0.52, 0.31]], [true, true]),
        hold([[0.6, 0.4], [0.7, 0.5]], [false, true]),
        hold([[0.79, 0.34], [0.8, 0.35]], [true, true]),
        // The lower row of the first again: a point is held once.
        hold([[0.5, 0.3], [0.55, 0.307]], [true, true]),
    ];
    config
}

const SCHEMES: [(ShapeFunction, Transfer); 6] = [
    (ShapeFunction::Linear, Transfer::Flip),
    (ShapeFunction::Ugimp, Transfer::Blend { pic_fraction: 0.3 }),
    (ShapeFunction::QuadraticBspline, Transfer::Flip),
    (ShapeFunction::QuadraticBspline, Transfer::Apic),
    (ShapeFunction::CubicBspline, Transfer::Apic),
    (ShapeFunction::CubicBspline, Transfer::Pic),
];

#[test]
fn held_points_keep_their_place_and_the_impulses_are_booked() {
    for (shape, transfer) in SCHEMES {
        for update in [StressUpdate::Usf, StressUpdate::Musl, StressUpdate::Usavg] {
            let mut config = supported(shape, transfer);
            config.stress_update = update;
            let what = format!("{shape:?} {transfer:?} {update:?}");
            let mut mpm = configured(&config);
            let start = mpm.points();
            let mut stepper = Stepper::new();
            stepper.step(&mut mpm, 0.0, true, &[]).expect(&what);
            let ledger = mpm.measurement().ledger;
            let before = ledger.momentum;
            stepper.run(&mut mpm, 2e-4, 300);
            stepper.step(&mut mpm, 2e-4, true, &[]).expect(&what);
            let ledger = mpm.measurement().ledger;
            for a in 0..2 {
                let gap = ledger.momentum[a] - before[a] - ledger.applied_impulse[a];
                // The block has 60 kg/m at 3 m/s.
                assert!(gap.abs() < 1e-10, "{what}: {gap:e}");
            }
            let mut held = 0;
            for (a, b) in start.iter().zip(mpm.points()) {
                for hold in &config.forcing.holds {
                    let [low, high] = hold.within;
                    let along = [hold.hold_x, hold.hold_y];
                    if (0..2).all(|i| (low[i]..=high[i]).contains(&a.position[i])) {
                        for i in (0..2).filter(|&i| along[i]) {
                            held += 1;
                            let way = (b.position[i] - a.position[i]).abs();
                            // Points that slide have weights that only just tell a node: 1e-6 of (2 E/m_p)^1/2 = 59 m/s
                            // over 60 ms is what they may go. Those that stay stay to rounding.
                            let most = if along == [true; 2] { 1e-10 } else { 4e-6 };
                            assert!(way < most, "{what}: {way:e} m");
                        }
                    }
                }
            }
            assert!(held > 70, "{held}");
        }
    }
}

/// A bar between slip walls, of `E = 1e5`, `nu = 0` and `c = 10 m/s`, held in the middle. Either half swings in its first mode,
/// `u = a/(2 pi c) |sin(2 pi x)| sin(2 pi c t)`, so that the support takes the jump of the stress, `2 E a/c sin(2 pi c t)` per
/// height. Returns the relative rms error of the displacement, and the largest error of the support's force over its
/// amplitude.
fn held_bar(shape: ShapeFunction, cells: u32) -> [f64; 2] {
    let (speed, amplitude, stiffness) = (10.0, 1e-6, 1e5);
    let cell = 1.0 / f64::from(cells);
    let mut config = block();
    (config.shape, config.transfer) = (shape, Transfer::Flip);
    config.stress_update = StressUpdate::Usavg;
    config.cell = cell;
    config.domain = [[0.0, 0.0], [1.0, 2.0 * cell]];
    config.walls = walls(Wall::Slip, Wall::Slip, Wall::Slip, Wall::Slip);
    config.materials[0].model = elastic_model(stiffness / 3.0, stiffness / 2.0);
    let [lower, upper] = config.domain;
    config.groups[0].fill = rectangle_fill(lower, upper);
    // An odd number of columns: one stands in the middle.
    config.groups[0].spacing = Spacing::Counts([3 * cells + 1, 6]);
    config.groups[0].fields.velocity = Some([format!("{amplitude}*abs(sin(2*pi*x))"), "0".into()]);
    let middle = [[0.5 - 1e-6, 0.0], [0.5 + 1e-6, 1.0]];
    config.forcing.holds = vec![hold(middle, [true, false])];
    let mut mpm = configured(&config);
    let start = mpm.points();
    let omega = 2.0 * PI * speed;
    let end = 0.7 * PI / omega;
    let steps = (end * speed * 10.0 / cell).ceil();
    let dt = end / steps;
    let mut stepper = Stepper::new();
    let (mut sum, mut worst): (f64, f64) = (0.0, 0.0);
    let force = 2.0 * stiffness * amplitude / speed * 2.0 * cell;
    for n in 0..steps as usize {
        let time = stepper.time;
        stepper.step(&mut mpm, dt, true, &[]).expect("a sound step");
        let told = mpm.measurement().groups[1];
        assert_eq!(told.contact_force[1], 0.0);
        sum += told.contact_force[0];
        // The mean over a tenth of the time: single steps have the noise of the points that cross cells.
        if (n + 1) % (steps as usize / 10) == 0 {
            let k = steps as usize / 10;
            let mean = sum / k as f64 / force;
            let [t1, t0] = [time + 0.5 * dt, time + 0.5 * dt - k as f64 * dt];
            let exact = ((omega * t0).cos() - (omega * t1).cos()) / (omega * (t1 - t0));
            worst = worst.max((mean.abs() - exact).abs());
            sum = 0.0;
        }
    }
    let (mut error, mut scale) = (0.0, 0.0);
    for (a, b) in start.iter().zip(mpm.points()) {
        let exact =
            amplitude / omega * (2.0 * PI * a.position[0]).sin().abs() * (omega * end).sin();
        error += (b.position[0] - a.position[0] - exact).powi(2);
        scale += exact.powi(2);
    }
    [f64::sqrt(error / scale), worst]
}

#[test]
fn a_bar_that_is_held_in_the_middle_swings_as_two() {
    for shape in [ShapeFunction::Linear, ShapeFunction::QuadraticBspline] {
        let errors = [16, 32, 64].map(|n| held_bar(shape, n));
        println!("{shape:?}: {errors:?}");
        // The displacement bends at the support, within reach of one shape function: first order.
        let order = 0.5 * (errors[0][0] / errors[2][0]).log2();
        assert!((0.7..1.5).contains(&order), "{shape:?}: {order} {errors:?}");
        assert!(errors[2][0] < 0.02, "{shape:?}: {errors:?}");
        assert!(errors[2][1] < 0.04, "{shape:?}: {errors:?}");
    }
}

/// Between two kicks the energy of a supported block changes by no more than that of a free one: supports do no work.
#[test]
fn supports_do_no_work() {
    let drift = |holds: bool| {
        let mut config = block();
        (config.shape, config.transfer) = (ShapeFunction::QuadraticBspline, Transfer::Flip);
        config.stress_update = StressUpdate::Usavg;
        config.groups[0].spacing = Spacing::PerCell(9);
        config.groups[0].fields.velocity = Some(["0".into(), "0.05*sin(pi*(x-0.1)/0.3)".into()]);
        if holds {
            // A beam on two points.
            config.forcing.holds = vec![
                hold([[0.1, 0.3], [0.11, 0.31]], [true, true]),
                hold([[0.39, 0.3], [0.4, 0.31]], [false, true]),
            ];
        }
        let mut mpm = configured(&config);
        let mut stepper = Stepper::new();
        let mut energies = Vec::new();
        for _ in 0..2000 {
            stepper.step(&mut mpm, 2e-4, true, &[]).expect("sound");
            let l = mpm.measurement().ledger;
            energies.push(l.kinetic + l.elastic);
        }
        // After the first reflections: the field that it begins with is not one of a supported block.
        let (first, last) = (energies[200], energies[1999]);
        println!("holds {holds}: {:e}", last / first - 1.0);
        (last / first - 1.0).abs()
    };
    let [free, held] = [drift(false), drift(true)];
    assert!(held < free.max(2e-3), "{held:e} beside {free:e}");
}

/// The support of what hangs at rest carries its weight.
#[test]
fn a_support_carries_the_weight() {
    let mut config = block();
    config.gravity = [0.0, -9.81];
    // Damping without a stage, whose own share of a kick would be taken before the support gets the rest.
    config.transfer = Transfer::Pic;
    config.forcing.holds = vec![hold([[0.1, 0.48], [0.4, 0.5]], [true, true])];
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    stepper.run(&mut mpm, 2e-4, 4000);
    stepper.step(&mut mpm, 2e-4, true, &[]).expect("sound");
    let support = mpm.measurement().groups[1];
    let weight = 1000.0 * 0.3 * 0.2 * 9.81;
    let force = support.contact_force;
    assert!((force[1] / weight - 1.0).abs() < 1e-6, "{force:?}");
    assert!(force[0].abs() < 1e-6 * weight, "{force:?}");
}

/// A probe tells what the points say one by one.
#[test]
fn a_probe_is_the_mean_of_its_points() {
    for grains in [false, true] {
        let mut config = flying();
        let mut other = config.groups[0].clone();
        config.groups[0].spacing = Spacing::PerCell(4);
        other.fill = rectangle_fill([0.45, 0.3], [0.6, 0.5]);
        other.name = "other".into();
        config.groups.push(other);
        let probe = |points: &str, within| Probe {
            name: "probe".into(),
            points: points.into(),
            within,
        };
        // Not in the order of the groups.
        let [last, first] = [[[0.45, 0.3], [0.5, 0.33]], [[0.2, 0.35], [0.3, 0.45]]];
        config.probes = vec![probe("other", last), probe("block", first)];
        let mut forces = Vec::new();
        if grains {
            config.grid_contact = Some(GridContact { friction: 0.0 });
        }
        let mut mpm = configured(&config);
        let start = mpm.points();
        if !grains {
            forces = pressed(&mut mpm);
        }
        let mut stepper = Stepper::new();
        for _ in 0..50 {
            stepper.step(&mut mpm, 2e-4, true, &forces).expect("sound");
        }
        let groups = mpm.measurement().groups.clone();
        assert_eq!(groups.len(), 4);
        for (told, (group, [low, high])) in groups[2..].iter().zip([(1, last), (0, first)]) {
            let of = |x: &[f64; 2]| (0..2).all(|a| (low[a]..=high[a]).contains(&x[a]));
            let chosen = start.iter().zip(mpm.points());
            let chosen: Vec<_> = chosen
                .filter(|(a, _)| a.group == group && of(&a.position))
                .collect();
            let mass: f64 = chosen.iter().map(|(_, p)| p.mass).sum();
            assert!((told.mass / mass - 1.0).abs() < 1e-14 && chosen.len() > 5);
            // The measurement is of the beginning of the step, points are at its end.
            for a in 0..2 {
                let mean = |of: &dyn Fn(&interface::message::wire::PointState) -> f64| {
                    chosen.iter().map(|(_, p)| p.mass * of(p)).sum::<f64>() / mass
                };
                let x = mean(&|p| p.position[a]) - 2e-4 * mean(&|p| p.velocity[a]);
                assert!((told.position[a] - x).abs() < 2e-7, "{grains}");
            }
            assert_eq!(told.contacts > 0, !grains && group == 0);
            let forced = [0, 1].map(|a| {
                if told.contacts > 0 {
                    told.contacts as f64 * [-0.5, 0.25][a]
                } else {
                    0.0
                }
            });
            for a in 0..2 {
                assert!((told.contact_force[a] - forced[a]).abs() < 1e-12);
            }
        }
    }
}

/// Presses on every point of the first group, and on no other.
fn pressed(mpm: &mut Mpm) -> Vec<ImpForce> {
    let corners = [[-0.2, 0.1], [0.42, 0.1], [0.42, 0.9], [-0.2, 0.9]];
    let envelope = corners.map(|position| EnvelopeVertex {
        body: 0,
        position,
        reach: 0.0,
    });
    let infos = mpm.select_imps(&envelope);
    infos
        .iter()
        .map(|info| ImpForce {
            force: if info.group == 0 {
                [-0.5, 0.25]
            } else {
                [0.0; 2]
            },
            stiffness: 0.0,
            ..ImpForce::default()
        })
        .collect()
}
