//! The faults of a continuum's configuration. The scene reader and the solver both call this, so that a scene which
//! passes `tandem check` is not refused for its numbers when it runs.
//!
//! The solver itself checks what needs the points (groups on top of one another, a traction on no point) or the values
//! of a formula.

use super::capability::word;
use super::fault::{ConfigFault, Faults};
use super::{
    ContactForceScheme, Drift, Fill, GridContact, GroupConfig, Hold, Lattice, MaterialConfig,
    MaterialModel, MpmConfig, Plane, ShapeFunction, Spacing, StressUpdate, Transfer, Wall,
};

/// Most cells along an axis of the domain: tiles of eight cells are numbered with 29 bits. Cells without points take no
/// memory, so their product is not limited.
pub const CELLS_MAX: f64 = 1.0e9;

/// Most points of a group: their identities within it have 32 bits.
pub const POINTS_MAX: f64 = 2.0e9;

impl MpmConfig {
    /// All faults of the configuration, in its order; empty if a solver can accept it.
    pub fn faults(&self) -> Vec<ConfigFault> {
        Faults::all(|found| {
            let grid_is_sound = self.grid_faults(found);
            self.scheme_faults(found);
            self.wall_faults(found);
            self.material_faults(found);
            for (g, group) in self.groups.iter().enumerate() {
                let mut found = found.at(format!("mpm.points.{g}"));
                self.group_faults(&mut found, group, grid_is_sound);
            }
            self.layer_faults(found);
            self.forcing_faults(found);
            self.chain_faults(found);
            if self.threads == 0 {
                found.add("mpm.threads", "0", "1 or more", "");
            }
        })
    }

    /// Checks the cell and the domain; returns whether both can be used.
    fn grid_faults(&self, found: &mut Faults<'_>) -> bool {
        found.finite("gravity", &self.gravity);
        found.not_negative("coupling.skin", self.skin, "a length of 0 or more");
        let cell = self.cell;
        let mut sound = found.positive("mpm.cell", cell, "a length above 0");
        let [lower, upper] = self.domain;
        let size = [0, 1].map(|a| upper[a] - lower[a]);
        if !size.iter().all(|s| s.is_finite() && *s > 0.0) {
            let help = "write [[x_min, y_min], [x_max, y_max]]";
            let expected = "a second corner above and right of the first";
            found.add("mpm.domain", format!("{:?} m", self.domain), expected, help);
            sound = false;
        }
        if !sound {
            return false;
        }
        for (a, axis) in ["x", "y"].into_iter().enumerate() {
            let exact = size[a] / cell;
            let count = exact.round();
            if count > CELLS_MAX {
                let expected = format!(
                    "a length that cuts mpm.domain into at most {CELLS_MAX:.0e} cells along {axis}"
                );
                let help = format!(
                    "it cuts {} m into {exact:.3e}; make the cell larger or the domain smaller",
                    size[a]
                );
                found.add("mpm.cell", cell, expected, help);
                return false;
            }
            // Decimal lengths are not exact in binary. So a millionth of a cell is rounding, and more is a mistake.
            if count < 1.0 || (exact - count).abs() > 1e-6 {
                let whole = count.max(1.0);
                let help = format!(
                    "end it at {axis} = {} ({whole} cells of {cell} m), or make the cell {} m",
                    lower[a] + whole * cell,
                    size[a] / whole
                );
                let value = format!("{exact:.6} cells long in {axis}");
                found.add("mpm.domain", value, "a whole number of cells", help);
                sound = false;
            }
        }
        sound
    }

    /// Checks the choices of the scheme and their combinations.
    fn transfer_faults(&self, found: &mut Faults<'_>) {
        let splines = [ShapeFunction::QuadraticBspline, ShapeFunction::CubicBspline];
        let mut own = found.at(format!("mpm.transfer.{}", word(&self.transfer)));
        if let Transfer::Blend { pic_fraction } = self.transfer {
            own.share_of_pic(pic_fraction);
        }
        if let Transfer::Xpic { order } | Transfer::FlipXpic { order, .. } = self.transfer {
            own.number("order", f64::from(order), order > 0, "1 (PIC) or more");
        }
        if let Transfer::FlipPic { pic_rate }
        | Transfer::Aflip { pic_rate }
        | Transfer::FlipXpic { pic_rate, .. } = self.transfer
        {
            own.not_negative("pic_rate", pic_rate, "a rate of 0 or more");
        }
        if self.transfer.is_affine() && !splines.contains(&self.shape) {
            let (name, others) = match self.transfer {
                Transfer::Apic => (
                    "apic",
                    "\"flip\", \"pic\" or blend with this shape function",
                ),
                _ => ("aflip", "\"flip\" or flip_pic with this shape function"),
            };
            let help = format!(
                "{name} needs shape = \"quadratic_bspline\" or \"cubic_bspline\": with the others the inertia D_p of \
                 eq. 29 has no inverse at every position"
            );
            found.add("mpm.transfer", format!("\"{name}\""), others, help);
        }
    }

