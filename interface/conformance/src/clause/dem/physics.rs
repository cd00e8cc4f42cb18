//! Sections 5 to 9: what the bodies do and say, judged by random cases beside the oracle ([`crate::random`]).

use interface::config::capability::CONTACTS;

use crate::clause::{Clause, clauses};

pub const CLAUSES: &[Clause] = clauses! {
    Must "J-1" "mass and inertia follow from the configuration",
        often: "the area without the sphero-radius; or the moment about another place than the centre of mass";
    Must "F-8" "without overlap the force is exactly 0",
        often: "contact that begins at a distance; or springs that outlive an opening";
    Must "F-7" "the force on a point is that of the law, for the positions of this step",
        often: "slip without the body's translation, its rotation or the point's spin; or springs kept by slot, beyond an \
                opening, or one for all bodies; or a force that is capped, or of another step";
    Must "F-5" "stiffness is above 0 where there is a force",
        often: "stiffness of contacts that do not press yet is left out";
    Must "F-6" "stiffness is that of all contacts within reach", after: &["F-7"],
        often: "only contacts that touch are counted, not all within reach; or no tangential stiffness";
    Must "T-1" "bodies move by the leapfrog, as their motion and what touches them say", after: &["J-1", "F-7"],
        often: "a kick of a whole step where half of two is asked for; or drift by the velocity before the kick; or torque of \
                the wrong sign, or spin by the mass";
    Must "F-9" "travel bounds the displacement of every surface", needs: &["motion:free"], after: &["T-1"],
        often: "travel of the centre, without the rotation";
    Must "E-1" "answers a request with outlines of that step";
    Must "F-2" "forces carry step and epoch";
    Must "F-3" "forces carry generation and number of the set";
    Must "E-4" "envelopes hold the bodies, in their order, each with one reach", after: &["T-1"],
        often: "an outline without the sphero-radius";
    Must "R-3" "forces, torques and contacts of each body are those of what touches it", after: &["F-7"],
        often: "torque of the wrong sign, or about another place; or no part of fixed bodies";
    Must "L-2" "limits bound frequencies, damping and speed of the next step", needs: &["motion:free"], after: &["T-1"],
        often: "no lever arm, or no tangential stiffness, in the frequency; or speed without the rotation";
    Must "N-1" "every entry of the ledger is what section 9 says", after: &["T-1"],
        often: "energy of only one of the springs; or work of one step's force, not of the mean of two; or no impulse of \
                supports";
    Must "R-6" "a frame has every contact, with its force and its place", needs: &[CONTACTS], after: &["F-7"];
};
