//! Discs on the segments of a boundary chain: foot, vertices, history, limits, state.

use crate::small_scenes::*;
use dem_proc::Sdem;
use interface::Vec2;
use interface::config::surfaces::ContactPair;
use interface::config::{BodyConfig, BodyShape, ContactLaw, DemConfig, Interface, Motion};
use interface::message::wire::{ImpInfo, ImpState};
use interface::solver::DemSolver;
use interface::step::Step;

const K: f64 = 1e5;
const A: f64 = 0.1;
const R: f64 = 0.02;

/// A disc at `center`.
fn disc(center: [f64; 2]) -> BodyConfig {
    BodyConfig {
        position: center,
        ..body(BodyShape::Disc, A)
    }
}

fn on_segments(bodies: Vec<BodyConfig>, law: ContactLaw) -> DemConfig {
    DemConfig {
        interface: Interface::Segments,
        body_contact: None,
        ..scene(bodies, law)
    }
}

/// A chain through `x` in this order, material on the left, not closed.
fn markers(x: &[[f64; 2]]) -> Points {
    let marker = |i: usize| ImpInfo {
        next: if i + 1 < x.len() { i as u32 + 2 } else { 0 },
        ..info(10 + i as u64, R, 1.0)
    };
    let each = x.iter().enumerate();
    let each: Vec<_> = each.map(|(i, x)| (marker(i), at(x[0], x[1]))).collect();
    Points::new(&each)
}

fn total(chain: &Points) -> Vec2 {
    chain.forces.iter().map(|f| Vec2::from(f.force)).sum()
}

/// Markers along the x axis from right to left (material below), at these places.
fn floor(x: &[f64]) -> Points {
    markers(&x.iter().map(|&x| [x, 0.0]).collect::<Vec<_>>())
}

/// The disc at `center` on a chain, evaluated once: chain and energy.
fn once(mut chain: Points, center: [f64; 2]) -> (Points, Sdem) {
    let mut dem = configured(&on_segments(vec![disc(center)], spring(K)));
    dem.imp_set(&chain.set);
    chain.contact(&mut dem, &OPENING).unwrap();
    (chain, dem)
}

/// Beside a vertex in a dent whose segment to the right ends before it has a foot, the maximum at the vertex counts in F-6 as the
/// two minima do: each marker has the largest share that it can have of each within half a radius.
#[test]
fn a_maximum_without_a_minimum_beside_it_counts_in_the_stiffness() {
    let (sin, cos) = 0.1_f64.sin_cos();
    let (short, long, way) = (0.005, 0.5, 0.5 * R);
    let dent = [
        [short * cos, short * sin],
        [0.0, 0.0],
        [-long * cos, long * sin],
    ];
    let distance = A + R - 2e-3;
    let (chain, _) = once(markers(&dent), [0.0, distance]);
    let foot = distance * sin / long;
    let expected = [
        1.0 + 1.0,                             // the end of the short segment, the vertex
        1.0 + 1.0 + (1.0 - foot + way / long), // and the foot on the long one
        (way - short) / long + way / long + (foot + way / long),
    ];
    for (force, share) in chain.forces.iter().zip(expected) {
        assert!(
            (force.stiffness - K * share).abs() < 1e-6,
            "{force:?} {share}"
        );
    }
    // Round a ring that is smaller than that, each marker counts once in either direction.
    let mut ring = markers(&[[0.0, 0.0], [-1e-4, -1e-4], [1e-4, -1e-4]]);
    ring.set[2].next = 1;
    let (ring, _) = once(ring, [0.0, distance]);
    let stiffness: Vec<f64> = ring.forces.iter().map(|f| f.stiffness).collect();
    assert_eq!(stiffness, [K, 2.0 * K, 2.0 * K]);
}

