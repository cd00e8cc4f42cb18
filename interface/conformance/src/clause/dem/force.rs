//! Section 7: the force on a point, by closed forms.

use interface::config::{BodyConfig, BodyShape, Motion};
use interface::message::wire::ImpForce;

use super::scene::{RADIUS, SPHERO, STIFFNESS, block_or_disc, body, elastic, scene};
use crate::bench::{Bench, Points};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Largest, Unmet, near, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "F-7a",
        "the force is k_n xi on the point, away from the body",
        geometry,
    )
    .mutant("sends the force on the body, at the start", || {
        // Later, points would be pulled through bodies, which ends the run.
        Flaw::forces(|header, forces| {
            if header.step == 0 {
                change::scale(forces, -1.0);
            }
        })
    }),
    Clause::must("F-7b", "it is linear in k_n", linear)
        .after(&["F-7a"])
        .mutant("limits the stiffness to 100 kN/m", || {
            change::law(|k, _, _, _| *k = k.min(1e5))
        }),
    Clause::must("F-7c", "forces of two bodies add up", two_bodies)
        .after(&["F-7a"])
        .mutant("forgets the second of two bodies", || {
            Flaw::forces(|_, forces| {
                for force in forces.iter_mut().filter(|f| f.stiffness == 1.2e5) {
                    force.force[1] = 0.0;
                }
            })
        }),
    Clause::must(
        "F-7e",
        "a point on the outline is pushed outwards",
        on_the_outline,
    )
    .needs(&["shape:rectangle"])
    .after(&["F-7a"])
    .mutant("has no normal on the outline", || {
        Flaw::forces(|_, forces| {
            for force in forces
                .iter_mut()
                .filter(|f| (f.force[1] - 1800.0).abs() < 1e-6)
            {
                force.force = [0.0; 2];
            }
        })
    }),
    Clause::must("F-8a", "without overlap the force is exactly 0", no_contact).mutant(
        "pushes before contact",
        || {
            Flaw::forces(|_, forces| {
                for force in forces
                    .iter_mut()
                    .filter(|f| f.force == [0.0; 2] && f.stiffness > 0.0)
                {
                    force.force = [0.0, 1e-30];
                }
            })
        },
    ),
    Clause::must("F-8b", "forces do not accumulate from step to step", again)
        .after(&["F-7a", "J-1b", "T-6a", "T-6b"])
        .mutant("adds to the forces of points that stay", || {
            let (count, stayed) = change::shared(0);
            let mut last = Vec::new();
            let flaw = Flaw::states(move |_, states| {
                let stays = !states.is_empty() && *states == last;
                count.set(if stays { count.get() + 1 } else { 0 });
                last.clone_from(states);
            });
            flaw.with(Flaw::forces(move |_, forces| {
                if stayed.get() >= 2 {
                    change::scale(forces, 1.0 + 1e-9);
                }
            }))
        }),
    Clause::must(
        "F-7d",
        "forces belong to the positions of their own step",
        lag,
    )
    .after(&["F-7a", "F-8b", "J-1b"])
    .mutant("answers with the forces of the last step", || {
        let mut last: Vec<ImpForce> = Vec::new();
        Flaw::forces(move |_, forces| {
            let now = forces.clone();
            if last.len() == forces.len() {
                forces.clone_from(&last);
            }
            last = now;
        })
    }),
    Clause::must(
        "F-7f",
        "forces do not change when the scene is moved",
        translated,
    )
    .after(&["F-7a"])
    .mutant("loses digits far from the origin", || {
        let (far, lost) = change::shared(false);
        let flaw = Flaw::states(move |_, states| {
            far.set(states.iter().any(|s| s.position[0].abs() > 100.0));
        });
        flaw.with(Flaw::forces(move |_, forces| {
            if lost.get() {
                change::scale(forces, 1.001);
            }
        }))
    }),
    Clause::must("F-7g", "forces turn with the scene", rotated)
        .needs(&["shape:rectangle"])
        .after(&["F-7a"])
        .mutant("does not turn bodies", || {
            Flaw::bodies_config(|config| {
                // Except the bodies whose envelopes are checked.
                if config.bodies.len() > 2 {
                    config.bodies.iter_mut().for_each(|body| body.angle = 0.0);
                }
            })
        }),
    Clause::must(
        "F-5a",
        "stiffness is above 0 where there is a force",
        stiffness_positive,
    )
    .mutant("gives no stiffness to a point that is pushed", || {
        change::stiffness(|force| force.force != [0.0; 2])
    }),
    Clause::must(
        "F-6a",
        "stiffness is the sum of k_n of the bodies within reach",
        reach,
    )
    .after(&["F-5a"])
    .mutant(
        "gives no stiffness to a point that is not yet pushed",
        || change::stiffness(|force| force.force == [0.0; 2]),
    ),
    Clause::must("I-9a", "slots follow each new set", slots)
        .after(&["F-7a", "F-7d"])
        .mutant("reverses the slots of a later set", || {
            Flaw::forces(|header, forces| {
                if header.set > 1 {
                    forces.reverse();
                }
            })
        }),
    Clause::must(
        "I-9d",
        "radius and mass follow a point's id through new sets",
        radii,
    )
    .after(&["F-7a", "F-7d", "I-9a"])
    .mutant("keeps radii by slot", || {
        let mut first: Vec<f64> = Vec::new();
        Flaw::set(move |_, set| {
            for (slot, info) in set.iter_mut().enumerate() {
                match first.get(slot) {
                    // A set that must be refused is not changed.
                    Some(radius) if info.radius > 0.0 => info.radius = *radius,
                    Some(_) => {}
                    None => first.push(info.radius),
                }
            }
        })
    }),
    Clause::must(
        "F-9a",
        "travel is an upper bound of the displacement of any surface",
        travel,
    )
    .needs(&["motion:free"])
    .after(&["T-1a"])
    .mutant("reports half its travel", || {
        Flaw::forces(|header, _| header.travel *= 0.5)
    }),
];

