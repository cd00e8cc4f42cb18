//! The oracle of a continuum: a plain transcription of Jiang 2020. Every point loops over every node of a small dense grid;
//! only the configuration is shared with the solver. It is slow on purpose.
#![expect(
    clippy::needless_range_loop,
    reason = "an axis is an index into several arrays of two"
)]

use std::collections::HashSet;

use interface::config::material::Frictional;
use interface::config::{
    Drift, MaterialModel, MpmConfig, ShapeFunction, StressUpdate, Transfer, Wall, Walls,
};
use interface::message::wire::ImpForce;

use crate::expression::{Expression, Meaning};
use crate::fill::{fill, refuse_overlap};

/// A shape function of the distance from a node in cells, and its derivative, as the paper prints them.
#[derive(Debug, Clone, Copy)]
pub enum Kernel {
    /// Linear hats.
    Linear,
    /// Quadratic B-spline.
    Quadratic,
    /// Cubic B-spline.
    Cubic,
    /// Half width of the box in cells.
    Ugimp(f64),
}

impl Kernel {
    /// At a distance in cells.
    pub fn value(self, x: f64) -> f64 {
        let r = x.abs();
        match self {
            Self::Linear => (1.0 - r).max(0.0),
            Self::Quadratic if r < 0.5 => 0.75 - r * r,
            Self::Quadratic if r < 1.5 => 0.5 * (1.5 - r).powi(2),
            Self::Cubic if r < 1.0 => 0.5 * r.powi(3) - r * r + 2.0 / 3.0,
            Self::Cubic if r < 2.0 => (2.0 - r).powi(3) / 6.0,
            Self::Ugimp(l) if r < l => 1.0 - (r * r + l * l) / (2.0 * l),
            Self::Ugimp(l) if r < 1.0 - l => 1.0 - r,
            Self::Ugimp(l) if r < 1.0 + l => (1.0 + l - r).powi(2) / (4.0 * l),
            _ => 0.0,
        }
    }

    /// Its derivative there.
    pub fn slope(self, x: f64) -> f64 {
        let r = x.abs();
        let slope = match self {
            Self::Linear if r < 1.0 => -1.0,
            Self::Quadratic if r < 0.5 => -2.0 * r,
            Self::Quadratic if r < 1.5 => r - 1.5,
            Self::Cubic if r < 1.0 => 1.5 * r * r - 2.0 * r,
            Self::Cubic if r < 2.0 => -0.5 * (2.0 - r).powi(2),
            Self::Ugimp(l) if r < l => -r / l,
            Self::Ugimp(l) if r < 1.0 - l => -1.0,
            Self::Ugimp(l) if r < 1.0 + l => -(1.0 + l - r) / (2.0 * l),
            _ => 0.0,
        };
        if x < 0.0 { -slope } else { slope }
    }
}

/// The law of a point. The first three have Hencky's elasticity.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum RefLaw {
    /// It does not yield.
    #[default]
    Elastic,
    /// Yield stress and hardening modulus in Pa.
    VonMises([f64; 2]),
    /// Strength by friction.
    DruckerPrager(Frictional),
    /// Deformation gradient so far.
    NeoHookean(nalgebra::Matrix2<f64>),
}

/// A point.
#[derive(Debug, Clone, Copy, Default)]
pub struct RefPoint {
    /// Its group.
    pub group: usize,
    /// Position in m.
    pub x: [f64; 2],
    /// Velocity in m/s.
    pub v: [f64; 2],
    /// `B_p` in m^2/s.
    pub b: [[f64; 2]; 2],
    /// Cauchy stress xx, yy, zz, xy in Pa.
    pub stress: [f64; 4],
    /// Volume over the initial one.
    pub ratio: f64,
    /// In kg/m.
    pub mass: f64,
    /// Initial volume in m^2.
    pub volume: f64,
    /// How far it has moved by a velocity that is still to be compared with the field of its strains, in m.
    pub unsettled: [f64; 2],
    /// Spin in rad/s of the field that moved it in the last step, if there was friction.
    pub spin: f64,
    /// Bulk modulus in Pa.
    pub bulk: f64,
    /// Shear modulus in Pa.
    pub shear: f64,
    /// The law of its material.
    pub law: RefLaw,
    /// Equivalent plastic strain of von Mises' material.
    pub plastic_strain: f64,
    /// Dissipated by plastic flow in J/m.
    pub lost: f64,
}

