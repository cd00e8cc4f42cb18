//! What a continuum answers beside what the oracle expects.

use interface::Vec2;
use interface::config::Transfer;
use interface::message::wire::{
    GroupState, ImpForce, ImpInfo, Ledger, Limits, PointState, Report, StepHeader, flags,
};
use interface::solver::Readiness;
use mechanics::outline::nearest;

use super::super::judge::{Judge, Number, Result, Vector, energies};
use super::case::Case;
use super::oracle::{Expected, Oracle};
use super::run::Stand;
use crate::bench::Shown;

/// What rounding may change, as a share: of a cell, and of the speed of waves. A place in a cell is rounded more the
/// farther the cell is from the origin.
fn blur(oracle: &Oracle) -> f64 {
    let c = &oracle.config;
    let far = c
        .domain
        .as_flattened()
        .iter()
        .fold(0.0_f64, |far, x| far.max(x.abs()));
    1e-12 + 1e-14 * far / c.cell
}

/// Tolerances of places (m), velocities (m/s), kinetic and stored energies (J/m) and impulses (N s/m).
struct Tolerance {
    x: f64,
    v: f64,
    energy: f64,
    stored: f64,
    impulse: f64,
}

impl Tolerance {
    fn of(stand: &Stand) -> Self {
        let (oracle, blur) = (&stand.oracle, blur(&stand.oracle));
        let speed = oracle.wave + stand.fastest;
        let mass: f64 = oracle.all().iter().map(|p| p.mass).sum();
        Self {
            x: blur * oracle.config.cell,
            v: blur * speed,
            energy: blur * mass * speed * (stand.fastest + blur * speed),
            stored: 10.0 * blur * mass * speed * speed,
            impulse: blur * mass * speed,
        }
    }
}

/// How far a point is beyond the reach of the bodies and of the points that it may touch, in m; below 0: within.
fn beyond(k: usize, oracle: &Oracle, case: &Case) -> f64 {
    let own = oracle.points[k];
    let (x, skin) = (Vec2::from(oracle.point(k).x), oracle.config.skin);
    let of_bodies = case.bodies.iter().map(|body| {
        let outline: Vec<Vec2> = body.vertices.iter().map(|&v| v.into()).collect();
        nearest(&outline, x).distance - body.reach - own.radius - skin
    });
    let pairs = &oracle.config.group_pairs;
    let touch = |other: usize| {
        let pair = [own.group, other];
        pairs.iter().any(|p| *p == pair || *p == [pair[1], pair[0]])
    };
    let others = oracle.points.iter().enumerate();
    let of_points = others
        .filter(|(_, other)| touch(other.group))
        .map(|(o, other)| {
            (Vec2::from(oracle.point(o).x) - x).norm() - own.radius - other.radius - skin
        });
    of_bodies.chain(of_points).fold(f64::INFINITY, f64::min)
}

