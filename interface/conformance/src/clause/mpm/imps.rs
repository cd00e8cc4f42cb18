//! Section 6: which points are identified, and when they are chosen anew.

use std::collections::BTreeMap;

use interface::config::GroupConfig;
use interface::message::wire::{EnvelopeVertex, flags};
use interface::transport::raw::Payload;

use super::scene::{
    DENSITY, DT, MASS, MODULI, RADIUS, SKIN, SPACING, block, material, points, scene, single,
};
use crate::bench::{Bench, ContinuumRun, around_all, outline};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "I-8a",
        "generations count from 1, by 1 for every set, also an empty or the same one",
        generations,
    )
    .mutant("counts sets by two", || {
        Flaw::set(|header, _| {
            if header.set > 1 {
                header.set += 1;
            }
        })
    }),
    Clause::must("I-2g", "ids increase strictly", ids).mutant(
        "exchanges the ids of two points",
        || {
            Flaw::set(|_, set| {
                if let [a, b, ..] = &mut set[..] {
                    std::mem::swap(&mut a.id, &mut b.id);
                }
            })
        },
    ),
    Clause::must(
        "I-2h",
        "the set has radius, mass and group of each point",
        infos,
    )
    .after(&["I-2g"])
    .mutant("reports too large masses", || {
        Flaw::set(|_, set| {
            for info in set {
                info.mass *= 1.5;
            }
        })
    }),
    Clause::must(
        "I-9b",
        "states are in the order of the set, and a point keeps its id",
        slots,
    )
    .after(&["I-2g"])
    .mutant("exchanges the states of two points", || {
        Flaw::states(|_, states| {
            if states.len() > 1 {
                states.swap(0, 1);
            }
        })
    }),
    Clause::must(
        "I-7a",
        "the set has all points within reach, radius and skin, and all points inside a body",
        reach,
    )
    .after(&["I-9b"])
    .mutant("uses half of the reach of a segment", || {
        Flaw::envelopes(|_, vertices| {
            let bodies: Vec<u64> = vertices.iter().map(|v| v.body).collect();
            for vertex in vertices {
                if bodies.iter().filter(|body| **body == vertex.body).count() == 2 {
                    vertex.reach *= 0.5;
                }
            }
        })
    }),
    Clause::must(
        "I-6a",
        "asks for envelopes before a point has used up the skin",
        points_travel,
    )
    .after(&["I-9b"])
    .mutant("lets points use up more than the skin", || {
        let inbound = Flaw::config(|config: &mut interface::config::MpmConfig| {
            for group in &mut config.groups {
                if let Some(radius) = &mut group.contact_radius {
                    let shrunk = *radius / change::SHRUNK;
                    config.skin = config.skin.max(0.02 + *radius - shrunk);
                    *radius = shrunk;
                }
            }
        });
        let outbound = Flaw::outbound(|mut message| {
            match &mut message.payload {
                Payload::Set(set) => set
                    .iter_mut()
                    .for_each(|info| info.radius *= change::SHRUNK),
                Payload::Report(reports) => reports
                    .iter_mut()
                    .for_each(|report| report.limits.radius_min *= change::SHRUNK),
                _ => {}
            }
            vec![message]
        });
        inbound.with(outbound)
    }),
    Clause::must(
        "I-6b",
        "asks for envelopes when bodies have used up the skin",
        bodies_travel,
    )
    .after(&["I-6a"])
    .mutant("does not look how far bodies have moved", || {
        Flaw::forces(|header, _| {
            if header.travel < 0.5 {
                header.travel = 0.0;
            }
        })
    }),
    Clause::should(
        "I-6c",
        "asks for envelopes at most twice as often as needed",
        seldom,
    )
    .mutant("asks for envelopes in every step", || {
        Flaw::forces(|header, _| {
            if header.travel.is_finite() {
                header.travel = 10.0;
            }
        })
    }),
    Clause::must("I-9c", "a set can have ten thousand points", many)
        .after(&["I-9b"])
        .mutant("sends five thousand states at most", || {
            Flaw::states(|header, states| {
                states.truncate(5000);
                header.count = states.len() as u64;
            })
        }),
];

/// Travel of bodies by which a new set is due in the next step, whatever the skin.
const FAR: f64 = 1.0;