impl RefPoint {
    /// Kirchhoff stress in Pa: its mean, and its deviator.
    fn kirchhoff(&self) -> (f64, nalgebra::Matrix3<f64>) {
        let [xx, yy, zz, xy] = self.stress.map(|s| s * self.ratio);
        let stress = nalgebra::Matrix3::new(xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, zz);
        let mean = stress.trace() / 3.0;
        (mean, stress - nalgebra::Matrix3::identity() * mean)
    }

    /// `K - 2 G/3` in Pa.
    fn lame(&self) -> f64 {
        self.bulk - 2.0 / 3.0 * self.shear
    }

    /// Elastic energy in J/m.
    pub fn stored(&self) -> f64 {
        if let RefLaw::NeoHookean(f) = self.law {
            let (ln, trace) = (self.ratio.ln(), f.norm_squared() + 1.0);
            let dense = self.shear * (trace - 3.0 - 2.0 * ln) + self.lame() * ln * ln;
            return 0.5 * self.volume * dense;
        }
        let (mean, deviator) = self.kirchhoff();
        let dense = 0.5 * mean * mean / self.bulk + 0.25 * deviator.norm_squared() / self.shear;
        self.volume * dense
    }
}

/// Points over a dense grid with a rim of three nodes.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The points.
    pub points: Vec<RefPoint>,
    /// Along x and y.
    pub kernels: [Kernel; 2],
    /// As configured.
    pub transfer: Transfer,
    /// Lower left corner of the grid in m.
    pub lower: [f64; 2],
    /// Along x and y.
    pub cells: [i64; 2],
    /// Spacing in m.
    pub cell: f64,
    /// In m/s^2.
    pub gravity: [f64; 2],
    /// As configured.
    pub walls: Walls,
    /// As configured.
    pub stress_update: StressUpdate,
    /// As configured.
    pub drift: Drift,
    /// Impulse of the walls on the points in the last step, in N s/m.
    pub wall_impulse: [f64; 2],
    /// Elastic energy of the points at `t_n` of the last step, in J/m.
    pub elastic: f64,
    /// Dissipated by plastic flow up to then, in J/m.
    pub plastic: f64,
}

const RIM: i64 = 3;

/// A node that is free or held, and all positions at which it appears, with the sign of its velocity there: its own
/// position, and those beyond walls where it is an image.
#[derive(Debug, Clone)]
struct Node {
    at: [i64; 2],
    places: Vec<([i64; 2], [f64; 2])>,
}

/// An index along an axis, and all indices at which it appears, with signs.
type Along = (i64, Vec<(i64, [f64; 2])>);

fn law(model: &MaterialModel) -> Option<RefLaw> {
    match *model {
        MaterialModel::LinearElastic { .. } => Some(RefLaw::Elastic),
        MaterialModel::VonMises {
            yield_stress: strength,
            hardening_modulus: hardening,
            ..
        } => Some(RefLaw::VonMises([strength, hardening])),
        MaterialModel::DruckerPrager(numbers) if numbers.is_plain() => {
            Some(RefLaw::DruckerPrager(numbers))
        }
        MaterialModel::NeoHookean { .. } => Some(RefLaw::NeoHookean(nalgebra::Matrix2::identity())),
        _ => None,
    }
}

fn kernel(shape: ShapeFunction, box_in_cells: f64) -> Kernel {
    match shape {
        ShapeFunction::Linear => Kernel::Linear,
        ShapeFunction::Ugimp => Kernel::Ugimp((0.5 * box_in_cells).min(0.5)),
        ShapeFunction::QuadraticBspline => Kernel::Quadratic,
        ShapeFunction::CubicBspline => Kernel::Cubic,
    }
}

/// Formulas in x and y.
fn field<const N: usize>(sources: Option<&[String; N]>, x: [f64; 2]) -> Option<[f64; N]> {
    let Some(sources) = sources else {
        return Some([0.0; N]);
    };
    let slot = |name: &str| match name {
        "x" => Some(Meaning::Slot(0)),
        "y" => Some(Meaning::Slot(1)),
        _ => None,
    };
    let mut values = [0.0; N];
    for (value, source) in values.iter_mut().zip(sources) {
        *value = Expression::compile(source, &slot).ok()?.evaluate(&x);
    }
    Some(values)
}

