//! The faults of a configuration of the bodies. The coupler's scene reader and the solver both call this, so that
//! `tandem check` refuses what `tandem run` would refuse.

use super::capability::word;
use super::fault::{ConfigFault, Faults};
use super::laws::Between;
use super::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion, OverlapMeasure};

impl DemConfig {
    /// All values that no bodies' solver could accept, in the order of the configuration.
    pub fn faults(&self) -> Vec<ConfigFault> {
        Faults::all(|found| self.look(found))
    }

    fn look(&self, found: &mut Faults<'_>) {
        found.finite("gravity", &self.gravity);
        for (i, body) in self.bodies.iter().enumerate() {
            body.look(&mut found.at(format!("dem.body.{i}")));
        }
        let points = Between::PointsAndBodies;
        // Without points or without bodies the law may have no stiffness: nothing is in contact by it.
        let is_used = !self.point_surfaces.is_empty() && !self.bodies.is_empty();
        if self.has_point_law() && (is_used || self.point_contact != ContactLaw::default()) {
            self.point_contact.look(&mut found.at("contact"), points);
        }
        if let Some(law) = &self.body_contact {
            law.look(&mut found.at("body_contact"), Between::Bodies);
        }
        self.group_pair_faults(found);
        self.overlap_faults(found);
        let before = found.count();
        self.table_faults(found);
        if found.count() == before {
            for (i, pair) in self.contact_pairs.iter().enumerate() {
                let mut found = found.at(format!("contact_pair.{i}.law"));
                let before = found.count();
                if self.body_pairs().any(|(k, _)| k == i) {
                    pair.law.look(&mut found, Between::Bodies);
                }
                // A pair of both kinds is reported once, by the stricter rules for bodies.
                if found.count() == before && self.point_pairs().any(|(k, _)| k == i) {
                    pair.law.look(&mut found, points);
                }
            }
        }
        if let Some(r) = self.contact_resolution {
            let expected = "above 0, at most 2 (the limit of stability)";
            found.number("dem.contact_resolution", r, r > 0.0 && r <= 2.0, expected);
        }
        let (skin, expected) = (self.skin, "a distance of 0 or more");
        found.number_in("m", "coupling.skin", skin, skin >= 0.0, expected);
        if self.threads == 0 {
            found.add("dem.threads", "0", "1 or more", "");
        }
    }

    /// Finds bodies and laws for which the measure of overlap is not defined.
    fn overlap_faults(&self, found: &mut Faults<'_>) {
        let measure = self.overlap;
        let name = word(&measure);
        if measure == OverlapMeasure::EachEdge {
            self.bare_faults(found);
            return;
        }
        let area = measure == OverlapMeasure::Area;
        for (i, body) in self.bodies.iter().enumerate() {
            let own = &body.name;
            if !body.shape.is_convex() {
                let value = format!("not convex (body \"{own}\")");
                let expected = format!("a convex body, since `dem.overlap` is \"{name}\"");
                let help = "take `dem.overlap = \"each_edge\"`, or a convex body";
                found.add(format!("dem.body.{i}.shape"), value, expected, help);
            } else if area && body.largest_radius() > 0.0 {
                let value = format!("{} m (body \"{own}\")", body.largest_radius());
                let expected =
                    "0, since `dem.overlap = \"area\"` is for polygons with sharp corners";
                let key = format!("dem.body.{i}.sphero_radius");
                found.add(
                    key,
                    value,
                    expected,
                    "drop the radius, or take \"nearest_edge\"",
                );
            }
        }
        let other = |law: &ContactLaw| !matches!(law, ContactLaw::Linear { .. });
        if self.bare_that_touch().is_some()
            && let Some(law) = self.body_laws().find(other)
        {
            let value = format!("`{}`", law.name());
            let expected = "`linear`, since two bodies have no sphero-radius";
            let help = "between sharp corners there is no radius, which the other laws need";
            found.add("body_contact", value, expected, help);
        }
    }

    /// The first body without sphero-radius that moves, where there is another one and bodies touch.
    fn bare_that_touch(&self) -> Option<usize> {
        let is_bare = |body: &BodyConfig| body.largest_radius() == 0.0;
        let moves = |body: &BodyConfig| is_bare(body) && body.motion.yielding() != [0.0; 3];
        let bare = self.bodies.iter().filter(|body| is_bare(body)).count();
        let touch = self.body_contact.is_some() && bare > 1;
        self.bodies.iter().position(moves).filter(|_| touch)
    }

    /// Finds two bodies without a sphero-radius. They would never touch, since the distance of a vertex from an edge is
    /// never below 0.
    fn bare_faults(&self, found: &mut Faults<'_>) {
        if let Some(i) = self.bare_that_touch() {
            let expected = "a radius above 0, since with `dem.overlap = \"each_edge\"` two bodies without one never touch";
            let value = format!("0 m (body \"{}\")", self.bodies[i].name);
            let help = "write a radius, or `dem.overlap = \"nearest_edge\"`";
            found.add(format!("dem.body.{i}.sphero_radius"), value, expected, help);
        }
    }
}

