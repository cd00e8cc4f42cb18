//! Volumes that points share with their neighbours, by the `volume_rate` of a material (docs/scene-format.md): towards the mean over
//! the nodes, and at a hundredth of this rate towards the room of the nodes that points fill to more than four fifths.

use interface::config::{MaterialModel, Wall};

use super::continuum::Reference;
use super::material::RefPoint;

fn rate(p: &RefPoint) -> f64 {
    match p.model {
        MaterialModel::MuI(numbers) => numbers.volume_rate,
        _ => 0.0,
    }
}

impl Reference {
    /// What is added to `ln J` of each point over `dt` (s).
    pub(super) fn swellings(&mut self, dt: f64) -> Vec<f64> {
        let mut swellings = vec![0.0; self.points.len()];
        if dt == 0.0 || self.points.iter().all(|p| rate(p) == 0.0) {
            return swellings;
        }
        let nodes = &self.nodes.list;
        let own: Vec<usize> = (0..nodes.len()).map(|n| self.within(n)).collect();
        let [mut initial, mut now, mut means, mut fits] = [(); 4].map(|()| vec![0.0; nodes.len()]);
        for p in self.points.iter().filter(|p| rate(p) > 0.0) {
            for (n, place) in self.seen(p) {
                let s = self.weight(p, place.at);
                initial[own[n]] += s * p.volume;
                now[own[n]] += s * p.volume * p.ratio;
            }
        }
        for n in (0..nodes.len()).filter(|n| initial[*n] != 0.0) {
            means[n] = now[n] / initial[n];
            let room = self.room(nodes[n].at) * self.config.cell * self.config.cell;
            let filled = now[n] / (0.8 * room);
            self.totals.is_doubtful |= (filled - 1.0).abs() < 1e-9;
            fits[n] = if filled > 1.0 {
                room / initial[n]
            } else {
                means[n]
            };
        }
        for (p, swelling) in self.points.iter().zip(&mut swellings) {
            let at_point = |values: &[f64]| -> f64 {
                let seen = self.seen(p);
                seen.map(|(n, place)| self.weight(p, place.at) * values[own[n]])
                    .sum()
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

    /// Cells that belong to a node: half of one for each axis along which it lies on a wall that holds points.
    fn room(&self, node: [i64; 2]) -> f64 {
        let half = |(wall, ..): (Wall, _, _)| if holds(wall) { 0.5 } else { 1.0 };
        self.walls_at(node).map(half).product()
    }

    /// The node that is as far within such walls as this one is beyond them.
    fn within(&self, n: usize) -> usize {
        let mut at = self.nodes.list[n].at;
        for (wall, a, out) in self.walls_at(at) {
            if holds(wall) {
                at[a] = if out < 0.0 { 0 } else { 2 * self.cells[a] } - at[a];
            }
        }
        let mut near = self.nodes.around(at.map(|i| i as f64));
        near.find(|(_, image)| image.at == at).map_or(n, |(n, _)| n)
    }
}

/// Whether it holds points within the domain.
fn holds(wall: Wall) -> bool {
    !matches!(wall, Wall::Open | Wall::Periodic)
}
