//! What a continuum answers beside what the oracle expects.

use interface::Vec2;
use interface::message::wire::{
    GroupState, ImpForce, ImpInfo, ImpState, Ledger, Limits, PointState, Report, StepHeader, flags,
};
use interface::solver::Readiness;
use mechanics::reference::layers::{Expected, Oracle};

use super::super::judge::{Judge, Result, show};
use super::case::{Case, Outline};
use super::run::Stand;
use crate::bench::Shown;

/// What rounding may change, as a share: of a cell, and of the speed of waves. A place in a cell is rounded more the
/// farther the cell is from the origin.
fn blur(oracle: &Oracle) -> f64 {
    1e-12 + 1e-14 * far(oracle) / oracle.config.cell
}

/// The largest coordinate of the domain in m.
fn far(oracle: &Oracle) -> f64 {
    let places = oracle.config.domain.as_flattened().iter();
    places.fold(0.0, |far, x| far.max(x.abs()))
}

/// Tolerances of places (m), velocities (m/s), spins (rad/s), kinetic and stored energies (J/m) and impulses (N s/m).
struct Tolerance {
    x: f64,
    v: f64,
    spin: f64,
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
            // A node of little mass, at the edge of what a point sees, may be much faster than any point. Splines have little
            // slope there, so what rounding makes of its weight counts as that of others; hats have all their slope.
            spin: 4.0 * blur / oracle.config.cell
                * (oracle.wave + stand.fastest.max(oracle.fastest_node())),
            energy: blur * mass * speed * (stand.fastest + blur * speed),
            stored: 10.0 * blur * mass * speed * speed,
            impulse: blur * mass * speed,
        }
    }
}

