//! The quantities that columns, checks and references may name, and one sample of all of them.
//!
//! | name | meaning | unit |
//! | --- | --- | --- |
//! | `time`, `t` | simulated time | s |
//! | `energy.X` | X: `kinetic` (points and translation of bodies), `rotation`, `elastic`, `gravity`, `contact`, `friction`, `viscous`, `plastic`, `driven`, `total`, `residual` | J/m |
//! | `energy.residual_relative` | residual over the largest energy in play so far | 1 |
//! | `energy.stress_work` | work of the stress of the points so far, less what plastic flow and viscous stress took | J/m |
//! | `energy.work_gap`, `energy.work_gap_relative` | that work less the growth of `elastic`; not a number of a continuum that does not keep it | J/m, 1 |
//! | `momentum.x`, `.y` | linear momentum of points and bodies at `t_{n+1/2}` | N s/m |
//! | `momentum_error` | applied impulses subtracted, relative to the largest momentum so far ([`crate::record::ledger`]) | 1 |
//! | `contact.force.x`, `.y` | force of bodies on points | N/m |
//! | `body.NAME.Q` | Q: `x`, `y` (m), `vx`, `vy` (m/s), `angle` (rad), `spin` (rad/s), `mass` (kg/m), `inertia` (kg m), `kinetic` (J/m, with rotation), `fx`, `fy` (N/m), `torque` (N) of the points on the body, `contacts`, `contact_fx`, `contact_fy` (N/m), `contact_torque` (N) of other bodies on it | |
//! | `points.NAME.Q` | Q: `x`, `y`, `vx`, `vy`, `mass`, `kinetic`, `fx`, `fy` of bodies on the group, `xmin`, `xmax`, `ymin`, `ymax`, `contacts` | |
//! | `fill.NAME.Q` | Q: `x`, `y`, `vx`, `vy` (mean by mass), `mass`, `kinetic` (with rotation) of a generated set of bodies; `spread` (m): mean of `\|x - x_mean\|` by mass; `xmin`, `xmax`, `ymin`, `ymax` of their centres | |
//! | `initial.Q` | the value of any of these at `t_0` | |

use interface::message::wire::{BodyState, GroupState, Ledger};

use mechanics::expression::Meaning;

/// Quantities that every scene has, in the order of their values in a [`Sample`].
const COMMON: [&str; 22] = [
    "time",
    "energy.kinetic",
    "energy.rotation",
    "energy.elastic",
    "energy.gravity",
    "energy.contact",
    "energy.friction",
    "energy.viscous",
    "energy.plastic",
    "energy.driven",
    "energy.total",
    "energy.residual",
    "energy.residual_relative",
    "energy.stress_work",
    "energy.work_gap",
    "energy.work_gap_relative",
    "momentum.x",
    "momentum.y",
    "momentum_error",
    "contact.force.x",
    "contact.force.y",
    "contact.points",
];

/// Quantities of one point group.
const OF_GROUP: [&str; 13] = [
    "x", "y", "vx", "vy", "mass", "kinetic", "fx", "fy", "xmin", "xmax", "ymin", "ymax", "contacts",
];

/// Quantities of one body.
const OF_BODY: [&str; 16] = [
    "x",
    "y",
    "vx",
    "vy",
    "angle",
    "spin",
    "mass",
    "inertia",
    "kinetic",
    "fx",
    "fy",
    "torque",
    "contacts",
    "contact_fx",
    "contact_fy",
    "contact_torque",
];

/// Quantities of a generated set of bodies.
const OF_FILL: [&str; 11] = [
    "x", "y", "vx", "vy", "mass", "kinetic", "spread", "xmin", "xmax", "ymin", "ymax",
];

/// What is conserved apart from the residual of the transfer scheme, in J/m: energies held, plus energy dissipated,
/// minus work put in.
pub fn total_energy(mpm: &Ledger, dem: &Ledger) -> f64 {
    let of = |l: &Ledger| {
        l.kinetic
            + l.kinetic_rotation
            + l.elastic
            + l.gravity
            + l.contact
            + l.friction_work
            + l.viscous_work
            + l.plastic_work
            - l.driven_work
    };
    of(mpm) + of(dem)
}

