//! A driven body leaves the contacts that press on it faster than they can follow: its velocity jumps at the start of a
//! run or a branch.

use crate::small_scenes::*;
use interface::config::{BodyConfig, BodyShape, ContactLaw, DemConfig, Motion};
use interface::solver::DemSolver;

const K: f64 = 1e5;
const RADIUS: f64 = 5e-3;
/// Overlap of the deepest point in m.
const XI: f64 = 2e-4;

/// A plate under points, which moves down at `speed` (m/s).
fn plate(speed: f64, damping_ratio: f64) -> DemConfig {
    let law = ContactLaw::linear(K, 0.0, 0.0, damping_ratio);
    let plate = BodyConfig {
        velocity: [0.0, -speed],
        motion: Motion::Driven,
        ..body(segment_shape([[-1.0, 0.0], [1.0, 0.0]]), 0.01)
    };
    scene(vec![plate], law)
}

/// Points of 0.1 kg/m that press on the plate, each a little less than the one before.
fn pressed() -> Points {
    let points: Vec<_> = (0..10)
        .map(|i| {
            let overlap = XI * (1.0 - 0.07 * f64::from(i));
            let y = 0.01 + RADIUS - overlap;
            (info(i as u64, RADIUS, 0.1), at(0.02 * f64::from(i), y))
        })
        .collect();
    Points::new(&points)
}

/// Energy that is created until all contacts have opened, divided by the energy in their springs, in steps of `dt` (s),
/// or of the length that the opening step asks for. Also returns that length.
fn created(config: &DemConfig, dt: Option<f64>) -> (f64, f64) {
    let (mut dem, mut points) = (configured(config), pressed());
    dem.imp_set(&points.set);
    let limits = points.step(&mut dem, &OPENING).limits;
    let held = dem.measurement().ledger.contact;
    let dt = dt.unwrap_or_else(|| 2.0 / limits.omega_sq.sqrt());
    for i in 0.. {
        points.step(&mut dem, &step(if i == 0 { 0.0 } else { dt }, dt));
        let ledger = dem.measurement().ledger;
        if i > 1 && ledger.contacts == 0 {
            let now = points.kinetic() + ledger.contact + ledger.viscous_work - ledger.driven_work;
            return (now / held - 1.0, dt);
        }
        assert!(i < 10_000, "they never part");
    }
    unreachable!()
}

/// The dashpot cancels the whole spring, so no force acts. The energy of the spring is the loss of the dashpot, however
/// far the plate moves in a step.
#[test]
fn a_dashpot_takes_no_more_than_the_spring_had() {
    let speed = 6.0;
    for way in [0.1, 0.9, 1.5, 8.0] {
        let (created, _) = created(&plate(speed, 0.5), Some(way * XI / speed));
        assert!(created.abs() < 1e-12, "{way} overlaps a step: {created:e}");
    }
}

/// The contacts are resolved, although only their load and the speed of the plate show that they open. They are
/// resolved equally well at all speeds.
#[test]
fn a_plate_that_is_driven_away_takes_no_more_than_the_springs_had() {
    for speed in [0.5, 2.0, 6.0] {
        let (created, dt) = created(&plate(speed, 0.0), None);
        assert!(created.abs() < 5e-4, "{speed} m/s: {created:e}");
        let per_overlap = XI / (speed * dt);
        assert!(
            (20.0..64.0).contains(&per_overlap),
            "{speed} m/s: {per_overlap}"
        );
    }
}

/// Squared frequency that the opening step asks for. Points have `velocity` (m/s), and their overlaps are multiplied by
/// `share`.
fn asked(config: &DemConfig, velocity: [f64; 2], share: f64) -> f64 {
    let (mut dem, mut points) = (configured(config), pressed());
    for state in &mut points.states {
        let overlap = 0.01 + RADIUS - state.position[1];
        state.position[1] = 0.01 + RADIUS - share * overlap;
        state.velocity = velocity;
    }
    dem.imp_set(&points.set);
    points.step(&mut dem, &OPENING).limits.omega_sq
}

#[test]
fn only_contacts_that_open_under_load_shorten_the_first_step() {
    let away = asked(&plate(6.0, 0.0), [0.0; 2], 1.0);
    assert!(away > 0.0);
    // A common velocity of plate and points has no effect.
    let moving = asked(&plate(2.0, 0.0), [0.0, 4.0], 1.0);
    assert!((moving / away - 1.0).abs() < 1e-12);
    // No resolution is needed if both move together, if the plate moves towards the points or along them, if points
    // only just touch, or if a dashpot holds them.
    assert_eq!(asked(&plate(0.0, 0.0), [0.0; 2], 1.0), 0.0);
    assert_eq!(asked(&plate(6.0, 0.0), [0.0, -6.0], 1.0), 0.0);
    assert_eq!(asked(&plate(-6.0, 0.0), [0.0; 2], 1.0), 0.0);
    assert_eq!(asked(&plate(0.0, 0.0), [3.0, 0.0], 1.0), 0.0);
    assert_eq!(asked(&plate(6.0, 0.0), [0.0; 2], 1e-3), 0.0);
    assert_eq!(asked(&plate(6.0, 0.5), [0.0; 2], 1.0), 0.0);
}

/// What two discs that adhere at rest have less than none is no energy that other contacts could do without.
#[test]
fn contacts_open_as_slowly_beside_two_that_adhere() {
    let alone = DemConfig {
        body_contact: Some(granular_law(K, 0.0, 0.0, 0.0, 1000.0, 0.0)),
        ..plate(6.0, 0.0)
    };
    let mut beside = alone.clone();
    beside.bodies.extend([-9.998, 9.998].map(|x| BodyConfig {
        position: [x, 100.0],
        ..body(BodyShape::Disc, 10.0)
    }));
    let [alone, beside] = [alone, beside].map(|config| asked(&config, [0.0; 2], 1.0));
    assert!(alone > 0.0 && alone == beside, "{alone} {beside}");
}

/// A disc on a driven floor, without points.
#[test]
fn bodies_on_a_floor_that_is_driven_away_are_let_go_in_many_steps() {
    let mut config = plate(6.0, 0.0);
    config.bodies.push(BodyConfig {
        position: [0.0, 0.01 + 0.1 - XI],
        ..body(BodyShape::Disc, 0.1)
    });
    let mut dem = configured(&config);
    let first = |dem: &mut dem_proc::Sdem| dem.contact(&OPENING, &[], &mut []).unwrap().limits;
    let dt = 2.0 / first(&mut dem).omega_sq.sqrt();
    dem.advance(&OPENING).unwrap();
    let held = dem.measurement().ledger.contact;
    for i in 0..200 {
        go(&mut dem, i == 0, dt);
    }
    let ledger = dem.measurement().ledger;
    assert_eq!(ledger.contact, 0.0);
    let created = (ledger.kinetic - ledger.driven_work) / held - 1.0;
    assert!(created.abs() < 1e-3, "{created:e}");
}
