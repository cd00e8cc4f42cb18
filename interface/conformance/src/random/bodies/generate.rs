//! Random cases, within what a solver says that it takes. Sizes, stiffnesses and masses come from several orders of
//! magnitude; the step follows from them by stability, and speeds from the step, so that nothing passes through anything.

use fastrand::Rng;
use interface::Vec2;
use interface::config::capability::{Capabilities, OWN_FRICTION};
use interface::config::surfaces::ContactPair;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, GroupPair, Interface, Motion,
    OverlapMeasure,
};
use interface::message::wire::ImpInfo;
use mechanics::reference::bodies::{Oracle, shared};

use super::super::dice::{Dice, decades};
use super::super::plan::{self, Course};
use super::case::{Along, Case, Walker};
use super::copy::Copied;

/// Bodies that no point gets inside of, or onto the outline.
const NO_INSIDE: &str = "feature:no_inside";

/// What the numbers of a case have in common.
struct Scale {
    /// Typical contact radius in m.
    radius: f64,
    /// Typical stiffness in N/m.
    stiffness: f64,
    /// Typical mass in kg/m.
    mass: f64,
}

/// The case of a seed, for a solver of bodies that says that it takes this.
pub fn case(seed: u64, takes: &Capabilities) -> Case {
    let mut rng = Rng::with_seed(seed);
    let scale = Scale {
        radius: decades(&mut rng, -3.0, 0.0),
        stiffness: decades(&mut rng, 3.0, 7.0),
        mass: decades(&mut rng, -1.0, 2.0),
    };
    // A body on a dozen stiff contacts, with a lever arm: omega dt stays well below 2.
    let dt = decades(&mut rng, -2.0, -0.8) * (scale.mass / (40.0 * scale.stiffness)).sqrt();
    Dice::new(rng, takes, dt, scale).case()
}

