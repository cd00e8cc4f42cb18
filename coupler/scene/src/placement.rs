//! How points and bodies lie at the start. Points within a body are refused before anything is started: contact pushes a
//! point to the nearest surface, whichever that is, and only if it is not too deep.

use interface::Vec2;
use interface::config::{BodyConfig, BodyShape};
use interface::message::wire::{ContactState, ImpInfo, ImpState};
use mechanics::fill::fill;
use mechanics::outline::nearest;

use super::Scene;
use super::diagnostic::SceneErrors;
use super::document::Part;
use super::needs::body_or_set;

/// Largest overlap, as a share of the coordinates, that comes from rounding: an expression of a scene has a few operations, each
/// with an error of 1e-16 of its numbers.
const ROUNDING: f64 = 1e-13;

/// A body where it is at the start.
struct Solid {
    /// Vertices in m; of a cluster the centres of its discs.
    outline: Vec<Vec2>,
    /// Radius in m around each vertex.
    radii: Vec<f64>,
    is_cluster: bool,
}

impl Solid {
    fn of(body: &BodyConfig) -> Self {
        let outline: Vec<Vec2> = body.placed().into_iter().map(Vec2::from).collect();
        Self {
            radii: (0..outline.len()).map(|k| body.radius_at(k)).collect(),
            outline,
            is_cluster: matches!(body.shape, BodyShape::Cluster { .. }),
        }
    }

    /// How far a place is below the surface in m, negative outside, and the way out.
    fn depth(&self, p: Vec2) -> (f64, Vec2) {
        let (from, signed, radius) = if self.is_cluster {
            let discs = self.outline.iter().zip(&self.radii);
            let discs = discs.map(|(&center, &radius)| (center, (p - center).norm(), radius));
            let deepest = discs.max_by(|a, b| (a.2 - a.1).total_cmp(&(b.2 - b.1)));
            deepest.expect("a cluster has discs")
        } else {
            let seen = nearest(&self.outline, p);
            (seen.point, seen.distance, self.radii[0])
        };
        let away = (p - from) * signed.signum();
        let away = away.try_normalize(0.0).unwrap_or(Vec2::y());
        (radius - signed, away)
    }

    /// The corners of a box around it in m.
    fn bounds(&self) -> [Vec2; 2] {
        let radius = self.radii.iter().copied().fold(0.0, f64::max);
        let mut all = self.outline.iter();
        let first = *all.next().expect("an outline has a vertex");
        let [low, high] = all.fold([first; 2], |[low, high], v| [low.inf(v), high.sup(v)]);
        [low.add_scalar(-radius), high.add_scalar(radius)]
    }

    /// How far a vertex of one reaches below the surface of the other in m.
    fn overlap(&self, other: &Self) -> f64 {
        let reach = |a: &Self, b: &Self| {
            let vertices = a.outline.iter().zip(&a.radii);
            let depths = vertices.map(|(&v, &radius)| radius + b.depth(v).0);
            depths.fold(f64::NEG_INFINITY, f64::max)
        };
        reach(self, other).max(reach(other, self))
    }
}

/// The deepest of the points of a group that are wholly inside a body.
struct Inside {
    count: usize,
    at: Vec2,
    depth: f64,
    way_out: Vec2,
}

/// Refuses points that are wholly inside a body at the start. A scene that begins with the state of another run has the places of
/// that run.
///
/// # Errors
/// Each group and body of which this is so, with the distance to move.
pub fn refuse_points_within_bodies(scene: &Scene) -> Result<(), SceneErrors> {
    let (Some(mpm), Some(dem), None) = (&scene.mpm, &scene.dem, &scene.start) else {
        return Ok(());
    };
    let solids: Vec<Solid> = dem.bodies.iter().map(Solid::of).collect();
    let mut diagnostics = Vec::new();
    for (g, group) in mpm.groups.iter().enumerate() {
        let radius = group.radius(mpm.cell);
        let [low, high] = group.fill.bounds().map(Vec2::from);
        let meets = |solid: &&Solid| {
            let [from, to] = solid.bounds();
            low.x < to.x && low.y < to.y && from.x < high.x && from.y < high.y
        };
        if !solids.iter().any(|solid| meets(&solid)) {
            continue;
        }
        // A region without points is refused by the solver.
        let Ok(filled) = fill(group, mpm.cell, "") else {
            continue;
        };
        let mut points: Vec<Vec2> = filled.positions.into_iter().map(Vec2::from).collect();
        points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
        for (b, solid) in solids.iter().enumerate() {
            let Some(inside) = inside(solid, &points, radius) else {
                continue;
            };
            let (at, way_out) = (inside.at, inside.way_out);
            let message = format!(
                "points of group `{}` are wholly inside body `{}`: {}; the deepest, at ({:.4}, {:.4}) m, is {:.3e} m below its surface",
                group.name, dem.bodies[b].name, inside.count, at.x, at.y, inside.depth
            );
            let help = format!(
                "move the group away from the body by at least {:.3e} m in the direction ({:.2}, {:.2})",
                inside.depth + radius,
                way_out.x + 0.0,
                way_out.y + 0.0
            );
            let key = format!("mpm.points.{g}.fill");
            let document = &scene.document;
            diagnostics.push(document.diagnostic(&key, Part::Value, &message, Some(help)));
        }
    }
    if diagnostics.is_empty() {
        Ok(())
    } else {
        Err(SceneErrors(diagnostics))
    }
}

