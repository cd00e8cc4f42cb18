//! From a configuration to a solver that is ready: checks, filling, and the one choice of shape function, transfer and
//! materials.

use core::ops::Range;

use interface::config::material::Frictional;
use interface::config::{
    ContactForceScheme, MaterialModel, MpmConfig, Plane, ShapeFunction, Transfer as TransferConfig,
};
use interface::solver::{MpmMeasurement, Readiness, Refusal};
use mechanics::fill::{FilledRegion, fill, refuse_overlap};
use mechanics::threads::Threads;

use super::grid::geometry;
use crate::grid_contact::GridContact;
use crate::kernel::lanes::LANES;
use crate::kernel::shape::{CubicBspline, Linear, QuadraticBspline, Shape, Ugimp};
use crate::kernel::tiles::Geometry;
use crate::kernel::transfer::{AffineState, NoSlopes, Slopes, Transfer};
use crate::layers::Layers;
use crate::material::{
    Constitutive, DruckerPrager, Fluid, Granular, Jaumann, Moduli, MohrCoulomb, MuI, NeoHookean,
    PlaneStrain, PlaneStress, Stresses, VonMises, YieldSurface,
};
use crate::pass::gaps::touching;
use crate::pass::sort::sort;
use crate::scheme::Scheme;
use crate::setup::chains::markers;
use crate::setup::fields::Fields;
use crate::setup::notes;
use crate::setup::region::points_within;
use crate::state::contact::Touches;
use crate::state::continuum::{Continuum, ContinuumState};
use crate::state::grid::Grid;
use crate::state::holds::{Hold, Holds};
use crate::state::imps::Imps;
use crate::state::point_set::PointSet;
use crate::state::points::{Cloud, Kind};
use crate::state::settling::Settling;
use crate::state::totals::KickWork;
use crate::state::walls::WallNodes;

/// Builds the solver.
///
/// # Errors
/// A [`Refusal`] that names the key.
pub fn build(config: &MpmConfig) -> Result<(Box<dyn Scheme>, Readiness), Refusal> {
    let parts = Parts::new(config)?;
    let affine = matches!(
        config.transfer,
        TransferConfig::Apic | TransferConfig::Aflip { .. }
    );
    match (config.shape, affine) {
        (ShapeFunction::QuadraticBspline, true) => {
            parts.build::<_, _, Slopes>(|_| QuadraticBspline)
        }
        (ShapeFunction::QuadraticBspline, false) => {
            parts.build::<_, _, NoSlopes>(|_| QuadraticBspline)
        }
        (ShapeFunction::CubicBspline, true) => parts.build::<_, _, Slopes>(|_| CubicBspline),
        (ShapeFunction::CubicBspline, false) => parts.build::<_, _, NoSlopes>(|_| CubicBspline),
        (ShapeFunction::Ugimp | ShapeFunction::Linear, true) => {
            unreachable!("a fault of the configuration")
        }
        (ShapeFunction::Ugimp, false) => {
            let cell = config.cell;
            parts.build::<_, _, NoSlopes>(move |p: &FilledRegion| {
                Ugimp::new(p.sides.map(|s| (0.5 * s / cell).min(0.5)))
            })
        }
        (ShapeFunction::Linear, false) => parts.build::<_, _, NoSlopes>(|_| Linear),
    }
}

/// The parts that do not depend on shape function and transfer.
struct Parts<'a> {
    config: &'a MpmConfig,
    geometry: Geometry,
    points: Vec<FilledRegion>,
    threads: Threads,
    notes: Vec<String>,
}

impl<'a> Parts<'a> {
    fn new(config: &'a MpmConfig) -> Result<Self, Refusal> {
        if let Some(fault) = config.faults().first() {
            return Err(fault.into());
        }
        let geometry = geometry(config);
        let mut notes = Vec::new();
        let mut points = Vec::new();
        for (g, group) in config.groups.iter().enumerate() {
            let key = format!("mpm.points.{g}");
            let mut filled = fill(group, config.cell, &key)?;
            for x in &mut filled.positions {
                *x = geometry.entered(*x); // what reaches over a periodic wall
            }
            points.push(filled);
        }
        let names = config.groups.iter().map(|group| &*group.name);
        notes.extend(notes::areas(names.zip(&points)));
        refuse_overlap(config, &points)?;
        let threads = Threads::new(config.threads, "mpm")
            .map_err(|e| Refusal::new("mpm.threads", format!("{} threads: {e}", config.threads)))?;
        Ok(Self {
            config,
            geometry,
            points,
            threads,
            notes,
        })
    }

