//! Saving and restoring: a solver that is taken up again goes on to the same bits.
//!
//! A run is driven as a session does it: a set is chosen when the travel asks for one, states are read, forces pressed on
//! the IMPs. It is saved now and then, and from each of these states a fresh solver, with another number of threads, does
//! the next hundred steps. Every step leaves a hash of all that the solver says.

use core::fmt::{Debug, Write};
use std::collections::hash_map::DefaultHasher;
use std::hash::Hasher;

use interface::config::material::Frictional;
use interface::config::{
    Fill, Leaving, MaterialModel, MpmConfig, ShapeFunction, Spacing, Transfer, Wall,
};
use interface::message::wire::{EnvelopeVertex, ImpForce};
use interface::solver::{Fault, MpmSolver};

use crate::blocks::{
    BULK, Random, SHEAR, Stepper, block, configured, elastic_model, neo_hookean_model, points_fill,
    rectangle_fill,
};
use mpm_proc::Mpm;

/// Steps that a run which was taken up again is compared over.
const COMPARED: usize = 100;

/// The session's part of a run, which is not the solver's to save.
#[derive(Clone)]
struct Driver {
    stepper: Stepper,
    random: Random,
    chosen: bool,
    dt: f64,
    domain: [[f64; 2]; 2],
}

impl Driver {
    fn new(config: &MpmConfig, dt: f64) -> Self {
        Self {
            stepper: Stepper::new(),
            random: Random::new(7),
            chosen: false,
            dt,
            domain: config.domain,
        }
    }

    /// A body that lies over the middle of where things happen.
    fn envelope() -> Vec<EnvelopeVertex> {
        [[0.2, 0.15], [0.55, 0.2], [0.5, 0.45], [0.25, 0.4]]
            .map(|position| EnvelopeVertex {
                body: 0,
                position,
                reach: 0.01,
            })
            .to_vec()
    }

    /// One step; the first one opens. Returns a hash of what the solver says.
    fn step(&mut self, mpm: &mut Mpm) -> Result<u64, Fault> {
        let mut hashed = Hashed(DefaultHasher::new());
        let mut random = self.random.clone();
        let mut forces = Vec::new();
        if !self.chosen || mpm.travel() > 0.008 {
            hashed.say(&mpm.select_imps(&Self::envelope()));
            self.chosen = true;
        }
        let states = mpm.imp_states();
        hashed.say(&states);
        let far = |x: f64, a: usize| self.domain[0][a] + 0.11 < x && x < self.domain[1][a] - 0.11;
        for state in states {
            let numbers = [0; 4].map(|_| random.between(-1.0, 1.0));
            let pressed = numbers[0] > 0.2 && far(state.position[0], 0);
            forces.push(if pressed {
                ImpForce {
                    force: [20.0 * numbers[1], 20.0 * numbers[2]],
                    couple: 0.1 * numbers[2],
                    stiffness: 1e4 * (1.0 + numbers[3]),
                    tangential: 4e3 * (1.0 + numbers[3]),
                }
            } else {
                ImpForce::default()
            });
        }
        let index = self.stepper.index;
        let dt = if index == 0 { 0.0 } else { self.dt };
        let measure = index.is_multiple_of(3);
        let limits = self.stepper.step(mpm, dt, measure, &forces)?;
        hashed.say(&limits);
        hashed.say(&mpm.travel());
        if measure {
            hashed.say(mpm.measurement());
        }
        if index.is_multiple_of(10) {
            hashed.say(&mpm.points());
        }
        self.random = random;
        Ok(hashed.0.finish())
    }

    fn steps(&mut self, mpm: &mut Mpm, count: usize) -> Vec<u64> {
        (0..count)
            .map(|_| self.step(mpm).expect("a sound step"))
            .collect()
    }
}

/// A hash of numbers as they are printed: the text of a finite one has all its bits.
struct Hashed(DefaultHasher);

impl Hashed {
    fn say(&mut self, what: &dyn Debug) {
        write!(self, "{what:?};").expect("hashing takes all");
    }
}

