//! Friction of a chain on a disc: one tangential spring for each span of the chain that presses.
//!
//! A disc is in contact with a span of the chain at the minima of the distance, less the maxima between them
//! ([`crate::contact::chain`]). For the normal springs this is right: the sum of the energies at minima less that at
//! maxima is an energy, and the forces are its gradient. Friction has no energy from which a part could be subtracted.
//! With a tangential spring at each minimum and maximum, that at a maximum would have the stiffness `-k_t`. It would
//! slip first, since it presses least, and slipping would then supply the work `mu F` times the slip. So a chain with
//! reflex corners, dragged to and fro under a disc, would drive the disc.
//!
//! So a span is one contact with one tangential spring of elongation `xi`. Let `w_i` be shares of the minima, each
//! at least 0 and their sum 1. Let `u_i` be the tangential displacement of the surfaces at each minimum. With
//!
//! ```text
//! u   = sum w_i u_i                 displacement of the span
//! f_i = -w_i k_t xi T_i             force at a minimum
//! |k_t xi| <= mu N                  N = sum of minima of F_n - sum of maxima of F_n
//! ```
//!
//! the work of all forces is `sum f_i . u_i T_i = -k_t xi u`. This is the work of one spring that the law of a single
//! contact limits by friction. So no energy can be gained, for any shares and any change of them. `N` is at least the
//! force of the deepest minimum, because a maximum has less overlap than either minimum beside it: from the deepest
//! minimum outward, each maximum can be paired with the minimum after it. By convexity `k_t u^2 <= sum w_i k_t u_i^2`.
//! So the bound of the step (F-6), which counts each minimum by itself, holds for the shared spring too. The forces of
//! dashpots are divided in the same way.
//!
//! The shares are those of the normal forces, `w_i = F_i / sum F_j`. On a flat chain, and wherever there is one
//! minimum, this is the law of a single contact. When a minimum appears or disappears, the shares change at once. The
//! force keeps its size and turns by a part of the angle of the corner.
//!
//! From step to step each minimum that pressed passes its part of the spring to the span that has come nearest to it
//! ([`Transferred::transfer`]). If a spring is divided, each span gets the share `p` that its minima had in the
//! force. The force is kept, and the energy decreases from 1 to `sum p^2`. Spans that join have the mean of their
//! springs, weighted by the share `q` of the force that each contributes. Both together give `xi' = sum q p xi`, for
//! which `sum xi'^2 <= sum xi^2`, so springs never supply energy that they did not hold. The difference is lost to
//! friction, and counted. To add the elongations of spans that join would keep the force, but could double the
//! energy.

use interface::Vec2;
use serde::{Deserialize, Serialize};

use crate::contact::chain::Extremum;
use crate::law::history::All;

/// A minimum of the distance that pressed in the last step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// Ids of the two markers between which it was.
    pub ids: [u64; 2],
    /// Share of the second marker.
    pub s: f64,
    /// Force of its normal spring in N/m, from which its share follows.
    pub force: f64,
    /// The spring of its span.
    pub spring: u32,
}

/// The history of the spans that a disc presses on: the minima, and the springs that minima share.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Memory {
    /// In the order of the spans.
    pub held: Vec<Held>,
    /// One spring for each span that pressed.
    pub springs: Vec<All>,
}

impl Memory {
    /// Removes all entries.
    pub fn clear(&mut self) {
        self.held.clear();
        self.springs.clear();
    }
}

/// An extremum of the distance from a disc, with the data for the contact law.
#[derive(Debug)]
pub struct Place<P> {
    /// Where.
    pub e: Extremum,
    /// Overlap in m.
    pub overlap: f64,
    /// Unit normal, from the disc to the chain.
    pub normal: Vec2,
    /// The normal turned by +90 degrees.
    pub tangent: Vec2,
    /// From the body's centre of mass to the contact in m.
    pub r: Vec2,
    /// From the foot to the contact in m: `r_p - xi/2`.
    pub surface: f64,
    /// The centre of mass in m.
    pub center: Vec2,
    /// Moments in m of unit forces along the normal and the tangent.
    pub arms: [f64; 2],
    /// The constants of the law.
    pub constants: P,
    /// Force of the normal spring and pull of adhesion in N/m; 0 if it does not press.
    pub elastic: [f64; 2],
}

