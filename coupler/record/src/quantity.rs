//! The quantities that columns, checks and references may name, and one sample of all of them.
//!
//! A quantity is one row of a table: name, unit, meaning, value. The names in expressions, the values of a sample and
//! the list in `docs/scene-format.md` are made from the rows.

use std::fmt::Write as _;

use interface::message::wire::{BodyState, GroupState, Ledger};
use mechanics::expression::Meaning;

use super::ledger::Balance;

/// A quantity of `T`, which is measured at every output.
struct Row<T: ?Sized> {
    name: &'static str,
    unit: &'static str,
    /// What it is, for the reference page.
    meaning: &'static str,
    value: fn(&T) -> f64,
}

/// Unit of a quantity of a slice that is in `unit` per metre of thickness, such as a mass (kg/m), a force (N/m) or a
/// moment of inertia (kg m). `None` for units that do not depend on the thickness.
///
/// # Panics
/// For a unit that no row has.
fn slice_unit(unit: &str) -> Option<&'static str> {
    match unit {
        "kg/m" => Some("kg"),
        "N/m" => Some("N"),
        "N s/m" => Some("N s"),
        "J/m" => Some("J"),
        "kg m" => Some("kg m^2"),
        "N" => Some("N m"),
        "N s" => Some("N m s"),
        "1" | "s" | "m" | "m/s" | "rad" | "rad/s" => None,
        other => unreachable!("say whether {other} is of a metre of thickness"),
    }
}

/// The full name of a quantity of the run, which may be abbreviated.
fn whole_name(name: &str) -> &str {
    if name == "t" { "time" } else { name }
}