impl Write for Hashed {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

/// What a run was when it was saved.
struct Moment {
    name: &'static str,
    driver: Driver,
    bytes: Vec<u8>,
}

/// Runs `config`, and once more from each of the moments at which it was saved.
pub(super) fn goes_on(name: &str, config: &MpmConfig) -> Vec<&'static str> {
    let mut mpm = configured(config);
    let mut driver = Driver::new(config, 2e-4);
    let mut hashes = Vec::new();
    let mut moments: Vec<Moment> = Vec::new();
    let mut save = |name, driver: &Driver, mpm: &Mpm| {
        if moments.iter().all(|m: &Moment| m.name != name) {
            let bytes = mpm.save().expect("configured");
            let driver = driver.clone();
            moments.push(Moment {
                name,
                driver,
                bytes,
            });
        }
    };
    save("before any step", &driver, &mpm);
    for n in 0..230 {
        let travel = mpm.travel();
        let result = driver.step(&mut mpm);
        hashes.push(result.unwrap_or_else(|fault| panic!("{name}, step {n}: {fault}")));
        if n == 0 {
            save("after the opening step", &driver, &mpm);
        } else if n < 230 - COMPARED {
            if mpm.travel().is_infinite() {
                save("after a point has crossed or gone", &driver, &mpm);
            } else if mpm.travel() < travel {
                save("after a selection", &driver, &mpm);
            }
            if n == 37 {
                save("mid-way", &driver, &mpm);
            }
        }
    }
    let mut threads = config.clone();
    threads.threads = 3 - config.threads;
    for moment in &moments {
        let mut fresh = configured(&threads);
        fresh.restore(&moment.bytes).expect("its own state");
        assert_eq!(
            fresh.save().unwrap(),
            moment.bytes,
            "{name}, {}",
            moment.name
        );
        let mut driver = moment.driver.clone();
        let done = driver.stepper.index as usize;
        let again = driver.steps(&mut fresh, COMPARED);
        let differs = (0..COMPARED).find(|&i| again[i] != hashes[done + i]);
        assert_eq!(differs, None, "{name}, saved {}: first step", moment.name);
    }
    moments.iter().map(|m| m.name).collect()
}

/// A block in the open that flies to the right and turns.
pub(super) fn flying() -> MpmConfig {
    let mut config = block();
    config.gravity = [0.0, -9.81];
    config.groups[0].spacing = Spacing::PerCell(9);
    config.groups[0].velocity = [3.0, 0.5];
    config.groups[0].fields.velocity = Some(["-5*(y-0.4)".into(), "5*(x-0.25)".into()]);
    config
}

fn rectangle(lower: [f64; 2]) -> Fill {
    let upper = [lower[0] + 0.3, lower[1] + 0.2];
    rectangle_fill(lower, upper)
}

/// Random cases (`kit.rs`) save within windows and go on with one thread; here points cross a periodic wall or are removed, and
/// threads change.
#[test]
fn a_restored_solver_goes_on_to_the_same_bits() {
    let mut moments = Vec::new();
    for leaves in [false, true] {
        let mut config = flying();
        if leaves {
            config.leaving = Leaving::Remove;
            config.groups[0].velocity = [-3.0, 0.5];
            config.groups[0].fill = rectangle([-0.2, 0.3]);
        } else {
            (config.walls.left, config.walls.right) = (Wall::Periodic, Wall::Periodic);
            config.groups[0].fill = rectangle([0.45, 0.3]);
        }
        for threads in [1, 2] {
            config.threads = threads;
            moments.extend(goes_on(&format!("leaves {leaves}"), &config));
        }
    }
    for moment in [
        "before any step",
        "after the opening step",
        "after a selection",
        "after a point has crossed or gone",
        "mid-way",
    ] {
        let count = moments.iter().filter(|m| **m == moment).count();
        assert!(count >= 2, "{moment}: {count} of 4");
    }
}

#[test]
fn a_state_takes_as_many_bytes_as_its_numbers() {
    let mut config = flying();
    config.cell = 0.01;
    let mpm = configured(&config);
    let points = mpm.points().len();
    // APIC, elastic: x, v, B; stress, volume; id.
    let least = points * (16 + 16 + 32 + 32 + 8 + 4);
    let bytes = mpm.save().unwrap().len();
    assert!((least..least * 5 / 4).contains(&bytes), "{bytes} {least}");
    assert!(bytes < mpm.bytes());
}

fn not_taken(config: &MpmConfig, bytes: &[u8], says: &[&str]) {
    let refusal = configured(config)
        .restore(bytes)
        .expect_err("another state");
    assert_eq!(refusal.key, "restore");
    for text in says {
        assert!(refusal.message.contains(text), "{refusal}");
    }
}

/// What another configuration has otherwise.
type Change = fn(&mut MpmConfig);

