//! Verlet lists: the pairs that can touch before the list is rebuilt, and the rule for rebuilding it.
//!
//! A list holds every pair that is closer than its contact distance plus the skin `V_d`. The distance of a pair
//! decreases by at most the sum of both displacements. So no unlisted pair can touch until the largest displacements of
//! both sides since the build, rotation and the points' own motion included, add up to more than the skin. The list of
//! bodies has a larger margin, because it also contains the pairs that may touch soon ([`crate::contact::approach`]).

use interface::Vec2;
use interface::message::wire::ImpInfo;
use mechanics::outline::{crosses_ray, nearest_on_edge};

use crate::body::bodies::Bodies;
use crate::body::edge::vertex_edge;
use crate::lists::cells::Cells;
use crate::lists::watch::Watch;
use crate::parry::{Bounds, BoxTree};
use crate::threads::CHUNK;

/// A point is "in reach" of a body up to this distance beyond contact, as a fraction of the point's radius. In a step a
/// point moves at most half its radius relative to a body (the kinematic limit), so every pair that touches in the next
/// step is in reach now.
pub const REACH: f64 = 0.5;

/// A point and a body that may touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointPair {
    /// Slot of the IMP.
    pub slot: u32,
    /// Body.
    pub body: u32,
    /// Disc of a cluster; 0 for any other body.
    pub part: u32,
    /// The edges of the body that may be nearest: their range in [`PointList::edges`].
    pub edges: [u32; 2],
}

/// The points and the bodies that may touch.
#[derive(Debug, Clone, Default)]
pub struct PointList {
    /// Pairs in ascending order of slot, then body, then part.
    pub pairs: Vec<PointPair>,
    /// Edges that may be nearest.
    pub edges: Vec<u32>,
    found: Vec<u32>,
    near: Vec<u32>,
}

impl PointList {
    /// Finds all pairs of points at `positions` (m) within reach plus `skin` (m), and for each pair the edges that may
    /// become nearest.
    ///
    /// An edge can become nearest only if its distance now exceeds that of the nearest edge by at most twice the skin:
    /// while both sides together move by the skin, the distance to each edge changes by at most the skin.
    pub fn build(&mut self, bodies: &Bodies, set: &[ImpInfo], positions: &[Vec2], skin: f64) {
        self.pairs.clear();
        self.edges.clear();
        let boxes = (0..bodies.len()).map(|b| {
            Bounds::around(bodies.outline_of(b).iter().copied()).grown(bodies.state[b].radius)
        });
        let tree = BoxTree::new(boxes);
        for (slot, (info, &p)) in set.iter().zip(positions).enumerate() {
            let margin = (1.0 + REACH) * info.radius + skin;
            let mut found = std::mem::take(&mut self.found);
            found.clear();
            tree.meeting(&Bounds::around([p]).grown(margin), &mut found);
            for &body in &found {
                self.add_pair(bodies, slot as u32, body, p, margin, 2.0 * skin);
            }
            self.found = found;
        }
    }

    /// Adds the pair if the point is within `margin` of the surface or inside it.
    fn add_pair(&mut self, bodies: &Bodies, slot: u32, body: u32, p: Vec2, margin: f64, band: f64) {
        let b = body as usize;
        let reach = bodies.state[b].radius + margin;
        let outline = bodies.outline_of(b);
        let shape = &bodies.properties[b].shape;
        let n = outline.len();
        if !shape.has_edges {
            // Each disc is a separate contact, so that the sum over discs is smooth where the nearest disc changes.
            for (part, center) in (0..).zip(outline) {
                if (p - center).norm() <= bodies.radius_at(b, part) + margin {
                    let from = self.edges.len() as u32;
                    self.edges.push(0);
                    self.pairs.push(PointPair {
                        slot,
                        body,
                        part,
                        edges: [from, from + 1],
                    });
                }
            }
            return;
        }
        let distance = |i: usize| {
            let j = if i + 1 == n { 0 } else { i + 1 };
            (p - nearest_on_edge(outline[i], outline[j], p, i, j).0).norm()
        };
        let mut near = std::mem::take(&mut self.near);
        near.clear();
        let nearest = |near: &[u32]| {
            let distances = near.iter().map(|&i| distance(i as usize));
            distances.fold(f64::INFINITY, f64::min)
        };
        let smallest = if let Some(tree) = &shape.edges {
            let q = bodies.into_frame(b, p);
            let search = |r: f64, near: &mut Vec<u32>| {
                near.clear();
                tree.meeting(&Bounds::around([q]).grown(r), near);
                nearest(near)
            };
            let mut r = reach;
            let mut smallest = search(r, &mut near);
            if smallest > reach {
                if !inside(&shape.vertices, tree, q, shape.extent, &mut near) {
                    self.near = near;
                    return;
                }
                // The point is deep inside: increase the radius until the nearest edge is found.
                while smallest > r {
                    r *= 2.0;
                    smallest = search(r, &mut near);
                }
            }
            search(smallest + band, &mut near);
            smallest
        } else {
            near.extend(0..shape.edge_count() as u32);
            let smallest = nearest(&near);
            let crosses = |&i: &usize| crosses_ray(outline[i], outline[(i + 1) % n], p);
            let inside = || n > 2 && (0..n).filter(crosses).count() % 2 == 1;
            if smallest > reach && !inside() {
                self.near = near;
                return;
            }
            smallest
        };
        let from = self.edges.len() as u32;
        let may_become_nearest = |&i: &u32| distance(i as usize) <= smallest + band;
        self.edges
            .extend(near.iter().copied().filter(may_become_nearest));
        self.pairs.push(PointPair {
            slot,
            body,
            part: 0,
            edges: [from, self.edges.len() as u32],
        });
        self.near = near;
    }
}

