//! Identified material points (Jiang 2020 section 4): which points the bodies ask for.

use interface::Vec2;
use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState};
use interface::solver::Refusal;
use mechanics::outline::{crosses_ray, nearest_on_edge};
use serde::{Deserialize, Serialize};

use crate::kernel::lanes::LANES;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::points::{Cloud, LaneCopy, NO_POINT, Tile};
use crate::state::saved::refusal;

/// One IMP: a point of a cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Member {
    /// Number of the cloud.
    pub cloud: u32,
    /// Identity less the cloud's first.
    pub local: u32,
}

/// The IMPs, slot by slot, ordered by id.
#[derive(Debug, Default)]
pub struct Imps {
    /// Who they are.
    pub members: Vec<Member>,
    /// Likewise, as the bodies' side is told.
    pub infos: Vec<ImpInfo>,
    /// Their states, as of the last [`Self::refresh`].
    pub states: Vec<ImpState>,
    /// The forces of the present step; empty where there are no bodies.
    pub forces: Vec<ImpForce>,
    /// Upper bound of the displacement of any point since the last selection in m.
    pub travel: f64,
    /// Verlet skin `V_d` in m.
    pub skin: f64,
}

/// What of the IMPs is saved.
#[derive(Debug, Serialize, Deserialize)]
pub struct SavedImps {
    members: Vec<Member>,
    travel: f64,
}

impl Imps {
    /// Who they are and how far points have gone since they were chosen.
    pub fn save(&self) -> SavedImps {
        let Self {
            members,
            infos: _,  // of the members
            states: _, // read from the points whenever they are asked for
            forces: _, // of one step
            travel,
            skin: _, // of the configuration
        } = self;
        SavedImps {
            members: members.clone(),
            travel: *travel,
        }
    }

    /// Takes over what [`Self::save`] gave.
    ///
    /// # Errors
    /// A [`Refusal`] of members that are not points of `clouds`, or not in order.
    pub fn restore<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        saved: SavedImps,
        clouds: &[Cloud<W, S, A>],
    ) -> Result<(), Refusal> {
        let SavedImps { members, travel } = saved;
        // Not a number would never ask for another set.
        if travel.is_nan() || travel < 0.0 {
            return Err(refusal(format!("points have travelled by {travel} m")));
        }
        for m in &members {
            let cloud = clouds.get(m.cloud as usize);
            let lane = cloud.and_then(|c| c.lane_of.get(m.local as usize));
            // A point that has been removed is in the set until it is chosen anew, which an infinite travel asks for.
            if lane.is_none_or(|l| *l == NO_POINT && travel.is_finite()) {
                let text = format!("the set has point {} of group {}", m.local, m.cloud);
                return Err(refusal(format!("{text}, which there is not")));
            }
        }
        if !members.is_sorted_by(|a, b| a < b) {
            return Err(refusal("the set is not ordered by id"));
        }
        (self.members, self.travel) = (members, travel);
        self.tell(clouds);
        self.states.clear();
        self.forces.clear();
        Ok(())
    }

    /// Chooses the points within `reach + r_p + V_d` of an envelope, or inside one.
    pub fn select<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        clouds: &[Cloud<W, S, A>],
        envelopes: &[EnvelopeVertex],
    ) {
        self.members.clear();
        self.travel = 0.0;
        let outlines = outlines(envelopes);
        if !outlines.is_empty() {
            for (c, cloud) in clouds.iter().enumerate() {
                for tile in &cloud.tiles {
                    let margin = cloud.radius + self.skin;
                    select_in_tile(cloud, tile, &outlines, margin, |local| {
                        self.members.push(Member {
                            cloud: c as u32,
                            local,
                        });
                    });
                }
            }
        }
        // Ids rise with the cloud and within it.
        self.members.sort_unstable();
        self.tell(clouds);
        self.forces.clear();
    }

    /// Writes down who the members are.
    fn tell<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        clouds: &[Cloud<W, S, A>],
    ) {
        self.infos.clear();
        self.infos.extend(self.members.iter().map(|m| {
            let cloud = &clouds[m.cloud as usize];
            ImpInfo {
                id: cloud.first_id + u64::from(m.local),
                radius: cloud.radius,
                mass: cloud.mass,
                group: m.cloud,
                next: 0,
            }
        }));
    }

    /// Reads the states of the IMPs.
    pub fn refresh<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
        &mut self,
        clouds: &[Cloud<W, S, A>],
    ) {
        self.states.clear();
        self.states.extend(self.members.iter().map(|m| {
            let cloud = &clouds[m.cloud as usize];
            let lane = cloud.lane_of[m.local as usize] as usize;
            ImpState {
                position: cloud.position(lane),
                velocity: cloud.velocity(lane),
            }
        }));
    }
}

