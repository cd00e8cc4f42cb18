//! Springs, friction and what laws remember, one contact at a time.

use dem_proc::body::surfaces::Surfaces;
use dem_proc::law::contact::Contact;
use dem_proc::law::dashpot::{Drag, Viscous};
use dem_proc::law::history::{All, Numbers, Part};
use dem_proc::law::mixed::AnyLaw;
use dem_proc::law::normal::{Adhesive, Area, Linear, Normal};
use dem_proc::law::rolling::Rolling;
use dem_proc::law::table::Table;
use dem_proc::law::tangent::{Coulomb, Elongation, Mindlin, Sheared, Tangent};
use dem_proc::law::{Kinematics, Law, PairProperties};
use interface::config::DemConfig;

#[test]
fn the_area_of_a_half_sunk_disc_is_half_a_disc() {
    let law = Area { stiffness: 1.0 };
    let half = law.force(&0.5, 0.5);
    assert!((half - 0.5 * std::f64::consts::PI * 0.25).abs() < 1e-15);
    assert!((law.force(&0.5, 1.0) - std::f64::consts::PI * 0.25).abs() < 1e-15);
}

/// Forces, losses and energies, with the contact sticking, slipping and separating.
#[test]
fn both_springs_are_one_at_a_constant_stiffness() {
    let (k_n, ratio, friction) = (4e4, 0.75, 0.3);
    let by_force = Mindlin { ratio, friction };
    let by_length = Coulomb::new(ratio * k_n, friction);
    let k_t = by_force.stiffness(k_n);
    assert_eq!(k_t, by_length.stiffness(k_n));
    let (mut sheared, mut elongation) = (Sheared::default(), Elongation::default());
    let [mut slips, mut sticks] = [0; 2];
    for n in 0..200 {
        let n = f64::from(n);
        let pressing = 50.0 + 20.0 * (0.11 * n).sin();
        let (moved, dashpot) = (3e-4 * (0.3 * n).sin(), 2.0 * (0.7 * n).cos());
        let opened = [
            by_force.separate(moved, &sheared),
            by_length.separate(moved, &elongation),
        ];
        let a = by_force.slide(k_t, pressing, dashpot, moved, &sheared);
        let b = by_length.slide(k_t, pressing, dashpot, moved, &elongation);
        (sheared, elongation) = (a.state, b.state);
        let stored = [by_force.energy(&sheared), by_length.energy(&elongation)];
        for ([a, b], size) in [
            ([a.spring, b.spring], 20.0),
            ([a.dashpot, b.dashpot], 20.0),
            ([a.loss, b.loss], 1e-2),
            (opened, 1e-2),
            (stored, 1e-2),
        ] {
            assert!((a - b).abs() < 1e-13 * size, "{n}: {a} {b}");
        }
        if a.loss > 1e-6 {
            slips += 1;
        } else {
            sticks += 1;
        }
    }
    assert!(slips > 20 && sticks > 20, "{slips} {sticks}");
}

/// A contact of grains that has slid by `u` and rolled by `theta` holds `k_t u^2 / 2 + k_r theta^2 / 2` beside the normal
/// spring. If it opens while the moment still does the work `M / 2` times the last angle, the rest is lost.
#[test]
fn a_contact_that_has_slid_and_rolled_loses_its_springs_when_it_opens() {
    let (k_n, k_t, mu_r, radius) = (1e5, 5e4, 0.2, 0.1);
    let law = Rolling {
        law: Contact {
            normal: Adhesive {
                spring: Linear { stiffness: k_n },
                stress: 0.0,
            },
            tangent: Coulomb::new(k_t, 0.5),
            dashpot: Viscous {
                ratio: 0.0,
                mass: 0.0,
            },
        },
        friction: mu_r,
    };
    let config = DemConfig::default();
    let surfaces = Surfaces::new(&config);
    let mixed = Table::new(&surfaces, &config.point_contact, &[], |_| {
        AnyLaw::Grains(law)
    });
    let pair = mixed.pair(&PairProperties {
        mass: 1.0,
        radius,
        surfaces: [0; 2],
    });
    let (overlap, u, theta, last) = (0.05, 1e-5, 0.3_f64, 0.2_f64);
    let pressed = Kinematics {
        overlap,
        moved: [0.0, u],
        sines: [theta.sin(), 0.0],
        ..Kinematics::default()
    };
    let response = mixed.response(&pair, &pressed, &All::default());
    let k_r = 2.25 * k_n * (mu_r * radius) * (mu_r * radius);
    let held = 0.5 * k_t * u * u + 0.5 * k_r * theta * theta;
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * b.abs(), "{a} {b}");
    near(response.moment, -k_r * theta);
    assert!(response.loss.friction.abs() < 1e-12 * held);
    let energy = mixed.energy(&pair, overlap, &response.history);
    near(energy, 0.5 * k_n * overlap * overlap + held);
    let opened = Kinematics {
        overlap: -1e-6,
        moved: [1e-3, 0.0],
        sines: [0.0, -last.sin()],
        ..Kinematics::default()
    };
    let loss = mixed.separate(&pair, &opened, &response.history);
    near(loss.friction, held + 0.5 * k_r * theta * last);
    assert_eq!(loss.viscous, 0.0);
}

#[test]
fn what_two_laws_both_remember_goes_over() {
    let before: (Elongation, Drag) = (Part([3.0]), Part([4.0, 5.0]));
    assert_eq!(<(Elongation, Drag)>::of(&All::of(&before)), before);
    assert_eq!(Elongation::of(&before), before.0);
    assert_eq!(Drag::of(&before), before.1);
    // A tangential spring with two numbers belongs to another law.
    assert_eq!(<(Sheared, Drag)>::of(&before), (Part([0.0; 2]), before.1));
}