/// Whether `q` is inside the outline, by the even-odd rule over the edges that a ray to the right meets.
fn inside(vertices: &[Vec2], tree: &BoxTree, q: Vec2, extent: f64, near: &mut Vec<u32>) -> bool {
    let n = vertices.len();
    near.clear();
    let far = Vec2::new(q.x + 4.0 * extent, q.y);
    tree.meeting(&Bounds::around([q, far]), near);
    let crossings = near.iter().map(|&i| i as usize);
    crossings
        .filter(|&i| crosses_ray(vertices[i], vertices[(i + 1) % n], q))
        .count()
        % 2
        == 1
}

/// A vertex of one body and an edge of another that may touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexEdge {
    /// Owner of the vertex, owner of the edge.
    pub bodies: [u32; 2],
    /// Vertex, in [`Bodies::outline`].
    pub vertex: u32,
    /// Ends of the edge, likewise; equal for a disc.
    pub edge: [u32; 2],
    /// Sum of the sphero-radii in m: contact begins where the distance falls below it.
    pub reach: f64,
    /// Radius around the vertex in m.
    pub radius: f64,
}

impl VertexEdge {
    /// Sort key of the list: body pair, which of the two has the vertex, vertex, edge. It depends only on the scene.
    pub fn key(&self) -> (u32, u32, bool, u32, u32) {
        let [v, e] = self.bodies;
        (v.min(e), v.max(e), v > e, self.vertex, self.edge[0])
    }
}

/// Calls `found` for every two bodies whose bounding boxes, enlarged by their margins, overlap, if forces can move at
/// least one of the two. The order is ascending, and the number is the sum of the margins in m.
pub fn close_pairs(bodies: &Bodies, watch: &Watch, mut found: impl FnMut([u32; 2], f64)) {
    let around = |b: usize| {
        let outline = Bounds::around(bodies.outline_of(b).iter().copied());
        outline.grown(bodies.state[b].radius + watch.margin(b))
    };
    let boxes: Vec<Bounds> = (0..bodies.len()).map(around).collect();
    let cells = Cells::new(&boxes);
    let free = |b: usize| bodies.properties[b].yields();
    let mut near = Vec::new();
    for i in 0..bodies.len() {
        near.clear();
        cells.above(i as u32, &boxes, &mut near);
        for &j in &near {
            let [a, b] = [i, j as usize].map(|b| &bodies.state[b]);
            let margin = watch.margin(i) + watch.margin(j as usize);
            // This mainly removes bodies whose boxes overlap at a corner, while their bounding circles do not.
            let together = a.extent + b.extent + margin;
            let apart = (a.center - b.center).norm_squared() > together * together;
            if !apart && (free(i) || free(j as usize)) {
                found([i as u32, j], margin);
            }
        }
    }
}

/// The bodies that may touch.
#[derive(Debug, Clone, Default)]
pub struct BodyList {
    /// Vertex-edge pairs in the order of [`VertexEdge::key`].
    pub pairs: Vec<VertexEdge>,
    /// The smallest contact distance among them in m; infinite if there are none.
    pub smallest_reach: f64,
    /// Whether all pairs of a chunk are of discs.
    pub round: Vec<bool>,
    near: Vec<u32>,
    vertices: Vec<u32>,
}

