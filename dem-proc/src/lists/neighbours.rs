//! Verlet lists: the pairs that can touch before the list is rebuilt, and the rule for rebuilding it.
//!
//! A list holds every pair that is closer than its contact distance plus the skin `V_d`. The distance of a pair
//! decreases by at most the sum of both displacements. So no unlisted pair can touch until the largest displacements of
//! both sides since the build, rotation and the points' own motion included, add up to more than the skin. The list of
//! bodies has a larger margin, because it also contains the pairs that may touch soon ([`crate::contact::approach`]).

use interface::Vec2;
use mechanics::outline::{Bounds, crosses_ray, foot};

use crate::body::bodies::Bodies;
use crate::body::edge::vertex_edge;
use crate::body::shape::Shape;
use crate::lists::cells::Cells;
use crate::lists::now::Among;
use crate::lists::watch::Watch;
use crate::parry::BoxTree;
use crate::threads::{CHUNK, part, search};
use mechanics::threads::Threads;

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

/// What belongs to a list of points and bodies that may touch.
#[derive(Debug, Clone, Default)]
pub struct PointList {
    /// Edges that may be nearest.
    pub edges: Vec<u32>,
    found: Vec<u32>,
    near: Vec<u32>,
}

impl PointList {
    /// Finds all `pairs` of points at `positions` (m) within reach plus `skin` (m), in ascending order of slot, then body,
    /// then part, and for each pair the edges that may become nearest.
    ///
    /// An edge can become nearest only if its distance now exceeds that of the nearest edge by at most twice the skin:
    /// while both sides together move by the skin, the distance to each edge changes by at most the skin.
    pub fn build(
        &mut self,
        among: &Among,
        positions: &[Vec2],
        skin: f64,
        pairs: &mut Vec<PointPair>,
    ) {
        let bodies = among.bodies;
        pairs.clear();
        self.edges.clear();
        let boxes = (0..bodies.len()).map(|b| {
            Bounds::around(bodies.outline_of(b).iter().copied()).grown(bodies.state[b].radius)
        });
        let tree = BoxTree::new(boxes);
        for (slot, (info, &p)) in among.set.iter().zip(positions).enumerate() {
            let margin = (1.0 + REACH) * info.radius + skin;
            let mut found = std::mem::take(&mut self.found);
            found.clear();
            tree.meeting(&Bounds::around([p]).grown(margin), &mut found);
            for &body in &found {
                self.add_pair(bodies, (slot as u32, body), p, [margin, 2.0 * skin], pairs);
            }
            self.found = found;
        }
    }

