//! Limits the first step if it begins with contacts that open at once.
//!
//! A force of leapfrog acts for half of the step before it and half of the one after it. If a contact opens within a
//! step, its force has acted for too long: with the force `F` and the energy `E` of its spring at the beginning of the
//! step, and surfaces that separate at `u`, it hands over `F u dt/2` instead of `E`. In a motion that began before, the
//! overlap of that last step is at most `u dt`, so the error is of the order of `dt^2`. At the start of a run, or of a
//! branch, any load may meet any velocity: a gate under sand is driven away from its first step on. Then the energy
//! `P dt/2 - E` with the power `P = sum F u` of these contacts appears: four times what the springs had of a gate at
//! 6 m/s (docs/energy.md).
//!
//! So the opening step asks for a step in which the contacts that have energy to give hand over a small part of it: `P dt/2 = E/N`,
//! which is also a bound of what appears, since the forces decrease. If all contacts open in this way, the bound is
//! not reached: `(1/N)^2/4` of the energy appears. The step then grows by a tenth every four steps, as at any start.

use std::collections::BTreeMap;

use interface::Vec2;
use interface::message::wire::ImpState;

use crate::contact::frame_contacts::{POINT, POINTS};
use crate::system::Sdem;

/// The number N of the module's documentation.
const PARTS: f64 = 32.0;
/// Contacts with less than this share of the energy of an impact at their speed are ignored. Otherwise two bodies that
/// only just touch would require an arbitrarily short step.
const NEGLIGIBLE: f64 = 1e-4;

impl Sdem {
    /// Squared frequency in 1/s^2 for which a step of `2 / omega` resolves the contacts that open with the initial
    /// velocities; 0 if there are none. The contacts of the opening step have been evaluated.
    pub(crate) fn release(&self, imps: &[ImpState]) -> f64 {
        let set = self.state.sets.now.iter().zip(imps);
        let points: BTreeMap<u64, _> = set
            .map(|(info, state)| (info.id, (1.0 / info.mass, Vec2::from(state.velocity))))
            .collect();
        // In W/m, and the energy in J/m of an impact at the speeds at which they open.
        let (mut power, mut impact) = (0.0, 0.0);
        for contact in &self.contacts {
            let body = |b: u64| {
                let state = &self.bodies.state[b as usize];
                let arm = Vec2::from(contact.position) - state.center;
                (state.inverse_mass, state.velocity_at(arm))
            };
            let side = |id: u64, is_point: bool| if is_point { points[&id] } else { body(id) };
            let (own_lightness, own) = side(contact.body, contact.with == POINTS);
            let (lightness, other) = side(contact.other, [POINT, POINTS].contains(&contact.with));
            let apart = own - other;
            let given = Vec2::from(contact.force).dot(&apart);
            if given > 0.0 {
                power += given;
                impact += 0.5 * apart.norm_squared() / (own_lightness + lightness);
            }
        }
        if power <= 0.0 {
            return 0.0;
        }
        let [_, energy] = self.contact_energy();
        if energy > NEGLIGIBLE * impact {
            (PARTS * power / energy).powi(2)
        } else {
            0.0
        }
    }
}
