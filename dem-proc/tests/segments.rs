//! Discs on the segments of a boundary chain: foot, vertices, history, limits, state.

mod small_scenes;

use dem_proc::Sdem;
use interface::Vec2;
use interface::config::{BodyConfig, BodyShape, ContactLaw, DemConfig, Interface, Motion};
use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::solver::{Answer, DemSolver, Fault};
use interface::step::Step;
use small_scenes::*;

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
struct Chain {
    set: Vec<ImpInfo>,
    states: Vec<ImpState>,
    forces: Vec<ImpForce>,
}

impl Chain {
    fn new(x: &[[f64; 2]]) -> Self {
        let n = x.len();
        let set = (0..n).map(|i| ImpInfo {
            next: if i + 1 < n { i as u32 + 2 } else { 0 },
            ..info(10 + i as u64, R, 1.0)
        });
        Self {
            set: set.collect(),
            states: x.iter().map(|x| at(x[0], x[1])).collect(),
            forces: vec![ImpForce::default(); n],
        }
    }

    /// The same but for the first markers.
    fn without(&self, first: usize) -> Self {
        let mut rest = Self {
            set: self.set[first..].to_vec(),
            states: self.states[first..].to_vec(),
            forces: self.forces[first..].to_vec(),
        };
        for info in rest.set.iter_mut().filter(|info| info.next > 0) {
            info.next -= first as u32;
        }
        rest
    }

    fn contact(&mut self, dem: &mut Sdem, step: &Step) -> Result<Answer, Fault> {
        dem.contact(step, &self.states, &mut self.forces)
    }

    fn step(&mut self, dem: &mut Sdem, step: &Step) -> Answer {
        let answer = self.contact(dem, step).unwrap();
        dem.advance(step).unwrap();
        answer
    }

    fn total(&self) -> Vec2 {
        self.forces.iter().map(|f| Vec2::from(f.force)).sum()
    }
}

/// Markers along the x axis from right to left (material below), at these places.
fn floor(x: &[f64]) -> Chain {
    Chain::new(&x.iter().map(|&x| [x, 0.0]).collect::<Vec<_>>())
}

/// The disc at `center` on a chain, evaluated once: chain and energy.
fn once(mut chain: Chain, center: [f64; 2]) -> (Chain, Sdem) {
    let mut dem = configured(&on_segments(vec![disc(center)], spring(K)));
    dem.imp_set(&chain.set);
    chain.contact(&mut dem, &OPENING).unwrap();
    (chain, dem)
}

#[test]
fn a_force_is_shared_by_its_foot() {
    let xi = 1e-3;
    let (chain, dem) = once(floor(&[1.0, 0.4, -0.2]), [0.55, A + R - xi]);
    let [a, b, c] = [0, 1, 2].map(|i| chain.forces[i].force);
    assert!((a[1] + 0.25 * K * xi).abs() < 1e-9 && (b[1] + 0.75 * K * xi).abs() < 1e-9);
    assert_eq!((a[0], b[0], c), (0.0, 0.0, [0.0; 2]));
    let of_body = dem.measurement().bodies[0];
    let sum = chain.total() + Vec2::from(of_body.point_force);
    assert!(sum.norm() < 1e-12, "{sum}");
    assert_eq!(of_body.contacts, 1);
    let told = DemSolver::contacts(&dem, &OPENING, &chain.states);
    let [contact] = told[..] else {
        panic!("{told:?}")
    };
    assert_eq!((contact.with, contact.other), (1, chain.set[1].id));
    assert_eq!(contact.force, of_body.point_force);
    assert!((contact.position[1] - (R - 0.5 * xi)).abs() < 1e-12);
    // F-6: the share that a foot can have after half a radius.
    let extra = 0.5 * R / 0.6;
    for (force, share) in chain.forces.iter().zip([0.25 + extra, 0.75 + extra, 0.0]) {
        assert!((force.stiffness - K * share).abs() < 1e-6, "{force:?}");
    }
    // Near a vertex the segment behind it counts as well.
    let (chain, _) = once(floor(&[1.0, 0.4, -0.2]), [0.404, A + R - xi]);
    let behind = (0.01 - 0.004) / 0.6;
    assert!((chain.forces[2].stiffness - K * behind).abs() < 1e-6);
    // No contact, no force; within reach there is stiffness.
    let (chain, _) = once(floor(&[1.0, 0.4, -0.2]), [0.55, A + R + 1e-3]);
    assert_eq!(chain.total(), Vec2::zeros());
    assert!(chain.forces[0].stiffness > 0.0);
    let (chain, _) = once(floor(&[1.0, 0.4, -0.2]), [0.55, A + 1.6 * R]);
    assert_eq!(chain.forces, vec![ImpForce::default(); 3]);
}

