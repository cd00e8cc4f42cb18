//! Plain code of the same kind as the jobs. It is part of the ratios, so a change here means new ratios.

use std::collections::VecDeque;
use std::hint::black_box;

use dem_proc::Sdem;

/// Discs in touch: a pair list, linear springs, dashpots, friction with history, leapfrog; no walls, no energies, no step
/// limit, no polygons.
pub struct PlainDiscs {
    discs: Vec<Disc>,
    pairs: Vec<(u32, u32, f64)>,
}

#[derive(Clone, Copy, Default)]
struct Disc {
    x: [f64; 2],
    v: [f64; 2],
    w: f64,
    r: f64,
    m: f64,
    f: [f64; 2],
    t: f64,
}

/// A number from 0 to 1, another one for each `i`.
fn rough(i: usize) -> f64 {
    let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed >> 40) as f64 / (1_u64 << 24) as f64
}

/// Places on a triangular lattice of this distance.
fn lattice(count: usize, distance: f64) -> impl Iterator<Item = [f64; 2]> {
    let across = (count as f64).sqrt() as usize;
    (0..count).map(move |i| {
        let (row, column) = (i / across, i % across);
        let x = distance * (column as f64 + 0.5 * (row % 2) as f64);
        [x, 0.866 * distance * row as f64]
    })
}

/// The pairs closer than this.
fn near(places: &[[f64; 2]], distance: f64) -> Vec<(u32, u32)> {
    let mut pairs = Vec::new();
    for (i, a) in places.iter().enumerate() {
        for (j, b) in places.iter().enumerate().skip(i + 1) {
            if (a[0] - b[0]).hypot(a[1] - b[1]) < distance {
                pairs.push((i as u32, j as u32));
            }
        }
    }
    pairs
}

impl PlainDiscs {
    /// Discs with these places (m), radii (m) and masses (kg/m).
    pub fn of(discs: impl Iterator<Item = ([f64; 2], f64, f64)>) -> Self {
        let disc = |(x, r, m)| Disc {
            x,
            r,
            m,
            ..Disc::default()
        };
        let discs: Vec<Disc> = discs.map(disc).collect();
        let mut pairs = Vec::new();
        for (i, a) in discs.iter().enumerate() {
            for (j, b) in discs.iter().enumerate().skip(i + 1) {
                if (a.x[0] - b.x[0]).hypot(a.x[1] - b.x[1]) < a.r + b.r + 0.001 {
                    pairs.push((i as u32, j as u32, 0.0));
                }
            }
        }
        Self { discs, pairs }
    }

    /// The grains of a settled box, whose first three bodies are its walls.
    pub fn settled(dem: &Sdem) -> Self {
        let bodies = dem.bodies();
        let disc = |b: usize| {
            let state = &bodies.state[b];
            (state.center.into(), state.radius, bodies.properties[b].mass)
        };
        Self::of((3..bodies.len()).map(disc))
    }

    /// Does steps. Returns how many pairs press in the last.
    pub fn run(&mut self, steps: usize) -> usize {
        const DT: f64 = 2e-5;
        let mut pressing = 0;
        for _ in 0..steps {
            pressing = self.forces(DT);
            for d in &mut self.discs {
                // A drag keeps them where they are.
                for k in 0..2 {
                    d.v[k] = 0.9 * (d.v[k] + 1e-9 * d.f[k] / d.m * DT);
                    d.x[k] += d.v[k] * DT;
                }
                d.w = 0.9 * (d.w + 1e-9 * d.t / (0.5 * d.m * d.r * d.r) * DT);
                d.f = [0.0; 2];
                d.t = 0.0;
            }
        }
        black_box(&self.discs);
        pressing
    }

