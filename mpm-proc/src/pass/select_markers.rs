//! Chooses the identified markers: both ends of every segment that is near a body's envelope or inside one.

use interface::Vec2;
use interface::message::wire::EnvelopeVertex;
use mechanics::outline::{Bounds, crosses_ray, segments_apart};

use super::select_imps::{Outline, near, outlines};
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
    if !near(&outline.bounds, &Bounds::around(ends), margin) {
        return false;
    }
    let inside = |p: Vec2| {
        outline.vertices.len() > 2
            && outline
                .edges()
                .fold(false, |inside, (a, b)| inside ^ crosses_ray(a, b, p))
    };
    let within = |(a, b): (Vec2, Vec2)| {
        // Slightly more, because the distance is compared after rounding.
        segments_apart(ends, [a, b]) <= margin * (1.0 + 1e-12)
    };
    ends.into_iter().any(inside) || outline.edges().any(within)
}
