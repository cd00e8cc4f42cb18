//! Bodies in contact with bodies, compared with closed forms.

use crate::small_scenes::walls::{open_box, wall};
use crate::small_scenes::*;
use dem_proc::Sdem;
use interface::Vec2;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Interface, Motion, OverlapMeasure,
    ratio_of_restitution,
};
use interface::message::wire::ImpInfo;
use interface::solver::DemSolver;

/// Does `n` steps of `dt`; the first is the first step of a run.
fn run(dem: &mut Sdem, n: usize, dt: f64) {
    for i in 0..n {
        let mut step = step(if i == 0 { 0.0 } else { dt }, dt);
        step.measure = i + 1 == n;
        step.time = i as f64 * dt;
        dem.contact(&step, &[], &mut []).unwrap();
        dem.advance(&step).unwrap();
    }
}

fn viscous(k: f64, friction: f64, ratio: f64) -> ContactLaw {
    ContactLaw::linear(k, 0.5 * k, friction, ratio)
}

/// A disc of radius 0.1 and 1 kg/m that flies at a floor whose surface is y = 0.
fn disc_at_floor(velocity: [f64; 2], law: ContactLaw) -> DemConfig {
    let disc = BodyConfig {
        position: [0.0, 0.1 + 1e-4],
        velocity,
        ..body(BodyShape::Disc, 0.1)
    };
    let floor = wall("floor", [-5.0, -0.1], [5.0, -0.1], 0.1);
    DemConfig {
        body_contact: Some(law),
        ..scene(vec![floor, disc], spring(1.0))
    }
}

/// Velocity and spin after the bounce.
fn after_bounce(config: &DemConfig, dt: f64) -> (Vec2, f64) {
    let mut dem = configured(config);
    for i in 0..10_000_000 {
        go(&mut dem, i == 0, dt);
        let state = &dem.bodies().state[1];
        if state.center.y > 0.1 && state.velocity.y > 0.0 {
            return (state.velocity, state.spin);
        }
    }
    panic!("it never came back");
}

/// Restitution of two free discs of radius 0.1 and these masses (kg/m) that meet head-on at 1 m/s, and the number of
/// steps in contact.
fn restitution_of_discs(masses: [f64; 2], law: ContactLaw, dt: f64) -> (f64, u32) {
    let disc = |x: f64, velocity: f64, mass: f64| BodyConfig {
        position: [x, 0.0],
        velocity: [velocity, 0.0],
        inertia: BodyInertia::Mass(mass),
        ..body(BodyShape::Disc, 0.1)
    };
    let mut dem = configured(&DemConfig {
        body_contact: Some(law),
        ..scene(
            vec![
                disc(-0.1 - 0.5 * dt, 1.0, masses[0]),
                disc(0.1, 0.0, masses[1]),
            ],
            spring(1.0),
        )
    });
    let mut touched = 0;
    for i in 0..1_000_000 {
        let step = step(if i == 0 { 0.0 } else { dt }, dt);
        dem.contact(&step, &[], &mut []).unwrap();
        let touches = dem.contacts() > 0;
        dem.advance(&step).unwrap();
        touched += u32::from(touches);
        if touched > 0 && !touches {
            let [a, b] = [0, 1].map(|b| dem.bodies().state[b].velocity.x);
            return (b - a, touched);
        }
    }
    panic!("they never parted");
}

