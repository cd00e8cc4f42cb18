//! Springs that part and join along a chain.

use dem_proc::contact::span::{Held, Transferred};
use dem_proc::law::history::{Numbers, Part};
use dem_proc::law::tangent::{Coulomb, Elongation, Mindlin, Sheared, Tangent};
use mechanics::generate::Random;

fn transfer<H: Numbers>(
    held: &[Held],
    springs: &[H],
    successors: &[Option<usize>],
    spans: usize,
) -> Transferred<H> {
    let mut transferred = Transferred::default();
    transferred.transfer(held, springs, successors, spans);
    transferred
}

fn held(spring: u32, force: f64) -> Held {
    Held {
        body: 0,
        part: 0,
        ids: [1, 2],
        s: 0.5,
        force,
        spring,
    }
}

#[test]
fn a_spring_that_continues_alone_is_the_same_to_the_bit() {
    let minima = [held(0, 3.0), held(0, 0.1), held(1, 7.0)];
    let springs: [Elongation; 2] = [Part([0.1]), Part([-0.7])];
    // One minimum of the first spring has disappeared.
    let transferred = transfer(&minima, &springs, &[Some(2), None, Some(0)], 3);
    let expected = [-0.7, 0.0, 0.1].map(|e| Part([e]));
    assert_eq!(transferred.histories, expected);
    assert!(transferred.ended.is_empty() && transferred.begun.is_empty());
    // All minima of the second spring have disappeared.
    let transferred = transfer(&minima, &springs, &[Some(0), Some(0), None], 1);
    assert_eq!(transferred.histories, [Part([0.1])]);
    assert_eq!(transferred.ended, [(2, Part([-0.7]))]);
    assert!(transferred.begun.is_empty());
}

#[test]
fn a_spring_that_parts_keeps_its_force() {
    let minima = [held(0, 3.0), held(0, 1.0)];
    let spring: Elongation = Part([0.8]);
    let transferred = transfer(&minima, &[spring], &[Some(0), Some(1)], 2);
    let found = transferred.histories.iter().map(|e| e.0[0]);
    assert!(found.zip([0.6, 0.2]).all(|(a, b)| (a - b).abs() < 1e-15));
    assert_eq!((transferred.ended.len(), transferred.begun.len()), (1, 2));
}

/// However springs are divided and joined, they hold no more energy than before, both with a constant stiffness and
/// with one that follows the load.
#[test]
fn no_transfer_gives_energy() {
    let mut numbers = Random::new(1);
    let mut random = move || numbers.unit();
    let (constant, following) = (
        Coulomb::new(2.0, 0.5),
        Mindlin {
            ratio: 0.8,
            friction: 0.5,
        },
    );
    for _ in 0..3000 {
        let count = 1 + (random() * 6.0) as usize;
        let mut spring = 0;
        let mut minima = vec![held(0, 1.0 + random())];
        for _ in 1..count {
            spring += u32::from(random() < 0.5);
            minima.push(held(spring, 1e-3 + random()));
        }
        let successors: Vec<Option<usize>> = minima
            .iter()
            .map(|_| Some((random() * 4.0) as usize).filter(|&s| s < 3))
            .collect();
        let n = spring as usize + 1;
        let a: Vec<Elongation> = (0..n).map(|_| Part([random() - 0.5])).collect();
        let b: Vec<Sheared> = (0..n)
            .map(|_| Part([random() - 0.5, 0.1 + random()]))
            .collect();
        let (after_a, after_b) = (
            transfer(&minima, &a, &successors, 3),
            transfer(&minima, &b, &successors, 3),
        );
        let sum_a = |all: &[Elongation]| all.iter().map(|e| constant.energy(e)).sum::<f64>();
        let sum_b = |all: &[Sheared]| all.iter().map(|e| following.energy(e)).sum::<f64>();
        assert!(sum_a(&after_a.histories) <= sum_a(&a) + 1e-15);
        assert!(sum_b(&after_b.histories) <= sum_b(&b) + 1e-15);
        // The energy that ended less the energy that began is the energy that was lost.
        let lost = |all: &[(usize, Elongation)]| {
            let of = all.iter().map(|(_, e)| constant.energy(e));
            of.sum::<f64>()
        };
        let missing = sum_a(&a) - sum_a(&after_a.histories);
        let reported = lost(&after_a.ended) - lost(&after_a.begun);
        assert!((missing - reported).abs() < 1e-14);
    }
}