fn generations(bench: &Bench) -> Judgement {
    let config = scene(vec![block([0.4; 2], [0.0; 2])]);
    let mut flow = bench.run_continuum(&config)?;
    flow.travel = FAR;
    flow.grant(DT, 5, false)?;
    let mut sets = 0;
    for round in 0..5 {
        flow.outlines = if round == 2 {
            Vec::new()
        } else {
            around_all(&config)
        };
        let shown = flow.exchange()?;
        if let Some(header) = shown.new_set {
            sets += 1;
            let told = (header.set, shown.header.set, header.flags);
            require(
                told == (sets, sets, flags::NEW_SET),
                format_args!("set {sets} and states of set {sets}, both with NEW_SET"),
                format_args!("set {}, states of set {}, flags {}", told.0, told.1, told.2),
            )
            .map_err(|e| e.at(shown.step.index))?;
        }
        let flagged = shown.header.flags & flags::NEW_SET != 0;
        require(
            flagged == shown.new_set.is_some() && flow.generation() == sets,
            format_args!("states of set {sets}"),
            format_args!("{:?}", shown.header),
        )
        .map_err(|e| e.at(shown.step.index))?;
    }
    let rebuilds = flow.report()?.report.rebuilds;
    require(
        rebuilds == sets,
        format_args!("{sets} sets in the report"),
        rebuilds,
    )?;
    Ok(format!("{sets} sets"))
}

fn ids(bench: &Bench) -> Judgement {
    let config = scene(vec![block([0.2; 2], [0.0; 2]), block([0.6; 2], [0.0; 2])]);
    let mut flow = bench.run_continuum(&config)?;
    flow.travel = FAR;
    flow.grant(DT, 3, false)?;
    for round in 0..3 {
        // All, then some of them, then all.
        flow.outlines = if round == 1 {
            outline(0, 0.01, &[[0.3, 0.3]])
        } else {
            around_all(&config)
        };
        let step = flow.exchange()?.step.index;
        let falls = flow.imps().windows(2).find(|pair| pair[0].id >= pair[1].id);
        require(falls.is_none(), "rising ids", format_args!("{falls:?}"))
            .map_err(|e| e.at(step))?;
        let enough = flow.imps().len() == 128 || (round == 1 && flow.imps().len() > 1);
        require(enough, "128 points, or some", flow.imps().len()).map_err(|e| e.at(step))?;
    }
    Ok("128 points in 3 sets".into())
}

fn infos(bench: &Bench) -> Judgement {
    let mut config = scene(vec![block([0.2; 2], [0.0; 2]), block([0.6; 2], [0.0; 2])]);
    config.materials.push(material(2.0 * DENSITY, MODULI));
    config.groups[1] = GroupConfig {
        material: 1,
        contact_radius: Some(0.8 * RADIUS),
        ..config.groups[1].clone()
    };
    let mut flow = bench.run_continuum(&config)?;
    flow.grant(DT, 1, false)?;
    let shown = flow.exchange()?;
    let mut of_group = [0, 0];
    for (info, state) in flow.imps().iter().zip(&shown.states) {
        let second = state.position[0] > 0.5;
        let (radius, mass) = if second {
            (0.8 * RADIUS, 2.0 * MASS)
        } else {
            (RADIUS, MASS)
        };
        require(
            info.group == u32::from(second),
            u32::from(second),
            info.group,
        )?;
        near("radius in m", info.radius, radius, 0.0)?;
        near("mass in kg/m", info.mass, mass, 1e-12 * mass)?;
        of_group[usize::from(second)] += 1;
    }
    require(
        of_group == [64, 64],
        "64 of each group",
        format_args!("{of_group:?}"),
    )?;
    Ok("128 points of 2 groups".into())
}

fn slots(bench: &Bench) -> Judgement {
    let velocity = [0.7, -0.4];
    let config = scene(vec![block([0.3, 0.5], velocity)]);
    let mut flow = bench.run_continuum(&config)?;
    flow.travel = FAR;
    flow.grant(DT, 6, false)?;
    let mut start: BTreeMap<u64, [f64; 2]> = BTreeMap::new();
    for round in 0..6 {
        flow.outlines = if round % 2 == 1 {
            outline(0, 0.03, &[[0.43, 0.62]])
        } else {
            around_all(&config)
        };
        let shown = flow.exchange()?;
        for (info, state) in flow.imps().iter().zip(&shown.states) {
            let t = shown.step.time;
            let x0 = *start.entry(info.id).or_insert(state.position);
            for i in 0..2 {
                // Points are 25 mm apart; the flight is exact to rounding, which T-1a judges.
                let x = x0[i] + t * velocity[i];
                near("position in m", state.position[i], x, 1e-6)
                    .map_err(|e| e.at(shown.step.index))?;
            }
        }
    }
    Ok(format!("{} points in 6 sets", start.len()))
}

