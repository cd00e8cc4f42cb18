//! What a solver of bodies answers beside what the oracle expects.

use interface::Vec2;
use interface::message::wire::{
    BodyState, ContactState, EnvelopeVertex, ImpForce, ImpInfo, Ledger, Limits,
};
use mechanics::outline::nearest;
use mechanics::reference::bodies::{BLUR, Expected, Oracle};

use super::super::judge::{Judge, Result, energies, show};
use crate::bench::Answer;

impl Judge<'_> {
    /// The forces of a step, and `travel` of their header; `whose`: of which run, if there are several.
    pub fn forces(
        &mut self,
        expected: &Expected,
        set: &[ImpInfo],
        answer: &Answer,
        whose: &str,
    ) -> Result {
        let points = || expected.points.iter().zip(set).zip(&answer.forces);
        for ((want, info), got) in points() {
            let of = format!("force on point {}{whose} in N/m", info.id);
            if !want.touched && want.blur == 0.0 {
                let of = format_args!("{of}, that nothing touches");
                self.same("F-8", of, got.force, [0.0; 2])?;
            }
            let tolerance = want.blur + 1e-9 * want.force.norm();
            self.near("F-7", &of, &got.force, want.force.as_slice(), tolerance)?;
            let stiff = got.force == [0.0; 2] || got.stiffness > 0.0;
            let of = format_args!("whether there is stiffness beside the {of}");
            self.same("F-5", of, stiff, true)?;
            let of = format_args!("couple on point {}{whose} in N", info.id);
            let tolerance = tolerance * info.radius;
            self.near("F-7", of, &[got.couple], &[want.couple], tolerance)?;
        }
        for ((want, info), got) in points().filter(|((want, _), _)| !want.at_the_edge) {
            let of = format_args!("stiffness at point {} in N/m", info.id);
            let (tangential, got, least) = (got.tangential, got.stiffness, want.stiffness);
            if want.exact {
                self.near("F-6", of, &[got], &[least], 1e-9 * least)?;
            } else {
                self.at_least("F-6", of, got, least)?;
            }
            let of = format_args!("tangential stiffness at point {} in N/m", info.id);
            let least = (1.0 - 1e-9) * want.tangential;
            self.at_least("F-6", of, tangential, least)?;
        }
        let least = expected.travel.unwrap_or(0.0);
        self.at_least("F-9", "travel in m", answer.header.travel, least)
    }

    /// That the forces on points and on bodies are opposite, whatever they are.
    pub fn opposite(
        &mut self,
        expected: &Expected,
        forces: &[ImpForce],
        bodies: &[BodyState],
    ) -> Result {
        let of_bodies = bodies.iter().map(|body| Vec2::from(body.point_force));
        let of_points = forces.iter().map(|f| Vec2::from(f.force));
        let size: f64 = of_points.clone().map(|f| f.norm()).sum();
        let blur: f64 = expected.points.iter().map(|point| point.blur).sum();
        let sum: Vec2 = of_bodies.chain(of_points).sum();
        let of = "sum of the forces on points and on bodies in N/m";
        self.near("R-3", of, sum.as_slice(), &[0.0; 2], blur + 1e-9 * size)
    }

    /// Outlines.
    pub fn envelopes(&mut self, oracle: &Oracle, vertices: &[EnvelopeVertex]) -> Result {
        let in_order = vertices.is_sorted_by_key(|vertex| vertex.body);
        self.same("E-4", "whether bodies come in their order", in_order, true)?;
        for (b, body) in oracle.bodies.iter().enumerate() {
            let own = || vertices.iter().filter(|v| v.body == b as u64);
            let reach = own().map(|v| v.reach).fold(0.0, f64::max);
            let (one, some) = (own().all(|v| v.reach == reach), own().next().is_some());
            let of = format!("whether body {b} has an outline and one reach");
            self.same("E-4", of, (some, one), (true, true))?;
            let outline: Vec<Vec2> = own().map(|v| v.position.into()).collect();
            let around = (0..8).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4);
            let around: Vec<_> = around.map(|way| Vec2::new(way.cos(), way.sin())).collect();
            let vertices = body.outline().collect::<Vec<_>>().into_iter();
            let surface = vertices.flat_map(|(v, a)| around.iter().map(move |n| (v + n * a, a)));
            for (at, a) in surface.take_while(|_| some) {
                let out = nearest(&outline, at).distance - reach;
                let within = out <= BLUR * (a + reach) + 1e-12 * at.norm();
                let of = format_args!("whether envelope {b} holds the surface at {at:?}");
                self.same("E-4", of, within, true)?;
            }
        }
        Ok(())
    }

    /// Limits for the step of `now`, reported after the step of `before`: what holds in both has to be bounded.
    /// Speeds far below `speed` (m/s) are not compared, nor frequencies far below that of a step of `dt` (s).
    pub fn limits(
        &mut self,
        limits: &Limits,
        before: &Expected,
        now: Option<&Expected>,
        (speed, dt): (f64, f64),
    ) -> Result {
        let least = before.speed - 1e-9 * speed;
        self.at_least("L-2", "speed in m/s", limits.speed, least)?;
        let tiny = 1e-9 / (dt * dt);
        let Some(now) = now else {
            let least = before.begun_omega_sq - tiny;
            return self.at_least("L-2", "omega_sq in 1/s^2", limits.omega_sq, least);
        };
        let largest = |e: &Expected| e.loads.iter().map(|load| load.rate).fold(0.0, f64::max);
        let least = |of: &dyn Fn(&Expected) -> f64| of(before).min(of(now));
        for (of, got, least) in [
            (
                "contact_omega_sq in 1/s^2",
                limits.contact_omega_sq,
                least(&largest) - tiny,
            ),
            (
                "omega_sq in 1/s^2",
                limits.omega_sq,
                // Who begins to touch, the solver knows, and within a step also at which lever arms.
                least(&|e| e.own_omega_sq)
                    .max(0.9 * now.begun_omega_sq)
                    .max(before.kinematic_omega_sq)
                    - tiny,
            ),
            ("damping", limits.damping, least(&|e| e.damping)),
            (
                "2 damping omega in 1/s",
                2.0 * limits.damping * limits.omega_sq.sqrt(),
                least(&|e| e.own_damping) - tiny * dt,
            ),
        ] {
            self.at_least("L-2", of, got, least)?;
        }
        Ok(())
    }

    /// Masses and poses of the bodies as measured, which the forces of the step have not changed yet.
    pub fn poses(&mut self, expected: &Expected, bodies: &[BodyState], tiny: f64) -> Result {
        for (b, (want, got)) in expected.bodies.iter().zip(bodies).enumerate() {
            let size = (want.inertia / want.mass).sqrt();
            let place = tiny + 1e-13 * Vec2::from(want.position).norm();
            let rows = [
                ("J-1", "mass", 1e-9 * want.mass),
                ("J-1", "inertia", 1e-9 * want.inertia),
                ("T-1", "position", place),
                ("T-1", "angle", tiny / size + 1e-12 * want.angle.abs()),
            ];
            self.fields(&format!(" of body {b}"), [got, want], &rows)?;
        }
        Ok(())
    }

    /// Loads and velocities of the bodies as measured. `dt` (s) is the longest step so far, `tiny` (m) what cannot be told
    /// apart.
    pub fn bodies(
        &mut self,
        expected: &Expected,
        bodies: &[BodyState],
        (tiny, dt): (f64, f64),
    ) -> Result {
        for (b, (want, got)) in expected.bodies.iter().zip(bodies).enumerate() {
            let norm = |v: [f64; 2]| Vec2::from(v).norm();
            let size = (want.inertia / want.mass).sqrt();
            let forces = norm(want.point_force) + norm(want.body_force);
            let slack = expected.loads[b].blur + 1e-9 * forces;
            let arm = slack * (size + norm(want.position) * 1e-6) * 8.0;
            let arm = arm + 1e-9 * want.point_torque.abs();
            let shift = if dt > 0.0 { tiny / dt } else { 0.0 };
            let speed = shift + 1e-9 * norm(want.velocity) + slack * dt / want.mass;
            let spin = shift / size + 1e-9 * want.spin.abs() + arm * dt / want.inertia;
            let rows = [
                ("R-3", "point_force", slack),
                ("R-3", "point_torque", arm),
                ("R-3", "body_force", slack),
                ("R-3", "body_torque", arm),
                ("R-3", "contacts", 0.0),
                ("T-1", "velocity", speed),
                ("T-1", "spin", spin),
            ];
            self.fields(&format!(" of body {b}"), [got, want], &rows)?;
        }
        Ok(())
    }

    /// The ledger as measured. Energies far below `energy` (J/m) are not compared, nor impulses far below `impulse`
    /// (N s/m).
    pub fn ledger(
        &mut self,
        expected: &Expected,
        got: &Ledger,
        (energy, impulse): (f64, f64),
    ) -> Result {
        let (want, most) = (&expected.ledger, expected.viscous_most);
        let touches = expected.touches.iter();
        let blur: f64 = touches.map(|touch| touch.blur * touch.overlap.abs()).sum();
        // What comes and goes between these entries is exact to the sum of them.
        let tolerance = 1e-6 * (energies(want) + most.abs()) + blur + 1e-9 * energy;
        let momenta = [want.momentum, want.applied_impulse, want.contact_impulse];
        let momentum: f64 = momenta.map(|p| Vec2::from(p).norm()).iter().sum();
        let slack = expected.loads.iter().map(|load| load.blur).sum::<f64>();
        let slack = slack + 1e-9 * Vec2::from(want.contact_force).norm();
        let impulse = 1e-6 * momentum + 1e-9 * impulse + expected.loose;
        self.ledgers("N-1", [got, want], [tolerance, impulse, slack])?;
        let moments = [
            want.angular_momentum,
            want.applied_moment,
            want.contact_moment,
        ];
        let moment = 1e-6 * moments.map(f64::abs).iter().sum::<f64>();
        let moment = moment + impulse * expected.far;
        let rows = ["angular_momentum", "applied_moment", "contact_moment"];
        self.fields("", [got, want], &rows.map(|name| ("N-1", name, moment)))?;
        let (work, least) = (got.viscous_work, want.viscous_work);
        let nearest = work.clamp(least, most.max(least));
        self.near("N-1", "viscous_work", &[work], &[nearest], tolerance)
    }

    /// The contacts of a frame. Those that have only just begun may be missing.
    pub fn contacts(&mut self, expected: &Expected, contacts: &[ContactState]) -> Result {
        let mut left = contacts.to_vec();
        for touch in &expected.touches {
            let want = touch.state();
            let turned = ContactState {
                body: want.other,
                other: want.body,
                force: want.force.map(|f| -f),
                ..want
            };
            // Of a body and a point the body is the first, of two alike either is.
            let ways = [want, if want.with == 1 { want } else { turned }];
            let slack = touch.blur + 1e-9 * touch.force.norm();
            let place = (1e-6 + touch.turns) * touch.overlap.abs() + 1e-9 * touch.at.norm();
            let names = |c: &ContactState| (c.with, c.body, c.other);
            let off = |a: [f64; 2], b: [f64; 2]| (Vec2::from(a) - Vec2::from(b)).norm();
            let same = |got: &ContactState| {
                ways.iter().any(|want| {
                    let near = off(got.force, want.force) <= slack;
                    let there = off(got.position, want.position) <= place;
                    names(got) == names(want) && near && there
                })
            };
            if let Some(k) = left.iter().position(same) {
                left.swap_remove(k);
                self.count("R-6", 0.0);
                continue;
            }
            let in_words =
                |c: &ContactState| format!("{} N/m at {} m", show(&c.force), show(&c.position));
            let of = ways.map(|want| names(&want));
            let got = contacts
                .iter()
                .find(|c| of.contains(&names(c)))
                .map(in_words);
            let what = format!("contact between {:?}", touch.who);
            return self.differ("R-6", what, in_words(&want), got.unwrap_or("none".into()));
        }
        let of = "contacts of a frame that do not overlap";
        self.same("R-6", of, left, Vec::new())
    }
}
