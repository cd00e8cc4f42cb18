//! One coupled step, as Jiang 2020 section 4.2 lists it, in the leapfrog of [`interface::step::Step`].

use interface::Vec2;
use interface::message::wire::{EnvelopeVertex, ImpForce, ImpState, Limits};
use interface::solver::{Answer, Fault, Refusal};
use interface::step::Step;

use crate::contact::damping::Damping;
use crate::contact::impact::{Impacts, SurfaceMotion};
use crate::contact::side::{AfterKick, Interval, Targets};
use crate::lists::now::{Ahead, Now};
use crate::system::{BODIES, POINTS, Sdem};
use crate::threads::{CHUNK, part};

impl Sdem {
    /// Step 1 of section 4.2: contact lists, contact forces, forces on the bodies, and the velocities after the kick.
    ///
    /// # Errors
    /// As [`interface::solver::DemSolver::contact`].
    pub fn contact(
        &mut self,
        step: &Step,
        imps: &[ImpState],
        forces: &mut [ImpForce],
    ) -> Result<Answer, Fault> {
        let set = self.state.sets.now.len();
        assert!(
            imps.len() == set && forces.len() == set,
            "{} states and {} forces for a set of {set} IMPs",
            imps.len(),
            forces.len()
        );
        let threads = self.threads.clone();
        threads.in_step(true, || {
            self.meet(step, imps, forces); //             lists and forces
            self.state.sets.replaced = None; //           lists are of the present set
            self.none_passed()?; //                       crate::contact::passage
            self.respond(step, imps)
        })
    }

    /// Steps 2 and 3 of section 4.2: commits the result of [`Self::contact`], and moves the bodies.
    pub(crate) fn move_on(&mut self, step: &Step) {
        if step.is_opening() {
            return;
        }
        let threads = self.threads.clone();
        threads.in_step(false, || {
            self.commit(step); //                         histories, ledger, v^{n+1/2}
            self.drift(step.dt); //                       eq. 42, x^n -> x^{n+1}
        });
    }

    /// Refuses two bodies of which one is on the wrong side of the other before anything has moved.
    pub(crate) fn none_passed_at_the_start(&mut self) -> Result<(), Refusal> {
        if self.sides[BODIES].is_none() {
            return Ok(());
        }
        let opening = Step {
            index: 0,
            time: 0.0,
            dt_before: 0.0,
            dt: 0.0,
            measure: false,
        };
        self.meet(&opening, &[], &mut []);
        let passed = self.sides[BODIES]
            .as_ref()
            .and_then(|side| side.sums().passed);
        match passed.and_then(|passed| passed.refusal(&self.bodies)) {
            Some(refusal) => Err(refusal),
            None => Ok(()),
        }
    }

    /// The outlines of all bodies. Their displacement is measured from these positions on.
    pub(crate) fn publish(&mut self) -> &[EnvelopeVertex] {
        self.state.published.reset(&self.bodies);
        self.envelopes.clear();
        for b in 0..self.bodies.len() {
            let vertex = |(k, p): (u32, &Vec2)| EnvelopeVertex {
                body: b as u64,
                position: (*p).into(),
                reach: self.bodies.radius_at(b, k),
            };
            let outline = (0..).zip(self.bodies.outline_of(b));
            self.envelopes.extend(outline.map(vertex));
        }
        &self.envelopes
    }

