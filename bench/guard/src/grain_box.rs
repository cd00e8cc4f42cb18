//! The case that speed is measured on: grains in rows that settle in an open box.

use dem_proc::Sdem;
use interface::config::{ContactLaw, DemConfig, Motion};
use interface::solver::DemSolver;
use interface::step::Step;
use mechanics::generate::{Arrangement, BodyFill, Grain, Sizes};

use walls::open_box;

#[path = "../../../dem-proc/tests/small_scenes/walls.rs"]
mod walls;

/// Spheropentagons, a tenth rounded, moderately irregular.
pub const PENTAGON: Grain = Grain::Polygon {
    corners: 5,
    roundness: 0.1,
    irregularity: 0.5,
};

/// Stiffness of a contact in N/m.
pub const STIFFNESS: f64 = 1e6;
/// Step in s.
pub const DT: f64 = 2e-5;

/// Width in m of a box of so many grains, which they would fill to the same height.
pub fn width_of(count: usize) -> f64 {
    0.02 * (count as f64).sqrt().round()
}

/// As many grains in a box as wide as high would be, with room to fall.
pub fn grain_box(grain: Grain, count: usize, threads: usize) -> DemConfig {
    let width = width_of(count);
    let mut bodies = open_box(width, 4.0 * width, 0.01);
    let packing = BodyFill {
        name: "grain".into(),
        count: count as u32,
        grain,
        size: Sizes::Uniform {
            from: 0.008,
            to: 0.01,
        },
        density: 2000.0,
        arrange: Arrangement::Rows {
            corner: [0.0; 2],
            width,
        },
        seed: 1,
        velocity: [0.0; 2],
        surface: String::new(),
    };
    bodies.extend(packing.bodies());
    let law = ContactLaw::linear(STIFFNESS, 0.5 * STIFFNESS, 0.5, 0.3);
    DemConfig {
        gravity: [0.0, -9.81],
        bodies,
        point_contact: law,
        body_contact: Some(law),
        skin: 0.001,
        threads,
        ..DemConfig::default()
    }
}

/// One step after another, `before` s long; 0 for the first of all.
pub fn step(dem: &mut Sdem, before: f64, measure: bool) {
    let step = Step {
        index: 0,
        time: 0.0,
        dt_before: before,
        dt: DT,
        measure,
    };
    std::hint::black_box(dem.contact(&step, &[], &mut []).expect("finite"));
    dem.advance(&step).expect("finite");
}

/// A solver that starts from `config`, after `steps` steps, the last of them measured.
pub fn run(config: &DemConfig, steps: usize) -> Sdem {
    let mut dem = Sdem::default();
    dem.configure(config).expect("a valid configuration");
    for i in 0..steps {
        step(&mut dem, if i == 0 { 0.0 } else { DT }, i + 1 == steps);
    }
    dem
}

/// The same grains where they are in `dem`, standing still.
pub fn at_rest(mut config: DemConfig, dem: &Sdem) -> DemConfig {
    for (body, state) in config.bodies.iter_mut().zip(&dem.bodies().state) {
        // The grains' shapes have their centroids in their origins, so the centre of mass is the position; the walls' do not.
        if body.motion == Motion::Fixed {
            continue;
        }
        body.position = state.center.into();
        body.angle = state.angle;
        body.velocity = [0.0; 2];
        body.spin = 0.0;
    }
    config
}

/// A settled pile. To wait until the dashpots have taken all motion would take minutes: the grains fall together, and are
/// stopped again and again until they lie on one another.
pub fn pile(grain: Grain, count: usize) -> DemConfig {
    let mut config = grain_box(grain, count, 1);
    let fall = 8_000;
    for steps in [fall].into_iter().chain([400; 10]) {
        let dem = run(&config, steps);
        config = at_rest(config, &dem);
    }
    config
}