impl Judge<'_> {
    /// What is said with Ready.
    pub fn readiness(&mut self, oracle: &Oracle, ready: &Readiness) -> Result {
        self.same("S-2c", "items", ready.items, oracle.points.len() as u64)?;
        let time = oracle.config.cell / oracle.wave;
        let of = "courant_time in s";
        self.near("S-2c", of, ready.courant_time, time, 1e-12 * time)?;
        let masses = oracle.all().into_iter().map(|p| p.mass);
        let least = masses.fold(f64::INFINITY, f64::min);
        self.near(
            "S-2c",
            "mass_min in kg/m",
            ready.mass_min,
            least,
            1e-12 * least,
        )
    }

    /// The set, if there is a new one, and whether one was due.
    pub fn set(
        &mut self,
        shown: &Shown,
        set: &[ImpInfo],
        stand: &mut Stand,
        case: &Case,
    ) -> Result {
        let (tiny, header) = (Tolerance::of(stand).x, &shown.header);
        stand.sets += u64::from(shown.new_set.is_some());
        let flag = shown.new_set.map_or(0, |_| flags::NEW_SET);
        let of_set = shown
            .new_set
            .map_or((stand.sets, flag), |h| (h.set, h.flags));
        let of = "generation and flags of the set and of its states";
        let due = (stand.sets, flag);
        self.same("I-8a", of, [of_set, (header.set, header.flags)], [due; 2])?;
        if shown.new_set.is_none() {
            return self.no_set(stand, tiny);
        }
        let rise = set.windows(2).all(|pair| pair[0].id < pair[1].id);
        self.same("I-2g", "whether ids rise", rise, true)?;
        stand.set.clear();
        for (info, state) in set.iter().zip(&shown.states) {
            let of = |what| format!("{what} of point {}", info.id);
            let Some(k) = stand.named(info.id, info.group, state.position) else {
                self.same("I-2g", of("group"), Some(info.group), None)?;
                continue;
            };
            let (radius, mass) = (stand.oracle.points[k].radius, stand.oracle.point(k).mass);
            self.same("I-2g", of("radius in m"), info.radius, radius)?;
            self.near("I-2g", of("mass in kg/m"), info.mass, mass, 1e-12 * mass)?;
            stand.set.push(k);
        }
        for k in 0..stand.oracle.points.len() {
            let (out, is_in) = (beyond(k, &stand.oracle, case), stand.set.contains(&k));
            if out.abs() > tiny {
                let (at, out) = (Vector(stand.oracle.point(k).x), Number(out));
                let of =
                    format!("whether the point at {at} m, {out} m beyond reach, is in the set");
                self.same("I-7a", of, is_in, out.0 < 0.0)?;
            }
        }
        stand.chosen = stand.oracle.all().iter().map(|p| p.x).collect();
        stand.bodies = 0.0;
        Ok(())
    }

    /// That the set may stay as it is.
    fn no_set(&mut self, stand: &Stand, tiny: f64) -> Result {
        let all = stand.oracle.all();
        let moved = all.iter().zip(&stand.chosen);
        let moved = moved.map(|(p, then)| (p.x[0] - then[0]).hypot(p.x[1] - then[1]));
        let points = moved.fold(0.0, f64::max);
        let pairs = !stand.oracle.config.group_pairs.is_empty();
        let bodies = stand.bodies.max(if pairs { points } else { 0.0 });
        let radii = stand.oracle.points.iter().map(|p| p.radius);
        let allowed = stand.oracle.config.skin - 0.5 * radii.fold(0.0, f64::max);
        let of = "skin less half a radius, after which there is a new set, in m";
        self.at_least("I-6a", of, allowed + 4.0 * tiny, points + bodies)
    }

    /// The states of a step.
    pub fn states(&mut self, shown: &Shown, stand: &Stand) -> Result {
        let tolerance = Tolerance::of(stand);
        let clause = if stand.pressed { "F-1a" } else { "T-1a" };
        for (k, state) in stand.set.iter().zip(&shown.states) {
            let p = stand.oracle.point(*k);
            let of = format!("position of point {k} in m");
            self.near_vector(clause, of, state.position, p.x.into(), tolerance.x)?;
            let of = format!("velocity of point {k} in m/s");
            self.near_vector(clause, of, state.velocity, p.v.into(), tolerance.v)?;
            let of = format!("spin of point {k} in rad/s");
            let per_cell = 4.0 / stand.oracle.config.cell;
            self.near("F-1a", of, state.spin, p.spin, per_cell * tolerance.v)?;
        }
        Ok(())
    }

    /// What a report counts.
    pub fn counts(&mut self, report: &Report, stand: &Stand) -> Result {
        let said = [report.items, report.imps, report.rebuilds];
        let points = [stand.oracle.points.len(), stand.set.len()].map(|n| n as u64);
        let want = [points[0], points[1], stand.sets];
        self.same("R-1b", "items, imps and rebuilds", said, want)
    }

    /// All points in a frame or at the end.
    pub fn all_points(
        &mut self,
        clause: &'static str,
        (step, header): (u64, StepHeader),
        points: &[PointState],
        stand: &mut Stand,
    ) -> Result {
        let (t, blur) = (Tolerance::of(stand), blur(&stand.oracle));
        let (said, want) = (
            (header.step, points.len()),
            (step, stand.oracle.points.len()),
        );
        self.same(clause, "step and number of all points", said, want)?;
        let rise = points.windows(2).all(|pair| pair[0].id < pair[1].id);
        self.same(clause, "whether ids rise", rise, true)?;
        for got in points {
            let of = |what: &str| format!("{what} of point {}", got.id);
            let Some(k) = stand.named(got.id, got.group, got.position) else {
                self.same(clause, of("group"), Some(got.group), None)?;
                continue;
            };
            let p = *stand.oracle.point(k);
            self.near_vector(clause, of("position in m"), got.position, p.x.into(), t.x)?;
            self.near_vector(clause, of("velocity in m/s"), got.velocity, p.v.into(), t.v)?;
            let volume = p.volume * p.ratio;
            let stiff = 10.0 * blur * (p.bulk + p.shear);
            let [xx, yy, zz, xy] = got.stress;
            let [pxx, pyy, pzz, pxy] = p.stress;
            for (what, got, want, tolerance) in [
                ("mass in kg/m", got.mass, p.mass, 1e-12 * p.mass),
                ("volume in m^2", got.volume, volume, 10.0 * blur * volume),
                ("stress xx in Pa", xx, pxx, stiff),
                ("stress yy in Pa", yy, pyy, stiff),
                ("stress zz in Pa", zz, pzz, stiff),
                ("stress xy in Pa", xy, pxy, stiff),
                ("plastic_strain", got.plastic_strain.into(), 0.0, 0.0),
            ] {
                self.near(clause, of(what), got, want, tolerance)?;
            }
        }
        Ok(())
    }

    /// The groups as measured.
    pub fn groups(&mut self, expected: &Expected, groups: &[GroupState], stand: &Stand) -> Result {
        let t = Tolerance::of(stand);
        for (g, (want, got)) in expected.groups.iter().zip(groups).enumerate() {
            let of = |what: &str| format!("{what} of group {g}");
            let force = 1e-12 * Vec2::from(want.contact_force).norm();
            self.near(
                "R-3e",
                of("mass in kg/m"),
                got.mass,
                want.mass,
                1e-12 * want.mass,
            )?;
            self.near(
                "R-3e",
                of("kinetic in J/m"),
                got.kinetic,
                want.kinetic,
                t.energy,
            )?;
            self.near(
                "R-3e",
                of("contacts"),
                got.contacts as f64,
                want.contacts as f64,
                0.0,
            )?;
            for (what, got, want, tolerance) in [
                ("position in m", got.position, want.position, t.x),
                ("velocity in m/s", got.velocity, want.velocity, t.v),
                (
                    "contact_force in N/m",
                    got.contact_force,
                    want.contact_force,
                    force,
                ),
                ("lower in m", got.lower, want.lower, t.x),
                ("upper in m", got.upper, want.upper, t.x),
                (
                    "loaded_lower in m",
                    got.loaded_lower,
                    want.loaded_lower,
                    t.x,
                ),
                (
                    "loaded_upper in m",
                    got.loaded_upper,
                    want.loaded_upper,
                    t.x,
                ),
            ] {
                self.near_vector("R-3e", of(what), got, want.into(), tolerance)?;
            }
        }
        Ok(())
    }

    /// The ledger as measured.
    pub fn books(&mut self, expected: &Expected, got: &Ledger, stand: &Stand) -> Result {
        let (t, want) = (Tolerance::of(stand), &expected.ledger);
        let config = &stand.oracle.config;
        self.near(
            "N-1a",
            "kinetic in J/m",
            got.kinetic,
            want.kinetic,
            t.energy,
        )?;
        // Strains of a few percent are worked up by a quadrature of the step.
        let works = 0.02 * want.stress_work.abs() + t.stored.max(1e-6 * want.kinetic);
        let stored = if stand.works { t.stored } else { works };
        if stand.works {
            self.near(
                "N-1a",
                "stress_work in J/m",
                got.stress_work,
                want.stress_work,
                works,
            )?;
        }
        if config.transfer == Transfer::Flip {
            self.near("N-1a", "transfer_work in J/m", got.transfer_work, 0.0, 0.0)?;
        }
        let fall = t.impulse / t.v * t.x * Vec2::from(config.gravity).norm();
        let tolerance = stored + fall + 1e-13 * want.gravity.abs();
        for ((what, want), (_, got)) in energies(want).into_iter().zip(energies(got)) {
            self.near("N-1a", what, got, want, tolerance)?;
        }
        let force = expected
            .groups
            .iter()
            .map(|g| Vec2::from(g.contact_force).norm());
        let force = 1e-12 * force.sum::<f64>();
        self.near_impulses("N-1a", [got, want], t.impulse, force)
    }

    /// The limits that were said after a step with these forces on all points.
    pub fn bounds(
        &mut self,
        limits: &Limits,
        expected: &Expected,
        forces: &[ImpForce],
        stand: &Stand,
    ) -> Result {
        let bound = expected.contact_omega_sq;
        self.at_least(
            "L-2a",
            "contact_omega_sq in 1/s^2",
            limits.contact_omega_sq,
            bound,
        )?;
        if forces
            .iter()
            .all(|f| f.stiffness == 0.0 && f.tangential == 0.0)
        {
            let of = "contact_omega_sq in 1/s^2, without stiffness";
            self.near("L-2a", of, limits.contact_omega_sq, 0.0, 0.0)?;
        }
        let speeds = stand.set.iter().map(|k| stand.oracle.point(*k).v);
        let fastest = speeds.map(|v| v[0].hypot(v[1])).fold(0.0, f64::max);
        let least = fastest - Tolerance::of(stand).v;
        self.at_least("L-2a", "speed in m/s", limits.speed, least)?;
        let least = |radii: &mut dyn Iterator<Item = f64>| radii.fold(f64::INFINITY, f64::min);
        let all = least(&mut stand.oracle.points.iter().map(|p| p.radius));
        let of_set = least(&mut stand.set.iter().map(|k| stand.oracle.points[*k].radius));
        if ![all, of_set].contains(&limits.radius_min) {
            return self.differ(
                "L-2a",
                "radius_min in m",
                Number(all),
                Number(limits.radius_min),
            );
        }
        Ok(())
    }
}
