//! Friction of a chain on a disc: one spring across for each stretch of the chain that presses.
//!
//! A disc meets a stretch of chain at minima of the distance, less the maxima between them ([`crate::contact::chain`]). Of the normal
//! springs that is right: the sum of the minima's energies less the maxima's is an energy, and the forces are its gradient.
//! Friction has no energy of which a part could be taken back. With a spring across at each minimum and maximum, one at a maximum
//! has the stiffness `-k_t`, and where it slips, which it does first, since it presses least, it gives `mu F` times the slip. So a
//! dented chain that is dragged to and fro under a disc drives it.
//!
//! A stretch is one contact, and so has one spring across, of elongation `xi`. Let `w_i` be shares of the minima, each at least 0, their sum
//! 1, and `u_i` what the surfaces have moved across at each. With
//!
//! ```text
//! u   = sum w_i u_i                 what the stretch has moved
//! f_i = -w_i k_t xi T_i             force at a minimum
//! |k_t xi| <= mu N                  N = sum of minima of F_n - sum of maxima of F_n
//! ```
//!
//! the work of all forces is `sum f_i . u_i T_i = -k_t xi u`, that of one spring which the law of one contact cuts to what friction
//! carries. So nothing can be gained, whatever the shares are and however they change. `N` is at least the force of the deepest minimum,
//! because a maximum has less overlap than either minimum beside it: go from the deepest outward, and take each maximum with
//! the minimum behind it. By convexity `k_t u^2 <= sum w_i k_t u_i^2`, so the bound of the step (F-6), which counts each
//! minimum by itself, holds for the shared spring too. What dashpots do goes the same way.
//!
//! The shares are those of the normal forces, `w_i = F_i / sum F_j`. On a flat chain, and wherever there is one minimum, all of this is the law
//! of one contact. When a minimum comes or goes, the shares change at once; the force keeps its size and moves over by a part of the
//! angle of the corner.
//!
//! From step to step each minimum that pressed hands its part of the spring to the stretch that has come nearest to it
//! ([`Handed::hand_on`]). A spring that parts goes to each stretch by the part `p` of the force of its minima that go there: the force
//! goes on, the energy falls from 1 to `sum p^2`. Stretches that join have the mean of their springs by the forces that they bring, `q`. Both together:
//! `xi' = sum q p xi`, for which `sum xi'^2 <= sum xi^2`, so a spring gives nothing away that it did not hold. What is
//! missing is lost to friction, and booked. To add the elongations of stretches that join would keep the force, and could double the energy.

use interface::Vec2;

use crate::contact::chain::Extremum;
use crate::law::history::Numbers;

/// A minimum of the distance that pressed in the last step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// The disc.
    pub body: u32,
    /// Its place in the outline of the body.
    pub part: u32,
    /// Identities of the markers between which it was.
    pub ids: [u64; 2],
    /// Share of the second.
    pub s: f64,
    /// Force of its normal spring in N/m, by which it has its share.
    pub force: f64,
    /// The spring of its stretch.
    pub spring: u32,
}

/// What stretches remember: minima, and the springs that these share.
#[derive(Debug, Default)]
pub struct Memory<H> {
    /// In the order of discs, and for each of its stretches.
    pub held: Vec<Held>,
    /// One for each stretch that pressed.
    pub springs: Vec<H>,
}

impl<H> Memory<H> {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.held.clear();
        self.springs.clear();
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.held.capacity() * size_of::<Held>() + self.springs.capacity() * size_of::<H>()
    }
}

/// An extremum of the distance of a disc as contact sees it.
#[derive(Debug)]
pub struct Place<P> {
    /// Where.
    pub e: Extremum,
    /// In m.
    pub overlap: f64,
    /// From the disc to the chain.
    pub normal: Vec2,
    /// The normal turned by +90 degrees.
    pub tangent: Vec2,
    /// From the body's centre of mass to the contact in m.
    pub r: Vec2,
    /// The centre of mass in m.
    pub center: Vec2,
    /// Moments of unit forces along the normal and across in m.
    pub arms: [f64; 2],
    /// Of the law.
    pub constants: P,
    /// Force of the normal spring and pull of adhesion in N/m; 0 where it does not press.
    pub elastic: [f64; 2],
}