    /// Adds the pair if the point is within `margin` of the surface or inside it.
    fn add_pair(
        &mut self,
        bodies: &Bodies,
        (slot, body): (u32, u32),
        p: Vec2,
        [margin, band]: [f64; 2],
        pairs: &mut Vec<PointPair>,
    ) {
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
                    pairs.push(PointPair {
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
            (p - foot(outline[i], outline[j], p).0).norm()
        };
        let mut near = std::mem::take(&mut self.near);
        let nearest = |near: &[u32]| {
            let distances = near.iter().map(|&i| distance(i as usize));
            distances.fold(f64::INFINITY, f64::min)
        };
        let fill = |near: &mut Vec<u32>, r: f64| {
            near.clear();
            let around = || Bounds::around([bodies.into_frame(b, p)]).grown(r);
            shape.edges_near(around, near);
        };
        fill(&mut near, reach);
        let mut smallest = nearest(&near);
        if smallest > reach {
            if !inside(shape, bodies.into_frame(b, p), &mut near) {
                self.near = near;
                return;
            }
            // The point is deep inside: increase the radius until the nearest edge is found.
            let mut r = reach;
            while smallest > r {
                r *= 2.0;
                fill(&mut near, r);
                smallest = nearest(&near);
            }
        }
        fill(&mut near, smallest + band);
        let from = self.edges.len() as u32;
        let may_become_nearest = |&i: &u32| distance(i as usize) <= smallest + band;
        self.edges
            .extend(near.iter().copied().filter(may_become_nearest));
        pairs.push(PointPair {
            slot,
            body,
            part: 0,
            edges: [from, self.edges.len() as u32],
        });
        self.near = near;
    }
}

/// Whether `q` is inside the outline, by the even-odd rule over the edges that a ray to the right meets.
fn inside(shape: &Shape, q: Vec2, near: &mut Vec<u32>) -> bool {
    near.clear();
    let far = Vec2::new(q.x + 4.0 * shape.extent, q.y);
    shape.edges_near(|| Bounds::around([q, far]), near);
    let edge = |i: u32| [i as usize, shape.edge_end(i as usize)].map(|k| shape.vertices[k]);
    let crosses = |&&i: &&u32| crosses_ray(edge(i)[0], edge(i)[1], q);
    shape.vertices.len() > 2 && near.iter().filter(crosses).count() % 2 == 1
}

/// A vertex of one body and an edge of another that may touch.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
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

/// A search by parts of what may touch.
#[derive(Debug, Default)]
pub struct Search<T>(Vec<Found<T>>);

/// What a part of a search has found, and its working memory.
#[derive(Debug, Default)]
pub struct Found<T> {
    /// The pairs.
    pub pairs: Vec<T>,
    others: Vec<u32>,
    near: Vec<u32>,
    vertices: Vec<u32>,
}

impl<T: Copy + Default + Send + Sync> Search<T> {
    /// Makes `all` what `find` appends for the numbers above each one whose boxes overlap its own, in the order of their
    /// first sides.
    pub fn run(
        &mut self,
        boxes: &[Bounds],
        threads: &Threads,
        all: &mut Vec<T>,
        find: impl Fn(u32, &[u32], &mut Found<T>) + Sync,
    ) {
        let cells = Cells::new(boxes);
        search(threads, boxes.len(), &mut self.0, |here, found| {
            found.pairs.clear();
            let mut others = std::mem::take(&mut found.others);
            for i in here {
                others.clear();
                cells.above(i as u32, boxes, &mut others);
                find(i as u32, &others, found);
            }
            found.others = others;
        });
        if let [only] = &mut self.0[..] {
            std::mem::swap(&mut only.pairs, all);
            return;
        }
        let count = self.0.iter().map(|found| found.pairs.len()).sum();
        all.resize(count, T::default());
        let mut all = &mut all[..];
        let places = self.0.iter().map(|found| {
            let (own, others) = std::mem::take(&mut all).split_at_mut(found.pairs.len());
            all = others;
            (own, &found.pairs)
        });
        threads.each(places, |(own, found)| own.copy_from_slice(found));
    }