    fn scheme_faults(&self, found: &mut Faults<'_>) {
        self.transfer_faults(found);
        if let Some(GridContact { friction }) = self.grid_contact {
            let key = "mpm.grid_contact.friction";
            found.not_negative(key, friction, "a coefficient of 0 or more");
        }
        let last = self.stress_update == StressUpdate::Usl;
        // Derived in docs/energy.md, "Hats".
        if last && self.shape == ShapeFunction::Linear {
            let help = "usl is unstable with shape = \"linear\" at any step: the acceleration of a node that a point has hardly \
                        reached has no bound, and usl strains the point by it; another way out is \"ugimp\" or a B-spline";
            found.add("mpm.stress_update", "\"usl\"", "\"usavg\"", help);
        }
        // Measured: they gain energy within tens of steps, the more quickly the shorter they are; with B-splines they do
        // not (docs/results/verification.md).
        let by_contact = last || self.stress_update == StressUpdate::Usavg;
        if by_contact && self.grid_contact.is_some() && self.shape == ShapeFunction::Ugimp {
            let help = "usl and usavg are unstable with grid_contact and shape = \"ugimp\": take a B-spline";
            found.add("mpm.shape", "\"ugimp\"", "\"quadratic_bspline\"", help);
        }
        let shares =
            |m: &MaterialConfig| matches!(&m.model, MaterialModel::MuI(m) if m.volume_rate > 0.0);
        if self.stress_update != StressUpdate::Usf && self.materials.iter().any(shares) {
            let help =
                "volume_rate mixes volumes into the strain where the stress is updated first";
            let wrong = format!("{:?}", self.stress_update).to_lowercase();
            found.add("mpm.stress_update", format!("\"{wrong}\""), "\"usf\"", help);
        }
        if self.contact_force == ContactForceScheme::Traction && self.shape == ShapeFunction::Linear
        {
            let help = "traction spreads a force over the point's box, which reaches nodes that get no mass from a linear \
                        shape function; another way out is shape = \"ugimp\" or a B-spline";
            found.add(
                "mpm.contact_force",
                "\"traction\"",
                "\"point\" or \"nearest_nodes\"",
                help,
            );
        }
        let mut materials = self.materials.iter();
        let plastic = materials.find(|m| !m.model.takes_plane_stress());
        if let (Plane::Stress, Some(material)) = (self.plane, plastic) {
            let help = format!(
                "stress is possible with linear_elastic and hypoelastic only; \"{}\" needs the stress out of plane",
                material.name
            );
            found.add("mpm.plane", "\"stress\"", "\"strain\"", help);
        }
    }

    fn wall_faults(&self, found: &mut Faults<'_>) {
        let walls = self.walls.by_axis();
        for (name, wall) in walls.as_flattened() {
            if let Wall::Friction { coefficient: mu } = *wall {
                let key = format!("mpm.walls.{name}.friction.coefficient");
                found.not_negative(key, mu, "a coefficient of 0 or more");
            }
        }
        for axis in 0..2 {
            self.driven_faults(found, walls[axis], walls[1 - axis], axis);
        }
        for [(one, a), (two, b)] in walls {
            let periodic = [a, b].map(|wall| wall == Wall::Periodic);
            if periodic[0] != periodic[1] {
                let help = format!(
                    "only one of the walls {one} and {two} is periodic; make both periodic or neither"
                );
                let key = format!("mpm.walls.{}", if periodic[0] { two } else { one });
                found.add(key, "not periodic", "the same as the opposite wall", help);
            }
        }
    }