/// A body beside a point: where on the outline the point is nearest, and in which direction it lies from there.
struct Case {
    name: &'static str,
    shape: BodyShape,
    nearest: [f64; 2],
    normal: [f64; 2],
    /// Whether the point is on the other side of the outline by this much (m) at zero distance of the table.
    inside: f64,
}

impl Case {
    fn needs(&self) -> &'static str {
        match self.shape {
            BodyShape::Disc => "shape:disc",
            BodyShape::Segment { .. } => "shape:segment",
            BodyShape::Rectangle { .. } => "shape:rectangle",
            _ => "shape:polygon",
        }
    }
}

/// The table of geometries: edges, caps, corners, a notch, and a point within a polygon.
fn cases() -> Vec<Case> {
    let (s, c) = (30f64.to_radians().sin(), 30f64.to_radians().cos());
    let d = 0.5f64.sqrt();
    let rectangle = || BodyShape::Rectangle {
        width: 0.2,
        height: 0.1,
    };
    let segment = || BodyShape::Segment {
        ends: [[-0.1, 0.0], [0.1, 0.0]],
    };
    // An L, its notch at (0.05, 0.05).
    let notched = || BodyShape::Polygon {
        vertices: vec![
            [-0.1, -0.1],
            [0.15, -0.1],
            [0.15, 0.05],
            [0.05, 0.05],
            [0.05, 0.15],
            [-0.1, 0.15],
        ],
    };
    let case = |name, shape, nearest, normal, inside| Case {
        name,
        shape,
        nearest,
        normal,
        inside,
    };
    vec![
        case("disc", BodyShape::Disc, [0.0, 0.0], [c, s], 0.0),
        case("disc, below", BodyShape::Disc, [0.0, 0.0], [0.0, -1.0], 0.0),
        case("side of a segment", segment(), [0.03, 0.0], [0.0, 1.0], 0.0),
        case(
            "other side of a segment",
            segment(),
            [-0.06, 0.0],
            [0.0, -1.0],
            0.0,
        ),
        case("cap of a segment", segment(), [0.1, 0.0], [c, s], 0.0),
        case("edge", rectangle(), [0.02, 0.05], [0.0, 1.0], 0.0),
        case("corner", rectangle(), [0.1, 0.05], [d, d], 0.0),
        case("corner, flat", rectangle(), [0.1, -0.05], [c, -s], 0.0),
        case("near the notch", notched(), [0.095, 0.05], [0.0, 1.0], 0.0),
        case(
            "near the notch, other edge",
            notched(),
            [0.05, 0.095],
            [1.0, 0.0],
            0.0,
        ),
        case(
            "within a polygon",
            rectangle(),
            [0.02, 0.05],
            [0.0, 1.0],
            0.035,
        ),
    ]
}

