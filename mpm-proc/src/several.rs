//! Combines the answers of several continua ([`crate::layers`]).

use interface::message::wire::{GroupState, Ledger, Limits};
use interface::solver::MpmMeasurement;

use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;

/// The narrower limits of two.
pub fn narrowest(a: &Limits, b: &Limits) -> Limits {
    Limits {
        omega_sq: a.omega_sq.max(b.omega_sq),
        contact_omega_sq: a.contact_omega_sq.max(b.contact_omega_sq),
        damping: a.damping.max(b.damping),
        speed: a.speed.max(b.speed),
        radius_min: 0.0, // the session adds it
        mobility: a.mobility.max(b.mobility),
    }
}

/// The measurement of all continua: sums, and the records of groups, of probes and of holds, each in the order of the
/// scene.
pub fn measure<'a, const W: usize, S: Shape<W>, A: AffineState>(
    into: &mut MpmMeasurement,
    continua: impl Iterator<Item = &'a Continuum<W, S, A>>,
) {
    let MpmMeasurement { ledger, groups } = into;
    *ledger = Ledger::default();
    groups.clear();
    // Whether each belongs to a probe or a hold, and its index there.
    let mut sets: Vec<((bool, usize), GroupState)> = Vec::new();
    for continuum in continua {
        let of = &continuum.measurement;
        add(ledger, &of.ledger);
        groups.extend_from_slice(&of.groups[..1]);
        let probes = continuum.probes.iter().map(|probe| (false, probe.number));
        let holds = continuum.holds.all.iter();
        let numbers = probes.chain(holds.map(|hold| (true, hold.points.number)));
        sets.extend(numbers.zip(of.groups[1..].iter().copied()));
    }
    sets.sort_by_key(|(number, _)| *number);
    groups.extend(sets.into_iter().map(|(_, state)| state));
}

fn add(sum: &mut Ledger, of: &Ledger) {
    sum.kinetic += of.kinetic;
    sum.elastic += of.elastic;
    sum.gravity += of.gravity;
    sum.friction_work += of.friction_work;
    sum.viscous_work += of.viscous_work;
    sum.plastic_work += of.plastic_work;
    sum.stress_work += of.stress_work;
    sum.driven_work += of.driven_work;
    sum.transfer_work += of.transfer_work;
    sum.contacts += of.contacts;
    sum.angular_momentum += of.angular_momentum;
    sum.applied_moment += of.applied_moment;
    sum.contact_moment += of.contact_moment;
    for a in 0..2 {
        sum.momentum[a] += of.momentum[a];
        sum.applied_impulse[a] += of.applied_impulse[a];
        sum.contact_impulse[a] += of.contact_impulse[a];
        sum.contact_force[a] += of.contact_force[a];
    }
}