    /// Refuses what cannot be combined with walls at both ends of `axis` that move along themselves.
    fn driven_faults(
        &self,
        found: &mut Faults<'_>,
        ends: [(&str, Wall); 2],
        across: [(&str, Wall); 2],
        axis: usize,
    ) {
        for (name, wall) in ends {
            let Wall::Driven { speed } = wall else {
                continue;
            };
            let key = format!("mpm.walls.{name}.driven.speed");
            found.number(key, speed, true, "a velocity along the wall");
            // The later passes of the filter act on what is left of the velocities, for which the walls would have to
            // be at rest.
            if self.transfer.filters() {
                let help = format!("xpic does not support the moving wall {name}: use flip");
                found.add("mpm.transfer", "xpic", "another transfer", help);
            }
            // Damping slows a point in the frame of the domain, its mirror image in that of the wall.
            let stages = self.forcing.stages.iter().enumerate();
            for (s, stage) in stages.filter(|(_, stage)| stage.damping > 0.0) {
                let key = format!("mpm.stage.{s}.damping");
                let help = format!(
                    "damping slows the material to rest, while the wall {name} moves it: leave it out"
                );
                found.add(key, stage.damping, "0", help);
            }
            for (other, wall) in across {
                if !matches!(wall, Wall::Periodic | Wall::Open) {
                    let help = format!(
                        "the wall {name} moves along itself and would push material into the wall {other}"
                    );
                    let key = format!("mpm.walls.{other}");
                    let expected = "\"periodic\" or \"open\"";
                    found.add(key, "a closed wall", expected, help);
                }
            }
            // With four cells or more, a node is beyond at most one of the two walls.
            let cells = (self.domain[1][axis] - self.domain[0][axis]) / self.cell;
            if cells < 3.5 {
                let value = format!("{cells:.0} cells from the wall {name} to the opposite wall");
                let help = "a moving wall needs 4 cells between it and the opposite wall";
                found.add("mpm.domain", value, "4 cells or more", help);
            }
        }
    }

    fn material_faults(&self, found: &mut Faults<'_>) {
        for (i, material) in self.materials.iter().enumerate() {
            let mut found = found.at(format!("mpm.material.{i}"));
            found.positive("density", material.density, "a density above 0");
            material.model.look(&mut found.at("model"));
        }
    }

    fn group_faults(&self, found: &mut Faults<'_>, group: &GroupConfig, grid_is_sound: bool) {
        if group.material >= self.materials.len() {
            let expected = format!("one of {} materials, counted from 0", self.materials.len());
            let help = format!("there is no material number {}", group.material);
            found.add("material", group.material, expected, help);
        }
        found.finite("velocity", &group.velocity);
        if let Some(r) = group.contact_radius {
            found.positive("contact_radius", r, "a length above 0");
        }
        self.spin_faults(found, group);
        let spacing_is_sound = group.spacing_faults(&mut found.at("spacing"));
        let fill_is_sound = group.fill_faults(&mut found.at("fill"));
        if grid_is_sound && fill_is_sound {
            self.outside_faults(found, group);
            if spacing_is_sound {
                self.box_faults(found, group);
            }
        }
    }

    /// Refuses what cannot be combined with nodes that get the spin of the group.
    fn spin_faults(&self, found: &mut Faults<'_>, group: &GroupConfig) {
        if !group.keeps_spin {
            return;
        }
        let help = match self.transfer {
            Transfer::Apic | Transfer::Aflip { .. } => {
                "apic already transfers the spin of each point: leave it out"
            }
            Transfer::Xpic { .. } | Transfer::FlipXpic { .. } => {
                "xpic filters velocities: use transfer = \"flip\""
            }
            _ if self.walls.periodic().contains(&true) => {
                "a group that crosses periodic walls has no centre of rotation: leave it out"
            }
            _ => return,
        };
        found.add("keeps_spin", "true", "false", help);
    }

    /// Refuses a region that reaches out of the domain. Over a periodic wall it may reach, by at most one period.
    fn outside_faults(&self, found: &mut Faults<'_>, group: &GroupConfig) {
        let [lower, upper] = group.fill.bounds();
        let [low, high] = self.domain;
        let periodic = self.walls.periodic();
        let outside = |a: usize| {
            let size = high[a] - low[a];
            if periodic[a] {
                upper[a] - lower[a] > size || lower[a] < low[a] - size || upper[a] > high[a] + size
            } else {
                lower[a] < low[a] || upper[a] > high[a]
            }
        };
        if outside(0) || outside(1) {
            let value = format!("from {lower:?} to {upper:?} m, outside of `mpm.domain`");
            let expected = format!("a region within {low:?} to {high:?} m");
            let help = "enlarge the domain or move the points";
            found.add("fill", value, expected, help);
        }
    }

