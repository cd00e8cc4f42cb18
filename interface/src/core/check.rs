//! Clauses on the numbers of records: the same function for what is sent and for what is received.

use super::error::{SessionError, broken};
use crate::message::Records;
use crate::message::control::Party;
use crate::message::wire::{ImpForce, ImpInfo, Record, StepHeader};

/// W-1: every number finite, and not negative where it may not be. `clause` is the one that asks for it here.
pub(crate) fn numbers(
    who: Party,
    clause: &'static str,
    step: u64,
    records: Records<'_>,
) -> Result<(), SessionError> {
    records.check().map_err(|(slot, field)| {
        let message =
            format!("{field} of record {slot} is not finite, or negative where it may not be");
        broken(who, clause, step, message)
    })
}

/// The same of one record.
pub(crate) fn number<T: Record>(
    who: Party,
    clause: &'static str,
    step: u64,
    record: &T,
) -> Result<(), SessionError> {
    record.check().map_err(|field| {
        let message = format!("{field} is not finite, or negative where it may not be: {record:?}");
        broken(who, clause, step, message)
    })
}

/// C-4: the header announces as many records as there are.
pub(crate) fn counted(header: &StepHeader, records: Records<'_>) -> bool {
    header.count == records.len() as u64
}

/// I-2: numbers, positive radius and mass, rising ids.
pub(crate) fn set(set: &[ImpInfo], step: u64) -> Result<(), SessionError> {
    numbers(Party::Mpm, "I-2", step, Records::Set(set))?;
    let complain = |message| Err(broken(Party::Mpm, "I-2", step, message));
    if let Some(imp) = set.iter().find(|imp| imp.radius <= 0.0 || imp.mass <= 0.0) {
        return complain(format!("radius and mass must be positive: {imp:?}"));
    }
    if let Some(pair) = set.windows(2).find(|pair| pair[0].id >= pair[1].id) {
        return complain(format!("ids must rise: {} then {}", pair[0].id, pair[1].id));
    }
    Ok(())
}

/// F-4 and F-5: numbers, and the stiffness behind every force.
pub(crate) fn forces(
    header: &StepHeader,
    forces: &[ImpForce],
    step: u64,
) -> Result<(), SessionError> {
    numbers(Party::Dem, "F-4", step, Records::Forces(forces))?;
    number(Party::Dem, "F-4", step, header)?;
    let bare = |f: &ImpForce| f.stiffness == 0.0 && f.force != [0.0; 2];
    if !forces
        .iter()
        .fold(false, |found, force| found | bare(force))
    {
        return Ok(());
    }
    match forces.iter().position(bare) {
        None => Ok(()),
        Some(slot) => {
            let message = format!(
                "slot {slot}: a force without a stiffness: {:?}",
                forces[slot]
            );
            Err(broken(Party::Dem, "F-5", step, message))
        }
    }
}