impl Judge<'_> {
    /// The contents of Ready.
    pub fn readiness(&mut self, oracle: &Oracle, ready: &Readiness) -> Result {
        self.same("S-2c", "items", ready.items, oracle.points.len() as u64)?;
        let time = oracle.config.cell / oracle.wave;
        let masses = oracle.all().into_iter().map(|p| p.mass);
        let least = masses.fold(f64::INFINITY, f64::min);
        for (of, got, want) in [
            ("courant_time in s", ready.courant_time, time),
            ("mass_min in kg/m", ready.mass_min, least),
        ] {
            self.near("S-2c", of, &[got], &[want], 1e-12 * want)?;
        }
        Ok(())
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
        let due = (stand.sets, flag);
        let of_set_too = shown.new_set.as_ref().map(|header| (header, set.len()));
        for (header, there) in of_set_too.into_iter().chain([(header, shown.states.len())]) {
            let of = "count in the header of a set or of states";
            self.same("C-4", of, header.count, there as u64)?;
        }
        let of_set = shown.new_set.map_or(due, |h| (h.set, h.flags));
        let of = "generation and flags of the set and of its states";
        self.same("I-8a", of, [of_set, (header.set, header.flags)], [due; 2])?;
        if shown.new_set.is_none() {
            return self.no_set(stand, tiny);
        }
        let rise = set.windows(2).all(|pair| pair[0].id < pair[1].id);
        self.same("I-2g", "whether ids rise", rise, true)?;
        stand.set.clear();
        for (info, state) in set.iter().zip(&shown.states) {
            let of = format!(" of point {}", info.id);
            let Some(k) = stand.named(info.id, info.group, state.position) else {
                let what = format_args!("group{of}");
                self.same("I-2g", what, Some(info.group), None)?;
                continue;
            };
            let mass = stand.oracle.point(k).mass;
            let want = ImpInfo {
                radius: stand.oracle.points[k].radius,
                mass,
                ..*info
            };
            let rows = [("I-2g", "radius", 0.0), ("I-2g", "mass", 1e-12 * mass)];
            self.fields(&of, [info, &want], &rows)?;
            stand.set.push(k);
        }
        let bodies = case.bodies.iter().map(Outline::placed).collect::<Vec<_>>();
        let mut has = vec![false; stand.oracle.points.len()];
        stand.set.iter().for_each(|k| has[*k] = true);
        for (k, is_in) in has.into_iter().enumerate() {
            let out = stand.oracle.beyond(k, &bodies);
            if out.abs() > tiny {
                let (at, far) = (show(&stand.oracle.point(k).x), show(&[out]));
                let of = format!("whether the point at {at} m, {far} m beyond reach, is in");
                self.same("I-7a", of, is_in, out < 0.0)?;
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
            let want = ImpState {
                position: p.x,
                velocity: p.v,
                spin: p.spin,
            };
            let rows = [
                ("F-1a", "spin", tolerance.spin),
                (clause, "position", tolerance.x),
                (clause, "velocity", tolerance.v),
            ];
            self.fields(&format!(" of point {k}"), [state, &want], &rows)?;
        }
        Ok(())
    }

    /// What a report counts.
    pub fn counts(&mut self, report: &Report, stand: &Stand) -> Result {
        let sent = [report.items, report.imps, report.rebuilds];
        let points = [stand.oracle.points.len(), stand.set.len()].map(|n| n as u64);
        let want = [points[0], points[1], stand.sets];
        self.same("R-1b", "items, imps and rebuilds", sent, want)
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
        let (sent, want) = (
            (header.step, points.len()),
            (step, stand.oracle.points.len()),
        );
        let (announced, there) = (header.count, points.len() as u64);
        self.same("C-4", "count in the header of all points", announced, there)?;
        self.same(clause, "step and number of all points", sent, want)?;
        let rise = points.windows(2).all(|pair| pair[0].id < pair[1].id);
        self.same(clause, "whether ids rise", rise, true)?;
        for got in points {
            let of = format!(" of point {}", got.id);
            let Some(k) = stand.named(got.id, got.group, got.position) else {
                self.same(clause, format_args!("group{of}"), Some(got.group), None)?;
                continue;
            };
            let p = *stand.oracle.point(k);
            let strain = if stand.strains { p.plastic_strain } else { 0.0 };
            let tolerance = 2e-7 * strain + 10.0 * blur;
            let of_strain = if p.model.keeps_plastic_strain() {
                ("R-5e", "plastic_strain", tolerance)
            } else {
                (clause, "plastic_strain", 0.0)
            };
            let want = PointState {
                position: p.x,
                velocity: p.v,
                mass: p.mass,
                volume: p.volume * p.ratio,
                stress: p.stress,
                plastic_strain: strain as f32,
                ..PointState::default()
            };
            let rows = [
                (clause, "position", t.x),
                (clause, "velocity", t.v),
                (clause, "mass", 1e-12 * p.mass),
                (clause, "volume", 10.0 * blur * want.volume),
                (clause, "stress", 10.0 * blur * (p.bulk + p.shear)),
                of_strain,
            ];
            self.fields(&of, [got, &want], &rows)?;
        }
        Ok(())
    }

    /// The groups as measured.
    pub fn groups(&mut self, expected: &Expected, groups: &[GroupState], stand: &Stand) -> Result {
        let (t, config) = (Tolerance::of(stand), &stand.oracle.config);
        // A sum is rounded once for each of its terms.
        let mean = t.x + f64::EPSILON * far(&stand.oracle) * stand.oracle.points.len() as f64;
        let supports = config.groups.len() + config.probes.len();
        let of_all = groups.iter().skip(supports).fold([0.0; 2], |sum, support| {
            [0, 1].map(|a| sum[a] + support.contact_force[a])
        });
        for (g, (want, got)) in expected.groups.iter().zip(groups).enumerate() {
            let is_support = g >= supports;
            let is_last = is_support && g + 1 == expected.groups.len();
            let mut got = *got;
            if is_support {
                got.contact_force = if is_last { of_all } else { [0.0; 2] };
            }
            let force = if is_support && expected.kick > 0.0 {
                t.impulse / expected.kick
            } else {
                1e-12 * Vec2::from(want.contact_force).norm()
            };
            let rows = [
                ("mass", 1e-12 * want.mass),
                ("kinetic", t.energy),
                ("contacts", 0.0),
                ("position", mean),
                ("velocity", t.v),
                ("contact_force", force),
                ("lower", t.x),
                ("upper", t.x),
                ("loaded_lower", t.x),
                ("loaded_upper", t.x),
            ];
            let rows = rows.map(|(name, tolerance)| ("R-3e", name, tolerance));
            self.fields(&format!(" of group {g}"), [&got, want], &rows)?;
        }
        Ok(())
    }

    /// The ledger as measured.
    pub fn books(&mut self, expected: &Expected, got: &Ledger, stand: &Stand) -> Result {
        let (t, want) = (Tolerance::of(stand), &expected.ledger);
        let config = &stand.oracle.config;
        // With periodic walls angular momentum has no balance.
        let turned = !config.walls.periodic().contains(&true);
        let corners = config.domain.iter().map(|[x, y]| x.hypot(*y));
        let moment = t.impulse * corners.fold(config.cell, f64::max);
        let rows = [
            (true, "kinetic", t.energy),
            (true, "viscous_work", t.stored),
            (stand.works, "stress_work", t.stored),
            (true, "transfer_work", t.stored),
            (true, "angular_momentum", moment),
            (true, "contact_moment", moment),
            (turned, "applied_moment", moment),
        ];
        let asked = rows.into_iter().filter(|(asked, ..)| *asked);
        let rows: Vec<_> = asked.map(|(_, name, most)| ("N-1a", name, most)).collect();
        self.fields("", [got, want], &rows)?;
        let fall = t.impulse / t.v * t.x * Vec2::from(config.gravity).norm();
        // A solver that does not report both may report either.
        let either = f64::from(u8::from(!stand.works)) * expected.created.abs();
        let energy = t.stored + either + fall + 1e-13 * want.gravity.abs();
        let groups = &expected.groups[..config.groups.len()];
        let forces = groups.iter().map(|g| Vec2::from(g.contact_force).norm());
        let force = 1e-12 * forces.sum::<f64>();
        self.ledgers("N-1a", [got, want], [energy, t.impulse, force])
    }

    /// The limits that were reported after a step with these forces on all points.
    pub fn bounds(
        &mut self,
        limits: &Limits,
        expected: &Expected,
        forces: &[ImpForce],
        stand: &Stand,
    ) -> Result {
        let (of, reported) = ("contact_omega_sq in 1/s^2", limits.contact_omega_sq);
        self.at_least(
            "L-2a",
            of,
            reported,
            (1.0 - 1e-9) * expected.contact_omega_sq,
        )?;
        if forces.iter().all(|f| f.stiffness + f.tangential == 0.0) {
            self.same("L-2a", "contact_omega_sq without stiffness", reported, 0.0)?;
        }
        let speeds = stand.set.iter().map(|k| stand.oracle.point(*k).v);
        let fastest = speeds.map(|v| v[0].hypot(v[1])).fold(0.0, f64::max);
        let least = fastest - Tolerance::of(stand).v;
        self.at_least("L-2a", "speed in m/s", limits.speed, least)?;
        let radius = |k: usize| stand.oracle.points[k].radius;
        let least =
            |of: &mut dyn Iterator<Item = usize>| of.map(radius).fold(f64::INFINITY, f64::min);
        let all = least(&mut (0..stand.oracle.points.len()));
        let of_set = least(&mut stand.set.iter().copied());
        // Of all points, or of those of the set.
        let reported = limits.radius_min;
        let want = if reported == of_set { of_set } else { all };
        self.same("L-2a", "radius_min in m", reported, want)
    }
}
