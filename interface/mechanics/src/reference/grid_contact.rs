//! Contact of layers on the nodes where more than one has mass (Bardenhagen 2000 eqs. 12 to 24). In the paper the normal of a layer is
//! the gradient of its own density; here it is that of the others' less its own, so that two have the same one, and what of
//! the impulses of three does not cancel is taken from all in proportion to mass.

use nalgebra::Vector2;

use super::continuum::{Kernel, Kicked, Reference, Totals};
use super::nodes::Node;

/// Lets layers that approach at a node go on together, and rub on one another; with what that dissipates.
pub fn meet(layers: &[Reference], kicked: &mut [Kicked], friction: f64) -> Totals {
    let mut taken = Totals::default();
    let books = f64::from(u8::from(layers[0].books_impacts()));
    let slopes: Vec<_> = layers.iter().map(Reference::slopes).collect();
    for n in 0..kicked[0].mass.len() {
        let there: Vec<usize> = (0..layers.len())
            .filter(|l| kicked[*l].mass[n] > 0.0)
            .collect();
        if there.len() < 2 {
            continue;
        }
        let mass: f64 = there.iter().map(|&l| kicked[l].mass[n]).sum();
        let momentum = |&l: &usize| Vector2::from(kicked[l].after[n]) * kicked[l].mass[n];
        let common = there.iter().map(momentum).sum::<Vector2<f64>>() / mass; // v_i
        let slopes: Vec<_> = there.iter().map(|&l| slopes[l][n]).collect();
        let steep: f64 = slopes.iter().map(|(_, whole)| whole).sum();
        let slopes: Vec<_> = slopes.into_iter().map(|(slope, _)| slope).collect();
        let slope: Vector2<f64> = slopes.iter().sum();
        let mut changes = Vec::new();
        for (&l, own) in there.iter().zip(&slopes) {
            let way = slope - own * 2.0;
            taken.is_doubtful |= way.norm() > 0.0 && way.norm() < 1e-6 * steep;
            let normal = way.try_normalize(0.0).unwrap_or_default();
            let relative = Vector2::from(kicked[l].after[n]) - common;
            let approach = relative.dot(&normal).max(0.0); // (12)
            let along = relative - normal * relative.dot(&normal);
            let most = friction * approach; // (22)
            changes.push([-normal * approach, -along.cap_magnitude(most)]); // (14), (23)
        }
        let masses = || there.iter().map(|&l| kicked[l].mass[n]);
        let [press, rub] = [0, 1].map(|k| {
            let each = masses().zip(&changes);
            each.map(|(m, change)| change[k] * m).sum::<Vector2<f64>>() / mass
        });
        for (&l, change) in there.iter().zip(&changes) {
            let (pressed, rubbed) = (change[0] - press, change[1] - rub);
            let of = &mut kicked[l];
            let [before, after] = [of.before[n], of.after[n]].map(Vector2::from);
            let after = after + pressed + rubbed;
            let mean = (before + after) * (0.5 * of.mass[n]);
            taken.pressed -= books * pressed.dot(&mean);
            taken.rubbed -= rubbed.dot(&mean);
            of.met -= (pressed + rubbed).dot(&mean);
            of.after[n] = after.into();
        }
    }
    taken
}

impl Reference {
    /// Gradient of the density at each node, up to a factor, along the walls that hold it: masses are mapped to the middles of cells by
    /// quadratic splines (24). With its size before walls have taken their part; none if only rounding is left.
    fn slopes(&self) -> Vec<(Vector2<f64>, f64)> {
        let spline = |d: f64| Kernel::Quadratic.value(d);
        let mut slopes = vec![Vector2::zeros(); self.nodes.list.len()];
        for p in &self.points {
            for (n, place) in self.seen(p) {
                let d = self.distance(p, place.at);
                let [[left, right], [below, above]] = d.map(|d| [spline(d + 0.5), spline(d - 0.5)]);
                let steps = [
                    (right - left) * (below + above),
                    (left + right) * (above - below),
                ];
                slopes[n] += Vector2::from(steps) * p.mass;
            }
        }
        let nodes = slopes.into_iter().zip(&self.nodes.list);
        let along = |(slope, node): (Vector2<f64>, &Node)| {
            let free = slope.component_mul(&Vector2::from(self.free(node.at)));
            let whole = slope.norm();
            let is_left = free.norm() > 1e-9 * whole;
            (if is_left { free } else { Vector2::zeros() }, whole)
        };
        nodes.map(along).collect()
    }
}
