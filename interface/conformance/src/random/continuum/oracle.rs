//! The oracle of the continuum's side: layers of points, each moved by the plain reference of [`mechanics::reference`], and
//! what section 9 of PROTOCOL.md says of them.

use interface::config::MpmConfig;
use interface::impulse::at;
use interface::message::wire::{GroupState, ImpForce, Ledger};
use interface::step::Step;
use mechanics::reference::{RefPoint, Reference};

/// Where a point is kept, and what does not change of it.
#[derive(Debug, Clone, Copy)]
pub struct Identity {
    /// Its group.
    pub group: usize,
    /// Contact radius in m.
    pub radius: f64,
    layer: usize,
    place: usize,
}

/// All points, and sums so far.
#[derive(Debug, Clone)]
pub struct Oracle {
    layers: Vec<Reference>,
    /// In the order of the configuration.
    pub points: Vec<Identity>,
    /// The configuration.
    pub config: MpmConfig,
    /// Speed of the fastest pressure wave in m/s.
    pub wave: f64,
    /// Elastic energy at the start in J/m.
    start: f64,
    applied: [f64; 2],
    contact: [f64; 2],
    /// Moments about the origin of weights, and of the forces, so far in N s.
    moments: [f64; 2],
}

/// What is expected of a step.
#[derive(Debug, Clone, Default)]
pub struct Expected {
    /// Largest squared frequency of contact in 1/s^2, from below; not computed where it is not asked for.
    pub contact_omega_sq: f64,
    /// The ledger, if the step is measured.
    pub ledger: Ledger,
    /// The groups likewise.
    pub groups: Vec<GroupState>,
}

impl Oracle {
    /// The points of a configuration; `None` where it is not of those that the oracle knows.
    pub fn new(config: &MpmConfig) -> Option<Self> {
        let layers = Reference::layers(config)?;
        let (mut points, mut wave) = (Vec::new(), 0.0_f64);
        for (layer, reference) in layers.iter().enumerate() {
            for (place, p) in reference.points.iter().enumerate() {
                points.push(Identity {
                    group: p.group,
                    radius: config.groups[p.group].contact_radius?,
                    layer,
                    place,
                });
                let stiff = (p.bulk + 4.0 / 3.0 * p.shear) * p.volume / p.mass;
                wave = wave.max(stiff.sqrt());
            }
        }
        let mut oracle = Self {
            points,
            layers,
            config: config.clone(),
            wave,
            start: 0.0,
            applied: [0.0; 2],
            contact: [0.0; 2],
            moments: [0.0; 2],
        };
        oracle.start = oracle.all().iter().map(RefPoint::stored).sum();
        Some(oracle)
    }

    /// A point.
    pub fn point(&self, k: usize) -> &RefPoint {
        let Identity { layer, place, .. } = self.points[k];
        &self.layers[layer].points[place]
    }

    /// All points.
    pub fn all(&self) -> Vec<RefPoint> {
        (0..self.points.len()).map(|k| *self.point(k)).collect()
    }

    /// Speed of the fastest point in m/s.
    pub fn fastest(&self) -> f64 {
        let speeds = self.all().into_iter().map(|p| p.v[0].hypot(p.v[1]));
        speeds.fold(0.0, f64::max)
    }

    /// Whether no point comes near the edge of the domain in a step of `dt` (s), and none is strained too far for a comparison.
    pub fn is_sound(&self, dt: f64) -> bool {
        let c = &self.config;
        self.all().iter().all(|p| {
            (0.5..2.0).contains(&p.ratio)
                && (0..2).all(|a| {
                    let room = 0.01 * c.cell + 2.0 * dt * p.v[a].abs();
                    p.x[a] - room > c.domain[0][a] && p.x[a] + room < c.domain[1][a]
                })
        })
    }

    fn kinetic(&self, k: usize) -> f64 {
        self.layers[self.points[k].layer].kinetic(self.point(k))
    }