#[test]
fn a_state_of_another_configuration_is_refused_with_what_differs() {
    let bytes = configured(&flying()).save().unwrap();
    let rows: [(Change, &[&str]); 5] = [
        (
            |c| c.shape = ShapeFunction::CubicBspline,
            &["mpm.shape", "quadratic", "cubic"],
        ),
        (
            |c| c.transfer = Transfer::Flip,
            &["mpm.transfer", "apic", "flip"],
        ),
        (
            |c| c.materials[0].model = neo_hookean_model(BULK, SHEAR),
            &["linear_elastic", "neo_hookean"],
        ),
        (
            |c| c.groups[0].spacing = Spacing::PerCell(4),
            &["mpm.points.0.spacing", "9"],
        ),
        (
            |c| {
                c.groups.push(c.groups[0].clone());
                c.groups[1].fill = rectangle([0.1, 0.6]);
            },
            &["mpm.points.1.name"],
        ),
    ];
    for (change, says) in rows {
        let mut other = flying();
        change(&mut other);
        not_taken(&other, &bytes, says);
    }
    not_taken(&flying(), b"", &["tandem-mpm"]);
    not_taken(&flying(), &bytes[..bytes.len() - 1], &["damaged"]);
    let refusal = Mpm::new().restore(&bytes).unwrap_err();
    assert!(refusal.message.contains("configured"), "{refusal}");

    // Given point by point, only their numbers distinguish the groups.
    let mut single = flying();
    let mut positions = vec![[0.2, 0.3], [0.3, 0.3]];
    let fill = |positions: &Vec<[f64; 2]>| points_fill(positions.clone());
    single.groups[0].spacing = Spacing::Distance(0.02);
    single.groups[0].fill = fill(&positions);
    let bytes = configured(&single).save().unwrap();
    positions.push([0.4, 0.3]);
    single.groups[0].fill = fill(&positions);
    not_taken(&single, &bytes, &["fill.points = 2", "has `3`"]);
}

/// A branch: points as they were, other gravity, walls, loads and moduli from here on.
#[test]
fn a_configuration_with_other_laws_goes_on_from_the_state() {
    let mut saved = configured(&flying());
    Driver::new(&flying(), 2e-4).steps(&mut saved, 60);
    let bytes = saved.save().unwrap();
    let mut other = flying();
    other.gravity = [0.0, -1.0];
    other.walls.bottom = Wall::Slip;
    other.leaving = Leaving::Remove;
    other.materials[0].model = elastic_model(0.5 * BULK, 0.5 * SHEAR);
    let mut branch = configured(&other);
    branch.restore(&bytes).unwrap();
    let place = |mpm: &Mpm| mpm.points().iter().map(|p| p.position).collect::<Vec<_>>();
    assert_eq!(place(&branch), place(&saved));
    Driver::new(&other, 1e-4).steps(&mut branch, 20);
    // Of other points, whatever else is the same.
    other.materials[0].density *= 2.0;
    not_taken(&other, &bytes, &["mpm.material.0.density"]);
    let mut periodic = flying();
    (periodic.walls.left, periodic.walls.right) = (Wall::Periodic, Wall::Periodic);
    not_taken(&periodic, &bytes, &["mpm.walls.periodic"]);
}

/// A model that keeps more numbers of each point than before, and a load that the saved run did not have.
#[test]
fn what_a_branch_adds_begins_with_it() {
    let sand = |separates| {
        MaterialModel::DruckerPrager(Frictional {
            bulk_modulus: BULK,
            shear_modulus: SHEAR,
            friction_angle: 35.0,
            dilation_angle: 0.0,
            cohesion: 0.0,
            tensile_strength: 0.0,
            critical_state: None,
            separates,
        })
    };
    let mut config = flying();
    config.materials[0].model = sand(false);
    let mut saved = configured(&config);
    let mut stepper = Stepper::new();
    stepper.run(&mut saved, 2e-4, 60);
    let bytes = saved.save().unwrap();
    config.materials[0].model = sand(true);
    config.forcing.body_force = Some(["1e3".into(), "0".into()]);
    let mut branch = configured(&config);
    branch.restore(&bytes).unwrap();
    let work = |mpm: &Mpm| mpm.measurement().ledger.driven_work;
    // Zero behind the first step, in which the load begins; then what it does in a step on 3 m/s.
    let mut measured = || {
        stepper.step(&mut branch, 2e-4, true, &[]).expect("sound");
        work(&branch)
    };
    let before = work(&saved);
    let (first, second) = (measured() - before, measured() - before);
    assert!(first.abs() < 1e-12, "{first}");
    let power = 1e3 * 60.0 * 3.0;
    assert!((second / (power * 2e-4) - 1.0).abs() < 0.1, "{second}");
}

/// A solver that has refused a state says so and does no step.
#[test]
fn a_solver_is_of_no_use_after_it_has_refused() {
    let bytes = configured(&flying()).save().unwrap();
    let mut mpm = configured(&flying());
    mpm.restore(&bytes[..100]).unwrap_err();
    let fault = Stepper::new().step(&mut mpm, 0.0, false, &[]).unwrap_err();
    assert!(fault.to_string().contains("configured"));
    mpm.configure(&flying()).unwrap();
    mpm.restore(&bytes).unwrap();
}