/// A rod that is hinged at its centre strikes a fixed disc with its end: its dashpots are those of its mass `m`, and `I/r^2` is what
/// swings.
#[test]
fn a_hinged_body_has_dashpots() {
    let e = 0.5;
    let gate = |zeta: f64| {
        let rod = BodyConfig {
            spin: -1e-2,
            motion: Motion::Guided {
                hold_x: true,
                hold_y: true,
                hold_angle: false,
            },
            ..body(segment_shape([[-1.0, 0.0], [1.0, 0.0]]), 0.01)
        };
        let stop = BodyConfig {
            position: [1.0, -0.11],
            motion: Motion::Fixed,
            ..body(BodyShape::Disc, 0.1)
        };
        configured(&scene(vec![rod, stop], viscous(1e6, 0.0, zeta)))
    };
    let elastic = gate(0.0);
    let rod = &elastic.bodies().properties[0];
    let mut dem = gate(ratio_of_restitution(e) * (rod.inertia / rod.mass).sqrt());
    let dt = 1e-3 * (rod.inertia / 1e6).sqrt();
    for i in 0..5000 {
        go(&mut dem, i == 0, dt);
    }
    let given = dem.bodies().state[0].spin / 1e-2;
    assert!((given / e - 1.0).abs() < 5e-3, "{given}");
}

/// The restitution is the one asked for, for any masses, below and above critical damping (e = 0.1), and for both laws.
#[test]
fn a_contact_has_the_restitution_that_is_asked_for() {
    for e in [
        0.1, 0.13, 0.14, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95,
    ] {
        for ratio in [1.0_f64, 10.0, 1000.0] {
            let reduced = ratio / (1.0 + ratio);
            let k = 1e6;
            let linear = viscous(k, 0.0, ratio_of_restitution(e));
            let constant = 1e8;
            let hertz = hertz_law(constant, 0.3, 0.0, e, 0.0);
            // Overlap of an elastic impact at 1 m/s divided by that speed: 1/omega of the linear spring.
            let times = [(reduced / k).sqrt(), (1.25 * reduced / constant).powf(0.4)];
            for (law, time) in [linear, hertz].into_iter().zip(times) {
                let (given, steps) = restitution_of_discs([1.0, ratio], law, 5e-4 * time);
                assert!(steps > 1000);
                let (name, error) = (law.name(), given / e - 1.0);
                assert!(error.abs() < 5e-3, "{name} {ratio} {e}: {given}");
            }
        }
    }
}

#[test]
fn hertz_contact_time_and_depth_and_restitution_at_any_speed() {
    let constant = 1e8;
    let hertz = |restitution| hertz_law(constant, 0.3, 0.0, restitution, 0.0);
    for v in [0.1_f64, 1.0] {
        // Depth (5 m v^2 / 4 K)^(2/5), time 2.94327 depth / v (Hertz; Johnson 1985 section 11.4).
        let depth = (1.25 * v * v / constant).powf(0.4);
        let time = 2.943_275 * depth / v;
        let dt = time / 5000.0;
        let mut config = disc_at_floor([0.0, -v], hertz(1.0));
        config.bodies[1].position[1] = 0.1;
        let mut dem = configured(&config);
        let (mut deepest, mut steps) = (0.0_f64, 0);
        while steps < 20_000 {
            go(&mut dem, steps == 0, dt);
            steps += 1;
            let y = dem.bodies().state[1].center.y;
            deepest = deepest.max(0.1 - y);
            if y > 0.1 {
                break;
            }
        }
        assert!((deepest / depth - 1.0).abs() < 1e-4, "{deepest} {depth}");
        assert!((f64::from(steps) * dt / time - 1.0).abs() < 1e-3);
        assert!((dem.bodies().state[1].velocity.y / v - 1.0).abs() < 1e-4);
        let (after, _) = after_bounce(&disc_at_floor([0.0, -v], hertz(0.6)), dt);
        assert!((after.y / v - 0.6).abs() < 1e-3, "{}", after.y / v);
    }
}

/// Sticking with `k_t = k_n / 3`: tangential and normal spring have the same period, since the disc's surface has the
/// effective mass m/3. The surface's sliding velocity is reversed: impulse `2 v_s m / 3`.
#[test]
fn oblique_impact_that_sticks() {
    let (v_n, v_t, k) = (1.0, 0.5, 3e8);
    let (v, spin) = after_bounce(
        &disc_at_floor([v_t, -v_n], frictional(k, k / 3.0, 1.0)),
        1e-7,
    );
    let surface = v.x + spin * 0.1;
    assert!((surface + v_t).abs() < 2e-3, "{surface}");
    assert!((v.x - (v_t - 2.0 * v_t / 3.0)).abs() < 2e-3, "{}", v.x);
}