/// One measurement of both sides, from which a [`Sample`] is filled.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// `t_n` in s.
    pub time: f64,
    /// The continuum's ledger; zeros where there is none.
    pub mpm: &'a Ledger,
    /// The bodies' ledger; zeros where there is none.
    pub dem: &'a Ledger,
    /// One record for each point group, in the order of the scene.
    pub groups: &'a [GroupState],
    /// One record for each body, in the order of the scene.
    pub bodies: &'a [BodyState],
    /// Momentum balance relative to the largest momentum so far.
    pub momentum_error: f64,
    /// [`total_energy`] minus its value at `t_0`, in J/m.
    pub energy_residual: f64,
    /// The residual relative to the largest total so far.
    pub energy_residual_relative: f64,
    /// Work of the stress that is neither stored nor dissipated, in J/m and relative to the same; `None` if the continuum
    /// does not keep that work.
    pub work_gap: Option<[f64; 2]>,
}

/// The registry: every quantity of a scene and its place in a [`Sample`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Quantities {
    names: Vec<String>,
    groups: usize,
    /// Bodies written one by one.
    bodies: usize,
    /// Bodies of each set, which follow them.
    fills: Vec<usize>,
}

/// The values of all quantities at one time, in the order of their registry.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sample {
    values: Vec<f64>,
}

impl Quantities {
    /// The quantities of a scene with these point groups, bodies, and generated sets of so many bodies.
    pub fn new<'a>(
        groups: impl IntoIterator<Item = &'a str>,
        bodies: impl IntoIterator<Item = &'a str>,
        fills: impl IntoIterator<Item = (&'a str, u32)>,
    ) -> Self {
        let mut registry = Self {
            names: COMMON.iter().map(|&name| name.to_owned()).collect(),
            ..Self::default()
        };
        for group in groups {
            registry.groups += 1;
            let names = OF_GROUP.iter().map(|q| format!("points.{group}.{q}"));
            registry.names.extend(names);
        }
        for body in bodies {
            registry.bodies += 1;
            let names = OF_BODY.iter().map(|q| format!("body.{body}.{q}"));
            registry.names.extend(names);
        }
        for (fill, count) in fills {
            registry.fills.push(count as usize);
            let names = OF_FILL.iter().map(|q| format!("fill.{fill}.{q}"));
            registry.names.extend(names);
        }
        registry
    }

    /// Number of values in a [`Sample`].
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Never: every scene has a time.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// All names, in the order of a [`Sample`].
    pub fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.names.iter().map(String::as_str)
    }

    /// Place of a quantity in a [`Sample`].
    pub fn index(&self, name: &str) -> Option<usize> {
        let name = if name == "t" { "time" } else { name };
        self.names.iter().position(|known| known == name)
    }

    /// What a name means in an expression over `[sample, initial sample]`: a quantity, or `initial.` and a quantity.
    pub(crate) fn meaning(&self, name: &str) -> Option<Meaning> {
        match name.strip_prefix("initial.") {
            Some(quantity) => Some(Meaning::Slot(self.len() + self.index(quantity)?)),
            None => Some(Meaning::Slot(self.index(name)?)),
        }
    }

    /// Fills `sample` from one measurement.
    ///
    /// # Panics
    /// If there are not as many groups or bodies as the scene has: an assertion, they were configured from it.
    pub fn fill(&self, sample: &mut Sample, measured: &Measured) {
        assert_eq!(measured.groups.len(), self.groups, "one record a group");
        let count = self.bodies + self.fills.iter().sum::<usize>();
        assert_eq!(measured.bodies.len(), count, "one record a body");
        let (bodies, mut filled) = measured.bodies.split_at(self.bodies);
        let values = &mut sample.values;
        values.clear();
        values.extend(common(measured));
        for group in measured.groups {
            values.extend(of_group(group));
        }
        for body in bodies {
            values.extend(of_body(body));
        }
        for count in &self.fills {
            let (fill, others) = filled.split_at(*count);
            values.extend(of_fill(fill));
            filled = others;
        }
        debug_assert_eq!(values.len(), self.len());
    }
}

