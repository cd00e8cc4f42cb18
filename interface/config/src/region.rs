//! Measures of the regions that points fill: bounds, distances of points, the contact radius that follows.

use super::polygon;
use super::{Fill, GroupConfig, InitialFields, Lattice, Spacing};

impl Fill {
    /// Lower left and upper right corner in m.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        match self {
            Self::Disc {
                center: [x, y],
                radius: r,
            }
            | Self::Ring {
                center: [x, y],
                radius: r,
                ..
            } => [[x - r, y - r], [x + r, y + r]],
            Self::Rectangle { lower, upper } => [*lower, *upper],
            Self::Polygon { vertices } => polygon::bounds(vertices),
            Self::Points { positions } => polygon::bounds(positions),
        }
    }

    /// Distance of a place from the outline in m, positive inside; `None` for a list of points, which has no outline.
    pub fn depth(&self, [x, y]: [f64; 2]) -> Option<f64> {
        match self {
            Self::Disc { center, radius } => Some(radius - (x - center[0]).hypot(y - center[1])),
            Self::Ring {
                center,
                radius,
                inner,
            } => {
                let r = (x - center[0]).hypot(y - center[1]);
                Some((radius - r).min(r - inner))
            }
            Self::Rectangle {
                lower: [left, bottom],
                upper: [right, top],
            } => {
                let corners = [
                    [*left, *bottom],
                    [*right, *bottom],
                    [*right, *top],
                    [*left, *top],
                ];
                Some(polygon::depth(&corners, [x, y]))
            }
            Self::Polygon { vertices } => Some(polygon::depth(vertices, [x, y])),
            Self::Points { .. } => None,
        }
    }

    /// Area in m^2; 0 for a list of points, which have none of their own.
    pub fn area(&self) -> f64 {
        match self {
            Self::Disc { radius, .. } => std::f64::consts::PI * radius * radius,
            Self::Ring { radius, inner, .. } => {
                std::f64::consts::PI * (radius * radius - inner * inner)
            }
            Self::Rectangle { lower, upper } => (upper[0] - lower[0]) * (upper[1] - lower[1]),
            Self::Polygon { vertices } => polygon::area(vertices).abs(),
            Self::Points { .. } => 0.0,
        }
    }
}

impl GroupConfig {
    /// Points at rest, of the first material and without fields.
    pub fn at_rest(name: &str, fill: Fill, spacing: Spacing) -> Self {
        Self {
            name: name.into(),
            material: 0,
            fill,
            spacing,
            lattice: Lattice::default(),
            velocity: [0.0; 2],
            fields: InitialFields::default(),
            contact_radius: None,
            keeps_spin: false,
        }
    }

    /// Distance of neighbouring points along x and y that the spacing asks for on a grid of spacing `cell`, in m.
    pub fn distances(&self, cell: f64) -> [f64; 2] {
        match self.spacing {
            Spacing::PerCell(n) => [cell / f64::from(n).sqrt(); 2],
            Spacing::Distance(distance) => [distance; 2],
            Spacing::Counts(counts) => {
                let [lower, upper] = self.fill.bounds();
                [0, 1].map(|a| (upper[a] - lower[a]) / f64::from(counts[a]))
            }
        }
    }

    /// Sides of a point's box in m: the distances, stretched to a whole number along each side of a rectangle; where the
    /// lattice follows an outline, of a square of the same area.
    pub fn box_sides(&self, cell: f64) -> [f64; 2] {
        let distances = self.distances(cell);
        if let Some(following) = self.following(distances[0]) {
            return [following.side(); 2];
        }
        match self.fill {
            Fill::Rectangle { lower, upper } => [0, 1].map(|a| {
                let size = upper[a] - lower[a];
                size / (size / distances[a]).round().max(1.0)
            }),
            _ => distances,
        }
    }

    /// Approximate number of points of the group on a grid of spacing `cell` in m.
    pub fn points_estimate(&self, cell: f64) -> f64 {
        let [dx, dy] = self.distances(cell);
        match (&self.fill, self.spacing) {
            (Fill::Points { positions }, _) => positions.len() as f64,
            (_, Spacing::Counts([nx, ny])) => f64::from(nx) * f64::from(ny),
            (fill, _) => (fill.area() / (dx * dy)).round(),
        }
    }

    /// Contact radius in m on a grid of spacing `cell` in m: that of the configuration, else the default.
    pub fn radius(&self, cell: f64) -> f64 {
        let given = self.contact_radius;
        given.unwrap_or_else(|| self.default_contact_radius(cell))
    }

    /// Contact radius in m of a group whose scene gives none: half the distance of neighbouring points.
    pub fn default_contact_radius(&self, cell: f64) -> f64 {
        let [dx, dy] = self.distances(cell);
        if let Some(following) = self.following(dx) {
            return 0.5 * following.side();
        }
        0.5 * (dx * dy).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(fill: Fill, spacing: Spacing) -> GroupConfig {
        GroupConfig::at_rest("", fill, spacing)
    }

    #[test]
    fn points_are_counted_by_area_number_or_list() {
        let disc = Fill::Disc {
            center: [0.0, 0.0],
            radius: 0.02,
        };
        let n = group(disc, Spacing::PerCell(36)).points_estimate(0.003);
        assert!((n - 5026.0).abs() < 2.0, "{n}");
        let block = Fill::Rectangle {
            lower: [0.0, 0.0],
            upper: [0.1, 0.1],
        };
        let counted = group(block, Spacing::Counts([51, 51]));
        assert_eq!(counted.points_estimate(1.0), 2601.0);
        let [dx, _] = counted.distances(1.0);
        assert!((dx - 0.1 / 51.0).abs() < 1e-15);
    }
}