impl BodyConfig {
    /// The sphero-radius in m; of a cluster, the largest radius of its discs.
    pub fn largest_radius(&self) -> f64 {
        let radii = (0..self.shape.vertices().len()).map(|k| self.radius_at(k));
        radii.fold(0.0, f64::max)
    }

    /// Finds the impossible values of the body.
    fn look(&self, found: &mut Faults<'_>) {
        self.shape_faults(found);
        match self.inertia {
            BodyInertia::Mass(m) => {
                found.number_in("kg/m", "mass", m, m > 0.0, "a mass above 0");
            }
            BodyInertia::Density(rho) => {
                let expected = "a density above 0";
                found.number_in("kg/m^3", "density", rho, rho > 0.0, expected);
            }
        }
        found.finite("position", &self.position);
        found.finite("angle", &[self.angle]);
        found.finite("velocity", &self.velocity);
        found.finite("spin", &[self.spin]);
        let moves = self.velocity != [0.0; 2] || self.spin != 0.0;
        if self.motion == Motion::Fixed && moves {
            let value = format!("\"fixed\" (body \"{}\")", self.name);
            let expected = "a motion, since the body has a velocity or a spin";
            let help = "`motion = \"driven\"` moves it with them, under any load";
            found.add("motion", value, expected, help);
        }
        if let Motion::Pushed {
            force: [x, y],
            torque,
            ramp,
            until,
        } = self.motion
        {
            let numbers = [x, y, torque, until.unwrap_or(0.0)];
            found.finite("motion.pushed", &numbers);
            let expected = "a time of 0 or more";
            found.number_in("s", "motion.pushed.ramp", ramp, ramp >= 0.0, expected);
        }
    }

    fn shape_faults(&self, found: &mut Faults<'_>) {
        let a = self.sphero_radius;
        let radius = |found: &mut Faults<'_>, holds: bool, expected: &str| {
            found.number_in("m", "sphero_radius", a, holds, expected);
        };
        match &self.shape {
            BodyShape::Disc => radius(found, a > 0.0, "a disc's radius above 0"),
            BodyShape::Segment { ends } => {
                radius(found, a > 0.0, "a segment's radius above 0");
                found.finite("shape.segment.ends", ends.as_flattened());
                if ends[0] == ends[1] {
                    let (value, expected) = (format!("{ends:?}"), "two different ends");
                    let help = "use `shape = \"disc\"`";
                    found.add("shape.segment.ends", value, expected, help);
                }
            }
            BodyShape::Polygon { vertices } => {
                radius(found, a >= 0.0, "a radius of 0 or more");
                found.polygon("shape.polygon.vertices", vertices);
            }
            BodyShape::Rectangle { width, height } => {
                radius(found, a >= 0.0, "a radius of 0 or more");
                for (name, length) in [("width", *width), ("height", *height)] {
                    let key = format!("shape.rectangle.{name}");
                    found.number_in("m", key, length, length > 0.0, "a length above 0");
                }
            }
            BodyShape::Cluster { centers, radii } => {
                found.finite("shape.cluster.centers", centers.as_flattened());
                if centers.is_empty() {
                    found.add("shape.cluster.centers", "no discs", "one or more", "");
                }
                let mut sorted = centers.clone();
                sorted.sort_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
                if let Some([twice, _]) = sorted.array_windows().find(|[p, q]| p == q) {
                    let value = format!("two discs at {twice:?}");
                    let expected = "a place of its own for each disc";
                    found.add("shape.cluster.centers", value, expected, "");
                }
                if radii.is_empty() {
                    return radius(found, a > 0.0, "a disc's radius above 0");
                }
                let expected = "0, since the discs have `radii`";
                radius(found, a == 0.0, expected);
                if radii.len() != centers.len() {
                    let (value, expected) = (radii.len(), centers.len());
                    let value = format!("{value} radii for {expected} discs");
                    let help = "give one for each of `centers`";
                    found.add("shape.cluster.radii", value, "as many", help);
                }
                for (k, &r) in radii.iter().enumerate() {
                    let key = format!("shape.cluster.radii.{k}");
                    found.number_in("m", key, r, r > 0.0, "a disc's radius above 0");
                }
            }
        }
    }
}

impl BodyShape {
    /// Whether the outline has no reflex corner; a cluster of more than one disc is not convex.
    pub fn is_convex(&self) -> bool {
        let vertices = self.vertices();
        let n = vertices.len();
        let turn = |i: usize| {
            let [a, b, c] = [i, i + 1, i + 2].map(|k| vertices[k % n]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        match self {
            Self::Cluster { .. } => n == 1,
            _ => (0..n).all(|i| turn(i) >= 0.0) || (0..n).all(|i| turn(i) <= 0.0),
        }
    }
}
