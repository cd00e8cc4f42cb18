//! Random cases of a continuum, within what a solver says that it takes. Cells, densities and stiffnesses come from several
//! orders of magnitude; speeds, forces and steps follow from them, so that strains stay moderate.

use fastrand::Rng;
use interface::config::capability::{Capabilities, LAYERS, PAIRS, STRESS_WORK};
use interface::config::material::{CriticalState, Elasticity, Frictional, Inertial};
use interface::config::{
    ContactForceScheme, Drift, Fill, GridContact, GroupConfig, Hold, InitialFields, MaterialConfig,
    MaterialModel, MpmConfig, Plane, Probe, Scheme, ShapeFunction, Spacing, Stage, StressUpdate,
    Traction, Transfer, Wall, Walls,
};

use super::super::dice::{Dice, decades};
use super::super::plan::{self, Course, Epoch};
use super::case::{Case, Outline, Push};
use crate::clause::mpm::scene;

/// A continuum whose points do not meet on a grid.
pub const NO_GRID: &str = "feature:no_grid";

/// What the numbers of a case have in common.
struct Scale {
    /// In m.
    cell: f64,
    /// Of pressure waves in m/s.
    wave: f64,
    /// In kg/m^3.
    density: f64,
}

/// Points of the groups of a case.
#[derive(Clone, Copy)]
enum Size {
    /// Up to four along each axis.
    Few,
    /// Many along this axis.
    Long(usize),
    /// As many along each axis, of which one half is of the first group and the other one of the second.
    Halves([u32; 2]),
}

/// How many points a group has.
fn points_of(group: &GroupConfig) -> usize {
    match (&group.fill, group.spacing) {
        (Fill::Points { positions }, _) => positions.len(),
        (_, Spacing::Counts([n, m])) => (n * m) as usize,
        _ => 0,
    }
}

/// The case of a seed, for a continuum that says that it takes this.
pub fn case(seed: u64, takes: &Capabilities) -> Case {
    let mut rng = Rng::with_seed(seed);
    let scale = Scale {
        cell: decades(&mut rng, -2.0, 0.5),
        wave: decades(&mut rng, 0.0, 3.0),
        density: decades(&mut rng, 1.0, 4.0),
    };
    let dt = decades(&mut rng, -1.7, -0.7) * scale.cell / scale.wave;
    Dice::new(rng, takes, dt, scale).case()
}

