//! What a step needs from the contact of the continuum: of its points with bodies or with one another ([`super::points`]),
//! or of the segments between the markers of its boundary with bodies ([`super::segments`]).

use std::fmt::Debug;

use interface::message::wire::{ContactState, ImpForce, ImpInfo, ImpState};
use interface::solver::Refusal;

use crate::body::bodies::Bodies;
use crate::body::load::Load;
use crate::contact::impact::Impacts;
use crate::contact::passage::Passed;
use crate::law::{LastStep, Loss};
use crate::threads::Threads;

/// The intervals before and after `t_n`, as far as contact needs them.
#[derive(Debug, Clone, Copy)]
pub struct Interval {
    /// The interval before.
    pub last_step: LastStep,
    /// Distance in m by which a point and a surface can approach in the interval after. A law whose stiffness grows
    /// with the overlap declares the stiffness that it may then have.
    pub closing: f64,
    /// How contacts that open or close count.
    pub impacts: Impacts<'static>,
}

/// What a step needs from contacts of points, for any law.
pub trait PointSide: Debug + Send {
    /// The set was replaced: slots are now in the order of `set`.
    fn imp_set(&mut self, set: &[ImpInfo]);
    /// The present set.
    fn set(&self) -> &[ImpInfo];
    /// The points are now at `states`. Builds a new list if a pair that is not in the present one could touch.
    fn update_list(&mut self, bodies: &Bodies, states: &[ImpState]);
    /// Evaluates every pair of the list (eqs. 44, 43, 41). Adds the forces on the points slot by slot (eq. 46), and the
    /// same numbers, negated, on the bodies (eqs. 49, 50).
    fn evaluate(
        &mut self,
        bodies: &Bodies,
        states: &[ImpState],
        interval: Interval,
        threads: &Threads,
        forces: &mut [ImpForce],
        loads: &mut [Load],
    );
    /// The first point, in the order of the list, that was too deep in the last evaluation.
    fn passed(&self) -> Option<Passed>;
    /// Energy dissipated over the last step.
    fn loss(&self) -> Loss;
    /// Energy in the contact springs in J/m.
    fn energy(&self, bodies: &Bodies, states: &[ImpState]) -> f64;
    /// Appends the pairs of the last evaluation that press to `found`, in the order of the list.
    fn collect_contacts(
        &self,
        bodies: &Bodies,
        states: &[ImpState],
        last_step: LastStep,
        found: &mut Vec<ContactState>,
    );
    /// Keeps the list that was evaluated.
    fn keep_list(&mut self);
    /// Makes the result of the evaluation the history of the next step, and keeps the list.
    fn commit(&mut self);
    /// Largest damping ratio of a contact in reach; 0 if there is none.
    fn damping_ratio(&self) -> f64;
    /// The bodies move with surface speeds up to `speed` (m/s) for `dt` (s).
    fn advance(&mut self, speed: f64, dt: f64);
    /// Bytes of memory.
    fn bytes(&self) -> usize;
    /// The bytes of its state.
    fn save(&self) -> Vec<u8>;
    /// Restores a saved state, with bodies of the same configuration.
    ///
    /// # Errors
    /// A refusal if the bytes are no state of this configuration.
    fn restore(&mut self, saved: &[u8], bodies: &Bodies) -> Result<(), Refusal>;
}
