//! After it has warmed up, a step of discs on a boundary chain allocates nothing, whatever parts and joins.

use crate::small_scenes::*;
use dem_proc::Sdem;
use interface::config::{BodyConfig, BodyShape, DemConfig, Interface, Motion};
use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::solver::DemSolver;
use interface::step::Step;

const K: f64 = 1e5;
const A: f64 = 0.1;
const R: f64 = 0.02;
const MARKERS: u32 = 30;

/// Markers around the lower half of a disc, or all around it, each of which moves in and out and along on its own.
fn markers(n: u64, all_around: bool) -> Vec<ImpState> {
    let rough = |i: u32, k: u32| f64::from((i * 37 + k * 23) % 19) / 19.0 - 0.5;
    let time = 1e-3 * n as f64;
    let spread = if all_around { 348.0 } else { 160.0 };
    let marker = |i: u32| {
        let own = |k: u32| (time * (3.0 + 4.0 * rough(i, k)) + 7.0 * rough(i, k + 1)).sin();
        let angle = (350.0 - spread / f64::from(MARKERS - 1) * f64::from(i)).to_radians();
        let angle = angle + 3e-2 * (2.0 * time).sin() + 1e-2 * own(2);
        let away = A + R - 1e-3 + 2e-3 * own(4);
        at(away * angle.cos(), away * angle.sin())
    };
    (0..MARKERS).map(marker).collect()
}

fn allocates_nothing(all_around: bool) {
    let disc = BodyConfig {
        position: [0.0, 0.0],
        motion: Motion::Driven,
        ..body(BodyShape::Disc, A)
    };
    let config = DemConfig {
        interface: Interface::Segments,
        body_contact: None,
        ..scene(vec![disc], frictional(K, 0.5 * K, 0.3))
    };
    let set: Vec<ImpInfo> = (0..MARKERS)
        .map(|i| ImpInfo {
            next: match i + 1 {
                MARKERS => u32::from(all_around),
                next => next + 1,
            },
            ..info(u64::from(i), R, 1.0)
        })
        .collect();
    let motion: Vec<Vec<ImpState>> = (0..3000).map(|n| markers(n, all_around)).collect();
    let mut forces = vec![ImpForce::default(); MARKERS as usize];
    let mut dem: Sdem = configured(&config);
    dem.imp_set(&set);
    let mut pressed = [false; 2];
    let mut run = |first: u64| {
        for (n, states) in (first..).zip(&motion) {
            let step = Step {
                index: n,
                measure: false,
                ..step(1e-3, 1e-3)
            };
            dem.contact(&step, states, &mut forces).expect("no fault");
            dem.advance(&step).expect("no fault");
            for force in &forces {
                pressed[usize::from(force.force == [0.0; 2])] = true;
            }
        }
    };
    // Twice: from the end of the motion back to its beginning all contacts change at once.
    run(0);
    run(3000);
    let counted = allocation_counter::measure(|| run(6000));
    assert_eq!(counted.count_total, 0, "{all_around}: {counted:?}");
    assert_eq!(pressed, [true; 2]);
}

#[test]
fn a_step_allocates_nothing_after_warm_up() {
    allocates_nothing(false);
    allocates_nothing(true);
}