impl Reference {
    /// The layers of a configuration, each with its points in the order of the configuration; `None` where it has something
    /// that is not known here.
    pub fn layers(config: &MpmConfig) -> Option<Vec<Self>> {
        let c = config;
        let cells = [0, 1].map(|a| ((c.domain[1][a] - c.domain[0][a]) / c.cell).round() as i64);
        let empty = Self {
            points: Vec::new(),
            kernels: [Kernel::Linear; 2],
            transfer: c.transfer,
            lower: c.domain[0],
            cells,
            cell: c.cell,
            gravity: c.gravity,
            walls: c.walls,
            stress_update: c.stress_update,
            drift: c.drift(),
            wall_impulse: [0.0; 2],
            elastic: 0.0,
            plastic: 0.0,
        };
        let (mut layers, mut filled) = (Vec::new(), Vec::new());
        for (g, group) in c.groups.iter().enumerate() {
            let region = fill(group, c.cell, "").ok()?;
            let material = c.materials.get(group.material)?;
            let law = law(&material.model)?;
            let (bulk, shear) = material.model.moduli();
            if g == 0 || c.layers {
                layers.push(empty.clone());
            }
            let layer = layers.last_mut()?;
            layer.kernels = region.sides.map(|side| kernel(c.shape, side / c.cell));
            for &x in &region.positions {
                let more = field(group.fields.velocity.as_ref(), x)?;
                layer.points.push(RefPoint {
                    group: g,
                    x,
                    v: [0, 1].map(|a| group.velocity[a] + more[a]),
                    stress: field(group.fields.stress.as_ref(), x)?,
                    ratio: 1.0,
                    mass: material.density * region.box_area(),
                    volume: region.box_area(),
                    bulk,
                    shear,
                    law,
                    ..RefPoint::default()
                });
            }
            filled.push(region);
        }
        let apart = |a: usize, b: usize| {
            !c.layers || c.group_pairs.iter().any(|p| [[a, b], [b, a]].contains(p))
        };
        refuse_overlap(&c.groups, &filled, apart).ok()?;
        Some(layers)
    }

    /// Along `axis`: numbers of nodes with their places and signs.
    fn along(&self, axis: usize) -> Vec<Along> {
        let n = self.cells[axis];
        let [low, high] = match axis {
            0 => [self.walls.left, self.walls.right],
            _ => [self.walls.bottom, self.walls.top],
        };
        if low == Wall::Periodic {
            return (0..n)
                .map(|i| (i, [i - n, i, i + n].map(|i| (i, [1.0; 2])).to_vec()))
                .collect();
        }
        let bspline = matches!(self.kernels[axis], Kernel::Quadratic | Kernel::Cubic);
        let sign = |wall| match wall {
            Wall::Fixed if bspline => Some([-1.0; 2]),
            Wall::Slip if bspline => Some([0, 1].map(|a| if a == axis { -1.0 } else { 1.0 })),
            Wall::Tangential if bspline => Some([0, 1].map(|a| if a == axis { 1.0 } else { -1.0 })),
            _ => None,
        };
        let (first, last) = (
            if sign(low).is_some() { 0 } else { -RIM },
            if sign(high).is_some() { n } else { n + RIM },
        );
        (first..=last)
            .map(|i| {
                let mut places = vec![(i, [1.0; 2])];
                if let Some(sign) = sign(low).filter(|_| i > 0) {
                    places.push((-i, sign));
                }
                if let Some(sign) = sign(high).filter(|_| i < n) {
                    places.push((2 * n - i, sign));
                }
                (i, places)
            })
            .collect()
    }

    fn nodes(&self) -> Vec<Node> {
        let (columns, rows) = (self.along(0), self.along(1));
        let mut nodes = Vec::new();
        for (j, in_column) in &rows {
            for (i, in_row) in &columns {
                let mut places = Vec::new();
                for (y, sy) in in_column {
                    for (x, sx) in in_row {
                        places.push(([*x, *y], [sx[0] * sy[0], sx[1] * sy[1]]));
                    }
                }
                nodes.push(Node {
                    at: [*i, *j],
                    places,
                });
            }
        }
        nodes
    }

    fn distance(&self, p: &RefPoint, place: [i64; 2]) -> [f64; 2] {
        [0, 1].map(|a| (p.x[a] - self.lower[a]) / self.cell - place[a] as f64)
    }

    fn weight(&self, p: &RefPoint, place: [i64; 2]) -> f64 {
        let d = self.distance(p, place);
        self.kernels[0].value(d[0]) * self.kernels[1].value(d[1])
    }