/// Overlaps in m: from a billionth to a third of the point's radius.
const OVERLAPS: [f64; 4] = [1e-9, 1e-6, 1e-3, 0.3 * RADIUS];

/// Name of a case, normal, and overlap in m.
type Expected = (String, [f64; 2], f64);

/// Every case with every overlap, each at a place of its own, a metre apart: bodies, points, and what is expected.
fn table(bench: &Bench, overlaps: &[f64]) -> (Vec<BodyConfig>, Points, Vec<Expected>) {
    let (mut bodies, mut points, mut expected) = (Vec::new(), Points::new(), Vec::new());
    for case in cases().into_iter().filter(|case| bench.takes(case.needs())) {
        for &overlap in overlaps {
            let k = bodies.len();
            let at = [(k % 8) as f64 - 4.0, (k / 8) as f64 - 4.0];
            bodies.push(body(case.shape.clone(), at, Motion::Fixed));
            let distance = SPHERO + RADIUS - overlap - case.inside;
            let x = |i: usize| at[i] + case.nearest[i] + distance * case.normal[i];
            points = points.with([x(0), x(1)], [0.0; 2], RADIUS, 0.5);
            let name = format!("{} at an overlap of {overlap:.1e} m", case.name);
            expected.push((name, case.normal, overlap + case.inside));
        }
    }
    (bodies, points, expected)
}

fn geometry(bench: &Bench) -> Judgement {
    let (bodies, points, expected) = table(bench, &OVERLAPS);
    let mut play = bench.run_bodies(&scene(bodies, elastic(STIFFNESS)))?;
    play.set(&points.set);
    let (answer, _) = play.step(0.0, &points.states)?;
    // Coordinates of up to 6 m carry the overlap to a few of their ulp.
    let blur = 16.0 * f64::EPSILON * 6.0 * STIFFNESS;
    let mut largest = Largest::default();
    for ((name, normal, overlap), got) in expected.iter().zip(&answer.forces) {
        let force = STIFFNESS * overlap;
        for (i, direction) in ["x", "y"].into_iter().enumerate() {
            let what = format!("{name}: force along {direction}");
            let (got, want) = (got.force[i], force * normal[i]);
            largest.near(&what, got, want, blur + 1e-12 * force, STIFFNESS * RADIUS)?;
        }
    }
    Ok(format!(
        "{} contacts, within {largest} of k_n r_p",
        expected.len()
    ))
}

fn no_contact(bench: &Bench) -> Judgement {
    let (bodies, points, expected) = table(bench, &[-1e-9, -1e-3, -0.4 * RADIUS]);
    let outside = |case: &(String, [f64; 2], f64)| case.2 <= 0.0;
    let mut play = bench.run_bodies(&scene(bodies, elastic(STIFFNESS)))?;
    play.set(&points.set);
    let (answer, _) = play.step(0.0, &points.states)?;
    let mut count = 0;
    for (case, got) in expected
        .iter()
        .zip(&answer.forces)
        .filter(|(case, _)| outside(case))
    {
        count += 1;
        let exact = got.force == [0.0; 2];
        require(
            exact,
            format_args!("{}: (0, 0)", case.0),
            format_args!("{:?}", got.force),
        )?;
    }
    require(count >= 6, "a table with gaps", count)?;
    Ok(format!("{count} gaps from 1e-9 m"))
}

/// The overlap table's first points in one answer, for a law of this stiffness.
fn forces_of(bench: &Bench, stiffness: f64) -> Result<Vec<ImpForce>, Unmet> {
    let (bodies, points, _) = table(bench, &[1e-3]);
    let mut play = bench.run_bodies(&scene(bodies, elastic(stiffness)))?;
    play.set(&points.set);
    Ok(play.step(0.0, &points.states)?.0.forces)
}

