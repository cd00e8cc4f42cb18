//! Clauses on the numbers of records, checked by who receives them.

use super::error::{SessionError, broken};
use crate::message::Records;
use crate::message::control::Party;
use crate::message::wire::{ImpForce, ImpInfo, Record, StepHeader};

/// W-1: every number is finite, and not negative where it may not be. `clause` is the clause that requires it here.
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

/// The same for one record.
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

/// I-3, F-3: what is wrong with a message of `sent` records, expected to be one for each IMP of the set of this number.
pub(crate) fn not_of_set(
    what: &str,
    header: &StepHeader,
    sent: usize,
    (set, imps): (u64, u64),
) -> Option<String> {
    let is_right = header.set == set && header.count == imps && sent as u64 == imps;
    (!is_right).then(|| {
        let StepHeader {
            set: theirs, count, ..
        } = header;
        format!("{sent} {what} for set {theirs}, {count} announced; expected {imps} for set {set}")
    })
}

/// I-2: finite numbers, positive radius and mass, rising ids.
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

/// I-2, for a side that uses links (W-2): each link leads to another slot of the set.
pub(crate) fn links(set: &[ImpInfo], step: u64) -> Result<(), SessionError> {
    let leads_nowhere = |&(slot, imp): &(usize, &ImpInfo)| {
        imp.next as usize > set.len() || imp.next as usize == slot + 1
    };
    if let Some((slot, imp)) = set.iter().enumerate().find(leads_nowhere) {
        let message = format!(
            "`next` of slot {slot} is {}, expected 0 or the number from 1 to {} of another slot",
            imp.next,
            set.len()
        );
        return Err(broken(Party::Mpm, "I-2", step, message));
    }
    Ok(())
}

/// F-4 and F-5: finite numbers, and a stiffness for every force.
#[expect(
    clippy::needless_bitwise_bool,
    reason = "without branches the compiler tests several forces at once"
)]
pub(crate) fn forces(
    header: &StepHeader,
    forces: &[ImpForce],
    step: u64,
) -> Result<(), SessionError> {
    number(Party::Dem, "F-4", step, header)?;
    let is_bare = |f: &ImpForce| {
        (f.stiffness == 0.0) & ((f.force[0] != 0.0) | (f.force[1] != 0.0))
            | (f.tangential == 0.0) & (f.couple != 0.0)
    };
    // Nearly always all is well, and one pass without branches says so.
    let fault_bits = forces
        .iter()
        .map(|force| force.fault_bits() | u64::from(is_bare(force)) << 63)
        .fold(0, |all, bits| all | bits);
    if fault_bits >> 63 == 0 {
        return Ok(());
    }
    numbers(Party::Dem, "F-4", step, Records::Forces(forces))?;
    let Some(slot) = forces.iter().position(is_bare) else {
        return Ok(());
    };
    let message = format!(
        "slot {slot}: a force without a stiffness: {:?}",
        forces[slot]
    );
    Err(broken(Party::Dem, "F-5", step, message))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "24 forces for set 1, expected 24 for set 1".
    #[test]
    fn a_wrong_count_is_told_with_the_number_that_is_wrong() {
        let header = |set, count| StepHeader {
            count,
            set,
            ..StepHeader::default()
        };
        let fault = |header, sent| not_of_set("forces", &header, sent, (1, 24));
        assert_eq!(fault(header(1, 24), 24), None);
        assert_eq!(
            fault(header(1, 23), 24).as_deref(),
            Some("24 forces for set 1, 23 announced; expected 24 for set 1")
        );
        for (header, sent) in [(header(1, 24), 23), (header(2, 24), 24)] {
            assert!(fault(header, sent).is_some());
        }
    }
}