    fn gradient(&self, p: &RefPoint, place: [i64; 2]) -> [f64; 2] {
        let d = self.distance(p, place);
        let [kx, ky] = self.kernels;
        [
            kx.slope(d[0]) * ky.value(d[1]) / self.cell,
            kx.value(d[0]) * ky.slope(d[1]) / self.cell,
        ]
    }

    fn hold(&self, node: [i64; 2], mut v: [f64; 2]) -> [f64; 2] {
        let w = &self.walls;
        for (acts, wall, axis) in [
            (node[0] <= 0, w.left, 0),
            (node[0] >= self.cells[0], w.right, 0),
            (node[1] <= 0, w.bottom, 1),
            (node[1] >= self.cells[1], w.top, 1),
        ] {
            match wall {
                Wall::Fixed if acts => v = [0.0; 2],
                Wall::Slip if acts => v[axis] = 0.0,
                Wall::Tangential if acts => v[1 - axis] = 0.0,
                _ => {}
            }
        }
        v
    }

    fn momentum(&self) -> [f64; 2] {
        [0, 1].map(|a| self.points.iter().map(|p| p.mass * p.v[a]).sum())
    }

    /// `(-dS/dy, dS/dx) / 2` at a place.
    fn curl(&self, p: &RefPoint, place: [i64; 2]) -> [f64; 2] {
        let [x, y] = self.gradient(p, place);
        [-0.5 * y, 0.5 * x]
    }

