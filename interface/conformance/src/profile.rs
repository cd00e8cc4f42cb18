//! What a solver is judged as: the capabilities that it names in Hello, and named profiles of them.
//!
//! A clause says what it needs ([`crate::clause::Clause::needs`]), so a profile's core follows from the rows: the
//! clauses that need nothing beyond it. Within a clause, scenes are made of what the solver takes.

use interface::config::capability::{Capabilities, OWN_FRICTION};
use interface::message::control::Party::{self, Dem, Mpm};

use crate::clause::{Clause, of};

/// A named set of capabilities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Profile {
    /// Its name.
    pub name: &'static str,
    /// Whose.
    pub party: Party,
    /// What a solver of this profile takes, at least, beyond the profile before it on its side.
    adds: &'static str,
}

const fn profile(party: Party, name: &'static str, adds: &'static str) -> Profile {
    Profile { name, party, adds }
}

/// From the least to the most, side by side: each is judged by all clauses of those before it on its side.
pub const PROFILES: &[Profile] = &[
    profile(Dem, "held", "shape:disc law:linear motion:fixed"),
    profile(Dem, "discs", "motion:free"),
    profile(Dem, "discs+friction", "feature:friction"),
    profile(
        Dem,
        "polygons",
        "shape:segment shape:rectangle shape:polygon",
    ),
    profile(
        Dem,
        "full",
        "motion:driven motion:guided motion:pushed feature:damping feature:body_contact",
    ),
    profile(Dem, "full+save", "save"),
    profile(
        Dem,
        "full+save+laws",
        "law:area law:granular feature:adhesion",
    ),
    profile(Dem, "full+save+laws+contacts", "contacts"),
    profile(Dem, "all", "pairs segments"),
    profile(Mpm, "elastic", "material:linear_elastic"),
    profile(
        Mpm,
        "full",
        "shape:linear transfer:flip wall:open feature:fields stress_work",
    ),
    profile(Mpm, "full+save", "save"),
    profile(Mpm, "full+save+layers", "layers pairs"),
    profile(Mpm, "all", "plastic_strain material:von_mises"),
];

/// The profiles of a side, from the least to the most.
pub fn profiles(party: Party) -> impl Iterator<Item = &'static Profile> {
    PROFILES
        .iter()
        .filter(move |profile| profile.party == party)
}

impl Profile {
    /// What a solver of this profile takes, at least.
    pub fn takes(&self) -> impl Iterator<Item = &'static str> {
        let name = self.name;
        let mut last = false;
        let up_to_it = profiles(self.party)
            .take_while(move |profile| !std::mem::replace(&mut last, profile.name == name));
        up_to_it.flat_map(|profile| profile.adds.split(' '))
    }

    /// What such a solver says in Hello.
    pub fn capabilities(&self) -> Capabilities {
        let mut names: Vec<&str> = self.takes().collect();
        // A family without members is listed too; otherwise it would not be restricted.
        if !names.iter().any(|name| name.starts_with("feature:")) {
            names.push(NO_FEATURE);
        }
        Capabilities::of(&names)
    }

    /// The clauses by which a solver of this profile must be judged.
    pub fn core(&self) -> impl Iterator<Item = &'static Clause> {
        let taken = self.capabilities();
        let clauses = of(self.party).into_iter();
        clauses.filter(move |clause| clause.lacks(&taken).is_empty())
    }
}

/// What a solver can declare as its own.
pub struct Own {
    /// By which it says so.
    pub name: &'static str,
    /// What of it is judged and what not.
    pub what: &'static str,
    /// What scenes need of which not all is judged then, or [`EVERY`].
    pub unjudged: Option<&'static str>,
}

/// Of all scenes.
pub const EVERY: &str = "";

/// All of that.
pub const OWN: [Own; 4] = [
    Own {
        name: OWN_FRICTION,
        what: "friction by a law of its own. Judged: the normal force, Coulomb's bound, opposite forces, motion, limits, no energy \
               from friction, and the same forces in a copy of the run that is shifted, turned, mirrored, in other order and in other \
               windows. Not judged: how large friction is below that bound, and between bodies",
        unjudged: Some("feature:friction"),
    },
    Own {
        name: "feature:impulses",
        what: "impulses between bodies. Not judged: contact between bodies",
        unjudged: Some("feature:body_contact"),
    },
    Own {
        name: "feature:no_inside",
        what: "no inside. Not judged: points on or behind an outline",
        unjudged: None,
    },
    Own {
        name: "feature:no_grid",
        what: "no grid. Not judged: points that meet",
        unjudged: Some(EVERY),
    },
];

/// By which a solver says that it takes no feature at all.
pub const NO_FEATURE: &str = "feature:none";

/// The largest profile that a solver with these capabilities fits: it takes all of it, as far as it says.
pub fn fitting(party: Party, taken: &Capabilities) -> Option<&'static Profile> {
    let fits = |profile: &&Profile| profile.takes().all(|name| taken.meets(name));
    profiles(party).filter(fits).last()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_grow_and_so_do_their_cores() {
        for party in [Party::Dem, Party::Mpm] {
            let all: Vec<_> = profiles(party).collect();
            for pair in all.windows(2) {
                let (less, more) = (pair[0], pair[1]);
                let more_takes = more.capabilities();
                assert!(less.takes().all(|name| more_takes.meets(name)));
                // Random cases have all that a profile takes, so it may be the same clauses that judge it.
                assert!(less.core().count() <= more.core().count(), "{}", more.name);
            }
            assert_eq!(all.last().unwrap().core().count(), of(party).len());
            assert!(all[0].core().count() > 20);
        }
    }

    #[test]
    fn a_solver_without_a_list_has_the_largest_profile() {
        let fit = |names: &[&str]| fitting(Party::Dem, &Capabilities::of(names)).map(|p| p.name);
        assert_eq!(fit(&[]), Some("full"));
        assert_eq!(fit(&["shape:disc"]), Some("discs+friction"));
        assert_eq!(fit(&["shape:disc", NO_FEATURE]), Some("discs"));
        assert_eq!(fit(&["shape:segment"]), None);
    }
}
