//! Geometry of the material points of two groups (Chen 2023 section 3.3). Each point has a circle for contact. Two
//! circles that overlap press on one another, by the same laws as a point and a body.
//!
//! ```text
//! N = (x_a - x_b) / |x_a - x_b|,   xi = r_a + r_b - |x_a - x_b|,   f_a = F_n N + F_t T,   f_b = -f_a
//! ```
//!
//! The surfaces move as the points do and turn with the spin of the field. (In the paper points have no rotation, so a rotation
//! of the continuum counts as motion along the contact.)

use interface::Vec2;
use interface::message::wire::{ContactState, ImpForce, ImpInfo};
use mechanics::outline::{Bounds, contact_point};

use crate::body::load::Load;
use crate::contact::engine::{Listing, On};
use crate::contact::frame_contacts::{POINTS, between};
use crate::contact::passage::{DEEP, Passed};
use crate::contact::points::{Geometry, Outcome, PointWatch, add_to_point};
use crate::law::{PairProperties, Stiffness, reduced};
use crate::lists::neighbours::{REACH, Search};
use crate::lists::now::Among;

/// Which groups touch one another.
#[derive(Debug, Clone, Default)]
pub struct PointPairs {
    /// For every two groups up to the last that touches another one, whether they touch.
    pairs: Vec<bool>,
    /// The surface of each of them.
    surfaces: Vec<u32>,
}

impl PointPairs {
    /// The groups of `pairs`; `surface` gives the number of a group's surface in the table of laws.
    pub fn new(
        pairs: impl Iterator<Item = [usize; 2]> + Clone,
        surface: impl Fn(usize) -> u32,
    ) -> Self {
        let groups = pairs.clone().flatten().max().map_or(0, |last| last + 1);
        let mut touching = vec![false; groups * groups];
        for [a, b] in pairs {
            (touching[a * groups + b], touching[b * groups + a]) = (true, true);
        }
        Self {
            pairs: touching,
            surfaces: (0..groups).map(surface).collect(),
        }
    }

    fn touch(&self, a: u32, b: u32) -> bool {
        let (groups, [a, b]) = (self.surfaces.len(), [a as usize, b as usize]);
        a.max(b) < groups && self.pairs[a * groups + b]
    }
}

/// Two slots whose points may touch, in ascending order.
type Pair = [u32; 2];

/// The contact from the centres of both points, and how far their surfaces are from them, in m.
#[derive(Debug, Clone, Copy)]
pub struct Arms {
    of_points: [Vec2; 2],
    surfaces: [f64; 2],
}

/// What a contact adds to its points.
#[derive(Debug, Clone, Copy)]
pub struct Effect {
    pair: Pair,
    stiffness: Stiffness,
    /// On both points in N.
    couples: [f64; 2],
}

type OnPoints<'a> = On<'a, PointPairs>;

impl OnPoints<'_> {
    fn infos(&self, pair: Pair) -> [&ImpInfo; 2] {
        pair.map(|slot| &self.set[slot as usize])
    }
}

/// Sum of the contact radii in m.
fn contact_distance([a, b]: [&ImpInfo; 2]) -> f64 {
    a.radius + b.radius
}

impl Listing for PointPairs {
    const POINTS: u32 = 2;
    type Pair = Pair;
    type Key = [u32; 3];
    type Extra = Search<Pair>;
    type Watch = PointWatch;

    /// Both points of a pair may have moved by this much towards one another.
    fn list(
        &self,
        among: &Among,
        watch: &PointWatch,
        pairs: &mut Vec<Pair>,
        search: &mut Search<Pair>,
    ) {
        let (set, positions, skin) = (among.set, &watch.built_at, watch.skin);
        // Each of two points contributes half of the largest distance at which they are listed.
        let boxes: Vec<Bounds> = (set.iter().zip(positions))
            .map(|(info, &x)| {
                let half = (1.0 + 0.5 * REACH) * info.radius + 0.5 * skin;
                Bounds::around([x]).grown(half)
            })
            .collect();
        search.run(&boxes, among.threads, pairs, |a, others, found| {
            let near = others.iter().filter(|&&b| {
                let [a, b] = [a as usize, b as usize];
                let both = [&set[a], &set[b]];
                self.touch(set[a].group, set[b].group)
                    && (positions[a] - positions[b]).norm()
                        <= contact_distance(both) + REACH * set[a].radius.min(set[b].radius) + skin
            });
            found.pairs.extend(near.map(|&b| [a, b]));
        });
    }

