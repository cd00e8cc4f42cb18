//! The capabilities that the solver lists in Hello.

use interface::config::capability::{
    Capabilities, LAYERS, PAIRS, PLASTIC_STRAIN, SAVE, SEGMENTS, STRESS_WORK, members_of,
};
use interface::config::{
    ContactForceScheme, Fill, Lattice, MaterialModel, Plane, ShapeFunction, StressUpdate, Transfer,
    Wall,
};

/// The capabilities beside the choices of a configuration.
const WORDS: [&str; 14] = [
    SAVE,
    LAYERS,
    PAIRS,
    PLASTIC_STRAIN,
    SEGMENTS,
    STRESS_WORK,
    "feature:fields",
    "feature:probes",
    "feature:holds",
    "feature:critical_state",
    "feature:separates",
    "feature:volume_rate",
    "feature:grid_contact",
    "feature:keeps_spin",
];

/// The capabilities of the solver: every variant of every choice, since [`crate::setup::configure`] has an arm for each.
pub fn capabilities() -> Capabilities {
    let mut all = Capabilities::of(&WORDS).0;
    all.extend(members_of::<ShapeFunction>("shape"));
    all.extend(members_of::<Transfer>("transfer"));
    all.extend(members_of::<StressUpdate>("stress_update"));
    all.extend(members_of::<Plane>("plane"));
    all.extend(members_of::<Wall>("wall"));
    all.extend(members_of::<MaterialModel>("material"));
    all.extend(members_of::<ContactForceScheme>("contact_force"));
    all.extend(members_of::<Fill>("fill"));
    all.extend(members_of::<Lattice>("lattice"));
    Capabilities(all)
}
