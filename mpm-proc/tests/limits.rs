//! The step limits against eigenvalues of dense matrices.

use interface::config::{MaterialModel, MpmConfig, ShapeFunction, Spacing, StressUpdate, Transfer};
use interface::message::wire::{ImpForce, Limits, PointState};
use interface::solver::MpmSolver;
use nalgebra::{DMatrix, DVector};

use crate::blocks::{
    BULK, Random, SHEAR, Stepper, block, configured, elastic_model, everywhere, first_step,
    points_fill,
};
use mechanics::reference::Kernel;
use mpm_proc::Mpm;

pub const CELL: f64 = 0.05;

/// The nodes that a cloud touches, in cells.
pub fn nodes(positions: &[[f64; 2]], kernel: Kernel, lower: [f64; 2]) -> Vec<[f64; 2]> {
    let all = (-3..24).flat_map(|j| (-3..24).map(move |i| [f64::from(i), f64::from(j)]));
    let touched = |node: &[f64; 2]| {
        let weights = positions.iter().map(|x| {
            let d = [0, 1].map(|a| (x[a] - lower[a]) / CELL - node[a]);
            kernel.value(d[0]) * kernel.value(d[1])
        });
        weights.sum::<f64>() > 1e-12
    };
    all.filter(touched).collect()
}

/// `S` (points x nodes) and `dS/dx`, `dS/dy` of a cloud, over all nodes that it touches.
pub fn matrices(positions: &[[f64; 2]], kernel: Kernel, lower: [f64; 2]) -> [DMatrix<f64>; 3] {
    matrices_over(&nodes(positions, kernel, lower), positions, kernel, lower)
}

/// The same over these nodes.
pub fn matrices_over(
    nodes: &[[f64; 2]],
    positions: &[[f64; 2]],
    kernel: Kernel,
    lower: [f64; 2],
) -> [DMatrix<f64>; 3] {
    let at = |p: usize, n: usize| [0, 1].map(|a| (positions[p][a] - lower[a]) / CELL - nodes[n][a]);
    let build = |f: &dyn Fn([f64; 2]) -> f64| {
        DMatrix::from_fn(positions.len(), nodes.len(), |p, n| f(at(p, n)))
    };
    let s = build(&|d| kernel.value(d[0]) * kernel.value(d[1]));
    let gx = build(&|d| kernel.slope(d[0]) * kernel.value(d[1]) / CELL);
    let gy = build(&|d| kernel.value(d[0]) * kernel.slope(d[1]) / CELL);
    [s, gx, gy]
}

pub fn largest_eigenvalue(symmetric: &DMatrix<f64>) -> f64 {
    symmetric.symmetric_eigenvalues().max()
}

/// A cloud of `count` points at random, with boxes of half a cell.
fn scattered(config: &mut MpmConfig, random: &mut Random, count: usize) -> Vec<[f64; 2]> {
    let positions: Vec<[f64; 2]> = (0..count)
        .map(|_| [random.between(0.2, 0.4), random.between(0.3, 0.5)])
        .collect();
    config.groups[0].fill = points_fill(positions.clone());
    config.groups[0].spacing = Spacing::Distance(0.025);
    positions
}

/// Volume in m^2 and mass in kg/m of its points.
const VOLUME: f64 = 0.025 * 0.025;
const MASS: f64 = 1000.0 * VOLUME;

/// `sum_p V_p B_p^T C B_p` of plane strain, with what maps the degrees of freedom (columns; the same for x and y) to the
/// gradients of a component at the points (rows): x before y.
fn elastic_operator(gx: &DMatrix<f64>, gy: &DMatrix<f64>) -> DMatrix<f64> {
    let n = gx.ncols();
    let (m, l) = (BULK + 4.0 / 3.0 * SHEAR, BULK - 2.0 / 3.0 * SHEAR);
    let block = |a: &DMatrix<f64>, b: &DMatrix<f64>| a.transpose() * b * VOLUME;
    let xy = block(gx, gy) * l + block(gy, gx) * SHEAR;
    let mut operator = DMatrix::zeros(2 * n, 2 * n);
    operator
        .view_mut((0, 0), (n, n))
        .copy_from(&(block(gx, gx) * m + block(gy, gy) * SHEAR));
    operator
        .view_mut((n, n), (n, n))
        .copy_from(&(block(gy, gy) * m + block(gx, gx) * SHEAR));
    operator.view_mut((0, n), (n, n)).copy_from(&xy);
    operator.view_mut((n, 0), (n, n)).copy_from(&xy.transpose());
    operator
}

