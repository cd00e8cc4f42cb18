//! Constitutive models (PHYSICS.md section 6).
//!
//! A model is a type; its loop is compiled for it. What it needs to remember of a point beyond stress and volume is its
//! [`Material::State`], which is nothing for an elastic solid.

mod drucker_prager;
mod elastic;
mod fluid;
mod hencky;
mod hypoelastic;
mod mohr_coulomb;
mod neo_hookean;
mod perfect_plasticity;
#[cfg(test)]
mod properties;
mod rigid;
#[cfg(test)]
mod single_point;
mod von_mises;

pub use drucker_prager::DruckerPrager;
pub use elastic::{Elastic, Moduli, PlaneStrain, PlaneStress, power};
pub use fluid::Fluid;
pub use hypoelastic::Jaumann;
pub use mohr_coulomb::MohrCoulomb;
pub use neo_hookean::NeoHookean;
pub use rigid::Rigid;
pub use von_mises::VonMises;

use interface::saved::{pack, unpack};
use interface::solver::Refusal;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::kernel::lanes::{LANES, Lanes, ZERO, splat};
use crate::kernel::shape::Shape;
use crate::pass::stress::{StressPass, update_tiles};
use crate::state::points::{LaneCopy, Sources, Tile, reorder};
use crate::state::saved::{Bytes, refusal};

/// Stress of four points in Pa.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Stress {
    /// `sigma_xx`.
    pub xx: Lanes,
    /// `sigma_yy`.
    pub yy: Lanes,
    /// `sigma_zz`, out of plane.
    pub zz: Lanes,
    /// `sigma_xy`.
    pub xy: Lanes,
}

/// What every material point has.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Point<P> {
    /// Stress at `t_n`.
    pub stress: Stress,
    /// Volume over initial volume.
    pub volume: Lanes,
    /// What the model remembers besides.
    pub state: P,
}

impl<P: LaneCopy> LaneCopy for Point<P> {
    fn copy_lane(&mut self, to: usize, source: &Self, from: usize) {
        let (a, b) = (&mut self.stress, &source.stress);
        a.xx.copy_lane(to, &b.xx, from);
        a.yy.copy_lane(to, &b.yy, from);
        a.zz.copy_lane(to, &b.zz, from);
        a.xy.copy_lane(to, &b.xy, from);
        self.volume.copy_lane(to, &source.volume, from);
        self.state.copy_lane(to, &source.state, from);
    }
}

/// What happens to four points over an interval: the velocity gradient times its length, `L_ij dt = dv_i/dx_j dt`, in the
/// middle of the interval.
#[derive(Debug, Clone, Copy)]
pub struct Deformation {
    /// `dv_x/dx dt`.
    pub xx: Lanes,
    /// `dv_x/dy dt`.
    pub xy: Lanes,
    /// `dv_y/dx dt`.
    pub yx: Lanes,
    /// `dv_y/dy dt`.
    pub yy: Lanes,
}

impl Deformation {
    /// The gradient with respect to the places in the middle of the interval, from that with respect to those at its end
    /// (`half` = 1/2) or its start (-1/2).
    ///
    /// Points move by `u`; with `A = du/dx_end` and `x_middle = x_end - u/2`,
    /// `du/dx_middle = A (1 - A/2)^-1 = (A - det A/2) / det(1 - A/2)`, and likewise from the start with the other sign.
    /// Strain and spin of the middle make rate forms exact to second order (Hughes and Winget 1980).
    #[inline(always)]
    pub fn in_the_middle(self, half: Lanes) -> Self {
        let Self { xx, xy, yx, yy } = self;
        let one = splat(1.0);
        let half_det = half * (xx * yy - xy * yx);
        let per = one / (one - half * (xx + yy - half_det));
        Self {
            xx: (xx - half_det) * per,
            xy: xy * per,
            yx: yx * per,
            yy: (yy - half_det) * per,
        }
    }

    /// None.
    pub const NOTHING: Self = Self {
        xx: ZERO,
        xy: ZERO,
        yx: ZERO,
        yy: ZERO,
    };
}

/// `exp(trace)` to second order, positive whatever the step: volume after an interval over volume before, where it is
/// integrated as a rate.
#[inline(always)]
fn swelling(trace: Lanes) -> Lanes {
    trace.mul_add(trace.mul_add(splat(0.5), splat(1.0)), splat(1.0))
}

/// Work per initial volume that was lost in an interval, in Pa.
#[derive(Debug, Clone, Copy)]
pub struct Dissipated {
    /// To plastic flow.
    pub plastic: Lanes,
    /// To viscous stress.
    pub viscous: Lanes,
}