    /// Checks how many boxes fill the region, and whether they are too wide for the shape function.
    fn box_faults(&self, found: &mut Faults<'_>, group: &GroupConfig) {
        let sides = group.box_sides(self.cell);
        let [lower, upper] = group.fill.bounds();
        let boxes = match &group.fill {
            Fill::Points { positions } => positions.len() as f64,
            _ => (upper[0] - lower[0]) / sides[0] * ((upper[1] - lower[1]) / sides[1]),
        };
        if boxes > POINTS_MAX {
            let value = format!("so small that `fill` needs about {boxes:.1e} points");
            let expected = format!("at most {POINTS_MAX:.0e}");
            found.add("spacing", value, expected, "use a larger spacing or cell");
        }
        // The centre of a disc is a corner of the lattice and not a point, so a small disc may get no point.
        let empty = match group.fill {
            Fill::Disc { radius, .. } if group.lattice == Lattice::Grid => {
                radius * radius < 0.5 * sides[0] * sides[0]
            }
            _ => false,
        };
        if empty {
            let value = format!(
                "a region that holds no points at a spacing of {} m",
                sides[0]
            );
            let expected = "a region that is wider than the spacing";
            found.add("fill", value, expected, "use a smaller spacing");
        }
        let widest = sides[0].max(sides[1]);
        if widest <= self.cell * (1.0 + 1e-9) {
            return;
        }
        let wide = format!("{widest} m from point to point");
        let expected = format!("at most the cell of {} m", self.cell);
        if self.shape == ShapeFunction::Ugimp {
            let help = "ugimp needs boxes no wider than a cell: use more points";
            found.add("spacing", wide, expected, help);
        } else if self.contact_force == ContactForceScheme::Traction {
            let help = "contact_force = \"traction\" needs boxes no wider than a cell: use more points, or \"point\"";
            found.add("spacing", wide, expected, help);
        }
    }

    fn forcing_faults(&self, found: &mut Faults<'_>) {
        for (i, traction) in self.forcing.tractions.iter().enumerate() {
            let mut found = found.at(format!("mpm.traction.{i}"));
            found.finite("force", &traction.force);
            self.set_faults(&mut found, &traction.points, traction.within);
        }
        for (i, hold) in self.forcing.holds.iter().enumerate() {
            self.hold_faults(&mut found.at(format!("mpm.hold.{i}")), hold);
        }
        self.stage_faults(found);
        for (i, probe) in self.probes.iter().enumerate() {
            let mut found = found.at(format!("mpm.probe.{i}"));
            self.set_faults(&mut found, &probe.points, probe.within);
        }
    }

    fn hold_faults(&self, found: &mut Faults<'_>, hold: &Hold) {
        self.set_faults(found, &hold.points, hold.within);
        if !hold.hold_x && !hold.hold_y {
            let (value, expected) = ("false, and so is `hold_y`", "a direction to hold");
            let help = "write `hold_x = true`, `hold_y = true` or both";
            found.add("hold_x", value, expected, help);
        }
        let help = if self.grid_contact.is_some() {
            "contact on the grid would move held points: leave one of them out"
        } else if self.transfer.filters() {
            "xpic filters velocities: use another transfer"
        } else {
            return;
        };
        found.add("", "held points", "none", help);
    }

    /// Refuses a set of points of no group, and a region `[lower left, upper right]` that is empty or not finite.
    fn set_faults(&self, found: &mut Faults<'_>, points: &str, within: [[f64; 2]; 2]) {
        let known: Vec<&str> = self.groups.iter().map(|group| &*group.name).collect();
        if !known.contains(&points) {
            let help = format!("known: {}", known.join(", "));
            let expected = "the name of a group of points";
            found.add("points", format!("\"{points}\""), expected, help);
        }
        let [lower, upper] = within;
        if !(0..2).all(|a| lower[a] <= upper[a]) {
            let value = format!("{within:?} m");
            let expected = "a second corner above and right of the first";
            let help = "write [[x_min, y_min], [x_max, y_max]]";
            found.add("within", value, expected, help);
        }
    }

