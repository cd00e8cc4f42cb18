//! CPU time per point and step, as the smallest of many short runs: the figures of `docs/performance-mpm.md`.
//!
//! `cargo run --release -p mpm-proc --example cost -- [points] [threads]`

use std::time::{Duration, Instant};

use interface::config::{
    Fill, GroupConfig, MaterialConfig, MaterialModel, MpmConfig, Plane, ShapeFunction, Spacing,
    StressUpdate, Transfer, Wall, Walls,
};
use interface::solver::MpmSolver;
use interface::step::Step;
use mpm_proc::Mpm;
use rustix::time::{ClockId, clock_gettime};

fn main() {
    let mut arguments = std::env::args()
        .skip(1)
        .map(|a| a.parse().expect("a number"));
    let points: usize = arguments.next().unwrap_or(40_000);
    let threads: usize = arguments.next().unwrap_or(1);
    let elastic = MaterialModel::LinearElastic {
        bulk_modulus: 5.0e5,
        shear_modulus: 3.2e5,
    };
    let sand = MaterialModel::DruckerPrager {
        bulk_modulus: 5.0e5,
        shear_modulus: 3.2e5,
        friction_angle: 35.0,
        dilation_angle: 0.0,
        cohesion: 0.0,
        tensile_strength: 0.0,
    };
    for (name, model) in [("elastic", elastic), ("drucker-prager", sand)] {
        let (cpu, wall, bytes) = cost(points, threads, model);
        println!(
            "{name}: {points} points, {threads} threads: {cpu:.1} ns CPU, {wall:.1} ns wall per point and step; {bytes:.0} bytes a point"
        );
    }
}

/// A column as wide as high, on a fixed floor against a slip wall, collapsing to the right.
fn column(points: usize, threads: usize, model: MaterialModel) -> MpmConfig {
    let cells = ((points as f64 / 4.0).sqrt().round()) as u32;
    let cell = 1.0 / f64::from(cells);
    MpmConfig {
        domain: [[0.0, 0.0], [4.0, 2.0]],
        cell,
        gravity: [0.0, -9.81],
        shape: ShapeFunction::QuadraticBspline,
        transfer: Transfer::Apic,
        stress_update: StressUpdate::Usf,
        plane: Plane::Strain,
        walls: Walls {
            left: Wall::Slip,
            bottom: Wall::Fixed,
            ..Walls::default()
        },
        materials: vec![MaterialConfig {
            name: "sand".into(),
            density: 1500.0,
            model,
        }],
        groups: vec![GroupConfig {
            name: "column".into(),
            material: 0,
            fill: Fill::Rectangle {
                lower: [0.0, 0.0],
                upper: [1.0, 1.0],
            },
            spacing: Spacing::PerCell(4),
            velocity: [0.0, 0.0],
            fields: interface::config::InitialFields::default(),
            contact_radius: None,
        }],
        contact_force: interface::config::ContactForceScheme::default(),
        forcing: interface::config::Forcing::default(),
        constants: std::collections::BTreeMap::new(),
        leaving: interface::config::Leaving::default(),
        skin: 0.0,
        threads,
    }
}

/// CPU and wall ns per point and step, and bytes per point.
fn cost(points: usize, threads: usize, model: MaterialModel) -> (f64, f64, f64) {
    let config = column(points, threads, model);
    let mut mpm = Mpm::new();
    let ready = mpm.configure(&config).expect("a good configuration");
    // 0.3 of the Courant time keeps all sizes alike and stable.
    let dt = 0.3 * ready.courant_time;
    let per_sample = (400_000 / points).max(1);
    let mut step = Step {
        index: 0,
        time: 0.0,
        dt_before: dt,
        dt,
        measure: false,
    };
    let mut best = [f64::INFINITY; 2];
    let begin = Instant::now();
    let mut samples = 0;
    while samples < 10 || begin.elapsed() < Duration::from_secs(4) {
        let (cpu, wall) = (cpu_seconds(), Instant::now());
        for _ in 0..per_sample {
            mpm.step(&step, &mut ()).expect("a sound step");
            step.index += 1;
            step.time += dt;
        }
        let scale = 1e9 / (per_sample as f64 * ready.items as f64);
        best[0] = best[0].min((cpu_seconds() - cpu) * scale);
        best[1] = best[1].min(wall.elapsed().as_secs_f64() * scale);
        samples += 1;
    }
    (best[0], best[1], mpm.bytes() as f64 / ready.items as f64)
}

fn cpu_seconds() -> f64 {
    let t = clock_gettime(ClockId::ProcessCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}