    /// Contact forces at `t_n` between bodies, and between bodies and points.
    pub(crate) fn meet(&mut self, step: &Step, imps: &[ImpState], forces: &mut [ImpForce]) {
        let (sides, speed) = (&mut self.sides, self.state.speed);
        let [weight, outer] = self.constants.outer_accelerations;
        let now = Now {
            bodies: &self.bodies,
            sets: &self.state.sets,
            states: imps,
            ahead: Ahead::new(step.kick(), step.dt, outer),
            speed,
        };
        for side in sides.iter_mut().flatten() {
            side.update_list(&now, &self.threads); //     Verlet lists of bodies and of points
        }
        let any_points = self.loads.clear(&self.threads, forces, !imps.is_empty());
        let mut to = Targets {
            forces,
            by_points: &mut self.loads.by_points,
            by_bodies: &mut self.loads.by_bodies,
            contacts: &mut self.contacts,
        };
        to.contacts.clear();
        let last_step = step.dt_before;
        let measured = step.measure || step.is_opening();
        let [bodies, points, pairs] = sides;
        if let Some(bodies) = bodies {
            // Contacts that have opened since the last step, which may have been longer, have dissipated energy.
            let way = now.ahead.way(speed).max(speed * last_step);
            let interval = Interval {
                last_step,
                closing: 2.0 * way,
                measured,
                ..Interval::default()
            };
            bodies.evaluate(&now, interval, &self.threads, &mut to); // eqs. 38 to 41, 43
        }
        if !any_points {
            return;
        }
        let (mut fastest, mut energy) = (0.0_f64, 0.0_f64);
        for (info, state) in self.state.sets.now.iter().zip(imps) {
            let square = Vec2::from(state.velocity).norm_squared();
            fastest = fastest.max(square);
            energy = energy.max(info.mass * square);
        }
        let fastest = fastest.sqrt();
        let interval = |approach: f64| Interval {
            last_step,
            closing: 1.5 * approach * step.dt.max(last_step),
            measured,
            impacts: Impacts {
                ahead: now.ahead,
                speed: approach,
                energy,
                weight,
                count: self.constants.per_resolution_sq[1],
                ..Impacts::default()
            },
        };
        let with_bodies = interval(speed + fastest);
        if let Some(points) = points {
            points.evaluate(&now, with_bodies, &self.threads, &mut to); // eqs. 44, 46, 49, 50
        }
        if let Some(pairs) = pairs {
            pairs.evaluate(&now, interval(2.0 * fastest), &self.threads, &mut to);
        }
    }

    /// The response of the bodies to these forces.
    pub(crate) fn respond(&mut self, step: &Step, imps: &[ImpState]) -> Result<Answer, Fault> {
        self.kick(step)?; //                              eq. 42, v^{n-1/2} -> v^{n+1/2}
        if step.measure {
            self.measurement = self.measure(step); //  docs/physics.md section 7
        }
        Ok(self.answer(step, imps)) //                    docs/physics.md section 4
    }

    /// Refuses a step in which a point or a body is on the wrong side of a body.
    fn none_passed(&self) -> Result<(), Fault> {
        let mut sides = self.sides.iter().flatten();
        match sides.find_map(|side| side.sums().passed) {
            Some(passed) => Err(passed.fault(&self.bodies)),
            None => Ok(()),
        }
    }

    /// Newton's and Euler's equations for every free body; the other bodies keep their velocity.
    fn kick(&mut self, step: &Step) -> Result<(), Fault> {
        let kick = step.kick();
        let [mut speed, mut energy, mut fastest] = self.kick_all(kick);
        if !speed.is_finite() {
            let wrong = |&(v, spin): &(Vec2, f64)| !(v.norm() + spin.abs()).is_finite();
            let first = self.kicked.velocities.iter().position(wrong);
            return Err(self.not_finite(first.unwrap_or_default()));
        }
        for &b in &self.bodies.special {
            let b = b as usize;
            let (state, body) = (&self.bodies.state[b], &self.bodies.properties[b]);
            let (force, torque) = body.motion.push(step.span());
            let (velocity, spin) = &mut self.kicked.velocities[b];
            *velocity += force * (state.inverse_mass * kick);
            *spin += torque * state.inverse_inertia * kick;
            let mut moved = 0.0;
            for i in 0..2 {
                if body.yielding[i] == 0.0 {
                    velocity[i] = state.velocity[i];
                } else {
                    moved += body.mass * velocity[i] * velocity[i];
                }
            }
            energy = energy.max(moved);
            let own = state.surface_speed(*velocity, *spin);
            speed = speed.max(own);
            fastest = fastest.max(spin.abs());
            let per_kick = if kick > 0.0 { 1.0 / kick } else { 0.0 };
            let accelerated = (
                (*velocity - state.velocity) * per_kick,
                (*spin - state.spin) * per_kick,
            );
            let motion = &mut self.kicked.motions[b];
            *motion = motion.moved(state, (*velocity, *spin), accelerated);
            if !own.is_finite() {
                return Err(self.not_finite(b));
            }
        }
        (self.kicked.speed, self.kicked.energy, self.kicked.spin) = (speed, energy, fastest);
        Ok(())
    }

