//! A model as the passes call it, whatever its type: for a batch of points at a time, never within a loop over points. So the
//! loops over points are compiled once for a model, and those over nodes once for a shape function.

use serde::{Deserialize, Serialize};

use super::elastic::power;
use super::model::Material;
use super::point::{Deformation, Dissipated, Point, Stress};
use crate::kernel::blocks::PointBlock;
use crate::kernel::lanes::{LANES, Lanes, largest, splat, sum};

/// Stress and volume of four points, which every model has.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Stressed {
    /// Stress at `t_n`.
    pub stress: Stress,
    /// Volume over initial volume.
    pub volume: Lanes,
}

impl PointBlock for Stressed {
    const NUMBERS: usize = 5;

    #[inline]
    fn number(&mut self, n: usize) -> &mut Lanes {
        match n {
            0 => &mut self.stress.xx,
            1 => &mut self.stress.yy,
            2 => &mut self.stress.zz,
            3 => &mut self.stress.xy,
            _ => &mut self.volume,
        }
    }
}

impl Stressed {
    /// Stress `xx, yy, zz, xy` (Pa) of one of the four, and its volume over the initial one.
    pub fn of_lane(&self, k: usize) -> ([f64; 4], f64) {
        let of = |lanes: Lanes| lanes.as_array()[k];
        let Stress { xx, yy, zz, xy } = self.stress;
        ([xx, yy, zz, xy].map(of), of(self.volume))
    }
}

/// Four points: stress and volume, and what the model keeps besides.
pub type Block = (Stressed, Vec<Lanes>);

/// What strains a batch of blocks; one item for each of them.
pub struct Straining<'a> {
    /// Deformations.
    pub by: &'a [Deformation],
    /// Further changes of `ln J`, where volumes are shared.
    pub swell: Option<&'a [Lanes]>,
    /// One in lanes with a point, zero in others.
    pub live: &'a [Lanes],
    /// One over the length of the interval in 1/s, zero for an interval of no length.
    pub per_dt: f64,
}

/// Sums over points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    stiffest: Lanes,
    plastic: Lanes,
    viscous: Lanes,
    twice_work: Lanes,
}

impl Sums {
    /// Largest stiffness over density in m^2/s^2.
    pub fn stiffest(&self) -> f64 {
        largest(self.stiffest)
    }

    /// Work per initial volume lost to plastic flow and to viscous stress, and that of the stress, in Pa.
    pub fn works(&self) -> [f64; 3] {
        let work = 0.5 * sum(self.twice_work);
        [sum(self.plastic), sum(self.viscous), work]
    }

    /// Updates four points and counts the dissipated work. The work of an additional `swelling` of `ln J` counts as
    /// viscous work, which may then be negative.
    #[inline(always)]
    fn strain<M: Material>(
        &mut self,
        model: &M,
        point: &mut Point<M::State>,
        (by, swell): (&Deformation, Option<Lanes>),
        per_dt: f64,
        live: Lanes,
    ) {
        let before = point.volume * power(&point.stress, by);
        let dissipated = match swell {
            None => model.update(point, by, per_dt),
            Some(swell) => {
                let half = splat(0.5) * swell;
                let swollen = Deformation {
                    xx: by.xx + half,
                    yy: by.yy + half,
                    ..*by
                };
                let pressed = |point: &Point<M::State>| {
                    point.volume * (point.stress.xx + point.stress.yy) * half
                };
                let before = pressed(point);
                let dissipated = model.update(point, &swollen, per_dt);
                let given = splat(0.5) * (before + pressed(point));
                self.viscous = live.mul_neg_add(given, self.viscous);
                dissipated
            }
        };
        let after = point.volume * power(&point.stress, by);
        self.count::<M>(&dissipated, before + after, live);
    }

    /// The work by the trapezoidal rule is what the leapfrog of nodes and points does to the same stress: the force of t_n
    /// acts over half of the interval behind and half of the one ahead.
    #[inline(always)]
    fn count<M: Material>(&mut self, dissipated: &Dissipated, twice_work: Lanes, live: Lanes) {
        self.twice_work = live.mul_add(twice_work, self.twice_work);
        if M::DISSIPATES {
            self.plastic = live.mul_add(dissipated.plastic, self.plastic);
            self.viscous = live.mul_add(dissipated.viscous, self.viscous);
        }
    }
}

/// A model of any type. Blocks come as a list of [`Stressed`] and one of [`Self::rows`] numbers for each.
pub trait Constitutive: Send + Sync {
    /// How many numbers of each point the model keeps besides stress and volume.
    fn rows(&self) -> usize;

    /// Points without stress.
    fn at_rest(&self) -> Block;

    /// Points with an initial stress `xx, yy, zz, xy` in Pa.
    ///
    /// # Errors
    /// Why the model cannot have it.
    fn under(&self, stress: [f64; 4]) -> Result<Block, String>;

    /// Strains points, and adds their works to the sums.
    fn strain(
        &self,
        points: &mut [Stressed],
        rows: &mut [Lanes],
        by: &Straining<'_>,
        sums: &mut Sums,
    );

    /// Adds the stiffness of points to the sums.
    fn stiffen(&self, points: &[Stressed], rows: &[Lanes], sums: &mut Sums);