/// The envelope of one body.
struct Outline {
    vertices: Vec<Vec2>,
    reach: f64,
    bounds: Bounds,
}

impl Outline {
    fn edges(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        let n = self.vertices.len();
        let count = if n == 2 { 1 } else { n };
        (0..count).map(move |i| (self.vertices[i], self.vertices[(i + 1) % n]))
    }
}

fn outlines(envelopes: &[EnvelopeVertex]) -> Vec<Outline> {
    envelopes
        .chunk_by(|a, b| a.body == b.body)
        .map(|records| {
            let vertices: Vec<Vec2> = records.iter().map(|r| Vec2::from(r.position)).collect();
            Outline {
                reach: records.iter().map(|r| r.reach).fold(0.0, f64::max),
                bounds: vertices.iter().copied().collect(),
                vertices,
            }
        })
        .collect()
}

/// An axis-aligned box.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    lower: Vec2,
    upper: Vec2,
}

impl FromIterator<Vec2> for Bounds {
    fn from_iter<I: IntoIterator<Item = Vec2>>(points: I) -> Self {
        let empty = Self {
            lower: Vec2::repeat(f64::INFINITY),
            upper: Vec2::repeat(f64::NEG_INFINITY),
        };
        points.into_iter().fold(empty, |b, p| Self {
            lower: b.lower.inf(&p),
            upper: b.upper.sup(&p),
        })
    }
}

impl Bounds {
    /// Whether something in one box can be within `distance` of something in the other.
    fn near(&self, other: &Self, distance: f64) -> bool {
        // A hair more, since the distances are compared after rounding.
        let d = Vec2::repeat(distance * (1.0 + 1e-9));
        let (a, b) = (self.lower - d, self.upper + d);
        a.x <= other.upper.x && a.y <= other.upper.y && b.x >= other.lower.x && b.y >= other.lower.y
    }
}

/// Calls `found` for the points of a tile that some outline asks for.
///
/// Whole tiles are passed over by their bounds, and a large outline is reduced to the edges that matter for the tile:
/// those near enough to be within reach, and those that a ray to the right can cross.
fn select_in_tile<const W: usize, S: Shape<W>, A: AffineState + LaneCopy>(
    cloud: &Cloud<W, S, A>,
    tile: &Tile,
    outlines: &[Outline],
    margin: f64,
    mut found: impl FnMut(u32),
) {
    let points = || {
        (tile.first..tile.first + tile.blocks).flat_map(|block| {
            (0..LANES).filter_map(move |k| {
                let local = cloud.ids[block][k];
                let position = Vec2::from(cloud.position(block * LANES + k));
                (local != NO_POINT).then_some((local, position))
            })
        })
    };
    let bounds: Bounds = points().map(|(_, p)| p).collect();
    let near: Vec<LocalOutline> = outlines
        .iter()
        .filter(|o| o.bounds.near(&bounds, o.reach + margin))
        .map(|o| LocalOutline::new(o, &bounds, o.reach + margin))
        .filter(|o| !o.near.is_empty() || !o.crossed.is_empty())
        .collect();
    if near.is_empty() {
        return;
    }
    for (local, p) in points() {
        if near.iter().any(|o| o.asks_for(p)) {
            found(local);
        }
    }
}

/// The part of an outline that matters for a box.
struct LocalOutline {
    distance: f64,
    near: Vec<(Vec2, Vec2)>,
    crossed: Vec<(Vec2, Vec2)>,
}

impl LocalOutline {
    fn new(outline: &Outline, bounds: &Bounds, distance: f64) -> Self {
        let box_of = |(a, b): &(Vec2, Vec2)| [*a, *b].into_iter().collect::<Bounds>();
        Self {
            distance,
            near: outline
                .edges()
                .filter(|e| box_of(e).near(bounds, distance))
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
            .map(|&(a, b)| (p - nearest_on_edge(a, b, p, 0, 0).0).norm_squared())
            .fold(f64::INFINITY, f64::min);
        square.sqrt() <= self.distance
            || self
                .crossed
                .iter()
                .fold(false, |inside, &(a, b)| inside ^ crosses_ray(a, b, p))
    }
}