    fn forces(&mut self, dt: f64) -> usize {
        const K: f64 = 1e6;
        let mut pressing = 0;
        for (i, j, spring) in &mut self.pairs {
            let (a, b) = (self.discs[*i as usize], self.discs[*j as usize]);
            let d = [a.x[0] - b.x[0], a.x[1] - b.x[1]];
            let reach = a.r + b.r;
            let sq = d[0] * d[0] + d[1] * d[1];
            if sq >= reach * reach {
                *spring = 0.0;
                continue;
            }
            pressing += 1;
            let l = sq.sqrt();
            let n = [d[0] / l, d[1] / l];
            let v = [a.v[0] - b.v[0], a.v[1] - b.v[1]];
            let v_n = v[0] * n[0] + v[1] * n[1];
            let v_t = v[1] * n[0] - v[0] * n[1] + a.r * a.w + b.r * b.w;
            let c = 0.6 * (K * a.m * b.m / (a.m + b.m)).sqrt();
            let f_n = (K * (reach - l) - c * v_n).max(0.0);
            *spring = (*spring + v_t * dt).clamp(-f_n / K, f_n / K);
            let f_t = (-0.5 * K * *spring - 0.7 * c * v_t).clamp(-0.5 * f_n, 0.5 * f_n);
            let f = [f_n * n[0] - f_t * n[1], f_n * n[1] + f_t * n[0]];
            for (of, sign, r) in [(*i, 1.0, a.r), (*j, -1.0, b.r)] {
                let disc = &mut self.discs[of as usize];
                disc.f[0] += sign * f[0];
                disc.f[1] += sign * f[1];
                disc.t += f_t * r;
            }
        }
        pressing
    }
}

/// Pentagons in pairs: the distance of each vertex of one from each edge of the other.
pub struct Polygons {
    outlines: Vec<[[f64; 2]; 5]>,
    pairs: Vec<(u32, u32)>,
    pushed: Vec<[f64; 2]>,
}

impl Polygons {
    /// This many.
    pub fn new(count: usize) -> Self {
        let places: Vec<_> = lattice(count, 0.018).collect();
        let outline = |(i, x): (usize, &[f64; 2])| {
            std::array::from_fn(|k| {
                let angle = std::f64::consts::TAU * (k as f64 / 5.0 + rough(i));
                [x[0] + 0.009 * angle.cos(), x[1] + 0.009 * angle.sin()]
            })
        };
        Self {
            outlines: places.iter().enumerate().map(outline).collect(),
            pairs: near(&places, 0.019),
            pushed: vec![[0.0; 2]; count],
        }
    }

    /// Does steps.
    pub fn run(&mut self, steps: usize) {
        for _ in 0..steps {
            for &(i, j) in &self.pairs {
                for (a, b) in [(i, j), (j, i)] {
                    let force = push(&self.outlines[a as usize], &self.outlines[b as usize]);
                    for (k, f) in force.into_iter().enumerate() {
                        self.pushed[a as usize][k] += f;
                        self.pushed[b as usize][k] -= f;
                    }
                }
            }
        }
        black_box(&self.pushed);
    }
}

/// The sum of the springs of all vertices of `a` against all edges of `b`.
fn push(a: &[[f64; 2]; 5], b: &[[f64; 2]; 5]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for v in a {
        for k in 0..5 {
            let (p, q) = (b[k], b[(k + 1) % 5]);
            let (d, e) = ([v[0] - p[0], v[1] - p[1]], [q[0] - p[0], q[1] - p[1]]);
            let along = (d[0] * e[0] + d[1] * e[1]) / (e[0] * e[0] + e[1] * e[1]);
            let s = along.clamp(0.0, 1.0);
            let away = [d[0] - s * e[0], d[1] - s * e[1]];
            let sq = away[0] * away[0] + away[1] * away[1];
            if sq < 1e-6 && sq > 0.0 {
                let l = sq.sqrt();
                sum[0] += (1e-3 - l) * away[0] / l;
                sum[1] += (1e-3 - l) * away[1] / l;
            }
        }
    }
    sum
}

/// Material points on a grid: quadratic weights, affine velocities, a linear elastic material.
pub struct Grid {
    points: Vec<Point>,
    nodes: Vec<[f64; 3]>,
    across: usize,
}

struct Point {
    x: [f64; 2],
    v: [f64; 2],
    c: [[f64; 2]; 2],
    stress: [f64; 3],
}

impl Grid {
    /// This many points, four to a cell of size 1, at rest.
    pub fn new(count: usize) -> Self {
        let across = (count as f64 / 4.0).sqrt().ceil() as usize;
        let point = |i: usize| {
            let (row, column) = (i / (2 * across), i % (2 * across));
            let place = |k: usize, i: usize| 2.25 + 0.5 * k as f64 + 0.1 * (rough(i) - 0.5);
            Point {
                x: [place(column, i), place(row, i + 3)],
                v: [0.01 * (rough(i + 5) - 0.5), 0.01 * (rough(i + 9) - 0.5)],
                c: [[0.0; 2]; 2],
                stress: [0.0; 3],
            }
        };
        let across = across + 6;
        Self {
            points: (0..count).map(point).collect(),
            nodes: vec![[0.0; 3]; across * across],
            across,
        }
    }