    /// Computes the velocities and spins after a kick (s) by contact loads and by gravity, part by part. Returns the largest surface speed in m/s, or NaN if one is
    /// not finite, the largest `m v^2` in J/m of a free one, and the largest spin in rad/s.
    fn kick_all(&mut self, kick: f64) -> [f64; 3] {
        let part = part(&self.threads, self.bodies.len());
        self.kicked.most.clear();
        let parts = self.bodies.len().div_ceil(part);
        self.kicked.most.resize(parts, [0.0; 3]);
        let coupled = self.loads.any_by_points;
        let (state, gravity) = (&self.bodies.state, self.gravity);
        let masses = &self.bodies.free.0;
        let moments = &mut self.kicked.moments;
        moments.resize(state.len().div_ceil(CHUNK), Vec2::zeros());
        let point_loads = &self.loads.by_points;
        let loads = self.loads.by_bodies.chunks(part);
        let parts = self
            .kicked
            .velocities
            .chunks_mut(part)
            .zip(self.kicked.motions.chunks_mut(part))
            .zip(&mut self.kicked.most);
        let moments = moments.chunks_mut(part.div_ceil(CHUNK));
        let parts = parts.zip(loads.zip(moments)).enumerate();
        self.threads.each(
            parts,
            |(i, (((kicked, motions), most), (loads, moments)))| {
                let here = i * part..i * part + kicked.len();
                // In registers: the results of two parts are in one line of the caches.
                let (mut finite, mut fastest, mut energy, mut spinning) = (true, 0.0, 0.0, 0.0);
                let kicked = kicked.iter_mut().zip(motions);
                let bodies = state[here.clone()].iter().zip(&masses[here.clone()]);
                let bodies = bodies.zip(loads).zip(kicked);
                for ((((state, mass), others), (kicked, motion)), points) in
                    bodies.zip(&point_loads[here.clone()])
                {
                    let (mut force, mut torque) = (others.force, others.torque);
                    if coupled {
                        force += points.force;
                        torque += points.torque;
                    }
                    let acceleration = force * state.inverse_mass + gravity * state.falls;
                    let velocity = state.velocity + acceleration * kick;
                    let turning = torque * state.inverse_inertia;
                    let spin = state.spin + turning * kick;
                    let surface = state.surface_speed(velocity, spin);
                    finite &= surface < f64::INFINITY;
                    fastest = if surface > fastest { surface } else { fastest };
                    let live = mass * velocity.norm_squared();
                    energy = if live > energy { live } else { energy };
                    spinning = spin.abs().max(spinning);
                    *kicked = (velocity, spin);
                    *motion =
                        SurfaceMotion::of(state, *kicked, (acceleration, turning), others.rate);
                }
                *most = [if finite { fastest } else { f64::NAN }, energy, spinning];
                // Here, where their states are in the cache of this thread.
                let chunks = state[here.clone()].chunks(CHUNK);
                let chunks = chunks.zip(masses[here].chunks(CHUNK));
                for ((state, masses), moment) in chunks.zip(moments) {
                    let of = state.iter().zip(masses).map(|(state, m)| state.center * *m);
                    *moment = of.sum();
                }
            },
        );
        // `f64::max` would lose a NaN.
        let larger = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
        let both = |a: [f64; 3], b: &[f64; 3]| [0, 1, 2].map(|i| larger(a[i], b[i]));
        self.kicked.most.iter().fold([0.0; 3], both)
    }