fn linear(bench: &Bench) -> Judgement {
    let once = forces_of(bench, STIFFNESS)?;
    let mut largest = Largest::default();
    for factor in [0.01, 4.0, 1e3] {
        for (one, other) in once.iter().zip(forces_of(bench, factor * STIFFNESS)?) {
            for i in 0..2 {
                let want = factor * one.force[i];
                let scale = factor * STIFFNESS * RADIUS;
                largest.near("force", other.force[i], want, 1e-12 * scale, scale)?;
            }
        }
    }
    Ok(format!("within {largest} over stiffnesses of 1 to 100 000"))
}

/// A point that two fixed discs press, from the left with `overlap`, from below with twice that (m).
fn between(overlap: f64) -> (Vec<BodyConfig>, Points) {
    let distance = SPHERO + RADIUS;
    let fixed = |at| body(BodyShape::Disc, at, Motion::Fixed);
    let points = Points::new().with([0.0; 2], [0.0; 2], RADIUS, 0.5);
    let (left, below) = (distance - overlap, distance - 2.0 * overlap);
    (vec![fixed([-left, 0.0]), fixed([0.0, -below])], points)
}

fn two_bodies(bench: &Bench) -> Judgement {
    let overlap = 1e-3;
    let (bodies, points) = between(overlap);
    let mut play = bench.run_bodies(&scene(bodies, elastic(STIFFNESS)))?;
    play.set(&points.set);
    let got = play.step(0.0, &points.states)?.0.forces[0].force;
    let force = STIFFNESS * overlap;
    near("force of the left disc", got[0], force, 1e-11 * force)?;
    near(
        "force of the lower disc",
        got[1],
        2.0 * force,
        1e-11 * force,
    )?;
    Ok(format!("{got:?} N/m"))
}

fn again(bench: &Bench) -> Judgement {
    let (bodies, points, _) = table(bench, &OVERLAPS);
    let mut play = bench.run_bodies(&scene(bodies, elastic(STIFFNESS)))?;
    play.set(&points.set);
    let first = play.step(1e-4, &points.states)?.0.forces;
    for _ in 0..3 {
        let (answer, _) = play.step(1e-4, &points.states)?;
        for (one, other) in first.iter().zip(&answer.forces) {
            let same = one.force == other.force;
            require(
                same,
                format_args!("{:?}", one.force),
                format_args!("{:?}", other.force),
            )
            .map_err(|e| e.at(answer.step.index))?;
        }
    }
    Ok("the same forces in four steps".into())
}

fn lag(bench: &Bench) -> Judgement {
    let fixed = body(BodyShape::Disc, [0.0; 2], Motion::Fixed);
    let mut play = bench.run_bodies(&scene(vec![fixed], elastic(STIFFNESS)))?;
    let at =
        |overlap: f64| Points::new().with([0.0, SPHERO + RADIUS - overlap], [0.0; 2], RADIUS, 0.5);
    play.set(&at(0.0).set);
    let overlaps = [1e-3, 1e-3, 2e-3, 1e-3, 1e-3, -1e-3, 1e-3];
    for overlap in overlaps {
        let (answer, _) = play.step(1e-4, &at(overlap).states)?;
        let want = STIFFNESS * f64::max(overlap, 0.0);
        // The clause is about the step of the force, not its exact size, because a dashpot may add to it.
        let got = answer.forces[0].force[1];
        near("force along y", got, want, 0.3 * STIFFNESS * 1e-3)
            .map_err(|e| e.at(answer.step.index))?;
    }
    Ok(format!("{} steps answered in the step", overlaps.len()))
}