/// What a solver may take, and what draws one of a size (m).
type Member<'a, T> = (&'static str, fn(&mut Dice<'a, Scale>, f64) -> T);

impl Dice<'_, Scale> {
    fn case(&mut self) -> Case {
        let springs = !self.takes.has("feature:impulses");
        let touching = springs && self.takes.meets("feature:body_contact") && self.often();
        let bodies: Vec<BodyConfig> = match self.rng.u32(0..8) {
            0 if self.takes.has("pairs") => Vec::new(),
            k => {
                // In one case of sixteen not all are near to one another, and in one of 128 there are so many
                // pairs that a solver may evaluate them in several chunks.
                let mut more = self.aside();
                let has_many = more.rng.u32(0..16) == 0;
                let many = more.rng.usize(6..16);
                let is_crowd = touching && more.rng.u32(0..8) == 0;
                let count = match (has_many, is_crowd) {
                    (false, _) => 1 + k as usize % 3,
                    (true, false) => many,
                    (true, true) => 10 * many + 200,
                };
                self.bodies(count, touching)
            }
        };
        let able = touching && self.takes.has("overlap:nearest_edge");
        let convex = bodies.iter().all(|body| body.shape.is_convex());
        let overlap = if able && convex && self.aside().often() {
            OverlapMeasure::NearestEdge
        } else {
            OverlapMeasure::EachEdge
        };
        let laws = [0; 3].map(|_| self.law(true));
        let between = self.law(false);
        let mut config = DemConfig {
            gravity: self.perhaps(|dice| dice.vector(9.81)),
            bodies,
            point_contact: laws[0],
            body_contact: touching.then_some(between),
            overlap,
            point_surfaces: vec![String::new(); 2],
            skin: self.scale.radius * self.between(0.05, 0.5),
            threads: 1,
            // Stiffness as it is, so that it can be compared (F-6).
            contact_resolution: (self.takes.meets("feature:contact_resolution")).then_some(2.0),
            ..DemConfig::default()
        };
        if self.takes.meets("feature:contact_pairs") && self.rarely() {
            config.point_surfaces = vec!["rubber".into(), "sand".into()];
            if let Some(body) = config.bodies.first_mut() {
                body.surface = "steel".into();
            }
            let between = ["steel".into(), "rubber".into()];
            // A solver may take only laws of one kind in a scene.
            let mixes = self.takes.meets("feature:mixed_kinds");
            let law = laws[usize::from(mixes || laws[1].is_like(&laws[0]))];
            // Between bodies it holds either way round.
            let like = |common: ContactLaw| mixes || common.is_like(&law);
            if config.body_contact.is_none_or(like) && self.aside().often() {
                for body in config.bodies.iter_mut().skip(1) {
                    body.surface = "rubber".into();
                }
            }
            config.contact_pairs.push(ContactPair { between, law });
        }
        if self.takes.has("pairs") && (config.bodies.is_empty() || self.rarely()) {
            let law = laws[2];
            config.group_pairs.push(GroupPair {
                between: [0, 1],
                law,
            });
        }
        let copied = self.copied(&mut config);
        self.seldom(&mut config);
        let mut epochs = self.epochs(self.takes.has("contacts") && copied.is_none());
        if copied.is_some() {
            epochs = plan::measured(&epochs);
        }
        let steps = plan::steps(&epochs);
        let mut points = self.points(&config, steps);
        if config.interface == Interface::Segments {
            points = self.chains(&config.bodies, steps);
        } else {
            self.aside().put_on_outlines(&mut config, &mut points);
        }
        Case {
            config,
            points,
            epochs,
            copied,
        }
    }

    /// Where a solver with friction of its own has some, only bodies and points touch, and it has to say the same in a copy.
    fn copied(&self, config: &mut DemConfig) -> Option<Copied> {
        let mut needs = config.needs().into_iter();
        let rubs = needs.any(|need| need.capability == "feature:friction");
        if !(rubs && self.takes.has(OWN_FRICTION)) {
            return None;
        }
        config.body_contact = None;
        config.group_pairs.clear();
        let mut dice = self.aside();
        // What guides hold is along the axes.
        let guided = |body: &BodyConfig| matches!(body.motion, Motion::Guided { .. });
        let turns = dice.often() && !config.bodies.iter().any(guided);
        Some(Copied {
            mirrored: dice.often(),
            turn: dice.when(turns, |dice| dice.way(3.0)),
            shift: dice.perhaps(|dice| dice.vector(100.0 * self.scale.radius)),
            reversed: dice.often(),
            window: dice.rng.usize(1..9),
        })
    }

    /// Makes some cases of a kind that random numbers hardly bring about: areas, rolling, chains.
    fn seldom(&self, config: &mut DemConfig) {
        let mut dice = self.aside();
        let kind = dice.rng.u32(0..10);
        let takes = |names: &[&str]| names.iter().all(|name| self.takes.meets(name));
        let touching = config.body_contact.is_some() && config.bodies.len() > 1;
        let sharp = ["overlap:area", "shape:polygon", "law:linear"];
        let rolling = ["feature:rolling_friction", "law:granular", "shape:disc"];
        let chain = self.takes.has("segments")
            && !self.takes.has(OWN_FRICTION)
            && self.takes.meets("shape:disc");
        match kind {
            0 | 1 if touching && takes(&sharp) => self.sharpen(&mut dice, config),
            2 | 3 if touching && takes(&rolling) => self.roll(&mut dice, config),
            4 | 5 if !config.bodies.is_empty() && chain => {
                config.interface = Interface::Segments;
                config.overlap = OverlapMeasure::EachEdge;
                config.group_pairs.clear();
                let whole =
                    |body: &&mut BodyConfig| !matches!(body.shape, BodyShape::Cluster { .. });
                for body in config.bodies.iter_mut().filter(whole) {
                    (body.sphero_radius, body.shape) = (extent(body), BodyShape::Disc);
                }
            }
            6 | 7 if touching && takes(&["motion:free"]) => self.fly(&mut dice, config),
            _ => {}
        }
    }

    /// Bodies that come from afar, at most as fast as uses up the skin in some steps.
    fn fly(&self, dice: &mut Dice<()>, config: &mut DemConfig) {
        let (skin, count) = (config.skin, config.bodies.len());
        let [apart, pace] = [dice.between(1.0, 4.0), dice.between(0.05, 0.2)].map(|s| s * skin);
        let row = [0, 1].map(|k| Vec2::from(config.bodies[k].position));
        let along = (row[1] - row[0]).normalize();
        for (k, body) in (0..).zip(&mut config.bodies) {
            let place = f64::from(k) - 0.5 * (count - 1) as f64;
            body.position = (Vec2::from(body.position) + along * (place * apart)).into();
            (body.motion, body.spin) = (Motion::Free, 0.0);
            body.velocity = (along * (-place * pace / self.dt)).into();
        }
    }

    /// Polygons with sharp corners, whose contact is measured by the area that they share.
    fn sharpen(&self, dice: &mut Dice<()>, config: &mut DemConfig) {
        config.overlap = OverlapMeasure::Area;
        for body in &mut config.bodies {
            let (size, corners) = (extent(body), dice.rng.u32(3..8));
            let vertices = dice.star(corners, [0.0; 2], |_| size);
            (body.shape, body.sphero_radius) = (BodyShape::Polygon { vertices }, 0.0);
        }
        // Some turn under the others, so that their corners come and go.
        let turns = dice.rarely() && dice.takes.meets("motion:driven");
        let k = self.scale.stiffness;
        let rubs = dice.often() && self.takes.meets("feature:friction");
        let damps = dice.rarely() && self.takes.meets("feature:damping");
        config.body_contact = Some(ContactLaw::Linear {
            normal_stiffness: k,
            tangential_stiffness: dice.when(rubs, |dice| k * dice.between(0.1, 1.0)),
            friction: dice.when(rubs, |dice| dice.between(0.05, 1.2)),
            damping_ratio: dice.when(damps, |dice| dice.between(0.01, 0.5)),
            damped_mass: 0.0,
        });
        for body in config.bodies.iter_mut().filter(|_| turns).skip(1) {
            (body.motion, body.velocity) = (Motion::Driven, [0.0; 2]);
            body.spin = dice.between(0.05, 0.2) / self.dt;
        }
        // Each comes along the row until it touches the one before it.
        let place = |config: &DemConfig, b: usize| Vec2::from(config.bodies[b].position);
        for b in 1..config.bodies.len() {
            let bodies = Oracle::new(config).bodies;
            let [first, second] = [b - 1, b].map(|b| bodies[b].corners());
            let back = place(config, b - 1) - place(config, b);
            let (mut apart, mut within) = (0.0, 1.0);
            for _ in 0..40 {
                let middle = 0.5 * (apart + within);
                let moved: Vec<Vec2> = second.iter().map(|x| x + back * middle).collect();
                let touch = shared(&first, &moved).is_some();
                *(if touch { &mut within } else { &mut apart }) = middle;
            }
            let deep = dice.between(-0.1, 0.3) * self.scale.radius;
            let shift = back * within + back.normalize() * deep;
            for body in &mut config.bodies[b..] {
                body.position = (Vec2::from(body.position) + shift).into();
            }
        }
    }

    /// Discs that touch and turn, most of them where they are.
    fn roll(&self, dice: &mut Dice<()>, config: &mut DemConfig) {
        let k = self.scale.stiffness;
        config.body_contact = Some(ContactLaw::Granular {
            normal_stiffness: k,
            tangential_stiffness: k * dice.between(0.1, 1.0),
            friction: dice.between(0.05, 1.2),
            damping_ratio: 0.0,
            damped_mass: 0.0,
            adhesion: 0.0,
            rolling_friction: dice.between(0.01, 1.0),
        });
        let held = Motion::Guided {
            hold_x: true,
            hold_y: true,
            hold_angle: false,
        };
        let ways = [held, Motion::Free, Motion::Driven];
        let mut before: Option<(Vec2, Vec2, f64)> = None;
        for body in &mut config.bodies {
            (body.sphero_radius, body.shape) = (extent(body), BodyShape::Disc);
            body.velocity = [0.0; 2];
            body.spin = decades(&mut dice.rng, -3.5, -0.5) * dice.way(0.3) / self.dt;
            body.motion = dice.one_of("motion", &ways).unwrap_or(Motion::Free);
            let (was, a) = (Vec2::from(body.position), body.sphero_radius);
            if let Some((old, at, b)) = before {
                let deep = (a + b) * (1.0 - dice.between(0.01, 0.25));
                body.position = (at + (was - old).normalize() * deep).into();
            }
            before = Some((was, body.position.into(), a));
        }
    }

    /// Chains of markers along a body each, from flat to bent, rings beside a body or around it among them, whose markers come and
    /// go as points do, together or one by one.
    fn chains(&self, bodies: &[BodyConfig], steps: u32) -> Vec<Walker> {
        let mut dice = self.aside();
        let mut points = Vec::new();
        for group in 0..dice.rng.u32(1..3) {
            let radius = self.scale.radius * dice.between(0.6, 1.0);
            let mass = dice.about(self.scale.mass);
            let body = dice.rng.usize(0..bodies.len());
            let reach = bodies[body].sphero_radius + radius;
            let (way, overlap) = dice.walk(radius, steps);
            let mut count = dice.rng.u32(2..9);
            let spacing = dice.between(0.5, 3.0) * radius;
            let mut spacing = spacing.min(4.0 * reach / f64::from(count));
            // The middle of a flat chain is this much nearer than a marker a metre aside.
            let mut bend = dice.between(-0.2, 1.5) / (2.0 * reach);
            let segment = if dice.often() { 1 } else { -1 };
            let change = dice.rng.u32(1..steps.max(2));
            let present = dice.presence(&[change], steps);
            let mut more = dice.aside();
            let [is_ring, comes_alone, tangled] = [0; 3].map(|_| more.rarely());
            let is_around = is_ring && more.often();
            let (mut messy, mut far) = (if tangled { 1.2 } else { 0.2 }, 0.0);
            if is_around {
                // The middles of its segments touch the body.
                (count, bend, messy) = (more.rng.u32(8..20), 0.0, 0.1);
                let half = std::f64::consts::PI / f64::from(count);
                (spacing, far) = (2.0 * half * reach, reach * (1.0 / half.cos() - 1.0));
            } else if is_ring {
                (count, far) = (count.max(3), more.between(1.0, 4.0) * radius);
            }
            for k in 0..count {
                let mut aside = (f64::from(k) - 0.5 * f64::from(count)) * spacing;
                aside += dice.way(messy * spacing);
                // The last marker of a ring beside a body is behind the others.
                let is_last = k + 1 == count;
                let is_behind = is_ring && !is_around && is_last;
                let away = if is_around || is_behind { far } else { 0.0 };
                aside = if is_behind { 0.0 } else { aside };
                let comes = comes_alone && more.often();
                // The disc is to the right of the chain.
                let along = |&(step, way): &(u32, f64)| (step, way - f64::from(segment) * aside);
                let mut deep = |&(step, deep): &(u32, f64)| {
                    (
                        step,
                        deep - away - bend * aside * aside + dice.way(0.05 * radius),
                    )
                };
                points.push(Walker {
                    info: ImpInfo {
                        // Of a cluster all of them go along the same disc.
                        id: 2 * points.len() as u64 + 1,
                        radius,
                        mass,
                        group,
                        next: 0,
                    },
                    along: Along::Body(body),
                    way: Course(way.0.iter().map(along).collect()),
                    overlap: Course(overlap.0.iter().map(&mut deep).collect()),
                    noise: dice.vector(0.1 * radius / dice.dt),
                    spin: dice.way(0.1 / dice.dt),
                    present: if comes {
                        more.presence(&[change, change + 3], steps)
                    } else {
                        present.clone()
                    },
                    segment: if is_last && !is_ring { 0 } else { segment },
                });
            }
        }
        points
    }

    fn law(&mut self, of_points: bool) -> ContactLaw {
        let k = self.about(self.scale.stiffness);
        let rubs = self.takes.meets("feature:friction") && self.rng.u32(0..3) > 0;
        let damps = self.takes.meets("feature:damping") && self.rarely();
        let damps = damps && !(rubs && self.takes.has(OWN_FRICTION));
        let sticks = self.takes.meets("feature:adhesion") && self.rarely();
        let friction = self.when(rubs, |dice| dice.between(0.05, 1.2));
        let tangential_stiffness = self.when(rubs, |dice| k * dice.between(0.1, 1.0));
        let damping_ratio = self.when(damps, |dice| dice.between(0.01, 0.5));
        let other_mass =
            of_points && damps && self.takes.meets("feature:damped_mass") && self.rarely();
        let damped_mass = self.when(other_mass, |dice| dice.about(dice.scale.mass));
        let adhesion = self.when(sticks, |dice| k * dice.between(0.001, 0.02));
        let linear = ContactLaw::Linear {
            normal_stiffness: k,
            tangential_stiffness,
            friction,
            damping_ratio,
            damped_mass,
        };
        let granular = ContactLaw::Granular {
            normal_stiffness: k,
            tangential_stiffness,
            friction,
            damping_ratio,
            damped_mass,
            adhesion,
            rolling_friction: self.rolling_friction(of_points),
        };
        let area = ContactLaw::Area {
            area_stiffness: k / self.scale.radius,
            tangential_stiffness,
            friction,
        };
        let laws = [
            ("law:linear", Some(linear)),
            ("law:granular", Some(granular)),
            ("law:hertz_mindlin", None),
            ("law:area", Some(area)),
        ];
        let drawn = self.member(&laws).unwrap_or(Some(linear));
        drawn.unwrap_or_else(|| ContactLaw::HertzMindlin {
            hertz_constant: k / self.scale.radius.sqrt(),
            poisson_ratio: self.between(0.0, 0.5),
            friction,
            restitution: if damps { self.between(0.3, 1.0) } else { 1.0 },
            adhesion,
        })
    }

    fn rolling_friction(&self, of_points: bool) -> f64 {
        let resists = !of_points && self.takes.meets("feature:rolling_friction");
        let mut dice = self.aside();
        let resists = resists && dice.often();
        dice.when(resists, |dice| dice.between(0.0, 1.0))
    }

    fn shape(&mut self) -> BodyShape {
        let size = self.about(4.0 * self.scale.radius);
        let shapes: [Member<BodyShape>; 5] = [
            ("shape:disc", |_, _| BodyShape::Disc),
            ("shape:segment", |_, size| BodyShape::Segment {
                ends: [[-size, 0.1 * size], [size, 0.0]],
            }),
            ("shape:rectangle", |dice, size| BodyShape::Rectangle {
                width: 2.0 * size,
                height: dice.between(0.5, 2.0) * size,
            }),
            ("shape:polygon", |dice, size| {
                // One in four has notches.
                // One in eight has so many corners that a solver may look for the near ones in its own way.
                let (few, mut more) = (dice.rng.u32(3..8), dice.aside());
                let many = more.rng.u32(0..8) == 0;
                let corners = if many { more.rng.u32(17..40) } else { few };
                let low = if dice.rarely() { 0.6 } else { 1.0 };
                let reach = |dice: &mut Self| size * dice.between(low, 1.0);
                BodyShape::Polygon {
                    vertices: dice.star(corners, [0.0; 2], reach),
                }
            }),
            ("shape:cluster", |_, size| BodyShape::Cluster {
                centers: vec![[0.0; 2], [0.7 * size, 0.2 * size]],
                radii: Vec::new(),
            }),
        ];
        let drawn = self.member(&shapes);
        drawn.map_or(BodyShape::Disc, |draw| draw(self, size))
    }

    fn motion(&mut self) -> Motion {
        let motions: [Member<Motion>; 6] = [
            ("motion:free", |_, _| Motion::Free),
            ("motion:free", |_, _| Motion::Free),
            ("motion:fixed", |_, _| Motion::Fixed),
            ("motion:driven", |_, _| Motion::Driven),
            ("motion:guided", |dice, _| Motion::Guided {
                hold_x: dice.often(),
                hold_y: dice.often(),
                hold_angle: dice.often(),
            }),
            ("motion:pushed", |dice, _| {
                let force = dice.scale.stiffness * dice.scale.radius * 0.1;
                Motion::Pushed {
                    force: dice.vector(force),
                    torque: dice.way(force * dice.scale.radius),
                    ramp: dice.perhaps(|dice| dice.dt * dice.between(0.0, 40.0)),
                    until: dice.rarely().then(|| dice.dt * dice.between(5.0, 40.0)),
                }
            }),
        ];
        let drawn = self.member(&motions);
        drawn.map_or(Motion::Fixed, |draw| draw(self, 0.0))
    }

    /// Bodies in a row, so near to one another that a point between two touches both, or that they touch.
    fn bodies(&mut self, count: usize, touching: bool) -> Vec<BodyConfig> {
        let far = self.rarely();
        let far = self.when(far, |dice| 1e4 * dice.scale.radius);
        let (mut x, heading) = (0.0, self.between(0.0, std::f64::consts::TAU));
        let mut bodies = Vec::new();
        for k in 0..count {
            let shape = self.shape();
            let disc = matches!(shape, BodyShape::Disc | BodyShape::Cluster { .. });
            let sphero_radius = match (&shape, self.rng.u32(0..4)) {
                (BodyShape::Polygon { .. } | BodyShape::Rectangle { .. }, 0) => 0.0,
                _ if disc => self.about(3.0 * self.scale.radius),
                _ => self.about(0.5 * self.scale.radius),
            };
            let corners = shape.vertices().into_iter().map(|[x, y]| x.hypot(y));
            let extent = corners.fold(0.0, f64::max) + sphero_radius;
            let widest = if touching { 0.3 } else { 1.5 };
            let gap = self.scale.radius * self.between(-0.3, widest);
            x += if k > 0 { extent + gap } else { 0.0 };
            let motion = self.motion();
            let moves = f64::from(u8::from(motion != Motion::Fixed && self.often()));
            bodies.push(BodyConfig {
                name: format!("body{k}"),
                shape,
                sphero_radius,
                inertia: self.inertia(extent),
                position: [far + x * heading.cos(), x * heading.sin()],
                angle: self.way(3.0),
                velocity: self.vector(moves * 0.05 * self.scale.radius / self.dt),
                spin: self.way(moves * 0.1 / self.dt),
                motion,
                surface: String::new(),
            });
            x += extent;
        }
        bodies
    }

    fn inertia(&mut self, extent: f64) -> BodyInertia {
        let mass = self.about(self.scale.mass);
        let whole = BodyInertia::Mass(mass);
        let density = BodyInertia::Density(mass / (extent * extent));
        self.one_of("inertia", &[whole, density]).unwrap_or(whole)
    }

    fn points(&mut self, config: &DemConfig, steps: u32) -> Vec<Walker> {
        let count = match self.rng.u32(0..40) {
            0 => 0,
            1 => self.rng.u64(60..200),
            _ => self.rng.u64(1..6),
        };
        let in_pairs = !config.group_pairs.is_empty();
        // The set changes in a few steps, so that some points come, go and change their slots.
        let changes = 0..self.rng.u32(0..3);
        let changes: Vec<u32> = changes.map(|_| self.rng.u32(1..steps.max(2))).collect();
        let mut id = 0;
        let mut points: Vec<Walker> = Vec::new();
        for k in 0..count as usize {
            id += self.rng.u64(1..4);
            let radius = self.scale.radius * self.between(0.6, 1.0);
            let on_point = in_pairs && k > 0 && (config.bodies.is_empty() || self.often());
            let along = if on_point {
                Along::Point(self.rng.usize(0..k))
            } else if config.bodies.is_empty() {
                Along::Axis
            } else {
                Along::Body(self.rng.usize(0..config.bodies.len()))
            };
            let group = match along {
                Along::Point(other) => 1 - points[other].info.group,
                Along::Body(_) | Along::Axis => self.rng.u32(0..2),
            };
            let (way, overlap) = self.walk(radius, steps);
            let mass = self.about(self.scale.mass);
            points.push(Walker {
                info: ImpInfo {
                    id,
                    radius,
                    mass,
                    group,
                    next: 0,
                },
                along,
                way,
                overlap,
                noise: {
                    let exact = self.often();
                    self.when(!exact, |dice| dice.vector(0.1 * radius / dice.dt))
                },
                spin: 0.0,
                present: self.presence(&changes, steps),
                segment: 0,
            });
        }
        for point in &mut points {
            if !self.rarely() {
                point.spin = self.way(0.1 / self.dt);
            }
        }
        points
    }
}

