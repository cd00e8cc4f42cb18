//! The step, as the paper has it (Jiang 2020 section 2.2 and eqs. 46 to 48; PHYSICS.md section 3).

use interface::config::{Drift, StressUpdate};
use interface::message::wire::{ImpForce, Limits};
use interface::solver::Fault;
use interface::step::Step;

use crate::kernel::shape::Shape;
use crate::kernel::transfer::Transfer;
use crate::pass::contact::ContactLoad;
use crate::pass::grid_to_points::grid_to_points;
use crate::pass::points_to_grid::points_to_grid;
use crate::pass::stress::{Standing, StressPass, Velocity};
use crate::state::continuum::Continuum;
use crate::state::points::{LaneCopy, Which};

impl<const W: usize, S: Shape<W>, T: Transfer> Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    /// The first part of a step from `t_n` to `t_{n+1}`: all that needs no contact force. The bodies' side computes
    /// the forces meanwhile.
    ///
    /// # Errors
    /// A [`Fault`] that names the point.
    pub fn predict(&mut self, step: &Step) -> Result<(), Fault> {
        self.damping = self.begin_stage(step.time);
        self.points_to_grid(); //                          m_I, p_I^{n-1/2}, v_I^{n-1/2}        (18) (19) (20) (30)
        self.update_stress_first(step.dt_before); //       D, W, sigma^n, f_I^int               (21) ... (25), (13)
        self.apply_loads(step)?; //                        f_I^ext                              (14)
        Ok(())
    }

    /// The second part, with the forces `f_p^n` of the bodies (46) on the IMPs; empty where there are none.
    ///
    /// # Errors
    /// A [`Fault`] that names the point.
    pub fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        let load = self.move_nodes(step, forces)?;
        self.move_points(step, load)
    }

    /// The nodes take the forces of the bodies and move.
    ///
    /// # Errors
    /// A [`Fault`] that names the point.
    pub fn move_nodes(&mut self, step: &Step, forces: &[ImpForce]) -> Result<ContactLoad, Fault> {
        let load = self.apply_contact(forces)?; //         f_I^cont                             (47)
        self.update_grid(step.kick(), self.damping); //    v_I^{n+1/2}                          (17) (48)
        Ok(load)
    }

    /// The points take the velocities of the nodes and move.
    ///
    /// # Errors
    /// A [`Fault`] that names the point.
    pub fn move_points(&mut self, step: &Step, load: ContactLoad) -> Result<Limits, Fault> {
        self.keep_books(step); //                          impulses; energies if asked for
        if step.dt_before + step.dt > 0.0 {
            self.filter_velocities(); //                   XPIC alone
            self.update_stress_last(step.dt); //           where the scene wants it so
            self.grid_to_points(step.dt)?; //              v_p^{n+1/2}, B_p, x_p^{n+1}          (26) ... (28), (31)
        } // else the opening step: a transfer without a kick would still smooth the velocities
        self.close_books(step);
        let limits = self.limits(load);
        self.remove_left();
        self.keep_sorted();
        Ok(limits)
    }

    /// The stress at `t_n` and its forces. Where it is updated last it is there already.
    fn update_stress_first(&mut self, dt: f64) {
        let strained = match self.stress_update {
            StressUpdate::Usf => Some(dt),
            StressUpdate::Usavg => Some(0.5 * dt),
            StressUpdate::Usl | StressUpdate::Musl => None,
        };
        let standing = match strained {
            Some(_) => Standing::End,
            None => Standing::Start, // as it was strained
        };
        let by = (Velocity::Before, standing);
        self.stress_pass(strained.unwrap_or(dt), by, strained.is_some(), true);
    }

    /// The stress at `t_{n+1}`, from the velocities after the kick: those of the nodes (USL), or those of the points,
    /// mapped to the nodes once more (MUSL; USAVG, on the way to the middle of the step).
    fn update_stress_last(&mut self, dt: f64) {
        let (velocity, dt) = match self.stress_update {
            StressUpdate::Usf => return,
            StressUpdate::Usl => (Velocity::After, dt),
            StressUpdate::Musl => (Velocity::Before, dt),
            StressUpdate::Usavg => (Velocity::Before, 0.5 * dt),
        };
        if velocity == Velocity::Before {
            self.transfer_pass::<true, false>(Which::All, 0.0);
            self.points_to_grid();
        }
        self.stress_pass(dt, (velocity, Standing::Start), true, false);
        self.book_stress_ahead();
    }

    fn grid_to_points(&mut self, dt: f64) -> Result<(), Fault> {
        let mapped = self.drift == Drift::Mapped && !self.loaded.is_empty();
        match self.stress_update {
            // The velocities have been taken, and mapped, before.
            StressUpdate::Musl | StressUpdate::Usavg => {
                self.transfer_pass::<false, true>(Which::All, dt);
            }
            StressUpdate::Usf if mapped => {
                self.look_near_loads();
                self.transfer_pass::<true, false>(Which::NearLoad, 0.0);
                self.map_near_loads();
                self.transfer_pass::<false, true>(Which::NearLoad, dt);
                self.transfer_pass::<true, true>(Which::Elsewhere, dt);
            }
            StressUpdate::Usf | StressUpdate::Usl => {
                self.transfer_pass::<true, true>(Which::All, dt);
            }
        }
        if mapped {
            self.move_loaded_points(dt);
        }
        self.check_points(dt)
    }

    fn points_to_grid(&mut self) {
        let grain = self.grain();
        let (clouds, grid, transfer) = (&mut self.clouds, &mut self.grid, self.transfer);
        self.threads.run(|| {
            for cloud in &mut *clouds {
                points_to_grid(grain, cloud, Which::All);
            }
            grid.sum_momentum(grain, clouds, transfer.pic_fraction());
        });
    }

    fn stress_pass(
        &mut self,
        dt: f64,
        (velocity, standing): (Velocity, Standing),
        strain: bool,
        load: bool,
    ) {
        let grain = self.grain();
        let (clouds, grid) = (&mut self.clouds, &self.grid);
        self.threads.run(|| {
            for cloud in clouds {
                cloud.material.update(StressPass {
                    grain,
                    shape: cloud.shape,
                    dt,
                    per_cell: 1.0 / grid.geometry.cell,
                    volume: cloud.volume,
                    tiles: &cloud.tiles,
                    x: &cloud.x,
                    nodes: &grid.tiles,
                    velocity,
                    standing,
                    strain,
                    load,
                    force: &mut cloud.force,
                    reports: &mut cloud.stress_reports,
                });
            }
        });
    }

    fn update_grid(&mut self, kick: f64, damping: f64) {
        let grain = self.grain();
        let (clouds, grid) = (&self.clouds, &mut self.grid);
        self.threads
            .run(|| grid.update(grain, clouds, kick, damping));
    }

    fn transfer_pass<const KICK: bool, const DRIFT: bool>(&mut self, which: Which, dt: f64) {
        let grain = self.grain();
        let (clouds, grid, transfer) = (&mut self.clouds, &self.grid, self.transfer);
        self.threads.run(|| {
            for cloud in clouds {
                grid_to_points::<W, KICK, DRIFT, S, T>(
                    grain,
                    cloud,
                    which,
                    &grid.tiles,
                    transfer,
                    dt,
                );
            }
        });
    }
}