fn on_the_outline(bench: &Bench) -> Judgement {
    let rectangle = BodyShape::Rectangle {
        width: 0.25,
        height: 0.125,
    };
    let fixed = body(rectangle, [0.0; 2], Motion::Fixed);
    // Numbers without rounding: the point is on the upper edge to the last bit.
    let points = Points::new().with([0.03125, 0.0625], [0.0; 2], RADIUS, 0.5);
    let mut play = bench.run_bodies(&scene(vec![fixed], elastic(STIFFNESS)))?;
    play.set(&points.set);
    let got = play.step(0.0, &points.states)?.0.forces[0].force;
    let want = STIFFNESS * (SPHERO + RADIUS);
    near("force along x", got[0], 0.0, 1e-12 * want)?;
    near("force along y", got[1], want, 1e-12 * want)?;
    Ok(format!("{:.1} N/m outwards", got[1]))
}

/// Forces of the table after the whole scene, bodies and points, has been moved by `place`.
fn moved(
    bench: &Bench,
    place: impl Fn([f64; 2]) -> [f64; 2],
    angle: f64,
) -> Result<(Vec<ImpForce>, Vec<ImpForce>), Unmet> {
    let (mut bodies, mut points, _) = table(bench, &[1e-3]);
    let answer = |bodies: &[BodyConfig], points: &Points| -> Result<Vec<ImpForce>, Unmet> {
        let mut play = bench.run_bodies(&scene(bodies.to_vec(), elastic(STIFFNESS)))?;
        play.set(&points.set);
        Ok(play.step(0.0, &points.states)?.0.forces)
    };
    let plain = answer(&bodies, &points)?;
    for body in &mut bodies {
        body.position = place(body.position);
        body.angle += angle;
    }
    for state in &mut points.states {
        state.position = place(state.position);
    }
    Ok((plain, answer(&bodies, &points)?))
}

fn translated(bench: &Bench) -> Judgement {
    let far = 1024.0;
    let (plain, moved) = moved(bench, |[x, y]| [x + far, y - far], 0.0)?;
    // Positions keep their digits to an ulp of the distance, twice in the overlap, and so does the normal.
    let tolerance = 16.0 * f64::EPSILON * far * STIFFNESS;
    let mut largest = Largest::default();
    for (one, other) in plain.iter().zip(&moved) {
        for i in 0..2 {
            largest.near(
                "force",
                other.force[i],
                one.force[i],
                tolerance,
                STIFFNESS * RADIUS,
            )?;
        }
    }
    Ok(format!("within {largest} of k_n r_p, 1.4 km away"))
}

fn rotated(bench: &Bench) -> Judgement {
    let (s, c) = 0.7f64.sin_cos();
    let turn = |[x, y]: [f64; 2]| [c * x - s * y, s * x + c * y];
    let (plain, turned) = moved(bench, turn, 0.7)?;
    let tolerance = 64.0 * f64::EPSILON * 8.0 * STIFFNESS;
    let mut largest = Largest::default();
    for (one, other) in plain.iter().zip(&turned) {
        let want = turn(one.force);
        for i in 0..2 {
            largest.near(
                "force",
                other.force[i],
                want[i],
                tolerance,
                STIFFNESS * RADIUS,
            )?;
        }
    }
    Ok(format!("within {largest} of k_n r_p, turned by 0.7"))
}

fn stiffness_positive(bench: &Bench) -> Judgement {
    let (bodies, points, expected) = table(bench, &OVERLAPS);
    let mut play = bench.run_bodies(&scene(bodies, elastic(STIFFNESS)))?;
    play.set(&points.set);
    let (answer, _) = play.step(0.0, &points.states)?;
    for (case, force) in expected.iter().zip(&answer.forces) {
        let enough = force.stiffness > 0.0 || force.force == [0.0; 2];
        require(enough, format_args!("{}: above 0", case.0), force.stiffness)?;
    }
    Ok(format!("{} contacts", expected.len()))
}

fn reach(bench: &Bench) -> Judgement {
    // Twice within reach, pressing or not; twice beyond.
    // (The lower disc is twice as far.)
    let gaps = [-0.1, 0.2, 0.6, 2.0];
    for (gap, count) in gaps.into_iter().zip([2.0, 2.0, 0.0, 0.0]) {
        let (bodies, points) = between(-gap * RADIUS);
        let mut play = bench.run_bodies(&scene(bodies, elastic(STIFFNESS)))?;
        play.set(&points.set);
        let got = play.step(0.0, &points.states)?.0.forces[0].stiffness;
        let what = format!("stiffness of two bodies at a gap of {gap} r_p");
        near(&what, got, count * STIFFNESS, 1e-9 * STIFFNESS)?;
    }
    Ok("k_n of each body up to a gap of r_p/2".into())
}

