//! The oracle of the continuum's side: layers of points, each moved by [`Reference`], and what section 9 of PROTOCOL.md says of
//! them.

use interface::Vec2;
use interface::config::MpmConfig;
use interface::impulse::at;
use interface::message::wire::{GroupState, ImpForce, Ledger};
use interface::step::Step;

use super::grid_contact::meet;
use super::{RefPoint, Reference, Totals};
use crate::outline::nearest;

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
    /// The points of each record of a measurement: of the groups, of the probes, of the supports.
    sets: Vec<Vec<usize>>,
    /// The configuration.
    pub config: MpmConfig,
    /// Speed of the fastest pressure wave in m/s.
    pub wave: f64,
    /// Elastic energy of the points at the start in J/m.
    start: f64,
    contact: [f64; 2],
    /// Of all steps before.
    past: Totals,
    /// Moments about the origin of weights, loads and supports, and of the forces, so far in N s.
    moments: [f64; 2],
}

/// What is expected of a step.
#[derive(Debug, Clone, Default)]
pub struct Expected {
    /// Largest squared frequency of contact in 1/s^2, from below; not computed where it is not asked for.
    pub contact_omega_sq: f64,
    /// The ledger, if the step is measured.
    pub ledger: Ledger,
    /// The groups likewise, then the probes and supports, of which the last one has the force of all: how several share it is
    /// their solver's own affair.
    pub groups: Vec<GroupState>,
    /// What of the work of the stress is neither stored nor dissipated, in J/m.
    pub created: f64,
    /// Length of the kick in s.
    pub kick: f64,
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
                    radius: config.groups[p.group].radius(config.cell),
                    layer,
                    place,
                });
                wave = wave.max(p.wave_sq().sqrt());
            }
        }
        let mut oracle = Self {
            sets: Vec::new(),
            points,
            layers,
            config: config.clone(),
            wave,
            start: 0.0,
            contact: [0.0; 2],
            past: Totals::default(),
            moments: [0.0; 2],
        };
        oracle.sets = oracle.sets()?;
        oracle.start = oracle.all().iter().map(RefPoint::stored).sum();
        Some(oracle)
    }

    fn sets(&self) -> Option<Vec<Vec<usize>>> {
        let c = &self.config;
        let of_groups =
            (0..c.groups.len()).map(|g| (g, [[f64::NEG_INFINITY; 2], [f64::INFINITY; 2]]));
        let probes = c.probes.iter().map(|probe| (&probe.points, probe.within));
        let holds = c.forcing.holds.iter();
        let holds = holds.map(|hold| (&hold.points, hold.within));
        let named = |name: &String| c.groups.iter().position(|group| group.name == *name);
        let of_regions = probes
            .chain(holds)
            .map(|(name, within)| Some((named(name)?, within)));
        let all: Option<Vec<_>> = of_groups.map(Some).chain(of_regions).collect();
        let points = |(g, within): (usize, _)| {
            let is_in =
                |k: &usize| self.points[*k].group == g && c.is_within(self.point(*k).start, within);
            (0..self.points.len()).filter(is_in).collect()
        };
        let sets: Vec<Vec<usize>> = all?.into_iter().map(points).collect();
        sets.iter().all(|set| !set.is_empty()).then_some(sets)
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

    /// Speed of the fastest point in m/s, of as much kinetic energy as it has with its affine field.
    pub fn fastest(&self) -> f64 {
        let speed = |k: usize| (2.0 * self.kinetic(k) / self.point(k).mass).sqrt();
        (0..self.points.len()).map(speed).fold(0.0, f64::max)
    }

    /// How fast rounding lets nodes be in m/s, [`Reference::fastest_node`].
    pub fn fastest_node(&self) -> f64 {
        let layers = self.layers.iter().map(|layer| layer.fastest_node);
        layers.fold(0.0, f64::max)
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

    /// How far a point is beyond the reach of the bodies, each an outline and its reach (m), and of the points that it may touch, in
    /// m; below 0: within.
    pub fn beyond(&self, k: usize, bodies: &[(Vec<Vec2>, f64)]) -> f64 {
        let own = self.points[k];
        let (x, skin) = (Vec2::from(self.point(k).x), self.config.skin);
        let of_bodies = bodies
            .iter()
            .map(|(outline, reach)| nearest(outline, x).distance - reach - own.radius - skin);
        let touch = |other: usize| {
            let pair = [own.group, other];
            let mut pairs = self.config.group_pairs.iter();
            pairs.any(|p| *p == pair || *p == [pair[1], pair[0]])
        };
        let others = self.points.iter().enumerate();
        let of_points = others.filter(|(_, other)| touch(other.group));
        let of_points = of_points.map(|(o, other)| {
            let apart = (Vec2::from(self.point(o).x) - x).norm();
            apart - own.radius - other.radius - skin
        });
        of_bodies.chain(of_points).fold(f64::INFINITY, f64::min)
    }

    fn kinetic(&self, k: usize) -> f64 {
        self.layers[self.points[k].layer].kinetic(self.point(k))
    }

    /// A step with the force on each point; `bounds`: with what limits have to bound. `None` where rounding decides.
    pub fn step(&mut self, step: &Step, forces: &[ImpForce], bounds: bool) -> Option<Expected> {
        let before = self.all();
        let energies =
            |o: &Self| -> Vec<f64> { (0..o.points.len()).map(|k| o.kinetic(k)).collect() };
        let kinetic = energies(self);
        let (kick, w) = (step.kick(), step.centring());
        let (mut contact_omega_sq, mut totals) = (0.0_f64, Totals::default());
        let (mut kicked, mut pushed) = (Vec::new(), Vec::new());
        for number in 0..self.layers.len() {
            let own = self.points.iter().zip(forces);
            let own = own.filter(|(id, _)| id.layer == number);
            let (radii, own): (Vec<f64>, Vec<ImpForce>) =
                own.map(|(id, force)| (id.radius, *force)).unzip();
            let layer = &mut self.layers[number];
            if bounds {
                contact_omega_sq = contact_omega_sq.max(layer.contact_omega_sq(&own, &radii));
            }
            if step.is_opening() {
                totals.elastic += layer.points.iter().map(RefPoint::stored).sum::<f64>();
                totals.lost = [0, 1, 2].map(|k| totals.lost[k] + layer.lost()[k]);
                continue;
            }
            layer.time = step.time;
            kicked.push(layer.kick(step.dt_before, step.dt, &own));
            pushed.push(own);
        }
        if let (Some(contact), false) = (self.config.grid_contact, kicked.is_empty()) {
            totals.add(&meet(&self.layers, &mut kicked, contact.friction));
        }
        for ((layer, kicked), forces) in self.layers.iter_mut().zip(&kicked).zip(&pushed) {
            layer.advance(step.dt_before, step.dt, forces, kicked);
            totals.add(&layer.totals);
        }
        let mass: f64 = before.iter().map(|p| p.mass).sum();
        for a in 0..2 {
            totals.applied[a] += kick * mass * self.config.gravity[a];
        }
        let (after, done) = (energies(self), self.all());
        let so_far = |of: fn(&Totals) -> f64| of(&self.past) + w * of(&totals);
        let mut ledger = Ledger {
            elastic: totals.elastic,
            plastic_work: totals.lost[0],
            viscous_work: totals.lost[1] + so_far(|t| t.damped) + so_far(|t| t.pressed).max(0.0),
            friction_work: so_far(|t| t.rubbed),
            driven_work: totals.driven + so_far(|t| t.pulled),
            transfer_work: so_far(|t| t.smoothed),
            stress_work: totals.lost[2] - totals.lost[1] - totals.lost[0],
            ..Ledger::default()
        };
        self.past.add(&totals);
        let now = [&before[..], &done];
        let mut groups = self.sums(now, [&kinetic, &after], w, forces, &mut ledger);
        let count = self.config.forcing.holds.len();
        let holds = groups.iter_mut().rev().take(count);
        for (k, hold) in holds.enumerate() {
            let whole = k == 0 && kick > 0.0;
            hold.contact_force = [0, 1].map(|a| if whole { totals.support[a] / kick } else { 0.0 });
        }
        for a in 0..2 {
            self.contact[a] += kick * ledger.contact_force[a];
        }
        ledger.applied_impulse = self.past.applied;
        ledger.contact_impulse = self.contact;
        let contact = kick * ledger.contact_moment;
        self.moments[1] += contact;
        self.moments[0] += totals.turned - contact;
        [ledger.applied_moment, ledger.contact_moment] = self.moments;
        let created = ledger.stress_work - (ledger.elastic - self.start);
        (!totals.is_doubtful).then_some(Expected {
            contact_omega_sq,
            ledger,
            groups,
            created,
            kick,
        })
    }

    /// The groups, and what the ledger has of points and forces: of the points and their energies before and after the kick,
    /// of which the latter count with the share `w`. Moments are those of contact forces alone.
    fn sums(
        &self,
        [before, done]: [&[RefPoint]; 2],
        [kinetic, after]: [&[f64]; 2],
        w: f64,
        forces: &[ImpForce],
        ledger: &mut Ledger,
    ) -> Vec<GroupState> {
        for (k, (p, f)) in before.iter().zip(forces).enumerate() {
            let pressed = f.force != [0.0; 2];
            ledger.kinetic += (1.0 - w) * kinetic[k] + w * after[k];
            ledger.contacts += u64::from(pressed);
            ledger.contact_moment += at(p.x, f.force)[2] + f.couple;
            for a in 0..2 {
                ledger.gravity -= p.mass * self.config.gravity[a] * p.x[a];
                ledger.momentum[a] += p.mass * done[k].v[a];
                ledger.contact_force[a] += f.force[a];
            }
        }
        let mut groups = vec![GroupState::default(); self.sets.len()];
        for (group, set) in groups.iter_mut().zip(&self.sets) {
            for &k in set {
                let (p, f, first) = (&before[k], &forces[k], group.mass == 0.0);
                group.mass += p.mass;
                group.kinetic += (1.0 - w) * kinetic[k] + w * after[k];
                let pressed = f.force != [0.0; 2];
                group.contacts += u64::from(pressed);
                let first_pressed = pressed && group.contacts == 1;
                for a in 0..2 {
                    let x = p.x[a];
                    group.position[a] += p.mass * x;
                    group.velocity[a] += p.mass * ((1.0 - w) * p.v[a] + w * done[k].v[a]);
                    group.contact_force[a] += f.force[a];
                    widen(&mut group.lower[a], &mut group.upper[a], x, first);
                    if pressed {
                        let [low, high] = [&mut group.loaded_lower[a], &mut group.loaded_upper[a]];
                        widen(low, high, x, first_pressed);
                    }
                }
            }
        }
        ledger.angular_momentum = done.iter().map(RefPoint::turning).sum();
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