    /// Does steps.
    pub fn run(&mut self, steps: usize) {
        const DT: f64 = 1e-3;
        for _ in 0..steps {
            self.nodes.fill([0.0; 3]);
            for p in &self.points {
                let (first, weights, offset) = around(p.x, self.across);
                let [xx, yy, xy] = p.stress.map(|s| 4.0 * 0.25 * DT * s);
                let a = [
                    [p.c[0][0] - xx, p.c[0][1] - xy],
                    [p.c[1][0] - xy, p.c[1][1] - yy],
                ];
                for j in 0..3 {
                    for i in 0..3 {
                        let d = [i as f64 - offset[0], j as f64 - offset[1]];
                        let w = weights[0][i] * weights[1][j];
                        let node = &mut self.nodes[first + j * self.across + i];
                        node[0] += w;
                        node[1] += w * (p.v[0] + a[0][0] * d[0] + a[0][1] * d[1]);
                        node[2] += w * (p.v[1] + a[1][0] * d[0] + a[1][1] * d[1]);
                    }
                }
            }
            for node in &mut self.nodes {
                if node[0] > 0.0 {
                    let per_mass = 0.999 / node[0];
                    (node[1], node[2]) = (node[1] * per_mass, node[2] * per_mass);
                }
            }
            for p in &mut self.points {
                let (first, weights, offset) = around(p.x, self.across);
                (p.v, p.c) = ([0.0; 2], [[0.0; 2]; 2]);
                for j in 0..3 {
                    for i in 0..3 {
                        let d = [i as f64 - offset[0], j as f64 - offset[1]];
                        let w = weights[0][i] * weights[1][j];
                        let node = &self.nodes[first + j * self.across + i];
                        for k in 0..2 {
                            let v = w * node[k + 1];
                            p.v[k] += v;
                            p.c[k][0] += 4.0 * v * d[0];
                            p.c[k][1] += 4.0 * v * d[1];
                        }
                    }
                }
                let volume = p.c[0][0] + p.c[1][1];
                let shear = p.c[0][1] + p.c[1][0];
                for (k, own) in [p.c[0][0], p.c[1][1]].into_iter().enumerate() {
                    p.stress[k] += DT * (10.0 * volume + 20.0 * own);
                    p.x[k] += DT * p.v[k];
                }
                p.stress[2] += DT * 10.0 * shear;
            }
        }
        black_box(&self.points);
    }
}

/// The first of the nine nodes around `x`, their weights along each axis, and the place of `x` from the first.
#[inline]
fn around(x: [f64; 2], across: usize) -> (usize, [[f64; 3]; 2], [f64; 2]) {
    let first = x.map(|x| (x - 0.5).floor());
    let offset = [x[0] - first[0], x[1] - first[1]];
    let weights = offset.map(|d| {
        let (left, right) = (1.5 - d, d - 0.5);
        [
            0.5 * left * left,
            0.75 - (d - 1.0) * (d - 1.0),
            0.5 * right * right,
        ]
    });
    (
        first[1] as usize * across + first[0] as usize,
        weights,
        offset,
    )
}

/// Letters of different kinds that are written, queued, taken and read.
#[derive(Default)]
pub struct Mail {
    queue: VecDeque<Letter>,
    read: f64,
}

enum Letter {
    States(Vec<f64>),
    Forces(Vec<f64>, u64),
    Report([f64; 8]),
}

impl Mail {
    /// Writes and reads this many.
    pub fn run(&mut self, count: usize) {
        for i in 0..count {
            let x = rough(i);
            self.queue.push_back(match i % 3 {
                0 => Letter::States(vec![x; 4]),
                1 => Letter::Forces(vec![x; 6], i as u64),
                _ => Letter::Report([x; 8]),
            });
            if self.queue.len() > 4 {
                self.read += match black_box(self.queue.pop_front()) {
                    Some(Letter::States(all)) => all.iter().sum(),
                    Some(Letter::Forces(all, i)) => all.iter().sum::<f64>() * (i % 7) as f64,
                    Some(Letter::Report(all)) => all[0] + all[7],
                    None => 0.0,
                };
            }
        }
        black_box(self.read);
    }
}