impl<P> Place<P> {
    /// What it counts: a maximum less than nothing.
    pub fn sign(&self) -> f64 {
        if self.e.least { 1.0 } else { -1.0 }
    }
}

/// What a disc's stretches go on from. It is kept from disc to disc, so that no step allocates.
#[derive(Debug, Default)]
pub struct Handed<H> {
    /// For each stretch.
    pub histories: Vec<H>,
    /// Springs that have ended, parted or joined, each with a minimum (of those given) that had part in it: they count once.
    pub ended: Vec<(usize, H)>,
    /// Springs that came of these, likewise: they count once less.
    pub begun: Vec<(usize, H)>,
    flows: Vec<Flow>,
    /// Numbers of a memory, and the sum of several.
    numbers: [Vec<f64>; 2],
}

/// A part of a spring that goes to a stretch.
#[derive(Debug)]
struct Flow {
    spring: u32,
    stretch: usize,
    /// Force in N/m of the minima that go there.
    force: f64,
    /// One of them.
    from: usize,
}

impl<H: Numbers> Handed<H> {
    /// Hands the springs of minima that pressed to `stretches` stretches; `heirs` has where each minimum has gone, if
    /// anywhere. Minima that have gone nowhere leave their part to the others of their spring.
    pub fn hand_on(
        &mut self,
        held: &[Held],
        springs: &[H],
        heirs: &[Option<usize>],
        stretches: usize,
    ) {
        let Self {
            histories,
            ended,
            begun,
            flows,
            numbers,
        } = self;
        ended.clear();
        begun.clear();
        histories.clear();
        histories.resize(stretches, H::default());
        part(held, heirs, flows);
        let of = |spring: u32| springs[spring as usize];
        let sum = |wanted: &dyn Fn(&Flow) -> bool| -> f64 {
            let flows = flows.iter().filter(|&f| wanted(f));
            flows.map(|f| f.force).sum()
        };
        // A spring that goes to one stretch, and no other with it.
        let whole = |flow: &Flow| {
            let others = |f: &&Flow| f.spring == flow.spring || f.stretch == flow.stretch;
            flows.iter().filter(others).count() == 1
        };
        for (stretch, history) in histories.iter_mut().enumerate() {
            let parents = || flows.iter().filter(move |f| f.stretch == stretch);
            let Some(first) = parents().next() else {
                continue;
            };
            if whole(first) {
                *history = of(first.spring);
                continue;
            }
            let brought = sum(&|f| f.stretch == stretch);
            let parts = parents().map(|f| {
                let part = f.force / sum(&|other| other.spring == f.spring);
                (part * (f.force / brought), of(f.spring))
            });
            *history = blend(parts, numbers);
            begun.push((first.from, *history));
        }
        let mut from = 0;
        for minima in held.chunk_by(|a, b| a.spring == b.spring) {
            let spring = minima[0].spring;
            if !flows.iter().any(|f| f.spring == spring && whole(f)) {
                ended.push((from, of(spring)));
            }
            from += minima.len();
        }
    }
}

/// The parts of the springs of minima, and the stretches to which they go.
fn part(held: &[Held], heirs: &[Option<usize>], flows: &mut Vec<Flow>) {
    flows.clear();
    for (from, (minimum, heir)) in held.iter().zip(heirs).enumerate() {
        let Some(stretch) = *heir else { continue };
        let (spring, force) = (minimum.spring, minimum.force);
        let same = |f: &&mut Flow| f.spring == spring && f.stretch == stretch;
        match flows.iter_mut().find(same) {
            Some(flow) => flow.force += force,
            None => flows.push(Flow {
                spring,
                stretch,
                force,
                from,
            }),
        }
    }
}