    /// Elastic energy per initial volume of four points in Pa.
    fn energy(&self, point: &Stressed, rows: &[Lanes]) -> Lanes;

    /// `plastic_strain` of the model, of four points.
    fn flowed(&self, point: &Stressed, rows: &[Lanes]) -> Lanes;

    /// Largest wave speed of the undeformed material in m/s.
    fn wave_speed(&self) -> f64;

    /// `viscosity_over_density` of the model in m^2/s.
    fn viscosity(&self) -> f64;

    /// `volume_rate` of the model in 1/s.
    fn sharing_rate(&self) -> f64;
}

impl<M: Material> Constitutive for M {
    fn rows(&self) -> usize {
        M::State::NUMBERS
    }

    fn at_rest(&self) -> Block {
        split(self.initial())
    }

    fn under(&self, stress: [f64; 4]) -> Result<Block, String> {
        let [xx, yy, zz, xy] = stress.map(splat);
        Ok(split(self.prestressed(Stress { xx, yy, zz, xy })?))
    }

    fn strain(
        &self,
        points: &mut [Stressed],
        rows: &mut [Lanes],
        by: &Straining<'_>,
        sums: &mut Sums,
    ) {
        let model = &{ *self }; // nothing can change its constants: what they give is computed once a batch
        let swell = by.swell.filter(|_| M::SHARES_VOLUMES);
        let each = points.iter_mut().zip(by.by).zip(by.live).enumerate();
        for (b, ((stressed, deformation), &live)) in each {
            let own = b * M::State::NUMBERS..(b + 1) * M::State::NUMBERS;
            let mut point = join::<M>(stressed, &rows[own.clone()]);
            let by_both = (deformation, swell.map(|swell| swell[b]));
            sums.strain(model, &mut point, by_both, by.per_dt, live);
            (stressed.stress, stressed.volume) = (point.stress, point.volume);
            for (n, row) in rows[own].iter_mut().enumerate() {
                *row = *point.state.number(n);
            }
        }
    }

    fn stiffen(&self, points: &[Stressed], rows: &[Lanes], sums: &mut Sums) {
        for (b, stressed) in points.iter().enumerate() {
            let own = &rows[b * M::State::NUMBERS..(b + 1) * M::State::NUMBERS];
            let stiffness = self.stiffness_over_density(&join::<M>(stressed, own));
            sums.stiffest = sums.stiffest.fast_max(stiffness);
        }
    }

    fn energy(&self, point: &Stressed, rows: &[Lanes]) -> Lanes {
        self.elastic_energy(&join::<M>(point, rows))
    }

    fn flowed(&self, point: &Stressed, rows: &[Lanes]) -> Lanes {
        self.plastic_strain(&join::<M>(point, rows))
    }

    fn wave_speed(&self) -> f64 {
        self.sound_speed()
    }

    fn viscosity(&self) -> f64 {
        self.viscosity_over_density()
    }

    fn sharing_rate(&self) -> f64 {
        self.volume_rate()
    }
}

#[inline(always)]
fn join<M: Material>(point: &Stressed, rows: &[Lanes]) -> Point<M::State> {
    let Stressed { stress, volume } = *point;
    let mut state = M::State::default();
    for (n, row) in rows.iter().enumerate() {
        *state.number(n) = *row;
    }
    Point {
        stress,
        volume,
        state,
    }
}

fn split<P: PointBlock>(point: Point<P>) -> Block {
    let Point {
        stress,
        volume,
        mut state,
    } = point;
    let rows = (0..P::NUMBERS).map(|n| *state.number(n)).collect();
    (Stressed { stress, volume }, rows)
}

/// Stress, volume and further numbers of all points of a cloud: the whole state of its material.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Stresses {
    /// Stress and volume, block by block.
    pub points: Vec<Stressed>,
    /// What the model keeps besides, block by block.
    pub rows: Vec<Lanes>,
}

impl Stresses {
    /// Of `blocks` blocks at rest.
    pub fn new(model: &dyn Constitutive, blocks: usize) -> Self {
        let (point, rows) = model.at_rest();
        Self {
            points: vec![point; blocks],
            rows: rows.repeat(blocks),
        }
    }

    /// Sets one lane to the first of `block`.
    pub fn set(&mut self, lane: usize, block: &Block) {
        let (b, k) = (lane / LANES, lane % LANES);
        let mut point = block.0;
        for n in 0..Stressed::NUMBERS {
            let first = point.number(n).as_array()[0];
            self.points[b].number(n).as_mut_array()[k] = first;
        }
        let rows = self.rows[b * block.1.len()..].iter_mut();
        for (to, from) in rows.zip(&block.1) {
            to.as_mut_array()[k] = from.as_array()[0];
        }
    }

    /// Stress `xx, yy, zz, xy` (Pa) of a lane's point, and its volume over the initial one.
    pub fn of_lane(&self, lane: usize) -> ([f64; 4], f64) {
        self.points[lane / LANES].of_lane(lane % LANES)
    }

    /// A block, and what the model keeps of it.
    pub fn block(&self, model: &dyn Constitutive, b: usize) -> (&Stressed, &[Lanes]) {
        let count = model.rows();
        (&self.points[b], &self.rows[b * count..(b + 1) * count])
    }
}