/// A table of quantities, one a line: name, unit, meaning, value.
macro_rules! table {
    ($(#[$doc:meta])* $name:ident: $of:ty;
        $($row:literal, $unit:literal, $meaning:literal, $value:expr;)*) => {
        $(#[$doc])*
        const $name: &[Row<$of>] = &[$(Row {
            name: $row,
            unit: $unit,
            meaning: $meaning,
            value: $value,
        }),*];
    };
}

/// Points with a name: their present state and first position.
struct Followed {
    now: GroupState,
    /// Centre of mass in the first sample in m; NaN if there are fewer points now, whose mean has moved by itself.
    first: [f64; 2],
}

table! {
    /// Quantities that every scene has. The time is the first.
    OF_RUN: Ledgers;
    "time", "s", "simulated time; `t` for short", |m| m.time;
    "energy.kinetic", "J/m", "kinetic energy of the points, and of the translation of the bodies", |m| m.balance.now.kinetic;
    "energy.rotation", "J/m", "kinetic energy of the rotation of the bodies", |m| m.balance.now.rotation;
    "energy.elastic", "J/m", "elastic energy of the points", |m| m.balance.now.elastic;
    "energy.gravity", "J/m", "potential energy of gravity", |m| m.balance.now.gravity;
    "energy.contact", "J/m", "energy in contact springs", |m| m.balance.now.contact;
    "energy.friction", "J/m", "dissipated by friction so far", |m| m.balance.now.friction;
    "energy.viscous", "J/m", "dissipated by viscosity so far", |m| m.balance.now.viscous;
    "energy.plastic", "J/m", "dissipated by plastic flow so far", |m| m.balance.now.plastic;
    "energy.transfer", "J/m", "taken from the motion by the transfer between points and nodes so far; below zero if it has given more than it took",
        |m| m.balance.now.transfer;
    "energy.transfer_relative", "1", "the same relative to the largest energy in play so far",
        |m| m.balance.transfer_relative();
    "energy.driven", "J/m", "work of driven bodies and boundaries so far", |m| m.balance.now.driven;
    "energy.total", "J/m", "the five energies, plus the four taken (a transfer that gives counts as 0), minus the work put in: conserved but for the residual",
        |m| m.balance.now.total;
    "energy.residual", "J/m", "total minus its first value", |m| m.balance.residual;
    "energy.residual_relative", "1", "the residual relative to the largest energy in play so far",
        |m| m.balance.residual_relative();
    "energy.stress_work", "J/m", "work of the stress of the points so far, minus what plastic flow and viscous stress took of it; no part of the total; NaN, which passes no check, if the continuum does not keep that work (capability `stress_work`)",
        |m| m.balance.work_gap().map_or(f64::NAN, |_| m.mpm.stress_work);
    "energy.work_gap", "J/m", "`energy.stress_work` minus the growth of `energy.elastic`: what a law without an energy takes (above 0) or creates (below 0); of a law with an energy the error of the quadrature; NaN as `energy.stress_work`",
        |m| m.balance.work_gap().unwrap_or(f64::NAN);
    "energy.work_gap_relative", "1", "the work gap relative to the largest energy in play so far",
        |m| m.balance.work_gap_relative().unwrap_or(f64::NAN);
    "momentum.x", "N s/m", "linear momentum of points and bodies, half a step after the time of the positions",
        |m| m.mpm.momentum[0] + m.dem.momentum[0];
    "momentum.y", "N s/m", "the same in y", |m| m.mpm.momentum[1] + m.dem.momentum[1];
    "momentum_error", "1", "change of momentum minus the applied impulses, relative to the largest momentum so far: sqrt(2 m E) of all groups and bodies by their kinetic energy, or handed over by contact or from outside",
        |m| m.balance.momentum_error;
    "angular_momentum", "N s", "angular momentum of points and bodies about the origin, with the velocities of `momentum.x`",
        |m| m.mpm.angular_momentum + m.dem.angular_momentum;
    "angular_momentum_error", "1", "change of angular momentum minus the moments of the applied impulses, relative to the largest angular momentum about the centre of mass so far: of all groups and bodies by their kinetic energy and extent, of a side, or handed over by contact or from outside; NaN with periodic walls",
        |m| m.balance.angular_momentum_error().map_or(f64::NAN, |[now, _]| now);
    "contact.force.x", "N/m", "force of bodies on points", |m| m.mpm.contact_force[0];
    "contact.force.y", "N/m", "the same in y", |m| m.mpm.contact_force[1];
    "contact.points", "1", "points on which bodies or other groups exert a force", |m| m.mpm.contacts as f64;
}

table! {
    /// Quantities of one point group.
    OF_GROUP: GroupState;
    "x", "m", "centre of mass; NaN as all places and velocities of points if none is left", |g| g.position[0];
    "y", "m", "the same in y", |g| g.position[1];
    "vx", "m/s", "mean velocity by mass", |g| g.velocity[0];
    "vy", "m/s", "the same in y", |g| g.velocity[1];
    "mass", "kg/m", "mass", |g| g.mass;
    "kinetic", "J/m", "kinetic energy", |g| g.kinetic;
    "fx", "N/m", "force of bodies and other groups on it", |g| g.contact_force[0];
    "fy", "N/m", "the same in y", |g| g.contact_force[1];
    "xmin", "m", "least x of its points", |g| g.lower[0];
    "xmax", "m", "largest x of its points", |g| g.upper[0];
    "ymin", "m", "least y of its points", |g| g.lower[1];
    "ymax", "m", "largest y of its points", |g| g.upper[1];
    "contacts", "1", "its points on which bodies or other groups exert a force", |g| g.contacts as f64;
    "loaded_width", "m", "extent in x of these points", |g| g.loaded_upper[0] - g.loaded_lower[0];
    "loaded_height", "m", "the same in y", |g| g.loaded_upper[1] - g.loaded_lower[1];
}

table! {
    /// Quantities of one probe. The place is the first, in x and y, then the mass.
    OF_PROBE: Followed;
    "x", "m", "centre of mass of its points", |p| p.now.position[0];
    "y", "m", "the same in y", |p| p.now.position[1];
    "mass", "kg/m", "mass", |p| p.now.mass;
    "ux", "m", "displacement since the first row of this run; NaN once one of its points has been removed", |p| p.now.position[0] - p.first[0];
    "uy", "m", "the same in y", |p| p.now.position[1] - p.first[1];
    "vx", "m/s", "mean velocity by mass", |p| p.now.velocity[0];
    "vy", "m/s", "the same in y", |p| p.now.velocity[1];
    "fx", "N/m", "force of bodies on its points", |p| p.now.contact_force[0];
    "fy", "N/m", "the same in y", |p| p.now.contact_force[1];
}

table! {
    /// Quantities of one hold.
    OF_HOLD: GroupState;
    "x", "m", "centre of mass of the held points", |h| h.position[0];
    "y", "m", "the same in y", |h| h.position[1];
    "fx", "N/m", "force of the support on them", |h| h.contact_force[0];
    "fy", "N/m", "the same in y", |h| h.contact_force[1];
}

table! {
    /// Quantities of one boundary chain.
    OF_CHAIN: GroupState;
    "x", "m", "mean of its markers", |c| c.position[0];
    "y", "m", "the same in y", |c| c.position[1];
    "fx", "N/m", "force of bodies on it", |c| c.contact_force[0];
    "fy", "N/m", "the same in y", |c| c.contact_force[1];
    "contacts", "1", "markers that bear a force", |c| c.contacts as f64;
    "angular_shift", "N s", "angular momentum that its weights have given to the continuum so far", |c| c.kinetic;
}

table! {
    /// Quantities of one body.
    OF_BODY: BodyState;
    "x", "m", "centre of mass", |b| b.position[0];
    "y", "m", "the same in y", |b| b.position[1];
    "vx", "m/s", "its velocity", |b| b.velocity[0];
    "vy", "m/s", "the same in y", |b| b.velocity[1];
    "angle", "rad", "angle, counter-clockwise", |b| b.angle;
    "spin", "rad/s", "angular velocity", |b| b.spin;
    "mass", "kg/m", "mass", |b| b.mass;
    "inertia", "kg m", "moment of inertia about the centre of mass", |b| b.inertia;
    "kinetic", "J/m", "kinetic energy of translation and rotation", kinetic;
    "fx", "N/m", "force of the points on the body", |b| b.point_force[0];
    "fy", "N/m", "the same in y", |b| b.point_force[1];
    "torque", "N", "torque of the points on the body", |b| b.point_torque;
    "contacts", "1", "points that overlap the body, of a cluster with each disc; also without a force, as at a dashpot that does not pull", |b| b.contacts as f64;
    "contact_fx", "N/m", "force of other bodies on the body", |b| b.body_force[0];
    "contact_fy", "N/m", "the same in y", |b| b.body_force[1];
    "contact_torque", "N", "torque of other bodies on the body", |b| b.body_torque;
}

table! {
    /// Quantities of a generated set of bodies.
    OF_FILL: [BodyState];
    "x", "m", "mean position by mass", |f| mean(f, |b| b.position[0]);
    "y", "m", "the same in y", |f| mean(f, |b| b.position[1]);
    "vx", "m/s", "mean velocity by mass", |f| mean(f, |b| b.velocity[0]);
    "vy", "m/s", "the same in y", |f| mean(f, |b| b.velocity[1]);
    "mass", "kg/m", "mass of all", mass;
    "kinetic", "J/m", "kinetic energy of all, with rotation", |f| f.iter().map(kinetic).sum();
    "spread", "m", "mean of `|x - x_mean|` by mass",
        |f| { let x = mean(f, |b| b.position[0]); mean(f, |b| (b.position[0] - x).abs()) };
    "xmin", "m", "least x of the centres", |f| along(f, 0).fold(f64::INFINITY, f64::min);
    "xmax", "m", "largest x of the centres", |f| along(f, 0).fold(f64::NEG_INFINITY, f64::max);
    "ymin", "m", "least y of the centres", |f| along(f, 1).fold(f64::INFINITY, f64::min);
    "ymax", "m", "largest y of the centres", |f| along(f, 1).fold(f64::NEG_INFINITY, f64::max);
}

fn mass(bodies: &[BodyState]) -> f64 {
    bodies.iter().map(|b| b.mass).sum()
}

/// Mean by mass.
fn mean(bodies: &[BodyState], of: impl Fn(&BodyState) -> f64) -> f64 {
    let sum: f64 = bodies.iter().map(|b| b.mass * of(b)).sum();
    sum / mass(bodies)
}

fn along(bodies: &[BodyState], axis: usize) -> impl Iterator<Item = f64> {
    bodies.iter().map(move |b| b.position[axis])
}

/// Kinetic energy of translation and rotation in J/m.
fn kinetic(b: &BodyState) -> f64 {
    let speed_sq = b.velocity[0].powi(2) + b.velocity[1].powi(2);
    0.5 * b.mass * speed_sq + 0.5 * b.inertia * b.spin.powi(2)
}

/// The ledgers of both sides at one time.
#[derive(Debug, Clone, Copy)]
pub struct Ledgers {
    /// `t_n` in s.
    pub time: f64,
    /// The continuum's ledger; zeros where there is none.
    pub mpm: Ledger,
    /// The bodies' ledger; zeros where there is none.
    pub dem: Ledger,
    /// The balance that has taken both.
    pub balance: Balance,
}

/// The registry: every quantity of a scene and its place in a sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Quantities {
    names: Vec<String>,
    /// Their units, per metre of thickness.
    units: Vec<&'static str>,
    /// Numbers of groups, probes, holds and chains, which a measurement has one after the other.
    sets: [usize; 4],
    /// Number of bodies that are written one by one.
    bodies: usize,
    /// Number of bodies of each set; the sets follow these bodies.
    fills: Vec<usize>,
    /// Thickness of the slice in m; `None`: the values are per metre.
    thickness: Option<f64>,
}

impl Quantities {
    /// The quantities of a scene with these point groups, probes, holds and chains, bodies, and generated sets of so
    /// many bodies.
    pub fn new<'a>(
        groups: impl IntoIterator<Item = &'a str>,
        [probes, holds, chains]: [&[&str]; 3],
        bodies: impl IntoIterator<Item = &'a str>,
        fills: impl IntoIterator<Item = (&'a str, u32)>,
    ) -> Self {
        let mut registry = Self::default();
        registry.add("", OF_RUN);
        let [probes, holds, chains] = [probes, holds, chains].map(|names| names.iter().copied());
        registry.sets = [
            registry.add_each("points", groups, OF_GROUP),
            registry.add_each("probe", probes, OF_PROBE),
            registry.add_each("hold", holds, OF_HOLD),
            registry.add_each("chain", chains, OF_CHAIN),
        ];
        registry.bodies = registry.add_each("body", bodies, OF_BODY);
        for (fill, count) in fills {
            registry.fills.push(count as usize);
            registry.add(&format!("fill.{fill}."), OF_FILL);
        }
        registry
    }

    /// Adds what has these names; returns how many there are.
    fn add_each<'a, T: ?Sized>(
        &mut self,
        kind: &str,
        names: impl IntoIterator<Item = &'a str>,
        rows: &[Row<T>],
    ) -> usize {
        let add = |name| self.add(&format!("{kind}.{name}."), rows);
        names.into_iter().map(add).count()
    }

    fn add<T: ?Sized>(&mut self, prefix: &str, rows: &[Row<T>]) {
        let names = rows.iter().map(|row| format!("{prefix}{}", row.name));
        self.names.extend(names);
        self.units.extend(rows.iter().map(|row| row.unit));
    }

    /// The same for a slice of this thickness (m), if the scene has one: masses, forces, momenta and energies are those of the
    /// slice and not of a metre.
    #[must_use]
    pub fn of_slice(self, thickness: Option<f64>) -> Self {
        Self { thickness, ..self }
    }

    /// Unit of a quantity by its name, also after `initial.`. `None` if it is not the name of a quantity.
    pub fn unit_of(&self, name: &str) -> Option<&'static str> {
        let place = self.index(name.strip_prefix("initial.").unwrap_or(name))?;
        let unit = self.units[place];
        let of_slice = self.thickness.and(slice_unit(unit));
        Some(of_slice.unwrap_or(unit))
    }

    /// All names, in the order of a sample.
    pub fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.names.iter().map(String::as_str)
    }

    /// Index of a quantity in a sample.
    pub fn index(&self, name: &str) -> Option<usize> {
        let name = whole_name(name);
        self.names.iter().position(|known| known == name)
    }

    /// What a name means in an expression over `[sample, initial sample]`: a quantity, or `initial.` and a quantity.
    pub fn meaning(&self, name: &str) -> Option<Meaning> {
        match name.strip_prefix("initial.") {
            Some(quantity) => Some(Meaning::Slot(self.names.len() + self.index(quantity)?)),
            None => Some(Meaning::Slot(self.index(name)?)),
        }
    }

    /// The records of groups, probes and holds, and those of chains.
    pub fn split_chains<'a>(&self, records: &'a mut [GroupState]) -> [&'a mut [GroupState]; 2] {
        records.split_at_mut(records.len() - self.sets[3]).into()
    }

    /// The sample of one measurement: the values of all quantities in their order, the time first. `groups` has a record for
    /// each point group, then for each probe, hold and chain, and `bodies` one for each body, in the order of the scene. `first`
    /// is the first sample; it is empty if this is it.
    ///
    /// # Panics
    /// If there are not as many groups or bodies as the scene has: an assertion, they were configured from it.
    pub fn sample(
        &self,
        ledgers: &Ledgers,
        groups: &[GroupState],
        bodies: &[BodyState],
        first: &[f64],
    ) -> Vec<f64> {
        let count: usize = self.sets.iter().sum();
        assert_eq!(groups.len(), count, "one record a group");
        let mut groups = groups.to_vec();
        let [of_points, _] = self.split_chains(&mut groups);
        // No points, no place: solvers write zeros.
        for none in of_points.iter_mut().filter(|state| state.mass == 0.0) {
            (none.position, none.velocity) = ([f64::NAN; 2], [f64::NAN; 2]);
            (none.lower, none.upper) = (none.position, none.position);
        }
        let mut rest = &groups[..];
        let [groups, probes, holds, chains] = self.sets.map(|count| {
            let (set, others) = rest.split_at(count);
            rest = others;
            set
        });
        let count = self.bodies + self.fills.iter().sum::<usize>();
        assert_eq!(bodies.len(), count, "one record a body");
        let (bodies, mut filled) = bodies.split_at(self.bodies);
        let mut sample = Vec::with_capacity(self.names.len());
        add(&mut sample, OF_RUN, ledgers);
        add_each(&mut sample, OF_GROUP, groups);
        for &now in probes {
            let place = sample.len();
            let mass = now.mass * self.thickness.unwrap_or(1.0);
            let first = match first.get(place..place + 3) {
                // Of all points, but for rounding.
                Some(&[x, y, all]) if mass >= (1.0 - 1e-9) * all => [x, y],
                Some(_) => [f64::NAN; 2],
                _ => now.position,
            };
            add(&mut sample, OF_PROBE, &Followed { now, first });
        }
        add_each(&mut sample, OF_HOLD, holds);
        add_each(&mut sample, OF_CHAIN, chains);
        add_each(&mut sample, OF_BODY, bodies);
        for count in &self.fills {
            let (fill, others) = filled.split_at(*count);
            add(&mut sample, OF_FILL, fill);
            filled = others;
        }
        if let Some(thickness) = self.thickness {
            for (value, unit) in sample.iter_mut().zip(&self.units) {
                if slice_unit(unit).is_some() {
                    *value *= thickness;
                }
            }
        }
        sample
    }

    /// The list of all quantities as the CSV file docs/quantities.csv.
    pub fn reference() -> String {
        let mut table = "name,unit,meaning\n".to_owned();
        list(&mut table, "", OF_RUN);
        list(&mut table, "points.NAME.", OF_GROUP);
        list(&mut table, "probe.NAME.", OF_PROBE);
        list(&mut table, "hold.NAME.", OF_HOLD);
        list(&mut table, "chain.NAME.", OF_CHAIN);
        list(&mut table, "body.NAME.", OF_BODY);
        list(&mut table, "fill.NAME.", OF_FILL);
        table
    }
}

fn list<T: ?Sized>(table: &mut String, of: &str, rows: &[Row<T>]) {
    for row in rows {
        let (name, unit, meaning) = (row.name, row.unit, row.meaning);
        let _ = writeln!(table, "{of}{name},{unit},\"{meaning}\"");
    }
}

fn add<T: ?Sized>(sample: &mut Vec<f64>, rows: &[Row<T>], of: &T) {
    sample.extend(rows.iter().map(|row| (row.value)(of)));
}

fn add_each<T>(sample: &mut Vec<f64>, rows: &[Row<T>], each: &[T]) {
    for one in each {
        add(sample, rows, one);
    }
}

#[cfg(test)]
mod tests;
