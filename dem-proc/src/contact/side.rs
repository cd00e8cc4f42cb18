//! What a step needs from contacts of any kind ([`super::engine`]): of bodies with one another, of points with bodies or
//! with one another, or of the segments between the markers of a boundary with bodies.

use std::fmt::Debug;

use interface::message::wire::{ContactState, ImpForce};
use interface::solver::Refusal;

use crate::body::bodies::Bodies;
use crate::body::load::{Load, PairLoad};
use crate::contact::damping::Damping;
use crate::contact::impact::{Impacts, SurfaceMotion};
use crate::contact::passage::Passed;
use crate::law::Loss;
use crate::lists::now::{Now, Sets};
use mechanics::threads::Threads;

/// The intervals before and after `t_n`, as far as contact needs them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Interval {
    /// Length in s of the interval before, over which the surfaces have moved; 0 before the first step.
    pub last_step: f64,
    /// Distance in m by which two surfaces can approach in the interval after: of bodies, in two steps. Two bodies
    /// within it count in the step limit. A law whose stiffness grows with the overlap declares the stiffness that it
    /// may then have.
    pub closing: f64,
    /// Whether the energy in contact springs and the contacts that press are wanted.
    pub measured: bool,
    /// How contacts of points that open or close count.
    pub impacts: Impacts<'static>,
}

/// The sums to which an evaluation adds.
#[derive(Debug)]
pub struct Targets<'a> {
    /// Forces on points, slot by slot.
    pub forces: &'a mut [ImpForce],
    /// Loads on bodies by points.
    pub by_points: &'a mut [Load],
    /// Loads on bodies by bodies.
    pub by_bodies: &'a mut [PairLoad],
    /// The contacts that press, if the interval is measured, in the order of the list.
    pub contacts: &'a mut Vec<ContactState>,
}

/// What an evaluation finds, over all contacts.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    /// Dissipated over the last step.
    pub loss: Loss,
    /// Energy in J/m in contact springs, if the interval is measured; and of those contacts alone that have more than
    /// none, as adhesion has less.
    pub energy: [f64; 2],
    /// Pairs in reach.
    pub in_reach: usize,
    /// Pairs of bodies that press.
    pub presses: usize,
    /// The largest stiffness in N/m of two bodies that press, if that is needed.
    pub stiffest: f64,
    /// The first pair, in the order of the list, whose overlap is too large.
    pub passed: Option<Passed>,
}

impl Sums {
    /// Adds the energy (J/m) of a contact.
    pub fn hold(&mut self, energy: f64) {
        self.energy[0] += energy;
        self.energy[1] += energy.max(0.0);
    }
}

/// Bodies after the kick, for the step limit.
#[derive(Debug, Clone, Copy)]
pub struct AfterKick<'a> {
    /// The bodies.
    pub bodies: &'a Bodies,
    /// Bounds of their motions.
    pub motions: &'a [SurfaceMotion],
    /// Their velocities, and the data to recognise impacts.
    pub impacts: Impacts<'a>,
    /// The largest spin of a body in rad/s.
    pub spin: f64,
}

/// What a step needs from contacts, for any law.
pub trait Side: Debug + Send + Sync {
    /// Builds a new list if a pair that is not in the present one could touch: two bodies, within two steps.
    fn update_list(&mut self, now: &Now, threads: &Threads);
    /// Evaluates every pair of the list (eqs. 38 to 41, 43, 44). Adds forces and torques, in the order of the list, to
    /// the sums of points (eq. 46) and of bodies (eqs. 39, 40, 49, 50).
    fn evaluate(&mut self, now: &Now, interval: Interval, threads: &Threads, to: &mut Targets);
    /// What the last evaluation found.
    fn sums(&self) -> &Sums;
    /// The largest of these frequencies of bodies in 1/s, 0 if there is none: upper bounds for the pairs in reach, where
    /// one whose contact opens or closes counts as often as [`Impacts::count`] says, and the rates of
    /// [`crate::contact::approach`]. With the largest squared frequency in 1/s^2 of the pairs in reach, counted once.
    fn omega(&self, after: &AfterKick, threads: &Threads) -> [f64; 2];
    /// Constants of its dashpots, 0 if no pair is in reach.
    fn damping(&self) -> Damping;
    /// Makes the result of the evaluation the history of the next step.
    fn commit(&mut self);
    /// The bodies move with surface speeds up to `speed` (m/s) for `dt` (s).
    fn advance(&mut self, speed: f64, dt: f64);
    /// The bytes of its state.
    fn save(&self) -> Vec<u8>;
    /// Restores a saved state, with bodies and sets of the same configuration.
    ///
    /// # Errors
    /// A refusal if the bytes are no state of this configuration.
    fn restore(&mut self, saved: &[u8], bodies: &Bodies, sets: &Sets) -> Result<(), Refusal>;
}