/// The largest squared frequency of a scheme that keeps velocities on points and smooths them by `share` of what the nodes do
/// not see: `dt^2 K <= 2 (1 + Q)` at the limit `4 / dt^2`, with `K` the operator on points.
fn of_points(s: &DMatrix<f64>, gx: &DMatrix<f64>, gy: &DMatrix<f64>, share: f64) -> f64 {
    let nodal: DVector<f64> = s.row_sum().transpose() * MASS;
    let q = DMatrix::from_fn(s.ncols(), s.nrows(), |i, p| {
        s[(p, i)] * MASS.sqrt() / nodal[i]
    });
    let seen = (s * &q * MASS.sqrt()).symmetric_eigen();
    let halves = seen
        .eigenvalues
        .map(|x| (1.0 - 0.5 * share * (1.0 - x)).powf(-0.5));
    let q = q * &seen.eigenvectors * DMatrix::from_diagonal(&halves);
    largest_eigenvalue(&elastic_operator(&(gx * &q), &(gy * &q)))
}

pub fn opening(config: &MpmConfig, forces: &[ImpForce]) -> Limits {
    let mut mpm = configured(config);
    mpm.select_imps(&everywhere());
    let step = first_step(0.0, false);
    mpm.step(&step, forces).expect("a sound step")
}

#[test]
fn the_elastic_frequency_bounds_the_eigenvalues_of_random_clouds() {
    use Kernel::{Cubic, Linear, Quadratic, Ugimp};
    let of_grid = None;
    for (kernel, transfer, smooths) in [
        (Quadratic, Transfer::Apic, of_grid),
        (Cubic, Transfer::Apic, of_grid),
        (Linear, Transfer::Flip, Some(0.0)),
        (Quadratic, Transfer::Flip, Some(0.0)),
        (Cubic, Transfer::Flip, Some(0.0)),
        (Ugimp(0.25), Transfer::Flip, Some(0.0)),
        (
            Ugimp(0.25),
            Transfer::Blend { pic_fraction: 0.4 },
            Some(0.4),
        ),
        (Cubic, Transfer::Xpic { order: 1 }, Some(1.0)),
        (Cubic, Transfer::Pic, Some(1.0)),
    ] {
        let shape = match kernel {
            Cubic => ShapeFunction::CubicBspline,
            Ugimp(_) => ShapeFunction::Ugimp,
            Linear => ShapeFunction::Linear,
            Quadratic => ShapeFunction::QuadraticBspline,
        };
        let mut tightest: f64 = 0.0;
        for seed in 0..12 {
            let mut random = Random::new(seed);
            let mut config = block();
            (config.shape, config.transfer) = (shape, transfer);
            if shape == ShapeFunction::Ugimp {
                config.stress_update = StressUpdate::Usavg; // with USF the bound is that of the grid
            }
            let count = [3, 12, 40][seed as usize % 3];
            let positions = scattered(&mut config, &mut random, count);
            let limits = opening(&config, &[]);

            let [s, gx, gy] = matrices(&positions, kernel, config.domain[0]);
            let nodal: DVector<f64> = s.row_sum().transpose() * MASS;
            let root = nodal.map(|m| 1.0 / m.sqrt());
            let by_mass = DMatrix::from_diagonal(&root);
            let exact = match smooths {
                None => largest_eigenvalue(&elastic_operator(&(&gx * &by_mass), &(&gy * &by_mass))),
                Some(share) => of_points(&s, &gx, &gy, share),
            };
            assert!(
                exact <= limits.omega_sq * (1.0 + 1e-9),
                "{shape:?} {transfer:?} {seed}: {exact} {}",
                limits.omega_sq
            );
            tightest = tightest.max(exact / limits.omega_sq);
        }
        // The bound is reached, near enough, by a cloud whose points lie in the stiffest place.
        let near = if shape == ShapeFunction::Linear {
            0.1
        } else {
            0.3
        };
        assert!(tightest > near, "{shape:?} {transfer:?}: {tightest}");
    }
}