    fn not_finite(&self, b: usize) -> Fault {
        Fault::NotFinite {
            what: "velocity".into(),
            item: format!("body {b} ({})", self.bodies.properties[b].name),
        }
    }

    /// The limits for the next step, and the displacement of the surfaces at its end.
    fn answer(&mut self, step: &Step, imps: &[ImpState]) -> Answer {
        let points = self.sides[POINTS..].iter().flatten();
        let dashpots = points.fold(Damping::default(), |all, side| {
            let own = side.damping();
            Damping {
                own: all.own + own.own,
                square: all.square.max(own.square),
                alone: 0.0,
                delay: all.delay.max(own.delay),
            }
        });
        // 4 zeta^2, of points and of bodies.
        let (mut of_points, mut of_bodies) = (0.0_f64, 0.0);
        let (mut rate, mut mobility): (f64, f64) = (0.0, 0.0);
        if !self.state.sets.now.is_empty() {
            // Bodies that forces do not move have no rate.
            for load in &self.loads.by_points {
                rate = rate.max(load.rate);
                mobility = mobility.max(load.mobility);
                let Damping { square, delay, .. } = dashpots;
                of_points = of_points
                    .max((square * (load.mobility + load.along)).min(delay * delay * load.rate));
            }
        }
        let mut omega_sq = 0.0;
        if let Some(bodies) = &self.sides[BODIES] {
            let [weight, outer] = self.constants.outer_accelerations;
            let after = AfterKick {
                bodies: &self.bodies,
                motions: &self.kicked.motions,
                impacts: Impacts {
                    kicked: &self.kicked.velocities,
                    kick: step.kick(),
                    ahead: Ahead::new(step.kick(), step.dt, outer),
                    speed: self.kicked.speed,
                    energy: self.kicked.energy,
                    weight,
                    span: step.span(),
                    count: self.constants.per_resolution_sq[0],
                },
                spin: self.kicked.spin,
            };
            let [omega, stiff] = bodies.omega(&after, &self.threads);
            omega_sq = omega * omega;
            let Damping {
                own, alone, delay, ..
            } = bodies.damping();
            // A contact that is resolved is so with its own ratio.
            of_bodies = alone;
            if stiff > 0.0 {
                of_bodies = alone.max(own.min(delay * delay * stiff) * stiff / omega_sq);
            }
            if step.is_opening() && (self.kicked.speed > 0.0 || outer > 0.0) {
                omega_sq = omega_sq.max(self.constants.first_contact);
            }
        }
        if step.is_opening() {
            omega_sq = omega_sq.max(self.release(imps));
        }
        // The stiffnesses of both add up, so that the root of the sum of squares is enough for their dashpots together.
        let damping = 0.5 * (dashpots.own + of_points + of_bodies).sqrt();
        // While the displacement is below a quarter of the skin, nothing is rebuilt, so a coarse bound is enough.
        let gone = self.state.published.bound(0.25 * self.skin, &self.bodies);
        Answer {
            limits: Limits {
                omega_sq,
                contact_omega_sq: rate,
                damping,
                speed: self.kicked.speed,
                radius_min: 0.0,
                mobility,
            },
            travel: Some(gone + self.kicked.speed * step.dt),
        }
    }

    /// Commits the result of the last evaluation, except the velocities, which the drift commits.
    fn commit(&mut self, step: &Step) {
        self.state.totals = self.totals_after(step);
        self.state.speed = self.kicked.speed;
        (self.sides.iter_mut().flatten()).for_each(|side| side.commit());
    }

    /// Moves velocities to `t_{n+1/2}` and positions to `t_{n+1}`.
    fn drift(&mut self, dt: f64) {
        self.bodies
            .drift(dt, &self.kicked.velocities, &self.threads);
        self.state.published.advance(self.state.speed, dt);
        let speed = self.state.speed;
        (self.sides.iter_mut().flatten()).for_each(|side| side.advance(speed, dt));
    }
}