    fn build<const W: usize, S: Shape<W>, A: AffineState>(
        self,
        shape: impl Fn(&FilledRegion) -> S,
    ) -> Result<(Box<dyn Scheme>, Readiness), Refusal> {
        let groups = self.config.groups.len();
        let apart = self.config.layers || self.config.grid_contact.is_some();
        let mut continua: Vec<Continuum<W, S, A>> = Vec::new();
        if apart {
            for g in 0..groups {
                continua.push(self.continuum(g..g + 1, &shape)?);
            }
        } else {
            continua.push(self.continuum(0..groups, &shape)?);
        }
        let readiness = self.readiness(&continua);
        let pairs = self.config.group_pairs.clone();
        let on_grid = self
            .config
            .grid_contact
            .map(|c| GridContact::new(c.friction));
        let layers = Layers::new(continua, pairs, on_grid, self.threads);
        Ok((Box::new(layers), readiness))
    }

    /// The continuum of some of the groups, for one thread.
    fn continuum<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        groups: Range<usize>,
        shape: &impl Fn(&FilledRegion) -> S,
    ) -> Result<Continuum<W, S, A>, Refusal> {
        let mut clouds = Vec::new();
        let holds = self.holds(groups.clone())?;
        let before = &self.points[..groups.start];
        let mut first_id = before.iter().map(|p| p.positions.len() as u64).sum();
        for g in groups.clone() {
            let (group, points) = (&self.config.groups[g], &self.points[g]);
            let fields = Fields::new(self.config, g)?;
            let number = clouds.len() as u32;
            let material = &self.config.materials[group.material];
            let blocks = points.positions.len().div_ceil(LANES);
            let model = constitutive(&material.model, material.density, self.config.plane);
            let mut stresses = Stresses::new(&*model, blocks);
            fields.prestress(&*model, &mut stresses, &points.positions)?;
            let shape = shape(points);
            let mut cloud = Cloud::new(
                shape,
                (model, stresses),
                &Kind {
                    mass: material.density * points.box_area(),
                    radius: group.radius(self.config.cell),
                    touching: [0, 1]
                        .map(|a| touching(&shape, a, points.sides[a] / self.geometry.cell)),
                    sides: points.sides,
                    spread: match self.config.contact_force {
                        ContactForceScheme::Point => None,
                        ContactForceScheme::NearestNodes => Some([0.0; 2]),
                        ContactForceScheme::Traction => {
                            Some(points.sides.map(|s| (0.5 * s / self.config.cell).min(0.5)))
                        }
                    },
                    keeps_spin: group.keeps_spin,
                },
                first_id,
                &points.positions,
                &at_rest(fields.velocities(&points.positions)?, number, &holds),
                fields.loads(&points.positions)?,
            );
            fields.set_slopes(&mut cloud, &points.positions);
            clouds.push(cloud);
            first_id += points.positions.len() as u64;
        }
        let radii: Vec<f64> = clouds.iter().map(|cloud| cloud.radius).collect();
        // Layers touch at nodes that move by themselves, so no image may follow another node.
        let mirrors = S::MIRRORED && self.config.grid_contact.is_none();
        let walls = WallNodes::new(&self.config.walls, self.geometry.cells, mirrors);
        let mut continuum = Continuum {
            grid: Grid::new(self.geometry, self.config.gravity, walls),
            configured: self.config.transfer,
            transfer: Transfer::of(self.config.transfer, 0.0),
            imps: Imps {
                skin: self.config.skin,
                markers: markers(self.config, first_id, &radii)?,
                ..Imps::default()
            },
            touches: Touches::default(),
            loaded: Vec::new(),
            state: ContinuumState::default(),
            kick: KickWork::default(),
            measurement: MpmMeasurement::default(),
            leaving: self.config.leaving,
            gone: Vec::new(),
            stress_update: self.config.stress_update,
            drift: self.config.drift(),
            settling: Settling::default(),
            stages: self.config.forcing.stages.clone(),
            damping: None,
            probes: self.probes(groups)?,
            holds: Holds::new(holds),
            threads: Threads::default(),
            clouds,
        };
        sort(&mut continuum);
        Ok(continuum)
    }

    /// The probes of some of the groups, each of which is a cloud of their continuum.
    fn probes(&self, groups: Range<usize>) -> Result<Vec<PointSet>, Refusal> {
        let mut found = Vec::new();
        for (i, probe) in self.config.probes.iter().enumerate() {
            if let Some(cloud) = self.cloud(&groups, &probe.points) {
                let key = format!("mpm.probe.{i}");
                found.push(self.set(i, groups.start, cloud, probe.within, &key)?);
            }
        }
        Ok(found)
    }

    /// The holds of some of the groups, likewise.
    fn holds(&self, groups: Range<usize>) -> Result<Vec<Hold>, Refusal> {
        let mut found = Vec::new();
        for (i, hold) in self.config.forcing.holds.iter().enumerate() {
            if let Some(cloud) = self.cloud(&groups, &hold.points) {
                let key = format!("mpm.hold.{i}");
                found.push(Hold {
                    points: self.set(i, groups.start, cloud, hold.within, &key)?,
                    along: [hold.hold_x, hold.hold_y],
                    impulse: [0.0; 2],
                });
            }
        }
        Ok(found)
    }

    /// Which of these groups has this name, counted from the first of them.
    fn cloud(&self, groups: &Range<usize>, name: &str) -> Option<usize> {
        let of = &self.config.groups[groups.clone()];
        of.iter().position(|group| group.name == name)
    }

    fn set(
        &self,
        number: usize,
        first: usize,
        cloud: usize,
        within: [[f64; 2]; 2],
        key: &str,
    ) -> Result<PointSet, Refusal> {
        let group = first + cloud;
        let positions = &self.points[group].positions;
        Ok(PointSet {
            number,
            cloud: cloud as u32,
            locals: points_within(self.config, group, positions, within, key)?,
        })
    }

    fn readiness<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        continua: &[Continuum<W, S, A>],
    ) -> Readiness {
        let cell = self.geometry.cell;
        let mut ready = Readiness {
            items: 0,
            bytes: 0,
            courant_time: f64::INFINITY,
            mass_min: f64::INFINITY,
            stiffness_max: 0.0,
            notes: self.notes.clone(),
        };
        for continuum in continua {
            ready.bytes += continuum.bytes() as u64;
            for cloud in &continuum.clouds {
                ready.items += cloud.len() as u64;
                ready.mass_min = ready.mass_min.min(cloud.mass);
                ready.courant_time = ready.courant_time.min(cell / cloud.material.wave_speed());
            }
        }
        // Of none there is none.
        for least in [&mut ready.courant_time, &mut ready.mass_min] {
            if !least.is_finite() {
                *least = 0.0;
            }
        }
        ready
    }
}