impl Dissipated {
    /// Nothing.
    pub const NOTHING: Self = Self {
        plastic: ZERO,
        viscous: ZERO,
    };
}

impl<P> Point<P> {
    /// A point without stress, of its initial volume.
    pub fn unstressed(state: P) -> Self {
        Self {
            stress: Stress {
                xx: ZERO,
                yy: ZERO,
                zz: ZERO,
                xy: ZERO,
            },
            volume: splat(1.0),
            state,
        }
    }
}

/// A constitutive model.
pub trait Material: Copy + Send + Sync + 'static {
    /// What it remembers of four points besides stress and volume.
    type State: LaneCopy + Serialize + DeserializeOwned;

    /// Whether [`Self::update`] can dissipate anything.
    const DISSIPATES: bool;

    /// The state of unstressed points.
    fn initial(&self) -> Point<Self::State>;

    /// The state of points that have this stress (Pa) at the start.
    ///
    /// # Errors
    /// Why the model cannot have it.
    fn prestressed(&self, stress: Stress) -> Result<Point<Self::State>, String> {
        let mut point = self.initial();
        point.stress = stress;
        Ok(point)
    }

    /// Brings stress, volume and state from `t_{n-1}` to `t_n`.
    ///
    /// `per_dt` is one over the length of the interval in 1/s, zero for an interval of no length.
    fn update(
        &self,
        point: &mut Point<Self::State>,
        deformation: &Deformation,
        per_dt: f64,
    ) -> Dissipated;

    /// Upper bound of the squared wave speeds that count for the step: the largest eigenvalue of stiffness times
    /// `diag(1, 1, 2)` in the plane over the density, in m^2/s^2 ([`crate::pass::limits`]).
    fn stiffness_over_density(&self, point: &Point<Self::State>) -> Lanes;

    /// Largest eigenvalue of the viscous stiffness over the initial density in m^2/s.
    fn viscosity_over_density(&self) -> f64 {
        0.0
    }

    /// Elastic energy per initial volume in Pa.
    fn elastic_energy(&self, point: &Point<Self::State>) -> Lanes;

    /// Largest wave speed of the undeformed material in m/s (Jiang 2020 eq. 51).
    fn sound_speed(&self) -> f64;
}

/// The material side of a cloud, whatever the model: called once in a pass, never within a loop over points.
pub trait Constitutive<const W: usize, S: Shape<W>>: Send + Sync {
    /// Stress at `t_n` and internal forces of all tiles (eqs. 13, 21 to 25).
    fn update(&mut self, pass: StressPass<'_, W, S>);

    /// Elastic energy per initial volume of a lane's point in Pa.
    fn energy_of(&self, lane: usize) -> f64;

    /// Elastic energy in J/m of the points of `tile`, each of initial volume `volume` (m^2).
    fn elastic_energy(&self, tile: &Tile, volume: f64) -> f64;

    /// Follows the points to their new places.
    fn reorder(&mut self, sources: &Sources);

    /// Largest wave speed of the undeformed material in m/s.
    fn sound_speed(&self) -> f64;

    /// Gives one lane an initial stress `xx, yy, zz, xy` in Pa.
    ///
    /// # Errors
    /// Why the model cannot have it.
    fn prestress(&mut self, lane: usize, stress: [f64; 4]) -> Result<(), String>;

    /// Stress `xx, yy, zz, xy` (Pa) of a lane's point, and its volume over the initial one.
    fn strained(&self, lane: usize) -> ([f64; 4], f64);

    /// Whether a point's volume has vanished or turned inside out.
    fn collapsed(&self, lane: usize) -> bool;

    /// `viscosity_over_density` of the model in m^2/s.
    fn viscosity_over_density(&self) -> f64;

    /// `stiffness_over_density` of the undeformed material in m^2/s^2.
    fn initial_stiffness(&self) -> f64;

    /// Bytes of memory in use.
    fn bytes(&self) -> usize;

    /// Stress, volume and state of all blocks, in their order.
    fn save(&self) -> Bytes;

    /// Takes over what [`Self::save`] gave of `blocks` blocks.
    ///
    /// # Errors
    /// A [`Refusal`] of bytes that are not that.
    fn restore(&mut self, saved: &Bytes, blocks: usize) -> Result<(), Refusal>;
}

/// The mark of the bytes of [`Constitutive::save`].
const SAVED: &str = "material";

/// The points of a cloud as its model sees them.
pub struct MaterialPoints<M: Material> {
    model: M,
    points: Vec<Point<M::State>>,
    scratch: Vec<Point<M::State>>,
}

impl<M: Material> MaterialPoints<M> {
    /// `blocks` blocks of unstressed points.
    pub fn new(model: M, blocks: usize) -> Self {
        Self {
            model,
            points: vec![model.initial(); blocks],
            scratch: Vec::new(),
        }
    }
}

impl<const W: usize, S: Shape<W>, M: Material> Constitutive<W, S> for MaterialPoints<M> {
    fn update(&mut self, pass: StressPass<'_, W, S>) {
        update_tiles(&self.model, &mut self.points, pass);
    }

