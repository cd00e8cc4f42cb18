//! Sections 6 and 7 with `interface` = `segments`: discs on a boundary chain.

use interface::config::{BodyShape, ContactLaw, DemConfig, Interface, Motion};
use interface::message::wire::ImpState;

use super::scene::{OVERLAP, RADIUS, SPHERO, STIFFNESS, body, elastic, law, scene};
use crate::bench::{Bench, Points};
use crate::clause::{Clause, clauses};
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, near};

const NEEDS: &[&str] = &["segments", "shape:disc"];

pub const CLAUSES: &[Clause] = clauses! {
    Must "F-7v" "a force on a segment is shared according to the position of its nearest point" by split,
        needs: NEEDS, after: &["W-2a"];
        - "shares a force on a segment evenly": on_segments(|forces| {
            let mean = [0, 1].map(|i| 0.5 * (forces[0][i] + forces[1][i]));
            if forces[2] == [0.0; 2] {
                (forces[0], forces[1]) = (mean, mean);
            }
        });
        - "gives all of it to the nearer marker": on_segments(|forces| {
            if forces[2] == [0.0; 2] {
                let sum = [0, 1].map(|i| forces[0][i] + forces[1][i]);
                let first = forces[0][1].abs() >= forces[1][1].abs();
                (forces[0], forces[1]) = if first {
                    (sum, [0.0; 2])
                } else {
                    ([0.0; 2], sum)
                };
            }
        });
    Must "F-7w" "a vertex of a chain counts once" by vertex, needs: NEEDS, after: &["W-2a", "F-7v"];
        - "counts a vertex for both of its segments": on_segments(|forces| {
            let all: f64 = forces.iter().map(|f| f[1]).sum();
            if forces[1][1] > 0.99 * all {
                forces[1] = forces[1].map(|f| 2.0 * f);
            }
        });
    Must "F-7x" "the tangential spring moves from segment to segment, and acts on the surface of markers that turn" by handed,
        needs: &["segments", "shape:disc", "feature:friction"], after: &["W-2a", "F-7v", "F-7w"];
        - "loses the spring at a vertex": on_segments(|forces| {
            if forces[0][1] > 0.0 && forces[2][1] == 0.0 {
                forces.iter_mut().for_each(|force| force[0] = 0.0);
            }
        });
        - "does not see markers turn": Flaw::state(|s| s.spin = 0.0);
        - "gives markers no couple": Flaw::force(|f| f.couple = 0.0);
    Must "I-2i" "refuses a link that is not another slot" by nowhere, needs: NEEDS;
        - "ignores links to slots that do not exist": Flaw::set(|_, set| {
            let slots = set.len();
            (1..).zip(set).for_each(|(slot, info)| {
                if info.next as usize > slots || info.next == slot {
                    info.next = 0;
                }
            });
        });
};

/// Changes the forces on three markers of a chain.
fn on_segments(mut change: impl FnMut(&mut [[f64; 2]; 3]) + 'static) -> Flaw {
    let (links, linked) = change::shared(false);
    let flaw = Flaw::set(move |_, set| links.set(set.iter().any(|info| info.next > 0)));
    flaw.with(Flaw::forces(move |_, forces| {
        if let [a, b, c] = &mut forces[..]
            && linked.get()
        {
            let mut three = [a.force, b.force, c.force];
            change(&mut three);
            [a.force, b.force, c.force] = three;
        }
    }))
}

/// A fixed disc at the origin that meets segments by `law`.
fn held(law: ContactLaw) -> DemConfig {
    DemConfig {
        interface: Interface::Segments,
        ..scene(vec![body(BodyShape::Disc, [0.0; 2], Motion::Fixed)], law)
    }
}

/// Height in m of a flat chain over the disc.
const HEIGHT: f64 = SPHERO + RADIUS - OVERLAP;

/// A chain over the disc, from left to right, the material above.
fn chain(places: &[[f64; 2]]) -> Points {
    let mut points = Points::new();
    for &place in places {
        points = points.with(place, [0.0; 2], RADIUS, 0.5);
    }
    let count = places.len() as u32;
    for (slot, info) in (1..).zip(&mut points.set) {
        info.next = if slot < count { slot + 1 } else { 0 };
    }
    points
}

fn nowhere(bench: &Bench) -> Judgement {
    let mut said = String::new();
    for (slot, next) in [(0, 4), (2, 3), (1, u32::MAX)] {
        let mut points = chain(&[[-0.05, HEIGHT], [0.0, HEIGHT], [0.06, HEIGHT]]);
        points.set[slot].next = next;
        let mut play = bench.run_bodies(&held(elastic()))?;
        play.set(&points.set);
        play.grant(1e-4, 1, false)?;
        play.send_states(&points.states)?;
        said = play.session.failure()?.message;
    }
    Ok(said)
}

/// The forces on a chain that meets the disc by an elastic law.
fn forces_on(bench: &Bench, places: &[[f64; 2]]) -> Result<Vec<[f64; 2]>, Unmet> {
    let points = chain(places);
    let mut play = bench.run_bodies(&held(elastic()))?;
    play.set(&points.set);
    let (answer, _) = play.measured(0.0, &points.states)?;
    Ok(answer.forces.iter().map(|f| f.force).collect())
}

fn split(bench: &Bench) -> Judgement {
    let whole = STIFFNESS * OVERLAP;
    for share in [0.25, 0.5, 0.9, 0.01] {
        let (left, right) = (-share * 0.12, (1.0 - share) * 0.12);
        let forces = forces_on(bench, &[[left, HEIGHT], [right, HEIGHT], [0.3, HEIGHT]])?;
        for (slot, own) in [1.0 - share, share, 0.0].into_iter().enumerate() {
            let [x, y] = forces[slot];
            let what = format!("force along y on marker {slot}");
            near(&what, y, own * whole, 1e-9 * whole)?;
            near("force along x", x, 0.0, 1e-9 * whole)?;
        }
    }
    Ok("4 feet".into())
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

fn handed(bench: &Bench) -> Judgement {
    /// k_t in N/m, what the chain moves in a step in m, and how far inside it its surface is.
    const TANGENTIAL: f64 = 3e4;
    const WAY: f64 = 1e-4;
    const SURFACE: f64 = RADIUS - 0.5 * OVERLAP;
    let points = chain(&[[-0.05, HEIGHT], [-4.5 * WAY, HEIGHT], [0.05, HEIGHT]]);
    let mut play = bench.run_bodies(&held(law(TANGENTIAL, 0.9, 0.0)))?;
    play.set(&points.set);
    play.measured(0.0, &points.states)?;
    let dt = 1e-3;
    for n in 0..12 {
        let way = WAY * f64::from(n);
        let moved = |s: &ImpState| ImpState {
            position: [s.position[0] + way, s.position[1]],
            velocity: [WAY / dt, 0.0],
            spin: 0.5 * WAY / SURFACE / dt,
        };
        let states: Vec<ImpState> = points.states.iter().map(moved).collect();
        let (answer, _) = play.measured(dt, &states)?;
        let got: f64 = answer.forces.iter().map(|f| f.force[0]).sum();
        let what = format!("force along the chain after {way:.1e} m");
        near(
            &what,
            got,
            -TANGENTIAL * 1.5 * way,
            1e-6 * 12.0 * TANGENTIAL * WAY,
        )?;
        for force in &answer.forces {
            let want = SURFACE * force.force[0];
            near(
                "couple on a marker",
                force.couple,
                want,
                1e-6 * SURFACE * TANGENTIAL * WAY,
            )?;
        }
    }
    Ok("12 steps over a vertex".into())
}