/// The sum of memories, each times a factor. The energy of a spring is of second degree in what is remembered where its stiffness is
/// constant, and of first degree where force and stiffness are remembered: for factors `q p` neither grows.
fn blend<H: Numbers>(
    parts: impl Iterator<Item = (f64, H)>,
    [numbers, sum]: &mut [Vec<f64>; 2],
) -> H {
    sum.clear();
    sum.resize(H::COUNT, 0.0);
    for (factor, history) in parts {
        numbers.clear();
        history.put(numbers);
        for (sum, x) in sum.iter_mut().zip(&*numbers) {
            *sum += factor * x;
        }
    }
    H::take(&mut sum.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::tangent::{Coulomb, Elongation, Mindlin, Sheared, Tangent};

    fn hand_on<H: Numbers>(
        held: &[Held],
        springs: &[H],
        heirs: &[Option<usize>],
        stretches: usize,
    ) -> Handed<H> {
        let mut handed = Handed::default();
        handed.hand_on(held, springs, heirs, stretches);
        handed
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
    fn a_spring_that_goes_on_alone_is_the_same_to_the_bit() {
        let minima = [held(0, 3.0), held(0, 0.1), held(1, 7.0)];
        let springs = [Elongation(0.1), Elongation(-0.7)];
        // One minimum of the first has gone.
        let handed = hand_on(&minima, &springs, &[Some(2), None, Some(0)], 3);
        let expected = [-0.7, 0.0, 0.1].map(Elongation);
        assert_eq!(handed.histories, expected);
        assert!(handed.ended.is_empty() && handed.begun.is_empty());
        // All minima of the second have.
        let handed = hand_on(&minima, &springs, &[Some(0), Some(0), None], 1);
        assert_eq!(handed.histories, [Elongation(0.1)]);
        assert_eq!(handed.ended, [(2, Elongation(-0.7))]);
        assert!(handed.begun.is_empty());
    }

    #[test]
    fn a_spring_that_parts_keeps_its_force() {
        let minima = [held(0, 3.0), held(0, 1.0)];
        let handed = hand_on(&minima, &[Elongation(0.8)], &[Some(0), Some(1)], 2);
        let found = handed.histories.iter().map(|e| e.0);
        assert!(found.zip([0.6, 0.2]).all(|(a, b)| (a - b).abs() < 1e-15));
        assert_eq!((handed.ended.len(), handed.begun.len()), (1, 2));
    }

    /// Whatever parts and joins, springs hold no more than before, be they of constant stiffness or of one that follows the load.
    #[test]
    fn no_handing_on_gives_energy() {
        let mut seed = 1_u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / (1_u64 << 31) as f64
        };
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
            let heirs: Vec<Option<usize>> = minima
                .iter()
                .map(|_| Some((random() * 4.0) as usize).filter(|&s| s < 3))
                .collect();
            let n = spring as usize + 1;
            let a: Vec<Elongation> = (0..n).map(|_| Elongation(random() - 0.5)).collect();
            let b: Vec<Sheared> = (0..n)
                .map(|_| Sheared {
                    force: random() - 0.5,
                    stiffness: 0.1 + random(),
                })
                .collect();
            let (after_a, after_b) = (
                hand_on(&minima, &a, &heirs, 3),
                hand_on(&minima, &b, &heirs, 3),
            );
            let sum_a = |all: &[Elongation]| all.iter().map(|e| constant.energy(e)).sum::<f64>();
            let sum_b = |all: &[Sheared]| all.iter().map(|e| following.energy(e)).sum::<f64>();
            assert!(sum_a(&after_a.histories) <= sum_a(&a) + 1e-15);
            assert!(sum_b(&after_b.histories) <= sum_b(&b) + 1e-15);
            // What ended less what began is what is missing.
            let lost = |all: &[(usize, Elongation)]| {
                let of = all.iter().map(|(_, e)| constant.energy(e));
                of.sum::<f64>()
            };
            let missing = sum_a(&a) - sum_a(&after_a.histories);
            let told = lost(&after_a.ended) - lost(&after_a.begun);
            assert!((missing - told).abs() < 1e-14);
        }
    }
}
