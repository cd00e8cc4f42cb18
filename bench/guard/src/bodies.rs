//! What a step of the bodies' side costs: CPU time of the calling thread and wall time, the lowest of many batches. The wall time
//! of two threads needs a quiet machine.
//!
//! `discs` and `pentagons` settle in a box and are measured with what they touch. A thousand discs settle in 60,000 steps; after
//! 12,000 they still fall and collide, and a contact costs twice as much. `plain` is the plain disc code of the guard on the
//! settled discs, so that figures taken on a busy machine have something to be compared with. More than 10,000 grains are in
//! boxes of 10,000 side by side, stopped after they have settled, and again 3,000 steps later. `points-on-discs` and
//! `points-on-pentagons` are points that press on fixed bodies and go to and fro by a thousandth of their radius, so that the lists
//! stay.
//!
//!     cargo run --release -p guard --example bodies -- discs|pentagons|plain COUNT THREADS [SETTLING_STEPS [STEPS [SKIN]]]
//!     cargo run --release -p guard --example bodies -- points-on-discs|points-on-pentagons [BODIES [POINTS_A_BODY]]

use std::f64::consts::{PI, TAU};
use std::time::Instant;

use dem_proc::Sdem;
use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion};
use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::session::cpu_time;
use interface::solver::DemSolver;
use interface::step::Step;
use mechanics::generate::Grain;

use grain_box::{DT, PENTAGON, at_rest, grain_box, run, step, width_of};
use yardsticks::PlainDiscs;

#[allow(dead_code)] // `pile` is the guard's
mod grain_box;
#[allow(dead_code)]
mod yardsticks;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let given = |i: usize| args.get(i).map(|a| a.parse::<f64>().expect("a number"));
    let number = |i: usize, default: usize| given(i).map_or(default, |n| n as usize);
    let kind = args.get(1).map_or("discs", String::as_str);
    if let Some(on) = kind.strip_prefix("points-on-") {
        points(on == "pentagons", number(2, 100), number(3, 60));
        return;
    }
    let grain = if kind == "pentagons" {
        PENTAGON
    } else {
        Grain::Disc
    };
    let (count, threads) = (number(2, 1000), number(3, 1));
    let (settling, measured) = (number(4, 60_000), number(5, 4_000));
    let config = DemConfig {
        skin: given(6).unwrap_or(0.001),
        ..grain_box(grain, count.min(BOX), threads)
    };
    let mut dem = run(&config, settling);
    if count > BOX {
        let one = at_rest(config, &dem);
        dem = run(&side_by_side(&one, count / BOX), AGAIN);
    }
    let kinetic = dem.measurement().ledger.kinetic;
    let batch = measured.div_ceil(10);
    let mut contacts = dem.contacts();
    let [cpu, wall] = if kind == "plain" {
        let mut discs = PlainDiscs::settled(&dem);
        lowest(10, batch, || contacts = discs.run(batch))
    } else {
        let steps = || (0..batch).for_each(|_| step(&mut dem, DT, false));
        let costs = lowest(10, batch, steps);
        contacts = dem.contacts();
        costs
    };
    println!(
        "{grain:?} x {count}, {threads} threads: {contacts} contacts, kinetic {kinetic:.1e} J/m; a step takes {:.1} us of CPU \
         ({:.1} ns a contact, {:.1} ns a body), {:.1} us of wall time",
        cpu * 1e6,
        cpu * 1e9 / contacts as f64,
        cpu * 1e9 / count as f64,
        wall * 1e6,
    );
}

/// Grains in a box of several.
const BOX: usize = 10_000;
/// Steps in which they settle again, from rest.
const AGAIN: usize = 3_000;

/// So many of this box in a row.
fn side_by_side(one: &DemConfig, boxes: usize) -> DemConfig {
    let shifted = |i: usize| {
        let away = 1.5 * width_of(BOX) * i as f64;
        one.bodies.iter().cloned().map(move |mut body| {
            body.name = format!("{} {i}", body.name);
            body.position[0] += away;
            body
        })
    };
    DemConfig {
        bodies: (0..boxes).flat_map(shifted).collect(),
        ..one.clone()
    }
}

