//! What a solver of bodies answers beside what the oracle expects.

use interface::Vec2;
use interface::message::wire::{
    BodyState, ContactState, EnvelopeVertex, ImpForce, ImpInfo, Ledger, Limits,
};
use mechanics::outline::nearest;

use super::super::judge::{Judge, Number, Result, Vector, energies};
use super::oracle::{BLUR, Expected, Oracle, Touch, Who};

impl Judge<'_> {
    /// The forces of a step.
    pub fn forces(&mut self, expected: &Expected, set: &[ImpInfo], forces: &[ImpForce]) -> Result {
        for ((want, info), got) in expected.points.iter().zip(set).zip(forces) {
            let of = format_args!("force on point {} in N/m", info.id).to_string();
            if !want.touched && want.blur == 0.0 {
                if got.force != [0.0; 2] {
                    return self.differ(
                        "F-8",
                        of,
                        "(0, 0), since nothing overlaps",
                        Vector(got.force),
                    );
                }
                self.count("F-8", 0.0);
            }
            let tolerance = want.blur + 1e-9 * want.force.norm();
            self.near_vector("F-7", of, got.force, want.force, tolerance)?;
            let of = format_args!("couple on point {} in N", info.id).to_string();
            self.near("F-7", of, got.couple, want.couple, tolerance * info.radius)?;
            if got.force != [0.0; 2] && got.stiffness <= 0.0 {
                let of = format_args!("stiffness at point {} in N/m", info.id).to_string();
                return self.differ(
                    "F-5",
                    of,
                    "above 0 where there is a force",
                    Number(got.stiffness),
                );
            }
            self.count("F-5", 0.0);
        }
        for ((want, info), got) in expected.points.iter().zip(set).zip(forces) {
            let of = format_args!("stiffness at point {} in N/m", info.id).to_string();
            if want.at_the_edge {
                continue;
            }
            if want.exact {
                self.near(
                    "F-6",
                    of,
                    got.stiffness,
                    want.stiffness,
                    1e-9 * want.stiffness,
                )?;
            } else {
                self.at_least("F-6", of, got.stiffness, want.stiffness)?;
            }
            let of = format_args!("tangential stiffness at point {} in N/m", info.id).to_string();
            let least = (1.0 - 1e-9) * want.tangential;
            self.at_least("F-6", of, got.tangential, least)?;
        }
        Ok(())
    }

    /// `travel` of the header of forces.
    pub fn travel(&mut self, expected: &Expected, travel: f64) -> Result {
        expected.travel.map_or(Ok(()), |least| {
            self.at_least("F-9", "travel in m", travel, least)
        })
    }

    /// Outlines.
    pub fn envelopes(&mut self, oracle: &Oracle, vertices: &[EnvelopeVertex]) -> Result {
        let in_order = vertices.is_sorted_by_key(|vertex| vertex.body);
        self.same("E-4", "whether bodies come in their order", in_order, true)?;
        for (b, body) in oracle.bodies.iter().enumerate() {
            let own: Vec<&EnvelopeVertex> =
                vertices.iter().filter(|v| v.body == b as u64).collect();
            let same = own
                .iter()
                .all(|v| v.reach == own[0].reach && v.reach >= 0.0);
            self.same("E-4", format!("whether body {b} has one reach"), same, true)?;
            let outline: Vec<Vec2> = own.iter().map(|v| v.position.into()).collect();
            if outline.is_empty() {
                return self.differ(
                    "E-4",
                    format_args!("envelope of body {b}"),
                    "an outline",
                    "none",
                );
            }
            for (part, a) in body.parts() {
                for v in part {
                    let reach = own.iter().map(|v| v.reach).fold(0.0, f64::max);
                    for k in 0..8 {
                        let way = f64::from(k) * std::f64::consts::FRAC_PI_4;
                        let at = v + Vec2::new(way.cos(), way.sin()) * a;
                        let out = nearest(&outline, at).distance - reach;
                        if out > BLUR * (a + reach) + 1e-12 * at.norm() {
                            let what = format_args!("envelope of body {b}").to_string();
                            let got = format_args!(
                                "ends {} m before its surface at {}",
                                Number(out),
                                Vector(at.into())
                            )
                            .to_string();
                            return self.differ("E-4", what, "holds the whole body", got);
                        }
                    }
                }
            }
            self.count("E-4", 0.0);
        }
        Ok(())
    }

    /// Limits for the step of `now`, said after the step of `before`: what holds in both has to be bounded.
    /// Of speeds far below `speed` (m/s) nothing is told, and of frequencies far below that of a step of `dt` (s).
    pub fn limits(
        &mut self,
        limits: &Limits,
        before: &Expected,
        now: Option<&Expected>,
        (speed, dt): (f64, f64),
    ) -> Result {
        self.at_least(
            "L-2",
            "speed in m/s",
            limits.speed,
            before.speed - 1e-9 * speed,
        )?;
        let Some(now) = now else { return Ok(()) };
        let largest = |e: &Expected| e.loads.iter().map(|load| load.rate).fold(0.0, f64::max);
        let least = |of: &dyn Fn(&Expected) -> f64| of(before).min(of(now));
        self.at_least(
            "L-2",
            "contact_omega_sq in 1/s^2",
            limits.contact_omega_sq,
            least(&largest) - 1e-9 / (dt * dt),
        )?;
        self.at_least(
            "L-2",
            "omega_sq in 1/s^2",
            limits.omega_sq,
            least(&|e| e.own_omega_sq) - 1e-9 / (dt * dt),
        )?;
        self.at_least("L-2", "damping", limits.damping, least(&|e| e.damping))
    }

    /// Masses and poses of the bodies as measured, which the forces of the step have not changed yet.
    pub fn poses(&mut self, expected: &Expected, bodies: &[BodyState], tiny: f64) -> Result {
        for (b, (want, got)) in expected.bodies.iter().zip(bodies).enumerate() {
            let of = |what: &str| format!("{what} of body {b}");
            self.near(
                "J-1",
                of("mass in kg/m"),
                got.mass,
                want.mass,
                1e-9 * want.mass,
            )?;
            self.near(
                "J-1",
                of("moment of inertia in kg m"),
                got.inertia,
                want.inertia,
                1e-9 * want.inertia,
            )?;
            let place = Vec2::from(want.position);
            let tolerance = tiny + 1e-13 * place.norm();
            let size = (want.inertia / want.mass).sqrt();
            self.near_vector("T-1", of("position in m"), got.position, place, tolerance)?;
            self.near(
                "T-1",
                of("angle in rad"),
                got.angle,
                want.angle,
                tiny / size + 1e-12 * want.angle.abs(),
            )?;
        }
        Ok(())
    }

    /// Loads and velocities of the bodies as measured. `dt` (s) is the longest step so far, `tiny` (m) what is not told
    /// apart.
    pub fn bodies(
        &mut self,
        expected: &Expected,
        bodies: &[BodyState],
        (tiny, dt): (f64, f64),
    ) -> Result {
        for (b, (want, got)) in expected.bodies.iter().zip(bodies).enumerate() {
            let load = &expected.loads[b];
            let of = |what: &str| format!("{what} of body {b}");
            let (place, size) = (Vec2::from(want.position), (want.inertia / want.mass).sqrt());
            let (force, torque) = (Vec2::from(want.point_force), want.point_torque);
            let slack = load.blur + 1e-9 * (force.norm() + Vec2::from(want.body_force).norm());
            let arm = slack * (size + place.norm() * 1e-6) * 8.0 + 1e-9 * torque.abs();
            self.near_vector(
                "R-3",
                of("force of points in N/m"),
                got.point_force,
                force,
                slack,
            )?;
            self.near(
                "R-3",
                of("torque of points in N"),
                got.point_torque,
                torque,
                arm,
            )?;
            self.near_vector(
                "R-3",
                of("force of bodies in N/m"),
                got.body_force,
                want.body_force.into(),
                slack,
            )?;
            self.near(
                "R-3",
                of("torque of bodies in N"),
                got.body_torque,
                want.body_torque,
                arm,
            )?;
            self.near(
                "R-3",
                of("number of points that press"),
                got.contacts as f64,
                want.contacts as f64,
                0.0,
            )?;
            let per_dt = if dt > 0.0 { 1.0 / dt } else { 0.0 };
            let speed = Vec2::from(want.velocity);
            let tolerance = tiny * per_dt + 1e-9 * speed.norm() + slack * dt / want.mass;
            self.near_vector("T-1", of("velocity in m/s"), got.velocity, speed, tolerance)?;
            let tolerance = tiny / size * per_dt + 1e-9 * want.spin.abs() + arm * dt / want.inertia;
            self.near("T-1", of("spin in rad/s"), got.spin, want.spin, tolerance)?;
        }
        Ok(())
    }

    /// The ledger as measured. Of energies far below `energy` (J/m) nothing is told, and of impulses far below `impulse`
    /// (N s/m).
    pub fn ledger(
        &mut self,
        expected: &Expected,
        got: &Ledger,
        (energy, impulse): (f64, f64),
    ) -> Result {
        let want = &expected.ledger;
        // What comes and goes between these entries is exact to the sum of them.
        let scale: f64 =
            energies(want).iter().map(|(_, e)| e.abs()).sum::<f64>() + expected.viscous_most.abs();
        let blur: f64 = expected
            .touches
            .iter()
            .map(|touch| touch.blur * touch.overlap.abs())
            .sum();
        let tolerance = 1e-6 * scale + blur + 1e-9 * energy;
        for ((what, want), (_, got)) in energies(want).into_iter().zip(energies(got)) {
            self.near("N-1", what, got, want, tolerance)?;
        }
        let (least, most) = (
            want.viscous_work - tolerance,
            expected.viscous_most + tolerance,
        );
        if !(least..=most).contains(&got.viscous_work) {
            let expected = format_args!("{} to {}", Number(least), Number(most)).to_string();
            return self.differ(
                "N-1",
                "viscous_work in J/m",
                expected,
                Number(got.viscous_work),
            );
        }
        let momentum: f64 = [want.momentum, want.applied_impulse, want.contact_impulse]
            .iter()
            .map(|p| Vec2::from(*p).norm())
            .sum();
        let impulse = 1e-6 * momentum + 1e-9 * impulse;
        let force = Vec2::from(want.contact_force).norm();
        let slack: f64 = expected.loads.iter().map(|load| load.blur).sum::<f64>() + 1e-9 * force;
        self.near_impulses("N-1", [got, want], impulse, slack)
    }

    /// The contacts of a frame. Those that have only just begun may be missing.
    pub fn contacts(&mut self, expected: &Expected, contacts: &[ContactState]) -> Result {
        let names = |touch: &Touch| match touch.who {
            Who::Point(id, b, _) => (1, b as u64, id),
            Who::Bodies(i, _, j, _) => (0, i as u64, j as u64),
            Who::Points(p, q) => (2, p, q),
        };
        let mut found: Vec<Option<&ContactState>> = contacts.iter().map(Some).collect();
        for touch in &expected.touches {
            let (with, a, b) = names(touch);
            // A frame has the force on the body, on the first body or on the first point.
            let on_first = if with == 1 { -touch.force } else { touch.force };
            let slack = touch.blur + 1e-9 * touch.force.norm();
            let place = 1e-6 * touch.overlap.abs() + 1e-9 * touch.at.norm();
            let matches = |c: &ContactState, turned: bool| {
                let (pair, force) = if turned {
                    ((b, a), -on_first)
                } else {
                    ((a, b), on_first)
                };
                c.with == with
                    && (c.body, c.other) == pair
                    && (Vec2::from(c.force) - force).norm() <= slack
                    && (Vec2::from(c.position) - touch.at).norm() <= place
            };
            let turned = [false, true]
                .into_iter()
                .take(if with == 1 { 1 } else { 2 });
            let mut turned = turned.filter_map(|turned| {
                found
                    .iter()
                    .position(|c| c.is_some_and(|c| matches(c, turned)))
            });
            if let Some(k) = turned.next() {
                found[k] = None;
                self.count("R-6", 0.0);
                continue;
            }
            let what = match touch.who {
                Who::Point(id, b, _) => format!("contact of body {b} with point {id}"),
                Who::Bodies(i, _, j, _) => format!("contact of bodies {i} and {j}"),
                Who::Points(p, q) => format!("contact of points {p} and {q}"),
            };
            let expected = format!(
                "{} N/m at {} m",
                Vector(on_first.into()),
                Vector(touch.at.into())
            );
            let same = contacts
                .iter()
                .find(|c| c.with == with && [(a, b), (b, a)].contains(&(c.body, c.other)));
            let got = same.map_or("none".to_owned(), |c| {
                format!("{} N/m at {} m", Vector(c.force), Vector(c.position))
            });
            return self.differ("R-6", what, expected, got);
        }
        match found.into_iter().flatten().next() {
            Some(more) => self.differ(
                "R-6",
                "contacts of a frame",
                "those that overlap",
                format_args!("also {more:?}"),
            ),
            None => Ok(()),
        }
    }
}