    /// Lists what `find` appends for every two bodies whose bounding boxes, enlarged by their margins, overlap, if forces
    /// can move at least one of the two. The order is ascending, and the number is the sum of the margins in m.
    pub fn close_pairs(
        &mut self,
        &Among {
            bodies, threads, ..
        }: &Among,
        watch: &Watch,
        all: &mut Vec<T>,
        find: impl Fn([u32; 2], f64, &mut Found<T>) + Sync,
    ) {
        let around = |b: usize| {
            let outline = Bounds::around(bodies.outline_of(b).iter().copied());
            outline.grown(bodies.state[b].radius + watch.margin(b))
        };
        let (count, part) = (bodies.len(), part(threads, bodies.len()));
        let mut boxes = vec![Bounds::around([Vec2::zeros()]); count];
        let parts = boxes.chunks_mut(part).enumerate();
        threads.each(parts, |(i, boxes)| {
            for (b, of) in (i * part..).zip(boxes) {
                *of = around(b);
            }
        });
        self.run(&boxes, threads, all, |i, others, found| {
            for &j in others {
                let [a, b] = [i, j].map(|b| &bodies.state[b as usize]);
                let margin = watch.margin(i as usize) + watch.margin(j as usize);
                // This mainly removes bodies whose boxes overlap at a corner, while their bounding circles do not.
                let together = a.extent + b.extent + margin;
                let apart = (a.center - b.center).norm_squared() > together * together;
                if !apart && (a.falls > 0.0 || b.falls > 0.0) {
                    find([i, j], margin, found);
                }
            }
        });
    }
}

/// What belongs to a list of bodies that may touch.
#[derive(Debug, Default)]
pub struct BodyList {
    search: Search<VertexEdge>,
    /// The smallest contact distance among them in m; infinite if there are none.
    pub smallest_reach: f64,
    /// Of each chunk of pairs, whether all are of discs, and the smallest contact distance in m.
    pub chunks: Vec<(bool, f64)>,
}

impl BodyList {
    /// Finds all vertex-edge pairs within contact distance plus margins, for bodies of which forces can move at least
    /// one, in the order of [`VertexEdge::key`].
    pub fn build(&mut self, among: &Among, watch: &Watch, pairs: &mut Vec<VertexEdge>) {
        let bodies = among.bodies;
        (self.search).close_pairs(among, watch, pairs, |[i, j], margin, found| {
            let [a, b] = [i, j].map(|b| &bodies.state[b as usize]);
            if a.is_disc() && b.is_disc() {
                // They have one contact, vertex on vertex.
                let (vertex, edge) = (a.first_vertex(), [b.first_vertex(); 2]);
                found.add_near(bodies, [i, j], margin, (vertex, edge));
                return;
            }
            found.add_bodies(bodies, [i, j], margin);
            // Of two clusters, too, each two discs have one contact.
            let edges = |b: u32| bodies.properties[b as usize].shape.has_edges;
            if edges(i) || edges(j) {
                found.add_bodies(bodies, [j, i], margin);
            }
        });
        self.chunks.resize(pairs.len().div_ceil(CHUNK), (true, 0.0));
        let chunks = pairs.chunks(CHUNK).zip(&mut self.chunks);
        (among.threads).each(chunks, |(pairs, chunk)| {
            let disc = |b: &u32| bodies.state[*b as usize].is_disc();
            let round = pairs.iter().all(|pair| pair.bodies.iter().all(disc));
            let reaches = pairs.iter().map(|pair| pair.reach);
            *chunk = (round, reaches.fold(f64::INFINITY, f64::min));
        });
        let reaches = self.chunks.iter().map(|(_, reach)| *reach);
        self.smallest_reach = reaches.fold(f64::INFINITY, f64::min);
    }
}

impl Found<VertexEdge> {
    /// The vertices of the first body against the edges of the second (one of the two sums of eq. 39).
    fn add_bodies(&mut self, bodies: &Bodies, pair: [u32; 2], margin: f64) {
        let [v, e] = pair.map(|b| b as usize);
        let [of_vertex, of_edge] = [v, e].map(|b| &bodies.properties[b].shape);
        if of_vertex.has_edges && !of_edge.has_edges {
            return; // discs have no edges; they are the vertices in the other sum
        }
        let reach = bodies.state[v].radius + bodies.state[e].radius + margin;
        let first = [v, e].map(|b| bodies.state[b].first_vertex());
        let (mut vertices, mut near) = (
            std::mem::take(&mut self.vertices),
            std::mem::take(&mut self.near),
        );
        vertices_near(bodies, v, e, reach, &mut vertices, &mut near);
        for &k in &vertices {
            let p = bodies.outline_of(v)[k as usize];
            near.clear();
            let around = || Bounds::around([bodies.into_frame(e, p)]).grown(reach);
            of_edge.edges_near(around, &mut near);
            for &i in &near {
                let edge = [i, of_edge.edge_end(i as usize) as u32].map(|i| first[1] + i);
                self.add_near(bodies, pair, margin, (first[0] + k, edge));
            }
        }
        (self.vertices, self.near) = (vertices, near);
    }

    /// Adds a vertex and an edge if they are within contact distance plus `margin` (m).
    #[inline]
    fn add_near(
        &mut self,
        bodies: &Bodies,
        pair: [u32; 2],
        margin: f64,
        (vertex, edge): (u32, [u32; 2]),
    ) {
        let at = |i: u32| bodies.outline[i as usize];
        let inverse = bodies.inverse_length_sq[edge[0] as usize];
        let (_, distance_sq) = vertex_edge(at(vertex), at(edge[0]), at(edge[1]), inverse);
        let radius = bodies.radii[vertex as usize];
        let reach = radius + bodies.radii[edge[0] as usize];
        let within = reach + margin;
        if distance_sq <= within * within {
            self.pairs.push(VertexEdge {
                bodies: pair,
                vertex,
                edge,
                reach,
                radius,
            });
        }
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