/// CPU and wall time of a step in s: the lowest of some batches of so many steps.
fn lowest(batches: usize, steps: usize, mut batch: impl FnMut()) -> [f64; 2] {
    let mut lowest = [f64::INFINITY; 2];
    for _ in 0..batches {
        let (start, began) = (cpu_time(), Instant::now());
        batch();
        let cpu = cpu_time().saturating_sub(start);
        for (least, time) in lowest.iter_mut().zip([cpu, began.elapsed()]) {
            *least = least.min(time.as_secs_f64() / steps as f64);
        }
    }
    lowest
}

/// Of a point and of a body's outline in m.
const RADII: [f64; 2] = [1e-3, 0.02];

/// The place at this distance, turned by a part of a full turn.
fn turned(turn: f64, r: f64) -> [f64; 2] {
    [r * (TAU * turn).cos(), r * (TAU * turn).sin()]
}

/// A body's shape, its sphero-radius, a tenth or all of it, and how far a face is from the centre.
fn shape(pentagons: bool) -> (BodyShape, f64, f64) {
    if !pentagons {
        return (BodyShape::Disc, RADII[1], 0.0);
    }
    let vertices = (0..5).map(|i| turned(f64::from(i) / 5.0, RADII[1]));
    let vertices = vertices.collect();
    let apothem = RADII[1] * (PI / 5.0).cos();
    (BodyShape::Polygon { vertices }, 0.1 * RADII[1], apothem)
}

/// Points around each body, which touch it.
fn points(pentagons: bool, bodies: usize, around: usize) {
    let (shape, sphero_radius, apothem) = shape(pentagons);
    let place = |b: usize| [0.1 * (b % 10) as f64, 0.1 * (b / 10) as f64];
    let body = |b: usize| BodyConfig {
        name: format!("body {b}"),
        shape: shape.clone(),
        sphero_radius,
        inertia: BodyInertia::Mass(1.0),
        position: place(b),
        motion: Motion::Fixed,
        ..BodyConfig::default()
    };
    let config = DemConfig {
        bodies: (0..bodies).map(body).collect(),
        point_contact: ContactLaw::linear(1e5, 5e4, 0.5, 0.1),
        skin: 2.0 * RADII[0],
        threads: 1,
        ..DemConfig::default()
    };
    let mut dem = Sdem::default();
    dem.configure(&config).expect("a valid configuration");
    // On the surface, or in the middle of a face, with an overlap of a tenth of the point's radius.
    let reach = apothem + sphero_radius + 0.9 * RADII[0];
    let state = |k: usize| {
        let (c, i) = (place(k / around), k % around);
        let turn = if pentagons {
            (2 * (i % 5) + 1) as f64 / 10.0
        } else {
            i as f64 / around as f64
        };
        let [x, y] = turned(turn, reach);
        ImpState {
            position: [c[0] + x, c[1] + y],
            ..ImpState::default()
        }
    };
    let mut states: Vec<ImpState> = (0..bodies * around).map(state).collect();
    let info = |id: usize| ImpInfo {
        id: id as u64,
        radius: RADII[0],
        mass: 1e-3,
        ..ImpInfo::default()
    };
    dem.imp_set(&(0..states.len()).map(info).collect::<Vec<_>>());
    let mut forces = vec![ImpForce::default(); states.len()];
    let (mut before, mut index) = (0.0, 0);
    let [cpu, _] = lowest(300, 20, || {
        for k in 0..20 {
            for state in &mut states {
                state.position[0] += if k % 2 == 0 { 1e-6 } else { -1e-6 };
            }
            let step = Step {
                index,
                time: 0.0,
                dt_before: before,
                dt: 1e-5,
                measure: false,
            };
            dem.contact(&step, &states, &mut forces).expect("finite");
            dem.advance(&step).expect("finite");
            (before, index) = (step.dt, index + 1);
        }
    });
    let pressing = forces.iter().filter(|f| f.force != [0.0; 2]).count();
    println!(
        "{pressing} points press on {bodies} bodies: {:.2} us of CPU a step, {:.2} ns a point",
        cpu * 1e6,
        cpu * 1e9 / pressing as f64
    );
}
