//! Converts between the vectors of nalgebra, which Tandem uses, and those of glam, which parry uses. This is the only
//! file that names `parry2d_f64` (docs/decisions/0002-parry.md).

use interface::Vec2;
use mechanics::outline::Bounds;
use parry2d_f64::bounding_volume::Aabb;
use parry2d_f64::math::{Pose, Vec2 as GlamVec2};
use parry2d_f64::partitioning::{Bvh, BvhBuildStrategy};
use parry2d_f64::query::ClosestPoints;
use parry2d_f64::query::details::closest_points_support_map_support_map;
use parry2d_f64::shape::SupportMap;

fn glam(v: Vec2) -> GlamVec2 {
    GlamVec2::new(v.x, v.y)
}

/// A tree of boxes, which finds the boxes that overlap a given one.
#[derive(Clone)]
pub struct BoxTree(Bvh);

impl std::fmt::Debug for BoxTree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "BoxTree({} leaves)", self.0.leaf_count())
    }
}

impl BoxTree {
    /// A tree of `boxes`, numbered in the order given.
    pub fn new(boxes: impl IntoIterator<Item = Bounds>) -> Self {
        let leaves = boxes
            .into_iter()
            .map(|b| Aabb::new(glam(b.lower), glam(b.upper)))
            .enumerate();
        Self(Bvh::from_iter(BvhBuildStrategy::Binned, leaves))
    }

    /// Appends the numbers of the boxes that overlap `query` to `found`, in ascending order, so that no result depends
    /// on the shape of the tree.
    pub fn meeting(&self, query: &Bounds, found: &mut Vec<u32>) {
        let from = found.len();
        let aabb = Aabb::new(glam(query.lower), glam(query.upper));
        found.extend(self.0.intersect_aabb(&aabb));
        found[from..].sort_unstable();
    }

    /// Bytes on the heap.
    pub fn bytes(&self) -> usize {
        self.0.heap_memory_size()
    }
}

/// A convex polygon in world coordinates, as GJK sees it.
struct Hull<'a>(&'a [Vec2]);

impl SupportMap for Hull<'_> {
    fn local_support_point(&self, dir: GlamVec2) -> GlamVec2 {
        let along = |p: &Vec2| p.x * dir.x + p.y * dir.y;
        let farthest = self
            .0
            .iter()
            .copied()
            .reduce(|best, p| if along(&p) > along(&best) { p } else { best });
        glam(farthest.expect("outlines are never empty"))
    }
}

/// The nearest points in m of two convex polygons, by the algorithm of Gilbert, Johnson and Keerthi (1988): twice the same
/// point if they touch, `None` if the gap is larger than `margin` (m).
pub fn nearest_points(a: &[Vec2], b: &[Vec2], margin: f64) -> Option<[Vec2; 2]> {
    match closest_points_support_map_support_map(&Pose::IDENTITY, &Hull(a), &Hull(b), margin) {
        ClosestPoints::Disjoint => None,
        ClosestPoints::WithinMargin(p, q) => Some([p, q].map(|p| Vec2::new(p.x, p.y))),
        ClosestPoints::Intersecting => Some([a[0], a[0]]),
    }
}