#[test]
fn the_chain_counts_four_times_for_a_disc_that_touches_it_within_two_steps() {
    let (gap, dt) = (1e-3, 1e-3);
    for (speed, count) in [(0.9 * gap / (2.1 * dt), 1.0), (1.1 * gap / (2.1 * dt), 4.0)] {
        let falling = BodyConfig {
            velocity: [0.0, -speed],
            ..disc([0.5, A + R + gap])
        };
        let mut dem = configured(&DemConfig {
            contact_resolution: None,
            ..on_segments(vec![falling], spring(K))
        });
        let mut chain = floor(&[1.0, 0.0]);
        dem.imp_set(&chain.set);
        let answer = chain.contact(&mut dem, &step(0.0, dt)).unwrap();
        let share = 0.5 + 0.5 * R;
        let stiffness = chain.forces.iter().map(|f| f.stiffness);
        let most = stiffness.fold(0.0, f64::max);
        assert!((most / (count * K * share) - 1.0).abs() < 1e-9, "{most}");
        let rate = answer.limits.contact_omega_sq;
        assert!((rate / (count * K) - 1.0).abs() < 1e-9, "{rate}");
    }
}

/// `k_n (1/m + (r x n)^2 / I) + k_t (1/m + (r x t)^2 / I)`, and `1/m + (r x n)^2 / I`: the lower of two discs of a cluster.
#[test]
fn a_disc_off_the_centre_on_a_chain_declares_its_rate_and_mobility() {
    let cluster = BodyShape::Cluster {
        centers: vec![[-0.2, -0.1], [0.2, 0.1]],
        radii: vec![A, A],
    };
    let xi = 1e-3;
    let cluster = BodyConfig {
        position: [0.55, 0.1 + A + R - xi],
        ..body(cluster, 0.0)
    };
    let mut dem = configured(&on_segments(vec![cluster], frictional(K, 0.6 * K, 0.5)));
    let mut chain = floor(&[1.0, -0.2]);
    dem.imp_set(&chain.set);
    let limits = chain.contact(&mut dem, &OPENING).unwrap().limits;
    let state = &dem.bodies().state[0];
    let (m, i) = (state.inverse_mass, state.inverse_inertia);
    // The contact is in the middle of the overlap; its normal is along y.
    let [across, along] = [0.2, 0.1 + A - 0.5 * xi].map(|r| m + i * r * r);
    let rate = K * across + 0.6 * K * along;
    assert!((limits.contact_omega_sq / rate - 1.0).abs() < 1e-10);
    assert!((limits.mobility / across - 1.0).abs() < 1e-10);
}

/// The chains of two groups on one disc, of which the heavier one alone has dashpots.
#[test]
fn dashpots_of_each_group_on_a_disc_count() {
    let rubber = ContactPair {
        between: ["rubber".into(), "steel".into()],
        law: ContactLaw::linear(K, 0.0, 0.0, 0.3),
    };
    let resting = BodyConfig {
        surface: "steel".into(),
        ..disc([0.5, A + R - 1e-3])
    };
    let mut dem = configured(&DemConfig {
        contact_pairs: vec![rubber],
        point_surfaces: vec![String::new(), "rubber".into()],
        ..on_segments(vec![resting], spring(K))
    });
    let marker = |id, next, group, mass, y| {
        let x = if next > 0 { 1.0 } else { 0.0 };
        let info = ImpInfo {
            next,
            group,
            ..info(id, R, mass)
        };
        (info, at(x, y))
    };
    let light = [marker(1, 2, 0, 1.0, -1e-3), marker(2, 0, 0, 1.0, -1e-3)];
    let heavy = [marker(3, 4, 1, 2.0, 0.0), marker(4, 0, 1, 2.0, 0.0)];
    let mut chains = Points::new(&[light, heavy].concat());
    dem.imp_set(&chains.set);
    let limits = chains.contact(&mut dem, &OPENING).unwrap().limits;
    assert!(limits.damping >= 0.3, "{limits:?}");
}

