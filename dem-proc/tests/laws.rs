//! Springs of friction, one contact at a time.

use dem_proc::law::tangent::{Coulomb, Elongation, Mindlin, Sheared, Tangent};

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