/// That the bound holds for any points, with friction on their surfaces, is for the kit to judge. A point alone has its own frequency.
#[test]
fn the_contact_frequency_of_a_point_alone_is_exact() {
    for (shape, kernel) in [
        (ShapeFunction::QuadraticBspline, Kernel::Quadratic),
        (ShapeFunction::CubicBspline, Kernel::Cubic),
        (ShapeFunction::Ugimp, Kernel::Ugimp(0.25)),
        (ShapeFunction::Linear, Kernel::Linear),
    ] {
        for seed in 0..8 {
            let mut random = Random::new(seed);
            let mut config = block();
            (config.shape, config.transfer) = (shape, Transfer::Flip);
            let radius = 0.025 * [0.5, 1.0, 2.0, 4.0][seed as usize % 4];
            config.groups[0].contact_radius = Some(radius);
            let positions = scattered(&mut config, &mut random, 1);
            let [s, gx, gy] = matrices(&positions, kernel, config.domain[0]);
            let (n, stiffness) = (s.ncols(), random.between(1e4, 1e6));
            let (y, x) = random.between(0.0, 6.3).sin_cos();
            for tangential in [0.0, stiffness] {
                let force = ImpForce {
                    stiffness,
                    tangential,
                    ..ImpForce::default()
                };
                let limits = opening(&config, &[force]);
                // A row for the normal, and one for the tangent with the turn of the surface.
                let rows = DMatrix::from_fn(2, 2 * n, |row, column| {
                    let (a, i) = (column / n, column % n);
                    let [along, across] = [[x, -y], [y, x]][a];
                    let turn = [-0.5 * gy[(0, i)], 0.5 * gx[(0, i)]][a];
                    let surface = s[(0, i)] * across - radius * turn;
                    let of_row = [
                        stiffness.sqrt() * s[(0, i)] * along,
                        tangential.sqrt() * surface,
                    ];
                    of_row[row] / (s[(0, i)] * MASS).sqrt()
                });
                let exact = largest_eigenvalue(&(&rows * rows.transpose()));
                let share = exact / limits.contact_omega_sq;
                assert!((share - 1.0).abs() < 1e-9, "{shape:?} {seed}: {share}");
            }
        }
    }
}

#[test]
fn without_imps_there_is_no_contact_limit() {
    let mut mpm = configured(&block());
    let step = first_step(0.0, false);
    let limits = mpm.step(&step, &[]).expect("a sound step");
    assert_eq!(
        (
            limits.contact_omega_sq,
            limits.mobility,
            limits.speed,
            limits.radius_min,
            limits.damping
        ),
        (0.0, 0.0, 0.0, 0.0, 0.0)
    );
    // 6/L^2 (2K + 2G/3)/rho
    let expected = 6.0 / (CELL * CELL) * (2.0 * BULK + 2.0 / 3.0 * SHEAR) / 1000.0;
    assert!((limits.omega_sq / expected - 1.0).abs() < 1e-12);
}

/// Energy after 400 steps of `share` of the solver's own limit over that at the start; infinite if a point leaves the domain.
fn growth(config: &MpmConfig, share: f64, forces: &dyn Fn(&Mpm) -> Vec<ImpForce>) -> f64 {
    let mut mpm = configured(config);
    mpm.select_imps(&everywhere());
    let mut stepper = Stepper::new();
    let mut step = |dt| {
        let forces = forces(&mpm);
        let limits = stepper.step(&mut mpm, dt, true, &forces).ok()?;
        let ledger = mpm.measurement().ledger;
        let omega_sq = limits.omega_sq + limits.contact_omega_sq;
        Some((omega_sq, ledger.kinetic + ledger.elastic))
    };
    let (mut omega_sq, start) = step(0.0).expect("a sound start");
    let mut energy = start;
    for _ in 0..400 {
        let Some(next) = step(share * 2.0 / omega_sq.sqrt()) else {
            return f64::INFINITY;
        };
        (omega_sq, energy) = next;
    }
    energy / start
}

fn strained(config: &mut MpmConfig, update: StressUpdate) {
    config.stress_update = update;
    config.groups[0].spacing = Spacing::Distance(0.025);
}

