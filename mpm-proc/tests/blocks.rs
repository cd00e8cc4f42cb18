//! Blocks of points, and steps.

use interface::config::material::Inertial;
use interface::config::{
    Elasticity, Fill, GroupConfig, MaterialConfig, MaterialModel, MpmConfig, Scheme, ShapeFunction,
    Spacing, Transfer, Wall, Walls,
};
use interface::message::wire::{EnvelopeVertex, ImpForce, Limits};
use interface::solver::{Fault, MpmSolver};
use interface::step::Step;
pub use mechanics::generate::Random;

use mpm_proc::Mpm;

pub const BULK: f64 = 5.0e5;
pub const SHEAR: f64 = 3.0e5;

/// Grains of the mu(I) rheology.
pub const GRAINS: Inertial = Inertial {
    bulk_modulus: BULK,
    shear_modulus: SHEAR,
    static_friction: 0.38,
    limit_friction: 0.64,
    inertial_number: 0.279,
    grain_diameter: 1e-3,
    grain_density: 2500.0,
    volume_rate: 0.0,
};

/// An elastic block of 0.3 x 0.2 in a domain of 1 x 0.8, cells of 0.05, nothing held.
pub fn block() -> MpmConfig {
    MpmConfig {
        scheme: Scheme {
            domain: [[-0.2, 0.1], [0.8, 0.9]],
            cell: 0.05,
            shape: ShapeFunction::QuadraticBspline,
            transfer: Transfer::Apic,
            ..Scheme::default()
        },
        materials: vec![MaterialConfig {
            name: "rubber".into(),
            density: 1000.0,
            model: elastic_model(BULK, SHEAR),
        }],
        groups: vec![GroupConfig::at_rest(
            "block",
            rectangle_fill([0.1, 0.3], [0.4, 0.5]),
            Spacing::PerCell(4),
        )],
        skin: 0.01,
        threads: 1,
        ..MpmConfig::default()
    }
}

pub fn rectangle_fill(lower: [f64; 2], upper: [f64; 2]) -> Fill {
    Fill::Rectangle { lower, upper }
}

pub fn disc_fill(center: [f64; 2], radius: f64) -> Fill {
    Fill::Disc { center, radius }
}

pub fn points_fill(positions: Vec<[f64; 2]>) -> Fill {
    Fill::Points { positions }
}

pub const fn elastic_model(bulk_modulus: f64, shear_modulus: f64) -> MaterialModel {
    MaterialModel::LinearElastic(Elasticity {
        bulk_modulus,
        shear_modulus,
    })
}

pub const fn neo_hookean_model(bulk_modulus: f64, shear_modulus: f64) -> MaterialModel {
    MaterialModel::NeoHookean(Elasticity {
        bulk_modulus,
        shear_modulus,
    })
}

pub const fn walls(left: Wall, right: Wall, bottom: Wall, top: Wall) -> Walls {
    Walls {
        left,
        right,
        bottom,
        top,
    }
}

/// The first step of a run.
pub fn first_step(dt: f64, measure: bool) -> Step {
    Step {
        index: 0,
        time: 0.0,
        dt_before: 0.0,
        dt,
        measure,
    }
}

pub fn configured(config: &MpmConfig) -> Mpm {
    let mut mpm = Mpm::new();
    mpm.configure(config).expect("a good configuration");
    mpm
}

/// Steps of equal length, first and closing half kicks included where a caller asks for them.
#[derive(Clone, Default)]
pub struct Stepper {
    pub index: u64,
    pub time: f64,
    pub before: f64,
}

impl Stepper {
    pub fn new() -> Self {
        Self::default()
    }

    pub fn step(
        &mut self,
        mpm: &mut Mpm,
        dt: f64,
        measure: bool,
        forces: &[ImpForce],
    ) -> Result<Limits, Fault> {
        let step = Step {
            index: self.index,
            time: self.time,
            dt_before: self.before,
            dt,
            measure,
        };
        self.index += 1;
        self.time += dt;
        self.before = dt;
        mpm.step(&step, forces)
    }

    pub fn run(&mut self, mpm: &mut Mpm, dt: f64, steps: usize) {
        for _ in 0..steps {
            self.step(mpm, dt, false, &[]).expect("a sound step");
        }
    }
}

/// Every position and velocity, bit by bit.
pub fn bits(mpm: &Mpm) -> Vec<u64> {
    mpm.points()
        .iter()
        .flat_map(|p| [p.position, p.velocity].concat())
        .map(f64::to_bits)
        .collect()
}

/// An outline so large that every point is an IMP.
pub fn everywhere() -> Vec<EnvelopeVertex> {
    [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]
        .map(|position| EnvelopeVertex {
            body: 0,
            position,
            reach: 0.0,
        })
        .to_vec()
}
