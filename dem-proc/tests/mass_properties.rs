//! Area, centroid and inertia of swept shapes against integration line by line.

use std::f64::consts::PI;

use crate::small_scenes::{
    Random, body, configured, polygon_shape, rectangle_shape, scene, segment_shape, spring, star,
};
use interface::config::{BodyInertia, BodyShape};
use interface::solver::DemSolver;

/// A closed outline and a distance from it.
type Part = (Vec<[f64; 2]>, f64);

/// Area, centroid and polar moment about the centroid of what is inside of an outline or within its distance:
/// horizontal lines are cut exactly, and added by the midpoint rule.
fn by_lines(parts: &[Part], lines: usize) -> (f64, [f64; 2], f64) {
    let ends = |sign: f64| {
        let of_part = move |(vertices, a): &Part| {
            let highest = vertices.iter().map(|v| sign * v[1]);
            highest.fold(f64::NEG_INFINITY, f64::max) + a
        };
        sign * parts.iter().map(of_part).fold(f64::NEG_INFINITY, f64::max)
    };
    let [low, high] = [-1.0, 1.0].map(ends);
    let h = (high - low) / lines as f64;
    let (mut area, mut sx, mut sy, mut polar) = (0.0, 0.0, 0.0, 0.0);
    for line in 0..lines {
        let y = low + (line as f64 + 0.5) * h;
        let mut spans: Vec<[f64; 2]> = Vec::new();
        for (vertices, a) in parts {
            let (n, a) = (vertices.len(), *a);
            let mut crossings: Vec<f64> = Vec::new();
            for i in 0..n {
                let (p, q) = (vertices[i], vertices[(i + 1) % n]);
                if (p[1] > y) != (q[1] > y) {
                    crossings.push(p[0] + (y - p[1]) / (q[1] - p[1]) * (q[0] - p[0]));
                }
                // The capsule around an edge is convex: its cut is from the smallest to the largest of all cuts.
                let mut xs: Vec<f64> = Vec::new();
                for c in [p, q] {
                    let under = a * a - (y - c[1]).powi(2);
                    if under >= 0.0 {
                        xs.extend([c[0] - under.sqrt(), c[0] + under.sqrt()]);
                    }
                }
                let (ex, ey) = (q[0] - p[0], q[1] - p[1]);
                let l = ex.hypot(ey);
                if l > 0.0 {
                    let (nx, ny) = (a * ey / l, -a * ex / l);
                    for s in [1.0, -1.0] {
                        let (u, v) = (
                            [p[0] + s * nx, p[1] + s * ny],
                            [q[0] + s * nx, q[1] + s * ny],
                        );
                        if (u[1] > y) != (v[1] > y) {
                            xs.push(u[0] + (y - u[1]) / (v[1] - u[1]) * (v[0] - u[0]));
                        }
                    }
                }
                if let Some(min) = xs.iter().copied().reduce(f64::min) {
                    spans.push([min, xs.iter().copied().fold(min, f64::max)]);
                }
            }
            crossings.sort_by(f64::total_cmp);
            spans.extend(crossings.chunks_exact(2).map(|c| [c[0], c[1]]));
        }
        spans.sort_by(|s, t| s[0].total_cmp(&t[0]));
        let mut end = f64::NEG_INFINITY;
        for [from, to] in spans {
            let from = from.max(end);
            if to > from {
                let w = to - from;
                area += w * h;
                sx += 0.5 * (to * to - from * from) * h;
                sy += y * w * h;
                polar += ((to.powi(3) - from.powi(3)) / 3.0 + y * y * w + h * h / 12.0 * w) * h;
                end = to;
            }
        }
    }
    let (cx, cy) = (sx / area, sy / area);
    (area, [cx, cy], polar - area * (cx * cx + cy * cy))
}

fn turn(v: [f64; 2], t: f64) -> [f64; 2] {
    [
        v[0] * t.cos() - v[1] * t.sin(),
        v[0] * t.sin() + v[1] * t.cos(),
    ]
}

