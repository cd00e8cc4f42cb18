//! Volumes that points share with their neighbours, by the `volume_rate` of a material (docs/scene-format.md): towards the mean over
//! the nodes, and at a hundredth of this rate towards the room of the nodes that points fill to more than four fifths.

use interface::config::MaterialModel;

use super::continuum::Reference;
use super::material::RefPoint;
use super::nodes::Node;

fn rate(p: &RefPoint) -> f64 {
    match p.model {
        MaterialModel::MuI(numbers) => numbers.volume_rate,
        _ => 0.0,
    }
}

impl Reference {
    /// What is added to `ln J` of each point over `dt` (s).
    pub(super) fn swellings(&mut self, nodes: &[Node], dt: f64) -> Vec<f64> {
        let mut swellings = vec![0.0; self.points.len()];
        if dt == 0.0 || self.points.iter().all(|p| rate(p) == 0.0) {
            return swellings;
        }
        let (mut means, mut fits) = (vec![0.0; nodes.len()], vec![0.0; nodes.len()]);
        for (n, node) in nodes.iter().enumerate() {
            let (mut initial, mut now) = (0.0, 0.0);
            for p in self.points.iter().filter(|p| rate(p) > 0.0) {
                let s: f64 = node.places.iter().map(|i| self.weight(p, i.at)).sum();
                initial += s * p.volume;
                now += s * p.volume * p.ratio;
            }
            if initial == 0.0 {
                continue;
            }
            means[n] = now / initial;
            let room = self.room(node.at) * self.config.cell * self.config.cell;
            let filled = now / (0.8 * room);
            self.totals.is_doubtful |= (filled - 1.0).abs() < 1e-9;
            fits[n] = if filled > 1.0 {
                room / initial
            } else {
                means[n]
            };
        }
        for (p, swelling) in self.points.iter().zip(&mut swellings) {
            let at_point = |values: &[f64]| -> f64 {
                let of_node = |(node, value): (&Node, &f64)| {
                    let s: f64 = node.places.iter().map(|i| self.weight(p, i.at)).sum();
                    s * value
                };
                nodes.iter().zip(values).map(of_node).sum()
            };
            let share = |rate: f64| 1.0 - (-rate * dt).exp();
            if rate(p) > 0.0 {
                let (mean, fits) = (at_point(&means), at_point(&fits));
                *swelling = share(rate(p)) * (mean / p.ratio).ln()
                    + share(0.01 * rate(p)) * (fits / mean).ln();
            }
        }
        swellings
    }

    /// Cells that belong to a node: half of one for each axis along which it lies on a mirror.
    fn room(&self, node: [i64; 2]) -> f64 {
        let on_mirror = |&(wall, axis, _): &_| self.mirrors(wall, axis);
        let inside = (0..2).all(|a| (0..=self.cells[a]).contains(&node[a]));
        let halves = self.walls_at(node).filter(on_mirror).map(|_| 0.5);
        if inside { halves.product() } else { 1.0 }
    }
}