/// Near chains with dents and tips, where minima add and maxima subtract: the force of springs and adhesion is the gradient of
/// their energy, and on a flat chain that of one contact.
#[test]
fn springs_and_adhesion_of_a_chain_have_an_energy() {
    let adhesion = 500.0;
    let law = granular_law(K, 0.0, 0.0, 0.0, adhesion, 0.0);
    let once = |x: &[[f64; 2]], center: [f64; 2]| {
        let mut chain = markers(x);
        let mut dem = configured(&on_segments(vec![disc(center)], law));
        dem.imp_set(&chain.set);
        let through = chain.contact(&mut dem, &OPENING).is_err();
        (!through).then(|| (-total(&chain), dem.measurement().ledger.contact))
    };
    let flat = [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]];
    let xi: f64 = 4e-3;
    let pull = 2.0 * adhesion * (2.0 * A * xi).sqrt();
    for x in [0.0, 1e-3, 0.3] {
        let (force, _) = once(&flat, [x, A + R - xi]).expect("a contact");
        assert!((force - Vec2::new(0.0, K * xi - pull)).norm() < 1e-9 * K * xi);
    }
    let (mut smooth, h) = (0, 1e-7);
    // Above the disc a peak between two lips, which it sees from behind: only the maximum at the peak is outside.
    let peak = [
        [-1e-3, 0.1],
        [-1e-2, 0.1],
        [0.0, A + R - xi],
        [1e-2, 0.1],
        [1e-3, 0.1],
    ];
    let (force, energy) = once(&peak, [0.0; 2]).expect("no passage");
    let negated = Vec2::new(0.0, K * xi - pull);
    assert!((force - negated).norm() < 1e-9 * K * xi, "{force}");
    let [below, above] = [-h, h].map(|y| once(&peak, [0.0, y]).expect("no passage").1);
    let slope = (below - above) / (2.0 * h);
    assert!(
        (slope - force.y).abs() < 1e-5 * force.y.abs(),
        "{slope} {force}"
    );
    assert!(energy < 0.0);
    let mut random = Random::new(29);
    for _ in 0..2000 {
        let [left, right] = [0, 1].map(|_| random.between(-1.2, 1.2));
        let x = [
            [right.cos(), right.sin()],
            [0.0, 0.0],
            [-left.cos(), left.sin()],
        ];
        let away = A + R - random.between(1e-3, 1.5e-2);
        let angle: f64 = random.between(0.2, 2.9);
        let center = [away * angle.cos(), away * angle.sin()];
        let at = |[dx, dy]: [f64; 2]| once(&x, [center[0] + dx, center[1] + dy]);
        let Some((force, _)) = at([0.0; 2]) else {
            continue; // the angles have put it on the other side
        };
        let around = [[h, 0.0], [-h, 0.0], [0.0, h], [0.0, -h]].map(at);
        let [Some(e), Some(w), Some(n), Some(s)] = around else {
            continue;
        };
        let jumps = |at: (Vec2, f64)| (at.0 - force).norm() > 1e-2 * K * 1e-3;
        if [e, w, n, s].into_iter().any(jumps) {
            continue; // the foot on a segment passes its end
        }
        smooth += 1;
        let [e, w, n, s] = [e, w, n, s].map(|(_, energy)| energy);
        let slope = Vec2::new(w - e, s - n) / (2.0 * h);
        assert!(
            (slope - force).norm() < 1e-4 * K * 1e-2,
            "{x:?} {center:?}: {slope} {force}"
        );
    }
    assert!(smooth > 1000, "{smooth}");
}

/// Another number from -0.5 to 0.5 for each marker and purpose.
fn rough(i: u32, k: u32) -> f64 {
    f64::from((i * 37 + k * 23) % 19) / 19.0 - 0.5
}

/// 30 markers around the disc at the origin, over an angle `around` in degrees, each of which moves in and out by `swing` (m) and along
/// on its own: minima and maxima come and go, spans of the chain part and join, springs slip.
fn wrapped(time: f64, around: f64, [depth, swing]: [f64; 2]) -> Vec<[f64; 2]> {
    let marker = |i: u32| {
        let own = |k: u32| (time * (3.0 + 4.0 * rough(i, k)) + 7.0 * rough(i, k + 1)).sin();
        let angle = (350.0 - around / 29.0 * f64::from(i)).to_radians();
        let angle = angle + 3e-2 * (2.0 * time).sin() + 1e-2 * own(2);
        let away = A + R - depth + swing * own(4);
        [away * angle.cos(), away * angle.sin()]
    };
    (0..30).map(marker).collect()
}

