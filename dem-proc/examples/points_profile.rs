//! What a pair of a point and a body costs in a step: points that press on bodies and go to and fro by a thousandth of their
//! radius, so that the lists stay. CPU time of the calling thread, the lowest of many batches.
//!
//! `cargo run --release -p dem-proc --example points_profile -- discs|pentagons [BODIES [POINTS_A_BODY]]`

use dem_proc::Sdem;
use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion};
use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::session::cpu_time;
use interface::solver::DemSolver;
use interface::step::Step;

const DT: f64 = 1e-5;
/// Of a point and of a body's outline in m.
const RADII: [f64; 2] = [1e-3, 0.02];

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let number = |i: usize, default: usize| {
        args.get(i)
            .map_or(default, |a| a.parse().expect("a number"))
    };
    let pentagons = args.get(1).is_some_and(|kind| kind == "pentagons");
    let bodies = number(2, 100);
    let (mut dem, mut states) = set_up(pentagons, bodies, number(3, 60));
    let info = |id: u64| ImpInfo {
        id,
        radius: RADII[0],
        mass: 1e-3,
        ..ImpInfo::default()
    };
    let set: Vec<ImpInfo> = (0..states.len() as u64).map(info).collect();
    dem.imp_set(&set);
    let mut forces = vec![ImpForce::default(); set.len()];
    let mut lowest = f64::INFINITY;
    for batch in 0..300 {
        let start = cpu_time().as_secs_f64();
        for k in 0..20 {
            for state in &mut states {
                state.position[0] += if k % 2 == 0 { 1e-6 } else { -1e-6 };
            }
            let step = Step {
                index: 20 * batch + k,
                time: 0.0,
                dt_before: if batch + k == 0 { 0.0 } else { DT },
                dt: DT,
                measure: false,
            };
            dem.contact(&step, &states, &mut forces).expect("finite");
            dem.advance(&step).expect("finite");
        }
        lowest = lowest.min((cpu_time().as_secs_f64() - start) / 20.0);
    }
    let pressing = forces.iter().filter(|f| f.force != [0.0; 2]).count();
    println!(
        "{pressing} points press on {bodies} bodies: {:.2} us of CPU a step, {:.2} ns a point",
        lowest * 1e6,
        lowest * 1e9 / pressing as f64
    );
}

/// A solver with bodies, and points around each of them that touch.
fn set_up(pentagons: bool, bodies: usize, around: usize) -> (Sdem, Vec<ImpState>) {
    let corner = |i: usize, n: usize| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
        [RADII[1] * cos, RADII[1] * sin]
    };
    // A sphero-radius of a tenth, or all of it.
    let (shape, sphero_radius) = if pentagons {
        let vertices = (0..5).map(|i| corner(i, 5)).collect();
        (BodyShape::Polygon { vertices }, 0.1 * RADII[1])
    } else {
        (BodyShape::Disc, RADII[1])
    };
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
    let law = ContactLaw::Linear {
        normal_stiffness: 1e5,
        tangential_stiffness: 5e4,
        friction: 0.5,
        damping_ratio: 0.1,
        damped_mass: 0.0,
    };
    let config = DemConfig {
        bodies: (0..bodies).map(body).collect(),
        point_contact: law,
        skin: 2.0 * RADII[0],
        threads: 1,
        ..DemConfig::default()
    };
    let mut dem = Sdem::default();
    dem.configure(&config).expect("a valid configuration");
    // On the surface, or in the middle of a face, with an overlap of a tenth of the point's radius.
    let apothem = if pentagons {
        RADII[1] * (std::f64::consts::PI / 5.0).cos()
    } else {
        0.0
    };
    let reach = apothem + sphero_radius + 0.9 * RADII[0];
    let mut states = Vec::new();
    for b in 0..bodies {
        let c = place(b);
        for i in 0..around {
            let at = if pentagons {
                (2 * (i % 5) + 1) as f64 / 10.0
            } else {
                i as f64 / around as f64
            };
            let (sin, cos) = (std::f64::consts::TAU * at).sin_cos();
            states.push(ImpState {
                position: [c[0] + reach * cos, c[1] + reach * sin],
                velocity: [0.0; 2],
                ..ImpState::default()
            });
        }
    }
    (dem, states)
}