/// Displacement down a slope of `tan` after `time`, of a body that first came to rest on level ground.
fn down_slope(mut config: DemConfig, tan: f64, time: f64, dt: f64) -> (f64, f64) {
    let g = 9.81;
    let cos = 1.0 / (1.0 + tan * tan).sqrt();
    config.gravity = [0.0, -g * cos];
    let mut dem = configured(&config);
    run(&mut dem, (0.5 / dt) as usize, dt);
    // The same bodies continue from where they are, with tilted gravity.
    let state = dem.bodies().state[1];
    config.bodies[1].position = state.center.into();
    config.bodies[1].angle = state.angle;
    config.gravity = [g * cos * tan, -g * cos];
    let mut dem = configured(&config);
    run(&mut dem, (time / dt) as usize, dt);
    let end = dem.bodies().state[1];
    (end.center.x - state.center.x, end.angle - state.angle)
}

fn block(law: ContactLaw, width: f64, height: f64) -> DemConfig {
    let a = 0.01;
    let shape = rectangle_shape(width - 2.0 * a, height - 2.0 * a);
    let block = BodyConfig {
        position: [0.0, 0.5 * height],
        ..body(shape, a)
    };
    scene(
        vec![wall("floor", [-5.0, -0.1], [5.0, -0.1], 0.1), block],
        law,
    )
}

/// A block tips over its lower core corner when the centre of mass passes above it: `tan = core width / height`.
#[test]
fn a_tall_block_tips_at_the_right_angle() {
    let config = block(viscous(1e7, 2.0, 0.3), 0.1, 0.4);
    let critical: f64 = 0.08 / 0.4;
    let at = |degrees: f64| (critical.atan() + degrees.to_radians()).tan();
    let (_, stands) = down_slope(config.clone(), at(-0.3), 1.0, 2e-5);
    assert!(stands.abs() < 0.01, "{stands}");
    let (_, falls) = down_slope(config, at(0.3), 1.0, 2e-5);
    assert!(falls < -0.3, "{falls}");
}

/// Without friction nothing acts on the spin of a disc at rest, and dashpots do not either: its surface stays where it is, although
/// the material at the contact moves away by `(1 - cos a) r` in a turn by `a`.
#[test]
fn a_damped_disc_that_spins_stays_at_rest() {
    let (r, dt, law) = (0.1, 1e-3, viscous(1e5, 0.0, 0.3));
    let below = |x: [f64; 2], shape: BodyShape| BodyConfig {
        position: x,
        ..fixed(shape, r)
    };
    let markers = [0.3, -0.3].map(|x| x * r);
    let chain = |k: usize| ImpInfo {
        next: [2, 0][k],
        ..info(1 + k as u64, r, 1.0)
    };
    let on_chain = [0, 1].map(|k| (chain(k), at(markers[k], -r)));
    let (points, segments) = (Interface::Points, Interface::Segments);
    let cases = [
        (
            vec![below([0.0, -r], segment_shape([[-1.0, 0.0], [1.0, 0.0]]))],
            vec![],
            points,
        ),
        (vec![below([0.0, -r], BodyShape::Disc)], vec![], points),
        (vec![], vec![(info(1, r, 1.0), at(0.0, -r))], points),
        (vec![], on_chain.to_vec(), segments),
    ];
    for (case, (mut bodies, imps, interface)) in cases.into_iter().enumerate() {
        for overlap in [OverlapMeasure::EachEdge, OverlapMeasure::NearestEdge] {
            let height = r - 9.81 / 1e5;
            bodies.push(BodyConfig {
                position: [0.0, height],
                spin: 80.0,
                ..body(BodyShape::Disc, r)
            });
            let mut config = DemConfig {
                body_contact: Some(law),
                gravity: [0.0, -9.81],
                interface,
                overlap,
                ..scene(bodies.clone(), law)
            };
            config.body_contact = config.body_contact.filter(|_| imps.is_empty());
            let (mut dem, mut points) = (configured(&config), Points::new(&imps));
            dem.imp_set(&points.set);
            for i in 0..100 {
                let step = step(if i == 0 { 0.0 } else { dt }, dt);
                points.contact(&mut dem, &step).unwrap();
                dem.advance(&step).unwrap();
            }
            let disc = dem.bodies().state[bodies.len() - 1];
            assert!(
                (disc.center.y - height).abs() < 1e-12,
                "{case}: {}",
                disc.center
            );
            assert!(disc.velocity.norm() < 1e-9, "{case}: {}", disc.velocity);
            bodies.pop();
        }
    }
}