    fn stage_faults(&self, found: &mut Faults<'_>) {
        let blends = matches!(self.transfer, Transfer::Flip | Transfer::Blend { .. });
        let mut before = f64::NEG_INFINITY;
        for (i, stage) in self.forcing.stages.iter().enumerate() {
            let mut found = found.at(format!("mpm.stage.{i}"));
            let from = stage.from;
            if found.not_negative("from", from, "a time of 0 or more") && from <= before {
                let expected =
                    format!("a time after {before} s, at which the stage before it begins");
                found.add("from", from, expected, "order stages by their beginning");
            }
            before = from;
            found.not_negative("damping", stage.damping, "a rate of 0 or more");
            if let Some(a) = stage.pic_fraction {
                found.share_of_pic(a);
                if !blends {
                    let help = "it has no meaning for this transfer: use transfer = \"flip\" or transfer.blend";
                    found.add("pic_fraction", a, "nothing", help);
                }
            }
        }
    }
}

impl Faults<'_> {
    /// Refuses a share of PIC that is none.
    fn share_of_pic(&mut self, share: f64) {
        let holds = (0.0..=1.0).contains(&share);
        self.number("pic_fraction", share, holds, "0 (FLIP) to 1 (PIC)");
    }
}

impl MpmConfig {
    /// Whether a place (m) in the domain is in a region, which may reach over periodic walls: the rest of it is at the other end.
    pub fn is_within(&self, x: [f64; 2], [low, high]: [[f64; 2]; 2]) -> bool {
        let [first, last] = self.domain;
        let periodic = self.walls.periodic();
        (0..2).all(|a| {
            let round = if periodic[a] { last[a] - first[a] } else { 0.0 };
            let mut places = [x[a], x[a] - round, x[a] + round].into_iter();
            places.any(|x| low[a] <= x && x <= high[a])
        })
    }

    /// The velocity with which points move. If strains are computed from the velocities of the nodes after the kick, points have
    /// to move with the same velocities. Contact on the grid acts on nodes and not on single points.
    pub fn drift(&self) -> Drift {
        if self.stress_update == StressUpdate::Usl || self.grid_contact.is_some() {
            Drift::Nodal
        } else {
            Drift::Mapped
        }
    }
}

impl GroupConfig {
    /// Checks the spacing; returns whether it is a usable number.
    fn spacing_faults(&self, found: &mut Faults<'_>) -> bool {
        let before = found.count();
        match self.spacing {
            Spacing::PerCell(n) => {
                let root = f64::from(n).sqrt().round();
                if n == 0 || root * root != f64::from(n) {
                    let near = root.max(1.0);
                    let help = format!("use {} or {}", near * near, (near + 1.0) * (near + 1.0));
                    let expected = "the square of a whole number: 1, 4, 9, 16, ...";
                    found.add("per_cell", n, expected, help);
                }
            }
            Spacing::Distance(d) => {
                found.positive("distance", d, "a length above 0");
            }
            Spacing::Counts(counts) => {
                let value = format!("{counts:?}");
                if !matches!(self.fill, Fill::Rectangle { .. }) {
                    let help =
                        "`counts` is for rectangles; use `spacing.per_cell` or `spacing.distance`";
                    found.add("counts", &value, "a rectangle to count along", help);
                }
                if counts.contains(&0) {
                    found.add("counts", value, "two numbers of 1 or more", "");
                }
            }
        }
        found.count() == before
    }

    /// Checks the region; returns whether it can be filled.
    fn fill_faults(&self, found: &mut Faults<'_>) -> bool {
        let before = found.count();
        let finite = |points: &[[f64; 2]]| points.as_flattened().iter().all(|x| x.is_finite());
        match &self.fill {
            Fill::Disc { center, radius } => {
                found.finite("disc.center", center);
                found.positive("disc.radius", *radius, "a length above 0");
            }
            Fill::Ring {
                center,
                radius,
                inner,
            } => {
                found.finite("ring.center", center);
                found.positive("ring.radius", *radius, "a length above 0");
                let hole = *inner > 0.0 && inner < radius;
                let expected = "a length above 0 and below the outer radius";
                found.number("ring.inner", *inner, hole, expected);
            }
            Fill::Rectangle { lower, upper } => {
                if !finite(&[*lower, *upper]) || !(0..2).all(|a| lower[a] < upper[a]) {
                    let value = format!("from {lower:?} to {upper:?} m");
                    let expected = "a rectangle whose `upper` is above and right of `lower`";
                    found.add("rectangle", value, expected, "");
                }
            }
            Fill::Polygon { vertices } => found.polygon("polygon.vertices", vertices),
            Fill::Points { positions } => {
                if positions.is_empty() || !finite(positions) {
                    let value = format!("a list of {} positions", positions.len());
                    let expected = "1 position or more, all finite";
                    found.add("points.positions", value, expected, "");
                }
            }
        }
        found.count() == before
    }
}
