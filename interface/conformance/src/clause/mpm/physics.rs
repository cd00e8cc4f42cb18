//! Sections 3 to 9: what a continuum does and says, judged by random cases beside the oracle ([`crate::random`]).

use interface::config::capability::PLASTIC_STRAIN;

use crate::clause::{Clause, clauses};

pub const CLAUSES: &[Clause] = clauses! {
    Must "S-2c" "Ready has the number of points, the mass of the lightest, and the time in which a wave crosses a cell",
        often: "the time of a cell without the shear modulus in the wave's speed; or the mass of a group for that of a point";
    Must "I-8a" "generations count from 1, by 1 for every set, also an empty or the same one",
        often: "a generation that does not rise where the new set is the old one";
    Must "I-1c" "states carry the step, the epoch and their number",
        often: "step or epoch of the step before";
    Must "I-2g" "the ids of a set rise, and it has radius, mass and group of each point",
        often: "ids by slot; or the radius of the cell, not of the group";
    Must "T-1a" "points move by the leapfrog, as their materials, transfer, shape function and walls say", after: &["I-2g"],
        often: "a kick of a whole step where half of two is asked for; or the weights of another shape function or transfer; or \
                walls on the wrong nodes; or stress updated at the other end of the step";
    Must "F-1a" "a force acts in its step, once, at the position of its point", after: &["T-1a"],
        often: "a force that is kept for the next step, or goes to the nearest node; or no couple";
    Must "I-7a" "the set has all points within reach, radius and skin, all inside a body, and those of groups that touch", after: &["F-1a"],
        often: "the distance from a body's vertices, not from its edges; or without its reach, the point's radius or the skin";
    Must "I-6a" "asks for envelopes before points and bodies have used up the skin", after: &["F-1a"],
        often: "only what points have moved, not what bodies have; or the skin without half a radius";
    Must "L-2a" "limits bound the frequency of contact and the speed, and have the smallest radius", after: &["F-1a"],
        often: "the mass of a node where that of a point is asked for; or no tangential stiffness";
    Must "R-1b" "a report counts points, IMPs and sets",
        often: "points counted once for each layer; or sets since the last report";
    Must "R-3e" "mass, motion, extent and contacts of a group are those of its points", after: &["F-1a"],
        often: "velocity at the end of the step, not in its middle; or points that are near counted as contacts";
    Must "N-1a" "every entry of the ledger is what section 9 says", after: &["F-1a"],
        often: "kinetic energy before the kick; or work of one step's force, not of the mean of two; or no impulse of walls and \
                supports";
    Must "R-5a" "with FRAME all points, as they are before the window, before the report", after: &["F-1a"],
        often: "points as they are after the window; or the volume of the start";
    Must "R-5e" "plastic strain is the equivalent one of von Mises' material and the shear strain of sand with a memory",
        needs: &[PLASTIC_STRAIN, "material:von_mises"], after: &["F-1a"],
        often: "the plastic shear strain, not the equivalent one; or its growth, not its sum";
    Must "D-1a" "all points at the end, in order of their ids, of the next step", after: &["F-1a"],
        often: "without the last half kick; or of the step before";
};