impl BodyList {
    /// Finds all vertex-edge pairs within contact distance plus margins, for bodies of which forces can move at least
    /// one.
    pub fn build(&mut self, bodies: &Bodies, watch: &Watch) {
        self.pairs.clear();
        close_pairs(bodies, watch, |[i, j], margin| {
            self.add_bodies(bodies, [i, j], margin);
            // Discs have no edges, so two of them have one contact, vertex on vertex.
            let edges = |b: u32| bodies.properties[b as usize].shape.has_edges;
            if edges(i) || edges(j) {
                self.add_bodies(bodies, [j, i], margin);
            }
        });
        let reaches = self.pairs.iter().map(|pair| pair.reach);
        self.smallest_reach = reaches.fold(f64::INFINITY, f64::min);
        let disc = |b: &u32| bodies.outline_of(*b as usize).len() == 1;
        let round = |chunk: &[VertexEdge]| chunk.iter().all(|pair| pair.bodies.iter().all(disc));
        self.round.clear();
        self.round.extend(self.pairs.chunks(CHUNK).map(round));
    }

    /// The vertices of the first body against the edges of the second (one of the two sums of eq. 39).
    fn add_bodies(&mut self, bodies: &Bodies, pair: [u32; 2], margin: f64) {
        let [v, e] = pair.map(|b| b as usize);
        let outline = bodies.outline_of(e);
        let [of_vertex, of_edge] = [v, e].map(|b| &bodies.properties[b].shape);
        if of_vertex.has_edges && !of_edge.has_edges {
            return; // discs have no edges; they are the vertices in the other sum
        }
        let reach = bodies.state[v].radius + bodies.state[e].radius + margin;
        let first = [v, e].map(|b| bodies.properties[b].first_vertex as u32);
        let inverse_length_sq = &bodies.inverse_length_sq[first[1] as usize..];
        let mut vertices = std::mem::take(&mut self.vertices);
        vertices_near(bodies, v, e, reach, &mut vertices, &mut self.near);
        for &k in &vertices {
            let p = bodies.outline_of(v)[k as usize];
            self.near.clear();
            match &bodies.properties[e].shape.edges {
                Some(tree) => {
                    let q = bodies.into_frame(e, p);
                    tree.meeting(&Bounds::around([q]).grown(reach), &mut self.near);
                }
                None => self
                    .near
                    .extend(0..bodies.properties[e].shape.edge_count() as u32),
            }
            for &i in &self.near {
                let i = i as usize;
                let j = of_edge.edge_end(i);
                let inverse = inverse_length_sq[i];
                let (_, distance_sq) = vertex_edge(p, outline[i], outline[j], inverse);
                let (vertex, edge) = (first[0] + k, [i, j].map(|i| first[1] + i as u32));
                let radius = bodies.radii[vertex as usize];
                let touching = radius + bodies.radii[edge[0] as usize];
                let within = touching + margin;
                if distance_sq <= within * within {
                    self.pairs.push(VertexEdge {
                        bodies: pair,
                        vertex,
                        edge,
                        reach: touching,
                        radius,
                    });
                }
            }
        }
        self.vertices = vertices;
    }
}

/// The vertices of body `v` that may be within `reach` of body `e`, in ascending order.
fn vertices_near(
    bodies: &Bodies,
    v: usize,
    e: usize,
    reach: f64,
    vertices: &mut Vec<u32>,
    near: &mut Vec<u32>,
) {
    vertices.clear();
    let outline = bodies.outline_of(v);
    let n = outline.len() as u32;
    if let Some(tree) = &bodies.properties[v].shape.edges {
        let other = bodies
            .outline_of(e)
            .iter()
            .map(|&p| bodies.into_frame(v, p));
        near.clear();
        tree.meeting(&Bounds::around(other).grown(reach), near);
        vertices.extend(near.iter().flat_map(|&i| [i, (i + 1) % n]));
        vertices.sort_unstable();
        vertices.dedup();
    } else {
        let around = Bounds::around(bodies.outline_of(e).iter().copied()).grown(reach);
        let meets = |i: &u32| around.meets(&Bounds::around([outline[*i as usize]]));
        vertices.extend((0..n).filter(meets));
    }
}