    /// A step with the force on each point; `bounds`: with what limits have to bound.
    pub fn step(&mut self, step: &Step, forces: &[ImpForce], bounds: bool) -> Expected {
        let before = self.all();
        let energies =
            |o: &Self| -> Vec<f64> { (0..o.points.len()).map(|k| o.kinetic(k)).collect() };
        let kinetic = energies(self);
        let (kick, w) = (step.kick(), step.centring());
        let (mut contact_omega_sq, mut elastic, mut plastic) = (0.0_f64, 0.0, 0.0);
        for number in 0..self.layers.len() {
            let own = self
                .points
                .iter()
                .zip(forces)
                .filter(|(id, _)| id.layer == number);
            let (radii, own): (Vec<f64>, Vec<ImpForce>) =
                own.map(|(id, force)| (id.radius, *force)).unzip();
            let layer = &mut self.layers[number];
            if bounds {
                contact_omega_sq = contact_omega_sq.max(layer.contact_omega_sq(&own, &radii));
            }
            if step.is_opening() {
                elastic += layer.points.iter().map(RefPoint::stored).sum::<f64>();
                plastic += layer.points.iter().map(|p| p.lost).sum::<f64>();
                continue;
            }
            layer.step(step.dt_before, step.dt, &own);
            elastic += layer.elastic;
            plastic += layer.plastic;
            for a in 0..2 {
                let mass: f64 = layer.points.iter().map(|p| p.mass).sum();
                self.applied[a] += layer.wall_impulse[a] + kick * mass * layer.gravity[a];
            }
        }
        let (after, done) = (energies(self), self.all());
        let mut ledger = Ledger {
            elastic,
            plastic_work: plastic,
            stress_work: elastic - self.start,
            ..Ledger::default()
        };
        let now = [&before[..], &done];
        let groups = self.sums(now, [&kinetic, &after], w, forces, &mut ledger);
        for a in 0..2 {
            self.contact[a] += kick * ledger.contact_force[a];
        }
        ledger.applied_impulse = self.applied;
        ledger.contact_impulse = self.contact;
        for (p, f) in before.iter().zip(forces) {
            let weight = self.config.gravity.map(|g| p.mass * g);
            self.moments[0] += kick * at(p.x, weight)[2];
            self.moments[1] += kick * (at(p.x, f.force)[2] + f.couple);
        }
        [ledger.applied_moment, ledger.contact_moment] = self.moments;
        Expected {
            contact_omega_sq,
            ledger,
            groups,
        }
    }

    /// The groups, and what the ledger has of points and forces: of the points and their energies before and after the kick,
    /// of which the latter count with the share `w`.
    fn sums(
        &self,
        [before, done]: [&[RefPoint]; 2],
        [kinetic, after]: [&[f64]; 2],
        w: f64,
        forces: &[ImpForce],
        ledger: &mut Ledger,
    ) -> Vec<GroupState> {
        let mut groups = vec![GroupState::default(); self.config.groups.len()];
        for (k, id) in self.points.iter().enumerate() {
            let (p, f, group) = (&before[k], &forces[k], &mut groups[id.group]);
            let first = group.mass == 0.0;
            let centred = (1.0 - w) * kinetic[k] + w * after[k];
            group.mass += p.mass;
            group.kinetic += centred;
            ledger.kinetic += centred;
            let pressed = f.force != [0.0; 2];
            group.contacts += u64::from(pressed);
            ledger.contacts += u64::from(pressed);
            let first_pressed = pressed && group.contacts == 1;
            for a in 0..2 {
                let x = p.x[a];
                group.position[a] += p.mass * x;
                group.velocity[a] += p.mass * ((1.0 - w) * p.v[a] + w * done[k].v[a]);
                group.contact_force[a] += f.force[a];
                widen(&mut group.lower[a], &mut group.upper[a], x, first);
                if pressed {
                    widen(
                        &mut group.loaded_lower[a],
                        &mut group.loaded_upper[a],
                        x,
                        first_pressed,
                    );
                }
                ledger.gravity -= p.mass * self.config.gravity[a] * x;
                ledger.momentum[a] += p.mass * done[k].v[a];
                ledger.contact_force[a] += f.force[a];
            }
        }
        let turning = |p: &RefPoint| p.mass * (at(p.x, p.v)[2] + p.b[1][0] - p.b[0][1]);
        ledger.angular_momentum = done.iter().map(turning).sum();
        for group in &mut groups {
            group.position = group.position.map(|x| x / group.mass);
            group.velocity = group.velocity.map(|p| p / group.mass);
        }
        groups
    }
}

fn widen(lower: &mut f64, upper: &mut f64, x: f64, first: bool) {
    *lower = if first { x } else { lower.min(x) };
    *upper = if first { x } else { upper.max(x) };
}