/// A disc that rolls on a flat floor: the moment against rolling has the radius of the disc, `a = 2/3 mu_r g`.
#[test]
fn a_floor_without_sphero_radius_is_flat() {
    let law = granular_law(1e6, 5e5, 0.6, 0.1, 0.0, 0.1);
    for overlap in [OverlapMeasure::EachEdge, OverlapMeasure::NearestEdge] {
        let floor = BodyConfig {
            position: [0.0, -0.1],
            ..fixed(rectangle_shape(4.0, 0.2), 0.0)
        };
        let disc = BodyConfig {
            position: [0.0, 0.05 - 9.81e-6],
            velocity: [0.5, 0.0],
            spin: -10.0,
            ..body(BodyShape::Disc, 0.05)
        };
        let mut config = scene(vec![floor, disc], law);
        (config.gravity, config.overlap) = ([0.0, -9.81], overlap);
        let mut dem = configured(&config);
        run(&mut dem, 4000, 5e-5);
        let slowed = 0.5 - dem.bodies().state[1].velocity.x;
        let expected = 2.0 / 3.0 * 0.1 * 9.81 * 0.2;
        assert!(
            (slowed / expected - 1.0).abs() < 0.02,
            "{slowed} {expected}"
        );
    }
}

/// Five rounded squares one on another on a floor, which touch without overlap.
#[test]
fn a_stack_of_blocks_stays_where_it_is_for_a_million_steps() {
    let mut bodies = vec![wall("floor", [-1.0, -0.1], [1.0, -0.1], 0.1)];
    let (side, radius) = (0.1, 0.01);
    let core = side - 2.0 * radius;
    bodies.extend((0..5).map(|i| BodyConfig {
        inertia: BodyInertia::Density(2000.0),
        position: [0.0, (f64::from(i) + 0.5) * side],
        ..body(rectangle_shape(core, core), radius)
    }));
    let mut config = scene(bodies, viscous(2e6, 0.5, 0.2));
    config.gravity = [0.0, -9.81];
    let mut dem = configured(&config);
    let dt = 4e-5;
    run(&mut dem, 50_000, dt);
    let rest: Vec<_> = dem.bodies().state.clone();
    for _ in 0..1_000_000 {
        let mut step = step(dt, dt);
        step.measure = false;
        dem.contact(&step, &[], &mut []).unwrap();
        dem.advance(&step).unwrap();
    }
    for (a, b) in rest.iter().zip(&dem.bodies().state) {
        assert!(
            (a.center - b.center).norm() < 1e-10,
            "{} {}",
            a.center,
            b.center
        );
        assert!((a.angle - b.angle).abs() < 1e-9);
    }
    // The weight of a block is 19.6 N, and the floor carries five.
    let floor = &dem.measurement().bodies[0];
    let weight: f64 = dem.bodies().properties[1..]
        .iter()
        .map(|b| b.mass * 9.81)
        .sum();
    assert!((floor.body_force[1] / -weight - 1.0).abs() < 1e-6);
}