/// The farthest place of a body from the origin of its shape in m.
fn extent(body: &BodyConfig) -> f64 {
    let corners = body.shape.vertices().into_iter();
    let corners = corners.map(|[x, y]| x.hypot(y));
    corners.fold(0.0, f64::max) + body.sphero_radius
}

impl<S> Dice<'_, S> {
    /// Some points on polygons begin on their outlines, or as near to them, if the bodies rest, as a corner can be, or inside, with
    /// notches.
    fn put_on_outlines(&mut self, config: &mut DemConfig, points: &mut [Walker]) {
        if self.rng.u32(0..6) > 0 || self.takes.has(NO_INSIDE) {
            return;
        }
        let mut dice = self.aside();
        let rest = dice.often() && dice.takes.meets("motion:fixed");
        let straight = if dice.often() { 0.0 } else { 1.0 };
        let inside = dice.often() && config.overlap == OverlapMeasure::EachEdge;
        let bodies = &mut config.bodies;
        for body in bodies.iter_mut().filter(|_| inside) {
            if let BodyShape::Polygon { vertices } = &mut body.shape {
                let inner = vertices.iter_mut().skip(1).step_by(2);
                inner.for_each(|v| *v = v.map(|x| 0.5 * x));
            }
        }
        for body in bodies.iter_mut().filter(|_| rest) {
            (body.motion, body.velocity, body.spin) = (Motion::Fixed, [0.0; 2], 0.0);
            // On an edge along an axis, points are on the outline to the last bit.
            body.angle *= straight;
        }
        for point in points {
            let Along::Body(b) = point.along else {
                continue;
            };
            let is_polygon = matches!(
                bodies[b].shape,
                BodyShape::Polygon { .. } | BodyShape::Rectangle { .. }
            );
            if !is_polygon || self.often() {
                continue;
            }
            let (stay, radius) = (self.rng.u32(1..20), point.info.radius);
            let near = rest && dice.often();
            let away = match (inside, near) {
                (true, _) => -radius * dice.between(0.05, 0.8),
                (_, true) => radius * decades(&mut dice.rng, -7.0, -1.0),
                _ => 0.0,
            };
            let mut last = (stay, bodies[b].sphero_radius + radius - away);
            let mut course = vec![(0, last.1), last];
            for &(step, wanted) in point.overlap.0.iter().filter(|(step, _)| *step > stay) {
                let change = 0.15 * radius * f64::from(step - last.0);
                last = (step, last.1 + (wanted - last.1).clamp(-change, change));
                course.push(last);
            }
            point.overlap = Course(course);
        }
    }

    fn presence(&mut self, changes: &[u32], steps: u32) -> Vec<[u32; 2]> {
        let mut edges: Vec<u32> = changes.iter().copied().filter(|_| self.rarely()).collect();
        edges.sort_unstable();
        edges.dedup();
        match (edges[..].first(), edges.get(1), self.often()) {
            (Some(&from), Some(&to), true) => vec![[0, from], [to, steps]],
            (Some(&at), _, true) => vec![[0, at]],
            (Some(&at), _, false) => vec![[at, steps]],
            (None, ..) => vec![[0, steps]],
        }
    }

    /// Where a point goes: way and overlap in m. It comes and goes, sticks, slides forth and back, and sinks in deep.
    fn walk(&mut self, radius: f64, steps: u32) -> (Course, Course) {
        let start = self.between(0.0, 20.0) * radius;
        let overlap = self.overlap(radius);
        let (mut way, mut overlaps) = (Course(vec![(0, start)]), Course(vec![(0, overlap)]));
        let (mut step, mut at, mut deep) = (0, start, overlap);
        while step < steps {
            let go = self.rng.u32(2..12);
            step += go;
            let pace = match self.rng.u32(0..3) {
                0 => 0.0,
                1 => 0.003 * radius,
                _ => 0.15 * radius,
            };
            at += f64::from(go) * self.way(pace);
            let wanted = self.overlap(radius);
            let change = 0.15 * radius * f64::from(go);
            deep += (wanted - deep).clamp(-change, change);
            way.0.push((step, at));
            overlaps.0.push((step, deep));
        }
        (way, overlaps)
    }

    fn overlap(&mut self, radius: f64) -> f64 {
        let share = match self.rng.u32(0..6) {
            0 => self.between(-0.7, 0.0),
            1 => self.between(0.0, 1e-3),
            2 => self.between(0.3, 0.9),
            _ => self.between(0.0, 0.3),
        };
        share * radius
    }
}