/// Over a vertex that is flat, sticks out, or is dented by any angle, the force of a disc is the gradient of one energy without
/// a step, and at a flat one it is that of one contact.
#[test]
fn a_vertex_counts_once_however_it_is_bent() {
    for turn in [
        0.0, 1e-12, -1e-12, 1e-6, -1e-6, 1e-3, -1e-3, 0.1, -0.1, 1.0, -1.0,
    ] {
        // Two arms from the origin, the left one turned: down (sticks out) where `turn` is above 0.
        let left = [-f64::cos(turn), -f64::sin(turn)];
        let chain = || Chain::new(&[[1.0, 0.0], [0.0, 0.0], left]);
        let energy = |x: f64, y: f64| once(chain(), [x, y]).1.measurement().ledger.contact;
        let force = |x: f64, y: f64| -once(chain(), [x, y]).0.total();
        for depth in [1e-4, 5e-3, 1e-2] {
            let dent = f64::max(0.0, (A + R - depth) * f64::tan(-0.5 * turn));
            let height = |x: f64| {
                if turn < 0.0 && x < dent {
                    A + R - depth + (dent - x) * f64::tan(-turn)
                } else {
                    A + R - depth
                }
            };
            let h = 1e-6;
            let (mut last, mut last_force) = (None, Vec2::zeros());
            for i in -200..=200 {
                let x = f64::from(i) * 1e-4 + dent + 0.5 * h;
                let y = height(x);
                let f = force(x, y);
                let e = energy(x, y);
                if let Some(before) = last {
                    // Nothing jumps: a step of 0.1 mm changes the overlap by as much at most.
                    let step: f64 = e - before;
                    assert!(
                        step.abs() < K * (depth + 3e-4) * 3e-4,
                        "{turn} {depth} {x}: {step}"
                    );
                    let jump: Vec2 = f - last_force;
                    assert!(jump.norm() < 4.0 * K * 3e-4, "{turn} {depth} {x}: {jump}");
                }
                (last, last_force) = (Some(e), f);
                let slope = [
                    energy(x + h, y) - energy(x - h, y),
                    energy(x, y + h) - energy(x, y - h),
                ]
                .map(|d| -d / (2.0 * h));
                let off = (Vec2::from(slope) - f).norm();
                assert!(
                    off < 1e-3 * K * depth + 4.0 * K * h,
                    "{turn} {depth} {x}: {off} {f}"
                );
                if turn.abs() < 1e-9 {
                    assert!((f.norm() - K * depth).abs() < 1e-6 * K * depth, "{x}: {f}");
                }
            }
        }
    }
}

