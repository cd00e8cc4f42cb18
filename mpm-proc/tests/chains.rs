//! Boundary chains: weights, forces, bounds and ways of markers, against plain matrices and closed forms.

use interface::config::{
    Chain, Interface, MpmConfig, ShapeFunction, Spacing, StressUpdate, Transfer,
};
use interface::message::wire::{EnvelopeVertex, ImpForce};
use interface::solver::{Fault, MpmSolver};
use nalgebra::DMatrix;

use crate::blocks::{Random, Stepper, block, configured, everywhere, points_fill};
use crate::limits::{largest_eigenvalue, matrices, nodes, opening};
use crate::saved::goes_on;
use mechanics::reference::Kernel;

const DENSITY: f64 = 1000.0;
const CELL: f64 = 0.05;

/// Markers round a rectangle, counter-clockwise, with `n` segments a side.
fn round(lower: [f64; 2], upper: [f64; 2], n: usize) -> Vec<[f64; 2]> {
    let corners = [lower, [upper[0], lower[1]], upper, [lower[0], upper[1]]];
    let side = |c: usize| {
        let (a, b) = (corners[c], corners[(c + 1) % 4]);
        (0..n).map(move |i| {
            let t = i as f64 / n as f64;
            [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
        })
    };
    (0..4).flat_map(side).collect()
}

/// The block of the other tests with a chain round it.
fn chained(floor: f64) -> MpmConfig {
    let mut config = block();
    config.interface = Interface::Segments;
    config.chains = vec![Chain {
        group: 0,
        markers: round([0.105, 0.305], [0.395, 0.495], 12),
        closed: true,
        floor,
    }];
    config
}

/// `N` (markers x nodes) as the text has it, and the masses of the nodes.
fn plain_weights(config: &MpmConfig, positions: &[[f64; 2]], kernel: Kernel) -> [DMatrix<f64>; 2] {
    let chain = &config.chains[0];
    let both: Vec<[f64; 2]> = positions.iter().chain(&chain.markers).copied().collect();
    let [s, _, _] = matrices(&both, kernel, config.domain[0]);
    let count = positions.len();
    let volume = config.groups[0].box_sides(CELL).iter().product::<f64>();
    let of_points = s.rows(0, count);
    let mass = of_points.row_sum() * (DENSITY * volume);
    let of_markers = s.rows(count, chain.markers.len());
    let full = chain.floor * DENSITY * CELL * CELL;
    let mut n = DMatrix::from_fn(of_markers.nrows(), of_markers.ncols(), |b, i| {
        of_markers[(b, i)] * (mass[i] / full).min(1.0)
    });
    for mut row in n.row_iter_mut() {
        let sum = row.sum();
        row /= sum;
    }
    [n, DMatrix::from_row_slice(1, mass.len(), mass.as_slice())]
}

/// What a marker has at a node: `N`, and `g` along x and y.
type Row = Vec<[f64; 3]>;

/// `N` and `g` of the markers at all nodes as the text has them, and the moments of their weights: `sum N x - x_b` in m, and how
/// much of a couple the nodes get.
fn plain_rows(
    config: &MpmConfig,
    positions: &[[f64; 2]],
    kernel: Kernel,
) -> Vec<(Row, [f64; 2], f64)> {
    let [n, _] = plain_weights(config, positions, kernel);
    let markers = &config.chains[0].markers;
    let both: Vec<[f64; 2]> = positions.iter().chain(markers).copied().collect();
    let nodes = nodes(&both, kernel, config.domain[0]);
    let nodes = nodes
        .iter()
        .map(|x| [0, 1].map(|a| config.domain[0][a] + CELL * x[a]));
    let nodes: Vec<[f64; 2]> = nodes.collect();
    let of_marker = |b: usize| {
        let mean = |of: &dyn Fn(usize) -> f64| -> f64 {
            (0..nodes.len()).map(|i| n[(b, i)] * of(i)).sum()
        };
        let middle = [0, 1].map(|a| mean(&|i| nodes[i][a]));
        let away = |i: usize, a: usize| nodes[i][a] - middle[a];
        let spread = mean(&|i| away(i, 0).powi(2) + away(i, 1).powi(2));
        let inertia = spread.max(0.1 * CELL * CELL);
        let row = (0..nodes.len()).map(|i| {
            let per_inertia = n[(b, i)] / inertia;
            [
                n[(b, i)],
                -away(i, 1) * per_inertia,
                away(i, 0) * per_inertia,
            ]
        });
        let shift = [0, 1].map(|a| middle[a] - markers[b][a]);
        (row.collect(), shift, spread / inertia)
    };
    (0..markers.len()).map(of_marker).collect()
}

pub const KERNELS: [(ShapeFunction, Kernel, Transfer); 3] = [
    (
        ShapeFunction::QuadraticBspline,
        Kernel::Quadratic,
        Transfer::Apic,
    ),
    (ShapeFunction::CubicBspline, Kernel::Cubic, Transfer::Apic),
    (ShapeFunction::Ugimp, Kernel::Ugimp(0.25), Transfer::Flip),
];

/// Points at random, and markers at random among and around them.
fn scattered(seed: u64, floor: f64) -> (MpmConfig, Vec<[f64; 2]>) {
    let mut random = Random::new(seed);
    let mut config = block();
    let mut somewhere = |n: usize, around: f64| -> Vec<[f64; 2]> {
        let mut along = |a: f64| random.between(a - around, a + 0.1 + around);
        (0..n).map(|_| [along(0.2), along(0.3)]).collect()
    };
    let positions = somewhere(20, 0.0);
    config.groups[0].fill = points_fill(positions.clone());
    config.groups[0].spacing = Spacing::Distance(0.025);
    config.interface = Interface::Segments;
    config.chains = vec![Chain {
        group: 0,
        markers: somewhere(9, 0.01),
        closed: false,
        floor,
    }];
    (config, positions)
}

#[test]
fn the_bound_of_the_step_holds_for_the_eigenvalues_of_random_chains() {
    for (shape, kernel, transfer) in KERNELS {
        for seed in 0..12 {
            let floor = [1.0, 0.1, 1e-2, 1e-4][seed as usize % 4];
            let (mut config, positions) = scattered(seed, floor);
            (config.shape, config.transfer) = (shape, transfer);
            let mut random = Random::new(100 + seed);
            // Without friction, and with contact radii up to the size of a cell.
            let radius = CELL * [0.0, 0.25, 0.5, 1.0][seed as usize / 3];
            config.groups[0].contact_radius = (radius > 0.0).then_some(radius);
            let forces: Vec<ImpForce> = (0..9)
                .map(|_| {
                    let stiffness = random.between(1e4, 1e6);
                    let ratio = if radius > 0.0 { 1.5 } else { 0.0 };
                    ImpForce {
                        stiffness,
                        tangential: random.between(0.0, ratio) * stiffness,
                        ..ImpForce::default()
                    }
                })
                .collect();
            let limits = opening(&config, &forces);
            let [_, mass] = plain_weights(&config, &positions, kernel);
            // A row for the normal and one for the surface of each marker.
            let mut scaled = DMatrix::zeros(18, 2 * mass.len());
            for (b, (of_marker, ..)) in plain_rows(&config, &positions, kernel).iter().enumerate() {
                let (sin, cos) = random.between(0.0, 6.3).sin_cos();
                let [k, k_t] = [forces[b].stiffness, forces[b].tangential].map(f64::sqrt);
                for (i, &[n, gx, gy]) in of_marker.iter().enumerate() {
                    let root = if mass[i] > 0.0 {
                        mass[i].sqrt().recip()
                    } else {
                        0.0
                    };
                    let surface = [-sin * n - radius * gx, cos * n - radius * gy];
                    for (a, along) in [cos, sin].into_iter().enumerate() {
                        scaled[(2 * b, 2 * i + a)] = k * root * along * n;
                        scaled[(2 * b + 1, 2 * i + a)] = k_t * root * surface[a];
                    }
                }
            }
            let exact = largest_eigenvalue(&(&scaled * scaled.transpose()));
            let bound = limits.contact_omega_sq;
            assert!(
                exact <= bound * (1.0 + 1e-9),
                "{shape:?} {seed}: {exact} {bound}"
            );
            assert!(exact > 0.05 * bound, "{shape:?} {seed}: {exact} {bound}");
        }
    }
}

/// At a corner of a cloud the nodes outside are nearly empty. Without the floor one marker there has as much as it pleases of
/// the frequency; with it no more than `1 / (eta rho L^2 sum N*)`.
#[test]
fn the_floor_bounds_what_a_marker_at_a_nearly_empty_node_costs() {
    let omega_sq = |floor: f64, tangential: f64| {
        let mut config = block();
        config.transfer = Transfer::Flip;
        config.groups[0].fill = points_fill(vec![[0.3 - 1e-4, 0.4 - 1e-4]]);
        config.groups[0].spacing = Spacing::Distance(0.025);
        config.shape = ShapeFunction::Linear;
        config.interface = Interface::Segments;
        config.chains = vec![Chain {
            group: 0,
            markers: vec![[0.26, 0.36], [0.27, 0.36]],
            closed: false,
            floor,
        }];
        let pressed = ImpForce {
            force: [0.0; 2],
            stiffness: 1e4,
            tangential,
            ..ImpForce::default()
        };
        opening(&config, &[pressed; 2]).contact_omega_sq
    };
    for tangential in [0.0, 1e4] {
        let [high, low] = [0.1, 1e-12].map(|floor| omega_sq(floor, tangential));
        assert!(low > 100.0 * high, "{low} {high}");
    }
    let [plain, rough] = [0.0, 1e4].map(|tangential| omega_sq(0.1, tangential));
    assert!(rough < 10.0 * plain, "{rough} {plain}");
}

/// Momentum of a kick is the impulse of the forces, and what the weights add to the angular momentum that of plain sums.
#[test]
fn a_force_on_a_marker_gives_the_nodes_its_whole_momentum() {
    for (shape, kernel, transfer) in KERNELS {
        let mut config = chained(0.1);
        (config.shape, config.transfer) = (shape, transfer);
        config.stress_update = StressUpdate::Usl;
        let mut mpm = configured(&config);
        let count = mpm.select_imps(&everywhere()).len();
        assert_eq!(count, 48);
        let mut random = Random::new(3);
        let forces: Vec<ImpForce> = (0..count)
            .map(|_| ImpForce {
                force: [0, 1].map(|_| random.between(-50.0, 50.0)),
                couple: random.between(-1.0, 1.0),
                stiffness: 1e4,
                tangential: 1e4,
            })
            .collect();
        let mut stepper = Stepper::new();
        let positions: Vec<[f64; 2]> = mpm.points().iter().map(|p| p.position).collect();
        stepper
            .step(&mut mpm, 2e-4, true, &forces)
            .expect("a sound step");
        let measured = mpm.measurement();
        let (ledger, chain) = (measured.ledger, measured.groups[1]);
        for a in 0..2 {
            let total: f64 = forces.iter().map(|f| f.force[a]).sum();
            assert!((ledger.momentum[a] - 1e-4 * total).abs() < 1e-14 * 50.0 * 48.0 * 1e-4);
            assert!((chain.contact_force[a] - total).abs() < 1e-11);
        }
        let rows = plain_rows(&config, &positions, kernel);
        let added = rows.iter().zip(&forces).map(|((_, shift, whole), f)| {
            shift[0] * f.force[1] - shift[1] * f.force[0] + (whole - 1.0) * f.couple
        });
        let expected: f64 = added.sum();
        let speed_sq = chain.kinetic / 1e-4;
        assert!(
            (speed_sq - expected).abs() < 1e-6 * expected.abs(),
            "{speed_sq} {expected}"
        );
        // FLIP changes angular momentum by itself.
        if transfer == Transfer::Apic {
            let given = ledger.contact_moment + chain.kinetic;
            let off = (ledger.angular_momentum - given).abs();
            assert!(off < 1e-12 * 1e-4 * 50.0 * 48.0, "{off}");
        }
    }
}

/// Hats have all their weight on one node if a marker lies on it: it takes no couple, which is reported.
#[test]
fn a_couple_on_a_single_node_is_told_to_be_lost() {
    let mut config = chained(0.1);
    (config.shape, config.transfer) = (ShapeFunction::Linear, Transfer::Flip);
    config.chains[0].markers = vec![[0.25, 0.4], [0.25, 0.45]];
    config.chains[0].closed = false;
    let mut mpm = configured(&config);
    let set = mpm.select_imps(&everywhere());
    assert_eq!(set.len(), 2);
    let turned = ImpForce {
        couple: 3.0,
        stiffness: 1.0,
        tangential: 1.0,
        ..ImpForce::default()
    };
    let forces = [turned, ImpForce::default()];
    let mut stepper = Stepper::new();
    stepper.step(&mut mpm, 2e-4, true, &forces).unwrap();
    let measured = mpm.measurement();
    let (ledger, chain) = (measured.ledger, measured.groups[1]);
    assert!((chain.kinetic / (-3.0 * 1e-4) - 1.0).abs() < 1e-9);
    assert!(ledger.angular_momentum.abs() < 1e-9 * 3e-4);
    assert!((ledger.contact_moment / 3e-4 - 1.0).abs() < 1e-12);
}

/// Markers of a block that turns, wherever they lie in the cells, say its spin where they rub, and nothing elsewhere.
#[test]
fn markers_turn_with_their_material() {
    for (shape, _, _) in KERNELS {
        let mut config = chained(0.1);
        (config.shape, config.transfer) = (shape, Transfer::Flip);
        config.groups[0].keeps_spin = true;
        let field = ["0.3 - 2*(y - 0.4)", "-0.2 + 2*(x - 0.25)"];
        config.groups[0].fields.velocity = Some(field.map(str::to_owned));
        let mut mpm = configured(&config);
        let count = mpm.select_imps(&everywhere()).len();
        let mut forces = vec![ImpForce::default(); count];
        for force in forces.iter_mut().step_by(3) {
            (force.stiffness, force.tangential) = (1.0, 1.0);
        }
        Stepper::new().step(&mut mpm, 1e-6, false, &forces).unwrap();
        for (state, force) in mpm.imp_states().iter().zip(&forces) {
            let expected = if force.tangential > 0.0 { 2.0 } else { 0.0 };
            assert!((state.spin - expected).abs() < 1e-9, "{state:?}");
        }
    }
}

/// All markers of a body that flies and turns stay where they are in it.
#[test]
fn markers_go_with_their_material() {
    for shift in [[0.7, -0.3], [0.0, 0.0]] {
        let mut config = chained(1e-3);
        config.groups[0].velocity = shift;
        let mut mpm = configured(&config);
        let before: Vec<[f64; 2]> = config.chains[0].markers.clone();
        Stepper::new().run(&mut mpm, 2e-4, 300);
        mpm.select_imps(&everywhere());
        let states = mpm.imp_states();
        for (state, x) in states.iter().zip(&before) {
            for a in 0..2 {
                let gone = state.position[a] - x[a];
                assert!((gone - 0.06 * shift[a]).abs() < 1e-12, "{gone}");
                assert!((state.velocity[a] - shift[a]).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn both_ends_of_every_segment_near_a_body_are_in_the_set_and_linked() {
    let config = chained(0.1);
    let mut mpm = configured(&config);
    let points = mpm.points().len() as u64;
    // A disc under the middle of the lowest side, whose third to fifth segment is near.
    let disc = |x: f64, y: f64, reach: f64| {
        [EnvelopeVertex {
            body: 0,
            position: [x, y],
            reach,
        }]
    };
    let segment = 0.29 / 12.0;
    let reach = 0.1 - config.skin - 0.0125;
    let middle = 0.105 + 4.5 * segment;
    let set = mpm
        .select_imps(&disc(middle, 0.305 - 0.1 + 1e-6, reach))
        .to_vec();
    let ids: Vec<u64> = set.iter().map(|i| i.id - points).collect();
    assert_eq!(ids, [4, 5], "a segment whose ends are out of reach");
    assert_eq!(set.iter().map(|i| i.next).collect::<Vec<_>>(), [2, 0]);
    assert!(
        set.iter()
            .all(|i| i.mass == DENSITY * CELL * CELL && i.radius == 0.0125)
    );
    // The last marker links to the first.
    let set = mpm.select_imps(&disc(0.105 - 0.05, 0.305, 0.06)).to_vec();
    let ids: Vec<u64> = set.iter().map(|i| i.id - points).collect();
    assert_eq!(ids.first(), Some(&0));
    let last = set.last().expect("a set");
    assert_eq!((last.id - points, last.next), (47, 1));
    assert!(mpm.select_imps(&disc(0.7, 0.8, 0.01)).is_empty());
    // A large body that holds all of it.
    assert_eq!(mpm.select_imps(&everywhere()).len(), 48);
    assert!(mpm.select_imps(&[]).is_empty());
}

#[test]
fn a_marker_without_material_is_named() {
    let mut config = chained(0.1);
    config.chains[0].markers[5] = [0.7, 0.8];
    let mut mpm = configured(&config);
    let fault = Stepper::new().step(&mut mpm, 1e-4, false, &[]);
    let Err(Fault::Other(text)) = fault else {
        panic!("{fault:?}");
    };
    assert!(
        text.contains("marker 5 of chain 0 at (0.7, 0.8) m"),
        "{text}"
    );
    // Where a little mass is, it stays with it.
    config.chains[0].markers[5] = [0.1 - 0.055, 0.4];
    let mut mpm = configured(&config);
    Stepper::new().run(&mut mpm, 1e-4, 10);
}

#[test]
fn chains_go_on_from_a_saved_state() {
    for update in ["usf", "musl", "usl"] {
        let mut config = crate::saved::flying();
        config.interface = Interface::Segments;
        config.stress_update = serde_json::from_value(update.into()).expect("a choice");
        config.chains = (0..config.groups.len())
            .map(|group| {
                let [lower, upper] = config.groups[group].fill.bounds();
                Chain {
                    group,
                    markers: round(lower, upper, 7),
                    closed: true,
                    floor: 0.05,
                }
            })
            .collect();
        let moments = goes_on(update, &config);
        assert!(moments.contains(&"after a selection"), "{moments:?}");
    }
}

/// The state of a chain has the mean position and velocity of its markers.
#[test]
fn a_chain_that_flies_is_measured_at_its_middle() {
    let mut config = chained(0.5);
    config.transfer = Transfer::Apic;
    config.groups[0].velocity = [0.3, -0.2];
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    stepper.run(&mut mpm, 2e-4, 3);
    stepper.step(&mut mpm, 2e-4, true, &[]).unwrap();
    let state = mpm.measurement().groups[1];
    for a in 0..2 {
        let v = [0.3, -0.2][a];
        let middle = [0.25, 0.4][a] + 6e-4 * v;
        let half = [0.145, 0.095][a];
        assert!((state.position[a] - middle).abs() < 1e-9, "{state:?}");
        assert!((state.velocity[a] - v).abs() < 1e-9, "{state:?}");
        assert!((state.lower[a] - middle + half).abs() < 1e-9, "{state:?}");
        assert!((state.upper[a] - middle - half).abs() < 1e-9, "{state:?}");
    }
}