/// The deepest of `points`, sorted by `x`, whose discs of `radius` (m) are wholly inside a body.
fn inside(solid: &Solid, points: &[Vec2], radius: f64) -> Option<Inside> {
    let [from, to] = solid.bounds();
    let first = points.partition_point(|p| p.x < from.x);
    let near = points[first..].iter().take_while(|p| p.x <= to.x);
    let mut found: Option<Inside> = None;
    for &at in near.filter(|p| p.y > from.y && p.y < to.y) {
        let (depth, way_out) = solid.depth(at);
        if depth <= radius {
            continue;
        }
        let deepest = found.get_or_insert(Inside {
            count: 0,
            at,
            depth,
            way_out,
        });
        deepest.count += 1;
        if depth > deepest.depth {
            (deepest.at, deepest.depth, deepest.way_out) = (at, depth, way_out);
        }
    }
    found
}

/// What presses at the start, and where the body that presses most is written: that is meant where something stands, and not where
/// stones were put into one another. Overlaps by rounding are left out.
pub fn pressing(
    scene: &Scene,
    contacts: &[ContactState],
    set: &[ImpInfo],
    states: &[ImpState],
) -> Option<String> {
    let dem = scene.dem.as_ref()?;
    let solid = |body: u64| Some(Solid::of(dem.bodies.get(body as usize)?));
    let point = |id: u64| {
        let slot = set.binary_search_by_key(&id, |info| info.id).ok()?;
        Some((&set[slot], Vec2::from(states[slot].position)))
    };
    let overlap = |contact: &ContactState| {
        Some(match contact.with {
            0 => solid(contact.body)?.overlap(&solid(contact.other)?),
            1 => {
                let (info, at) = point(contact.other)?;
                info.radius + solid(contact.body)?.depth(at).0
            }
            _ => {
                let ((a, at_a), (b, at_b)) = (point(contact.body)?, point(contact.other)?);
                a.radius + b.radius - (at_a - at_b).norm()
            }
        })
    };
    let size = |contact: &ContactState| contact.force[0].hypot(contact.force[1]);
    let corners = dem.bodies.iter().flat_map(|body| Solid::of(body).bounds());
    let reach = corners.map(|corner| corner.amax()).fold(0.0, f64::max);
    let known = contacts.iter().filter_map(|c| Some((c, overlap(c)?)));
    let pressing = known.filter(|&(_, overlap)| overlap > ROUNDING * reach);
    let pressing: Vec<_> = pressing.collect();
    let by_size =
        |a: &&(&ContactState, f64), b: &&(&ContactState, f64)| size(a.0).total_cmp(&size(b.0));
    let &(most, overlap) = pressing.iter().max_by(by_size)?;
    let body = |index: u64| format!("body `{}`", dem.bodies[index as usize].name);
    let of_group = |id: u64| {
        let group = point(id).map(|(info, _)| info.group as usize);
        let group = group.and_then(|g| scene.mpm.as_ref()?.groups.get(g));
        group.map_or("a point".into(), |g| {
            format!("a point of group `{}`", g.name)
        })
    };
    let (one, other, key) = match most.with {
        0 => {
            let [first, second] = [most.body.min(most.other), most.body.max(most.other)];
            (
                body(second),
                body(first),
                format!("dem.body.{second}.position"),
            )
        }
        1 => (
            of_group(most.other),
            body(most.body),
            format!("dem.body.{}.position", most.body),
        ),
        _ => (
            of_group(most.other),
            of_group(most.body),
            "group_pair".to_owned(),
        ),
    };
    let place = scene
        .document
        .whereabouts(&body_or_set(&key, &scene.document));
    let count = match pressing.len() {
        1 => "1 contact presses".to_owned(),
        n => format!("{n} contacts press"),
    };
    Some(format!(
        "{count} at t = 0, the largest force is {:.3e} N/m: {one} overlaps {other} by {overlap:.3e} m ({place}); \
         move apart whatever should not touch at the start",
        size(most)
    ))
}