    /// One step; `forces` holds a contact force for each point.
    #[expect(
        clippy::too_many_lines,
        reason = "a step from top to bottom, as it is written on paper"
    )]
    pub fn step(&mut self, dt_before: f64, dt: f64, forces: &[ImpForce]) {
        let kick = 0.5 * (dt_before + dt);
        let start = self.momentum();
        let alpha = self.pic_fraction(kick);
        let inertia = self.inertia();
        let nodes = self.nodes();
        let (mass, before) = self.map(&nodes, inertia);
        let [first, last] = self.shares();
        let settles = self.drift == Drift::Mapped && dt > 0.0;
        if settles && first > 0.0 {
            for i in 0..self.points.len() {
                let field = self.interpolate(&nodes, i, |n, _| before[n]);
                let p = &mut self.points[i];
                p.unsettled = [0, 1].map(|a| {
                    let past = first * dt_before;
                    if past > 0.0 {
                        past * field[a] - p.unsettled[a]
                    } else {
                        0.0
                    }
                });
            }
        }
        self.strain(&nodes, &before, first * dt_before, 0.5);
        self.elastic = self.points.iter().map(RefPoint::stored).sum();
        self.plastic = self.points.iter().map(|p| p.lost).sum();
        let mut after = vec![[0.0; 2]; nodes.len()];
        for (n, node) in nodes.iter().enumerate() {
            let mut f = [0.0; 2];
            for (p, contact) in self.points.iter().zip(forces) {
                let [xx, yy, _, xy] = p.stress;
                let v = p.volume * p.ratio;
                for (place, sign) in &node.places {
                    let g = self.gradient(p, *place);
                    let s = self.weight(p, *place);
                    let internal = [xx * g[0] + xy * g[1], xy * g[0] + yy * g[1]];
                    let curl = self.curl(p, *place);
                    for a in 0..2 {
                        let outer = contact.force[a] + p.mass * self.gravity[a];
                        let turning = contact.couple * curl[a];
                        f[a] += sign[a] * (outer * s + turning - v * internal[a]); // (13), (47)
                    }
                }
            }
            if mass[n] > 0.0 {
                let free = [0, 1].map(|a| before[n][a] + kick * f[a] / mass[n]); // (17), (48)
                after[n] = self.hold(node.at, free);
            }
        }
        self.filter_by_order(&nodes, kick, inertia);
        if self.stress_update == StressUpdate::Usl {
            self.strain(&nodes, &after, dt, -0.5);
        }
        let mut drift: Vec<[f64; 2]> = (0..self.points.len())
            .map(|i| {
                let p = self.points[i];
                let (mut v, mut dv, mut b) = ([0.0; 2], [0.0; 2], [[0.0; 2]; 2]);
                for (n, node) in nodes.iter().enumerate() {
                    for (place, sign) in &node.places {
                        let s = self.weight(&p, *place);
                        let d = self.distance(&p, *place).map(|d| -d * self.cell);
                        for a in 0..2 {
                            v[a] += s * sign[a] * after[n][a];
                            dv[a] += s * sign[a] * (after[n][a] - before[n][a]);
                            for c in 0..2 {
                                b[a][c] += s * sign[a] * after[n][a] * d[c]; // (31)
                            }
                        }
                    }
                }
                let p = &mut self.points[i];
                for a in 0..2 {
                    p.v[a] = alpha * v[a] + (1.0 - alpha) * (p.v[a] + dv[a]); // (26) ... (28)
                }
                if self.transfer.is_affine() {
                    p.b = b;
                }
                v
            })
            .collect();
        let (_, again) = self.map(&nodes, inertia);
        self.strain(&nodes, &again, last * dt, -0.5);
        let mapped = self.places_near_loads(&nodes, forces);
        let moving = |n: usize, place: [i64; 2]| {
            let is_mapped = last > 0.0 || mapped.contains(&place);
            if self.drift == Drift::Mapped && is_mapped {
                again[n]
            } else {
                after[n]
            }
        };
        let spins: Vec<f64> = (0..self.points.len())
            .map(|i| match forces[i].tangential {
                0.0 => 0.0,
                _ => self.spin(&nodes, i, moving),
            })
            .collect();
        if self.drift == Drift::Mapped {
            for (i, drift) in drift.iter_mut().enumerate() {
                *drift = self.interpolate(&nodes, i, moving);
            }
        }
        // Gravity and contact are known; the rest of the change of momentum is due to the walls.
        let end = self.momentum();
        for a in 0..2 {
            let outer = self.points.iter().zip(forces);
            let outer: f64 = outer
                .map(|(p, f)| f.force[a] + p.mass * self.gravity[a])
                .sum();
            self.wall_impulse[a] = end[a] - start[a] - kick * outer;
        }
        for ((p, v), spin) in self.points.iter_mut().zip(drift).zip(spins) {
            p.spin = spin;
            for a in 0..2 {
                p.x[a] += dt * v[a];
                if settles {
                    p.x[a] += p.unsettled[a];
                    p.unsettled[a] = first * dt * v[a];
                }
            }
        }
    }

    /// `D_p` in m^2 (31).
    fn inertia(&self) -> f64 {
        let of_unit = match self.kernels[0] {
            Kernel::Cubic => 1.0 / 3.0,
            _ => 0.25,
        };
        self.cell.powi(2) * of_unit
    }

    /// Kinetic energy of a point in J/m, with that of its affine field (29).
    pub fn kinetic(&self, p: &RefPoint) -> f64 {
        let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
        0.5 * p.mass * (square(p.v) + (square(p.b[0]) + square(p.b[1])) / self.inertia())
    }

    /// The largest squared frequency in 1/s^2 that contact with these forces may have, from below: by power iteration. Each
    /// point has a stiffness along two directions, the first of which is that of its force; along the second acts its tangential
    /// stiffness on a surface of these radii (m), and what else there is of the stiffness at its centre.
    pub fn contact_omega_sq(&self, forces: &[ImpForce], radii: &[f64]) -> f64 {
        let nodes = self.nodes();
        let (mass, _) = self.map(&nodes, self.inertia());
        let mut rows: Vec<(f64, Vec<[f64; 2]>)> = Vec::new();
        for ((p, f), radius) in self.points.iter().zip(forces).zip(radii) {
            let size = f.force[0].hypot(f.force[1]);
            let normal = match size {
                0.0 => [1.0, 0.0],
                _ => f.force.map(|f| f / size),
            };
            let tangent = [-normal[1], normal[0]];
            for (k, along, radius) in [
                (f.stiffness, normal, 0.0),
                (f.stiffness - f.tangential, tangent, 0.0),
                (f.tangential, tangent, *radius),
            ] {
                let at = |node: &Node| -> [f64; 2] {
                    let free = self.hold(node.at, [1.0; 2]);
                    let mut row = [0.0; 2];
                    for (place, sign) in &node.places {
                        let (s, curl) = (self.weight(p, *place), self.curl(p, *place));
                        for a in 0..2 {
                            row[a] += free[a] * sign[a] * (s * along[a] - radius * curl[a]);
                        }
                    }
                    row
                };
                if k > 0.0 {
                    rows.push((k, nodes.iter().map(at).collect()));
                }
            }
        }
        let mut largest = 0.0_f64;
        for start in [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            let mut u = vec![start; nodes.len()];
            for _ in 0..20 {
                let mut f = vec![[0.0; 2]; nodes.len()];
                for (k, row) in &rows {
                    let of_node = |(s, u): (&[f64; 2], &[f64; 2])| s[0] * u[0] + s[1] * u[1];
                    let at: f64 = row.iter().zip(&u).map(of_node).sum();
                    for (f, s) in f.iter_mut().zip(row) {
                        *f = [0, 1].map(|a| f[a] + k * s[a] * at);
                    }
                }
                let (mut work, mut inert) = (0.0, 0.0);
                for ((f, m), u) in f.iter().zip(&mass).zip(&u) {
                    work += f[0] * u[0] + f[1] * u[1];
                    inert += m * (u[0] * u[0] + u[1] * u[1]);
                }
                if work <= 0.0 {
                    break;
                }
                largest = largest.max(work / inert);
                let by_mass =
                    |(f, m): (&[f64; 2], &f64)| f.map(|f| if *m > 0.0 { f / m } else { 0.0 });
                u = f.iter().zip(&mass).map(by_mass).collect();
                let size = u
                    .as_flattened()
                    .iter()
                    .fold(0.0_f64, |most, u| most.max(u.abs()));
                for u in u.as_flattened_mut() {
                    *u /= size;
                }
            }
        }
        largest
    }

    /// Where nodes are that see forces, or that a point sees which sees one of these.
    fn places_near_loads(&self, nodes: &[Node], forces: &[ImpForce]) -> HashSet<[i64; 2]> {
        let places = || nodes.iter().flat_map(|node| &node.places).map(|p| p.0);
        let presses = |f: &ImpForce| f.force != [0.0; 2] || f.couple != 0.0;
        let pressed = || self.points.iter().zip(forces).filter(|p| presses(p.1));
        let loaded: HashSet<[i64; 2]> = places()
            .filter(|place| pressed().any(|(p, _)| self.weight(p, *place) != 0.0))
            .collect();
        // As many nodes as a point sees along an axis, less one.
        let reach = match self.kernels[0] {
            Kernel::Linear => 1,
            Kernel::Quadratic | Kernel::Ugimp(_) => 2,
            Kernel::Cubic => 3,
        };
        // Near loads at the other end too.
        let closed = self.walls.periodic().contains(&true);
        if closed && !loaded.is_empty() {
            return places().collect();
        }
        let near = |[x, y]: &[i64; 2]| {
            let mut around = (-reach..=reach).flat_map(|j| (-reach..=reach).map(move |i| [i, j]));
            around.any(|[i, j]| loaded.contains(&[x + i, y + j]))
        };
        places().filter(near).collect()
    }

    /// A velocity of the nodes at a point, of which `velocity` says what it is at each place.
    fn interpolate(
        &self,
        nodes: &[Node],
        point: usize,
        velocity: impl Fn(usize, [i64; 2]) -> [f64; 2],
    ) -> [f64; 2] {
        let (p, mut v) = (&self.points[point], [0.0_f64; 2]);
        for (n, node) in nodes.iter().enumerate() {
            for (place, sign) in &node.places {
                let s = self.weight(p, *place);
                if s != 0.0 {
                    let of_node = velocity(n, *place);
                    v = [0, 1].map(|a| v[a] + s * sign[a] * of_node[a]);
                }
            }
        }
        v
    }

    /// Half the curl of such a velocity at a point.
    fn spin(
        &self,
        nodes: &[Node],
        point: usize,
        velocity: impl Fn(usize, [i64; 2]) -> [f64; 2],
    ) -> f64 {
        let (p, mut spin) = (&self.points[point], 0.0);
        for (n, node) in nodes.iter().enumerate() {
            for (place, sign) in &node.places {
                let curl = self.curl(p, *place);
                let of_node = velocity(n, *place);
                for a in 0..2 {
                    spin += curl[a] * sign[a] * of_node[a];
                }
            }
        }
        spin
    }

    /// alpha of eq. 28 over a kick.
    fn pic_fraction(&self, kick: f64) -> f64 {
        match self.transfer {
            Transfer::Flip | Transfer::Xpic { .. } | Transfer::FlipXpic { .. } => 0.0,
            Transfer::Blend { pic_fraction } => pic_fraction,
            Transfer::FlipPic { pic_rate } | Transfer::Aflip { pic_rate } => {
                1.0 - (-pic_rate * kick).exp()
            }
            _ => 1.0,
        }
    }

    /// The filter of XPIC, where the transfer has one.
    fn filter_by_order(&mut self, nodes: &[Node], kick: f64, inertia: f64) {
        match self.transfer {
            Transfer::Xpic { order } => self.filter(nodes, order, 1.0, inertia),
            Transfer::FlipXpic { order, pic_rate } => {
                self.filter(nodes, order, 1.0 - (-pic_rate * kick).exp(), inertia);
            }
            _ => {}
        }
    }

    /// The share of an interval that mapped velocities strain from its end, and the share from its start.
    fn shares(&self) -> [f64; 2] {
        match self.stress_update {
            StressUpdate::Usf => [1.0, 0.0],
            StressUpdate::Usl => [0.0, 0.0],
            StressUpdate::Musl => [0.0, 1.0],
            StressUpdate::Usavg => [0.5, 0.5],
        }
    }

    /// `v_p -= share (1 - S S+)^m v_p`.
    fn filter(&mut self, nodes: &[Node], order: u32, share: f64, inertia: f64) {
        let aside: Vec<[f64; 2]> = self.points.iter().map(|p| p.v).collect();
        for _ in 0..order {
            let (_, held) = self.map(nodes, inertia);
            for (n, node) in nodes.iter().enumerate() {
                for (place, sign) in &node.places {
                    for i in 0..self.points.len() {
                        let s = self.weight(&self.points[i], *place);
                        for a in 0..2 {
                            self.points[i].v[a] -= s * sign[a] * held[n][a];
                        }
                    }
                }
            }
        }
        for (p, v) in self.points.iter_mut().zip(aside) {
            p.v = [0, 1].map(|a| v[a] - share * p.v[a]);
        }
    }

    /// Mass and velocity of the nodes (18) ... (20), (30), walls obeyed.
    fn map(&self, nodes: &[Node], inertia: f64) -> (Vec<f64>, Vec<[f64; 2]>) {
        let mut mass = vec![0.0; nodes.len()];
        let mut momentum = vec![[0.0; 2]; nodes.len()];
        for (n, node) in nodes.iter().enumerate() {
            for p in &self.points {
                for (place, sign) in &node.places {
                    let s = self.weight(p, *place);
                    let d = self.distance(p, *place).map(|d| -d * self.cell); // x_I - x_p
                    mass[n] += p.mass * s;
                    for a in 0..2 {
                        let affine = (p.b[a][0] * d[0] + p.b[a][1] * d[1]) / inertia;
                        momentum[n][a] += p.mass * s * sign[a] * (p.v[a] + affine);
                    }
                }
            }
        }
        let velocity = (0..nodes.len())
            .map(|n| {
                if mass[n] > 0.0 {
                    self.hold(nodes[n].at, momentum[n].map(|p| p / mass[n]))
                } else {
                    [0.0; 2]
                }
            })
            .collect();
        (mass, velocity)
    }

    /// Strains every point by the velocities of the nodes over `dt` (21) ... (24), with gradients of the middle of the
    /// interval; `half` is how much of it is past where the points stand.
    fn strain(&mut self, nodes: &[Node], velocity: &[[f64; 2]], dt: f64, half: f64) {
        for i in 0..self.points.len() {
            let p = self.points[i];
            let mut l = [[0.0; 2]; 2];
            for (n, node) in nodes.iter().enumerate() {
                for (place, sign) in &node.places {
                    let g = self.gradient(&p, *place);
                    for a in 0..2 {
                        for b in 0..2 {
                            l[a][b] += sign[a] * velocity[n][a] * g[b] * dt;
                        }
                    }
                }
            }
            let [[xx, xy], [yx, yy]] = l;
            let at = nalgebra::Matrix2::new(xx, xy, yx, yy);
            let middle = at
                * (nalgebra::Matrix2::identity() - at * half)
                    .try_inverse()
                    .expect("regular");
            self.stress(i, middle);
        }
    }

    /// Hencky's elasticity with matrices and their eigenvectors: `b <- f b f^T`, `eps = ln(b)/2`. Then the return of the Cauchy
    /// stress to a yield surface. Or a stress of the whole deformation.
    fn stress(&mut self, i: usize, l: nalgebra::Matrix2<f64>) {
        use nalgebra::Matrix3;
        let p = &mut self.points[i];
        let l = Matrix3::new(l.m11, l.m12, 0.0, l.m21, l.m22, 0.0, 0.0, 0.0, 0.0);
        let one = Matrix3::identity();
        let f = (one - l * 0.5).try_inverse().expect("regular") * (one + l * 0.5);
        let function = |m: Matrix3<f64>, of: fn(f64) -> f64| {
            let eigen = m.symmetric_eigen();
            let diagonal = Matrix3::from_diagonal(&eigen.eigenvalues.map(of));
            eigen.eigenvectors * diagonal * eigen.eigenvectors.transpose()
        };
        if let RefLaw::NeoHookean(before) = p.law {
            let whole = f.fixed_view::<2, 2>(0, 0) * before;
            p.law = RefLaw::NeoHookean(whole);
            p.ratio = whole.determinant();
            let round = p.lame() * p.ratio.ln();
            let b = whole * whole.transpose();
            let [xx, yy, zz] = [b.m11, b.m22, 1.0].map(|b| p.shear * (b - 1.0) + round);
            p.stress = [xx, yy, zz, p.shear * b.m12].map(|tau| tau / p.ratio);
            return;
        }
        let (mean, deviator) = p.kirchhoff();
        let strain = deviator / (2.0 * p.shear) + one * (mean / (3.0 * p.bulk));
        let b = f * function(strain * 2.0, f64::exp) * f.transpose();
        let strain = function((b + b.transpose()) * 0.5, f64::ln) * 0.5;
        let volumetric = one * strain.trace();
        let new = volumetric * p.bulk + (strain - volumetric / 3.0) * (2.0 * p.shear);
        p.ratio *= f.determinant();
        let trial = new / p.ratio;
        let mean = trial.trace() / 3.0;
        let deviator = trial - one * mean;
        let new = match p.law {
            RefLaw::VonMises([strength, hardening]) => {
                let q = (1.5 * deviator.norm_squared()).sqrt();
                let stiff = 3.0 * p.shear / p.ratio;
                let beyond = q - strength - hardening * p.plastic_strain;
                let flow = beyond.max(0.0) / (stiff + hardening);
                p.plastic_strain += flow;
                p.lost += (q - stiff * flow) * flow * p.ratio * p.volume;
                let kept = if flow > 0.0 {
                    1.0 - stiff * flow / q
                } else {
                    1.0
                };
                one * mean + deviator * kept
            }
            RefLaw::DruckerPrager(numbers) => {
                let tau = (0.5 * deviator.norm_squared()).sqrt();
                let (new_mean, new_tau) = by_friction(&numbers, mean, tau);
                let in_shear = new_tau * (tau - new_tau) / p.shear;
                let in_volume = new_mean * (mean - new_mean) / p.bulk;
                p.lost += (in_shear + in_volume) * p.ratio * p.ratio * p.volume;
                let kept = if tau > 0.0 { new_tau / tau } else { 1.0 };
                one * new_mean + deviator * kept
            }
            _ => trial,
        };
        p.stress = [new[(0, 0)], new[(1, 1)], new[(2, 2)], new[(0, 1)]];
    }
}

