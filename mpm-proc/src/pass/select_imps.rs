//! Chooses the identified material points: those near the bodies' envelopes (Jiang 2020 section 4).

use interface::Vec2;
use interface::message::wire::EnvelopeVertex;
use mechanics::outline::{Bounds, crosses_ray, foot};

use crate::kernel::point_tile::Tile;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::imps::{Imps, Member};
use crate::state::points::Cloud;

/// Chooses the points within `reach + r_p + V_d` of an envelope, or inside one.
pub fn select_imps<const W: usize, S: Shape<W>, A: AffineState>(
    imps: &mut Imps,
    clouds: &[Cloud<W, S, A>],
    envelopes: &[EnvelopeVertex],
) {
    imps.state.members.clear();
    imps.state.travel = 0.0;
    let outlines = outlines(envelopes);
    if !outlines.is_empty() {
        for (c, cloud) in clouds.iter().enumerate() {
            for tile in &cloud.tiles {
                let margin = cloud.radius + imps.skin;
                let members = &mut imps.state.members;
                select_in_tile(cloud, tile, &outlines, margin, &mut |local| {
                    members.push(Member {
                        cloud: c as u32,
                        local,
                    });
                });
            }
        }
    }
    // Ids rise with the cloud and within it.
    imps.state.members.sort_unstable();
    imps.write_infos(clouds);
    imps.forces.clear();
}

/// The envelope of one body.
pub(super) struct Outline {
    pub vertices: Vec<Vec2>,
    pub reach: f64,
    pub bounds: Bounds,
}

impl Outline {
    pub fn edges(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        let n = self.vertices.len();
        let count = if n == 2 { 1 } else { n };
        (0..count).map(move |i| (self.vertices[i], self.vertices[(i + 1) % n]))
    }
}

pub(super) fn outlines(envelopes: &[EnvelopeVertex]) -> Vec<Outline> {
    envelopes
        .chunk_by(|a, b| a.body == b.body)
        .map(|records| {
            let vertices: Vec<Vec2> = records.iter().map(|r| Vec2::from(r.position)).collect();
            Outline {
                reach: records.iter().map(|r| r.reach).fold(0.0, f64::max),
                bounds: Bounds::around(vertices.iter().copied()),
                vertices,
            }
        })
        .collect()
}

/// Whether something in one box can be within `distance` (m) of something in the other.
pub(super) fn near(a: &Bounds, b: &Bounds, distance: f64) -> bool {
    // Slightly more, because the distances are compared after rounding.
    a.grown(distance * (1.0 + 1e-9)).meets(b)
}

/// Calls `found` for the points of a tile that some outline asks for.
///
/// Whole tiles are passed over by their bounds, and a large outline is reduced to the edges that matter for the tile:
/// those near enough to be within reach, and those that a ray to the right can cross.
fn select_in_tile<const W: usize, S: Shape<W>, A: AffineState>(
    cloud: &Cloud<W, S, A>,
    tile: &Tile,
    outlines: &[Outline],
    margin: f64,
    found: &mut dyn FnMut(u32),
) {
    let mut bounds = Bounds::EMPTY;
    cloud.points_of(tile, &mut |_, p| bounds.widen(p.into()));
    let near = LocalOutline::all(outlines, &bounds, margin);
    if near.is_empty() {
        return;
    }
    cloud.points_of(tile, &mut |local, p| {
        if near.iter().any(|o| o.asks_for(p.into())) {
            found(local);
        }
    });
}

/// The part of an outline that matters for a box.
struct LocalOutline {
    distance: f64,
    near: Vec<(Vec2, Vec2)>,
    crossed: Vec<(Vec2, Vec2)>,
}

impl LocalOutline {
    /// What matters of these outlines, of which points within their reach and `margin` (m) are wanted.
    fn all(outlines: &[Outline], bounds: &Bounds, margin: f64) -> Vec<Self> {
        outlines
            .iter()
            .filter(|o| near(&o.bounds, bounds, o.reach + margin))
            .map(|o| Self::new(o, bounds, o.reach + margin))
            .filter(|o| !o.near.is_empty() || !o.crossed.is_empty())
            .collect()
    }

    fn new(outline: &Outline, bounds: &Bounds, distance: f64) -> Self {
        let box_of = |(a, b): &(Vec2, Vec2)| Bounds::around([*a, *b]);
        Self {
            distance,
            near: outline
                .edges()
                .filter(|e| near(&box_of(e), bounds, distance))
                .collect(),
            crossed: if outline.vertices.len() > 2 {
                outline
                    .edges()
                    .filter(|e| {
                        let b = box_of(e);
                        b.lower.y <= bounds.upper.y && b.upper.y >= bounds.lower.y
                    })
                    .collect()
            } else {
                Vec::new()
            },
        }
    }

    fn asks_for(&self, p: Vec2) -> bool {
        let square = self
            .near
            .iter()
            .map(|&(a, b)| (p - foot(a, b, p).0).norm_squared())
            .fold(f64::INFINITY, f64::min);
        square.sqrt() <= self.distance
            || self
                .crossed
                .iter()
                .fold(false, |inside, &(a, b)| inside ^ crosses_ray(a, b, p))
    }
}