/// The midpoint rule over 8,000 lines errs by about (h / size)^1.5 at the round tips: 1e-6, and 1e-5 at the smallest discs of a
/// cluster.
#[test]
fn a_thousand_random_shapes_agree_with_integration() {
    let mut random = Random::new(2026);
    let mut checked = [0, 0];
    while checked[0] + checked[1] < 1000 {
        let n = 1 + (random.unit() * 9.0) as usize;
        let a = random.between(0.01, 0.4);
        let (shape, a, parts): (BodyShape, f64, Vec<Part>) = match (n, random.unit()) {
            (1, _) => (BodyShape::Disc, a, vec![(vec![[0.0, 0.0]], a)]),
            (2, _) => {
                let ends = [[random.unit(), random.unit()], [-random.unit(), 0.1]];
                (segment_shape(ends), a, vec![(ends.to_vec(), a)])
            }
            // Unequal discs that overlap.
            (_, kind) if kind < 0.2 => {
                let mut any = || random.between(-1.0, 1.0);
                let centers: Vec<[f64; 2]> = (0..n).map(|_| [any(), any()]).collect();
                let radii: Vec<f64> = (0..n).map(|_| 0.5 + 0.4 * any()).collect();
                let parts = centers.iter().zip(&radii);
                let parts = parts.map(|(center, a)| (vec![*center], *a)).collect();
                (BodyShape::Cluster { centers, radii }, 0.0, parts)
            }
            (_, kind) => {
                let corner = |i: usize| {
                    let t =
                        (i as f64 + random.between(0.1, 0.9)) * std::f64::consts::TAU / n as f64;
                    [t.cos(), 1.3 * t.sin()]
                };
                let shape = if kind < 0.5 {
                    polygon_shape((0..n).map(corner).collect())
                } else {
                    star(&mut random, n, 0.4, 1.0)
                };
                let vertices = shape.vertices();
                (shape, a, vec![(vertices, a)])
            }
        };
        let is_convex = shape.is_convex();
        let mut config = body(shape, a);
        config.inertia = BodyInertia::Density(1.0);
        let mut dem = dem_proc::Sdem::default();
        if let Err(refusal) = dem.configure(&scene(vec![config], spring(1.0))) {
            assert!(refusal.key.ends_with("sphero_radius"), "{refusal}");
            continue; // too round for one of its notches
        }
        let b = &dem.bodies().properties[0];
        checked[usize::from(is_convex)] += 1;
        // Lines along an edge would see it all at once or not at all: turn to where no edge is near horizontal.
        let turned = |t: f64| -> Vec<Part> {
            let turned = |(v, a): &Part| (v.iter().map(|v| turn(*v, t)).collect(), *a);
            parts.iter().map(turned).collect()
        };
        let steepest = |t: f64| {
            let slope = |v: &[[f64; 2]], i: usize| {
                let (p, q) = (v[i], v[(i + 1) % v.len()]);
                (q[1] - p[1]).abs() / (q[0] - p[0]).hypot(q[1] - p[1])
            };
            let of_part = |(v, _): Part| (0..v.len()).map(move |i| slope(&v, i));
            turned(t)
                .into_iter()
                .flat_map(of_part)
                .fold(f64::INFINITY, f64::min)
        };
        let trials = (0..60).map(|i| f64::from(i) * 0.05);
        let angle = trials
            .max_by(|&s, &t| steepest(s).total_cmp(&steepest(t)))
            .unwrap();
        let (area, centroid, polar) = by_lines(&turned(angle), 8000);
        let centroid = turn(centroid, -angle);
        assert!(
            (b.mass / area - 1.0).abs() < 3e-5,
            "area {} {area} {parts:?}",
            b.mass
        );
        assert!(
            (b.inertia / polar - 1.0).abs() < 6e-5,
            "polar {} {polar}",
            b.inertia
        );
        let c = b.shape.moments.centroid;
        assert!((c.x - centroid[0]).abs() < 3e-5 && (c.y - centroid[1]).abs() < 3e-5);
    }
    assert!(checked[0] > 200 && checked[1] > 200, "{checked:?}");
}

/// Mass and moment of inertia of a body of density 1.
fn of(shape: BodyShape, a: f64) -> (f64, f64) {
    let mut config = body(shape, a);
    config.inertia = BodyInertia::Density(1.0);
    let dem = configured(&scene(vec![config], spring(1.0)));
    let body = &dem.bodies().properties[0];
    (body.mass, body.inertia)
}

#[test]
fn a_disc_a_rounded_segment_and_a_rounded_square_have_closed_forms() {
    let (m, i) = of(BodyShape::Disc, 0.5);
    assert!((m - PI * 0.25).abs() < 1e-15 && (i - 0.5 * PI * 0.0625).abs() < 1e-15);
    // Stadium: rectangle L x 2a and two half discs.
    let (l, a) = (2.0, 0.5);
    let (m, i) = of(segment_shape([[0.0, 0.0], [l, 0.0]]), a);
    assert!((m - (2.0 * a * l + PI * a * a)).abs() < 1e-14);
    let rectangle = 2.0 * a * l * (l * l + 4.0 * a * a) / 12.0;
    let half = 0.5 * PI * a * a;
    let offset = 4.0 * a / (3.0 * PI);
    let half_own = 0.25 * PI * a.powi(4) - half * offset * offset;
    let caps = 2.0 * (half_own + half * (0.5 * l + offset).powi(2));
    assert!((i - rectangle - caps).abs() < 1e-13);
    let (m, _) = of(rectangle_shape(2.0, 1.0), 0.1);
    assert!((m - (2.0 + 6.0 * 0.1 + PI * 0.01)).abs() < 1e-14);
}

/// Two discs of radius 1 a distance 1 apart: two discs less the lens `2 pi / 3 - sqrt(3) / 2`; and a disc within
/// another adds nothing.
#[test]
fn a_lens_counts_once_and_a_hidden_disc_not_at_all() {
    let cluster = |distance: f64, radii: [f64; 2]| {
        let (centers, radii) = (vec![[0.0, 0.0], [distance, 0.0]], radii.to_vec());
        of(BodyShape::Cluster { centers, radii }, 0.0)
    };
    let (two, _) = cluster(1.0, [1.0, 1.0]);
    let lens = 2.0 * PI / 3.0 - 0.75_f64.sqrt();
    assert!((two - (2.0 * PI - lens)).abs() < 1e-14, "{two}");
    let (hidden, inertia) = cluster(0.3, [1.0, 0.5]);
    assert!((hidden - PI).abs() < 1e-14 && (inertia - 0.5 * PI).abs() < 1e-14);
}

#[test]
fn a_notch_narrower_than_the_disc_is_refused_for_a_free_body_only() {
    let vertices = vec![
        [0., 0.],
        [3., 0.],
        [3., 2.],
        [1.6, 2.],
        [1.6, 1.],
        [1.4, 1.],
        [1.4, 2.],
        [0., 2.],
    ];
    let shape = polygon_shape(vertices);
    let configure = |config| dem_proc::Sdem::default().configure(&scene(vec![config], spring(1.0)));
    assert!(configure(body(shape.clone(), 0.09)).is_ok());
    let refusal = configure(body(shape.clone(), 0.11)).unwrap_err();
    assert_eq!(refusal.key, "dem.body.0.sphero_radius");
    assert!(configure(crate::small_scenes::fixed(shape, 0.11)).is_ok());
}