/// Issue 4: energy of a frictionless, undamped gas of 100 spheropolygons constant to 1e-4.
#[test]
fn a_gas_keeps_its_energy_over_1e5_steps() {
    let mut random = Random::new(77);
    let mut bodies = open_box(2.0, 2.0, 0.05);
    bodies.push(wall("lid", [-0.05, 2.05], [2.05, 2.05], 0.05));
    for i in 0..100 {
        let shape = star(&mut random, 3 + i % 4, 0.04, 0.06);
        bodies.push(BodyConfig {
            position: [0.1 + 0.2 * (i % 10) as f64, 0.1 + 0.2 * (i / 10) as f64],
            velocity: [random.between(-1.0, 1.0), random.between(-1.0, 1.0)],
            spin: random.between(-5.0, 5.0),
            ..body(shape, 0.02)
        });
    }
    let mut config = scene(bodies, spring(1e6));
    config.skin = 0.02;
    let mut dem = configured(&config);
    let dt = 1e-5;
    let energy = |dem: &Sdem| {
        let l = dem.measurement().ledger;
        l.kinetic + l.kinetic_rotation + l.contact
    };
    let (mut first, mut worst, mut collided) = (0.0, 0.0_f64, 0);
    for i in 0..100_000 {
        let mut step = step(if i == 0 { 0.0 } else { dt }, dt);
        step.measure = i % 50 == 0;
        dem.contact(&step, &[], &mut []).unwrap();
        dem.advance(&step).unwrap();
        if step.measure {
            if i == 0 {
                first = energy(&dem);
            }
            worst = worst.max((energy(&dem) / first - 1.0).abs());
            collided += dem.contacts();
        }
    }
    assert!(collided > 100, "{collided}");
    assert!(worst < 1e-4, "{worst}");
}

#[test]
fn adhesion_hangs_a_disc_on_a_ceiling() {
    let law = |adhesion| granular_law(1e6, 5e5, 0.8, 0.3, adhesion, 0.0);
    // Pull-off: pull c sqrt(xi) less k xi is largest at xi = (c / 2k)^2, c^2 / 4k, c = 2 s sqrt(2 R*).
    let hangs = |stress: f64| {
        let mut config = disc_at_floor([0.0, 0.0], law(stress));
        config.bodies[1].position[1] = 0.1 - 2e-5; // deeper than the largest pull
        config.gravity = [0.0, 9.81];
        let mut dem = configured(&config);
        run(&mut dem, 20_000, 2e-5);
        dem.bodies().state[1].center.y < 0.11
    };
    let needed = (4.0 * 1e6 * 9.81_f64).sqrt() / (2.0 * (2.0 * 0.05_f64).sqrt());
    assert!(hangs(1.2 * needed) && !hangs(0.9 * needed));
}

/// Two discs part in the last step before a step of no length, as at the end of a run: what was left in the tangential spring
/// is dissipated, and not forgotten.
#[test]
fn a_contact_that_opens_in_the_last_step_is_booked_in_the_closing_one() {
    let disc = |x: f64, v: f64| BodyConfig {
        position: [x, 0.0],
        velocity: [v, 0.0],
        spin: 0.5,
        ..body(BodyShape::Disc, 0.1)
    };
    let config = DemConfig {
        body_contact: Some(viscous(1e4, 1.0, 0.0)),
        ..scene(vec![disc(0.0, -1.0), disc(0.199, 1.0)], spring(1.0))
    };
    let mut dem = configured(&config);
    let dt = 1e-4;
    let mut before = 0.0;
    for i in 0..100 {
        let mut step = step(if i == 0 { 0.0 } else { dt }, dt);
        step.measure = true;
        dem.contact(&step, &[], &mut []).unwrap();
        let parting = dem.measurement().ledger.friction_work;
        if dem.measurement().bodies[0].body_force == [0.0; 2] {
            // The same step again, but of no length.
            step.dt = 0.0;
            dem.contact(&step, &[], &mut []).unwrap();
            let closing = dem.measurement().ledger.friction_work;
            assert!(parting > before + 1e-7, "{before} {parting}");
            assert_eq!(closing, parting);
            return;
        }
        before = parting;
        dem.advance(&step).unwrap();
    }
    panic!("the discs still touch");
}