fn slots(bench: &Bench) -> Judgement {
    // Discs in a row, points above them at different overlaps; every normal is along y.
    let bodies = (0..4).map(|k| body(BodyShape::Disc, [f64::from(k), 0.0], Motion::Fixed));
    let at = |k: u32| {
        let overlap = 1e-4 * f64::from(k + 1);
        ([f64::from(k), SPHERO + RADIUS - overlap], overlap)
    };
    let mut play = bench.run_bodies(&scene(bodies.collect(), elastic(STIFFNESS)))?;
    // Every set has other points in other slots.
    for ids in [vec![0, 1, 2, 3], vec![1, 3], vec![0, 2, 3], vec![3]] {
        let mut points = Points::new();
        for &k in &ids {
            points = points.with(at(k).0, [0.0; 2], RADIUS, 0.5);
        }
        for (info, &k) in points.set.iter_mut().zip(&ids) {
            info.id = u64::from(k) + 10;
        }
        play.set(&points.set);
        let (answer, _) = play.step(1e-5, &points.states)?;
        for (&k, force) in ids.iter().zip(&answer.forces) {
            let what = format!("force along y on point {}", k + 10);
            near(&what, force.force[1], STIFFNESS * at(k).1, 1e-9)
                .map_err(|e| e.at(answer.step.index))?;
        }
    }
    Ok("four sets".into())
}

fn radii(bench: &Bench) -> Judgement {
    let held = |k| body(BodyShape::Disc, [f64::from(k), 0.0], Motion::Fixed);
    let config = scene((0..3).map(held).collect(), elastic(STIFFNESS));
    let mut play = bench.run_bodies(&config)?;
    for ids in [[0u32, 1, 2].as_slice(), &[1, 2], &[0, 2]] {
        let mut points = Points::new();
        for &k in ids {
            let radius = RADIUS * (1.0 + 0.1 * f64::from(k));
            let at = [f64::from(k), SPHERO + radius - 1e-4];
            points = points.with(at, [0.0; 2], radius, 0.5);
        }
        for (info, &k) in points.set.iter_mut().zip(ids) {
            info.id = u64::from(k);
        }
        play.set(&points.set);
        let (answer, _) = play.step(1e-5, &points.states)?;
        for (&k, force) in ids.iter().zip(&answer.forces) {
            let what = format!("force along y on point {k}");
            near(&what, force.force[1], STIFFNESS * 1e-4, 1e-9)
                .map_err(|e| e.at(answer.step.index))?;
        }
    }
    Ok("three sets of points with radii of their own".into())
}

fn travel(bench: &Bench) -> Judgement {
    let mut runner = block_or_disc(bench, [0.0; 2]);
    runner.velocity = [0.8, -0.6];
    runner.spin = 5.0;
    let mut play = bench.run_bodies(&scene(vec![runner], elastic(STIFFNESS)))?;
    let dt = 1e-3;
    play.grant(dt, 20, false)?;
    let (_, from) = play.envelopes()?;
    let mut least = f64::INFINITY;
    for _ in 0..20 {
        let answer = play.exchange(&[])?;
        let t = play.time();
        // Every point of the surface is a vertex's, carried along and turned, give or take the sphero-radius.
        let (s, c) = (5.0 * t).sin_cos();
        let gone = from.iter().map(|vertex| {
            let [x, y] = vertex.position;
            let (dx, dy) = (c * x - s * y + 0.8 * t - x, s * x + c * y - 0.6 * t - y);
            dx.hypot(dy)
        });
        let gone = gone.fold(0.0, f64::max);
        let said = answer.header.travel;
        require(
            said >= gone * (1.0 - 1e-12),
            format_args!("travel of at least {gone:.6e} m"),
            format_args!("{said:.6e}"),
        )
        .map_err(|e| e.at(answer.step.index))?;
        least = least.min(said / gone);
    }
    play.report()?;
    Ok(format!("at least {least:.3} of what its vertices go"))
}