impl Sample {
    /// The values, in the order of the registry; empty before the first fill.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The time of the sample in s.
    ///
    /// # Panics
    /// If it was never filled: an assertion.
    pub fn time(&self) -> f64 {
        self.values[0]
    }
}

#[cfg(test)]
impl From<Vec<f64>> for Sample {
    fn from(values: Vec<f64>) -> Self {
        Self { values }
    }
}

fn common(measured: &Measured) -> [f64; COMMON.len()] {
    let (m, d) = (measured.mpm, measured.dem);
    let [gap, gap_relative] = measured.work_gap.unwrap_or([f64::NAN; 2]);
    let stress_work = measured.work_gap.map_or(f64::NAN, |_| m.stress_work);
    [
        measured.time,
        m.kinetic + d.kinetic,
        m.kinetic_rotation + d.kinetic_rotation,
        m.elastic + d.elastic,
        m.gravity + d.gravity,
        m.contact + d.contact,
        m.friction_work + d.friction_work,
        m.viscous_work + d.viscous_work,
        m.plastic_work + d.plastic_work,
        m.driven_work + d.driven_work,
        total_energy(m, d),
        measured.energy_residual,
        measured.energy_residual_relative,
        stress_work,
        gap,
        gap_relative,
        m.momentum[0] + d.momentum[0],
        m.momentum[1] + d.momentum[1],
        measured.momentum_error,
        m.contact_force[0],
        m.contact_force[1],
        m.contacts as f64,
    ]
}

fn of_group(g: &GroupState) -> [f64; OF_GROUP.len()] {
    [
        g.position[0],
        g.position[1],
        g.velocity[0],
        g.velocity[1],
        g.mass,
        g.kinetic,
        g.contact_force[0],
        g.contact_force[1],
        g.lower[0],
        g.upper[0],
        g.lower[1],
        g.upper[1],
        g.contacts as f64,
    ]
}

fn of_fill(bodies: &[BodyState]) -> [f64; OF_FILL.len()] {
    let mass: f64 = bodies.iter().map(|b| b.mass).sum();
    let mean = |f: &dyn Fn(&BodyState) -> f64| {
        let sum: f64 = bodies.iter().map(|b| b.mass * f(b)).sum();
        sum / mass
    };
    let ends = |axis: usize| {
        let at = bodies.iter().map(|b| b.position[axis]);
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        at.fold(none, |[low, high], x| [low.min(x), high.max(x)])
    };
    let x = mean(&|b| b.position[0]);
    let ([xmin, xmax], [ymin, ymax]) = (ends(0), ends(1));
    [
        x,
        mean(&|b| b.position[1]),
        mean(&|b| b.velocity[0]),
        mean(&|b| b.velocity[1]),
        mass,
        bodies.iter().map(kinetic).sum(),
        mean(&|b| (b.position[0] - x).abs()),
        xmin,
        xmax,
        ymin,
        ymax,
    ]
}

/// Kinetic energy of translation and rotation in J/m.
fn kinetic(b: &BodyState) -> f64 {
    let speed_sq = b.velocity[0].powi(2) + b.velocity[1].powi(2);
    0.5 * b.mass * speed_sq + 0.5 * b.inertia * b.spin.powi(2)
}

