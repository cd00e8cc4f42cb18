//! How a contact force reaches the grid: momentum, and the step limit of each way.

use interface::config::{ContactForceScheme, Spacing};
use interface::message::wire::ImpForce;
use nalgebra::{DMatrix, DVector};

use crate::blocks::{Random, block, points_fill};
use crate::chains::KERNELS;
use crate::limits::{largest_eigenvalue, matrices_over, nodes, opening};
use mechanics::reference::Kernel;

const SCHEMES: [ContactForceScheme; 3] = [
    ContactForceScheme::Point,
    ContactForceScheme::NearestNodes,
    ContactForceScheme::Traction,
];

/// `sqrt(G(T) G(S))` is above the norm of contact's operator, and so above its spectral radius.
#[test]
fn the_limit_of_each_scheme_bounds_its_operator() {
    for scheme in SCHEMES {
        for (shape, kernel, transfer) in KERNELS {
            for seed in 0..9 {
                let mut random = Random::new(100 + seed);
                let mut config = block();
                config.contact_force = scheme;
                (config.shape, config.transfer) = (shape, transfer);
                let count = [1, 12, 40][seed as usize % 3];
                let positions: Vec<[f64; 2]> = (0..count)
                    .map(|_| [random.between(0.2, 0.4), random.between(0.3, 0.5)])
                    .collect();
                config.groups[0].fill = points_fill(positions.clone());
                config.groups[0].spacing = Spacing::Distance(0.025);
                let stiffness: Vec<f64> = (0..count)
                    .map(|i| {
                        if i % 3 == 1 {
                            0.0
                        } else {
                            random.between(1e4, 1e6)
                        }
                    })
                    .collect();
                let force = |&stiffness| ImpForce {
                    force: [0.0; 2],
                    stiffness,
                    ..ImpForce::default()
                };
                let forces: Vec<ImpForce> = stiffness.iter().map(force).collect();
                let limits = opening(&config, &forces);

                let scatter = match scheme {
                    ContactForceScheme::Point => kernel,
                    ContactForceScheme::NearestNodes => Kernel::Linear,
                    ContactForceScheme::Traction => Kernel::Ugimp(0.25),
                };
                let mass = 1000.0 * 0.025 * 0.025;
                let lower = config.domain[0];
                let reached = nodes(&positions, kernel, lower);
                let [s, t] = [kernel, scatter]
                    .map(|kernel| matrices_over(&reached, &positions, kernel, lower))
                    .map(|[weights, ..]| weights);
                let nodal: DVector<f64> = s.row_sum().transpose() * mass;
                let root = |m: &DMatrix<f64>| {
                    DMatrix::from_fn(count, m.ncols(), |p, i| {
                        stiffness[p].sqrt() * m[(p, i)] / nodal[i].sqrt()
                    })
                };
                let operator = root(&t).transpose() * root(&s);
                let norm = largest_eigenvalue(&(operator.transpose() * &operator)).sqrt();
                let bound = limits.contact_omega_sq;
                assert!(
                    norm <= bound * (1.0 + 1e-9),
                    "{scheme:?} {shape:?}: {norm} {bound}"
                );
                assert!(norm > 0.05 * bound, "{scheme:?} {shape:?}: {norm} {bound}");
                let lightest = (1.0 + 1e-9) / mass;
                assert!(limits.mobility <= lightest || scheme != ContactForceScheme::Point);
                if count == 1 {
                    // One point: the operator's only eigenvalue is k sum S T / m.
                    let eigenvalue = (root(&s) * root(&t).transpose())[(0, 0)];
                    assert!(eigenvalue <= bound * (1.0 + 1e-12));
                }
            }
        }
    }
}