#[test]
fn a_sharp_corner_has_two_contacts() {
    let (chain, dem) = once(
        Chain::new(&[[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]),
        [A + R - 2e-3, A + R - 1e-3],
    );
    let force = -chain.total();
    assert!((force - Vec2::new(2e-3, 1e-3) * K).norm() < 1e-9, "{force}");
    assert_eq!(dem.measurement().bodies[0].contacts, 2);
}

#[test]
fn a_ring_around_a_small_block_is_met_from_all_sides() {
    let mut ring = Chain::new(&[[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]);
    ring.set[3].next = 1;
    for k in 0..24 {
        let angle = f64::from(k) * std::f64::consts::TAU / 24.0;
        let (sin, cos) = angle.sin_cos();
        let away = 0.05 / sin.abs().max(cos.abs()) + A + R - 1e-3;
        let chain = Chain {
            set: ring.set.clone(),
            states: ring.states.clone(),
            forces: ring.forces.clone(),
        };
        let (chain, dem) = once(chain, [away * cos, away * sin]);
        let pressed = dem.measurement().bodies[0].contacts;
        let force = -chain.total();
        assert!(pressed <= 1, "{k}: {pressed}");
        // At sides and corners the way out is the normal.
        if k % 3 == 0 {
            assert!(
                (force - Vec2::new(cos, sin) * K * 1e-3).norm() < 1e-6,
                "{k}: {force}"
            );
        }
    }
}

/// A disc that rolls down: places, angles and energies step by step.
fn roll(markers: &[f64], friction: f64, save_at: Option<usize>) -> Vec<[u64; 4]> {
    let slope = 30.0_f64.to_radians();
    let g = 9.81;
    let start = A + R - g * slope.cos() / K;
    let mut config = on_segments(vec![disc([0.0, start])], frictional(K, 0.5 * K, friction));
    config.gravity = [-g * slope.sin(), -g * slope.cos()];
    let mut chain = floor(markers);
    let mut dem = configured(&config);
    dem.imp_set(&chain.set);
    chain.step(&mut dem, &OPENING);
    let dt = 2e-4;
    let mut said = Vec::new();
    for n in 0..2500 {
        if save_at == Some(n) {
            let bytes = dem.save().unwrap();
            let mut fresh = configured(&config);
            fresh.restore(&bytes).unwrap();
            assert_eq!(fresh.save().unwrap(), bytes);
            dem = fresh;
        }
        let step = Step {
            index: n as u64 + 1,
            time: n as f64 * dt,
            dt_before: if n == 0 { 0.0 } else { dt },
            dt,
            measure: true,
        };
        chain.step(&mut dem, &step);
        let (state, ledger) = (dem.measurement().bodies[0], dem.measurement().ledger);
        let energy = ledger.kinetic
            + ledger.kinetic_rotation
            + ledger.gravity
            + ledger.contact
            + ledger.friction_work;
        let x = state.position;
        said.push([x[0], x[1], state.angle, energy].map(f64::to_bits));
    }
    said
}

/// Markers from right to left at `spacing` times random numbers.
fn uneven(spacing: f64, seed: u64) -> Vec<f64> {
    let mut random = Random(seed);
    let mut x = vec![0.3];
    while x[x.len() - 1] > -0.8 {
        x.push(x[x.len() - 1] - spacing * random.between(0.3, 2.0));
    }
    x
}

#[test]
fn a_disc_rolls_with_two_thirds_of_g_sin_whatever_the_spacing() {
    let on_one = roll(&[0.5, -1.0], 0.9, None);
    let last = on_one[on_one.len() - 1].map(f64::from_bits);
    let time: f64 = 2499.0 * 2e-4;
    let way = 0.5 * (2.0 / 3.0) * 9.81 * 0.5 * time * time;
    assert!((last[0] / -way - 1.0).abs() < 2e-3, "{last:?} {way}");
    assert!((last[2] * A / way - 1.0).abs() < 2e-3, "{last:?}");
    let energy = |row: &[u64; 4]| f64::from_bits(row[3]);
    let moved = 9.81 * 0.5 * way;
    for (spacing, seed) in [(0.1, 1), (0.02, 2), (0.003, 3), (0.0005, 4)] {
        let rows = roll(&uneven(spacing, seed), 0.9, None);
        for (row, plain) in rows.iter().zip(&on_one) {
            for k in 0..3 {
                let (a, b) = (f64::from_bits(row[k]), f64::from_bits(plain[k]));
                assert!((a - b).abs() < 1e-9, "{spacing}: {a} {b}");
            }
            let off = energy(row) - energy(plain);
            assert!(off.abs() < 1e-9 * moved, "{spacing}: {off}");
        }
        let steps = rows
            .windows(2)
            .map(|w| (energy(&w[1]) - energy(&w[0])).abs());
        let largest = steps.fold(0.0, f64::max);
        assert!(largest < 1e-4 * moved, "{spacing}: {largest} of {moved}");
    }
    // With less friction than it takes to roll it slips: g (sin - mu cos).
    let slips = roll(&uneven(0.02, 5), 0.1, None);
    let last = slips[slips.len() - 1].map(f64::from_bits);
    let slope = 30.0_f64.to_radians();
    let way = 0.5 * 9.81 * (slope.sin() - 0.1 * slope.cos()) * time * time;
    assert!((last[0] / -way - 1.0).abs() < 2e-3, "{last:?} {way}");
}

#[test]
fn a_saved_disc_rolls_on_to_the_same_bits() {
    let markers = uneven(0.02, 9);
    assert_eq!(roll(&markers, 0.9, None), roll(&markers, 0.9, Some(1234)));
}

/// A disc that is dragged keeps its tangential spring over vertices, and over a new set.
#[test]
fn history_is_handed_along_the_chain_and_over_a_new_set() {
    for turn in [0.0, 1e-4, -1e-4, 0.02, -0.02] {
        let depth = 2e-3;
        let mut dragged = disc([0.05, A + R - depth]);
        dragged.motion = Motion::Driven;
        dragged.velocity = [-1e-2, 0.0];
        // Stiff friction that never slips over this way.
        let mut dem = configured(&on_segments(vec![dragged], frictional(K, K, 100.0)));
        let (sin, cos) = f64::sin_cos(turn);
        let mut chain = Chain::new(&[
            [1.0, 0.0],
            [0.06, 0.0],
            [0.04, 0.0],
            [0.04 - 0.02 * cos, -0.02 * sin],
            [0.04 - cos, -sin],
        ]);
        dem.imp_set(&chain.set);
        chain.step(&mut dem, &OPENING);
        let dt = 0.01;
        for n in 0..300 {
            if n == 150 {
                chain = chain.without(1);
                dem.imp_set(&chain.set);
            }
            chain.step(&mut dem, &step(if n == 0 { 0.0 } else { dt }, dt));
            let gone = 1e-2 * dt * f64::from(n);
            let pull = -chain.total().x;
            // The friction along x is that of the way gone, but for the turning of the segments.
            let off = (pull - K * gone).abs() - (K * depth + K * gone) * 2.0 * turn.abs();
            assert!(off < 1e-6 * K, "{turn} {n}: {pull} for {}", K * gone);
        }
    }
}

/// A disc that is dragged through an arc of many markers has minima and maxima of the distance that come and go. What their
/// springs took with them was booked nowhere, and a maximum that did not press had the spring of a contact far from it end
/// anew in each step: friction seemed to give energy.
#[test]
fn friction_and_springs_have_the_work_of_a_disc_that_is_dragged_through_an_arc() {
    let rough = |i: u32| f64::from((i * 37) % 11) / 11.0 - 0.5;
    let arc: Vec<[f64; 2]> = (0..60)
        .map(|i| {
            let angle = (340.0 - 140.0 / 59.0 * (f64::from(i) + 0.6 * rough(i))).to_radians();
            let radius = A + R - 2e-3 + 2e-5 * rough(i + 5);
            [radius * angle.cos(), radius * angle.sin()]
        })
        .collect();
    for friction in [0.01, 0.3, 100.0] {
        let mut dragged = disc([0.0, 0.0]);
        dragged.motion = Motion::Driven;
        (dragged.velocity, dragged.spin) = ([3e-2, 0.0], 0.5);
        let mut dem = configured(&on_segments(
            vec![dragged],
            frictional(K, 0.5 * K, friction),
        ));
        let mut chain = Chain::new(&arc);
        dem.imp_set(&chain.set);
        chain.step(&mut dem, &OPENING);
        let start = dem.measurement().ledger.contact;
        let dt = 4e-4;
        for n in 0..350 {
            chain.step(&mut dem, &step(if n == 0 { 0.0 } else { dt }, dt));
            let ledger = dem.measurement().ledger;
            let found = ledger.contact - start + ledger.friction_work;
            let off = (found - ledger.driven_work).abs() / ledger.driven_work.max(0.1);
            assert!(off < 5e-4, "mu {friction}, step {n}: {ledger:?}");
        }
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
}

#[test]
fn links_that_lead_nowhere_are_none() {
    let mut chain = floor(&[0.5, 0.1, -0.1, -0.5]);
    for next in [9, u32::MAX, 2] {
        chain.set[1].next = next; // beyond the set, or itself
        let copy = Chain {
            set: chain.set.clone(),
            states: chain.states.clone(),
            forces: chain.forces.clone(),
        };
        let (chain, _) = once(copy, [0.0, A + R - 1e-3]);
        assert_eq!(chain.total(), Vec2::zeros(), "{next}");
    }
    // Two markers on one another: a segment without length.
    let (chain, _) = once(floor(&[0.5, 0.0, 0.0, -0.5]), [0.1, A + R - 1e-3]);
    assert!((chain.total().y + K * 1e-3).abs() < 1e-6);
}

#[test]
fn other_shapes_than_discs_are_refused_by_their_key() {
    let shape = BodyShape::Rectangle {
        width: 1.0,
        height: 1.0,
    };
    let bodies = vec![disc([5.0, 0.0]), body(shape, 0.1)];
    let refusal = Sdem::default().configure(&on_segments(bodies, spring(K)));
    assert_eq!(refusal.expect_err("a refusal").key, "dem.bodies[1].shape");
}
