//! Volumes that points share ([`mpm_proc::pass::volumes`]).

use interface::config::material::Inertial;
use interface::config::{InitialFields, MaterialModel, MpmConfig, Spacing, Transfer, Wall};
use interface::solver::MpmSolver;

use crate::blocks::{Random, Stepper, block, configured, points_fill, walls};

const CELL: f64 = 2e-3;
const HEIGHT: f64 = 8.0 * CELL;
const GRAVITY: [f64; 2] = [4.245_227_6, -8.844_224_1];

/// Speed of the surface of Bagnold's flow of the layer in m/s (scenes/verification/bagnold.toml).
fn surface_speed() -> f64 {
    let number = 0.279 * (0.48 - 0.38) / (0.64 - 0.48);
    2.0 / 3.0 * HEIGHT * number / 2e-3 * (1500.0 * -GRAVITY[1] * HEIGHT / 2500.0).sqrt()
}

/// A layer of mu(I) grains on a slope, at its steady speed, its points in disorder.
fn layer(volume_rate: f64) -> MpmConfig {
    let mut config = block();
    config.cell = CELL;
    config.domain = [[0.0, 0.0], [4.0 * CELL, 16.0 * CELL]];
    config.gravity = GRAVITY;
    config.transfer = Transfer::FlipXpic {
        order: 2,
        pic_rate: 50.0,
    };
    config.walls = walls(Wall::Periodic, Wall::Periodic, Wall::Fixed, Wall::Open);
    config.materials[0].density = 1500.0;
    config.materials[0].model = MaterialModel::MuI(Inertial {
        bulk_modulus: 5e5,
        shear_modulus: 3e5,
        static_friction: 0.38,
        limit_friction: 0.64,
        inertial_number: 0.279,
        grain_diameter: 2e-3,
        grain_density: 2500.0,
        volume_rate,
    });
    let (mut random, side) = (Random::new(1), 0.5 * CELL);
    let mut near = |i: usize| side * (i as f64 + 0.5 + random.between(-0.4, 0.4));
    let positions = (0..16)
        .flat_map(|j| (0..8).map(move |i| (i, j)))
        .map(|(i, j)| [near(i), near(j)])
        .collect();
    config.groups[0].fill = points_fill(positions);
    config.groups[0].spacing = Spacing::Distance(side);
    let [x, y] = GRAVITY.map(|g| 1500.0 * g);
    let pressed = format!("{y}*max({HEIGHT} - y, 0)");
    config.groups[0].fields = InitialFields {
        velocity: Some([
            format!("{}*(1 - max(1 - y/{HEIGHT}, 0)^1.5)", surface_speed()),
            "0".into(),
        ]),
        stress: Some([
            pressed.clone(),
            pressed.clone(),
            pressed,
            format!("{x}*max({HEIGHT} - y, 0)"),
        ]),
    };
    config
}

/// Mean speed along the slope over the steady one, and mean height over that of the start, after 0.3 s: a shear of 12.
fn after_shear(volume_rate: f64) -> [f64; 2] {
    let mut mpm = configured(&layer(volume_rate));
    let mean = |of: &dyn Fn(&interface::message::wire::PointState) -> f64, mpm: &mpm_proc::Mpm| {
        let points = mpm.points();
        points.iter().map(of).sum::<f64>() / points.len() as f64
    };
    let begin = [
        mean(&|p| p.velocity[0], &mpm),
        mean(&|p| p.position[1], &mpm),
    ];
    Stepper::new().run(&mut mpm, 4e-5, 7_500);
    let end = [
        mean(&|p| p.velocity[0], &mpm),
        mean(&|p| p.position[1], &mpm),
    ];
    [end[0] / begin[0], end[1] / begin[1]]
}

/// Without the rate points in disorder have volumes of their own, most of them open, and the layer flows too fast, the more
/// so the longer it is sheared.
#[test]
fn a_sheared_layer_keeps_its_speed() {
    let [own, shared] = [0.0, 1000.0].map(after_shear);
    println!("{own:?} {shared:?}");
    assert!(own[0] > 1.12, "{own:?}");
    assert!((shared[0] - 1.0).abs() < 0.07, "{shared:?}");
    assert!((shared[1] - 1.0).abs() < 0.04, "{shared:?}");
}