    fn key([a, b]: Pair, slot: impl Fn(u32) -> Option<u32>) -> Option<[u32; 3]> {
        let [a, b] = [slot(a)?, slot(b)?];
        Some([a.min(b), a.max(b), 0])
    }

    fn properties(&self, among: &Among, pair: Pair) -> PairProperties {
        let [a, b] = pair.map(|slot| &among.set[slot as usize]);
        PairProperties {
            mass: reduced(a.mass, b.mass),
            radius: reduced(a.radius, b.radius),
            surfaces: [a, b].map(|info| self.surfaces[info.group as usize]),
        }
    }

    fn bodies(_: Pair) -> [Option<u32>; 2] {
        [None; 2]
    }
}

impl Geometry for PointPairs {
    type Arms = Arms;
    type Effect = Effect;

    #[inline]
    fn reach(on: &OnPoints, pair: Pair) -> f64 {
        let [a, b] = on.infos(pair);
        REACH * a.radius.min(b.radius)
    }

    /// The normal is along x if both are at the same place.
    #[inline]
    fn overlap(on: &OnPoints, pair: Pair) -> (f64, Vec2) {
        let [p, q] = pair.map(|slot| on.position(slot));
        let distance = (p - q).norm();
        let normal = if distance > 0.0 {
            (p - q) / distance
        } else {
            Vec2::x()
        };
        (contact_distance(on.infos(pair)) - distance, normal)
    }

    #[inline]
    fn arms(on: &OnPoints, pair: Pair, (overlap, normal): (f64, Vec2)) -> Arms {
        let [a, b] = on.infos(pair).map(|info| info.radius - 0.5 * overlap);
        Arms {
            of_points: [normal * -a, normal * b],
            surfaces: [a, b],
        }
    }

    #[inline]
    fn overlap_before(on: &OnPoints, pair: Pair) -> Option<f64> {
        let [p, q] = pair.map(|slot| on.watch.was(slot));
        Some(contact_distance(on.infos(pair)) - (p? - q?).norm())
    }

    #[inline]
    fn moved(on: &OnPoints, pair: Pair, arms: &Arms) -> Option<Vec2> {
        let moved = |k: usize| on.moved(pair[k], arms.of_points[k]);
        Some(moved(0)? - moved(1)?)
    }

    #[inline]
    fn effect(
        _: &OnPoints,
        pair: Pair,
        arms: &Arms,
        stiffness: Stiffness,
        [_, tangential]: [f64; 2],
    ) -> Effect {
        Effect {
            pair,
            stiffness,
            // The force on the second is the negative, and it lies on the other side of the contact.
            couples: arms.surfaces.map(|arm| -arm * tangential),
        }
    }

    /// Twice the stiffness at both points (F-6).
    #[inline]
    fn add(outcome: &Outcome<Effect>, forces: &mut [ImpForce], _: &mut [Load]) {
        let Effect {
            pair,
            stiffness,
            couples,
        } = outcome.effect;
        let most = stiffness.normal.max(stiffness.tangential);
        for (k, force) in [outcome.force, -outcome.force].into_iter().enumerate() {
            let part = ImpForce {
                force: force.into(),
                couple: couples[k],
                stiffness: 2.0 * most,
                tangential: 2.0 * stiffness.tangential,
            };
            add_to_point(&mut forces[pair[k] as usize], &part);
        }
    }

    #[inline]
    fn is_deep(on: &OnPoints, pair: Pair, overlap: f64) -> bool {
        overlap > DEEP * contact_distance(on.infos(pair))
    }

    #[cold]
    fn passed(on: &OnPoints, pair: Pair, overlap: f64) -> Option<Passed> {
        let both = on.infos(pair);
        Some(Passed::Point {
            ids: both.map(|info| info.id),
            groups: both.map(|info| info.group),
            overlap,
            contact_distance: contact_distance(both),
        })
    }

    fn contact_state(
        on: &OnPoints,
        pair: Pair,
        (overlap, normal): (f64, Vec2),
        force: Vec2,
    ) -> ContactState {
        let both = on.infos(pair);
        let at = contact_point(on.position(pair[0]), both[0].radius, overlap, normal);
        between(both.map(|info| info.id), POINTS, at, force)
    }
}
