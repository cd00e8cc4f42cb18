//! Sections 6 and 7 with `interface` = `segments`: what random cases of boundary chains do not meet.

use interface::config::{DemConfig, Interface, Motion};

use super::scene::{OVERLAP, RADIUS, SPHERO, STIFFNESS, disc, points};
use crate::bench::{Bench, Points};
use crate::clause::{Clause, clauses};
use crate::verdict::{Judgement, Unmet, near, require};

const NEEDS: &[&str] = &["segments", "shape:disc"];

pub const CLAUSES: &[Clause] = clauses! {
    Must "F-7w" "a vertex of a chain counts once" by vertex, needs: NEEDS, after: &["W-2a"];
    Must "I-2i" "refuses a link that is not another slot" by nowhere, needs: NEEDS;
};

/// A fixed disc at the origin that meets segments by an elastic law.
fn held() -> DemConfig {
    DemConfig {
        interface: Interface::Segments,
        ..disc(Motion::Fixed)
    }
}

/// Height in m of a flat chain over the disc.
const HEIGHT: f64 = SPHERO + RADIUS - OVERLAP;

/// A chain over the disc, from left to right, the material above.
fn chain(places: &[[f64; 2]]) -> Points {
    let mut points = points(places.iter().copied());
    let count = places.len() as u32;
    for (slot, info) in (1..).zip(&mut points.set) {
        info.next = if slot < count { slot + 1 } else { 0 };
    }
    points
}

fn nowhere(bench: &Bench) -> Judgement {
    let mut message = String::new();
    for (slot, next) in [(0, 4), (2, 3), (1, u32::MAX)] {
        let mut points = chain(&[[-0.05, HEIGHT], [0.0, HEIGHT], [0.06, HEIGHT]]);
        points.set[slot].next = next;
        let mut play = bench.run_bodies(&held())?;
        play.set(&points.set);
        play.grant(1e-4, 1, false)?;
        play.send_states(&points.states)?;
        message = play.session.failure()?.message;
        require(message.contains("I-2"), "a failure by I-2", &message)?;
    }
    Ok(message)
}

/// The forces on a chain that meets the disc by an elastic law.
fn forces_on(bench: &Bench, places: &[[f64; 2]]) -> Result<Vec<[f64; 2]>, Unmet> {
    let points = chain(places);
    let mut play = bench.run_bodies(&held())?;
    play.set(&points.set);
    let (answer, _) = play.measured(0.0, &points.states)?;
    Ok(answer.forces.iter().map(|f| f.force).collect())
}

fn vertex(bench: &Bench) -> Judgement {
    // Flat, bent towards the disc and away from it by up to a hundredth of a degree.
    for lift in [0.0, 1e-12, -1e-12, 1e-8, -1e-8, 1e-6, -1e-6] {
        for off in [0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-6, -1e-6] {
            let places = [[-0.05, HEIGHT], [off, HEIGHT + lift], [0.06, HEIGHT]];
            let got = forces_on(bench, &places)?.iter().map(|f| f[1]).sum();
            let want = STIFFNESS * (OVERLAP - lift);
            near("force on all", got, want, 1e-4 * want)?;
        }
    }
    Ok("49 vertices".into())
}
