//! A scene with `thickness`: its masses, forces, stiffnesses and energies are those of a slice. They are divided by the
//! thickness on input, and quantities are multiplied by it on output ([`record::quantity`]). Solvers work per
//! metre and do not know the thickness.

use interface::config::Motion;

use super::problems::Problems;
use super::written::SceneWritten;

/// Divides the numbers of the whole slice by its thickness.
pub(super) fn per_metre(problems: &mut Problems, written: &mut SceneWritten) {
    let Some(thickness) = written.thickness else {
        return;
    };
    problems.above_zero("thickness", thickness, "a length");
    // With a refused thickness, correct numbers would be reported as faults.
    if thickness <= 0.0 {
        return;
    }
    let laws = [&mut written.contact, &mut written.body_contact];
    let laws = laws.into_iter().flatten();
    let pairs = written.contact_pair.iter_mut().map(|pair| &mut pair.law);
    let of_groups = written.group_pair.iter_mut().map(|pair| &mut pair.law);
    for law in laws.chain(pairs).chain(of_groups) {
        *law = law.per_metre(thickness);
    }
    if let Some(mpm) = &mut written.mpm {
        for traction in &mut mpm.traction {
            traction.force = traction.force.map(|f| f / thickness);
        }
    }
    for body in written.dem.iter_mut().flat_map(|dem| &mut dem.body) {
        body.mass = body.mass.map(|mass| mass / thickness);
        if let Motion::Pushed { force, torque, .. } = &mut body.body.motion {
            *force = force.map(|f| f / thickness);
            *torque /= thickness;
        }
    }
}