impl<P> Place<P> {
    /// 1 for a minimum, -1 for a maximum.
    pub fn sign(&self) -> f64 {
        if self.e.least { 1.0 } else { -1.0 }
    }
}

/// The histories with which the spans of a disc continue. It is kept from disc to disc, so that no step allocates.
#[derive(Debug, Default)]
pub struct Transferred {
    /// One for each span.
    pub histories: Vec<All>,
    /// Springs that have ended, were divided or joined. Each has the index of a minimum to which it belonged. Their
    /// energies count once.
    pub ended: Vec<(usize, All)>,
    /// The springs that they became, in the same form. Their energies are subtracted once.
    pub begun: Vec<(usize, All)>,
    flows: Vec<Flow>,
}

/// A part of a spring that goes to a span.
#[derive(Debug)]
struct Flow {
    spring: u32,
    span: usize,
    /// Force in N/m of the minima that go to the span.
    force: f64,
    /// Index of one of them.
    from: usize,
}

impl Transferred {
    /// Transfers the springs of minima that pressed to `spans` spans. `successors` has the span to which
    /// each minimum goes, if any. Minima that go to none leave their part to the others of their spring.
    pub fn transfer(
        &mut self,
        Memory { held, springs }: &Memory,
        successors: &[Option<usize>],
        spans: usize,
    ) {
        let Self {
            histories,
            ended,
            begun,
            flows,
        } = self;
        ended.clear();
        begun.clear();
        histories.clear();
        histories.resize(spans, All::default());
        part(held, successors, flows);
        let of = |spring: u32| springs[spring as usize];
        let sum = |wanted: &dyn Fn(&Flow) -> bool| -> f64 {
            let flows = flows.iter().filter(|&f| wanted(f));
            flows.map(|f| f.force).sum()
        };
        // Whether a spring goes as a whole to a span that gets no other spring.
        let whole = |flow: &Flow| {
            let others = |f: &&Flow| f.spring == flow.spring || f.span == flow.span;
            flows.iter().filter(others).count() == 1
        };
        for (span, history) in histories.iter_mut().enumerate() {
            let parents = || flows.iter().filter(move |f| f.span == span);
            let Some(first) = parents().next() else {
                continue;
            };
            if whole(first) {
                *history = of(first.spring);
                continue;
            }
            let brought = sum(&|f| f.span == span);
            let parts = parents().map(|f| {
                let part = f.force / sum(&|other| other.spring == f.spring);
                (part * (f.force / brought), of(f.spring))
            });
            *history = blend(parts);
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

/// Divides the springs of the minima between the spans to which they go.
fn part(held: &[Held], successors: &[Option<usize>], flows: &mut Vec<Flow>) {
    flows.clear();
    for (from, (minimum, successor)) in held.iter().zip(successors).enumerate() {
        let Some(span) = *successor else { continue };
        let (spring, force) = (minimum.spring, minimum.force);
        let same = |f: &&mut Flow| f.spring == spring && f.span == span;
        match flows.iter_mut().find(same) {
            Some(flow) => flow.force += force,
            None => flows.push(Flow {
                spring,
                span,
                force,
                from,
            }),
        }
    }
}

/// The sum of histories, each times a factor. The energy of a spring is quadratic in its history if its stiffness is
/// constant, and linear if force and stiffness are stored. For factors `q p` neither can grow.
fn blend(parts: impl Iterator<Item = (f64, All)>) -> All {
    let mut sum = All::default();
    for (factor, history) in parts {
        for (sum, x) in sum.iter_mut().zip(history) {
            *sum += factor * x;
        }
    }
    sum
}