#[test]
fn a_step_allocates_nothing_after_warm_up() {
    // Around the lower half of the disc, or all around it.
    for (around, next) in [(160.0, 0), (348.0, 1)] {
        let states = |n| {
            let x = wrapped(1e-3 * f64::from(n), around, [1e-3, 2e-3]);
            x.iter().map(|x| at(x[0], x[1])).collect()
        };
        let motion: Vec<Vec<ImpState>> = (0..3000).map(states).collect();
        let mut chain = markers(&wrapped(0.0, around, [1e-3, 2e-3]));
        chain.set[29].next = next;
        let mut held = disc([0.0, 0.0]);
        held.motion = Motion::Driven;
        let law = frictional(K, 0.5 * K, 0.3);
        let mut dem = configured(&on_segments(vec![held], law));
        dem.imp_set(&chain.set);
        let mut pressed = [false; 2];
        let mut run = || {
            for states in &motion {
                let step = Step {
                    measure: false,
                    ..step(1e-3, 1e-3)
                };
                let answer = dem.contact(&step, states, &mut chain.forces);
                answer.expect("no fault");
                dem.advance(&step).expect("no fault");
                for force in &chain.forces {
                    pressed[usize::from(force.force == [0.0; 2])] = true;
                }
            }
        };
        // Twice: from the end of the motion back to its beginning all contacts change at once.
        run();
        run();
        let counted = allocation_counter::measure(run);
        assert_eq!(counted.count_total, 0, "{around}: {counted:?}");
        assert_eq!(pressed, [true; 2]);
    }
}

#[test]
fn a_disc_that_comes_through_the_chain_is_named() {
    let mut driven = disc([0.0, A + R]);
    driven.motion = Motion::Driven;
    driven.velocity = [0.0, -1.0];
    let mut dem = configured(&on_segments(vec![driven], spring(K)));
    let mut chain = floor(&[0.3, 0.1, -0.1, -0.3]);
    dem.imp_set(&chain.set);
    chain.step(&mut dem, &OPENING);
    let dt = 0.009; // not half of the radius in a step
    let mut fault = None;
    for n in 0..30 {
        match chain.contact(&mut dem, &step(if n == 0 { 0.0 } else { dt }, dt)) {
            Ok(_) => dem.advance(&step(dt, dt)).unwrap(),
            Err(found) => {
                fault = Some(found.to_string());
                break;
            }
        }
    }
    let fault = fault.expect("a fault");
    assert!(fault.contains("body 0 (body)"), "{fault}");
    // Farther behind the chain than a step leads, a disc is on the other side of the material.
    for (behind, through) in [(0.4, true), (0.6, false)] {
        let mut chain = floor(&[0.3, 0.1, -0.1, -0.3]);
        let config = on_segments(vec![disc([0.0, -behind * R])], spring(K));
        let mut dem = configured(&config);
        dem.imp_set(&chain.set);
        assert_eq!(chain.contact(&mut dem, &OPENING).is_err(), through);
        assert!(through || total(&chain) == Vec2::zeros());
    }
}

#[test]
fn two_markers_may_lie_on_one_another() {
    let (chain, _) = once(floor(&[0.5, 0.0, 0.0, -0.5]), [0.1, A + R - 1e-3]);
    assert!((total(&chain).y + K * 1e-3).abs() < 1e-6);
}

#[test]
fn other_shapes_than_discs_are_refused_by_their_key() {
    let bodies = vec![disc([5.0, 0.0]), body(rectangle_shape(1.0, 1.0), 0.1)];
    let refusal = Sdem::default().configure(&on_segments(bodies, spring(K)));
    assert_eq!(refusal.expect_err("a refusal").key, "dem.body.1.shape");
}