/// Returns a mean stress and a `tau` in Pa to Drucker-Prager's surfaces, `tau + q sigma <= k` and `sigma <= sigma_t`
/// (Jiang 2020 eqs. 31 to 35). A line halves the corner of the two surfaces. A stress beyond both returns to the surface on its
/// side of the line, or to the corner if it would end beyond the other surface. Only the ratio of the moduli matters.
fn by_friction(numbers: &Frictional, mean: f64, tau: f64) -> (f64, f64) {
    let root = |angle: f64| (9.0 + 12.0 * angle.to_radians().tan().powi(2)).sqrt();
    let slope = |angle: f64| 3.0 * angle.to_radians().tan() / root(angle);
    let (q, q_flow) = (slope(numbers.friction_angle), slope(numbers.dilation_angle));
    let k = 3.0 * numbers.cohesion / root(numbers.friction_angle);
    let most = numbers.tensile_strength.min(k / q);
    let halves = ((1.0 + q * q).sqrt() - q) * (mean - most);
    let to_shear = mean <= most || tau - (k - q * most) > halves;
    let flow =
        (tau + q * mean - k).max(0.0) / (numbers.shear_modulus + numbers.bulk_modulus * q * q_flow);
    let moved = if to_shear {
        mean - numbers.bulk_modulus * q_flow * flow
    } else {
        mean
    };
    let new = moved.min(most);
    (new, tau.min(k - q * new))
}