/// Four points a cell apart, of which all nodes see as much of one as of the others: 0.92 of the largest step that any cloud
/// allows (0.84 of the squared frequency), by a dense eigenvalue. So close to it the energy of leapfrog swings by a factor
/// of `1/(1 - 0.91^2)`.
#[test]
fn the_stiffest_square_is_stable_up_to_its_limit_and_not_a_tenth_beyond() {
    for update in [StressUpdate::Usf, StressUpdate::Musl, StressUpdate::Usavg] {
        let mut config = block();
        (config.shape, config.transfer) = (ShapeFunction::CubicBspline, Transfer::Flip);
        let [low, high] = [0.174_75, 0.225_25];
        config.domain = [[-0.3, -0.3], [0.7, 0.7]];
        config.groups[0].fill =
            points_fill(vec![[low, high], [high, high], [low, low], [high, low]]);
        let field = ["1e-6*cos(62*x)", "1e-6*sin(62*y+x)"].map(String::from);
        config.groups[0].fields.velocity = Some(field);
        strained(&mut config, update);
        let of = |share| growth(&config, share, &|_| Vec::new());
        assert!(of(0.99) < 10.0, "{update:?}: {}", of(0.99));
        assert!(of(1.1) > 1e6, "{update:?}: {}", of(1.1));
    }
}

/// With USL a point is strained by what its own stress has just done to its nodes, also by motions that no point sees. At
/// the step of other schemes its stress grew without bound.
#[test]
fn a_lone_point_under_stress_settles_with_usl_up_to_its_limit_and_not_beyond() {
    for (transfer, shape, at) in [
        (Transfer::Flip, ShapeFunction::QuadraticBspline, 0.325_001),
        (Transfer::Pic, ShapeFunction::QuadraticBspline, 0.325_001),
        (Transfer::Apic, ShapeFunction::QuadraticBspline, 0.325_001),
        (Transfer::Flip, ShapeFunction::Ugimp, 0.312_49),
    ] {
        let mut config = block();
        (config.shape, config.transfer) = (shape, transfer);
        config.groups[0].fill = points_fill(vec![[at; 2]]);
        config.groups[0].fields.stress = Some(["1", "1", "0", "0"].map(String::from));
        strained(&mut config, StressUpdate::Usl);
        let of = |share| growth(&config, share, &|_| Vec::new());
        assert!(of(0.99) < 1.0, "{transfer:?} {shape:?}: {}", of(0.99));
        assert!(of(1.05) > 1e6, "{transfer:?} {shape:?}: {}", of(1.05));
    }
}

/// A drop of which viscosity makes the limit, on linear hats: without it in their bound it flew apart.
#[test]
fn a_viscous_drop_on_hats_is_stable_within_its_limit() {
    for update in [StressUpdate::Usf, StressUpdate::Usavg] {
        let mut config = block();
        (config.shape, config.transfer) = (ShapeFunction::Linear, Transfer::Flip);
        config.materials[0].model = MaterialModel::Fluid {
            bulk_modulus: 1e5,
            exponent: 7.0,
            viscosity: 1e3,
        };
        let field = ["1e-6*cos(62*x)", "1e-6*sin(62*y+x)"].map(String::from);
        config.groups[0].fields.velocity = Some(field);
        strained(&mut config, update);
        let grown = growth(&config, 0.99, &|_| Vec::new());
        assert!(grown < 1.1, "{update:?}: {grown}");
    }
}

/// Springs on some points of a soft block: with USL they give way at 0.9 of what other schemes bear.
#[test]
fn contact_is_stable_within_its_limit_with_every_stress_update() {
    for update in [StressUpdate::Usf, StressUpdate::Usl] {
        let mut config = block();
        config.transfer = Transfer::Flip;
        config.materials[0].model = elastic_model(1e-2, 1e-2);
        let field = ["1e-6*cos(62*x)", "1e-6*sin(62*y+x)"].map(String::from);
        config.groups[0].fields.velocity = Some(field);
        strained(&mut config, update);
        let points = configured(&config).points();
        for every in [1, 3, 7] {
            let forces = |mpm: &Mpm| {
                let pairs = mpm.points().into_iter().zip(&points).enumerate();
                let spring = |(i, (now, start)): (usize, (_, &PointState))| {
                    let now: PointState = now;
                    let stiffness = if i % every == 0 { 1e5 } else { 0.0 };
                    let force = [0, 1].map(|a| stiffness * (start.position[a] - now.position[a]));
                    ImpForce {
                        force,
                        stiffness,
                        ..ImpForce::default()
                    }
                };
                pairs.map(spring).collect()
            };
            let grown = growth(&config, 0.99, &forces);
            assert!(grown < 1.1, "{update:?}, every {every}: {grown}");
        }
    }
}
