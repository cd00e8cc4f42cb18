//! Chooses the identified markers: both ends of every segment that is near a body's envelope or inside one.

use interface::Vec2;
use interface::message::wire::EnvelopeVertex;
use mechanics::outline::{crosses_ray, nearest_on_edge};

use super::select_imps::{Outline, outlines};
use crate::state::imps::{Imps, Member};
use crate::state::markers::Markers;

/// Chooses both ends of every segment within `reach + r_b + V_d` of an envelope, or with an end inside one.
pub fn select_markers(imps: &mut Imps, envelopes: &[EnvelopeVertex]) {
    let Some(markers) = imps.markers.take() else {
        return;
    };
    imps.state.members.clear();
    imps.state.travel = 0.0;
    let outlines = outlines(envelopes);
    let mut chosen = vec![false; markers.state.x.len()];
    for marker in 0..markers.state.x.len() {
        let Some(next) = markers.next(marker) else {
            continue;
        };
        let distance = markers.chain(marker).radius + imps.skin;
        let ends = [marker, next].map(|m| Vec2::from(markers.state.x[m]));
        if outlines.iter().any(|o| asks_for(o, ends, distance)) {
            (chosen[marker], chosen[next]) = (true, true);
        }
    }
    let members = chosen.iter().enumerate().filter(|(_, chosen)| **chosen);
    imps.state
        .members
        .extend(members.map(|(marker, _)| member(&markers, marker)));
    imps.markers = Some(markers);
    imps.forces.clear();
}

/// A marker as a member of the set.
pub fn member(markers: &Markers, marker: usize) -> Member {
    Member {
        cloud: markers.chain(marker).cloud,
        local: marker as u32,
    }
}

/// Whether a body needs the segment between `ends`.
fn asks_for(outline: &Outline, ends: [Vec2; 2], distance: f64) -> bool {
    let margin = outline.reach + distance;
    if !outline.bounds.near(&ends.into_iter().collect(), margin) {
        return false;
    }
    let inside = |p: Vec2| {
        outline.vertices.len() > 2
            && outline
                .edges()
                .fold(false, |inside, (a, b)| inside ^ crosses_ray(a, b, p))
    };
    let near = |(a, b): (Vec2, Vec2)| {
        // Slightly more, because the distance is compared after rounding.
        apart(ends, [a, b]) <= margin * (1.0 + 1e-12)
    };
    ends.into_iter().any(inside) || outline.edges().any(near)
}

/// Distance of two segments in m.
fn apart([a, b]: [Vec2; 2], [c, d]: [Vec2; 2]) -> f64 {
    let side = |p: Vec2, q: Vec2, x: Vec2| (q - p).perp(&(x - p));
    let cross = side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
    if cross {
        return 0.0;
    }
    let to = |p: Vec2, q: Vec2, x: Vec2| (x - nearest_on_edge(p, q, x, 0, 1).0).norm();
    let ends = [to(a, b, c), to(a, b, d), to(c, d, a), to(c, d, b)];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_that_cross_are_not_apart() {
        let [a, b] = [Vec2::new(-0.1, 0.0), Vec2::new(0.9, 0.0)];
        let [c, d] = [Vec2::new(0.0, -0.7), Vec2::new(0.0, 0.2)];
        for (ends, others) in [
            ([a, b], [c, d]),
            ([b, a], [c, d]),
            ([a, b], [d, c]),
            ([c, d], [a, b]),
            ([d, c], [b, a]),
        ] {
            assert_eq!(apart(ends, others), 0.0);
        }
        // Short of one another by 0.1, and by the diagonal beyond an end.
        assert!((apart([a, b], [Vec2::new(0.3, 0.1), d]) - 0.1).abs() < 1e-15);
        let beyond = [Vec2::new(0.93, 0.04), Vec2::new(0.93, 2.0)];
        assert!((apart([a, b], beyond) - 0.05).abs() < 1e-15);
    }
}