fn constitutive(model: &MaterialModel, density: f64, plane: Plane) -> Box<dyn Constitutive> {
    let moduli = |bulk, shear| Moduli {
        bulk,
        shear,
        density,
    };
    match *model {
        MaterialModel::LinearElastic(m) => {
            let moduli = moduli(m.bulk_modulus, m.shear_modulus);
            match plane {
                Plane::Strain => Box::new(PlaneStrain(moduli)),
                Plane::Stress => Box::new(PlaneStress(moduli)),
            }
        }
        MaterialModel::Hypoelastic(m) => {
            let moduli = moduli(m.bulk_modulus, m.shear_modulus);
            match plane {
                Plane::Strain => Box::new(Jaumann(PlaneStrain(moduli))),
                Plane::Stress => Box::new(Jaumann(PlaneStress(moduli))),
            }
        }
        MaterialModel::DruckerPrager(m) => sand(DruckerPrager::new(density, &m), &m),
        MaterialModel::MohrCoulomb(m) => sand(MohrCoulomb::new(density, &m), &m),
        MaterialModel::MuI(m) => {
            let model = Granular {
                grains: MuI::new(density, &m),
                critical: None,
                separates: true,
                volume_rate: m.volume_rate,
            };
            Box::new(model)
        }
        MaterialModel::NeoHookean(m) => {
            Box::new(NeoHookean(moduli(m.bulk_modulus, m.shear_modulus)))
        }
        MaterialModel::Fluid {
            bulk_modulus,
            exponent,
            viscosity,
        } => Box::new(Fluid {
            bulk: bulk_modulus,
            exponent,
            viscosity,
            density,
        }),
        MaterialModel::VonMises {
            bulk_modulus,
            shear_modulus,
            yield_stress,
            hardening_modulus,
        } => Box::new(VonMises {
            moduli: moduli(bulk_modulus, shear_modulus),
            yield_stress,
            hardening: hardening_modulus,
        }),
    }
}

/// A frictional material, with its state if it has one.
fn sand<G: YieldSurface>(grains: G, numbers: &Frictional) -> Box<dyn Constitutive> {
    if numbers.is_plain() {
        return Box::new(grains);
    }
    let model = Granular {
        grains,
        critical: numbers.critical_state,
        separates: numbers.separates,
        volume_rate: 0.0,
    };
    Box::new(model)
}

/// `velocities` (m/s) of a cloud's points, of which those that are held are at rest.
fn at_rest(mut velocities: Vec<[f64; 2]>, cloud: u32, holds: &[Hold]) -> Vec<[f64; 2]> {
    for hold in holds.iter().filter(|hold| hold.points.cloud == cloud) {
        for &local in &hold.points.locals {
            for a in (0..2).filter(|&a| hold.along[a]) {
                velocities[local as usize][a] = 0.0;
            }
        }
    }
    velocities
}