impl Dice<'_, Scale> {
    fn case(mut self) -> Case {
        let alone = self.takes.has(NO_GRID);
        let spacing = if alone {
            8.0
        } else {
            1.0 / self.between(1.2, 3.5)
        } * self.scale.cell;
        let (shape, stress_update, transfer) = self.scheme(alone);
        let count = 1 + self.rng.usize(0..3);
        let layers = count > 1 && self.takes.has(LAYERS) && self.rarely();
        let pairs = layers && self.takes.has(PAIRS) && self.often();
        let walls = if alone {
            Walls::default()
        } else {
            let drawn = self.walls();
            let walls = self.aside().rough(drawn);
            let speed = 0.03 * self.scale.wave;
            if transfer.filters() {
                walls
            } else {
                self.aside().aside().pull(walls, speed)
            }
        };
        let materials: Vec<_> = (0..count).map(|_| self.material(alone)).collect();
        let mut groups = self.groups(count, spacing, layers && !pairs, transfer.is_affine());
        let plane = self.prestress(&mut groups, &materials);
        let domain = self.domain(&groups, &walls);
        let most = 1e-3 * self.scale.wave / self.dt;
        let gravity = self.perhaps(|dice| dice.vector(most));
        let mut config = MpmConfig {
            scheme: Scheme {
                domain,
                cell: self.scale.cell,
                shape,
                transfer,
                stress_update,
                plane,
                walls,
                layers,
                ..Scheme::default()
            },
            gravity,
            materials,
            group_pairs: if pairs { vec![[0, 1]] } else { Vec::new() },
            skin: self.between(0.05, 1.0) * self.scale.cell,
            ..scene::scene(groups)
        };
        if !alone {
            self.aside().force(&mut config, most);
            self.aside().aside().meet(&mut config);
        }
        let epochs = self.epochs(true);
        let steps = plan::steps(&epochs);
        self.aside().carry(&mut config, &epochs);
        let points = config.groups.iter().map(points_of).sum();
        let mut pushes = self.pushes(points, spacing, steps, config.drift());
        let skin = config.skin;
        let travel = (0..self.rng.u32(0..4))
            .map(|k| (8 * k, self.between(0.0, 0.8) * skin))
            .collect();
        let bodies = self.bodies(config.domain);
        if config.walls.periodic().contains(&true) {
            // A body sees no points beyond the other end, and a solver may refuse it there.
            pushes.clear();
        }
        if !alone {
            self.aside().share(&mut config);
            self.rub(&mut pushes, spacing);
        }
        Case {
            bodies,
            travel: Course(travel),
            pushes,
            epochs,
            config,
        }
    }

    /// How points and nodes exchange what they have.
    fn scheme(&mut self, alone: bool) -> (ShapeFunction, StressUpdate, Transfer) {
        use ShapeFunction::{CubicBspline, Linear, QuadraticBspline, Ugimp};
        use StressUpdate::{Musl, Usavg, Usf, Usl};
        let shape = self.one_of("shape", &[QuadraticBspline, CubicBspline, Ugimp, Linear]);
        let shape = shape.filter(|_| !alone);
        let shape = shape.unwrap_or(Linear);
        let stress_update = match self.one_of("stress_update", &[Usf, Usl, Musl, Usavg]) {
            Some(Usl) if shape == Linear => Usf,
            drawn => drawn.unwrap_or(Usf),
        };
        let transfer = if alone {
            Transfer::Flip
        } else {
            self.transfer(shape)
        };
        (shape, stress_update, transfer)
    }

    fn transfer(&mut self, shape: ShapeFunction) -> Transfer {
        let order = self.rng.u32(1..4);
        let pic_rate = self.between(0.0, 0.5) / self.dt;
        let pic_fraction = self.rng.f64();
        let transfers = [
            Transfer::Flip,
            Transfer::Pic,
            Transfer::Blend { pic_fraction },
            Transfer::Xpic { order },
            Transfer::FlipPic { pic_rate },
            Transfer::FlipXpic { order, pic_rate },
            Transfer::Apic,
            Transfer::Aflip { pic_rate },
        ];
        // The last two need a spline.
        let count = match shape {
            ShapeFunction::QuadraticBspline | ShapeFunction::CubicBspline => 8,
            _ => 6,
        };
        let drawn = self.one_of("transfer", &transfers[..count]);
        drawn.unwrap_or(Transfer::Flip)
    }

    fn walls(&mut self) -> Walls {
        use Wall::{Fixed, Open, Slip, Tangential};
        let walls = [Open, Open, Fixed, Slip, Tangential];
        let mut pair = || {
            let ends = [0; 2].map(|_| self.one_of("wall", &walls).unwrap_or(Open));
            let closed = self.takes.has("wall:periodic") && self.aside().rng.u32(0..8) == 0;
            if closed { [Wall::Periodic; 2] } else { ends }
        };
        let ([left, right], [bottom, top]) = (pair(), pair());
        Walls {
            left,
            right,
            bottom,
            top,
        }
    }

    fn material(&mut self, alone: bool) -> MaterialConfig {
        // K + 4 G/3 = rho c^2.
        let ratio = if alone {
            5.0 / 3.0
        } else {
            self.between(0.5, 5.0)
        };
        let density = self.about(self.scale.density);
        let shear_modulus = density * self.scale.wave * self.scale.wave * self.between(0.3, 1.0)
            / (ratio + 4.0 / 3.0);
        let moduli = Elasticity {
            bulk_modulus: ratio * shear_modulus,
            shear_modulus,
        };
        let mut material = scene::material(density, moduli);
        if self.takes.has("material:von_mises") && !alone && self.rarely() {
            material.model = MaterialModel::VonMises {
                bulk_modulus: ratio * shear_modulus,
                shear_modulus,
                yield_stress: self.between(1e-3, 2e-2) * shear_modulus,
                hardening_modulus: self.between(0.0, 1.0) * shear_modulus,
            };
        } else if self.takes.has("material:linear_elastic") && !alone {
            let model = self.aside().model(&self.scale, moduli);
            material.model = model.unwrap_or(material.model);
        }
        material
    }

    /// Plane strain or stress. A run begins with no stress beyond a yield surface, nor with one that has no deformation, nor where
    /// rounding decides whether grains touch.
    fn prestress(&self, groups: &mut [GroupConfig], materials: &[MaterialConfig]) -> Plane {
        let mut aside = self.aside();
        let thins = !self.takes.has(NO_GRID)
            && materials.iter().all(|m| m.model.takes_plane_stress())
            && aside.takes.meets("plane:stress")
            && aside.rarely();
        for group in groups {
            let model = materials[group.material].model;
            let pressure = -aside.between(1e-3, 1e-2) * model.moduli().0;
            let stress = &mut group.fields.stress;
            match model {
                _ if model.takes_plane_stress() => {
                    if let (true, Some([_, _, zz, _])) = (thins, stress) {
                        *zz = "0".into();
                    }
                }
                MaterialModel::NeoHookean(_) | MaterialModel::VonMises { .. } => *stress = None,
                _ if !aside.takes.meets("feature:fields") => *stress = None,
                _ => {
                    let normal = || format!("{pressure}");
                    *stress = Some([normal(), normal(), normal(), "0".into()]);
                }
            }
        }
        if thins { Plane::Stress } else { Plane::Strain }
    }

    /// Groups side by side, or on one another where they are `apart`: on layers and without contact.
    fn groups(
        &mut self,
        count: usize,
        spacing: f64,
        apart: bool,
        affine: bool,
    ) -> Vec<GroupConfig> {
        let size = self.aside().size(count);
        // Rounding of far places changes light nodes by more than what is compared, and many points have some.
        let far = self.rarely() && matches!(size, Size::Few);
        let far = self.when(far, |dice| 1e3 * dice.scale.cell);
        let corner = [0; 2].map(|_| far + self.way(5.0) * self.scale.cell);
        let mut groups = Vec::new();
        let mut left = corner[0];
        for g in 0..count {
            let few = [1 + self.rng.u32(0..4), 1 + self.rng.u32(0..4)];
            let counts = match size {
                Size::Few => few,
                Size::Long(0) => [self.aside().rng.u32(10..40), few[1]],
                Size::Long(_) => [few[0], self.aside().rng.u32(10..40)],
                Size::Halves(counts) => counts,
            };
            let upper = (matches!(size, Size::Halves(_)) && g < 2).then_some(g == 1);
            // Layers may lie on one another, where their groups do not touch.
            let at = if upper == Some(true) || apart && self.often() {
                corner[0]
            } else {
                left
            };
            let group = self.group(g, spacing, ([at, corner[1]], counts, upper), affine);
            left = at + spacing * (f64::from(counts[0]) + self.between(0.0, 0.5));
            groups.push(group);
        }
        groups
    }

    /// A group of `counts` points with its lower left corner at `corner` (m), or of one half of these: the `upper` one or not.
    fn group(
        &mut self,
        number: usize,
        side: f64,
        (corner, counts, upper): ([f64; 2], [u32; 2], Option<bool>),
        affine: bool,
    ) -> GroupConfig {
        let [n, m] = counts.map(f64::from);
        // Without a grid, points of a region may be joined in some other way.
        let regions = self.takes.meets("fill:rectangle") && !self.takes.has(NO_GRID);
        let listed = self.takes.meets("fill:points")
            && (upper.is_some() || self.rng.u32(0..4) > 0 || !regions);
        let (fill, spacing) = if listed {
            let mess = if self.often() { 0.2 * side } else { 0.0 };
            let mut positions = Vec::new();
            for k in 0..counts[0] * counts[1] {
                let place = [k % counts[0], k / counts[0]].map(|i| f64::from(i) + 0.5);
                let shares = place[0] / n + place[1] / m;
                let x = [0, 1].map(|a| corner[a] + place[a] * side + self.way(mess));
                if upper.is_none_or(|upper| upper == (shares >= 1.0)) {
                    positions.push(x);
                }
            }
            (Fill::Points { positions }, Spacing::Distance(side))
        } else {
            let lower = corner;
            let upper = [corner[0] + n * side, corner[1] + m * side];
            (Fill::Rectangle { lower, upper }, Spacing::Counts(counts))
        };
        let speed = 0.03 * self.scale.wave;
        // The affine velocities that points of such a transfer begin with are their solver's own.
        let velocity = (self.takes.meets("feature:fields") && !affine && self.often()).then(|| {
            let mut field = || {
                let [a, b] = self.vector(speed / self.scale.cell);
                format!("({a})*(x - ({}))+({b})*(y - ({}))", corner[0], corner[1])
            };
            [field(), field()]
        });
        let pressure = 0.01 * self.scale.density * self.scale.wave * self.scale.wave;
        let stress = (self.takes.meets("feature:fields") && self.rarely())
            .then(|| [0; 4].map(|_| format!("{}", self.way(pressure))));
        GroupConfig {
            name: format!("group{number}"),
            material: number,
            spacing,
            velocity: self.vector(speed),
            fields: InitialFields { velocity, stress },
            contact_radius: Some(self.between(0.05, 0.5) * side.min(self.scale.cell)),
            ..scene::group(fill)
        }
    }

    /// A domain around these groups, with more room at walls through which points would leave.
    fn domain(&mut self, groups: &[GroupConfig], walls: &Walls) -> [[f64; 2]; 2] {
        let mut domain = [[0.0; 2]; 2];
        for (a, ends) in walls.by_axis().into_iter().enumerate() {
            let along = || groups.iter().flat_map(|g| g.fill.bounds().map(|x| x[a]));
            let [low, high] = [
                along().fold(f64::INFINITY, f64::min),
                along().fold(f64::NEG_INFINITY, f64::max),
            ];
            let mut room = |(_, wall)| match wall {
                Wall::Open => self.between(1.0, 3.0),
                _ => self.between(0.05, 1.0),
            };
            let (below, above) = (room(ends[0]), room(ends[1]));
            let cells = ((high - low) / self.scale.cell + below + above)
                .ceil()
                .max(4.0);
            domain[0][a] = low - below * self.scale.cell;
            domain[1][a] = domain[0][a] + cells * self.scale.cell;
        }
        domain
    }

    /// Forces that change the velocity of a point by some percent of that of waves in all.
    fn pushes(&mut self, points: usize, side: f64, steps: u32, drift: Drift) -> Vec<Push> {
        let count = if self.rarely() {
            0
        } else {
            self.rng.usize(1..6)
        };
        let mut pushes = Vec::new();
        for _ in 0..count {
            let from = self.rng.u32(0..steps.max(2));
            let to = from + self.rng.u32(1..12);
            let mass = self.scale.density * side.min(self.scale.cell).powi(2);
            let most = mass * 0.01 * self.scale.wave / self.dt;
            // Whether a point that bodies are near to, but do not press on, moves with the mapped velocities, is its
            // solver's own affair.
            let touches = drift == Drift::Mapped || self.rng.u32(0..4) > 0;
            pushes.push(Push {
                point: self.rng.usize(0..points.max(1)),
                steps: [from, to],
                force: self.when(touches, |dice| dice.vector(most)),
                couple: 0.0,
                stiffness: self.about(0.01 * mass / (self.dt * self.dt)),
                tangential: 0.0,
            });
        }
        pushes
    }

    /// Friction on the surfaces of some of the points that are pushed.
    fn rub(&mut self, pushes: &mut [Push], side: f64) {
        for push in pushes {
            if self.often() {
                let most = 0.2 * side * push.force[0].hypot(push.force[1]);
                push.couple = self.way(most);
                push.tangential = self.between(0.1, 1.0) * push.stiffness;
            }
        }
    }

    fn bodies(&mut self, [lower, upper]: [[f64; 2]; 2]) -> Vec<Outline> {
        let size = [upper[0] - lower[0], upper[1] - lower[1]];
        if self.often() {
            // Around all, so that all points are seen in every step.
            let at = |x: f64, y: f64| [lower[0] + x * size[0], lower[1] + y * size[1]];
            let vertices = vec![at(-1.0, -1.0), at(2.0, -1.0), at(2.0, 2.0), at(-1.0, 2.0)];
            return vec![Outline {
                vertices,
                reach: 0.0,
            }];
        }
        let count = self.rng.u32(0..3);
        let mut bodies = Vec::new();
        for _ in 0..count {
            let n = self.rng.u32(1..6);
            let middle = [0, 1].map(|a| lower[a] + size[a] * self.rng.f64());
            let extent = self.between(0.1, 0.5) * size[0].min(size[1]);
            // One in four has notches.
            let mut vertices = self.star(n, middle, |dice| {
                extent * if dice.rarely() { 0.5 } else { 1.0 }
            });
            if self.often() {
                vertices.reverse();
            }
            let reach = self.between(0.0, 1.0) * self.scale.cell;
            bodies.push(Outline { vertices, reach });
        }
        bodies
    }
}