/// Distance of a point to a segment in m.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (ab, ap) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = ab[0] * ab[0] + ab[1] * ab[1];
    let s = if square > 0.0 {
        ((ap[0] * ab[0] + ap[1] * ab[1]) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (ap[0] - s * ab[0]).hypot(ap[1] - s * ab[1])
}

/// Distance of a point to a body's outline, below zero inside a polygon.
fn signed_distance(p: [f64; 2], vertices: &[EnvelopeVertex]) -> f64 {
    let n = vertices.len();
    let mut inside = false;
    let mut least = f64::INFINITY;
    for k in 0..n {
        let (a, b) = (vertices[k].position, vertices[(k + 1) % n].position);
        least = least.min(distance(p, a, b));
        if (a[1] > p[1]) != (b[1] > p[1])
            && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        {
            inside = !inside;
        }
    }
    if inside && n > 2 { -least } else { least }
}

/// The outlines that sets are chosen by: name, and bodies.
fn outlines() -> Vec<(&'static str, Vec<EnvelopeVertex>)> {
    let arrow = [[0.3, 0.3], [0.8, 0.45], [0.3, 0.6], [0.45, 0.45]];
    let mut backwards = arrow;
    backwards.reverse();
    let two = [
        outline(0, 0.05, &[[0.2, 0.8]]),
        outline(1, 0.0, &[[0.15, 0.75], [0.5, 0.9]]),
    ];
    vec![
        ("a disc", outline(0, 0.1, &[[0.4, 0.6]])),
        ("a point without reach", outline(0, 0.0, &[[0.5, 0.5]])),
        ("a segment", outline(0, 0.03, &[[0.1, 0.2], [0.9, 0.7]])),
        (
            "a triangle",
            outline(0, 0.02, &[[0.2, 0.2], [0.7, 0.3], [0.3, 0.8]]),
        ),
        ("a concave polygon", outline(0, 0.01, &arrow)),
        ("the same clockwise", outline(0, 0.01, &backwards)),
        (
            "a polygon around all",
            outline(0, 0.0, &[[-3.0, -3.0], [4.0, -3.0], [0.5, 6.0]]),
        ),
        ("a disc far away", outline(0, 0.1, &[[7.0, 7.0]])),
        ("two bodies", two.concat()),
        ("none", Vec::new()),
    ]
}

fn reach(bench: &Bench) -> Judgement {
    // Points all over the domain, by a sequence that fills it evenly, wherever edges run.
    let place = |k: u32| {
        [0.754_877_666, 0.569_840_291].map(|a| 0.05 + 0.9 * (0.5 + f64::from(k) * a).fract())
    };
    let positions: Vec<[f64; 2]> = (0..500).map(place).collect();
    let config = scene(vec![GroupConfig {
        spacing: interface::config::Spacing::Distance(0.2 * SPACING),
        ..points(&positions)
    }]);
    let mut flow = bench.run_continuum(&config)?;
    flow.travel = FAR;
    let cases = outlines();
    flow.grant(DT, 1 + cases.len() as u64, false)?;
    let all = flow.exchange()?;
    let everyone: Vec<(u64, [f64; 2])> = flow
        .imps()
        .iter()
        .zip(&all.states)
        .map(|(info, state)| (info.id, state.position))
        .collect();
    require(everyone.len() == 500, "500 points", everyone.len())?;
    let mut chosen = 0;
    for (name, bodies) in cases {
        flow.outlines = bodies;
        let shown = flow.exchange()?;
        require(shown.new_set.is_some(), "a new set", "the old one")
            .map_err(|e| e.at(shown.step.index))?;
        let mut set = flow.imps().iter().map(|info| info.id).peekable();
        for &(id, position) in &everyone {
            let bodies = flow.outlines.chunk_by(|a, b| a.body == b.body);
            let beyond = bodies
                .map(|v| signed_distance(position, v) - v[0].reach - RADIUS - SKIN)
                .fold(f64::INFINITY, f64::min);
            let there = set.next_if_eq(&id).is_some();
            chosen += u64::from(there);
            // At the very edge rounding decides.
            require(
                there == (beyond <= 0.0) || beyond.abs() < 1e-12,
                format_args!(
                    "{name}: point {id} at {position:?}, {beyond:.3e} m beyond, left out or in"
                ),
                if there {
                    "in the set"
                } else {
                    "not in the set"
                },
            )
            .map_err(|e| e.at(shown.step.index))?;
        }
    }
    Ok(format!("500 points, 10 outlines, {chosen} chosen"))
}

/// Largest travel with which the set stays, in m.
const ALLOWED: f64 = SKIN - 0.5 * RADIUS;

fn points_travel(bench: &Bench) -> Judgement {
    let velocity = [0.6, 0.8];
    let config = scene(vec![block([0.3; 2], velocity)]);
    let mut flow = bench.run_continuum(&config)?;
    let mut chosen: Vec<[f64; 2]> = Vec::new();
    let mut largest: f64 = 0.0;
    // 1 m/s and a tenth of a millisecond: 0.1 mm a step, once across the skin and back to its half.
    let (dt, steps) = (DT, 220);
    flow.run(dt, steps, |flow, shown| {
        if shown.new_set.is_some() {
            chosen = shown.states.iter().map(|s| s.position).collect();
        } else {
            let travels = shown
                .states
                .iter()
                .zip(&chosen)
                .map(|(s, then)| (s.position[0] - then[0]).hypot(s.position[1] - then[1]));
            let travel = travels.fold(0.0, f64::max);
            largest = largest.max(travel);
            require(
                travel <= ALLOWED * (1.0 + 1e-9),
                format_args!("a new set when a point has moved {ALLOWED:.4e} m"),
                format_args!("none after {travel:.4e} m"),
            )
            .map_err(|e| e.at(shown.step.index))?;
        }
        Ok(flow.no_forces())
    })?;
    Ok(format!(
        "{} sets, travel up to {largest:.4e} m of {ALLOWED:.4e}",
        flow.generation()
    ))
}

fn bodies_travel(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
    let mut kept = 0;
    for share in [0.5, 0.999, 1.001, 0.3, 7.0, 0.0] {
        flow.travel = share * ALLOWED;
        flow.grant(DT, 2, false)?;
        flow.exchange()?;
        // The second step is after forces with this travel.
        let shown = flow.exchange()?;
        let asked = !shown.asked.is_empty() && shown.new_set.is_some();
        kept += u64::from(!asked);
        require(
            asked || share <= 1.0,
            format_args!("a new set when bodies have moved {:.4e} m", flow.travel),
            "the old one",
        )
        .map_err(|e| e.at(shown.step.index))?;
        flow.travel = 0.0;
        flow.report()?;
    }
    Ok(format!("kept {kept} times within the skin"))
}

fn seldom(bench: &Bench) -> Judgement {
    let velocity = [0.6, 0.8];
    let mut flow = bench.run_continuum(&scene(vec![block([0.3; 2], velocity)]))?;
    let steps = 400;
    flow.coast(DT, steps)?;
    let needed = steps as f64 * DT / ALLOWED;
    let sets = flow.generation();
    require(
        sets as f64 <= 1.0 + 2.0 * needed,
        format_args!("at most {:.0} sets", 1.0 + 2.0 * needed),
        sets,
    )?;
    Ok(format!("{sets} sets, {:.0} needed", 1.0 + needed.floor()))
}

fn many(bench: &Bench) -> Judgement {
    let mut config = scene(vec![block([0.2; 2], [0.5, 0.0])]);
    config.groups[0].fill = interface::config::Fill::Rectangle {
        lower: [0.25; 2],
        upper: [0.75; 2],
    };
    config.groups[0].spacing = interface::config::Spacing::Counts([100, 100]);
    let mut flow: ContinuumRun = bench.run_continuum(&config)?;
    let start = flow.free_step(DT)?.0;
    flow.coast(DT, 2)?;
    let end = flow.free_step(DT)?.0;
    require(
        end.states.len() == 10_000,
        "10 000 states",
        end.states.len(),
    )?;
    for (a, b) in start.states.iter().zip(&end.states) {
        let x = a.position[0] + 3.0 * DT * 0.5;
        near("position in m", b.position[0], x, 1e-9).map_err(|e: Unmet| e)?;
    }
    Ok("10 000 states, 4 steps".into())
}