    fn elastic_energy(&self, tile: &Tile, volume: f64) -> f64 {
        (0..tile.blocks)
            .map(|b| {
                let energy = self.model.elastic_energy(&self.points[tile.first + b]);
                crate::kernel::lanes::sum(energy * tile.live(b))
            })
            .sum::<f64>()
            * volume
    }

    fn energy_of(&self, lane: usize) -> f64 {
        let energy = self.model.elastic_energy(&self.points[lane / LANES]);
        energy.as_array()[lane % LANES]
    }

    fn reorder(&mut self, sources: &Sources) {
        reorder(&mut self.points, &mut self.scratch, sources);
    }

    fn sound_speed(&self) -> f64 {
        self.model.sound_speed()
    }

    fn prestress(&mut self, lane: usize, stress: [f64; 4]) -> Result<(), String> {
        let [xx, yy, zz, xy] = stress.map(splat);
        let point = self.model.prestressed(Stress { xx, yy, zz, xy })?;
        self.points[lane / LANES].copy_lane(lane % LANES, &point, 0);
        Ok(())
    }

    fn strained(&self, lane: usize) -> ([f64; 4], f64) {
        let Point { stress, volume, .. } = &self.points[lane / LANES];
        let of = |lanes: &Lanes| lanes.as_array()[lane % LANES];
        let Stress { xx, yy, zz, xy } = stress;
        ([xx, yy, zz, xy].map(of), of(volume))
    }

    fn collapsed(&self, lane: usize) -> bool {
        let (_, volume) = Constitutive::<W, S>::strained(self, lane);
        volume.is_nan() || volume <= 0.0
    }

    fn viscosity_over_density(&self) -> f64 {
        self.model.viscosity_over_density()
    }

    fn initial_stiffness(&self) -> f64 {
        crate::kernel::lanes::largest(self.model.stiffness_over_density(&self.model.initial()))
    }

    fn bytes(&self) -> usize {
        (self.points.capacity() + self.scratch.capacity()) * size_of::<Point<M::State>>()
    }

    fn save(&self) -> Bytes {
        let Self {
            model: _, // of the configuration
            points,
            scratch: _, // room to sort in
        } = self;
        Bytes(pack(SAVED, points))
    }

    fn restore(&mut self, saved: &Bytes, blocks: usize) -> Result<(), Refusal> {
        let points: Vec<Point<M::State>> = unpack(SAVED, &saved.0)?;
        if points.len() != blocks {
            let text = format!("{} blocks of material for {blocks} of points", points.len());
            return Err(refusal(text));
        }
        self.points = points;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(rows: [[f64; 2]; 2]) -> Deformation {
        let [[xx, xy], [yx, yy]] = rows.map(|row| row.map(splat));
        Deformation { xx, xy, yx, yy }
    }

    fn rows(by: Deformation) -> [[f64; 2]; 2] {
        [[by.xx, by.xy], [by.yx, by.yy]].map(|row| row.map(|x| x.to_array()[0]))
    }

    /// A turn by 1 rad in one interval, and a stretch to twice the length, as seen from both ends: the middle sees no
    /// strain in the one, and in the other the change of length over the mean length.
    #[test]
    fn the_middle_is_the_same_from_both_ends() {
        let (sin, cos) = 1.0_f64.sin_cos();
        let turned = [[cos - 1.0, -sin], [sin, cos - 1.0]]; // R - 1
        let turned_back = [[1.0 - cos, -sin], [sin, 1.0 - cos]]; // 1 - R^T
        let spin = 2.0 * 0.5_f64.tan();
        let stretched = [[1.0, 0.0], [0.0, 0.0]];
        let stretched_back = [[0.5, 0.0], [0.0, 0.0]];
        for (at_start, at_end, middle) in [
            (turned, turned_back, [[0.0, -spin], [spin, 0.0]]),
            (stretched, stretched_back, [[2.0 / 3.0, 0.0], [0.0, 0.0]]),
        ] {
            for (rows_of, half) in [(at_start, -0.5), (at_end, 0.5)] {
                let found = rows(gradient(rows_of).in_the_middle(splat(half)));
                for (found, middle) in found.as_flattened().iter().zip(middle.as_flattened()) {
                    assert!((found - middle).abs() < 1e-15, "{half}: {found} {middle}");
                }
            }
        }
    }
}
