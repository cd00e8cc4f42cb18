//! What the step needs from contact between points and bodies, whatever meets what: the points themselves
//! ([`super::points`]) or the segments between the markers of a boundary ([`super::segments`]).

use std::fmt::Debug;

use interface::message::wire::{ContactState, ImpForce, ImpInfo, ImpState};
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::body::displacement::SavedDisplacement;
use crate::body::load::Load;
use crate::contact::passage::Passed;
use crate::contact::set::SavedChain;
use crate::law::history::SavedHistories;
use crate::law::{LastStep, Loss};
use crate::threads::Threads;

/// The intervals around `t_n`, as contact sees them.
#[derive(Debug, Clone, Copy)]
pub struct Interval {
    /// The one behind.
    pub last_step: LastStep,
    /// How far a point and a surface can come together in the one ahead, in m: a law whose stiffness grows with the
    /// overlap declares what it may be by then.
    pub closing: f64,
}

/// What the step needs from the contact between points and bodies, whatever the law.
pub trait PointSide: Debug + Send {
    /// Slots are now ordered as `set`.
    fn imp_set(&mut self, set: &[ImpInfo]);
    /// The present set.
    fn set(&self) -> &[ImpInfo];
    /// Points are at `states`: makes a list anew if a pair that is not in the one that is kept could touch.
    fn update_list(&mut self, bodies: &Bodies, states: &[ImpState]);
    /// Evaluates every pair of the list (eqs. 44, 43, 41) and sums the forces on the points slot by slot (eq. 46) and
    /// the same numbers negated on the bodies (eqs. 49, 50).
    fn evaluate(
        &mut self,
        bodies: &Bodies,
        states: &[ImpState],
        interval: Interval,
        threads: &Threads,
        forces: &mut [ImpForce],
        loads: &mut [Load],
    );
    /// The first point, in the order of the list, that the last evaluation found too far inside a body.
    fn passed(&self, bodies: &Bodies, states: &[ImpState]) -> Option<Passed>;
    /// Energy dissipated over the last step.
    fn loss(&self) -> Loss;
    /// Energy in the contact springs in J/m.
    fn energy(&self, bodies: &Bodies, states: &[ImpState]) -> f64;
    /// Adds the pairs of the last evaluation that press, after `last_step`, to those `found`, in the order of the list.
    fn tell(
        &self,
        bodies: &Bodies,
        states: &[ImpState],
        last_step: LastStep,
        found: &mut Vec<ContactState>,
    );
    /// Keeps the list that was evaluated.
    fn keep_list(&mut self);
    /// Accepts what was evaluated as the history of the next step, and keeps the list.
    fn commit(&mut self);
    /// Largest damping ratio of a contact in reach; 0 where there is none.
    fn damping_ratio(&self) -> f64;
    /// The bodies move on with surface speeds up to `speed` (m/s) for `dt` (s).
    fn advance(&mut self, speed: f64, dt: f64);
    /// Bytes of memory.
    fn bytes(&self) -> usize;
    /// For a saved state.
    fn save(&self) -> SavedPoints;
    /// Takes over what was saved, with bodies of the same configuration. After a refusal all is as it was.
    ///
    /// # Errors
    /// A refusal if it is not of this configuration.
    fn restore(&mut self, saved: &SavedPoints, bodies: &Bodies) -> Result<(), Refusal>;
}

/// Contact with points in a saved state. The list follows from where points and bodies were when it was built.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SavedPoints {
    /// As records of the wire.
    pub(super) set: Vec<u8>,
    pub(super) replaced: Option<Vec<u8>>,
    /// In m.
    pub(super) previous: Vec<[f64; 2]>,
    /// In m.
    pub(super) built_at: Vec<[f64; 2]>,
    pub(super) displacement: SavedDisplacement,
    pub(super) histories: SavedHistories,
    /// Of contact with segments, in place of all but the set.
    pub(super) chain: Option<SavedChain>,
}

impl SavedPoints {
    /// Contact with the segments of a chain of these markers.
    pub fn of_chain(set: Vec<u8>, chain: SavedChain) -> Self {
        Self {
            set,
            chain: Some(chain),
            ..Self::default()
        }
    }
}