impl Dice<'_, ()> {
    /// In one case of eight groups are large: a solver may keep points in blocks of cells, and has its own way where a group fills
    /// several of them, or only a part of one.
    fn size(&mut self, groups: usize) -> Size {
        if self.takes.has(NO_GRID) || self.rng.u32(0..8) > 0 {
            return Size::Few;
        }
        let halves = groups > 1 && self.takes.meets("fill:points");
        match self.rng.usize(0..3) {
            2 if halves => Size::Halves([0; 2].map(|_| self.rng.u32(10..26))),
            axis => Size::Long(axis % 2),
        }
    }

    /// A model of these moduli (Pa) that is no solid of the usual elasticity; or none.
    fn model(&mut self, scale: &Scale, moduli: Elasticity) -> Option<MaterialModel> {
        let Elasticity {
            bulk_modulus,
            shear_modulus,
        } = moduli;
        let strength = |dice: &mut Self| dice.between(1e-3, 2e-2) * shear_modulus;
        let friction_angle = self.between(5.0, 50.0);
        let sand = Frictional {
            bulk_modulus,
            shear_modulus,
            friction_angle,
            dilation_angle: self.perhaps(|dice| dice.between(0.0, friction_angle)),
            cohesion: self.perhaps(strength),
            tensile_strength: self.perhaps(strength),
            critical_state: None,
            separates: false,
        };
        let sand = self.separating(sand);
        let cone = Frictional {
            critical_state: self.critical_state(),
            ..sand
        };
        let models = [
            MaterialModel::DruckerPrager(cone),
            MaterialModel::MohrCoulomb(sand),
            MaterialModel::NeoHookean(moduli),
            self.fluid(scale, bulk_modulus),
            MaterialModel::Hypoelastic(moduli),
            MaterialModel::MuI(self.grains(scale, moduli)),
        ];
        // Grains begin under pressure, and a stress without an energy is compared by its work.
        let whole = self.takes.meets("feature:fields") && self.takes.has(STRESS_WORK);
        let drawn = self.one_of("material", &models[..if whole { 6 } else { 4 }]);
        drawn.filter(|_| self.often())
    }

    /// The same walls, of which some have friction; or none.
    fn rough(&mut self, mut walls: Walls) -> Walls {
        if self.rng.u32(0..8) == 0 {
            return Walls::default();
        }
        for wall in [
            &mut walls.left,
            &mut walls.right,
            &mut walls.bottom,
            &mut walls.top,
        ] {
            let coefficient = self.between(0.0, 1.0);
            if *wall != Wall::Periodic && self.takes.meets("wall:friction") && self.rarely() {
                *wall = Wall::Friction { coefficient };
            }
        }
        walls
    }

    /// The same walls, of which some move at `most` this speed (m/s), with none that acts along those.
    fn pull(&mut self, walls: Walls, most: f64) -> Walls {
        let (speed, which) = (self.way(most), self.rng.u32(0..48));
        if !self.takes.meets("wall:driven") || which > 5 {
            return walls;
        }
        let driven = Wall::Driven { speed };
        let [one, other] = match which % 3 {
            0 => [driven; 2],
            1 => [driven, Wall::Open],
            _ if self.takes.meets("wall:slip") => [Wall::Slip, driven],
            _ => [Wall::Open, driven],
        };
        let across = |ends: [Wall; 2]| match ends {
            [Wall::Periodic, _] => Wall::Periodic,
            _ => Wall::Open,
        };
        let [left, right, bottom, top] = if which < 3 {
            let across = across([walls.left, walls.right]);
            [across, across, one, other]
        } else {
            let across = across([walls.bottom, walls.top]);
            [one, other, across, across]
        };
        Walls {
            left,
            right,
            bottom,
            top,
        }
    }

    /// Adds loads that accelerate points as `most` (m/s^2) does, supports, probes, stages, and a way for contact forces to the grid.
    fn force(&mut self, config: &mut MpmConfig, most: f64) {
        let MpmConfig {
            scheme,
            forcing,
            groups,
            ..
        } = config;
        if self.takes.meets("feature:fields") && self.rarely() {
            let mut formula = || {
                let [of_space, of_time] = [
                    self.way(most / scheme.cell),
                    self.way(most / (50.0 * self.dt)),
                ];
                let x = scheme.domain[0][0];
                format!(
                    "({})*(1 + y*y/(1 + y*y)) + ({of_space})*(x - ({x})) + ({of_time})*t",
                    self.way(most)
                )
            };
            forcing.body_force = Some([formula(), formula()]);
        }
        if self.rarely() {
            let (points, within) = self.some(groups, scheme.cell);
            let density = config.materials[0].density;
            let force = self.vector(most * density * scheme.cell * scheme.cell);
            forcing.tractions.push(Traction {
                points,
                within,
                force,
            });
        }
        let filters = scheme.transfer.filters();
        let holds = self.takes.meets("feature:holds") && !filters && self.rarely();
        if holds {
            forcing.holds.push(self.hold(groups, scheme.cell));
        }
        if self.takes.meets("feature:probes") {
            for k in 0..self.rng.u32(0..3) {
                let (points, within) = self.some(groups, scheme.cell);
                config.probes.push(Probe {
                    name: format!("probe{k}"),
                    points,
                    within,
                });
            }
        }
        if holds && self.often() {
            let hold = self.hold(groups, scheme.cell);
            forcing.holds.push(Hold {
                name: "other".into(),
                ..hold
            });
        }
        let blends = matches!(scheme.transfer, Transfer::Flip | Transfer::Blend { .. });
        let walls = scheme.walls.by_axis();
        let driven = |(_, wall): &(_, Wall)| matches!(wall, Wall::Driven { .. });
        let pulled = walls.as_flattened().iter().any(driven);
        let most = if pulled { 0.0 } else { 1.0 / self.dt };
        let stages = self.rng.u32(0..8).saturating_sub(5);
        for k in 0..stages {
            let from = (f64::from(k) + self.rng.f64()) * 20.0 * self.dt;
            forcing.stages.push(Stage {
                from: if k == 0 && self.often() { 0.0 } else { from },
                damping: self.perhaps(|dice| dice.between(0.0, most)),
                pic_fraction: (blends && self.often()).then(|| self.rng.f64()),
            });
        }
        let splines = scheme.shape != ShapeFunction::Linear;
        let schemes = [
            ContactForceScheme::NearestNodes,
            ContactForceScheme::Traction,
        ];
        let way = self.one_of("contact_force", &schemes[..if splines { 2 } else { 1 }]);
        scheme.contact_force = way.filter(|_| self.rarely()).unwrap_or_default();
    }

    /// Lets grains share their volumes with others near them; or not.
    fn share(&mut self, config: &mut MpmConfig) {
        let first = config.stress_update == StressUpdate::Usf;
        let takes = self.takes.meets("feature:volume_rate") && first;
        for material in config.materials.iter_mut().filter(|_| takes) {
            if let MaterialModel::MuI(numbers) = &mut material.model {
                numbers.volume_rate = self.perhaps(|dice| dice.between(0.0, 0.1) / dice.dt);
            }
        }
    }

    /// Lets groups touch on the grid, or nodes get the spins of their groups; or neither.
    fn meet(&mut self, config: &mut MpmConfig) {
        let (which, friction) = (self.rng.u32(0..16), self.between(0.0, 1.0));
        let meets = self.takes.meets("feature:grid_contact") && which < 4;
        if meets && !config.layers && config.groups.len() > 1 && config.forcing.holds.is_empty() {
            config.grid_contact = Some(GridContact { friction });
            let by_first = matches!(config.stress_update, StressUpdate::Usf | StressUpdate::Musl);
            if config.shape == ShapeFunction::Ugimp && !by_first {
                config.stress_update = StressUpdate::Usf;
            }
        }
        let plain = !config.transfer.filters() && !config.transfer.is_affine();
        let closed = config.walls.periodic().contains(&true);
        if self.takes.meets("feature:keeps_spin") && plain && !closed && which % 4 == 0 {
            for group in &mut config.groups {
                group.keeps_spin = self.often();
            }
        }
    }

    /// In one case of eight all points fly across some cells, where no wall or support holds them: a solver that keeps points in
    /// blocks of cells has to move them from one to another.
    fn carry(&mut self, config: &mut MpmConfig, epochs: &[Epoch]) {
        let held = self.takes.has(NO_GRID) || !config.forcing.holds.is_empty();
        if self.rng.u32(0..8) > 0 || held {
            return;
        }
        let times = epochs.iter().map(|e| e.dt * f64::from(e.steps()));
        let time: f64 = times.sum();
        let longest = epochs.iter().map(|epoch| epoch.dt).fold(0.0, f64::max);
        let walls = config.walls.by_axis();
        let free = |a: usize| {
            let lets = |(_, wall): &(_, Wall)| matches!(wall, Wall::Open | Wall::Periodic);
            let slides = |end: &(_, Wall)| lets(end) || end.1 == Wall::Slip;
            walls[a].iter().all(lets) && walls[1 - a].iter().all(slides)
        };
        for a in (0..2).filter(|a| free(*a)) {
            let cell = config.cell;
            let way = self.way(4.0) * cell;
            // A point moves by less than a cell in a step.
            let speed = way.signum() * (way.abs() / time).min(0.3 * cell / longest);
            let room = (way.abs() / cell).ceil() * cell;
            if walls[a][0].1 != Wall::Periodic {
                let end = usize::from(way > 0.0);
                config.domain[end][a] += way.signum() * room;
            }
            for group in &mut config.groups {
                group.velocity[a] += speed;
            }
        }
    }

    fn hold(&mut self, groups: &[GroupConfig], cell: f64) -> Hold {
        let (points, within) = self.some(groups, cell);
        let [hold_x, hold_y] = [[true, false], [false, true], [true, true]][self.rng.usize(0..3)];
        Hold {
            name: "hold".into(),
            points,
            within,
            hold_x,
            hold_y,
        }
    }

    /// The name of a group, and a region with some of its points.
    fn some(&mut self, groups: &[GroupConfig], cell: f64) -> (String, [[f64; 2]; 2]) {
        let group = &groups[self.rng.usize(0..groups.len())];
        let middle = match (&group.fill, group.spacing) {
            (Fill::Points { positions }, _) => positions[self.rng.usize(0..positions.len())],
            (fill, Spacing::Counts(counts)) => {
                let [lower, upper] = fill.bounds();
                [0, 1].map(|a| {
                    let place =
                        (f64::from(self.rng.u32(0..counts[a])) + 0.5) / f64::from(counts[a]);
                    lower[a] + (upper[a] - lower[a]) * place
                })
            }
            (fill, _) => fill.bounds()[0],
        };
        let reach = [0; 2].map(|_| self.between(0.1, 1.5) * cell);
        let ends = [-1.0, 1.0].map(|sign| [0, 1].map(|a| middle[a] + sign * reach[a]));
        (group.name.clone(), ends)
    }

    /// The same sand, perhaps with grains that separate.
    fn separating(&mut self, sand: Frictional) -> Frictional {
        let fields = self.takes.meets("feature:fields");
        if !fields || !self.takes.meets("feature:separates") || !self.rarely() {
            return sand;
        }
        Frictional {
            cohesion: 0.0,
            separates: true,
            ..sand
        }
    }

    fn critical_state(&mut self) -> Option<CriticalState> {
        if !self.takes.meets("feature:critical_state") || !self.rarely() {
            return None;
        }
        Some(if self.often() {
            CriticalState::ShearStrain(self.between(1e-3, 1e-2))
        } else {
            CriticalState::Volume(1.0 + self.between(1e-3, 1e-1))
        })
    }

    fn fluid(&mut self, scale: &Scale, bulk_modulus: f64) -> MaterialModel {
        let inert = scale.density * scale.cell * scale.wave;
        MaterialModel::Fluid {
            bulk_modulus,
            exponent: [1.0, self.between(2.0, 8.0)][self.rng.usize(0..2)],
            viscosity: self.perhaps(|dice| dice.between(0.0, 0.05) * inert),
        }
    }

    /// Grains whose inertial number is about that at which friction is halfway.
    fn grains(&mut self, scale: &Scale, moduli: Elasticity) -> Inertial {
        let static_friction = self.between(0.1, 0.8);
        let inertial_number = self.between(0.1, 1.0);
        Inertial {
            bulk_modulus: moduli.bulk_modulus,
            shear_modulus: moduli.shear_modulus,
            static_friction,
            limit_friction: static_friction + self.between(0.05, 0.5),
            inertial_number,
            grain_diameter: self.about(inertial_number * scale.cell),
            grain_density: self.about(scale.density),
            volume_rate: 0.0,
        }
    }
}