fn of_body(b: &BodyState) -> [f64; OF_BODY.len()] {
    [
        b.position[0],
        b.position[1],
        b.velocity[0],
        b.velocity[1],
        b.angle,
        b.spin,
        b.mass,
        b.inertia,
        kinetic(b),
        b.point_force[0],
        b.point_force[1],
        b.point_torque,
        b.contacts as f64,
        b.body_force[0],
        b.body_force[1],
        b.body_torque,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_stands_at_the_index_of_its_name() {
        let quantities = Quantities::new(["disc"], ["floor", "target"], [("grains", 2)]);
        let mpm = Ledger {
            kinetic: 1.0,
            elastic: 2.0,
            contact_force: [3.0, 4.0],
            momentum: [5.0, 6.0],
            driven_work: 0.5,
            stress_work: 2.25,
            ..Ledger::default()
        };
        let dem = Ledger {
            kinetic: 10.0,
            kinetic_rotation: 20.0,
            friction_work: 40.0,
            ..Ledger::default()
        };
        let group = GroupState {
            velocity: [7.0, 8.0],
            upper: [9.0, 11.0],
            contacts: 12,
            ..GroupState::default()
        };
        let target = BodyState {
            velocity: [3.0, 4.0],
            mass: 2.0,
            spin: 2.0,
            inertia: 3.0,
            point_torque: 13.0,
            body_force: [17.0, 18.0],
            body_torque: 19.0,
            ..BodyState::default()
        };
        let grain = |x: f64, mass: f64| BodyState {
            position: [x, 2.0 * x],
            velocity: [0.0, 1.0],
            mass,
            ..BodyState::default()
        };
        let mut sample = Sample::default();
        let measured = Measured {
            time: 0.25,
            mpm: &mpm,
            dem: &dem,
            groups: &[group],
            bodies: &[
                BodyState::default(),
                target,
                grain(1.0, 3.0),
                grain(5.0, 1.0),
            ],
            momentum_error: 14.0,
            energy_residual: 15.0,
            energy_residual_relative: 16.0,
            work_gap: Some([0.25, 0.125]),
        };
        quantities.fill(&mut sample, &measured);
        for (name, expected) in [
            ("time", 0.25),
            ("t", 0.25),
            ("energy.kinetic", 11.0),
            ("energy.rotation", 20.0),
            ("energy.total", 72.5),
            ("energy.residual", 15.0),
            ("energy.residual_relative", 16.0),
            ("energy.stress_work", 2.25),
            ("energy.work_gap", 0.25),
            ("energy.work_gap_relative", 0.125),
            ("momentum.y", 6.0),
            ("momentum_error", 14.0),
            ("contact.force.x", 3.0),
            ("points.disc.vx", 7.0),
            ("points.disc.xmax", 9.0),
            ("points.disc.ymax", 11.0),
            ("points.disc.contacts", 12.0),
            ("body.target.kinetic", 31.0),
            ("body.target.torque", 13.0),
            ("body.target.contact_fx", 17.0),
            ("body.target.contact_fy", 18.0),
            ("body.target.contact_torque", 19.0),
            ("body.floor.mass", 0.0),
            ("fill.grains.x", 2.0),
            ("fill.grains.y", 4.0),
            ("fill.grains.vy", 1.0),
            ("fill.grains.mass", 4.0),
            ("fill.grains.kinetic", 2.0),
            ("fill.grains.spread", 1.5),
            ("fill.grains.xmax", 5.0),
            ("fill.grains.ymin", 2.0),
        ] {
            let index = quantities.index(name).unwrap_or_else(|| panic!("{name}"));
            assert_eq!(sample.values()[index], expected, "{name}");
        }
        assert_eq!(sample.values().len(), quantities.len());
        assert_eq!(quantities.index("body.targt.vx"), None);
    }

    /// A check of what the continuum does not say must not pass.
    #[test]
    fn a_gap_that_nobody_keeps_is_not_a_number() {
        let quantities = Quantities::new([], [], []);
        let ledger = Ledger::default();
        let silent = Measured {
            time: 0.0,
            mpm: &ledger,
            dem: &ledger,
            groups: &[],
            bodies: &[],
            momentum_error: 0.0,
            energy_residual: 0.0,
            energy_residual_relative: 0.0,
            work_gap: None,
        };
        let mut sample = Sample::default();
        quantities.fill(&mut sample, &silent);
        for name in ["energy.work_gap", "energy.stress_work"] {
            let index = quantities.index(name).expect("a quantity");
            assert!(sample.values()[index].is_nan(), "{name}");
        }
    }
}
